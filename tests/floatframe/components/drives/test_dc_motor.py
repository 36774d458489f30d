"""A direct current motor on a rotor: closed forms, stiff circuits, gears, control, energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from floatframe import GROUND, GeneralizedAlpha, Marker, RevoluteJoint, RigidBody, System, integrate
from floatframe.components.drives import DcMotor, Pid
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import harmonic
from floatframe.results import element_motion
from tests.floatframe.element_laws import marker_motion, placed, power_defect

J, R, L, K, D, U = 2e-3, 0.5, 2e-5, 0.05, 1e-4, 24.0
A, B = Marker(GROUND, position=(0, 0, 0)), Marker("rotor", position=(0, 0, 0))


def driven(motor):
    rotor = RigidBody("rotor", mass=1.0, inertia=np.diag([1e-3, 1e-3, J]))
    return System([rotor], [RevoluteJoint("hinge", A, B, axis=(0, 0, 1))], [], elements=[motor])


def run_up(ratio, h):
    """Current and speed at t = 0.1 by the motor, and by the exponential of the two linear equations."""
    system = driven(DcMotor("motor", A, B, R, L, K, voltage=U, damping=D, ratio=ratio))
    found = element_motion(system, integrate(system, GeneralizedAlpha(0.8, 1e-11), 0.1, h), "motor").outputs
    rates = np.array([[-R / L, -K * ratio / L], [ratio * K / J, -(ratio**2) * D / J]])
    steady = -np.linalg.solve(rates, [U / L, 0])
    return np.array([found["current"][-1], found["speed"][-1]]), steady - expm(0.1 * rates) @ steady


@pytest.mark.parametrize("ratio", [1.0, -2.5])
def test_a_run_up_is_the_exponential_at_steps_far_above_the_time_of_the_circuit(ratio):
    h = 1e-3
    assert h > 12 * 2 * L / R  # where explicit steps blow up
    coarse, exact = run_up(ratio, h)
    fine, _ = run_up(ratio, h / 20)
    assert_allclose(fine, exact, rtol=1e-6)
    order = np.log(np.abs((coarse - exact) / (fine - exact))) / np.log(20)
    assert_allclose(order, 2, rtol=0, atol=0.15)


@pytest.mark.parametrize("controlled", ["speed", "angle", "current"])
def test_electrical_power_is_stored_lost_or_given_to_the_shaft(controlled):
    pid = Pid(harmonic(5.0, 2.0), 2.0, 5.0, 0.1, 0.01, -50.0, 60.0)
    options = {"axis": [0, 1, 1], "ratio": 3.0, "friction": 0.1, "damping": 0.01}
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    x = np.array([marker_motion([0, 0, 0], turn, omega=[1, 2, -3]), marker_motion([0.3, 0.2, 0.1], omega=[10, 30, 20])])
    for motor in (
        DcMotor("m", A, B, R, L, K, controller=pid, controlled=controlled, **options),
        DcMotor("m", A, B, R, L, K, voltage=harmonic(20.0, 3.0), **options),
    ):
        law = motor.law(placed(x))
        z = np.array(law.start) + np.random.default_rng(1).normal(size=len(law.start))
        defect, throughput = power_defect(law, 0.7, x, z)
        assert abs(defect) <= 1e-13 * throughput


def test_an_angle_is_held_over_many_turns_as_by_an_independent_model():
    target, pid = 40.0, Pid(40.0, 2.0, 3.0, 0.1, 2e-3, -U, U)
    system = driven(DcMotor("motor", A, B, R, 1e-3, K, controller=pid, controlled="angle"))
    found = element_motion(system, integrate(system, GeneralizedAlpha(0.9, 1e-11), 1.0, 5e-5), "motor")
    width = 1e-3 * 2 * U

    def part(x):
        y = np.clip(x / width, 0, 1)
        return y * y * (3 - 2 * y)

    def rates(t, y):
        current, angle, speed, integral, seen = y
        error = target - angle
        output = 2 * error + integral + 0.1 * (error - seen) / 2e-3
        growth = 3 * error * (part(U - output) if error > 0 else part(output + U))
        voltage = np.clip(output, -U, U)
        return [(voltage - R * current - K * speed) / 1e-3, speed, K * current / J, growth, (error - seen) / 2e-3]

    start = [0, 0, 0, 0, target]
    exact = solve_ivp(rates, (0, 1.0), start, method="Radau", rtol=1e-10, atol=1e-10).y[:, -1]
    values = [found.outputs[key][-1] for key in ("current", "angle", "speed")]
    assert 4 * 2 * np.pi < exact[1] < 10 * 2 * np.pi
    assert_allclose(values, exact[:3], rtol=1e-6)
    assert_allclose(found.states["counted angle"][-1], exact[1], rtol=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "element 'm': expected a voltage or a controller, got neither: missing supply"),
        ({"voltage": 1.0, "controller": Pid(1.0, 1.0)}, "expected a voltage or a controller, got both"),
        ({"controller": Pid(1.0, 1.0), "controlled": "sped"}, "expected one of speed, angle, current, got 'sped'"),
        ({"voltage": "on"}, "voltage: expected a number, got 'on'"),
        ({"voltage": 1.0, "inductance": 0.0}, "inductance: expected a number above 0, got 0"),
    ],
)
def test_a_motor_that_cannot_be_is_refused(options, message):
    given = {"resistance": R, "inductance": L, "constant": K} | options
    with pytest.raises(ModelError, match=message):
        DcMotor("m", A, B, **given)
