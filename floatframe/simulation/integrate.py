"""Computation of a motion: start, then steps in compiled batches, which are checked and written.

    (1) start       make bodies consistent; memory of the integrator and results at the start    `Integrator.start`
    (2) step        a batch of steps in one compiled call, cut where laws jump and events happen  `next_steps`
    (3) observe     checks of step size, energy, laws and ranges of validity                      `Run.observe`
    (4) write       results, restart records, and progress                         `Run.keep`, `Run.close_segment`

`resume` begins with the record of an interrupted run in place of (1). The integrator keeps its state between steps in a
`Memory`; results of output times are `Rows`.
"""

import logging
import os
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, fields, replace
from math import ceil
from typing import Any

import numpy as np

from fe_models.foundation.records import checked_fields
from fe_models.foundation.tasks.interrupts import heeded_interrupts
from fe_models.foundation.words import nearest
from floatframe.engine.compiling.callbacks import cost_words, raise_errors_of
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.impulses import words_of_begun_drives
from floatframe.engine.initial_conditions.mass_positivity import indefinite_mass_words, indefinite_masses
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError, ModelError, ResultsError
from floatframe.integrators.integrator import Failure, Integrator, joined_rows
from floatframe.integrators.registry import CLASSES, has_fixed_steps, has_second_order, made_integrator
from floatframe.integrators.relative import in_formulation
from floatframe.model.checked_values import number
from floatframe.model.forces import UserForce
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.head import Head
from floatframe.results.motion import Motion, motion_of
from floatframe.results.results_file import MemorySource, segments_words, validity_text
from floatframe.results.sensors import measured
from floatframe.results.sensors.left_out import left_out_estimates
from floatframe.results.trajectory import Trajectory, read_trajectory
from floatframe.results.validity import ValidityNote, notes_from_json, notes_to_json
from floatframe.results.writer import ResultsPlace, ResultsWriter, last_restart
from floatframe.simulation.energy_watch import EnergyWatch
from floatframe.simulation.event_steps import EventWatch
from floatframe.simulation.events import has_events, require_times_of_events
from floatframe.simulation.jumps import jumps_of_steps, next_steps
from floatframe.simulation.law_watch import LawWatch
from floatframe.simulation.motion_head import head_of, joint_rows
from floatframe.simulation.restart import RESTART_STEPS, memory_of_record, restart_record, system_digest
from floatframe.simulation.sampling import Sampling
from floatframe.simulation.step_advice import step_advice, step_warnings
from floatframe.simulation.step_watch import WATCHES, StepWatch
from floatframe.simulation.validity_watch import ValidityWatch

__all__ = [
    "Progress", "checked_times", "integrate", "number_of_steps", "require_no_units", "require_watch", "resume",
]  # fmt: skip

log = logging.getLogger(__name__)

BATCH_STEPS = 400  #: steps per call of the compiled loop
FIRST_STEPS = 100  #: number of first steps in which a failure may be caused by the start of prescribed motions
LOOK_ROWS, LOOK_SECONDS = 1000, 0.2  #: result rows are checked after this number of rows, or after this time
SEGMENT_SECONDS = 2.0  #: time after which a segment of the results file is closed
TIMES = ("t_start", "t_end", "h", "output_every")  #: attributes of the run in the head of the results
MOST_STEPS = 1e12  #: largest number of steps of a run, which would take months
MOST_OF_RUN = 0.5  #: fraction of the computing time above which calls of a Python function give a warning
LONG_CALLS = 1.0  #: shortest computing time of such calls for a warning [s]
LEFT_OUT_LIMIT = 0.1  #: share of the strain energy that modes may leave out without a note
LEFT_OUT_ADVICE = "reduce it with more modes, or choose them by their error (cms reduce --error 1e-3 --up-to 500Hz)"
#: allowed time difference between the start of a run and the end of the run that it continues, as a fraction of a step
SAME_TIME = 1e-6


