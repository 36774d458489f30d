"""Spectral damage: other programs' values, closed forms, long simulated histories, Parseval."""

import math
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import gamma

from floatframe.durability.fatigue.criteria import Criterion
from floatframe.durability.fatigue.history_damage import count_histories
from floatframe.durability.fatigue.load_blocks import LoadBlock
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.sn_curve import basquin_curve
from floatframe.durability.fatigue.spectral.spectra import ModalSpectra, modal_moments, spectra_of_history
from floatframe.durability.fatigue.spectral.spectral_damage import count_spectra, stress_moments
from floatframe.durability.fatigue.spectral.spectral_methods import SPECTRAL_METHODS, damage_rates, widths
from floatframe.errors import FatigueError

#: numbers of FLife 2.3 for its own example: N S^k = 1.8e22, k = 7.3, 5 MPa² in 20-60 Hz and 2 MPa² in 100-120 Hz [s]
FLIFE_LIVES = {
    "dirlik": 1470203265616970.5,
    "tovo-benasciutti": 1664732299501329.0,
    "zhao-baker": 1441384055904468.8,
    "narrow-band": 1212524292738833.5,
    "wirsching-light": 1769842876068961.8,
}
F = np.linspace(0, 500, 5001)
BIMODAL = np.where((F > 20) & (F < 60), 5 / 40, 0) + np.where((F > 100) & (F < 120), 2 / 20, 0.0)


def moments_of(G, f=F):
    return np.array([[np.trapezoid(f**m * G, f)] for m in (0, 1, 2, 4)])


def uniaxial(*sizes):
    stress = np.zeros((1, 6, len(sizes)))
    stress[0, 0] = sizes
    return stress


@pytest.mark.parametrize("method", SPECTRAL_METHODS)
def test_lives_are_those_of_another_program(method):
    curve = basquin_curve((1.8e22 / 1e6) ** (1 / 7.3), 1e6, 7.3)
    assert_allclose(1 / damage_rates(moments_of(BIMODAL), curve, method)[0], FLIFE_LIVES[method], rtol=1e-12)


@pytest.mark.parametrize("width", [0.05, 0.4, 1.5])
def test_lives_are_those_of_another_program_run_beside(width):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import FLife
    G = np.exp(-0.5 * ((F - 60) / (60 * width)) ** 2) + 0.3 * np.exp(-0.5 * ((F - 200) / 20) ** 2)
    data = FLife.SpectralData(input={"PSD": G, "f": F})
    curve = basquin_curve(10.0, 1e6, 4.0)
    for method, theirs in {
        "dirlik": FLife.Dirlik, "tovo-benasciutti": FLife.TovoBenasciutti, "zhao-baker": FLife.ZhaoBaker,
        "wirsching-light": FLife.WirschingLight, "narrow-band": FLife.Narrowband,
    }.items():  # fmt: skip
        life = theirs(data).get_life(1e6 * 10.0**4, 4.0)
        assert_allclose(1 / damage_rates(moments_of(G), curve, method)[0], life, rtol=1e-10)


@pytest.mark.parametrize("method", SPECTRAL_METHODS)
def test_all_methods_meet_for_a_narrow_band(method):
    """D = nu_0 (sqrt(2) sigma)^k Gamma(1 + k/2) / C (Rayleigh); the band of 1 % is nearly a line."""
    moments = moments_of(np.where(np.abs(F - 100) < 0.5, 3.0, 0.0))
    nu_0, _, _, a_2 = widths(moments)
    expected = nu_0 * (math.sqrt(2 * moments[0, 0]) / 10) ** 4 * gamma(3) / 1e6
    assert a_2 > 0.9999
    assert_allclose(damage_rates(moments, basquin_curve(10.0, 1e6, 4), method)[0], expected, rtol=0.02)


@pytest.mark.parametrize("method", [name for name in SPECTRAL_METHODS if name != "wirsching-light"])
@pytest.mark.parametrize("below", ["limit", "haibach"])
def test_two_slopes_are_the_integral_of_the_density(method, below):
    """Second road: p(S) / N(S) by quadrature."""
    curve = basquin_curve(4.0, 1e6, 5, below=below)
    moments = moments_of(BIMODAL)
    S = np.linspace(1e-6, 40, 400_001)
    total = 0.0
    for density in SPECTRAL_METHODS[method](moments):
        b, theta = density.shape[0], density.theta[0]
        p = b * S ** (b - 1) / theta**b * np.exp(-((S / theta) ** b))
        total += density.rate[0] * np.trapezoid(p * curve.damage(S), S)
    assert_allclose(damage_rates(moments, curve, method)[0], total, rtol=1e-4)


