"""Parts of large sparse matrices in one pass, where SciPy's indexing needs several, and the order of their rows."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.spread_matrix import SpreadBlock
from fe_models.foundation.tall.columns import elsewhere
from fe_models.foundation.threads import in_threads

__all__ = ["PrincipalBlock", "nearby_order", "principal_block", "scalar_part", "spread_block"]

SMALL = 200_000  #: number of stored entries below which compiled loops cost more than they save


@dataclass(frozen=True, eq=False)
class PrincipalBlock:
    """The submatrix A[index][:, index], (n, n); provides products and the diagonal without computing the submatrix."""

    A: sp.csc_array
    index: IntArray  #: rows and columns in any order, each once, (n,)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.index), len(self.index)

    def diagonal(self) -> Array:
        """Return the diagonal, (n,)."""
        return np.asarray(self.A.diagonal()[self.index])

    def __matmul__(self, x: Array) -> Array:
        """Return the product with one column (n,) or many (n, k)."""
        return np.asarray((self.A @ self.expanded(x))[self.index])

    def expanded(self, x: Any) -> Any:
        """Extend one column (n,) or many (n, k) to all rows of A, with zeros outside the submatrix.

        Columns that are distributed like the submatrix stay distributed.
        """
        if elsewhere(x) is not None and (block := spread_block(self)) is not None:
            return block.expanded(x)
        whole = np.zeros((self.A.shape[0], *x.shape[1:]))
        whole[self.index] = x
        return whole


def spread_block(A: Any) -> SpreadBlock | None:
    """Return a submatrix distributed over ranks; None for other matrices, and for submatrices in another order."""
    return A.A.block(A.index) if isinstance(A, PrincipalBlock) and not sp.issparse(A.A) else None


def principal_block(A: sp.csc_array, index: IntArray) -> sp.csc_array:
    """Return A[index][:, index], (n, n), with sorted row indices; the index may have any order."""
    if not sp.issparse(A):
        A = A.whole()
    n = len(index)
    if n == A.shape[0] and (index[1:] > index[:-1]).all():
        return A
    if A.nnz < SMALL:
        block = sp.csc_array(A[:, index])[index]
        block.sort_indices()
        return block
    from fe_models.foundation.sparse.sparse_kernels import column_counts, column_entries

    new_row = np.full(A.shape[0], -1, A.indices.dtype)
    new_row[index] = np.arange(n)
    counts = np.empty(n, A.indptr.dtype)
    in_threads(column_counts, (A.indptr, A.indices, index, new_row), (counts,))
    indptr = np.zeros(n + 1, A.indptr.dtype)
    np.cumsum(counts, out=indptr[1:])
    indices, data = np.empty(indptr[-1], A.indices.dtype), np.empty(indptr[-1])
    in_threads(column_entries, (A.indptr, A.indices, A.data, index, new_row), (indptr, indices, data))
    block = sp.csc_array((data, indices, indptr), shape=(n, n))
    block.has_sorted_indices = True
    return block


def scalar_part(A: sp.csc_array) -> sp.csr_array:
    """Return the largest S, (p, p), with A[:3p, :3p] = S ⊗ 1₃ exactly, such as the scalar mass of a solid.

    Parameters
    ----------
    A
        Symmetric matrix, (n, n), dofs node by node. p is 0 if the first three dofs do not form such a block, or if the
        row indices are not sorted.
    """
    from fe_models.foundation.sparse.sparse_kernels import n_scalar_nodes, scalar_entries

    p = n_scalar_nodes(A.indptr, A.indices, A.data) if A.has_sorted_indices else 0
    indptr = np.zeros(p + 1, A.indptr.dtype)
    scalar_entries(A.indptr, A.indices, A.data, p, indptr, A.indices[:0], A.data[:0])
    indices, data = np.empty(indptr[-1], A.indices.dtype), np.empty(indptr[-1])
    scalar_entries(A.indptr, A.indices, A.data, p, indptr, indices, data)
    return sp.csr_array((data, indices, indptr), shape=(p, p))


# an ordering of dofs that places neighbours near each other, for any order of the nodes in the file -------------------
# A product with a sparse matrix reads the vector in the order of the numbering. Mesh programs number nodes corner by
# corner, then edge by edge, so neighbours lie tens of thousands of rows apart and every read misses the cache. In
# reverse Cuthill-McKee order they lie within a band.


FEW_DOFS = 20_000  #: number of dofs below which the columns stay in the cache in any order


def nearby_order(A: sp.csc_array, dofs: IntArray, index: IntArray) -> IntArray:
    """Return dofs in an order that places neighbours near each other; small or distributed sets keep their order.

    (1) build the graph of the nodes from the entries of A between the first given dof of each node
    (2) order the nodes by reverse Cuthill-McKee
    (3) list the dofs node by node; nodes that do not have exactly the dofs ux, uy, uz come last, so that the mass of a
        solid begins with M_s ⊗ 1₃ (`scalar_part`)

    Parameters
    ----------
    A
        Symmetric matrix over all dofs, (n_dof, n_dof).
    dofs
        (node, component) of all dofs, (n_dof, 2).
    index
        Dofs to order, ascending, (n,).
    """
    if not sp.issparse(A):
        return A.ordered(index)
    if len(index) < FEW_DOFS:
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
