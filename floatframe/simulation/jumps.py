"""Steps at force jumps: one step ends at the jump and the next step begins there, so that no impulse is lost.

A time integration method evaluates a force at both ends of a step. If the force jumps within the step or at one of its
ends, the impulse has an error of order h. Therefore the step ends just before the jump, and the motion continues from
the state there with the accelerations due to the force after the jump. If a state of an element (the current of a
motor) responds to the jump in less than a step, the step begins with short parts that grow.
"""

from collections.abc import Sequence
from math import ceil

import numpy as np

from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.compiling.time_laws import functions_of_time, parts_of_time
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.work import Work
from floatframe.errors import ModelError
from floatframe.integrators.integrator import Failure, Integrator
from floatframe.integrators.registry import has_fixed_steps
from floatframe.model.functions.time_switches import OfTime, switch_times
from floatframe.model.system import System
from floatframe.simulation.event_steps import EventWatch

__all__ = ["jump_times", "jumps_by_step", "jumps_of_steps", "next_steps"]

PER_STEP = 4  #: number of points in a step between which expressions of t are compared
MOST_PLACES = 1_000_000  #: largest number of points of comparison in a run
N_PARTS = 10  #: largest number of halvings of a step after a jump, for states with fast response
#: a step is halved if the change predicted by the state's rate exceeds these multiples of its change and of its size
FOLLOWED, FELT = 2.0, 0.05
STEEP = 1.5  #: growth of an expression at half the distance that indicates a pole
SHORT = 1e-9  #: gap left before a jump, and remainder that counts as zero, as fractions of a step


def jump_times(system: System, t_start: float, h: float, n_steps: int) -> list[float]:
    """Return the ascending times after the start of a run, up to its end, at which a force or law jumps.

    (1) jumps of the values of functions of time
    (2) switches of expressions, found between points in the steps
    (3) knots that user forces and laws declare
    """
    times = {
        float(t) for each in functions_of_time(system) if not each.is_motion for t in each.function.jumps(0)[0]
    }  # (1)
    n_places = min(PER_STEP * n_steps, MOST_PLACES) + 1
    for where, each in parts_of_time(system):  # (2)
        parts = each.parts_of_time()
        found = switch_times(parts.switches, np.linspace(t_start, t_start + n_steps * h, n_places))
        require_bounded(where, parts.values, found, SHORT * h)
        times |= set(found)
    times |= {float(t) for force in system.forces for t in getattr(force, "knots", ())}  # (3)
    times |= {float(t) for placed in compiled_system(system).laws for t in placed.law.knots}
    return sorted(t for t in times if t_start < t <= t_start + n_steps * h * (1 + 1e-12))


def require_bounded(where: str, values: Sequence[OfTime], times: Sequence[float], short: float) -> None:
    """Raise `ModelError` if an expression has a pole at a jump, shown by its growth at half the distance."""
    for value in values:
        for t in times:
            for side in (-short, short):
                near, middle, far = np.abs(value(t + side * np.array([1.0, 2.0, 4.0])))
                if near > STEEP * middle and middle > STEEP * far > 0.0:
                    raise ModelError(
                        f"{where}: an expression grows without bound near t = {t:.9g}, where a tangent has a pole or a "
                        "denominator passes zero; expected a bounded one: limit it, as in min(5, max(-5, tan(t))), or "
                        "end the run before"
                    )


def jumps_of_steps(system: System, t_start: float, h: float, n_steps: int) -> dict[int, list[float]]:
    """Return the jump times for each step k, after t_start + k h and up to t_start + (k + 1) h inclusive."""
    jumps = jumps_by_step(jump_times(system, t_start, h, n_steps), t_start, h)
    return {k: times for k, times in jumps.items() if k < n_steps}


def jumps_by_step(times: list[float], t0: float, h: float) -> dict[int, list[float]]:
    """Return the jump times after t0 by the step k that contains them, from t0 + k h to t0 + (k + 1) h."""
    found: dict[int, list[float]] = {}
    for t in times:
        k = max(ceil((t - t0) / h - SHORT) - 1, 0)  # next to t0: the motion restarts at once
        found.setdefault(k, []).append(t)
    return found


