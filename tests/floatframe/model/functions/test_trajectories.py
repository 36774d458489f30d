"""Motions from value to value: they begin and end as asked, keep their limits, and reach them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import TypeAdapter
from scipy.interpolate import BPoly

from floatframe import GROUND, Marker, PrismaticJoint
from floatframe.errors import ModelError
from floatframe.model.functions.path_motions import largest_size, path_motion, rest_to_rest_spline
from floatframe.model.functions.point_to_point import quintic, trapezoid, trapezoids_together
from floatframe.model.functions.time_functions import harmonic

SPEED, ACCELERATION = 0.8, 2.0


def sampled_sizes(function, order):
    ends = np.array(function.begins)
    t = np.concatenate([np.linspace(ends[0], ends[-1] + 0.5, 40001), ends, ends - 1e-13])
    return np.abs(function.at(t, order))


def test_a_quintic_is_the_polynomial_of_its_ends():
    """Against the same polynomial in Bernstein's form, made by SciPy."""
    given = [1.5, -0.3, 4.0], [-2.0, 0.7, -1.0]
    found = quintic(
        0.4, 2.1, given[0][0], given[1][0], first_velocity=given[0][1], last_velocity=given[1][1],
        first_acceleration=given[0][2], last_acceleration=given[1][2],
    )  # fmt: skip
    expected = BPoly.from_derivatives([0.4, 2.1], given)
    t = np.linspace(0.4, 2.1 - 1e-12, 23)
    for order in range(3):
        assert_allclose(found.at(t, order), expected(t, order), rtol=0, atol=1e-9)
    assert_allclose([found(0.2), found(0.2, 1), found(3.1), found(3.1, 1)], [1.5 + 0.06, -0.3, -2.0 + 0.7, 0.7],
                    rtol=1e-12, atol=0)  # fmt: skip


@pytest.mark.parametrize(("first", "last"), [(0.2, 1.7), (1.7, 0.2)])
@pytest.mark.parametrize("deceleration", [2.0, 5.0])
def test_a_long_way_has_a_part_at_the_largest_speed_and_takes_the_time_of_the_closed_form(first, last, deceleration):
    found = trapezoid(first, last, speed=SPEED, acceleration=ACCELERATION, deceleration=deceleration, t_start=0.3)
    time = 1.5 / SPEED + SPEED / 2 * (1 / ACCELERATION + 1 / deceleration)
    assert_allclose(found.begins[-1] - 0.3, time, rtol=1e-12, atol=0)
    assert_allclose([found(-1.0), found(0.3), found(0.3 + time), found(9.0)], [first, first, last, last], rtol=1e-12)
    assert_allclose(sampled_sizes(found, 1).max(), SPEED, rtol=1e-12, atol=0)
    sign = np.sign(last - first)
    second = sign * found.at(np.linspace(0.3, 0.3 + time, 999)[1:-1], 2)
    assert set(np.round(second, 9)) == {ACCELERATION, 0.0, -deceleration}
    assert not len(found.jumps(0)[0])
    assert not len(found.jumps(1)[0])


def test_a_short_way_is_a_triangle_of_the_speed():
    h, a, d = 0.1, 2.0, 3.0
    found = trapezoid(0.0, h, speed=SPEED, acceleration=a, deceleration=d)
    peak = np.sqrt(2 * h * a * d / (a + d))
    assert_allclose(found.begins[-1], peak / a + peak / d, rtol=1e-12, atol=0)
    assert_allclose(found(peak / a, 1), peak, rtol=1e-12, atol=0)
    assert found(found.begins[-1] - 1e-9, 2) == -d
    assert not len(found.jumps(0)[0])
    assert not len(found.jumps(1)[0])


@pytest.mark.parametrize("duration", [2.4, 7.0])
def test_a_longer_duration_is_met_with_the_same_accelerations_at_a_lower_speed(duration):
    found = trapezoid(0.0, 1.5, speed=SPEED, acceleration=ACCELERATION, duration=duration)
    assert_allclose([found.begins[-1], found(duration)], [duration, 1.5], rtol=1e-12, atol=0)
    assert sampled_sizes(found, 1).max() < SPEED
    assert_allclose(sampled_sizes(found, 2).max(), ACCELERATION, rtol=1e-12, atol=0)


def test_coordinates_that_move_together_end_together_and_the_slowest_is_as_fast_as_it_can():
    ways = {"a": (0.0, 1.5), "b": (1.0, 0.8), "c": (0.4, 0.4)}
    speed, acceleration = {"a": 0.8, "b": 3.0, "c": 1.0}, 2.0
    found = trapezoids_together(ways, speed=speed, acceleration=acceleration, t_start=1.0)
    alone = trapezoid(*ways["a"], speed=0.8, acceleration=2.0, t_start=1.0)
    for name in "ab":
        assert_allclose(found[name].begins[-1], alone.begins[-1], rtol=1e-12, atol=0)
        assert_allclose(found[name](9.0), ways[name][1], rtol=1e-12, atol=0)
    assert found["c"](2.0) == 0.4
    t = np.linspace(0, 4, 99)
    assert_allclose(found["a"].at(t), alone.at(t), rtol=0, atol=1e-12)


