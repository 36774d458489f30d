"""A PID controller that acts directly as a torque about an axis or a force along it."""

from dataclasses import dataclass

from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.drives.pid import Pid, pid_law, target_of
from floatframe.components.drives.shaft import Z_AXIS, check_controller, check_shaft, required, shaft_numbers
from floatframe.components.drives.turns import turned_angle
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.pairs import add_axial_force, add_torque, axial_motion, direction_of, turning_speed
from floatframe.model.elements.unit_names import outputs_in, states_in

__all__ = ["PidDrive"]

CONTROLLED = ("angle", "speed", "distance", "rate")
ANGLE, SPEED, DISTANCE, RATE = range(4)
UNITS = ("rad", "rad/s", "m", "m/s")
CONTROLLER = 12  #: index in the data of the controller


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PidDrive(Element):
    """A drive with a PID controller: a torque about, or a force along, the axis of marker a; it acts between a and b.

    `controlled` is "angle" (zero as assembled, counted through full turns) or "speed" about the axis, with a torque, or
    "distance" of marker b from marker a along the axis or its "rate", with a force. With `time_constant`, the torque or
    force follows the output of the controller with this lag.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    controller: Pid
    controlled: str = "angle"  #: quantity that the controller controls: "angle", "speed", "distance" or "rate"
    axis: GivenArray = given(Z_AXIS)  #: axis in axes of marker a, (3,)
    time_constant: float = 0.0  #: time constant of the actuator [s]

    def __post_init__(self) -> None:
        check_shaft(self)
        required(self, at_least=("time_constant",))
        if self.controller is None:
            raise ModelError(f"element {self.name!r}: controller: missing; expected a Pid")
        check_controller(self, CONTROLLED)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the drive."""
        mode = CONTROLLED.index(self.controlled)
        shaft = shaft_numbers(self.axis, placed)
        e = placed.A[0] @ self.axis
        value = float(e @ (placed.r[1] - placed.r[0])) if mode == DISTANCE else 0.0
        acting = ("torque", "N m") if mode in (ANGLE, SPEED) else ("force", "N")
        states = [("counted angle", "rad", 0.0)] if mode == ANGLE else []
        if self.time_constant > 0:
            states.append((*acting, 0.0))
        states += self.controller.start(value, UNITS[mode], acting[1])
        outputs = [(self.controlled, UNITS[mode]), acting, ("power in", "W"), ("error", UNITS[mode])]
        return ElementLaw(
            function=pid_drive_law,
            data=[mode, self.time_constant, *shaft, *self.controller.numbers(1 / placed.units.time)],
            **states_in(placed.units, states),
            **outputs_in(placed.units, outputs),
            tangent="complex",
            acts=("moment", "moment") if mode in (ANGLE, SPEED) else ("wrench", "wrench"),
            power_in="power in",
        )


@njit
def pid_drive_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the torque or force of the drive, the rates of its states and its outputs."""
    mode, lag = int(data[0]), data[1]
    e = direction_of(x, 0, data, 2)
    state = 0
    if mode == ANGLE:
        rate = turning_speed(x, 0, 1, e)
        value = turned_angle(x, data, 2, rate, z, z_dot, 0)
        state = 1
    elif mode == SPEED:
        rate = turning_speed(x, 0, 1, e)
        value = rate
    else:
        value, rate = axial_motion(x, 0, 1, e)
        if mode == RATE:
            value = rate
    first = state + 1 if lag > 0.0 else state
    u = pid_law(t, value, data, CONTROLLER, z, z_dot, first)
    if lag > 0.0:
        z_dot[state] = (u - z[state]) / lag
        u = z[state]
    if mode == ANGLE or mode == SPEED:
        add_torque(wrench, 0, 1, u, e)
    else:
        add_axial_force(wrench, x, 0, 1, u, e)
    outputs[0], outputs[1], outputs[2] = value, u, u * rate
    outputs[3] = target_of(t, data, CONTROLLER) - value
