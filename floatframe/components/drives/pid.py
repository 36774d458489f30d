"""PID controllers with anti-windup, for drives: their data, and the law of their states."""

from dataclasses import dataclass

import numpy as np
from numba.extending import register_jitable

from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest
from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.elements.curves import function_at, function_numbers
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["ANTI_WINDUP", "Pid", "pid_law", "target_of"]

ANTI_WINDUP = ("none", "clamping", "back-calculation")
NONE, CLAMPING, BACK_CALCULATION = range(3)
#: width of the smooth transition at a limit, relative to the range between both limits; with a single limit, relative
#: to its magnitude or, if it is 0, to kp e plus the integral of ki e over one second
BAND = 1e-3
PROPORTIONAL, INTEGRAL, DERIVATIVE, FILTER, LOW, HIGH, MODE, TRACKING, WIDTH, TARGET = range(10)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Pid:
    """u = kp e + I + kd d, limited, with e = target - value, dI/dt = ki e, and d the filtered rate of e.

    d = (e - x)/filter_time with dx/dt = d. Without anti-windup, I would continue to grow while the output is limited:

    - "clamping": I is constant while the output is beyond a limit and e drives it further (blended over 1e-3 of the
      range);
    - "back-calculation": dI/dt = ki e + (u_limited - u)/tracking_time.
    """

    target: TimeFunction | float  #: desired value as a function of time
    kp: float  #: gain of the error [unit of the output over that of the controlled value]
    ki: float = 0.0  #: gain of the integral [1/s times the unit of kp]
    kd: float = 0.0  #: gain of the derivative [s times the unit of kp]
    filter_time: float | None = None  #: time constant of the derivative filter, required with kd [s]
    lower: float | None = None  #: lower limit of the output; None: no limit
    upper: float | None = None  #: upper limit of the output; None: no limit
    anti_windup: str = "clamping"  #: limit of the integral: "clamping" or "back-calculation"
    tracking_time: float | None = None  #: time constant of back-calculation (anti-windup) [s]
    integral: float = 0.0  #: initial value of the integral part I

    def __post_init__(self) -> None:
        for key in ("kp", "ki", "kd", "integral"):
            object.__setattr__(self, key, number(f"controller: {key}", getattr(self, key)))
        for key in ("filter_time", "tracking_time"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, number(f"controller: {key}", getattr(self, key), above=0.0))
        for key in ("lower", "upper"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, number(f"controller: {key}", getattr(self, key)))
        if not isinstance(self.target, TimeFunction):
            object.__setattr__(self, "target", constant(number("controller: target", self.target)))
        if self.anti_windup not in ANTI_WINDUP:
            raise ModelError(
                f"controller: anti_windup: expected one of {', '.join(ANTI_WINDUP)}, got {self.anti_windup!r}"
                f"{nearest(str(self.anti_windup), ANTI_WINDUP)}"
            )
        if self.kd != 0 and self.filter_time is None:
            raise ModelError("controller: filter_time: missing; kd acts on a filtered rate: give a time above 0")
        if self.anti_windup == "back-calculation" and self.ki != 0 and self.tracking_time is None:
            raise ModelError("controller: tracking_time: missing; back-calculation needs one, such as kp/ki")
        if self.lower is not None and self.upper is not None and self.upper <= self.lower:
            raise ModelError(f"controller: upper: expected a number above lower = {self.lower:g}, got {self.upper:g}")

    @property
    def states(self) -> list[str]:
        """Names of the states: I if ki is given, x if kd is given."""
        return [name for name, factor in (("integral", self.ki), ("filtered error", self.kd)) if factor != 0]

    def start(self, value: float, seen: str, output: str) -> list[tuple[str, str, float]]:
        """Return name, unit and initial value of each state at a given value, such that the derivative does not jump.

        seen, output: SI units of the controlled value and of the output.
        """
        assert isinstance(self.target, TimeFunction)  # ensured by __post_init__
        starts = {"integral": (output, self.integral), "filtered error": (seen, self.target(0.0) - value)}
        return [(name, *starts[name]) for name in self.states]

    def numbers(self, second: float) -> list[float]:
        """Return the data of `pid_law`; `second` is one second in the time unit of the system."""
        assert isinstance(self.target, TimeFunction)  # ensured by __post_init__
        huge = np.finfo(float).max
        limits = [-huge if self.lower is None else self.lower, huge if self.upper is None else self.upper]
        mode = ANTI_WINDUP.index(self.anti_windup) if self.lower is not None or self.upper is not None else NONE
        ends = [end for end in (self.lower, self.upper) if end is not None]
        size = max(ends) - min(ends) if len(ends) == 2 else abs(ends[0]) if ends else 0.0
        width = BAND * size if size > 0.0 else -BAND * (abs(self.kp) + abs(self.ki) * second)  # below 0: times |e|
        times = [self.filter_time or 0.0, *limits, mode, self.tracking_time or 0.0, width]
        return [self.kp, self.ki, self.kd, *times, *function_numbers(self.target)]


@register_jitable
def margin(x, band):
    """Return 0 for x <= 0 and 1 for x >= band, smooth in between."""
    if x.real <= 0.0:
        return 0.0 * x
    if x.real >= band.real:
        return 0.0 * x + 1.0
    y = x / band
    return y * y * (3.0 - 2.0 * y)


@register_jitable
def target_of(t, data, at):
    """Return the target of the controller whose data begin at data[at]."""
    return function_at(data, at + TARGET, t)


@register_jitable
def pid_law(t, value, data, at, z, z_dot, first):
    """Return the output of the controller whose data begin at data[at]; write its state rates from index `first` on."""
    e = target_of(t, data, at) - value
    u = data[at + PROPORTIONAL] * e
    state = first
    ki, kd = data[at + INTEGRAL], data[at + DERIVATIVE]
    if ki != 0.0:
        u = u + z[state]
        state += 1
    if kd != 0.0:
        d = (e - z[state]) / data[at + FILTER]
        z_dot[state] = d
        u = u + kd * d
    low, high = data[at + LOW], data[at + HIGH]
    limited = u
    if u.real < low:
        limited = 0.0 * u + low
    elif u.real > high:
        limited = 0.0 * u + high
    if ki != 0.0:
        rate = ki * e
        if data[at + MODE] == CLAMPING:
            width = data[at + WIDTH]
            if width < 0.0:
                width = -width * (e if e.real > 0.0 else -e)
            rate = rate * (margin(high - u, width) if rate.real > 0.0 else margin(u - low, width))
        elif data[at + MODE] == BACK_CALCULATION:
            rate = rate + (limited - u) / data[at + TRACKING]
        z_dot[first] = rate
    return limited