@pytest.mark.parametrize("degree", [3, 5])
def test_a_path_passes_its_values_at_rest_at_its_ends_and_one_coordinate_reaches_a_limit(degree):
    values = {"a": [0.0, 1.0, 0.4, 2.0], "b": [0.5, 0.5, -0.5, -0.4]}
    speed, acceleration = {"a": 1.0, "b": 0.7}, 3.0
    found = path_motion(values, speed=speed, acceleration=acceleration, degree=degree, t_start=0.2)
    used = []
    for name, motion in found.motions.items():
        assert_allclose(motion.at(found.t), values[name], rtol=0, atol=1e-12)
        assert_allclose(motion.at(found.t[[0, -1]], 1), 0, rtol=0, atol=1e-9)
        if degree == 5:
            assert_allclose(motion.at(found.t[[0, -1]], 2), 0, rtol=0, atol=1e-8)
        used += [sampled_sizes(motion, 1).max() / speed[name], sampled_sizes(motion, 2).max() / acceleration]
        for order in range(1, degree):  # of the spline: the order before the last is continuous inside
            inside = [k for k in np.flatnonzero((motion.jumps(order)[0][:, None] == found.t[1:-1]).any(1))]
            assert order >= 3 or not inside
        PrismaticJoint("rail", GROUND, Marker("block"), motions={"distance": motion})  # accepted as a drive
    assert_allclose(max(used), 1.0, rtol=1e-5, atol=0)  # the samples are dense; never above a limit
    assert max(used) <= 1 + 1e-9


def test_the_largest_rates_are_found_between_samples():
    found = rest_to_rest_spline([0.0, 0.4, 1.0, 1.1], [0.0, 1.0, -0.3, 0.2])
    for order in (0, 1, 2):
        assert_allclose(largest_size(found, order), sampled_sizes(found, order).max(), rtol=1e-6, atol=0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: quintic(1.0, 1.0, 0, 1), "t_end above t_start = 1"),
        (lambda: quintic(0.0, 1.0, 0, np.nan), "quintic: last: expected a finite number"),
        (lambda: trapezoid(0, 1, speed=0, acceleration=1), "trapezoid: speed: expected a number above 0"),
        (lambda: trapezoid(0, 1, speed=1, acceleration=1, duration=1.5), "takes at least 2"),
        (lambda: trapezoids_together({}, speed=1, acceleration=1), "at least one coordinate"),
        (lambda: trapezoids_together({"a": (0, 1)}, speed={"b": 1}, acceleration=1), "a limit of 'a', got 'b'"),
        (lambda: path_motion({}, speed=1, acceleration=1), "at least one coordinate"),
        (lambda: path_motion({"a": [0, 1], "b": [0, 1, 2]}, speed=1, acceleration=1), r"'b': .* shape \(3"),
        (lambda: path_motion({"a": [0, 1, 1]}, speed=1, acceleration=1), "no coordinate moves between values 1 and 2"),
        (lambda: path_motion({"a": [0, 1]}, speed=-1, acceleration=1), "speed of 'a': expected a number above 0"),
        (lambda: rest_to_rest_spline([0, 1], [0, 1], 4), "degree of 3 or 5, got 4"),
        (lambda: rest_to_rest_spline([0, 0], [0, 1]), "rising times"),
        (lambda: largest_size(harmonic(1.0, 2.0), 1), "got one with a sine"),
    ],
)  # fmt: skip
def test_impossible_motions_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


def test_system_files_know_them():
    from floatframe.files.system_file.described import MotionSection

    def function(kind, **keys):
        return TypeAdapter(MotionSection).validate_python({"type": kind, **keys}).object_named()

    table = function("trapezoid", first=0.0, last=1.5, speed=SPEED, acceleration=ACCELERATION, t_start=0.5)
    assert table(0.5 + 1.5 / SPEED + SPEED / ACCELERATION) == pytest.approx(1.5, abs=1e-12)
    table = function("quintic", t_start=0.0, t_end=1.0, first=0.0, last=1.0, last_velocity=2.0)
    assert table(1.0, 1) == pytest.approx(2.0, abs=1e-12)
    table = function("spline", t=[0.0, 1.0, 3.0], values=[0.0, 1.0, 0.5], degree=5)
    assert table(1.0) == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(ValueError, match="takes at least 2"):
        function("trapezoid", first=0.0, last=1.0, speed=1.0, acceleration=1.0, duration=0.5)
