"""Vibration modes: the lowest eigenpairs of K x = omega² M x, by number or up to a frequency."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import scipy.sparse as sp

from cms.errors import EigenError
from cms.linear_algebra.solvers.factorization import Factorization, Matrix, factorize, matrix_of, shifted_matrix
from cms.linear_algebra.solvers.inverse import Inverse
from cms.linear_algebra.solvers.mode_count import ModeCount, mode_count
from cms.linear_algebra.solvers.mode_search import GUARDS, DenseSearch, KrylovSearch
from cms.linear_algebra.solvers.shift_inverted import ArraySpace, Modes, ShiftInverted
from cms.linear_algebra.solvers.slepc_modes import SlepcSearch, search_on_ranks
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields
from fe_models.foundation.solver import Solver
from fe_models.foundation.sparse.submatrix import PrincipalBlock
from fe_models.foundation.tall.columns import combine, elsewhere, in_memory, of_this_process
from fe_models.foundation.tall.on_disk import row_slices
from fe_models.foundation.threads import one_blas_thread

__all__ = ["EigenResult", "FactorMismatchError", "GuardModes", "eigenmodes", "no_modes", "orientation", "turn_in_place"]


SMALL = 300  #: number of dofs up to which dense matrices are faster
LARGEST_DENSE = 3000  #: number of dofs up to which dense matrices are affordable if many of the modes are wanted
SHIFT = 1e-6  #: shift for a free body divided by the median of K_kk / M_kk; close to the first elastic omega²
SHIFT_SMALL = 1e-4  #: the same for a small dense pencil
ZERO = 1e-13  #: omega² divided by this median, below which it is rounding of K: a rigid-body mode
TIGHTEST, LOOSEST = 1e-13, 0.1  #: smallest tolerance that rounding allows, and largest meaningful tolerance
MISMATCH = 1e-3  #: relative residual of K x = omega² M x, above which the factor is not that of K - sigma M
MOST_PROOFS = 3
GAP = 1e-4  #: relative gap between two values of omega² that is sufficient for counting modes
RESOLVED = 0.01  #: residual of a guard mode, below which its frequency is resolved


class FactorMismatchError(EigenError):
    """The modes from a factorisation are not those of K and M."""


@dataclass(frozen=True, eq=False)
class GuardModes:
    """Approximate modes just above the wanted ones, which the eigensolver found beside them."""

    Phi: Array  #: mode shapes, M-orthonormal, (n_dof, n_guards)
    frequencies: Array  #: frequencies of their Rayleigh quotients, ascending, (n_guards,) [Hz]
    residuals: Array  #: as in `EigenResult`, (n_guards,)

    @property
    def resolved_to(self) -> float:
        """Frequency below which wanted modes and guards are complete [Hz]; 0: no guard is resolved."""
        n = int(np.logical_and.accumulate(self.residuals <= RESOLVED).sum())
        return float(self.frequencies[n - 1] * (1 - RESOLVED)) if n else 0.0


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError, misfit=EigenError)
class EigenResult:
    """Modes by ascending frequency, M-orthonormal."""

    #: squared angular frequencies [1/s²]; exactly 0 for rigid-body modes
    omega2: Annotated[Array, ArrayShape(("n_modes",))]
    frequencies: Annotated[Array, ArrayShape(("n_modes",))]  #: natural frequencies [Hz]
    Phi: Annotated[Array, ArrayShape((None, "n_modes"))]  #: mode shapes; `SpreadColumns` if the body is distributed
    #: |x - (omega² - sigma) (K - sigma M)⁻¹ M x|_M for x before its last inverse iteration; NaN: not measured
    residuals: Annotated[Array, ArrayShape(("n_modes",), has_nan=True)]
    n_solves: int  #: number of solved right-hand sides
    method: str  #: name and settings of the solver
    is_proven: bool  #: whether the inertia of a second factorisation confirmed that no mode is missing
    guards: GuardModes | None = None  #: approximate modes above these; None: not known, or distributed over ranks

    def over(self, expanded: Callable[[Any], Any]) -> "EigenResult":
        """Return the modes and guards over other dofs, by a function from columns to columns."""
        guards = None if self.guards is None else replace(self.guards, Phi=expanded(self.guards.Phi))
        return replace(self, Phi=expanded(self.Phi), guards=guards)

    def first(self, k: int) -> "EigenResult":
        """Return the lowest k modes; the next ones become guards."""
        if k == len(self.omega2):
            return self
        beyond = slice(k, k + GUARDS)
        return replace(
            self,
            omega2=self.omega2[:k],
            frequencies=self.frequencies[:k],
            Phi=self.Phi[:, :k],
            residuals=self.residuals[:k],
            guards=GuardModes(self.Phi[:, beyond], self.frequencies[beyond], self.residuals[beyond]),
        )


def no_modes(n_dof: int) -> EigenResult:
    """Return a result without modes."""
    none: Array = np.zeros(0)
    return EigenResult(none, none, np.zeros((n_dof, 0)), none, 0, "none asked for", is_proven=False)


def eigenmodes(
    K: Matrix,
    M: Matrix,
    n_modes: int | ModeCount,
    *,
    factorization: Inverse | None = None,
    solver: str | Solver | None = None,
    shift: float | None = None,
    tolerance: float = 1e-5,
    numbering: IntArray | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> EigenResult:
    """Compute the lowest vibration modes of a sparse symmetric pencil.

    (1) block Lanczos on S = (K - sigma M)⁻¹ M until the leading residuals are below the tolerance
    (2) Y = S X / theta: one inverse iteration of the Ritz vectors X gives their true residuals |Y - X|_M, and corrects
        components without mass (multipliers, massless dofs), which the M-norm does not measure
    (3) Rayleigh-Ritz in the span of Y; Yᵀ (K - sigma M) Y = Yᵀ M X / theta needs no product with K
    (4) signs, and directions within multiple frequencies, by `orientation`

    Parameters
    ----------
    K
        Stiffness, (n, n); semidefinite for a free body, indefinite only because of Lagrange multipliers.
    M
        Mass, (n, n), semidefinite, with zeros for massless dofs and multipliers. If K and M are `PrincipalBlock`, their
        entries are not held during the search. Distributed matrices (`SpreadMatrix`) stay distributed, and so do the
        modes if the blocks were factorised on the ranks (`SpreadColumns`).
    n_modes
        Number of modes, or a `ModeCount` for all modes up to a frequency [Hz], with or without proof.
    factorization
        Existing factorisation of K - shift M; None: K - shift M is factorised here, and the factor freed.
    solver
        Solver, or its name (`cms.linear_algebra.solvers.registry`), if no factorisation is given; default: the fastest
        installed solver.
    shift
        sigma [1/s²], below all omega². Default: 0 if a factorisation is given, otherwise a small negative value that
        also suits a free body.
    tolerance
        Largest residual |x - (omega² - sigma) S x|_M of a unit x. It bounds the relative error of omega² - sigma; the
        actual error is of the order of its square.
    numbering
        Number of each row, which selects its value in the random start vector. A body with rows in another order then
        has the same start vector, and its modes agree better than the tolerance. Default: the order of the rows.
    progress
        Callback that receives the number of found modes and of wanted modes (0 while this is unknown).

    Raises
    ------
    EigenError
        If more modes are requested than exist, an eigenvalue is below the shift, the residuals stay above the
        tolerance, or the inertia counts a different number of modes.
    FactorizationError
        If K - shift M is singular.
    """
    K, M = (matrix_of(A) if sp.issparse(A) else A for A in (K, M))
    n = K.shape[0]
    if K.shape != (n, n) or M.shape != (n, n):
        raise EigenError(f"eigenmodes: expected K and M of one square shape, got {K.shape} and {M.shape}")
    wanted = mode_count(n_modes)
    if wanted.n is not None and wanted.n < 1:
        raise EigenError(f"eigenmodes: n_modes = {wanted.n}; expected at least 1")
    if wanted.n is not None and wanted.n > n:
        raise EigenError(f"eigenmodes: {wanted.description}, but there are {n} dofs; choose n_modes <= {n}")
    if not TIGHTEST <= tolerance <= LOOSEST:
        raise EigenError(f"eigenmodes: tolerance = {tolerance:g}; expected {TIGHTEST:g} to {LOOSEST:g}")
    is_large_part = wanted.n is not None and 3 * wanted.n > n
    is_dense = n <= SMALL or (is_large_part and n <= LARGEST_DENSE)
    stiffness, diagonal = K.diagonal(), M.diagonal()
    has_both = (stiffness > 0) & (diagonal > 0)
    if not has_both.any():
        raise EigenError("eigenmodes: no dof has both stiffness and mass; expected a body that can vibrate")
    scale = float(np.median(stiffness[has_both] / diagonal[has_both]))  # near the highest omega² of the mesh
    if shift is None:
        shift = 0.0 if factorization is not None else -(SHIFT_SMALL if is_dense else SHIFT) * scale
    with ExitStack() as stack:
        stack.enter_context(one_blas_thread())
        if factorization is None:
            factorization = stack.enter_context(_factorize_shifted(matrix_of(K), matrix_of(M), shift, solver))
        if factorization.n != n:
            raise EigenError(f"eigenmodes: factorization: expected order {n}, got {factorization.n}")
        is_here = is_dense or factorization.solver.spread is None
        own_search, space = (None, None) if is_here else search_on_ranks(factorization, numbering)
        kind: type[DenseSearch | KrylovSearch | SlepcSearch] = DenseSearch if is_dense else own_search or KrylovSearch
        if space is not None:
            stack.callback(space.close)
        mass = M if space is not None or not isinstance(M, PrincipalBlock) else matrix_of(M)
        operator = ShiftInverted(mass, shift, factorization, tolerance, progress, space or ArraySpace(n, numbering))
        search = kind(operator, wanted)
        modes = search.modes(wanted)
        if wanted.verify:
            modes = _proven_modes(K, M, search, modes, wanted)
        k = int((modes.omega2[: modes.n_wanted] <= wanted.omega2).sum()) if wanted.omega2 is not None else wanted.n or 0
        residuals, method = modes.residuals, search.description
        n_solves, solver = operator.n_solves, factorization.description
        # if K itself is factorised, there is no rigid-body mode, even if the highest omega² of the mesh is very large
        zero = max(ZERO * scale, 1e-9 * abs(shift)) if shift else 0.0
        if (modes.omega2 < -zero).any():
            raise EigenError(
                f"eigenmodes: omega² = {modes.omega2.min():.6g} is negative; expected a stiffness without negative "
                "energy"
            )
        omega2 = np.where(modes.omega2 <= zero, 0.0, modes.omega2)
        columns = combine(modes.Y, modes.Z)
        del search, modes, operator  # frees the basis before the modes are copied
        if space is not None:
            space.close()
        stays = space is not None and space.has_rows_of(K)
        Phi = columns if stays else of_this_process(columns)
        del columns  # before the space is closed, because ranks then free data without references
        Z, frequencies = orientation(Phi, omega2), np.sqrt(omega2) / (2 * np.pi)
        guards = None if stays else GuardModes(combine(Phi, Z[:, k:]), frequencies[k:], residuals[k:])
        Phi = combine(Phi, Z[:, :k], order="C")
    omega2 = omega2[:k]
    _require_match(K, M, Phi, omega2, shift, tolerance)
    method = f"{method}; shift {shift:.6g}, tolerance {tolerance:g}, {n_solves} columns solved by {solver}"
    return EigenResult(
        omega2, frequencies[:k], Phi, residuals[:k], n_solves, method, is_proven=wanted.verify, guards=guards
    )


def _proven_modes(
    K: Matrix, M: Matrix, search: KrylovSearch | DenseSearch | SlepcSearch, modes: Modes, wanted: ModeCount
) -> Modes:
    """Return the modes once the inertia confirms their number; search for more modes while it is larger."""
    operator = search.operator
    for _ in range(MOST_PROOFS):
        last, sigma = counting_shift(modes.omega2, modes.n_wanted, wanted, operator.shift)
        n_below = _count_below(K, M, sigma, operator.factorization)
        if n_below == last:
            return modes
        if n_below < last:
            raise EigenError(
                f"eigenmodes: found {last} modes below {_hertz(sigma):.6g} Hz, but the inertia counts {n_below}; "
                "expected symmetric K and M, and a factorisation of them"
            )
        modes = search.modes(wanted, at_least=n_below)
    raise EigenError(
        f"eigenmodes: the inertia counts {n_below} modes below {_hertz(sigma):.6g} Hz, found {last}; ask for more modes"
    )


def counting_shift(omega2: Array, k: int, wanted: ModeCount, shift: float) -> tuple[int, float]:
    """Return the number of modes below a shift, and the shift, which lies in a gap after the last wanted mode."""
    levels = np.concatenate([[shift], omega2])  # levels[j] is omega² of mode j, counted from 1
    for j in range(k, len(omega2)):
        low, high = levels[j], levels[j + 1]
        if high - low > GAP * (high - shift):
            sigma = (low + high) / 2
            if wanted.omega2 is not None and j == k:
                margin = GAP * (high - shift) / 4
                sigma = min(max(wanted.omega2, low + margin), high - margin)
            return j, sigma
    return len(omega2), levels[-1] + GAP * (levels[-1] - shift)


def _factorize_shifted(K: Matrix, M: Matrix, sigma: float, solver: str | Solver | None) -> Factorization:
    A = K if sigma == 0 else shifted_matrix(K, M, sigma)
    return factorize(A, definite=sigma <= 0 and bool((A.diagonal() > 0).all()), solver=solver)


def _count_below(K: Matrix, M: Matrix, sigma: float, at_shift: Inverse) -> int:
    """Count the modes between the shift and sigma by Sylvester's law: the negative eigenvalues of K - sigma M."""
    with _factorize_shifted(K, M, sigma, at_shift.solver) as factorization:
        inertia = factorization.inertia
    if inertia.n_zero or at_shift.inertia.n_zero:
        raise EigenError(
            f"eigenmodes: {inertia.n_zero} pivots at {_hertz(sigma):.6g} Hz are zero within rounding, so that modes "
            "cannot be counted there; ask for another number of modes, or do without the proof"
        )
    return inertia.n_negative - at_shift.inertia.n_negative


