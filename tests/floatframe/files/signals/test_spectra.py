"""Spectra against closed forms, Parseval's identity, pyYeti and SciPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pyyeti import psd as pyyeti_psd

from floatframe.errors import SignalError
from floatframe.files.signals import (
    WINDOWS,
    Signal,
    amplitude_spectrum,
    band_edges,
    octave_levels,
    psd,
    transfer_estimate,
    window_corrections,
)
from floatframe.files.signals.analysis import SpectrumRequest, as_psd
from floatframe.files.signals.octaves import nominal_frequency

RATE = 1024.0


def noise(n, seed=0, sigma=1.0):
    return sigma * np.random.default_rng(seed).normal(size=n)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("n", [1024, 1023])
def test_a_sine_has_its_amplitude_through_every_window(window, n):
    k = 100
    t = np.arange(n) / RATE
    x = 3.0 * np.sin(2 * np.pi * k * RATE / n * t + 0.7) + 0.5
    peak, rms = (amplitude_spectrum(x, RATE, window=window, detrend="none", is_rms=r) for r in (False, True))
    assert_allclose(peak.values[[0, k]], [0.5, 3.0], rtol=1e-12, atol=0)
    assert_allclose(rms.values[[0, k]], [0.5, 3.0 / np.sqrt(2)], rtol=1e-12, atol=0)
    assert peak.kind == "amplitude (peak)"


@pytest.mark.parametrize("window", WINDOWS)
def test_a_line_between_two_is_seen_smaller_by_the_scalloping_of_the_window(window):
    n, k = 1024, 100.5
    t = np.arange(n) / RATE
    found = amplitude_spectrum(np.sin(2 * np.pi * k * RATE / n * t), RATE, window=window, detrend="none")
    assert_allclose(found.values[[100, 101]], window_corrections(window, n).scalloping, rtol=3e-3, atol=0)


def test_corrections_of_windows_are_those_of_their_sums_of_cosines():
    """Of Σ a_m cos(2 pi m j/n): gain a_0, noise bandwidth 1 + Σ a_m²/(2 a_0²); hann 0.5 and 1.5, and so on."""
    for window, a in (("hann", [0.5, 0.5]), ("hamming", [0.54, 0.46]), ("blackman", [0.42, 0.5, 0.08]),
                      ("rectangular", [1.0])):  # fmt: skip
        c = window_corrections(window)
        expected = [a[0], 1 + sum(x**2 for x in a[1:]) / (2 * a[0] ** 2)]
        assert_allclose([c.coherent_gain, c.noise_bandwidth], expected, rtol=1e-9, atol=0)


@pytest.mark.parametrize("window", WINDOWS)
def test_the_density_of_white_noise_is_its_variance_over_half_the_rate(window):
    x = noise(400_000, sigma=2.0)
    G = psd(x, RATE, window=window, n_segment=1000, unit="m/s²")
    assert (G.unit, G.n_averages) == ("(m/s²)²/Hz", 799)
    assert_allclose(np.mean(G.values[5:-5]), 4.0 / (RATE / 2), rtol=0.01, atol=0)


@pytest.mark.parametrize("n", [500, 501])
def test_the_integral_of_the_density_is_the_mean_square(n):
    """Parseval: exact for one segment without window."""
    x = noise(n) + 3.0
    G = psd(x, RATE, window="rectangular", n_segment=n, detrend="none")
    assert_allclose(G.mean_square, np.mean(x**2), rtol=1e-12, atol=0)
    with pytest.raises(SignalError, match="has no mean square; take psd"):
        _ = amplitude_spectrum(x, RATE).mean_square


def test_the_density_is_the_mean_over_segments_of_its_formula():
    """Equation (1) summed directly: no transform of a library."""
    x, n = noise(48, seed=3), 16
    w = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    waves = np.exp(-2j * np.pi * np.outer(np.arange(n // 2 + 1), np.arange(n)) / n)
    parts = [np.abs(waves @ (w * (x[k : k + n] - x[k : k + n].mean()))) ** 2 for k in range(0, 33, 8)]
    expected = 2 * np.mean(parts, axis=0) / (RATE * (w @ w))
    expected[[0, -1]] /= 2
    found = psd(x, RATE, n_segment=n)
    assert_allclose(found.values, expected, rtol=1e-11, atol=1e-18)
    assert_allclose(found.frequencies, np.arange(9) * RATE / n, rtol=1e-14, atol=0)
    assert found.n_averages == 5


def test_the_density_is_that_of_pyyeti():
    """One time slice of its maximax density is the average of all segments."""
    x = noise(8192, seed=3)
    f, P = pyyeti_psd.psdmod(x, RATE, nperseg=512, timeslice=8.0, tsoverlap=0.5)
    assert_allclose(psd(x, RATE, n_segment=512).values, P, rtol=1e-10, atol=1e-18)
    assert len(f) == 257


@pytest.mark.parametrize("fraction", [1, 3])
def test_octave_levels_are_those_of_pyyeti(fraction):
    x = np.cumsum(noise(60_000, seed=5)) * 0.01 + noise(60_000, seed=6)
    density = psd(x, RATE, n_segment=4096)
    bands = octave_levels(density, fraction)
    middle = bands.frequencies
    P, f, *_ = pyyeti_psd.rescale(density.values, density.frequencies, freq=middle)
    assert_allclose(f, middle, rtol=1e-12, atol=0)
    # pyYeti puts edges half way between its midband frequencies on a logarithmic scale: those of the standard
    inner = slice(1, -1)
    mine = bands.values**2 / np.diff(bands.edges, axis=1)[:, 0]
    assert_allclose(mine[inner], P[inner], rtol=0.03 if fraction == 3 else 0.01, atol=0)


def test_band_edges_are_those_of_iec_61260():
    """Table of exact base-ten frequencies: 1000·10^(3x/10) for octaves, edges by 10^(3/20); nominal ones."""
    middle, edges = band_edges(1, 20.0, 12000.0)
    assert_allclose(middle, [31.622776601683793, 63.09573444801933, 125.89254117941672, 251.18864315095802,
                             501.1872336272723, 1000.0, 1995.2623149688795, 3981.0717055349727, 7943.282347242815],
                    rtol=1e-12, atol=0)  # fmt: skip
    assert_allclose(edges[5], [707.9457843841379, 1412.5375446227544], rtol=1e-12, atol=0)
    assert_allclose(edges[1:, 0], edges[:-1, 1], rtol=1e-14, atol=0)
    assert [nominal_frequency(f) for f in middle] == [31.5, 63, 125, 250, 500, 1000, 2000, 4000, 8000]
    thirds, edges = band_edges(3, 80.0, 400.0)
    assert [nominal_frequency(f) for f in thirds] == [100, 125, 160, 200, 250, 315]
    assert_allclose(edges[:, 1] / edges[:, 0], 10**0.1, rtol=1e-12, atol=0)


def test_the_squares_of_all_bands_add_to_the_power_between_their_edges():
    x = noise(50_000)
    density = psd(x, RATE, n_segment=2048)
    for fraction in (1, 3, 6):
        bands = octave_levels(density, fraction)
        low, high = bands.edges[0, 0], bands.edges[-1, 1]
        fine = np.linspace(low, high, 400_001)
        near = density.values[np.rint(fine[:-1] / density.resolution).astype(int)]
        assert_allclose(bands.mean_square, near.mean() * (high - low), rtol=1e-4, atol=0)
        assert (np.diff(bands.edges, axis=1)[:, 0] >= 2 * density.resolution * (1 - 1e-9)).all()


def test_a_filter_is_found_from_its_input_and_output():
    """y = x_j + x_{j-3}/2 plus noise: noise in y does not bias H1, noise in x not H2; coherence by its formula."""
    x, e = noise(300_000), noise(300_000, seed=1, sigma=0.5)
    y = x + 0.5 * np.concatenate([np.zeros(3), x[:-3]])
    clean = transfer_estimate(x, y, RATE, n_segment=1024, units=("N", "m/s²"))
    H = 1 + 0.5 * np.exp(-2j * np.pi * clean.frequencies * 3 / RATE)
    assert clean.unit == "(m/s²)/(N)"
    assert_allclose(clean.H1[5:-5], H[5:-5], rtol=0, atol=0.02)
    assert_allclose(clean.coherence[5:-5], 1.0, rtol=0, atol=2e-3)
    noisy_out, noisy_in = (transfer_estimate(a, b, RATE, n_segment=1024) for a, b in ((x, y + e), (x + e, y)))
    for found, other in ((noisy_out.H1, noisy_out.H2), (noisy_in.H2, noisy_in.H1)):
        assert abs(np.mean(found[5:-5] / H[5:-5]) - 1) < 0.01
        assert abs(np.mean(other[5:-5] / H[5:-5]) - 1) > 0.1
    expected = np.abs(H) ** 2 / (np.abs(H) ** 2 + 0.25)
    assert abs(np.mean(noisy_out.coherence[5:-5] / expected[5:-5]) - 1) < 0.01


def test_samples_too_large_to_be_squared_are_refused():
    values = 1e300 * np.sin(np.arange(300.0))
    for spectrum in (psd, amplitude_spectrum):
        with pytest.raises(SignalError, match="of up to 1e\\+300 are too large to be squared"):
            spectrum(values, 100.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda x: psd(x, RATE, window="han"), "did you mean 'hann'"),
        (lambda x: psd(x, 0.0), "rate = 0.0"),
        (lambda x: psd(x * np.nan, RATE), "finite samples"),
        (lambda x: psd(x, RATE, n_segment=1000), "a segment of 1000 samples: expected 8 up to the 200"),
        (lambda x: psd(x, RATE, overlap=1.0), "overlap = 1"),
        (lambda x: psd(x, RATE, detrend="quadratic"), "constant, linear, none"),
        (lambda x: transfer_estimate(x, x[1:], RATE), "records of one length, got 200 and 199"),
        (lambda x: transfer_estimate(x, x, RATE, n_segment=200), "coherence needs two or more"),
        (lambda x: octave_levels(psd(x, RATE, n_segment=8)), "take a finer resolution"),
        (lambda x: octave_levels(amplitude_spectrum(x, RATE)), "expected a power spectral density"),
    ],
)
def test_impossible_spectra_are_refused(make, words):
    with pytest.raises(SignalError, match=words):
        make(noise(200))


@pytest.mark.parametrize("overlap", [0.0, 0.25, 0.5, 0.75])
def test_eight_segments_fill_the_record_unless_their_length_is_given(overlap):
    """n + 7 (1 - overlap) n samples are eight segments of n."""
    n = 4000
    density = psd(noise(round(n + 7 * (1 - overlap) * n)), RATE, overlap=overlap)
    assert density.n_averages == 8
    assert_allclose(density.resolution, RATE / n, rtol=1e-12, atol=0)


@pytest.mark.parametrize("overlap", [0.0, 0.25, 0.5, 0.75])
def test_eight_segments_fit_into_records_of_any_length(overlap):
    """Odd segments overlap by half a sample less than asked for: seven of them fitted in every other record."""
    for n_t in range(300, 340):
        assert psd(noise(n_t), RATE, overlap=overlap).n_averages == 8


@pytest.mark.parametrize("resolution", [0.25, 1.0, 4.0])
def test_lines_have_the_requested_spacing(resolution):
    time = np.arange(8000) / RATE
    signal = Signal("a", time, np.sin(300 * time), "N")
    found = as_psd(signal, SpectrumRequest(resolution=resolution))
    assert_allclose(found.resolution, resolution, rtol=1e-12, atol=0)
    assert_allclose(np.diff(found.frequencies), resolution, rtol=1e-9, atol=0)
