"""A unit makes the motion that `integrate` makes of the same inputs, and can go back."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import GROUND, GeneralizedAlpha, Marker, PrismaticJoint, RigidBody, System, integrate, read_system
from floatframe.errors import ConvergenceError, ModelError, ResultsError
from floatframe.files.cosimulation.unit import Unit, UnitState, quintic
from floatframe.model.functions.time_functions import constant, polynomial_of_time
from floatframe.sensors import measured
from tests.floatframe.files.cosimulation.arms import MACRO, T_END, H, motor_at, write_arm

MOTOR = "forces.motor.motor"


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return read_system(write_arm(tmp_path_factory.mktemp("arm")))


def made(arm, **options):
    system, run = arm
    unit = Unit(system, run.integrator, run.h, **{"names": [MOTOR, "torque"], **options})
    unit.begin()
    return unit


def led(unit, first, last):
    """Take communication steps with the inputs of the file."""
    found = []
    for k in range(first, last):
        unit.set(MOTOR, motor_at(k * MACRO))
        unit.step(k * MACRO, MACRO)
        found.append(unit.values())
    return found


def test_outputs_are_those_of_a_run_with_the_same_inputs(arm):
    """To 1e-8 of each sensor, jumps of the motor and the state of a user force included; after a jump, its new side."""
    system, run = arm
    motion = measured(system, integrate(system, run.integrator, T_END, H))
    found = led(made(arm), 0, round(T_END / MACRO))
    every = round(MACRO / H)
    jumps = [k for k in range(len(found)) if motor_at((k + 1) * MACRO) != motor_at(k * MACRO)]
    assert len(jumps) == 2
    for name, sensor in motion.items():
        values = np.array([[each[f"{name}.{column}"] for column in sensor.columns] for each in found])
        expected = np.array([column[every::every] for column in sensor.columns.values()]).T
        smooth = [k for k in range(len(found)) if k not in jumps]
        assert_allclose(values[smooth], expected[smooth], rtol=0, atol=1e-8 * np.abs(expected).max(), err_msg=name)


def test_a_step_depends_on_state_and_inputs_alone(arm):
    unit = made(arm)
    led(unit, 0, 12)
    kept = unit.state()
    expected = led(unit, 12, 20)
    unit.restore(kept)
    assert led(unit, 12, 20) == expected
    other = made(arm)
    other.restore(UnitState.from_bytes(kept.to_bytes(), other.system))
    assert led(other, 12, 20) == expected


def test_an_input_of_the_linearised_system_is_a_torque_of_the_motion(arm):
    """On the wrist: its torque is the force along the coordinate, with the other sign of the lag's."""
    unit = made(arm, outputs=["wrist.angle"])
    before = unit.values()["wrist.angle.force"]
    unit.set("torque", 3.0)
    assert_allclose(unit.values()["wrist.angle.force"] - before, 3.0, rtol=0, atol=1e-9)


def cart(motion):
    body = RigidBody("cart", 2.0, np.eye(3))
    return System([body], [PrismaticJoint("rail", GROUND, Marker("cart"), (1, 0, 0), motions={"distance": motion})])


def test_a_drive_follows_value_rate_and_acceleration():
    """Given those of x(t) with a constant acceleration it is x(t); the force is m a."""
    a, H_big = 3.0, 0.02
    unit = Unit(cart(constant(0.0)), GeneralizedAlpha(), 0.005)
    unit.set("joints.rail.distance.acceleration", a)
    unit.begin()
    for k in range(10):
        t = k * H_big
        unit.set("joints.rail.distance", a * t**2 / 2)
        unit.set("joints.rail.distance.rate", a * t)
        unit.step(t, H_big)
        found = unit.values()
        assert_allclose(found["rail.distance.value"], a * (t + H_big) ** 2 / 2, rtol=1e-12)
        assert_allclose(found["rail.distance.force"], 2.0 * a, rtol=1e-7)


def test_a_drive_meets_a_smooth_motion_in_the_third_power_of_the_step():
    def error(size):
        unit = Unit(cart(constant(0.0)), GeneralizedAlpha(), size)
        unit.set("joints.rail.distance.rate", 1.0)
        unit.begin()
        worst = 0.0
        for k in range(round(1.0 / size)):
            t = k * size
            for name, value in (("", np.sin(t)), (".rate", np.cos(t)), (".acceleration", -np.sin(t))):
                unit.set(f"joints.rail.distance{name}", value)
            unit.step(t, size)
            worst = max(worst, abs(unit.values()["rail.distance.value"] - np.sin(t + size)))
        return worst

    sizes = np.array([0.1, 0.05, 0.025, 0.0125])
    slope = np.polyfit(np.log(sizes), np.log([error(size) for size in sizes]), 1)[0]
    assert abs(slope - 3.0) < 0.15


def test_the_polynomial_of_a_drive_meets_both_ends():
    begin, end, T = np.array([0.3, -1.0, 2.0]), np.array([0.1, 0.7, -4.0]), 0.3
    c = quintic(begin, end, T)
    function = polynomial_of_time(list(c))
    assert_allclose([function(0.0, k) for k in range(3)], begin, rtol=1e-14)
    assert_allclose([function(T, k) for k in range(3)], end, rtol=1e-12)


def test_a_step_that_fails_leaves_the_unit_where_it_was(arm):
    system, run = arm
    unit = made((system, replace(run, integrator=GeneralizedAlpha(max_iterations=2))))
    unit.set("torque", 1e9)
    before = unit.state()
    with pytest.raises(ConvergenceError, match=r"the step of 0\.001 from t = 0 failed"):
        unit.step(0.0, MACRO)
    assert unit.t == 0.0
    assert_array_equal(unit.state().memory.state.q, before.memory.state.q)
    unit.set("torque", 0.0)
    unit.step(0.0, MACRO)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda unit: unit.set("motor", 1.0), "no input 'motor'; expected one of torque, forces.motor.motor"),
        (lambda unit: unit.set(MOTOR, np.nan), "expected a finite number, got nan"),
        (lambda unit: unit.step(0.1, MACRO), "is to begin at t = 0.1, but it is at 0"),
        (lambda unit: unit.step(0.0, -1.0), "expected a communication step above 0, got -1"),
        (lambda unit: UnitState.from_bytes(b"no state", unit.system), "these bytes are not one that was serialised"),
    ],
)
def test_bad_calls_are_refused(arm, call, words):
    with pytest.raises((ModelError, ResultsError), match=words):
        call(made(arm))


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["forces.motr.motor"], "no input 'forces.motr.motor'; did you mean 'forces.motor.motor'"),
        (["joints.hinge.angle"], r"where the file prescribes it: \[joints.NAME.motions.COORDINATE\]"),
    ],
)
def test_unknown_inputs_are_refused(arm, names, words):
    with pytest.raises(ModelError, match=words):
        made(arm, names=names)