def _require_match(K: Matrix, M: Matrix, Phi: Array, omega2: Array, shift: float, tolerance: float) -> None:
    """Check K x = omega² M x for a random combination of modes; the iteration used only the factorisation of K."""
    if not len(omega2):
        return
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=len(omega2)) / np.sqrt(omega2 - shift)
    factors = np.stack([np.ones(len(omega2)), omega2, omega2 - shift], axis=1) * signs[:, None]
    x = of_this_process(combine(Phi, factors, order="F"))
    force, inertia = K @ x[:, 0], M @ x[:, 1]
    size = np.linalg.norm(force) + np.linalg.norm(M @ x[:, 2])
    defect = np.linalg.norm(force - inertia) / size
    if not defect < max(MISMATCH, 1e3 * tolerance):
        raise FactorMismatchError(
            f"eigenmodes: K x - omega² M x is {defect:.1e} of its terms; expected a factorisation of K - shift M "
            f"(shift = {shift:g}) of these very matrices"
        )


def _hertz(omega2: float) -> float:
    return float(np.sqrt(max(omega2, 0.0)) / (2 * np.pi))


# unique choice among equivalent bases: signs of modes, and directions within multiple frequencies ---------------------


MULTIPLE = 1e-10  #: relative gap of omega² below which modes form one multiple mode


