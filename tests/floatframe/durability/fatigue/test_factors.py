"""Factors by formula against values that others print, at the ends of their ranges, and in a file."""

import pytest
from numpy.testing import assert_allclose

from floatframe.durability.fatigue import assess, read_fatigue
from floatframe.durability.fatigue.fatigue_file import (
    reliability_factor,
    roughness_factor,
    size_factor,
    technological_size_factor,
)
from floatframe.errors import FatigueError
from tests.floatframe.durability.fatigue.examples import FILE


def test_roughness_of_a_machined_steel_is_the_printed_one():
    assert_allclose(roughness_factor(600, 100), 0.79, atol=5e-4)  # printed with two digits beside the formula
    assert roughness_factor(600, 1) == roughness_factor(600, 0) == 1
    assert roughness_factor(1200, 100) < roughness_factor(600, 100) < roughness_factor(600, 10)
    assert roughness_factor(200, 200) == 1  # lg(2 Rm/400) = 0
    assert_allclose(roughness_factor(300, 100, "grey-iron"), 1 - 0.06 * 2 * _lg(6), rtol=1e-14)


@pytest.mark.parametrize(
    ("group", "standard", "at_standard"),
    [("structural-steel", 40, 0.9162), ("quenched-steel", 16, 0.9241), ("normalised-steel", 16, 0.9747),
     ("case-hardened-steel", 11, 0.9360), ("nitrided-steel", 100, 0.8271), ("cast-steel", 100, 0.8703)],
)  # fmt: skip
def test_the_technological_factor_has_the_tabulated_strength_of_its_standard_diameter(group, standard, at_standard):
    """F(d_N) is tabulated; with it K_d(d) F(d_N) = F(d), a straight line over lg d that is 1 at 7.5 mm."""
    assert technological_size_factor(standard, group) == 1
    assert_allclose(technological_size_factor(standard * (1 + 1e-9), group), 1, rtol=1e-8)  # no step
    d = 240.0
    slope = (1 - at_standard) / (_lg(standard) - _lg(7.5))
    digits = 1e-4 * (1 + (_lg(d) - _lg(7.5)) / (_lg(standard) - _lg(7.5)))  # cut off in the table, carried to d
    found = technological_size_factor(d, group) * at_standard
    assert_allclose(found, 1 - slope * (_lg(d) - _lg(7.5)), rtol=0, atol=digits)
    assert technological_size_factor(300, group) == technological_size_factor(250, group)


def _lg(x):
    from math import log10

    return log10(x)


def test_size_and_reliability_are_those_of_the_textbook():
    assert_allclose(size_factor(7.62), 1, rtol=1e-15)
    assert_allclose(size_factor(32), 1.24 * 32**-0.107, rtol=3e-3)  # its rounded form
    assert_allclose(size_factor(51.0001), size_factor(51), rtol=0.02)  # the two branches nearly meet
    table = {0.5: 1, 0.9: 0.897, 0.95: 0.868, 0.99: 0.814, 0.999: 0.753, 0.9999: 0.702, 0.99999: 0.659}
    for survival, k in table.items():
        assert_allclose(reliability_factor(survival), k, atol=6e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: roughness_factor(600, 1e4), "expected 0 to 500 micrometres"),
        (lambda: roughness_factor(6e8, 10), "expected 200 to 3000 MPa of steel, got 6e\\+08; check its unit"),
        (lambda: roughness_factor(600, 10, "stel"), "unknown group 'stel'.*'steel'"),
        (lambda: technological_size_factor(30, "steel"), "unknown group 'steel'"),
        (lambda: technological_size_factor(0, "cast-steel"), "above 0"),
        (lambda: size_factor(0.03), "expected 2.79 to 254 mm"),
        (lambda: reliability_factor(0.3), "expected 0.5 to below 1"),
    ],
)
def test_numbers_out_of_range_are_refused(call, message):
    with pytest.raises(FatigueError, match=message):
        call()


def test_a_file_takes_formulas_beside_numbers(folder):
    """Rm in MPa whatever the unit of the curve; both are named in the notes."""
    text = FILE.format(weld="", places="nodes").replace("survival = 0.9\n", "")
    formulas = """factors = { size = 0.9, surface = { method = "fkm-roughness", roughness = 25, group = "steel" },
    scatter = { method = "shigley-reliability", survival = 0.99 } }"""
    text = text.replace("factors = { size = 0.9 }", formulas.replace("\n   ", "")).replace("25,", "25.0,")
    (folder / "job.toml").write_text(text)
    curve = assess(read_fatigue(folder / "job.toml")).result.curve
    factor = 0.9 * roughness_factor(700, 25) * reliability_factor(0.99)
    assert_allclose(curve.amplitude[0], 1e6 * factor, rtol=1e-12)
    assert any("roughness 25.0, group steel" in note for note in curve.notes)
    in_ksi = text.replace('"MPa"', '"ksi"').replace("= 700", f"= {700 / 6.894757293168361!r}")
    (folder / "job.toml").write_text(in_ksi)
    assert_allclose(assess(read_fatigue(folder / "job.toml")).result.curve.amplitude[0] / 6894757.293168361, factor)
    for old, new, message in (
        ("tensile_strength = 700\n", "", "fkm-roughness needs material.tensile_strength"),
        ("roughness = 25.0, ", "", "roughness is missing"),
        ("roughness = 25.0", "roughness = 25.0, diameter = 3.0", "diameter has no meaning here"),
        ("fkm-roughness", "fkm-rough", "unknown formula"),
        ("size = 0.9", "size = true", "expected a number above 0, or a table"),
        ("[material]", "survival = 0.9\n[material]", "count the scatter twice"),
    ):
        assert old in text
        bad = text.replace(old, new).replace('mean_stress = "goodman"', "")
        (folder / "job.toml").write_text(bad)
        with pytest.raises(FatigueError, match=message):
            read_fatigue(folder / "job.toml")
