import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import fe_models as fm
from fe_models.errors import MeshError

MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
4
0 3 "foot"
1 1 "leg"
1 2 "beam"
2 9 "plate"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 0 0 2
7 0 0 1
3 1 0 2
4 9 9 9
5 1 1 2
$EndNodes
$Elements
5
1 15 2 3 1 1
2 8 2 1 1 1 2 7
3 1 2 2 2 2 3
4 1 2 1 2 2 3
5 2 2 9 3 2 3 5
$EndElements
"""

INP = """*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 2., 0., 0.
*ELEMENT, TYPE=B31, ELSET=shaft
1, 1, 2
2, 2, 3
*NSET, NSET=tip
3
"""

BDF = """BEGIN BULK
GRID,10,,0.,0.,0.
GRID,11,,1.,0.,0.
GRID,12,,1.,1.,0.
CBAR,1,7,10,11,0.,1.,0.
CBEAM,2,8,11,12,0.,0.,1.
ENDDATA
"""

NODES = """# a portal
node, x, y, z, sets
1, 0, 0, 0, foot left
2, 0, 0, 3
3, 4, 0, 3, corner
99, 0, 5, 0
"""
LINES = """line, node1, node2, group, vx, vy, vz, third, z1, z2
1, 1, 2, leg, , , , 99
2, 2, 3, beam, 0, 1, 0, , 0.1, 0.1   # on top
"""


def written(tmp_path, **files):
    for name, text in files.items():
        (tmp_path / name.replace("_", ".")).write_text(text)
    return tmp_path


def test_physical_curves_of_gmsh_become_groups_of_lines(tmp_path):
    mesh = fm.beams.read_line_mesh(written(tmp_path, frame_msh=MSH) / "frame.msh")
    assert_allclose(mesh.nodes, [(0, 0, 0), (0, 0, 2), (0, 0, 1), (1, 0, 2)])
    # the curve with a middle node is two lines; the line listed for two groups is there once, in both
    assert {tuple(sorted(line)) for line in mesh.lines.tolist()} == {(0, 2), (1, 2), (1, 3)}
    length = np.linalg.norm(np.diff(mesh.nodes[mesh.lines], axis=1), axis=2).ravel()
    assert_allclose(length, [1, 1, 1])
    assert sorted(mesh.line_sets) == ["beam", "leg"]
    assert len(mesh.line_sets["leg"]) == 3
    assert len(mesh.line_sets["beam"]) == 1
    assert_array_equal(mesh.node_sets["foot"], [0])
    assert_array_equal(mesh.node_numbers, [1, 2, 7, 3])
    assert "1 cells that are no lines" in mesh.notes[0]


def test_only_the_lines_of_the_named_groups_are_taken(tmp_path):
    mesh = fm.beams.read_line_mesh(written(tmp_path, frame_msh=MSH) / "frame.msh", groups=["beam"])
    assert len(mesh.lines) == 1
    assert_allclose(np.sort(mesh.nodes[:, 0]), [0, 1])
    assert_array_equal(mesh.line_sets["leg"], [0])


def test_beams_of_abaqus_and_nastran_are_lines_with_their_groups(tmp_path):
    folder = written(tmp_path, shaft_inp=INP, frame_bdf=BDF)
    shaft, frame = fm.beams.read_line_mesh(folder / "shaft.inp"), fm.beams.read_line_mesh(folder / "frame.bdf")
    assert_array_equal(shaft.lines, [(0, 1), (1, 2)])
    assert_array_equal(shaft.line_sets["shaft"], [0, 1])
    assert_array_equal(shaft.node_sets["tip"], [2])
    assert_array_equal(frame.lines, [(0, 1), (1, 2)])
    assert_array_equal(frame.line_sets["pid_8"], [1])


def test_tables_give_nodes_lines_groups_and_axes(tmp_path):
    folder = written(tmp_path, nodes_csv=NODES, lines_csv=LINES)
    mesh = fm.files.read_tables(folder / "nodes.csv", folder / "lines.csv")
    assert_allclose(mesh.nodes, [(0, 0, 0), (0, 0, 3), (4, 0, 3)])  # node 99 only orients
    assert_array_equal(mesh.lines, [(0, 1), (1, 2)])
    assert_allclose(mesh.orientations, [(0, 5, 0), (0, 1, 0)])
    assert_allclose(mesh.offsets[1], [(0, 0, 0.1), (0, 0, 0.1)])
    assert_array_equal(mesh.line_sets["beam"], [1])
    assert_array_equal(mesh.node_sets["foot"], [0])
    assert_array_equal(mesh.node_numbers, [1, 2, 3])


def test_tables_may_be_separated_by_semicolons(tmp_path):
    folder = written(tmp_path, a_csv="node;x;y\n1;0;0\n2;1.5;0\n", b_csv="node1;node2\n1;2\n")
    assert_allclose(fm.files.read_tables(folder / "a.csv", folder / "b.csv").nodes, [(0, 0, 0), (1.5, 0, 0)])


@pytest.mark.parametrize(
    ("nodes", "lines", "words"),
    [
        ("", LINES, "the table is empty"),
        ("node,x\n1,0\n", LINES, "missing y"),
        ("node,x,y,q\n1,0,0,0\n", LINES, "unknown column 'q'"),
        ("node,x,y\n1,0,0\n1,1,0\n", LINES, "line 3: node 1 is listed twice"),
        ("node,x,y\n1,zero,0\n", LINES, "line 2: column x: expected a finite number, got 'zero'"),
        ("node,x,y\n1,nan,0\n", LINES, "column x: expected a finite number"),
        ("node,x,y\none,0,0\n", LINES, "column node: expected a whole number"),
        ("node,x,y\n1,0,0,7\n", LINES, "line 2: 4 entries, but the header has 3"),
        (NODES, "node1,node2\n1,5\n", "line 2: column node2: there is no node 5"),
        (NODES, "node1,node2\n", "expected lines, got none"),
        (NODES, "node1,node2,vx,third\n1,2,1,3\n", "both a vector"),
    ],
)
def test_bad_tables_are_refused_with_file_and_line(tmp_path, nodes, lines, words):
    folder = written(tmp_path, nodes_csv=nodes, lines_csv=lines)
    with pytest.raises(MeshError, match=words):
        fm.files.read_tables(folder / "nodes.csv", folder / "lines.csv")


def test_a_missing_table_is_named(tmp_path):
    with pytest.raises(MeshError, match=r"nodes\.csv: cannot be read: No such file"):
        fm.files.read_tables(tmp_path / "nodes.csv", tmp_path / "lines.csv")


def test_a_mesh_without_lines_is_no_frame(tmp_path):
    text = MSH.replace("5\n1 15", "2\n1 15").replace("2 8 2 1 1 1 2 7\n3 1 2 2 2 2 3\n4 1 2 1 2 2 3\n", "")
    folder = written(tmp_path, frame_msh=text)
    with pytest.raises(MeshError, match="expected lines"):
        fm.beams.read_line_mesh(folder / "frame.msh")
    with pytest.raises(MeshError, match=r"no group of lines 'led'.*did you mean 'leg'"):
        fm.beams.read_line_mesh(written(tmp_path, frame_msh=MSH) / "frame.msh", groups=["led"])