def next_steps(
    integrator: Integrator,
    system: System,
    memory: Memory,
    work: Work,
    *,
    t0: float,
    h: float,
    first: int,
    n_steps: int,
    every: int,
    jumps: dict[int, list[float]],
    events: EventWatch | None = None,
) -> tuple[Memory, Rows, Work, int, Failure | None]:
    """Take steps of size h, beginning with step `first` counted from t0: the steps before the next jumps, or this step.

    Return the memory after them, the results after every `every`-th step (and at a stop), working arrays, the number of
    completed steps, at most n_steps, and the reason if the next step failed. jumps: times by step. system: as events
    have switched it.
    """
    n_smooth = min((k - first for k in jumps if k >= first), default=n_steps)
    if n_smooth == 0:
        memory, rows, work, failure = over_jumps(
            integrator, system, memory, work, t=t0 + first * h, h=h, jumps=jumps[first], events=events
        )
        n_good = int(failure is None)
        has_row = n_good and ((first + 1) % every == 0 or (events is not None and events.has_stopped))
        return memory, Rows(*(array[: 1 if has_row else 0] for array in rows)), work, n_good, failure
    n_steps = min(n_steps, n_smooth)
    if events is not None:
        return events.steps(integrator, memory, work, t0=t0, h=h, first=first, n_steps=n_steps, every=every)
    memory, rows, n_good, failure = integrator.advance(
        system, memory, work, t0=t0, h=h, first=first, n_steps=n_steps, every=every
    )
    return memory, rows, work, n_good, failure


def over_jumps(
    integrator: Integrator,
    system: System,
    memory: Memory,
    work: Work,
    *,
    t: float,
    h: float,
    jumps: list[float],
    events: EventWatch | None = None,
) -> tuple[Memory, Rows, Work, Failure | None]:
    """Take a step of size h from t, divided at jumps; return memory and results at its end, or at a stop."""
    where, end, begin = t, t + h, memory
    rows: Rows | None = None
    is_after = False  # whether the next part of the step follows a jump
    for number, until in enumerate([*jumps, end]):
        is_last = number == len(jumps)
        size = until - where - (0.0 if is_last else SHORT * h)
        if size > SHORT * h:
            acting = system if events is None else events.system
            n_parts = n_settling_parts(integrator, acting, memory, work, where, size) if is_after else 0
            done = 0.0
            for part in range(n_parts + 1):  # each part is as long as all parts before it
                until_part = size * 2.0 ** (part - n_parts)
                at, own = where + done, until_part - done
                if events is None:
                    memory, rows, _, failure = integrator.advance(
                        system, memory, work, t0=at, h=own, first=0, n_steps=1, every=1
                    )
                else:
                    memory, rows, work, failure = events.step(integrator, memory, work, t0=at, h=own, k=0)
                if failure is not None:
                    return begin, rows, work, failure
                if events is not None and events.has_stopped:
                    return memory, rows, work, None
                done = until_part
        if not is_last:
            acting = system if events is None else events.system
            memory, rows = integrator.after_jump(acting, until, memory, work)
            is_after = True
        where = until
    assert rows is not None
    return memory, rows._replace(t=np.full_like(rows.t, end)), work, None


def n_settling_parts(integrator: Integrator, system: System, memory: Memory, work: Work, t: float, size: float) -> int:
    """Return how many times a step after a jump is halved at its beginning.

    A trial step is taken: if the initial rate of a state predicts a much larger change than the step has, the state
    settles within the step.
    """
    rows = compiled_system(system).model.states.row
    if not len(rows) or not has_fixed_steps(integrator):
        return 0
    after, _, n_good, _ = integrator.advance(system, memory, work, t0=t, h=size, first=0, n_steps=1, every=2)
    if not n_good:
        return N_PARTS
    z, z_after = memory.w[rows], after.w[rows]
    way = size * np.abs(memory.w[rows + 1])
    is_fast = (way > FOLLOWED * np.abs(z_after - z)) & (way > FELT * np.maximum(np.abs(z), np.abs(z_after)))
    return N_PARTS if is_fast.any() else 0
