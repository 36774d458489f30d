"""Levels: units, straight lines in log-log axes, and bad tables by their lines."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe.durability.shaking.loads.levels import Level, in_model, read_level
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.errors import ModelError


def test_a_level_is_straight_in_log_log_axes_and_ends_at_its_rows():
    level = Level.of([(10, 1.0), (1000, 100.0)])
    assert_allclose(level.at(np.array([5.0, 10.0, 100.0, 1000.0, 1001.0])), [0.0, 1.0, 10.0, 100.0, 0.0], rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "g"),
    [("m-kg-s", 9.80665), ("mm-t-s", 9806.65), ("mm-kg-ms", 9.80665e-3), ("in-slinch-s", 386.0885826771654)],
)
def test_one_g_in_units_of_a_model(name, g):
    level, density = Level.of([(10, 1.0), (20, 1.0)]), Level.of([(10, 1.0), (20, 1.0)], "g2/Hz")
    f, units = np.array([15.0]), unit_system(name)
    assert_allclose(level.in_si(f) * in_model(level, "z", units), g, rtol=1e-12)
    assert_allclose(density.in_si(f) * in_model(density, "z", units), g**2, rtol=1e-12)


def test_other_units_are_the_same_level():
    f = np.array([15.0])
    for value, unit in ((9.80665, "m/s2"), (9806.65, "mm/s²"), (9.80665e3 / (2 * np.pi * 15) ** 2, "mm")):
        table = [(14.999999, value), (15.000001, value)]
        assert_allclose(Level.of(table, unit).in_si(f), 9.80665, rtol=1e-6)
    assert_allclose(Level.of([(1, 9.80665**2), (20, 9.80665**2)], "(m/s2)2/Hz").in_si(f), 9.80665**2, rtol=1e-12)


@pytest.mark.parametrize(
    ("rows", "unit", "words"),
    [
        ([(10, 1.0), (20, 0.0)], "g2/Hz", r"row 2: 0 g2/Hz at 20 Hz: expected a level above 0"),
        ([(10, 1.0), (20, -1.0)], "g2/Hz", r"row 2: -1 g2/Hz"),
        ([(10, 1.0), (30, 1.0), (20, 1.0)], "g", r"row 3: 20 Hz after 30 Hz: expected increasing frequencies"),
        ([(10, 1.0), (10, 2.0)], "g", r"row 2: 10 Hz after 10 Hz"),
        ([(0, 1.0), (10, 2.0)], "g", r"row 1: frequency 0 Hz"),
        ([(10, float("nan")), (20, 2.0)], "g", r"row 1: nan"),
        ([(10, 1.0)], "g", r"2 rows"),
        ([(10, 1.0, 3.0), (20, 1.0)], "g", r"row 1: expected two numbers"),
        ([(10, 1.0), (20, 1.0)], "G", r"unknown unit"),
        ([(10, 1.0), (20, 1.0)], "m/s", r"unknown unit"),
        ([(10, 1.0), (20, 1.0)], "g/Hz", r"g2/Hz"),
    ],
)
def test_bad_tables_are_refused_with_their_row(rows, unit, words):
    with pytest.raises(ModelError, match=words):
        Level.of(rows, unit, "random.qual: level")


def test_bad_files_are_refused_with_their_line(tmp_path):
    path = tmp_path / "level.csv"
    path.write_text("Hz, g2/Hz\n# a remark\n20, 0.01\n\n10; 0.01\n")
    with pytest.raises(ModelError, match=r"level.csv, line 5: 10 Hz after 20 Hz"):
        read_level(path, "g2/Hz", "level")
    path.write_text("20 0.01\n30 x\n")
    with pytest.raises(ModelError, match="line 2: expected two numbers"):
        read_level(path, "g2/Hz", "level")
    path.write_text("20 0.01\n30\t0.02 # end\n")
    assert_allclose(read_level(path, "g2/Hz", "level").values, [0.01, 0.02])
    path.write_text("20 0.01\n30 inf\n")
    with pytest.raises(ModelError, match="line 2: expected finite numbers"):
        read_level(path, "g2/Hz", "level")
    path.write_text("# nothing\n")
    with pytest.raises(ModelError, match="expected lines of two numbers, Hz and g2/Hz, got none"):
        read_level(path, "g2/Hz", "level")
    with pytest.raises(ModelError, match="cannot be read"):
        read_level(tmp_path / "none.csv", "g2/Hz", "level")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"factor": 0.9}, "1 or more"),
        ({"frequency": 0.6}, "between 0 and 0.5"),
        ({"bands": [(10, 5, 1, 0)]}, "from Hz, to Hz"),
    ],
)
def test_uncertainties_that_make_no_sense_are_refused(given, words):
    with pytest.raises(ModelError, match=words):
        Uncertainty(**given)


def test_uncertainty_by_band():
    f = np.array([10.0, 20.0, 40.0])
    factor, share = Uncertainty(1.1, 0.0, [(15, 30, 1.5, 0.1)]).of(f)
    assert_allclose(factor, [1.1, 1.5, 1.1])
    assert_allclose(share, [0.0, 0.1, 0.0])


@pytest.mark.parametrize(("name", "second"), [("m-kg-s", 1.0), ("mm-t-s", 1.0), ("mm-kg-ms", 1e3)])
def test_one_radian_per_second_squared_in_units_of_a_model(name, second):
    """1 rad/s² is 1e-6 rad/ms², whatever the unit of length; a density has the square."""
    level, density = (Level.of([(10, 3.0), (20, 3.0)], unit) for unit in ("rad/s2", "(rad/s2)2/Hz"))
    f, units = np.array([15.0]), unit_system(name)
    assert_allclose(level.in_si(f) * in_model(level, "ry", units), 3.0 / second**2, rtol=1e-12)
    assert_allclose(density.in_si(f) * in_model(density, "ry", units), 3.0 / second**4, rtol=1e-12)
