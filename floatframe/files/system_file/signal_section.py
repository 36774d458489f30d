"""Tables of the system file for measured signals: [signals.NAME]."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fe_models.foundation.toml_file import Table, choice, existing_file
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.drift import DRIFTS, without_drift
from floatframe.files.signals.read_signals import SIGNAL_FORMATS, read_signals
from floatframe.files.signals.resampling import filtered, resampled
from floatframe.files.signals.signal_units import STANDARD_GRAVITY, SignalUnit, parsed_unit, signal_unit, system_factor
from floatframe.files.signals.signals import Signal
from floatframe.files.system_file.keys import Name, NotNegative, Number, Positive
from floatframe.model.functions.tables import INTERPOLATIONS, acceleration_table
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["SignalFunction", "SignalSection", "function_named", "signal_functions"]

#: quantities that are motions: their tables are quintic by default, those of others linear
SMOOTH = ("length", "angle")
INTEGRATED = {"acceleration": "length", "angular acceleration": "angle"}
NEAR = 0.02  #: relative difference from the gravity up to which a mean value suggests another unit
CHANNEL = "a name or a number from 1, the channel"


@dataclass(frozen=True)
class SignalFunction:
    """A measured signal as a function of time in the units of a system, with its quantity."""

    name: str
    function: TimeFunction
    quantity: str  #: "length", "angle", "force", ...
    notes: tuple[str, ...]  #: operations applied to the signal


class SignalSection(Table):
    """[signals.NAME]: a channel of a file as a function of time."""

    file: Annotated[Path, BeforeValidator(existing_file("file with signals"))] = Field(
        description=f"the path of a file with signals ({', '.join(SIGNAL_FORMATS)})"
    )
    channel: Annotated[str | int | None, Field(description=CHANNEL)] = None
    column: Annotated[str | int | None, Field(description=CHANNEL)] = None
    unit: str | None = Field(None, description='the unit of its numbers, such as "mm", "g" or "kN"; "-" for a number')
    time: Name | None = Field(None, description="the name of the column with the times")
    rate: Positive | None = Field(None, description="a number above 0, samples per second of a file without times")
    decimal: choice("decimal sign", lambda: (".", ",")) | None = Field(  # type: ignore[valid-type]
        None, description='"." or ","'
    )
    delimiter: str | None = Field(None, description="the separator of columns")
    fill: NotNegative = Field(0.0, description="a number, 0 or more, the longest gap in seconds that is filled")
    scale: Number = Field(1.0, description="a number by which its values are multiplied")
    offset: Number = Field(0.0, description="a number in its unit that is then added")
    low_pass: Positive | None = Field(None, description="a number above 0, the corner of a low-pass in Hz")
    high_pass: Positive | None = Field(None, description="a number above 0, the corner of a high-pass in Hz")
    resample: Positive | None = Field(None, description="a number above 0, the new rate in Hz")
    t_start: Number | None = Field(
        None, description="a number, the time of the first sample; default: that in the file"
    )
    interpolation: choice("interpolation", lambda: tuple(INTERPOLATIONS)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(INTERPOLATIONS)}"
    )
    integrate: bool = Field(False, description="true: an acceleration is integrated twice, exactly, into a motion")
    drift: choice("way with drift", lambda: tuple(DRIFTS)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(DRIFTS)}"
    )
    corner: Positive | None = Field(None, description='a number above 0, the corner in Hz of drift = "high-pass"')
    position: Number | None = Field(None, description="a number, the position at the first sample; default 0")
    velocity: Number | None = Field(None, description="a number, the velocity at the first sample; default 0")

    @model_validator(mode="after")
    def _fits_together(self) -> "SignalSection":
        if self.channel is not None and self.column is not None:
            raise ValueError("expected channel or column, which are the same, got both")
        if self.integrate and self.interpolation is not None:
            raise ValueError("interpolation: an acceleration that is integrated is linear between samples; remove it")
        for key in ("drift", "corner", "position", "velocity"):
            if not self.integrate and getattr(self, key) is not None:
                raise ValueError(f"{key}: belongs to integrate = true")
        return self

    def signal(self, name: str) -> Signal:
        """Return the channel with its unit, filtered and resampled as the table specifies."""
        signals = read_signals(
            self.file, time=self.time, rate=self.rate, fill=self.fill, uneven=self.resample is not None,
            decimal=self.decimal, delimiter=self.delimiter,
        )  # fmt: skip
        chosen = self.channel if self.channel is not None else self.column
        if chosen is None and len(signals) > 1:
            raise SignalError(
                f"{self.file} has {len(signals)} channels; name one, channel = ...{nearest('', signals.names)}"
            )
        found = signals[1 if chosen is None else chosen]
        unit = agreed_unit(f"{self.file}: channel {quoted(found.name)}", found.unit, self.unit)
        values = self.scale * found.values + self.offset
        found = replace(found, name=name, values=values, unit=unit, notes=(*found.notes, *doubts(values, unit)))
        if self.resample is not None and found.step is None:
            found = resampled(found, self.resample)[0]
        if self.low_pass is not None or self.high_pass is not None:
            found = filtered(found, low_pass=self.low_pass, high_pass=self.high_pass)
        if self.resample is not None and (found.step is None or abs(found.rate - self.resample) > 1e-9 * found.rate):
            found = resampled(found, self.resample)[0]
        return found

    def function(self, name: str, units: Units) -> SignalFunction:
        """Return the function of time in a unit system, with angles in rad."""
        signal = self.signal(name)
        where = f"{self.file}: channel {quoted(signal.name)}"
        quantity = signal_unit(signal.unit, where).quantity
        if self.integrate:
            signal = without_drift(signal, self.drift or "none", self.corner)
        t = signal.time / units.time
        if self.t_start is not None:
            t = t - t[0] + self.t_start
        values = signal.values * system_factor(signal.unit, units, where)
        if not self.integrate:
            kind = self.interpolation or ("quintic" if quantity in SMOOTH and len(t) >= 6 else "linear")
            return SignalFunction(name, INTERPOLATIONS[kind](t, values), quantity, signal.notes)
        function = acceleration_table(t, values, self.position or 0.0, self.velocity or 0.0)
        end = t[-1:]
        note = (
            f"integrated twice: at its end, t = {end[0]:.6g} {units.time_symbol}, position "
            f"{function.at(end)[0]:.6g} and velocity {function.at(end, 1)[0]:.6g} in units of the system"
        )
        return SignalFunction(name, function, INTEGRATED[quantity], (*signal.notes, note))


def agreed_unit(where: str, stated: str, given: str | None) -> str:
    """Return the unit of a channel, as its file or the table states it; `SignalError` if the two disagree.

    No unit is guessed: if neither states one, `SignalError` is raised.
    """
    if given is None:
        if not stated:
            raise SignalError(f'{where}: the file states no unit; expected unit = "m/s^2", "g", "mm", ... or "-"')
        signal_unit(stated, where)
        return stated
    wanted, known = signal_unit(given, where), parsed_unit(stated) if stated else None
    if known is not None and not same_unit(known, wanted):
        raise SignalError(
            f"{where}: the file states {stated} ({known.quantity}, {known.factor:g} in SI units), the table {given} "
            f"({wanted.quantity}, {wanted.factor:g}); remove unit, or correct the file"
        )
    return given


def same_unit(a: SignalUnit, b: SignalUnit) -> bool:
    """Return whether two units are equal within rounding."""
    return a.exponents == b.exponents and abs(a.factor / b.factor - 1) < 1e-6


def doubts(values: Any, unit: str) -> tuple[str, ...]:
    """Return a note if the mean of an acceleration equals the gravity in another unit than the stated one."""
    known = parsed_unit(unit)
    if known is None or known.quantity != "acceleration":
        return ()
    mean = abs(float(np.mean(values)))
    for word, factor in (("m/s^2", 1.0), ("g", STANDARD_GRAVITY), ("mm/s^2", 1e-3)):
        other = SignalUnit(factor, known.exponents)
        if not same_unit(other, known) and abs(mean * factor / STANDARD_GRAVITY - 1) < NEAR:
            return (f"its mean is {mean:.4g} {unit}, which is the gravity if the numbers are in {word}: are they?",)
    return ()


def signal_functions(sections: Mapping[str, SignalSection], units: Units) -> dict[str, SignalFunction]:
    """Return the functions of the tables, by name; `SignalError` names the table."""
    functions = {}
    for name, section in sections.items():
        try:
            functions[name] = section.function(name, units)
        except SignalError as error:
            raise SignalError(f"signals.{name}: {error}") from error
    return functions


def function_named(name: str, signals: Mapping[str, SignalFunction]) -> SignalFunction:
    """Return a function by name; `SignalError` with the nearest name if there is no such table."""
    if name not in signals:
        raise SignalError(f"signal {quoted(name)}: there is no table [signals.{name}]{nearest(name, signals)}")
    return signals[name]
