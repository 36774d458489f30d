"""Tables of the system file for functions of time: [joints.NAME.motions.COORDINATE]."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from inspect import signature
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.toml_file import Table, choice
from fe_models.foundation.words import nearest
from floatframe.errors import ModelError, SignalError
from floatframe.files.system_file.keys import Name, Number, Numbers
from floatframe.files.system_file.signal_section import SignalFunction, function_named
from floatframe.model.functions.path_motions import rest_to_rest_spline
from floatframe.model.functions.point_to_point import quintic, trapezoid
from floatframe.model.functions.tables import INTERPOLATIONS, acceleration_table, interpolated, overshoot
from floatframe.model.functions.time_functions import (
    TimeFunction,
    constant,
    cycloidal_spin_up,
    harmonic,
    piecewise,
    polynomial_of_time,
    smooth_step,
)

__all__ = ["TIME_FUNCTIONS", "MotionSection", "overshoot_notes", "require_quantity"]


def measured_signal(signal: TimeFunction, factor: float = 1.0) -> TimeFunction:
    """Return a measured signal multiplied by a factor."""
    pieces = signal.pieces.copy()
    pieces[:, :7] *= factor
    return replace(signal, pieces=pieces)


TIME_FUNCTIONS: dict[str, Callable[..., TimeFunction]] = {
    "constant": constant,
    "polynomial": polynomial_of_time,
    "harmonic": harmonic,
    "smooth-step": smooth_step,
    "quintic": quintic,
    "trapezoid": trapezoid,
    "spline": rest_to_rest_spline,
    "cycloidal-spin-up": cycloidal_spin_up,
    "table": interpolated,
    "acceleration-table": acceleration_table,
    "signal": measured_signal,
    "piecewise": piecewise,
}


class MotionSection(Table):
    """A function of time of a given type; the other keys are the parameters of that type."""

    type: choice("type of motion", lambda: tuple(TIME_FUNCTIONS)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(TIME_FUNCTIONS)}"
    )
    value: Number | None = Field(None, description="a number, the constant value")
    coefficients: Numbers | None = Field(None, description="a list of numbers, the coefficients of 1, t, t² and so on")
    amplitude: Number | None = Field(None, description="a number, the amplitude")
    omega: Number | None = Field(None, description="a number, the angular frequency or speed in rad per unit of time")
    phase: Number | None = Field(None, description="a number, the phase in rad; default 0")
    offset: Number | None = Field(None, description="a number, the mean value; default 0")
    t_start: Number | None = Field(None, description="a number, the time where the step begins")
    t_end: Number | None = Field(None, description="a number, the time where the step ends")
    first: Number | None = Field(None, description="a number, the value before the step")
    last: Number | None = Field(None, description="a number, the value after the step")
    first_velocity: Number | None = Field(None, description="a number, the velocity at the beginning; default 0")
    last_velocity: Number | None = Field(None, description="a number, the velocity at the end; default 0")
    first_acceleration: Number | None = Field(None, description="a number, the acceleration at the start; default 0")
    last_acceleration: Number | None = Field(None, description="a number, the acceleration at the end; default 0")
    speed: Number | None = Field(None, description="a number above 0, the largest speed")
    acceleration: Number | None = Field(None, description="a number above 0, the largest acceleration")
    deceleration: Number | None = Field(None, description="a number above 0; default: as the acceleration")
    degree: int | None = Field(None, description="3 or 5, the degree of the spline; default 3")
    duration: Number | None = Field(None, description="a number above 0, the duration of the motion")
    t: Numbers | None = Field(None, description="a list of rising times; piecewise: where each piece begins")
    values: Numbers | None = Field(None, description="a list of values, one for each time")
    interpolation: choice("interpolation", lambda: tuple(INTERPOLATIONS)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(INTERPOLATIONS)}; default cubic"
    )
    position: Number | None = Field(None, description="a number, the position at the first time; default 0")
    velocity: Number | None = Field(None, description="a number, the velocity at the first time; default 0")
    signal: Name | None = Field(None, description="the name of a table [signals.NAME]")
    factor: Number | None = Field(None, description="a factor on the signal; default 1")
    pieces: list["MotionSection"] | None = Field(
        None, description="a list of tables, a function of the time since its beginning for each time of t"
    )

    @model_validator(mode="after")
    def _fits_the_type(self) -> "MotionSection":
        allowed = signature(TIME_FUNCTIONS[self.type]).parameters
        for key in type(self).model_fields:
            if key != "type" and getattr(self, key) is not None and key not in allowed:
                raise ValueError(f"a {self.type} motion has no key {key}{nearest(key, allowed)}")
        for key, parameter in allowed.items():
            if parameter.default is parameter.empty and getattr(self, key) is None:
                raise ValueError(f"{key}: missing; expected {type(self).model_fields[key].description}")
        if any(True for _ in self.signals()):  # signals are resolved once the whole file is read
            return self
        try:
            self.function()
        except ModelError as error:
            raise ValueError(str(error)) from None
        return self

    def signals(self) -> Iterator[str]:
        """Yield the names of the signals that the function contains, including those in its pieces."""
        if self.signal is not None:
            yield self.signal
        for piece in self.pieces or ():
            yield from piece.signals()

    def function(self, signals: Mapping[str, SignalFunction] | None = None) -> TimeFunction:
        """Return the function of the table; `signals` are those of the system file, by name."""
        make = TIME_FUNCTIONS[self.type]
        given: dict[str, Any] = {key: getattr(self, key) for key in signature(make).parameters}
        if self.pieces is not None:
            given["pieces"] = [piece.function(signals) for piece in self.pieces]
        if self.signal is not None:
            given["signal"] = function_named(self.signal, signals or {}).function
        return make(**{key: value for key, value in given.items() if value is not None})


OVERSHOOT = 0.1  #: largest overshoot of a table without a note, relative to the range of its values


def overshoot_notes(section: Any, place: str = "") -> Iterator[str]:
    """Yield a note on each table within a section whose spline, if none is chosen, leaves the range of its values."""
    if isinstance(section, MotionSection) and section.type == "table" and section.interpolation is None:
        t, values = np.array(section.t), np.array(section.values)
        size, where = overshoot(section.function(), t, values)
        if size > OVERSHOOT:
            yield (
                f"{place}: its cubic spline leaves the range of the values by {100 * size:.3g} % of it, at "
                f'{where:.4g}; interpolation = "monotone" stays within, "cubic" ends this note'
            )
    inside = dict(section) if isinstance(section, Mapping | Table) else {}
    if isinstance(section, list | tuple):
        inside = {str(k): each for k, each in enumerate(section)}
    for key, each in inside.items():
        yield from overshoot_notes(each, f"{place}.{key}".removeprefix("."))


def require_quantity(
    where: str, section: MotionSection, signals: Mapping[str, SignalFunction] | None, expected: tuple[str, ...]
) -> None:
    """Raise `SignalError` if a table uses a signal of another quantity than expected."""
    for name in section.signals():
        found = function_named(name, signals or {}).quantity
        if found not in expected:
            hint = "; integrate = true makes a motion of an acceleration" if found.endswith("acceleration") else ""
            raise SignalError(f"{where}: expected {' or '.join(expected)}, but signal {name!r} is: {found}{hint}")
