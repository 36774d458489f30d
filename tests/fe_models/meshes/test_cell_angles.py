import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.checks.mesh_report import face_angles
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.mesh import SOLID_TYPES, Mesh


def one_cell(kind, nodes=None):
    nodes = CELL_SHAPES[kind].nodes if nodes is None else nodes
    return Mesh(nodes, {kind: np.arange(len(nodes))[None]})


def test_faces_of_a_regular_tetrahedron_meet_at_arc_cosine_of_a_third():
    nodes = np.array([[1.0, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    assert_allclose(face_angles(one_cell("tetra", nodes)), np.degrees(np.arccos(1 / 3)), rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("kind", "angles"),
    [("hexahedron", (90, 90)), ("hexahedron20", (90, 90)), ("wedge", (45, 90)), ("tetra10", (54.735610317, 90))],
)
def test_angles_of_the_reference_cells(kind, angles):
    assert_allclose(face_angles(one_cell(kind)), angles, rtol=1e-10, atol=0)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_angles_do_not_change_when_a_cell_is_turned_and_scaled(kind):
    rng = np.random.default_rng(3)
    nodes = CELL_SHAPES[kind].nodes + 0.05 * rng.standard_normal(CELL_SHAPES[kind].nodes.shape)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    assert_allclose(
        face_angles(one_cell(kind, 3.7 * nodes @ turn.T)), face_angles(one_cell(kind, nodes)), rtol=1e-12, atol=0
    )


def test_a_flat_cell_has_an_angle_of_zero_and_one_of_180_degrees():
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0]])
    assert_allclose(face_angles(one_cell("tetra", nodes)), (0, 180), rtol=0, atol=1e-10)