@dataclass(frozen=True)
@checked_fields(ModelError)
class Progress:
    """Progress of a run.

    Parameters
    ----------
    t
        Time reached [s].
    t_end
        End of the run [s].
    n_steps
        Number of finished steps.
    n_total
        Number of steps of the whole run.
    n_iterations
        Number of Newton iterations so far.
    notes
        Notes of the run so far.
    n_rejected
        Number of rejected steps so far.
    """

    t: float
    t_end: float
    n_steps: int
    n_total: int
    n_iterations: int
    notes: tuple[ValidityNote, ...] = ()
    n_rejected: int = 0


def integrate(
    system: System,
    integrator: Integrator | type[Integrator] | str,
    t_end: float,
    h: float,
    *,
    t_start: float = 0.0,
    state: State | None = None,
    output: str | os.PathLike[str] | None = None,
    output_every: int = 1,
    batch_steps: int = BATCH_STEPS,
    progress: Callable[[Progress], None] | None = None,
    formulation: str | None = None,
    watch: str = "stop",
) -> Motion:
    """Compute a motion from t_start to t_end.

    Parameters
    ----------
    system
        The system. The given positions and velocities of its bodies are made consistent first.
    integrator
        The method, such as `GeneralizedAlpha(rho_inf=0.8)`. A class, or a name of a system file such as "hht", stands
        for the method with its defaults.
    t_end
        End time [s].
    h
        Step size [s]. If the integrator controls its step, h is the interval of outputs and the largest step. If h does
        not divide the time of the run, it is reduced until one more step fits.
    t_start
        Time at the beginning [s].
    state
        State to begin from, instead of the positions and velocities of the bodies in the system.
    output
        Results file; None keeps the motion in memory.
    output_every
        Number of steps from one written result to the next; the start is always written.
    batch_steps
        Steps per call of the compiled loop; the motion does not depend on it, bit for bit.
    progress
        Called after every batch. An exception that it raises ends the run; closed segments of the results stay.
    formulation
        "absolute", or "relative" for the coordinates of joints (docs/relative.md), with results of the same form; None:
        the formulation of the integrator.
    watch
        If the steps cause an error of 3 % in the motion, or add 5 % to its energy, `validity` of the motion and the log
        report it. "stop": the run also ends when half of its energy comes from its steps. "tell": it continues. "off":
        no checks.

    Returns
    -------
    Motion
        The motion; with `output` its arrays are read from the file when they are used.

    Raises
    ------
    ModelError
        If an argument or the system is impossible.
    ConvergenceError
        If a step fails, or half of the energy comes from the steps; its attribute `trajectory` is the motion so far.
    ResultsError
        If the results cannot be written.
    """
    require_watch(watch)
    t_start, t_end, h = checked_times(t_start, t_end, h)
    integrator = in_formulation(made_integrator(integrator), formulation)
    if output_every < 1 or batch_steps < 1:
        raise ModelError(
            f"integrate: expected output_every and batch_steps of at least 1, got {output_every} and {batch_steps}"
        )
    require_no_units(system)
    n_total = number_of_steps(t_start, t_end, h)
    step = (t_end - t_start) / n_total
    sampling = Sampling.of(system, t_start, step, n_total)
    system = system if sampling is None else sampling.system
    if abs(step - h) > 1e-9 * h:
        log.info("h = %g does not divide the time from %g to %g: h = %.9g is used", h, t_start, t_end, step)
    warnings = step_warnings(system, t_start, step, n_total, has_steps_of_one_size=has_fixed_steps(integrator))
    for _, words in warnings:
        log.warning("system %r: %s", system.name, words)
    acting = [ValidityNote.of_law(kind, words, t_start) for kind, words in warnings if kind != "modes"]
    head = head_of(system, integrator, t_start, t_end, step, output_every)
    head = replace(head, angles=compiled_system(system).angles, run=dict(head.run) | {"watch": watch})
    events = EventWatch(system, head) if has_events(system) else None
    require_times_of_events(system, t_start)
    begun = system if events is None else events.system
    with ExitStack() as held:  # reserves the location of the results during the computation
        place = None if output is None else held.enter_context(ResultsPlace(output, inputs=system.files))
        memory = integrator.start(begun, t_start, state)  # (1)
        run = Run(
            system, integrator, head, t_start, t_end, step, n_total, output_every,
            writer=None, notes=tuple(acting), events=events, sampling=sampling,
        )  # fmt: skip
        run.words_of_start = lambda: words_of_begun_drives(begun, t_start, state, step)
        memory, rows = run.begin(memory, 0)
        if sampling is not None and sampling.sample(0, rows, head):
            memory, rows = integrator.after_jump(run.acting, t_start, memory, run.work)
        require_sensors(system, head, rows)
        run.writer = None if place is None else ResultsWriter(place, head)
        run.steps.begin(memory.state)
        run.continue_from(state)
        run.energy.observe(system, rows, is_switched=False)
        run.keep(rows)
        run.close_segment(run.record(memory, 0))
        raise_if_interrupted = held.enter_context(heeded_interrupts())
        return run.advance(memory, 0, batch_steps, progress, raise_if_interrupted)


