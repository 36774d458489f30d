"""Lift and drag of a wing, part of a wing or tail as functions of the angle of attack, by quasi-steady strip theory."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.curves import function_at, function_numbers
from floatframe.model.elements.smooth import atan2
from floatframe.model.elements.unit_names import outputs_in
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["LiftingSurface"]

ELEMENTS = {"lifting-surface": "floatframe.components.aerodynamics:LiftingSurface"}

NO_WIND: Any = (0.0, 0.0, 0.0)
OUTPUTS = (
    ("lift", "N"), ("drag", "N"), ("alpha", "rad"), ("speed", "m/s"), ("lift coefficient", "1"), ("power lost", "W"),
)  # fmt: skip
FACTOR = 10  #: index in the data of the lift factor
LEAST_SPEED = 1e-6  #: air speed below which force and angle are zero


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class LiftingSurface(Element):
    """Lift and drag at a marker whose x axis points forward along the chord, and z upward from the surface.

    v_x and v_z are components of the marker's velocity through the air, V² = v_x² + v_z²; the spanwise component has no
    effect:

        alpha = atan2(-v_z, v_x),   C_L = lift_slope (alpha - zero_lift(t)) factor(t), held at ±most_lift,
        C_D = zero_drag + induced_drag C_L²,   lift rho/2 V² area C_L, drag rho/2 V² area C_D.

    Lift is normal to the flow in the plane of x and z, and drag is opposite to the velocity. Beyond `most_lift`, the
    lift stays constant; it does not break down (stall). Neglected are ground effect, downwash of one surface on
    another, and the lag of the circulation (over a distance of some chords).
    """

    name: str
    marker: Marker  #: x forward along the chord, z up
    area: float  #: wing area [m²]
    lift_slope: float  #: slope of the lift coefficient, dC_L/dalpha [1/rad]
    density: float  #: density rho of the air [kg/m³]
    #: angle of attack without lift as a function of time [rad]: negative for incidence and flaps, positive for an
    #: elevator that is pulled up
    zero_lift: TimeFunction | float = 0.0
    most_lift: float = 1.5  #: largest absolute lift coefficient C_L
    zero_drag: float = 0.0  #: drag coefficient C_D without lift
    induced_drag: float = 0.0  #: factor of induced drag, 1/(pi e aspect ratio)
    factor: TimeFunction | float = 1.0  #: lift factor as a function of time, for example for spoilers
    wind: Array = NO_WIND  #: velocity of the air, ground axes, (3,) [m/s]

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        for key in ("area", "density", "most_lift"):
            object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), above=0.0))
        for key in ("lift_slope", "zero_drag", "induced_drag"):
            object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), at_least=0.0))
        object.__setattr__(self, "wind", array_of_shape(f"{where}: wind", self.wind, (3,)))
        for key in ("zero_lift", "factor"):
            if not isinstance(getattr(self, key), TimeFunction):
                object.__setattr__(self, key, constant(number(f"{where}: {key}", getattr(self, key))))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the surface."""
        assert isinstance(self.factor, TimeFunction)  # ensured by __post_init__
        assert isinstance(self.zero_lift, TimeFunction)
        if placed.on_ground[0]:
            raise ModelError(f"element {self.name!r}: marker: expected one on a body that flies, got one on the ground")
        factor, zero_lift = function_numbers(self.factor), function_numbers(self.zero_lift)
        data = [self.density, self.area, self.lift_slope, FACTOR + len(factor), self.most_lift, self.zero_drag]
        return ElementLaw(
            function=lifting_surface_law,
            data=[*data, self.induced_drag, *self.wind, *factor, *zero_lift],
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("force",),
            power_lost="power lost",
        )


@njit
def lifting_surface_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the aerodynamic force at the marker, and the outputs."""
    rho, area, slope, most, zero_drag, induced = data[0], data[1], data[2], data[4], data[5], data[6]
    v = x[0, 12] - data[7], x[0, 13] - data[8], x[0, 14] - data[9]
    ahead = x[0, 3] * v[0] + x[0, 6] * v[1] + x[0, 9] * v[2]  # v_x and v_z
    up = x[0, 5] * v[0] + x[0, 8] * v[1] + x[0, 11] * v[2]
    V = np.sqrt(ahead * ahead + up * up + 1e-60)
    if V.real < LEAST_SPEED:
        return
    alpha = atan2(-up, ahead)
    C = slope * (alpha - function_at(data, int(data[3]), t)) * function_at(data, FACTOR, t)
    if C.real > most:
        C = most + 0.0 * C
    elif C.real < -most:
        C = -most + 0.0 * C
    D = zero_drag + induced * C * C
    q = 0.5 * rho * area * V
    a = -q * (C * up + D * ahead)  # along x: lift has a forward component when sinking
    b = q * (C * ahead - D * up)  # along z
    lost = 0.0 * V
    for k in range(3):
        wrench[0, k] = a * x[0, 3 + 3 * k] + b * x[0, 5 + 3 * k]
        lost -= wrench[0, k] * x[0, 12 + k]
    outputs[0], outputs[1], outputs[2], outputs[3], outputs[4], outputs[5] = q * V * C, q * V * D, alpha, V, C, lost
