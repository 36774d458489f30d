"""Krylov mode set: it matches moments of the transfer function at given frequencies (load-dependent Ritz vectors)."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
from scipy.linalg.lapack import dpstrf

from cms.errors import FactorizationError, ModeSetError
from cms.linear_algebra.independent import DisplacementColumns
from cms.linear_algebra.solvers.factorization import factorize, shifted_matrix
from cms.modes.centrifugal import CENTRIFUGAL
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.families.receptance import boundary_scale, largest_error, receptance_of_pencil
from cms.modes.mode_set import Block, ModeSet, mode_set, require_interfaces, rigid_block
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.sparse.submatrix import PrincipalBlock
from fe_models.foundation.tall.columns import gram

__all__ = ["krylov"]

DEFLATION = 1e-7  #: remainder of a unit column outside the span, below which the column is omitted
MOST_BLOCKS = 30  #: largest number of blocks per shift if a tolerance ends the expansion
LOSS = 0.02  #: loss factor of the transfer function in the error estimate: 1 % of critical at resonance
BAND_POINTS = 60  #: number of frequencies in the band at which transfer functions are compared


def krylov(
    body: FEBody | Families,
    *,
    n_modes: int | None = None,
    n_blocks: int | None = None,
    shifts: Sequence[float] = (0.0,),
    tolerance: float | None = None,
    band: tuple[float, float] | None = None,
    load_cases: bool = True,
) -> ModeSet:
    """Krylov mode set: [Psi_R, blocks of moments] for loads F = [unit loads on boundary dofs, load cases] [1]_.

    (1) shift 0: X_1 = Pᵀ G P F, X_{j+1} = Pᵀ G P M X_j with the elastic flexibility of the free body; inertia loads of
        rigid-body accelerations need no column, because P M Psi_R = 0 and Psi_R is in the set
    (2) shift s, sigma = (2 pi s)²: X_1 = (K - sigma M)⁻¹ F, X_{j+1} = (K - sigma M)⁻¹ M X_j, without rigid-body part
    (3) every block, shift after shift, is orthogonalised twice against the span in W = K + omega_1² M; columns with a
        remainder below 1e-7 (or `tolerance`) are deflated, and the recurrence continues with the others

    The projection is symmetric, so j blocks at a shift match the first 2 j moments m_k = Fᵀ [(K - sigma M)⁻¹ M]^k (K -
    sigma M)⁻¹ F, k = 0 .. 2 j - 1, of the transfer function Fᵀ (K - omega² M)⁻¹ F at that shift. The options of the set
    give the number of matched moments.

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of columns beyond the first block of every shift; 0 gives the static set [Psi_R, Psi_U] if the shift is
        0.
    n_blocks
        Number of blocks at every shift, instead of n_modes.
    shifts
        Expansion frequencies [Hz, or 1/time unit of the body]; none may be a natural frequency of the free body. Each
        shift except 0 costs a factorisation.
    tolerance
        Instead of a number. With `band`: blocks are added until the relative change of the transfer function over the
        band is below the tolerance (elastic part, 2 % loss factor). Without `band`: blocks are added until the
        remainder of all new columns is below the tolerance.
    band
        Range of frequencies (from, to) over which the error is estimated [Hz].
    load_cases
        Whether the load cases of the body are among the loads. Centrifugal load cases are not, because their response
        is static.

    Raises
    ------
    ModeSetError
        If not exactly one of n_modes, n_blocks and tolerance is given, numbers are out of range, or a shift is a
        natural frequency.

    References
    ----------
    .. [1] Craig & Hale (1988), docs/bibliography.md; the moments are derived in docs/theory.md §3.
    """
    _check(n_modes, n_blocks, shifts, tolerance, band)
    source, body = body, body_of(body)
    body.require_coupled()
    require_interfaces("krylov", body)
    cases = [case for case in body.load_cases if load_cases and case.kind != CENTRIFUGAL]
    F_extra = np.array([case.f for case in cases]).T if cases else np.zeros((body.n_dof, 0))
    with ExitStack() as stack:
        families = stack.enter_context(families_of(source))
        expansions = [
            _static_expansion(families, F_extra) if shift == 0 else _shifted_expansion(families, shift, F_extra, stack)
            for shift in dict.fromkeys(map(float, shifts))
        ]
        span = _Span(families, deflation=DEFLATION if tolerance is None or band is not None else tolerance)
        n_first, history, is_met = 0, [], False
        for j in range(MOST_BLOCKS if n_blocks is None else n_blocks):
            for expansion in expansions:
                span.add(expansion, j)
            if j == 0:
                n_first = span.n
            if all(expansion.is_exhausted for expansion in expansions):
                is_met = True
                break
            if n_modes is not None and span.n - n_first >= n_modes:
                break
            if band is not None and tolerance is not None:
                history.append(span.receptance(band))
                if j > 0 and largest_error(history[-1], history[-2]) < tolerance:
                    is_met = True
                    break
        n_kept = span.n if n_modes is None else min(span.n, n_first + n_modes)
        modes = _mode_set(families, span, expansions, n_first, n_kept, history, [case.name for case in cases])
        if tolerance is None:
            return modes
        words = f"{tolerance:g}, {'met' if is_met else f'not met with {MOST_BLOCKS} blocks at every shift'}"
        return replace(modes, options={**modes.options, "tolerance": words})


@dataclass(eq=False)
class _Expansion:
    """One expansion point: its operator, its first block, and the directions for the next block."""

    name: str
    first_block: Callable[[], Array]  #: function that returns X_1, (n_dof, n_f)
    apply: Callable[[Array], Array]  #: operator X -> (K - sigma M)⁻¹ X, or the elastic flexibility
    last: Array | None = None  #: M times the last directions, (n_dof, k); None before the first block
    ends: tuple[int, ...] = ()  #: number of columns of the whole span after each block of this expansion

    @property
    def is_exhausted(self) -> bool:
        """Whether the last block added no new direction."""
        return self.last is not None and self.last.shape[1] == 0


class _Span:
    """W-orthonormal columns that grow block by block."""

    def __init__(self, families: Families, *, deflation: float) -> None:
        self.body, self.families, self.deflation = families.body, families, deflation
        self._K, self._M = SymmetricProduct(self.body.K), SymmetricProduct(self.body.M)
        self._is_motion = self.body.dofs[:, 1] != MULTIPLIER
        self.columns = self._products(np.zeros((self.body.n_dof, 0)))
        self.labels: list[str] = []
        self.groups: list[str] = []
        self.omega2 = 0.0

    @property
    def n(self) -> int:
        """Number of columns."""
        return self.columns.X.shape[1]

    def add(self, expansion: _Expansion, j: int) -> None:
        """Add block j + 1 of an expansion."""
        if expansion.is_exhausted:
            return
        X = expansion.first_block() if expansion.last is None else expansion.apply(expansion.last)
        new = self._orthonormal(X)
        expansion.last = new.MX
        k = new.X.shape[1]
        self.columns = self.columns.beside(new)
        group = f"krylov {expansion.name} block {j + 1}"
        self.labels += [f"{group} direction {d + 1}" for d in range(k)]
        self.groups += [group] * k
        expansion.ends = (*expansion.ends, self.n)

    def _orthonormal(self, X: Array) -> DisplacementColumns:
        """Return W-orthonormal directions of elastic columns X outside the span: step (3).

        Multipliers are set to zero. Motions that satisfy the constraints have the same energy with any multipliers, but
        with large multipliers the remainder of a motion would be lost in rounding.
        """
        free = self.families.free
        X = (X - free.N @ (free.M_N.T @ X)) * self._is_motion[:, None]
        block = self._products(X)
        stiffness = np.einsum("nk,nk->k", X, block.KX)
        mass = np.einsum("nk,nk->k", X, block.MX)
        if self.omega2 == 0.0:
            has_mass = mass > 1e-14 * mass.max(initial=0.0)
            self.omega2 = float((stiffness[has_mass] / mass[has_mass]).min(initial=np.inf)) if has_mass.any() else 1.0
        size = np.sqrt(np.maximum(stiffness + self.omega2 * mass, 0.0))
        is_there = size > np.finfo(float).tiny
        X = X[:, is_there] / size[is_there]
        block = self._products(X)
        for _ in range(2):  # two passes suffice
            block = self._without_span(block)
        rest = np.einsum("nk,nk->k", block.X, block.KX + self.omega2 * block.MX)
        block = block[np.flatnonzero(rest > self.deflation**2)]
        if not block.X.shape[1]:
            return block
        G = gram(block.X, block.KX) + self.omega2 * gram(block.X, block.MX)
        factor, pivots, rank, _ = dpstrf(G, tol=self.deflation**2, lower=0)
        Z = np.zeros((len(G), rank))
        Z[pivots[:rank] - 1] = la.solve_triangular(np.triu(factor[:rank, :rank]), np.eye(rank))
        block = self._products(block.X @ Z)
        # a small remainder still contains part of the span, due to rounding
        block = self._without_span(block)
        G = gram(block.X, block.KX) + self.omega2 * gram(block.X, block.MX)
        return self._products(block.X @ la.solve_triangular(la.cholesky(G), np.eye(rank)))

    def _without_span(self, block: DisplacementColumns) -> DisplacementColumns:
        return self._products(block.X - self.columns.X @ self.columns.inner(block, self.omega2))

    def _products(self, X: Array) -> DisplacementColumns:
        # the coefficients over the mode set are not needed
        return DisplacementColumns(X, self._K @ X, self._M @ X, np.zeros((0, X.shape[1])))

    def receptance(self, band: tuple[float, float]) -> np.ndarray:
        """Return the elastic receptance of the boundary over the band, (n_f, n_b, n_b)."""
        b = boundary_scale(self.body)[:, None] * self.columns.X[self.body.b]
        K, M = gram(self.columns.X, self.columns.KX), gram(self.columns.X, self.columns.MX)
        return receptance_of_pencil(b, K, M, loss=LOSS, omega2=self.omega2).at(np.linspace(*band, BAND_POINTS))


def _static_expansion(families: Families, F_extra: Array) -> _Expansion:
    def first_block() -> Array:
        return np.hstack([families.Psi_U, families.flexibility(F_extra)]) if F_extra.shape[1] else families.Psi_U

    return _Expansion("0 Hz", first_block, families.flexibility)


def _shifted_expansion(families: Families, shift: float, F_extra: Array, stack: ExitStack) -> _Expansion:
    """Return the expansion at a shift; the stack keeps its factorisation open."""
    body = families.body
    sigma = (2 * np.pi * shift) ** 2
    order = np.arange(body.n_dof) if body.layout is None else body.layout.order
    A = shifted_matrix(PrincipalBlock(body.K, order), PrincipalBlock(body.M, order), sigma)
    try:
        factor = stack.enter_context(factorize(A, definite=False, solver=families.solver))
    except FactorizationError as error:
        raise ModeSetError(
            f"krylov: shift = {shift:g}: K - (2 pi shift)² M of body {body.name!r} is singular: a natural frequency of "
            "the free body; move the shift by a percent"
        ) from error

    def first_block() -> Array:
        F = np.zeros((body.n_dof, len(body.b)))
        F[body.b, np.arange(len(body.b))] = 1.0
        return solve(np.hstack([F, F_extra]))

    def solve(F: Array) -> Array:
        if body.layout is None:
            return factor.solve(F)
        x = np.empty(F.shape)
        x[order] = factor.solve(F[order])
        return x

    return _Expansion(f"{shift / body.units.time:g} Hz", first_block, solve)


def _check(
    n_modes: int | None,
    n_blocks: int | None,
    shifts: Sequence[float],
    tolerance: float | None,
    band: tuple[float, float] | None,
) -> None:
    """Raise `ModeSetError` for contradictory options and for numbers out of range."""
    given = {"n_modes": n_modes, "n_blocks": n_blocks, "tolerance": tolerance}
    if sum(value is not None for value in given.values()) != 1:
        raise ModeSetError(
            "krylov: expected one of n_modes, n_blocks and tolerance, got "
            + ", ".join(f"{name} = {value}" for name, value in given.items())
        )
    if n_modes is not None and n_modes < 0:
        raise ModeSetError(f"krylov: n_modes = {n_modes}; expected 0 or more")
    if n_blocks is not None and n_blocks < 1:
        raise ModeSetError(f"krylov: n_blocks = {n_blocks}; expected 1 or more")
    if tolerance is not None and not 0 < tolerance < 1:
        raise ModeSetError(f"krylov: tolerance = {tolerance}; expected a number between 0 and 1")
    if not len(shifts) or not all(0 <= shift < np.inf for shift in shifts):
        raise ModeSetError(f"krylov: shifts = {list(shifts)}; expected one or more frequencies, 0 or more")
    if band is not None and (len(band) != 2 or not 0 <= band[0] < band[1] < np.inf):
        raise ModeSetError(f"krylov: band = {band}; expected two frequencies (from, to), 0 <= from < to")
    if band is not None and tolerance is None:
        raise ModeSetError("krylov: band: the error over a band needs a tolerance; got none")


def _mode_set(
    families: Families,
    span: _Span,
    expansions: list[_Expansion],
    n_first: int,
    n_kept: int,
    history: list[np.ndarray],
    load_names: list[str],
) -> ModeSet:
    blocks = {e.name: sum(end <= n_kept for end in e.ends) for e in expansions}
    options = {
        "n_modes": str(n_kept),
        "shifts": ", ".join(e.name for e in expansions),
        "moments matched": ", ".join(f"{2 * n} at {name}" for name, n in blocks.items()),
        "loads": ", ".join([f"{len(families.body.b)} boundary dofs", *load_names]),
    }
    if len(history) > 1:
        options["estimated transfer-function error"] = f"{largest_error(history[-1], history[-2]):.3g}"
    columns = Block(span.columns.X[:, :n_kept], span.labels[:n_kept], span.groups[:n_kept])
    rigid = rigid_block(families, families.Psi_R, "rigid-body")
    modes = mode_set("krylov", families, [rigid, columns], options=options)
    # number of columns that n_modes does not count; smaller sets contain them too
    n_static = np.array([float(rigid.columns.shape[1] + min(n_first, n_kept))])
    return replace(modes, data={"omega2": np.array(span.omega2), "n_static": n_static})