def require_no_units(system: System) -> None:
    """Raise `ModelError` if a system has units of other programs, which a run without them would ignore."""
    if system.fmus:
        names = ", ".join(unit.name for unit in system.fmus)
        raise ModelError(
            f"system {system.name!r} is coupled to units of other programs (fmus: {names}): use floatframe run, or "
            "floatframe.files.co_simulate in place of integrate; such a run cannot be resumed"
        )


def require_watch(watch: str) -> None:
    """Raise `ModelError` unless this is a kind of checks of the steps."""
    if watch not in WATCHES:
        raise ModelError(
            f"integrate: watch: expected one of {', '.join(WATCHES)}, got {watch!r}{nearest(watch, WATCHES)}"
        )


def checked_times(t_start: float, t_end: float, h: float) -> tuple[float, float, float]:
    """Return start, end and step of a run as numbers; `ModelError` if there is no such run."""
    t_start, t_end = number("integrate: t_start", t_start), number("integrate: t_end", t_end)
    h = number("integrate: h", h, above=0.0)
    if t_end <= t_start:
        raise ModelError(f"integrate: expected t_end above t_start = {t_start:g}, got {t_end:g}")
    if h > (t_end - t_start) * (1 + 1e-9):
        raise ModelError(
            f"integrate: h: expected at most the time from {t_start:g} to t_end = {t_end:g}, got {h:g}; "
            f"are t_end and h swapped?"
        )
    return t_start, t_end, h


def number_of_steps(t_start: float, t_end: float, h: float) -> int:
    """Return the number of steps from t_start to t_end; `ModelError` if it is too large for any computer."""
    wanted = (t_end - t_start) / h
    if not wanted <= MOST_STEPS:
        raise ModelError(
            f"integrate: the run from t = {t_start:g} to {t_end:g} with h = {h:g} has {wanted:.1e} steps, expected at "
            f"most {MOST_STEPS:.0e}; choose an earlier t_end or a larger h"
        )
    return max(1, ceil(wanted * (1 - 1e-12) - 1e-9))


def require_sensors(system: System, head: Head, rows: Rows) -> None:
    """Raise `ModelError` or `ResultsError` before the run if a sensor cannot measure the initial state."""
    if system.sensors:
        told = rows_of_file(compiled_system(system), rows)
        measured(system, Trajectory(head, MemorySource(joint_rows(system, [told])), is_complete=False))


