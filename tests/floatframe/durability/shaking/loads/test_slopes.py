"""Bands with slopes: corners and rms of a published kind of profile, and every way to write one wrongly."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.shaking.loads.levels import level_rms
from floatframe.durability.shaking.loads.slopes import level_of_bands
from floatframe.errors import ModelError

PROFILE = [[20, 80, "+3 dB/oct"], [80, 350, 0.04], [350, 2000, "-3 dB/oct"]]


def bands(rows, unit="g2/Hz"):
    return level_of_bands(rows, unit, "random.qual: level")


def test_the_profile_of_navmat_has_its_corners_and_its_six_g():
    """3 dB/oct is a density that is nearly proportional to f: 0.01 at 20 Hz, 0.007 at 2000 Hz, 6.06 g rms."""
    level = bands(PROFILE)
    assert_allclose(level.frequencies, [20, 80, 350, 2000])
    power = 0.3 / np.log10(2)
    assert_allclose(level.values, [0.04 * (20 / 80) ** power, 0.04, 0.04, 0.04 * (2000 / 350) ** -power], rtol=1e-12)
    assert_allclose(level.values, [0.01, 0.04, 0.04, 0.007], rtol=0.01)
    assert_allclose(level_rms(level), 6.06, atol=0.01)


def test_a_slope_of_amplitudes_is_half_that_of_densities():
    level = bands([[5, 10, "+6 dB/oct"], [10, 100, 1.0], [100, 200, "-12dB/octave"]], "g")
    assert_allclose(level.values, [10 ** (-6 / 20), 1.0, 1.0, 10 ** (-12 / 20)], rtol=1e-12)


def test_slopes_go_on_over_several_bands_on_both_sides():
    level = bands([[10, 20, "3 dB/oct"], [20, 40, "6 dB/oct"], [40, 80, 1.0], [80, 160, "-6 dB/oct"],
                   [160, 320, "-3.0 dB/oct"]])  # fmt: skip
    expected = np.cumsum([-9.0, 3, 6, 0, -6, -3])
    assert_allclose(10 * np.log10(level.values), expected, atol=1e-12)


def test_a_slope_between_two_levels_meets_both():
    level = bands([[10, 20, 0.01], [20, 80, "+3 dB/oct"], [80, 100, 0.04]])
    assert_allclose(level.values, [0.01, 0.01, 0.04, 0.04])
    with pytest.raises(ModelError, match=r"band 2: \+3 dB/oct from 0.01 .* 0.03981 at 80 Hz, -1.78 dB from the 0.06"):
        bands([[10, 20, 0.01], [20, 80, "+3 dB/oct"], [80, 100, 0.06]])


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "got none"),
        ([[20, 80, "3 dB/oct"]], "no band has a level"),
        ([[20, 80, 0.1], [90, 100, 0.1]], "begins at 90 Hz, but the previous band ends at 80 Hz"),
        ([[20, 80, 0.1], [80, 100, 0.2]], "band 2: a step from 0.1 to 0.2"),
        ([[80, 20, 0.1]], "rising frequencies above 0"),
        ([[0, 20, 0.1]], "rising frequencies above 0"),
        ([[20, 80, 0.0]], "expected a level above 0"),
        ([[20, 80, "steep"]], 'expected a slope such as "\\+3 dB/oct"'),
        ([[20, 80, "3 dB"]], "expected a slope"),
        ([[20, 80, "1e9 dB/oct"]], "expected a slope"),
        ([[20, 80, "300 dB/oct"]], "up to 100"),
        ([[20, "80", 1.0]], "band 1: expected"),
        ([[20, 80]], "band 1: expected"),
    ],
)
def test_bands_that_are_none_are_refused(rows, message):
    with pytest.raises(ModelError, match=message):
        bands(rows)
