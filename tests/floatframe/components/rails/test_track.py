"""Tracks and what their rails deviate: clothoids by Fresnel integrals, spectra, envelopes of wheels, bad input."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.signal import welch
from scipy.special import fresnel

from floatframe.components.rails.irregularities import SPECTRA, Irregularities, random_irregularities, wheel_envelope
from floatframe.components.rails.law import deviation, place_on_track
from floatframe.components.rails.splines import coefficients
from floatframe.components.rails.track import Segment, Track, curve
from floatframe.errors import ModelError


def test_a_transition_is_a_clothoid_and_a_circle_closes():
    R, L = 250.0, 80.0
    track = Track(curve(R, 2 * np.pi * R, transition=L, before=0.5, after=0.5))
    scale = np.sqrt(np.pi * R * L)  # curvature s/(R L): angle s²/(2 R L)
    y, x = fresnel(L / scale)
    assert_allclose(track.frame(0.5 + L).origin, [0.5 + scale * x, scale * y, 0], rtol=0, atol=1e-9)
    one, other = track.frame(0.5 + L), track.frame(0.5 + L + 2 * np.pi * R)
    assert_allclose(one.origin, other.origin, rtol=0, atol=1e-7)
    assert_allclose(one.axes, other.axes, rtol=0, atol=1e-10)
    assert_allclose(one.curvature, 1 / R)


def test_cant_lifts_the_outer_rail():
    left, right = Track(curve(300.0, 100.0, cant=0.15)), Track(curve(-300.0, 100.0, cant=0.15))
    for track, sign in ((left, 1), (right, -1)):
        frame = track.frame(120.0)
        assert_allclose(1.5 * frame.axes[2, 1], -sign * 0.15, rtol=1e-12)
        assert_allclose(frame.axes.T @ frame.axes, np.eye(3), atol=1e-14)
        assert_allclose(np.linalg.det(frame.axes), 1.0)


@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_the_compiled_law_finds_the_place_beside_a_point(heading):
    track = Track(
        (Segment(300.0), *curve(-200.0, 250.0, transition=60.0, cant=0.1)), start=(5.0, -7.0, 0.3), heading=heading
    )  # fmt: skip
    data = np.concatenate([np.zeros(21), track.cells.ravel()])
    data[14], data[15] = 21, len(track.cells)
    for s in (-40.0, 0.0, 151.0, 320.5, 345.0, 401.7, 599.0, 640.0, 730.0, 900.0):
        frame = track.frame(s)
        for beside in (-0.9, 0.0, 0.8):
            point = frame.origin + beside * np.array([frame.axes[0, 1], frame.axes[1, 1], 0]) / np.hypot(
                *frame.axes[:2, 1]
            )
            found = place_on_track(data, point[0], point[1])
            assert_allclose(found[0], s, rtol=0, atol=1e-9)
            assert_allclose(found[1:3], frame.origin[:2], rtol=0, atol=1e-9)
            assert_allclose([np.cos(found[3]), np.sin(found[3])], frame.axes[:2, 0], rtol=0, atol=1e-10)
            assert_allclose(np.sin(found[4]), -frame.axes[2, 1], rtol=0, atol=1e-12)
            ends = [np.arctan2(*track.frame(x).axes[1::-1, 0]) for x in (s - 1e-3, s + 1e-3)]
            assert_allclose(found[5], (ends[1] - ends[0]) / 2e-3, rtol=0, atol=1e-8)  # curvature: slope of the heading


@pytest.mark.parametrize("name", ["erri-low", "erri-high", "fra-4", "fra-6"])
def test_random_rails_have_the_variance_and_the_spectrum_of_their_class(name):
    spectrum = SPECTRA[name]
    track = random_irregularities(name, 6000.0, seed=3, fade=0.0)
    lateral, vertical = 0.5 * (track.left_y + track.right_y), 0.5 * (track.left_z + track.right_z)
    roll = (track.left_z - track.right_z) / 1.5
    low, high = 2 * np.pi / 100, 2 * np.pi
    for signal, which in ((lateral, 0), (vertical, 1), (roll, 2)):
        variance = quad(lambda W, which=which: float(spectrum.densities(np.array(W))[which]), low, high, limit=200)[0]
        assert_allclose(np.var(signal), variance, rtol=0.25)
        f, density = welch(signal, fs=1 / 0.2, nperseg=2048)
        W = 2 * np.pi * f
        band = (W > 0.3) & (W < 3.0)
        expected = 2 * np.pi * spectrum.densities(W[band])[which]
        assert_allclose(np.mean(np.log(density[band] / expected)), 0.0, atol=0.15)


def test_published_levels_of_the_european_spectra():
    """Standard deviations of vertical waves of 3 to 25 m, from the integral: about 1.0 and 1.6 mm for low and high."""
    for name, expected in (("erri-low", 0.99e-3), ("erri-high", 1.62e-3)):
        variance = quad(
            lambda W, name=name: float(SPECTRA[name].densities(np.array(W))[1]), 2 * np.pi / 25, 2 * np.pi / 3
        )[0]
        assert_allclose(np.sqrt(variance), expected, rtol=0.02)


def test_a_seed_is_a_track():
    one, other = random_irregularities("erri-low", 100.0, seed=1), random_irregularities("erri-low", 100.0, seed=1)
    assert np.array_equal(one.left_z, other.left_z)
    assert not np.array_equal(one.left_z, random_irregularities("erri-low", 100.0, seed=2).left_z)
    assert one.left_z[0] == 0.0


def test_a_wheel_bridges_a_gap_and_climbs_a_step_along_its_own_circle():
    r, step, spacing = 0.46, 0.01, 1e-3
    s = np.arange(-0.5, 0.5, spacing)
    envelope = wheel_envelope(np.where(s >= 0, step, 0.0), spacing, r)
    reach = np.sqrt(step * (2 * r - step))
    inside = (s > -reach) & (s < -spacing)
    assert_allclose(envelope[inside], step - (r - np.sqrt(r**2 - s[inside] ** 2)), rtol=0, atol=spacing * reach / r)
    assert_allclose(envelope[s < -reach - 2 * spacing], 0.0, atol=1e-15)
    gap = wheel_envelope(np.where(np.abs(s) < 0.05, -0.01, 0.0), spacing, r)
    assert_allclose(gap.min(), -(r - np.sqrt(r**2 - 0.05**2)), rtol=0.03)  # hangs on both edges
    smooth = 1e-4 * np.sin(2 * np.pi * s)
    assert_allclose(wheel_envelope(smooth, spacing, r), smooth, rtol=0, atol=2e-7)  # long waves are followed
    assert np.all(envelope >= np.where(s >= 0, step, 0.0))


def test_deviations_are_splines_through_their_table():
    s = np.linspace(2.0, 12.0, 51)
    values = 1e-3 * np.sin(s)
    data = np.concatenate(
        [np.zeros(20), np.column_stack([coefficients(v) for v in (values, 2 * values, 3 * values, 4 * values)]).ravel()]
    )
    data[16:20] = 20, 2.0, 0.2, 51
    for place in (4.05, 7.33, 9.0):
        for k in range(4):
            value, slope = deviation(data, k, place)
            assert_allclose(value, (k + 1) * 1e-3 * np.sin(place), rtol=0, atol=2e-7)
            assert_allclose(slope, (k + 1) * 1e-3 * np.cos(place), rtol=0, atol=2e-6)
    assert deviation(data, 0, 1.0) == (pytest.approx(1e-3 * np.sin(2.0)), 0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Track((Segment(10.0, cant=(0, 0)), Segment(10.0, cant=(0.1, 0.1)))), "cant jumps"),
        (lambda: Track((Segment(-10.0),)), "length"),
        (lambda: Track((Segment(10.0, (0.0, 300.0)),)), "20 m or more"),
        (lambda: Track((Segment(10.0, cant=(150.0, 150.0)),)), "is the unit metre"),
        (lambda: curve(5.0, 10.0), "20 m or more"),
        (lambda: Irregularities(np.arange(5), *[np.full(5, 3.0)] * 4), "look like millimetres"),
        (lambda: Irregularities([0, 1, 3, 4], *[np.zeros(4)] * 4), "equally spaced"),
        (lambda: Irregularities(np.arange(5), np.zeros(4), *[np.zeros(5)] * 3), "left_y"),
        (lambda: random_irregularities("uic", 100.0), "erri-low"),
        (lambda: random_irregularities("fra-1", 100.0, spacing=0.5), "quarter"),
        (lambda: random_irregularities("fra-1", 1e9), "too many"),
        (lambda: random_irregularities("fra-1", 100.0, shortest=200.0), "not shorter"),
        (lambda: wheel_envelope(np.array([0.0, 1.0]), 0.1, 0.46), "more than the radius"),
        (lambda: Track.from_table({"radius": 300}), "unknown key"),
        (lambda: Track.from_table({"curve": {"R": 300}}), "a curve has radius"),
        (lambda: Track.from_table({"irregularities": {"spectrum": "fra-1"}}), "length is missing"),
    ],
)
def test_bad_tracks_are_named(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_a_table_of_a_file_is_the_track():
    table = {
        "heading": 0.2,
        "curve": {"radius": 300.0, "length": 50.0},
        "irregularities": {"spectrum": "erri-low", "length": 30.0},
    }
    track = Track.from_table(table)
    assert_allclose(track.frame(90.0).origin, Track(curve(300.0, 50.0), heading=0.2).frame(90.0).origin)
    assert track.irregularities is not None
    segments = Track.from_table(
        {"segments": [{"length": 10}, {"length": 20, "curvature": [0.0, 0.002], "cant": [0.0, 0.05]}]}
    )
    assert_allclose(segments.segments[1].cant, (0.0, 0.05))
    assert segments.length == 30.0
