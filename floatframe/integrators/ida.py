"""SUNDIALS IDA for the index-reduced equations, an independent method for comparisons.

Evaluated in `floatframe.engine.kernels.evaluation`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.gaps import gaps_at, has_gaps
from floatframe.engine.initial_conditions.initial import (
    assembled,
    solve_accelerations,
    with_compatible_velocities,
)
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.model import COUPLER, USER_FORCE
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import FloatframeError, ModelError
from floatframe.integrators.integrator import (
    Failure,
    FollowedRotations,
    Integrator,
    joined_rows,
    observed_outputs,
)
from floatframe.integrators.passed_contacts import Stretch, stretches_of_passed_contact
from floatframe.integrators.remembered_contacts import require_no_remembered_contacts
from floatframe.model.rotations import euler_parameter_rates
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Ida"]

MOST_STEPS = 100_000  #: largest number of solver steps between two outputs


@dataclass(frozen=True)
@checked_fields(ModelError)
class Ida(Integrator):
    """Backward differentiation of orders one to five with variable steps: SUNDIALS IDA [1]_, through scikit-sundae.

    Joints enter by their second derivatives: one linear system gives accelerations and reactions of a state (index
    one), y' = (v, p * omega / 2, q_dot, u_dot(t, y)). At the end of each batch of steps, and in every output, the state
    is projected on the constraints of the joints with the least motion, positions first, then velocities. The method is
    for checks of the others: it is slow, and its energy drifts by an amount that depends on the tolerances. Work and
    dissipation in the results are summed by the trapezoidal rule over the outputs. `stops` of elements are checked at
    the outputs only.

    Needs the extra `ida`: pip install "floatframe[ida]".

    Parameters
    ----------
    rtol
        Relative tolerance of a step.
    atol
        Absolute tolerance of a step, in the units of the system.

    References
    ----------
    .. [1] Hindmarsh et al. (2005), ACM Transactions on Mathematical Software 31, 363-396.
    """

    rtol: float = 1e-8
    atol: float = 1e-10

    def __post_init__(self) -> None:
        for name in ("rtol", "atol"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ModelError(f"Ida: {name}: expected a number between 0 and 1, got {getattr(self, name)}")

    def start(self, system: System, t: float, state: State | None = None, before: Memory | None = None) -> Memory:
        """Return the memory at the start, for a consistent state near the given one."""
        solver_class()
        compiled = compiled_system(system)
        for c, name in enumerate(compiled.connection_names):
            if compiled.model.connections.law[c] in (COUPLER, USER_FORCE):
                raise ModelError(f"Ida: {name!r} has a memory, which this scheme cannot integrate; use another scheme")
        for each in compiled.laws:
            if each.law.states or each.law.multipliers:
                raise ModelError(
                    f"Ida: element {each.element.name!r} has states or multipliers of its own, which this scheme "
                    "cannot integrate; use GeneralizedAlpha"
                )
        require_no_remembered_contacts(compiled, "Ida")
        return super().start(system, t, state, before).changed(a=np.zeros(0))

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps output times, beginning with step `first` counted from t0; see `integrator.Integrator`."""
        made = Motion(compiled_system(system), t0 + h * first, memory)
        times: Array = t0 + h * np.arange(first, first + n_steps + 1, dtype=float)
        memory, rows, n_good, failure, _ = observed_outputs(
            self.outputs(made, times, memory), "IDA", system, memory, work, h=h, first=first, every=every
        )
        return memory.changed(n_iterations=memory.n_iterations + made.n_evaluations), joined_rows(rows), n_good, failure

    def outputs(self, made: "Motion", times: Array, memory: Memory) -> Iterator[tuple[float, State, Array, Array]]:
        """Yield time, state, u_dot and w at all times except the first."""
        compiled, own = made.compiled, made.work
        solution = self.solved_past_contacts if has_gaps(compiled) else self.solved
        reached, message = solution(made, times, flattened(memory.state))
        made.rotations.begin(float(times[0]), memory.angle, memory.angle_rate)
        for t, (at, y) in zip(times[1:], reached, strict=False):
            if not np.isfinite(y).all() or abs(at - t) > 1e-9 * (times[1] - times[0]):  # a failed solver ends early
                break
            own.state.time[...] = t
            own.counted.no_number[...] = 0  # the solver may have evaluated a NaN beyond this time
            state = with_compatible_velocities(compiled, own, assembled(compiled, own, state_of(compiled, y)))
            yield (float(t), state, *made.accelerations(t, state))
        else:
            if len(reached) == len(times) - 1:
                return
        raise ModelError(made.problem or message)

    def solved(self, made: "Motion", t: Array, y_0: Array) -> tuple[list[tuple[float, Array]], str]:
        """Return the times and y that the solver reached, except the first, and its message."""
        solver = self.solver(made)
        # the solver returns all its steps if it gets only two times, therefore a third one is added
        asked = t if len(t) > 2 else np.array([t[0], 0.5 * (t[0] + t[1]), t[1]])
        solution = solver.solve(asked, y_0, made.rates(float(t[0]), y_0))
        reached = zip(np.atleast_1d(solution.t), np.atleast_2d(solution.y), strict=True)
        return list(reached)[len(asked) - len(t) + 1 :], solution.message

    def solved_past_contacts(self, made: "Motion", t: Array, y_0: Array) -> tuple[list[tuple[float, Array]], str]:
        """Return the same as `solved` for a system with contacts, step by step, so that no short contact is missed."""
        compiled, work = made.compiled, new_work(made.compiled.model)

        def gaps(at: float, y: Array) -> Array:
            return gaps_at(compiled, work, at, state_of(compiled, y), np.zeros(len(work.state.w)))

        reached: list[tuple[float, Array]] = []
        begin, y, rates, stretches = float(t[0]), y_0, made.rates(float(t[0]), y_0), [Stretch(t[-1])]
        while len(reached) < len(t) - 1:
            until, most = stretches.pop(0) if stretches else Stretch(t[-1])
            until = min(until, t[-1])
            solver = self.solver(made, max_step=most if np.isfinite(most) else 0.0)
            solver.init_step(begin, y, rates)
            while begin < until:
                result = solver.step(until, method="onestep", tstop=until)
                if not result.success:
                    return reached, result.message
                end = float(result.t)
                if end <= begin:  # after outputs within a step, the solver returns the end of the step once more
                    continue
                both = np.array([y, result.y]), np.array([rates, result.yp])
                found = stretches_of_passed_contact(gaps, begin, end, *both)
                if found:
                    stretches = found
                    break
                for time in t[1 + len(reached) :][t[1 + len(reached) :] <= end]:
                    reached.append((float(time), np.array(solver.step(time, method="normal").y)))
                begin, y, rates = end, result.y, result.yp
        return reached, ""

    def solver(self, made: "Motion", **options: float) -> Any:
        """Return a solver for the residual of a motion."""
        return solver_class()(
            made.residual, rtol=self.rtol, atol=self.atol, max_num_steps=MOST_STEPS, linsolver="dense", **options
        )


