"""Triangles, quads and lines of mesh files as shells."""

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm

INP = """*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 2., 0., 0.
9, 7., 7., 7.
*ELEMENT, TYPE=S4R, ELSET=floor
11, 1, 2, 3, 4
*ELEMENT, TYPE=S3, ELSET=tip
12, 2, 5, 3
*ELEMENT, TYPE=B31, ELSET=rib
13, 2, 3
*NSET, NSET=root
1, 4
"""

BDF = """BEGIN BULK
GRID,10,,0.,0.,0.
GRID,11,,1.,0.,0.
GRID,12,,1.,1.,0.
GRID,13,,0.,1.,0.
GRID,14,,2.,0.,0.
CQUAD4,1,7,10,11,12,13
CTRIA3,2,8,11,14,12
CBAR,3,9,11,12,0.,0.,1.
ENDDATA
"""


def test_abaqus_shells_with_their_sets_and_ribs(tmp_path):
    (tmp_path / "a.inp").write_text(INP)
    mesh = fm.shells.read_shell_mesh(tmp_path / "a.inp", stiffeners=["rib"])
    assert_array_equal(mesh.cells["quad"], [[0, 1, 2, 3]])
    assert_array_equal(mesh.cells["triangle"], [[1, 4, 2]])
    assert_array_equal(mesh.lines, [[1, 2]])
    assert_array_equal(mesh.line_sets["rib"], [0])
    assert_array_equal(mesh.node_sets["root"], [0, 3])
    assert_array_equal(mesh.node_sets["tip"], [1, 2, 4])
    assert_array_equal(mesh.node_numbers, [1, 2, 3, 4, 5])
    assert "1 nodes that belong to no shell or stiffener were dropped" in mesh.notes
    assert mesh.cell_name("quad", 0) == "quad 11"


def test_nastran_shells_by_property_and_only_some_groups(tmp_path):
    (tmp_path / "a.bdf").write_text(BDF)
    mesh = fm.shells.read_shell_mesh(tmp_path / "a.bdf")
    assert {group: set(by_type) for group, by_type in mesh.cell_sets.items()} == {
        "pid_7": {"quad"},
        "pid_8": {"triangle"},
    }
    assert len(mesh.lines) == 0
    part = fm.shells.read_shell_mesh(tmp_path / "a.bdf", groups=["pid_8"])
    assert part.n_cells == 1
    assert_array_equal(part.nodes[part.cells["triangle"][0]], [[1, 0, 0], [2, 0, 0], [1, 1, 0]])
    with pytest.raises(fm.errors.MeshError, match="no group of triangles or quads 'pid_9'"):
        fm.shells.read_shell_mesh(tmp_path / "a.bdf", groups=["pid_9"])
    with pytest.raises(fm.errors.MeshError, match="no group of lines 'pid_8'"):
        fm.shells.read_shell_mesh(tmp_path / "a.bdf", stiffeners=["pid_8"])


@pytest.mark.parametrize(("kind", "n"), [("triangle6", 6), ("quad9", 9)])
def test_quadratic_cells_become_four_flat_ones_of_the_same_area(tmp_path, kind, n):
    from fe_models.meshes.cell_shapes import CELL_SHAPES

    nodes = np.column_stack([CELL_SHAPES[kind].nodes, np.zeros(n)])
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(nodes, [(kind, np.arange(n)[None])]))
    mesh = fm.shells.read_shell_mesh(tmp_path / "a.vtu")
    steel = fm.Material("steel", E=2e11, nu=0.3, rho=8000.0)
    report = fm.shells.report_shell(mesh, [steel], units=cms.unit_system("m-kg-s"))
    assert mesh.n_cells == 4
    assert report.area == pytest.approx(0.5 if kind == "triangle6" else 1.0)
    assert report.findings == ()
    assert "1 quadratic cells were split into four flat ones each" in mesh.notes


def test_files_without_shells_are_refused(tmp_path):
    line = meshio.Mesh(np.eye(3), [("line", np.array([[0, 1], [1, 2]]))])
    meshio.write(tmp_path / "a.vtu", line)
    with pytest.raises(
        fm.errors.MeshError, match=r"expected triangles or quads \(shells\), got 2 line; export the surfaces"
    ):
        fm.shells.read_shell_mesh(tmp_path / "a.vtu")


def test_quads_of_eight_nodes_get_their_middle_from_the_quadratic_field(tmp_path):
    """On a cylinder z = 1 - x² the serendipity field is exact: the ninth node stands on it."""
    corners = np.array([(0, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 1)], dtype=float)
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    middles[:, 2] = 1 - middles[:, 0] ** 2
    meshio.write(tmp_path / "b.vtu", meshio.Mesh(np.concatenate([corners, middles]), [("quad8", np.arange(8)[None])]))
    mesh = fm.shells.read_shell_mesh(tmp_path / "b.vtu")
    assert_allclose(mesh.nodes[8], [0.5, 0.5, 0.75], rtol=0, atol=1e-15)
    assert_array_equal(np.sort(mesh.cells["quad"], axis=1), [[0, 4, 7, 8], [1, 4, 5, 8], [2, 5, 6, 8], [3, 6, 7, 8]])