def resume(
    system: System,
    output: str | os.PathLike[str],
    *,
    progress: Callable[[Progress], None] | None = None,
) -> Motion:
    """Resume an interrupted run; the motion is bitwise the same as without the interruption.

    Parameters
    ----------
    system
        The system that was run.
    output
        The results file that the run was to write; its segments are in the same folder.
    progress
        As in `integrate`.

    Raises
    ------
    ResultsError
        If there is nothing to resume, or the segments are those of another system.
    ConvergenceError
        If a step fails.
    """
    require_no_units(system)
    with ResultsPlace(output, inputs=system.files, is_begun=True) as place:
        head, record = last_restart(place.folder)
        run = dict(head.run)
        kind = CLASSES.get(str(run.get("integrator")))
        if kind is None or any(name not in run for name in (*TIMES, *(part.name for part in fields(kind)))):
            raise ResultsError(f"{output}: another version of this program made the interrupted run; run it anew")
        integrator = kind(**{part.name: run[part.name] for part in fields(kind)})
        n_total = round((run["t_end"] - run["t_start"]) / run["h"])
        sampling = Sampling.of(system, run["t_start"], run["h"], n_total)
        system = system if sampling is None else sampling.system
        if run.get("digest") != system_digest(system, integrator):
            raise ResultsError(
                f"{output}: the interrupted run was of another system than {system.name!r}, or the system or this "
                "program has changed since; resume it with the files and version with which it began, or run it anew"
            )
        if record is None:
            raise ResultsError(f"{output}: the interrupted run has no restart record; run it anew")
        memory, n_done = memory_of_record(record, system)
        if sampling is not None:
            sampling.restore(record)
        watch = EventWatch(system, head) if has_events(system) else None
        if watch is not None:
            watch.restore(record)
        writer = ResultsWriter(place, head, goes_on=True)
        again = Run(
            system, integrator, head, run["t_start"], run["t_end"], run["h"], n_total, run["output_every"], writer,
            notes=notes_from_json(validity_text(place.folder)),
            seconds_before=float(record.get("seconds", 0.0)),
            events=watch,
            sampling=sampling,
        )  # fmt: skip
        if again.left_out:
            again.take_left_out(read_trajectory(place.folder))
        again.steps.restore(record, again.notes)
        again.energy.restore(record, again.notes)
        again.begin(memory, n_done)
        with heeded_interrupts() as raise_if_interrupted:
            return again.advance(memory, n_done, BATCH_STEPS, progress, raise_if_interrupted)