def gaussian(G, f, seed, n=2**18, rate=2000.0):
    """A Gaussian history with the spectra (n_f, m, m) by random phases of its factors."""
    rng = np.random.default_rng(seed)
    grid = np.fft.rfftfreq(n, 1 / rate)
    roots = np.linalg.cholesky(G + 1e-12 * np.eye(G.shape[1]) * np.abs(G).max())
    at = np.minimum(np.searchsorted(f, grid), len(f) - 1)
    inside = (grid <= f[-1])[:, None, None]
    noise = rng.standard_normal((len(grid), G.shape[1])) + 1j * rng.standard_normal((len(grid), G.shape[1]))
    X = np.einsum("fkl,fl->fk", np.where(inside, roots[at], 0), noise) * math.sqrt(rate * n) / 2
    return np.arange(n) / rate, np.fft.irfft(X, n, axis=0)


def test_a_simulated_history_counted_by_rainflow_has_the_spectral_damage():
    """262 s of two bands apart, k = 4: the methods are fits, and scatter of 2 % remains; narrow-band is far off."""
    G = np.where((F > 20) & (F < 60), 5 / 40, 0) + np.where((F > 200) & (F < 240), 5 / 40, 0.0)
    q = gaussian(G[:, None, None].astype(complex), F, 1, n=2**19)[1]
    curve = basquin_curve(10.0, 1e6, 4, least_cycles=1)
    counted = count_histories(uniaxial(1.0), [LoadBlock("a", q)], curve, negligible=0).total[0] / (len(q) / 2000)
    for method in ("dirlik", "tovo-benasciutti"):
        assert_allclose(damage_rates(moments_of(G), curve, method)[0][0], counted, rtol=0.08)
    assert damage_rates(moments_of(G), curve, "narrow-band")[0][0] > 1.3 * counted


def three_modes():
    """Cross spectra of three correlated coordinates: H(f) S_ff H(f)*."""
    f = np.linspace(1, 300, 1500)
    H = np.stack([1 / (1 - (f / f0) ** 2 + 0.04j * f / f0) for f0 in (40, 55, 130)], axis=1)
    return ModalSpectra("road", f, np.einsum("fk,fl->fkl", H, H.conj()) + 0.1 * np.eye(3), 100.0)


def test_moments_of_a_stress_are_those_of_its_own_spectrum():
    """Parseval and linearity: the spectrum of one component at every frequency, then integrated."""
    spectra = three_modes()
    stress = np.random.default_rng(0).standard_normal((4, 6, 3))
    n = np.array([0.6, 0.0, 0.8])
    found = stress_moments(stress, spectra, Criterion("normal", n_planes=4), np.tile(np.eye(3), (4, 1, 1)))
    for node in range(4):
        row = stress[node, 0]
        G = np.einsum("k,fkl,l->f", row, spectra.spectra, row).real
        assert_allclose(found[:, node, 0], moments_of(G, spectra.frequencies)[:, 0], rtol=1e-12)
    assert n @ n == pytest.approx(1)


def test_equivalent_von_mises_stress_has_the_mean_square_of_von_mises_stress():
    """Preumont & Piéfort (1994): of a simulated history; 3 % of scatter."""
    spectra = three_modes()
    stress = np.random.default_rng(2).standard_normal((1, 6, 3))
    _, q = gaussian(spectra.spectra, spectra.frequencies, 0)
    xx, yy, zz, yz, xz, xy = stress[0] @ q.T
    mises = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * (yz**2 + xz**2 + xy**2)
    assert_allclose(stress_moments(stress, spectra, Criterion())[0, 0, 0], mises.mean(), rtol=0.03)


def test_von_mises_of_a_uniaxial_stress_is_its_own():
    spectra = three_modes()
    sizes = np.array([3.0, -2.0, 0.5])
    G = np.einsum("k,fkl,l->f", sizes, spectra.spectra, sizes).real
    expected = moments_of(G, spectra.frequencies)
    assert_allclose(stress_moments(uniaxial(*sizes), spectra, Criterion())[:, 0], expected, rtol=1e-12)
    found = count_spectra(uniaxial(*sizes), [spectra], basquin_curve(10.0, 1e6, 5, least_cycles=1e-9))
    assert_allclose(found.total, 100 * damage_rates(expected, basquin_curve(10.0, 1e6, 5), "dirlik")[0], rtol=1e-12)


def test_spectra_of_a_history_keep_its_variance():
    t, q = gaussian(three_modes().spectra, three_modes().frequencies, 1, n=2**15)
    found = modal_moments(spectra_of_history("a", t, q + 5.0, n_segment=2048), (0.0,))[0]
    assert_allclose(found, np.cov(q.T, bias=True), atol=0.05 * np.cov(q.T).max())


