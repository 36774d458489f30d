"""Cables: taut and slack against closed forms, over pulleys, preloaded, and refusals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PrismaticJoint,
    RigidBody,
    System,
    integrate,
    read_system,
    static_equilibrium,
)
from floatframe.components.cables import Cable
from floatframe.errors import ModelError
from floatframe.results import element_motion
from floatframe.results.energy_balance import balance_defect
from tests.floatframe.components.cables.examples import G, jumper
from tests.floatframe.finite_differences import assert_tangent_is_exact

METHOD = GeneralizedAlpha(0.95, 1e-11)


def test_a_jump_into_a_cable_is_a_fall_and_half_a_wave():
    """Falls 0.5 m, then swings about m g/k below 1 m, and comes back with its speed, slack again."""
    m, k = 2.0, 400.0
    omega, v = np.sqrt(k / m), np.sqrt(2 * G * 0.5)
    fall, sag = np.sqrt(2 * 0.5 / G), m * G / k
    taut = (2 * np.pi - 2 * np.arctan2(v / omega, sag)) / omega
    system = jumper()
    motion = integrate(system, METHOD, fall + taut + 0.1, 2e-4)
    rope = element_motion(system, motion, "rope").outputs
    assert_allclose(rope["tension"].max(), k * (sag + np.hypot(sag, v / omega)), rtol=1e-5)
    assert_allclose(motion.body("mass").r[-1, 2], -1.0 + v * 0.1 - 0.5 * G * 0.01, atol=2e-4)
    assert rope["tension"][-1] == 0.0
    assert rope["slack"][-1] > 0
    assert_allclose(balance_defect(motion), 0.0, atol=1e-3)


def test_a_cable_over_a_point_carries_one_tension():
    """Two masses on one cable over a point 1 m above: acceleration (m1 - m2) g/(m1 + m2)."""
    masses = [RigidBody(n, m, np.eye(3), position=(x, 0, 0)) for n, m, x in (("one", 3.0, 0.0), ("two", 2.0, 0.0))]
    guides = [PrismaticJoint(f"{b.name} guide", Marker(GROUND), Marker(b.name), axis=(0, 0, 1)) for b in masses]
    rope = Cable("rope", [Marker("one"), Marker(GROUND, position=(0, 0, 1.0)), Marker("two")], 1e6, damping=2e3,
                 preload=2 * 3.0 * 2.0 * G / 5.0)  # fmt: skip
    system = System(masses, guides, [Gravity((0, 0, -G))], elements=[rope])
    motion = integrate(system, METHOD, 0.2, 1e-3)
    assert_allclose(motion.body("one").r[-1, 2], -0.5 * G / 5 * 0.04, rtol=1e-4)
    assert_allclose(element_motion(system, motion, "rope").outputs["tension"][-1], 12.0 * G / 5, rtol=1e-4)


def test_statics_and_tangent():
    hung = static_equilibrium(jumper(length=0.4))
    assert_allclose(hung.state.r[0, 2], -0.4 - 2 * G / 400, rtol=1e-9)
    assert_tangent_is_exact(jumper(length=0.4, damping=3.0))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"preload": 1.0}, "expected one of them, got both"),
        ({"length": -1.0}, "length"),
        ({"stiffness": 0.0}, "stiffness"),
    ],
)
def test_numbers_out_of_range_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        jumper(**options)


def test_points_that_coincide_and_too_much_preload_are_refused():
    mass = RigidBody("mass", 2.0, np.eye(3))
    for cable, words in (
        (Cable("c", [Marker(GROUND), Marker("mass")], 1.0), "coincide as placed"),
        (Cable("c", [Marker(GROUND, position=(0, 0, 1)), Marker("mass")], 1.0, preload=2.0), "more than its length"),
    ):
        with pytest.raises(ModelError, match=words):
            integrate(System([mass], elements=[cable]), METHOD, 0.1, 1e-2)


def test_a_cable_and_a_brake_of_a_system_file_are_those_of_python(tmp_path):
    path = tmp_path / "hung.toml"
    path.write_text(
        """
        [system]
        units = "m-kg-s"
        gravity = [0, 0, -9.81]
        [bodies.mass]
        mass = 2.0
        inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        position = [0, 0, -0.5]
        [joints.guide]
        type = "prismatic"
        body_a = "ground"
        body_b = "mass"
        marker_a = [0, 0, 0]
        marker_b = [0, 0, 0]
        axis = [0, 0, 1]
        [elements.rope]
        type = "cables.cable"
        points = [{body = "ground", marker = [0, 0, 0]}, {body = "mass", marker = [0, 0, 0]}]
        stiffness = 400.0
        length = 0.4
        [elements.brake]
        type = "friction.bristles"
        marker_a = {body = "ground", marker = [0, 0, 0]}
        marker_b = {body = "mass", marker = [0, 0, 0]}
        axis = [0, 0, 1]
        coulomb = 1.0
        stiffness = 1e4
        """
    )
    system, _ = read_system(path)
    assert [element.name for element in system.elements] == ["rope", "brake"]
    plain = System(system.bodies, system.joints, system.forces, elements=[system.elements[0]])
    assert_allclose(static_equilibrium(plain).state.r[0, 2], -0.4 - 2 * G / 400, rtol=1e-9)
