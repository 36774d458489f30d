"""Strain at the nodes of solids, from their stress."""

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.solids.body import SolidModel
from fe_models.weld import WeldedModel

__all__ = ["node_compliances"]


def node_compliances(body: FEBody, nodes: IntArray) -> Array:
    """Return strain by stress at nodes, (n, 6, 6) [1/Pa], xx yy zz yz xz xy, shear strains doubled.

    The stress of a node is the mean over elements of one material, so that its strain is the mean of their strains.

    Raises
    ------
    BodyError
        If a node is of no solid: the strain of beams and shells is not known at nodes.
    """
    return np.array([_compliance(body, int(node)) for node in nodes]).reshape(-1, 6, 6)


def _compliance(body: FEBody, node: int) -> Array:
    model, row = body.element_model, node
    if isinstance(model, WeldedModel):
        first = np.cumsum([0, *model.n_nodes])
        part = int(np.searchsorted(first, node, side="right")) - 1
        model, row = (model.parts[part], node - int(first[part])) if part < len(model.parts) else (None, 0)
    if not isinstance(model, SolidModel) or row >= len(model.mesh.nodes):
        raise BodyError(
            f"body {body.name!r}: strain: node {node} is of no solid elements; ask for its stress, or for the forces "
            "in beams and shells"
        )
    return np.asarray(np.linalg.inv(model.materials[model.of_node[row]].stiffness), np.float64)
