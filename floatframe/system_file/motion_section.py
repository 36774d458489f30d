"""Tables of the system file for functions of time: [joints.NAME.motions.COORDINATE]."""

from collections.abc import Callable
from inspect import signature
from typing import Any

from pydantic import Field, model_validator

from fe_models.foundation.toml_file import Table, choice
from fe_models.foundation.words import nearest
from floatframe.errors import ModelError
from floatframe.functions.time_functions import (
    TimeFunction,
    constant,
    cycloidal_spin_up,
    harmonic,
    piecewise,
    polynomial_of_time,
    smooth_step,
    table,
)
from floatframe.system_file.keys import Number, Numbers

__all__ = ["TIME_FUNCTIONS", "MotionSection"]

TIME_FUNCTIONS: dict[str, Callable[..., TimeFunction]] = {
    "constant": constant,
    "polynomial": polynomial_of_time,
    "harmonic": harmonic,
    "smooth-step": smooth_step,
    "cycloidal-spin-up": cycloidal_spin_up,
    "table": table,
    "piecewise": piecewise,
}


class MotionSection(Table):
    """A function of time by its type; the other keys are the parameters of that type."""

    type: choice("type of motion", lambda: tuple(TIME_FUNCTIONS)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(TIME_FUNCTIONS)}"
    )
    value: Number | None = Field(None, description="a number, the constant value")
    coefficients: Numbers | None = Field(None, description="a list of numbers, of 1, t, t² and so on")
    amplitude: Number | None = Field(None, description="a number, the amplitude")
    omega: Number | None = Field(None, description="a number, the angular frequency or speed in rad over time")
    phase: Number | None = Field(None, description="a number, the phase in rad; default 0")
    offset: Number | None = Field(None, description="a number, the mean value; default 0")
    t_start: Number | None = Field(None, description="a number, the time where the step begins")
    t_end: Number | None = Field(None, description="a number, the time where the step ends")
    first: Number | None = Field(None, description="a number, the value before the step")
    last: Number | None = Field(None, description="a number, the value after the step")
    duration: Number | None = Field(None, description="a number above 0, the duration of the spin-up")
    t: Numbers | None = Field(None, description="a list of rising times; piecewise: where each piece begins")
    values: Numbers | None = Field(None, description="a list of values, one for each time")
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
        try:
            self.function()
        except ModelError as error:
            raise ValueError(str(error)) from None
        return self

    def function(self) -> TimeFunction:
        """Return the function of the table."""
        make = TIME_FUNCTIONS[self.type]
        given: dict[str, Any] = {key: getattr(self, key) for key in signature(make).parameters}
        if self.pieces is not None:
            given["pieces"] = [piece.function() for piece in self.pieces]
        return make(**{key: value for key, value in given.items() if value is not None})
