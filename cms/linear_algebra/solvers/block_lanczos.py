"""Block Lanczos iteration for the largest eigenvalues of a shift-inverted pencil.

S = (K - sigma M)⁻¹ M is self-adjoint in the inner product (x, y) = xᵀ M y, even if M is only semidefinite. Its largest
eigenvalues theta = 1 / (omega² - sigma) belong to the modes nearest above the shift.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la

from cms.linear_algebra.solvers.tall_space import TallProduct, TallSpace
from fe_models.foundation.arrays import Array

__all__ = ["BlockLanczos", "RitzPairs"]

DEPENDENT = 1e-10  #: length of a new direction relative to its block, below which it is rounding
TAME = 1e-3  #: ratio of shortest to longest new direction, above which one pass makes them orthogonal to 1e-13
SETTLED = 1e-12  #: share of the shortest new direction that a pass may remove without a new product with M
ROUNDOFF = 1e-14  #: defect of M-orthonormal columns that is not corrected
MAX_PASSES = 5


@dataclass(frozen=True, eq=False)
class RitzPairs:
    """Eigenpairs of the projected operator, largest theta first."""

    theta: Array  #: (m,) [s²]
    S: Array  #: vectors over the basis, (m, m)
    coupling: Array  #: of S x - theta x to the next block, (b, m) [s²]
    residuals: Array  #: |S x - theta x|_M / |theta| for unit x, from the recurrence, (m,)


class BlockLanczos:
    """A growing M-orthonormal basis V with its projection T = Vᵀ M S V, and the next block.

    (1) W = S V_j                                                 one block solve
    (2) A = V_jᵀ M W; W <- W - V Rᵀ - V_j A                       the recurrence: R couples V_j to the basis before it
    (3) C = Vᵀ M W; W <- W - V C                                  full reorthogonalisation of the remainder
    (4) W = V_{j+1} R from the eigenvectors of Wᵀ M W, without dependent directions; (3) and (4) are repeated if W was
        nearly dependent
    (5) T gets the block column [Rᵀ; A] + C; R of (4) couples to the next block
    (6) thick restart when the basis is full: V <- V X of the leading Ritz pairs, whose residuals all lie in V_{j+1}

    Full reorthogonalisation avoids spurious copies. One pass suffices, because (2) has removed everything except
    rounding. Blocks have the memory order of the solver; the basis is stored column by column.
    """

    def __init__(
        self, solve: Callable[[Any], Any], M: TallProduct, space: TallSpace, *, block: int, capacity: int
    ) -> None:
        """Start with a random block; solve and M map columns of the space to columns of the space."""
        self.solve, self.M, self.space, self.n, self.block = solve, M, space, space.n, block
        self.n_solves = 0
        self.m = 0  # number of columns of V that are in T
        self._basis = space.basis(min(capacity, self.n) + block)
        self._T = np.zeros((self._basis.capacity, self._basis.capacity))
        self._random = np.random.default_rng(0)
        self._M_next = self._start()  # M V_{j+1}; V_{j+1} itself is stored after V
        self._R = np.zeros((self._M_next.shape[1], 0))  # coupling of the next block to all of V
        self._coupled = 0  # first column of V to which the next block is coupled

    @property
    def V(self) -> Any:
        """The basis, (n, m)."""
        return self._basis.columns(0, self.m)

    @property
    def V_and_next(self) -> Any:
        """The basis and the next block, (n, m + b)."""
        return self._basis.columns(0, self.m + self._M_next.shape[1])

    @property
    def is_exhausted(self) -> bool:
        """Whether V spans the complete range of the operator."""
        return self._M_next.shape[1] == 0

    @property
    def capacity(self) -> int:
        """Number of columns that V can hold before a restart."""
        return self._basis.capacity - self.block

    def grow(self, capacity: int) -> None:
        """Allocate memory for more columns."""
        size = min(capacity, self.n) + self.block
        if size > self._basis.capacity:
            T = np.zeros((size, size))
            T[: self.m, : self.m] = self._T[: self.m, : self.m]
            self._basis.grow(size, self.V_and_next.shape[1])
            self._T = T

    def advance(self) -> None:
        """Add the next block to the basis."""
        M_new = self._M_next
        first, last = self.m, self.m + M_new.shape[1]
        block = slice(first, last)
        self.m = last
        W = self._apply(M_new)  # (1)
        A = self.space.inner(M_new, W)  # (2)
        near = np.concatenate([self._R[:, self._coupled :].T, A])
        self.space.subtract(W, self._basis.columns(self._coupled, self.m), near)
        C, R, M_next = self._append(W, np.linalg.norm(near, axis=0).max())  # (3), (4)
        C[self._coupled :] += near  # (5)
        self._T[:last, block] = C
        self._T[block, :last] = C.T
        self._T[block, block] = (C[block] + C[block].T) / 2
        self._R = np.zeros((len(R), last))
        self._R[:, block] = R
        self._coupled = first
        # an invariant subspace: search directions that the start block did not contain
        if len(R) == 0 and last < self.n:
            M_next = self._start()
            self._R = np.zeros((M_next.shape[1], last))
            self._coupled = last
        self._M_next = M_next

    def ritz(self) -> RitzPairs:
        """Return the eigenpairs of T with their residuals |R s|."""
        theta, S = la.eigh(self._T[: self.m, : self.m])
        theta, S = theta[::-1], S[:, ::-1]
        scale = np.maximum(np.abs(theta), np.finfo(float).tiny)
        coupling = self._R @ S
        return RitzPairs(theta, S, coupling, np.linalg.norm(coupling, axis=0) / scale)

    def restart(self, ritz: RitzPairs, keep: int) -> None:
        """Keep only the span of the leading Ritz vectors; the next block stays."""
        S = ritz.S[:, :keep]
        self._basis.turn(self.m, S)
        self._basis.put(keep, self._basis.columns(self.m, self.m + len(self._R)))
        self._T[: self.m, : self.m] = 0.0
        self._T[np.arange(keep), np.arange(keep)] = ritz.theta[:keep]
        self._R = self._R @ S
        self._coupled = 0
        self.m = keep

    def _apply(self, M_x: Any) -> Any:
        self.n_solves += M_x.shape[1]
        return self.solve(M_x)

    def _start(self) -> Any:
        """Append an M-orthonormal random block in the range of the operator, orthogonal to V; return M times it."""
        width = min(self.block, self.n - self.m)
        _, _, M_W = self._append(self._apply(self.M @ self.space.random(self._random, width)), 0.0)
        return M_W

    def _append(self, W: Any, length: float) -> tuple[Array, Array, Any]:
        """Split W = V C + V_next R, with V_next stored after V; return C, R, M V_next (steps 3, 4). W is overwritten.

        `length` is the length of the part removed from W earlier; a remainder is rounding relative to it.
        """
        V, inner, combined = self.V, self.space.inner, self.space.combined
        C_sum = np.zeros((self.m, W.shape[1]))
        R_sum = np.eye(W.shape[1])
        M_W = self.M @ W
        for k_pass in range(MAX_PASSES):
            C = inner(V, M_W)
            gram = _symmetric(inner(W, M_W))
            longest = np.sqrt(max(np.diag(gram).max(initial=0.0), 0.0))
            self.space.subtract(W, V, C)
            C_sum += C @ R_sum
            gram -= C.T @ C  # Gram matrix of W - V C, accurate as long as cancellation is small
            taken = np.abs(C).max(initial=0.0)
            if not taken**2 <= SETTLED**2 * la.eigvalsh(gram)[0]:
                M_W = self.M @ W
                gram = _symmetric(inner(W, M_W))
            length2, U = la.eigh(gram)
            floor = DEPENDENT * max(length, longest) if k_pass == 0 else 0.1
            kept = length2 > floor**2
            scaled = U[:, kept] / np.sqrt(length2[kept])
            W, M_W = combined(W, scaled), combined(M_W, scaled)
            R_sum = (U[:, kept] * np.sqrt(length2[kept])).T @ R_sum
            if not kept.any():
                break
            if length2[kept][0] > (TAME * longest) ** 2:
                defect = _symmetric(inner(W, M_W))
                if np.abs(defect - np.eye(len(defect))).max() > ROUNDOFF:
                    U = la.cholesky(defect)
                    W, M_W = (combined(X, la.solve_triangular(U, np.eye(len(U)))) for X in (W, M_W))
                    R_sum = U @ R_sum
                break
            M_W = self.M @ W
        self._basis.put(self.m, W)
        return C_sum, R_sum, M_W


def _symmetric(G: Array) -> Array:
    return (G + G.T) / 2
