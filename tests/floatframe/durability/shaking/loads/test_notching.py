"""Notches keep their limits, are no deeper than needed, and name their reason."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.shaking.loads.levels import Level
from floatframe.durability.shaking.loads.notching import ForceLimit, ResponseLimit, notched_random, notched_sine
from floatframe.durability.shaking.loads.random_vibration import RandomTest, random_runs
from floatframe.durability.shaking.loads.sine import SineTest, sine_run
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.errors import ModelError
from tests.floatframe.durability.shaking.single_mass import ACCELERATION, FORCE, masses

G = 9.80665
MODEL = masses([20.0, 60.0], 0.02, [1.0, 0.5])
SINE = sine_run(MODEL, SineTest("s", Level.of([(5, 1.0), (100, 1.0)]), ("z",)), "z")
RANDOM = random_runs(MODEL, RandomTest("r", Level.of([(5, 0.01), (200, 0.01)], "g2/Hz"), ("z",)))[0]


def test_a_response_limit_is_kept_and_met_within_its_notch():
    found = notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", 5.0)])
    assert found.sizes[:, ACCELERATION].max() <= 5 * G * (1 + 1e-12)
    assert (found.notched <= SINE.level * (1 + 1e-12)).all()
    inside = found.notched < SINE.level * (1 - 1e-9)
    assert_allclose(found.sizes[inside, ACCELERATION], 5 * G, rtol=1e-12)
    notch = found.notches[0]
    assert notch.first < 20 < notch.last
    assert_allclose(notch.depth, 20 * np.log10(SINE.peaks[ACCELERATION] / (5 * G)), rtol=1e-9)
    assert notch.reason == "limit of mass acceleration z"


def test_a_factor_on_the_response_is_that_much_less_of_the_limit():
    found = notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", 5.0, factor=1.25)])
    same = notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", 4.0)])
    assert_allclose(found.notched, same.notched, rtol=1e-12)
    in_density = notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", 5.0, factor=1.25)])
    assert_allclose(
        in_density.notched, notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", 3.2)]).notched
    )


def test_the_limit_that_allows_least_is_the_reason():
    limits = [
        ResponseLimit("mass acceleration z", 5.0, name="mirror"),
        ResponseLimit("base force z", 12.0, name="adapter"),
    ]
    found = notched_sine(MODEL, SINE, limits)
    reasons = {notch.reason for notch in found.notches if notch.first < 60 < notch.last}
    assert reasons == {"adapter"}
    assert (found.sizes[:, FORCE] <= 12.0 * (1 + 1e-12)).all()
    assert (found.sizes[:, ACCELERATION] <= 5 * G * (1 + 1e-12)).all()


def test_an_uncertain_response_makes_a_deeper_and_wider_notch():
    level = SineTest("s", Level.of([(5, 1.0), (100, 1.0)]), ("z",))
    doubtful = Uncertainty(1.25, 0.05)
    run = sine_run(MODEL, level, "z", doubtful)
    found = notched_sine(MODEL, run, [ResponseLimit("mass acceleration z", 5.0)])
    plain = notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", 5.0)])
    assert_allclose(found.notches[0].depth - plain.notches[0].depth, 20 * np.log10(1.25), rtol=1e-9)
    assert found.notches[0].last > plain.notches[0].last


def test_a_force_limit_is_the_semi_empirical_one():
    found = notched_random(MODEL, RANDOM, [ForceLimit("base force z", 1.5, exponent=2.0)])
    f = found.frequencies
    allowed = 1.5**2 * 1.25**2 * RANDOM.level[:, 0] * np.where(f < 20, 1, (20 / f) ** 2)
    assert_allclose(found.limits["force limit of base force z"], allowed, rtol=1e-9)
    assert_allclose(found.sizes[:, FORCE], np.minimum(RANDOM.density[:, FORCE], allowed), rtol=1e-9)
    sine = notched_sine(MODEL, SINE, [ForceLimit("base force z", 1.5, frequency=30.0, exponent=2.0, mass=1.0)])
    f = sine.frequencies
    assert_allclose(sine.limits["force limit of base force z"], 1.5 * G * np.where(f < 30, 1, 30 / f), rtol=1e-9)


def test_an_rms_is_met_by_clipping():
    wanted = 0.6 * RANDOM.rms[ACCELERATION] / G
    found = notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", rms=wanted)])
    assert_allclose(found.rms[ACCELERATION], wanted * G, rtol=1e-9)
    clipped = found.sizes[:, ACCELERATION]
    assert_allclose(clipped[found.notched < found.level * 0.999], clipped.max(), rtol=1e-9)
    kept = notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", rms=2 * RANDOM.rms[ACCELERATION] / G)])
    assert kept.notches == ()


def test_a_notch_names_the_output_that_there_would_be_without_it():
    """Amplitudes or densities of the run, at the frequency of the largest depth, and their ratio to the limit in dB."""
    sine = notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", 5.0)])
    density = notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", 0.02)])
    for found, own, tenfold, limit in (
        (sine, SINE.sizes, 20, 5 * G), (density, RANDOM.density, 10, 0.02 * G**2)
    ):  # fmt: skip
        notch = found.notches[0]
        at = np.flatnonzero(found.frequencies == notch.deepest)
        assert_allclose(notch.unnotched, np.abs(own[at, ACCELERATION]), rtol=1e-12)
        assert_allclose(notch.limit, limit, rtol=1e-12)
        assert_allclose(notch.depth, tenfold * np.log10(notch.unnotched / limit), rtol=1e-9)


def test_a_density_limit_in_g_is_one_of_the_density():
    found = notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", 0.02)])
    assert_allclose(found.sizes[:, ACCELERATION].max(), 0.02 * G**2, rtol=1e-12)
    table = Level.of([(10, 0.02), (40, 0.02)], "g2/Hz")
    same = notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", table=table)])
    inside = (same.frequencies > 10) & (same.frequencies < 40)
    assert_allclose(same.notched[inside], found.notched[inside], rtol=1e-9)


@pytest.mark.parametrize("units", ["mm-kg-ms", "in-slinch-s"])
def test_a_table_of_accelerations_is_in_its_own_unit_and_a_load_in_that_of_the_output(units):
    model = masses([20.0, 60.0], 0.02, [1.0, 0.5], units)
    run = sine_run(model, SineTest("s", Level.of([(5, 1.0), (100, 1.0)]), ("z",)), "z")
    rows = [(5, 5.0), (100, 5.0)]
    in_g = notched_sine(model, run, [ResponseLimit("mass acceleration z", table=Level.of(rows, "g"))])
    assert_allclose(in_g.sizes[:, ACCELERATION].max(), 5 * model.gravity, rtol=1e-12)
    for unit, one_g in (("m/s2", G), ("in/s2", G / 0.0254), ("output", 1.0)):
        table = Level.of([(f, one_g * value) for f, value in rows], unit)
        found = notched_sine(model, run, [ResponseLimit("mass acceleration z", table=table)])
        assert_allclose(found.notched, in_g.notched, rtol=1e-12)
    load = Level.of([(5, 0.4 * run.peaks[FORCE]), (100, 0.4 * run.peaks[FORCE])], "output")
    assert_allclose(notched_sine(model, run, [ResponseLimit("base force z", table=load)]).sizes[:, FORCE].max(),
                    0.4 * run.peaks[FORCE], rtol=1e-12)  # fmt: skip


DENSITY, IN_SI = Level.of([(5, 1.0), (100, 1.0)], "g2/Hz"), Level.of([(5, 1.0), (100, 1.0)], "m/s2")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", table=DENSITY)]), "an amplitude of"),
        (lambda: notched_random(MODEL, RANDOM, [ResponseLimit("mass acceleration z", table=IN_SI)]), "a density of"),
        (lambda: notched_sine(MODEL, SINE, [ResponseLimit("base force z", table=IN_SI)]), "in the unit of the output"),
        (
            lambda: notched_sine(MODEL, SINE, [ResponseLimit("mass acceleration z", 1e-3)]),
            r"requires a notch of [\d.]+ dB",
        ),
        (lambda: notched_sine(MODEL, SINE, [ResponseLimit("mass acc z", 1.0)]), "mass acceleration z"),
        (lambda: notched_sine(MODEL, SINE, [ResponseLimit("base force z", rms=1.0)]), "limit of random tests"),
        (lambda: ResponseLimit("base force z", 0.0), "no input satisfies a limit"),
        (lambda: ResponseLimit("base force z"), "one of level, table, rms"),
        (lambda: ForceLimit("base force z", -1.0), "above 0"),
    ],
)
def test_notches_that_are_impossible_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


def test_uncertainty_deepens_notches_of_random_tests():
    """The factor alone takes 20 log10 of it from a density, and the rms with the factor is the one that is allowed."""
    level = RandomTest("r", Level.of([(5, 0.01), (100, 0.01)], "g2/Hz"), ("z",))
    doubtful = random_runs(MODEL, level, Uncertainty(1.5))[0]
    plain = random_runs(MODEL, level)[0]
    limit = [ResponseLimit("mass acceleration z", 0.02)]
    found, nominal = (notched_random(MODEL, run, limit).notches[0] for run in (doubtful, plain))
    assert_allclose(found.depth - nominal.depth, 20 * np.log10(1.5), rtol=1e-9)
    wanted = 0.5 * plain.rms[ACCELERATION] / G
    kept = notched_random(MODEL, doubtful, [ResponseLimit("mass acceleration z", rms=wanted)])
    assert_allclose(1.5 * kept.rms[ACCELERATION] / G, wanted, rtol=1e-6)
