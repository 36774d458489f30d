"""The volume a node stands for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.body.couplings.couplings import couple
from fe_models.elements.solids.body import node_volumes
from tests.bodies import bar, box_mesh

KINDS = ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge"]


@pytest.mark.parametrize("kind", KINDS)
def test_volumes_are_positive_and_sum_to_that_of_the_body(kind):
    mesh = box_mesh(3, 2, 2, 1.0, 0.6, 0.5, kind)
    volumes = node_volumes(mesh)
    assert (volumes > 0).all()
    assert_allclose(volumes.sum(), 0.3, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_volumes_have_the_symmetry_of_the_mesh(kind):
    """Point symmetry about the middle of the box maps these meshes onto themselves."""
    mesh = box_mesh(2, 2, 2, 1.0, 0.6, 0.5, kind)
    volumes = node_volumes(mesh)
    mirrored = [1.0, 0.6, 0.5] - mesh.nodes
    partner = np.linalg.norm(mesh.nodes[:, None] - mirrored[None], axis=2).argmin(axis=0)
    assert_allclose(volumes[partner], volumes, rtol=1e-12)


def test_corners_of_one_brick_share_its_volume_equally():
    assert_allclose(node_volumes(box_mesh(1, 1, 1, 1.0, 2.0, 4.0, "hexahedron")), np.ones(8), rtol=1e-12)


def test_reference_nodes_of_couplings_stand_for_no_volume():
    body = bar(nx=2, kind="hexahedron")
    assert_allclose(couple(body).node_volumes, [*body.node_volumes, 0, 0], rtol=0, atol=0)
