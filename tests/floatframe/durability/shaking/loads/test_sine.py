"""Sine tests: transmissibility of one and two masses, and sweeps against their integration cycle by cycle."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.shaking.loads.levels import Level
from floatframe.durability.shaking.loads.sine import SineTest, sine_run, sweep_envelope
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.errors import ModelError
from tests.floatframe.durability.shaking.single_mass import ACCELERATION, DISPLACEMENT, FORCE, masses

LEVEL = Level.of([(5.0, 1.0), (100.0, 1.0)])
G = 9.80665


def test_the_transmissibility_of_a_mass():
    run = sine_run(masses([20.0], 0.05), SineTest("s", LEVEL, ("z",)), "z")
    r = run.frequencies / 20.0
    below = (1 - r**2) ** 2 + (0.1 * r) ** 2
    assert_allclose(run.sizes[:, ACCELERATION], G * np.sqrt((1 + (0.1 * r) ** 2) / below), rtol=1e-12)
    omega = 2 * np.pi * 20
    assert_allclose(run.sizes[:, DISPLACEMENT], G / omega**2 / np.sqrt(below), rtol=1e-12)
    # the peak lies at r² = (sqrt(1 + 8 zeta²) - 1)/(4 zeta²)
    z2 = 0.05**2
    top = (np.sqrt(1 + 8 * z2) - 1) / (4 * z2)
    peak = G * np.sqrt((1 + 4 * z2 * top) / ((1 - top) ** 2 + 4 * z2 * top))
    assert_allclose(run.peaks[ACCELERATION], peak, rtol=2e-4)
    assert_allclose(run.static[:, ACCELERATION], G, rtol=1e-5)


def test_two_masses_in_a_row_by_their_matrices():
    k, m, c = np.array([[3e4, -1e4], [-1e4, 1e4]]), np.diag([2.0, 1.0]), np.array([[6.0, -2.0], [-2.0, 2.0]])
    omega2, Phi = np.linalg.eigh(np.diag(1 / np.sqrt(np.diag(m))) @ k @ np.diag(1 / np.sqrt(np.diag(m))))
    Phi = np.diag(1 / np.sqrt(np.diag(m))) @ Phi
    zeta = np.diag(Phi.T @ c @ Phi) / (2 * np.sqrt(omega2))  # proportional to k: no coupling
    participation = Phi.T @ m @ np.ones(2)
    model = masses(np.sqrt(omega2) / (2 * np.pi), zeta, participation)
    run = sine_run(model, SineTest("s", LEVEL, ("z",)), "z")
    for f, force in zip(run.frequencies[::50], run.sizes[::50, FORCE], strict=True):
        w = 2 * np.pi * f
        x = np.linalg.solve(k - w**2 * m + 1j * w * c, -m @ np.ones(2) * G)  # relative to the base
        total = np.ones(2) @ m @ (G - w**2 * x)
        assert_allclose(force, abs(total), rtol=1e-9)


@pytest.mark.parametrize("downward", [False, True])
def test_a_sweep_is_that_of_its_integration_cycle_by_cycle(downward):
    from pyyeti.ode import SolveUnc

    model = masses([12.0, 31.0, 33.0], [0.02, 0.01, 0.01], [1.0, 0.4, 0.7])
    rate, level = 30.0, Level.of([(8.0, 1.0), (20.0, 0.5), (60.0, 2.0)])
    test = SineTest("s", level, ("z",), rate, downward)
    f, w = sweep_envelope(model, 2, test, step=0.0125)  # so that straight lines between its points do no harm
    growth = (-1 if downward else 1) * rate / 60 * np.log(2)
    h, T = 2e-4, np.log(7.5) / abs(growth)
    t = np.arange(0, T, h)
    own = (60.0 if downward else 8.0) * np.exp(growth * t)
    phi = (own - own[0]) * 2 * np.pi / growth
    history = np.exp(1j * phi) * level.at(own) * G
    solver = SolveUnc(np.ones(3), np.diag(model.C), model.omega**2, h)
    first = (
        2 * np.pi * own[0]
    )  # real and imaginary part are two real motions, from the steady state of the first frequency
    start = model.B[2, :, 2] * history[0] / (model.omega**2 - first**2 + 1j * first * np.diag(model.C))
    a = [
        solver.tsolve(np.outer(model.B[2, :, 2], part(history)), d0=part(start), v0=part(1j * first * start)).a
        for part in (np.real, np.imag)
    ]
    second = a[0] + 1j * a[1]
    envelope = np.abs(second[0] + history)
    place = np.log(f / f[0]) / growth
    mine = np.interp(t, place, np.abs(w[:, ACCELERATION]))
    assert_allclose(mine, envelope, rtol=0, atol=2e-3 * envelope.max())


def test_a_slow_sweep_is_steady_and_a_fast_one_is_not():
    model = masses([20.0], 0.02)
    slow = sine_run(model, SineTest("s", LEVEL, ("z",), 0.4), "z")
    assert_allclose(slow.swept_peaks[ACCELERATION], slow.peaks[ACCELERATION], rtol=6e-3)
    fast = sine_run(model, SineTest("s", LEVEL, ("z",), 60.0), "z")
    assert fast.swept_peaks[ACCELERATION] < 0.8 * fast.peaks[ACCELERATION]
    half = sweep_envelope(model, 2, SineTest("s", LEVEL, ("z",), 60.0), step=0.025)[1]
    assert_allclose(np.abs(half[:, ACCELERATION]).max(), fast.swept_peaks[ACCELERATION], rtol=1e-3)


def test_a_slow_sweep_takes_static_modes_as_springs():
    """The displacement has the mode at 80 Hz as a spring, x = -P a / omega²: it adds with the sign of the load."""
    model = masses([20.0, 80.0], [0.02, 0.02], [1.0, 2.0])
    model = replace(model, n_residual=1, E=np.where(np.arange(3)[:, None, None] == 0, 1.0, model.E))
    f, swept = sweep_envelope(model, 2, SineTest("s", Level.of([(1.0, 1.0), (2.0, 1.0)]), ("z",), 0.4), step=0.025)
    w, omega = 2 * np.pi * f, 2 * np.pi * np.array([20.0, 80.0])
    steady = -G / (omega[0] ** 2 - w**2 + 2j * 0.02 * omega[0] * w) - 2 * G / omega[1] ** 2
    assert_allclose(swept[:, DISPLACEMENT], steady, rtol=1e-4, atol=0)


def test_uncertain_frequencies_widen_a_peak_and_factors_raise_it():
    model = masses([20.0], 0.02)
    run = sine_run(model, SineTest("s", LEVEL, ("z",)), "z", Uncertainty(1.2, 0.1))
    inside = (run.frequencies > 18.5) & (run.frequencies < 21.5)
    assert_allclose(run.uncertain[inside, ACCELERATION], 1.2 * run.peaks[ACCELERATION], rtol=1e-9)
    away = run.frequencies > 23
    assert (run.uncertain[away, ACCELERATION] < run.peaks[ACCELERATION]).all()


@pytest.mark.parametrize(
    ("level", "rate", "direction", "words"),
    [
        (Level.of([(5, 1), (50, 1)], "g2/Hz"), None, "z", "that of a random test"),
        (LEVEL, -1.0, "z", "octaves per minute above 0"),
        (LEVEL, None, "w", "no base direction"),
        (LEVEL, None, "rx", "unit g for direction rx"),
        (Level.of([(5, 1), (50, 1)], "rad/s2"), None, "z", "unit rad/s2 for direction z"),
    ],
)
def test_tests_that_make_no_sense_are_refused(level, rate, direction, words):
    with pytest.raises(ModelError, match=words):
        sine_run(masses([20.0], 0.02), SineTest("s", level, (direction,), rate), direction)


def test_an_undamped_mode_in_the_band_is_refused():
    with pytest.raises(ModelError, match=r"mode 1 at 20 Hz lies in the band 5 to 100 Hz and has no damping"):
        sine_run(masses([20.0], 0.0), SineTest("s", LEVEL, ("z",)), "z")


def test_modes_that_respond_statically_need_no_damping():
    model = masses([20.0, 80.0], [0.02, 0.0], [1.0, 0.5])
    test = SineTest("s", LEVEL, ("z",))
    with pytest.raises(ModelError, match="mode 2 at 80 Hz"):
        sine_run(model, test, "z")
    sine_run(replace(model, n_residual=1), test, "z")
    with pytest.raises(ModelError, match=r"mode 1 at 20 Hz .* \(1 such modes\)"):
        sine_run(replace(masses([20.0, 80.0], 0.0, [1.0, 0.5]), n_residual=1), test, "z")
