"""A direct current motor on a shaft, with the armature current as a state and a voltage or controller as supply."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import RATE, Quantity
from floatframe.components.drives.pid import Pid, pid_law
from floatframe.components.drives.shaft import (
    Z_AXIS,
    check_controller,
    check_shaft,
    required,
    shaft_numbers,
    time_functions,
)
from floatframe.components.drives.turns import turned_angle
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.curves import function_at, function_numbers
from floatframe.model.elements.pairs import add_torque, direction_of, turning_speed
from floatframe.model.elements.unit_names import outputs_in, states_in
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["DcMotor"]

FRICTION_SPEED = Quantity(1.0, RATE)

#: quantities that a controller can control, with their units
CONTROLLED = {"speed": "rad/s", "angle": "rad", "current": "A"}
BY_FUNCTION, SPEED, ANGLE, CURRENT = range(4)
SUPPLY = 18  #: index in the data of the voltage or of the controller
OUTPUTS = (
    ("current", "A"), ("voltage", "V"), ("torque", "N m"), ("speed", "rad/s"), ("angle", "rad"), ("power in", "W"),
    ("power lost", "W"), ("power out", "W"), ("energy", "J"),
)  # fmt: skip


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class DcMotor(Element):
    """Torque k i on marker b (rotor) relative to marker a (stator) about an axis; L di/dt = u - R i - k ratio omega.

    omega is the angular velocity of b relative to a about `axis`. With a gear, the motor rotates `ratio` times as fast,
    and its torque on b, minus friction, is multiplied by `ratio`. The voltage u is a function of time, or the output of
    a controller for `controlled`: the speed omega, the angle (zero as assembled, counted through full turns) or the
    current.

    Raises
    ------
    ModelError
        If neither or both of a voltage and a controller are given.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    resistance: float  #: resistance R of the armature [ohm]
    inductance: float  #: inductance L of the armature [H]
    constant: float  #: motor constant k: torque divided by current, or voltage divided by speed [N m/A = V s/rad]
    voltage: TimeFunction | float | None = None  #: voltage u as a function of time [V]
    controller: Pid | None = None  #: controller of u, in place of `voltage`
    controlled: str = "speed"  #: quantity that the controller controls: "speed", "angle" or "current"
    axis: GivenArray = given(Z_AXIS)  #: axis in axes of marker a, (3,)
    ratio: float = 1.0  #: gear ratio, speed of the motor divided by omega
    friction: float = 0.0  #: dry friction of the motor [N m]
    friction_speed: float = FRICTION_SPEED  #: speed scale w of friction ω/√(ω² + w²), with motor speed ω [rad/s]
    damping: float = 0.0  #: viscous damping of the motor: torque divided by speed [N m s]
    current: float = 0.0  #: initial current [A]

    def __post_init__(self) -> None:
        check_shaft(self)
        required(
            self, above=("resistance", "inductance", "constant", "friction_speed"), at_least=("friction", "damping"),
            real=("ratio", "current"),
        )  # fmt: skip
        if self.ratio == 0:
            raise ModelError(f"element {self.name!r}: ratio: expected a number other than 0")
        time_functions(self, "voltage")
        check_controller(self, tuple(CONTROLLED))
        if (self.voltage is None) == (self.controller is None):
            given = "neither: missing supply" if self.voltage is None else "both"
            raise ModelError(f"element {self.name!r}: expected a voltage or a controller, got {given}")

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the motor."""
        numbers = [self.resistance, self.inductance, self.constant, self.ratio, self.friction, self.friction_speed]
        numbers += [
            self.damping,
            BY_FUNCTION if self.controller is None else 1 + tuple(CONTROLLED).index(self.controlled),
        ]
        states = [("current", "A", self.current)]
        if self.controller is None:
            assert isinstance(self.voltage, TimeFunction)  # ensured by __post_init__
            supply = function_numbers(self.voltage)
        else:
            supply = self.controller.numbers(1 / placed.units.time)
            if self.controlled == "angle":
                states.append(("counted angle", "rad", 0.0))
            value = self.current if self.controlled == "current" else 0.0
            states += self.controller.start(value, CONTROLLED[self.controlled], "V")
        return ElementLaw(
            function=dc_motor_law,
            data=[*numbers, *shaft_numbers(self.axis, placed), *supply],
            **states_in(placed.units, states),
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("moment", "moment"),
            energy="energy",
            power_in="power in",
            power_lost="power lost",
        )


@njit
def dc_motor_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the motor torque, the rates of current and controller states, and the outputs."""
    R, L, k, ratio, mode = data[0], data[1], data[2], data[3], int(data[7])
    e = direction_of(x, 0, data, 8)
    speed = turning_speed(x, 0, 1, e)
    omega, i, angle = ratio * speed, z[0], 0.0 * speed
    if mode == BY_FUNCTION:
        u = function_at(data, SUPPLY, t) + 0.0 * i
    elif mode == ANGLE:
        angle = turned_angle(x, data, 8, speed, z, z_dot, 1)
        u = pid_law(t, angle, data, SUPPLY, z, z_dot, 2)
    else:
        u = pid_law(t, speed if mode == SPEED else i, data, SUPPLY, z, z_dot, 1)
    z_dot[0] = (u - R * i - k * omega) / L
    friction = data[4] * omega / np.sqrt(omega * omega + data[5] * data[5]) + data[6] * omega
    torque = ratio * (k * i - friction)
    add_torque(wrench, 0, 1, torque, e)
    outputs[0], outputs[1], outputs[2], outputs[3], outputs[4] = i, u, torque, speed, angle
    outputs[5], outputs[6], outputs[7], outputs[8] = (
        u * i,
        R * i * i + friction * omega,
        torque * speed,
        0.5 * L * i * i,
    )
