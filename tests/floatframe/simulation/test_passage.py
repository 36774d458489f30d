"""Where a value passes its level: the first multiple of the tolerance, whatever the guess is."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.simulation.passage import expected_passage, passage

SHAPES = {
    "smooth": lambda x: math.sin(3 * x),
    "steep": lambda x: math.tanh(1e4 * x),
    "kink": lambda x: x if x < 0 else 1e-3 * x,
    "jump": lambda x: -1.0 if x < 0 else 2.0,
    "flat": lambda x: max(-1e-3, x),
    "root": lambda x: math.copysign(math.sqrt(abs(x)), x),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_the_first_multiple_of_the_tolerance_that_is_not_below_zero(shape):
    """It lies behind the zero by no more than the tolerance, and is the same for every guess."""
    rng = np.random.default_rng(7)
    for zero in rng.uniform(0, 1, 40):
        tried = []

        def beyond(x, zero=zero, tried=tried):
            tried.append(x)
            return SHAPES[shape](x - zero)

        places = {
            passage(beyond, beyond(0.0), beyond(1.0), 1e-7, guess)
            for guess in ((zero, 3.0), (0.5, 3.0), (0.1, 0.0), (0.9, -1.0), (zero + 1e-6, 1e3))
        }
        (place,) = places
        assert place in tried
        assert 0 <= place - zero <= 1e-7 * (1 + 1e-6)
        assert beyond(place) >= 0 > beyond(place - 1e-7 * (1 + 1e-6))


def test_a_good_guess_takes_two_evaluations():
    """Through three values on either side, as a smooth motion gives them in steps."""
    zero, tried = 0.3712, []

    def value(x):
        return math.sin(0.3 * (x - zero))

    def beyond(x):
        tried.append(x)
        return value(x)

    neighbours = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]
    x, slope = expected_passage(neighbours, [value(x) for x in neighbours])
    assert_allclose((x, slope), (zero, 0.3), rtol=0, atol=1e-5)
    assert_allclose(passage(beyond, value(0.0), value(1.0), 1e-9, (x, slope)), zero, rtol=0, atol=1e-9)
    assert len(tried) <= 3


def test_a_level_that_is_just_reached_at_the_end_is_passed_there():
    assert passage(lambda x: x - 1.0, -1.0, 0.0, 1e-9, (1.0, 1.0)) == 1.0
    assert passage(lambda x: -1.0, -1.0, 1.0, 1e-3, (0.5, 2.0)) == 1.0


def test_two_values_are_joined_by_a_line():
    assert_allclose(expected_passage([0.0, 1.0], [-1.0, 3.0]), (0.25, 4.0), rtol=1e-12, atol=0)
