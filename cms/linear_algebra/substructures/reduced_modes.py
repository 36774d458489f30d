"""The lowest modes of the reduced pencil, which has a diagonal stiffness and a mass with blocks along the tree."""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.special import gammaincinv

from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.solvers.factorization import Inertia
from cms.linear_algebra.solvers.registry import solver_of
from cms.linear_algebra.substructures.reduced_mass import ReducedMass
from cms.linear_algebra.substructures.tree import SubstructureTree
from fe_models.foundation.arrays import Array, IntArray, symmetric_part
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import combine, combined, inner

__all__ = ["COLUMNS", "PROBES", "SLICE", "ApproximateModes", "reduced_modes", "reduced_omega2"]


# improvement ----------------------------------------------------------------------------------------------------------
# Improvement of modes by inverse iteration with the tree and Rayleigh-Ritz, and an estimate of the remaining error.


COLUMNS = 128  #: number of columns in a block
SLICE = 16384  #: number of rows that are moved at a time
PROBES = 64  #: number of random columns that measure the residuals of all modes
RARE = 1e-3  #: share of the modes whose residual the random columns may underestimate
SUMS = 16  #: number of neighbouring modes whose residuals are measured together
FEW = 0.25  #: share of the modes up to which doubtful modes are measured individually


class ApproximateModes:
    """Approximate modes X of K x = omega² M x, M-orthonormal; they are changed in place.

    X may contain only the leading modes of a longer list of frequencies. All rows are in elimination order.
    """

    def __init__(self, tree: SubstructureTree, K: sp.csc_array, M: sp.csc_array, omega2: Array, X: Array) -> None:
        self.tree = tree
        self.K, self.M = (SymmetricProduct(A, columns=COLUMNS) for A in (K, M))
        self.omega2 = omega2  #: Rayleigh quotients of the modes, (p,)
        self.X = X  #: leading modes, (n, p), in C order
        self.residuals = np.full(len(omega2), np.nan)  #: residual |r|_K / omega of each mode before the last step, (p,)
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
        """Return an estimate of the relative error of each of the first frequencies, (count,); all are too high.

        (1) r = x - omega² K⁻¹ M x,  a = |r|²_K / omega²,  b = |r|²_M  for each mode, with one solve for each
        (2) for many modes: a from above by random probes; b / a from sums of neighbours, r_j / omega_j with random
            signs
        (3) (a + b / (1 - omega² / omega_next²)) / 2, where omega_next belongs to the first mode that is not iterated
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
        """Step (3): return the error of some modes, from a and b / omega² of each mode."""
        omega2 = self.omega2[which]
        apart = 1 - omega2 / self.omega2[-1]
        return (a + omega2 * b / np.maximum(apart, np.finfo(float).eps)) / 2

    def _residuals_of_sums(self, pick: Array) -> tuple[Array, Array]:
        """Step (1): return a and b / omega² for sums of r_j / omega_j with coefficients `pick`, (count, m)."""
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

        With y = omega² M x - K x, a is yᵀ K⁻¹ y / omega². For random probes w with covariance K⁻¹, (wᵀ y)² has the mean
        omega² a, and its sum over the probes has a chi² distribution. The sum is divided by the quantile of probability
        `RARE`.
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


# reduced modes --------------------------------------------------------------------------------------------------------


START = 5  #: number of substructure modes per wanted mode in the first pencil of the search
DENSE = 3000  #: number of substructure modes up to which dense matrices are fast and small
TOLERANCE = 1e-4  #: tolerated residual of the iteration, far below the error due to substructuring
WIDER = 4  #: ratio between numbers of substructure modes in successive pencils
SETTLED = 5e-5  #: relative error of omega² at which the iteration ends
LAG = 4.0  #: factor on the estimated error after a step, which considers only much higher modes
MOST_STEPS = 20


class Diagonal:
    """Inverse of a diagonal matrix with the interface that the eigensolver needs."""

    description = "a diagonal"

    def __init__(self, d: Array) -> None:
        self.d, self.n = d, len(d)
        self.inertia = Inertia(0, 0, len(d))
        self.solver = solver_of()

    def solve(self, b: Array) -> Array:
        """Return d⁻¹ b, (n, k)."""
        return b / self.d[:, None]


def reduced_modes(omega2: Array, M: ReducedMass, count: int) -> tuple[Array, Array]:
    """Return the lowest `count` eigenvalues, ascending, and M-orthonormal vectors, (n, count).

    (1) solve the pencil of the lowest substructure modes, some for each wanted mode
    (2) use four times as many, and so on up to all, and add the new modes by a first-order correction; if this is not
        accurate enough, continue by subspace iteration from these vectors
    """
    n = len(omega2)
    few = min(n, max(START * count, DENSE // 2))
    if 2 * few >= n:
        return _at_once(omega2, M, count)
    is_in = _lowest(omega2, few)
    lam, Z = _at_once(omega2[is_in], M.of(is_in), count)  # (1)
    while not is_in.all():  # (2)
        few *= WIDER
        before, is_in = is_in, _lowest(omega2, few) if 2 * few < n else np.ones(n, dtype=bool)
        part, is_new, cut = M.of(is_in), ~before[is_in], float(omega2[is_in & ~before].min())
        found, Z = _widened(omega2[is_in], part, lam, Z, is_new)
        is_settled, lam = _is_settled(lam, found, cut), found
        if not is_settled:
            lam, Z = _iterated(omega2[is_in], part, lam, Z, cut)
    return lam, Z


def _widened(omega2: Array, M: ReducedMass, lam: Array, Z: Array, is_new: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Step (2): return the eigenpairs with new substructure modes in addition to those of Z, (n_old, k).

    (1) components of a step of subspace iteration along the new modes, d = D⁻¹ M_no Z Lambda; the step only scales Z
    (2) H = Lambda + B,  B = dᵀ D d;  G = 1 + A + Aᵀ + dᵀ M_nn d,  A = dᵀ M_no Z = B Lambda⁻¹
    (3) H c = lam G c,  Z <- [Z; d] C
    """
    whole = np.zeros((len(omega2), Z.shape[1]))
    d = M.between(is_new, ~is_new, Z) * lam / omega2[is_new, None]  # (1)
    root = np.sqrt(omega2[is_new])[:, None] * d
    B = inner(root, root)  # (2)
    del root
    G = np.eye(len(lam)) + B / lam + (B / lam).T + symmetric_part(inner(d, M.of(is_new) @ d))
    lam, C = la.eigh(np.diag(lam) + B, G)  # (3)
    whole[~is_new], whole[is_new] = Z, d
    return lam, combined(whole, C)


