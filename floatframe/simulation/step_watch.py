"""Estimate the discretisation error of a run by repeating parts of it with another step size.

It works for second-order methods, with fixed steps and with an error tolerance:

(1) A companion is the same motion with steps twice as long (or an error tolerance eight times as large). It costs half
    a step for each step of the run. The run and the companion differ by three times the error of the run, including the
    amplification or damping of earlier errors by the motion.
(2) A companion with half steps starts from the same memory and replaces the first one if the error of (1) or (6)
    exceeds `SCREEN` of the limit, if the long steps fail, or if a flexible body turns by `FAR_TURN` in a step. It
    differs from the run by 3/4 of the error. Only its estimate is reported. If it begins with the run, it has little
    numerical damping (`LIGHT`): the run may damp vibrations that its steps do not resolve, and a companion with equal
    damping would not show their effect on the motion.
    The estimate is valid for errors of second order. The companion with double steps therefore continues beside the one
    with half steps. If, at the same damping, the difference from the run falls by less than a factor of four from
    double to half steps (vibrations of much energy that no step resolves), the estimate uses the observed ratio, at
    most `MOST_RATIO`. If double steps fail, it uses `UNKNOWN_RATIO`. If the error is between `SCREEN` of the limit and
    the limit, and the ratio is outside `ORDINARY`, half steps may agree with the run by chance. Then quarter steps from
    the same memory decide, with half steps beside them.
(3) The companion covers `COMPANION_STEPS` steps. It crosses jumps of forces and has its own events. In a run of more
    than `LONG_RUN` steps it starts after the first steps, from their memory, and ends as soon as the error,
    extrapolated in proportion to the time up to the end of the run, is far below the limit.
(4) After that, windows of `WINDOW` steps are repeated with half steps. The distance between windows grows. The errors
    of all steps are summed; steps between two windows get the mean error of both.
(5) Position errors are relative to the longest displacement of any body from its start. Rotation errors are relative to
    the largest rotation; if the sum of this rotation and its error is below `SMALL_TURN`, they are relative to the
    displacement divided by the length of the system. Windows also count the errors of speeds, relative to twice the
    largest speed (a vibration moves by two amplitudes). An error a of position and an error b of speed combine to
    sqrt(a² + b²), because a vibration turns one into the other.
(6) If accelerations change much in the first step, this step alone is compared with two half steps of the same damping:
    a stiff spring with a damper settles before the comparisons of (1), although the first step may be wrong by the
    whole sag. While companions run, steps in which a force jumps, and the steps after them, are compared likewise, in
    runs without events.

(7) A run that continues another one in time (`State.watched`) is a piece of one motion. Its errors are relative to the
    motion since the start of the first run. If a companion reached the end of the previous run, the error of the last
    state is passed on, and the companions of this run begin with it, as if they had run since the beginning, with the
    shortest steps that were needed before. Other errors of earlier pieces are added.

A companion restarts where a run can be resumed, and its error up to there is added. These sums, and the sum over
windows, do not include the effect of the motion on earlier errors: it may damp them or magnify them (chaos).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Memory
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import FloatframeError, ResultsError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.integrators.integrator import Integrator, has_divided_steps, started_anew
from floatframe.integrators.registry import has_fixed_steps
from floatframe.integrators.relative import RelativeGeneralizedAlpha
from floatframe.model.rotations import (
    euler_parameter_product,
    euler_parameters_of_rotation_vector,
    rotations_between,
)
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.validity import ValidityNote
from floatframe.simulation.event_steps import EventWatch
from floatframe.simulation.jumps import jumps_by_step, next_steps
from floatframe.simulation.restart import RESTART_STEPS

__all__ = ["FIRST_VERDICT", "WATCHES", "StepWatch"]

#: "stop": end a run that gains half of its energy from its steps; "tell": only report; "off": do not watch
WATCHES = ("stop", "tell", "off")
COMPANION_STEPS = 400  #: number of steps that companions cover
LONG_RUN = 1000  #: number of steps of a run above which companions may cover fewer
LEAST_COMPANION_STEPS = 64  #: smallest number of steps that companions cover in long runs
SMALL_SHARE = 0.05  #: fraction of the error limit below which an extrapolated error lets a companion end early
FIRST_CHECK = 4  #: number of steps before the first comparison, and smallest number between two comparisons
CHECK_INTERVAL = 8  #: in short runs, the number of covered steps divided by the steps between two comparisons
MOST_BETWEEN_CHECKS = 128  #: largest number of steps between two comparisons in long runs
WINDOW = 4  #: number of steps in a window, which must be even
WINDOW_GROWTH = 4  #: factor by which the distance between windows grows
MOST_BETWEEN_WINDOWS = 16380  #: largest number of steps between two windows
FIRST_VERDICT = 20  #: number of steps before the first verdict, because a shorter motion gives errors no scale
STEP_LIMIT = 0.03  #: relative error above which a run is reported
#: the same limit for runs shorter than `FIRST_CHECK` steps, or than `FIRST_VERDICT` from a state with unknown history
SHORT_LIMIT = 0.01
REST_LENGTH = 1e-7  #: displacement, relative to the length of the system, below which the system is at rest
REST_ANGLE = 1e-6  #: rotation below which the system is at rest [rad]
#: rotation plus its error below which rotation errors are ignored in a motion as long as the system [rad]
SMALL_TURN = 1e-3
FAR_TURN = 1.0  #: rotation of a flexible body in a step above which double steps give no estimate [rad]
LIGHT = 0.9  #: smallest rho_inf of companions with half steps that begin with the run
FULL_TURN = 3.0  #: rotation above which rotation errors are relative to a full turn [rad]
#: fraction of the limit above which half steps decide, because double steps may be outside the asymptotic range
SCREEN = 0.25
AIM = 0.2  #: share of the limit that the recommended step would reach
DOUBLES, HALVES, QUARTERS = 2.0, 0.5, 0.25  #: step size of a companion relative to the run
#: factor from the difference of run and companion to the error of the run
ERROR_SHARE = {ratio: 1 / (1 - ratio**2) for ratio in (DOUBLES, HALVES, QUARTERS)}
#: range of the ratio of differences, half to double steps, that counts as second order (exactly: 1/4)
ORDINARY = (1 / 6, 3 / 8)
MOST_RATIO = 2 / 3  #: largest ratio of differences, half to double steps, from which an error is estimated
UNKNOWN_RATIO = 1 / 2  #: ratio used if double steps fail, which belongs to errors of first order


#: counters that a record contains
COUNTS = ("next_window", "window_distance", "n_watched", "n_companion_steps", "companions_done", "n_before", "is_piece",
          "ratio")  # fmt: skip


@dataclass
class Companion:
    """The motion with another step size, started from a memory of the run."""

    integrator: Integrator
    begin: Memory  #: memory of the run from which the companion started
    start: int  #: number of run steps before the companion started
    ratio: float  #: step size of the companion relative to the run
    at: int  #: number of run steps that the companion has reached
    memory: Memory  #: memory of the companion
    work: Work  #: working arrays of the companion
    error: Array  #: position and rotation errors of the run at the last comparison, (n_b, 2, 3)
    before: int  #: number of run steps at the previous comparison
    error_before: Array  #: error at the previous comparison, (n_b, 2, 3)
    peak: Array  #: largest position and rotation errors so far, (n_b, 2)
    run: Memory  #: memory of the run at the last comparison
    error_at_begin: Array  #: position and rotation errors of the run where the companion started, (n_b, 2)
    events: EventWatch | None  #: events of the companion
    events_at_begin: EventWatch | None  #: events of the run where the companion started
    share: float  #: factor from the difference of run and companion to the error of the run

    @classmethod
    def begun(
        cls, integrator: Integrator, memory: Memory, work: Work, start: int, ratio: float, h: float = 0.0,
        events: EventWatch | None = None, is_light: bool = False,
    ) -> "Companion":  # fmt: skip
        """Return a companion that starts from the run's memory after `start` steps.

        h: fixed step size of the run, from which the step changes to that of the companion without a new start; 0: not
        fixed. events: events of the run after `start` steps, if it has any; the companion gets a copy with working
        arrays. is_light: whether to use the numerical damping of `LIGHT` if it is less than that of the run.
        """
        none = np.zeros((len(memory.r), 2, 3))
        method, begin, share = integrator_of(integrator, ratio), memory, ERROR_SHARE[ratio]
        if is_light:
            method, share = lighter(method, ratio)
        if h and memory.h and isinstance(method, GeneralizedAlpha | RelativeGeneralizedAlpha) and method.h_min is None:
            method, begin = replace(method, h_min=h), memory.changed(h_next=ratio * h)  # without a new start
        own = None if events is None else events.copied()
        if own is not None:
            work = own.new_work()
        work.solver.c_k[...] = 0.0  # a resumed run has no factors of other steps
        peak = lengths(none)
        return cls(
            method, memory, start, ratio, start, begin, work, none, start, none, peak, memory, peak, own, events, share
        )

    def begin_apart(self, system: System, t: float, error: Array) -> None:
        """Shift the start by the error of the run at t, as if this companion had run until then; see `error_of`."""
        apart = moved(self.begin, -error / self.share)
        acting = system if self.events is None else self.events.system
        self.memory, _ = started_anew(self.integrator, acting, t, apart, self.work)
        self.error = self.error_before = error[: self.error.size].reshape(self.error.shape)
        self.peak = self.error_at_begin = lengths(self.error)

    def follow(
        self, system: System, end: Memory, last: int, t0: float, h: float, jumps: Mapping[int, list[float]]
    ) -> bool:
        """Advance to run step `last` and compare with the run's memory `end`; return whether the steps converged.

        jumps: times at which forces jump, by run step.
        """
        begin, size = t0 + self.start * h, self.ratio * h
        done, until = round((self.at - self.start) / self.ratio), round((last - self.start) / self.ratio)
        ahead = [t for k, times in jumps.items() if self.at <= k < last for t in times]
        memory, own_jumps = self.memory, jumps_by_step(ahead, begin, size)
        try:
            while done < until:
                memory, _, self.work, n_good, failure = next_steps(
                    self.integrator, system if self.events is None else self.events.system, memory, self.work, t0=begin,
                    h=size, first=done, n_steps=until - done, every=until + 1, jumps=own_jumps, events=self.events,
                )  # fmt: skip
                done += n_good
                if failure is not None or (self.events is not None and self.events.has_stopped):
                    return False
        except FloatframeError:
            return False
        self.memory, self.before, self.error_before, self.at, self.run = memory, self.at, self.error, last, end
        self.error = self.share * difference(end, memory)
        self.peak = np.maximum(self.peak, lengths(self.error))
        return True

    def last_error(self) -> Array:
        """Return the error of the run's state at the last comparison; see `error_of`."""
        return np.asarray(self.share * error_of(self.run, self.memory))

    @property
    def is_light(self) -> bool:
        """Whether the companion has less numerical damping than the run."""
        return self.share != ERROR_SHARE[self.ratio]

    def speeds(self, h: float) -> Array:
        """Return the mean errors of speed between the last two comparisons, (n_b, 2)."""
        return lengths(self.error - self.error_before) / (h * max(1, self.at - self.before))


