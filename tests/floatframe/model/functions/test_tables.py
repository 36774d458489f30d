"""Tables as functions of time: exact double integration, smoothness, no overshoot; against closed forms and SciPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import PchipInterpolator, make_interp_spline

from floatframe import GROUND, GeneralizedAlpha, Marker, PrismaticJoint, RigidBody, System, integrate
from floatframe.errors import ModelError
from floatframe.integrators import EnergyDecaying
from floatframe.model.functions.tables import (
    INTERPOLATIONS,
    acceleration_table,
    interpolated,
    linear_table,
    monotone_table,
    quintic_table,
)
from floatframe.model.functions.time_functions import table
from floatframe.sensors import PlaceSensor, measured

ROUNDOFF = 1e-12
T, PEAK = 0.011, 500.0  # half-sine shock of 11 ms


def half_sine(n):
    t = np.linspace(0.0, T, n)
    a = PEAK * np.sin(np.pi * t / T)
    a[-1] = 0.0
    return t, a


def test_an_acceleration_table_is_integrated_exactly_twice():
    """Of straight lines the integrals are known: each piece by Simpson's rule, which is exact for cubics."""
    rng = np.random.default_rng(2)
    t, a = np.cumsum(rng.uniform(0.1, 1.0, 12)), rng.normal(size=12)
    motion = acceleration_table(t, a, 0.3, -0.7)
    assert_allclose(motion.at(t[:-1], 2), a[:-1], rtol=ROUNDOFF, atol=0)
    middle = (t[1:] + t[:-1]) / 2
    assert_allclose(motion.at(middle, 2), (a[1:] + a[:-1]) / 2, rtol=ROUNDOFF, atol=ROUNDOFF)
    gained = np.diff(t) * (a[1:] + a[:-1]) / 2
    assert_allclose(np.diff(motion.at(t, 1)), gained, rtol=1e-11, atol=ROUNDOFF)
    v = motion.at(t, 1), motion.at(middle, 1)
    assert_allclose(np.diff(motion.at(t)), np.diff(t) / 6 * (v[0][1:] + 4 * v[1] + v[0][:-1]), rtol=1e-11, atol=1e-11)
    assert_allclose([motion(t[0]), motion(t[0], 1)], [0.3, -0.7], rtol=ROUNDOFF, atol=0)


@pytest.mark.parametrize(
    ("shape", "velocity", "position"),
    [
        (lambda s: np.sin(np.pi * s), 2 / np.pi, 1 / np.pi),  # half-sine: V = 2 A T/pi, U = A T²/pi
        (lambda s: (1 - np.cos(2 * np.pi * s)) / 2, 1 / 2, 1 / 4),  # haversine
    ],
    ids=["half-sine", "haversine"],
)
def test_shocks_gain_the_velocity_and_position_of_their_closed_forms_with_order_two(shape, velocity, position):
    errors = []
    for n in (101, 201):
        s = np.linspace(0, 1, n)
        motion = acceleration_table(T * s, PEAK * shape(s))
        found = motion(T, 1) / (PEAK * T * velocity), motion(T) / (PEAK * T**2 * position)
        errors.append(np.abs(np.array(found) - 1).max())
    assert errors[1] < 5e-5
    # the haversine is periodic and smooth there: its trapezoidal sum is exact; the half-sine has order 2
    assert errors[1] < 0.26 * errors[0] + 1e-14


def test_a_shock_through_an_acceleration_table_does_not_ring_where_a_cubic_does():
    """Met to 1e-6 of the peak at its knots and zero before it; a cubic through the same samples swings by 2 % there."""
    t, a = half_sine(11)
    motion = acceleration_table(t, a)
    assert_allclose(motion.at(t[:-1], 2), a[:-1], rtol=0, atol=1e-6 * PEAK)
    before = np.linspace(-T, 0, 200)[:-1]
    assert_allclose(motion.at(before, 2), 0, rtol=0, atol=1e-6 * PEAK)
    cubic = table(np.concatenate([np.linspace(-T, 0, 11)[:-1], t]), np.concatenate([np.zeros(10), a]))
    assert 0.01 * PEAK < np.abs(cubic.at(before)).max() < 0.03 * PEAK


