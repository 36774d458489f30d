"""Roads: interpolation, envelopes against circles, obstacles, random roads against their classes."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe.components import wheels
from floatframe.components.wheels.roads.profiles import ROUGHNESS, density, track_correlation
from floatframe.components.wheels.roads.surface import road_grip, road_height
from floatframe.errors import ModelError

R = 0.3


def heights(road, x, y=0.0):
    return np.array([road.height(each, y) for each in np.atleast_1d(x)])


def test_a_profile_goes_through_its_knots_and_never_beyond_them():
    rng = np.random.default_rng(1)
    x, z = np.cumsum(rng.uniform(0.1, 0.5, 30)), 0.02 * rng.standard_normal(30)
    road = wheels.profile_road(x, z)
    assert_allclose(heights(road, x), z, atol=1e-15)
    between = heights(road, np.linspace(x[3], x[4], 50))
    assert between.min() >= min(z[3:5]) - 1e-15
    assert between.max() <= max(z[3:5]) + 1e-15
    assert_allclose(heights(road, [x[0] - 5, x[-1] + 7]), [z[0], z[-1]])


@pytest.mark.parametrize("is_linear", [True, False])
@pytest.mark.parametrize("n_y", [1, 2, 4])
def test_slopes_of_a_road_are_the_derivatives_of_its_height(is_linear, n_y):
    """By a step along the imaginary axis, which is exact, at places inside and beyond its edges."""
    rng = np.random.default_rng(2)
    x, y = np.cumsum(rng.uniform(0.5, 1.0, 8)), np.cumsum(rng.uniform(0.3, 0.6, n_y))
    numbers = wheels.GridRoad(x, 0.1 * rng.standard_normal((8, n_y)), y=y, is_linear=is_linear).numbers()
    for px, py in zip(rng.uniform(0, x[-1] + 1, 20), rng.uniform(0, y[-1] + 0.5, 20), strict=True):
        _, z_x, z_y, _ = road_height(numbers, 0, px, py)
        assert_allclose(road_height(numbers, 0, px + 1e-30j, py + 0j)[0].imag / 1e-30, z_x, atol=1e-14)
        assert_allclose(road_height(numbers, 0, px + 0j, py + 1e-30j)[0].imag / 1e-30, z_y, atol=1e-14)


def test_a_grid_holds_a_plane_exactly():
    x, y = np.array([0.0, 0.7, 1.0, 2.5]), np.array([-1.0, 0.5, 2.0])
    road = wheels.GridRoad(x, 0.2 * x[:, None] - 0.1 * y[None, :] + 0.3, y=y)
    for px, py in ((0.1, 0.0), (0.9, 1.9), (2.4, -0.9)):
        assert_allclose(road.height(px, py), 0.2 * px - 0.1 * py + 0.3, rtol=1e-14)


def test_the_envelope_of_a_step_is_the_circle_about_its_edge():
    """The disc rests on the edge while its centre is within sqrt(2 R h - h²) before it."""
    h, at = 0.08, 3.0
    road = wheels.step(at, h, length=6.0).enveloped(R, step=0.01)
    reach = np.sqrt(2 * R * h - h**2)
    ahead = at - road.x
    expected = np.where(ahead <= 0, h, np.where(ahead < reach, h + np.sqrt(np.maximum(R**2 - ahead**2, 0)) - R, 0.0))
    assert_allclose(road.z[:, 0], expected, atol=1e-14)
    assert road.z[:, 0].max() == pytest.approx(h)
    assert 10 < np.sum((ahead > 0) & (ahead < reach))


def test_the_envelope_of_a_fall_is_the_same_circle_behind_the_edge():
    h, at = 0.05, 3.0
    road = wheels.step(at, -h, length=6.0).enveloped(R, step=0.01)
    behind = road.x - at
    expected = np.where(behind <= 0, 0.0, np.maximum(-h, np.sqrt(np.maximum(R**2 - behind**2, 0)) - R))
    assert_allclose(road.z[:, 0], expected, atol=1e-14)


def test_the_envelope_of_a_ramp_is_the_line_shifted_by_the_disc():
    """On a slope m the lowest point of the disc is R (sqrt(1 + m²) - 1) above the line below its centre."""
    m = 0.4
    road = wheels.ramp(2.0, 4 * m, 4.0, length=8.0).enveloped(R, step=0.01)
    on = (road.x > 2.5) & (road.x < 5.5)
    assert_allclose(road.z[on, 0], m * (road.x[on] - 2.0) + R * (np.sqrt(1 + m**2) - 1), atol=1e-13)


def test_the_envelope_is_the_maximum_over_a_fine_ground():
    """Second road: brute force over points of the ground a tenth of a millimetre apart."""
    rng = np.random.default_rng(3)
    x, z = np.arange(0, 3, 0.05), 0.02 * rng.standard_normal(60)
    road = wheels.GridRoad(x, z, is_linear=True).enveloped(R, step=0.1)
    s = np.arange(-0.5, 3.5, 1e-4)
    ground = np.interp(s, x, z)
    for place, found in zip(road.x, road.z[:, 0], strict=True):
        near = np.abs(s - place) <= R
        brute = np.max(ground[near] + np.sqrt(R**2 - (s[near] - place) ** 2) - R)
        assert 0 <= found - brute < 1e-6 * R + 1e-7


def test_a_wide_disc_feels_what_lies_beside_its_middle():
    x, y = np.linspace(0, 4, 41), np.array([-0.5, 0.0, 0.5])
    z = np.zeros((41, 3))
    z[:, 2] = 0.04
    narrow, wide = (wheels.GridRoad(x, z, y=y, is_linear=True).enveloped(R, width=w) for w in (0.0, 0.2))
    assert_allclose(narrow.height(2.0, 0.25), 0.02, atol=1e-12)
    assert_allclose(wide.height(2.0, 0.4), 0.04, atol=1e-12)
    assert_allclose(wide.height(2.0, -0.1), 0.0, atol=1e-12)
    assert_allclose(wide.height(2.0, 0.25), 0.028, atol=1e-12)  # its left edge stands at 0.35


def test_an_obstacle_between_two_y_leaves_the_other_wheel_alone():
    road = wheels.bump(2.0, 0.05, 0.4, length=5.0).enveloped(R, between=(0.3, 1.0))
    assert_allclose(road.height(2.2, 0.7), 0.05, atol=1e-12)
    assert_allclose(road.height(2.2, -0.7), 0.0, atol=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_an_obstacle_between_two_y_ends_within_a_hundredth_of_its_width(size):
    low, high = 0.3 * size, 0.7 * size
    road = wheels.bump(2.0 * size, 0.05 * size, 0.4 * size, length=5.0 * size).enveloped(R * size, between=(low, high))
    edge = 0.01 * (high - low)
    for y, height in ((low, 0.05), (high, 0.05), (low - edge, 0.0), (high + edge, 0.0)):
        assert_allclose(road.height(2.2 * size, y), height * size, rtol=0, atol=1e-12 * size)


def test_a_cosine_bump_is_one():
    road = wheels.cosine_bump(1.0, 0.1, 2.0, length=5.0).road()
    x = np.linspace(1.0, 3.0, 65)
    assert_allclose(heights(road, x), 0.05 * (1 - np.cos(np.pi * (x - 1.0))), atol=1e-12)


@pytest.mark.parametrize("name", ["A", "C", "F"])
def test_the_density_of_a_random_road_is_that_of_its_class(name):
    """Welch's estimate: averaged over bands of equal ratio, within 10 % of the class line (some 40 segments)."""
    from scipy.signal import welch

    road = wheels.iso_8608_road(name, 4000.0, seed=5)
    n, found = welch(road.z[:, 0], 1 / 0.05, nperseg=4096, noverlap=2048, detrend="constant")
    for low, high in ((0.03, 0.06), (0.06, 0.15), (0.15, 0.4), (0.4, 1.0), (1.0, 2.5)):
        band = (n >= low) & (n < high)
        ratio = np.mean(found[band] / density(name, n[band]))
        assert 0.9 < ratio < 1.1
    lines = found[(n > 0.05) & (n < 2.5)] / density(name, n[(n > 0.05) & (n < 2.5)])
    assert np.quantile(lines, 0.01) > 0.4
    assert np.quantile(lines, 0.99) < 1.9


