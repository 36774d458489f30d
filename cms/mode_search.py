"""The search for the wanted modes: a Krylov basis for large pencils, dense matrices for small ones."""

import numpy as np
import scipy.linalg as la

from cms.arrays import Array
from cms.block_lanczos import BlockLanczos, RitzPairs
from cms.errors import EigenError
from cms.shift_inverted import Modes, ShiftInverted, Wanted, refined_modes
from cms.tall import combine

__all__ = ["DenseSearch", "KrylovSearch"]

BLOCK = 8  #: columns of a Lanczos block
GUARDS = 8  #: Ritz vectors beyond the wanted ones that take part in the last step
FIRST_GUESS = 30  #: modes to make room for, as long as only a frequency is given
MOST_COLUMNS = 40  #: to solve for, per wanted mode and guard
MOST_REFINEMENTS = 4
FLOOR = 1e-13  #: residual by the recurrence below which only rounding is left
NEGLIGIBLE = 1e-12  #: theta against the largest one, below which a mode has no mass
NEGATIVE = 1e-8  #: the same for a negative theta that is more than rounding
MASSLESS = 1e-13  #: eigenvalue of M against its largest, below which a direction has no mass


class KrylovSearch:
    """Block Lanczos, grown until the wanted modes have converged; can be asked for more of them afterwards."""

    def __init__(self, operator: ShiftInverted, wanted: Wanted) -> None:
        self.operator = operator
        self.description = f"block Lanczos, block {BLOCK}"
        guess = wanted.count or FIRST_GUESS
        self._lanczos = BlockLanczos(
            operator.solve, operator.M_product, operator.n, block=BLOCK, capacity=basis_size(guess)
        )

    def modes(self, wanted: Wanted, at_least: int = 0) -> Modes:
        """Return the wanted modes, or `at_least` so many, refined; their true residuals are below the tolerance."""
        operator, tolerance = self.operator, self.operator.tolerance
        for _ in range(MOST_REFINEMENTS):
            ritz, k = self._converge(wanted, at_least, tolerance)
            n_kept = leading_count(ritz.theta, k, k + GUARDS)
            modes = refined_modes(operator, combine(self._lanczos.V, ritz.S[:, :n_kept]), ritz.theta[:n_kept], k)
            if modes.residuals.max(initial=0.0) <= operator.tolerance:
                return modes
            tolerance = max(0.1 * tolerance, FLOOR)  # the recurrence was more hopeful than the truth
        raise EigenError(
            f"eigenmodes: residuals stay at {modes.residuals.max():.1e}, expected {operator.tolerance:.1e}; "
            "K is too ill-conditioned for this tolerance: allow a larger one, or mend units and stiffness contrasts"
        )

    def _converge(self, wanted: Wanted, at_least: int, tolerance: float) -> tuple[RitzPairs, int]:
        """Advance until the wanted pairs have converged by the recurrence; return all pairs and the wanted number."""
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
                    raise EigenError(f"eigenmodes: expected {k} modes, found all there are: {len(ritz.theta)}")
                next_look = lanczos.m + max(BLOCK, lanczos.m // 16)
                lanczos.grow(basis_size(k))
                most = MOST_COLUMNS * (k + 10 * BLOCK)
            if lanczos.m + BLOCK > lanczos.capacity:
                ritz = lanczos.ritz()
                lanczos.restart(ritz, min(lanczos.m - BLOCK, k + (lanczos.capacity - k) // 3))
                next_look = 0
            lanczos.advance()
        raise EigenError(f"eigenmodes: no convergence after {lanczos.n_solves} columns; allow a larger tolerance")

    def _judge(self, ritz: RitzPairs, wanted: Wanted, at_least: int, tolerance: float) -> tuple[int, bool]:
        """Return how many pairs are wanted by what is known now, and whether all of them have converged."""
        is_exhausted = self._lanczos.is_exhausted
        theta, residuals = ritz.theta, ritz.residuals
        if wanted.omega2 is None:
            k = max(wanted.count or 0, at_least)
            n_finite = leading_count(theta, 1, len(theta)) if len(theta) else 0
            if is_exhausted and n_finite < k:
                raise EigenError(
                    f"eigenmodes: n_modes = {k}, but only {n_finite} modes have mass; choose n_modes <= {n_finite}"
                )
            is_bounded = True
        else:
            theta_cutoff = 1 / (wanted.omega2 - self.operator.shift)
            k = max(int((theta > theta_cutoff).sum()), at_least)
            # the next mode is beyond the frequency for certain, or converged there
            is_bounded = is_exhausted or (
                k < len(theta)
                and (theta[k] * (1 + residuals[k]) < theta_cutoff or residuals[k] <= tolerance)
                and residuals[k] < 0.1
            )
        is_converged = residuals[:k] <= tolerance
        self.operator.report(int(np.argmin(np.append(is_converged, False))), wanted.count or 0)
        return k, bool(len(theta) >= k and is_converged.all() and is_bounded)


class DenseSearch:
    """All modes of a small pencil at once.

    (1) M = B Bᵀ by its eigenvectors, massless directions left out
    (2) Bᵀ (K - sigma M)⁻¹ B q = theta q;  x = (K - sigma M)⁻¹ B q / theta has xᵀ M x = 1
    """

    description = "dense matrices"

    def __init__(self, operator: ShiftInverted, wanted: Wanted) -> None:
        self.operator = operator
        d, U = la.eigh(operator.M.toarray())
        if d[0] < -1e-10 * d[-1]:
            raise EigenError("eigenmodes: M has a negative eigenvalue; expected a mass matrix")
        has_mass = d > MASSLESS * d[-1]
        B = U[:, has_mass] * np.sqrt(d[has_mass])
        self._A_inv_B = operator.solve(B)
        projected = B.T @ self._A_inv_B
        theta, Q = la.eigh((projected + projected.T) / 2)
        self._theta, self._Q = theta[::-1], Q[:, ::-1]
        refuse_negative(self._theta)

    def modes(self, wanted: Wanted, at_least: int = 0) -> Modes:
        """Return the wanted modes, or `at_least` so many, refined."""
        operator, theta = self.operator, self._theta
        n_finite = leading_count(theta, 1, len(theta))
        if wanted.omega2 is None:
            k = max(wanted.count or 0, at_least)
        else:
            k = max(int((theta > 1 / (wanted.omega2 - operator.shift)).sum()), at_least)
        if k > n_finite:
            raise EigenError(
                f"eigenmodes: n_modes = {k}, but only {n_finite} modes have mass; choose n_modes <= {n_finite}"
            )
        n_kept = leading_count(theta, k, min(k + GUARDS, n_finite))
        modes = refined_modes(operator, self._A_inv_B @ (self._Q[:, :n_kept] / theta[:n_kept]), theta[:n_kept], k)
        if modes.residuals.max(initial=0.0) > operator.tolerance:
            raise EigenError(
                f"eigenmodes: residuals are {modes.residuals.max():.1e}, expected {operator.tolerance:.1e}; "
                "allow a larger tolerance"
            )
        operator.report(k, wanted.count or 0)
        return modes


def basis_size(k: int) -> int:
    """Columns of a Krylov basis in which k modes usually converge without a restart."""
    return 3 * k + 25 * BLOCK


def leading_count(theta: Array, least: int, most: int) -> int:
    """Return how many of the leading theta, `least` to `most`, are large enough to take part in the last step."""
    is_large = theta[:most] > NEGLIGIBLE * theta[0] if least <= 1 else theta[:most] > 0.1 * theta[least - 1]
    return max(least, int(is_large.sum())) if least > 1 else int(is_large.sum())


def refuse_negative(theta: Array) -> None:
    """Refuse a pencil with eigenvalues below the shift."""
    if len(theta) and theta[-1] < -NEGATIVE * theta[0]:
        raise EigenError(
            "eigenmodes: an eigenvalue omega² lies below the shift; expected a stiffness without negative energy, and "
            "a shift below its lowest mode"
        )
