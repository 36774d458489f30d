"""The linear tyre, whose forces are proportional to slip."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import SPEED, TIME, Quantity
from floatframe.components.wheels.linear_law import linear_law, linear_law_at_rest
from floatframe.components.wheels.looks import tyre_looks
from floatframe.components.wheels.numbers import tyre_law, tyre_numbers
from floatframe.components.wheels.reading import Read, tyre_of_table
from floatframe.components.wheels.roads.road import FlatRoad, Road
from floatframe.components.wheels.tyre_fields import check_common, common_numbers
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.shapes import Arrow, Drawn

__all__ = ["LinearTyre"]

LOW_SPEED = Quantity(1.0, SPEED)
SETTLING_TIME = Quantity(0.02, TIME)


@frozen_copies
@dataclass(frozen=True, eq=False)
class LinearTyre(Element):
    """A tyre with forces proportional to slip, limited by friction, as in linear vehicle dynamics.

    Marker A lies on the road, with z up. Marker B is at the wheel centre, on the spinning body. All lengths, forces and
    speeds are in units of the system. Axes, slips and outputs: docs/wheels.md.
    """

    name: str
    marker_a: Marker  #: on the road: z up, x along the road
    marker_b: Marker  #: at the wheel centre, on the spinning body
    radius: float  #: R_0, unloaded [m]
    stiffness: float  #: k, vertical [N/m]
    slip_stiffness: float  #: C_x = dF_x/dkappa [N]
    cornering_stiffness: float  #: C_y = -dF_y/dalpha [N/rad]
    damping: float = 0.0  #: c, vertical [N s/m]
    camber_stiffness: float = 0.0  #: C_gamma = -dF_y/dsin(gamma) [N]
    trail: float = 0.0  #: pneumatic trail t: M_z = t C_y tan(alpha) [m]
    friction: float = 1.0  #: mu, |(F_x, F_y)| <= mu F_z
    #: relaxation length along x [m]; 0: no relaxation, so that the wheel creeps at a standstill
    relaxation_x: float = 0.0
    relaxation_y: float = 0.0  #: relaxation length along y [m]
    rolling_resistance: float = 0.0  #: f_r: M_y = -f_r R_0 F_z
    flattening: float = 1 / 3  #: q, in the effective rolling radius R_0 - q d
    low_speed: float = LOW_SPEED  #: speed below which the wheel is treated as nearly standing [m/s]
    settling_time: float = SETTLING_TIME  #: tau, settling time of the damped tread at a standstill [s]
    landing_depth: float | None = None  #: deflection over which damping and tread forces build up [m]; None: radius/500
    #: spin axis, pointing left, in axes of marker B
    axis: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    road: Road = field(default_factory=FlatRoad)  #: in axes of marker A

    def __post_init__(self) -> None:
        positive = ("slip_stiffness", "cornering_stiffness", "friction")
        check_common(self, positive, ("trail", "rolling_resistance", "flattening"), ("camber_stiffness",))

    @classmethod
    def from_table(cls, name: str, table: Mapping[str, Any], read: Read) -> "LinearTyre":
        """Return the tyre of [elements.NAME]."""
        return tyre_of_table(name, table, read, cls)

    def drawn(self) -> tuple[Drawn | Arrow, ...]:
        """Return the drawn wheel, road and force."""
        return tyre_looks(self.radius, self.axis, self.road)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the element law for the markers in the assembled configuration."""
        own = [self.slip_stiffness, self.cornering_stiffness, self.camber_stiffness, self.trail, self.friction]
        own += [self.flattening, self.rolling_resistance]
        data = tyre_numbers(f"element {self.name!r}", placed, common_numbers(self), self.axis, own, self.road)
        return tyre_law(linear_law, linear_law_at_rest, data, placed, (self.relaxation_x, self.relaxation_y))
