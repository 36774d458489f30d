"""Modes better and better: inverse iteration by the tree with Rayleigh-Ritz, and what error is left."""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.solvers.sparse_product import SymmetricProduct
from cms.solvers.tall import combine, combined, inner
from cms.substructures.tree import SubstructureTree
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["COLUMNS", "SLICE", "ApproximateModes", "groups"]

COLUMNS = 128  #: of a block
SLICE = 16384  #: rows that are put elsewhere at a time
SAME_SIZE = 16  #: groups of modes of one size, whose residuals are measured by one column each


class ApproximateModes:
    """Approximate modes X of K x = omega² M x, M-orthonormal; they change in place.

    All rows are in the order of elimination.
    """

    def __init__(self, tree: SubstructureTree, K: sp.csc_array, M: sp.csc_array, omega2: Array, X: Array) -> None:
        self.tree = tree
        self.K, self.M = (SymmetricProduct(A, columns=COLUMNS) for A in (K, M))
        self.omega2 = omega2  #: Rayleigh quotients, (p,)
        self.X = X  #: (n, p), C order
        self.residuals = np.full(len(omega2), np.nan)  #: |r|_K / omega of the modes before the last step, (p,)
        self.n_solves = 0

    def improve(self) -> None:
        """Take one step of subspace iteration; r = x - omega² K⁻¹ M x is the residual of what was there before.

        (1) Y = K⁻¹ M X, block by block in the place of X
        (2) H = Yᵀ K Y = Yᵀ M X;  G = Yᵀ M Y
        (3) |r|²_K = omega² (omega² H_jj - 1), for xᵀ K x = omega²
        (4) H z = omega² G z;  X <- Y Z
        """
        p = len(self.omega2)
        H, G = np.zeros((p, p)), np.zeros((p, p))
        for first in range(0, p, COLUMNS):
            stop = min(first + COLUMNS, p)
            M_X = self.M @ self.X[:, first:stop]
            Y = M_X.copy()  # (1)
            self.tree.solve_ordered(Y)
            self.n_solves += stop - first
            self.X[:, first:stop] = Y
            H[:stop, first:stop] = inner(self.X[:, :stop], M_X)  # (2)
            del M_X
            G[:stop, first:stop] = inner(self.X[:, :stop], self.M @ Y)
        H, G = (np.triu(A) + np.triu(A, 1).T for A in (H, G))
        self.residuals = np.sqrt(np.maximum(self.omega2 * np.diag(H) - 1, 0.0))  # (3)
        scale = np.sqrt(np.diag(H))
        self.omega2, Z = la.eigh(H / np.outer(scale, scale), G / np.outer(scale, scale))  # (4)
        self.X = combined(self.X, Z / scale[:, None])

    def errors(self, count: int) -> Array:
        """Return about how much too high each of the first frequencies is at most, relative, (count,).

        (1) r = x - omega² K⁻¹ M x of each mode, or of a group of modes together: the sum of r_j / omega_j with random
            signs has the expected squared length of all of them, which bounds that of each
        (2) a = |r|²_K / omega²,  b = |r|²_M
        (3) (a + b / (1 - omega² / omega_next²)) / 2, omega_next that of the first mode that does not take part
            (docs/theory.md §2)
        """
        of_mode = groups(count)
        n_groups = int(of_mode.max(initial=-1)) + 1
        pick = np.zeros((count, n_groups))
        pick[np.arange(count), of_mode] = np.random.default_rng(0).choice([-1.0, 1.0], size=count)
        omega = np.sqrt(self.omega2[:count])
        X = self.X[:, :count]
        S_x = self.M @ combine(X, pick * omega[:, None])  # (1)
        self.tree.solve_ordered(S_x)
        self.n_solves += n_groups
        r = combine(X, pick / omega[:, None])
        r -= S_x
        del S_x
        a, b = (np.maximum(np.einsum("nk,nk->k", r, A @ r), 0.0)[of_mode] for A in (self.K, self.M))  # (2)
        apart = 1 - self.omega2[:count] / self.omega2[-1]
        return (a + self.omega2[:count] * b / np.maximum(apart, np.finfo(float).eps)) / 2  # (3)

    def into(self, Phi: Array, rows: IntArray) -> None:
        """Put the leading modes into these rows of Phi, (n_dof, k)."""
        for a in range(0, self.tree.n, SLICE):
            Phi[rows[a : a + SLICE]] = self.X[a : a + SLICE, : Phi.shape[1]]


def groups(count: int) -> IntArray:
    """Return the group of each mode, (count,): the highest stand alone, downwards groups of 2, 4, 8 ...

    The lower a frequency, the smaller its error, so that more of them together may stand for each.
    """
    sizes: list[int] = []
    while sum(sizes) < count:
        sizes.append(min(2 ** (len(sizes) // SAME_SIZE), count - sum(sizes)))
    return np.repeat(np.arange(len(sizes)), sizes)[::-1].copy()
