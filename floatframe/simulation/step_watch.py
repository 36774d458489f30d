"""Watches the steps of a run: how far they put the motion off, by the same motion in steps of another size beside it.

For methods of second order, with steps of one size and with steps that an error tolerance controls:

(1) a run begins with a companion: the same motion in steps twice as long (a tolerance eight times as large), which
    costs half a step for each. What it differs by is three times the error of the run, growth and decay of errors
    along the motion included
(2) where that is above the limit, or the long steps fail, a companion in halves of the steps takes all of them again,
    and goes on instead: it differs by 3/4 of the error, and alone decides what is told
(3) the companion goes along for `BESIDE` steps, over jumps of forces and with events of its own. In a run of more than
    `LONG` it begins after the first of them, without a start of its own, and ends where the error, drawn out to the end
    of the run in proportion, is far below the limit
(4) afterwards windows of `WINDOW` steps, farther and farther apart, are taken again in halves from the same memory, and
    the errors of the steps are summed; between two windows a step has the mean of theirs
(5) errors of place are measured by the farthest way of a body from its start, rotations likewise, or by the way over
    the length of the system where that is more. In windows those of speed count as well, by twice the largest speed
    (a vibration goes two amplitudes away); both make one number, sqrt(a² + b²), as they turn into one another

A companion begins anew where a run can be resumed; the errors before it are added. What errors become that windows sum
is not known: a motion may forget them (damping) or magnify them (chaos).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import FloatframeError, ResultsError
from floatframe.integrators import has_fixed_steps
from floatframe.integrators.carry import Carry, Integrator, has_divided_steps
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.integrators.relative import RelativeGeneralizedAlpha
from floatframe.model.rotations import rotations_between
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.validity import ValidityNote
from floatframe.simulation.event_steps import EventWatch
from floatframe.simulation.jumps import jumps_by_step, next_steps
from floatframe.simulation.restart import RESTART_STEPS

__all__ = ["FIRST_VERDICT", "WATCHES", "StepWatch"]

#: what is done with what is found: end a run half of whose energy comes from its steps; tell alone; do not look for it
WATCHES = ("stop", "tell", "off")
BESIDE = 400  #: steps beside which a companion goes
LONG = 1000  #: steps of a run above which it may do with less
CALM_STEPS = 64  #: after so many steps a companion may stop, in runs of more than `LONG`
CALM = 0.05  #: of the limit, below which the error drawn out to the end of the run is far below it
FIRST_CHECK = 4  #: steps before a companion is compared, and at least between two comparisons
CHECKS = 8  #: and this part of the steps that it has gone
FEW_CHECKS = 128  #: most steps between two comparisons in runs of more than `LONG`
WINDOW = 4  #: steps that are taken again in halves, an even number
GROWTH = 4  #: steps between two windows over those between the two before
FARTHEST = 16380  #: most steps between two windows
FIRST_VERDICT = 20  #: steps before which a motion has gone too short a way to measure errors by
STEP_LIMIT = 0.03  #: estimated error of the motion above which a run tells
SHORT_LIMIT = 0.01  #: the same of a run of less steps than that: it may be a piece of a motion in which errors add up
LEAST_WAY = 1e-7  #: of the length of the system: shorter ones are rest
LEAST_TURN = 1e-6  #: rad, likewise
FULL_TURN = 3.0  #: rad: a body that turns so far is measured by a whole turn
SCREEN = 0.25  #: of the limit, above which steps in halves decide: one in doubles may be too far off to measure by
AIM = 0.2  #: of the limit, that the step which is advised would reach
DOUBLES, HALVES = 2.0, 0.5  #: size of steps of a companion over those of the run
SHARE_OF_ERROR = {DOUBLES: 1 / 3, HALVES: 4 / 3}  #: error of the run over what both differ by: 1/(2² - 1), 1/(1 - 1/2²)


@dataclass
class Companion:
    """The same motion from one memory on in steps of another size."""

    integrator: Integrator
    begin: Carry  #: memory of the run from which it began
    start: int  #: step after which
    ratio: float  #: size of its steps over that of the run
    at: int  #: step after which it is
    carry: Carry  #: its memory there
    work: Work  #: its working arrays
    apart: Array  #: error of the run there, (n_b, 2, 3)
    before: int  #: the comparison before: step
    apart_before: Array  #: and error
    peak: Array  #: largest error, of place and rotation, (n_b, 2)
    events: EventWatch | None  #: its events
    events_at_begin: EventWatch | None  #: those of the run at its beginning

    @classmethod
    def begun(
        cls, integrator: Integrator, carry: Carry, work: Work, start: int, ratio: float, h: float = 0.0,
        events: EventWatch | None = None,
    ) -> "Companion":  # fmt: skip
        """Begin from a memory after step `start`; h: of fixed steps, which become longer as divided ones do.

        events: of the run at that step; the companion takes working arrays for its own.
        """
        none = np.zeros((len(carry.state.r), 2, 3))
        method, begin = integrator_of(integrator, ratio), carry
        if h and carry.h and isinstance(method, GeneralizedAlpha | RelativeGeneralizedAlpha) and method.h_min is None:
            method, begin = replace(method, h_min=h), replace(carry, h_next=ratio * h)  # no start of its own
        own = None if events is None else events.copied()
        if own is not None:
            work = own.new_work()
        work.solver.c_k[...] = 0.0  # without the factors of other steps, which a resumed run would not have
        peak = lengths(none)
        return cls(method, carry, start, ratio, start, begin, work, none, start, none, peak, own, events)

    def follow(
        self, system: System, end: Carry, last: int, t0: float, h: float, jumps: Mapping[int, list[float]]
    ) -> bool:
        """Go on to the step after which the run has memory `end`; return whether its steps succeed.

        jumps: times at which forces jump, by the step of the run.
        """
        begin, size = t0 + self.start * h, self.ratio * h
        done, until = round((self.at - self.start) / self.ratio), round((last - self.start) / self.ratio)
        ahead = [t for k, times in jumps.items() if self.at <= k < last for t in times]
        carry, own_jumps = self.carry, jumps_by_step(ahead, begin, size)
        try:
            while done < until:
                carry, _, self.work, n_good, failure = next_steps(
                    self.integrator, system if self.events is None else self.events.system, carry, self.work, t0=begin,
                    h=size, first=done, n_steps=until - done, every=until + 1, jumps=own_jumps, events=self.events,
                )  # fmt: skip
                done += n_good
                if failure is not None or (self.events is not None and self.events.has_stopped):
                    return False
        except FloatframeError:
            return False
        self.carry, self.before, self.apart_before, self.at = carry, self.at, self.apart, last
        self.apart = SHARE_OF_ERROR[self.ratio] * difference(end.state, carry.state)
        self.peak = np.maximum(self.peak, lengths(self.apart))
        return True

    def speeds(self, h: float) -> Array:
        """Return the errors of the speeds between the last two comparisons, (n_b, 2)."""
        return lengths(self.apart - self.apart_before) / (h * max(1, self.at - self.before))


@dataclass
class StepWatch:
    """The error of the steps of a run, by companions at first and by windows of steps later."""

    integrator: Integrator
    n_total: int  #: steps of the run
    is_on: bool = True
    spent: int = 0  #: steps beside which a companion has gone
    is_calm: bool = False  #: no companion goes along any more
    companion: Companion | None = None
    next: int = 0  #: step at which the next window begins
    gap: int = 0  #: steps between the last window and the next one
    watched: int = 0  #: steps of which the error is summed
    #: error of a step, lately: of place and rotation, and of their speeds, (n_b, 2, 2)
    rate: Array | None = None
    total: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))  #: error of the motion, (n_b, 2, 2)
    begun: State | None = None  #: state at the start
    #: farthest way of a body and largest rotation, and twice the largest speeds, (2, 2)
    size: Array = field(default_factory=lambda: np.zeros((2, 2)))
    turn: Array = field(default_factory=lambda: np.zeros(0))  #: largest turn of each body in a step, (n_b,) [rad]
    note: ValidityNote | None = None
    opened: list[tuple[int, Carry]] = field(default_factory=list)  #: begin and middle of a window: step, memory
    again: tuple[System, Work] | None = None  #: working arrays of companions and windows
    jumps: Mapping[int, list[float]] = field(default_factory=dict)  #: times at which forces jump, by the step

    def begin(self, state: State) -> None:
        """Begin from the state at the start of a run."""
        n = len(state.r)
        self.begun, self.total, self.turn = state, np.zeros((n, 2, 2)), np.zeros(n)

    @property
    def limit(self) -> float:
        """Estimated error above which the run tells."""
        return STEP_LIMIT if self.n_total >= FIRST_VERDICT else SHORT_LIMIT

    @property
    def is_long(self) -> bool:
        """Whether companions go beside a part of the run alone."""
        return self.n_total > LONG

    @property
    def has_companion(self) -> bool:
        """Whether a companion goes along."""
        return self.is_on and not self.is_calm

    def is_window(self, n_done: int) -> bool:
        """Whether the steps after n_done belong to a window; none has a restart inside."""
        if self.has_companion or not self.is_on or n_done < self.next:
            return False
        return bool(self.opened) or n_done % RESTART_STEPS <= RESTART_STEPS - WINDOW

    def room(self, n_done: int, most: int) -> int:
        """Return how many steps may be taken at once after n_done: to a comparison, half a window, or the next one."""
        if self.has_companion:
            gone = 0 if self.companion is None else n_done - self.companion.start
            if not self.is_comparable(n_done):
                return 1
            if self.is_long:
                n = min(max(FIRST_CHECK, gone), FEW_CHECKS)
            else:
                n = max(FIRST_CHECK, gone // CHECKS // 2 * 2)
            n_left = self.n_total - n_done
            return n if n < n_left or self.is_comparable(self.n_total) else max(1, n_left // 2 * 2)
        if self.is_window(n_done):
            return WINDOW // 2
        return min(most, self.next - n_done) if self.is_on and n_done < self.next else most

    def is_comparable(self, n_done: int) -> bool:
        """Whether the companion has a step that ends where step n_done of the run does."""
        return self.companion is None or self.companion.ratio == HALVES or (n_done - self.companion.start) % 2 == 0

    def take(
        self, system: System, begin: Carry, end: Carry, *, t0: float, h: float, first: int, n_steps: int,
        events: EventWatch | None = None, is_cut: bool = False,
    ) -> ValidityNote | None:  # fmt: skip
        """Take steps that led from one memory to another; return a note that is new with them.

        events: as they were before these steps, where a companion begins with them. is_cut: forces jump or events
        switch in the steps.
        """
        last = first + n_steps
        if self.has_companion:
            if self.companion is None and self.is_long and begin.h == 0.0:
                return None
            return self.accompany(system, begin, end, t0, h, first, last, events)
        if is_cut:
            self.opened = []
            return None
        if not self.is_window(first):
            return None
        if not self.opened:
            self.opened = [(first, begin), (last, end)]
            return None
        return self.closed(system, end, last, t0, h)

    def interrupt(self, h: float) -> None:
        """Leave the steps out that come next: they fail, or a stop ends the run within one."""
        self.opened = []
        self.leave(h)

    def accompany(
        self, system: System, begin: Carry, end: Carry, t0: float, h: float, first: int, last: int,
        events: EventWatch | None,
    ) -> ValidityNote | None:  # fmt: skip
        """Compare the memory after step `last` with that of the companion; return a note that is new with it."""
        if self.companion is None:
            self.catch_up(first, self.rate)
            is_fixed = not has_divided_steps(compiled_system(system).model) and has_fixed_steps(self.integrator)
            self.companion = Companion.begun(
                self.integrator, begin, self.working(system), first, DOUBLES, h if is_fixed else 0.0, events
            )
        other = self.companion
        if self.is_comparable(last):
            self.measure(begin.state, end.state, h * (last - first))
            self.turn = np.maximum(self.turn, turns_in_a_step(system, end.state, h))
            is_good = other.follow(system, end, last, t0, h, self.jumps)
            if other.ratio == DOUBLES and not (is_good and self.share(system, other).max() < SCREEN * self.limit):
                other = self.companion = self.in_halves(system, other)
                is_good = other.follow(system, end, last, t0, h, self.jumps)
            if not is_good:
                self.companion, self.is_calm, self.next = None, True, last
                return None
        is_judged = last >= max(FIRST_VERDICT, min(self.n_total, BESIDE) // 2)
        note = self.judged(system, t0 + last * h, h) if is_judged else None
        is_over = self.spent + last - other.start >= BESIDE or self.note is not None
        is_calm = self.is_long and last >= CALM_STEPS and self.drawn_out(system, other, last) < CALM * self.limit
        if is_over or is_calm or last % RESTART_STEPS == 0:
            self.leave(h)
        if is_over or is_calm:
            self.is_calm, self.gap = True, (GROWTH - 1) * max(last, WINDOW) if self.is_long else max(last, WINDOW)
            self.next = last + self.gap
        return note

    def in_halves(self, system: System, other: Companion) -> Companion:
        """Return a companion in halves of the steps from where another one began."""
        return Companion.begun(
            self.integrator, other.begin, self.working(system), other.start, HALVES, events=other.events_at_begin
        )

    def leave(self, h: float) -> None:
        """Sum the error that the companion has found, and go on without it."""
        other, self.companion = self.companion, None
        if other is None or other.at == other.start:
            return
        found = np.stack([other.peak, other.speeds(h)], axis=2)
        self.total, self.rate = self.total + found, found / (other.at - other.start)
        self.spent += other.at - other.start
        self.watched = other.at

    def catch_up(self, step: int, rate: Array | None) -> None:
        """Sum the error of the steps before one that have not been watched, of a rate."""
        if rate is not None:
            self.total = self.total + max(0, step - self.watched) * rate
        self.watched = max(step, self.watched)

    def working(self, system: System) -> Work:
        """Return working arrays of companions and windows."""
        if self.again is None or self.again[0] is not system:
            self.again = system, new_work(compiled_system(system).model)
        return self.again[1]

    def closed(self, system: System, end: Carry, last: int, t0: float, h: float) -> ValidityNote | None:
        """Take the steps of the window that is open again, up to a memory; return a note that is new with them."""
        (start, before), (middle, half) = self.opened
        self.opened = []
        self.gap = min(GROWTH * self.gap, FARTHEST)
        self.next = last + self.gap
        other = Companion.begun(self.integrator, before, self.working(system), start, HALVES)
        for number, coarse in ((middle, half), (last, end)):
            if number > other.at and not other.follow(system, coarse, number, t0, h, {}):
                return None
        size = np.stack([lengths(other.apart), other.speeds(h)], axis=2)
        rate = size / (last - start)
        self.catch_up(start, rate if self.rate is None else (self.rate + rate) / 2)
        self.total = self.total + size
        self.rate, self.watched = rate, last
        self.turn = np.maximum(self.turn, turns_in_a_step(system, end.state, h))
        begun, then = (middle, half) if last > middle else (start, before)
        self.measure(then.state, end.state, h * (last - begun))
        return self.judged(system, t0 + last * h, h) if last >= FIRST_VERDICT else None

    def measure(self, half: State, end: State, seconds: float) -> None:
        """Take two states of the motion, so many seconds apart, into its way and speed."""
        assert self.begun is not None
        way = lengths(difference(end, self.begun)).max(axis=0)
        if way[1] > FULL_TURN:
            way[1] = 2 * np.pi
        speed = lengths(difference(end, half)).max(axis=0) / seconds
        self.size = np.maximum(self.size, np.stack([way, 2 * speed], axis=1))

    def conclude(self, system: System, end: Carry, n_done: int, t0: float, h: float) -> ValidityNote | None:
        """Sum the error up to the end of a run; return a note that is new with it."""
        if self.opened and self.opened[1][0] == n_done:
            note = self.closed(system, end, n_done, t0, h)
            if note is not None:
                return note
        other = self.companion
        if other is not None and other.at == other.start and n_done > other.start:  # a run of one step, or of three
            other = self.in_halves(system, other)
            if other.follow(system, end, n_done, t0, h, self.jumps):
                self.measure(other.begin.state, end.state, h * (n_done - other.start))
                self.companion = other
        self.leave(h)
        if self.rate is None:
            return None
        self.catch_up(n_done, self.rate)
        return self.judged(system, t0 + n_done * h, h)

    def share(self, system: System, companion: Companion | None = None) -> Array:
        """Return the error of places and rotations of each body over their way, (n_b, 2); a companion: and its own."""
        compiled = compiled_system(system)
        least = np.array([LEAST_WAY * compiled.length, LEAST_TURN])
        size = self.size.copy()
        size[1] = np.maximum(size[1], size[0] / compiled.length)
        moves = size[:, 0] > least
        total = self.total
        if companion is not None:
            total = total.copy()
            total[:, :, 0] += companion.peak
        parts = total / np.where(size > 0.0, size, np.inf)
        return np.where(moves, np.linalg.norm(parts, axis=2), 0.0)

    def drawn_out(self, system: System, companion: Companion, last: int) -> float:
        """Return the largest error after step `last`, drawn out to the end of the run: errors of phase grow with time."""
        return float(self.share(system, companion).max()) * self.n_total / last

    def judged(self, system: System, t: float, h: float) -> ValidityNote | None:
        """Return the note of the error so far if it is new."""
        companion = self.companion
        if companion is not None and companion.ratio == DOUBLES:
            return None
        share = self.share(system, companion)
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
        """Return what is needed to go on, by name; nothing where it is off."""
        if not self.is_on or self.begun is None:
            return {}
        rate = np.full_like(self.total, np.nan) if self.rate is None else self.rate
        return {
            "watch_counts": np.array([self.next, self.gap, self.watched, self.spent, self.is_calm]), "watch_rate": rate,
            "watch_total": self.total, "watch_size": self.size, "watch_turn": self.turn,
            **{f"watch_{name}": np.asarray(getattr(self.begun, name)) for name in ("r", "p", "q", "u")},
        }  # fmt: skip

    def restore(self, record: Mapping[str, Array], notes: tuple[ValidityNote, ...]) -> None:
        """Go on from a record and the notes of the part that is done."""
        if not self.is_on:
            return
        try:
            self.next, self.gap, self.watched, self.spent, is_calm = (int(n) for n in record["watch_counts"])
            self.is_calm = bool(is_calm)
            arrays = [
                np.array(record[f"watch_{name}"], dtype=float)
                for name in ("rate", "total", "size", "turn", "r", "p", "q", "u")
            ]
        except (KeyError, ValueError) as error:
            raise ResultsError("restart: the record lacks what the watch of the steps knows; run it anew") from error
        rate, self.total, self.size, self.turn = arrays[:4]
        self.rate, self.begun = None if np.isnan(rate).any() else rate, State(*arrays[4:])
        self.note = next((note for note in notes if note.kind == "steps"), None)


def integrator_of(integrator: Integrator, ratio: float) -> Integrator:
    """Return a method for steps whose size has a ratio to those of another one."""
    tolerance = getattr(integrator, "error_tolerance", None)
    if tolerance is None:
        return integrator
    return replace(integrator, error_tolerance=tolerance * ratio**3)  # type: ignore[type-var]


def lengths(vectors: Array) -> Array:
    """Return the lengths of vectors in the last axis."""
    return np.sqrt((vectors**2).sum(axis=-1))


def difference(state: State, other: State) -> Array:
    """Return the differences of places and the rotation vectors between orientations, (n_b, 2, 3) [m, rad]."""
    apart = np.empty((len(state.r), 2, 3))
    apart[:, 0], apart[:, 1] = state.r - other.r, rotations_between(state.p, other.p)
    return apart


def turns_in_a_step(system: System, state: State, h: float) -> Array:
    """Return how far each body turns in a step of size h, (n_b,) [rad]."""
    u0 = compiled_system(system).model.bodies.u0[:-1]
    return h * np.linalg.norm(state.u[u0[:, None] + np.arange(3, 6)], axis=1)
