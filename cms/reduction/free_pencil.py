"""Matrices of the free reduced body over rigid motion and modal coordinates, from a modal file alone."""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors, stiffness_scale
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, frozen

__all__ = [
    "FreePencil", "free_elastic_modes", "free_pencil", "frequency_distance", "has_inertia", "port_rows", "whole_pencil",
    "whole_port_rows",
]  # fmt: skip

#: smallest eigenvalue of the scaled rigid mass matrix, below which there is no inertia about an axis
NO_INERTIA = 1e-12
KNOWN_RATIO = 1e9  #: ratio of squared frequencies up to which rounding of the modal mass is far below all limits


@dataclass(frozen=True, eq=False)
class FreePencil:
    """M x'' + D x' + K x = f for x = (translation of B, rotation of B, q), small motion, components in B.

    For a body fixed to the ground, x = q: its frame does not move.
    """

    M: Array  #: mass, (n_r + n_q, n_r + n_q); n_r = 6, or 0 for a body fixed to the ground
    K: Array  #: stiffness, (n_r + n_q, n_r + n_q)
    D: Array  #: damping, (n_r + n_q, n_r + n_q)

    def __post_init__(self) -> None:
        for name in ("M", "K", "D"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def free_pencil(reduced: ReducedBody) -> FreePencil:
    """Return the matrices of a free body, or over the modes alone for a body fixed to the ground."""
    return FreePencil(reduced.M, reduced.K, reduced.D) if reduced.is_held else whole_pencil(reduced)


def whole_pencil(reduced: ReducedBody) -> FreePencil:
    """Return the matrices of docs/theory.md §6 at rest.

    M = [m 1, -S~, 1C; S~, J(0), 2C; 1Cᵀ, 2Cᵀ, M*], K = diag(0, K*), D = diag(0, D*).
    """
    moments = reduced.moments
    M = np.block([[moments.rigid_mass, moments.coupling], [moments.coupling.T, reduced.M]])
    K, D = np.zeros_like(M), np.zeros_like(M)
    K[6:, 6:], D[6:, 6:] = reduced.K, reduced.D
    return FreePencil(M, K, D)


def free_elastic_modes(reduced: ReducedBody) -> tuple[Array, Array, np.ndarray]:
    """Return the elastic modes of the free reduced body, ascending, then its massless shapes.

    Rigid motion is condensed by M_rr x_r + M_rq q = 0.

    Returns
    -------
    omega2
        Squared frequencies; for massless shapes the stiffness, (n,) [1/s²].
    X
        Shapes over x, (n_r + n_q, n).
    is_massive
        Whether each shape has mass, (n,) bool.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the body has no inertia about some axis, or a mode has neither stiffness nor mass.
    """
    pencil = free_pencil(reduced)
    T = np.eye(reduced.n_q)
    if not reduced.is_held:
        T = np.vstack([-np.linalg.solve(pencil.M[:6, :6], pencil.M[:6, 6:]), T])
    G_M = T.T @ pencil.M @ T
    Z, is_massive = elastic_eigenvectors(reduced.K, (G_M + G_M.T) / 2, stiffness_scale(reduced.K, reduced.M))
    omega2 = np.einsum("kq,kl,lq->q", Z, reduced.K, Z)
    order = np.lexsort((omega2, np.logical_not(is_massive)))
    return omega2[order], T @ Z[:, order], is_massive[order]


def frequency_distance(own: Array, stored: Array) -> Array:
    """Return the relative differences between computed and stored frequencies, both ascending.

    Rounding limits the accuracy: for unit energy the modal mass is proportional to omega_1² / omega² and has an error
    of eps, so the relative error of a frequency is eps omega² / omega_1². Light frames with point masses have modes at
    1e6 times the first frequency. Beyond the ratio `KNOWN_RATIO`, differences are reduced in this proportion, and modes
    may be missing in one of the lists, because rounding decides whether they have mass.

    Raises
    ------
    ValueError
        If other modes are missing in one of the lists.
    """
    n = min(len(own), len(stored))
    first = min(own[0], stored[0]) if n else 0.0
    surplus = np.concatenate([own[n:], stored[n:]])
    if (surplus**2 < KNOWN_RATIO * first**2).any() or (len(surplus) and not n):
        raise ValueError(f"{len(own)} frequencies for {len(stored)}")
    return np.asarray(np.abs(own[:n] / stored[:n] - 1) * np.minimum(1.0, KNOWN_RATIO * (first / stored[:n]) ** 2))


def has_inertia(reduced: ReducedBody) -> bool:
    """Return whether the rigid body has mass and inertia about every axis, from its scaled mass matrix."""
    M_rr = reduced.moments.rigid_mass
    size = np.sqrt(np.maximum(np.diag(M_rr), 0.0))
    return bool((size > 0).all() and np.linalg.eigvalsh(M_rr / np.outer(size, size))[0] > NO_INERTIA)


def port_rows(reduced: ReducedBody, name: str) -> Array:
    """Return the motion of the reference point of an interface due to x, in axes of B, (6, n_r + n_q)."""
    if reduced.is_held:
        return np.asarray(reduced.interface(name).Psi)
    return whole_port_rows(reduced, name)


def whole_port_rows(reduced: ReducedBody, name: str) -> Array:
    """Return the motion of the reference point due to rigid motion and modes, in axes of B, (6, 6 + n_q)."""
    interface = reduced.interface(name)
    rows = np.zeros((6, 6 + reduced.n_q))
    rows[:3, :6] = rigid_motion_of_points(interface.position[None], np.zeros(3))[0]
    rows[3:, 3:6] = np.eye(3)
    rows[:, 6:] = interface.Psi
    return rows
