"""Block Lanczos iteration for the largest eigenvalues of a shift-inverted pencil.

S = (K - sigma M)⁻¹ M is self-adjoint in the inner product (x, y) = xᵀ M y, also where M is only semidefinite. Its
largest eigenvalues theta = 1 / (omega² - sigma) are the modes nearest above the shift.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.arrays import Array
from cms.sparse_product import SymmetricProduct
from cms.tall import combine, inner, subtract

__all__ = ["BlockLanczos", "RitzPairs"]

DEPENDENT = 1e-10  #: length of a new direction against the block it came from, below which it is rounding
CANCELLATION = 1e-6  #: part of a squared length that is left; below it the lengths are measured again
MAX_PASSES = 5


@dataclass(frozen=True, eq=False)
class RitzPairs:
    """Eigenpairs of the projected operator, largest theta first."""

    theta: Array  #: (m,) [s²]
    S: Array  #: vectors over the basis, (m, m)
    residuals: Array  #: |S x - theta x|_M / |theta| of unit x, by the recurrence, (m,)


class BlockLanczos:
    """A growing M-orthonormal basis V with its projection T = Vᵀ M S V, and the block that comes next.

    (1) W = S V_j                                        one block solve
    (2) C = Vᵀ M W; W <- W - V C; twice: full reorthogonalisation, level-3 products
    (3) W = V_{j+1} R by the eigenvectors of Wᵀ M W, dependent directions dropped
    (4) T gains C as its last block column; R couples to the next block
    (5) thick restart when the basis is full: V <- V S of the leading Ritz pairs, whose residuals all lie in V_{j+1}

    Full reorthogonalisation costs a few percent of the solves and leaves no spurious copies to sort out.
    """

    def __init__(
        self, solve: Callable[[Array], Array], M: SymmetricProduct, n: int, *, block: int, capacity: int
    ) -> None:
        self.solve, self.M, self.n, self.block = solve, M, n, block
        self.n_solves = 0
        self.m = 0  # columns of V that T knows
        self._rows = np.empty((min(capacity, n) + block, n))  # V.T: rows are the basis vectors
        self._T = np.zeros((len(self._rows), len(self._rows)))
        self._random = np.random.default_rng(0)
        self._next = self._start()  # (V_{j+1}, M V_{j+1})
        self._R = np.zeros((self._next[0].shape[1], 0))  # coupling of the next block to all of V
        self._ritz: RitzPairs | None = None

    @property
    def V(self) -> Array:
        """The basis, (n, m)."""
        return self._rows[: self.m].T

    @property
    def is_exhausted(self) -> bool:
        """Whether V spans everything the operator can reach."""
        return self._next[0].shape[1] == 0

    @property
    def capacity(self) -> int:
        """Columns V can hold before a restart."""
        return len(self._rows) - self.block

    def grow(self, capacity: int) -> None:
        """Make room for more columns."""
        size = min(capacity, self.n) + self.block
        if size > len(self._rows):
            rows, T = np.empty((size, self.n)), np.zeros((size, size))
            rows[: self.m], T[: self.m, : self.m] = self._rows[: self.m], self._T[: self.m, : self.m]
            self._rows, self._T = rows, T

    def advance(self) -> RitzPairs:
        """Add the next block to the basis; return the Ritz pairs of the larger basis."""
        new, M_new = self._next
        first, last = self.m, self.m + new.shape[1]
        self._rows[first:last] = new.T
        self.m = last
        W, C, R, M_W = self._orthonormalize(self._apply(M_new), wants_coupling=True)
        self._T[:last, first:last] = C
        self._T[first:last, :last] = C.T
        diagonal = self._T[first:last, first:last]
        self._T[first:last, first:last] = (diagonal + diagonal.T) / 2
        self._R = np.zeros((W.shape[1], last))
        self._R[:, first:last] = R
        if W.shape[1] == 0 and last < self.n:  # an invariant subspace: look for what the start did not contain
            W, M_W = self._start()
            self._R = np.zeros((W.shape[1], last))
        self._next = W, M_W
        return self.ritz()

    def ritz(self) -> RitzPairs:
        """Eigenpairs of T with their residuals |R s|."""
        theta, S = la.eigh(self._T[: self.m, : self.m])
        theta, S = theta[::-1], S[:, ::-1]
        scale = np.maximum(np.abs(theta), np.finfo(float).tiny)
        return RitzPairs(theta, S, np.linalg.norm(self._R @ S, axis=0) / scale)

    def restart(self, ritz: RitzPairs, keep: int) -> None:
        """Keep the span of the leading Ritz vectors only; the next block stays."""
        S = np.ascontiguousarray(ritz.S[:, :keep].T)
        for first in range(0, self.n, 65536):  # in place, in slices: no second basis in memory
            part = slice(first, first + 65536)
            self._rows[:keep, part] = S @ self._rows[: self.m, part]
        self._T[: self.m, : self.m] = 0.0
        self._T[np.arange(keep), np.arange(keep)] = ritz.theta[:keep]
        self._R = self._R @ S.T
        self.m = keep

    def _apply(self, M_x: Array) -> Array:
        self.n_solves += M_x.shape[1]
        return self.solve(M_x)

    def _start(self) -> tuple[Array, Array]:
        """Return an M-orthonormal random block in the range of the operator and orthogonal to V, and M times it."""
        width = min(self.block, self.n - self.m)
        random = self._random.standard_normal((self.n, width))
        W, _, _, M_W = self._orthonormalize(self._apply(self.M @ random), wants_coupling=False)
        return W, M_W

    def _orthonormalize(self, W: Array, *, wants_coupling: bool) -> tuple[Array, Array, Array, Array]:
        """Split W = V C + V_new R; return V_new, C, R, M V_new (steps 2 and 3)."""
        V = self.V
        C_sum = np.zeros((self.m, W.shape[1])) if wants_coupling else np.zeros((self.m, 0))
        R_sum = np.eye(W.shape[1])
        M_W = self.M @ W
        largest = np.nan
        for k_pass in range(MAX_PASSES):
            C = inner(V, M_W)
            gram = inner(W, M_W)
            before = np.diag(gram)
            gram = gram - C.T @ C  # of W - V C, as long as little cancels
            subtract(W, V, C)
            if wants_coupling:
                C_sum += C @ R_sum
            if k_pass == 0 and not _is_safe(gram, before):
                M_W = self.M @ W
                gram = inner(W, M_W)
            length2, U = la.eigh((gram + gram.T) / 2)
            if k_pass == 0:
                largest = np.sqrt(max(before.max(initial=0.0), 0.0))
            floor = DEPENDENT * largest if k_pass == 0 else 0.1
            kept = length2 > floor**2
            scaled = U[:, kept] / np.sqrt(length2[kept])
            W = combine(W, scaled)
            R_sum = (U[:, kept] * np.sqrt(length2[kept])).T @ R_sum
            if not kept.any():
                break
            if k_pass and length2.min() > 0.9:  # the pass changed nothing but rounding
                M_W = combine(M_W, scaled)
                break
            M_W = self.M @ W
        return W, C_sum, R_sum, M_W[:, : W.shape[1]]


def _is_safe(gram: Array, before: Array) -> bool:
    """Whether the squared lengths left after the projection are still accurate."""
    return bool(len(gram) and la.eigvalsh((gram + gram.T) / 2)[0] > CANCELLATION * before.max())
