"""Public elements beside the built-in parts that do the same."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    consistent_state,
    element_motion,
    integrate,
    point_motion,
)
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.sensors import ElementSensor, measured, measurement_of
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.elements.laws import FUNCTIONS, Ball, Spring
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

METHOD = GeneralizedAlpha(0.9, 1e-11)
ENDS = (Marker("a", position=(0.1, 0.2, 0.3)), Marker("b", position=(0.3, 0.1, 0.2)))
HELD = (Marker(GROUND, position=(0, 0, 1)), Marker("a", position=(0.3, 0.3, 0.3)))


def two_bodies():
    inertia = np.diag([0.1, 0.2, 0.25])
    return [
        RigidBody("a", mass=2.0, inertia=inertia, position=(1, 0, 0), omega_B=(1, 2, 3)),
        RigidBody("b", mass=1.0, inertia=inertia, position=(2, 0.3, 0), omega_B=(1, -2, 3)),
    ]


def sprung(elements=(), forces=()):
    return System(two_bodies(), [], [*forces, Gravity((0, 0, -9.81))], elements=elements)


def built_in():
    return sprung(
        forces=[
            SpringDamper("s", *ENDS, stiffness=200.0, damping=1.0, preload=1.0),
            SpringDamper("g", *HELD, stiffness=300.0, damping=2.0, preload=1.0),
        ]
    )


def as_elements(**options):
    return sprung([Spring("s", *ENDS, 200.0, 1.0, 1.0, **options), Spring("g", *HELD, 300.0, 2.0, 1.0, **options)])


def places(motion):
    return np.concatenate([motion.body(name).r for name in motion.body_names], axis=1)


@pytest.fixture(scope="module")
def oracle():
    return integrate(built_in(), METHOD, 0.3, 1e-3)


@pytest.mark.parametrize("how", FUNCTIONS)
@pytest.mark.parametrize("is_opposite", [True, False])
def test_a_spring_moves_as_the_built_in_one(oracle, how, is_opposite):
    motion = integrate(as_elements(how=how, is_opposite=is_opposite), METHOD, 0.3, 1e-3)
    assert_allclose(places(motion), places(oracle), rtol=0, atol=1e-12)
    assert np.abs(balance_defect(motion) - balance_defect(oracle)).max() < 1e-11 * energy_scale(oracle)


@pytest.mark.parametrize("how", FUNCTIONS)
@pytest.mark.parametrize("is_opposite", [True, False])
def test_the_tangent_of_a_spring_is_exact(how, is_opposite):
    assert_tangent_is_exact(as_elements(how=how, is_opposite=is_opposite), tolerance=1e-8)


def pendulum(joint=(), elements=()):
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3))
    body = FlexibleBody("b", flexible, omega_B=(0.3, -0.2, 0.5))
    return System([body], joint, [Gravity((0, 0, -9.81))], elements=elements)


def hinge():
    place = pendulum().bodies[0].reduced.interfaces[0].position
    return Marker(GROUND, position=place), Marker("b", "end_a")


def test_three_multipliers_hold_a_flexible_pendulum_as_a_spherical_joint_does():
    plain = replace(METHOD, stabilized=False)  # velocities of joints are held too, those of rows of elements never
    by_joint = integrate(pendulum([SphericalJoint("ball", *hinge())]), plain, 0.2, 1e-3)
    system = pendulum(elements=[Ball("ball", *hinge())])
    by_element = integrate(system, plain, 0.2, 1e-3)
    assert_allclose(by_element.body("b").r, by_joint.body("b").r, rtol=0, atol=1e-11)
    assert_allclose(by_element.body("b").q, by_joint.body("b").q, rtol=0, atol=1e-11)
    reaction = by_joint.reaction("ball").force
    held = element_motion(system, by_element, "ball")
    atol = 1e-12 / (0.25 * 1e-3**2)  # rounding of positions by beta h²
    assert_allclose(np.column_stack(list(held.multipliers.values())), reaction, rtol=0, atol=atol)
    assert_allclose(held.wrench[:, 1, :3], -reaction, rtol=0, atol=atol)
    start = [consistent_state(each) for each in (pendulum([SphericalJoint("ball", *hinge())]), system)]
    assert_allclose(start[1].u_dot, start[0].u_dot, rtol=0, atol=1e-10)
    assert_allclose(start[1].w[-3:], start[0].w[:3], rtol=0, atol=1e-10)


def test_the_tangent_of_held_rows_is_exact():
    assert_tangent_is_exact(pendulum(elements=[Ball("ball", *hinge())]))


def test_a_sensor_shows_outputs_by_their_names():
    system = as_elements()
    motion = integrate(system, METHOD, 0.05, 1e-3)
    found = measured(system, motion, [ElementSensor("all", "s"), ElementSensor("one", "s", "tension")])
    assert found["all"].units == {"tension": "N", "energy": "J", "lost": "W"}
    assert list(found["one"].columns) == ["tension"]
    ends = [point_motion(motion, end.body, end.position).position for end in ENDS]
    start = [point_motion(motion, end.body, end.position).position[0] for end in ENDS]
    rate = [point_motion(motion, end.body, end.position).velocity for end in ENDS]
    line = ends[1] - ends[0]
    length = np.linalg.norm(line, axis=1)
    stretched = length - np.linalg.norm(start[1] - start[0])
    tension = 200 * stretched + 1 * np.einsum("ti,ti->t", line, rate[1] - rate[0]) / length + 1
    assert_allclose(found["one"].columns["tension"], tension, rtol=1e-10)
    assert_allclose(measurement_of(system, motion, "s.energy").columns["energy"], found["all"].columns["energy"])
