"""H2-optimal mode set: directions for which the impulse responses between the interfaces have the least error."""

import logging
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la
from scipy.optimize import OptimizeResult, minimize

from cms.errors import ModeSetError
from cms.modes.families.families import Families, body_of, families_of
from cms.modes.mode_set import Block, ModeSet, boundary_block, mode_set, require_interfaces, rigid_block
from cms.modes.mode_sets.balanced import balance
from cms.modes.mode_sets.elastic_system import (
    NOTHING_NEW,
    check_options,
    chosen_dofs,
    damping_description,
    elastic_system,
    first_independent,
    require_damped,
)
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import combine

__all__ = ["H2Problem", "PoleResidues", "h2_optimal", "pole_residues"]

log = logging.getLogger(__name__)

MOST_ITERATIONS = 500  #: default of `max_iterations`
WINDOW = 10  #: number of iterations over which the decrease of the error is judged
STATIONARY = 1e-3  #: relative decrease of the error over the window, below which the directions are stationary
EXACT = 1e-13  #: squared relative error that is rounding
REMEMBERED = 20  #: number of steps that L-BFGS remembers
COINCIDENT = 1e-10  #: distance of the two poles of a mode relative to their size, below which they are one


# transfer functions by poles and residues -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class PoleResidues:
    """Symmetric transfer function H(s) = Σ_k r_k r_kᵀ / (s - p_k)."""

    p: Array  #: poles, (n_p,) complex [1/s]
    r: Array  #: rows r_k, (n_p, n_u) complex
    X: Array  #: shapes of the poles over the coordinates, r = Xᵀ B, (n, n_p) complex

    def at(self, s: Array, b: Array) -> tuple[Array, Array]:
        """Return H(s_k) b_k, (n_u, n_s), and b_kᵀ H[s_k, s_l] b_l, (n_s, n_s), with the divided differences of H.

        (1) U_jk = r_jᵀ b_k / (s_k - p_j), so H(s_k) b_k = Σ_j r_j U_jk
        (2) 1 / (s - p) has the divided difference -1 / ((s_k - p) (s_l - p)), so the second result is -Uᵀ U; for k = l
            it contains the derivative of H
        """
        U = (self.r @ b.T) / (s[None, :] - self.p[:, None])
        return self.r.T @ U, -U.T @ U


def pole_residues(omega2: Array, D: Array, B: Array) -> PoleResidues:
    """Return the transfer function Bᵀ (s² + s D + diag(omega²))⁻¹ B by its poles and residues.

    (1) x = shape of a pole p: (p² + p D + diag(omega²)) x = 0; the states (omega q, q_dot) give a well-scaled matrix
    (2) the system is symmetric, so the residue is x xᵀ with the scale xᵀ (2 p + D) x = 1; a diagonal D gives both in
        closed form, 1 / ((s - p) (s - p')) = [1 / (s - p) - 1 / (s - p')] / (p - p')

    Raises
    ------
    ModeSetError
        If two poles coincide, as with critical damping.
    """
    n, d = len(omega2), np.diag(D)
    if np.count_nonzero(D - np.diag(d)) == 0:
        root = np.sqrt(d * d / 4 - omega2 + 0j)
        p = np.concatenate([-d / 2 + root, -d / 2 - root])
        scale = np.concatenate([2 * root, -2 * root])
        X = np.hstack([np.eye(n), np.eye(n)]).astype(complex)
    else:
        omega = np.sqrt(omega2)
        A = np.block([[np.zeros((n, n)), np.diag(omega)], [-np.diag(omega), -D]])
        p, states = la.eig(A)  # (1)
        X = states[:n] / omega[:, None]
        X = X / np.linalg.norm(X, axis=0)
        scale = 2 * p * np.einsum("nk,nk->k", X, X) + np.einsum("nk,nk->k", X, D @ X)
    if not (np.abs(scale) > COINCIDENT * np.abs(p)).all():
        raise ModeSetError("h2_optimal: two poles coincide: a mode has critical damping; give another damping_ratio")
    X = X / np.sqrt(scale)  # (2)
    return PoleResidues(p, X.T @ B, X)


# the H2 error of a reduced system and its gradient --------------------------------------------------------------------


