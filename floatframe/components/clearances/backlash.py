"""Clearances of joints: backlash of a hinge and play of a ball joint."""

from dataclasses import dataclass

from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.components.clearances.contact import (
    NUMBERS,
    Range,
    add_contact,
    contact_numbers,
    depth_force,
    require_numbers,
)
from floatframe.components.clearances.hinge import length_of
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import unit_vector
from floatframe.model.elements import Element, ElementLaw, GapSpring, Placed
from floatframe.model.elements.pairs import (
    add_axial_force,
    add_torque,
    angle_about,
    angle_numbers,
    axial_motion,
    direction_of,
    turning_speed,
)
from floatframe.model.elements.unit_names import outputs_in

__all__ = ["Backlash", "BallWithPlay"]


# a ball joint with play: a ball in a larger socket --------------------------------------------------------------------


FRICTION_SPEED = Quantity(1e-3, SPEED)
OUTPUTS = {"eccentricity": "m", "force": "N", "energy": "J", "power lost": "W", "gap": "m"}


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BallWithPlay(Element):
    """A ball at marker b in a larger socket at marker a; the contact force is described in `contact`.

    Outputs: distance between the centres, normal force, energy and power lost.

    Raises
    ------
    ModelError
        If a number is out of its range, or a marker is not a `Marker`.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    play: float  #: radial play, the difference of the radii [m]
    stiffness: float  #: contact stiffness k [N/mⁿ]
    exponent: float = 1.0  #: exponent n of the contact depth
    damping: float = 0.0  #: damping chi, proportional to the approach velocity [s/m]
    friction: float = 0.0  #: coefficient of friction mu
    friction_speed: float = FRICTION_SPEED  #: slip speed v_s at which friction is 0.71 of its value [m/s]
    radius: float = 0.0  #: radius of the ball, which is the lever arm of friction [m]

    def __post_init__(self) -> None:
        require_numbers(self, {"play": Range(above=0.0)})

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the ball."""
        return ElementLaw(
            function=ball_law,
            data=[*contact_numbers(self), self.play],
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("wrench", "wrench"),
            is_opposite=True,
            energy="energy",
            power_lost="power lost",
            gaps={"gap": GapSpring(self.stiffness, self.exponent)},
        )


@njit
def ball_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the contact of the ball and the outputs."""
    p = x[1, 0], x[1, 1], x[1, 2]
    out = p[0] - x[0, 0], p[1] - x[0, 1], p[2] - x[0, 2]
    outputs[0] = length_of(out)
    outputs[4] = data[NUMBERS] - outputs[0]
    outputs[1], outputs[2], outputs[3] = add_contact(wrench, x, p, out, outputs[0], data[NUMBERS], data, 0)


# backlash -------------------------------------------------------------------------------------------------------------


MOTIONS = {"along": ("N", "m"), "about": ("N m", "rad")}  #: units of force and displacement


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Backlash(Element):
    """A dead band in the motion of marker b relative to marker a, along an axis or about it.

    The motion is free for `lower` < displacement < `upper`. Beyond, with the depth x, the force is k xⁿ max(0, 1 + chi
    x_dot). The displacement along the axis is the distance of the markers along it; the angle is zero as assembled and
    must stay within half a turn. Use the markers of the joint along or about whose axis the backlash acts.

    Raises
    ------
    ModelError
        If a number is out of its range, or a marker is not a `Marker`.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    lower: float  #: lower end of the dead band [m, rad]
    upper: float  #: upper end of the dead band, above `lower` [m, rad]
    stiffness: float  #: stiffness k of the stops [N/mⁿ, N m/radⁿ]
    exponent: float = 1.0  #: exponent n of the contact depth
    damping: float = 0.0  #: damping chi, proportional to the approach velocity [s/m, s/rad]
    motion: str = "along"  #: motion "along" the axis or "about" it
    axis: GivenArray = given((0.0, 0.0, 1.0))  #: in the axes of marker a, (3,)

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        require_numbers(self, {"lower": Range(), "upper": Range()})
        if self.motion not in MOTIONS:
            raise ModelError(f"{where}: motion: expected one of {', '.join(MOTIONS)}, got {self.motion!r}")
        if not self.lower < self.upper:
            raise ModelError(f"{where}: upper: expected a value above lower = {self.lower:g}, got {self.upper:g}")
        object.__setattr__(self, "axis", unit_vector(f"{where}: axis", self.axis))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the backlash."""
        force, way = MOTIONS[self.motion]
        outputs = {"way": way, "force": force, "energy": "J", "power lost": "W", "gap": way}
        data = [self.stiffness, self.exponent, self.damping, self.lower, self.upper, float(self.motion == "about")]
        data += angle_numbers(self.axis, placed.A[0], placed.A[1])
        return ElementLaw(
            function=backlash_law,
            data=data,
            **outputs_in(placed.units, outputs),
            tangent="complex",
            acts=("moment", "moment") if self.motion == "about" else ("wrench", "force"),
            energy="energy",
            power_lost="power lost",
            gaps={"gap": GapSpring(self.stiffness, self.exponent)},
        )


@njit
def backlash_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the force of the stop that is touched, and the outputs."""
    lower, upper, is_turn = data[3], data[4], data[5] > 0.0
    e = direction_of(x, 0, data, 6)
    if is_turn:
        way, speed = angle_about(x, 0, 1, data, 6), turning_speed(x, 0, 1, e)
    else:
        way, speed = axial_motion(x, 0, 1, e)
    side = 1.0 if way.real >= 0.5 * (lower + upper) else -1.0
    end = upper if side > 0.0 else lower
    N, spring, energy = depth_force(side * (way - end), side * speed, data, 0)
    if is_turn:
        add_torque(wrench, 0, 1, -side * N, e)
    else:
        add_axial_force(wrench, x, 0, 1, -side * N, e)
    outputs[0], outputs[1], outputs[2], outputs[3] = way, side * N, energy, (N - spring) * side * speed
    outputs[4] = side * (end - way)