def orientation(Phi: Any, omega2: Array) -> Array:
    """Return the orthogonal matrix Z, (k, k), that transforms modes Phi to their standard basis Phi Z.

    Within a group of modes with equal frequency, any rotation is equally valid, and rounding decides. The length of a
    row of the group does not depend on the rotation. Therefore (1) the longest row is rotated to (+, 0, 0, …), (2) the
    longest remaining row to (*, +, 0, …), and so on. In a group of one mode, the largest entry becomes positive. Rows
    within 1 % of the longest count as equally long; the first of them is used.

    Parameters
    ----------
    Phi
        Modes by ascending frequency, (n, k); distributed modes are collected one frequency at a time.
    omega2
        Squared frequencies of the modes, (k,) [1/s²].
    """
    k = Phi.shape[1]
    Z = np.zeros((k, k))
    gaps = np.abs(np.diff(omega2, prepend=-np.inf))
    starts = np.flatnonzero(gaps > MULTIPLE * np.abs(omega2))
    for first, last in zip(starts, [*starts[1:], k], strict=True):
        if last == first + 1:
            mode = in_memory(Phi[:, first:last])[:, 0]
            size = np.abs(mode)
            Z[first, first] = -1.0 if mode[np.argmax(size > 0.99 * size.max())] < 0 else 1.0
        else:
            Z[first:last, first:last] = _standard_rotation(in_memory(Phi[:, first:last]))
    return Z


