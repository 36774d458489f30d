"""Energy balance of a run from its result rows: the energy that the time steps have added or removed.

The balance is total energy - work of forces + dissipated energy, minus its value at the start.

- Gain: the steps must not add energy. A run reports a gain of `GAIN_LIMIT`. It stops when the energy of the motion,
  without the sum of the work of dampers, has grown by `STOP_LIMIT`.
- Loss: numerical damping removes energy, mostly of vibrations that the steps do not resolve. A companion with other
  steps damps the same vibrations, so it cannot show their effect on the motion. A run reports a loss of `LOSS_LIMIT`.

These errors of the balance are subtracted from a gain or a loss:

- the change of the power in a step, which bounds the error of the trapezoidal sums of work;
- for gains, the work of dampers where it changes fast from step to step: the velocity in a damper that the steps do not
  resolve changes its sign from step to step, and the trapezoidal sum is then far above the energy that the scheme
  removes;
- roundoff: positions have an error of `ROUNDING` times their distance from the origin. Roundoff of forces in stiff
  springs moves bodies by at most `REST` times the length of the system. Velocities have these errors divided by the
  step size.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import GRAVITATION, KINETIC, SPRINGS, STRAIN, WORK_GIVEN, WORK_TAKEN, Rows
from floatframe.integrators.integrator import joined_rows
from floatframe.model.system import System
from floatframe.results.validity import ValidityNote
from floatframe.simulation.step_watch import FIRST_VERDICT

__all__ = ["EnergyWatch"]

GAIN_LIMIT = 0.05  #: energy gain, relative to the energy in motion, above which a run reports it
STOP_LIMIT = 0.5  #: energy gain, relative to the energy in motion, above which a run stops
LOSS_LIMIT = 0.1  #: energy loss, relative to the energy in motion, above which a run reports it
#: relative change of the dampers' work between two intervals up to which their velocities count as resolved
STEADY = 0.05
MOST_WAITING = 400  #: limit of collected rows; below it, as many rows are collected as were assessed before
ADVICE = {
    "energy": "take a shorter step, the scheme energy-momentum or relative coordinates",
    "damping": "take a step that resolves the fast vibrations, less numerical damping (rho_inf nearer to 1), or start "
    "without these vibrations",
}  #: remedy for each kind of note
#: displacement in a step, divided by the length of the system, due to roundoff in springs of 1000 rad per step
REST = 1e-12
ROUNDING = 8 * np.finfo(float).eps  #: relative rounding error of a number


@dataclass
class EnergyWatch:
    """The energy that the time steps of a run have added to its motion, computed from result rows."""

    every: int  #: number of steps between rows
    h: float  #: step size [s]
    n_seen: int = 0  #: number of assessed rows after the first one
    last: Array | None = None  #: energy, supplied work and dissipated work at the last row, (3,)
    change: Array | None = None  #: supplied and dissipated work in the previous interval, (2,)
    potential: Array | None = None  #: smallest and largest potential of gravity
    gain: float = 0.0  #: energy that the steps have added
    unsure: float = 0.0  #: error of `gain` due to the integration of work
    unresolved: float = 0.0  #: additional error of `gain` due to the work of unresolved dampers
    taken: float = 0.0  #: work of dampers
    scale: float = 0.0  #: largest energy in motion
    noise: float = 0.0  #: rounding error of the energy
    waiting: list[Rows] = field(default_factory=list)  #: rows that are not yet assessed
    notes: dict[str, ValidityNote] = field(default_factory=dict)  #: notes by their kind
    is_beyond: bool = False  #: whether the run must stop

    def observe(
        self, system: System, rows: Rows, *, is_switched: bool, is_last: bool = False
    ) -> tuple[ValidityNote, ...]:
        """Take result rows and return new notes; is_switched: whether events happened in these rows.

        The first steps, with little motion, are assessed only at the end of a run (is_last). Rows are collected,
        because it costs as much to assess a few as many.
        """
        notes = self.flush(system) if is_switched else ()
        if len(rows.t):
            self.waiting.append(rows)
        n = sum(len(each.t) for each in self.waiting)
        if n == 0 or (not (is_switched or is_last) and n < min(MOST_WAITING, self.n_seen)):
            return notes
        rows, self.waiting = joined_rows(self.waiting), []
        return (*notes, *self.judge(system, rows, is_switched=is_switched, is_last=is_last))

    def flush(self, system: System) -> tuple[ValidityNote, ...]:
        """Assess the collected rows and return new notes."""
        if not self.waiting:
            return ()
        rows, self.waiting = joined_rows(self.waiting), []
        return self.judge(system, rows, is_switched=False, is_last=False)

    def judge(self, system: System, rows: Rows, *, is_switched: bool, is_last: bool) -> tuple[ValidityNote, ...]:
        """Assess result rows and return new notes; is_switched: whether events happened in these rows."""
        d = rows.diagnostics
        energy = d[:, KINETIC] + d[:, STRAIN] + d[:, SPRINGS] + d[:, GRAVITATION]
        now = np.stack([energy, d[:, WORK_GIVEN], d[:, WORK_TAKEN]], axis=1)
        scales = self.measured(d)
        noises = np.maximum(self.noise, np.maximum.accumulate(rounding_energies(system, rows, self.h)))
        self.scale, self.noise = float(scales[-1]), float(noises[-1])
        last, self.last = self.last, now[-1]
        number = self.n_seen + 1 + np.arange(len(rows.t))
        self.n_seen += 0 if last is None else len(rows.t)
        if last is None or is_switched:
            self.change = None
            return ()
        steps = np.diff(np.concatenate([last[None], now]), axis=0)
        work = steps[:, 1:]
        change = work[:1] if self.change is None else self.change[None]
        before = np.concatenate([change, work])[:-1]
        swing = np.abs(work) if self.every > 1 else np.abs(work - before) / 2
        if self.change is None:
            swing[0] = np.abs(work[0])
        self.change = work[-1]
        taken, taken_before = np.abs(work[:, 1]), np.abs(before[:, 1])
        taken_so_far = self.taken + np.cumsum(taken)
        is_steady = np.abs(taken - taken_before) <= STEADY * np.maximum(taken, taken_before)
        unresolved = self.unresolved + np.cumsum(np.where(is_steady, 0.0, np.maximum(taken - swing[:, 1], 0.0)))
        gains = self.gain + np.cumsum(steps[:, 0] - work[:, 0] + work[:, 1])
        unsure = self.unsure + np.cumsum(swing.sum(axis=1))
        self.gain, self.unsure = float(gains[-1]), float(unsure[-1])
        self.unresolved, self.taken = float(unresolved[-1]), float(taken_so_far[-1])
        is_judged = number * self.every >= FIRST_VERDICT
        is_judged[-1] = is_judged[-1] or is_last
        is_judged &= scales > 0.0
        share_of = np.where(is_judged, 1.0 / np.where(scales > 0.0, scales, 1.0), 0.0)
        gained, lost = share_of * (gains - unsure - unresolved - noises), share_of * (-gains - unsure - noises)
        grown = share_of * (gains - unsure - taken_so_far - noises)
        self.is_beyond = self.is_beyond or float(grown.max()) > STOP_LIMIT
        new = (
            self.noted(system, rows, "energy", gained, GAIN_LIMIT),
            self.noted(system, rows, "damping", lost, LOSS_LIMIT),
        )
        return tuple(note for note in new if note is not None)

    def noted(self, system: System, rows: Rows, kind: str, share: Array, limit: float) -> ValidityNote | None:
        """Store the largest share at the times of the rows, (n_t,), if it is above a limit.

        Return the note if it is new.
        """
        k = int(np.argmax(share))
        largest, t = float(share[k]), float(rows.t[k])
        if not largest > limit:
            return None
        if kind in self.notes:
            self.notes[kind] = self.notes[kind].with_value(largest, t)
            return None
        first = float(rows.t[int(np.argmax(share > limit))])
        body = compiled_system(system).body_names[int(np.argmax(kinetic_energies(system, rows.u[k])))]
        self.notes[kind] = ValidityNote(body, kind, limit, largest, first, t, advice=ADVICE[kind])
        return self.notes[kind]

    def passed_on(self) -> dict[str, list[float]]:
        """Return the data that a continuing run needs; no rows may be waiting."""
        return {"energy": [self.gain, self.unsure, self.unresolved, self.taken, self.scale, self.noise]}

    def continue_from(self, watched: Mapping[str, Any]) -> None:
        """Add the errors of the previous run, which this run continues."""
        self.gain, self.unsure, self.unresolved, self.taken, self.scale, self.noise = watched["energy"]

    def record(self) -> dict[str, Array]:
        """Return the data for a resumed run by name; no rows may be waiting."""
        if self.last is None or self.potential is None:
            return {}
        change = np.full(2, np.nan) if self.change is None else self.change
        sums = np.array([self.gain, self.unsure, self.unresolved, self.taken, self.scale, self.noise])
        return {"energy_sums": np.concatenate([sums, self.last, change, self.potential])}

    def restore(self, record: Mapping[str, Array], notes: tuple[ValidityNote, ...]) -> None:
        """Restore the data of an interrupted run from its record and notes."""
        if "energy_sums" not in record:
            return
        numbers = np.array(record["energy_sums"], dtype=float)
        sums = (float(x) for x in numbers[:6])
        self.gain, self.unsure, self.unresolved, self.taken, self.scale, self.noise = sums
        self.n_seen = FIRST_VERDICT  # the run was resumed after its first steps
        self.last, change, self.potential = numbers[6:9], numbers[9:11], numbers[11:]
        self.change = None if np.isnan(change).any() else change
        self.notes = {note.kind: note for note in notes if note.kind in ADVICE}

    def measured(self, d: Array) -> Array:
        """Return the largest energy in motion up to each row, (n_t,)."""
        low, high = np.minimum.accumulate(d[:, GRAVITATION]), np.maximum.accumulate(d[:, GRAVITATION])
        if self.potential is not None:
            low, high = np.minimum(low, self.potential[0]), np.maximum(high, self.potential[1])
        self.potential = np.array([low[-1], high[-1]])
        parts = np.abs(d[:, [KINETIC, STRAIN, SPRINGS, WORK_GIVEN, WORK_TAKEN]]).max(axis=1)
        return np.maximum(self.scale, np.maximum(np.maximum.accumulate(parts), high - low))


def rounding_energies(system: System, rows: Rows, h: float) -> Array:
    """Return the possible energy error of each row due to rounding in steps of size h, (n_t,)."""
    compiled = compiled_system(system)
    model = compiled.model
    mass = model.body_types.mass[model.bodies.kind]
    v = np.abs(rows.u[:, model.bodies.u0[:-1, None] + np.arange(3)]).max(axis=2)
    slip = (ROUNDING * np.abs(rows.r).max(axis=2) + REST * compiled.length) / h
    return np.asarray((slip * (v + slip)) @ mass + ROUNDING * np.abs(rows.diagnostics[:, GRAVITATION]))


def kinetic_energies(system: System, u: Array) -> Array:
    """Return the kinetic energy of each body, (n_b,), as if its centre of mass were at its origin."""
    model = compiled_system(system).model
    u0, kind = model.bodies.u0[:-1], model.bodies.kind
    v, omega = u[u0[:, None] + np.arange(3)], u[u0[:, None] + np.arange(3, 6)]
    J = np.einsum("naa->na", model.body_types.J0)[kind]
    return np.asarray(0.5 * model.body_types.mass[kind] * (v**2).sum(axis=1) + 0.5 * (J * omega**2).sum(axis=1))
