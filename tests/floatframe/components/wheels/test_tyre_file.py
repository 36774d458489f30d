"""Tyre property files: what is read, converted, refused."""

from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from floatframe.components import wheels
from floatframe.components.wheels.tyre_file import tyre_from_text
from floatframe.errors import ModelError

TEXT = wheels.shipped_tyre("passenger_car_61").read_text()


def changed(old, new, text=TEXT):
    assert old in text
    return tyre_from_text(text.replace(old, new, 1), "tyre file x.tir")


def test_a_shipped_file_is_read():
    tyre = wheels.read_tyre_file(wheels.shipped_tyre("passenger_car_61"))
    assert (tyre.version, tyre.radius, tyre.load, tyre.side, tyre.is_combined) == (61, 0.32, 4000, "left", True)
    assert tyre.coefficients["PKY1"] == -16
    assert tyre.ranges["pressure"] == (150e3, 300e3)
    assert tyre.carcass == (3.6e5, 1.1e5)
    assert tyre.pressure == 220e3


def test_numbers_with_units_are_converted():
    text = TEXT.replace("'meter'", "'mm'").replace("'newton'", "'kilonewton'")
    text = text.replace("TIME   = 'second'", "TIME = 'second'\nPRESSURE = 'bar'")
    for key, value in {
        "UNLOADED_RADIUS = 0.32": "UNLOADED_RADIUS = 320",
        "FNOMIN = 4000": "FNOMIN = 4",
        "VERTICAL_STIFFNESS = 210000": "VERTICAL_STIFFNESS = 0.21",
        "LONGVL   = 16.7": "LONGVL = 16700",
        "NOMPRES  = 220000": "NOMPRES = 2.2",
        "FZMAX = 9000": "FZMAX = 9",
        "FZMIN = 100": "FZMIN = 0.1",
    }.items():
        assert key in text, key
        text = text.replace(key, value)
    tyre = tyre_from_text(text, "x")
    assert_allclose([tyre.radius, tyre.load, tyre.stiffness, tyre.speed], [0.32, 4000, 2.1e5, 16.7], rtol=1e-12)
    assert_allclose([tyre.nominal_pressure, *tyre.ranges["load"]], [220e3, 100, 9000], rtol=1e-12)


def test_exponents_of_fortran_and_comments_are_read():
    assert changed("PCX1 = 1.58", "PCX1 = 0.158D+01 $ shape").coefficients["PCX1"] == 1.58


def test_what_is_missing_or_left_out_is_said():
    tyre = changed("PCX1 = 1.58", "PCX1 = 1.58\nQFCX = 0.1\nPDXP1 = 0.4")
    assert any("vertical deflection by longitudinal force (QFCX)" in note for note in tyre.notes)
    assert any("turn slip (PDXP1)" in note for note in tyre.notes)
    assert "PEX1" in changed("PEX1 = 0.11\n", "").notes[0]


def test_the_version_can_be_said():
    text = TEXT.replace("FITTYP   = 61", "FITTYP = 5")
    with pytest.raises(ModelError, match=r'FITTYP = 5 is unknown .*give version = "5\.2"'):
        tyre_from_text(text, "x")
    assert tyre_from_text(text, "x", version="5.2").version == 52
    assert changed("FITTYP   = 61", "PROPERTY_FILE_FORMAT = 'PAC2002'").version == 52


def test_coefficients_of_the_other_version_are_unused_and_named():
    tyre = changed("FITTYP   = 61", "FITTYP = 6")
    assert tyre.coefficients["PKY4"] == 2.0
    assert tyre.coefficients["PPY1"] == 0
    assert any(note.startswith("not of version 5.2, unused") and "PPY1" in note for note in tyre.notes)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("PDY1 = 0.88\n", "", "missing PDY1, which version 6.1 needs"),
        ("RBX1 = 13\n", "", r"missing RBX1, .* for combined slip \(USE_MODE"),
        ("FNOMIN = 4000\n", "", "missing FNOMIN"),
        ("FORCE  = 'newton'\n", "", r"\[UNITS\]: missing FORCE"),
        ("'meter'", "'furlong'", "LENGTH: expected one of .*furlong"),
        ("'radians'", "'degrees'", "ANGLE: expected 'radians'"),
        ("'meter'", "'mm'", "pressures have no unit"),
        ("FITTYP   = 61\n", "", "PROPERTY_FILE_FORMAT = missing"),
        ("PDY1 = 0.88", "PDY1 = zero point nine", "PDY1: expected a number, got 'zero point nine'"),
        ("PDY1 = 0.88", "PDY1 0.88", "line .*expected KEY = value"),
        ("PDY1 = 0.88", "PDY1 = 0.88\nPDY1 = 0.9", "PDY1 = 0.9 contradicts 0.88"),
        ("FNOMIN = 4000", "FNOMIN = -4000", "FNOMIN: expected a number above 0"),
        ("NOMPRES  = 220000", "NOMPRES = -1", "NOMPRES: expected a number above 0"),
        ("FZMIN = 100", "FZMIN = 10000", "FZMIN = 10000 is not below FZMAX"),
        ("'LEFT'", "'UP'", "TYRESIDE: expected 'LEFT'"),
        ("PDY1 = 0.88", "PDY1 = nan", "PDY1: expected a number, got 'nan'"),
    ],
)
def test_files_that_cannot_be_used_are_refused(old, new, message):
    with pytest.raises(ModelError, match=message):
        changed(old, new)


def test_what_is_no_property_file_is_refused(tmp_path):
    for content, message in ((b"\0\1\2", "binary"), (b"", "no line KEY"), (b"x" * 2_000_000, "2000000 bytes")):
        path = Path(tmp_path / "x.tir")
        path.write_bytes(content)
        with pytest.raises(ModelError, match=message):
            wheels.read_tyre_file(path)
    with pytest.raises(ModelError, match="cannot be read"):
        wheels.read_tyre_file(tmp_path / "none.tir")
    with pytest.raises(ModelError, match="passenger_car_61"):
        wheels.shipped_tyre("moped")
