"""Memory and report of an integrator between steps: one type for all integrators."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.file_frames import state_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import counted_angles_of
from floatframe.engine.initial_conditions.newton_equations import displaced
from floatframe.engine.kernels.memory import Memory, Rows, memory_at
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError
from floatframe.model.rotations import continued_rotation, rotation_log
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = [
    "LEAST_STEP",
    "Carry",
    "Failure",
    "FollowedRotations",
    "Integrator",
    "carry_of",
    "carry_of_past",
    "counted_on",
    "has_divided_steps",
    "joined_rows",
    "memory_of",
    "observed",
    "observed_unless_stopped",
    "one_by_one",
    "one_step_of",
    "started_anew",
    "turned_on",
    "with_angles",
    "words_of_contact",
]

LEAST_STEP = 1e-6  #: fraction of the largest step, for steps that may be divided without a given smallest step


@dataclass(frozen=True, eq=False)
class Carry:
    """The complete memory of an integrator between steps."""

    state: State
    u_dot: Array  #: accelerations, (n_u,)
    a: Array  #: algorithmic accelerations, (n_u,); for h = 0 (at the start) the rates of u_dot
    h: float  #: step size for which `a` holds; 0 at the start
    w: Array  #: wrenches of the connections on their markers A, ground axes, (n_w,)
    work: Array  #: work of point forces; energy dissipated by dampers and modal damping, (2,)
    power: Array  #: their rates, (2,)
    n_iterations: int = 0  #: of Newton's method so far
    h_next: float = 0.0  #: desired size of the next step
    n_steps: int = 0  #: accepted so far
    n_rejected: int = 0  #: tried in vain so far
    #: angles of `CompiledSystem.angles`, counted through full turns, (n_angles,) [rad]; empty: not counted
    angle: Array = field(default_factory=lambda: np.zeros(0))
    angle_rate: Array = field(default_factory=lambda: np.zeros(0))  #: their rates [rad/s]


@dataclass(frozen=True)
class Failure:
    """Reason of a failed step."""

    words: str
    residual: float  #: last correction relative to the allowed one


class Integrator(Protocol):
    """A method with its parameters: a frozen dataclass of plain numbers, all memory in the carry."""

    def start(self, system: System, t: float, state: State | None = None, before: Carry | None = None) -> Carry:
        """Return the memory at the beginning, from a consistent state.

        Counted angles, angles of couplers and states of user forces go on from those of a memory `before`.
        """

    def after_jump(self, system: System, t: float, carry: Carry, work: Work) -> tuple[Carry, Rows]:
        """Return the memory after a jump of forces at t, and the results there.

        Positions and velocities are continuous.
        """

    def step(self, system: System, t: float, h: float, carry: Carry) -> Carry:
        """Return the memory one step of size h later; `ConvergenceError` if it fails."""

    def observe(self, system: System, t: float, carry: Carry, work: Work) -> tuple[Carry, Rows]:
        """Return the results at the carried state, and store the power there in the carry."""

    def advance(
        self, system: System, carry: Carry, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Carry, Rows, int, Failure | None]:
        """Advance by n_steps of size h, the first with the number `first` from t0, with a row after every `every`-th.

        Returns
        -------
        tuple
            The memory after the last good step; the rows of results; how many steps were good; why the next was not,
            or None.
        """


def started_anew(method: Integrator, system: System, t: float, carry: Carry, work: Work) -> tuple[Carry, Rows]:
    """Return the memory of a motion that begins at t in the state of another memory, and the results there."""
    fresh = method.start(system, t, state_of_file(compiled_system(system), carry.state), before=carry)
    return method.observe(system, t, counted_on(fresh, carry), work)


def counted_on(fresh: Carry, carry: Carry) -> Carry:
    """Return the memory of a new start with work and counts of the previous one."""
    return replace(
        fresh, work=carry.work, n_iterations=carry.n_iterations, n_steps=carry.n_steps, n_rejected=carry.n_rejected,
        h_next=0.0,
    )  # fmt: skip


def one_step_of(method: Integrator, system: System, t: float, h: float, carry: Carry) -> Carry:
    """Return the memory one step of size h later, as computed by `advance`; `ConvergenceError` if it fails."""
    work = new_work(compiled_system(system).model)
    after, _, _, failure = method.advance(system, carry, work, t0=t, h=h, first=0, n_steps=1, every=2)
    if failure is not None:
        words = f"the step of {h:g} from t = {t:g} failed: {failure.words}"
        raise ConvergenceError(words, t=t, h=h, residual=failure.residual)
    return after


def one_by_one(
    method: Integrator,
    system: System,
    carry: Carry,
    work: Work,
    *,
    t0: float,
    h: float,
    first: int,
    n_steps: int,
    every: int,
) -> tuple[Carry, list[Rows], int, Failure | None]:
    """Advance as `Integrator.advance`, step by step: memory, rows, number of good steps, reason of failure."""
    rows: list[Rows] = []
    for k in range(n_steps):
        carry, row, n_good, failure = method.advance(
            system, carry, work, t0=t0, h=h, first=first + k, n_steps=1, every=every
        )
        rows.append(row)
        if not n_good:
            return carry, rows, k, failure
    return carry, rows, n_steps, None


def memory_of(carry: Carry) -> Memory:
    """Return a copy of the memory that the kernels may overwrite; its algorithmic accelerations are u_dot."""
    memory = memory_at(carry.state, carry.u_dot, carry.w, n_angles=len(carry.angle))
    memory.angle[:], memory.angle_rate[:] = carry.angle, carry.angle_rate
    memory.work_given[...], memory.work_taken[...] = carry.work
    memory.power_given[...], memory.power_taken[...] = carry.power
    memory.h[...], memory.h_wanted[...] = carry.h, carry.h_next
    memory.n_accepted[...], memory.n_rejected[...] = carry.n_steps, carry.n_rejected
    return memory


def carry_of(memory: Memory, n_iterations: int) -> Carry:
    """Return the memory as left by the kernels after a number of iterations of Newton's method."""
    return Carry(
        State(memory.r, memory.p, memory.q, memory.u),
        memory.u_dot,
        memory.a,
        float(memory.h),
        memory.w,
        np.array([memory.work_given, memory.work_taken]),
        np.array([memory.power_given, memory.power_taken]),
        n_iterations,
        float(memory.h_wanted),
        int(memory.n_accepted),
        int(memory.n_rejected),
        memory.angle,
        memory.angle_rate,
    )


