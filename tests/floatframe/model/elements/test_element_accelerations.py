"""Laws that ask for accelerations: an added mass as an element against the body it stands for, and an accelerometer."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FixedJoint,
    GeneralizedAlpha,
    Marker,
    PrismaticJoint,
    RigidBody,
    System,
    frequency_response,
    integrate,
    kinematics,
    linearize,
    system_modes,
)
from floatframe.analyses import check_element, open_equations
from floatframe.errors import ModelError
from floatframe.forces import Bushing
from floatframe.model.elements import Element, ElementLaw
from floatframe.results import element_motion
from floatframe.sensors import Channel, ElementSensor
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.elements.element_accelerations_examples import INERTIA, MASS, Heavy, pair


@pytest.mark.parametrize("kind", ["rigid", "flexible"])
def test_an_added_mass_moves_as_the_body_it_stands_for(kind):
    own, oracle = pair(kind)
    name = own.bodies[0].name
    motions = [integrate(each, GeneralizedAlpha(0.9, 1e-10), 0.4, 1e-3, output_every=20) for each in (own, oracle)]
    bodies = [motion.body(name) for motion in motions]
    assert np.abs(bodies[1].r[-1] - bodies[1].r[0]).max() > 0.05
    size = np.abs(motions[1].reaction("hinge").force).max()
    assert_allclose(bodies[0].r, bodies[1].r, rtol=0, atol=2e-6)
    assert_allclose(motions[0].reaction("hinge").force, motions[1].reaction("hinge").force, rtol=0, atol=2e-4 * size)


@pytest.mark.parametrize("tangent", ["complex", "differences"])
def test_the_tangent_with_accelerations_is_exact(tangent):
    own, _ = pair("rigid")
    system = replace(own, elements=[replace(own.elements[0], tangent=tangent)])
    assert check_element(system, "heavy").findings == ()
    assert_tangent_is_exact(system, tolerance=4e-9 if tangent == "complex" else 2e-7)


def test_modes_know_the_added_mass():
    """A body on a bushing with the mass as an element, and as a body: the same frequencies."""
    body = RigidBody("body", 2.0, np.diag([0.1, 0.2, 0.3]))
    stiffness = np.diag([1e3, 2e3, 3e3, 40.0, 50.0, 60.0])
    mount = Bushing("mount", Marker(GROUND), Marker("body"), stiffness=stiffness)
    marker = Marker("body", position=(0.3, 0.1, 0.2))
    own = System([body], forces=[mount], elements=[Heavy("heavy", marker, gravity=0.0)])
    lump = RigidBody("lump", MASS, INERTIA, position=(0.3, 0.1, 0.2))
    oracle = System([body, lump], [FixedJoint("weld", marker, Marker("lump"))], [mount])
    found, exact = (system_modes(linearize(each)).natural_frequencies for each in (own, oracle))
    assert_allclose(np.sort(found), np.sort(exact), rtol=1e-9)


def test_a_response_sees_the_acceleration_an_element_shows():
    """Output m a of the mass under a force on the body, over frequency: -omega² x m, on both sides."""
    body = RigidBody("body", 2.0, np.diag([0.1, 0.2, 0.3]))
    mount = Bushing("mount", Marker(GROUND), Marker("body"), stiffness=1e3 * np.eye(6), damping=20.0 * np.eye(6))
    system = System([body], forces=[mount], elements=[Shown("heavy", Marker("body"))],
                    sensors=[ElementSensor("seen", "heavy", "force")])  # fmt: skip
    push = Channel("push", Marker("body"), (1.0, 0, 0))
    omega = 2 * np.pi * np.array([1.0, 3.0, 9.0])
    found = frequency_response(linearize(system, inputs=[push], outputs=system.sensors), omega / (2 * np.pi))
    exact = -MASS * omega**2 / (1e3 + 20j * omega - (2.0 + MASS) * omega**2)
    assert_allclose(found.values[:, 0, 0], exact, rtol=1e-7)


def test_analyses_without_accelerations_name_the_element():
    own, _ = pair("rigid")
    for analysis in (open_equations, lambda each: kinematics(each, [0.0, 0.1])):
        with pytest.raises(ModelError, match="element 'heavy' uses accelerations"):
            analysis(own)
    with pytest.raises(ModelError, match="element 'feedback' has states and uses accelerations"):
        linearize(System([RigidBody("cart", 1.0, np.eye(3))], elements=[Follow("feedback", Marker("cart"))]))


@njit
def shown_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Add a mass without moment, and show its inertia force."""
    for i in range(3):
        wrench[0, i] = -data[0] * x[0, 18 + i]
    outputs[0] = data[0] * x[0, 18]


@dataclass(frozen=True, eq=False)
class Shown(Element):
    """A point mass that shows m a along x."""

    name: str
    marker: Marker

    def law(self, placed):
        return ElementLaw(function=shown_law, data=[MASS], outputs=("force",), tangent="complex", accelerations=True)


@njit
def follow_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Push against the acceleration that a filter of first order shows."""
    z_dot[0] = (x[0, 18] - z[0]) / data[1]
    wrench[0, 0] = -data[0] * z[0]
    outputs[0] = x[0, 18]


@dataclass(frozen=True, eq=False)
class Follow(Element):
    """Feedback of a filtered accelerometer."""

    name: str
    marker: Marker

    def law(self, placed):
        return ElementLaw(
            function=follow_law, data=[1.5, 0.05], states=("filtered",), outputs=("seen",), tangent="complex",
            acts=("force",), accelerations=True,
        )  # fmt: skip


def test_an_accelerometer_feeds_back_through_its_filter():
    """m x'' = -k x - g z, T z' = x'' - z: a linear system of three states, in closed form."""
    from scipy.linalg import expm

    m, k, gain, T = 2.0, 50.0, 1.5, 0.05
    body = RigidBody("cart", m, np.eye(3), velocity=(1.0, 0, 0))
    rail = PrismaticJoint("rail", Marker(GROUND), Marker("cart"), axis=(1, 0, 0))
    spring = Bushing("spring", Marker(GROUND), Marker("cart"), stiffness=np.diag([k, 0, 0, 0, 0, 0]))
    system = System([body], [rail], [spring], elements=[Follow("feedback", Marker("cart"))])
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-11), 1.0, 5e-4, output_every=100)
    A = np.array([[0, 1, 0], [-k / m, 0, -gain / m], [-k / m / T, 0, -(gain / m + 1) / T]])
    exact = np.array([expm(A * t) @ [0, 1.0, 0] for t in motion.t])
    seen = element_motion(system, motion, "feedback")
    assert_allclose(motion.body("cart").r[:, 0], exact[:, 0], rtol=0, atol=2e-6)
    assert_allclose(seen.states["filtered"], exact[:, 2], rtol=0, atol=2e-5)
    assert_allclose(seen.outputs["seen"], exact @ A[1], rtol=0, atol=2e-5)