@dataclass
class StepWatch:
    """Estimate of the discretisation error of a run, first by companions, later by windows."""

    integrator: Integrator
    n_total: int  #: number of steps of the run
    is_on: bool = True
    n_before: int = 0  #: number of steps of earlier runs that this one continues
    is_piece: bool = False  #: whether the run starts from a state with unknown errors
    #: position and rotation errors of the first step, or of a step with a jump, that are not yet summed, (n_b, 2)
    first_error: Array | float = 0.0
    error: Array | None = None  #: error of the initial state of the run, not included in `total`; see `error_of`
    n_companion_steps: int = 0  #: number of steps that companions have covered
    companions_done: bool = False  #: whether only windows follow, without companions
    companion: Companion | None = None
    coarse: Companion | None = None  #: companion with double or fourfold step size, beside a companion with short steps
    coarse_fails: bool = False  #: whether the coarse companion cannot compute the motion
    ratio: float = DOUBLES  #: initial step size of companions relative to the run
    next_window: int = 0  #: step at which the next window starts
    window_distance: int = 0  #: number of steps between the last window and the next
    n_watched: int = 0  #: number of steps whose errors are summed
    #: errors per step in the last companion or window: position and rotation, and their speeds, (n_b, 2, 2)
    error_per_step: Array | None = None
    #: sum of the errors of position and rotation, and of their speeds, (n_b, 2, 2)
    total: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    #: error of the last state, and `total` without it, if a companion reached the end of the run
    at_end: tuple[Array, Array] | None = None
    initial_state: State | None = None  #: state at the start of the run
    #: largest displacement and rotation of any body, and twice the largest speeds, (2, 2)
    size: Array = field(default_factory=lambda: np.zeros((2, 2)))
    turn: Array = field(default_factory=lambda: np.zeros(0))  #: largest rotation of each body in a step, (n_b,) [rad]
    note: ValidityNote | None = None
    open_window: list[tuple[int, Memory]] = field(
        default_factory=list
    )  #: step and memory at the start and middle of a window
    kept_work: tuple[System, Work] | None = None  #: working arrays of companions and windows
    jumps: Mapping[int, list[float]] = field(default_factory=dict)  #: times at which forces jump, by step

    def begin(self, state: State) -> None:
        """Take the initial state of a run."""
        n = len(state.r)
        self.initial_state, self.total, self.turn = state, np.zeros((n, 2, 2)), np.zeros(n)

    def passed_on(self) -> dict[str, list[float]]:
        """Return the data that a run which continues this one needs."""
        if not self.is_on or self.initial_state is None:
            return {}
        first, error, total = self.initial_state, np.zeros(0), self.total
        if self.at_end is not None:
            error, total = self.at_end
        arrays = {"errors": total, "size": self.size, "r": first.r, "p": first.p, "error": error,
                  "ratio": np.array([self.ratio])}  # fmt: skip
        return {name: [float(x) for x in array.ravel()] for name, array in arrays.items()}

    def continue_from(self, watched: Mapping[str, Any]) -> None:
        """Assess the run together with the run that it continues as one motion."""
        self.n_before, self.is_piece = int(watched["n_steps"]), False
        if not self.is_on or "errors" not in watched:
            return
        assert self.initial_state is not None
        shapes = {"errors": self.total.shape, "size": (2, 2), "r": self.initial_state.r.shape,
                  "p": self.initial_state.p.shape}  # fmt: skip
        self.total, self.size, r, p = (np.reshape(watched[name], shape) for name, shape in shapes.items())
        self.initial_state = replace(self.initial_state, r=r, p=p)
        (self.ratio,) = watched.get("ratio", [DOUBLES])
        if len(watched.get("error", ())):
            self.error = np.array(watched["error"], dtype=float)
            if self.is_long:  # its companion begins later
                self.add_error_at_begin()

    def add_error_at_begin(self) -> None:
        """Add the error of the initial state to the sum."""
        assert self.error is not None
        total = self.total.copy()
        total[:, :, 0] += lengths(self.error[: 6 * len(total)].reshape(-1, 2, 3))
        self.total, self.error = total, None

    @property
    def limit(self) -> float:
        """Relative error above which a note about the run is made."""
        is_short = self.n_before + self.n_total < (FIRST_VERDICT if self.is_piece else FIRST_CHECK)
        return SHORT_LIMIT if is_short else STEP_LIMIT

    def is_judged(self, n_done: int) -> bool:
        """Whether the motion up to step n_done is long enough for relative errors."""
        return self.n_before + n_done >= FIRST_VERDICT

    @property
    def is_long(self) -> bool:
        """Whether companions cover only part of the first steps, because the run is long."""
        return self.n_total > LONG_RUN

    @property
    def has_companion(self) -> bool:
        """Whether a companion covers the next steps."""
        return self.is_on and not self.companions_done

    def is_window(self, n_done: int) -> bool:
        """Whether the step after n_done belongs to a window; windows do not contain restart points."""
        if self.has_companion or not self.is_on or n_done < self.next_window:
            return False
        return bool(self.open_window) or n_done % RESTART_STEPS <= RESTART_STEPS - WINDOW

    def room(self, n_done: int, most: int) -> int:
        """Return the number of steps after n_done up to the next comparison, half window or window."""
        if self.has_companion:
            if n_done < 2:
                return 1 if n_done == 0 else FIRST_CHECK - 1
            gone = 0 if self.companion is None else n_done - self.companion.start
            if not self.is_comparable(n_done) or self.follows_jump(n_done):
                return 1
            if self.is_long:
                n = min(max(FIRST_CHECK, gone), MOST_BETWEEN_CHECKS)
            else:
                n = max(FIRST_CHECK, gone // CHECK_INTERVAL // 2 * 2)
            n = next((k for k in range(1, n) if self.follows_jump(n_done + k)), n)
            n_left = self.n_total - n_done
            return n if n < n_left or self.is_comparable(self.n_total) else max(1, n_left // 2 * 2)
        if self.is_window(n_done):
            return WINDOW // 2
        return min(most, self.next_window - n_done) if self.is_on and n_done < self.next_window else most

    def is_comparable(self, n_done: int) -> bool:
        """Whether a step of the companion ends together with step n_done of the run."""
        return self.companion is None or self.companion.ratio < 1.0 or (n_done - self.companion.start) % 2 == 0

    def take(
        self, system: System, begin: Memory, end: Memory, *, t0: float, h: float, first: int, n_steps: int,
        events: EventWatch | None = None, is_cut: bool = False,
    ) -> ValidityNote | None:  # fmt: skip
        """Take the memories before and after n_steps steps of the run; return a note if it is new.

        events: events of the run before these steps, needed if a companion starts with these steps. is_cut: whether a
        force jumps or an event switches something within these steps.
        """
        last = first + n_steps
        if self.has_companion:
            has_jump = self.follows_jump(first) and self.companion is not None and self.companion.events is None
            if n_steps == 1 and (first == 0 or has_jump) and self.may_err_at_once(system, begin, end, h):
                work = new_work(compiled_system(system).model) if first else self.work_arrays(system)
                halves = Companion.begun(self.integrator, begin, work, first, HALVES, events=events)
                if halves.follow(system, end, last, t0, h, self.jumps):
                    self.first_error = np.maximum(self.first_error, halves.peak)
                    self.update_size(begin, end, h)
            if self.companion is None and self.is_long and (begin.h == 0.0 or first < FIRST_CHECK):
                return None
            return self.compare(system, begin, end, t0, h, first, last, events)
        if is_cut:
            self.open_window = []
            return None
        if not self.is_window(first):
            return None
        if not self.open_window:
            self.open_window = [(first, begin), (last, end)]
            return None
        return self.close_window(system, end, last, t0, h)

    def follows_jump(self, n_done: int) -> bool:
        """Whether a force jumps in the step after n_done, or in the step before it, or between them."""
        return n_done in self.jumps or n_done - 1 in self.jumps

    def may_err_at_once(self, system: System, begin: Memory, end: Memory, h: float) -> bool:
        """Whether the first step alone may have a relevant error, judged by its change of accelerations.

        If they change by c, positions may be wrong by h² c/2. Motions that a step does not resolve change them fully.
        """
        u0 = compiled_system(system).model.bodies.u0[:-1, None] + np.arange(6)
        change = lengths((end.u_dot - begin.u_dot)[u0].reshape(-1, 2, 3)).max(axis=0)
        way = lengths(difference(end, begin)).max(axis=0)
        return bool((h**2 / 2 * change > SCREEN * self.limit * way).any())

    def skip(self, h: float) -> None:
        """Close companion and window before a step that fails or in which an event ends the run."""
        self.open_window = []
        self.close_companion(h)

    def compare(
        self, system: System, begin: Memory, end: Memory, t0: float, h: float, first: int, last: int,
        events: EventWatch | None,
    ) -> ValidityNote | None:  # fmt: skip
        """Compare the run after step `last` with the companion; return a note if it is new."""
        if self.companion is None:
            self.add_unwatched_steps(first, self.error_per_step)
            is_fixed = not has_divided_steps(compiled_system(system).model) and has_fixed_steps(self.integrator)
            self.companion = self.moved_companion(system, t0, Companion.begun(
                self.integrator, begin, self.work_arrays(system), first, DOUBLES, h if is_fixed else 0.0, events
            ))  # fmt: skip
            self.coarse_fails = False
            while self.companion.ratio > self.ratio:
                self.refined(system, t0, self.companion)
        other = self.companion
        if self.is_comparable(last):
            self.update_size(begin, end, h * (last - first))
            self.turn = np.maximum(self.turn, turns_in_a_step(system, end, h))
            if not self.follow(system, other, end, last, t0, h):  # the error found so far still counts
                self.close_companion(h)
                self.companions_done, self.next_window = True, last
                return self.new_note(system, t0 + last * h, h) if self.is_judged(last) else None
            other = self.companion
        is_due = self.is_judged(last) and last >= min(self.n_total, COMPANION_STEPS) // 2
        note = self.new_note(system, t0 + last * h, h) if is_due else None
        if is_due and self.note is None and self.is_doubtful(system, other):
            quarters = self.refined(system, t0, other)
            if quarters.follow(system, end, last, t0, h, self.jumps):
                other, note = quarters, self.new_note(system, t0 + last * h, h)
            else:
                self.companion, self.coarse, self.coarse_fails = other, None, True
        is_over = self.n_companion_steps + last - other.start >= COMPANION_STEPS or self.note is not None
        if self.is_long and last >= LEAST_COMPANION_STEPS:  # errors of phase grow in proportion to time
            expected = float(self.relative_errors(system, other.peak).max()) * self.n_total / last
            is_over = is_over or expected < SMALL_SHARE * self.limit
        if is_over or last % RESTART_STEPS == 0:
            self.close_companion(h)
        if is_over:
            self.companions_done = True
            self.window_distance = (WINDOW_GROWTH - 1 if self.is_long else 1) * max(last, WINDOW)
            self.next_window = last + self.window_distance
        return note

    def turns_far(self, system: System) -> bool:
        """Whether a flexible body has rotated by more than `FAR_TURN` in a step."""
        is_flexible = np.diff(compiled_system(system).model.bodies.q0) > 0
        return bool((self.turn[is_flexible] > FAR_TURN).any())

    def follow(self, system: System, other: Companion, end: Memory, last: int, t0: float, h: float) -> bool:
        """Advance the companions to run step `last` and replace failed ones; return whether the steps converged."""
        is_far = self.turns_far(system)
        is_good = not (is_far and other.ratio == DOUBLES) and other.follow(system, end, last, t0, h, self.jumps)
        if self.coarse is not None and (last - other.start) % 2 == 0:
            is_fit = not (is_far and self.coarse.ratio == DOUBLES)
            if not (is_fit and self.coarse.follow(system, end, last, t0, h, self.jumps)):
                self.coarse, self.coarse_fails = None, True
        found = np.maximum(other.peak, self.first_error)  # half steps may have found an error that double steps miss
        is_small = is_good and self.relative_errors(system, found).max() < SCREEN * self.limit
        if other.ratio == DOUBLES and not is_small:
            doubles_fail, other = not is_good, self.refined(system, t0, other)
            if doubles_fail:
                self.coarse, self.coarse_fails = None, True
            is_good = other.follow(system, end, last, t0, h, self.jumps)
        if not is_good and other.is_light:  # the steps may fail because of the smaller damping
            damped = self.with_steps(other.ratio, system, t0, other, is_light=False)
            is_good = damped.follow(system, end, last, t0, h, self.jumps)
            self.companion = damped if is_good else other
        return is_good

    def refined(self, system: System, t0: float, coarse: Companion) -> Companion:
        """Start a companion with shorter steps from the same start; the present one continues beside it."""
        self.coarse, self.kept_work = coarse, None  # each has its own working arrays
        self.ratio = HALVES if coarse.ratio == DOUBLES else QUARTERS
        is_light = coarse.ratio == DOUBLES or coarse.is_light
        self.companion = self.with_steps(self.ratio, system, t0, coarse, is_light=is_light)
        return self.companion

    def is_doubtful(self, system: System, halves: Companion) -> bool:
        """Whether the error from half steps is relevant compared with the limit, but not of second order."""
        if halves.ratio != HALVES:
            return False
        found = halves.peak * by_observed_order(halves, self.coarse, self.coarse_fails)
        counts = self.relative_errors(system, found) > SCREEN * self.limit
        if self.coarse is None:
            return self.coarse_fails and bool(counts.any())
        ratio = ratio_of_differences(halves, self.coarse)
        return bool((counts & ((ratio < ORDINARY[0]) | (ratio > ORDINARY[1]))).any())

    def with_steps(
        self, ratio: float, system: System, t0: float, other: Companion, *, is_light: bool = True
    ) -> Companion:
        """Return a companion with the given step size ratio that starts where another companion started.

        is_light: whether to use little numerical damping, if the companion begins with the run. (Later memories of the
        run contain the damping of its method.)
        """
        return self.moved_companion(system, t0, Companion.begun(
            self.integrator, other.begin, self.work_arrays(system), other.start, ratio, events=other.events_at_begin,
            is_light=is_light and other.begin.h == 0.0,
        ))  # fmt: skip

    def moved_companion(self, system: System, t0: float, other: Companion) -> Companion:
        """Return a companion whose start includes the error of the run, if it starts at the beginning of the run."""
        if self.error is not None and other.start == 0:
            try:
                other.begin_apart(system, t0, self.error)
            except FloatframeError:  # there is no consistent state with this error
                self.add_error_at_begin()
        return other

    def close_companion(self, h: float) -> Array | None:
        """Remove the companion and add its error to the sum; return the error, or None if there is none."""
        other, self.companion = self.companion, None
        coarse, self.coarse = self.coarse, None
        if other is None or other.at == other.start:  # only the error of the first step is known, and it counts
            first = np.zeros_like(self.total)
            first[:, :, 0] = self.first_error
            self.total, self.first_error = self.total + first, 0.0
            return None
        factors = by_observed_order(other, coarse, self.coarse_fails)
        found = np.stack([other.peak, other.speeds(h)], axis=2) * factors[:, :, None]
        grown = found.copy()
        grown[:, :, 0] = np.maximum(found[:, :, 0] - other.error_at_begin, 0.0)
        self.error_per_step = grown / (other.at - other.start)
        found[:, :, 0] = np.maximum(found[:, :, 0], self.first_error)
        self.total, self.first_error = self.total + found, 0.0
        self.error = None
        self.n_companion_steps += other.at - other.start
        self.n_watched = other.at
        return found

    def add_unwatched_steps(self, step: int, rate: Array | None) -> None:
        """Add the error of the steps before `step` that no companion or window covered, from an error per step."""
        if rate is not None:
            self.total = self.total + max(0, step - self.n_watched) * rate
        self.n_watched = max(step, self.n_watched)

    def work_arrays(self, system: System) -> Work:
        """Return working arrays for companions and windows."""
        if self.kept_work is None or self.kept_work[0] is not system:
            self.kept_work = system, new_work(compiled_system(system).model)
        return self.kept_work[1]

    def close_window(self, system: System, end: Memory, last: int, t0: float, h: float) -> ValidityNote | None:
        """Repeat the window up to the memory `end` with half steps; return a note if it is new."""
        (start, before), (middle, half) = self.open_window
        self.open_window = []
        self.window_distance = min(WINDOW_GROWTH * self.window_distance, MOST_BETWEEN_WINDOWS)
        self.next_window = last + self.window_distance
        other = Companion.begun(self.integrator, before, self.work_arrays(system), start, HALVES)
        for number, coarse in ((middle, half), (last, end)):
            if number > other.at and not other.follow(system, coarse, number, t0, h, {}):
                return None
        size = np.stack([lengths(other.error), other.speeds(h)], axis=2)
        rate = size / (last - start)
        self.add_unwatched_steps(start, rate if self.error_per_step is None else (self.error_per_step + rate) / 2)
        self.total = self.total + size
        self.error_per_step, self.n_watched = rate, last
        self.turn = np.maximum(self.turn, turns_in_a_step(system, end, h))
        begun, then = (middle, half) if last > middle else (start, before)
        self.update_size(then, end, h * (last - begun))
        return self.new_note(system, t0 + last * h, h) if self.is_judged(last) else None

    def update_size(self, half: Memory, end: Memory, seconds: float) -> None:
        """Update the largest displacements, rotations and speeds from two memories that are `seconds` apart."""
        assert self.initial_state is not None
        way = lengths(difference(end, self.initial_state)).max(axis=0)
        if way[1] > FULL_TURN:
            way[1] = 2 * np.pi
        speed = lengths(difference(end, half)).max(axis=0) / seconds
        self.size = np.maximum(self.size, np.stack([way, 2 * speed], axis=1))

    def conclude(self, system: System, end: Memory, n_done: int, t0: float, h: float) -> ValidityNote | None:
        """Add the errors up to the end of the run; return a note if it is new."""
        if self.open_window and self.open_window[1][0] == n_done:
            note = self.close_window(system, end, n_done, t0, h)
            if note is not None:
                return note
        other = self.companion
        if other is not None and other.at < n_done < FIRST_VERDICT:  # a run of few steps ends within a double step
            halves = self.with_steps(HALVES, system, t0, other, is_light=False)
            if halves.follow(system, end, n_done, t0, h, self.jumps):
                self.update_size(halves.begin, end, h * (n_done - halves.start))
                self.companion = other = halves
        found = self.close_companion(h)
        if self.error_per_step is None and not self.total.any():
            return None
        self.add_unwatched_steps(n_done, self.error_per_step)
        if other is not None and found is not None:
            self.at_end = other.last_error(), self.total - found
        return self.new_note(system, t0 + n_done * h, h)

    def relative_errors(self, system: System, found: Array | None = None) -> Array:
        """Return the relative position and rotation errors of each body, including those of a companion, (n_b, 2)."""
        compiled = compiled_system(system)
        least = np.array([REST_LENGTH * compiled.length, REST_ANGLE])
        size, total = self.size.copy(), self.total
        if found is not None:
            total = total.copy()
            total[:, :, 0] += found
        largest_turn = size[1, 0] + total[:, 1, 0].max()  # largest rotation that the exact motion may have
        if largest_turn < SMALL_TURN * min(size[0, 0] / compiled.length, 1.0):
            size[1] = np.maximum(size[1], size[0] / compiled.length)
        moves = size[:, 0] > least
        parts = total / np.where(size > 0.0, size, np.inf)
        return np.where(moves, np.linalg.norm(parts, axis=2), 0.0)

    def new_note(self, system: System, t: float, h: float) -> ValidityNote | None:
        """Update the note with the present error; return it if it is new."""
        companion = self.companion
        if companion is not None and companion.ratio == DOUBLES:
            return None
        found = None
        if companion is not None:
            factors = by_observed_order(companion, self.coarse, self.coarse_fails)
            found = np.maximum(companion.peak * factors, self.first_error)
        share = self.relative_errors(system, found)
        i = int(np.argmax(share.max(axis=1)))
        largest, limit = float(share[i].max()), self.limit
        if not largest > limit:
            return None
        if self.note is not None:
            self.note = self.note.with_value(largest, t)
            return None
        turn = f"it turns by up to {self.turn[i]:.2g} rad in a step; " if self.turn[i] > 0.1 else ""
        finer = h * np.sqrt(AIM * limit / largest)
        advice = f"take a step of about {finer:.1g}"
        tolerance = getattr(self.integrator, "error_tolerance", None)
        if tolerance is not None:
            finer = tolerance * (AIM * limit / largest) ** 1.5
            advice = f"take an error_tolerance of about {finer:.1g}"
        self.note = ValidityNote(
            compiled_system(system).body_names[i], "steps", limit, largest, t, t, advice=turn + advice
        )
        return self.note

    def record(self) -> dict[str, Array]:
        """Return the data for a resumed run by name; nothing if the watch is off."""
        if not self.is_on or self.initial_state is None:
            return {}
        rate = np.full_like(self.total, np.nan) if self.error_per_step is None else self.error_per_step
        return {
            "watch_counts": np.array([getattr(self, name) for name in COUNTS]), "watch_rate": rate,
            "watch_error": np.zeros(0) if self.error is None else self.error,
            "watch_total": self.total, "watch_size": self.size, "watch_turn": self.turn,
            **{f"watch_{name}": np.asarray(getattr(self.initial_state, name)) for name in ("r", "p", "q", "u")},
        }  # fmt: skip

    def restore(self, record: Mapping[str, Array], notes: tuple[ValidityNote, ...]) -> None:
        """Restore the data of an interrupted run from its record and notes."""
        if not self.is_on:
            return
        try:
            for name, count in zip(COUNTS, record["watch_counts"], strict=True):
                setattr(self, name, type(getattr(self, name))(count))
            arrays = [
                np.array(record[f"watch_{name}"], dtype=float)
                for name in ("rate", "total", "size", "turn", "error", "r", "p", "q", "u")
            ]
        except (KeyError, ValueError) as error:
            raise ResultsError("restart: the record has no data of the step watch; run it anew") from error
        rate, self.total, self.size, self.turn, apart = arrays[:5]
        self.error = apart if apart.size else None
        self.error_per_step, self.initial_state = None if np.isnan(rate).any() else rate, State(*arrays[5:])
        self.note = next((note for note in notes if note.kind == "steps"), None)


def integrator_of(integrator: Integrator, ratio: float) -> Integrator:
    """Return the method for another step size; ratio: new step size divided by the original one."""
    tolerance = getattr(integrator, "error_tolerance", None)
    if tolerance is None:
        return integrator
    return replace(integrator, error_tolerance=tolerance * ratio**3)  # type: ignore[type-var]


def lighter(integrator: Integrator, ratio: float) -> tuple[Integrator, float]:
    """Return the method with the numerical damping of `LIGHT` if its own is larger, and its error factor.

    The phase error of generalized-alpha in a period is c(rho_inf) (omega h)², with c as in the code.
    """
    if not isinstance(integrator, GeneralizedAlpha | RelativeGeneralizedAlpha):
        return integrator, ERROR_SHARE[ratio]
    is_other = integrator.parameters is not None or integrator.error_tolerance is not None
    if is_other or integrator.rho_inf >= LIGHT:
        return integrator, ERROR_SHARE[ratio]
    own, light = (1 / 12 + 3 / 8 * ((1 - rho) / (1 + rho)) ** 2 for rho in (integrator.rho_inf, LIGHT))
    return replace(integrator, rho_inf=LIGHT), own / (own - light * ratio**2)


def ratio_of_differences(other: Companion, coarse: Companion) -> Array:
    """Return the further change by finer steps divided by the change by the coarse steps, (n_b, 2)."""
    fine, before = other.peak / abs(other.share), coarse.peak / abs(coarse.share)
    more = fine - before if coarse.ratio < 1.0 else fine
    return np.asarray(np.maximum(more, 0.0) / np.where(before > 0.0, before, np.inf))


def by_observed_order(other: Companion, coarse: Companion | None, coarse_fails: bool) -> Array:
    """Return the factor by which errors exceed the second-order estimate of a companion, (n_b, 2).

    If the changes due to shorter and shorter steps form a geometric series of ratio x, the changes after the last one
    add up to x/(1 - x) times the last. If double steps fail, the order is unknown and taken as first.
    """
    none = np.ones(other.peak.shape)
    if other.ratio == DOUBLES or (other.ratio == HALVES and other.is_light):
        return none
    if coarse is None:
        return none * (1 / (1 - UNKNOWN_RATIO) / ERROR_SHARE[HALVES] if coarse_fails and other.ratio == HALVES else 1.0)
    fine = other.peak / other.share
    last = fine - coarse.peak / coarse.share if coarse.ratio < 1.0 else fine
    ratio = np.clip(ratio_of_differences(other, coarse), 0.25, MOST_RATIO)
    found = fine + np.maximum(last, 0.0) * ratio / (1 - ratio)
    return np.asarray(found / np.where(other.peak > 0.0, other.peak, np.inf))


def lengths(vectors: Array) -> Array:
    """Return the lengths of vectors along the last axis."""
    return np.sqrt((vectors**2).sum(axis=-1))


def difference(memory: Memory, other: Memory | State) -> Array:
    """Return differences of positions and rotation vectors between orientations, (n_b, 2, 3) [m, rad]."""
    apart = np.empty((len(memory.r), 2, 3))
    apart[:, 0], apart[:, 1] = memory.r - other.r, rotations_between(memory.p, other.p)
    return apart


def error_of(memory: Memory, other: Memory) -> Array:
    """Return the difference of two states: positions and orientations (n_b, 2, 3), modal coordinates, velocities."""
    apart = difference(memory, other)
    return np.concatenate([apart.ravel(), memory.q - other.q, memory.u - other.u])


def moved(memory: Memory, apart: Array) -> Memory:
    """Return the memory with its state changed by a difference; see `error_of`."""
    n_b, n_q = len(memory.r), len(memory.q)
    of_bodies, q, u = np.split(apart, [6 * n_b, 6 * n_b + n_q])
    way, theta = of_bodies.reshape(n_b, 2, 3).transpose(1, 0, 2)
    p = euler_parameter_product(memory.p, euler_parameters_of_rotation_vector(theta))
    return memory.changed(r=memory.r + way, p=p, q=memory.q + q, u=memory.u + u)


def turns_in_a_step(system: System, memory: Memory, h: float) -> Array:
    """Return the rotation of each body in a step of size h, (n_b,) [rad]."""
    u0 = compiled_system(system).model.bodies.u0[:-1]
    return h * np.linalg.norm(memory.u[u0[:, None] + np.arange(3, 6)], axis=1)
