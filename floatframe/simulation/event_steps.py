"""Time steps in which events are located.

The compiled loop takes a block of steps and stores the memory after each. Then the watched values of the whole block
are computed at once. If a value passes its level within a step, trial steps of other sizes, from the memory before that
step, locate the event. No step of the run is repeated. Events that only record leave the motion unchanged, bit for bit.
"""

import json
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.file_frames import rows_of_file, state_of_file
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.impulses import impact
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.engine.kernels.memory import KINETIC, SPRINGS, WORK_GIVEN, WORK_TAKEN, Memory, Rows
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.integrators.ida import Ida
from floatframe.integrators.integrator import Failure, Integrator, coasted, counted_on, joined_rows, memory_of_past
from floatframe.integrators.relative_ode import RelativeOde
from floatframe.model.joints.rows import NOTHING, POSITION
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.head import Head
from floatframe.results.results_file import MemorySource
from floatframe.results.sensors import measurement_of
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.events import Event, events_of, off_at_start, require_events, switched
from floatframe.simulation.motion_head import joint_rows
from floatframe.simulation.passage import MOST_NEIGHBOURS, direct_values, expected_passage, passage
from floatframe.simulation.stop_events import (
    INWARD,
    StopEvent,
    coupled_sum,
    just_inside,
    require_within_limits,
    stop_events,
    stop_values,
    sum_rows,
    sum_size,
)
from floatframe.simulation.switch_events import SwitchEvent, beyond_zero, sign_of, switch_events, with_signs

__all__ = ["EventWatch"]

BLOCK = 400  #: largest number of steps in a block; blocks end at multiples of it
#: change of a watched value in a step, relative to its level and largest value, below which it is constant
STANDS = 1e-9
#: fraction of a step below which the rest after an event is extrapolated, because so short a step is only roundoff
SHORT = 1e-7
MOST_NUMBERS = 2**23  #: largest count of numbers in the results of a block
SHUT = 1e-6  #: largest gap, relative to `gap_sizes`, that a coupler or an element closes when it is engaged
MOST_MADE = 8  #: largest number of switched systems that are cached
MOST_IN_A_STEP = 100  #: largest number of events in one step; more of them switch each other on and off endlessly


class Ended(NamedTuple):
    """The result at the end of a step."""

    memory: Callable[[], Memory]  #: function that returns the memory
    row: Rows | None  #: result row; None if it was not written
    values: Array  #: watched values of the events, (n_events,)


class Place(NamedTuple):
    """The location of event j within a step."""

    part: float  #: time since the start of the step, as a fraction of the step size
    j: int
    memory: Memory
    row: Rows
    failure: Failure | None  #: failure of the trial step to this location, or None


def same(memory: Memory) -> Memory:
    """Return the memory unchanged; used when the memory of an `Ended` exists already."""
    return memory


def past_rows(work: Work, n_steps: int, t0: float, h: float, first: int) -> Rows:
    """Return one row after each of n_steps steps, with the time and the stored angles only."""
    empty = Rows(*(np.zeros(0) for _ in Rows._fields))
    times: Array = t0 + h * np.arange(first + 1, first + n_steps + 1, dtype=float)
    return empty._replace(t=times, angle=work.past.memory.angle[:n_steps])


def one_of(rows: Rows, k: int) -> Rows:
    """Return row k of the results as a record with one row."""
    return Rows(*(array[k : k + 1] for array in rows))


