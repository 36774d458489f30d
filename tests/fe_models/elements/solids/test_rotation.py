"""Rotation at nodes of solids: exact for rigid rotations and constant strain, of second order for bending."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.elements.solids.body import nodal_rotation
from tests.bodies import box_mesh, distorted

KINDS = ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge", "wedge15"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_field_has_the_rotation_of_its_gradient_at_every_node(kind):
    mesh = distorted(box_mesh(2, 2, 2, kind=kind), amount=0.15)
    H = np.random.default_rng(1).normal(size=(3, 3))
    u = (mesh.nodes @ H.T).reshape(-1, 1)
    expected = 0.5 * np.array([H[2, 1] - H[1, 2], H[0, 2] - H[2, 0], H[1, 0] - H[0, 1]])
    found = nodal_rotation(mesh, u, np.arange(len(mesh.nodes)))
    assert_allclose(found[..., 0], np.tile(expected, (len(mesh.nodes), 1)), rtol=0, atol=1e-12 * np.abs(H).max())


def test_pure_bending_has_the_slope_of_the_axis_where_cells_can_bend():
    """w = x²/2, u = -x z: the rotation about y is -x at every point, and quadratic cells hold the field."""
    mesh = box_mesh(3, 2, 2, kind="hexahedron20")
    x, _, z = mesh.nodes.T
    u = np.stack([-x * z, 0 * x, x**2 / 2], axis=1).reshape(-1, 1)
    nodes = np.array([0, 11, 40, 5])
    found = nodal_rotation(mesh, u, nodes)[..., 0]
    assert_allclose(found, np.stack([0 * nodes, -x[nodes], 0 * nodes], axis=1), rtol=0, atol=1e-12)
