"""Common parts of the integrators: their protocol, the reason for a failed step, conversions between memories."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.engine.compiling.file_frames import state_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import consistent_motion, counted_angles_of
from floatframe.engine.initial_conditions.newton_equations import displaced
from floatframe.engine.kernels.entry import Outcome
from floatframe.engine.kernels.memory import WORK_GIVEN, WORK_TAKEN, Memory, Rows, memory_at, new_rows
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError, FloatframeError
from floatframe.model.rotations import continued_rotation, rotation_log
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = [
    "LEAST_STEP",
    "Failure",
    "FollowedRotations",
    "Integrator",
    "counted_on",
    "failure_of_element",
    "has_divided_steps",
    "joined_rows",
    "memory_of_past",
    "observed",
    "observed_outputs",
    "one_by_one",
    "started_anew",
    "turned_on",
    "with_angles",
]

LEAST_STEP = 1e-6  #: smallest size of a divided step relative to the largest, if the user gives no minimum


@presented
@dataclass(frozen=True)
class Failure:
    """Reason why a step failed."""

    words: str
    residual: float  #: last Newton correction relative to the allowed correction


class Integrator(Protocol):
    """A method with its parameters: a frozen dataclass of plain numbers; everything that changes is in the memory."""

    def start(self, system: System, t: float, state: State | None = None, before: Memory | None = None) -> Memory:
        """Return the memory at the start: the consistent state and its accelerations.

        Counted angles, angles of couplers and states of user forces continue from those of a memory `before`.
        """
        known, angle = (None, None) if before is None else (before.w, before.angle)
        made = consistent_motion(system, state, t=t, known=known, angle=angle)
        return with_angles(system, t, memory_at(made.state, made.u_dot, made.w), before, state)

    def after_jump(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory after forces have jumped at t, and the results there.

        Positions and velocities are continuous.
        """
        return started_anew(self, system, t, memory, work)

    def step(self, system: System, t: float, h: float, memory: Memory) -> Memory:
        """Return the memory after one step of size h; `ConvergenceError` if it fails."""
        work = new_work(compiled_system(system).model)
        after, _, _, failure = self.advance(system, memory, work, t0=t, h=h, first=0, n_steps=1, every=2)
        if failure is not None:
            words = f"the step of {h:g} from t = {t:g} failed: {failure.words}"
            raise ConvergenceError(words, t=t, h=h, residual=failure.residual)
        return after

    def observe(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory with the power at its state, and the results there."""
        return observed(system, t, memory, work)

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps of size h, beginning with step `first` counted from t0; write a row every `every` steps.

        Returns
        -------
        tuple
            The memory after the last good step; the rows of results; the number of good steps; the reason why the next
            step failed, or None.
        """
        raise NotImplementedError


def started_anew(method: Integrator, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
    """Return the memory of a motion that starts at t from the state in another memory, and the results there."""
    fresh = method.start(system, t, state_of_file(compiled_system(system), memory.state), before=memory)
    return method.observe(system, t, counted_on(fresh, memory), work)


def counted_on(fresh: Memory, memory: Memory) -> Memory:
    """Return the memory of a new start with work and counters continued from the previous memory."""
    return fresh.changed(
        work=memory.work,
        n_iterations=memory.n_iterations,
        n_steps=memory.n_steps,
        n_rejected=memory.n_rejected,
        h_next=0.0,
    )


def one_by_one(
    method: Integrator,
    system: System,
    memory: Memory,
    work: Work,
    *,
    t0: float,
    h: float,
    first: int,
    n_steps: int,
    every: int,
) -> tuple[Memory, list[Rows], int, Failure | None]:
    """Advance step by step as `Integrator.advance` does: return memory, rows, number of successful steps, failure."""
    rows: list[Rows] = []
    for k in range(n_steps):
        memory, row, n_good, failure = method.advance(
            system, memory, work, t0=t0, h=h, first=first + k, n_steps=1, every=every
        )
        rows.append(row)
        if not n_good:
            return memory, rows, k, failure
    return memory, rows, n_steps, None


def memory_of_past(work: Work, end: Memory, k: int) -> Memory:
    """Return the memory after step k, counted from 0, of a call of `advance` that ended with the memory `end`."""
    memory = Memory._make(np.array(array[k]) for array in work.past.memory)
    return memory._replace(a=memory.a[: len(end.a)])


def with_angles(
    system: System, t: float, memory: Memory, before: Memory | None = None, state: State | None = None
) -> Memory:
    """Return the memory at the start of a motion with its counted angles.

    They continue from those of a memory `before`. Without one they begin with the values of the motions that prescribe
    them, else of the given initial state, else between -pi and pi.
    """
    compiled = compiled_system(system)
    if before is None:
        known = counted_angles_of(compiled, state)
        known = np.zeros(len(compiled.angles)) if known is None else known
        pairs = zip(known, compiled.angle_motions, strict=True)
        start = np.array([angle if motion is None else motion(t) for angle, motion in pairs])
    else:
        start = before.angle
    return turned_on(system, memory.changed(angle=start, angle_rate=np.zeros_like(start)), 0.0)


def turned_on(system: System, memory: Memory, h: float) -> Memory:
    """Return the memory with its counted angles advanced to its state over a step of size h."""
    from floatframe.engine.kernels.entry import count_angles

    if not len(memory.angle):
        return memory
    model, after = compiled_system(system).model, memory.copied()
    count_angles(model, new_work(model), after, h)
    return after


def coasted(
    method: Integrator, system: System, t: float, size: float, memory: Memory, work: Work
) -> tuple[Memory, Rows]:
    """Return memory and results at t + size, extrapolated from the rates, where a step would only be roundoff."""
    compiled = compiled_system(system)
    state = displaced(compiled.model, memory.state, size * memory.state.u)
    w, rows = memory.w.copy(), compiled.model.states.row
    w[rows] += size * w[rows + 1]
    state = replace(state, u=memory.state.u + size * memory.u_dot)
    memory = memory.changed(state=state, w=w, work=memory.work + size * memory.power)
    return method.observe(system, t + size, turned_on(system, memory, size), work)


class FollowedRotations:
    """Rotation vectors of bushings, continuous through full turns, for a method that chooses its own steps.

    They are written into the iterate.
    """

    def __init__(self, model: Model, work: Work, t: float, memory: Memory) -> None:
        """Begin to count from the state of a motion at time t."""
        self.angles, self.u0, self.state = model.angles, model.bodies.u0, work.state
        self.first = np.flatnonzero(model.angles.part == 0)
        self.begin(t, memory.angle, memory.angle_rate)

    def begin(self, t: float, angle: Array, rate: Array) -> None:
        """Set the rotations at time t, from which the count continues."""
        self.t, self.angle, self.rate = t, angle.copy(), rate.copy()
        self.state.angle[: len(angle)] = angle

    def has_changed(self, t: float) -> bool:
        """Update the rotations in the iterate for time t.

        Return whether they differ by full turns from the rotations used before.
        """
        changed = False
        for k in self.first:
            parts = slice(k, k + 3)
            holder, other = int(self.angles.holder[k]), int(self.angles.other[k])
            x, z = (self.in_ground(holder, each) for each in (self.angles.x[k], self.angles.z[k]))
            A = np.array([x, np.cross(z, x), z])
            theta = rotation_log(A @ self.in_ground(other, self.angles.y[parts].T))
            rate = A @ (self.spin(other) - self.spin(holder))
            expected = self.angle[parts] + 0.5 * (t - self.t) * (self.rate[parts] + rate)
            was = continued_rotation(theta, self.state.angle[parts])
            self.angle[parts], self.rate[parts] = continued_rotation(theta, expected), rate
            self.state.angle[parts] = self.angle[parts]
            changed = changed or bool(np.abs(self.angle[parts] - was).max() > np.pi)
        self.t = t
        return changed

    def in_ground(self, i: int, x: Array) -> Array:
        """Return directions fixed in body i (-1: ground) in ground axes."""
        return x if i < 0 else np.asarray(self.state.R[i] @ x)

    def spin(self, i: int) -> Array:
        """Return the angular velocity of body i (-1: ground) in ground axes."""
        return np.zeros(3) if i < 0 else np.asarray(self.state.R[i] @ self.state.u[self.u0[i] + 3 : self.u0[i] + 6])


def observed_outputs(
    outputs: Iterable[tuple[float, State, Array, Array]], name: str, system: System, memory: Memory, work: Work, *,
    h: float, first: int, every: int,
) -> tuple[Memory, list[Rows], int, Failure | None, bool]:  # fmt: skip
    """Return memory, rows, number of successful outputs, failure, and whether an element ended the run.

    Work and dissipation are summed by the trapezoidal rule.

    Parameters
    ----------
    outputs
        Time, state, u_dot and w at output times h apart, found by a solver with steps of its own.
    name
        Name of the solver, for messages.
    """
    rows, n_good = [new_rows(compiled_system(system).model, 0)], 0
    try:
        for t, state, u_dot, w in outputs:
            after = memory.changed(state=state, u_dot=u_dot, w=w, h=h, n_steps=memory.n_steps + 1)
            work.counted.stopped[...] = 0
            after, row = observed(system, t, turned_on(system, after, h), work)
            if stop := int(work.counted.stopped):
                return memory, rows, n_good, Failure(compiled_system(system).stop_words[stop - 1], 0.0), True
            memory = after.changed(work=memory.work + 0.5 * h * (memory.power + after.power))
            row.diagnostics[0, [WORK_GIVEN, WORK_TAKEN]] = memory.work
            n_good += 1
            if (first + n_good) % every == 0:
                rows.append(row)
    except (FloatframeError, np.linalg.LinAlgError) as error:
        return memory, rows, n_good, Failure(f"{name}: {error}", np.inf), False
    return memory, rows, n_good, None, False


def observed(system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
    """Return the memory with the power at its state, and the results there."""
    from floatframe.engine.kernels.entry import absolute_kernels

    after = memory.copied()
    return after, absolute_kernels.observe(compiled_system(system).model, work, memory=after, t=t)


def joined_rows(parts: Sequence[Rows]) -> Rows:
    """Return consecutive parts of the results as one."""
    return parts[0] if len(parts) == 1 else Rows(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def failure_of_element(
    compiled: CompiledSystem, work: Work, outcome: Outcome, least: float, smaller: str
) -> Failure | None:
    """Return the reason for a failed step if an element or contact caused the failure, for any method; otherwise None.

    least: the smallest step; smaller: name of the option that allows shorter steps.
    """
    from floatframe.engine.kernels.generalized_alpha import STOPPED, UNRESOLVED

    if outcome.status == STOPPED:  # the step converged, so a NaN in one of its iterates does not matter
        return Failure(compiled.stop_words[outcome.singular], outcome.excess)
    if no_number := int(work.counted.no_number):
        words = (
            f"{compiled.connection_words(no_number - 1)} is not finite (NaN or infinity) for a finite motion; check "
            "its law, or choose a smaller h if the law is defined only near the motion"
        )
        return Failure(words, outcome.excess)
    if outcome.status != UNRESOLVED:
        return None
    c = int(compiled.model.gaps.connection[int(work.gaps.shortest)])
    words = (
        f"contact {compiled.connection_names[c]!r} takes steps of {float(work.gaps.step):.3g} s, expected h_min = "
        f"{least:.3g} at least: with longer steps it would gain energy; give a smaller {smaller}, or a softer "
        "contact"
    )
    return Failure(words, outcome.excess)


def has_divided_steps(model: Model) -> bool:
    """Whether fixed steps may be divided, because contacts close or dry friction comes to rest."""
    forces = model.joint_forces
    return len(model.gaps.connection) > 0 or bool((forces.friction > 0).any() or (forces.coefficient > 0).any())
