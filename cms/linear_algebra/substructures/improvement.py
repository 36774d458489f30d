"""Improvement of modes by inverse iteration with the tree and Rayleigh-Ritz, and an estimate of the remaining error."""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.special import gammaincinv

from cms.linear_algebra.solvers.sparse_product import SymmetricProduct
from cms.linear_algebra.solvers.tall import combine, combined, inner
from cms.linear_algebra.substructures.tree import SubstructureTree
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["COLUMNS", "PROBES", "SLICE", "ApproximateModes"]

COLUMNS = 128  #: columns of a block
SLICE = 16384  #: rows that are moved at a time
PROBES = 64  #: random columns that measure the residuals of any number of modes
RARE = 1e-3  #: share of the modes whose residual the probes underestimate
SUMS = 16  #: number of neighbouring modes whose residuals are measured together
FEW = 0.25  #: share of the modes up to which doubtful ones are measured individually


class ApproximateModes:
    """Approximate modes X of K x = omega² M x, M-orthonormal; they are changed in place.

    X may contain only the leading modes of a longer list of frequencies. All rows are in elimination order.
    """

    def __init__(self, tree: SubstructureTree, K: sp.csc_array, M: sp.csc_array, omega2: Array, X: Array) -> None:
        self.tree = tree
        self.K, self.M = (SymmetricProduct(A, columns=COLUMNS) for A in (K, M))
        self.omega2 = omega2  #: Rayleigh quotients, (p,)
        self.X = X  #: (n, p), C order, with the given number of columns
        self.residuals = np.full(len(omega2), np.nan)  #: |r|_K / omega of the modes before the last step, (p,)
        self.n_solves = 0

    def improve(self) -> None:
        """Take one step of subspace iteration; r = x - omega² K⁻¹ M x is the residual of the previous modes.

        (1) Y = K⁻¹ M X, block by block in the memory of X
        (2) H = Yᵀ K Y = Yᵀ M X;  G = Yᵀ M Y
        (3) |r|²_K = omega² (omega² H_jj - 1), because xᵀ K x = omega²
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

    def errors(self, count: int, tolerance: float = np.inf) -> Array:
        """Return an estimate of the relative error of each of the first frequencies (they are too high), (count,).

        (1) r = x - omega² K⁻¹ M x,  a = |r|²_K / omega²,  b = |r|²_M  for each mode, with one solve for each
        (2) for many modes: a from above by random probes; b / a from sums of neighbours, r_j / omega_j with random
            signs
        (3) (a + b / (1 - omega² / omega_next²)) / 2, where omega_next is the first mode that does not take part
            (docs/theory.md §2)
        (4) repeat (1) for those that (2) finds above the tolerance, at most for the worst `PROBES`
        """
        if count <= PROBES:
            return self._errors_of(*self._residuals_of_sums(np.eye(count)), np.arange(count))
        a = self._probed(count)  # (2)
        of_mode = np.arange(count) * SUMS // count
        pick = np.zeros((count, SUMS))
        pick[np.arange(count), of_mode] = np.random.default_rng(0).choice([-1.0, 1.0], size=count)
        a_sum, b_sum = self._residuals_of_sums(pick)
        b = a * (b_sum / np.maximum(a_sum, np.finfo(float).tiny))[of_mode]
        errors = self._errors_of(a, b, np.arange(count))
        doubtful = np.flatnonzero(errors > tolerance)  # (4)
        if 0 < len(doubtful) <= FEW * count:
            doubtful = doubtful[np.argsort(-errors[doubtful])][:PROBES]
            errors[doubtful] = self._errors_of(*self._residuals_of_sums(np.eye(count)[:, doubtful]), doubtful)
        return errors

    def _errors_of(self, a: Array, b: Array, which: IntArray) -> Array:
        """Step (3): return the error of some modes from a, and b / omega², of each."""
        omega2 = self.omega2[which]
        apart = 1 - omega2 / self.omega2[-1]
        return (a + omega2 * b / np.maximum(apart, np.finfo(float).eps)) / 2

    def _residuals_of_sums(self, pick: Array) -> tuple[Array, Array]:
        """Step (1): return a, and b / omega², for sums of r_j / omega_j with coefficients in pick, (count, m)."""
        r = self._residuals(pick)
        a, b = (np.maximum(np.einsum("nk,nk->k", r, A @ r), 0.0) for A in (self.K, self.M))
        return a, b

    def _residuals(self, pick: Array) -> Array:
        """Return sums of r_j / omega_j, r = x - omega² K⁻¹ M x, (n, m), with the coefficients pick, (count, m)."""
        count, m = pick.shape
        omega = np.sqrt(self.omega2[:count])
        X = self.X[:, :count]
        S_x = self.M @ combine(X, pick * omega[:, None])
        self.tree.solve_ordered(S_x)
        self.n_solves += m
        r = combine(X, pick / omega[:, None])
        r -= S_x
        return r

    def _probed(self, count: int) -> Array:
        """Step (2): return an upper bound of a for each mode, valid except for one mode in a thousand, (count,).

        With y = omega² M x - K x, a is yᵀ K⁻¹ y / omega². For probes w with covariance K⁻¹, (wᵀ y)² has this as its
        mean, and a sum over the probes has a chi² distribution. It is divided by the quantile below which it hardly
        ever lies.
        """
        W = np.random.default_rng(0).standard_normal((self.tree.n, PROBES))
        self.tree.spread_ordered(W)
        X, omega2 = self.X[:, :count], self.omega2[:count, None]
        y = omega2 * inner(X, self.M @ W)
        y -= inner(X, self.K @ W)
        return (y**2).sum(axis=1) / (2 * gammaincinv(PROBES / 2, RARE)) / omega2[:, 0]

    def into(self, Phi: Array, rows: IntArray) -> None:
        """Write the leading modes into these rows of Phi, (n_dof, k)."""
        for a in range(0, self.tree.n, SLICE):
            Phi[rows[a : a + SLICE]] = self.X[a : a + SLICE, : Phi.shape[1]]
