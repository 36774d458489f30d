"""Watches a run step by step: how far its steps err, and how much of its energy comes from the steps alone.

Error of the steps, for methods of second order with steps of one size:

(1) windows of `WINDOW` steps follow each other closely at the start of a run and every `FARTHEST` steps later
(2) a window is taken again from the same memory in steps of half the size: the difference is 3/4 of its error
(3) the differences of place at its middle and end, d_1 and d_2, give that of the speed too, (d_2 - d_1)/(half of it)
(4) the error of the motion is estimated by the sums over all steps; between two windows a step has the mean of theirs
(5) errors of place are measured by the farthest way of a body from its start, those of speed by twice the largest
    speed (a vibration goes two amplitudes away), and both make one number, sqrt(a² + b²), as they turn into one
    another in a vibration; rotations likewise, or by the way over the length of the system where that is more

Speeds are those between the middle and the end, so that vibrations which a step does not resolve count for little. What
errors become in a motion that forgets them (damping) or magnifies them (chaos) the sum does not know.

Energy: total energy - work + dissipated, less its value at the start, is what the steps have added. The schemes may
lose energy, never gain it. Work is summed by the trapezoidal rule, which is exact to the change of the power in a step;
so much of a gain is not held against the steps.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.system import compiled_system
from floatframe.errors import FloatframeError, ResultsError
from floatframe.integrators.carry import Carry, Integrator
from floatframe.integrators.ida import Ida
from floatframe.integrators.relative_ode import RelativeOde
from floatframe.kernels.memory import GRAVITATION, KINETIC, SPRINGS, STRAIN, WORK_GIVEN, WORK_TAKEN, Rows
from floatframe.kernels.work import Work, new_work
from floatframe.motion.restart import RESTART_STEPS
from floatframe.results.validity import ValidityNote
from floatframe.state import State
from floatframe.system import System

__all__ = ["WATCHES", "EnergyWatch", "StepWatch", "has_steps_of_one_size"]

#: what is done with what is found: end a run half of whose energy comes from its steps; tell alone; do not look for it
WATCHES = ("stop", "tell", "off")
WINDOW = 4  #: steps that are taken again in halves, an even number
FARTHEST = 4092  #: most steps between two windows
FIRST_VERDICT = 20  #: steps before which a motion has gone too short a way to measure errors by
STEP_LIMIT = 0.03  #: estimated error of the motion above which a run tells
ENERGY_LIMIT = 0.05  #: gain over the energy that moves about, above which a run tells
ENERGY_STOP = 0.5  #: and above which it stops
LEAST_WAY = 1e-7  #: of the length of the system: shorter ones are rest
LEAST_TURN = 1e-6  #: rad, likewise
FULL_TURN = 3.0  #: rad: a body that turns so far is measured by a whole turn
AIM = 0.2  #: of the limit, that the step which is advised would reach
ERROR_OF_HALVES = 4.0 / 3.0  #: error of a window over what its halves differ by: 1 - (1/2)²


@dataclass
class StepWatch:
    """The error of the steps of a run, estimated from windows of steps that are taken again in halves."""

    integrator: Integrator
    is_on: bool = True
    next: int = 0  #: step at which the next window begins
    gap: int = 0  #: steps between the last window and the next one
    watched: int = 0  #: steps of which the error is summed
    #: error of a step in the last window: of place and rotation, and of their speeds, (n_b, 2, 2)
    rate: Array | None = None
    total: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))  #: error of the motion, (n_b, 2, 2)
    begun: State | None = None  #: state at the start
    #: farthest way of a body and largest rotation, and twice the largest speeds, (2, 2)
    size: Array = field(default_factory=lambda: np.zeros((2, 2)))
    turn: Array = field(default_factory=lambda: np.zeros(0))  #: largest turn of each body in a step, (n_b,) [rad]
    note: ValidityNote | None = None
    opened: list[tuple[int, Carry]] = field(default_factory=list)  #: begin and middle of a window: step, memory
    again: tuple[System, Work] | None = None  #: working arrays of the steps that are taken again

    def begin(self, state: State) -> None:
        """Begin from the state at the start of a run."""
        n = len(state.r)
        self.begun, self.total, self.turn = state, np.zeros((n, 2, 2)), np.zeros(n)

    def is_window(self, n_done: int) -> bool:
        """Whether the steps after n_done belong to a window; none has a restart inside."""
        if not self.is_on or n_done < self.next:
            return False
        return bool(self.opened) or n_done % RESTART_STEPS <= RESTART_STEPS - WINDOW

    def room(self, n_done: int, most: int) -> int:
        """Return how many steps may be taken at once after n_done: half a window, or up to the next one."""
        if self.is_window(n_done):
            return WINDOW // 2
        return min(most, self.next - n_done) if self.is_on and n_done < self.next else most

    def take(
        self, system: System, begin: Carry, end: Carry, *, t0: float, h: float, first: int, n_steps: int
    ) -> ValidityNote | None:
        """Take steps of a window from one memory to another; return a note that is new with them."""
        if not self.opened:
            self.opened = [(first, begin), (first + n_steps, end)]
            return None
        return self.closed(system, end, first + n_steps, t0, h)

    def closed(self, system: System, end: Carry, last: int, t0: float, h: float) -> ValidityNote | None:
        """Take the steps of the window that is open again, up to a memory; return a note that is new with them."""
        (start, before), (middle, half) = self.opened
        self.opened = []
        self.gap = min(2 * self.gap + WINDOW, FARTHEST)
        self.next = last + self.gap
        if self.again is None or self.again[0] is not system:
            self.again = system, new_work(compiled_system(system).model)
        work = self.again[1]
        work.solver.c_k[...] = 0.0  # factors of another window, which would not be the same after a resumption
        apart, finer, at = [np.zeros((len(self.total), 2, 3))], before, start
        for number, coarse in ((middle, half), (last, end)):
            if number == at:
                continue
            try:
                finer, _, _, failure = self.integrator.advance(
                    system, finer, work, t0=t0, h=h / 2, first=2 * at, n_steps=2 * (number - at), every=2 * (last + 1)
                )
            except FloatframeError:
                return None
            if failure is not None:
                return None
            apart.append(difference(coarse.state, finer.state))
            at = number
        seconds = h * (last - middle if last > middle else last - start)
        speed = (apart[-1] - apart[-2]) / seconds
        size = np.sqrt((np.stack([apart[-1], speed], axis=2) ** 2).sum(axis=3))
        rate = ERROR_OF_HALVES / (last - start) * size
        mean = rate if self.rate is None else (self.rate + rate) / 2
        self.total = self.total + max(0, start - self.watched) * mean + (last - start) * rate
        self.rate, self.watched = rate, last
        self.turn = np.maximum(self.turn, turns_in_a_step(system, end.state, h))
        self.measure(half.state if last > middle else before.state, end.state, seconds)
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
        t = t0 + n_done * h
        if self.opened and self.opened[1][0] == n_done:
            note = self.closed(system, end, n_done, t0, h)
            if note is not None:
                return note
        if self.rate is None:
            return None
        self.total = self.total + max(0, n_done - self.watched) * self.rate
        self.watched = max(n_done, self.watched)
        return self.judged(system, t, h)

    def judged(self, system: System, t: float, h: float) -> ValidityNote | None:
        """Return the note of the error so far if it is new."""
        compiled = compiled_system(system)
        least = np.array([LEAST_WAY * compiled.length, LEAST_TURN])
        size = self.size.copy()
        size[1] = np.maximum(size[1], size[0] / compiled.length)
        moves = size[:, 0] > least
        parts = self.total / np.where(size > 0.0, size, np.inf)
        share = np.where(moves, np.linalg.norm(parts, axis=2), 0.0)  # (n_b, 2)
        i = int(np.argmax(share.max(axis=1)))
        largest = float(share[i].max())
        if not largest > STEP_LIMIT:
            return None
        if self.note is not None:
            if largest > self.note.largest:
                self.note = replace(self.note, largest=largest, t_largest=t)
            return None
        turn = f"it turns by up to {self.turn[i]:.2g} rad in a step; " if self.turn[i] > 0.1 else ""
        finer = h * np.sqrt(AIM * STEP_LIMIT / largest)
        self.note = ValidityNote(
            compiled.body_names[i], "steps", STEP_LIMIT, largest, t, t, advice=f"{turn}take a step of about {finer:.1g}"
        )
        return self.note

    def record(self) -> dict[str, Array]:
        """Return what is needed to go on, by name; nothing where it is off."""
        if not self.is_on or self.begun is None:
            return {}
        rate = np.full_like(self.total, np.nan) if self.rate is None else self.rate
        return {
            "watch_counts": np.array([self.next, self.gap, self.watched]), "watch_rate": rate,
            "watch_total": self.total, "watch_size": self.size, "watch_turn": self.turn,
            **{f"watch_{name}": np.asarray(getattr(self.begun, name)) for name in ("r", "p", "q", "u")},
        }  # fmt: skip

    def restore(self, record: Mapping[str, Array], notes: tuple[ValidityNote, ...]) -> None:
        """Go on from a record and the notes of the part that is done."""
        if not self.is_on:
            return
        try:
            self.next, self.gap, self.watched = (int(n) for n in record["watch_counts"])
            arrays = [
                np.array(record[f"watch_{name}"], dtype=float)
                for name in ("rate", "total", "size", "turn", "r", "p", "q", "u")
            ]
        except (KeyError, ValueError) as error:
            raise ResultsError("restart: the record lacks what the watch of the steps knows; run it anew") from error
        rate, self.total, self.size, self.turn = arrays[:4]
        self.rate, self.begun = None if np.isnan(rate).any() else rate, State(*arrays[4:])
        self.note = next((note for note in notes if note.kind == "steps"), None)


@dataclass
class EnergyWatch:
    """The energy that the steps of a run have added to its motion, from its rows of results."""

    every: int  #: steps between rows
    n_seen: int = 0  #: rows after the first one
    last: Array | None = None  #: energy, work given and taken at the last row, (3,)
    change: Array | None = None  #: of the work in the interval before it, (2,)
    potential: Array | None = None  #: least and largest of gravity
    gain: float = 0.0  #: what the steps have added
    unsure: float = 0.0  #: of it, by the sum of the work
    scale: float = 0.0  #: largest energy that moves about
    note: ValidityNote | None = None
    is_beyond: bool = False  #: whether the run has to stop

    def observe(self, system: System, rows: Rows, *, is_switched: bool, is_last: bool = False) -> ValidityNote | None:
        """Take rows of results; return a note that is new with them. is_switched: something else acts in them.

        The first steps, in which little moves yet, are judged at the end of a run alone (is_last).
        """
        if len(rows.t) == 0:
            return None
        d = rows.diagnostics
        energy = d[:, KINETIC] + d[:, STRAIN] + d[:, SPRINGS] + d[:, GRAVITATION]
        now = np.stack([energy, d[:, WORK_GIVEN], d[:, WORK_TAKEN]], axis=1)
        self.measure(d)
        last, self.last = self.last, now[-1]
        number = self.n_seen + 1 + np.arange(len(rows.t))
        self.n_seen += 0 if last is None else len(rows.t)
        if last is None or is_switched:
            self.change = None
            return None
        steps = np.diff(np.concatenate([last[None], now]), axis=0)
        work = steps[:, 1:]
        change = work[:1] if self.change is None else self.change[None]
        swing = np.abs(work) if self.every > 1 else np.abs(np.diff(np.concatenate([change, work]), axis=0)) / 2
        if self.change is None:
            swing[0] = np.abs(work[0])
        self.change = work[-1]
        gains = self.gain + np.cumsum(steps[:, 0] - work[:, 0] + work[:, 1])
        unsure = self.unsure + np.cumsum(swing.sum(axis=1))
        self.gain, self.unsure = float(gains[-1]), float(unsure[-1])
        share = (gains - unsure) / self.scale if self.scale > 0.0 else np.zeros(len(gains))
        is_judged = number * self.every >= FIRST_VERDICT
        is_judged[-1] = is_judged[-1] or is_last
        share = np.where(is_judged, share, 0.0)
        largest = float(share.max())
        if not largest > ENERGY_LIMIT:
            return None
        k = int(np.argmax(share))
        self.is_beyond = self.is_beyond or largest > ENERGY_STOP
        if self.note is not None:
            if largest > self.note.largest:
                self.note = replace(self.note, largest=largest, t_largest=float(rows.t[k]))
            return None
        first = float(rows.t[int(np.argmax(share > ENERGY_LIMIT))])
        compiled = compiled_system(system)
        body = compiled.body_names[int(np.argmax(kinetic_energies(system, rows.u[k])))]
        self.note = ValidityNote(
            body, "energy", ENERGY_LIMIT, largest, first, float(rows.t[k]), advice=
            "take a shorter step, the scheme energy-momentum or relative coordinates",
        )  # fmt: skip
        return self.note

    def record(self) -> dict[str, Array]:
        """Return what is needed to go on, by name."""
        if self.last is None or self.potential is None:
            return {}
        change = np.full(2, np.nan) if self.change is None else self.change
        sums = np.array([self.gain, self.unsure, self.scale])
        return {"energy_sums": np.concatenate([sums, self.last, change, self.potential])}

    def restore(self, record: Mapping[str, Array], notes: tuple[ValidityNote, ...]) -> None:
        """Go on from a record and the notes of the part that is done."""
        if "energy_sums" not in record:
            return
        numbers = np.array(record["energy_sums"], dtype=float)
        self.gain, self.unsure, self.scale = (float(x) for x in numbers[:3])
        self.n_seen = FIRST_VERDICT  # a restart comes later
        self.last, change, self.potential = numbers[3:6], numbers[6:8], numbers[8:10]
        self.change = None if np.isnan(change).any() else change
        self.note = next((note for note in notes if note.kind == "energy"), None)

    def measure(self, d: Array) -> None:
        """Take rows into the largest energy that moves about."""
        ends = np.array([d[:, GRAVITATION].min(), d[:, GRAVITATION].max()])
        if self.potential is not None:
            ends = np.array([min(ends[0], self.potential[0]), max(ends[1], self.potential[1])])
        self.potential = ends
        parts = np.abs(d[:, [KINETIC, STRAIN, SPRINGS, WORK_GIVEN, WORK_TAKEN]])
        self.scale = max(self.scale, float(parts.max()), float(ends[1] - ends[0]))


def has_steps_of_one_size(integrator: Integrator) -> bool:
    """Whether a method takes steps of the size that it is given."""
    return not isinstance(integrator, Ida | RelativeOde) and getattr(integrator, "error_tolerance", None) is None


def lengths(vectors: Array) -> Array:
    """Return the lengths of vectors in the last axis."""
    return np.sqrt((vectors**2).sum(axis=-1))


def difference(state: State, other: State) -> Array:
    """Return the differences of places and the rotation vectors between orientations, (n_b, 2, 3) [m, rad]."""
    apart = np.empty((len(state.r), 2, 3))
    apart[:, 0], apart[:, 1] = state.r - other.r, rotations_between(state.p, other.p)
    return apart


def rotations_between(p: Array, other: Array) -> Array:
    """Return the rotation vectors from orientations to others, Euler parameters (n, 4): (n, 3) [rad].

    conj(other) p = (cos(angle/2), sin(angle/2) axis); of the two signs, that of the smaller angle.
    """
    w, x, y, z = p.T
    a, b, c, d = other.T
    scalar = a * w + b * x + c * y + d * z
    vector = np.stack(
        [a * x - b * w - c * z + d * y, a * y + b * z - c * w - d * x, a * z - b * y + c * x - d * w], axis=1
    )
    sine = lengths(vector)
    angle = 2 * np.arctan2(sine, np.abs(scalar)) * np.where(scalar < 0, -1.0, 1.0)
    return np.asarray(vector * (angle / np.where(sine > 0.0, sine, 1.0))[:, None])


def turns_in_a_step(system: System, state: State, h: float) -> Array:
    """Return how far each body turns in a step of size h, (n_b,) [rad]."""
    u0 = compiled_system(system).model.bodies.u0[:-1]
    return h * np.linalg.norm(state.u[u0[:, None] + np.arange(3, 6)], axis=1)


def kinetic_energies(system: System, u: Array) -> Array:
    """Return the kinetic energy of each body as if its mass were about its origin, (n_b,)."""
    model = compiled_system(system).model
    u0, kind = model.bodies.u0[:-1], model.bodies.kind
    v, omega = u[u0[:, None] + np.arange(3)], u[u0[:, None] + np.arange(3, 6)]
    J = np.einsum("naa->na", model.body_types.J0)[kind]
    return np.asarray(0.5 * model.body_types.mass[kind] * (v**2).sum(axis=1) + 0.5 * (J * omega**2).sum(axis=1))
