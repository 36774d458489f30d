"""A brake with anti-skid: its law at chosen states, its tangent, a wheel on a bench against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, integrate
from floatframe.analyses import check_element
from floatframe.errors import ModelError
from floatframe.results import element_motion
from tests.floatframe.components.drives.anti_skid_brake_examples import J, R, bench, brake
from tests.floatframe.element_laws import evaluate, marker_motion, placed


def rates(omega, z, **changes):
    law = brake(**changes).law(placed(np.array([marker_motion([0, 0, 0])] * 2)))
    x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, 0], omega=[0, omega, 0])])
    return evaluate(law, 0.0, x, np.array(z))


@pytest.mark.parametrize(
    ("slip", "rate"), [(0.0, 3e7), (0.10, 3e7), (0.125, 1.5e7), (0.15, 0.0), (0.175, -0.6e8), (0.4, -1.2e8)]
)
def test_the_valve_builds_holds_and_lets_go_by_the_slip(slip, rate):
    v = 40.0
    omega = v * (1 - slip) / R
    wrench, z_dot, seen = rates(omega, [omega, v, 5e6, 4e6])
    assert_allclose(z_dot, [0.0, max(-slip * v / 0.02, -8.0), rate, 1e6 / 0.015], rtol=1e-9, atol=1e-6)
    assert_allclose([wrench[1, 4], wrench[0, 4], seen["power lost"]], [-1200, 1200, 1200 * omega], rtol=1e-12)


def test_a_wheel_that_is_braked_too_hard_is_let_go_by_its_deceleration():
    omega = 40.0 / R  # the sensor has not seen yet what the wheel does: 60 m/s² of its rim
    z_dot = rates(omega - 60 / R * 4e-3, [omega, 40.0, 5e6, 5e6])[1]
    assert_allclose(z_dot[2], -1.2e8, rtol=1e-9)
    slip_alone = {"deceleration": None, "deceleration_band": None}
    assert rates(omega - 60 / R * 4e-3, [omega, 40.0, 5e6, 5e6], **slip_alone)[1][2] == 3e7


def test_below_its_drop_out_and_without_anti_skid_a_locked_wheel_gets_the_pressure_of_the_pilot():
    assert rates(0.0, [0.0, 2.5, 5e6, 5e6])[1][2] == 3e7
    assert rates(0.0, [0.0, 40.0, 5e6, 5e6], anti_skid=False)[1][2] == 3e7
    assert rates(0.0, [0.0, 40.0, 1.1e7, 5e6], anti_skid=False)[1][2] < 0
    assert rates(0.0, [0.0, 40.0, 1e7, 5e6], anti_skid=False)[1][2] == 0.0


def test_a_wheel_on_a_bench_stops_by_the_torque_of_its_pressure_and_the_tangent_is_exact():
    system = bench(anti_skid=False, pressure=1e6)  # 300 N m
    assert check_element(system, "brake").findings == ()
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-10), 0.6, 2e-3)
    found = element_motion(system, motion, "brake").outputs["speed"]
    assert_allclose(found[200], 100.0 - 300 / J * 0.4, rtol=1e-4)
    assert abs(found[-1]) < 0.1  # it stands
    assert check_element(bench(), "brake").findings == ()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"slip": 1.2}, "slip: expected a threshold below 1"),
        ({"slip_band": 0.0}, "slip_band"),
        ({"deceleration_band": None}, "expected deceleration and deceleration_band, or neither"),
        ({"anti_skid": "yes"}, "anti_skid: expected True or False"),
        ({"radius": -0.3}, "radius"),
    ],
)
def test_numbers_out_of_their_range_are_refused(changes, message):
    with pytest.raises(ModelError, match=message):
        brake(**changes)
