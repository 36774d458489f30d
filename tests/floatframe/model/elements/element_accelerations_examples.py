"""Systems, bodies and helpers that several tests share: element accelerations."""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from floatframe import GROUND, FixedJoint, Gravity, Marker, RevoluteJoint, RigidBody, SphericalJoint, System
from floatframe.engine.compiling.markers import marker_pose
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.elements import Element, ElementLaw
from tests.floatframe.model.elements.public_elements_examples import hinge, pendulum

MASS, INERTIA = 0.8, np.diag([0.02, 0.03, 0.05])
SPIN = 2.0 * np.array([0, 1, 0.3])


@njit
def heavy_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Inertia of a body about its centre of mass at the marker: -m (a - gravity), -(J alpha + omega x J omega)."""
    m, gravity = data[0], data[1]
    H, H_dot = np.zeros_like(x[0, :3]), np.zeros_like(x[0, :3])
    for i in range(3):
        wrench[0, i] = -m * x[0, 18 + i]
        for k in range(3):  # J = sum of principal inertias over the axes of the marker
            axis_omega, axis_alpha = 0.0 * x[0, 0], 0.0 * x[0, 0]
            for j in range(3):
                axis_omega += x[0, 3 + 3 * j + k] * x[0, 15 + j]
                axis_alpha += x[0, 3 + 3 * j + k] * x[0, 21 + j]
            H[i] += data[2 + k] * x[0, 3 + 3 * i + k] * axis_omega
            H_dot[i] += data[2 + k] * x[0, 3 + 3 * i + k] * axis_alpha
    wrench[0, 2] -= m * gravity
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        wrench[0, 3 + i] = -H_dot[i] - (x[0, 15 + j] * H[k] - x[0, 15 + k] * H[j])


@dataclass(frozen=True, eq=False)
class Heavy(Element):
    """A body at a marker, as an element."""

    name: str
    marker: Marker
    mass: float = MASS
    gravity: float = 9.81
    tangent: str = "complex"

    def law(self, placed):
        data = [self.mass, self.gravity, *np.diag(INERTIA)]
        return ElementLaw(function=heavy_law, data=data, tangent=self.tangent, accelerations=True)


def carriers(kind):
    """Return bodies, joints and the marker that carries the mass: a rigid double pendulum, or a flexible rod."""
    if kind == "rigid":
        moves = {"omega_B": SPIN, "velocity": np.cross(SPIN, (0.6, 0, 0))}
        body = RigidBody("arm", 1.5, np.diag([0.3, 0.4, 0.5]), position=(0.6, 0, 0), **moves)
        joint = RevoluteJoint("hinge", Marker(GROUND), Marker("arm", position=(-0.6, 0, 0)), axis=(0, 1, 0.3))
        return [body], [joint], Marker("arm", position=(0.5, 0.1, -0.2))
    joint = SphericalJoint("hinge", *hinge())
    return [replace(pendulum().bodies[0], omega_B=np.zeros(3))], [joint], Marker("b", "end_b")


def pair(kind):
    """Return the system with the mass as an element, and with a body fixed to the same marker."""
    bodies, joints, marker = carriers(kind)
    own = System(bodies, joints, [Gravity((0, 0, -9.81))], elements=[Heavy("heavy", marker)])
    place = placed_at(own)
    moves = {"omega_B": SPIN, "velocity": np.cross(SPIN, place)} if kind == "rigid" else {}
    lump = RigidBody("lump", MASS, INERTIA, position=place, **moves)
    oracle = System([*bodies, lump], [*joints, FixedJoint("weld", marker, Marker("lump"))], [Gravity((0, 0, -9.81))])
    return own, oracle


def placed_at(system):
    """Return where the marker of the element is."""
    own = compiled_system(system)
    return marker_pose(own.laws[0].markers[0], own.placed, own.model.bodies.n_q)[0]
