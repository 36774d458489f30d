"""Numbers of the user: through meshes and bodies, what a name means, and messages where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fe_models.body.couplings.couplings import check_overlap, couple
from fe_models.body.fe_body import Interface
from fe_models.body.kept_nodes import keep_nodes
from fe_models.body.weld import weld
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Rectangle
from fe_models.elements.shells.body import shell_body
from fe_models.elements.shells.shell_property import ShellProperty
from fe_models.elements.solids.body import solid_body
from fe_models.errors import BodyError, InterfaceError, MeshError
from fe_models.files.matrices.given import body_from_matrices
from fe_models.files.tables import read_tables
from fe_models.foundation.units import unit_system
from fe_models.meshes.boundary import facets_of
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.numbering import NONE, NamedSet, Numbering, numbering_side_by_side
from fe_models.meshes.shell_mesh import ShellMesh
from tests.bodies import STEEL, box_mesh

UNITS = unit_system("m-kg-s")


def scrambled(mesh, seed=0):
    """Return the mesh with numbers that are neither in order nor without gaps, of nodes and cells."""
    random = np.random.default_rng(seed)
    cells = {kind: random.permutation(7 * len(rows))[: len(rows)] + 1000 for kind, rows in mesh.cells.items()}
    return replace(mesh, node_numbers=random.permutation(9 * len(mesh.nodes))[: len(mesh.nodes)] + 5_000_000,
                   cell_numbers=cells)  # fmt: skip


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "wedge"])
def test_the_element_of_a_triangle_is_the_one_cell_that_has_its_nodes(kind):
    mesh = scrambled(box_mesh(2, 2, 1, kind=kind))
    body = solid_body(mesh, STEEL, name="box", units=UNITS)
    row_of = {int(number): row for row, number in enumerate(mesh.cell_numbers[kind])}
    for triangle, number in zip(body.surface, body.numbering.elements, strict=True):
        owners = np.flatnonzero([np.isin(triangle, cell).all() for cell in mesh.cells[kind]])
        assert owners.tolist() == [row_of[int(number)]]


def test_nodes_and_sets_keep_their_numbers_through_coupling():
    mesh = scrambled(box_mesh(3, 1, 1))
    body = couple(solid_body(mesh, STEEL, name="box", units=UNITS))
    for row in (0, 7, len(mesh.nodes) - 1):
        assert body.numbering.rows_of_node("test", int(mesh.node_numbers[row])).tolist() == [row]
        assert body.numbering.node_name(row) == str(mesh.node_numbers[row])
    assert_array_equal(body.numbering.named_set("test", "left").members, mesh.node_sets["left"])
    half = body.numbering.named_set("test", "left half")
    assert half.kind == "elements"
    assert half.size == len(mesh.cell_sets["left half"]["hexahedron"])
    numbers = mesh.cell_numbers["hexahedron"][mesh.cell_sets["left half"]["hexahedron"]]
    assert set(body.numbering.elements[half.members]) <= set(numbers.tolist())


def frame(numbers=(40, 7, 900), lines=(3, 11)):
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    mesh = LineMesh(nodes, [[0, 1], [1, 2]], {"spar": np.array([0, 1])}, {"mid": np.array([1])},
                    node_numbers=np.array(numbers), line_numbers=np.array(lines))  # fmt: skip
    return beam_body(mesh, BeamProperty(Rectangle(0.03, 0.02), STEEL), name="frame", units=UNITS)


def test_points_of_a_skin_have_the_number_of_the_node_that_moves_them():
    body = frame()
    rows = body.numbering.rows_of_node("test", 7)
    assert rows[0] == 1
    assert body.numbering.on_skin[rows[0]] == 0
    assert (body.numbering.on_skin[rows[1:]] == 1).all()
    assert (body.nodes[rows, 0] == 1.0).all()
    triangles = body.numbering.triangles_of_element("test", 11)
    assert body.nodes[body.surface[triangles]][..., 0].min() == 1.0
    assert_array_equal(body.kept, [0, 1, 2])


def test_the_skin_of_a_shell_knows_cells_and_nodes():
    nodes = np.array([[x, y, 0.0] for y in range(3) for x in range(4)])
    quads = np.array([[4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4] for j in range(2) for i in range(3)])
    numbers = np.arange(12)[::-1] * 3 + 100
    mesh = ShellMesh(nodes, {"quad": quads}, node_numbers=numbers, cell_numbers={"quad": 50 + 2 * np.arange(6)})
    body = shell_body(mesh, ShellProperty(0.01, STEEL), name="plate", units=UNITS)
    for row, point in enumerate(body.nodes):
        at = int(np.flatnonzero(numbers == body.numbering.nodes[row])[0])
        assert np.allclose(point[:2], nodes[at, :2])
    for triangle, number in zip(body.surface, body.numbering.elements, strict=True):
        cell = quads[int(np.flatnonzero(mesh.cell_numbers["quad"] == number)[0])]
        assert set(body.numbering.nodes[triangle]) <= set(numbers[cell].tolist())


def test_bodies_with_the_same_numbers_are_told_apart_by_their_names():
    left, right = (Numbering(nodes=np.array([12, 5, NONE]), elements=np.array([1])) for _ in range(2))
    both = numbering_side_by_side([("A", left, 3, 1), ("B", right, 3, 1)])
    assert [both.node_name(k) for k in (0, 4)] == ["A.12", "B.5"]
    assert both.node_name(2) == "index 2"
    assert both.rows_of_node("test", "B.12").tolist() == [3]
    with pytest.raises(BodyError, match=r"node 12 is there 2 times; name the instance: node = 'A.12' or 'B.12'"):
        both.rows_of_node("test", 12)
    other = Numbering(nodes=np.array([70, 71, 72]), elements=np.array([2]))
    assert numbering_side_by_side([("A", left, 3, 1), ("B", other, 3, 1)]).instances == ()


def test_welded_bodies_keep_numbers_sets_and_kept_nodes():
    ends = [couple(replace(frame(), name=name)) for name in ("one", "two")]
    whole = weld(ends, [], name="both")
    assert whole.numbering.node_name(1) == "one.7"
    row = int(whole.numbering.rows_of_node("test", "two.7")[0])
    assert row in whole.kept
    assert whole.nodes[row, 0] == 1.0
    assert set(whole.numbering.set_names) == {"one.mid", "two.mid", "one.spar", "two.spar"}


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (6, r"no node 6 among the 3 that are kept, from 7 to 900; nearest: 7, 40, 900.*keep = \[6\]"),
        (True, 'expected a whole number, or text "INSTANCE.number", got True'),
        ("seven", 'expected a whole number, or text "INSTANCE.number"'),
        ("P.7", "no instance 'P'"),
    ],
)
def test_a_node_that_is_not_there_is_told_with_the_nearest(asked, words):
    with pytest.raises(BodyError, match=words):
        frame().numbering.rows_of_node("sensor 'tip'", asked)


def test_sets_that_are_empty_or_missing_are_refused():
    numbering = Numbering(sets=(NamedSet("inside", "nodes", np.zeros(0), 4), NamedSet("none", "nodes", np.zeros(0), 0)))
    with pytest.raises(BodyError, match=r'none of its 4 nodes is kept in the body; keep them: keep = \["inside"\]'):
        numbering.named_set("test", "inside")
    with pytest.raises(BodyError, match="set 'none' is empty"):
        numbering.named_set("test", "none")
    with pytest.raises(BodyError, match="did you mean 'inside'"):
        numbering.named_set("test", "insid")
    with pytest.raises(BodyError, match="the body knows no numbers of nodes"):
        numbering.rows_of_node("test", 3)


def test_nodes_are_kept_by_number_set_and_position():
    mesh = scrambled(box_mesh(4, 2, 2))
    body = solid_body(mesh, STEEL, name="box", units=UNITS)
    middle = int(np.flatnonzero((mesh.nodes == [0.5, 0.5, 0.5]).all(axis=1))[0])
    for keep in ([int(mesh.node_numbers[middle])], [mesh.nodes[middle] + 1e-4], ["left", [0.5, 0.5, 0.5]]):
        assert middle in keep_nodes(body, keep).kept
    assert_array_equal(keep_nodes(body, ["left"]).kept, mesh.node_sets["left"])
    for everything in ("all", ["all"]):
        assert_array_equal(keep_nodes(body, everything).kept, np.arange(len(mesh.nodes)))
    with pytest.raises(BodyError, match=rf"no node at \[0.6, 0.5, 0.5\].*nearest: node {mesh.node_numbers[middle]} at"):
        keep_nodes(body, [[0.6, 0.5, 0.5]])
    with pytest.raises(BodyError, match="expected the number of a node, the name of a set, or"):
        keep_nodes(body, [[1.0, 2.0]])


def test_lines_of_a_table_have_the_numbers_of_its_column(tmp_path):
    (tmp_path / "nodes.csv").write_text("node,x,y,z\n5,0,0,0\n9,1,0,0\n2,2,0,0\n")
    (tmp_path / "lines.csv").write_text("line,node1,node2,elements\n70,5,9,2\n31,9,2,1\n")
    mesh = read_tables(tmp_path / "nodes.csv", tmp_path / "lines.csv")
    assert_array_equal(mesh.line_numbers, [70, 70, 31])
    assert_array_equal(mesh.node_numbers, [5, 9, 2, -1])
    body = beam_body(mesh, BeamProperty(Rectangle(0.03, 0.02), STEEL), name="frame", units=UNITS)
    triangles = body.surface[body.numbering.triangles_of_element("test", 31)]
    assert body.nodes[triangles][..., 0].min() == 1.0
    (tmp_path / "lines.csv").write_text("line,node1,node2\n70,5,9\n70,9,2\n")
    with pytest.raises(MeshError, match="a number from 0 of its own for each line"):
        read_tables(tmp_path / "nodes.csv", tmp_path / "lines.csv")


def test_messages_about_members_have_the_numbers_of_the_mesh():
    mesh = scrambled(box_mesh(2, 1, 1))
    shared = [Interface(name, "rigid", np.array([3, 4, 7]), np.zeros(3)) for name in ("a", "b")]
    with pytest.raises(InterfaceError, match=rf"share 3 nodes \(first node {mesh.node_numbers[3]}\)"):
        check_overlap(shared, numbers=mesh.node_numbers)
    body = solid_body(mesh, STEEL, name="box", units=UNITS)
    held = body.K + 1e9 * abs(body.K).max() * np.eye(1, body.n_dof, 3).T @ np.eye(1, body.n_dof, 3)
    with pytest.raises(BodyError, match=rf"row 3 \(node {mesh.node_numbers[1]}, component 0\)"):
        body_from_matrices(body.M, held, body.nodes, body.dofs, name="box", units=UNITS, surface=body.surface,
                           numbering=body.numbering)  # fmt: skip


def test_cells_of_two_types_are_numbered_through():
    one, two = box_mesh(1, 1, 1), box_mesh(1, 1, 1, kind="wedge")
    nodes = np.concatenate([one.nodes, two.nodes + np.array([3.0, 0.0, 0.0])])
    mesh = Mesh(nodes, {"hexahedron": one.cells["hexahedron"], "wedge": two.cells["wedge"] + len(one.nodes)})
    found = facets_of(mesh)
    for triangle, cell in zip(found.triangles, found.cells, strict=True):
        rows = mesh.cells["hexahedron"][cell] if cell == 0 else mesh.cells["wedge"][cell - 1]
        assert set(triangle) <= set(rows)
