"""Steps with events: values watched after each of many steps, and the step refined to where one passes its level.

Steps are taken by the compiled loop in blocks, and what is watched is measured for a whole block at once. A block in
which something happens is taken again up to the step in question, from the memory and the factors that it began with:
the same numbers, bit for bit.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.compiling.file_frames import rows_of_file, state_of_file
from floatframe.compiling.public_elements import PlacedLaw
from floatframe.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.integrators.carry import Carry, Failure, Integrator
from floatframe.integrators.ida import Ida
from floatframe.joints.rows import NOTHING, POSITION
from floatframe.kernels.memory import KINETIC, SPRINGS, WORK_GIVEN, WORK_TAKEN, Rows
from floatframe.kernels.records import leaves
from floatframe.kernels.work import Work, new_work
from floatframe.motion.events import Event, events_of, off_at_start, require_events, switched
from floatframe.motion.stop_events import (
    INWARD,
    StopEvent,
    coupled_sum,
    just_inside,
    require_within_limits,
    stop_events,
    stop_values,
    sum_rows,
)
from floatframe.results.head import Head
from floatframe.results.results_file import MemorySource
from floatframe.results.sensors import sensor_of
from floatframe.results.trajectory import Trajectory
from floatframe.results.writer import arrays_of
from floatframe.start.impact import impact
from floatframe.state import State
from floatframe.system import System

__all__ = ["EventWatch"]

BLOCK = 400  #: most steps between which what is watched is not measured; blocks end where a multiple of it does
STANDS = 1e-9  #: change of what is watched in a step, relative to its level or 1, below which it is held or at rest
SHUT = 1e-6  #: of the length of the system, or rad: what a coupler may close that takes hold of a value
MOST_IN_A_STEP = 100  #: events in one step; more mean that events switch each other without end


@dataclass
class EventWatch:
    """The events of a run: what is watched, what is switched off, what stops hold, and what has happened."""

    full: System  #: with all forces
    head: Head
    system: System = field(init=False)  #: with some off
    events: tuple[Event, ...] = field(init=False)  #: those of the system, then those of its stops
    off: frozenset[str] = field(init=False)  #: forces at zero, couplers not engaged, elements that do nothing
    caught: dict[str, float] = field(default_factory=dict)  #: what couplers that have been engaged hold
    resting: dict[str, str] = field(default_factory=dict)  #: side of the limits at which couplers hold
    values: Array = field(init=False)  #: of the events at the last time, angles without jumps, (n_events,)
    row: Rows | None = field(init=False, default=None)  #: results at the last time
    #: the last two rows that were measured, each with itself in the frames of the files
    told: tuple[tuple[Rows, Rows], ...] = field(init=False, default=())
    happened: list[dict[str, Any]] = field(default_factory=list)
    recorded: list[Rows] = field(default_factory=list)  #: results at events since they were last taken
    has_stopped: bool = False
    due: int = -1  #: number of the step in which something is known to happen
    #: working arrays, those that are not empty, and what they were where the present block began
    held: tuple[Work, list[Array], list[Array]] | None = field(init=False, default=None)
    calm: int = BLOCK  #: most steps of the next block: few after an event, which may be one of many

    def __post_init__(self) -> None:
        require_events(self.full)
        self.events = (*events_of(self.full), *stop_events(self.full))
        released = {coupler.name for coupler in self.full.couplers if not coupler.engaged}
        self.switch(off_at_start(events_of(self.full)) | released)
        self.values = np.zeros(len(self.events))

    def switch(self, off: frozenset[str]) -> None:
        """Take these forces and couplers off, all others on, with what couplers have caught and stops hold."""
        self.off = off
        self.caught = {name: value for name, value in self.caught.items() if name not in off}
        limits = {coupler.name: coupler.limits for coupler in self.full.couplers}
        stops = {name: float(getattr(limits[name], side)) for name, side in self.resting.items()}
        self.system = switched(self.full, off, self.caught | stops)

    def begin(self, row: Rows) -> None:
        """Take the results at the time from which steps go on."""
        is_first = self.row is None
        self.row = row
        if is_first and not self.happened:
            self.values = self.measured(row, row)[0]
            require_within_limits(compiled_system(self.full), self.events, self.values)
            self.take_inside()

    def measured(self, *rows: Rows) -> Array:
        """Return what each event watches at the times of rows of results, (n_times, n_events)."""
        compiled = compiled_system(self.full)
        motion, columns = None, []
        for event in self.events:
            if isinstance(event, StopEvent):
                columns.append(stop_values(compiled, event, self.resting, rows))
                continue
            if event.at is not None:
                columns.append(np.concatenate([row.t for row in rows]))
                continue
            if motion is None:
                arrays = arrays_of([self.in_files(row) for row in rows])
                arrays["drift"] = arrays["drift"][:, : len(self.head.joints)]
                head = replace(self.head, summary={"events": self.happened})
                motion = Trajectory(head, MemorySource(arrays), is_complete=False)
            found = sensor_of(self.full, event.watch).measure(self.full, motion).columns
            name = event.column or next(iter(found))
            if name not in found:
                raise ModelError(f"event {event.name!r}: column: expected one of {', '.join(found)}, got {name!r}")
            columns.append(found[name])
        return np.array(columns).T

    def in_files(self, row: Rows) -> Rows:
        """Return results in the frames of the files; those after one step are those before the next."""
        for known, told in self.told:
            if known is row:
                return told
        told = rows_of_file(compiled_system(self.full), row)
        if len(row.t) == 1:
            self.told = (*self.told[-1:], (row, told))
        return told

    def values_after(self, row: Rows) -> Array:
        """Return what is watched at a later time."""
        assert self.row is not None
        return np.asarray(self.measured(self.row, row)[1])

    def happens(self, event: Event, before: float, after: float) -> bool:
        """Whether an event happens from one value to the next.

        One that only switches, and finds all as it wants it, does not where rounding alone passes its level: what a
        latch holds stays there.
        """
        if not event.happens(before, after):
            return False
        only_switches = bool(event.switch_on or event.switch_off) and not event.stop
        changes = bool(self.off.intersection(event.switch_on)) or not self.off.issuperset(event.switch_off)
        return changes or not only_switches or abs(after - before) > STANDS * max(1.0, abs(event.level_passed))

    def near_levels(self, values: Array) -> IntArray:
        """Return the steps in which a value, (n_times, n_events), may pass its level: it is not on one side of it."""
        beyond = values - np.array([event.level_passed for event in self.events])
        return np.flatnonzero(~(beyond[1:] * beyond[:-1] > 0.0).all(axis=1))

    def any_happens(self, before: Array, after: Array) -> bool:
        """Whether an event happens from values to the next, (n_events,)."""
        each = zip(self.events, before, after, strict=True)
        return any(self.happens(event, float(first), float(then)) for event, first, then in each)

    def steps(
        self, integrator: Integrator, carry: Carry, work: Work, *, t0: float, h: float, first: int, n_steps: int
    ) -> tuple[Carry, Rows, Work, int, Failure | None]:
        """Take steps of size h, the first of them number `first` from t0, as many as make a block, n_steps at most.

        Return the results after each of them (those at a stop, if the run ends there), and how many are done.

        (1) the steps of a block, as many as there were without an event, by one call; what is watched, after each
        (2) nothing happens: the block is done
        (3) something happens in its first step: that step is taken by `step`
        (4) something happens later: the steps before are taken again from where the block began, and are done
        """
        n = min(n_steps, BLOCK - first % BLOCK, self.calm)
        if n == 1 or first == self.due or isinstance(integrator, Ida):  # each call of Ida begins anew
            n_before = len(self.happened)
            carry, row, work, failure = self.step(integrator, carry, work, t0=t0, h=h, k=first)
            self.calm = min(2 * self.calm, BLOCK) if len(self.happened) == n_before else 1
            return carry, row, work, int(failure is None), failure
        if self.held is None or self.held[0] is not work:
            arrays = [array for _, array in leaves(work) if array.size]
            self.held = work, arrays, [np.empty_like(array) for array in arrays]
        _, arrays, kept = self.held
        begin = carry
        for array, value in zip(arrays, kept, strict=True):
            value[...] = array
        carry, rows, n_good, failure = integrator.advance(
            self.system, begin, work, t0=t0, h=h, first=first, n_steps=n, every=1
        )
        assert self.row is not None
        values = np.concatenate([self.values[None], self.measured(self.row, rows)[1:]])
        n_free = next((k for k in self.near_levels(values) if self.any_happens(values[k], values[k + 1])), n_good)
        if n_free < n_good:
            for array, value in zip(arrays, kept, strict=True):
                array[...] = value
            self.due = first + n_free
            carry = begin
            if n_free == 0:
                return self.steps(integrator, carry, work, t0=t0, h=h, first=first, n_steps=1)
            carry, rows, n_free, failure = integrator.advance(
                self.system, begin, work, t0=t0, h=h, first=first, n_steps=n_free, every=1
            )
        if n_free:
            self.values, self.row = values[n_free], Rows(*(array[n_free - 1 : n_free] for array in rows))
        self.calm = min(2 * self.calm, BLOCK)
        return carry, rows, work, n_free, failure

    def step(
        self, integrator: Integrator, carry: Carry, work: Work, *, t0: float, h: float, k: int
    ) -> tuple[Carry, Rows, Work, Failure | None]:
        """Take step k of size h from t0 + k h, with the events in it; return the results at its end, or at the stop."""
        t, t_end = t0 + k * h, t0 + (k + 1) * h
        where, size, number = t0, h, k
        for _ in range(MOST_IN_A_STEP):
            begin = carry
            carry, row, _, failure = integrator.advance(
                self.system, begin, work, t0=where, h=size, first=number, n_steps=1, every=1
            )
            if failure is not None:
                return begin, row, work, failure
            values = self.values_after(row)
            events = self.events
            passed = [j for j, e in enumerate(events) if self.happens(e, float(self.values[j]), float(values[j]))]
            trial = new_work(compiled_system(self.system).model) if passed else work  # leaves the factors of the run
            found = sorted(
                (self.locate(integrator, begin, work if events[j].is_active else trial, t, size, j, values[j]), j)
                for j in passed
            )
            acting = next(((part, j) for part, j in found if events[j].is_active), None)
            last = 1.0 if acting is None else acting[0]
            noted = [(part, j) for part, j in found if not events[j].is_active and part <= last]
            for part, j in noted:
                failure = self.note(integrator, begin, trial, t, size, part, j)
                if failure is not None:
                    return begin, row, work, failure
            if acting is None:
                self.values, self.row = values, row
                return carry, row, work, None
            part, j = acting
            event = events[j]
            if part < 1.0:
                carry, row, _, failure = integrator.advance(
                    self.system, begin, work, t0=t, h=part * size, first=0, n_steps=1, every=1
                )
                if failure is not None:
                    return begin, row, work, failure
            t = t + part * size if event.at is None else event.at
            row = row._replace(t=np.array([t]))
            reached = self.values_after(row)
            for i in (j, *(i for _, i in noted)):  # has passed its level, whatever rounding says
                level = events[i].level_passed
                if (reached[i] - level) * (self.values[i] - level) > 0.0:
                    reached[i] = level
            self.values, self.row = reached, row
            if isinstance(event, StopEvent):
                state = self.strike(integrator, carry, event, t, h)
            else:
                self.add(event, t)
                if event.record and not event.stop:
                    self.recorded.append(row)
                if event.stop:
                    self.has_stopped = True
                    return carry, row, work, None
                state = self.engage(event, carry, t)
            carry, row, work = self.begun_anew(integrator, carry, state, row, t)
            self.row = row
            self.take_inside()
            where, size, number = t, t_end - t, 0
            if size <= 1e-12 * h:
                return carry, row._replace(t=np.array([t_end])), work, None
        words = f"{MOST_IN_A_STEP} events happened in one step: {', '.join(e['name'] for e in self.happened[-3:])}, ..."
        return carry, row, work, Failure(words, np.inf)

    def begun_anew(
        self, integrator: Integrator, carry: Carry, state: State, row: Rows, t: float
    ) -> tuple[Carry, Rows, Work]:
        """Return memory, results and working arrays of the motion that begins at t from a state of the engine.

        The energy that springs bring or take with them is work given; what an impact takes is work taken.
        """
        is_struck = state is not carry.state
        told = state_of_file(compiled_system(self.full), state)
        fresh = integrator.start(self.system, t, told, before=carry)
        before, work_done = row.diagnostics[-1], carry.work
        carry = replace(
            fresh, work=work_done, n_iterations=carry.n_iterations, n_steps=carry.n_steps,
            n_rejected=carry.n_rejected, h_next=0.0,
        )  # fmt: skip
        work = new_work(compiled_system(self.system).model)
        carry, row = integrator.observe(self.system, t, carry, work)
        after = row.diagnostics[-1]
        taken = float(before[KINETIC] - after[KINETIC]) if is_struck else 0.0
        change = np.array([float(after[SPRINGS] - before[SPRINGS]), taken])
        after[WORK_GIVEN] += change[0]
        after[WORK_TAKEN] += change[1]
        return replace(carry, work=work_done + change), row, work

    def engage(self, event: Event, carry: Carry, t: float) -> State:
        """Switch by an event; return the state of the engine with the velocities after it."""
        compiled = compiled_system(self.full)
        couplers = {coupler.name: coupler for coupler in self.full.couplers}
        engaged = [name for name in event.switch_on if name in couplers and name in self.off]
        for name in engaged:
            caught, constant = coupled_sum(compiled, name, carry.w), couplers[name].constant
            if constant is None:
                self.caught[name] = caught
                continue
            wanted = float(constant(t))  # type: ignore[operator]
            if abs(caught - wanted) > SHUT * max(1.0, compiled.length):
                raise ModelError(
                    f"event {event.name!r} at t = {t:g}: coupler {name!r} is to hold {wanted:.6g}, but finds "
                    f"{caught:.6g}; leave its constant out, so that it holds what it catches, or let the event watch it"
                )
        holding = [
            placed
            for placed in compiled.laws
            if placed.element.name in self.off.intersection(event.switch_on)
            and any(each != NOTHING for each in placed.law.holds)
        ]
        self.switch((self.off | set(event.switch_off)) - set(event.switch_on))
        if not engaged and not holding:
            return carry.state
        hit = impact(compiled_system(self.system), carry.state, t=t, known=carry.w, restitution={})
        for placed in holding:
            require_shut(event, placed, hit.gap, t, compiled.length)
        cores = [sum_rows(compiled, name)[2] for name in engaged]
        impulse = {name: float(hit.impulse[k]) for name, k in zip(engaged, cores, strict=True)}
        for placed in holding:
            for name, row in zip(placed.law.multipliers, placed.multipliers, strict=True):
                impulse[f"{placed.element.name}.{name}"] = float(hit.impulse[row])
        self.happened[-1]["impulse"] = impulse
        return hit.state

    def strike(self, integrator: Integrator, carry: Carry, event: StopEvent, t: float, h: float) -> State:
        """Meet a limit, or leave it; return the state of the engine with the velocities after it."""
        self.add(event, t)
        happened = self.happened[-1]
        if event.side == "release":
            del self.resting[event.coupler]
            self.switch(self.off)
            return carry.state
        limits = next(each.limits for each in self.full.couplers if each.name == event.coupler)
        assert limits is not None  # it has events
        _, factors, core = sum_rows(compiled_system(self.full), event.coupler)
        self.resting[event.coupler] = event.side
        self.switch(self.off)
        holding = compiled_system(self.system)
        hit = impact(holding, carry.state, t=t, known=carry.w, restitution={})
        speed = float(hit.rate[core]) * float(np.abs(factors).max())  # rows of couplers have a largest coefficient of 1
        told = state_of_file(compiled_system(self.full), hit.state)
        pressed = INWARD[event.side] * float(integrator.start(self.system, t, told, before=carry).w[core])
        thrown = 2 * limits.restitution * abs(float(hit.impulse[core]))  # pressed by this for the time of the flight
        happened["speed before"], happened["speed after"] = speed, 0.0
        if pressed > 0.0 and thrown <= pressed * h:
            happened["impulse"] = {event.coupler: float(hit.impulse[core])}
            return hit.state
        if limits.restitution > 0.0:
            restitution = {core: limits.restitution}
            hit = impact(holding, carry.state, t=t, known=carry.w, restitution=restitution)
            happened["speed after"] = -limits.restitution * speed
        happened["impulse"] = {event.coupler: float(hit.impulse[core])}
        del self.resting[event.coupler]
        self.switch(self.off)
        return hit.state

    def take_inside(self) -> None:
        """Let limits that are reached, and on which nothing rests, be reached anew by whatever goes beyond them."""
        for j, event in enumerate(self.events):
            if isinstance(event, StopEvent) and event.side in INWARD and event.coupler not in self.resting:
                self.values[j] = just_inside(event, float(self.values[j]))

    def add(self, event: Event, t: float) -> None:
        """Take an event into what has happened."""
        self.happened.append({"name": event.name, "t": t, "stop": event.stop, "switch_on": list(event.switch_on),
                              "switch_off": list(event.switch_off)})  # fmt: skip

    def note(
        self, integrator: Integrator, begin: Carry, trial: Work, t: float, size: float, part: float, j: int
    ) -> Failure | None:
        """Record the results at an event that does not change the motion, by a step to it that leads no further."""
        event = self.events[j]
        _, row, _, failure = integrator.advance(
            self.system, begin, trial, t0=t, h=part * size, first=0, n_steps=1, every=1
        )
        if failure is None:
            self.add(event, t + part * size if event.at is None else event.at)
            self.recorded.append(row if event.at is None else row._replace(t=np.array([event.at])))
        return failure

    def taken(self) -> list[Rows]:
        """Return the results recorded at events since the last call."""
        rows, self.recorded = self.recorded, []
        return rows

    def locate(
        self, integrator: Integrator, begin: Carry, work: Work, t: float, size: float, j: int, last: float
    ) -> float:
        """Return the part of a step after which event j has just happened."""
        event = self.events[j]
        if event.at is not None:
            return (event.at - t) / size
        sign = np.sign(last - event.level) or -np.sign(self.values[j] - event.level)

        def beyond(part: float) -> float:
            if part <= 0.0:
                return float(sign * (self.values[j] - event.level))
            if part >= 1.0:
                return max(float(sign * (last - event.level)), 0.0)
            _, row, _, failure = integrator.advance(
                self.system, begin, work, t0=t, h=part * size, first=0, n_steps=1, every=1
            )
            if failure is not None:
                raise ModelError(f"event {event.name!r}: its time in the step from t = {t:g} was not found")
            return float(sign * (self.values_after(row)[j] - event.level))

        if beyond(1.0) == 0.0:
            return 1.0
        from scipy.optimize import brentq  # slow to import, seldom wanted

        part = float(brentq(beyond, 0.0, 1.0, xtol=event.tolerance, rtol=4 * np.finfo(float).eps))
        while part < 1.0 and beyond(part) < 0.0:
            part = min(1.0, part + event.tolerance)
        return part

    def record(self) -> dict[str, Array]:
        """Return what a run needs to go on."""
        words = json.dumps(
            {"off": sorted(self.off)}
            | {name: getattr(self, name) for name in ("happened", "caught", "resting", "calm")}
        )
        return {"event_values": self.values, "events": np.frombuffer(words.encode(), dtype=np.uint8)}

    def restore(self, record: Mapping[str, Array]) -> None:
        """Go on from a record."""
        data = json.loads(np.asarray(record["events"], dtype=np.uint8).tobytes().decode())
        self.caught, self.resting = data.get("caught", {}), data.get("resting", {})
        self.calm = data.get("calm", BLOCK)
        self.switch(frozenset(data["off"]))
        self.happened = data["happened"]
        self.values = np.array(record["event_values"], dtype=float)


def require_shut(event: Event, placed: PlacedLaw, gap: Array, t: float, length: float) -> None:
    """Raise `ModelError` if an element that is switched on is to hold a position which the motion does not have."""
    for name, row, holds in zip(placed.law.multipliers, placed.multipliers, placed.law.holds, strict=True):
        if holds == POSITION and abs(gap[row]) > SHUT * max(1.0, length):
            raise ModelError(
                f"event {event.name!r} at t = {t:g}: element {placed.element.name!r} is to hold the position of its "
                f"multiplier {name!r}, but finds it open by {gap[row]:.6g}; let the event watch what it holds"
            )
