"""The free-free vibration of a subset of a mode set, in the coordinates of a comparison."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.arrays import Array, IntArray
from cms.compare.coordinates import Coordinates
from cms.errors import ModeSetError
from cms.finishing import elastic_eigenvectors
from cms.independent import RANK_TOLERANCE

__all__ = ["FreeShapes", "free_shapes", "independent_subset"]


@dataclass(frozen=True, eq=False)
class FreeShapes:
    """M-orthonormal, K-diagonal elastic shapes of the free reduced body, without rigid-body motion."""

    omega2: Array  #: ascending, (n_massive,) [1/s²]
    shapes: Array  #: coordinates of those shapes, (n_Q, n_massive)
    static: Array  #: shapes without mass, K-orthonormal, (n_Q, n_static)
    span: Array  #: W-orthonormal basis of the subset and the rigid-body modes, (n_Q, n)
    redundant: IntArray  #: columns of the subset that depend on the others, ascending
    condition: float  #: of the independent columns at unit W-length, in that norm [-]

    @property
    def n_q(self) -> int:
        """Number of independent elastic shapes: the generalised coordinates of the reduced body."""
        return len(self.omega2) + self.static.shape[1]


def independent_subset(T: Array) -> tuple[Array, IntArray, float]:
    """Orthonormal basis of columns T by pivoted QR at unit length, the redundant ones, and the condition of the rest.

    The tolerance is that of the finishing step (THEORY §3).
    """
    length = np.linalg.norm(T, axis=0)
    unit = T / np.where(length > 0, length, 1.0)
    Q, R, pivots = la.qr(unit, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    rank = int((sizes > RANK_TOLERANCE).sum())
    kept = np.linalg.svd(R[:rank, :rank], compute_uv=False)
    condition = float(kept[0] / kept[-1]) if rank else np.inf
    return Q[:, :rank], np.sort(pivots[rank:]).astype(np.int64), condition


def free_shapes(c: Coordinates, T: Array, rigid: Array, omega2_1: float) -> FreeShapes:
    """Solve the free-free problem of the span of columns T and the rigid-body modes.

    (1) independent columns U of T
    (2) rigid-body part off: U <- (1 - N Nᵀ M) U, N M-orthonormal rigid-body modes
    (3) K z = omega² M z over U without its null space, by the solver of the finishing step

    Parameters
    ----------
    T
        Columns of the subset, (n_Q, k).
    rigid
        M-orthonormal rigid-body modes N, (n_Q, n_r).
    omega2_1
        omega_1² of the free body [1/s²].

    Raises
    ------
    ModeSetError
        If nothing elastic is left.
    """
    U, redundant, condition = independent_subset(T)  # (1)
    U = U - rigid @ (rigid.T @ (c.M @ U))  # (2)
    G_K, G_M = U.T @ c.K @ U, U.T @ c.M @ U
    Z, has_mass, _ = elastic_eigenvectors((G_K + G_K.T) / 2, (G_M + G_M.T) / 2, omega2_1)  # (3)
    is_massive = np.asarray(has_mass, dtype=bool)
    if not Z.shape[1]:
        raise ModeSetError(f"its {T.shape[1]} columns hold only rigid-body motion; add modes")
    Y = U @ Z
    omega2 = np.einsum("nk,nl,lk->k", Y, c.K, Y, optimize=True)
    massive, static = Y[:, is_massive], Y[:, ~is_massive]
    order = np.argsort(omega2[is_massive])
    span, _ = np.linalg.qr(np.hstack([rigid, Y]))
    return FreeShapes(
        omega2=omega2[is_massive][order],
        shapes=massive[:, order],
        static=static / np.sqrt(omega2[~is_massive]),
        span=span,
        redundant=redundant,
        condition=condition,
    )
