"""Levels over frequency: accelerations and power spectral densities, in the units of test specifications.

Between two rows a level is linear in log-log axes, as in test specifications; outside its rows it is zero.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.number_pairs import read_pairs
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.durability.shaking.structure.model import STANDARD_GRAVITY, gravity_in
from floatframe.errors import ModelError

__all__ = ["ACCELERATIONS", "DENSITIES", "STROKES", "Level", "in_model", "known_unit", "level_rms", "read_level"]

ACCELERATIONS = {  # unit -> m/s² or rad/s²
    "g": STANDARD_GRAVITY,
    "m/s2": 1.0,
    "mm/s2": 1e-3,
    "cm/s2": 1e-2,
    "in/s2": 0.0254,
    "ft/s2": 0.3048,
    "rad/s2": 1.0,
}
STROKES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "rad": 1.0}  # amplitude of a displacement or rotation
DENSITIES = {"g2/Hz": "g", "(m/s2)2/Hz": "m/s2", "(mm/s2)2/Hz": "mm/s2", "(rad/s2)2/Hz": "rad/s2"}
OF_OUTPUT = "output"  #: unit in which the output of a limit is listed: g for accelerations, else that of the model
FEWEST = 2  #: smallest number of rows


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Level:
    """A level at frequencies [Hz]: amplitudes of an acceleration or displacement, or a power spectral density.

    Parameters
    ----------
    frequencies
        Ascending frequencies, (n,) [Hz].
    values
        Values in `unit`, (n,).
    unit
        Unit of the values, such as "g", "m/s2" or "g2/Hz".
    where
        Location of the level, for messages.
    rows
        Location of each row, for messages: "line 7"; (): the row number.

    Raises
    ------
    ModelError
        If frequencies are not positive and increasing, or a level is not a number above zero; the message names the
        row.
    """

    frequencies: Array
    values: Array
    unit: str = "g"
    where: str = field(default="shake: level", compare=False)
    rows: Sequence[str] = ()

    def __post_init__(self) -> None:
        f, values = np.asarray(self.frequencies, dtype=float), np.asarray(self.values, dtype=float)
        object.__setattr__(self, "unit", known_unit(self.unit, self.where))
        if f.ndim != 1 or f.shape != values.shape or len(f) < FEWEST:
            raise ModelError(
                f"{self.where}: expected {FEWEST} rows (Hz, {self.unit}) at least, got {len(np.atleast_1d(f))}"
            )
        names = self.rows or [f"row {k + 1}" for k in range(len(f))]
        for k, (frequency, value) in enumerate(zip(f, values, strict=True)):
            if not np.isfinite(frequency) or frequency <= 0:
                raise ModelError(f"{self.where}: {names[k]}: frequency {frequency:g} Hz: expected a number above 0")
            if not np.isfinite(value) or value <= 0:
                raise ModelError(
                    f"{self.where}: {names[k]}: {value:g} {self.unit} at {frequency:g} Hz: expected a level above "
                    "0 (it is linear in log-log axes); end the table where the level ends"
                )
            if k and frequency <= f[k - 1]:
                raise ModelError(
                    f"{self.where}: {names[k]}: {frequency:g} Hz after {f[k - 1]:g} Hz: expected increasing "
                    "frequencies; write a step with two frequencies close together"
                )
        object.__setattr__(self, "frequencies", frozen(f))
        object.__setattr__(self, "values", frozen(values))

    @classmethod
    def of(cls, rows: "Level | Sequence[Sequence[float]]", unit: str = "g", where: str = "shake: level") -> "Level":
        """Return a level from rows (Hz, value); a level is returned unchanged."""
        if isinstance(rows, Level):
            return rows
        for k, row in enumerate(rows):
            if np.ndim(row) != 1 or len(row) != 2:
                raise ModelError(f"{where}: row {k + 1}: expected two numbers, (Hz, {unit}), got {row!r}")
        table = np.array([[float(value) for value in row] for row in rows]).reshape(-1, 2)
        return cls(table[:, 0], table[:, 1], unit, where)

    @property
    def first(self) -> float:
        """First frequency [Hz]."""
        return float(self.frequencies[0])

    @property
    def last(self) -> float:
        """Last frequency [Hz]."""
        return float(self.frequencies[-1])

    @property
    def is_density(self) -> bool:
        """Whether the level is a power spectral density."""
        return self.unit in DENSITIES

    def at(self, frequencies: Array) -> Array:
        """Return the level in its unit at frequencies [Hz], (n_f,); zero outside its rows."""
        f = np.asarray(frequencies, dtype=float)
        inside = (f >= self.first * (1 - 1e-12)) & (f <= self.last * (1 + 1e-12))
        values = np.exp(np.interp(np.log(np.maximum(f, 1e-300)), np.log(self.frequencies), np.log(self.values)))
        return np.asarray(np.where(inside, values, 0.0))

    def in_si(self, frequencies: Array) -> Array:
        """Return accelerations [m/s², rad/s²] or their densities [per Hz], (n_f,)."""
        if self.is_density:
            return self.at(frequencies) * ACCELERATIONS[DENSITIES[self.unit]] ** 2
        if self.unit in STROKES:
            return self.at(frequencies) * STROKES[self.unit] * (2 * np.pi * np.asarray(frequencies)) ** 2
        return self.at(frequencies) * ACCELERATIONS[self.unit]

    @property
    def is_rotation(self) -> bool:
        """Whether the level is a rotation."""
        return "rad" in self.unit


def read_level(path: Path, unit: str, where: str) -> Level:
    """Return a level from a text file of two columns, Hz and value; empty lines and lines from # on are skipped.

    Raises
    ------
    ModelError
        If a line is not two numbers, or `Level` refuses it; the message names the line.
    """
    table, lines = read_pairs(path, f"Hz and {unit}", ModelError, where)
    return Level(table[:, 0], table[:, 1], unit, where, [f"{path.name}, line {number}" for number in lines])


def known_unit(unit: str, where: str) -> str:
    """Return the unit in its standard spelling; `ModelError` with the nearest one if it is unknown."""
    plain = unit.strip().replace("²", "2").replace("^2", "2").replace("s**2", "s2").replace(" ", "")
    plain = re.sub(r"^g2/hz$|^G2/Hz$", "g2/Hz", plain)
    known = [*ACCELERATIONS, *STROKES, *DENSITIES, OF_OUTPUT]
    if plain not in known:
        raise ModelError(
            f"{where}: unit: unknown unit {quoted(unit)}{nearest(plain, known)}; one g is {STANDARD_GRAVITY} m/s2"
        )
    return plain


def in_model(level: Level, direction: str, units: Units) -> float:
    """Return the factor from SI (m/s², rad/s²) to accelerations of the model; squared for a density.

    Raises
    ------
    ModelError
        If the level is for a translation and the direction is a rotation, or vice versa.
    """
    turns = direction.startswith("r")
    if turns != level.is_rotation:
        raise ModelError(
            f"{level.where}: unit {level.unit} for direction {direction}, expected "
            f"{'rad/s2 or (rad/s2)2/Hz for a rotation' if turns else 'an acceleration of a translation'}"
        )
    factor = units.time**2 if turns else gravity_in(units) / STANDARD_GRAVITY
    return float(factor**2 if level.is_density else factor)


def level_rms(level: Level) -> float:
    """Return the root mean square of a density, exact for straight lines in log-log axes [unit of the acceleration].

    The integral of a piece S = S_1 (f/f_1)^n is S_1 f_1 ((f_2/f_1)^(n+1) - 1)/(n + 1), or S_1 f_1 ln(f_2/f_1) for
    n = -1.
    """
    f, s = level.frequencies, level.values
    ratio = np.log(f[1:] / f[:-1])
    power = np.log(s[1:] / s[:-1]) / ratio + 1
    x = power * ratio
    growth = np.where(np.abs(x) < 1e-8, 1 + x / 2, np.expm1(x) / np.where(x == 0, 1.0, x))
    return float(np.sqrt(np.sum(s[:-1] * f[:-1] * ratio * growth)))
