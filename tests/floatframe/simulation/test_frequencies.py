"""Supplies, loads and drives that vary faster than the steps follow are told by name, with the step that follows."""

import logging

import numpy as np
import pytest

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    UserForce,
    integrate,
)
from floatframe.components import drives
from floatframe.integrators import RelativeOde
from floatframe.joints import AxialDistance
from floatframe.model.functions.time_functions import constant, harmonic, piecewise, polynomial_of_time
from floatframe.simulation.step_advice import frequency_words

A, B = Marker(GROUND, position=(1.0, 2.0, 3.0)), Marker("b")
SINE = harmonic(3.0, 2 * np.pi * 50, phase=0.3, offset=1.0)
RAIL, HINGE = PrismaticJoint("rail", A, B), RevoluteJoint("hinge", A, B)


def system(joints=(), forces=(), elements=()):
    body = RigidBody("b", 1.0, 0.05 * np.eye(3), position=(1.0, 2.0, 3.0))
    return System([body], list(joints), list(forces), elements=list(elements))


def induction_motor(frequency=50.0, **given):
    supply = {"rated_voltage": 325.0, "rated_frequency": 50.0} | given
    return drives.InductionMotor(
        "m", A, B, stator_resistance=0.8, rotor_resistance=0.6, stator_leakage=0.004, rotor_leakage=0.004,
        magnetizing=0.12, pole_pairs=2, frequency=frequency, **supply,
    )  # fmt: skip


def user(text):
    x = {"x": AxialDistance(A, B, axis=(0, 0, 1))}
    return UserForce(
        "u", x, {"x": text}, parameters={"w": 2 * np.pi * 50}, functions={"late": polynomial_of_time([0, 2])}
    )


CASES = {
    "forces.f.amplitude": lambda: system(forces=[PointForce("f", B, (1, 0, 0), amplitude=SINE)]),
    "forces.f.motor": lambda: system([RAIL], [JointForce("f", "rail", "distance", motor=SINE)]),
    "joints.j.motions.distance": lambda: system([PrismaticJoint("j", A, B, motions={"distance": SINE})]),
    "elements.m.controller.target": lambda: system(
        [HINGE], elements=[drives.PidDrive("m", A, B, drives.Pid(target=SINE, kp=1.0))]
    ),
    "elements.m": lambda: system([HINGE], elements=[induction_motor()]),
    "forces.u": lambda: system(forces=[user("2 + sin(w*late(t)/2 + 0.4)*x")]),
}


@pytest.mark.parametrize(("where", "make"), CASES.items(), ids=CASES)
def test_a_frequency_that_steps_do_not_follow_is_told(where, make):
    """50 Hz: a period of 20 ms, which steps of 1 ms follow by 20, of 5 ms by 4."""
    (words,) = frequency_words(make(), 0.0, 5e-3, 100)
    assert words == (
        f"{where}: steps of 0.005 do not follow its frequency: 4 steps in its period of 0.02; h = 0.001 has 20"
    )
    assert frequency_words(make(), 0.0, 1e-3, 500) == ()
    assert frequency_words(make(), 0.0, 5e-3, 100, has_steps_of_one_size=False) == ()
    (words,) = frequency_words(make(), 0.0, 2e-2, 100, has_steps_of_one_size=False)
    assert "1 steps in its period of 0.02; h = 0.001" in words


def test_the_highest_frequency_of_a_run_counts():
    """Of harmonics, of a frequency that rises, of pieces that act in the run."""
    (words,) = frequency_words(
        system([HINGE], elements=[induction_motor(harmonics=[[-5, 0.2], [7, -0.14]])]), 0, 1e-3, 9
    )
    assert "2.86 steps in its period of 0.002857" in words
    rising = system([HINGE], elements=[induction_motor(polynomial_of_time([0.0, 10.0]))])
    assert frequency_words(rising, 0.0, 1e-3, 4000) == ()
    assert "18.2 steps in its period of 0.01818" in frequency_words(rising, 0.0, 1e-3, 5500)[0]
    late = piecewise([0.0, 2.0], [constant(1.0), SINE])
    for t, n in ((0.0, 0), (1.0, 0), (1.9, 1), (3.0, 1)):
        assert len(frequency_words(system(forces=[PointForce("f", B, (1, 0, 0), amplitude=late)]), t, 5e-3, 40)) == n


def test_a_run_tells_it(caplog):
    loaded = CASES["forces.f.amplitude"]()
    with caplog.at_level(logging.WARNING):
        integrate(loaded, GeneralizedAlpha(0.8), 0.02, 1e-3)
        integrate(loaded, RelativeOde(), 0.02, 5e-3)
    assert not any("frequency" in record.getMessage() for record in caplog.records)
    with caplog.at_level(logging.WARNING):
        integrate(loaded, GeneralizedAlpha(0.8), 0.02, 5e-3)
    assert any("forces.f.amplitude: steps of 0.005" in record.getMessage() for record in caplog.records)
