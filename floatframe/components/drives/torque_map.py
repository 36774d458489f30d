"""A motor or engine described by maps: torque over speed and throttle, efficiency over speed and torque."""

from collections.abc import Sequence
from dataclasses import dataclass

from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.drives.pid import Pid, pid_law
from floatframe.components.drives.shaft import Z_AXIS, check_controller, check_shaft, required, time_functions
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.curves import function_at, function_numbers, grid_at, grid_numbers
from floatframe.model.elements.pairs import add_torque, direction_of, turning_speed
from floatframe.model.elements.unit_names import outputs_in, states_in
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["TorqueMap"]

OUTPUTS = (
    ("torque", "N m"), ("speed", "rad/s"), ("throttle", "1"), ("efficiency", "1"), ("power in", "W"),
    ("power lost", "W"), ("power out", "W"),
)  # fmt: skip


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class TorqueMap(Element):
    """Torque from a map over the speed of the motor and the throttle, bilinear and constant beyond its edges.

    The throttle is a function of time, or the output of a controller of the speed of marker b relative to marker a
    about `axis`. With a gear, the motor rotates `ratio` times as fast, and its torque on b is multiplied by `ratio`.
    With `time_constant`, the torque follows the map with a first-order lag. With an efficiency map eta, the input power
    is T omega/eta if the motor drives and T omega eta if it brakes.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    speeds: Sequence[float]  #: increasing speeds of the motor [rad/s]
    throttles: Sequence[float]  #: increasing throttle values
    torques: Sequence[Sequence[float]]  #: torques, with a row for each speed and a column for each throttle [N m]
    throttle: TimeFunction | float | None = None  #: throttle as a function of time
    controller: Pid | None = None  #: controller of the throttle from the speed of b, in place of `throttle`
    time_constant: float = 0.0  #: time constant of the torque lag [s]
    ratio: float = 1.0  #: gear ratio, speed of the motor divided by the speed of b
    axis: GivenArray = given(Z_AXIS)  #: axis in axes of marker a, (3,)
    efficiency_torques: Sequence[float] | None = None  #: increasing absolute motor torques of the efficiency map [N m]
    #: efficiencies, with a row for each of `speeds` and a column for each torque
    efficiencies: Sequence[Sequence[float]] | None = None
    controlled: str = "speed"  #: quantity that the controller controls: "speed"

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        check_shaft(self)
        required(self, at_least=("time_constant",), real=("ratio",))
        if self.ratio == 0:
            raise ModelError(f"{where}: ratio: expected a number other than 0")
        time_functions(self, "throttle")
        check_controller(self, ("speed",))
        if (self.throttle is None) == (self.controller is None):
            given = "neither" if self.throttle is None else "both"
            raise ModelError(f"{where}: expected a throttle or a controller, got {given}")
        if (self.efficiencies is None) != (self.efficiency_torques is None):
            raise ModelError(f"{where}: expected efficiency_torques and efficiencies together, or neither")
        self.maps()

    def maps(self) -> tuple[list[float], list[float]]:
        """Return the data of both maps; the second is empty if there is no efficiency map."""
        where = f"element {self.name!r}"
        torque = grid_numbers(f"{where}: torques over speeds and throttles", self.speeds, self.throttles, self.torques)
        if self.efficiencies is None or self.efficiency_torques is None:
            return torque, []
        eta = array_of_shape(
            f"{where}: efficiencies", self.efficiencies, (len(self.speeds), len(self.efficiency_torques))
        )
        if (eta <= 0).any() or (eta > 1).any():
            raise ModelError(
                f"{where}: efficiencies: expected numbers above 0 and up to 1, got {eta.min():g} to {eta.max():g}"
            )
        return torque, grid_numbers(
            f"{where}: efficiencies over speeds and efficiency_torques",
            self.speeds,
            self.efficiency_torques,
            eta.tolist(),
        )

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the map."""
        torque, efficiency = self.maps()
        at = 11
        if self.controller is None:
            assert isinstance(self.throttle, TimeFunction)  # ensured by __post_init__
            supply = function_numbers(self.throttle)
        else:
            supply = self.controller.numbers(1 / placed.units.time)
        at_efficiency = at + len(torque)
        head = [self.ratio, self.time_constant, 0.0 if self.controller is None else 1.0, *self.axis]
        head += [at, at_efficiency if efficiency else 0, at_efficiency + len(efficiency), 0, 0]
        states = [("motor torque", "N m", 0.0)] if self.time_constant > 0 else []
        if self.controller is not None:
            states += self.controller.start(0.0, "rad/s", "1")
        return ElementLaw(
            function=torque_map_law,
            data=[*head, *torque, *efficiency, *supply],
            **states_in(placed.units, states),
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("moment", "moment"),
            power_in="power in",
            power_lost="power lost",
        )


@njit
def torque_map_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the torque from a map, the rates of its states, and its outputs."""
    ratio, lag = data[0], data[1]
    at, at_efficiency, at_supply = int(data[6]), int(data[7]), int(data[8])
    e = direction_of(x, 0, data, 3)
    speed = turning_speed(x, 0, 1, e)
    first = 1 if lag > 0.0 else 0
    if data[2] == 0.0:
        throttle = function_at(data, at_supply, t) + 0.0 * speed
    else:
        throttle = pid_law(t, speed, data, at_supply, z, z_dot, first)
    motor = grid_at(data, at, ratio * speed, throttle)
    if lag > 0.0:
        z_dot[0] = (motor - z[0]) / lag
        motor = z[0]
    torque = ratio * motor
    add_torque(wrench, 0, 1, torque, e)
    power = torque * speed
    eta, given = 1.0 + 0.0 * speed, power
    if at_efficiency > 0:
        eta = grid_at(data, at_efficiency, ratio * speed, -motor if motor.real < 0.0 else motor)
        given = power / eta if power.real > 0.0 else power * eta
    outputs[0], outputs[1], outputs[2], outputs[3] = torque, speed, throttle, eta
    outputs[4], outputs[5], outputs[6] = given, given - power, power
