"""The generalized-alpha method for constrained motion on R³ × SO(3) × Rⁿ."""

from dataclasses import dataclass, replace

import numpy as np

from cms.arrays import Array
from floatframe.constraint_words import open_joints
from floatframe.errors import ModelError
from floatframe.initial import acceleration_rates, consistent_state, velocity_correction
from floatframe.kernels.model import MASS, STIFFNESS, Memory, Model, Rows, Work, new_rows, new_work
from floatframe.linearization import displaced, modal_diagonals
from floatframe.state import State
from floatframe.system import System

__all__ = ["Carry", "Failure", "GeneralizedAlpha"]


@dataclass(frozen=True, eq=False)
class Carry:
    """All that generalized-alpha remembers between steps."""

    state: State
    u_dot: Array  #: accelerations, (n_u,)
    a: Array  #: algorithmic accelerations, (n_u,); for h = 0 (at the start) the rates of u_dot
    h: float  #: step size to which `a` belongs; 0 at the start
    w: Array  #: wrenches of the connections on their markers A, ground axes, (n_w,)
    work: Array  #: of point forces; taken by dampers and modal damping, (2,)
    power: Array  #: their rates, (2,)
    n_iterations: int = 0  #: of Newton's method so far


@dataclass(frozen=True)
class Failure:
    """Why a step could not be made."""

    words: str
    residual: float  #: last correction over the allowed one


