"""Moments against each other: of masses, and of inertia that no distribution of mass has."""

from dataclasses import replace

import numpy as np
import pytest

import cms
import fe_models as fm
from cms.assessment.quality.of_body.moments_of_mass import check_gram
from cms.body.invariants import NEGATIVITY
from cms.body.modal_file.file import read
from tests.bodies import STEEL


@pytest.fixture(scope="module", params=[True, False])
def frame(request):
    """Two stout beams across each other, with and without rotary inertia of bending."""
    points = np.array([(0, 0, 0), (0.5, 0, 0), (1, 0, 0), (0.5, 0.5, 0), (0.5, 1, 0)], dtype=float)
    mesh = fm.beams.LineMesh(points, [(0, 1), (1, 2), (1, 3), (3, 4)])
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.2, 0.1), STEEL, rotary_inertia=request.param)
    joint = fm.beams.line_interface(mesh, "left", fm.beams.NodeIndices((0,)))
    body = fm.beam_body(mesh, section, name="cross", units=fm.unit_system("m-kg-s"), interfaces=[joint])
    body = cms.couple(body)
    return request.param, cms.reduce(body, cms.craig_bampton(body, n_modes=12))


def test_bars_without_rotary_inertia_are_no_contradiction(frame, tmp_path):
    """Their torsional inertia alone has negative second moments along the axis, E = J (1/2 - e_x e_xT)."""
    is_rotary, reduced = frame
    cms.write(reduced, tmp_path / "cross.h5")
    for body in (reduced, read(tmp_path / "cross.h5")):
        record = check_gram(body)
        assert (reduced.moments.negativity > 1e-6) is not is_rotary
        assert (NEGATIVITY in body.provenance) is not is_rotary
        assert record.verdict == ("pass" if is_rotary else "info")
        assert is_rotary or "no distribution of its mass has" in record.reason
        assert check_gram(replace(body, provenance={})).verdict == ("pass" if is_rotary else "fail")


def test_moments_that_contradict_each_other_fail_in_both(frame):
    _, reduced = frame
    P = np.array(reduced.moments.P)
    spoilt = replace(reduced, moments=replace(reduced.moments, P=3 * P))
    assert check_gram(spoilt).verdict == "fail"
