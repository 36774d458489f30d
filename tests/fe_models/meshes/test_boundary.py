import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.elements.solids.elements import reference_element
from fe_models.meshes.boundary import (
    area_centroid,
    boundary_facets,
    boundary_triangles,
    facet_weights,
    facets_of,
    first_of_equal_rows,
)
from fe_models.meshes.cell_shapes import CELL_SHAPES, cell_jacobians, quadrature, shape_values
from fe_models.meshes.mesh import Mesh
from tests.fe_models.small_meshes import SOLID_TYPES, cell_mesh, faced_box

ROUNDOFF = 1e-12
BOX_AREA = 2 * (2 * 1 + 2 * 1.5 + 1 * 1.5)


def enclosed_volume(nodes, triangles):
    """∮ x·n dA / 3 over flat triangles."""
    a, b, c = (nodes[triangles[:, k]] + np.array([3, 5, 7]) for k in range(3))  # a facet through 0 would not count
    return np.einsum("ti,ti->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("kind", CELL_SHAPES)
def test_shape_functions_are_one_at_their_node_and_sum_to_one(kind):
    shape = CELL_SHAPES[kind]
    assert_allclose(shape_values(kind, shape.nodes)[0], np.eye(len(shape.nodes)), rtol=0, atol=ROUNDOFF)
    N, dN = shape_values(kind, quadrature(kind)[0])
    assert_allclose(N.sum(axis=1), 1, rtol=0, atol=ROUNDOFF)
    assert_allclose(dN.sum(axis=1), 0, rtol=0, atol=10 * ROUNDOFF)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_shape_functions_are_those_of_scikit_fem(kind):
    table = reference_element(kind).mass
    N, dN = shape_values(kind, table.points)
    assert_allclose(N, table.values, rtol=0, atol=ROUNDOFF)
    assert_allclose(dN, table.gradients, rtol=0, atol=10 * ROUNDOFF)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_quadrature_of_a_curved_cell_equals_a_rule_of_much_higher_degree(kind):
    rng = np.random.default_rng(1)
    X = CELL_SHAPES[kind].nodes + rng.uniform(-0.05, 0.05, (len(CELL_SHAPES[kind].nodes), 3))
    points, weights = quadrature(kind)
    volume = cell_jacobians(kind, X[None], points)[0] @ weights
    x, w = np.polynomial.legendre.leggauss(8)
    x, w = (x + 1) / 2, w / 2
    cube = np.stack(np.meshgrid(x, x, x, indexing="ij"), -1).reshape(-1, 3)
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
    if kind.startswith("tetra"):  # collapse the cube: x, y (1 - x), z (1 - x)(1 - y)
        weight = weight * (1 - cube[:, 0]) ** 2 * (1 - cube[:, 1])
        cube = np.column_stack(
            [cube[:, 0], cube[:, 1] * (1 - cube[:, 0]), cube[:, 2] * (1 - cube[:, 0]) * (1 - cube[:, 1])]
        )
    elif kind.startswith("wedge"):
        weight = weight * (1 - cube[:, 0])
        cube = np.column_stack([cube[:, 0], cube[:, 1] * (1 - cube[:, 0]), cube[:, 2]])
    elif kind.startswith("pyramid"):
        weight = weight * (1 - cube[:, 2]) ** 2
        cube = np.column_stack([cube[:, :2] * (1 - cube[:, 2:]), cube[:, 2]])
    assert_allclose(volume, cell_jacobians(kind, X[None], cube)[0] @ weight, rtol=1e-12, atol=0)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_boundary_of_a_box_is_outward_and_has_its_area(kind):
    mesh = faced_box(kind, (3, 2, 2))
    facets = boundary_facets(mesh)
    assert_allclose(enclosed_volume(mesh.nodes, boundary_triangles(mesh)), 3.0, rtol=100 * ROUNDOFF, atol=0)
    assert_allclose(facet_weights(mesh.nodes, facets).sum(), BOX_AREA, rtol=ROUNDOFF, atol=0)
    area, centroid = area_centroid(mesh.nodes, facets)
    assert_allclose(area, BOX_AREA, rtol=ROUNDOFF, atol=0)
    assert_allclose(centroid, [1, 0.5, 0.75], rtol=ROUNDOFF, atol=0)


def test_cached_facets_are_read_only():
    found = facets_of(faced_box("tetra"))
    for array in (*found.boundary.values(), found.triangles, found.cells, found.pairs):
        assert not array.flags.writeable


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_boundary_facets_keep_middle_nodes_between_their_corners(kind):
    mesh = faced_box(kind)
    for face_kind, rows in boundary_facets(mesh).items():
        shape = CELL_SHAPES[face_kind]
        for place, parents in enumerate(shape.middles, start=len(shape.corners)):
            expected = mesh.nodes[rows[:, list(parents)]].mean(axis=1)
            assert_allclose(mesh.nodes[rows[:, place]], expected, rtol=0, atol=ROUNDOFF)


def test_boundary_of_a_mixed_mesh_hides_the_facets_between_cell_types():
    hexes, wedges = faced_box("hexahedron", (1, 1, 1), (1, 1, 1)), faced_box("wedge", (1, 1, 1), (1, 1, 1))
    nodes = np.concatenate([hexes.nodes, wedges.nodes + np.array([1, 0, 0])])
    unique, number = np.unique(np.rint(nodes), axis=0, return_inverse=True)
    mesh = Mesh(
        unique,
        {"hexahedron": number[hexes.cells["hexahedron"]], "wedge": number[wedges.cells["wedge"] + len(hexes.nodes)]},
    )
    assert_allclose(facet_weights(mesh.nodes, boundary_facets(mesh)).sum(), 10.0, rtol=ROUNDOFF, atol=0)
    assert_allclose(enclosed_volume(mesh.nodes, boundary_triangles(mesh)), 2.0, rtol=100 * ROUNDOFF, atol=0)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_drawing_triangles_cover_the_flat_faces_of_a_cell_once(kind):
    mesh = cell_mesh(kind)
    triangles, facets = boundary_triangles(mesh), boundary_facets(mesh)
    a, b, c = (mesh.nodes[triangles[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a) / 2
    assert (np.einsum("td,td->t", areas, a - mesh.nodes.mean(axis=0)) > 0).all()
    assert_allclose(np.linalg.norm(areas, axis=1).sum(), area_centroid(mesh.nodes, facets)[0], rtol=ROUNDOFF, atol=0)
    assert_array_equal(np.unique(triangles), np.unique(np.concatenate([rows.ravel() for rows in facets.values()])))


def test_corners_of_flat_quadratic_triangles_weigh_nothing_and_middles_a_third():
    nodes = np.column_stack([CELL_SHAPES["triangle6"].nodes, np.zeros(6)])
    weights = facet_weights(nodes, {"triangle6": np.arange(6)[None]})
    assert_array_equal(weights[:3], 0)
    assert_allclose(weights[3:], 1 / 6, rtol=ROUNDOFF, atol=0)


def test_weights_of_quadratic_quads_are_positive_and_sum_to_the_area():
    nodes = np.column_stack([CELL_SHAPES["quad8"].nodes, np.zeros(8)])
    weights = facet_weights(nodes, {"quad8": np.arange(8)[None]})
    assert (weights > 0).all()
    assert_allclose(weights.sum(), 1, rtol=ROUNDOFF, atol=0)


def test_equal_rows_are_found_in_any_place():
    classes, count = first_of_equal_rows(np.array([[1, 2], [0, 5], [1, 2], [0, 4]]))
    assert classes[0] == classes[2]
    assert len(count) == 3
    assert_array_equal(np.sort(count), [1, 1, 2])
