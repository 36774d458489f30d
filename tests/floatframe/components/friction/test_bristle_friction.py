"""Friction of bristles against SciPy, against sticking for good, and against its energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.components.friction import BristleFriction
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import harmonic
from floatframe.results import element_motion
from floatframe.results.energy_balance import balance_defect
from tests.floatframe.components.friction.examples import NUMBERS, pulled
from tests.floatframe.finite_differences import assert_tangent_is_exact

METHOD = GeneralizedAlpha(0.9, 1e-10)


def rates(t, y, n, elastic, creeps):
    """The equations of the block once more: place, speed, deflection."""
    x, v, z = y
    steady = (n["coulomb"] + (n["static"] - n["coulomb"]) * np.exp(-((v / n["stribeck_speed"]) ** 2))) / n["stiffness"]
    if creeps or (abs(z) >= steady and z * v > 0):
        alpha = 1.0
    elif z * v <= 0 or abs(z) <= elastic * steady:
        alpha = 0.0
    else:
        middle = (1 + elastic) / 2 * steady
        alpha = (1 + np.sin(np.pi * (abs(z) - middle) / (steady * (1 - elastic)))) / 2
    z_dot = v * (1 - alpha * np.sign(v) * z / steady)
    friction = n["stiffness"] * z + n["damping"] * z_dot + n["viscous"] * v
    return v, 20.0 * (0.1 * t - x) - friction, z_dot


@pytest.mark.parametrize("creeps", [False, True])
def test_stick_and_slip_are_those_of_an_independent_integration(creeps):
    system = pulled(creeps=creeps)
    motion = integrate(system, METHOD, 2.5, 2.5e-4)
    exact = solve_ivp(
        rates, (0, 2.5), [0, 0, 0], "Radau", args=(NUMBERS, 0.7, creeps), rtol=1e-9, atol=1e-12, max_step=1e-3
    )
    place, most = motion.body("block").r[-1, 0], exact.y[0, -1]
    assert exact.y[1].max() > 0.2  # it has slipped
    assert_allclose(place, most, rtol=2e-4)
    assert_allclose(balance_defect(motion), 0.0, atol=1e-4)


def loaded(creeps):
    """Return a block under a load that swings between 0.1 and 0.6 of what friction holds."""
    block = RigidBody("block", 1.0, np.eye(3))
    rail = PrismaticJoint("rail", Marker(GROUND), Marker("block"), axis=(1, 0, 0))
    load = PointForce("load", Marker("block"), force=(1.0, 0, 0), amplitude=harmonic(0.25, 12.0, offset=0.35))
    options = NUMBERS | {"static": None, "stribeck_speed": None, "creeps": creeps}
    friction = BristleFriction("friction", Marker(GROUND), Marker("block"), axis=(1, 0, 0), **options)
    return System([block], [rail], [load], elements=[friction])


def test_what_sticks_stays_where_lugre_as_published_creeps():
    place = {}
    for creeps in (False, True):
        motion = integrate(loaded(creeps), METHOD, 6.0, 2e-3)
        place[creeps] = motion.body("block").r[:, 0].max()
    assert place[False] < 1.05 * 0.6 / NUMBERS["stiffness"]
    assert place[True] > 3 * place[False]


@pytest.mark.parametrize("motion", ["along", "about"])
def test_tangent_is_exact(motion):
    body = RigidBody("block", 1.0, np.diag([1.0, 2.0, 1.5]), omega_B=(0.0, 0.0, 0.02), velocity=(0, 0, 0.02))
    joint = (PrismaticJoint if motion == "along" else RevoluteJoint)(
        "joint", Marker(GROUND), Marker("block"), axis=(0, 0, 1)
    )
    friction = BristleFriction("friction", Marker(GROUND), Marker("block"), motion=motion, **NUMBERS)
    assert_tangent_is_exact(System([body], [joint], elements=[friction]))


def test_a_wheel_on_a_brake_stops_after_the_angle_of_its_energy():
    """J w²/2 = M phi, but for the elastic turn of the bristles."""
    wheel = RigidBody("wheel", 1.0, 2 * np.eye(3), omega_B=(0, 0, 3.0))
    axle = RevoluteJoint("axle", Marker(GROUND), Marker("wheel"), axis=(0, 0, 1))
    options = {"coulomb": 5.0, "stiffness": 1e5, "damping": 300.0, "speed": 3.0, "motion": "about"}
    brake = BristleFriction("brake", Marker(GROUND), Marker("wheel"), **options)
    system = System([wheel], [axle], elements=[brake])
    motion = integrate(system, METHOD, 1.6, 1e-3)
    seen = element_motion(system, motion, "brake")
    lost = np.trapezoid(seen.outputs["power lost"], motion.t)
    assert_allclose(lost, 9.0, rtol=1e-3)
    assert abs(motion.body("wheel").omega_B[-1, 2]) < 1e-6


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"static": 0.5}, "would never stick"),
        ({"stribeck_speed": None}, "stribeck_speed: missing"),
        ({"stiffness": 0.0}, "stiffness"),
        ({"elastic": 1.0}, "elastic: expected a fraction below 1"),
        ({"motion": "round"}, "expected one of along, about"),
    ],
)
def test_numbers_out_of_range_are_refused(options, words):
    with pytest.raises(ModelError, match=words):
        pulled(**options)
