"""An ordering of dofs that places neighbours near each other, whatever the order of the nodes in the file.

A product with a sparse matrix reads the vector in the order of the numbering. Mesh programs number nodes corner by
corner, then edge by edge, so neighbours lie tens of thousands of rows apart and every read misses the cache. In reverse
Cuthill-McKee order they lie within a band.
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fe_models.body.couplings.submatrix import principal_block
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.ranks.spread_matrix import SpreadMatrix

__all__ = ["nearby_order"]

SMALL = 20_000  #: number of dofs below which the columns stay in the cache in any order


def nearby_order(A: sp.csc_array, dofs: IntArray, index: IntArray) -> IntArray:
    """Return dofs in an order that places neighbours near each other; small or distributed sets keep their order.

    (1) build the graph of the nodes from the entries of A between the first given dof of each node
    (2) order the nodes by reverse Cuthill-McKee
    (3) list the dofs node by node; nodes that do not have exactly the dofs ux, uy, uz come last, so that the mass of a
        solid begins with M_s ⊗ 1₃ (`scalar_part`)

    Parameters
    ----------
    A
        Symmetric, over all dofs, (n_dof, n_dof).
    dofs
        (node, component) of all dofs, (n_dof, 2).
    index
        The dofs to order, ascending, (n,).
    """
    if isinstance(A, SpreadMatrix):
        return A.ordered(index)
    if len(index) < SMALL:
        return index
    node, component = dofs[index].T
    by_node = np.lexsort((component, node))
    nodes, first, counts = np.unique(node[by_node], return_index=True, return_counts=True)
    graph = principal_block(A, index[by_node[first]])  # (1)
    rank = np.empty(len(nodes), np.int64)
    rank[reverse_cuthill_mckee(sp.csr_array((graph.data, graph.indices, graph.indptr)), symmetric_mode=True)] = (
        np.arange(len(nodes))
    )  # (2)
    is_solid = (counts == 3) & (np.add.reduceat(1 << (component[by_node] + 1), first) == 0b1110)
    of_dof = np.searchsorted(nodes, node)
    return index[np.lexsort((component, rank[of_dof], ~is_solid[of_dof]))]  # (3)
