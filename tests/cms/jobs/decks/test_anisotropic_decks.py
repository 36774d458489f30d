"""Decks of Abaqus and CalculiX with orthotropic materials in axes of their own, and shells of varied thickness."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.body.material import AnisotropicMaterial, OrthotropicMaterial
from fe_models.elements.solids.body import solid_body
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.bodies import box_mesh
from tests.decks import write_deck

YOUNG, POISSON, SHEAR = (13e9, 7e9, 4e9), (0.3, 0.25, 0.4), (3e9, 2e9, 1.5e9)
#: where the constants of each law stand in a tensor of rows 11 22 33 12 13 23, as the manuals list them
ORTHOTROPIC = ["11", "12", "22", "13", "23", "33", "44", "55", "66"]
ANISOTROPIC = [f"{i}{j}" for j in range(1, 7) for i in range(1, j + 1)]


def body_of(path):
    text = job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name)
    path.with_suffix(".toml").write_text(text)
    return uncoupled_body(read_job(path.with_suffix(".toml")), Stages())


def tensor():
    """Stress by strain in the axes of the material, rows 11 22 33 12 13 23."""
    S = np.diag([*(1 / np.array(YOUNG)), *(1 / np.array(SHEAR))])
    for i, j, nu in ((0, 1, POISSON[0]), (0, 2, POISSON[1]), (1, 2, POISSON[2])):
        S[i, j] = S[j, i] = -nu / YOUNG[i]
    return np.linalg.inv(S)


def law(kind):
    """The lines of a law below *ELASTIC."""
    C = tensor()
    values = {
        "ENGINEERING CONSTANTS": [*YOUNG, *POISSON, *SHEAR],
        "ORTHOTROPIC": [C[int(k[0]) - 1, int(k[1]) - 1] for k in ORTHOTROPIC],
        "ANISOTROPIC": [C[int(k[0]) - 1, int(k[1]) - 1] for k in ANISOTROPIC],
    }[kind]
    rows = [", ".join(repr(float(x)) for x in values[k : k + 8]) for k in range(0, len(values), 8)]
    return "\n".join([f"*ELASTIC, TYPE={kind}", *rows])


def deck(folder, kind, orientation):
    path = write_deck(folder / "ply.inp", box_mesh(2, 1, 1, 1.0, 0.1, 0.08, "hexahedron20"))
    text = f"*MATERIAL, NAME=PLY\n{law(kind)}\n*DENSITY\n600.\n{orientation}"
    path.write_text(path.read_text() + text + '*SOLID SECTION, ELSET="all", MATERIAL=ply, ORIENTATION=Grain\n')
    return path


@pytest.mark.parametrize("kind", ["ENGINEERING CONSTANTS", "ORTHOTROPIC", "ANISOTROPIC"])
def test_the_same_material_by_three_laws_is_that_of_our_solids_in_its_axes(tmp_path, kind):
    """Axes through two points, then turned by 30 degrees about the second."""
    axes = "*ORIENTATION, NAME=GRAIN\n1., 1., 0., -1., 3., 0.5\n2, 30.\n"
    body = body_of(deck(tmp_path, kind, axes))
    x = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    y = np.array([-1.0, 3.0, 0.5])
    y = (y - x * (x @ y)) / np.linalg.norm(y - x * (x @ y))
    turned = Rotation.from_rotvec(np.deg2rad(30) * y).apply([x, y, np.cross(x, y)])
    material = OrthotropicMaterial("PLY", YOUNG, SHEAR, POISSON, 600.0, tuple(tuple(row) for row in turned.tolist()))
    plain = solid_body(box_mesh(2, 1, 1, 1.0, 0.1, 0.08, "hexahedron20"), material, name="b", units=body.units)
    assert_allclose(body.K.toarray(), plain.K.toarray(), rtol=0, atol=1e-11 * abs(plain.K).max())


def test_axes_that_are_not_known_are_refused(tmp_path):
    around = "*ORIENTATION, NAME=GRAIN, SYSTEM=CYLINDRICAL\n0., 0., 0., 0., 0., 1.\n"
    with pytest.raises(MeshError, match=r"1 \*ORIENTATION: axes that vary in space"):
        body_of(deck(tmp_path, "ORTHOTROPIC", around))
    with pytest.raises(MeshError, match="a section names the orientation 'Grain'"):
        parse_deck(deck(tmp_path, "ORTHOTROPIC", "*ORIENTATION, NAME=OTHER\n1., 0., 0., 0., 1., 0.\n"))
    line = "*ORIENTATION, NAME=GRAIN\n1., 0., 0., 2., 0., 0.\n"
    with pytest.raises(MeshError, match="points a and b lie on one line"):
        parse_deck(deck(tmp_path, "ORTHOTROPIC", line))


def coupled(folder, value):
    """The anisotropic deck with D_1112 = value, rows 11 and 12 coupled."""
    path = deck(folder, "ANISOTROPIC", "*ORIENTATION, NAME=GRAIN\n1., 1., 0., -1., 1., 0.\n")
    lines = path.read_text().splitlines()
    at = lines.index("*ELASTIC, TYPE=ANISOTROPIC")
    words = lines[at + 1].split(", ")
    lines[at + 1] = ", ".join([*words[:6], value, *words[7:]])
    path.write_text("\n".join(lines) + "\n")
    return path


def test_constants_that_couple_shear_and_stretch_make_an_anisotropic_material(tmp_path):
    """The 21 constants, 11 22 33 12 13 23, in the order of our rows 11 22 33 23 13 12."""
    body = body_of(coupled(tmp_path, "1e9"))
    C = tensor()
    C[0, 3] = C[3, 0] = 1e9
    C = C[np.ix_([0, 1, 2, 5, 4, 3], [0, 1, 2, 5, 4, 3])]
    s = np.sqrt(0.5)
    material = AnisotropicMaterial("PLY", C, 600.0, ((s, s, 0), (-s, s, 0), (0, 0, 1)))
    plain = solid_body(box_mesh(2, 1, 1, 1.0, 0.1, 0.08, "hexahedron20"), material, name="b", units=body.units)
    assert_allclose(body.K.toarray(), plain.K.toarray(), rtol=0, atol=1e-11 * abs(plain.K).max())


def test_constants_without_energy_are_refused(tmp_path):
    with pytest.raises(MeshError, match="the stiffness is not positive definite"):
        body_of(coupled(tmp_path, "1e12"))


@pytest.mark.parametrize("section", ["*SHELL SECTION, MATERIAL=PLY, ORIENTATION=GRAIN, ELSET=plate\n.01\n"])
def test_shells_of_anisotropic_materials_are_refused(tmp_path, section):
    path = coupled(tmp_path, "1e9")
    text = path.read_text().partition("*SOLID SECTION")[0].partition("*MATERIAL")[2]
    path.write_text(PLATE.partition("*MATERIAL")[0] + "*MATERIAL" + text + section)
    with pytest.raises(MeshError, match="shells of anisotropic materials"):
        body_of(path)


PLATE = """*NODE
1, 0, 0, 0
2, 2, 0, 0
3, 2, 1, 0
4, 0, 1, 0
5, 1, 0, 0
6, 2, .5, 0
7, 1, 1, 0
8, 0, .5, 0
9, 4, 0, 0
10, 4, 1, 0
11, 3, 0, 0
12, 4, .5, 0
13, 3, 1, 0
*ELEMENT, TYPE=S8, ELSET=plate
1, 1, 2, 3, 4, 5, 6, 7, 8
2, 2, 9, 10, 3, 11, 12, 13, 6
*NSET, NSET=edge
9, 10, 12
*MATERIAL, NAME=M
*ELASTIC
2e11, .3
*DENSITY
1000.
*SHELL SECTION, ELSET=plate, MATERIAL=M, OFFSET=0.5
0.01
"""


def test_thickness_at_nodes_keeps_the_mass_of_a_quadratic_thickness(tmp_path):
    """t = 0.01 (1 + x + x²) over 4 by 1: mass = 1000 · 0.01 (4 + 8 + 64/3); edges without entry have the section's."""
    x = {2: 2, 3: 2, 6: 2, 5: 1, 7: 1, 11: 3, 13: 3}
    rows = "".join(f"{node}, {0.01 * (1 + at + at**2)!r}\n" for node, at in x.items())
    path = tmp_path / "plate.inp"
    path.write_text(PLATE + "*NODAL THICKNESS\nedge, 0.21\n" + rows)
    loaded = parse_deck(path)
    assert ("*NODAL THICKNESS", "2") in [row[:2] for row in loaded.ledger.rows()]
    for shell in loaded.shells:
        assert_allclose(shell.offset, -shell.thickness / 2, rtol=1e-14)
    body = body_of(path)
    along = np.where(body.dofs[:, 1] == 0, 1.0, 0.0)
    assert_allclose(along @ body.M @ along, 10 * (4 + 8 + 64 / 3), rtol=1e-12)
    path.write_text(PLATE.replace("*SHELL SECTION", "*SHELL SECTION, NODAL THICKNESS") + "*NODAL THICKNESS\nedge, 1.\n")
    with pytest.raises(MeshError, match=r"2 \*NODAL THICKNESS: elements without a thickness"):
        body_of(path)
