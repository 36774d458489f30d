"""The table of docs/user_guide.md that says how to read a motion: every expression, its shape, and its unit."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
import floatframe as ff
from tests.root import ROOT

TABLE = re.search(
    r"<!-- trajectory -->\n\n(.*?)\n\n", (ROOT / "docs" / "user_guide.md").read_text(encoding="utf-8"), re.DOTALL
)[1]
ROWS = [tuple(cell.strip() for cell in row.strip("|").split("|"))[:3] for row in TABLE.splitlines()[2:]]
#: how much larger the number of each unit is in mm-t-s than in m-kg-s: length 1e3, mass 1e-3, time 1
IN_MM_T_S = {
    "1": 1,
    "s": 1,
    "m": 1e3,
    "m2": 1e6,
    "kg": 1e-3,
    "sqrt(kg)": 1e-3**0.5,
    "rad": 1,
    "N": 1,
    "J": 1e3,
    "s2": 1,
}


@pytest.fixture(scope="module")
def motions():
    """Return names of the same motion of a flexible pendulum in m-kg-s and in mm-t-s."""
    line = fm.beams.straight_line((0, 0, 0), (0.5, 0, 0), 4)
    ends = [fm.beams.line_interface(line, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.004, 0.01), fm.Material("steel", 210e9, 0.3, 7850.0))
    body = cms.couple(fm.beam_body(line, section, name="rod", units=fm.unit_system("m-kg-s"), interfaces=ends))
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=1), frame=cms.TisserandFrame())

    def moved(reduced, length):
        pin = ff.RevoluteJoint("pin", ff.GROUND, ff.Marker("rod", "start"), axis=(0, 1, 0))
        tip = ff.sensors.PlaceSensor("tip", ff.Marker("rod", "end"))
        gravity = ff.Gravity((0.5 * length, 0.2 * length, -9.81 * length))
        system = ff.System([ff.FlexibleBody("rod", reduced)], [pin], [gravity], reduced.units, sensors=[tip])
        motion = ff.integrate(system, ff.GeneralizedAlpha(0.8), t_end=0.05, h=1e-3, output_every=5)
        return {"ff": ff, "motion": motion, "system": system, "reduced": reduced}

    return moved(reduced, 1.0), moved(cms.body.convert_units(reduced, "mm-t-s"), 1e3)


@pytest.mark.parametrize(("expression", "shape", "unit"), ROWS, ids=[row[0].strip("`") for row in ROWS])
def test_shapes_and_units_are_those_that_are_stated(motions, expression, shape, unit):
    in_m, in_mm = (np.asarray(eval(expression.strip("`"), dict(names))) for names in motions)
    sizes = {"n_t": 11, "n_q": motions[0]["reduced"].n_q}
    stated = tuple(sizes[word] if word in sizes else int(word) for word in re.findall(r"\w+", shape))
    assert in_m.shape == stated
    if "drift" in expression:  # what Newton's method leaves open is noise, in every unit
        return
    above, _, below = unit.partition("/")
    factor = np.prod([IN_MM_T_S[word] for word in above.split()]) / IN_MM_T_S[below or "1"]
    scale = max(np.abs(in_mm).max(), factor * np.abs(in_m).max())
    assert_allclose(in_mm, factor * in_m, rtol=0, atol=1e-5 * scale)


def test_every_field_of_a_motion_of_a_body_is_in_the_table():
    from dataclasses import fields

    from floatframe.results.trajectory import BodyMotion

    named = {match[1] for row in ROWS if (match := re.fullmatch(r'`motion\.body\("rod"\)\.(\w+)`', row[0]))}
    assert named == {field.name for field in fields(BodyMotion)} - {"t"}