def test_the_variance_of_a_random_road_is_the_integral_of_its_density():
    """Over a whole period: int G dn = G_0 n_0² (1/n_low - 1/n_high), its lines summed in place of the integral."""
    low, high = 0.05, 2.0
    road = wheels.iso_8608_road("B", 0.05 * (2**15 - 1), seed=1, band=(low, high))
    assert_allclose(np.var(road.z), ROUGHNESS["B"] * 0.01 * (1 / low - 1 / high), rtol=0.02)


def test_the_same_seed_gives_the_same_road_and_another_one_another():
    roads = [wheels.iso_8608_road("C", 50.0, seed=seed) for seed in (4, 4, 9)]
    assert_array_equal(roads[0].z, roads[1].z)
    assert np.abs(roads[0].z - roads[2].z).max() > 1e-3
    assert roads[0].x[-1] == pytest.approx(50.0)


def test_two_tracks_are_one_for_long_waves_and_two_for_short_ones():
    """Coherence of both, by Welch, is g² of the surface alike in all directions."""
    from scipy.signal import coherence

    b = 1.5
    road = wheels.iso_8608_road("C", 6000.0, seed=11, tracks=(-b / 2, b / 2))
    n, found = coherence(road.z[:, 0], road.z[:, 1], 1 / 0.05, nperseg=4096, noverlap=2048)
    for low, high in ((0.02, 0.05), (0.08, 0.12), (0.15, 0.25), (0.5, 1.0)):
        band = (n >= low) & (n < high)
        assert abs(np.mean(found[band]) - np.mean(track_correlation(n[band], b) ** 2)) < 0.06
    assert np.mean(found[(n > 0.5) & (n < 1.0)]) < 0.05 < 0.85 < np.mean(found[(n > 0.012) & (n < 0.05)])


