"""Cells divided into eight: volume, curved surface, shared nodes, groups, cracks."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.errors import MeshError
from fe_models.meshes.cell_shapes import cell_jacobians, quadrature
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.refined import DIVIDED, refined_mesh
from tests.bodies import box_mesh, distorted


def volumes(mesh, kind):
    points, weights = quadrature(kind)
    J = cell_jacobians(kind, mesh.nodes[mesh.cells[kind]], points)
    assert (J > 0).all()
    return J @ weights


@pytest.mark.parametrize("kind", DIVIDED)
def test_parts_fill_their_curved_cell(kind):
    mesh = distorted(box_mesh(2, 2, 1, kind=kind), amount=0.05)
    fine = refined_mesh(mesh)
    assert len(fine.cells[kind]) == 8 * len(mesh.cells[kind])
    assert_allclose(volumes(fine, kind).reshape(-1, 8).sum(axis=1), volumes(mesh, kind), rtol=1e-12)
    assert len(np.unique(np.round(fine.nodes, 9), axis=0)) == len(fine.nodes)  # every node stands once
    assert set(fine.cells[kind].ravel()) == set(range(len(fine.nodes)))
    left = fine.cell_sets["left half"][kind]
    assert_allclose(volumes(fine, kind)[left].sum(), volumes(mesh, kind)[mesh.cell_sets["left half"][kind]].sum())


def test_divided_twice_is_the_finer_box():
    fine = refined_mesh(refined_mesh(box_mesh(1, 1, 1, kind="hexahedron27")))
    same = box_mesh(4, 4, 4, kind="hexahedron27")
    order = [np.lexsort(np.round(each.nodes, 9).T) for each in (fine, same)]
    assert_allclose(fine.nodes[order[0]], same.nodes[order[1]], atol=1e-12)


def test_cracks_stay_open():
    """Two cells at one place without common nodes stay apart."""
    one = box_mesh(1, 1, 1, kind="tetra10")
    two = Mesh(np.vstack([one.nodes, one.nodes]), {"tetra10": np.vstack([one.cells["tetra10"]] * 2)})
    two = replace(two, cells={"tetra10": np.vstack([one.cells["tetra10"], one.cells["tetra10"] + len(one.nodes)])})
    assert len(refined_mesh(two).nodes) == 2 * len(refined_mesh(one).nodes)


def test_wedges_are_refused():
    with pytest.raises(MeshError, match="got wedge15"):
        refined_mesh(box_mesh(1, 1, 1, kind="wedge15"))
