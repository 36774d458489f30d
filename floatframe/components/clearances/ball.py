"""A ball joint with play: a ball in a larger socket."""

from dataclasses import dataclass

from numba import njit

from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.components.clearances.contact import NUMBERS, Range, add_contact, contact_numbers, require_numbers
from floatframe.components.clearances.hinge import length_of
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, GapSpring, Placed
from floatframe.model.elements.unit_names import in_units

__all__ = ["BallWithPlay"]

FRICTION_SPEED = Quantity(1e-3, SPEED)
OUTPUTS = {"eccentricity": "m", "force": "N", "energy": "J", "power lost": "W", "gap": "m"}


@frozen_copies
@dataclass(frozen=True, eq=False)
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
    play: float  #: difference of the radii [m]
    stiffness: float  #: k of the contact [N/mⁿ]
    exponent: float = 1.0  #: n
    damping: float = 0.0  #: chi, damping proportional to the approach velocity [s/m]
    friction: float = 0.0  #: mu
    friction_speed: float = FRICTION_SPEED  #: v_s, slip at which friction is 0.71 of its value [m/s]
    radius: float = 0.0  #: radius of the ball, lever arm of the friction [m]

    def __post_init__(self) -> None:
        require_numbers(self, {"play": Range(above=0.0)})

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the ball."""
        return ElementLaw(
            function=ball_law,
            data=[*contact_numbers(self), self.play],
            outputs=tuple(OUTPUTS),
            output_units=in_units(placed.units, list(OUTPUTS.values())),
            tangent="complex",
            acts=("wrench", "wrench"),
            is_opposite=True,
            energy="energy",
            power_lost="power lost",
            gaps={"gap": GapSpring(self.stiffness, self.exponent)},
        )


@njit
def ball_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write the contact of the ball and the outputs."""
    p = x[1, 0], x[1, 1], x[1, 2]
    out = p[0] - x[0, 0], p[1] - x[0, 1], p[2] - x[0, 2]
    seen[0] = length_of(out)
    seen[4] = data[NUMBERS] - seen[0]
    seen[1], seen[2], seen[3] = add_contact(wrench, x, p, out, seen[0], data[NUMBERS], data, 0)
