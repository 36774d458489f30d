"""Functions of time: values, derivatives, smooth joints of pieces, and the kernel beside the description."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, Marker, PrismaticJoint, RigidBody, System
from floatframe.analyses import consistent_state
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import (
    TimeFunction,
    constant,
    cycloidal_spin_up,
    harmonic,
    piecewise,
    polynomial_of_time,
    sampled,
    smooth_step,
    table,
)

FUNCTIONS = {
    "constant": constant(0.4),
    "polynomial": polynomial_of_time([0.1, 0.2, -0.3, 0.4, 0.5, -0.6]),
    "harmonic": harmonic(0.5, 3.0, 0.2, 0.1),
    "smooth step": smooth_step(0.2, 0.9, 0.1, 0.6),
    "cycloid": cycloidal_spin_up(3.0, 0.7),
    "table": table(np.linspace(0, 1, 9), np.sin(np.linspace(0, 1, 9) * 4)),
}


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
@pytest.mark.parametrize("t", [-0.3, 0.13, 0.52, 0.8, 1.7])
def test_derivatives_are_those_of_the_value(function, t):
    s = 1e-5
    rate = (function(t + s) - function(t - s)) / (2 * s)
    second = (function(t + s, 1) - function(t - s, 1)) / (2 * s)
    assert_allclose(function(t, 1), rate, rtol=0, atol=1e-7)
    assert_allclose(function(t, 2), second, rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", ["smooth step", "cycloid"])
def test_pieces_meet_with_rate_and_second_rate(name):
    function = FUNCTIONS[name]
    for t in function.begins[1:]:
        for order in range(3):
            assert_allclose(function(t - 1e-9, order), function(t + 1e-9, order), rtol=0, atol=1e-6)


def test_cycloid_turns_by_half_of_full_speed_while_it_spins_up():
    """Angle omega T/2 at T; rate omega (t/T - sin(2 pi t/T)/(2 pi)); beyond: constant speed."""
    omega, T = 3.0, 0.7
    spin = cycloidal_spin_up(omega, T)
    assert_allclose(spin(T), omega * T / 2, rtol=1e-12, atol=0)
    t = 0.2
    assert_allclose(spin(t, 1), omega * (t / T - np.sin(2 * np.pi * t / T) / (2 * np.pi)), rtol=1e-12, atol=0)
    assert_allclose(spin(5.0) - spin(4.0), omega, rtol=1e-12, atol=0)


def test_a_sampled_function_is_met_within_its_tolerance():
    spline = sampled(lambda t: np.exp(-t) * np.sin(9 * t), 0.0, 2.0, 1e-8)
    t = np.random.default_rng(1).uniform(0, 2, 200)
    assert_allclose([spline(x) for x in t], np.exp(-t) * np.sin(9 * t), rtol=0, atol=2e-8)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_kernels_know_the_same_function(name):
    """A block on a rail is placed at f, moves with f' and is accelerated by f''."""
    body = RigidBody("block", 1.0, np.eye(3))
    rail = PrismaticJoint("rail", GROUND, Marker("block"), axis=(1, 0, 0), motions={"distance": FUNCTIONS[name]})
    system = System([body], [rail])
    for t in (-0.3, 0.13, 0.52, 0.8, 1.7):
        start = consistent_state(system, t=t)
        found = start.state.r[0, 0], start.state.u[0], start.u_dot[0]
        assert_allclose(found, [FUNCTIONS[name](t, k) for k in range(3)], rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: polynomial_of_time([]), "one to six coefficients"),
        (lambda: smooth_step(1.0, 1.0, 0.0, 1.0), "t_end above t_start"),
        (lambda: table([0, 1, 1, 2], [0, 0, 0, 0]), "rising times"),
        (lambda: table([0, 1], [0, 0]), "four or more times"),
        (lambda: sampled(lambda t: float(t > 0.3), 0.0, 1.0, 1e-3), "it jumps"),
        (lambda: TimeFunction([0.0], [[1.0]]), r"expected n times"),
        (lambda: cycloidal_spin_up(1.0, 0.0), "duration: expected a number above 0"),
    ],
)
def test_impossible_functions_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


PARTS = [FUNCTIONS[name] for name in ("harmonic", "smooth step", "polynomial", "cycloid", "table")]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_piecewise_function_is_each_of_its_parts_in_the_time_since_it_began(order):
    begins = [0.5, 1.2, 1.6, 2.3, 4.0]
    whole = piecewise(begins, PARTS)
    for t in np.random.default_rng(2).uniform(-1, 6, 200):
        k = max(int(np.searchsorted(begins, t, side="right")) - 1, 0)
        assert_allclose(whole(t, order), PARTS[k](t - begins[k], order), rtol=0, atol=1e-11)


def test_jumps_are_found_where_they_are():
    ramp = piecewise([0.0, 1.0, 3.0], [polynomial_of_time([0.0, 2.0]), constant(2.0), constant(5.0)])
    assert [list(x) for x in ramp.jumps(0)] == [[3.0], [3.0]]
    assert [list(x) for x in ramp.jumps(1)] == [[1.0], [-2.0]]
    for function in FUNCTIONS.values():
        assert not len(function.jumps(0)[0])
        assert not len(function.jumps(1)[0])


@pytest.mark.parametrize(("t", "n"), [([0.0, 1.0], 1), ([], 0), ([1.0, 1.0], 2), ([0.0, np.inf], 2)])
def test_pieces_without_their_times_are_refused(t, n):
    with pytest.raises(ModelError, match="piecewise: "):
        piecewise(t, [constant(1.0)] * n)


def test_a_motion_that_jumps_is_refused():
    jump = piecewise([0.0, 1.0], [constant(0.0), constant(0.1)])
    kink = piecewise([0.0, 1.0], [constant(0.0), polynomial_of_time([0.0, 2.0])])
    for motion, words in ((jump, "the value jumps by 0.1 at t = 1"), (kink, "the rate jumps by 2 at t = 1")):
        with pytest.raises(ModelError, match=f"joint 'guide': motions: distance: {words}"):
            PrismaticJoint("guide", GROUND, Marker("block"), axis=(1, 0, 0), motions={"distance": motion})
