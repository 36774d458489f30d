"""Notches: inputs reduced where a limit would be exceeded, with the limit that causes each notch.

Sine:    a(f) = min(level, limit_k(f) / |H_k(f)|)                     amplitudes
Random:  S(f) = min(level, limit_k(f) / |H_k(f)|²)                    densities
         S(f) = min(level, c_k / |H_k(f)|²), c_k so that the rms is kept      rms

Force limits keep the interface force as small as in flight, where the mounting is compliant (Scharton (1997)):

    S_FF = C² M_0² S_AA               f < f_0
    S_FF = C² M_0² S_AA (f_0/f)^n     f >= f_0

with the mass M_0, the frequency f_0 of the main mode, the factor C of the mounting structure and its roll-off n (2 for
densities). The limit of sine amplitudes is the square root. Notches are computed on the resolved grid.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.durability.shaking.loads.levels import OF_OUTPUT, Level, in_model
from floatframe.durability.shaking.loads.random_vibration import RandomRun
from floatframe.durability.shaking.loads.sine import SineRun
from floatframe.durability.shaking.structure.model import Output, ShakenModel
from floatframe.errors import ModelError

__all__ = ["ForceLimit", "Notch", "NotchedRun", "ResponseLimit", "notched_random", "notched_sine"]

LOWEST = -60.0  #: logarithm of the smallest clipped density, relative to its largest value, 260 dB
DEEPEST = 40.0  #: largest allowed depth of a notch [dB], by default
ACCELERATION_KINDS = ("acceleration", "angular acceleration")  #: outputs with tables in units of acceleration
JOINED = 0.01  #: smallest reported depth of a notch [dB]


@dataclass(frozen=True)
@checked_fields(ModelError)
class ResponseLimit:
    """An output and a level that it must not exceed.

    Parameters
    ----------
    output
        Name of an output: "mirror acceleration x", "base force z", "root stress von Mises".
    level
        Constant level over frequency, in the unit of the table.
    table
        Level over frequency; the unit "output" is that of `level`.
    rms
        Rms over the whole band, only for random tests.
    name
        Name of the limit, for the report.
    factor
        Factor on the response before the comparison.
    """

    output: str
    level: float | None = None
    table: Level | None = None
    rms: float | None = None
    name: str = ""
    factor: float = 1.0

    def __post_init__(self) -> None:
        given = [key for key in ("level", "table", "rms") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ModelError(
                f"notch {self.name or self.output!r}: expected one of level, table, rms, got "
                f"{', '.join(given) or 'none'}"
            )
        for value in (self.level, self.rms):
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ModelError(
                    f"notch {self.name or self.output!r}: no input satisfies a limit of {value!r}; "
                    "expected a number above 0"
                )
        if not (math.isfinite(self.factor) and self.factor > 0):
            raise ModelError(
                f"notch {self.name or self.output!r}: factor: expected a number above 0, got {self.factor!r}"
            )


@dataclass(frozen=True)
@checked_fields(ModelError)
class ForceLimit:
    """The semi-empirical limit of an interface force, in the driven direction or another one.

    Parameters
    ----------
    output
        Name of an output that is a force of a base: "base force z".
    C
        Factor C of the mounting structure, about sqrt(2) [-].
    frequency
        Frequency f_0 of the main mode [Hz]; None: the mode with the largest effective mass in the direction.
    exponent
        Exponent n above f_0, for densities; half of it for amplitudes.
    mass
        Mass M_0 in units of the model; None: that of the structure.
    name
        Name of the limit, for the report.
    """

    output: str
    C: float
    frequency: float | None = None
    exponent: float = 2.0
    mass: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        for key in ("C", "frequency", "mass"):
            value = getattr(self, key)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ModelError(f"notch {self.name or self.output!r}: {key}: expected a number above 0, got {value!r}")
        if not (math.isfinite(self.exponent) and self.exponent >= 0):
            raise ModelError(f"notch {self.name or self.output!r}: exponent: expected 0 or more, got {self.exponent!r}")


Limit = ResponseLimit | ForceLimit


@dataclass(frozen=True)
class Notch:
    """A frequency range in which one limit reduces the input."""

    first: float  #: lower end of the notch [Hz]
    last: float
    deepest: float  #: frequency of the largest depth [Hz]
    depth: float  #: largest depth [dB]
    reason: str  #: name of the limit
    output: str
    limit: float  #: limit at the largest depth, unit of the output (squared per Hz for a density)
    unnotched: float  #: value of the output without notch at the largest depth


@dataclass(frozen=True, eq=False)
class NotchedRun:
    """A notched input and the outputs for it."""

    frequencies: Array  #: frequencies of the test, (n_f,) [Hz]
    level: Array  #: specified level, (n_f,) [units of the model, squared per Hz for a density]
    notched: Array  #: level with notches, (n_f,), in the units of `level`
    sizes: Array  #: amplitudes or densities of the outputs, (n_f, n_out)
    notches: tuple[Notch, ...]
    rms: Array | None  #: rms of the outputs in a random test, (n_out,)
    input_rms: float | None  #: rms of the notched input in a random test
    #: limit over frequency by name, (n_f,); for an rms limit, the density at which the output is clipped
    limits: dict[str, Array]


def column_of(outputs: Sequence[Output], limit: Limit) -> int:
    """Return the column of the output of a limit; `ModelError` with the nearest name if there is none."""
    names = [output.name for output in outputs]
    if limit.output not in names:
        raise ModelError(
            f"notch {limit.name or limit.output!r}: no output {quoted(limit.output)}{nearest(limit.output, names)}"
        )
    return names.index(limit.output)


def in_output_units(model: ShakenModel, output: Output, value: float) -> float:
    """Return a limit, given with accelerations in g, in units of the model."""
    return value * model.gravity if output.kind == "acceleration" else value


def notched_sine(model: ShakenModel, run: SineRun, limits: Sequence[Limit], deepest: float = DEEPEST) -> NotchedRun:
    """Return the notched input of a sine run; the limits apply to the amplitudes with uncertainty.

    Raises
    ------
    ModelError
        If a limit requires a notch deeper than allowed, or is an rms, which only random tests have.
    """
    transfer, wide = run.sizes / run.level[:, None], run.uncertain / run.level[:, None]
    allowed, of = np.full((len(limits), len(run.frequencies)), np.inf), {}
    for k, limit in enumerate(limits):
        column = column_of(run.outputs, limit)
        if isinstance(limit, ResponseLimit):
            if limit.rms is not None:
                raise ModelError(f"notch {label(limit)!r}: an rms is a limit of random tests, not of sine {run.test!r}")
            value = limit_over(model, run.outputs[column], limit, run.frequencies) / limit.factor
        else:
            value = np.sqrt(force_limit(model, limit, run.direction, run.frequencies, run.level**2))
        of[label(limit)] = value
        allowed[k] = np.divide(value, wide[:, column], out=np.full_like(value, np.inf), where=wide[:, column] > 0)
    notched, which = lowered(run.level, allowed)
    decibels = 20 * np.log10(notched / run.level)
    found = stretches(
        run.frequencies,
        decibels,
        which,
        limits,
        of,
        [wide[:, column_of(run.outputs, limit)] * run.level for limit in limits],
    )
    require_possible(found, deepest, f"sine {run.test!r}, {run.direction}")
    return NotchedRun(run.frequencies, run.level, notched, transfer * notched[:, None], found, None, None, of)


def notched_random(model: ShakenModel, run: RandomRun, limits: Sequence[Limit], deepest: float = DEEPEST) -> NotchedRun:
    """Return the notched input of a random run of one direction; limits of density, then of rms.

    The limits apply to the densities with uncertainty; the returned densities and rms are nominal.
    """
    if run.level.shape[1] != 1:
        raise ModelError(
            f"notch: random {run.test!r} drives several inputs at once; expected one direction for notches"
        )
    f, level = run.band.frequencies, run.level[:, 0]
    transfer, wide = run.density / level[:, None], run.wide / level[:, None]
    allowed, of = np.full((len(limits), len(f)), np.inf), {}
    for k, limit in enumerate(limits):
        column = column_of(run.outputs, limit)
        own = wide[:, column]
        if isinstance(limit, ForceLimit):
            value = force_limit(model, limit, run.direction, f, level)
        elif limit.rms is not None:
            wanted = in_output_units(model, run.outputs[column], limit.rms) / limit.factor
            value = np.full(len(f), clipped_at(run, own * level, wanted))
        else:
            value = limit_over(model, run.outputs[column], limit, f, density=True) / limit.factor**2
        of[label(limit)] = value
        allowed[k] = np.divide(value, own, out=np.full_like(value, np.inf), where=own > 0)
    notched, which = lowered(level, allowed)
    decibels = 10 * np.log10(notched / level)
    found = stretches(
        f, decibels, which, limits, of, [wide[:, column_of(run.outputs, limit)] * level for limit in limits]
    )
    require_possible(found, deepest, f"random {run.test!r}, {run.direction}")
    sizes = transfer * notched[:, None]
    rms = np.sqrt(np.maximum(run.band.integral(sizes), 0.0))
    return NotchedRun(f, level, notched, sizes, found, rms, float(np.sqrt(run.band.integral(notched))), of)


def label(limit: Limit) -> str:
    """Return the name of a limit."""
    if limit.name:
        return limit.name
    return f"force limit of {limit.output}" if isinstance(limit, ForceLimit) else f"limit of {limit.output}"


def limit_over(model: ShakenModel, output: Output, limit: ResponseLimit, f: Array, *, density: bool = False) -> Array:
    """Return the limit at frequencies in units of the model, squared per Hz for a density; infinite outside its table.

    Raises
    ------
    ModelError
        If its table is for another quantity than the output, or for amplitudes although densities are limited.
    """
    scale = in_output_units(model, output, 1.0) ** (2 if density else 1)
    if limit.level is not None:
        return np.full(len(f), limit.level * scale)
    table = limit.table
    assert table is not None
    if table.unit == OF_OUTPUT:
        value = table.at(f) * scale
    else:
        if output.kind not in ACCELERATION_KINDS or table.is_density != density:
            wanted = "a density" if density else "an amplitude"
            raise ModelError(
                f"notch {label(limit)!r}: table: unit {table.unit}, expected {wanted} of {output.name!r} "
                f"[{output.unit}]; give the rows in the unit of the output, unit = {OF_OUTPUT!r}"
            )
        direction = "rx" if output.kind == "angular acceleration" else "x"
        value = table.in_si(f) * in_model(table, direction, model.units)
    return np.asarray(np.where(value > 0, value, np.inf))


def force_limit(model: ShakenModel, limit: ForceLimit, direction: str, f: Array, density: Array) -> Array:
    """Return the semi-empirical density of a force, (n_f,)."""
    k = model.inputs.index(direction)
    mass = float(model.mass[k, k]) if limit.mass is None else limit.mass
    f_0 = main_frequency(model, k) if limit.frequency is None else limit.frequency
    roll = np.where(f < f_0, 1.0, (f_0 / f) ** limit.exponent)
    return np.asarray(limit.C**2 * mass**2 * density * roll)


def main_frequency(model: ShakenModel, k: int) -> float:
    """Return the frequency of the mode with the largest effective mass for an input [Hz]."""
    return float(model.frequencies[int(np.argmax(model.B[2, :, k] ** 2))])


def clipped_at(run: RandomRun, density: Array, rms: float) -> float:
    """Return the density at which an output is clipped to satisfy its rms; infinite if it needs no clipping."""
    total = float(np.sqrt(run.band.integral(density)))
    if total <= rms:
        return math.inf
    top = float(density.max())

    def over(x: float) -> float:
        return float(np.sqrt(run.band.integral(np.minimum(density, top * math.exp(x))))) - rms

    if over(LOWEST) > 0:
        return top * math.exp(LOWEST)  # deeper notches are rejected anyway
    return top * math.exp(float(brentq(over, LOWEST, 0.0, xtol=1e-12)))


def lowered(level: Array, allowed: Array) -> tuple[Array, Array]:
    """Return the smallest of the level and the allowed levels, and the index of the limit (-1: none), (n_f,) each."""
    if not len(allowed):
        return level, np.full(len(level), -1)
    which = allowed.argmin(axis=0)
    least = allowed.min(axis=0)
    return np.minimum(level, least), np.where(least < level, which, -1)


def stretches(
    f: Array, decibels: Array, which: Array, limits: Sequence[Limit], of: dict[str, Array], free: Sequence[Array]
) -> tuple[Notch, ...]:
    """Return the notches: ranges of neighbouring frequencies with the same cause."""
    reason = np.where(decibels < -JOINED, which, -1)
    ends = np.flatnonzero(np.diff(reason)) + 1
    found = []
    for part in np.split(np.arange(len(f)), ends):
        k = int(reason[part[0]])
        if k < 0:
            continue
        at = part[int(np.argmin(decibels[part]))]
        limit = limits[k]
        found.append(
            Notch(float(f[part[0]]), float(f[part[-1]]), float(f[at]), float(-decibels[at]), label(limit), limit.output,
                  float(of[label(limit)][at]), float(free[k][at]))
        )  # fmt: skip
    return tuple(found)


def require_possible(notches: Sequence[Notch], deepest: float, where: str) -> None:
    """Raise `ModelError` if a notch is deeper than allowed."""
    worst = max(notches, key=lambda notch: notch.depth, default=None)
    if worst is not None and worst.depth > deepest:
        raise ModelError(
            f"{where}: {worst.reason} requires a notch of {worst.depth:.1f} dB at {worst.deepest:.4g} Hz (the "
            "output would reach "
            f"{worst.unnotched:.4g}, allowed {worst.limit:.4g}), more than the {deepest:g} dB that are allowed; "
            "check the "
            "limit and its unit, or raise deepest"
        )
