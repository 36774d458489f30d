"""A car with linear tyres in space against the closed-form single-track model."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from tests.floatframe.components.wheels.car import Car

METHOD = ff.GeneralizedAlpha(0.9, 1e-10)
STEP = 4e-3


def lateral_states(car, V, duration, *, v=0.01, r=0.01):
    """Return t and (v, r, F_f, F_r) of a free motion, axes of the car."""
    system = car.system(V, v=v, r=r)
    motion = ff.integrate(system, METHOD, duration, STEP)
    chassis = motion.body("chassis")
    yaw = 2 * np.arctan2(chassis.p[:, 3], chassis.p[:, 0])
    side = np.cos(yaw) * chassis.v[:, 1] - np.sin(yaw) * chassis.v[:, 0]
    forces = [
        sum(ff.results.element_motion(system, motion, f"tyre_{axle}{end}").outputs["Fy"] for end in "lr")
        for axle in "fr"
    ]
    return motion.t, np.stack([side, chassis.omega_B[:, 2], *forces])


def eigenvalues_of_motion(states, h):
    """Return the eigenvalues of the linear system that maps each sample into the next, by least squares."""
    scale = np.abs(states).max(axis=1, keepdims=True)
    before, after = states[:, :-1] / scale, states[:, 1:] / scale
    return np.log(np.linalg.eigvals(np.linalg.lstsq(before.T, after.T, rcond=None)[0].T).astype(complex)) / h


def assert_same_eigenvalues(found, expected, rtol):
    found, expected = (np.sort_complex(each[each.imag >= -1e-9]) for each in (found, expected.astype(complex)))
    assert_allclose(found, expected, rtol=rtol)


def test_the_yaw_rate_gain_is_that_of_the_single_track_model():
    """Understeer: steered by 0.002 rad at 20 m/s, after 2 s."""
    car, V, steer = Car(), 20.0, 2e-3
    motion = ff.integrate(car.system(V, steer=steer), METHOD, 2.0, STEP)
    assert_allclose(motion.body("chassis").omega_B[-1, 2] / steer, car.yaw_rate_gain(V), rtol=2e-3)


@pytest.mark.parametrize("V", [10.0, 20.0])
@pytest.mark.parametrize("sigma", [0.0, 0.5])
def test_eigenvalues_are_those_of_the_single_track_model(sigma, V):
    """With relaxation lengths 0 (two states) and not (four), within 1 %."""
    car = Car(sigma=sigma)
    _, states = lateral_states(car, V, 0.6)
    n = 2 if sigma == 0 else 4
    assert_same_eigenvalues(eigenvalues_of_motion(states[:n, 5:], STEP), np.linalg.eigvals(car.matrix(V)), 0.01)


def test_the_critical_speed_is_where_the_slow_mode_of_an_oversteering_car_stops_to_decay():
    """Slow eigenvalue just below and above the closed form; its zero, interpolated, within 1 %."""
    car = Car(C_f=9e4, C_r=6e4)
    critical = car.critical_speed()
    slow = []
    for factor in (0.97, 1.03):
        V = factor * critical
        _, states = lateral_states(car, V, 1.2)
        slow.append(eigenvalues_of_motion(states[:2, 5:], STEP).real.max())
    assert slow[0] < 0 < slow[1]
    assert_allclose(critical * (0.97 - 0.06 * slow[0] / (slow[1] - slow[0])), critical, rtol=0.01)
