import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.couplings.couplings import check_overlap
from fe_models.body.fe_body import Interface
from fe_models.elements.interfaces import distributing_interface, nodes_interface, rigid_interface
from fe_models.errors import InterfaceError
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.mesh import Mesh, drop_unused_nodes
from fe_models.meshes.selections import Box, Cylinder, FaceGroup, NearestNode, NodeSet, Plane, selected_facets
from tests.fe_models.small_meshes import SOLID_TYPES, cell_mesh, faced_box

ROUNDOFF = 1e-12
END = Plane((2, 0, 0), (1, 0, 0))
END_CENTRE = [2, 0.5, 0.75]


def ring(n_around=12, length=2.0):
    """A thick tube of hexahedra about the z axis through (1, 2, 0), inner radius 1, outer radius 2."""
    angle = 2 * np.pi * np.arange(n_around) / n_around
    layers = []
    for z in (0.0, length):
        for r in (1.0, 2.0):
            layers.append(np.column_stack([1 + r * np.cos(angle), 2 + r * np.sin(angle), np.full(n_around, z)]))
    k = np.arange(n_around)
    following = (k + 1) % n_around
    lower = [k, k + n_around, following + n_around, following]
    cells = np.column_stack([*lower, *(nodes + 2 * n_around for nodes in lower)])
    return Mesh(np.concatenate(layers), {"hexahedron": cells}, source="ring")


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_plane_and_face_group_select_the_same_nodes(kind):
    mesh = faced_box(kind)
    expected = np.flatnonzero(np.abs(mesh.nodes[:, 0] - 2) < 1e-12)
    assert_array_equal(END.members(mesh), expected)
    assert_array_equal(FaceGroup("right face").members(mesh), expected)
    assert_array_equal(Box((2, 0, 0), (2, 1, 1.5)).members(mesh), expected)


def test_geometry_chooses_nodes_of_the_surface_only():
    mesh = faced_box("hexahedron27", (1, 1, 1))  # node 26 stands in the middle of the cell
    middle = Plane((1, 0.5, 0.75), (0, 0, 1)).members(mesh)
    inside = np.flatnonzero(np.abs(mesh.nodes - [1, 0.5, 0.75]).max(axis=1) < 1e-12)
    assert inside.size == 1
    assert inside[0] not in middle
    assert middle.size == 8


def test_cylinder_selects_the_bore_within_its_span():
    mesh = ring()
    bore = Cylinder((1, 2, -5), (0, 0, 3), 1.0).members(mesh)
    assert_allclose(np.linalg.norm(mesh.nodes[bore, :2] - [1, 2], axis=1), 1, rtol=ROUNDOFF, atol=0)
    assert bore.size == 24
    low = Cylinder((1, 2, 0), (0, 0, 1), 1.0, span=(-0.1, 0.1)).members(mesh)
    assert low.size == 12
    assert_array_equal(mesh.nodes[low, 2], 0)


def test_nearest_node_is_one_node():
    mesh = faced_box("tetra")
    assert_array_equal(mesh.nodes[NearestNode((1.9, 0.9, 1.6)).members(mesh)], [[2, 1, 1.5]])


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_default_reference_is_the_area_centroid(kind):
    for make in (rigid_interface, distributing_interface, nodes_interface):
        interface = make(faced_box(kind, (2, 1, 2)), "end", END)
        assert_allclose(interface.reference, END_CENTRE, rtol=0, atol=ROUNDOFF)


