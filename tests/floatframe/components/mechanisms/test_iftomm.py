"""The rigid problems of the benchmark library of the field against exact solutions, other equations, published ends."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from floatframe import GeneralizedAlpha, integrate
from floatframe.components.mechanisms import (
    andrews_mechanism,
    bricard_mechanism,
    flyball_governor,
    n_four_bar,
    point_pendulum,
)
from floatframe.components.mechanisms.iftomm import ANDREWS_START
from floatframe.errors import ModelError
from floatframe.results.energy_balance import balance_defect
from floatframe.results.place_motion import point_motion
from tests.references.field_oracles import ANDREWS_END, andrews_angles, bricard, four_bar_angle, governor

FORMULATIONS = ("absolute", "relative")


def moved(system, t_end, h, formulation, every=1):
    return integrate(system, GeneralizedAlpha(0.9), t_end, h, formulation=formulation, output_every=every)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_point_mass_on_a_rod_moves_as_elliptic_functions_say(formulation):
    motion = moved(point_pendulum(), 2.0, 2.5e-4, formulation, 40)
    k2 = 0.5  # sin² of half the amplitude of a right angle
    u = np.sqrt(9.81) * motion.t
    sn = ellipj(ellipk(k2) - u, k2)[0]
    theta = 2 * np.arcsin(np.sqrt(k2) * sn)  # from below
    exact = np.column_stack([-np.sin(theta), -np.cos(theta)])
    assert_allclose(motion.body("mass").r[:, :2], exact, rtol=0, atol=5e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_windows_of_four_bars_pass_their_singular_positions_and_stay_one_pendulum(formulation):
    n = 3
    motion = moved(n_four_bar(n), 3.0, 5e-4, formulation, 100)
    top = point_motion(motion, f"crank {n}", np.array([1.0, 0, 0])).position - [n, 0, 0]
    theta = four_bar_angle(n, motion.t)
    assert np.ptp(theta) > 2 * np.pi  # through both positions on one line
    assert_allclose(top[:, :2], np.column_stack([np.cos(theta), np.sin(theta)]), rtol=0, atol=2e-5)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_andrews_mechanism_ends_where_the_test_set_of_initial_value_problems_says(formulation):
    motion = moved(andrews_mechanism(), 0.03, 5e-6, formulation, 2000)
    found = andrews_angles(motion)[-1]
    # beta makes two and a half turns: angles are told within one
    off = np.abs(np.exp(1j * found) - np.exp(1j * ANDREWS_END))
    assert off[2:].max() < 1e-5
    assert off.max() < 1e-3
    assert np.abs(balance_defect(motion)).max() < 1e-4


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_bricards_mechanism_moves_as_mass_points_with_least_squares(formulation):
    motion = moved(bricard_mechanism(), 0.8, 1e-3, formulation, 200)
    exact = bricard(motion.t, rtol=1e-9)
    assert np.abs(exact[-1] - exact[0]).max() > 0.3
    assert_allclose(motion.body("rod 4").r, exact, rtol=0, atol=5e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_stiff_governor_rises_as_its_two_coordinates_say(formulation):
    motion = moved(flyball_governor(), 0.5, 5e-4, formulation, 100)
    assert_allclose(motion.body("slider").r[:, 2], governor(motion.t), rtol=0, atol=1e-5)
    assert_allclose(motion.angular_momentum[:, 2], motion.angular_momentum[0, 2], rtol=1e-6)


def test_impossible_starts_are_refused():
    with pytest.raises(ModelError, match="expected \\|x\\| up to the length 1, got x = 2"):
        point_pendulum(x=2.0)
    with pytest.raises(ModelError, match="n: expected at least 1, got 0"):
        n_four_bar(0)


def test_andrews_mechanism_is_closed_at_the_published_angles():
    """Both markers of every joint are at one place; the spring of 0.07785 m is nearly at its free length."""
    system = andrews_mechanism()
    bodies = {body.name: body for body in system.bodies}

    def place(marker):
        if marker.body not in bodies:
            return marker.position
        body = bodies[marker.body]
        w, *v = body.orientation
        return body.position + Rotation.from_quat([*v, w]).as_matrix() @ marker.position

    gaps = [np.linalg.norm(place(joint.marker_a) - place(joint.marker_b)) for joint in system.joints]
    assert len(gaps) == 10
    assert_allclose(gaps, 0.0, rtol=0, atol=1e-12)
    angle = {name: 2 * np.arctan2(body.orientation[3], body.orientation[0]) for name, body in bodies.items()}
    beta, theta, gamma, phi, delta, omega, epsilon = ANDREWS_START
    expected = {"OF": beta, "FE": beta + theta, "BDE": gamma, "GE": phi + delta, "AG": delta, "HE": omega + epsilon}
    for name, value in (expected | {"AH": epsilon}).items():
        assert_allclose(np.exp(1j * angle[name]), np.exp(1j * value), rtol=0, atol=1e-12, err_msg=name)
    spring = system.forces[0]
    C = place(spring.marker_a)
    assert_allclose(C, [0.014, 0.072, 0.0], rtol=0, atol=0)
    c, s = np.cos(gamma), np.sin(gamma)
    D = [-0.03635 + 0.02 * c + 0.018 * s, 0.03273 + 0.02 * s - 0.018 * c, 0.0]
    assert_allclose(place(spring.marker_b), D, rtol=0, atol=1e-15)
