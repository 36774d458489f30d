"""Cell types of scikit-fem: elements and node order."""

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES

__all__ = ["SKFEM_ELEMENTS", "skfem_node_order"]

SKFEM_ELEMENTS = {
    "tetra": "ElementTetP1",
    "tetra10": "ElementTetP2",
    "hexahedron": "ElementHex1",
    "hexahedron20": "ElementHexS2",
    "hexahedron27": "ElementHex2",
    "wedge": "ElementWedge1",
}  #: scikit-fem element with the same nodes, by cell type; other cell types use the monomials of their shapes


def skfem_node_order(kind: str) -> IntArray:
    """Return, for each meshio node of a cell type, the local number of the same node in scikit-fem, (n_nodes,)."""
    import skfem

    positions = np.asarray(getattr(skfem, SKFEM_ELEMENTS[kind])().doflocs)
    distance = np.abs(CELL_SHAPES[kind].nodes[:, None] - positions[None]).max(axis=2)
    order = distance.argmin(axis=1)
    if (distance.min(axis=1) > 1e-12).any() or np.unique(order).size != len(positions):
        raise MeshError(f"{kind}: the installed scikit-fem places its nodes elsewhere; expected scikit-fem 10 to 12")
    return order