def solver_class():
    """Return the class of the solver; `ModelError` states the extra to install if it is missing."""
    try:
        from sksundae.ida import IDA
    except ImportError as error:
        raise ModelError(
            'Ida: needs SUNDIALS through scikit-sundae, which is not installed; pip install "floatframe[ida]"'
        ) from error
    return IDA


def flattened(state: State) -> Array:
    """Return (r, p, q, u) of a state as one vector."""
    return np.concatenate([state.r.ravel(), state.p.ravel(), state.q, state.u])


def state_of(compiled: CompiledSystem, y: Array) -> State:
    """Return the state in a vector y, with normalised Euler parameters."""
    n_b, n_q = len(compiled.model.bodies.kind), int(compiled.model.bodies.q0[-1])
    r, p, q, u = np.split(np.array(y), [3 * n_b, 7 * n_b, 7 * n_b + n_q])
    p = p.reshape(n_b, 4)
    return State(r.reshape(n_b, 3), p / np.linalg.norm(p, axis=1, keepdims=True), q, u)


class Motion:
    """Rates of a system with a count of evaluations; errors are stored, because they cannot pass through the solver."""

    def __init__(self, compiled: CompiledSystem, t: float, memory: Memory) -> None:
        self.compiled, self.work = compiled, new_work(compiled.model)
        self.rotations = FollowedRotations(compiled.model, self.work, t, memory)  #: counted rotations of bushings
        self.n_evaluations, self.problem = 0, ""

    def accelerations(self, t: float, state: State) -> tuple[Array, Array]:
        """Return accelerations and wrenches for a state at time t."""
        found = solve_accelerations(self.compiled, self.work, state)
        return solve_accelerations(self.compiled, self.work, state) if self.rotations.has_changed(t) else found

    def rates(self, t: float, y: Array) -> Array:
        """Return the rate y' of y."""
        model = self.compiled.model
        state = state_of(self.compiled, y)
        self.work.state.time[...] = t
        u_dot, _ = self.accelerations(t, state)
        self.n_evaluations += 1
        starts = model.bodies.u0[:-1]
        r_dot = [state.u[k : k + 3] for k in starts]
        p_dot = [euler_parameter_rates(p, state.u[k + 3 : k + 6]) for p, k in zip(state.p, starts, strict=True)]
        q_dot = [state.u[model.bodies.u0[i] + 6 : model.bodies.u0[i + 1]] for i in range(len(starts))]
        return np.concatenate([*r_dot, *p_dot, *q_dot, u_dot])

    def residual(self, t: float, y: Array, y_dot: Array, result: Array) -> None:
        """Write the residual, y_dot minus the rate at y."""
        try:
            result[:] = y_dot - self.rates(t, y)
        except (FloatframeError, RuntimeError, ValueError) as error:
            self.problem = self.problem or str(error)
            result[:] = np.nan