@dataclass
class Run:
    """A motion that is being computed, and the destination of its results."""

    system: System
    integrator: Integrator
    head: Head
    t_start: float
    t_end: float
    h: float
    n_total: int
    output_every: int
    writer: ResultsWriter | None
    notes: tuple[ValidityNote, ...] = ()  #: notes from before the run, or from the completed part of a resumed run
    kept: list[Rows] = field(default_factory=list)
    seconds_before: float = 0.0  #: computing time before an interruption
    began: float = field(default_factory=time.perf_counter)
    events: EventWatch | None = None
    sampling: Sampling | None = None
    words_of_start: Callable[[], str] = lambda: ""  #: returns the possible cause of a failure in the first steps
    jumps: dict[int, list[float]] = field(init=False)  #: times of force jumps by step; set by `advance`
    work: Work = field(init=False)  #: working arrays of the kernels; set by `begin`

    @property
    def seconds(self) -> float:
        """Computing time of the run so far [s]."""
        return self.seconds_before + time.perf_counter() - self.began

    def record(self, memory: Memory, n_done: int) -> dict[str, np.ndarray]:
        """Return the data to resume the run from its present state."""
        self.report(*self.energy.flush(self.system))
        events = {} if self.events is None else self.events.record()
        watches = self.steps.record() | self.energy.record()
        samples = {} if self.sampling is None else self.sampling.record()
        return restart_record(memory, n_done) | {"seconds": np.array(self.seconds)} | events | watches | samples

    def record_where_due(self, memory: Memory, n_done: int) -> dict[str, np.ndarray] | None:
        """Return the data to resume the run here, or None if runs cannot be resumed after this step."""
        return self.record(memory, n_done) if self.writer is not None and n_done % RESTART_STEPS == 0 else None

    def summary(self, memory: Memory) -> dict[str, Any]:
        """Return the counters and computing times of the run, and its events."""
        events = {} if self.events is None else {"events": self.events.happened}
        samples = {} if self.sampling is None else {"controllers": self.sampling.summary()}
        found = {each.body: {"share": each.share, "t": each.t_largest} for each in (s.result() for s in self.left_out)}
        return (
            events
            | samples
            | ({"left_out": found} if found else {})
            | self.watched()
            | {name: int(getattr(memory, name)) for name in ("n_steps", "n_rejected", "n_iterations")}
            | {"wall_time": self.seconds}
        )

    def continue_from(self, state: State | None) -> None:
        """Add the errors of the run that ended at this state, if the present run continues it in time."""
        if state is None:
            return
        self.steps.is_piece = True
        watched = {} if state.watched is None else state.watched
        is_next = abs(watched.get("t", np.inf) - self.t_start) <= SAME_TIME * self.h
        if is_next and len(watched.get("r", state.r.ravel())) == state.r.size:
            self.steps.continue_from(watched)
            self.energy.continue_from(watched)

    def watched(self) -> dict[str, dict[str, Any]]:
        """Return the errors up to the end of the run, for a run that continues it."""
        if self.watching == "off":
            return {}
        t = self.t_start + self.n_total * self.h
        if self.events is not None and self.events.has_stopped:
            t = self.events.happened[-1]["t"]
        found: dict[str, Any] = {"t": t, "n_steps": self.steps.n_before + self.n_total}
        return {"watched": found | self.steps.passed_on() | self.energy.passed_on()}

    def __post_init__(self) -> None:
        self.watch = ValidityWatch(self.system, self.notes)
        self.watching = str(self.head.run.get("watch", "off"))
        is_on = self.watching != "off" and has_second_order(self.integrator)
        self.steps = StepWatch(self.integrator, self.n_total, is_on)
        self.energy = EnergyWatch(self.output_every, self.h)
        self.closed = self.looked = time.monotonic()  # time of the last segment, and of the last check of rows
        self.waiting: list[Rows] = []
        self.left_out = left_out_estimates(self.system, self.h * self.output_every)

    def keep(self, rows: Rows) -> None:
        """Collect result rows, because one check of many rows costs as much as a check of a few."""
        if len(rows.t):
            self.waiting.append(rows)
        if sum(len(each.t) for each in self.waiting) >= LOOK_ROWS or time.monotonic() - self.looked > LOOK_SECONDS:
            self.look()

    def look(self) -> None:
        """Write and check the collected rows; report a body that leaves the range of its linear frame."""
        self.looked = time.monotonic()
        if self.writer is not None:
            self.writer.validity = notes_to_json(self.watch.notes)
        if not self.waiting:
            return
        rows, self.waiting = joined_rows(self.waiting), []
        for note in self.watch.observe(rows):
            log.warning("%s", note.words)
        told = rows_of_file(compiled_system(self.system), rows)
        if self.left_out:
            self.take_left_out(Trajectory(self.head, MemorySource(joint_rows(self.system, [told])), is_complete=False))
        if self.writer is None:
            self.kept.append(told)
        else:
            self.writer.validity = notes_to_json(self.watch.notes)
            self.writer.append(told)

    def take_left_out(self, trajectory: Trajectory) -> None:
        """Pass outputs to the estimates of what modes left out."""
        for estimate in self.left_out:
            estimate.take(trajectory)

    def report_left_out(self) -> None:
        """Store and log a note for each body whose modes left out too much of its strain energy."""
        for estimate in self.left_out:
            found = estimate.result()
            if found.share > LEFT_OUT_LIMIT:
                t_first = float(found.t[np.argmax(found.shares > LEFT_OUT_LIMIT)])
                note = ValidityNote(
                    found.body, "left out", LEFT_OUT_LIMIT, found.share, t_first, found.t_largest,
                    advice=LEFT_OUT_ADVICE,
                )  # fmt: skip
                self.watch.found[note.key] = note
                log.warning("system %r: %s", self.system.name, note.words)
        if self.writer is not None:
            self.writer.validity = notes_to_json(self.watch.notes)

    def report(self, *new: ValidityNote | None) -> None:
        """Store the notes about step size and energy, and log new ones."""
        found = [] if self.steps.note is None else [self.steps.note]
        for each in (*found, *self.energy.notes.values()):
            self.watch.found[each.key] = each
        for note in (each for each in new if each is not None):
            log.warning("system %r: %s", self.system.name, note.words)

    def close_segment(self, record: dict[str, np.ndarray] | None = None) -> None:
        """Close a segment of the results, if they are written to a file, with the data to resume from."""
        self.look()
        self.closed = time.monotonic()
        if self.writer is not None:
            self.writer.close_segment(record)

    def begin(self, memory: Memory, n_done: int) -> tuple[Memory, Rows]:
        """Evaluate the motion where the run starts or is resumed; store the iterate and the first results."""
        self.work = new_work(compiled_system(self.acting).model) if self.events is None else self.events.new_work()
        memory, rows = self.integrator.observe(self.acting, self.t_start + n_done * self.h, memory, self.work)
        if self.events is not None:
            self.events.begin(rows)
        return memory, rows

    def advance(
        self,
        memory: Memory,
        n_done: int,
        batch_steps: int,
        progress: Callable[[Progress], None] | None,
        raise_if_interrupted: Callable[[], None],
    ) -> Motion:
        """Take the remaining steps in batches that end where a run can be resumed; return the motion."""
        self.jumps = self.steps.jumps = jumps_of_steps(self.system, self.t_start, self.h, self.n_total)
        laws = LawWatch(self.system, self.t_start, self.h, self.jumps, n_done)
        n_told = n_done  # steps at the last progress report
        failure: Failure | None = None
        safe = self.record_where_due(memory, n_done)  # made now: during a block, events are later than the memory
        try:
            while n_done < self.n_total:
                raise_if_interrupted()
                if n_done % RESTART_STEPS == 0:
                    self.work.solver.c_k[...] = 0.0  # factors are renewed, as after a resumption
                    if n_done and time.monotonic() - self.closed > SEGMENT_SECONDS:
                        self.close_segment(safe)
                batch = self.sampled(self.step(memory, n_done, batch_steps - (n_done - n_told), batch_steps))  # (2)
                memory, failure, n_done = batch.end, batch.failure, batch.n_done
                self.keep(batch.rows)
                self.observe(batch, laws)  # (3)
                safe = self.record_where_due(memory, n_done)  # (4)
                is_over = n_done == self.n_total or failure is not None or batch.has_stopped or self.is_beyond
                if is_over:
                    self.report(self.steps.conclude(self.acting, memory, n_done, self.t_start, self.h))
                    self.look()
                is_due = n_done % RESTART_STEPS == 0 or n_done - n_told >= batch_steps or n_done == self.n_total
                if is_due or not batch.n_good or self.events is not None:
                    n_told = n_done
                    if progress is not None:
                        progress(self.progress(memory, n_done))
                if is_over:
                    break
        except BaseException:
            self.close_segment(safe)
            raise
        for each in (self.system, self.acting):
            raise_errors_of(compiled_system(each).callbacks)
        if failure is not None:
            begins = self.words_of_start() if n_done < FIRST_STEPS else ""
            if begins:
                failure = replace(failure, words=f"{failure.words}; {begins}")
            raise stopped(self, failure, self.t_start + n_done * self.h, memory.state)
        if self.is_beyond:
            raise energetic(self, self.t_start + n_done * self.h)
        return self.finished(memory)

    def step(self, memory: Memory, first: int, n_left: int, batch_steps: int) -> "Batch":
        """Take at most `n_left` steps, up to the next check, the end of the run, or new factors.

        The watch divides batches of `batch_steps` further, but does not move their ends.
        """
        n_steps = min(n_left, self.steps.room(first, batch_steps), self.n_total - first)
        n_steps = min(n_steps, RESTART_STEPS - first % RESTART_STEPS)
        n_steps = n_steps if self.sampling is None else min(n_steps, self.sampling.room(first))
        n_happened = self.n_happened
        starts_companion = self.steps.has_companion and self.steps.companion is None
        before = self.events.copied() if self.events is not None and starts_companion else None
        end, rows, self.work, n_good, failure = next_steps(
            self.integrator, self.acting, memory, self.work, t0=self.t_start, h=self.h, first=first, n_steps=n_steps,
            every=self.output_every, jumps=self.jumps, events=self.events,
        )  # fmt: skip
        if self.events is not None:
            rows = in_order([*self.events.taken(), rows])
        has_stopped = self.events is not None and self.events.has_stopped
        return Batch(first, n_good, memory, end, rows, failure, before, self.n_happened > n_happened, has_stopped)

    def sampled(self, batch: "Batch") -> "Batch":
        """Call the controllers that are due at the end of a batch; return it with their outputs there."""
        n_done = batch.n_done
        if self.sampling is None or not batch.n_good or batch.failure is not None or n_done == self.n_total:
            return batch
        if not self.sampling.is_due(n_done):
            return batch
        t = self.t_start + n_done * self.h
        end, row = self.integrator.observe(self.acting, t, batch.end, self.work)
        if not self.sampling.sample(n_done, row, self.head):
            return batch
        self.jumps.setdefault(n_done - 1, []).append(t)  # for companions of the run
        end, row = self.integrator.after_jump(self.acting, t, batch.end, self.work)
        rows = batch.rows
        if n_done % self.output_every == 0:
            rows = joined_rows([Rows(*(array[:-1] for array in rows)), row])
        return replace(batch, end=end, rows=rows)

    def observe(self, batch: "Batch", laws: LawWatch) -> None:
        """Pass a batch to the checks and report their notes."""
        is_last = batch.n_done >= self.n_total or batch.failure is not None or batch.has_stopped
        if self.watching != "off":
            found = self.energy.observe(self.system, batch.rows, is_switched=batch.is_switched, is_last=is_last)
            self.report(*found)
        if batch.n_good and batch.failure is None and not batch.has_stopped:
            note = self.steps.take(
                self.acting, batch.begin, batch.end, t0=self.t_start, h=self.h, first=batch.first,
                n_steps=batch.n_good, events=batch.events_before,
                is_cut=batch.is_switched or batch.first in self.jumps or batch.n_done - 1 in self.jumps,
            )  # fmt: skip
            self.report(note)
        else:
            self.steps.skip(self.h)
        if self.watching != "off" and batch.failure is None:
            is_last = batch.n_done == self.n_total or batch.has_stopped
            for words in laws.observe(batch.end, batch.n_done, is_last=is_last):
                note = ValidityNote.of_law("law", words, self.t_start + batch.n_done * self.h)
                self.watch.found[note.key] = note
                log.warning("system %r: %s", self.system.name, words)

    def progress(self, memory: Memory, n_done: int) -> Progress:
        """Return the progress of the run."""
        t, counts = self.t_start + n_done * self.h, (int(memory.n_iterations), self.watch.notes, int(memory.n_rejected))
        return Progress(t, self.t_end, n_done, self.n_total, *counts)

    @property
    def is_beyond(self) -> bool:
        """Whether half of the energy comes from time steps, so that the run must stop."""
        return self.watching == "stop" and self.energy.is_beyond

    @property
    def acting(self) -> System:
        """The system with its present switches."""
        return self.system if self.events is None else self.events.system

    @property
    def n_happened(self) -> int:
        """Number of past events."""
        return 0 if self.events is None else len(self.events.happened)

    def close_segment_when_due(self) -> None:
        """Close a segment of the results without data to resume from, if the last segment is old enough."""
        if time.monotonic() - self.closed > SEGMENT_SECONDS:
            self.close_segment()

    def report_costs(self) -> None:
        """Log whether user functions were compiled and how long their calls took; warn if they dominate the time."""
        forces = [force.name for force in self.system.forces if isinstance(force, UserForce) and force.function]
        for callback in compiled_system(self.acting).callbacks:
            if callback.name in [f"force {name!r}" for name in forces]:
                is_most = callback.seconds > max(MOST_OF_RUN * (self.seconds - self.seconds_before), LONG_CALLS)
                log.log(logging.WARNING if is_most else logging.INFO, "%s", cost_words(callback))
        for each in () if self.sampling is None else self.sampling.sampled:
            log.info("%s", each.cost_words())

    def finished(self, memory: Memory) -> Motion:
        """Return the motion after all its steps have been stored."""
        self.look()
        self.report_left_out()
        self.report_costs()
        if self.writer is None:
            head = replace(self.head, summary=self.summary(memory))
            arrays = MemorySource(joint_rows(self.system, self.kept))
            return Motion(head, arrays, is_complete=True, validity=self.watch.notes, known=self.system)
        self.writer.finish(self.summary(memory))
        return motion_of(read_trajectory(self.writer.path), self.system)


