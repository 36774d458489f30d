"""Random tests: Miles' equation, pyYeti on the same matrices, cross spectra, and von Mises of a whole field."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.shaking.loads.levels import Level, level_rms
from floatframe.durability.shaking.loads.random_vibration import CrossSpectrum, RandomTest, random_run, random_runs
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.structure.model import Output
from floatframe.errors import ModelError
from tests.floatframe.durability.shaking.single_mass import ACCELERATION, DISPLACEMENT, FORCE, masses

G = 9.80665
WHITE = Level.of([(1e-2, 0.04), (1e5, 0.04)], "g2/Hz")


@pytest.mark.parametrize("Q", [5.0, 25.0, 500.0])
def test_white_noise_on_a_mass_has_the_rms_of_miles(Q):
    run = random_runs(masses([50.0], 1 / (2 * Q)), RandomTest("r", WHITE, ("z",)))[0]
    zeta = 1 / (2 * Q)
    # int |H|² df = pi f Q/2 (1 + 4 zeta²) over all frequencies; Miles leaves the bracket out
    exact = np.sqrt(np.pi / 2 * 50.0 * Q * 0.04 * (1 + 4 * zeta**2))
    assert_allclose(run.rms[ACCELERATION] / G, exact, rtol=2e-5)
    assert_allclose(run.miles[0].grms * np.sqrt(1 + 4 * zeta**2), exact, rtol=1e-12)
    omega = 2 * np.pi * 50
    assert_allclose(run.rms[DISPLACEMENT], G / omega**2 * np.sqrt(0.04 * np.pi * 50.0 / (4 * zeta)), rtol=1e-4)
    assert_allclose(run.crossings[DISPLACEMENT], 50.0, rtol=1e-2)
    assert run.error.max() < 1e-4


@pytest.mark.parametrize("units", ["m-kg-s", "mm-kg-ms"])
def test_estimates_of_miles_are_those_of_each_mode_in_the_band_with_its_share_of_the_mass(units):
    P, f, zeta = np.array([1.5, -0.4, 0.7, 2.0]), np.array([45.0, 80.0, 300.0, 3000.0]), [0.02, 0.01, 0.03, 0.05]
    level = Level.of([(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)], "g2/Hz")
    found = random_runs(masses(f, zeta, P, units), RandomTest("r", level, ("z",)))[0].miles
    assert [each.mode for each in found] == [1, 2, 3]  # the last lies above the band
    for k, each in enumerate(found):
        Q = 1 / (2 * zeta[k])
        density = level.at(f[k : k + 1])[0]
        expected = [f[k], Q, density, np.sqrt(np.pi / 2 * f[k] * Q * density), P[k] ** 2 / (P @ P)]
        own = [each.frequency, each.Q, each.density, each.grms, each.share]
        assert_allclose(own, expected, rtol=1e-9)


def test_densities_and_rms_are_those_of_pyyeti():
    from pyyeti import ode

    level = Level.of([(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)], "g2/Hz")
    model = masses([45.0, 47.0, 300.0], [0.02, 0.01, 0.03], [1.0, 0.4, 0.7])
    run = random_runs(model, RandomTest("r", level, ("z",)))[0]
    solver = ode.SolveUnc(np.ones(3), np.diag(model.C), model.omega**2)

    def theirs(f):
        rows = [[model.E[2], None, model.E[0], model.D[2][:, [2]]]]
        return ode.solvepsd(solver, (level.at(f) * G**2)[None], model.B[2][:, [2]], f, rows)

    assert_allclose(run.density, np.asarray(theirs(run.band.frequencies)[1][0]).T, rtol=1e-9)
    fine = np.unique(np.concatenate([np.geomspace(20, 2000, 100_001), np.linspace(40, 52, 50_001)]))
    assert_allclose(run.rms, np.asarray(theirs(fine)[0][0]), rtol=1e-6)  # by trapezia


def test_the_rms_of_a_level_is_that_of_its_straight_lines():
    level = Level.of([(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)], "g2/Hz")
    f = np.geomspace(20, 2000, 200_001)
    assert_allclose(level_rms(level), np.sqrt(np.trapezoid(level.at(f), f)), rtol=1e-7)
    assert_allclose(level_rms(Level.of([(10, 1.0), (100, 0.1)], "g2/Hz")), np.sqrt(10 * np.log(10)), rtol=1e-12)


def two_bases():
    """The first mass moved by two inputs: H_1 by x, H_2 = -H_1 by z."""
    model = masses([50.0], 0.02)
    B, D = np.array(model.B), np.array(model.D)
    B[2, :, 0], D[:, :, 0] = -B[2, :, 2], -D[:, :, 2]
    return replace(model, B=B, D=D, mass=np.eye(6))


@pytest.mark.parametrize(
    ("coherence", "phase", "power"),
    [(0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (1.0, 180.0, 4.0), (0.25, 0.0, 1.0), (1.0, 90.0, 2.0)],
)
def test_cross_spectra_add_by_coherence_and_phase(coherence, phase, power):
    level = Level.of([(20, 0.01), (200, 0.01)], "g2/Hz")
    alone = random_runs(masses([50.0], 0.02), RandomTest("r", level, ("z",)))[0]
    cross = [CrossSpectrum("x", "z", coherence, phase)]
    both = random_runs(two_bases(), RandomTest("r", levels={"x": level, "z": level}, cross=cross))[0]
    assert_allclose(both.rms**2, power * alone.rms**2, rtol=1e-9, atol=1e-9 * alone.rms.max() ** 2)


def test_a_positive_phase_puts_the_first_input_ahead():
    level = Level.of([(20, 0.01), (200, 0.01)], "g2/Hz")
    model = masses([50.0], 0.02)
    D = np.array(model.D)
    D[2, ACCELERATION, 0] = 1.0  # x is felt at once
    model = replace(model, D=D, mass=np.eye(6))
    cross = [CrossSpectrum("z", "x", 1.0, 40.0)]
    run = random_runs(model, RandomTest("r", levels={"z": level, "x": level}, cross=cross))[0]
    H = run.transfer[:, ACCELERATION, 0]  # of z = exp(i (omega t + 40 degrees)), beside x = exp(i omega t)
    assert_allclose(
        run.density[:, ACCELERATION], 0.01 * G**2 * np.abs(H * np.exp(1j * np.radians(40)) + 1) ** 2, rtol=1e-9
    )


def test_contradicting_coherences_are_refused():
    level = Level.of([(20, 0.01), (200, 0.01)], "g2/Hz")
    cross = [CrossSpectrum(*pair, 1.0, phase) for pair, phase in ((("x", "y"), 0), (("y", "z"), 0), (("x", "z"), 90))]
    with pytest.raises(ModelError, match="contradict each other"):
        random_runs(two_bases(), RandomTest("r", levels=dict.fromkeys("xyz", level), cross=cross))


def test_von_mises_of_a_field_is_that_of_its_outputs():
    model = masses([45.0, 47.0, 300.0], [0.02, 0.01, 0.03], [1.0, 0.4, 0.7])
    stress = np.random.default_rng(0).normal(size=(7, 6, 3))
    E, D = np.zeros((3, 9, 3)), np.zeros((3, 9, 6))
    E[:, :3], D[:, :3] = model.E, model.D
    E[0, 3:] = stress[4]
    names = tuple(Output(f"p stress {c}", "stress", "Pa", "p stress") for c in ("xx", "yy", "zz", "yz", "xz", "xy"))
    model = replace(
        model,
        E=E,
        D=D,
        outputs=(*model.outputs, *names),
        field=(stress, np.zeros((7, 6, 6))),
        field_labels=tuple("abcdefg"),
    )
    run = random_runs(model, RandomTest("r", Level.of([(20, 0.01), (500, 0.01)], "g2/Hz"), ("z",)))[0]
    assert_allclose(run.field[4], run.rms[-1], rtol=1e-10)
    assert_allclose(run.von_mises["p stress"].rms, run.rms[-1], rtol=1e-10)
    assert run.outputs[-1].kind == "von Mises"


def test_uncertainty_stands_beside_the_nominal_rms():
    run = random_run(masses([50.0], 0.02), RandomTest("r", WHITE), {"z": WHITE}, Uncertainty(1.5))
    assert_allclose(run.uncertain, 1.5 * run.rms, rtol=1e-9)
    wide = random_run(masses([50.0], 0.02), RandomTest("r", WHITE), {"z": WHITE}, Uncertainty(frequency=0.05))
    assert (wide.uncertain[[ACCELERATION, FORCE]] > 1.3 * wide.rms[[ACCELERATION, FORCE]]).all()


def test_uncertainty_is_the_same_of_one_input_and_of_two_that_act_as_one():
    level = Level.of([(20, 0.01), (200, 0.01)], "g2/Hz")
    doubtful = Uncertainty(1.5, 0.05)
    alone = random_runs(masses([50.0], 0.02), RandomTest("r", level, ("z",)), doubtful)[0]
    cross = [CrossSpectrum("x", "z", 1.0, 180.0)]
    both = random_runs(two_bases(), RandomTest("r", levels={"x": level, "z": level}, cross=cross), doubtful)[0]
    assert_allclose(both.uncertain, 2.0 * alone.uncertain, rtol=1e-9)  # opposite signs of both bases add


def test_the_largest_to_expect_is_that_of_simulated_noise():
    # band-limited noise from 40 to 60 Hz seen through a stiff mass: Gaussian with nu = 50.3 Hz
    level = Level.of([(40, 1.0), (60, 1.0)], "g2/Hz")
    run = random_runs(masses([5e3], 0.02), RandomTest("r", level, ("z",), duration=20.0))[0]
    rng, f = np.random.default_rng(0), np.arange(40, 60, 1 / 20.0)
    t = np.arange(0, 20, 1 / 500)
    largest, waves = [], np.exp(2j * np.pi * np.outer(t, f))
    for _ in range(30):
        c = rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))
        largest.append((waves @ c).real.max() * np.sqrt(1 / 20.0))
    assert_allclose(run.expected[ACCELERATION] / G, np.mean(largest), rtol=0.04)
    assert_allclose(run.crossings[ACCELERATION], np.sqrt((60**3 - 40**3) / 3 / 20), rtol=1e-3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "either level"),
        ({"level": Level.of([(5, 1), (9, 1)])}, "expected the unit of a density"),
        ({"level": WHITE, "cross": [CrossSpectrum("x", "y", 0.5)]}, "inputs that act at once"),
        ({"levels": {"x": WHITE}, "cross": [CrossSpectrum("x", "y", 1.5)]}, "expected 0 to 1"),
        ({"level": WHITE, "duration": 0.0}, "seconds above 0"),
    ],
)
def test_tests_that_make_no_sense_are_refused(given, words):
    with pytest.raises(ModelError, match=words):
        RandomTest("r", **given)


@pytest.mark.parametrize(
    ("units", "g", "radian"),
    [("m-kg-s", G, 1.0), ("mm-t-s", 1e3 * G, 1.0), ("mm-kg-ms", 1e-3 * G, 1e-6), ("in-slinch-s", G / 0.0254, 1.0)],
)
def test_the_rms_of_an_input_is_in_units_of_the_model(units, g, radian):
    """White noise W over the band b has the rms sqrt(W b)."""
    levels = {
        "base:z": Level.of([(20, 0.04), (420, 0.04)], "g2/Hz"),
        "base:x": Level.of([(20, 9.0), (120, 9.0)], "(m/s2)2/Hz"),
        "base:ry": Level.of([(20, 0.25), (120, 0.25)], "(rad/s2)2/Hz"),
    }
    run = random_runs(masses([50.0], 0.02, units=units), RandomTest("r", levels=levels))[0]
    found = dict(zip(run.inputs, run.input_rms, strict=True))
    assert_allclose(found["base:z"], 4.0 * g, rtol=1e-12)
    assert_allclose(found["base:x"], 30.0 * g / G, rtol=1e-12)
    assert_allclose(found["base:ry"], 5.0 * radian, rtol=1e-12)
