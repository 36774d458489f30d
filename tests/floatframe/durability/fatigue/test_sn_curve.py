"""S-N curves and mean stress by hand and by another program."""

import math

import fatpack
import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.durability.fatigue.kernels.cycle_kernels import cycle_rule, equivalent_amplitude
from floatframe.durability.fatigue.mean_stress import MeanStress
from floatframe.durability.fatigue.sn_curve import basquin_curve, table_curve
from floatframe.errors import FatigueError


@pytest.mark.parametrize(("below", "life"), [("limit", math.inf), ("elementary", 32e6), ("haibach", 512e6)])
def test_below_the_knee(below, life):
    """Half the amplitude of the knee at 1e6 cycles, k = 5: never, 2^5, 2^9 times as many."""
    curve = basquin_curve(100.0, 1e6, 5, below=below)
    assert_allclose(curve.life([200.0, 100.0, 50.0]), [1e6 / 32, 1e6, life], rtol=1e-12)


def test_two_slopes_are_those_of_another_program():
    """fatpack takes ranges."""
    theirs = fatpack.BiLinearEnduranceCurve(120.0)
    theirs.Nc, theirs.Nd, theirs.m1, theirs.m2 = 2e6, 1e7, 3.0, 5.0
    S_d = 120.0 * (2e6 / 1e7) ** (1 / 3)
    curve = basquin_curve(S_d / 2, 1e7, 3, second_slope=5, least_cycles=1)
    ranges = np.array([300.0, 130.0, 80.0, 40.0])
    assert_allclose(curve.life(ranges / 2), theirs.get_endurance(ranges), rtol=1e-12)


def test_a_table_passes_through_its_points():
    N, S = [1e4, 1e5, 1e6, 1e7], [400.0, 250.0, 180.0, 150.0]
    curve = table_curve(N, S, below="limit")
    assert_allclose(curve.life(S), N, rtol=1e-12)
    assert curve.life(149.9) == math.inf
    assert_allclose(np.log(curve.life(math.sqrt(250 * 180))), 0.5 * (math.log(1e5) + math.log(1e6)), rtol=1e-12)
    assert table_curve(N, S).life(100.0) < math.inf


def test_survival_moves_the_curve_by_quantiles():
    """97.72 % are two standard deviations of log N."""
    curve = basquin_curve(100.0, 1e6, 5).for_survival(0.9772498680518208, deviation=0.2)
    assert_allclose(curve.life(100.0), 1e6 * 10**-0.4, rtol=1e-9)
    assert_allclose(basquin_curve(100.0, 1e6, 5).scaled(0.5, "surface").life(50.0), 1e6, rtol=1e-12)


@pytest.mark.parametrize(
    ("mean_stress", "S_a", "S_m", "expected"),
    [
        (MeanStress(), 100, 50, 100),
        (MeanStress("goodman", 500.0), 100, 50, 100 / 0.9),
        (MeanStress("goodman", 500.0), 100, -50, 100),
        (MeanStress("goodman", 500.0, credit_compression=True), 100, -50, 100 / 1.1),
        (MeanStress("goodman", 500.0), 100, 500, math.inf),
        (MeanStress("soderberg", 250.0), 100, 50, 125),
        (MeanStress("morrow", 1000.0), 95, 50, 100),
        (MeanStress("gerber", 500.0), 96, 100, 100),
        (MeanStress("gerber", 500.0), 96, -100, 96),
        (MeanStress("swt"), 50, 150, 100),
        (MeanStress("swt"), 50, -60, 0),
        (MeanStress("walker", 0.5), 50, 150, 100),
        (MeanStress("walker", 1.0), 50, 150, 50),
        (MeanStress("fkm", 0.3), 100, -200, 70),
        (MeanStress("fkm", 0.3), 100, -100, 70),
        (MeanStress("fkm", 0.3), 100, 50, 115),
        (MeanStress("fkm", 0.3), 100, 100, 130),
        (MeanStress("fkm", 0.3), 100, 200, 130 * 1.2 / 1.1),
        (MeanStress("fkm", 0.3), 100, 300, 130 * 1.3 / 1.1),
        (MeanStress("fkm", 0.3), 100, 900, 130 * 1.3 / 1.1),
    ],
)
def test_mean_stress_by_hand(mean_stress, S_a, S_m, expected):
    rule = cycle_rule(basquin_curve(100.0, 1e6, 5), mean_stress)
    assert_allclose(equivalent_amplitude(rule, float(S_a), float(S_m)), expected, rtol=1e-12)


