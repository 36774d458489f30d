"""The generalized-alpha method for constrained motion on R³ × SO(3) × Rⁿ.

Evaluated in `floatframe.engine.kernels.generalized_alpha`.
"""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.constraint_words import open_joints
from floatframe.engine.initial_conditions.initial import (
    ConsistentState,
    solve_accelerations,
    work_from,
)
from floatframe.engine.initial_conditions.newton_equations import displaced, modal_diagonals
from floatframe.engine.initial_conditions.step_filter import (
    Beginning,
    Spin,
    StepFilter,
    beginning_of,
    closing_velocities,
    spin_of,
    step_filter,
)
from floatframe.engine.kernels.entry import Outcome
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.model import COUPLER, JOINT, MASS, Model
from floatframe.engine.kernels.work import Work
from floatframe.errors import ModelError
from floatframe.integrators.integrator import (
    LEAST_STEP,
    Failure,
    Integrator,
    failure_of_element,
    has_divided_steps,
    started_anew,
)
from floatframe.model.joints.rows import is_held_position
from floatframe.model.system import System

__all__ = ["GeneralizedAlpha", "hht", "newmark", "trapezoidal"]

LONGER = 1 + 1e-6  #: ratio of two step sizes below which they count as equal


@dataclass(frozen=True)
@checked_fields(ModelError)
class GeneralizedAlpha(Integrator):
    """Generalized-alpha for index-3 equations of motion on a Lie group [1]_ [2]_, second order.

    (1) predict: a_new = a
    (2) Newton's method for  M u_dot - Jᵀ w = f, g = 0  in the increment x of the step, where
        x = h u + h² ((1/2 - beta) a + beta a_new),  r + x_r, R exp(x_theta), q + x_q
        u_new = u + h ((1 - gamma) a + gamma a_new)
    (3) (1 - alpha_m) a_new + alpha_m a = (1 - alpha_f) u_dot_new + alpha_f u_dot

    The unknowns of Newton's method are x and beta h² w, and the equations of motion are multiplied by beta h², so that
    the matrix stays well-conditioned as h falls. The start uses a = u_dot(t + (alpha_m - alpha_f) h) without the
    components that steps of size h do not resolve, and changes the velocities by O(h²) so that the first step closes
    the joints without a kick (`initial_conditions.step_filter`). Otherwise reactions would begin with an error of first
    order. Where forces jump, a changes by the jump of u_dot, filtered likewise.

    In linear systems no mode gains energy, and in each step the amplitude of a mode that h does not resolve falls to
    rho_inf times its value. In nonlinear systems the error of the energy is of second order.

    With `error_tolerance` the step follows the motion. The position x of (2) and the exact one differ by [3]_

        e = (gamma/2 - beta - 1/12) h² (a_new - a) + O(h⁴),

    because a = u_dot + (1/2 - gamma) h u_ddot to first order, so that x has h³ u_ddot ((1/2 - gamma)/2 + beta) in the
    place of h³ u_ddot / 6. A step is repeated with a smaller size if e is above the tolerance or Newton's method fails.
    e is taken for each body, as the root mean square over its mass divided by the size of all bodies connected with it
    by joints and forces (without the ground), and the largest decides: so no heavy or distant body hides the error of
    another. The `h` of `integrate` is then the interval of output times and the longest step. Equal steps from one
    output time to the next meet these times exactly.

    Parameters
    ----------
    rho_inf
        Spectral radius at infinite frequency, 0 <= rho_inf <= 1; 1: no numerical damping, so that reactions of joints
        oscillate permanently by O(h).
    tolerance
        Largest last correction relative to the displacement due to the accelerations of the step.
    max_iterations
        Largest number of Newton iterations in a step.
    error_tolerance
        Largest local error of a body in a step relative to the size of the connected bodies; None: fixed step.
    h_min
        Smallest size to which a step may be divided, after failure or at a contact [s]. None: a millionth of h; fixed
        steps are then divided only in systems with contacts or dry friction.
    parameters
        alpha_m, alpha_f, beta, gamma instead of those from rho_inf (see `newmark`, `hht`).
    stabilized
        Enforce velocities of joints as well as positions, and integrate the spin of axisymmetric bodies separately;
        False: the equations of reference 2 unchanged, whose steps sensitivities differentiate.

    References
    ----------
    .. [1] Arnold & Bruels (2007), Multibody System Dynamics 18, 185-202.
    .. [2] Bruels & Cardona (2010), Journal of Computational and Nonlinear Dynamics 5, 031002.
    .. [3] The estimate of Zienkiewicz & Xie (1991), Earthquake Engineering & Structural Dynamics 20, 871-887, which
       Negrut et al. carried over to the index-3 equations of HHT; derived above for all parameters.
    """

    rho_inf: float = 0.8
    tolerance: float = 1e-8
    max_iterations: int = 25
    error_tolerance: float | None = None
    h_min: float | None = None
    parameters: tuple[float, float, float, float] | None = None
    stabilized: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.rho_inf <= 1.0:
            raise ModelError(f"GeneralizedAlpha: rho_inf: expected 0 <= rho_inf <= 1, got {self.rho_inf}")
        if not 0.0 < self.tolerance < 1.0:
            raise ModelError(f"GeneralizedAlpha: tolerance: expected 0 < tolerance < 1, got {self.tolerance}")
        if self.max_iterations < 1:
            raise ModelError(f"GeneralizedAlpha: max_iterations: expected at least 1, got {self.max_iterations}")
        for name in ("error_tolerance", "h_min"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < np.inf:
                raise ModelError(f"GeneralizedAlpha: {name}: expected a number above 0, or None, got {value}")
        if self.parameters is not None:
            object.__setattr__(self, "parameters", tuple(float(x) for x in self.parameters))
            if len(self.parameters) != 4 or not self.parameters[2] > 0 or max(self.parameters[:2]) >= 1:
                raise ModelError(
                    "GeneralizedAlpha: parameters: expected (alpha_m, alpha_f, beta, gamma) with alpha_m and alpha_f "
                    f"below 1 and beta above 0, got {self.parameters}"
                )

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """Coefficients alpha_m, alpha_f, beta and gamma of the method."""
        if self.parameters is not None:
            return self.parameters
        rho = self.rho_inf
        alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + alpha_f - alpha_m
        return alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma

    def after_jump(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory after forces have jumped at t, and the results there.

        The state stays. u_dot and a change by the jump after the filter of `initial_conditions.step_filter` with s = 1.
        """
        if memory.h == 0.0:
            return started_anew(self, system, t, memory, work)
        exact, change = self.jump(compiled_system(system), memory, t)
        after, rows = self.observe(system, t, exact, work)
        return after.changed(u_dot=memory.u_dot + change, a=memory.a + change), rows

    def jump(
        self, compiled: CompiledSystem, memory: Memory, t: float, may: NDArray[np.bool_] | None = None
    ) -> tuple[Memory, Array]:
        """Return the memory with u_dot and w after forces have jumped at t; the change of u_dot is filtered.

        may: see `spin_at`.
        """
        work = work_from(compiled.model, memory.w)
        work.state.time[...] = t
        u_dot, w = solve_accelerations(compiled, work, memory.state, memory.w)
        after = memory.changed(u_dot=u_dot, w=w, h_next=0.0)
        spin = self.spin_at(compiled, after, may)
        z = self.filter_at(compiled, after, float(memory.h), t, full=True, spin=spin, work=work)
        assert z is not None
        return after, z.twice(u_dot - memory.u_dot)

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps of size h, beginning with step `first` counted from t0; see `integrator.Integrator`.

        `work` holds the factors of the last Newton matrix, which are used until they are too old.
        """
        from floatframe.engine.kernels.entry import absolute_kernels

        compiled = compiled_system(system)
        after = self.prepared(system, memory, h, t0 + first * h).copied()
        rows, outcome = absolute_kernels.advance(
            compiled.model, work, memory=after,
            t0=t0, h=h, first=first, n_steps=n_steps, every=every, **self.numbers(compiled, h),
        )  # fmt: skip
        failure = None if outcome.status == 0 else self.explain(system, work, outcome, after.u, h)
        return after, rows, outcome.n_steps, failure

    def numbers(self, compiled: CompiledSystem, h: float) -> dict[str, float]:
        """Return the parameters for steps of size h, by the names of the fields of `Order` in the kernels."""
        return dict(zip(("alpha_m", "alpha_f", "beta", "gamma"), self.coefficients, strict=True)) | {
            "tolerance": self.tolerance,
            "max_iterations": self.max_iterations,
            "length": compiled.length,
            "most_error": self.error_tolerance or 0.0,
            "h_min": self.least_step(h, compiled),
            "stabilized": int(self.stabilized),
        }

    def least_step(self, h: float, compiled: CompiledSystem) -> float:
        """Return the smallest size to which a step of size h may be divided; 0 if steps may not be divided."""
        if self.h_min is not None:
            return min(self.h_min, h)
        is_fixed = self.error_tolerance is None and not has_divided_steps(compiled.model)
        return 0.0 if is_fixed else LEAST_STEP * h

    def spin_at(self, compiled: CompiledSystem, memory: Memory, may: NDArray[np.bool_] | None = None) -> Spin | None:
        """Return the bodies whose spin the next step integrates separately; may, (n_b,): candidates, None for all."""
        return spin_of(compiled, consistent_of(memory), may) if self.stabilized else None

    def filter_at(
        self,
        compiled: CompiledSystem,
        memory: Memory,
        h: float,
        t: float,
        *,
        full: bool,
        spin: Spin | None,
        work: Work,
    ) -> StepFilter | None:
        """Return the filter of `initial_conditions.step_filter` for step size h; full: with s = 1; None if s = 0."""
        _, _, beta, gamma = self.coefficients
        s = 1.0 if full else min(gamma - 0.5, 1.0)
        if s <= 0.0:
            return None
        numbers = {"c_d": s * gamma * h, "c_k": s * beta * h**2}
        return step_filter(compiled, consistent_of(memory), t, **numbers, spin=spin, work=work)

    def filtered(
        self, compiled: CompiledSystem, memory: Memory, h: float, t: float, *, full: bool, spin: Spin | None
    ) -> Beginning:
        """Return the initial accelerations of a motion and their rates after the filter from `filter_at`."""
        work = work_from(compiled.model, memory.w)
        z = self.filter_at(compiled, memory, h, t, full=full, spin=spin, work=work)
        return beginning_of(compiled, consistent_of(memory), t, h, z, work, spin=spin)

    def first_step(self, compiled: CompiledSystem, memory: Memory, h: float, t: float, spin: Spin | None) -> float:
        """Return the size of the first step, an equal part of h for which the estimated error is allowed."""
        if self.error_tolerance is None:
            return h
        model = compiled.model
        _, _, beta, gamma = self.coefficients
        rates = self.filtered(compiled, memory, h, t, full=True, spin=spin).rates
        squares = np.add.reduceat(mass_weights(model) * rates**2, model.bodies.u0[:-1])
        largest = np.sqrt(squares / model.body_types.mass[model.bodies.kind]) / model.bodies.size
        error = abs(gamma / 2 - beta - 1 / 12) * largest.max()
        fitting = (self.error_tolerance / error) ** (1 / 3) if error > 0 else h
        return h / ceil(h / max(0.5 * fitting, self.least_step(h, compiled), 1e-3 * h) * (1 - 1e-9))

    def prepared(self, system: System, memory: Memory, h: float, t: float) -> Memory:
        """Return the memory with algorithmic accelerations for steps of size h that begin at t.

        At the start, and where longer steps follow, a is found as in `initial_conditions.step_filter`. Where shorter
        steps follow, the difference a - u_dot is scaled by the ratio of the step sizes.
        """
        compiled = compiled_system(system)
        is_divided = self.least_step(h, compiled) > 0.0
        if memory.h == h or (memory.h != 0.0 and is_divided):
            return memory.changed(h_next=min(float(memory.h_next) or h, h) if is_divided else h)
        if h <= LONGER * memory.h:
            return memory.changed(a=memory.u_dot + h / memory.h * (memory.a - memory.u_dot), h=h, h_next=h)
        spin = self.spin_at(compiled, memory)
        if memory.h == 0.0:
            h = self.first_step(compiled, memory, h, t, spin)
        alpha_m, alpha_f, beta, _ = self.coefficients
        begun = self.filtered(compiled, memory, h, t, full=False, spin=spin)
        u_dot, a = begun.u_dot, begun.u_dot + (alpha_m - alpha_f) * h * begun.rates
        state = memory.state
        rows = rows_closed_by_positions(compiled.model, self.stabilized)
        if rows.any():
            work = work_from(compiled.model, memory.w)
            z = self.filter_at(compiled, memory, h, t, full=True, spin=None, work=work)
            assert z is not None
            begun = beginning_of(compiled, consistent_of(memory), t, h, z, work)
            x = h * state.u + h**2 * (0.5 * begun.u_dot + ((alpha_m - alpha_f) / 2 + beta) * h * begun.rates)
            after = displaced(compiled.model, state, x)
            state = replace(state, u=state.u + closing_velocities(z, after, memory.w, t, h, rows))
        return memory.changed(state=state, u_dot=u_dot, a=a, h=h, h_next=h)

    def explain(self, system: System, work: Work, outcome: Outcome, u: Array, h: float) -> Failure:
        """Return the reason why a step of size h failed that began with velocities u, (n_u,)."""
        from floatframe.engine.kernels.generalized_alpha import (
            INACCURATE,
            SINGULAR_BODY,
            SINGULAR_CONNECTION,
            TURNED,
        )

        compiled = compiled_system(system)
        least = self.least_step(h, compiled)
        fast_turn = words_of_fast_turn(compiled, u, least or h)
        status, _, _, index, excess = outcome
        if failure := failure_of_element(compiled, work, outcome, least, "h_min or h"):
            return failure
        if status == SINGULAR_BODY:
            name = compiled.body_names[index]
            if fast_turn:
                return Failure(f"Newton's method diverged: {fast_turn}; choose a smaller h", excess)
            words = f"the Newton matrix of body {name!r} is singular; check its mass, inertia and stiffness"
            return Failure(words, excess)
        if status == SINGULAR_CONNECTION:
            words = (
                f"the equations of {compiled.connection_words(index)} depend on other equations (a singular position); "
                "choose a smaller h, or check for a drive out of reach or an error in the system"
            )
            return Failure(f"{words}; {fast_turn}" if fast_turn else words, excess)
        if status == TURNED:
            words = words_of_turn(compiled, work, index)
            words += (
                ', joint coordinates (formulation = "relative"), EnergyMomentum, or the frame of the body on the axis'
            )
            return Failure(words, excess)
        if status == INACCURATE:
            words = (
                f"its error stays above error_tolerance = {self.error_tolerance} down to the smallest "
                f"step, h_min = {least:.3g}; allow a larger error or a shorter step, or check for a jump in the motion"
            )
            return Failure(words, excess)
        words = f"Newton's method did not converge in {self.max_iterations} iterations"
        if np.isfinite(excess):
            words += f" (last correction {excess:.2g} times the allowed one)"
        gaps = open_joints(compiled, work.connections.g)
        if gaps and np.isfinite(work.connections.g).all():
            words += f"; {gaps}"
        if least > 0:
            words += f"; this was the smallest step, h_min = {least:.3g}"
        if fast_turn:
            words += f"; {fast_turn}"
        words += (
            "; choose a smaller h, or check for a singular position, a drive out of reach or an error in the system"
        )
        return Failure(words, excess)


def newmark(beta: float = 0.25, gamma: float = 0.5, **options: float) -> GeneralizedAlpha:
    """Return the Newmark method [1]_, with alpha_m = alpha_f = 0; second order only for gamma = 1/2.

    Parameters
    ----------
    beta, gamma
        Parameters of positions, x = h u + h² ((1/2 - beta) a + beta a_new), and of velocities. In linear systems the
        method is stable for every h if beta >= gamma/2 >= 1/4.
    options
        Other parameters of `GeneralizedAlpha`.

    References
    ----------
    .. [1] Newmark (1959), Journal of the Engineering Mechanics Division 85, 67-94.
    """
    if not (np.isfinite(gamma) and np.isfinite(beta) and 2 * beta >= gamma >= 0.5):
        raise ModelError(f"newmark: expected 2 beta >= gamma >= 1/2 (stable), got beta = {beta}, gamma = {gamma}")
    return GeneralizedAlpha(parameters=(0.0, 0.0, beta, gamma), **options)  # type: ignore[arg-type]


def trapezoidal(**options: float) -> GeneralizedAlpha:
    """Return the trapezoidal rule `newmark(1/4, 1/2)`, which has no numerical damping.

    In linear systems without joints it conserves energy. Reactions of joints oscillate permanently by O(h).

    Parameters
    ----------
    options
        Other parameters of `GeneralizedAlpha`.
    """
    return newmark(0.25, 0.5, **options)


def hht(alpha: float = -0.1, **options: float) -> GeneralizedAlpha:
    """Return the method of Hilber, Hughes and Taylor [1]_, with alpha_m = 0 and alpha_f = -alpha.

    Parameters
    ----------
    alpha
        Numerical damping, from -1/3 (largest) to 0 (none: the trapezoidal rule).
    options
        Other parameters of `GeneralizedAlpha`.

    References
    ----------
    .. [1] Hilber, Hughes & Taylor (1977), Earthquake Engineering & Structural Dynamics 5, 283-292.
    """
    if not -1 / 3 <= alpha <= 0:
        raise ModelError(f"hht: alpha: expected -1/3 <= alpha <= 0, got {alpha}")
    parameters = (0.0, -alpha, 0.25 * (1 - alpha) ** 2, 0.5 - alpha)
    return GeneralizedAlpha(parameters=parameters, **options)  # type: ignore[arg-type]


def mass_weights(model: Model) -> Array:
    """Return masses, moments of inertia and modal masses for all velocities, (n_u,)."""
    result = np.zeros(int(model.bodies.u0[-1]))
    for i, t in enumerate(model.bodies.kind):
        parts = [np.full(3, model.body_types.mass[t]), np.diag(model.body_types.J0[t]), modal_diagonals(model, i, MASS)]
        result[model.bodies.u0[i] : model.bodies.u0[i + 1]] = np.concatenate(parts)
    return result


def words_of_turn(compiled: CompiledSystem, work: Work, body: int) -> str:
    """Return the message about a body that rotates too far in a step."""
    from floatframe.engine.kernels.generalized_alpha import MOST_TURN

    turn = float(np.linalg.norm(work.state.theta[body]))
    return (
        f"body {compiled.body_names[body]!r} turns by {turn:.3g} rad in a step, with a joint away from its axis of "
        f"turning: expected at most {MOST_TURN:g} rad, beyond which joints can give it energy; choose a smaller h"
    )


def words_of_fast_turn(compiled: CompiledSystem, u: Array, h: float) -> str:
    """Return a message about the body that rotates furthest in a step, if by more than `MOST_TURN`; u: velocities."""
    from floatframe.engine.kernels.generalized_alpha import MOST_TURN

    first = compiled.model.bodies.u0[:-1]
    turns = h * np.linalg.norm(u[first[:, None] + np.arange(3, 6)], axis=1)
    k = int(np.argmax(turns)) if len(turns) > 0 else -1
    if k < 0 or not turns[k] > MOST_TURN:
        return ""
    return f"body {compiled.body_names[k]!r} turns by {turns[k]:.3g} rad in a step"


def rows_closed_by_positions(model: Model, stabilized: bool) -> NDArray[np.bool_]:
    """Return which rows constrain positions but not velocities, (n_w,); if stabilised, only rows of elements do."""
    is_stabilized = np.repeat(np.isin(model.connections.law, (JOINT, COUPLER)), model.connections.size)
    return is_held_position(model.rows.kind) & ~(is_stabilized & stabilized)


def consistent_of(memory: Memory) -> ConsistentState:
    """Return the state in a memory together with its accelerations and wrenches."""
    return ConsistentState(memory.state, memory.u_dot, memory.w)