def carry_of_past(work: Work, end: Carry, k: int) -> Carry:
    """Return the memory after step k, from 0, of a call of `advance` that led to the memory `end`.

    The working arrays have room for it, and had kept none before the call.
    """
    past, last = work.past, int(work.past.n) - 1
    n_steps, n_rejected, n_iterations = (int(count) for count in past.counts[k])
    return Carry(
        State(past.r[k], past.p[k], past.q[k], past.u[k]),
        past.u_dot[k].copy(),
        past.a[k, : len(end.a)].copy(),
        float(past.h[k]),
        past.w[k].copy(),
        past.work[k].copy(),
        past.power[k].copy(),
        end.n_iterations - int(past.counts[last, 2]) + n_iterations,
        float(past.h_wanted[k]),
        n_steps,
        n_rejected,
        past.angle[k].copy(),
        past.angle_rate[k].copy(),
    )


def with_angles(
    system: System, t: float, carry: Carry, before: Carry | None = None, state: State | None = None
) -> Carry:
    """Return the memory at the start of a motion with its angles counted.

    They go on from those of a memory before, else from the motions that prescribe them, from the state that a motion
    begins with, or between -pi and pi.
    """
    compiled = compiled_system(system)
    if before is None:
        known = counted_angles_of(compiled, state)
        known = np.zeros(len(compiled.angles)) if known is None else known
        pairs = zip(known, compiled.angle_motions, strict=True)
        start = np.array([angle if motion is None else motion(t) for angle, motion in pairs])
    else:
        start = before.angle
    return turned_on(system, replace(carry, angle=start, angle_rate=np.zeros_like(start)), 0.0)


