"""Stick-slip friction along or about an axis, modelled by the deflection of bristles, without creep while sticking.

v is the sliding velocity, z the mean deflection of the bristles, and z_ss(v) = G(v)/sigma_0 the steady value:

    G(v) = F_C + (F_S - F_C) exp(-(v/v_S)²)
    dz/dt = v (1 - alpha(z, v) z/z_ss sign(v)),      F = sigma_0 z + sigma_1 dz/dt + sigma_2 v

Canudas de Wit and others (1995) use alpha = 1 (LuGre). The bristles then slip slightly under any oscillating load, so
that a contact that should stick creeps. In the model of Dupont et al. (2002), alpha is 0 if |z| decreases or is below a
fraction of z_ss (elastic deflection), 1 for |z| >= z_ss, and smooth in between.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.pairs import add_axial_force, add_torque, axial_motion, direction_of, turning_speed
from floatframe.model.elements.smooth import absolute
from floatframe.model.elements.unit_names import in_units, outputs_in

__all__ = ["BristleFriction"]

ELEMENTS = {"bristles": "floatframe.components.friction:BristleFriction"}

MOTIONS = {"along": ("N", "m", "m/s"), "about": ("N m", "rad", "rad/s")}  #: units of force, deflection and velocity


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BristleFriction(Element):
    """Friction between markers b and a, for sliding along an axis or rotation about it, which can stick.

    Up to the force `static`, the contact acts like a stiff spring. Beyond it, the contact slips with the friction
    `coulomb`, which rises to `static` near rest.
    Use the markers of the joint in which the friction acts; its level does not depend on the force in the joint.

    Raises
    ------
    ModelError
        If a number is out of its range, or a marker is not a `Marker`.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    coulomb: float  #: friction force F_C at high sliding velocity [N, N m]
    stiffness: float  #: stiffness sigma_0 of the bristles [N/m, N m/rad]
    static: float | None = None  #: largest friction force F_S while sticking [N, N m]; None: equal to `coulomb`
    stribeck_speed: float | None = None  #: Stribeck speed v_S, required with `static` [m/s, rad/s]
    damping: float = 0.0  #: damping sigma_1 of the bristles [N s/m, N m s/rad]
    viscous: float = 0.0  #: viscous friction sigma_2 [N s/m, N m s/rad]
    elastic: float = 0.7  #: fraction of the steady deflection below which there is no slip; 0 with `creeps`
    creeps: bool = False  #: whether the bristles slip at any deflection (LuGre as published)
    motion: str = "along"  #: motion "along" the axis or "about" it
    speed: float = 0.0  #: initial sliding velocity, with the bristle deflection of steady sliding
    axis: GivenArray = given((0.0, 0.0, 1.0))  #: in the axes of marker a, (3,)

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        if self.motion not in MOTIONS:
            raise ModelError(f"{where}: motion: expected one of {', '.join(MOTIONS)}, got {self.motion!r}")
        object.__setattr__(self, "axis", unit_vector(f"{where}: axis", self.axis))
        for key in ("coulomb", "stiffness"):
            object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), above=0.0))
        for key in ("damping", "viscous", "elastic"):
            object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), at_least=0.0))
        object.__setattr__(self, "speed", number(f"{where}: speed", self.speed))
        if self.elastic >= 1:
            raise ModelError(f"{where}: elastic: expected a fraction below 1, got {self.elastic:g}")
        static = self.coulomb if self.static is None else number(f"{where}: static", self.static, above=0.0)
        if static < self.coulomb:
            raise ModelError(
                f"{where}: static: expected at least coulomb = {self.coulomb:g}, got {static:g}: "
                "a contact with larger friction in sliding would never stick"
            )
        if static > self.coulomb and self.stribeck_speed is None:
            raise ModelError(f"{where}: stribeck_speed: missing; static falls to coulomb over this speed")
        object.__setattr__(self, "static", static)
        speed = 1.0 if self.stribeck_speed is None else self.stribeck_speed
        object.__setattr__(self, "stribeck_speed", number(f"{where}: stribeck_speed", speed, above=0.0))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the friction."""
        force, length, speed = MOTIONS[self.motion]
        outputs = [("force", force), ("velocity", speed), ("energy", "J"), ("power lost", "W")]
        assert self.static is not None
        assert self.stribeck_speed is not None
        level = self.coulomb + (self.static - self.coulomb) * math.exp(-((self.speed / self.stribeck_speed) ** 2))
        start = float(np.sign(self.speed)) * level / self.stiffness
        data = [self.coulomb, self.static, self.stribeck_speed, self.stiffness, self.damping, self.viscous]
        data += [self.elastic, float(self.creeps), float(self.motion == "about"), *self.axis]
        return ElementLaw(
            function=bristle_law,
            data=data,
            states=["deflection"],
            start=[start],
            state_units=in_units(placed.units, [length]),
            state_sizes=[self.static / self.stiffness],
            **outputs_in(placed.units, outputs),
            tangent="complex",
            acts=("moment", "moment") if self.motion == "about" else ("wrench", "force"),
            energy="energy",
            power_lost="power lost",
        )


@njit
def slipping(z, v, steady, elastic, creeps):
    """Return alpha, the fraction of the motion that is slip, from 0 (sticking) to 1."""
    if creeps > 0.0:
        return 0.0 * z + 1.0
    size = absolute(z)
    if z.real * v.real <= 0.0 or size.real <= elastic * steady.real:
        return 0.0 * z
    if size.real >= steady.real:
        return 0.0 * z + 1.0
    return 0.5 + 0.5 * np.sin(math.pi * (size - 0.5 * (1.0 + elastic) * steady) / ((1.0 - elastic) * steady))


@njit
def bristle_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write friction, the rate of the deflection and the outputs."""
    coulomb, static, stribeck, stiffness, damping, viscous = data[0], data[1], data[2], data[3], data[4], data[5]
    e = direction_of(x, 0, data, 9)
    if data[8] > 0.0:
        v = turning_speed(x, 0, 1, e)
    else:
        _, v = axial_motion(x, 0, 1, e)
    ratio = v / stribeck
    level = coulomb + (static - coulomb) * np.exp(-ratio * ratio)
    steady = level / stiffness
    z_dot[0] = v - slipping(z[0], v, steady, data[6], data[7]) * absolute(v) * z[0] / steady
    friction = stiffness * z[0] + damping * z_dot[0] + viscous * v
    if data[8] > 0.0:
        add_torque(wrench, 0, 1, -friction, e)
    else:
        add_axial_force(wrench, x, 0, 1, -friction, e)
    outputs[0], outputs[1] = friction, v
    outputs[2] = 0.5 * stiffness * z[0] * z[0]
    outputs[3] = friction * v - stiffness * z[0] * z_dot[0]
