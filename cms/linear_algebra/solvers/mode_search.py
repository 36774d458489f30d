"""Search for the wanted modes: a Krylov basis for large pencils, dense matrices for small ones."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la

from cms.errors import EigenError
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.shift_inverted import (
    Modes,
    ShiftInverted,
    TallProduct,
    TallSpace,
    measured_residual,
    refined_modes,
)
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import combine, combine_in_place, combined, gram, inner, put, subtract

__all__ = ["BlockLanczos", "DenseSearch", "KrylovSearch", "RitzPairs"]


# block Lanczos iteration for the largest eigenvalues of a shift-inverted pencil ---------------------------------------
# S = (K - sigma M)⁻¹ M is self-adjoint in the inner product (x, y) = xᵀ M y, even if M is only semidefinite. Its
# largest eigenvalues theta = 1 / (omega² - sigma) belong to the modes nearest above the shift.


DEPENDENT = 1e-10  #: length of a new direction relative to its block, below which it is rounding
TAME = 1e-3  #: ratio of shortest to longest new direction, above which one orthogonalisation pass is exact to 1e-13
SETTLED = 1e-12  #: share of the shortest new direction that a pass may remove without recomputing its product with M
ROUNDOFF = 1e-14  #: error of M-orthonormal columns that needs no correction
MAX_PASSES = 5


@dataclass(frozen=True, eq=False)
class RitzPairs:
    """Eigenpairs of the projected operator, largest theta first."""

    theta: Array  #: eigenvalues theta of the projected operator, (m,) [s²]
    S: Array  #: eigenvectors as coefficients over the basis, (m, m)
    coupling: Array  #: part of S x - theta x along the next block, (b, m) [s²]
    residuals: Array  #: residual |S x - theta x|_M / |theta| of each unit vector x, from the recurrence, (m,)


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
        """Start with a random block; solve and M are operators on columns of the space."""
        self.solve, self.M, self.space, self.n, self.block = solve, M, space, space.n, block
        self.n_solves = 0
        self.m = 0  # number of columns of V included in T
        self.capacity = min(capacity, self.n)  #: number of columns of V before a restart
        self._columns = space.empty(self.capacity + block)  # storage of V, followed by the next block
        self._T = np.zeros((self.capacity + block, self.capacity + block))
        self._random = np.random.default_rng(0)
        self._M_next = self._start()  # M V_{j+1}; V_{j+1} itself is stored after V
        self.is_exhausted = self._M_next.shape[1] == 0  #: whether V spans the whole range of the operator
        self._R = np.zeros((self._M_next.shape[1], 0))  # coupling of the next block to all columns of V
        self._coupled = 0  # index of the first column of V to which the next block is coupled

    @property
    def V(self) -> Any:
        """Basis V, (n, m)."""
        return self._columns[:, : self.m]

    @property
    def V_and_next(self) -> Any:
        """Basis V and the next block, (n, m + b)."""
        return self._columns[:, : self.m + self._M_next.shape[1]]

    def grow(self, capacity: int) -> None:
        """Allocate memory for more columns."""
        if min(capacity, self.n) > self.capacity:
            self.capacity = min(capacity, self.n)
            size = self.capacity + self.block
            T = np.zeros((size, size))
            T[: self.m, : self.m] = self._T[: self.m, : self.m]
            old, self._columns, self._T = self.V_and_next, self.space.empty(size), T
            put(old, self._columns[:, : old.shape[1]])

    def advance(self) -> None:
        """Add the next block to the basis."""
        M_new = self._M_next
        first, last = self.m, self.m + M_new.shape[1]
        block = slice(first, last)
        self.m = last
        self.n_solves += M_new.shape[1]
        W = self.solve(M_new)  # (1)
        A = inner(M_new, W)  # (2)
        near = np.concatenate([self._R[:, self._coupled :].T, A])
        subtract(W, self._columns[:, self._coupled : self.m], near)
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
        self.is_exhausted = M_next.shape[1] == 0

    def ritz(self) -> RitzPairs:
        """Return the eigenpairs of T and their residuals |R s|."""
        theta, S = la.eigh(self._T[: self.m, : self.m])
        theta, S = theta[::-1], S[:, ::-1]
        scale = np.maximum(np.abs(theta), np.finfo(float).tiny)
        coupling = self._R @ S
        return RitzPairs(theta, S, coupling, np.linalg.norm(coupling, axis=0) / scale)

    def restart(self, ritz: RitzPairs, keep: int) -> None:
        """Reduce the basis to the span of the leading Ritz vectors; the next block does not change."""
        S = ritz.S[:, :keep]
        combine_in_place(self.V, S)
        b = len(self._R)
        put(self._columns[:, self.m : self.m + b], self._columns[:, keep : keep + b])
        self._T[: self.m, : self.m] = 0.0
        self._T[np.arange(keep), np.arange(keep)] = ritz.theta[:keep]
        self._R = self._R @ S
        self._coupled = 0
        self.m = keep

    def _start(self) -> Any:
        """Append a random block, M-orthonormal and orthogonal to V, in the range of the operator; return M times it."""
        width = min(self.block, self.n - self.m)
        self.n_solves += width
        _, _, M_W = self._append(self.solve(self.M @ self.space.random(self._random, width)), 0.0)
        return M_W

    def _append(self, W: Any, length: float) -> tuple[Array, Array, Any]:
        """Split W = V C + V_next R, with V_next stored after V; return C, R, M V_next (steps 3, 4). W is overwritten.

        `length` is the length of the part removed from W earlier; a remainder is rounding relative to it.
        """
        V = self.V
        C_sum = np.zeros((self.m, W.shape[1]))
        R_sum = np.eye(W.shape[1])
        M_W = self.M @ W
        for k_pass in range(MAX_PASSES):
            C = inner(V, M_W)
            G = gram(W, M_W)
            longest = np.sqrt(max(np.diag(G).max(initial=0.0), 0.0))
            subtract(W, V, C)
            C_sum += C @ R_sum
            G -= C.T @ C  # Gram matrix of W - V C, accurate as long as cancellation is small
            taken = np.abs(C).max(initial=0.0)
            if not taken**2 <= SETTLED**2 * la.eigvalsh(G)[0]:
                M_W = self.M @ W
                G = gram(W, M_W)
            length2, U = la.eigh(G)
            floor = DEPENDENT * max(length, longest) if k_pass == 0 else 0.1
            kept = length2 > floor**2
            scaled = U[:, kept] / np.sqrt(length2[kept])
            W, M_W = combined(W, scaled), combined(M_W, scaled)
            R_sum = (U[:, kept] * np.sqrt(length2[kept])).T @ R_sum
            if not kept.any():
                break
            if length2[kept][0] > (TAME * longest) ** 2:
                G = gram(W, M_W)
                if np.abs(G - np.eye(len(G))).max() > ROUNDOFF:
                    U = la.cholesky(G)
                    W, M_W = (combined(X, la.solve_triangular(U, np.eye(len(U)))) for X in (W, M_W))
                    R_sum = U @ R_sum
                break
            M_W = self.M @ W
        put(W, self._columns[:, self.m : self.m + W.shape[1]])
        return C_sum, R_sum, M_W


# mode search ----------------------------------------------------------------------------------------------------------


BLOCK = 8  #: number of columns in a Lanczos block; narrow blocks need fewer columns in total
#: columns of a wide block, and number of modes from which it is used; wide blocks are solved faster per column
WIDE, MANY = 16, 32
GUARDS = 16  #: number of Ritz vectors beyond the wanted ones in the last step
SOLVED_GUARDS = 8  #: the same if the last step solves for each of them
FIRST_GUESS = 30  #: assumed number of modes if only a cutoff frequency is given
MOST_COLUMNS = 40  #: largest number of solved columns per wanted mode and guard mode
MOST_REFINEMENTS = 4
VISIBLE = 1e-6  #: change of a mode in a solve that has no effect on the M-norm, because the changed part has no mass
FLOOR = 1e-13  #: residual from the recurrence, below which it is only rounding
NEGLIGIBLE = 1e-12  #: ratio of theta to the largest theta, below which a mode has no mass
NEGATIVE = 1e-8  #: ratio of |theta| of a negative theta to the largest theta, above which it is not rounding
MASSLESS = 1e-13  #: ratio of an eigenvalue of M to the largest, below which a direction has no mass


class KrylovSearch:
    """Block Lanczos until the wanted modes have converged; more modes can be requested later."""

    def __init__(self, operator: ShiftInverted, wanted: ModeCount) -> None:
        self.operator = operator
        guess = wanted.n or FIRST_GUESS
        block = WIDE if guess >= MANY else BLOCK
        self.description = f"block Lanczos, block {block}"
        self._lanczos = BlockLanczos(
            operator.solve, operator.M_product, operator.space, block=block, capacity=basis_size(guess, block)
        )
        self._is_clean = operator.has_mass_everywhere  # otherwise S removes rounding in massless dofs

    def modes(self, wanted: ModeCount, at_least: int = 0) -> Modes:
        """Return the wanted modes, at least `at_least`, refined to true residuals below the tolerance."""
        operator, tolerance = self.operator, self.operator.tolerance
        for _ in range(MOST_REFINEMENTS):
            ritz, k = self._converge(wanted, at_least, tolerance)
            if self._is_clean:
                modes = improved_modes(self._lanczos, ritz, k, operator.shift)
                residual, defect = measured_residual(operator, modes)
                self._is_clean = defect <= max(VISIBLE, 100 * residual)
            if not self._is_clean:
                n_kept = leading_count(ritz.theta, k, k + SOLVED_GUARDS)
                X = combine(self._lanczos.V, ritz.S[:, :n_kept])
                modes = refined_modes(operator, X, ritz.theta[:n_kept], k)
                residual = modes.residuals[:k].max(initial=0.0)
            if residual <= operator.tolerance:
                return modes
            tolerance = max(0.1 * tolerance, FLOOR)  # the residual from the recurrence can be smaller than the true one
        raise EigenError(
            f"eigenmodes: residuals stay at {residual:.1e}, expected {operator.tolerance:.1e}; "
            "K is too ill-conditioned for this tolerance: allow a larger one, or correct units and stiffness contrasts"
        )

    def _converge(self, wanted: ModeCount, at_least: int, tolerance: float) -> tuple[RitzPairs, int]:
        """Iterate until the recurrence residuals of the wanted pairs converge; return all pairs and their number."""
        lanczos = self._lanczos
        next_look = 0
        k, most = 1, np.inf
        while lanczos.n_solves <= most:
            if lanczos.m >= next_look or lanczos.is_exhausted:
                ritz = lanczos.ritz()
                refuse_negative(ritz.theta)
                k, is_done = self._judge(ritz, wanted, at_least, tolerance)
                if is_done:
                    return ritz, k
                if lanczos.is_exhausted:
                    raise EigenError(f"eigenmodes: expected {k} modes, but only {len(ritz.theta)} exist")
                # computing the eigenpairs of T becomes more expensive as T grows
                next_look = max(lanczos.m + lanczos.m // 64, k)
                lanczos.grow(basis_size(k, lanczos.block))
                most = MOST_COLUMNS * (k + 10 * lanczos.block)
            if lanczos.m + lanczos.block > lanczos.capacity:
                ritz = lanczos.ritz()
                lanczos.restart(ritz, min(lanczos.m - lanczos.block, k + (lanczos.capacity - k) // 3))
                next_look = 0
            lanczos.advance()
        raise EigenError(f"eigenmodes: no convergence after {lanczos.n_solves} columns; allow a larger tolerance")

    def _judge(self, ritz: RitzPairs, wanted: ModeCount, at_least: int, tolerance: float) -> tuple[int, bool]:
        """Return the number of pairs that are wanted according to current knowledge, and whether all have converged."""
        is_exhausted = self._lanczos.is_exhausted
        theta, residuals = ritz.theta, ritz.residuals
        if wanted.omega2 is None:
            k = max(wanted.n or 0, at_least)
            n_finite = leading_count(theta, 1, len(theta)) if len(theta) else 0
            if is_exhausted and n_finite < k:
                raise EigenError(
                    f"eigenmodes: n_modes = {k}, but only {n_finite} modes have mass; choose n_modes <= {n_finite}"
                )
            is_bounded = True
        else:
            theta_cutoff = 1 / (wanted.omega2 - self.operator.shift)
            k = max(int((theta > theta_cutoff).sum()), at_least)
            # the next mode is certainly above the cutoff frequency, or has converged there
            is_bounded = is_exhausted or (
                k < len(theta)
                and (theta[k] * (1 + residuals[k]) < theta_cutoff or residuals[k] <= tolerance)
                and residuals[k] < 0.1
            )
        is_converged = residuals[:k] <= tolerance
        self.operator.report(int(np.argmin(np.append(is_converged, False))), wanted.n or 0)
        return k, bool(len(theta) >= k and is_converged.all() and is_bounded)


def improved_modes(lanczos: BlockLanczos, ritz: RitzPairs, k: int, shift: float) -> Modes:
    """Return modes in the span of Y = S X, without a solve, for leading Ritz vectors X = V s.

    (1) S X = X theta + V_next (R s), so Y = S X / theta = X + V_next g with g = R s / theta: an inverse iteration
    (2) (K - sigma M) Y = M X / theta, so Yᵀ (K - sigma M) Y = 1 / theta = H;  Yᵀ M Y = 1 + gᵀ g = G
    (3) H z = (omega² - sigma) G z
    """
    p = leading_count(ritz.theta, k, len(ritz.theta))
    g = ritz.coupling[:, :p] / ritz.theta[:p]  # (1)
    mu, Z = la.eigh(np.diag(1 / ritz.theta[:p]), np.eye(p) + g.T @ g)  # (2), (3)
    Z = Z[:, : k + GUARDS]
    return Modes(
        mu[: k + GUARDS] + shift,
        k,
        ritz.residuals[: Z.shape[1]],
        lanczos.V_and_next,
        np.concatenate([ritz.S[:, :p] @ Z, g @ Z]),
    )


class DenseSearch:
    """Computes all modes of a small pencil at once.

    (1) M = B Bᵀ from the eigenvectors of S M S, S_kk = M_kk^(-1/2), without massless directions; the rank then depends
        neither on the units of rotations and translations nor on a heavy point beside a light beam
    (2) Bᵀ (K - sigma M)⁻¹ B q = theta q;  x = (K - sigma M)⁻¹ B q / theta has xᵀ M x = 1
    """

    description = "dense matrices"

    def __init__(self, operator: ShiftInverted, wanted: ModeCount) -> None:
        self.operator = operator
        M = operator.M_product @ np.eye(operator.n)
        size = np.sqrt(np.where(M.diagonal() > 0, M.diagonal(), 1.0))
        d, U = la.eigh(M / size / size[:, None])
        if d[0] < -1e-10 * d[-1]:
            raise EigenError("eigenmodes: M has a negative eigenvalue; expected a mass matrix")
        has_mass = d > MASSLESS * d[-1]
        B = size[:, None] * U[:, has_mass] * np.sqrt(d[has_mass])
        self._A_inv_B = operator.solve(B)
        projected = B.T @ self._A_inv_B
        theta, Q = la.eigh((projected + projected.T) / 2)
        self._theta, self._Q = theta[::-1], Q[:, ::-1]
        refuse_negative(self._theta)

    def modes(self, wanted: ModeCount, at_least: int = 0) -> Modes:
        """Return the wanted modes, at least `at_least`, refined."""
        operator, theta = self.operator, self._theta
        n_finite = leading_count(theta, 1, len(theta))
        if wanted.omega2 is None:
            k = max(wanted.n or 0, at_least)
        else:
            k = max(int((theta > 1 / (wanted.omega2 - operator.shift)).sum()), at_least)
        if k > n_finite:
            raise EigenError(
                f"eigenmodes: n_modes = {k}, but only {n_finite} modes have mass; choose n_modes <= {n_finite}"
            )
        n_kept = leading_count(theta, k, min(k + GUARDS, n_finite))
        modes = refined_modes(operator, self._A_inv_B @ (self._Q[:, :n_kept] / theta[:n_kept]), theta[:n_kept], k)
        for _ in range(MOST_REFINEMENTS):
            if modes.residuals[:k].max(initial=0.0) <= operator.tolerance:
                break
            modes = refined_modes(operator, combine(modes.Y, modes.Z), 1 / (modes.omega2 - operator.shift), k)
        if modes.residuals[:k].max(initial=0.0) > operator.tolerance:
            raise EigenError(
                f"eigenmodes: residuals are {modes.residuals[:k].max():.1e}, expected {operator.tolerance:.1e}; "
                "allow a larger tolerance"
            )
        operator.report(k, wanted.n or 0)
        return modes


def basis_size(k: int, block: int) -> int:
    """Return the size of a Krylov basis in which k modes usually converge without restart."""
    return 3 * k + 15 * block + 80


def leading_count(theta: Array, least: int, most: int) -> int:
    """Return the number of leading theta that are large enough for the last step, from `least` to `most`."""
    is_large = theta[:most] > NEGLIGIBLE * theta[0] if least <= 1 else theta[:most] > 0.1 * theta[least - 1]
    return max(least, int(is_large.sum())) if least > 1 else int(is_large.sum())


def refuse_negative(theta: Array) -> None:
    """Raise `EigenError` if the pencil has eigenvalues below the shift."""
    if len(theta) and theta[-1] < -NEGATIVE * theta[0]:
        raise EigenError(
            "eigenmodes: an eigenvalue omega² lies below the shift; expected a stiffness and a mass without negative "
            "energy, and a shift below the lowest mode. A slightly indefinite mass, as some programs write it, is "
            "repaired by repair_mass = true in the [body] of a job, repair_mass=True of body_from_matrices"
        )