def turned_on(system: System, carry: Carry, h: float) -> Carry:
    """Return the memory with its angles advanced by a step of size h to its state; none if none are counted."""
    from floatframe.engine.kernels.entry import count_angles

    if not len(carry.angle):
        return carry
    model = compiled_system(system).model
    memory = memory_of(carry)
    count_angles(model, new_work(model), memory, h)
    return replace(carry, angle=memory.angle, angle_rate=memory.angle_rate)


def coasted(method: Integrator, system: System, t: float, size: float, carry: Carry, work: Work) -> tuple[Carry, Rows]:
    """Return the memory so shortly after t that a step would be only rounding, from its rates, and the results."""
    compiled = compiled_system(system)
    state = displaced(compiled.model, carry.state, size * carry.state.u)
    w, rows = carry.w.copy(), compiled.model.states.row
    w[rows] += size * w[rows + 1]
    state = replace(state, u=carry.state.u + size * carry.u_dot)
    carry = replace(carry, state=state, w=w, work=carry.work + size * carry.power)
    return method.observe(system, t + size, turned_on(system, carry, size), work)


class FollowedRotations:
    """Counted rotations of bushings for a method with its own steps; they are set in the iterate."""

    def __init__(self, model: Model, work: Work, t: float, carry: Carry) -> None:
        """Begin with the state of a motion at time t."""
        self.angles, self.u0, self.state = model.angles, model.bodies.u0, work.state
        self.first = np.flatnonzero(model.angles.part == 0)
        self.begin(t, carry.angle, carry.angle_rate)

    def begin(self, t: float, angle: Array, rate: Array) -> None:
        """Set the rotations at time t, from which counting continues."""
        self.t, self.angle, self.rate = t, angle.copy(), rate.copy()
        self.state.angle[: len(angle)] = angle

    def has_changed(self, t: float) -> bool:
        """Set the rotations of the iterate at time t.

        Return whether they differ by full turns from those used before.
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
        """Return directions of body i, -1 for the ground, in ground axes."""
        return x if i < 0 else np.asarray(self.state.R[i] @ x)

    def spin(self, i: int) -> Array:
        """Return the angular velocity of body i in ground axes."""
        return np.zeros(3) if i < 0 else np.asarray(self.state.R[i] @ self.state.u[self.u0[i] + 3 : self.u0[i] + 6])


def observed_unless_stopped(system: System, t: float, carry: Carry, work: Work) -> tuple[Array, Rows, Failure | None]:
    """Return the same as `observed`, and the reason if an element ends the run at the carried state; otherwise None."""
    work.counted.stopped[...] = 0
    power, rows = observed(system, t, carry, work)
    stop = int(work.counted.stopped)
    return power, rows, Failure(compiled_system(system).stop_words[stop - 1], 0.0) if stop else None


def observed(system: System, t: float, carry: Carry, work: Work) -> tuple[Array, Rows]:
    """Return the power, (2,), and the results at the carried state."""
    from floatframe.engine.kernels.entry import absolute_kernels

    memory = memory_of(carry)
    rows = absolute_kernels.observe(compiled_system(system).model, work, memory=memory, t=t)
    return np.array([memory.power_given, memory.power_taken]), rows


def joined_rows(parts: Sequence[Rows]) -> Rows:
    """Return rows of results one after the other."""
    return parts[0] if len(parts) == 1 else Rows(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def words_of_contact(compiled: CompiledSystem, work: Work, least: float, smaller: str) -> str:
    """Return a message with the contact that needs steps below the smallest size, and with the remedy."""
    c = int(compiled.model.gaps.connection[int(work.gaps.shortest)])
    return (
        f"contact {compiled.connection_names[c]!r} takes steps of {float(work.gaps.step):.3g} s, expected h_min = "
        f"{least:.3g} at least: with longer steps it would gain energy; give a smaller {smaller}, or a softer "
        "contact"
    )


def has_divided_steps(model: Model) -> bool:
    """Whether fixed steps of a system may be divided: if contacts close, or dry friction comes to rest."""
    forces = model.joint_forces
    return len(model.gaps.connection) > 0 or bool((forces.friction > 0).any() or (forces.coefficient > 0).any())
