"""A wrong order of middle nodes is seen whatever the size of the mesh, and a sound mesh never taken for one."""

import numpy as np
import pytest

from fe_models.errors import MeshError
from fe_models.meshes.cells.raw_mesh import require_node_order
from tests.bodies import box_mesh


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e4])
@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "wedge15", "pyramid13", "hexahedron27"])
def test_two_middle_nodes_in_each_others_place_are_named(kind, size):
    mesh = box_mesh(2, 1, 1, 1.0, 0.7, 1.3, kind)
    nodes, cells = size * (mesh.nodes + 5.0), mesh.cells[kind]
    require_node_order("m", kind, nodes, cells)
    n = {"tetra10": 4, "wedge15": 6, "pyramid13": 5}.get(kind, 8)
    swapped = cells.copy()
    swapped[:, [n, n + 1]] = cells[:, [n + 1, n]]
    told = f"node {n + 1} of the cells should lie between their nodes 1 and 2, in {len(cells)}"
    with pytest.raises(MeshError, match=told):
        require_node_order("m", kind, nodes, swapped)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4])
def test_middle_nodes_off_their_places_are_no_other_order(size):
    mesh = box_mesh(2, 2, 1, kind="hexahedron20")
    moved = mesh.nodes + 0.05 * np.random.default_rng(1).normal(size=mesh.nodes.shape)
    require_node_order("m", "hexahedron20", size * moved, mesh.cells["hexahedron20"])
