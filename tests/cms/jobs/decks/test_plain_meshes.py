"""Decks (.inp) of nodes and elements alone, as meshers write them: elements of faces and edges only name groups."""

import pytest
from numpy.testing import assert_allclose

from cms.errors import BodyError
from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models import read_mesh
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.bodies import box_mesh
from tests.decks import write_deck

NAMING = """*ELEMENT, TYPE=T3D2, ELSET=Line1
901, 1, 2
*ELEMENT, TYPE=CPS4, ELSET=Surface1
902, 1, 2, 4, 3
"""
LINE = "elements that name edges and faces, and are no part of the body: 1 T3D2, 1 CPS4"
JOB = """[body]
{key} = "bar.inp"
units = "m-kg-s"
[materials.steel]
young = 2.1e11
poisson = 0.3
density = 7850
{more}
[interfaces.left]
kind = "rigid"
nodes = "left"
[reduction]
n_modes = 2
"""


@pytest.fixture
def path(tmp_path):
    path = write_deck(tmp_path / "bar.inp", box_mesh(2, 1, 1, 1.0, 0.1, 0.08, "hexahedron"))
    first, _, rest = path.read_text().partition("*ELEMENT")
    path.write_text(f"*HEADING\nbox\n{first}{NAMING}*ELEMENT{rest}*ELSET, ELSET=whole\n1, 2\n")
    return path


def body_of(path, key, more=""):
    path.with_suffix(".toml").write_text(JOB.format(key=key, more=more))
    return uncoupled_body(read_job(path.with_suffix(".toml")), Stages())


def test_a_plain_mesh_says_in_one_line_what_only_names_groups(path):
    mesh = read_mesh(path)
    assert mesh.notes == (LINE,)
    assert "Surface1" in mesh.face_sets
    assert {"Line1"} <= set(mesh.node_sets)
    assert len(mesh.cells["hexahedron"]) == 2


def test_a_plain_mesh_is_no_deck_and_the_message_says_how_to_use_it(path):
    deck = parse_deck(path)
    assert deck.is_plain_mesh
    assert deck.ledger.rows() == [("*ELEMENT", "1", LINE)]
    with pytest.raises(MeshError, match="a plain mesh, without materials, sections and steps") as caught:
        job_text(deck, DeckOptions("m-kg-s", {}), path.name)
    assert "[body] mesh = 'bar.inp'" in str(caught.value)
    assert "'Surface1'" in str(caught.value)
    path.write_text(path.read_text() + "*NSET, NSET=foot\n1, 2\n")
    with pytest.raises(MeshError, match=r"its sets of nodes .*'foot'"):
        job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name)
    for more in ("*MATERIAL, NAME=M\n", "*STEP\n*FREQUENCY\n2\n*END STEP\n"):
        path.write_text(path.read_text() + more)
        assert not parse_deck(path).is_plain_mesh
        with pytest.raises(ValueError, match="elements without a section"):
            job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name)


def test_a_job_of_its_own_tables_reads_a_plain_mesh_as_mesh_and_as_deck(path):
    plain = body_of(path, "mesh")
    deck = body_of(path, "deck", '[solids.bar]\ncells = "whole"\n')
    assert_allclose(deck.K.toarray(), plain.K.toarray(), rtol=0, atol=1e-12 * abs(plain.K).max())
    path.write_text(path.read_text() + "*MATERIAL, NAME=M\n")  # a whole deck: its shells and rods may have mass
    with pytest.raises(BodyError, match="1 line cells are in no table"):
        body_of(path, "deck", '[solids.bar]\ncells = "whole"\n')
