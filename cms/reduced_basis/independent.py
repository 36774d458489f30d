"""Independent columns of a mode set in the norm of W = K + omega_1² M, and the redundant ones (docs/theory.md §3).

A Gram matrix squares the condition of the columns, so a column whose pivot is small in its Gram matrix is not judged
there: its remainder is formed, measured, and judged itself. This is a pivoted QR in blocks.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.linalg.lapack import dpstrf

from cms.solvers.tall import combine, inner
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Columns", "gram", "independent_columns"]

RANK_TOLERANCE = 1e-10  #: remainder of a unit column below which it is redundant (docs/theory.md §3)
ROUNDING_MARGIN = 30.0  #: times the rounding noise of a column in the W-norm, where that is more
TRUSTED_PIVOT = 1e-4  #: remainder above which a pivoted Cholesky of the Gram matrix decides by itself


@dataclass(eq=False)
class Columns:
    """Displacement columns with their products and their origin; blocks of one tall, thin matrix each."""

    X: Array  #: (n_dof, k)
    KX: Array  #: (n_dof, k)
    MX: Array  #: (n_dof, k)
    T: Array  #: coefficients over the columns of the mode set, (n_columns, k)

    def __matmul__(self, Z: Array) -> "Columns":
        return Columns(combine(self.X, Z), combine(self.KX, Z), combine(self.MX, Z), self.T @ Z)

    def __sub__(self, other: "Columns") -> "Columns":
        return Columns(self.X - other.X, self.KX - other.KX, self.MX - other.MX, self.T - other.T)

    def __getitem__(self, index: IntArray) -> "Columns":
        return Columns(self.X[:, index], self.KX[:, index], self.MX[:, index], self.T[:, index])

    def beside(self, other: "Columns") -> "Columns":
        """Return both, side by side."""
        return Columns(*(np.hstack([getattr(self, a), getattr(other, a)]) for a in ("X", "KX", "MX", "T")))

    def inner(self, other: "Columns", omega2: float) -> Array:
        """Return selfᵀ (K + omega² M) other."""
        return inner(self.X, other.KX) + omega2 * inner(self.X, other.MX)


def gram(X: Array, AX: Array) -> Array:
    """Return Xᵀ A X of a symmetric A, with the rounding of its two halves averaged."""
    G = inner(X, AX)
    return (G + G.T) / 2


def independent_columns(columns: Columns, body: FEBody, omega2: float) -> tuple[Columns, IntArray]:
    """W-orthonormal columns of the same span, and the indices of the redundant columns.

    Parameters
    ----------
    columns
        The columns of a mode set with their products, T the identity.
    omega2
        omega_1² of W = K + omega_1² M [1/s²].

    Returns
    -------
    basis
        W-orthonormal columns, T says how they are made; none where all columns are zero or rounding.
    redundant
        Indices of columns whose remainder against the others is below the tolerance, ascending.
    """
    length = _length(columns, omega2)
    is_zero = length <= np.finfo(float).tiny
    redundant = list(np.flatnonzero(is_zero))
    index = np.flatnonzero(~is_zero)
    rest = columns[index] if is_zero.any() else columns
    tolerance = np.maximum(RANK_TOLERANCE, ROUNDING_MARGIN * _rounding_noise(rest, body, omega2) / length[index])
    size, remainder = length[index], np.ones(len(index))  # remainder: W-length of what is left of each unit column
    basis: Columns | None = None
    while len(index):
        # tall arrays stay as they are: lengths and the order of pivots go into the small matrices
        G = rest.inner(rest, omega2) / np.outer(size, size)
        factor, pivots, rank, _ = dpstrf((G + G.T) / 2, tol=TRUSTED_PIVOT**2, lower=0)
        taken, left = pivots[:rank] - 1, pivots[rank:] - 1
        U = np.triu(factor[:rank, :rank])
        Z = np.zeros((len(index), rank))
        Z[taken] = la.solve_triangular(U, np.eye(rank)) / size[taken, None]
        new = _orthonormalized(rest @ Z, body, omega2, well_conditioned=len(left) == 0 and _is_tame(U))
        basis = new if basis is None else basis.beside(new)
        if not len(left):
            break
        rest = _unit(rest[left], size[left])
        for _ in range(2):  # twice is enough
            rest = rest - basis @ basis.inner(rest, omega2)
            rest.KX, rest.MX = body.K @ rest.X, body.M @ rest.X  # fresh: the difference lost their leading digits
        size = _length(rest, omega2)
        remainder = remainder[left] * size
        is_kept = remainder > tolerance[left]
        redundant += list(index[left[~is_kept]])
        index, tolerance, remainder = index[left[is_kept]], tolerance[left[is_kept]], remainder[is_kept]
        rest, size = rest[np.flatnonzero(is_kept)], size[is_kept]
    if basis is None:  # nothing but rounding: no column is longer than its own noise
        basis = columns[np.zeros(0, np.int64)]
    return basis, np.sort(np.asarray(redundant, dtype=np.int64))


def _length(columns: Columns, omega2: float) -> Array:
    """W-length of every column, (k,)."""
    stiff = np.einsum("nk,nk->k", columns.X, columns.KX)
    return np.sqrt(np.maximum(stiff + omega2 * np.einsum("nk,nk->k", columns.X, columns.MX), 0.0))


def _unit(columns: Columns, size: Array) -> Columns:
    return Columns(columns.X / size, columns.KX / size, columns.MX / size, columns.T / size)


def _is_tame(U: Array) -> bool:
    """Whether a Cholesky step loses so few digits that its result is orthonormal to about 1e-12."""
    return bool(np.abs(np.diag(U)).min() > 0.03)


def _orthonormalized(new: Columns, body: FEBody, omega2: float, *, well_conditioned: bool) -> Columns:
    """Return the columns made W-orthonormal once more, with fresh products where the first step lost digits."""
    if not well_conditioned:
        new.KX, new.MX = body.K @ new.X, body.M @ new.X
    G = new.inner(new, omega2)
    return new @ la.solve_triangular(la.cholesky((G + G.T) / 2), np.eye(len(G)))


def _rounding_noise(columns: Columns, body: FEBody, omega2: float) -> Array:
    """W-length of independent rounding errors eps |x_k| in every column, (k,)."""
    diagonal = np.abs(body.K.diagonal()) + omega2 * body.M.diagonal()
    return np.finfo(float).eps * np.sqrt(np.einsum("n,nk,nk->k", diagonal, columns.X, columns.X))
