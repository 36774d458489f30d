"""The shake file: what `floatframe shake` reads (docs/shake.md)."""

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

import cms
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.arrays import Array
from fe_models.foundation.toml_file import Table, Vector3, choice, existing_file, kind_field, read_toml, validated
from floatframe.durability.shaking.loads.levels import ACCELERATIONS, OF_OUTPUT, Level, read_level
from floatframe.durability.shaking.loads.notching import DEEPEST, ForceLimit, Limit, ResponseLimit
from floatframe.durability.shaking.loads.pulses import DECAY, EDGE, PULSES, SHAPES, damped_sines, pulse, synthesised
from floatframe.durability.shaking.loads.random_vibration import CrossSpectrum, RandomTest
from floatframe.durability.shaking.loads.shock import SpectrumRequest, TimeTest
from floatframe.durability.shaking.loads.sine import SineTest
from floatframe.durability.shaking.loads.slopes import level_of_bands
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.responses.response_spectrum import KINDS
from floatframe.durability.shaking.shake import NotchRequest, ShakeJob
from floatframe.durability.shaking.structure.body import bases_of_body
from floatframe.durability.shaking.structure.damping import Damping
from floatframe.durability.shaking.structure.places import QUANTITIES, Observed
from floatframe.errors import ModelError, SignalError, SystemFileError
from floatframe.files.signals.read_signals import read_signals
from floatframe.files.signals.signal_units import unit_factor
from floatframe.files.signals.signals import Signal
from floatframe.files.system_file.read_system import read_system
from floatframe.model.system import System

__all__ = ["read_shake"]


def as_tuple(value: Any) -> Any:
    """Return a list of the file, and lists in it, as tuples."""
    return tuple(as_tuple(each) for each in value) if isinstance(value, list) else value


file_beside = existing_file()


def rows_or_file(value: Any, info: ValidationInfo) -> Any:
    """Return rows as tuples, bands unchanged, or the path of a file."""
    if isinstance(value, str):
        return file_beside(value, info)
    if isinstance(value, list) and value and all(isinstance(row, list) and len(row) == 3 for row in value):
        for number, (first, last, level) in enumerate(value, start=1):
            if not (is_number(first) and is_number(last) and (is_number(level) or isinstance(level, str))):
                raise ValueError(
                    f'band {number}: expected [from Hz, to Hz, level or "slope dB/oct"], got {[first, last, level]!r}'
                )
        return tuple(tuple(row) for row in value)
    return rows_of(2)(value)


def rows_of(length: int) -> Callable[[Any], tuple[tuple[float, ...], ...]]:
    """Return a function from a list to rows of finite numbers; `ValueError` with the invalid row."""

    def rows(value: Any) -> tuple[tuple[float, ...], ...]:
        if not isinstance(value, list | tuple):
            raise ValueError(f"expected a list of rows of {length} numbers, [[...], ...], got {value!r}")
        for number, row in enumerate(value, start=1):
            if not (isinstance(row, list | tuple) and len(row) == length and all(is_number(each) for each in row)):
                raise ValueError(f"row {number}: expected {length} finite numbers, [...], got {row!r}")
        return tuple(tuple(float(each) for each in row) for row in value)

    return rows