class H2Problem:
    """Squared H2 error J(V) = |H - H_V|² of the system reduced to the span of V, relative to |H|², and its gradient.

    The norm of H is the root of ∫ |h(t)|² dt over the impulse responses h between all loads and responses.

    (1) V orthonormal; H_V(s) = B_Vᵀ (s² + s D_V + K_V)⁻¹ B_V with D_V = Vᵀ D V, K_V = Vᵀ diag(omega²) V, B_V = Vᵀ B
    (2) by its poles p_k and residues r_k: <G, H_V> = Σ_k r_kᵀ G(-p_k) r_k for each stable G, so
        J = |H|² + Σ_k r_kᵀ [H_V(-p_k) - 2 H(-p_k)] r_k
    (3) with E = H_V - H, Z(s) = s² + s D + diag(omega²), reduced response x = Z_V⁻¹ B_V = Σ_k x_k r_kᵀ / (s - p_k) and
        residual rho = B - Z V x = (1 - V Vᵀ) B - Σ_k W_k r_kᵀ / (s - p_k), W_k = Z(p_k) V x_k:
        dH_V = rhoᵀ dV x + its transpose, so dJ = 4 <E, rhoᵀ dV x>; the residues of rho(s) E(-s) x(s)ᵀ on the left give
        dJ/dV = 4 Re[(1 - V Vᵀ) B Σ_k E(s_k) r_k x_kᵀ + Σ_kl W_k (r_kᵀ E[s_k, s_l] r_l) x_lᵀ]
        with divided differences at the mirrored poles s_k = -p_k. Interpolation there makes it zero: E(s_k) r_k = 0,
        r_kᵀ E[s_k, s_l] r_l = 0.
    """

    def __init__(self, omega2: Array, D: Array, B: Array) -> None:
        """Prepare the transfer function of the whole system.

        Raises
        ------
        ModeSetError
            If a mode is undamped, so that the norm is infinite, or has critical damping.
        """
        self.omega2, self.D, self.B = omega2, D, B
        self.whole = pole_residues(omega2, D, B)
        require_damped("h2_optimal", self.whole.p, omega2)
        values, _ = self.whole.at(-self.whole.p, self.whole.r)
        self.norm2 = float(np.sum(self.whole.r.T * values).real)  #: |H|²

    def error(self, V: Array) -> float:
        """Return J(V) / |H|² for independent columns V, (n, k)."""
        return self.error_and_gradient(V)[0]

    def error_and_gradient(self, V: Array) -> tuple[float, Array]:
        """Return J(V) / |H|² for independent columns V, (n, k), and its gradient, (n, k)."""
        if not V.shape[1]:
            return 1.0, V
        Q, R = la.qr(V, mode="economic")
        reduced, Y = self.reduced(Q)
        p, r = reduced.p, reduced.r
        of_reduced, differences = reduced.at(-p, r)
        of_whole, whole_differences = self.whole.at(-p, r)
        J = self.norm2 + float(np.sum(r.T * (of_reduced - 2 * of_whole)).real)  # (2)
        E, E_kl = of_reduced - of_whole, differences - whole_differences
        x = Y @ reduced.X
        shapes = Q @ x
        W = self.omega2[:, None] * shapes + (self.D @ shapes) * p + shapes * p**2
        outside = self.B - Q @ (Q.T @ self.B)
        G = 4 * (outside @ (E @ x.T) + W @ (E_kl @ x.T)).real  # (3)
        return J / self.norm2, la.solve_triangular(R, G.T).T / self.norm2

    def reduced(self, Q: Array) -> tuple[PoleResidues, Array]:
        """Return the transfer function of the system reduced to orthonormal columns Q, in its modes Q Y: step (1)."""
        omega2, Y = la.eigh(Q.T @ (self.omega2[:, None] * Q))
        modes = Q @ Y
        return pole_residues(omega2, modes.T @ (self.D @ modes), modes.T @ self.B), Y


# the directions -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Directions:
    """Directions of the least H2 error beside fixed ones, and how they were found."""

    V: Array  #: the directions, without the fixed ones, (n, n_modes)
    error: float  #: |H - H_V| / |H|
    start: str  #: what the iteration started from
    n_iterations: int  #: number of iterations
    is_stationary: bool  #: whether the last iterations changed the error by less than `STATIONARY`
    decrease: float  #: relative decrease of the error over the last iterations
    change: float  #: largest relative change of a pole over the last iterations


