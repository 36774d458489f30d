"""Flexible surfaces of a page: nodes, mode shapes and stress modes in 16 bit, modal coordinates over the rows.

    place of a node       r + R (c + m Σ_k a_k phi_k)       m the magnification, a_k the amplitudes of a row
    displacement          |Σ_k a_k phi_k|
    von Mises' stress     sqrt(3/2 s:s) of s = Σ_k a_k s_k

The amplitudes are the modal coordinates q. For a body with quadratic modes, the second-order part ½ Σ q_k q_l g_kl is
added with its own amplitudes and shapes (the leading ones of its history). Shapes that move every shown node by less
than 1e-5 of the largest displacement, and change every stress by less than 1e-3 of the largest stress, are omitted.
"""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.body.stress import von_mises_of
from fe_models.foundation.arrays import Array
from floatframe.pictures.viewer.surface import ShownSurface, shown_surface

__all__ = ["FlexibleSurface", "flexible_surface", "nodes_within"]

MOVES, STRESSES = 1e-5, 1e-3  #: fractions of the largest displacement and stress below which a mode is omitted
#: steps between the numbers of a shape and of a stress mode at their largest amplitudes, as fractions of those largest
MOVE_STEP, STRESS_STEP = 2e-4, 1e-4
FEWEST, MOST = 300, 20_000  #: smallest and largest number of shown nodes of a body
CHUNK_SIZE = 2_000_000  #: largest count of displacement values in memory at a time


@dataclass(frozen=True, eq=False)
class FlexibleSurface:
    """The data of a flexible body in a page."""

    body: int  #: index of the body
    surface: ShownSurface
    nodes: Array  #: positions of the shown nodes, (n, 3) [m]
    shapes: Array  #: shapes phi_k of the shown nodes, (n_a, n, 3)
    stress: Array | None  #: stress modes s_k, (n_a, n, 6); None if the body has none
    amplitudes: Array  #: a_k in the shown rows, (n_rows, n_a)
    largest_displacement: float  #: largest displacement of the shown nodes in the shown rows [m]
    largest_stress: float  #: largest stress of the shown nodes in the shown rows [Pa]
    n_modes: int  #: number of modes of the body

    @property
    def steps(self) -> tuple[Array, Array]:
        """Sufficient steps between the numbers of each shape and of each stress mode, (n_a,) each; 0 without motion."""
        reach = np.abs(self.amplitudes).max(axis=0, initial=0.0)
        if len(self.amplitudes) == 1:  # an equilibrium, about which modes may be drawn
            return 0 * reach, 0 * reach
        reach = np.maximum(reach, 1e-300)
        return MOVE_STEP * self.largest_displacement / reach, STRESS_STEP * self.largest_stress / reach


def nodes_within(n_bytes: float, bodies: dict[str, ReducedBody]) -> dict[str, int]:
    """Return the number of nodes of each body that may be shown so that the data of all bodies fit into `n_bytes`.

    The numbers are proportional to the square roots of the numbers of nodes, so that a small body beside a large
    one is still drawn finely.
    """
    has = {name: len(np.unique(body.surface)) for name, body in bodies.items() if len(body.surface)}
    parts = {name: 9 if bodies[name].stress is not None else 3 for name in has}
    cost = {name: 20 + 2 * parts[name] * bodies[name].n_q for name in has}
    low, high = 0.0, float(MOST)
    for _ in range(40):
        factor = (low + high) / 2
        used = sum(min(has[name], factor * np.sqrt(has[name])) * cost[name] for name in has)
        low, high = (factor, high) if used <= n_bytes else (low, factor)
    return {name: int(np.clip(low * np.sqrt(has[name]), min(FEWEST, has[name]), min(MOST, has[name]))) for name in has}


def flexible_surface(number: int, body: ReducedBody, q: Array, most: int, *, is_stiffened: bool) -> FlexibleSurface:
    """Return the surface of a body with at most about `most` nodes.

    Parameters
    ----------
    q
        Modal coordinates in the shown rows; for pages of modes, the largest ones in each mode, (n_rows, n_q).
    """
    surface = shown_surface(body.nodes, body.surface, most)
    shapes = np.moveaxis(np.asarray(body.Phi)[surface.rows], 2, 0)
    stress = None
    if body.stress is not None:
        stress = np.moveaxis(np.asarray(body.stress)[surface.rows], 2, 0)
    amplitudes = np.asarray(q, dtype=float)
    if body.quadratic is not None and is_stiffened:
        more, second = second_order(body, surface, amplitudes)
        shapes, amplitudes = np.concatenate([shapes, second]), np.concatenate([amplitudes, more], axis=1)
        if stress is not None:
            stress = np.concatenate([stress, np.zeros((len(second), *stress.shape[1:]))])
    displacement = largest_displacement(shapes, amplitudes)
    largest_stress = 0.0
    if stress is not None:
        largest_stress = max(
            (float(part.max(initial=0.0)) for part in von_mises_of(np.moveaxis(stress, 0, 2), amplitudes)), default=0.0
        )
    reach = np.abs(amplitudes).max(axis=0, initial=0.0)
    kept = reach * np.abs(shapes).max(axis=(1, 2), initial=0.0) > MOVES * displacement
    if stress is not None:
        kept |= reach * np.abs(stress).max(axis=(1, 2), initial=0.0) > STRESSES * largest_stress
    return FlexibleSurface(
        number, surface, np.asarray(body.nodes)[surface.rows], shapes[kept], None if stress is None else stress[kept],
        amplitudes[:, kept], displacement, largest_stress, body.n_q,
    )  # fmt: skip


def largest_displacement(shapes: Array, amplitudes: Array) -> float:
    """Return the largest displacement of a node in any row [m]."""
    n_a, n = shapes.shape[:2]
    flat, largest = shapes.reshape(n_a, 3 * n), 0.0
    at_once = max(1, CHUNK_SIZE // max(3 * n, 1))
    for first in range(0, len(amplitudes), at_once):
        d = (amplitudes[first : first + at_once] @ flat).reshape(-1, n, 3)
        largest = max(largest, float(np.einsum("tna,tna->tn", d, d).max(initial=0.0)))
    return float(np.sqrt(largest))


def second_order(body: ReducedBody, surface: ShownSurface, q: Array) -> tuple[Array, Array]:
    """Return amplitudes (n_rows, k) and shapes (k, n, 3) of the leading second-order displacements in its history."""
    assert body.quadratic is not None  # checked by the caller
    g = np.asarray(body.quadratic)[surface.rows]
    n, n_q = len(g), body.n_q
    pairs = 0.5 * (q[:, :, None] * q[:, None, :]).reshape(len(q), n_q * n_q)
    left, size, right = np.linalg.svd(pairs, full_matrices=False)
    kept = size > 1e-9 * size.max(initial=0.0)
    shapes = right[kept] @ g.reshape(3 * n, n_q * n_q).T
    return left[:, kept] * size[kept], shapes.reshape(-1, n, 3)
