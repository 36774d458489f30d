"""A hinge with play: a pin in a larger bearing.

The axis of the bearing passes through marker a, that of the pin through marker b. In two planes of the pin, at the ends
of the bearing (s = ±L/2 from marker b along the pin), the pin can be displaced from the axis of the bearing by the
radial play c, so that it can tilt by up to 2 c/L. Along the axis, marker b can move by the axial play to each side.
Beyond the play, see `contact`. A spring and a damper, such as a harness, can act about the axis, with the torque -k_t
(angle - free) - d_t (rate of the angle).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numba.extending import register_jitable

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
    inner_product,
    turning_speed,
)
from floatframe.model.elements.smooth import absolute
from floatframe.model.elements.unit_names import outputs_in

__all__ = ["HingeWithPlay"]

FRICTION_SPEED = Quantity(1e-3, SPEED)

OUTPUTS = {
    "angle": "rad", "eccentricity": "m", "axial": "m", "tilt": "rad", "force": "N", "contacts": "1", "energy": "J",
    "power lost": "W", "gap": "m", "other gap": "m", "axial gap": "m",
}  # fmt: skip


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class HingeWithPlay(Element):
    """A pin at marker b in a larger bearing at marker a, which rotates about an axis.

    Outputs: the angle of b relative to a about the axis, zero as assembled; the displacements of marker b from the axis
    of the bearing and along it; the angle between both axes; the resultant contact force in the bearing; the number of
    planes in contact; energy and power lost. Axial contact has no friction.

    Raises
    ------
    ModelError
        If a number is out of its range, or a marker is not a `Marker`.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    radial_play: float  #: distance from the centred pin to contact, half the difference of the diameters [m]
    stiffness: float  #: contact stiffness k in one plane [N/mⁿ]
    length: float = 0.0  #: length L of the bearing [m]; 0: a single plane, in which the pin tilts freely
    axial_play: float = 0.0  #: axial play to each side [m]
    slides: bool = False  #: whether the pin moves freely along the axis
    axial_stiffness: float | None = None  #: stiffness of the axial contact [N/mⁿ]; None: equal to `stiffness`
    exponent: float = 1.0  #: exponent n of the contact depth
    damping: float = 0.0  #: damping chi, proportional to the approach velocity [s/m]
    friction: float = 0.0  #: coefficient of friction mu
    friction_speed: float = FRICTION_SPEED  #: slip speed v_s at which friction is 0.71 of its value [m/s]
    radius: float = 0.0  #: radius of the pin, which is the lever arm of friction [m]
    turn_stiffness: float = 0.0  #: torsional stiffness k_t about the axis [N m/rad]
    turn_damping: float = 0.0  #: torsional damping d_t about the axis [N m s/rad]
    #: angle at which the torsional spring is free of moment, relative to the assembled angle [rad]
    turn_free: float = 0.0
    axis: GivenArray = given((0.0, 0.0, 1.0))  #: in the axes of marker a, (3,)

    def __post_init__(self) -> None:
        require_numbers(
            self,
            {
                "radial_play": Range(above=0.0),
                "length": Range(at_least=0.0),
                "axial_play": Range(at_least=0.0),
                "axial_stiffness": Range(above=0.0),
                "turn_stiffness": Range(at_least=0.0),
                "turn_damping": Range(at_least=0.0),
                "turn_free": Range(),
            },
        )
        object.__setattr__(self, "axis", unit_vector(f"element {self.name!r}: axis", self.axis))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the hinge, whose axes must coincide when assembled."""
        axial = self.stiffness if self.axial_stiffness is None else self.axial_stiffness
        gaps = {"gap": GapSpring(self.stiffness, self.exponent)}
        if self.length > 0.0:
            gaps["other gap"] = gaps["gap"]
        if not self.slides:
            gaps["axial gap"] = GapSpring(axial, self.exponent)
        along = placed.A[1].T @ placed.A[0] @ self.axis
        data = [*contact_numbers(self), self.radial_play, self.length, axial, self.exponent, self.damping]
        data += [-1.0 if self.slides else self.axial_play, *along]
        data += angle_numbers(self.axis, placed.A[0], placed.A[1])
        data += [self.turn_stiffness, self.turn_damping, self.turn_free]
        return ElementLaw(
            function=hinge_law,
            data=data,
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("wrench", "wrench"),
            is_opposite=True,
            energy="energy",
            power_lost="power lost",
            gaps=gaps,
        )


PLAY, LENGTH, AXIAL, AXIAL_PLAY = NUMBERS, NUMBERS + 1, NUMBERS + 2, NUMBERS + 5  #: indices in `data`
ALONG, ABOUT, TURN = NUMBERS + 6, NUMBERS + 9, NUMBERS + 18


@njit
def hinge_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the contacts in both planes and along the axis, and the outputs."""
    e, pin = direction_of(x, 0, data, ABOUT), direction_of(x, 1, data, ALONG)
    n_planes = 2 if data[LENGTH] > 0.0 else 1
    for k in range(n_planes):
        s = 0.0 if n_planes == 1 else (k - 0.5) * data[LENGTH]
        p = x[1, 0] + s * pin[0], x[1, 1] + s * pin[1], x[1, 2] + s * pin[2]
        way, out = off_axis(x, p, e)
        outputs[8 + k] = data[PLAY] - way
        N, energy, lost = add_contact(wrench, x, p, out, way, data[PLAY], data, 0)
        if N.real > 0.0:
            outputs[5] += 1.0
        outputs[6] += energy
        outputs[7] += lost
    along, rate = axial_motion(x, 0, 1, e)
    if data[AXIAL_PLAY] >= 0.0:
        side = 1.0 if along.real >= 0.0 else -1.0
        outputs[10] = data[AXIAL_PLAY] - side * along
        N, spring, energy = depth_force(side * along - data[AXIAL_PLAY], side * rate, data, AXIAL)
        add_axial_force(wrench, x, 0, 1, -side * N, e)
        outputs[6] += energy
        outputs[7] += (N - spring) * side * rate
    outputs[4] = length_of((wrench[1, 0], wrench[1, 1], wrench[1, 2]))
    outputs[0], speed = angle_about(x, 0, 1, data, ABOUT), turning_speed(x, 0, 1, e)
    turn = outputs[0] - data[TURN + 2]
    add_torque(wrench, 0, 1, -data[TURN] * turn - data[TURN + 1] * speed, e)
    outputs[6] += 0.5 * data[TURN] * turn * turn
    outputs[7] += data[TURN + 1] * speed * speed
    outputs[1], _ = off_axis(x, (x[1, 0], x[1, 1], x[1, 2]), e)
    outputs[2] = along
    cosine = inner_product(e, pin)
    across = pin[0] - cosine * e[0], pin[1] - cosine * e[1], pin[2] - cosine * e[2]
    outputs[3] = np.arctan(length_of(across) / absolute(cosine))


@register_jitable
def off_axis(x, p, e):
    """Return the distance of a point from the axis e through marker 0, and the vector from the axis, normal to e."""
    d = p[0] - x[0, 0], p[1] - x[0, 1], p[2] - x[0, 2]
    along = inner_product(d, e)
    out = d[0] - along * e[0], d[1] - along * e[1], d[2] - along * e[2]
    return length_of(out), out


@register_jitable
def length_of(a):
    """Return the length of a vector with three components; its derivative is zero for the zero vector."""
    squared = inner_product(a, a)
    return np.sqrt(squared) if squared.real > 0.0 else 0.0 * squared