@pytest.mark.parametrize(
    ("scheme", "per_interval", "least", "most"),
    [
        (EnergyDecaying(), 1, 0.0, 1e-6),
        (EnergyDecaying(), 2, 0.0, 1e-6),
        (GeneralizedAlpha(rho_inf=0.8), 1, 0.0, 3e-4),
        (GeneralizedAlpha(rho_inf=0.8), 2, 0.0, 2e-3),
        (GeneralizedAlpha(rho_inf=0.5), 2, 0.0, 2e-3),
        (GeneralizedAlpha(rho_inf=0.8, stabilized=False), 1, 1e-3, 5e-3),
        (GeneralizedAlpha(rho_inf=0.8, stabilized=False), 2, 0.05, 0.1),
        (GeneralizedAlpha(rho_inf=0.5, stabilized=False), 2, 5e-3, 0.02),
    ],
)
def test_schemes_report_the_acceleration_of_a_driven_body_at_the_knots(scheme, per_interval, least, most):
    """Parts of the peak; plain generalized-alpha has accelerations of its own: kinks at every second step add up.

    Where velocities of joints are held too, as by default, they are nearer by ten to eighty times.
    """
    t, a = half_sine(23)
    body = RigidBody("box", 2.0, np.eye(3))
    rail = PrismaticJoint("rail", GROUND, Marker("box"), axis=(1, 0, 0), motions={"distance": acceleration_table(t, a)})
    system = System([body], [rail], sensors=[PlaceSensor("box", Marker("box"), "acceleration")])
    motion = integrate(system, scheme, T, T / (22 * per_interval))
    found = measured(system, motion)["box"].columns["x"]
    error = np.abs(found[:-per_interval:per_interval] - a[:-1]).max() / PEAK
    assert least <= error <= most


def test_a_quintic_table_is_smooth_in_acceleration_and_meets_scipy():
    t = np.sort(np.random.default_rng(3).uniform(0, 2, 40))
    x = np.sin(7 * t)
    f = quintic_table(t, x)
    inside = np.linspace(t[0], t[-1], 333)[:-1]
    spline = make_interp_spline(t, x, k=5)
    for order in range(3):
        assert_allclose(f.at(inside, order), spline.derivative(order)(inside), rtol=0, atol=1e-9 * 7**order)
        assert len(f.jumps(order)[0]) == (
            0 if order < 2 else 2
        )  # of the acceleration at the ends, where tangents begin


def test_a_monotone_table_does_not_overshoot_and_meets_scipy():
    t, x = np.array([0.0, 1.0, 2.0, 3.5, 4.0]), np.array([0.0, 0.0, 1.0, 1.0, 3.0])
    f = monotone_table(t, x)
    inside = np.linspace(0, 4, 200)[:-1]
    assert_allclose(f.at(inside), PchipInterpolator(t, x)(inside), rtol=0, atol=1e-13)
    assert (np.diff(f.at(inside)) >= -1e-14).all()
    assert len(f.jumps(1)[0]) == 0


def test_a_linear_table_holds_its_ends():
    f = linear_table([1.0, 2.0, 4.0], [3.0, 5.0, 1.0])
    assert_allclose(f.at(np.array([-9.0, 0.0, 1.5, 3.0, 9.0])), [3, 3, 4, 3, 1], rtol=ROUNDOFF, atol=0)


@pytest.mark.parametrize("name", ["cubic", "monotone", "quintic"])
def test_tables_go_on_along_their_tangents(name):
    t = np.linspace(0.5, 2, 9)
    f = interpolated(t, np.cos(t), name)
    for end, beyond in ((t[0], t[0] - 3.0), (t[-1], t[-1] + 3.0)):
        rate = (f(end + 1e-7) - f(end - 1e-7)) / 2e-7
        assert_allclose(f(beyond), f(end) + rate * (beyond - end), rtol=1e-6, atol=0)


def test_jumps_of_a_long_table_are_found_at_once():
    """A million pieces: the time is that of a few passes over arrays, not of a loop."""
    t = np.arange(300_000) * 1e-3
    x = np.where(t < 150.0005, 0.0, 1.0)
    assert len(linear_table(t, x).jumps(0)[0]) == 0
    assert_allclose(linear_table(t, x).jumps(1)[0], [150.0, 150.001], rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: acceleration_table([0.0, 1.0, 1.0], [0.0, 1.0, 2.0]), "rising times, got 1 and then 1 at place 2"),
        (lambda: acceleration_table([0.0, 1.0], [0.0, np.nan]), "finite numbers, got t = 1, value nan at place 1"),
        (lambda: quintic_table([0.0, 1.0], [0.0, 1.0]), "6 or more times"),
        (lambda: acceleration_table([0.0, 1.0], [0.0, 1.0], position=np.inf), "position"),
        (lambda: interpolated([0.0, 1.0], [0.0, 1.0], "linaer"), "did you mean 'linear'"),
    ],
)
def test_impossible_tables_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


def test_every_interpolation_meets_its_table():
    t = np.linspace(0, 1, 8)
    for name in INTERPOLATIONS:
        assert_allclose(interpolated(t, t**2, name).at(t), t**2, rtol=0, atol=1e-14)
