"""Fixtures of this room."""

from dataclasses import replace

import numpy as np
import pytest

import cms
import fe_models as fm
from cms.body.modal_file.file import write
from fe_models.meshes.numbering import NamedSet
from tests.fe_models.small_frames import STEEL
from tests.floatframe.durability.fatigue.examples import LENGTH, UNITS, B, H, noise


@pytest.fixture(scope="module")
def mast():
    """A beam of four elements, numbered 11 to 14, all its ends and the set ROOT of its first element kept."""
    mesh = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), 4)
    ends = [fm.beams.line_interface(mesh, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    body = fm.beam_body(
        mesh, fm.beams.BeamProperty(fm.beams.Rectangle(B, H), STEEL), name="mast", units=UNITS, interfaces=ends,
    )  # fmt: skip
    line_of = np.asarray(body.element_model.skin.line_of)
    root = NamedSet("ROOT", "elements", np.flatnonzero(line_of == 0), 1)
    body = replace(body, numbering=replace(body.numbering, elements=11 + line_of, sets=(root,)))
    coupled = cms.couple(fm.body.element_points(body))
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=2), frame=cms.NodalFrame("start"))


@pytest.fixture
def folder(mast, tmp_path):
    write(mast, tmp_path / "mast.h5")
    made = noise(mast)
    np.savez(tmp_path / "noise.npz", frequencies=made.frequencies, spectra=made.spectra)
    return tmp_path
