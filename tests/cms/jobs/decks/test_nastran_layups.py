"""PCOMP and MAT8 against our laminates."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.body.material import Material, OrthotropicMaterial
from fe_models.elements.shells.body import shell_body
from fe_models.elements.shells.shell_property import LaminateProperty, Layer
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from fe_models.meshes.shell_mesh import ShellMesh

DECK = """BEGIN BULK
CORD2R,5,,0.,0.,0.,0.,0.,1.
,1.,1.,0.
GRID,1,,0.,0.,0.
GRID,2,,2.,0.,0.
GRID,3,,2.,1.,0.
GRID,4,,0.,1.,0.
CQUAD4,1,1,2,3,4,1,THETA
PCOMP,1,Z0,2.,,,,,LAM
,1,.01,,,2,.02,30.
,2,,-45.
MAT1,1,2.+11,,.3,8000.
MAT8,2,1.4+11,1.+10,.3,5.+9,4.+9,3.+9,1600.
ENDDATA
"""
STEEL = Material("1", E=2e11, nu=0.3, rho=8000.0)
PLY = OrthotropicMaterial("2", (1.4e11, 1e10, 1e10), (5e9, 4e9, 3e9), (0.3, 0.1, 0.2), 1600.0)


def deck_of(folder, theta="", z0="", lam="", **more):
    text = DECK.replace("THETA", theta).replace("Z0", z0).replace("LAM", lam)
    for old, new in more.items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "plate.bdf"
    path.write_text(text)
    return parse_deck(path)


@pytest.mark.parametrize(
    ("options", "direction", "offset", "repeat"),
    [
        ({"theta": "20."}, np.deg2rad(90 + 20), 0.0, 1),  # the first side is from (2, 0) to (2, 1)
        ({"theta": "5", "z0": "0."}, np.deg2rad(45), 0.025, 1),
        ({"theta": "20.,.1", "z0": "-.03", "lam": "SYM"}, np.deg2rad(90 + 20), 0.1 - 0.03 + 0.05, 2),
    ],
)
def test_layers_lie_as_the_card_says(tmp_path, options, direction, offset, repeat):
    deck = deck_of(tmp_path, **options)
    path = tmp_path / "plate.toml"
    path.write_text(job_text(deck, DeckOptions("m-kg-s", {}), "plate.bdf"))
    body = uncoupled_body(read_job(path), Stages())
    layers = (Layer(STEEL, 0.01), Layer(PLY, 0.02, 30.0), Layer(PLY, 0.02, -45.0))
    layers = layers if repeat == 1 else layers + layers[::-1]
    X = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    laminate = LaminateProperty(layers, (np.cos(direction), np.sin(direction), 0), offset=offset, added_mass=2.0)
    plain = shell_body(ShellMesh(X, {"quad": np.array([[1, 2, 3, 0]])}), laminate, name="p", units=body.units)
    assert_allclose(body.K.toarray(), plain.K.toarray(), rtol=0, atol=1e-12 * abs(plain.K).max())
    assert_allclose(body.M.toarray(), plain.M.toarray(), rtol=0, atol=1e-12 * abs(plain.M).max())


def test_a_last_layer_that_is_given_by_its_material_alone_takes_the_thickness_before_it(tmp_path):
    deck = deck_of(tmp_path, **{",2,,-45.": ",2"})
    path = tmp_path / "plate.toml"
    path.write_text(job_text(deck, DeckOptions("m-kg-s", {}), "plate.bdf"))
    body = uncoupled_body(read_job(path), Stages())
    along = (body.dofs[:, 1] == 0).astype(float)
    density = 0.01 * 8000.0 + 2 * 0.02 * 1600.0 + 2.0
    assert_allclose(along @ (body.M @ along), 2.0 * density, rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lam": "BEND"}, "1 PCOMP: property 1: LAM = BEND"),
        ({",1,.01,": ",1,,"}, "a layer without material or thickness"),
        ({"PCOMP,1,,2.,,,,,\n,1,.01,,,2,.02,30.\n,2,,-45.": "PSHELL,1,2,.1,9,,2"}, "a material that is not known"),
    ],
)
def test_layups_that_are_not_known_are_refused(tmp_path, options, words):
    with pytest.raises(MeshError, match=words):
        deck_of(tmp_path, **options).ledger.require_whole()


def test_a_sheet_without_transverse_shear_is_noted(tmp_path):
    rows = deck_of(tmp_path, **{"4.+9,3.+9,1600.": ",,1600."}).ledger.rows()
    assert any(name == "MAT8" and "G12" in why for name, _, why in rows)
