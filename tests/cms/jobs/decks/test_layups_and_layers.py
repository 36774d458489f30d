"""Decks with shells of layers, and with beams and shells on the same nodes."""

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

PLATE = """*NODE
1, 0, 0, 0
2, 2, 0, 0
3, 2, 1, 0
4, 0, 1, 0
*ELEMENT, TYPE=S4, ELSET=plate
1, 1, 2, 3, 4
*MATERIAL, NAME=Steel
*ELASTIC
2e11, .3
*DENSITY
8000.
*MATERIAL, NAME=Ply
*ELASTIC, TYPE=ENGINEERING CONSTANTS
1.4e11, 1e10, 1e10, .3, .3, .4, 5e9, 5e9,
3e9
*DENSITY
1600.
*ORIENTATION, NAME=along
1., 1., 0., -1., 1., 0.
*ORIENTATION, NAME=across
-1., 1., 0., -1., -1., 0.
*ORIENTATION, NAME=tilted
0.2588190451025208, 0.9659258262890683, 0., -0.9659258262890683, 0.2588190451025208, 0.
*ORIENTATION, NAME=round, SYSTEM=CYLINDRICAL
0., 0., 0., 0., 0., 1.
"""
STEEL = Material("Steel", E=2e11, nu=0.3, rho=8000.0)
PLY = OrthotropicMaterial("Ply", (1.4e11, 1e10, 1e10), (5e9, 5e9, 3e9), (0.3, 0.3, 0.4), 1600.0)


def body_of(folder, text):
    path = folder / "plate.inp"
    path.write_text(text)
    path.with_suffix(".toml").write_text(job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name))
    return uncoupled_body(read_job(path.with_suffix(".toml")), Stages())


def plain(body, layers, direction, offset=0.0, cells=((0, 1, 2, 3),)):
    X = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
    mesh = ShellMesh(X, {"quad": np.array(cells)})
    return shell_body(mesh, LaminateProperty(layers, direction, offset=offset), name="p", units=body.units)


def same(body, other):
    scale = abs(other.K).max()
    assert_allclose(body.K.toarray(), other.K.toarray(), rtol=0, atol=1e-12 * scale)
    assert_allclose(body.M.toarray(), other.M.toarray(), rtol=0, atol=1e-12 * abs(other.M).max())


def test_layers_lie_from_bottom_to_top(tmp_path):
    text = (
        PLATE + "*SHELL SECTION, ELSET=plate, COMPOSITE, OFFSET=0.5\n0.01,,Steel\n0.02,,steel\n0.004, 3, PLY, along\n"
    )
    layers = (Layer(STEEL, 0.01), Layer(STEEL, 0.02), Layer(PLY, 0.004))
    body = body_of(tmp_path, text)
    same(body, plain(body, layers, (1, 1, 0), offset=-0.017))
    other = plain(body, layers[::-1], (1, 1, 0), offset=-0.017)
    assert abs(body.K - other.K).max() > 1e-3 * abs(body.K).max()


@pytest.mark.parametrize("cells", ["1, 2, 3, 4", "1, 4, 3, 2"])
def test_orientations_of_layers_are_angles_about_the_normal(tmp_path, cells):
    """An angle as a number, from the orientation of the section, and an orientation of the layer's own."""
    text = PLATE.replace("1, 1, 2, 3, 4\n", f"1, {cells}\n")
    text += "*SHELL SECTION, ELSET=plate, COMPOSITE, ORIENTATION=along\n.01,,Ply\n.02,,Ply,tilted\n.03,,Ply,30.\n"
    body = body_of(tmp_path, text)
    order = tuple(int(n) - 1 for n in cells.split(","))
    up = 1 if order[1] == 1 else -1  # the axes turn about +z, whichever side is the top
    layers = (Layer(PLY, 0.01), Layer(PLY, 0.02, 30.0 * up), Layer(PLY, 0.03, 30.0))
    same(body, plain(body, layers, (1, 1, 0), cells=(order,)))


def test_a_shell_of_one_orthotropic_material_is_one_layer(tmp_path):
    body = body_of(tmp_path, PLATE + "*SHELL SECTION, ELSET=plate, MATERIAL=ply, ORIENTATION=across\n0.05\n")
    same(body, plain(body, (Layer(PLY, 0.05),), (-1, 1, 0)))


