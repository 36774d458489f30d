"""What modes add to a body, as numbers in the frame of its node: invariants and the shapes of its markers.

The node of a flexible body is the outer frame of its joint while the body is undeformed, axes F at o in the frame of
the body, so that a body that is clamped there needs no transformation but that of the joint. With phi_k and
c = c_0 + phi q in the frame of the body, moments of a mode in that of the node are (docs/theory.md §6, §7)

    C1'_k = Fᵀ C1_k                          int phi_k
    X'_k  = Fᵀ (X_k - C1_k oᵀ) F             int phi_k c_0ᵀ, of which 2C_k and 3C_k = (tr X_k) 1 - X_k are made
    S'_kl = Fᵀ (S_kl - K_t,kl oᵀ) F          int phi_k phi_lᵀ, and what geometric stiffness adds to it
    K_r'  = Fᵀ (K_r - o × K_t)

Numbers that vanish but for rounding are zero here. What counts as rounding is a part of 1e-14 of what an entry can be
at most, by Schwarz's inequality: of C1_k (m M_kk)^(1/2), of X_k (tr P M_kk)^(1/2), of S_kl and 4C_kl
(M_kk M_ll)^(1/2), or of the largest of its kind if that is more (geometric stiffness; shapes of markers); M, K and D
likewise by their diagonals. Forces change by less than 1e-14 of the largest term of their kind for each such number.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.design.generation.graph import Graph, Terms, terms
from floatframe.engine.kernels.model import C1, C3, C4, DAMPING, K_ROTATION, K_TRANSLATION, MASS, S_AB, STIFFNESS
from floatframe.engine.tree.recursion.expansion import Expansion, marker_shape
from floatframe.model.bodies.marker_shape import MarkerShape

__all__ = ["ElasticMarker", "Modes", "elastic_marker", "modes_of"]

ROUNDING = 1e-14


@dataclass(frozen=True, eq=False)
class Modes:
    """Modal coordinates of a body and their moments, in the frame of its node; arrays of constant terms."""

    n: int
    x0: int  #: first of them among the positions
    v0: int  #: among the rates
    C1: Terms  #: (n, 3)
    X: Terms  #: (n, 3, 3) [k, a, b]: phi_k along a, place along b
    S: Terms  #: (n, n, 3, 3) [k, l, a, b]: phi_k along a, phi_l along b
    C4: Terms  #: (n, n, 3) [k, l]
    M: Terms  #: (n, n)
    K: Terms
    D: Terms
    K_t: Terms  #: (n, n, 3) [k, l]; zero unless stiffened
    K_r: Terms

    @property
    def rates(self) -> slice:
        """Its place among the rates."""
        return slice(self.v0, self.v0 + self.n)


@dataclass(frozen=True, eq=False)
class ElasticMarker:
    """A marker that moves with modes, in the frame of the node of its body."""

    x0: int  #: first mode among the positions
    v0: int  #: among the rates
    place: Terms  #: undeformed, (3,)
    axes: Terms  #: undeformed, (3, 3)
    shift: Terms  #: displacement by the modes, (n, 3)
    turn: Terms  #: rotation by them, (n, 3)
    shift_bend: Terms  #: K_P, (n, n, 3), symmetric; zero unless stiffened
    turn_bend: Terms

    @property
    def moves(self) -> bool:
        """Whether it moves with the modes at all."""
        parts = (self.shift, self.turn, self.shift_bend, self.turn_bend)
        return not all(value.is_constant(0.0) for part in parts for value in part.ravel())


def without_noise(x: Array, bound: Array) -> Array:
    """Return numbers with those below rounding of a bound, or of the largest beside it, made zero."""
    bound = np.broadcast_to(bound, x.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(bound > 0, np.abs(x) / bound, np.where(x == 0, 0.0, 1.0))
    return np.asarray(np.where(share < ROUNDING * max(1.0, float(share.max(initial=0.0))), 0.0, x))


def blocks_of(expansion: Expansion, i: int) -> dict[int, Array]:
    """Return the numbers of body i by their names in `kernels.model`; geometric stiffness of a body without is zero."""
    model = expansion.compiled.model
    types, t, n = model.body_types, int(model.bodies.kind[i]), int(model.bodies.n_q[i])
    shapes: dict[int, tuple[int, ...]] = {
        C1: (3, n), C3: (3, 3, n), S_AB: (n, 3, 3, n), C4: (n, 3, n), MASS: (n, n), STIFFNESS: (n, n),
        DAMPING: (n, n), K_TRANSLATION: (n, 3, n), K_ROTATION: (n, 3, n),
    }  # fmt: skip
    blocks = {}
    for which, shape in shapes.items():
        start = int(types.block0[t, which])
        if which in (K_TRANSLATION, K_ROTATION) and not types.is_stiffened[t]:
            blocks[which] = np.zeros(shape)
        elif which in (MASS, STIFFNESS, DAMPING) and types.is_diagonal[t, which - MASS]:
            blocks[which] = np.diag(types.blocks[start : start + n])
        else:
            blocks[which] = types.blocks[start : start + int(np.prod(shape))].reshape(shape)
    return blocks


def modes_of(graph: Graph, expansion: Expansion, i: int, frame: tuple[Array, Array]) -> Modes:
    """Return the modes of body i; frame: axes and origin of its node in the body."""
    F, origin = frame
    model, numbers = expansion.compiled.model, blocks_of(expansion, i)
    t, n = int(model.bodies.kind[i]), int(model.bodies.n_q[i])
    mass, J = float(model.body_types.mass[t]), model.body_types.J0[t]
    M, K, D = (numbers[which] for which in (MASS, STIFFNESS, DAMPING))
    C1_k, C3_k = numbers[C1].T, np.moveaxis(numbers[C3], 2, 0)
    X = 0.5 * np.trace(C3_k, axis1=1, axis2=2)[:, None, None] * np.eye(3) - C3_k
    S_kl = np.transpose(numbers[S_AB], (3, 0, 1, 2))  # [k, l, a, b]
    C4_kl, Kt_kl, Kr_kl = (np.transpose(numbers[which], (2, 0, 1)) for which in (C4, K_TRANSLATION, K_ROTATION))
    X = F.T @ (X - C1_k[:, :, None] * origin) @ F
    S_kl = F.T @ (S_kl - Kt_kl[..., None] * origin) @ F
    Kr_kl = (Kr_kl - np.cross(origin, Kt_kl)) @ F
    size = np.sqrt(np.maximum(np.diag(M), 0.0))  # of modes
    pair = size[:, None] * size
    moved = J + mass * ((origin @ origin) * np.eye(3) - np.outer(origin, origin))
    spread = np.sqrt(0.5 * max(float(np.trace(J)), float(np.trace(moved))))  # of the masses about either frame
    stiff, damped = (np.sqrt(np.abs(np.diag(each))) for each in (K, D))

    def kept(x: Array, bound: Array) -> Terms:
        return terms(graph, without_noise(x, bound))

    return Modes(
        n=n,
        x0=expansion.xq_of[i].start,
        v0=expansion.vq_of[i].start,
        C1=kept(C1_k @ F, np.sqrt(mass) * size[:, None]),
        X=kept(X, spread * size[:, None, None]),
        S=kept(S_kl, pair[..., None, None]),
        C4=kept(C4_kl @ F, pair[..., None]),
        M=kept(M, pair),
        K=kept(K, stiff[:, None] * stiff),
        D=kept(D, damped[:, None] * damped),
        K_t=kept(Kt_kl @ F, pair[..., None]),
        K_r=kept(Kr_kl, pair[..., None]),
    )


def elastic_marker(
    graph: Graph, expansion: Expansion, i: int, shape: MarkerShape, frame: tuple[Array, Array], length: float
) -> ElasticMarker:
    """Return a marker of the flexible body i in the frame of its node, axes and origin of that in the body.

    length: the largest of the tree.
    """
    F, origin = frame
    n = expansion.xq_of[i].stop - expansion.xq_of[i].start
    psi = np.zeros((6, n)) if shape.psi is None else shape.psi
    bend = np.zeros((6, n, n)) if shape.bend is None else shape.bend
    size = np.sqrt(np.maximum(np.diag(blocks_of(expansion, i)[MASS]), 0.0))
    largest = largest_shapes(expansion, i)
    parts: list[Terms] = []
    for rows, most in zip((slice(0, 3), slice(3, 6)), largest, strict=True):
        parts.append(terms(graph, without_noise(psi[rows].T @ F, most[:, None])))
        bent = np.moveaxis(bend[rows], 0, 2) @ F
        parts.append(terms(graph, without_noise(bent, (size[:, None] * size)[..., None])))
    place = F.T @ (shape.position - origin)
    axes = F.T @ shape.triad
    whole = np.round(axes)
    return ElasticMarker(
        x0=expansion.xq_of[i].start,
        v0=expansion.vq_of[i].start,
        place=terms(graph, np.where(np.abs(place) < ROUNDING * length, 0.0, place)),
        axes=terms(graph, np.where(np.abs(axes - whole) < ROUNDING, whole, axes) + 0.0),
        shift=parts[0],
        turn=parts[2],
        shift_bend=parts[1],
        turn_bend=parts[3],
    )


def largest_shapes(expansion: Expansion, i: int) -> tuple[Array, Array]:
    """Return the largest displacement and rotation by each mode over all interfaces of body i, (n,) each."""
    markers = expansion.compiled.model.markers
    n = expansion.xq_of[i].stop - expansion.xq_of[i].start
    found = [np.zeros((6, n))]
    found += [interface.Psi for interface in expansion.system.bodies[i].moved.interfaces]  # type: ignore[union-attr]
    for m in np.flatnonzero(markers.body == i):
        shape = marker_shape(expansion.compiled, int(m))
        found += [] if shape.psi is None else [shape.psi]
    size = np.abs(np.array(found)).max(axis=0)
    return size[:3].max(axis=0), size[3:].max(axis=0)
