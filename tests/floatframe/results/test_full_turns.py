"""Angles that a run did not count are followed from one output to the next by their rates."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import ResultsError
from floatframe.results.full_turns import followed_angle


def wrapped(angle):
    return np.angle(np.exp(1j * angle))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("start", [-2.5, 0.4])
def test_an_angle_that_speeds_up_by_turns_a_step_is_followed(sign, start):
    """At steady acceleration the mean of two rates is exact, and one of them alone is off by more than a turn."""
    t = np.cumsum([0.3, 0.1, 0.25, 0.1, 0.2, 0.15, 0.1])
    angle = start + sign * 400.0 * (t - 0.3) ** 2
    rate = sign * 800.0 * (t - 0.3)
    assert np.abs(np.diff(rate) * np.diff(t) / 2).min() > np.pi
    assert_allclose(followed_angle("a", t, wrapped(angle), rate), angle, rtol=0, atol=1e-11)


def test_a_quarter_of_a_turn_off_its_extrapolation_is_lost_and_named():
    t = np.array([0.0, 0.5, 1.0])
    value = np.array([0.0, 0.1, 0.2])
    assert_allclose(followed_angle("a", t, value, np.array([0.2, 0.2, 0.2 + 4 * 1.5])), value, rtol=0, atol=1e-12)
    with pytest.raises(
        ResultsError, match=r"hinge: the angle cannot be followed from t = 0\.5 to 1, .* about 1\.7 rad"
    ):
        followed_angle("hinge", t, value, np.array([0.2, 0.2, 0.2 + 4 * 1.6]))
