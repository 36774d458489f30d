"""Controllers and drives by control: windup, filters, maps, against independent models and closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from floatframe import GeneralizedAlpha, PrismaticJoint, RevoluteJoint, RigidBody, System, integrate
from floatframe.analyses import check_element
from floatframe.components.drives import Pid, PidDrive, SpeedControl, TorqueMap
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import constant, harmonic
from floatframe.results import element_motion
from tests.floatframe.components.drives.controllers_examples import A, B, J, every_drive, turned
from tests.floatframe.element_laws import evaluate, marker_motion, placed
from tests.floatframe.finite_differences import assert_tangent_is_exact

METHOD = GeneralizedAlpha(0.9, 1e-11)


def outputs(system, name, t_end, h):
    return element_motion(system, integrate(system, METHOD, t_end, h), name)


def test_a_speed_control_is_its_linear_equation():
    """J dw/dt = K ((target - w) - lambda (w - x)/T), dx/dt = (w - x)/T."""
    K, lam, T, target, start = 3.0, 0.05, 4e-3, 30.0, 12.0
    system = turned(SpeedControl("hold", A, B, target, K, lam, T, speed=start), omega=start)
    found = outputs(system, "hold", 0.2, 2e-4)
    rates = np.array([[-K / J * (1 + lam / T), K / J * lam / T], [1 / T, -1 / T]])
    steady = np.array([target, target])
    exact = steady + expm(0.2 * rates) @ (start - steady)
    assert_allclose([found.outputs["speed"][-1], found.states["filtered speed"][-1]], exact, rtol=1e-6)
    slow = target + (start - target) * np.exp(-0.2 * K / (J + K * lam))  # lambda as an inertia
    assert_allclose(found.outputs["speed"][-1], slow, rtol=2e-3)


def test_a_speed_control_gives_its_limit_and_no_more():
    law = SpeedControl("hold", A, B, 100.0, 3.0, limit=50.0).law(placed(np.array([marker_motion([0, 0, 0])] * 2)))
    for omega, torque in ((0.0, 50.0), (95.0, 15.0), (200.0, -50.0)):
        x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, 0], omega=[0, 0, omega])])
        wrench, _, seen = evaluate(law, 0.0, x, np.zeros(0))
        assert_allclose([wrench[1, 5], wrench[0, 5], seen["power in"]], [torque, -torque, torque * omega], rtol=1e-14)


def overshoot(**options):
    pid = Pid(1.0, 4.0, 20.0, lower=-2.0, upper=2.0, **options)
    found = outputs(turned(PidDrive("pid", A, B, pid, "speed")), "pid", 1.5, 1e-3)
    return found.outputs["speed"].max() - 1.0, found


def test_controllers_that_do_not_wind_up_overshoot_less():
    wound, _ = overshoot(anti_windup="none")
    clamped, found = overshoot(anti_windup="clamping")
    followed, _ = overshoot(anti_windup="back-calculation", tracking_time=0.05)
    assert np.abs(found.outputs["torque"]).max() == 2.0
    assert wound > 0.3
    assert clamped < 0.7 * wound
    assert followed < 0.7 * wound


@pytest.mark.parametrize(("kp", "ki"), [(4.0, 20.0), (0.0, 20.0)])
def test_the_only_limit_may_be_zero_in_a_system_of_any_size(kp, ki):
    """A drive that cannot pull: a body and gains of a millionth do the same; the integral stops at the limit."""
    found = []
    for size in (1.0, 1e-6):
        pid = Pid(harmonic(1.0, 2.0), size * kp, size * ki, lower=0.0)
        rotor = RigidBody("rotor", mass=2.0 * size, inertia=size * np.diag([0.3, 0.3, J]))
        system = System(
            [rotor], [RevoluteJoint("hinge", A, B, axis=(0, 0, 1))], elements=[PidDrive("pid", A, B, pid, "speed")]
        )
        found.append(outputs(system, "pid", 1.0, 1e-3))
    assert_allclose(found[1].outputs["speed"], found[0].outputs["speed"], rtol=0, atol=1e-6)
    assert found[0].outputs["torque"].min() == 0.0 if kp else found[0].states["integral"].min() > -1e-3
    assert found[0].outputs["torque"].max() > 0.5


@pytest.mark.parametrize("anti_windup", ["none", "back-calculation"])
def test_a_controlled_speed_is_that_of_an_independent_model(anti_windup):
    kp, ki, most, tracking = 4.0, 20.0, 2.0, 0.05

    def rates(t, y):
        speed, integral = y
        wanted = kp * (1 - speed) + integral
        given = np.clip(wanted, -most, most)
        back = (given - wanted) / tracking if anti_windup == "back-calculation" else 0.0
        return [given / J, ki * (1 - speed) + back]

    exact = solve_ivp(rates, (0, 0.5), [0, 0], method="Radau", rtol=1e-9, atol=1e-11, max_step=5e-3).y[:, -1]
    pid = Pid(1.0, kp, ki, lower=-most, upper=most, anti_windup=anti_windup, tracking_time=tracking)
    found = outputs(turned(PidDrive("pid", A, B, pid, "speed")), "pid", 0.5, 1e-4)
    assert_allclose([found.outputs["speed"][-1], found.states["integral"][-1]], exact, rtol=1e-6)


def test_a_controlled_distance_settles_at_its_target_with_the_lag_of_its_actuator():
    body = RigidBody("rotor", mass=3.0, inertia=np.eye(3), position=(0, 0, 1.0))
    guide = PrismaticJoint("guide", A, B, axis=(0, 0, 1))
    drive = PidDrive("push", A, B, Pid(1.5, 300.0, 60.0, 40.0, 2e-3), "distance", time_constant=0.01)
    found = outputs(System([body], [guide], [], elements=[drive]), "push", 0.6, 2e-4)

    def rates(t, y):
        z, v, force, integral, seen = y
        error = 1.5 - z
        d = (error - seen) / 2e-3
        return [v, force / 3.0, (300 * error + integral + 40 * d - force) / 0.01, 60 * error, d]

    exact = solve_ivp(rates, (0, 0.6), [1, 0, 0, 0, 0.5], method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    assert_allclose(found.outputs["distance"][-1], exact[0], rtol=1e-6)
    assert_allclose(found.outputs["force"][-1], exact[2], rtol=1e-4)


def test_a_torque_map_drives_through_its_gear_and_takes_power_by_its_efficiency():
    torques = [[0, 40, 80], [-10, 50, 100], [-20, 30, 60]]
    given = {
        "speeds": [0, 100, 300], "throttles": [0, 0.5, 1], "torques": torques,
        "efficiency_torques": [0, 100], "efficiencies": [[0.5, 0.8], [0.6, 0.9], [0.5, 0.7]], "ratio": 4.0,
    }  # fmt: skip
    law = TorqueMap("engine", A, B, throttle=0.75, **given).law(placed(np.array([marker_motion([0, 0, 0])] * 2)))
    x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, 0], omega=[0, 0, 12.5])])  # the motor turns at 50
    wrench, _, seen = evaluate(law, 0.0, x, np.zeros(0))
    motor = (60 + 75) / 2
    eta = np.mean([0.5 + 0.3 * motor / 100, 0.6 + 0.3 * motor / 100])
    assert_allclose(wrench[1, 5], 4 * motor, rtol=1e-14)
    assert_allclose(seen["power in"], motor * 50 / eta, rtol=1e-13)
    assert_allclose(seen["power in"] - seen["power lost"], motor * 50, rtol=1e-13)


def test_a_torque_map_without_efficiencies_loses_no_power():
    given = {"speeds": [0, 100], "throttles": [0, 1], "torques": [[0, 80], [-10, 60]], "ratio": 4.0}
    law = TorqueMap("engine", A, B, throttle=0.5, **given).law(placed(np.array([marker_motion([0, 0, 0])] * 2)))
    x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, 0], omega=[0, 0, 12.5])])
    _, _, seen = evaluate(law, 0.0, x, np.zeros(0))
    motor = (40 + 25) / 2  # the motor turns at 50
    assert_allclose([seen[key] for key in ("efficiency", "power in", "power lost", "power out")],
                    [1.0, motor * 50, 0.0, motor * 50], rtol=1e-13, atol=0)  # fmt: skip


@pytest.mark.parametrize("drive", list(every_drive()), ids=lambda drive: type(drive).__name__)
def test_the_tangent_of_a_drive_is_exact(drive):
    system = turned(drive, omega=3.0)
    assert_tangent_is_exact(system, tolerance=2e-8)
    assert check_element(system, "motor").findings == ()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pid(1.0, 1.0, anti_windup="clamp"), "anti_windup: expected one of none, clamping, back-calculation"),
        (lambda: Pid(1.0, 1.0, kd=1.0), "filter_time: missing; kd acts on a filtered rate"),
        (lambda: Pid(1.0, 1.0, 1.0, anti_windup="back-calculation"), "tracking_time: missing"),
        (lambda: Pid(1.0, 1.0, lower=2.0, upper=1.0), "upper: expected a number above lower = 2, got 1"),
        (lambda: SpeedControl("s", A, B, 1.0, 1.0, 0.1), "element 's': filter_time: missing; .* such as 0.005"),
        (lambda: TorqueMap("t", A, B, [0, 1], [0, 1], [[1, 2]], throttle=1.0), "expected shape .2, 2., got .1, 2."),
        (lambda: TorqueMap("t", A, B, [0, 1], [0, 1], np.ones((2, 2))), "expected a throttle or a controller"),
        (
            lambda: TorqueMap("t", A, B, [0, 1], [0, 1], np.ones((2, 2)), throttle=constant(1.0),
                              efficiency_torques=[0, 1], efficiencies=[[1.2, 1], [1, 1]]),
            "efficiencies: expected numbers above 0 and up to 1, got 1 to 1.2",
        ),
    ],
)  # fmt: skip
def test_a_controller_that_cannot_be_is_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()
