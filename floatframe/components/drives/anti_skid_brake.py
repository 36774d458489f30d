"""A wheel brake with anti-skid control: a valve adapts the pressure to the wheel speed."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numba.extending import register_jitable

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import RATE, TIME, Quantity
from floatframe.components.drives.shaft import check_shaft, required, time_functions
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.curves import function_at, function_numbers
from floatframe.model.elements.pairs import add_torque, direction_of, turning_speed
from floatframe.model.elements.smooth import larger, smaller
from floatframe.model.elements.unit_names import in_units, outputs_in
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["AntiSkidBrake"]

LAG = Quantity(0.02, TIME)
SENSOR_TIME = Quantity(5e-3, TIME)
FRICTION_SPEED = Quantity(0.5, RATE)

Y_AXIS = (0.0, 1.0, 0.0)
OUTPUTS = (
    ("torque", "N m"), ("pressure", "Pa"), ("pilot pressure", "Pa"), ("speed", "rad/s"), ("wheel speed", "m/s"),
    ("reference speed", "m/s"), ("slip", "1"), ("skid", "1"), ("power lost", "W"),
)  # fmt: skip
PILOT = 17  #: index in the data of the pilot's pressure


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class AntiSkidBrake(Element):
    """Brake torque on marker b relative to marker a about an axis, with a valve that releases a skidding wheel.

    omega is the angular velocity of b relative to a, omega_s the measured one, v_w = R omega_s with the rolling radius
    R:

    (1) sensor: d omega_s/dt = (omega - omega_s)/sensor_time
    (2) reference speed: dv/dt = (v_w - v)/reference_time, where v decreases at most by `reference_deceleration`, like
        the speed of the vehicle; a faster decrease is attributed to the wheel
    (3) slip s = (v - v_w)/max(v, drop_out); skid e = the larger of (s - slip)/slip_band and, if `deceleration` is
        given, (-dv_w/dt - deceleration)/deceleration_band
    (4) valve: dp_v/dt = build_rate for e <= -1, falls linearly to zero at e = 0, and on to -release_rate for e >= 1;
        p_v stays between zero and the pilot's pressure (it approaches these limits with `time_constant`)
    (5) brake: dp/dt = (p_v - p)/time_constant, torque -gain p tanh(omega/friction_speed)

    For reference speeds between drop_out/2 and `drop_out`, a cubic blends (4) out, so that the vehicle can stop. With
    `anti_skid = False`, (4) never acts.
    """

    name: str
    marker_a: Marker  #: marker on the brake support
    marker_b: Marker  #: marker on the wheel
    pressure: TimeFunction | float  #: pilot's pressure above ambient, a function of time [Pa]
    gain: float  #: brake gain: torque divided by pressure [m³]
    build_rate: float  #: rate at which the valve builds up pressure [Pa/s]
    release_rate: float  #: rate at which the valve releases pressure [Pa/s]
    radius: float  #: rolling radius R of the wheel [m]
    slip: float  #: slip threshold above which the valve releases
    slip_band: float  #: half width of the slip range around the threshold in which the valve opens and closes
    reference_deceleration: float  #: largest assumed deceleration of the vehicle [m/s²]
    drop_out: float  #: reference speed below which anti-skid is off [m/s]
    deceleration: float | None = None  #: threshold of the rim deceleration [m/s²]; None: only slip is used
    deceleration_band: float | None = None  #: half width of the range around this threshold, required with it [m/s²]
    reference_time: float = LAG  #: time constant with which the reference speed follows a faster wheel [s]
    sensor_time: float = SENSOR_TIME  #: time constant of the sensor [s]
    time_constant: float = LAG  #: time constant of valve and brake [s]
    friction_speed: float = FRICTION_SPEED  #: speed scale of the disc friction [rad/s]; a locked wheel creeps below it
    speed: float = 0.0  #: initial speed of the wheel [rad/s]
    anti_skid: bool = True  #: whether the valve releases pressure before the wheel locks
    axis: GivenArray = given(Y_AXIS)  #: in the axes of marker a, (3,)

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        check_shaft(self)
        above = ("gain", "build_rate", "release_rate", "radius", "slip", "slip_band", "reference_deceleration")
        times = ("reference_time", "sensor_time", "time_constant", "friction_speed")
        required(self, above=(*above, "drop_out", "deceleration", "deceleration_band", *times), real=("speed",))
        time_functions(self, "pressure")
        if self.slip >= 1:
            raise ModelError(
                f"{where}: slip: expected a threshold below 1, the slip of a locked wheel, got {self.slip:g}"
            )
        if (self.deceleration is None) != (self.deceleration_band is None):
            raise ModelError(f"{where}: expected deceleration and deceleration_band, or neither of them")
        if not isinstance(self.anti_skid, bool):
            raise ModelError(f"{where}: anti_skid: expected True or False, got {self.anti_skid!r}")

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the brake."""
        assert isinstance(self.pressure, TimeFunction)  # ensured by __post_init__
        pressure = float(self.pressure.at(np.zeros(1))[0])
        number(f"element {self.name!r}: pressure at the start", pressure, at_least=0.0)
        data = [self.gain, self.build_rate, self.release_rate, self.radius, self.slip, self.slip_band]
        data += [self.reference_deceleration, self.drop_out, self.deceleration or 0.0, self.deceleration_band or 0.0]
        data += [self.reference_time, self.sensor_time, self.time_constant, self.friction_speed, *self.axis]
        start = [self.speed, self.radius * self.speed, pressure, pressure]
        size = self.build_rate * self.time_constant
        return ElementLaw(
            function=anti_skid_brake_law if self.anti_skid else brake_law,
            data=[*data, *function_numbers(self.pressure)],
            states=["sensed speed", "reference speed", "valve pressure", "pressure"],
            start=start,
            state_units=in_units(placed.units, ["rad/s", "m/s", "Pa", "Pa"]),
            state_sizes=[self.drop_out / self.radius, self.drop_out, size, size],
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("moment", "moment"),
            power_lost="power lost",
        )