def test_area_centroid_is_not_the_mean_of_the_nodes():
    nodes = CELL_SHAPES["hexahedron"].nodes.copy()
    nodes[[5, 6], 1] = [0.25, 0.75]  # the end x = 1 becomes a trapezoid of widths 1 and 1/2 from z = 0 to 1
    interface = rigid_interface(cell_mesh("hexahedron", nodes), "end", Plane((1, 0, 0), (1, 0, 0)))
    assert_allclose(interface.reference, [1, 0.5, 4 / 9], rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_weighted_mean_of_the_members_is_the_area_centroid(kind):
    mesh = faced_box(kind, (2, 1, 2))
    interface = distributing_interface(mesh, "end", FaceGroup("right face"))
    assert_allclose(interface.weights @ mesh.nodes[interface.nodes], END_CENTRE, rtol=0, atol=ROUNDOFF)
    assert_allclose(interface.weights.sum(), 1, rtol=ROUNDOFF, atol=0)


def test_distributing_weights_of_a_quadratic_tetrahedron_mesh_lie_on_the_middle_nodes():
    mesh = faced_box("tetra10", (1, 1, 1), (1, 1, 1))
    interface = distributing_interface(mesh, "end", Plane((1, 0, 0), (1, 0, 0)))
    at_corner = (np.abs(mesh.nodes[interface.nodes] - 0.5) == 0.5).all(axis=1)
    assert_array_equal(interface.weights[at_corner], 0)  # they stay members
    on_diagonal = (mesh.nodes[interface.nodes][:, 1:] == 0.5).all(axis=1)
    assert_allclose(interface.weights[on_diagonal], 1 / 3, rtol=ROUNDOFF, atol=0)  # in both triangles
    assert_allclose(interface.weights[~at_corner & ~on_diagonal], 1 / 6, rtol=ROUNDOFF, atol=0)


def test_linear_faces_over_quadratic_cells_select_the_middle_nodes():
    mesh = faced_box("tetra10")
    linear = Mesh(
        mesh.nodes,
        mesh.cells,
        {},
        {"triangle": mesh.faces["triangle6"][:, :3]},
        {"end": {"triangle": mesh.face_sets["right face"]["triangle6"]}},
        {},
        source="box",
    )
    assert_array_equal(FaceGroup("end").members(linear), FaceGroup("right face").members(mesh))
    assert list(selected_facets(linear, FaceGroup("end"))) == ["triangle6"]


def test_reference_and_triad_are_those_of_the_user():
    triad = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    interface = rigid_interface(faced_box("tetra"), "end", END, reference=(3, 0, 0), triad=triad)
    assert_array_equal(interface.reference, [3, 0, 0])
    assert_array_equal(interface.triad, triad)
    assert interface.kind == "rigid"


def test_nodes_without_a_facet_have_their_mean_as_reference():
    mesh = faced_box("hexahedron")
    edge = Box((0, 0, 0), (2, 0, 0))
    assert_allclose(nodes_interface(mesh, "edge", edge).reference, [1, 0, 0], rtol=0, atol=ROUNDOFF)


def message(make, *arguments, **options):
    with pytest.raises(InterfaceError) as caught:
        make(*arguments, **options)
    return str(caught.value)


def test_unknown_face_group_names_the_nearest():
    text = message(rigid_interface, faced_box("tetra"), "end", FaceGroup("rigth face"))
    assert "interface 'end': no face group 'rigth face'; did you mean 'right face'?" in text
    assert "left face" in text


def test_unknown_node_set_names_the_nearest():
    assert "did you mean 'left'" in message(rigid_interface, faced_box("tetra"), "end", NodeSet("lefd"))


def test_group_of_another_kind_is_named_as_such():
    assert "('right face' is a face group)" in message(
        rigid_interface, faced_box("tetra"), "end", NodeSet("right face")
    )
    assert "('left half' is a cell group)" in message(
        rigid_interface, faced_box("tetra"), "end", FaceGroup("left half")
    )


def test_empty_plane_says_where_the_body_is():
    text = message(rigid_interface, faced_box("tetra"), "end", Plane((2.5, 0, 0), (1, 0, 0)))
    assert "lies between -2.5 and -0.5 along the normal" in text
    assert "nearest node is 0.5 away" in text


def test_empty_cylinder_says_how_far_the_nearest_node_is():
    assert "differs by 0.5" in message(rigid_interface, ring(), "bore", Cylinder((1, 2, 0), (0, 0, 1), 1.5))
    text = message(rigid_interface, ring(), "bore", Cylinder((1, 2, 0), (0, 0, 1), 1.0, span=(5, 6)))
    assert "the body lies between 0 and 2" in text


def test_empty_box_says_where_the_body_is():
    text = message(rigid_interface, faced_box("tetra"), "end", Box((3, 0, 0), (4, 1, 1)))
    assert "from (0, 0, 0) to (2, 1, 1.5), the nearest node is 1 away" in text


@pytest.mark.parametrize(
    "selection",
    [
        Plane((0, 0, np.nan), (1, 0, 0)),
        Plane((0, 0, 0), (0, 0, 0)),
        Plane((0, 0, 0), (1, 0, 0), tolerance=-1),
        Cylinder((0, 0, 0), (0, 0, 1), 0.0),
        Box((1, 0, 0), (0, 1, 1)),
        NearestNode((0, np.inf, 0)),
    ],
)
def test_impossible_geometry_is_refused(selection):
    assert "expected" in message(rigid_interface, faced_box("tetra"), "end", selection)


@pytest.mark.parametrize(
    ("selection", "words"),
    [
        (NearestNode((0, 0, 0)), "got 1"),
        (Box((0, 0, 0), (1, 0, 0)), "got 2"),
        (Box((0, 0, 0), (2, 0, 0)), "3 nodes lie on one line"),
    ],
)
def test_rigid_interface_with_too_few_or_collinear_nodes_is_refused(selection, words):
    assert words in message(rigid_interface, faced_box("hexahedron"), "end", selection)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_collinear_is_judged_by_size_and_place(scale):
    mesh = faced_box("hexahedron")
    moved = Mesh((mesh.nodes * [1, 0.1, 0.1] + [5, 5, 5]) * scale, mesh.cells, source="box")
    line = Box(tuple(np.array([5, 5, 5]) * scale), tuple(np.array([7, 5, 5]) * scale))
    assert "lie on one line" in message(rigid_interface, moved, "edge", line)
    assert rigid_interface(moved, "end", Plane(tuple(np.array([7, 5, 5]) * scale), (1, 0, 0))).nodes.size == 4


def test_distributing_interface_without_a_facet_is_refused():
    assert "no complete facet" in message(
        distributing_interface, faced_box("hexahedron"), "edge", Box((0, 0, 0), (2, 0, 0))
    )


def test_distributing_interface_whose_weights_lie_on_a_line_is_refused():
    nodes = CELL_SHAPES["hexahedron"].nodes * [1, 1e-8, 1]
    assert "lie on one line" in message(
        distributing_interface, cell_mesh("hexahedron", nodes), "sliver", Plane((0, 0, 1), (0, 0, 1))
    )


def test_group_on_nodes_outside_the_solid_is_refused():
    mesh = faced_box("tetra")
    loose = Mesh(np.vstack([mesh.nodes, [9, 9, 9]]), mesh.cells, node_sets={"reference": [len(mesh.nodes)]})
    assert "1 of its nodes belong to no solid cell" in message(nodes_interface, loose, "end", NodeSet("reference"))
    clean = drop_unused_nodes(loose)
    assert "node set 'reference' is empty; nodes that belong" in message(
        nodes_interface, clean, "end", NodeSet("reference")
    )


def test_triad_that_is_no_rotation_is_refused():
    assert "triad: expected orthonormal" in message(
        rigid_interface, faced_box("tetra"), "end", END, triad=np.diag([1, 1, -1])
    )
    assert "reference: expected three" in message(rigid_interface, faced_box("tetra"), "end", END, reference=(1, 2))


def test_overlapping_interfaces_are_named_with_the_count_of_shared_nodes():
    mesh = faced_box("hexahedron")
    end = rigid_interface(mesh, "end", END)
    side = rigid_interface(mesh, "side", Plane((0, 0, 0), (0, 1, 0)))
    far = rigid_interface(mesh, "far", NodeSet("left"))
    text = message(check_overlap, [end, side, far])
    assert "'end' and 'side' share 2 nodes" in text
    assert "'side' and 'far' share 2 nodes" in text
    assert "'end' and 'far'" not in text
    check_overlap([end, far])


def test_two_interfaces_of_one_name_are_refused():
    one = Interface("pin", "nodes", np.array([0]), np.zeros(3))
    two = Interface("pin", "nodes", np.array([1]), np.zeros(3))
    assert "two are named 'pin'" in message(check_overlap, [one, two])