@pytest.mark.parametrize("name", ["goodman", "swt", "walker", "morrow"])
def test_mean_stress_is_that_of_another_program(name):
    """fatpack takes and gives ranges."""
    theirs = {
        "goodman": lambda a, m: fatpack.find_goodman_equivalent_stress(a, m, 500.0),
        "morrow": lambda a, m: fatpack.find_morrow_equivalent_stress(a, m, 500.0),
        "swt": fatpack.find_swt_equivalent_stress,
        "walker": lambda a, m: fatpack.find_walker_equivalent_stress(a, m, 0.6),
    }[name]
    value = {"goodman": 500.0, "morrow": 500.0, "walker": 0.6}.get(name, 0.0)
    rule = cycle_rule(basquin_curve(100.0, 1e6, 5), MeanStress(name, value))
    for a, m in ((80.0, 30.0), (20.0, 150.0)):
        assert_allclose(equivalent_amplitude(rule, a, m), theirs(np.array([2 * a]), np.array([m])) / 2, rtol=1e-12)


@pytest.mark.parametrize("R", [0.0, 0.1, -0.5])
@pytest.mark.parametrize(
    "mean_stress",
    [MeanStress("goodman", 600.0), MeanStress("gerber", 600.0), MeanStress("swt"), MeanStress("walker", 0.4),
     MeanStress("fkm", 0.25), MeanStress("soderberg", 500.0)],
    ids=lambda each: each.name,
)  # fmt: skip
def test_cycles_at_the_ratio_of_the_curve_are_its_own(mean_stress, R):
    """A curve measured at R gives back its amplitudes for cycles at R, whatever the law."""
    rule = cycle_rule(basquin_curve(100.0, 1e6, 5, stress_ratio=R), mean_stress)
    for S in (20.0, 90.0, 160.0):
        assert_allclose(equivalent_amplitude(rule, S, S * (1 + R) / (1 - R)), S, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: table_curve([1e4, 1e5, 1e5], [300, 200, 100]), "point 3: expected more cycles at a smaller amplitude"),
        (lambda: table_curve([1e4, 1e5], [200, 300]), "point 2"),
        (lambda: table_curve([1e4, 1e5], [300, -1]), "above 0"),
        (lambda: table_curve([1e4], [300]), "two points or more"),
        (lambda: table_curve([1e4, 1.1e4], [300, 200]), "slope k = 0.235"),
        (lambda: basquin_curve(0.0, 1e6, 5), "amplitude: expected a number above 0"),
        (lambda: basquin_curve(100, 1e6, 0.5), "slope: expected k of 1 or more"),
        (lambda: basquin_curve(100, 1e6, 5, second_slope=4), "second_slope: expected at least the slope 5"),
        (lambda: basquin_curve(100, 1e6, 5, below="miner"), "below: unknown"),
        (lambda: basquin_curve(100, 1e6, 5, stress_ratio=1.0), "stress ratio"),
        (lambda: basquin_curve(100, 1e6, 5).for_survival(1.0, deviation=0.1), "between 0 and 1"),
        (lambda: basquin_curve(100, 1e6, 5).scaled(0.0, "size"), "size: expected a factor above 0"),
        (lambda: MeanStress("goodman", 0.0), "tensile strength above 0, got 0; give tensile_strength"),
        (lambda: MeanStress("goodmann", 1.0), "did you mean 'goodman'"),
        (lambda: MeanStress("fkm", 1.2), "sensitivity M"),
        (lambda: MeanStress("swt", credit_compression=True), "credit_compression is for"),
    ],
)
def test_bad_curves_are_refused(make, words):
    with pytest.raises(FatigueError, match=words.replace("(", r"\(")):
        make()