def test_an_upright_shell_of_isotropic_layers_needs_no_direction(tmp_path):
    """Across x: the direction of angle 0 cannot be x there."""
    text = PLATE.replace("2, 2, 0, 0", "2, 0, 0, 2").replace("3, 2, 1, 0", "3, 0, 1, 2")
    body = body_of(tmp_path, text + "*SHELL SECTION, ELSET=plate, COMPOSITE\n0.01,,Steel\n0.02,,Steel\n")
    along = np.where(body.dofs[:, 1] == 0, 1.0, 0.0)
    assert_allclose(along @ body.M @ along, 8000 * 0.03 * 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("MATERIAL=Ply\n0.05\n", "no ORIENTATION says where its axes lie"),
        ("MATERIAL=Ply, ORIENTATION=round\n0.05\n", "axes that vary in space"),
        ("COMPOSITE, ORIENTATION=alon\n.01,,Ply\n", "names the orientation 'alon'"),
        ("COMPOSITE\n.01,,\n", "expected thickness, number of points, material"),
        ("COMPOSITE\n", "expected a line for each layer"),
    ],
)
def test_layers_without_axes_are_refused(tmp_path, section, words):
    with pytest.raises(MeshError, match=words):
        body_of(tmp_path, PLATE + "*SHELL SECTION, ELSET=plate, " + section)


BEAMS = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 2, 0, 0
*ELEMENT, TYPE=B32, ELSET=one
1, 1, 2, 3
*ELEMENT, TYPE=B32, ELSET=two
2, 1, 2, 3
*MATERIAL, NAME=A
*ELASTIC
2e11, .3
*DENSITY
8000.
*MATERIAL, NAME=B
*ELASTIC
1e11, .3
*DENSITY
2000.
*BEAM SECTION, ELSET=one, MATERIAL=A, SECTION=RECT
0.1, 0.2
0., 1., 0.
*BEAM SECTION, ELSET=two, MATERIAL=B, SECTION=RECT
0.1, 0.2
0., 1., 0.
"""


def test_beams_on_the_same_nodes_add_up(tmp_path):
    """Two materials in one section are one of E_1 + E_2 and rho_1 + rho_2."""
    body = body_of(tmp_path, BEAMS)
    alone = BEAMS.replace("*ELEMENT, TYPE=B32, ELSET=two\n2, 1, 2, 3\n", "")
    alone = alone.replace("2e11", "3e11").replace("8000.", "10000.").partition("*BEAM SECTION, ELSET=two")[0]
    same(body, body_of(tmp_path, alone))


def test_a_beam_twice_in_one_set_is_refused(tmp_path):
    with pytest.raises(MeshError, match="listed twice"):
        body_of(tmp_path, BEAMS.replace("ELSET=two\n2, 1, 2, 3", "ELSET=two\n2, 1, 2, 3\n3, 1, 2, 3"))


def test_shells_on_the_same_nodes_add_up(tmp_path):
    text = PLATE.replace("1, 1, 2, 3, 4\n", "1, 1, 2, 3, 4\n*ELEMENT, TYPE=S4, ELSET=coat\n2, 1, 2, 3, 4\n")
    half = "*SHELL SECTION, ELSET=plate, MATERIAL=Steel\n0.02\n*SHELL SECTION, ELSET=coat, MATERIAL=Steel\n0.02\n"
    body = body_of(tmp_path, text + half)
    single = body_of(tmp_path, PLATE + "*SHELL SECTION, ELSET=plate, MATERIAL=Steel\n0.02\n")
    assert_allclose(body.K.toarray(), 2 * single.K.toarray(), rtol=0, atol=1e-12 * abs(single.K).max())


def test_supports_along_axes_of_their_own_are_interfaces_with_these_axes(tmp_path):
    text = PLATE + "*SHELL SECTION, ELSET=plate, MATERIAL=Steel\n0.02\n*NSET, NSET=pin\n2, 3\n"
    text += "*TRANSFORM, NSET=pin\n1., 1., 0., -1., 1., 0.\n*BOUNDARY\npin, 2\n1, 1, 3\n"
    body = body_of(tmp_path, text)
    s = np.sqrt(0.5)
    assert_allclose(body.interface("pin").triad, np.array([[s, s, 0], [-s, s, 0], [0, 0, 1]]).T, atol=1e-15)
    assert_allclose(body.interface("node_1").triad, np.eye(3), atol=0)
    assert "holds uy along its own axes at the interface pin" in (tmp_path / "plate.toml").read_text()