def _is_settled(before: Array, lam: Array, cut: float) -> bool:
    """Return whether the error that remains after a step, as a share of the last change, is small.

    The missing part of the modes lies along modes above the cut; a step reduces it by a factor of about (lam / cut)².
    """
    left = (before / lam - 1) * np.minimum(LAG * (lam / cut) ** 2, 0.5)
    return bool((left <= SETTLED).all())


def _lowest(omega2: Array, few: int) -> NDArray[np.bool_]:
    return omega2 <= np.partition(omega2, few - 1)[few - 1]


def _iterated(omega2: Array, M: ReducedMass, lam: Array, Z: Array, cut: float) -> tuple[Array, Array]:
    """Step (2): subspace iteration Y = D⁻¹ M Z, D = diag(omega²), H = Yᵀ D Y, G = Yᵀ M Y, H c = lam G c, Z <- Y C.

    It ends when the error after a step is small.
    """
    M_Z = M @ Z
    for _ in range(MOST_STEPS):
        before = lam
        Y = M_Z / omega2[:, None]
        H, M_Y = inner(Y, M_Z), M @ Y
        scale = 1 / np.sqrt(np.diag(H))
        lam, C = la.eigh(H * np.outer(scale, scale), inner(Y, M_Y) * np.outer(scale, scale))
        C *= scale[:, None]
        Z, M_Z = combine(Y, C), combine(M_Y, C)
        if _is_settled(before, lam, cut):
            break
    return lam, Z


def _at_once(omega2: Array, M: ReducedMass, count: int) -> tuple[Array, Array]:
    """Solve densely: with D = diag(omega²), the largest eigenvalues of D^-½ M D^-½ are 1 / omega² of the modes."""
    n = len(omega2)
    if n > DENSE and 3 * count < n:
        found = eigenmodes(
            sp.csc_array(sp.diags_array(omega2)), M.tocsc(), count, factorization=Diagonal(omega2), tolerance=TOLERANCE
        )
        return np.array(found.omega2), np.array(found.Phi)
    A, scale = _scaled(omega2, M)
    theta, Z = la.eigh(A, subset_by_index=(n - count, n - 1), overwrite_a=True)
    theta, Z = theta[::-1], Z[:, ::-1]
    return 1 / theta, scale[:, None] * Z / np.sqrt(theta)


def reduced_omega2(omega2: Array, M: ReducedMass, k: int) -> float:
    """Return the k-th lowest eigenvalue, k from 1, from dense matrices."""
    n = len(omega2)
    A, _ = _scaled(omega2, M)
    theta = la.eigh(A, subset_by_index=(n - k, n - k), overwrite_a=True, eigvals_only=True)
    return float(1 / theta[0])


def _scaled(omega2: Array, M: ReducedMass) -> tuple[Array, Array]:
    """Return D^-½ M D^-½ and the diagonal of D^-½."""
    scale = 1 / np.sqrt(omega2)
    return scale[:, None] * M.toarray() * scale, scale