def best_directions(
    problem: H2Problem, fixed: Array, starts: dict[str, Array], n_modes: int, max_iterations: int
) -> Directions:
    """Return `n_modes` directions that minimise the H2 error together with fixed ones.

    (1) start from the first independent directions of the start with the least error
    (2) variables Y = diag(omega) V: in the norm of strain energy, low and high frequencies have similar curvature
    (3) L-BFGS lowers log J until ten iterations lower the error by less than 0.1 %; the error never rises

    Parameters
    ----------
    problem
        The system.
    fixed
        Columns Y that the span contains in any case, orthonormal, (n, n_fixed).
    starts
        Directions by descending importance, (n, n_any), by name.
    n_modes
        Number of directions.
    max_iterations
        Largest number of iterations.
    """
    omega = np.sqrt(problem.omega2)[:, None]

    def span(Y: Array) -> Array:
        return np.hstack([fixed, Y]) / omega

    begun = {name: first_independent(omega * V, fixed, n_modes) for name, V in starts.items()}
    errors = {name: problem.error(span(Y)) for name, Y in begun.items()}
    start = min(errors, key=errors.__getitem__)
    Y, J = begun[start], errors[start]
    if n_modes == 0 or J < EXACT:
        return Directions(Y / omega, float(np.sqrt(max(J, 0.0))), start, 0, True, 0.0, 0.0)

    def objective(y: Array) -> tuple[float, Array]:
        J, G = problem.error_and_gradient(span(y.reshape(Y.shape)))
        J = max(J, EXACT)
        return float(np.log(J)), (G[:, fixed.shape[1] :] / omega / J).ravel()

    history = deque([(np.log(J), Y.ravel())], maxlen=WINDOW + 1)
    n_iterations = 0

    def decrease() -> float:
        return float(1 - np.exp((history[-1][0] - history[0][0]) / 2))

    def record(intermediate_result: OptimizeResult) -> None:
        nonlocal n_iterations
        n_iterations += 1
        history.append((intermediate_result.fun, intermediate_result.x.copy()))
        if intermediate_result.fun <= np.log(EXACT) or (len(history) > WINDOW and decrease() < STATIONARY):
            raise StopIteration

    found = minimize(  # (3)
        objective,
        Y.ravel(),
        jac=True,
        method="L-BFGS-B",
        callback=record,
        options={"maxiter": max_iterations, "maxfun": 20 * max_iterations, "maxcor": REMEMBERED, "ftol": 0, "gtol": 0},
    )
    last, earlier = (span(y.reshape(Y.shape)) for y in (history[-1][1], history[0][1]))
    frequencies = [np.sort(np.abs(problem.reduced(la.qr(V, mode="economic")[0])[0].p)) for V in (last, earlier)]
    return Directions(
        last[:, fixed.shape[1] :],
        float(np.exp(history[-1][0] / 2)),
        start,
        n_iterations,
        is_stationary=found.status != 1,  # 1: the largest number of iterations; otherwise no step lowers the error
        decrease=decrease(),
        change=float(np.abs(frequencies[0] / frequencies[1] - 1).max()),
    )


def dominant_modes(problem: H2Problem) -> Array:
    """Return unit columns of the modes by descending H2 norm |b bᵀ| / sqrt(2 d omega²) of their transfer functions."""
    norm = np.einsum("kb,kb->k", problem.B, problem.B) / np.sqrt(np.diag(problem.D) * problem.omega2)
    return np.eye(len(norm))[:, np.argsort(-norm, kind="stable")]


def fewest_directions(make: Callable[[int], Directions], most: int, tolerance: float) -> Directions:
    """Return the fewest directions with a relative H2 error of at most the tolerance, by bisection."""
    low, high = -1, most
    best = make(most)
    while high - low > 1:
        middle = (low + high) // 2
        found = make(middle)
        if found.error <= tolerance:
            high, best = middle, found
        else:
            low = middle
    return best