@register_jitable
def part(x):
    """Return x clamped to 0 .. 1."""
    return 0.0 * x if x.real < 0.0 else (1.0 + 0.0 * x if x.real > 1.0 else x)


@register_jitable
def hyperbolic_tangent(x):
    """Return tanh(x), by a formula that is valid for large and complex numbers."""
    y = x if x.real >= 0.0 else -x
    h = np.exp(-2.0 * y)
    value = (1.0 - h) / (1.0 + h)
    return value if x.real >= 0.0 else -value


@register_jitable
def brake(t, x, z, data, wrench, z_dot, outputs, is_watched):
    """Write torque, rates and outputs; steps (1) to (5) of `AntiSkidBrake`."""
    gain, build, release, R, slip, slip_band = data[0], data[1], data[2], data[3], data[4], data[5]
    falling, drop_out, deceleration, band = data[6], data[7], data[8], data[9]
    lag = data[12]
    e = direction_of(x, 0, data, 14)
    omega = turning_speed(x, 0, 1, e)
    z_dot[0] = (omega - z[0]) / data[11]  # (1)
    v_w = R * z[0]
    v = z[1]
    z_dot[1] = larger((v_w - v) / data[10], 0.0 * v - falling)  # (2)
    s = (v - v_w) / larger(v, 0.0 * v + drop_out)  # (3)
    skid = (s - slip) / slip_band
    if band > 0.0:
        skid = larger(skid, (-R * z_dot[0] - deceleration) / band)
    rate = build + 0.0 * skid  # (4)
    if is_watched:
        k = part(2.0 * v / drop_out - 1.0)
        k = k * k * (3.0 - 2.0 * k)
        rate = k * (build * part(-skid) - release * part(skid)) + (1.0 - k) * build
    pilot = function_at(data, PILOT, t)
    z_dot[2] = larger(smaller(rate, (pilot - z[2]) / lag), -z[2] / lag)
    z_dot[3] = (z[2] - z[3]) / lag  # (5)
    torque = -gain * z[3] * hyperbolic_tangent(omega / data[13])
    add_torque(wrench, 0, 1, torque, e)
    outputs[0], outputs[1], outputs[2], outputs[3], outputs[4] = torque, z[3], pilot, omega, v_w
    outputs[5], outputs[6], outputs[7], outputs[8] = v, s, skid, -torque * omega


@njit
def anti_skid_brake_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write torque, rates and outputs of a brake with anti-skid."""
    brake(t, x, z, data, wrench, z_dot, outputs, True)


@njit
def brake_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write torque, rates and outputs of a brake that follows only the pilot's pressure."""
    brake(t, x, z, data, wrench, z_dot, outputs, False)
