"""What the conserving and variational schemes share: how a run of them starts, goes on and is observed."""

from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.system import compiled_system
from floatframe.discrete.bodies import Placed, placed_bodies, state_of
from floatframe.discrete.constraints import Span
from floatframe.discrete.newton import StepError
from floatframe.discrete.system import DiscreteSystem, discrete_system
from floatframe.errors import ModelError
from floatframe.integrators.carry import Carry, Failure, observed, one_step_of, turned_on, with_angles
from floatframe.kernels.memory import Rows, new_rows
from floatframe.kernels.work import Work
from floatframe.start.initial import consistent_motion, solve_accelerations, with_compatible_velocities
from floatframe.state import State
from floatframe.system import System

__all__ = ["DiscreteScheme", "StepResult", "check_options"]


@dataclass(frozen=True, eq=False)
class StepResult:
    """The bodies after a step, and what happened over it."""

    placed: list[Placed]
    f: Array  #: multipliers of the joints, (n_held,)
    work: tuple[float, float]  #: that entered; taken by dampers and friction
    n_iterations: int


class DiscreteScheme:
    """A scheme that steps from bodies to bodies; what it is besides its `one_step`."""

    tolerance: float
    max_iterations: int

    def one_step(self, ds: DiscreteSystem, placed: list[Placed], span: Span, f: Array) -> StepResult:
        """Return the bodies, multipliers and work after a step; `StepError` if it fails."""
        raise NotImplementedError

    def start(self, system: System, t: float, state: State | None = None, before: Carry | None = None) -> Carry:
        """Return the memory at the beginning, from a state made consistent; `a` holds the multipliers of the joints."""
        consistent = consistent_motion(system, state, t=t)
        n_held = discrete_system(system, type(self).__name__).n_held
        carry = Carry(
            consistent.state, consistent.u_dot, np.zeros(n_held), 0.0, consistent.w, np.zeros(2), np.zeros(2)
        )  # fmt: skip
        return with_angles(system, t, carry, before)

    def step(self, system: System, t: float, h: float, carry: Carry) -> Carry:
        """Return the memory one step of size h later; `ConvergenceError` if it fails."""
        return one_step_of(self, system, t, h, carry)

    def observe(self, system: System, t: float, carry: Carry, work: Work) -> tuple[Carry, Rows]:
        """Return the results at the carried state, with accelerations and reactions of the equations of motion."""
        compiled = compiled_system(system)
        work.state.time[...] = t
        fitting = with_compatible_velocities(compiled, work, carry.state)
        u_dot, w = solve_accelerations(compiled, work, fitting)
        _, rows = observed(system, t, replace(carry, u_dot=u_dot, w=w), work)
        return carry, rows

    def advance(
        self, system: System, carry: Carry, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Carry, Rows, int, Failure | None]:
        """Advance by n_steps of size h, the first of them number `first` from t0; see `carry.Integrator`."""
        ds = discrete_system(system, type(self).__name__)
        rows = [new_rows(compiled_system(system).model, 0)]
        n_good, failure = 0, None
        for k in range(first, first + n_steps):
            placed = placed_bodies(ds.bodies, ds.model, carry.state)
            t_0, t_1 = t0 + k * h, t0 + (k + 1) * h
            try:
                result = self.one_step(ds, placed, Span(t_0, t_1, 0.5 * (t_0 + t_1)), carry.a)
            except StepError as error:
                failure = Failure(f"{error}; choose a smaller h, or look for a singular position", error.excess)
                break
            carry = replace(
                carry,
                state=state_of(ds.bodies, result.placed),
                a=result.f,
                h=h,
                work=carry.work + np.array(result.work),
                n_iterations=carry.n_iterations + result.n_iterations,
                n_steps=carry.n_steps + 1,
            )
            carry = turned_on(system, carry, h)
            n_good += 1
            if (k + 1) % every == 0:
                carry, row = self.observe(system, t_1, carry, work)
                rows.append(row)
        joined = Rows(*(np.concatenate([getattr(part, name) for part in rows]) for name in Rows._fields))
        return carry, joined, n_good, failure


def check_options(scheme: DiscreteScheme) -> None:
    """Raise `ModelError` if tolerance or number of iterations is impossible."""
    name = type(scheme).__name__
    if not 0.0 < scheme.tolerance < 1.0:
        raise ModelError(f"{name}: tolerance: expected 0 < tolerance < 1, got {scheme.tolerance}")
    if scheme.max_iterations < 1:
        raise ModelError(f"{name}: max_iterations: expected at least 1, got {scheme.max_iterations}")
