"""A torque that controls the speed of a wheel: C = K ((target - omega) - lambda domega/dt)."""

from dataclasses import dataclass

from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.drives.shaft import Z_AXIS, check_shaft, required, time_functions
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.curves import function_at, function_numbers
from floatframe.model.elements.pairs import add_torque, direction_of, turning_speed
from floatframe.model.elements.unit_names import in_units, outputs_in
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["SpeedControl"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SpeedControl(Element):
    """Torque C = K ((target - omega) - lambda domega/dt) on marker b relative to marker a about an axis.

    omega is the angular velocity of b relative to a about `axis`. Its rate is obtained with a first-order filter, dx/dt
    = (omega - x)/filter_time, as (omega - x)/filter_time. The result is exact for changes that are slow compared with
    `filter_time`; for omega = sin(w t), it is wrong by the factor 1/(1 + i w filter_time). The filter starts at
    `speed`. Apart from the filter, lambda acts like a moment of inertia K lambda on the axis.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    target: TimeFunction | float  #: desired speed omega as a function of time [rad/s]
    gain: float  #: gain K [N m s]
    rate_time: float = 0.0  #: rate time lambda [s]
    #: time constant of the filter, required with lambda; usually at most lambda/10 [s]
    filter_time: float | None = None
    axis: GivenArray = given(Z_AXIS)  #: axis in axes of marker a, (3,)
    limit: float | None = None  #: largest torque in both directions [N m]; None: no limit
    speed: float = 0.0  #: initial speed omega, from which the filter starts [rad/s]

    def __post_init__(self) -> None:
        check_shaft(self)
        required(self, above=("gain", "filter_time", "limit"), at_least=("rate_time",), real=("speed",))
        time_functions(self, "target")
        if self.rate_time > 0 and self.filter_time is None:
            raise ModelError(
                f"element {self.name!r}: filter_time: missing; rate_time acts on a filtered rate: give a time above "
                f"0, such as {self.rate_time / 20:.3g}"
            )

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the control."""
        assert isinstance(self.target, TimeFunction)  # ensured by __post_init__
        has_state = self.rate_time > 0
        outputs = (("torque", "N m"), ("speed", "rad/s"), ("target", "rad/s"), ("power in", "W"))
        data = [self.gain, self.rate_time, self.filter_time or 0.0, self.limit or 0.0, *self.axis]
        return ElementLaw(
            function=speed_control_law,
            data=[*data, *function_numbers(self.target)],
            states=["filtered speed"] if has_state else [],
            start=[self.speed] if has_state else [],
            state_units=in_units(placed.units, ["rad/s"] if has_state else []),
            **outputs_in(placed.units, outputs),
            tangent="complex",
            acts=("moment", "moment"),
            power_in="power in",
        )


@njit
def speed_control_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the torque, the rate of the filtered speed and the outputs."""
    gain, rate_time, filter_time, limit = data[0], data[1], data[2], data[3]
    e = direction_of(x, 0, data, 4)
    omega = turning_speed(x, 0, 1, e)
    target = function_at(data, 7, t)
    torque = gain * (target - omega)
    if rate_time > 0.0:
        z_dot[0] = (omega - z[0]) / filter_time
        torque = torque - gain * rate_time * z_dot[0]
    if limit > 0.0:
        if torque.real > limit:
            torque = 0.0 * torque + limit
        elif torque.real < -limit:
            torque = 0.0 * torque - limit
    add_torque(wrench, 0, 1, torque, e)
    outputs[0], outputs[1], outputs[2], outputs[3] = torque, omega, target, torque * omega
