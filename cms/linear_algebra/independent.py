"""Independent columns of a mode set in the norm W = K + omega_1² M, and the redundant columns (docs/theory.md §3).

A Gram matrix squares the condition number of the columns. A small pivot in it therefore does not decide whether a
column is redundant: the remainder of this column is computed, and its length decides. This is a pivoted QR in blocks.

The columns of a body with many interfaces are the largest array of all, so they are not copied. Gram matrices are
computed from a few products K v and M v at a time, one half of each (`Products`). A basis is stored as columns times a
small matrix (`Basis`) until the shapes are needed. Columns may be distributed (`SpreadColumns`); operations on them are
then distributed too.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.linalg.lapack import dpstrf

from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import beside, combine, dots, inner

__all__ = [
    "Basis", "DisplacementColumns", "Products", "gram_in_blocks", "independent_basis", "independent_columns",
    "orthonormal_basis", "within",
]  # fmt: skip

#: remainder of a unit column outside the span, below which the column is redundant (docs/theory.md §3)
RANK_TOLERANCE = 1e-10
#: factor on the rounding error of a column in the W-norm, for rounding errors above the tolerance
ROUNDING_MARGIN = 30.0
TRUSTED_PIVOT = 1e-4  #: remainder above which a pivoted Cholesky of the Gram matrix is trusted
TRUSTED_CONDITION = 1e4  #: condition number of the Gram matrix of unit columns, below which one Cholesky step suffices
PRODUCT_BYTES = 128e6  #: size of products with K or M in memory at a time [bytes]


@dataclass(eq=False)
class DisplacementColumns:
    """Tall, thin block of displacement columns with their products with K and M, and their origin."""

    X: Array  #: displacement columns, (n_dof, k)
    KX: Array  #: K X, (n_dof, k)
    MX: Array  #: M X, (n_dof, k)
    T: Array  #: coefficients over the columns of the mode set, (n_columns, k)

    def __matmul__(self, Z: Array) -> "DisplacementColumns":
        return DisplacementColumns(combine(self.X, Z), combine(self.KX, Z), combine(self.MX, Z), self.T @ Z)

    def __getitem__(self, index: IntArray | slice) -> "DisplacementColumns":
        return DisplacementColumns(self.X[:, index], self.KX[:, index], self.MX[:, index], self.T[:, index])

    def beside(self, *others: "DisplacementColumns") -> "DisplacementColumns":
        """Return blocks of columns side by side."""
        blocks = (self, *others)
        return DisplacementColumns(*(beside(*(getattr(each, a) for each in blocks)) for a in ("X", "KX", "MX", "T")))

    def inner(self, other: "DisplacementColumns", omega2: float) -> Array:
        """Return selfᵀ (K + omega² M) other."""
        return inner(self.X, other.KX) + omega2 * inner(self.X, other.MX)


@dataclass(frozen=True, eq=False)
class Products:
    """Products of displacement columns with the stiffness and mass of a body, in blocks of columns."""

    K: SymmetricProduct
    M: SymmetricProduct

    @classmethod
    def of_body(cls, body: FEBody) -> "Products":
        """Return the products for the matrices of a body."""
        return cls(SymmetricProduct(body.K), SymmetricProduct(body.M))

    def beside(self, X: Array) -> DisplacementColumns:
        """Return the columns together with their products, (n_dof, k)."""
        return DisplacementColumns(X, self.K @ X, self.M @ X, np.eye(X.shape[1]))


def gram_in_blocks(X: Array, A: SymmetricProduct) -> Array:
    """Return Xᵀ A X, (k, k), for symmetric A: one half is computed, from blocks of A X that are freed after use."""
    n, k = X.shape
    width = max(16, int(PRODUCT_BYTES / (8 * max(n, 1))))
    G = np.zeros((k, k))
    for first in range(0, k, width):
        last = min(first + width, k)
        G[:last, first:last] = inner(X[:, :last], A @ X[:, first:last])
        G[first:last, :first] = G[:first, first:last].T
        own = G[first:last, first:last]
        G[first:last, first:last] = (own + own.T) / 2
    return G


@dataclass(frozen=True, eq=False)
class Basis:
    """W-orthonormal columns Q = X Z that span a mode set."""

    X: Array  #: columns from which Q is combined, (n_dof, l)
    Z: Array  #: coefficients of Q over X, (l, k)
    T: Array  #: coefficients of Q over the columns of the mode set, (n_columns, k)
    G_K: Array  #: Qᵀ K Q, (k, k)
    G_M: Array  #: Qᵀ M Q, (k, k)
    is_formed: bool = True  #: False: X are the columns of the mode set themselves, which must not change

    def inner(self, F: Array) -> Array:
        """Return Qᵀ F, (k, n)."""
        return self.Z.T @ inner(self.X, F)

    def combine(self, C: Array) -> Array:
        """Return Q C, (n_dof, n)."""
        return combine(self.X, self.Z @ C)

    def columns(self, products: Products) -> DisplacementColumns:
        """Return the columns of Q with their products, (n_dof, k)."""
        Q = products.beside(self.combine(np.eye(self.Z.shape[1])))
        Q.T = self.T
        return Q

    def with_columns(self, new: DisplacementColumns) -> "Basis":
        """Return the basis extended by W-orthonormal columns that are W-orthogonal to it."""
        sides = []
        for G, product in ((self.G_K, new.KX), (self.G_M, new.MX)):
            across, own = self.inner(product), inner(new.X, product)
            sides.append(np.block([[G, across], [across.T, (own + own.T) / 2]]))
        k, width = new.X.shape[1], self.X.shape[1]
        Z = np.zeros((width + k, self.Z.shape[1] + k))
        Z[:width, :-k], Z[width:, -k:] = self.Z, np.eye(k)
        G_K, G_M = sides
        return Basis(beside(self.X, new.X), Z, np.hstack([self.T, new.T]), G_K, G_M)


def independent_columns(V: Array, body: FEBody, omega2: float) -> tuple[DisplacementColumns, IntArray]:
    """Return W-orthonormal columns of the same span with their products, and the indices of redundant columns.

    Parameters
    ----------
    V
        The columns of a mode set, (n_dof, n_columns).
    omega2
        omega_1² in W = K + omega_1² M [1/s²].

    Returns
    -------
    basis
        W-orthonormal columns; T expresses them in V. There are none if all columns are zero or rounding.
    redundant
        Indices of columns with a remainder below the tolerance, ascending.
    """
    products = Products.of_body(body)
    G_K, G_M = gram_in_blocks(V, products.K), gram_in_blocks(V, products.M)
    basis, redundant = independent_basis(V, G_K, G_M, products, body, omega2)
    return basis.columns(products), redundant


def independent_basis(
    V: Array, G_K: Array, G_M: Array, products: Products, body: FEBody, omega2: float
) -> tuple[Basis, IntArray]:
    """Return a W-orthonormal basis of the span of columns, W = K + omega_1² M, and the indices of redundant columns.

    (1) pivoted Cholesky of the Gram matrix of unit columns selects columns with pivots above `TRUSTED_PIVOT`
    (2) if no column is left and the Gram matrix is well conditioned, its factor gives the basis: Q = V Z
    (3) otherwise compute Q, and orthonormalise it once more by its own Gram matrices
    (4) compute the remainders of the other columns outside Q, drop those that are redundant, and repeat from (1)

    Parameters
    ----------
    V
        Columns, (n_dof, n_columns).
    G_K, G_M
        Vᵀ K V and Vᵀ M V, (n_columns, n_columns).
    omega2
        omega_1² [1/s²].
    """
    length = np.sqrt(np.maximum(np.diag(G_K) + omega2 * np.diag(G_M), 0.0))
    is_zero = length <= np.finfo(float).tiny
    redundant, index = list(np.flatnonzero(is_zero)), np.flatnonzero(~is_zero)
    if not len(index):
        return _no_columns(V), np.asarray(redundant, dtype=np.int64)
    size = length[index]
    diagonal = np.abs(body.K.diagonal()) + omega2 * body.M.diagonal()
    noise = np.finfo(float).eps * np.sqrt(dots(V, V, diagonal))[index]  # W-length of rounding errors eps |v_k|
    tolerance = np.maximum(RANK_TOLERANCE, ROUNDING_MARGIN * noise / size)
    # tall arrays are not changed: lengths and pivot order go into the small matrices
    W = (G_K + omega2 * G_M)[np.ix_(index, index)] / np.outer(size, size)
    taken, left, factor = _pivoted(W)  # step (1)
    Z = np.zeros((V.shape[1], len(taken)))
    Z[index[taken]] = factor / size[taken, None]
    if not len(left) and np.linalg.cond(W) < TRUSTED_CONDITION:  # (2)
        return Basis(V, Z, Z, within(G_K, Z), within(G_M, Z), is_formed=False), np.asarray(redundant, dtype=np.int64)
    basis = orthonormal_basis(combine(V, Z), Z, products, omega2)  # (3)
    if not len(left):
        return basis, np.asarray(redundant, dtype=np.int64)
    rest = products.beside(V[:, index[left]] / size[left])
    rest.T = np.zeros((V.shape[1], len(left)))
    rest.T[index[left], np.arange(len(left))] = 1 / size[left]
    index, tolerance, remainder = index[left], tolerance[left], np.ones(len(left))
    while len(index):  # (4)
        for _ in range(2):  # two passes suffice
            C = basis.inner(rest.KX + omega2 * rest.MX)
            T = rest.T - basis.T @ C
            # compute the products anew, because the difference has lost its leading digits
            rest = products.beside(rest.X - basis.combine(C))
            rest.T = T
        size = _length(rest, omega2)
        remainder = remainder * size
        is_kept = remainder > tolerance
        redundant += list(index[~is_kept])
        index, tolerance, remainder, size = index[is_kept], tolerance[is_kept], remainder[is_kept], size[is_kept]
        if not len(index):
            break
        rest = rest[np.flatnonzero(is_kept)]
        taken, left, factor = _pivoted(rest.inner(rest, omega2) / np.outer(size, size))
        Z = np.zeros((len(index), len(taken)))
        Z[taken] = factor / size[taken, None]
        new = rest @ Z
        basis = basis.with_columns(_orthonormalized(products, new, omega2))
        rest = _unit(rest[left], size[left])
        index, tolerance, remainder = index[left], tolerance[left], remainder[left]
    return basis, np.sort(np.asarray(redundant, dtype=np.int64))


def _no_columns(V: Array) -> Basis:
    """Return an empty basis, used if all columns are zero or rounding."""
    none = np.zeros((0, 0))
    return Basis(V, np.zeros((V.shape[1], 0)), np.zeros((V.shape[1], 0)), none, none, is_formed=False)


def _pivoted(W: Array) -> tuple[IntArray, IntArray, Array]:
    """Return the columns chosen by pivoted Cholesky of a Gram matrix, the other columns, and the inverse factor."""
    factor, pivots, rank, _ = dpstrf((W + W.T) / 2, tol=TRUSTED_PIVOT**2, lower=0)
    U = np.triu(factor[:rank, :rank])
    return pivots[:rank] - 1, pivots[rank:] - 1, la.solve_triangular(U, np.eye(rank))


def orthonormal_basis(Q: Array, T: Array, products: Products, omega2: float) -> Basis:
    """Orthonormalise nearly W-orthonormal columns to rounding, and return them as a basis."""
    G_K, G_M = gram_in_blocks(Q, products.K), gram_in_blocks(Q, products.M)
    Z = la.solve_triangular(la.cholesky(G_K + omega2 * G_M), np.eye(len(G_K)))
    return Basis(Q, Z, T @ Z, within(G_K, Z), within(G_M, Z))


def within(G: Array, Z: Array) -> Array:
    """Transform a Gram matrix to other columns: Zᵀ G Z, symmetric."""
    H = Z.T @ G @ Z
    return np.asarray((H + H.T) / 2)


def _length(columns: DisplacementColumns, omega2: float) -> Array:
    """Return the W-norm of each column, (k,)."""
    stiff = dots(columns.X, columns.KX)
    return np.sqrt(np.maximum(stiff + omega2 * dots(columns.X, columns.MX), 0.0))


def _unit(columns: DisplacementColumns, size: Array) -> DisplacementColumns:
    return DisplacementColumns(columns.X / size, columns.KX / size, columns.MX / size, columns.T / size)


def _orthonormalized(products: Products, new: DisplacementColumns, omega2: float) -> DisplacementColumns:
    """Orthonormalise the columns in the W-norm again, with recomputed products, because the first pass lost digits."""
    fresh = products.beside(new.X)
    fresh.T = new.T
    G = fresh.inner(fresh, omega2)
    return fresh @ la.solve_triangular(la.cholesky((G + G.T) / 2), np.eye(len(G)))