def test_scale_repeats_and_mean_stress_by_hand():
    """k = 5: twice the load is 32 times the damage; Goodman 100 of 500 raises amplitudes by 1 / 0.8."""
    base, curve, stress = three_modes(), basquin_curve(10.0, 1e6, 5, least_cycles=1e-9), uniaxial(1.0, 2.0, 0.0)
    args = (base.frequencies, base.spectra, 100.0)
    one = count_spectra(stress, [base], curve).total
    more = count_spectra(stress, [ModalSpectra("a", *args, repeats=3, scale=2)], curve)
    assert_allclose(more.total, 96 * one, rtol=1e-12)
    mean = ModalSpectra("a", *args, mean=np.array([100.0, 0, 0]))
    assert_allclose(count_spectra(stress, [mean], curve, mean_stress=MeanStress("goodman", 500.0)).total,
                    one / 0.8**5, rtol=1e-12)  # fmt: skip
    with pytest.raises(FatigueError, match="no less than the strength 50"):
        count_spectra(stress, [mean], curve, mean_stress=MeanStress("goodman", 50.0))


RATIO_0 = basquin_curve(1, 1e6, 5, stress_ratio=0.0)
EYE = np.broadcast_to(np.eye(2), (3, 2, 2))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ModalSpectra("a", [1, 2, 2], EYE, 1.0), "got 2 and then 2 Hz"),
        (lambda: ModalSpectra("a", [-1, 2, 3], EYE, 1.0), "from 0 on"),
        (lambda: ModalSpectra("a", [1, 2, 3], EYE * np.array([1, -1]), 1.0), "expected 0 or more"),
        (lambda: ModalSpectra("a", [1, 2, 3], EYE + np.array([[0, 1], [0, 0]]), 1.0), "conj"),
        (lambda: ModalSpectra("a", [1, 2, 3], EYE * math.nan, 1.0), "NaN"),
        (lambda: ModalSpectra("a", [1, 2, 3], EYE[:2], 1.0), r"got \(3,\) and \(2, 2, 2\)"),
        (lambda: ModalSpectra("a", [1, 2, 3], EYE, 0.0), "duration: expected a number above 0"),
        (lambda: ModalSpectra("a", [1, 2, 3], EYE, 1.0, mean=np.zeros(3)), "mean: expected 2"),
        (lambda: spectra_of_history("a", np.arange(20.0) ** 2, np.zeros((20, 1))), "equal steps"),
        (lambda: count(method="dirlick"), "did you mean 'dirlik'"),
        (lambda: count(criterion=Criterion("principal")), 'take "normal"'),
        (lambda: count(criterion=Criterion("findley")), 'take "shear"'),
        (lambda: count(mean_stress=MeanStress("swt")), "a factor on all amplitudes"),
        (lambda: count(curve=RATIO_0, mean_stress=MeanStress("gerber", 9.0)), "R = -1"),
        (lambda: count(curve=basquin_curve(1, 1e6, 5, below="haibach"), method="wirsching-light"), "one slope"),
        (lambda: count(stress=np.ones((1, 6, 3))), "2 modal coordinates, but stress shapes of 3"),
    ],
)
def test_spectra_that_cannot_be_are_refused(make, words):
    with pytest.raises(FatigueError, match=words):
        make()


def count(stress=None, curve=None, **args):
    stress = np.ones((1, 6, 2)) if stress is None else stress
    return count_spectra(stress, [ModalSpectra("a", [1, 2, 3], EYE, 1.0)], curve or basquin_curve(1.0, 1e6, 5), **args)


def test_zhao_baker_says_where_it_does_not_hold():
    f = np.linspace(0.1, 1000, 20_000)
    wide = moments_of(1 / (1 + (f / 0.5) ** 2), f)
    with pytest.raises(FatigueError, match=r"0.13 or more, got 0.0"):
        damage_rates(wide, basquin_curve(1.0, 1e6, 5), "zhao-baker")


def test_von_mises_of_the_stress_in_the_surface_is_that_of_all_of_it_on_a_free_surface():
    spectra = three_modes()
    stress = np.random.default_rng(4).standard_normal((3, 6, 3))
    stress[:, 2:5] = 0  # e3 is the normal
    frames = np.tile(np.eye(3), (3, 1, 1))
    full, plane = (stress_moments(stress, spectra, Criterion(tensor=tensor), frames) for tensor in ("full", "surface"))
    assert_allclose(plane, full, rtol=1e-12)
