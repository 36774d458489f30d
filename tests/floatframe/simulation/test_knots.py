"""What steps pass over is said."""

import logging

import numpy as np
import pytest

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PrismaticJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.model.functions.tables import acceleration_table, linear_table, monotone_table, quintic_table
from floatframe.simulation.step_advice import knot_words

t = np.linspace(0.0, 0.1, 101)


def driven(function):
    rail = PrismaticJoint("rail", GROUND, Marker("box"), axis=(1, 0, 0), motions={"distance": function})
    return System([RigidBody("box", 1.0, np.eye(3))], [rail])


def pushed(function):
    rail = PrismaticJoint("rail", GROUND, Marker("box"), axis=(1, 0, 0))
    return System([RigidBody("box", 1.0, np.eye(3))], [rail], [JointForce("push", "rail", "distance", motor=function)])


def test_steps_longer_than_the_samples_of_a_table_are_said():
    (words,) = knot_words(pushed(linear_table(t, np.sin(90 * t))), 0.0, 2.5e-3, 40)
    assert words.startswith("forces.push.motor: steps of 0.0025 pass over 59 of the 99 knots of its table")
    assert "whose smallest interval is 0.001" in words


@pytest.mark.parametrize("h", [1e-3, 5e-4, 7e-4])
def test_steps_that_meet_every_sample_say_nothing(h):
    motion = quintic_table(np.append(t, [0.2, 0.3]), np.append(np.sin(90 * t), [0.0, 0.0]))
    for system in (
        pushed(linear_table(t, np.sin(90 * t))),
        driven(acceleration_table(t, np.sin(90 * t))),
        driven(motion),
    ):
        assert knot_words(system, 0.0, h, int(0.0999 / h)) == ()


def test_a_jump_of_a_driven_acceleration_inside_a_step_is_said():
    a = np.cos(90 * t)  # begins with one at t = 0.02
    system = driven(acceleration_table(t + 0.02, a))
    assert knot_words(system, 0.0, 1e-3, 100) == ()
    (words,) = knot_words(system, 0.0, 3e-4, 300)
    assert words.startswith(
        "joints.rail.motions.distance: its acceleration jumps inside 1 steps, first by 1 at t = 0.02"
    )
    corners = driven(monotone_table(t, np.sin(90 * t)))
    assert "jumps inside" in knot_words(corners, 0.0, 7e-4, 140)[0]


def test_a_run_says_it(caplog):
    with caplog.at_level(logging.WARNING):
        integrate(pushed(linear_table(t, np.sin(90 * t))), GeneralizedAlpha(), 0.01, 2e-3)
    assert any("forces.push.motor: steps of 0.002 pass over 4 of the 9 knots" in r.getMessage() for r in caplog.records)
