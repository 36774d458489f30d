"""Geometric stiffness of solid elements as a sparse matrix, for many columns (docs/theory.md §7).

Over the nodes, K_geo(sigma) is S ⊗ 1₃ with S_nm = ∫ grad N_nᵀ sigma grad N_m dV. With n columns and p points per node,
the products of gradients of all pairs (`fe_models.elements.solids.geometric`) take 9 p n² operations, plus 6 p n² for
every state. Phiᵀ (S Phi) takes 3 n² operations for every state, and needs no array of all pairs at a point (1e7 numbers
at n = 2000).
"""

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from fe_models.elements.solids.elements import ShapeTable
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.on_disk import in_memory, row_slices
from fe_models.foundation.threads import n_threads
from fe_models.meshes.mesh import Mesh

__all__ = ["MANY_COLUMNS", "scalar_geometric_matrices", "sparse_geometric_stiffness"]

#: number of columns above which the sparse matrix is faster (`python -m benchmarks.geometric_stiffness columns`)
MANY_COLUMNS = 100
PRODUCT_BYTES = 64e6  #: memory for S times a block of columns


def sparse_geometric_stiffness(matrices: Iterator[sp.csr_array], n_states: int, Phi: Array) -> Array:
    """Return Phiᵀ (S_j ⊗ 1₃) Phi, (n_states, n, n), of scalar matrices S_j and columns Phi, (3 n_nodes, n)."""
    n_nodes, n = len(Phi) // 3, Phi.shape[1]
    width = max(16, int(PRODUCT_BYTES / (24 * max(n_nodes, 1))))
    cuts = np.linspace(0, n_nodes, n_threads() + 1).astype(int)
    K = np.zeros((n_states, n, n))
    with ThreadPoolExecutor(n_threads()) as pool:
        for K_j, S in zip(K, matrices, strict=True):
            parts = [S[a:b] for a, b in pairwise(cuts)]
            for first in range(0, n, width):
                last = min(first + width, n)
                block = np.ascontiguousarray(in_memory(Phi[:, first:last])).reshape(n_nodes, -1)
                product = np.concatenate(list(pool.map(lambda part, block=block: part @ block, parts)))
                product = product.reshape(len(Phi), last - first)
                for rows in row_slices(len(Phi), Phi):
                    K_j[:last, first:last] += Phi[rows, :last].T @ product[rows]
                K_j[first:last, :first] = K_j[:first, first:last].T  # symmetric, so only one half is computed
                own = K_j[first:last, first:last]
                own[:] = (own + own.T) / 2
    return K


def scalar_geometric_matrices(
    mesh: Mesh, tensors: Array, of_cell: Mapping[str, IntArray], tables: Mapping[str, ShapeTable], u: Array
) -> Iterator[sp.csr_array]:
    """Yield S, (n_nodes, n_nodes), for the stress of each state u, (3 n_nodes, k), over the cell types in `tables`.

    Parameters
    ----------
    tensors
        Matrix of every material that maps strain to stress, (n_materials, 6, 6).
    of_cell
        Index of the material of each cell, (n_cells,), by cell type.
    tables
        Quadrature points and gradients of the shape functions, by cell type.
    """
    from fe_models.elements.solids.geometric_kernels import write_scalar_matrices

    n_nodes = len(mesh.nodes)
    states = np.ascontiguousarray(u).reshape(n_nodes, 3, -1)
    rows = [np.repeat(mesh.cells[kind], mesh.cells[kind].shape[1], axis=1).ravel() for kind in tables]
    columns = [np.tile(mesh.cells[kind], mesh.cells[kind].shape[1]).ravel() for kind in tables]
    keys = np.concatenate([np.zeros(0, np.int64), *rows]) * n_nodes + np.concatenate([np.zeros(0, np.int64), *columns])
    places, entry = np.unique(keys, return_inverse=True)
    indptr = np.searchsorted(places // max(n_nodes, 1), np.arange(n_nodes + 1))
    for j in range(states.shape[2]):
        state = np.ascontiguousarray(states[:, :, j : j + 1])
        values = []
        for kind, table in tables.items():
            cells = mesh.cells[kind]
            matrices = np.zeros((len(cells), cells.shape[1], cells.shape[1]))
            write_scalar_matrices(
                mesh.nodes, cells, of_cell[kind], tensors, table.gradients, table.weights, state, matrices
            )
            values.append(matrices.ravel())
        summed = np.bincount(entry, np.concatenate([np.zeros(0), *values]), minlength=len(places))
        yield sp.csr_array((summed, places % max(n_nodes, 1), indptr), shape=(n_nodes, n_nodes))
