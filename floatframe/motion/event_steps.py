"""Steps with events: values watched at both ends of a step, and the step refined to where one passes its level."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.file_frames import rows_of_file, state_of_file
from floatframe.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.integrators.carry import Carry, Failure, Integrator
from floatframe.kernels.memory import Rows
from floatframe.kernels.work import Work, new_work
from floatframe.motion.events import Event, events_of, off_at_start, require_events, with_forces_off
from floatframe.results.head import Head
from floatframe.results.results_file import MemorySource
from floatframe.results.sensors import sensor_of
from floatframe.results.trajectory import Trajectory
from floatframe.results.writer import arrays_of
from floatframe.system import System

__all__ = ["EventWatch"]

SPRINGS, WORK = 3, 10  #: columns of `Rows.diagnostics`
MOST_IN_A_STEP = 100  #: events in one step; more mean that events switch each other without end


@dataclass
class EventWatch:
    """The events of a run: what is watched, which forces are off, and what has happened."""

    full: System  #: with all forces
    head: Head
    system: System = field(init=False)  #: with some off
    off: frozenset[str] = field(init=False)
    values: Array = field(init=False)  #: of the events at the last time, angles without jumps, (n_events,)
    row: Rows | None = field(init=False, default=None)  #: results at the last time
    happened: list[dict[str, Any]] = field(default_factory=list)
    recorded: list[Rows] = field(default_factory=list)  #: results at events since they were last taken
    has_stopped: bool = False

    def __post_init__(self) -> None:
        require_events(self.full)
        self.switch(off_at_start(events_of(self.full)))
        self.values = np.zeros(len(events_of(self.full)))

    def switch(self, off: frozenset[str]) -> None:
        """Take these forces off, all others on."""
        self.off = off
        self.system = with_forces_off(self.full, off)

    def begin(self, row: Rows) -> None:
        """Take the results at the time from which steps go on."""
        is_first = self.row is None
        self.row = row
        if is_first and not self.happened:
            self.values = self.measured(row, row)[0]

    def measured(self, before: Rows, after: Rows) -> Array:
        """Return what each event watches at two times, (2, n_events)."""
        compiled = compiled_system(self.full)
        arrays = arrays_of([rows_of_file(compiled, row) for row in (before, after)])
        arrays["drift"] = arrays["drift"][:, : len(self.head.joints)]
        motion = Trajectory(self.head, MemorySource(arrays), is_complete=False)
        columns = []
        for event in events_of(self.full):
            if event.at is not None:
                columns.append(motion.t)
                continue
            found = sensor_of(self.full, event.watch).measure(self.full, motion).columns
            name = event.column or next(iter(found))
            if name not in found:
                raise ModelError(f"event {event.name!r}: column: expected one of {', '.join(found)}, got {name!r}")
            columns.append(found[name])
        return np.array(columns).T

    def values_after(self, row: Rows) -> Array:
        """Return what is watched at a later time."""
        assert self.row is not None
        return np.asarray(self.measured(self.row, row)[1])

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
            events = events_of(self.full)
            passed = [j for j, e in enumerate(events) if e.happens(float(self.values[j]), float(values[j]))]
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
            self.add(event, t)
            if event.record and not event.stop:
                self.recorded.append(row)
            if event.stop:
                self.has_stopped = True
                return carry, row, work, None
            self.switch((self.off | set(event.switch_off)) - set(event.switch_on))
            told = state_of_file(compiled_system(self.full), carry.state)
            fresh = integrator.start(self.system, t, told, before=carry)
            stored, work_done = float(row.diagnostics[-1, SPRINGS]), carry.work
            carry = replace(
                fresh, work=work_done, n_iterations=carry.n_iterations, n_steps=carry.n_steps,
                n_rejected=carry.n_rejected, h_next=0.0,
            )  # fmt: skip
            work = new_work(compiled_system(self.system).model)
            carry, row = integrator.observe(self.system, t, carry, work)
            gained = float(row.diagnostics[-1, SPRINGS]) - stored  # energy that springs bring or take with them
            carry = replace(carry, work=work_done + np.array([gained, 0.0]))
            row.diagnostics[-1, WORK] += gained
            self.row = row
            where, size, number = t, t_end - t, 0
            if size <= 1e-12 * h:
                return carry, row._replace(t=np.array([t_end])), work, None
        words = f"{MOST_IN_A_STEP} events happened in one step: {', '.join(e['name'] for e in self.happened[-3:])}, ..."
        return carry, row, work, Failure(words, np.inf)

    def add(self, event: Event, t: float) -> None:
        """Take an event into what has happened."""
        self.happened.append({"name": event.name, "t": t, "stop": event.stop, "switch_on": list(event.switch_on),
                              "switch_off": list(event.switch_off)})  # fmt: skip

    def note(
        self, integrator: Integrator, begin: Carry, trial: Work, t: float, size: float, part: float, j: int
    ) -> Failure | None:
        """Record the results at an event that does not change the motion, by a step to it that leads no further."""
        event = events_of(self.full)[j]
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
        event = events_of(self.full)[j]
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
        words = json.dumps({"off": sorted(self.off), "happened": self.happened})
        return {"event_values": self.values, "events": np.frombuffer(words.encode(), dtype=np.uint8)}

    def restore(self, record: Mapping[str, Array]) -> None:
        """Go on from a record."""
        data = json.loads(np.asarray(record["events"], dtype=np.uint8).tobytes().decode())
        self.switch(frozenset(data["off"]))
        self.happened = data["happened"]
        self.values = np.array(record["event_values"], dtype=float)