def h2_optimal(
    body: FEBody | Families,
    *,
    n_modes: int | None = None,
    tolerance: float | None = None,
    damping_ratio: float = 0.01,
    n_rich: int | None = None,
    inputs: Sequence[str] | None = None,
    static: bool = True,
    max_iterations: int = MOST_ITERATIONS,
) -> ModeSet:
    """H2-optimal set: [Psi_R, Psi_U, the directions of least error of the impulse responses] [1]_.

    (1) Rich basis: free modes and residual attachment modes, M-orthonormal and K-diagonal. No further factorisation is
        needed, and a modal damping ratio is diagonal.
    (2) Loads and responses at all boundary dofs, or at chosen ones, each scaled so that its own static elastic response
        is 1.
    (3) Start from the modes with the largest transfer functions, or from balanced directions, whichever has the
        smaller error.
    (4) Descend along the gradient of the H2 error over all subspaces that contain Psi_U (`H2Problem`), until the error
        is stationary. M, D and K are projected by one real congruence, which keeps them symmetric and definite.

    The error is at most that of the best start, so at most that of balanced truncation and of the dominant free modes
    with as many columns. The minimum is local; rounding may choose between minima of nearly the same error, as for a
    symmetric body. The `data` of the set contain the relative H2 error ("h2 error").

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`, which several sets can share.
    n_modes
        Number of directions beside Psi_R and Psi_U.
    tolerance
        Relative H2 error, 0 to 1, instead of a number: the fewest directions whose error is at most as large.
    damping_ratio
        Modal damping ratio of the transfer functions, added to the damping of the body; default 1 % of critical.
    n_rich
        Number of free modes of the rich basis. Default: 3 n_modes, at least 60 and at most three fifths of all; fewer
        if the eigensolver cannot find that many.
    inputs
        Interfaces at which loads act and responses are measured, or single components, such as "big_end" or "big_end
        uz". Default: all boundary dofs.
    static
        Whether the set contains the unrestrained attachment modes Psi_U, and is statically complete.
    max_iterations
        Largest number of iterations; a warning says if the error was not stationary before.

    Raises
    ------
    ModeSetError
        If not exactly one of n_modes and tolerance is given, numbers are out of range, a name is no interface or
        component, a mode is undamped or critically damped, or the rich basis cannot be computed.

    References
    ----------
    .. [1] Gugercin, Antoulas & Beattie (2008) and Wyatt (2012), docs/bibliography.md, interpolate at mirrored poles;
       the gradient is derived at `H2Problem`.
    """
    check_options("h2_optimal", n_modes, tolerance, damping_ratio, n_rich)
    if max_iterations < 1:
        raise ModeSetError(f"h2_optimal: max_iterations = {max_iterations}; expected 1 or more")
    source, body = body, body_of(body)
    body.require_coupled()
    require_interfaces("h2_optimal", body)
    with families_of(source) as families:
        system = elastic_system("h2_optimal", families, n_modes, n_rich=n_rich, damping_ratio=damping_ratio)
        into = chosen_dofs("h2_optimal", body, "inputs", inputs)
        problem = H2Problem(system.omega2, system.D, system.B[:, into])
        fixed = np.zeros((len(system.omega2), 0))
        if static:
            fixed = la.orth(system.B / np.sqrt(system.omega2)[:, None], rcond=NOTHING_NEW)
        starts = {
            "dominant free modes": dominant_modes(problem),
            "balanced directions": balance(system.omega2, system.D, problem.B).T,
        }
        most = len(system.omega2) - fixed.shape[1]
        if n_modes is not None and n_modes > most:
            raise ModeSetError(
                f"h2_optimal: n_modes = {n_modes}, but the rich basis of body {body.name!r} has {most} directions "
                "beside the static responses; choose fewer, or a larger n_rich"
            )

        def make(n: int) -> Directions:
            return best_directions(problem, fixed, starts, n, max_iterations)

        found = make(n_modes) if n_modes is not None else fewest_directions(make, most, tolerance or 0.0)
        _warn_if_moving(body, found)
        Q = la.qr(found.V, mode="economic")[0]
        V = Q @ la.eigh(Q.T @ (system.omega2[:, None] * Q))[1] if Q.size else Q
        n_found = V.shape[1]
        blocks = [
            rigid_block(families, families.Psi_R, "rigid-body"),
            *([boundary_block(body, families.Psi_U, "unrestrained attachment")] if static else []),
            Block(combine(system.Phi, V), [f"h2-optimal {k + 1}" for k in range(n_found)], ["h2-optimal"] * n_found),
        ]
        options = {
            "n_modes": str(n_found),
            "rich basis": f"{len(system.omega2)} elastic columns",
            "inputs": ", ".join(inputs) if inputs is not None else "all interfaces",
            "damping": damping_description(body, damping_ratio),
            "relative H2 error": f"{found.error:.3g}",
            "start": found.start,
            "iterations": f"{found.n_iterations}, {'stationary' if found.is_stationary else 'not stationary'}",
        }
        modes = mode_set("h2-optimal", families, blocks, options=options)
        return replace(modes, data={"h2 error": np.array([found.error])})


def _warn_if_moving(body: FEBody, found: Directions) -> None:
    """Warn if the error was still falling when the iteration ended."""
    if not found.is_stationary:
        log.warning(
            "h2_optimal: body %r: the error is not stationary after %d iterations: the last %d lowered it by %.2g %% "
            "(expected below %.2g %%) and moved a pole by %.2g %%; give more max_iterations",
            body.name, found.n_iterations, min(WINDOW, found.n_iterations), 100 * found.decrease, 100 * STATIONARY,
            100 * found.change,
        )  # fmt: skip
