"""Shock response spectra against pyYeti and closed forms of a half-sine."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.shaking.loads.pulses import pulse
from floatframe.durability.shaking.responses.response_spectrum import (
    POINTS_A_CYCLE,
    octave_frequencies,
    refined,
    shock_response_spectrum,
)
from floatframe.errors import ModelError

H = 1e-4


@pytest.fixture(scope="module")
def noise():
    return np.concatenate([[0.0], np.random.default_rng(3).normal(size=300), np.zeros(3000)])


@pytest.mark.parametrize(
    ("kind", "stype"), [("acceleration", "absacce"), ("displacement", "reldisp"), ("pseudo-velocity", "pvelo")]
)
def test_spectra_are_those_of_pyyeti(noise, kind, stype):
    from pyyeti import srs

    f = octave_frequencies(20.0, 240.0, 3)  # up to 41 samples a cycle: no points between are taken by either
    own = shock_response_spectrum(noise, H, f, 12.5, kind)
    other = srs.srs(noise, 1 / H, f, 12.5, stype=stype, rolloff="none", time="total", parallel="no")
    # residual peaks: ours in closed form, theirs at samples
    assert (own >= other * (1 - 1e-9)).all()
    assert_allclose(own, other, rtol=3e-3)
    within = shock_response_spectrum(noise, H, f, 12.5, kind, residual=False)
    theirs = srs.srs(noise, 1 / H, f, 12.5, stype=stype, rolloff="none", time="primary", parallel="no")
    assert_allclose(within, theirs, rtol=1e-9)


def test_a_half_sine_on_a_slow_undamped_mass_leaves_its_velocity_change():
    T = 0.01
    t, a = pulse("half-sine", 50.0, T)
    for f in (5.0, 20.0, 40.0):
        own = shock_response_spectrum(a, float(t[1]), np.array([f]), 1e9)[0]
        r = 2 * f * T  # residual: 2 r cos(pi r/2)/(1 - r²), the largest for r <= 1
        assert_allclose(own, 50.0 * abs(2 * r * np.cos(np.pi * r / 2) / (1 - r**2)), rtol=2e-5)


def test_a_stiff_mass_has_the_largest_acceleration_itself():
    t, a = pulse("terminal-peak", 30.0, 0.02)
    fine = np.arange(0, 0.02 + 1e-9, 2e-5)
    own = shock_response_spectrum(np.interp(fine, t, a), 2e-5, np.array([4e5]), 10.0)
    assert_allclose(own, 30.0, rtol=0.02)


def test_what_comes_after_the_last_sample_counts():
    t, a = pulse("half-sine", 1.0, 0.01)
    f = np.array([10.0])
    short = shock_response_spectrum(a, float(t[1]), f, 20.0)
    assert_allclose(short, shock_response_spectrum(np.pad(a, (0, 8000)), float(t[1]), f, 20.0), rtol=1e-6)
    assert shock_response_spectrum(a, float(t[1]), f, 20.0, residual=False) < 0.9 * short


@pytest.mark.parametrize(("given", "words"), [({"kind": "velocity"}, "kind"), ({"Q": 0.4}, "above 0.5")])
def test_unknown_kinds_and_amplifications_are_refused(given, words):
    with pytest.raises(ModelError, match=words):
        shock_response_spectrum(np.ones(5), H, np.array([10.0]), **given)


def test_points_between_lie_on_the_lines_between_samples_and_end_with_the_last_one():
    """Straight lines are divided so that a cycle has enough points."""
    a = np.array([1.0, -3.0, 0.5, 2.0])
    n = int(np.ceil(POINTS_A_CYCLE * 1000.0 * H))
    found, step = refined(a, H, 1000.0)
    assert n > 1
    assert_allclose(step, H / n, rtol=1e-15)
    assert found.shape == (3 * n + 1,)
    share = np.arange(n) / n
    for k in range(3):
        assert_allclose(found[k * n : (k + 1) * n], (1 - share) * a[k] + share * a[k + 1], rtol=0, atol=1e-14)
    assert found[-1] == a[-1]