def is_number(value: Any) -> bool:
    """Whether an entry of the file is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


Number = float
Row2 = tuple[Number, Number]
Rows = Annotated[Any, BeforeValidator(rows_or_file)]  # rows of two numbers, bands of three entries, or a path
Names = Annotated[tuple[str, ...], BeforeValidator(as_tuple)]
ROWS = 'rows [Hz, level], bands [from Hz, to Hz, level or "slope dB/oct"], or the path of a file with two columns'


class BaseSection(Table):
    """[base] or [bases.NAME]."""

    interface: str | None = Field(None, description="the interface that the base holds")
    interfaces: Names = Field((), description="the interfaces that the base holds, a list of names")
    joints: Names = Field((), description="of a system: the joints, springs and bushings that the base moves")
    point: Vector3 | None = Field(None, description="the reference point, [x, y, z] in mesh coordinates")

    @model_validator(mode="after")
    def _one(self) -> "BaseSection":
        given = [key for key in ("interface", "interfaces", "joints") if getattr(self, key)]
        if len(given) > 1:
            raise ValueError(f"expected one of interface, interfaces, joints, got {' and '.join(given)}")
        return self

    def holds(self) -> tuple[str, ...]:
        """Return the interfaces or joints."""
        return (self.interface,) if self.interface is not None else self.interfaces or self.joints


class DampingSection(Table):
    """[damping]."""

    ratio: float | None = Field(
        None, description="a number from 0 to below 1, the ratio of critical damping of all modes"
    )
    Q: float | None = Field(None, description="a number above 0.5, the amplification 1/(2 ratio)")
    table: Annotated[tuple[Row2, ...], BeforeValidator(rows_of(2))] = Field((), description="rows [Hz, ratio]")
    bands: Annotated[tuple[tuple[float, float, float], ...], BeforeValidator(rows_of(3))] = Field(
        (), description="rows [from Hz, to Hz, ratio]"
    )
    modes: dict[str, float] = Field(default_factory=dict, description='ratios by mode number, { "1" = 0.02 }')
    own: bool = Field(False, description="true: the damping of the body or of the dampers of the system")
    heavy: bool = Field(False, description="true or false: whether ratios above 0.2 are intended")


class UncertaintySection(Table):
    """[uncertainty]."""

    factor: float = Field(1.0, description="a number of 1 or more, the factor on all responses")
    frequency: float = Field(0.0, description="a share from 0 to 0.5, the relative uncertainty of frequencies")
    bands: Annotated[tuple[tuple[float, float, float, float], ...], BeforeValidator(rows_of(4))] = Field(
        (), description="rows [from Hz, to Hz, factor, share]"
    )


class OutputSection(Table):
    """[outputs.NAME]."""

    interface: str | None = Field(None, description="the name of an interface")
    node: int | str | None = Field(None, description='the number of a node, or "INSTANCE.number"')
    element: int | str | None = Field(None, description="the number of an element: each of its kept nodes")
    set: str | None = Field(None, description="the name of a set: each of its kept nodes")
    position: Vector3 | None = Field(None, description="the position of a kept node, [x, y, z] in mesh coordinates")
    point: str | None = Field(None, description="the name of a stress point")
    quantities: Names = Field((), description=f"a list of {', '.join(QUANTITIES)}")
    body: str | None = Field(None, description="of a system: the name of the body")
    sensor: str | None = Field(None, description="of a system: the name of one of its sensors")
    recovery: str | None = Field(None, description="of a body: the name of a recovery table in its modal file")
    tolerance: Annotated[float, Field(ge=0)] = Field(
        TOLERANCE, description="a number of 0 or more: largest distance from position, relative to the body size"
    )


class SineSection(Table):
    """[sine.NAME]."""

    level: Rows = Field(description=ROWS)
    unit: str = Field("g", description="the unit of the level: g, m/s2, mm (amplitude of the displacement), ...")
    directions: Names = Field(("x", "y", "z"), description="a list of x, y, z, rx, ry, rz, or base:x")
    rate: float | None = Field(None, description="a number above 0, octaves per minute; default: steady")
    downward: bool = Field(False, description="true: from the last frequency to the first")


class InputLevel(Table):
    """A level of [random.NAME.inputs]."""

    level: Rows = Field(description=ROWS)
    unit: str | None = Field(None, description="the unit of the density; default: that of the test")


class CrossSection(Table):
    """An entry of cross in [random.NAME]."""

    a: str = Field(description="an input, base:x")
    b: str = Field(description="another input, base:x")
    coherence: float = Field(description="a number from 0 to 1, gamma squared")
    phase: float = Field(0.0, description="a number, degrees")


class RandomSection(Table):
    """[random.NAME]."""

    level: Rows | None = Field(None, description=ROWS)
    unit: str = Field("g2/Hz", description="the unit of the density: g2/Hz, (m/s2)2/Hz, ...")
    directions: Names = Field(("x", "y", "z"), description="a list of x, y, z, rx, ry, rz, or base:x")
    inputs: dict[str, InputLevel] = Field(default_factory=dict, description="levels by input, all at once")
    cross: Annotated[tuple[CrossSection, ...], BeforeValidator(as_tuple)] = Field(
        (), description="a list of { a, b, coherence, phase }"
    )
    duration: float | None = Field(None, description="a number above 0, seconds, for the expected largest value")


class ShockSection(Table):
    """[shock.NAME]."""

    pulse: choice("pulse", lambda: PULSES) | None = Field(None, description=f"one of {', '.join(PULSES)}")  # type: ignore[valid-type]
    amplitude: float | None = Field(None, description="a number, in unit")
    duration: float | None = Field(None, description="a number above 0, seconds")
    edge: float = Field(EDGE, description="a share up to 0.5, rise and fall of a trapezoid")
    srs: Rows | None = Field(None, description="rows [Hz, acceleration] of a target shock response spectrum, or a file")
    Q: float = Field(10.0, description="a number above 0.5, of that spectrum")
    shapes: choice("shapes", lambda: tuple(SHAPES)) = Field(  # type: ignore[valid-type]
        "wavelets", description=f"the shapes whose sum is the history of a spectrum, one of {', '.join(SHAPES)}"
    )
    decay: float | None = Field(None, description="a ratio from 0.005 to 0.5, of damped sines")
    file: Annotated[Path, BeforeValidator(file_beside)] | None = Field(None, description="a file with a time history")
    column: str | None = Field(None, description="the name of the acceleration in the file")
    unit: str = Field("g", description="the unit of the acceleration")
    directions: Names = Field(("x", "y", "z"), description="a list of x, y, z, rx, ry, rz, or base:x")
    after: float | None = Field(None, description="a number of 0 or more, seconds computed after the end")

    @model_validator(mode="after")
    def _one_way(self) -> "ShockSection":
        ways = [key for key in ("pulse", "srs", "file") if getattr(self, key) is not None]
        if len(ways) != 1:
            raise ValueError(f"expected one of pulse, srs, file, got {', '.join(ways) or 'none'}")
        if self.decay is not None and (self.srs is None or self.shapes != "damped-sines"):
            raise ValueError('decay belongs to an srs with shapes = "damped-sines"')
        if self.pulse is not None and (self.amplitude is None or self.duration is None):
            raise ValueError("a pulse needs amplitude and duration")
        return self


class TransientSection(Table):
    """[transient.NAME]: measured or computed histories, all at once."""

    file: Annotated[Path, BeforeValidator(file_beside)] = Field(
        description="a file with time histories: .csv, .mat, .rsp"
    )
    time: str | None = Field(None, description="the name of the column of times; default: found by its name")
    rate: float | None = Field(None, description="a number above 0, samples per second, if the file has no times")
    inputs: dict[str, str] = Field(
        description='columns of the file by input: "base:x", "interface:x" (a force), "load case NAME"'
    )
    unit: str | None = Field(None, description="the unit of the accelerations; default: that of the file")
    force_unit: str | None = Field(None, description="the unit of the forces; default: that of the file")
    after: float | None = Field(None, description="a number of 0 or more, seconds computed after the end")


class NotchSection(Table):
    """[notch.NAME]."""

    of: str = Field(description="the tests to notch: sine, random, sine.NAME or random.NAME")
    output: str = Field(description='the name of an output, such as "mirror acceleration z" or "base force z"')
    level: float | None = Field(
        None, description="a number above 0, g or the unit of the output (squared per Hz of a random test)"
    )
    table: Rows | None = Field(None, description=ROWS)
    rms: float | None = Field(None, description="a number above 0, of random tests: g or the unit of the output")
    C: float | None = Field(None, description="a number above 0: the semi-empirical force limit")
    frequency: float | None = Field(None, description="a number above 0, Hz, above which the force limit decreases")
    exponent: float = Field(2.0, description="a number of 0 or more, the exponent of its decrease")
    mass: float | None = Field(None, description="a number above 0, mass M_0; default: that of the structure")
    factor: float = Field(1.0, description="a number above 0, the factor on the response before the comparison")
    deepest: float = Field(DEEPEST, description="a number above 0, dB, the largest allowed depth of a notch")

    @field_validator("of")
    @classmethod
    def _kind(cls, value: str) -> str:
        if value.partition(".")[0] not in ("sine", "random"):
            raise ValueError("expected sine, random, sine.NAME or random.NAME")
        return value


class SpectraSection(Table):
    """[spectra]: shock response spectra of accelerations."""

    Q: Annotated[tuple[float, ...], BeforeValidator(as_tuple)] = Field(
        (10.0,), description="a list of numbers above 0.5"
    )
    kind: choice("spectrum", lambda: KINDS) = Field("acceleration", description=f"one of {', '.join(KINDS)}")  # type: ignore[valid-type]
    first: float | None = Field(None, description="a number above 0, Hz")
    last: float | None = Field(None, description="a number above 0, Hz")
    per_octave: Annotated[int, Field(ge=1, le=96)] = Field(12, description="a whole number from 1 to 96")


class ModesSection(Table):
    """[modes]."""

    residual_above: float | None = Field(None, description="a number above 0, Hz: modes above it respond statically")


class ShakeFile(Table):
    """A shake file."""

    kind: str = kind_field("shake")
    body: Annotated[Path, BeforeValidator(file_beside)] | None = Field(None, description="the path of a modal file")
    system: Annotated[Path, BeforeValidator(file_beside)] | None = Field(None, description="the path of a system file")
    units: str | None = Field(None, description="a unit system for numbers and results; default: that of the body")
    title: str = Field("", description="a title, text")
    base: str | BaseSection | None = Field(None, description="an interface, or a table [base]")
    bases: dict[str, BaseSection] = Field(default_factory=dict, description="tables [bases.NAME]")
    damping: DampingSection = Field(description="a table [damping]: ratio, Q, table, bands, modes or own")
    uncertainty: UncertaintySection = Field(default_factory=UncertaintySection, description="a table [uncertainty]")  # type: ignore[arg-type]
    modes: ModesSection = Field(default_factory=ModesSection, description="a table [modes]")  # type: ignore[arg-type]
    outputs: dict[str, OutputSection] = Field(default_factory=dict, description="tables [outputs.NAME]")
    sine: dict[str, SineSection] = Field(default_factory=dict, description="tables [sine.NAME]")
    random: dict[str, RandomSection] = Field(default_factory=dict, description="tables [random.NAME]")
    shock: dict[str, ShockSection] = Field(default_factory=dict, description="tables [shock.NAME]")
    transient: dict[str, TransientSection] = Field(default_factory=dict, description="tables [transient.NAME]")
    notch: dict[str, NotchSection] = Field(default_factory=dict, description="tables [notch.NAME]")
    spectra: SpectraSection = Field(default_factory=SpectraSection, description="a table [spectra]")  # type: ignore[arg-type]

    @model_validator(mode="after")
    def _fits(self) -> "ShakeFile":
        if (self.body is None) == (self.system is None):
            raise ValueError("expected either body, a modal file, or system, a system file")
        if self.base is not None and self.bases:
            raise ValueError("expected either base or tables [bases.NAME], got both")
        if not (self.sine or self.random or self.shock or self.transient):
            raise ValueError(
                "expected at least one table: [sine.NAME], [random.NAME], [shock.NAME] or [transient.NAME]"
            )
        return self


def read_shake(path: str | os.PathLike[str]) -> ShakeJob:
    """Read and check a shake file.

    Parameters
    ----------
    path
        Name of the shake file (TOML).

    Raises
    ------
    SystemFileError
        If the file is not valid; the message lists every problem, with key path, value, expected value and choices.
    ModelError
        If a level, limit or place is not valid.
    """
    path = Path(path)
    data = validated(ShakeFile, read_toml(path, SystemFileError), path, SystemFileError, context=path.parent)
    if data.body is not None:
        structure: cms.ReducedBody | System = cms.read(data.body, units=data.units)
    else:
        if data.units is not None:
            raise SystemFileError(f"{path}: units: only for a modal file; a system file states its own units")
        structure, _ = read_system(str(data.system))
    try:
        return job_of(data, structure)
    except ModelError as error:
        raise SystemFileError(f"{path}: {error}") from error


def job_of(data: ShakeFile, structure: cms.ReducedBody | System) -> ShakeJob:
    """Return the job of a checked file."""
    base, points = bases_of(data)
    if isinstance(structure, cms.ReducedBody):
        bases_of_body(structure, base, points)  # reports an unknown name before the errors that follow from it
    spectra = SpectrumRequest(
        data.spectra.Q, data.spectra.kind, data.spectra.first, data.spectra.last, data.spectra.per_octave
    )
    return ShakeJob(
        structure=structure,
        base=base,
        points=points,
        damping=damping_of(data.damping),
        outputs=tuple(
            Observed(name, **{key: getattr(each, key) for key in OutputSection.model_fields})
            for name, each in data.outputs.items()
        ),
        sine=tuple(
            SineTest(
                name, level_of(each.level, each.unit, f"sine.{name}: level"), each.directions, each.rate, each.downward
            )
            for name, each in data.sine.items()
        ),
        random=tuple(random_of(name, each) for name, each in data.random.items()),
        shock=(
            *(shock_of(name, each, spectra) for name, each in data.shock.items()),
            *(transient_of(data, name, spectra) for name in data.transient),
        ),
        notch=notches_of(data),
        uncertainty=Uncertainty(data.uncertainty.factor, data.uncertainty.frequency, data.uncertainty.bands),
        residual_above=data.modes.residual_above,
        title=data.title,
        source=str(data.body or data.system),
    )


def bases_of(data: ShakeFile) -> tuple[Any, dict[str, Any]]:
    """Return the bases and their points, as `ShakeJob` takes them."""
    if isinstance(data.base, str) or (data.base is None and not data.bases):
        return data.base, {}
    sections = dict(data.bases)
    if data.base is not None:
        sections[(data.base.holds() or ("base",))[0]] = data.base
    held = {name: section.holds() for name, section in sections.items()}
    points = {name: np.array(section.point) for name, section in sections.items() if section.point is not None}
    return (None if held == {"base": ()} else held), points


def damping_of(section: DampingSection) -> Damping:
    """Return the damping; `ModelError` if a mode is not given by its number."""
    for key in section.modes:
        if not key.isdecimal():
            raise ModelError(f"damping.modes.{key}: expected the number of a mode, from 1")
    modes = {int(key): value for key, value in section.modes.items()}
    return Damping(section.ratio, section.Q, section.table, section.bands, modes, section.own, section.heavy)


def level_of(rows: Any, unit: str, where: str) -> Level:
    """Return a level from rows, bands or a file."""
    if isinstance(rows, Path):
        return read_level(rows, unit, where)
    is_bands = bool(rows) and len(rows[0]) == 3
    return level_of_bands(rows, unit, where) if is_bands else Level.of(rows, unit, where)


def random_of(name: str, section: RandomSection) -> RandomTest:
    """Return a random test."""
    where = f"random.{name}"
    levels = {
        key: level_of(each.level, each.unit or section.unit, f"{where}.inputs.{key}: level")
        for key, each in section.inputs.items()
    }
    return RandomTest(
        name,
        None if section.level is None else level_of(section.level, section.unit, f"{where}: level"),
        section.directions,
        levels or None,
        tuple(CrossSpectrum(each.a, each.b, each.coherence, each.phase) for each in section.cross),
        section.duration,
    )


def shock_of(name: str, section: ShockSection, spectra: SpectrumRequest) -> TimeTest:
    """Return a shock."""
    where = f"shock.{name}"
    if section.unit not in ACCELERATIONS:
        raise ModelError(f"{where}: unit: expected one of {', '.join(ACCELERATIONS)}, got {section.unit!r}")
    si, synthesis = ACCELERATIONS[section.unit], None
    if section.pulse is not None:
        assert section.amplitude is not None and section.duration is not None  # noqa: PT018
        t, a = pulse(section.pulse, section.amplitude, section.duration, edge=section.edge)
        words = f"{section.pulse} of {section.amplitude:g} {section.unit}, {1e3 * section.duration:g} ms"
    elif section.srs is not None:
        target = level_of(section.srs, section.unit, f"{where}: srs")
        if section.shapes == "damped-sines":
            decay = DECAY if section.decay is None else section.decay
            synthesis = damped_sines(target, section.Q, section.duration, decay=decay)
        else:
            synthesis = synthesised(target, section.Q, section.duration)
        t, a = synthesis.time, synthesis.acceleration
        least, most = float(synthesis.decibels.min()), float(synthesis.decibels.max())
        words = (
            f"{section.shapes.replace('-', ' ')} made for a spectrum of Q = {section.Q:g}, met within {least:+.2f} to "
            f"{most:+.2f} dB"
        )
    else:
        assert section.file is not None
        signals = read_signals(section.file)
        if section.column is None and len(signals.names) != 1:
            raise ModelError(f"{where}: column: {section.file} has {', '.join(signals.names)}: name one")
        signal = signals[section.column or signals.names[0]]
        t, a = signal.time, in_si(signal, section.unit, "m/s^2", where) / si
        words = f"{signal.name} of {section.file.name}"
    return TimeTest(name, t, a * si, section.directions, None, section.after, spectra, "shock", words, synthesis)


def transient_of(data: ShakeFile, name: str, spectra: SpectrumRequest) -> TimeTest:
    """Return a transient: columns of a file as accelerations of bases and forces."""
    section, where = data.transient[name], f"transient.{name}"
    signals = read_signals(section.file, time=section.time, rate=section.rate)
    if not section.inputs:
        raise ModelError(f"{where}: inputs: expected one column at least, of {', '.join(signals.names)}")
    held = bases_of(data)[0]
    bases = {held} if isinstance(held, str) else set(held or ())
    values = {}
    for key, column in section.inputs.items():
        signal, place = signals[column], key.rpartition(":")[0]
        turns = key.rpartition(":")[2].startswith("r")
        if key.startswith("load case "):
            values[key] = np.asarray(signal.values)
        elif not place or place in bases or not bases:
            values[key] = in_si(signal, section.unit, "rad/s^2" if turns else "m/s^2", where)
        else:
            values[key] = in_si(signal, section.force_unit, "N m" if turns else "N", where)
    words = f"{', '.join(section.inputs.values())} of {section.file.name}"
    return TimeTest(name, signals.time, None, (), values, section.after, spectra, "transient", words)


def in_si(signal: Signal, unit: str | None, si: str, where: str) -> Array:
    """Return the values of a signal in an SI unit; `ModelError` if neither the file nor the table states a unit."""
    if unit is None and not signal.unit:
        raise ModelError(f"{where}: {signal.name}: the file states no unit; give unit")
    try:
        return np.asarray(signal.values) * unit_factor(unit or signal.unit, si)
    except SignalError as error:
        raise ModelError(
            f"{where}: {signal.name}: {error}; name the input as base:direction or interface:direction"
        ) from error


def notches_of(data: ShakeFile) -> tuple[NotchRequest, ...]:
    """Return the notches, grouped by tests and depth."""
    together: dict[tuple[str, float], list[Limit]] = {}
    for name, each in data.notch.items():
        kind, _, test = each.of.partition(".")
        known = data.sine if kind == "sine" else data.random
        if test and test not in known:
            raise ModelError(
                f"notch.{name}: of: no test {each.of!r}; choices: {', '.join(f'{kind}.{key}' for key in known)}"
            )
        if each.C is not None:
            if (each.level, each.table, each.rms) != (None, None, None):
                raise ModelError(f"notch.{name}: expected either C (a force limit) or level, table, rms")
            limit: Limit = ForceLimit(each.output, each.C, each.frequency, each.exponent, each.mass, name)
        else:
            table = None if each.table is None else level_of(each.table, OF_OUTPUT, f"notch.{name}: table")
            limit = ResponseLimit(each.output, each.level, table, each.rms, name, each.factor)
        together.setdefault((each.of, each.deepest), []).append(limit)
    return tuple(
        NotchRequest(tuple(limits), of.partition(".")[0], (of.partition(".")[2],) if "." in of else (), deepest)
        for (of, deepest), limits in together.items()
    )