@dataclass(frozen=True, eq=False)
class Batch:
    """Steps of a run that were taken in one call."""

    first: int  #: number of steps done before the batch
    n_good: int  #: number of successful steps in the batch
    begin: Memory
    end: Memory
    rows: Rows  #: results at output times and events in the batch
    failure: Failure | None  #: reason why the next step failed, or None
    events_before: EventWatch | None  #: copy of the events before the batch, if a companion run begins there
    is_switched: bool  #: whether events happened in the batch
    has_stopped: bool  #: whether an event ended the run

    @property
    def n_done(self) -> int:
        """Number of steps done after the batch."""
        return self.first + self.n_good


def in_order(parts: list[Rows]) -> Rows:
    """Return result rows in ascending time; at equal times the row of the earlier part comes first."""
    if len(parts) == 1:
        return parts[0]
    rows = joined_rows(parts)
    order = np.argsort(rows.t, kind="stable")
    return Rows(*(array[order] for array in rows))


def stopped(run: Run, failure: Failure, t: float, state: State) -> ConvergenceError:
    """Return the error for a failed step, with the motion so far."""
    words = f"system {run.system.name!r}: the step of {run.h:g} from t = {t:.9g} failed: {failure.words}"
    advice = step_advice(run.system, run.h)
    if advice is not None:
        words += f"; {advice.words}"
    words += "".join(f"; {note.words}" for note in run.watch.notes)
    lost = indefinite_mass_words(indefinite_masses(run.system, state))
    words += f"; {lost}" if lost else ""
    trajectory, where = motion_so_far(run)
    return ConvergenceError(words + where, t=t, h=run.h, residual=failure.residual, trajectory=trajectory)


def energetic(run: Run, t: float) -> ConvergenceError:
    """Return the error for a run that ends because its steps add energy, with the motion so far."""
    words = (
        f"system {run.system.name!r}: stopped at t = {t:.9g} with steps of {run.h:g}: "
        f"{run.energy.notes['energy'].words}; "
        'watch = "tell" continues nevertheless'
    )
    trajectory, where = motion_so_far(run)
    return ConvergenceError(words + where, t=t, h=run.h, residual=float("inf"), trajectory=trajectory)


def motion_so_far(run: Run) -> tuple[Motion, str]:
    """Return the motion of a run that ends early, and the location of its file for messages ("" if in memory)."""
    if run.writer is None:
        arrays = MemorySource(joint_rows(run.system, run.kept))
        return Motion(run.head, arrays, is_complete=False, validity=run.watch.notes, known=run.system), ""
    run.writer.close_segment()
    return motion_of(read_trajectory(run.writer.folder), run.system), f"; {segments_words(run.writer.folder)}"
