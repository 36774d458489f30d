"""Public elements beside the built-in parts that do the same."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import SphericalJoint, integrate
from floatframe.analyses import consistent_state
from floatframe.results import element_motion, point_motion
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.sensors import ElementSensor, measured, measurement_of
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.elements.laws import FUNCTIONS, Ball
from tests.floatframe.model.elements.public_elements_examples import (
    ENDS,
    METHOD,
    as_elements,
    built_in,
    hinge,
    pendulum,
    places,
)


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