@dataclass(frozen=True)
class GeneralizedAlpha:
    """Generalized-alpha for index-3 equations of motion on a Lie group [1]_ [2]_, second order.

    (1) predict: a_new = a
    (2) Newton on  M u_dot - Jᵀ w = f, g = 0  over the increment x of the step, where
        x = h u + h² ((1/2 - beta) a + beta a_new),  r + x_r, R exp(x_theta), q + x_q
        u_new = u + h ((1 - gamma) a + gamma a_new)
    (3) (1 - alpha_m) a_new + alpha_m a = (1 - alpha_f) u_dot_new + alpha_f u_dot

    Unknowns of Newton's method are x and beta h² w, the equations of motion are multiplied by beta h², so that the
    matrix stays well-conditioned as h falls. The start uses a = u_dot(t + (alpha_m - alpha_f) h) and shifts the
    velocities by O(h²) such that the first step closes the joints without a kick; without both, reactions begin with
    an error of first order.

    References
    ----------
    .. [1] Arnold & Bruels (2007), Multibody System Dynamics 18, 185-202.
    .. [2] Bruels & Cardona (2010), Journal of Computational and Nonlinear Dynamics 5, 031002.
    """

    #: spectral radius at infinite frequency, 0 <= rho_inf <= 1; 1: no numerical damping, reactions of joints then
    #: oscillate by O(h) for good
    rho_inf: float = 0.8
    tolerance: float = 1e-8  #: largest last correction over the one that the accelerations of the step amount to
    max_iterations: int = 25

    def __post_init__(self) -> None:
        if not 0.0 <= self.rho_inf <= 1.0:
            raise ModelError(f"GeneralizedAlpha: rho_inf: expected 0 <= rho_inf <= 1, got {self.rho_inf}")
        if not 0.0 < self.tolerance < 1.0:
            raise ModelError(f"GeneralizedAlpha: tolerance: expected 0 < tolerance < 1, got {self.tolerance}")
        if self.max_iterations < 1:
            raise ModelError(f"GeneralizedAlpha: max_iterations: expected at least 1, got {self.max_iterations}")

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """alpha_m, alpha_f, beta, gamma."""
        rho = self.rho_inf
        alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        return alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma

    def start(self, system: System, t: float, state: State | None = None) -> Carry:
        """Return the memory at the beginning: the state made consistent, its accelerations and their rates."""
        consistent = consistent_state(system, state, t=t)
        rates = acceleration_rates(system.compiled, consistent, t)
        return Carry(consistent.state, consistent.u_dot, rates, 0.0, consistent.w, np.zeros(2), np.zeros(2))

    def step(self, system: System, t: float, h: float, carry: Carry) -> Carry:
        """Return the memory one step of size h later.

        Raises
        ------
        ConvergenceError
            If Newton's method fails.
        """
        from floatframe.errors import ConvergenceError

        work = new_work(system.compiled.model)
        after, _, _, failure = self.advance(system, carry, work, t0=t, h=h, first=0, n_steps=1, every=2)
        if failure is not None:
            words = f"the step of {h:g} from t = {t:g} failed: {failure.words}"
            raise ConvergenceError(words, t=t, h=h, residual=failure.residual)
        return after

    def observe(self, system: System, t: float, carry: Carry, work: Work) -> tuple[Carry, Rows]:
        """Return the results at the carried state; the carry learns the power at it."""
        from floatframe.kernels.entry import observe_state

        memory = memory_of(carry)
        rows = observe_state(system.compiled.model, work, memory, t)
        return replace(carry, power=memory.power), rows

    def advance(
        self, system: System, carry: Carry, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Carry, Rows, int, Failure | None]:
        """Advance by n_steps of size h, the first of them number `first` from t0.

        `work` holds the factors of the last Newton matrix, which serve until they are too old.

        Returns
        -------
        tuple
            The memory after the last good step; the rows of results after every `every`-th step; how many steps were
            good; why the next was not, or None.
        """
        from floatframe.kernels.entry import advance_steps

        compiled = system.compiled
        carry = self.prepared(system, carry, h, t0 + first * h)
        memory = memory_of(carry)
        n_rows = (first + n_steps) // every - first // every
        rows = new_rows(compiled.model, n_rows)
        iterations = int(work.counts[2])
        outcome = advance_steps(
            compiled.model,
            work,
            memory,
            rows,
            t0=t0,
            h=h,
            first=first,
            n_steps=n_steps,
            every=every,
            coefficients=self.coefficients,
            tolerance=self.tolerance,
            max_iterations=self.max_iterations,
            length=compiled.length,
        )
        after = Carry(
            State(memory.r, memory.p, memory.q, memory.u),
            memory.u_dot,
            memory.a,
            h,
            memory.w,
            memory.work,
            memory.power,
            carry.n_iterations + int(work.counts[2]) - iterations,
        )
        rows = Rows(*(array[: outcome.n_rows] for array in rows))
        failure = None if outcome.status == 0 else self.explain(system, work, outcome)
        return after, rows, outcome.n_steps, failure

    def prepared(self, system: System, carry: Carry, h: float, t: float) -> Carry:
        """Return the memory with its algorithmic accelerations for steps of size h.

        At the start: a = u_dot + (alpha_m - alpha_f) h d(u_dot)/dt, where rates of modes that h does not resolve are
        left out smoothly, and the velocities are shifted. After a change of the step size: scaled likewise.
        """
        if carry.h == h:
            return carry
        if carry.h != 0.0:
            return replace(carry, a=carry.u_dot + h / carry.h * (carry.a - carry.u_dot), h=h)
        compiled = system.compiled
        alpha_m, alpha_f, beta, _ = self.coefficients
        rates = carry.a / (1 + h**2 * squared_frequencies(compiled.model))
        a = carry.u_dot + (alpha_m - alpha_f) * h * rates
        x = h * carry.state.u + h**2 * (0.5 * a + beta * h * rates)
        after = displaced(compiled.model, carry.state, x)
        shift = velocity_correction(compiled, carry.state, after, h, beta, t)
        return replace(carry, state=replace(carry.state, u=carry.state.u + shift), a=a, h=h)

    def explain(self, system: System, work: Work, outcome: tuple) -> Failure:
        """Say why a step failed."""
        from floatframe.kernels.generalized_alpha import SINGULAR_BODY, SINGULAR_CONNECTION

        compiled = system.compiled
        status, _, _, index, excess = outcome
        if status == SINGULAR_BODY:
            name = compiled.body_names[index]
            words = f"the Newton matrix of body {name!r} is singular; check its mass, inertia and stiffness"
            return Failure(words, excess)
        if status == SINGULAR_CONNECTION:
            name = compiled.connection_names[index]
            return Failure(f"the constraints of joint {name!r} depend on others here (a singular position)", excess)
        words = f"Newton's method did not converge in {self.max_iterations} iterations"
        if np.isfinite(excess):
            words += f" (last correction {excess:.2g} times the allowed one)"
        gaps = open_joints(compiled, work.g)
        if gaps and np.isfinite(work.g).all():
            words += f"; {gaps}"
        words += "; choose a smaller h, or look for a singular position, a drive out of reach or an error in the system"
        return Failure(words, excess)


def memory_of(carry: Carry) -> Memory:
    """Return a copy of the memory that the kernels may overwrite."""
    state = carry.state
    return Memory(
        state.r.copy(),
        state.p.copy(),
        state.q.copy(),
        state.u.copy(),
        np.array(carry.u_dot),
        np.array(carry.a),
        np.array(carry.w),
        np.array(carry.work),
        np.array(carry.power),
    )


def squared_frequencies(model: Model) -> Array:
    """Return K_kk/M_kk for modal velocities (infinite without mass), 0 for the others, (n_u,) [1/s²]."""
    result = np.zeros(int(model.u0[-1]))
    for i in range(len(model.kind)):
        M, K = modal_diagonals(model, i, MASS), modal_diagonals(model, i, STIFFNESS)
        ratio = np.divide(K, M, out=np.full(len(M), np.inf), where=M > 0)
        result[model.u0[i] + 6 : model.u0[i + 1]] = np.maximum(ratio, 0.0)
    return result
