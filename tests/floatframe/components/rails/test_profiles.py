"""Profiles: published dimensions and joints of the standard ones, smoothing, what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.components.rails.profile import Profile, profile_of_points
from floatframe.components.rails.standard_profiles import (
    S1002_BOUNDS,
    cone,
    head_of_circles,
    inclined,
    rail_60e1,
    s1002,
    wheel_s1002,
)
from floatframe.errors import ModelError


def test_the_eight_sections_of_s1002_meet_with_equal_slopes():
    for bound in S1002_BOUNDS[1:-1]:
        below, at, above = s1002(np.array([bound - 1e-7, bound, bound + 1e-7]))
        assert_allclose(
            [below, above], at, rtol=0, atol=1.5e-4
        )  # mm; the standard's polynomials are printed to ten digits
        left = np.diff(s1002(bound + np.array([-2e-5, -1e-5])))[0] / 1e-5
        right = np.diff(s1002(bound + np.array([1e-5, 2e-5])))[0] / 1e-5
        assert_allclose(left, right, rtol=0, atol=1e-4)


def test_s1002_has_the_flange_of_its_standard():
    """28 mm high, 32.5 mm thick 10 mm below the running circle, flank of 70 degrees, outer part of 1 : 15."""
    y = np.linspace(-70, 60, 130001)
    F = s1002(y)
    assert_allclose(F.max(), 28.0, rtol=0, atol=1e-9)
    assert s1002(np.array([0.0]))[0] == 0.0
    flank = np.interp(-10.0, -F[(y > -55) & (y < 0)], y[(y > -55) & (y < 0)])
    assert_allclose(70.0 + flank, 32.5, rtol=0, atol=5e-4)
    assert_allclose(np.degrees(np.arctan(-np.gradient(F, y).min())), 70.0, rtol=0, atol=1e-3)
    assert_allclose(np.diff(s1002(np.array([40.0, 55.0])))[0], -1.0, rtol=0, atol=1e-7)


def test_s1002_on_its_tread_is_where_another_program_has_it():
    """Places and heights of the wheel of the Manchester benchmark as CONTACT 23.1 prints them, less its approach."""
    s = np.array([1.8726, 4.7204, 6.2694, 7.5089, 8.5660])
    height, approach = (
        np.array([0.0729, 0.1451, 0.1754, 0.1960, 0.2114]),
        np.array([1.596, 1.859, 1.946, 2.007, 2.054]) * 1e-2,
    )
    assert_allclose(-s1002(s), height - approach, rtol=0, atol=7e-4)


def test_the_head_of_60e1_closes_at_its_published_width():
    """The widths of the first two circles are typed in; 72 mm between the sides follows from tangency alone."""
    rail = rail_60e1()
    slope = rail.slope(rail.y)
    side = rail.y[np.argmax(slope < -19.9)]
    assert_allclose(2 * side, 0.072, rtol=0, atol=1e-5)
    assert_allclose(rail.slope(np.array([0.0])), 0.0, atol=1e-12)
    assert_allclose(rail.curvature(np.array([0.005, 0.018, 0.032])), -1 / np.array([0.3, 0.08, 0.013]), rtol=2e-3)
    assert np.abs(np.diff(slope[np.abs(rail.y) < 0.034])).max() < 0.07  # tangent: no kink


def test_an_inclined_rail_is_that_of_the_manchester_benchmark():
    """UIC60 at 1 : 40 as tabulated there (sampled, mm; y inward negative, z downward)."""
    y, z = np.array([
        [-36.310303, 4.1373100], [-30.211027, 2.2283480], [-18.800542, 0.59313022], [-12.236779, 0.24991168],
        [-8.6518464, 0.12495522], [2.2616861, 0.0084805629], [10.231937, 0.41437678], [18.093602, 1.6039611],
        [22.405651, 3.1735515], [27.215326, 8.0403505],
    ]).T  # fmt: skip
    for rail, most in ((rail_60e1(), 0.026), (head_of_circles(21.03, 52.053, "as there"), 0.018)):
        head = inclined(rail, 1 / 40)
        shifts = np.linspace(7.3, 7.7, 81)
        defects = [head.height((y + shift) * 1e-3) * 1e3 + z for shift in shifts]
        defects = [defect - defect.mean() for defect in defects]
        assert min(np.abs(defect).max() for defect in defects) < most


def test_an_inclined_rail_has_its_top_at_zero_and_is_higher_outside():
    head = inclined(rail_60e1(), 1 / 20)
    around = np.linspace(-0.03, 0.03, 600001)
    assert_allclose(head.height(around).max(), 0.0, atol=1e-10)
    assert_allclose(head.slope(np.array([0.0])), 1 / 20, rtol=1e-2)
    assert np.all(np.diff(head.y) > 0)


def test_the_cone_has_its_conicity_and_a_flange_without_kinks():
    wheel = cone(1 / 20)
    tread = wheel.y > -0.02
    assert_allclose(wheel.slope(wheel.y[tread][1:-1]), -0.05, rtol=0, atol=1e-6)
    assert_allclose(wheel.z.max(), 0.028, rtol=0, atol=1e-6)
    flange = (wheel.y > -0.05) & (wheel.y < 0)
    assert np.abs(np.diff(wheel.slope(wheel.y[flange]))).max() < 0.2  # 0.1 mm along a fillet of 13 mm
    assert_allclose(wheel.slope(np.array([-0.0385])), -2.747477, rtol=1e-3)


def test_noise_of_a_measurement_is_smoothed_to_its_size():
    rng = np.random.default_rng(1)
    y = np.linspace(-0.035, 0.05, 400)
    z = s1002(y * 1e3) * 1e-3 + rng.normal(0, 1e-5, 400)
    rough = Profile("wheel", y, z)
    for noise in (1e-5, None):
        wheel = profile_of_points("wheel", y, z, noise=noise)
        assert np.sqrt(np.mean((wheel.height(y) - s1002(y * 1e3) * 1e-3) ** 2)) < 6e-6
        inner = (wheel.y > -0.02) & (wheel.y < 0.04)
        true = np.gradient(s1002(wheel.y[inner] * 1e3) * 1e-3, wheel.y[inner])
        assert (
            np.abs(wheel.slope(wheel.y[inner]) - true).max() < 0.02 < np.abs(rough.slope(wheel.y[inner]) - true).max()
        )


def test_points_from_outside_inward_are_the_same_profile():
    y, z = wheel_s1002().y, wheel_s1002().z
    assert_allclose(Profile("wheel", y[::-1], z[::-1]).height(y), z, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda y, z: (y * 1e3, z * 1e3), "look like millimetres"),
        (lambda y, z: (np.r_[y[:500], y[400:]], np.r_[z[:500], z[400:]]), "not cross itself or turn back"),
        (lambda y, z: (y[:4], z[:4]), "at least 5"),
        (lambda y, z: (y, z[:-1]), "two equal lists"),
        (lambda y, z: (y, np.where(y > 0, np.nan, z)), "finite"),
        (lambda y, z: (y * 0.1, z), "between 0.04 m"),
        (lambda y, z: (y, 3.5 * z), "is the unit metre"),
    ],
)
def test_points_that_are_no_profile_are_refused(change, message):
    wheel = wheel_s1002()
    with pytest.raises(ModelError, match=message):
        Profile("wheel", *change(wheel.y, wheel.z))


def test_words_and_bounds_are_checked():
    with pytest.raises(ModelError, match="wheel or rail"):
        Profile("tyre", wheel_s1002().y, wheel_s1002().z)
    with pytest.raises(ModelError, match="conicity"):
        cone(3.0)
    with pytest.raises(ModelError, match="-70 mm to 60 mm"):
        s1002(np.array([61.0]))
    with pytest.raises(ModelError, match="1/40"):
        inclined(rail_60e1(), 40)
    with pytest.raises(ModelError, match="noise"):
        profile_of_points("wheel", wheel_s1002().y, wheel_s1002().z, noise=-1.0)