@dataclass
class EventWatch:
    """The events of a run: watched values, switched parts, stops at their limits, and past events."""

    full: System  #: the system with all forces switched on
    head: Head
    system: System = field(init=False)  #: the system with the present switches
    #: cache of switched systems, by the names of parts that are off and by held values
    made: dict[tuple, System] = field(init=False, default_factory=dict)
    events: tuple[Event, ...] = field(init=False)  #: events of the system, of its stops and of its switching functions
    off: frozenset[str] = field(init=False)  #: names of forces, couplers and elements that are off
    caught: dict[str, float] = field(default_factory=dict)  #: values at which engaged couplers are fixed
    #: limit, "lower" or "upper", at which each stopped coupler rests
    resting: dict[str, str] = field(default_factory=dict)
    signs: dict[str, int] = field(default_factory=dict)  #: present sign of each switching function, by event
    #: watched values at the last time, with angles counted through full turns, (n_events,)
    values: Array = field(init=False)
    row: Rows | None = field(init=False, default=None)  #: results at the last time, if sensors need them
    #: the last two measured rows, each with a copy in the body frames of result files
    told: tuple[tuple[Rows, Rows], ...] = field(init=False, default=())
    happened: list[dict[str, Any]] = field(default_factory=list)
    recorded: list[Rows] = field(default_factory=list)  #: results at events since the last call of `taken`
    has_stopped: bool = False
    #: function that computes the watched value of an event from result rows; None if a sensor is needed
    direct: list[Callable[[Rows], Array] | None] = field(init=False)
    due: int = -1  #: number of the next step that contains an event, -1 if unknown
    trial: tuple[System, Work] | None = field(init=False, default=None)  #: working arrays of trial steps
    calm: int = BLOCK  #: largest size of the next block, which is small after an event that changed the motion
    changed: int = 0  #: number of the step at whose end the motion was last changed by an event

    def __post_init__(self) -> None:
        require_events(self.full)
        self.events = (*events_of(self.full), *stop_events(self.full), *switch_events(self.full))
        released = {coupler.name for coupler in self.full.couplers if not coupler.engaged}
        self.switch(off_at_start(events_of(self.full)) | released)
        self.values, self.largest = np.zeros(len(self.events)), np.zeros(len(self.events))
        is_own = [isinstance(each, StopEvent | SwitchEvent) for each in self.events]
        each_event = zip(self.events, is_own, strict=True)
        self.direct = [None if own else direct_values(self.full, each) for each, own in each_event]

    def copied(self) -> "EventWatch":
        """Return a copy for a companion run with another step size; both share the cache of switched systems."""
        other = copy(self)
        other.caught, other.resting, other.signs = dict(self.caught), dict(self.resting), dict(self.signs)
        other.values, other.happened, other.recorded = self.values.copy(), list(self.happened), []
        other.trial, other.due, other.calm, other.changed = None, -1, BLOCK, 0  # step numbers of this run
        return other

    def switch(self, off: frozenset[str]) -> None:
        """Switch off exactly these names, and keep the values of couplers and stops."""
        self.off = off
        self.caught = {name: value for name, value in self.caught.items() if name not in off}
        limits = {coupler.name: coupler.limits for coupler in self.full.couplers}
        stops = {name: float(getattr(limits[name], side)) for name, side in self.resting.items()}
        held = self.caught | stops
        key = off, tuple(sorted(held.items())), tuple(self.signs.items())
        if key not in self.made:
            if len(self.made) >= MOST_MADE:
                self.made.clear()
            self.made[key] = switched(with_signs(self.full, self.signs), off, held)
        self.system = self.made[key]

    def begin(self, row: Rows) -> None:
        """Take the result row at the time at which the steps start or resume."""
        is_first = self.row is None
        self.row = row
        if is_first and not self.happened:
            self.values = self.measured(row, row)[0]
            require_within_limits(compiled_system(self.full), self.events, self.values)
            pairs = zip(self.events, self.values, strict=True)
            self.signs = {each.name: sign_of(float(x)) for each, x in pairs if isinstance(each, SwitchEvent)}
            self.switch(self.off)
            self.take_inside()

    def measured(self, *rows: Rows) -> Array:
        """Return the watched values for result rows, (n_times, n_events)."""
        compiled = compiled_system(self.full)
        motion, columns = None, []
        for event, direct in zip(self.events, self.direct, strict=True):
            if isinstance(event, StopEvent):
                columns.append(stop_values(compiled, event, self.resting, rows))
                continue
            if isinstance(event, SwitchEvent) and event.values is not None:
                columns.append(event.values(rows))
                continue
            if direct is not None:
                columns.append(np.concatenate([direct(row) for row in rows]))
                continue
            if motion is None:
                arrays = joint_rows(self.full, [self.in_files(row) for row in rows])
                head = replace(self.head, summary={"events": self.happened})
                motion = Trajectory(head, MemorySource(arrays), is_complete=False)
            found = measurement_of(self.full, motion, event.watch).columns
            name = event.column or next(iter(found))
            if name not in found:
                raise ModelError(f"event {event.name!r}: column: expected one of {', '.join(found)}, got {name!r}")
            columns.append(found[name])
        values = np.array(columns).T
        self.largest = np.maximum(self.largest, np.abs(values).max(axis=0, initial=0.0))
        return values

    def in_files(self, row: Rows) -> Rows:
        """Return result rows in the body frames of result files; single rows are cached for the next step."""
        for known, told in self.told:
            if known is row:
                return told
        told = rows_of_file(compiled_system(self.full), row)
        if len(row.t) == 1:
            self.told = (*self.told[-1:], (row, told))
        return told

    def values_after(self, row: Rows) -> Array:
        """Return the watched values of a later result row, (n_events,)."""
        if self.is_direct:
            return np.asarray(self.measured(row)[0])
        assert self.row is not None
        return np.asarray(self.measured(self.row, row)[1])

    @property
    def is_direct(self) -> bool:
        """Whether the watched values can be computed without sensors."""
        return None not in self.direct

    def happens(self, event: Event, before: float, after: float) -> bool:
        """Whether an event happens between two watched values.

        If an event would switch nothing, it does not happen by a change of roundoff size, as of a latched value.
        """
        if not event.happens(before, after):
            return False
        only_switches = bool(event.switch_on or event.switch_off) and not event.stop
        changes = bool(self.off.intersection(event.switch_on)) or not self.off.issuperset(event.switch_off)
        size = max(abs(event.level_passed), float(self.largest[self.events.index(event)]))
        return changes or not only_switches or abs(after - before) > STANDS * size

    def near_levels(self, values: Array) -> IntArray:
        """Return the steps in which a value, (n_times, n_events), is close to its level or passes it."""
        beyond = values - np.array([event.level_passed for event in self.events])
        return np.flatnonzero(~(beyond[1:] * beyond[:-1] > 0.0).all(axis=1))

    def any_happens(self, before: Array, after: Array) -> bool:
        """Whether any event happens between two sets of watched values, (n_events,)."""
        each = zip(self.events, before, after, strict=True)
        return any(self.happens(event, float(first), float(then)) for event, first, then in each)

    def new_work(self) -> Work:
        """Return working arrays for the system with the present switches, with space for the memories of a block."""
        return new_work(compiled_system(self.system).model, min(BLOCK, self.longest))

    @property
    def longest(self) -> int:
        """Largest number of steps in a block, limited by the memory that its results need."""
        state = compiled_system(self.full).placed
        numbers = 8 * state.r.size + 5 * len(state.u) + len(compiled_system(self.full).owners)
        return max(1, MOST_NUMBERS // (numbers + 1))

    def trial_work(self) -> Work:
        """Return working arrays for trial steps, which leave the factors of the run unchanged."""
        if self.trial is None or self.trial[0] is not self.system:
            self.trial = self.system, new_work(compiled_system(self.system).model)
        return self.trial[1]

    def steps(
        self, integrator: Integrator, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int,
        every: int,
    ) -> tuple[Memory, Rows, Work, int, Failure | None]:  # fmt: skip
        """Take a block of up to n_steps steps of size h, beginning with step `first` counted from t0.

        Return the memory, the results after every `every`-th step (and at a stop), working arrays, the number of
        completed steps, and the reason if the next step failed.

        (1) One call takes the steps of the block and stores the memory after each. The watched values are computed.
        (2) If an event happens in a step, trial steps from the memory before this step locate the event (`settled`).
        (3) If the event does not change the motion, the steps of the block are accepted.
        (4) If the event changes the motion, the block ends with that step.

        If the method stores no memories, the steps before the event are repeated, and the step with the event is taken
        in a call of its own.
        """
        keeps_past = not isinstance(integrator, Ida | RelativeOde)
        is_single = first == self.due or isinstance(integrator, Ida)  # each call of Ida restarts
        n = 1 if is_single else min(n_steps, BLOCK - first % BLOCK, self.calm, self.longest)
        # other methods complete their memories only where results are written
        every_row = every if self.is_direct and isinstance(integrator, GeneralizedAlpha) else 1
        begin, before = memory, self.row
        work.past.n[...] = 0
        memory, rows, n_good, failure = integrator.advance(
            self.system, begin, work, t0=t0, h=h, first=first, n_steps=n, every=every_row
        )
        if every_row == 1:
            assert before is not None
            found = self.measured(before, rows)[1:]
        else:
            found = self.measured(past_rows(work, n_good, t0, h, first))
        values = np.concatenate([self.values[None], found])
        for k in map(int, self.near_levels(values)):
            if not self.any_happens(values[k], values[k + 1]):
                continue
            if n > 1 and not keeps_past:
                self.due = first + k
                if k == 0:
                    return self.steps(integrator, begin, work, t0=t0, h=h, first=first, n_steps=1, every=every)
                n_good, values = k, values[: k + 1]
                memory, rows, _, failure = integrator.advance(
                    self.system, begin, work, t0=t0, h=h, first=first, n_steps=n_good, every=1
                )
                break
            self.values = values[k]
            if every_row == 1:
                self.row = before if k == 0 else one_of(rows, k - 1)
            after = partial(memory_of_past, work, memory, k) if keeps_past else partial(same, memory)
            ended = Ended(after, one_of(rows, k) if every_row == 1 else None, values[k + 1])
            close = slice(max(0, k + 1 - MOST_NEIGHBOURS), k + 1 + MOST_NEIGHBOURS)
            settled = self.settled(
                integrator,
                begin if k == 0 else memory_of_past(work, memory, k - 1),
                ended,
                work,
                t=t0 + (first + k) * h,
                t_end=t0 + (first + k + 1) * h,
                h=h,
                neighbours=(k - close.start, values[close]),
            )
            if settled is not None:
                memory, row, work, failure = settled
                n_good = k + int(failure is None)
                rows = Rows(*(array[: (first + k) // every_row - first // every_row] for array in rows))
                if failure is None and (self.has_stopped or (first + n_good) % every_row == 0):
                    rows = joined_rows([rows, row])
                self.calm = max(1, (first + n_good - self.changed) // 2)
                self.changed = first + n_good
                return memory, self.due_of(rows, first, every // every_row), work, n_good, failure
        self.values = values[n_good]
        if n_good and every_row == 1:
            self.row = one_of(rows, n_good - 1)
        self.calm = min(2 * self.calm, BLOCK)
        return memory, self.due_of(rows, first, every // every_row), work, n_good, failure

    def due_of(self, rows: Rows, first: int, every: int) -> Rows:
        """Return the results after every `every`-th step, counted from `first`, and the result at a stop."""
        if every == 1:
            return rows
        is_due = (first + 1 + np.arange(len(rows.t))) % every == 0
        if self.has_stopped:
            is_due[-1:] = True
        return Rows(*(array[is_due] for array in rows))

    def step(
        self, integrator: Integrator, memory: Memory, work: Work, *, t0: float, h: float, k: int
    ) -> tuple[Memory, Rows, Work, Failure | None]:
        """Take step k of size h from t0 + k h with its events; return the results at its end or at a stop."""
        after, row, _, failure = integrator.advance(self.system, memory, work, t0=t0, h=h, first=k, n_steps=1, every=1)
        if failure is not None:
            return memory, row, work, failure
        ended = Ended(partial(same, after), row, self.values_after(row))
        settled = self.settled(integrator, memory, ended, work, t=t0 + k * h, t_end=t0 + (k + 1) * h, h=h)
        return (after, row, work, None) if settled is None else settled

    def settled(
        self, integrator: Integrator, begin: Memory, ended: "Ended", work: Work, *, t: float, t_end: float, h: float,
        neighbours: tuple[int, Array] | None = None,
    ) -> tuple[Memory, Rows, Work, Failure | None] | None:  # fmt: skip
        """Handle the events in a step of size h from t; return None if they do not change the motion.

        Otherwise return memory, results and working arrays at the end of the step or at the stop, and the reason if the
        step failed. begin: memory before the step. ended: end of the step. neighbours: the watched values at the steps
        around this one, (n_times, n_events), after the number of these steps that come before it.
        """
        size, reached_end = h, None
        for _ in range(MOST_IN_A_STEP):
            events, values = self.events, ended.values
            passed = [j for j, e in enumerate(events) if self.happens(e, float(self.values[j]), float(values[j]))]
            if not passed:
                self.values, self.row = values, ended.row
                return reached_end
            found = sorted(
                (self.located(integrator, begin, ended, t, size, j, neighbours) for j in passed),
                key=lambda place: (place.part, place.j),
            )
            acting = next((place for place in found if events[place.j].is_active), None)
            last = 1.0 if acting is None else acting.part
            noted = [place for place in found if not events[place.j].is_active and place.part <= last]
            failure = next((place.failure for place in (*noted, acting) if place and place.failure is not None), None)
            if failure is not None:
                return begin, found[0].row, work, failure
            for place in noted:
                self.note(place, t + place.part * size)
            if acting is None:
                self.values, self.row = values, ended.row
                return reached_end
            event, memory = events[acting.j], acting.memory
            t = t + acting.part * size if event.at is None else event.at
            row = acting.row._replace(t=np.array([t]))
            reached = self.values_after(row)
            # these events have passed their levels: correct values that roundoff leaves on the old side
            for i in (acting.j, *(place.j for place in noted)):
                level = events[i].level_passed
                if (reached[i] - level) * (self.values[i] - level) > 0.0:
                    reached[i] = level
            for place in found:  # events at the same time follow after this one
                if place.j != acting.j and events[place.j].is_active and place.part <= acting.part:
                    reached[place.j] = self.values[place.j]
            self.values, self.row = reached, row
            before = self.system
            if isinstance(event, StopEvent):
                state = self.strike(memory, event, t, h)
            elif isinstance(event, SwitchEvent):
                self.add(event, t)
                self.signs[event.name] = -self.signs[event.name]
                self.switch(self.off)
                state = None
            else:
                self.add(event, t)
                if event.record and not event.stop:
                    self.recorded.append(row)
                if event.stop:
                    self.has_stopped = True
                    return memory, row, work, None
                state = self.engage(event, memory, t)
            begin, row, work = self.begun_anew(integrator, before, memory, state, row, t)
            self.row = row
            self.take_inside()
            size, neighbours = t_end - t, None
            if size <= SHORT * h:
                begin, row = coasted(integrator, self.system, t, size, begin, work)
                self.row = row._replace(t=np.array([t_end]))
                return begin, self.row, work, None
            memory, row, _, failure = integrator.advance(
                self.system, begin, work, t0=t, h=size, first=0, n_steps=1, every=1
            )
            if failure is not None:
                return begin, row, work, failure
            ended = Ended(partial(same, memory), row, self.values_after(row))
            reached_end = memory, row, work, None
        words = f"{MOST_IN_A_STEP} events happened in one step: {', '.join(e['name'] for e in self.happened[-3:])}, ..."
        return memory, row, work, Failure(words, np.inf)

    def begun_anew(
        self, integrator: Integrator, system: System, memory: Memory, state: State | None, row: Rows, t: float
    ) -> tuple[Memory, Rows, Work]:
        """Return memory, results and working arrays for the motion after an event at t.

        system: as switched before t. state: state of the engine with changed velocities; None: the state of the memory.
        The method restarts if velocities or constraints have changed, and continues if only forces have changed. Energy
        that switched springs add or remove counts as supplied work, energy that an impact removes as dissipated work.
        """
        is_struck = state is not None
        before, work_done, work = row.diagnostics[-1], memory.work, self.new_work()
        if is_struck or not holds_alike(system, self.system):
            told = state_of_file(compiled_system(self.full), memory.state if state is None else state)
            fresh = counted_on(integrator.start(self.system, t, told, before=memory), memory)
            memory, row = integrator.observe(self.system, t, fresh, work)
        else:
            memory, row = integrator.after_jump(self.system, t, memory, work)
        after = row.diagnostics[-1]
        taken = float(before[KINETIC] - after[KINETIC]) if is_struck else 0.0
        change = np.array([float(after[SPRINGS] - before[SPRINGS]), taken])
        after[WORK_GIVEN] += change[0]
        after[WORK_TAKEN] += change[1]
        return memory.changed(work=work_done + change), row, work

    def engage(self, event: Event, memory: Memory, t: float) -> State | None:
        """Apply the switches of an event; return the engine state after a velocity jump, None if there is none."""
        compiled = compiled_system(self.full)
        couplers = {coupler.name: coupler for coupler in self.full.couplers}
        engaged = [name for name in event.switch_on if name in couplers and name in self.off]
        for name in engaged:
            caught, constant = coupled_sum(compiled, name, memory.w), couplers[name].constant
            if constant is None:
                self.caught[name] = caught
                continue
            wanted = float(constant(t))  # type: ignore[operator]
            if abs(caught - wanted) > SHUT * sum_size(compiled, name):
                raise ModelError(
                    f"event {event.name!r} at t = {t:g}: coupler {name!r} is to hold {wanted:.6g}, but finds "
                    f"{caught:.6g}; omit its constant, so that it holds this value, or let the event watch this sum"
                )
        holding = [
            placed
            for placed in compiled.laws
            if placed.element.name in self.off.intersection(event.switch_on)
            and any(each != NOTHING for each in placed.law.holds)
        ]
        self.switch((self.off | set(event.switch_off)) - set(event.switch_on))
        if not engaged and not holding:
            return None
        hit = impact(compiled_system(self.system), memory.state, t=t, known=memory.w, restitution={})
        for placed in holding:
            require_shut(event, placed, hit.gap, t, compiled.gap_sizes)
        cores = [sum_rows(compiled, name)[2] for name in engaged]
        impulse = {name: float(hit.impulse[k]) for name, k in zip(engaged, cores, strict=True)}
        for placed in holding:
            for name, row in zip(placed.law.multipliers, placed.multipliers, strict=True):
                impulse[f"{placed.element.name}.{name}"] = float(hit.impulse[row])
        self.happened[-1]["impulse"] = impulse
        return hit.state

    def strike(self, memory: Memory, event: StopEvent, t: float, h: float) -> State | None:
        """Handle a coupler that reaches or leaves its limit; return the engine state after a velocity jump, or None."""
        self.add(event, t)
        happened = self.happened[-1]
        if event.side == "release":
            del self.resting[event.coupler]
            self.switch(self.off)
            return None
        limits = next(each.limits for each in self.full.couplers if each.name == event.coupler)
        assert limits is not None  # only couplers with limits have stop events
        _, factors, core = sum_rows(compiled_system(self.full), event.coupler)
        self.resting[event.coupler] = event.side
        self.switch(self.off)
        holding = compiled_system(self.system)
        hit = impact(holding, memory.state, t=t, known=memory.w, restitution={})
        speed = float(hit.rate[core]) * float(np.abs(factors).max())  # rows of couplers have a largest coefficient of 1
        told = state_of_file(compiled_system(self.full), hit.state)
        pressed = INWARD[event.side] * float(consistent_motion(self.system, told, t=t, known=memory.w).w[core])
        thrown = 2 * limits.restitution * abs(float(hit.impulse[core]))  # pressed by this for the time of the flight
        happened["speed before"], happened["speed after"] = speed, 0.0
        if pressed > 0.0 and thrown <= pressed * h:
            happened["impulse"] = {event.coupler: float(hit.impulse[core])}
            return hit.state
        if limits.restitution > 0.0:
            restitution = {core: limits.restitution}
            hit = impact(holding, memory.state, t=t, known=memory.w, restitution=restitution)
            happened["speed after"] = -limits.restitution * speed
        happened["impulse"] = {event.coupler: float(hit.impulse[core])}
        del self.resting[event.coupler]
        self.switch(self.off)
        return hit.state

    def take_inside(self) -> None:
        """Move values at limits without contact just inside, so that the next passage is an event.

        Likewise, values of switching functions move to the side of their current sign.
        """
        for j, event in enumerate(self.events):
            if isinstance(event, StopEvent) and event.side in INWARD and event.coupler not in self.resting:
                self.values[j] = just_inside(event, float(self.values[j]))
            elif isinstance(event, SwitchEvent):
                self.values[j] = beyond_zero(float(self.values[j]), self.signs[event.name])

    def add(self, event: Event, t: float) -> None:
        """Add an event to the list of events so far."""
        self.happened.append({"name": event.name, "t": t, "stop": event.stop, "switch_on": list(event.switch_on),
                              "switch_off": list(event.switch_off)})  # fmt: skip

    def note(self, place: "Place", t: float) -> None:
        """Store the results of a trial step to an event that does not change the motion."""
        event = self.events[place.j]
        self.add(event, t if event.at is None else event.at)
        self.recorded.append(place.row if event.at is None else place.row._replace(t=np.array([event.at])))

    def taken(self) -> list[Rows]:
        """Return the results stored at events since the last call."""
        rows, self.recorded = self.recorded, []
        return rows

    def located(
        self, integrator: Integrator, begin: Memory, ended: "Ended", t: float, size: float, j: int,
        neighbours: tuple[int, Array] | None,
    ) -> "Place":  # fmt: skip
        """Locate event j in a step of size `size` from t; return the location just after the event.

        Each trial is one step from the start of the given step to the trial time.
        """
        event, work = self.events[j], self.trial_work()
        tried: dict[float, Place] = {}

        def at(part: float) -> Place:
            if part == 1.0:
                memory, row = ended.memory(), ended.row
                if row is None:
                    _, row = integrator.observe(self.system, t + size, memory, work)
                return Place(part, j, memory, row, None)
            if part <= 0.0:  # at the start, after another event at this time
                begun, row = integrator.observe(self.system, t, begin, work)
                return Place(0.0, j, begun, row, None)
            if part not in tried:
                work.solver.c_k[...] = 0.0  # do not use factors of other trial steps
                memory, row, _, failure = integrator.advance(
                    self.system, begin, work, t0=t, h=part * size, first=0, n_steps=1, every=1
                )
                tried[part] = Place(part, j, memory, row, failure)
            return tried[part]

        if event.at is not None:
            return at((event.at - t) / size)
        first, last = float(self.values[j]) - event.level, float(ended.values[j]) - event.level
        sign = float(np.sign(last) or -np.sign(first))

        def beyond(part: float) -> float:
            place = at(part)
            if place.failure is not None:
                raise ModelError(f"event {event.name!r}: its time in the step from t = {t:g} was not found")
            return sign * (float(self.values_after(place.row)[j]) - event.level)

        before, values = (0, np.array([first, last])) if neighbours is None else neighbours
        if neighbours is not None:
            values = values[:, j] - event.level
        guess = expected_passage([float(k - before) for k in range(len(values))], [sign * float(x) for x in values])
        return at(passage(beyond, sign * first, max(sign * last, 0.0), event.tolerance, guess))

    def record(self) -> dict[str, Array]:
        """Return the data for a resumed run by name."""
        names = ("happened", "caught", "resting", "signs", "calm", "changed", "due")
        words = json.dumps({"off": sorted(self.off)} | {name: getattr(self, name) for name in names})
        return {"event_values": self.values, "events": np.frombuffer(words.encode(), dtype=np.uint8)}

    def restore(self, record: Mapping[str, Array]) -> None:
        """Restore the data of an interrupted run."""
        data = json.loads(np.asarray(record["events"], dtype=np.uint8).tobytes().decode())
        self.caught, self.resting, self.signs = (data.get(name, {}) for name in ("caught", "resting", "signs"))
        self.calm = data.get("calm", BLOCK)
        self.changed, self.due = data.get("changed", 0), data.get("due", -1)
        self.switch(frozenset(data["off"]))
        self.happened = data["happened"]
        self.values = np.array(record["event_values"], dtype=float)


def holds_alike(a: System, b: System) -> bool:
    """Whether two switched systems have the same position and velocity constraints."""
    return np.array_equal(compiled_system(a).model.rows.kind, compiled_system(b).model.rows.kind)


def require_shut(event: Event, placed: PlacedLaw, gap: Array, t: float, sizes: Array) -> None:
    """Raise `ModelError` if an element that is switched on constrains a position that the bodies do not have."""
    for name, row, holds in zip(placed.law.multipliers, placed.multipliers, placed.law.holds, strict=True):
        if holds == POSITION and abs(gap[row]) > SHUT * sizes[row]:
            raise ModelError(
                f"event {event.name!r} at t = {t:g}: element {placed.element.name!r} is to hold the position of its "
                f"multiplier {name!r}, but finds it open by {gap[row]:.6g}; let the event watch this position"
            )