def _standard_rotation(group: Array) -> Array:
    p = group.shape[1]
    leading = []
    rest = group
    for _ in range(p):
        length = np.linalg.norm(rest, axis=1)
        row = int(np.argmax(length > 0.99 * length.max()))
        leading.append(row)
        if length[row] > 0:
            direction = rest[row] / length[row]
            rest = rest - np.outer(rest @ direction, direction)
    # the leading rows are L Qᵀ with lower triangular L, so Q transforms them to L; signs make its diagonal positive
    Q, R = np.linalg.qr(group[leading].T)
    return Q * np.where(np.diag(R) < 0, -1.0, 1.0)


def turn_in_place(Phi: Any, turn: Array) -> None:
    """Replace Phi, (n, k), by Phi turn, (k, k); modes that change only their sign are not combined with others."""
    if (far := elsewhere(Phi)) is not None:
        far.on_rows(turn_in_place, Phi, turn)
        return
    is_mixed = np.count_nonzero(turn, axis=0) > 1
    mixed = np.flatnonzero(is_mixed | (np.count_nonzero(turn, axis=1) > 1))
    signs, turn_mixed = np.diag(turn), turn[np.ix_(mixed, mixed)]
    for rows in row_slices(len(Phi), Phi):
        turned = Phi[rows, mixed] @ turn_mixed
        Phi[rows] *= signs
        Phi[rows, mixed] = turned
