"""Invariants of a flexible body and shapes of its markers, as numbers in its node frame.

The node of a flexible body is the outer frame of its joint while the body is undeformed, with axes F at o in the body
frame. A body that is clamped at this frame then needs only the transformation of the joint. With phi_k and
c = c_0 + phi q in the body frame, the moments of a mode in the node frame are (docs/theory.md §6, §7)

    C1'_k = Fᵀ C1_k                          int phi_k
    X'_k  = Fᵀ (X_k - C1_k oᵀ) F             int phi_k c_0ᵀ, from which 2C_k and 3C_k = (tr X_k) 1 - X_k follow
    S'_kl = Fᵀ (S_kl - K_t,kl oᵀ) F          int phi_k phi_lᵀ, with the contribution of geometric stiffness
    K_r'  = Fᵀ (K_r - o × K_t)

Rounding errors are set to zero. An entry is a rounding error if it is below 1e-14 of its bound by Schwarz's inequality:
(m M_kk)^(1/2) for C1_k, (tr P M_kk)^(1/2) for X_k, (M_kk M_ll)^(1/2) for S_kl and 4C_kl; or of the largest entry of its
kind if that is larger (geometric stiffness, shapes of markers). M, K and D are treated likewise, with bounds from their
diagonals. Each such number changes forces by less than 1e-14 of the largest term of their kind.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.design.generation.graph import Graph, Terms, terms
from floatframe.engine.initial_conditions.newton_equations import modal_matrix, stored_array
from floatframe.engine.kernels.model import C1, C3, C4, DAMPING, K_ROTATION, K_TRANSLATION, MASS, S_AB, STIFFNESS
from floatframe.engine.tree.recursion.expansion import Expansion, marker_shape
from floatframe.model.bodies.marker_shape import MarkerShape

__all__ = ["ElasticMarker", "Modes", "elastic_marker", "modes_of"]

ROUNDING = 1e-14


@dataclass(frozen=True, eq=False)
class Modes:
    """Modal coordinates of a body, and the moments of its modes in the node frame as constant terms."""

    n: int
    x0: int  #: index of the first mode among the positions
    v0: int  #: index of the first mode among the rates
    C1: Terms  #: first-order coupling with translation, (n, 3)
    X: Terms  #: (n, 3, 3) [k, a, b]: component a of phi_k, component b of the position
    S: Terms  #: (n, n, 3, 3) [k, l, a, b]: component a of phi_k, component b of phi_l
    C4: Terms  #: coupling C4 [k, l] with rotation, (n, n, 3)
    M: Terms  #: modal mass matrix, (n, n)
    K: Terms
    D: Terms
    K_t: Terms  #: (n, n, 3) [k, l]; zero unless stiffened
    K_r: Terms

    @property
    def rates(self) -> slice:
        """The rates of the modes among all rates."""
        return slice(self.v0, self.v0 + self.n)


@dataclass(frozen=True, eq=False)
class ElasticMarker:
    """A marker that moves with modes, in the node frame of its body."""

    x0: int  #: index of the first mode among the positions
    v0: int  #: index of the first mode among the rates
    place: Terms  #: undeformed position, (3,)
    axes: Terms  #: undeformed axes, (3, 3)
    shift: Terms  #: displacement per modal coordinate, (n, 3)
    turn: Terms  #: rotation per modal coordinate, (n, 3)
    shift_bend: Terms  #: K_P, (n, n, 3), symmetric; zero unless stiffened
    turn_bend: Terms

    @property
    def moves(self) -> bool:
        """Whether modes move the marker at all."""
        parts = (self.shift, self.turn, self.shift_bend, self.turn_bend)
        return not all(value.is_constant(0.0) for part in parts for value in part.ravel())


def without_noise(x: Array, bound: Array) -> Array:
    """Return numbers; entries that are rounding errors of a bound or of the largest entry are replaced by zero."""
    bound = np.broadcast_to(bound, x.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(bound > 0, np.abs(x) / bound, np.where(x == 0, 0.0, 1.0))
    return np.asarray(np.where(share < ROUNDING * max(1.0, float(share.max(initial=0.0))), 0.0, x))


def blocks_of(expansion: Expansion, i: int) -> dict[int, Array]:
    """Return the numbers of body i by their names in `kernels.model`; missing geometric stiffness is zero."""
    model = expansion.compiled.model
    n, has_unit_loads = int(model.bodies.n_q[i]), bool(model.body_types.has_unit_loads[model.bodies.kind[i]])
    blocks = {which: modal_matrix(model, i, which) for which in (MASS, STIFFNESS, DAMPING)}
    for which, shape in ((C1, (3, n)), (C3, (3, 3, n)), (S_AB, (n, 3, 3, n)), (C4, (n, 3, n))):
        blocks[which] = stored_array(model, i, which, *shape)
    for which in (K_TRANSLATION, K_ROTATION):
        blocks[which] = stored_array(model, i, which, n, 3, n) if has_unit_loads else np.zeros((n, 3, n))
    return blocks


def modes_of(graph: Graph, expansion: Expansion, i: int, frame: tuple[Array, Array]) -> Modes:
    """Return the modes of body i; `frame` has the axes and origin of its node in the body."""
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
    size = np.sqrt(np.maximum(np.diag(M), 0.0))  # M_kk^(1/2)
    pair = size[:, None] * size
    moved = J + mass * ((origin @ origin) * np.eye(3) - np.outer(origin, origin))
    spread = np.sqrt(0.5 * max(float(np.trace(J)), float(np.trace(moved))))  # radius of gyration about either frame
    stiff, damped = (np.sqrt(np.abs(np.diag(each))) for each in (K, D))

    def significant(x: Array, bound: Array) -> Terms:
        return terms(graph, without_noise(x, bound))

    return Modes(
        n=n,
        x0=expansion.xq_of[i].start,
        v0=expansion.vq_of[i].start,
        C1=significant(C1_k @ F, np.sqrt(mass) * size[:, None]),
        X=significant(X, spread * size[:, None, None]),
        S=significant(S_kl, pair[..., None, None]),
        C4=significant(C4_kl @ F, pair[..., None]),
        M=significant(M, pair),
        K=significant(K, stiff[:, None] * stiff),
        D=significant(D, damped[:, None] * damped),
        K_t=significant(Kt_kl @ F, pair[..., None]),
        K_r=significant(Kr_kl, pair[..., None]),
    )


def elastic_marker(
    graph: Graph, expansion: Expansion, i: int, shape: MarkerShape, frame: tuple[Array, Array], length: float
) -> ElasticMarker:
    """Return a marker of the flexible body i in its node frame.

    frame: axes and origin of the node frame in the body; length: the largest length of the tree.
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
    """Return the largest displacement and rotation per modal coordinate over all interfaces of body i, (n,) each."""
    markers = expansion.compiled.model.markers
    n = expansion.xq_of[i].stop - expansion.xq_of[i].start
    found = [np.zeros((6, n))]
    found += [interface.Psi for interface in expansion.system.bodies[i].moved.interfaces]  # type: ignore[union-attr]
    for m in np.flatnonzero(markers.body == i):
        shape = marker_shape(expansion.compiled, int(m))
        found += [] if shape.psi is None else [shape.psi]
    size = np.abs(np.array(found)).max(axis=0)
    return size[:3].max(axis=0), size[3:].max(axis=0)