def test_the_correlation_of_tracks_is_basset_s_integral():
    """g = int S(sqrt(n² + m²)) cos(2 pi m b) dm / int S dm with S falling as |n|^-(w + 1): by quadrature."""
    from scipy.integrate import quad

    for n, b, w in ((0.1, 1.5, 2.0), (0.3, 0.8, 2.0), (0.2, 1.2, 2.4)):

        def kernel(m, n=n, w=w):
            return (n**2 + m**2) ** (-(w + 1) / 2)

        whole = quad(kernel, 0, np.inf)[0]
        part = quad(kernel, 0, np.inf, weight="cos", wvar=2 * np.pi * b)[0]
        assert_allclose(track_correlation(n, b, waviness=w), part / whole, rtol=1e-6)


def test_a_given_coherence_is_that_of_the_tracks():
    from scipy.signal import coherence

    road = wheels.iso_8608_road("C", 6000.0, seed=2, tracks=(0.0, 1.0), coherence=0.5)
    n, found = coherence(road.z[:, 0], road.z[:, 1], 1 / 0.05, nperseg=4096, noverlap=2048)
    assert abs(np.mean(found[(n > 0.05) & (n < 2)]) - 0.5) < 0.03


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: wheels.profile_road([0, 1, 1], [0, 0, 0]), "increasing numbers, got 1, then 1"),
        (lambda: wheels.profile_road([0, 1, 2], [0, np.nan, 0]), "finite"),
        (lambda: wheels.profile_road([0, 1, 2], [0, 0]), r"expected shape \(3, 1\)"),
        (lambda: wheels.profile_road([0.0], [0.0]), "2 knots or more"),
        (lambda: wheels.GridRoad([0, 1], [[0, 0], [0, 0]], y=[1, 0]), "road: y: expected increasing"),
        (lambda: wheels.step(1.0, 0.1, length=3.0).road(), "increasing numbers"),
        (lambda: wheels.step(4.0, 0.1, length=3.0), "a position on the road"),
        (lambda: wheels.Polyline([0, 2, 1], [0, 0, 0]), "corners in the order of x"),
        (lambda: wheels.step(1.0, 0.1, length=3.0).enveloped(-1.0), "radius: expected a number above 0"),
        (lambda: wheels.iso_8608_road("K", 10.0, seed=1), "expected one of A, B"),
        (lambda: wheels.iso_8608_road("A", 10.0, seed=1, spacing=0.5), "does not resolve waves"),
        (lambda: wheels.iso_8608_road("A", 10.0, seed=1, band=(1.0, 0.5)), "lowest < highest"),
        (lambda: wheels.iso_8608_road("A", 10.0, seed=1, tracks=(1.0, 0.0)), "tracks: expected increasing"),
    ],
)
def test_roads_that_are_none_are_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_grip_is_straight_between_its_knots_and_stays_with_a_road_that_is_enveloped():
    grip = wheels.Grip([10.0, 12.0, 30.0], [1.0, 0.4, 0.4])
    bump = wheels.cosine_bump(5.0, 0.05, 2.0, length=40.0).road()
    for road in (wheels.FlatRoad(grip), replace(bump, grip=grip), replace(bump, grip=grip).enveloped(R)):
        numbers = np.concatenate([[7.0], road.numbers()])
        found = [road_grip(numbers, 1, x) for x in (-5.0, 10.0, 11.0, 12.0, 20.0, 99.0)]
        assert_allclose(found, [1.0, 1.0, 0.7, 0.4, 0.4, 0.4], rtol=1e-14)
        assert_allclose(road_grip(numbers, 1, 11.0 + 1e-30j).imag / 1e-30, -0.3, rtol=1e-12)
        assert_allclose(road.height(6.0), 0.0 if isinstance(road, wheels.FlatRoad) else 0.05, atol=1e-5)
    assert road_grip(wheels.FlatRoad().numbers(), 0, 3.0) == 1.0


@pytest.mark.parametrize(
    ("x", "factor", "message"),
    [
        ([0.0, 0.0], [1.0, 0.5], "grip: x: expected increasing"),
        ([0.0, 1.0], [1.0, 0.0], "grip: factor: expected numbers above 0, got 0 at x = 1"),
        ([0.0, 1.0], [1.0], "grip: factor"),
    ],
)
def test_a_grip_that_is_none_is_refused(x, factor, message):
    with pytest.raises(ModelError, match=message):
        wheels.Grip(x, factor)
