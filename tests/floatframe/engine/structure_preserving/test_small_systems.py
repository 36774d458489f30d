"""Derivatives of functions of users in conserving steps are taken over lengths of the system, such as micrometres."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from floatframe import GROUND, Marker, PrismaticJoint, RigidBody, System, UserForce
from floatframe.engine.compiling.system import compiled_system
from floatframe.joints import JointCoordinate
from floatframe.model.elements import Element, ElementLaw
from tests.floatframe.engine.structure_preserving.in_python.forces import user_values
from tests.floatframe.engine.structure_preserving.in_python.public_elements import Motion

MASS, OMEGA = 1e-3, 20.0
AXIS = np.array([1.0, 2.0, -2.0]) / 3


@njit
def spring_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write a spring m w² s (1 + 5 s²/L²) along the axis between two points."""
    s = 0.0
    for k in range(3):
        s += (x[1, k] - x[0, k]) * data[2 + k]
    force = data[0] * s * (1.0 + 5.0 * s * s / data[1] ** 2)
    for k in range(3):
        wrench[0, k], wrench[1, k] = force * data[2 + k], -force * data[2 + k]


@dataclass(frozen=True, eq=False)
class Spring(Element):
    name: str
    a: Marker
    b: Marker
    size: float

    def law(self, placed):
        return ElementLaw(function=spring_law, data=[MASS * OMEGA**2, self.size, *AXIS], acts=["force", "force"])


def on_rail(size, kind):
    inertia = MASS * size**2 * np.diag([0.1, 0.2, 0.25])
    body = RigidBody("body", MASS, inertia, position=0.5 * size * AXIS, velocity=3.0 * size * AXIS)
    rail = PrismaticJoint("rail", Marker(GROUND, position=np.zeros(3)), Marker("body", position=np.zeros(3)), axis=AXIS)
    if kind == "element":
        ends = Marker(GROUND, position=np.zeros(3)), Marker("body", position=np.zeros(3))
        return System([body], [rail], elements=[Spring("spring", *ends, size)])

    def function(t, x, v, z, Q, z_dot):
        s = x[0] + 0.5 * size
        Q[0] = -MASS * OMEGA**2 * s * (1.0 + 5.0 * s**2 / size**2)

    return System(
        [body], [rail], [UserForce("spring", {"x": JointCoordinate("rail", "distance")}, ("x",), function=function)]
    )


def slope(size, s):
    """The change of the force by the way s."""
    return -MASS * OMEGA**2 * (1.0 + 15.0 * s**2 / size**2)


@pytest.mark.parametrize("size", [1.0, 1e-6, 1e4])
def test_derivatives_of_a_function_are_taken_over_the_size_of_its_coordinates(size):
    model = compiled_system(on_rail(size, "force")).model
    x = np.array([0.0, 0.2 * size + 1j, 0.0])
    (value,) = user_values(model, 0, x)
    assert_allclose(value.imag, slope(size, 0.7 * size), rtol=1e-6)


@pytest.mark.parametrize("size", [1.0, 1e-6, 1e4])
def test_derivatives_of_an_element_are_taken_over_its_length(size):
    model = compiled_system(on_rail(size, "element")).model
    motion = Motion.__new__(Motion)
    motion.model, motion.i, motion.head = model, 0, model.laws.head[0]
    motion.span, motion.markers = SimpleNamespace(h=0.01), [None, None]
    motion.dr = motion.turn = [np.zeros(3), np.zeros(3)]
    places = [(np.zeros(3), np.eye(3)), (0.7 * size * AXIS + 1j * AXIS, np.eye(3))]
    wrench = motion.wrenches(motion.law(0.0, places, np.zeros(0), np.zeros(0)))
    assert_allclose(wrench[1, :3].imag, slope(size, 0.7 * size) * AXIS, rtol=1e-6)
