"""Common parts of the conserving and variational schemes: start, continuation and observation of a run."""

import numpy as np

from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import (
    solve_accelerations,
    with_compatible_velocities,
)
from floatframe.engine.kernels.entry import Outcome
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.work import Work
from floatframe.engine.structure_preserving.compiled import kept_of
from floatframe.engine.structure_preserving.system import discrete_system
from floatframe.errors import ModelError
from floatframe.integrators.integrator import (
    LEAST_STEP,
    Failure,
    Integrator,
    failure_of_element,
    has_divided_steps,
    observed,
)
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["DiscreteScheme", "check_options"]


class DiscreteScheme(Integrator):
    """A structure-preserving scheme whose steps advance the bodies."""

    tolerance: float
    max_iterations: int

    @property
    def equations(self) -> int:
        """Kind of scheme: `CONSERVING` or `VARIATIONAL`."""
        raise NotImplementedError

    @property
    def damping(self) -> float:
        """Spectral radius for modes with frequencies far above 1/h; 1 without dissipation."""
        return 1.0

    def start(self, system: System, t: float, state: State | None = None, before: Memory | None = None) -> Memory:
        """Return the memory at the start, for a consistent state near the given one.

        `a` holds the multipliers: zero for joints; for equations of elements, the values that fulfil them at the start.
        """
        memory = super().start(system, t, state, before)
        held = discrete_system(system, type(self).__name__).held
        is_of_law = np.isin(held, compiled_system(system).model.laws.equation)
        return memory.changed(a=np.where(is_of_law, memory.w[held], 0.0))

    def observe(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the results at a state, with accelerations and reactions from the equations of motion."""
        compiled = compiled_system(system)
        work.state.time[...] = t
        work.state.w_start[:] = memory.w
        work.states.base[:], work.states.rate_base[:] = memory.w[compiled.model.states.row], 0.0
        work.states.kappa[...], work.states.rho[...] = 0.0, 1.0
        fitting = with_compatible_velocities(compiled, work, memory.state, memory.w)
        u_dot, w = solve_accelerations(compiled, work, fitting, memory.w)
        _, rows = observed(system, t, memory.changed(u_dot=u_dot, w=w), work)
        return memory, rows

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps of size h, beginning with step `first` counted from t0; see `Integrator`."""
        from floatframe.engine.kernels.generalized_alpha import NO_ACCELERATION
        from floatframe.engine.structure_preserving.kernels.steps import discrete_kernels

        compiled = compiled_system(system)
        model = compiled.model
        least = LEAST_STEP * h if has_divided_steps(model) else 0.0
        ds = discrete_system(system, type(self).__name__)
        kept = kept_of(work, ds, self.equations, h, self.damping)
        step = kept.step
        kept.go_on_from(memory, memory.a, is_anew=bool(work.solver.c_k == 0.0))
        work.solver.c_k[...] = 1.0
        after = memory.changed(h_next=min(float(memory.h_next) or h, h)).copied()
        rows, outcome = discrete_kernels.advance(
            model, work, kept.discrete, step, memory=after, t0=t0, h=h, first=first, n_steps=n_steps, every=every,
            tolerance=self.tolerance, max_iterations=self.max_iterations, length=ds.length, h_min=least,
        )  # fmt: skip
        if outcome.status == NO_ACCELERATION:  # the memory is beyond the last good step: repeat the good steps
            # find the reason first: the repeated steps overwrite the arrays from which it is found
            failure = explained(compiled, work, outcome, self.max_iterations, LEAST_STEP * h)
            work.past.n[...] = 0
            again = self.advance(system, memory, work, t0=t0, h=h, first=first, n_steps=outcome.n_steps, every=every)
            return *again[:3], failure
        kept.after = after = after.changed(power=memory.power)
        return after, rows, outcome.n_steps, explained(compiled, work, outcome, self.max_iterations, least)


def explained(
    compiled: CompiledSystem, work: Work, outcome: Outcome, max_iterations: int, least: float
) -> Failure | None:
    """Return the reason why a step failed; None if no step failed."""
    from floatframe.engine.kernels.generalized_alpha import DONE, NO_ACCELERATION, SINGULAR

    if outcome.status == DONE:
        return None
    if failure := failure_of_element(compiled, work, outcome, least, "h"):
        return failure
    words = f"Newton's method did not converge in {max_iterations} iterations"
    if outcome.status == NO_ACCELERATION:
        words = "at its end, constraints depend on each other or a force is not finite: there are no accelerations"
    elif outcome.status == SINGULAR:
        words = "the matrix of Newton's method is singular"
    elif not np.isfinite(outcome.excess):
        words = "Newton's method diverged"
    return Failure(f"{words}; choose a smaller h, or check for a singular position", outcome.excess)


def check_options(scheme: DiscreteScheme) -> None:
    """Raise `ModelError` if the tolerance or the number of iterations is invalid."""
    name = type(scheme).__name__
    if not 0.0 < scheme.tolerance < 1.0:
        raise ModelError(f"{name}: tolerance: expected 0 < tolerance < 1, got {scheme.tolerance}")
    if scheme.max_iterations < 1:
        raise ModelError(f"{name}: max_iterations: expected at least 1, got {scheme.max_iterations}")
