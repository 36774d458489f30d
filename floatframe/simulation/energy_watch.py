"""Watches the energy of a motion row by row: what its steps have added to it.

Total energy - work + dissipated, less its value at the start, is what the steps have added. The schemes may lose
energy, never gain it. Work is summed by the trapezoidal rule, which is exact to the change of the power in a step; so
much of a gain is not held against the steps. Nor is what rounding gives: places are known to `ROUNDING` of their
distance from the origin, velocities that close joints to that over the step.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import GRAVITATION, KINETIC, SPRINGS, STRAIN, WORK_GIVEN, WORK_TAKEN, Rows
from floatframe.integrators.carry import joined_rows
from floatframe.model.system import System
from floatframe.results.validity import ValidityNote
from floatframe.simulation.step_watch import FIRST_VERDICT

__all__ = ["EnergyWatch"]

ENERGY_LIMIT = 0.05  #: gain over the energy that moves about, above which a run tells
ENERGY_STOP = 0.5  #: and above which it stops
WAITING, MOST_WAITING = 8, 400  #: rows wait for others, up to this part of those before and so many
ROUNDING = 8 * np.finfo(float).eps  #: of a number


@dataclass
class EnergyWatch:
    """The energy that the steps of a run have added to its motion, from its rows of results."""

    every: int  #: steps between rows
    h: float  #: step size [s]
    n_seen: int = 0  #: rows after the first one
    last: Array | None = None  #: energy, work given and taken at the last row, (3,)
    change: Array | None = None  #: of the work in the interval before it, (2,)
    potential: Array | None = None  #: least and largest of gravity
    gain: float = 0.0  #: what the steps have added
    unsure: float = 0.0  #: of it, by the sum of the work
    scale: float = 0.0  #: largest energy that moves about
    noise: float = 0.0  #: of the energy, by rounding
    waiting: list[Rows] = field(default_factory=list)  #: rows that are not judged yet
    note: ValidityNote | None = None
    is_beyond: bool = False  #: whether the run has to stop

    def observe(self, system: System, rows: Rows, *, is_switched: bool, is_last: bool = False) -> ValidityNote | None:
        """Take rows of results; return a note that is new with them. is_switched: something else acts in them.

        The first steps, in which little moves yet, are judged at the end of a run alone (is_last). Rows are judged
        together: a look at a few costs as much as one at many.
        """
        note = self.flush(system) if is_switched else None
        if len(rows.t):
            self.waiting.append(rows)
        n = sum(len(each.t) for each in self.waiting)
        if n == 0 or (not (is_switched or is_last) and n < min(MOST_WAITING, self.n_seen // WAITING)):
            return note
        rows, self.waiting = joined_rows(self.waiting), []
        return self.judge(system, rows, is_switched=is_switched, is_last=is_last) or note

    def flush(self, system: System) -> ValidityNote | None:
        """Judge the rows that wait; return a note that is new with them."""
        if not self.waiting:
            return None
        rows, self.waiting = joined_rows(self.waiting), []
        return self.judge(system, rows, is_switched=False, is_last=False)

    def judge(self, system: System, rows: Rows, *, is_switched: bool, is_last: bool) -> ValidityNote | None:
        """Take rows of results; return a note that is new with them."""
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
        share = np.where(scales > 0.0, (gains - unsure - noises) / np.where(scales > 0.0, scales, 1.0), 0.0)
        is_judged = number * self.every >= FIRST_VERDICT
        is_judged[-1] = is_judged[-1] or is_last
        share = np.where(is_judged, share, 0.0)
        largest = float(share.max())
        if not largest > ENERGY_LIMIT:
            return None
        k = int(np.argmax(share))
        self.is_beyond = self.is_beyond or largest > ENERGY_STOP
        if self.note is not None:
            self.note = self.note.with_value(largest, float(rows.t[k]))
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
        """Return what is needed to go on, by name; no rows may wait."""
        if self.last is None or self.potential is None:
            return {}
        change = np.full(2, np.nan) if self.change is None else self.change
        sums = np.array([self.gain, self.unsure, self.scale, self.noise])
        return {"energy_sums": np.concatenate([sums, self.last, change, self.potential])}

    def restore(self, record: Mapping[str, Array], notes: tuple[ValidityNote, ...]) -> None:
        """Go on from a record and the notes of the part that is done."""
        if "energy_sums" not in record:
            return
        numbers = np.array(record["energy_sums"], dtype=float)
        self.gain, self.unsure, self.scale, self.noise = (float(x) for x in numbers[:4])
        self.n_seen = FIRST_VERDICT  # a restart comes later
        self.last, change, self.potential = numbers[4:7], numbers[7:9], numbers[9:11]
        self.change = None if np.isnan(change).any() else change
        self.note = next((note for note in notes if note.kind == "energy"), None)

    def measured(self, d: Array) -> Array:
        """Return the largest energy that has moved about at the times of rows, (n_t,)."""
        low, high = np.minimum.accumulate(d[:, GRAVITATION]), np.maximum.accumulate(d[:, GRAVITATION])
        if self.potential is not None:
            low, high = np.minimum(low, self.potential[0]), np.maximum(high, self.potential[1])
        self.potential = np.array([low[-1], high[-1]])
        parts = np.abs(d[:, [KINETIC, STRAIN, SPRINGS, WORK_GIVEN, WORK_TAKEN]]).max(axis=1)
        return np.maximum(self.scale, np.maximum(np.maximum.accumulate(parts), high - low))


def rounding_energies(system: System, rows: Rows, h: float) -> Array:
    """Return by how much rounding may change the energy of rows in steps of size h, (n_t,)."""
    model = compiled_system(system).model
    mass = model.body_types.mass[model.bodies.kind]
    v = np.abs(rows.u[:, model.bodies.u0[:-1, None] + np.arange(3)]).max(axis=2)
    slip = ROUNDING / h * np.abs(rows.r).max(axis=2)
    return np.asarray((slip * (v + slip)) @ mass + ROUNDING * np.abs(rows.diagnostics[:, GRAVITATION]))


def kinetic_energies(system: System, u: Array) -> Array:
    """Return the kinetic energy of each body as if its mass were about its origin, (n_b,)."""
    model = compiled_system(system).model
    u0, kind = model.bodies.u0[:-1], model.bodies.kind
    v, omega = u[u0[:, None] + np.arange(3)], u[u0[:, None] + np.arange(3, 6)]
    J = np.einsum("naa->na", model.body_types.J0)[kind]
    return np.asarray(0.5 * model.body_types.mass[kind] * (v**2).sum(axis=1) + 0.5 * (J * omega**2).sum(axis=1))
