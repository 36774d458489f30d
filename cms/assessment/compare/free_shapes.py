"""Free-free vibration modes of a subset of a mode set, in the coordinates of a comparison."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.assessment.compare.coordinates import Coordinates
from cms.errors import ModeSetError
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.linear_algebra.independent import RANK_TOLERANCE
from cms.reduction.basis.finishing import elastic_directions
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Subset", "independent_subset", "judged_subset"]


@dataclass(frozen=True, eq=False)
class Subset:
    """Some columns of a mode set, and their free-free modes in small coordinates."""

    basis: FreeBasis  #: free-free modes; rows are coordinates over Q, (n_Q, …), not dofs
    condition: float  #: condition number of the independent columns, scaled to unit length in the W-norm [-]
    n_columns: int

    @property
    def n_q(self) -> int:
        """Number of independent elastic shapes: the generalised coordinates of the reduced body."""
        return len(self.basis.omega2)


def independent_subset(T: Array) -> tuple[Array, IntArray, float]:
    """Return an orthonormal basis of columns T, the redundant columns, and the condition number of the others.

    The tolerance is the one of the finishing step (docs/theory.md §3).
    """
    length = np.linalg.norm(T, axis=0)
    unit = T / np.where(length > 0, length, 1.0)
    Q, R, pivots = la.qr(unit, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    rank = int((sizes > RANK_TOLERANCE).sum())
    condition = float(np.linalg.cond(R[:rank, :rank])) if rank else np.inf
    return Q[:, :rank], np.sort(pivots[rank:]).astype(np.int64), condition


def judged_subset(c: Coordinates, T: Array, labels: tuple[str, ...], rigid: Array, omega2_1: float) -> Subset:
    """Solve the free-free problem of the span of columns T and the rigid-body modes.

    (1) independent columns U of T
    (2) directions d of U outside the rigid-body motions, without their rigid-body part: U <- (1 - N Nᵀ M) U d
    (3) K z = omega² M z over U, by the solver of the finishing step

    Parameters
    ----------
    T
        Columns of the subset, (n_Q, k).
    labels
        Labels of these columns, (k,).
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
    # scaled to unit length: the norm of coordinates is the (K + omega_1² M)-norm of the shapes, which is omega_1 for N
    motions = rigid / np.sqrt(omega2_1)
    in_span = U.T @ motions
    rest = motions - U @ in_span
    U = U @ elastic_directions(in_span, rest.T @ rest)  # (2)
    U = U - rigid @ (rigid.T @ (c.M @ U))
    if not U.shape[1]:
        raise ModeSetError(f"its {T.shape[1]} columns hold only rigid-body motion; add modes")
    G_K, G_M = U.T @ c.K @ U, U.T @ c.M @ U
    Z, has_mass = elastic_eigenvectors((G_K + G_K.T) / 2, (G_M + G_M.T) / 2, omega2_1)  # (3)
    is_massive = np.asarray(has_mass, dtype=bool)
    Phi = U @ Z
    omega2 = np.einsum("nk,nl,lk->k", Phi, c.K, Phi, optimize=True)
    order = np.lexsort((omega2, ~is_massive))
    dropped = tuple(labels[k] for k in redundant)
    basis = FreeBasis(Phi[:, order], omega2[order], is_massive[order], rigid, dropped)
    return Subset(basis, condition, T.shape[1])
