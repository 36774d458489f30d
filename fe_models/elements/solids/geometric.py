"""Geometric stiffness of solid elements: Phiᵀ K_geo(sigma_j) Phi of many states j in one pass (docs/theory.md §7).

K_geo(sigma)_kl = ∫ sigma_ab Σ_c phi_k,c,a phi_l,c,b dV is linear in the stress. The products of gradients of a pair of
columns do not depend on the state. They are therefore computed once at every point, and one matrix product with the
stress of all states sums over the points. With very many columns these products dominate the cost; a sparse matrix is
then assembled for each state.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from fe_models.body.material import AnyMaterial
from fe_models.elements.solids.assembly_on_ranks import MeshPart, SpreadMesh
from fe_models.elements.solids.elements import ShapeTable, reference_element
from fe_models.elements.solids.incompatible import KIND, brick_chunks, brick_operators, gradient_stress
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.ranks.product import Halo
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows
from fe_models.foundation.ranks.spread_columns import Part, SpreadColumns, own_part, spread_columns
from fe_models.foundation.tall.columns import in_memory
from fe_models.foundation.tall.on_disk import row_slices
from fe_models.foundation.threads import n_threads, one_blas_thread
from fe_models.meshes.cell_shapes import CELL_SHAPES, shape_values
from fe_models.meshes.mesh import Mesh

__all__ = [
    "MANY_COLUMNS",
    "integrated_cells",
    "projected_geometric_stiffness",
    "scalar_geometric_matrices",
    "sparse_geometric_stiffness",
    "spread_geometric_stiffness",
]


# geometric stiffness of solid elements as a sparse matrix, for many columns (docs/theory.md §7) -----------------------
# Over the nodes, K_geo(sigma) is S ⊗ 1₃ with S_nm = ∫ grad N_nᵀ sigma grad N_m dV. With n columns and p points per
# node, the products of gradients of all pairs (`fe_models.elements.solids.geometric`) take 9 p n² operations, plus 6 p
# n² for every state. Phiᵀ (S Phi) takes 3 n² operations for every state, and needs no array of all pairs at a point
# (1e7 numbers at n = 2000).


#: number of columns above which the sparse matrix is faster (`python -m benchmarks.geometric_stiffness columns`)
MANY_COLUMNS = 100
PRODUCT_BYTES = 64e6  #: size of S times a block of columns [bytes]


def sparse_geometric_stiffness(matrices: Iterator[sp.csr_array], n_states: int, Phi: Array) -> Array:
    """Return Phiᵀ (S_j ⊗ 1₃) Phi, (n_states, n, n), for scalar matrices S_j and columns Phi, (3 n_nodes, n)."""
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


class IntegratedCells(NamedTuple):
    """Cells of one type with the same quadrature points."""

    cells: IntArray  #: nodes of each cell, (n_cells, n_nodes)
    material: IntArray  #: material index of each cell, (n_cells,)
    table: ShapeTable


def scalar_geometric_matrices(
    nodes: Array, tensors: Array, parts: Sequence[IntegratedCells], u: Array
) -> Iterator[sp.csr_array]:
    """Yield S, (n_nodes, n_nodes), of these cells for the stress of each state u, (3 n_nodes, k).

    Parameters
    ----------
    nodes
        Positions, (n_nodes, 3).
    tensors
        Matrix of every material that maps strain to stress, (n_materials, 6, 6).
    parts
        Cells with their quadrature.
    """
    from fe_models.elements.solids.stress_kernels import write_scalar_matrices

    n_nodes = len(nodes)
    states = np.ascontiguousarray(u).reshape(n_nodes, 3, -1)
    rows = [np.repeat(cells, cells.shape[1], axis=1).ravel() for cells, _, _ in parts]
    columns = [np.tile(cells, cells.shape[1]).ravel() for cells, _, _ in parts]
    keys = np.concatenate([np.zeros(0, np.int64), *rows]) * n_nodes + np.concatenate([np.zeros(0, np.int64), *columns])
    places, entry = np.unique(keys, return_inverse=True)
    indptr = np.searchsorted(places // max(n_nodes, 1), np.arange(n_nodes + 1))
    for j in range(states.shape[2]):
        state = np.ascontiguousarray(states[:, :, j : j + 1])
        values = []
        for cells, material, table in parts:
            matrices = np.zeros((len(cells), cells.shape[1], cells.shape[1]))
            write_scalar_matrices(nodes, cells, material, tensors, table.gradients, table.weights, state, matrices)
            values.append(matrices.ravel())
        summed = np.bincount(entry, np.concatenate([np.zeros(0), *values]), minlength=len(places))
        yield sp.csr_array((summed, places % max(n_nodes, 1), indptr), shape=(n_nodes, n_nodes))


# geometric ------------------------------------------------------------------------------------------------------------


#: distance of a mid-side node from the middle of its edge, divided by the cell size, above which a tetrahedron is
#: curved; for cells below it, the geometric stiffness has a relative error of this size in a rotation
CURVED = 1e-9
CHUNK_BYTES = 1.5e6  #: size of the products that a thread has at a time; they must fit in its cache [bytes]


def projected_geometric_stiffness(
    mesh: Mesh,
    materials: tuple[AnyMaterial, ...],
    of_cell: Mapping[str, IntArray],
    u: Array,
    Phi: Array,
    *,
    incompatible: bool = False,
    integration: str = "full",
) -> Array:
    """Return Phiᵀ K_geo(sigma_j) Phi, (k, n, n), for the stress of states u, (3 n_nodes, k).

    Parameters
    ----------
    mesh, materials, of_cell
        As in `fe_models.elements.solids.stress.nodal_stress`.
    u
        Displacements of the states, dof 3 i + c is component c of node i, (3 n_nodes, k).
    Phi
        Columns, (3 n_nodes, n).
    incompatible
        Whether eight-node bricks have incompatible modes. The stress then acts on the gradients of their complete
        field.
    integration
        Integration of the stiffness, one of `fe_models.elements.solids.elements.INTEGRATIONS`.
    """
    n_nodes, n = len(mesh.nodes), Phi.shape[1]
    tensors = np.array([material.stiffness for material in materials])
    parts = [
        part
        for kind in mesh.cells
        if not (incompatible and kind == KIND)
        for part in integrated_cells(mesh, kind, of_cell, integration)
    ]
    if n >= MANY_COLUMNS:
        matrices = scalar_geometric_matrices(mesh.nodes, tensors, parts, u)
        K = sparse_geometric_stiffness(matrices, u.shape[1], Phi)
        if incompatible and len(mesh.cells.get(KIND, ())):
            K += _of_bricks(mesh.nodes, mesh.cells[KIND], tensors[of_cell[KIND]], u, Phi)
        return K
    states = np.ascontiguousarray(u).reshape(n_nodes, 3, -1)
    columns = np.ascontiguousarray(Phi).reshape(n_nodes, 3, -1)
    pairs = np.zeros((states.shape[2], n * (n + 1) // 2))
    n_parts = n_threads()
    with one_blas_thread(), ThreadPoolExecutor(n_parts) as pool:
        for cells, material, table in parts:
            cuts = np.linspace(0, len(cells), n_parts + 1).astype(int)
            futures = [
                pool.submit(_pairs_of, mesh.nodes, cells[a:b], material[a:b], tensors, table, states, columns)
                for a, b in pairwise(cuts)
                if b > a
            ]
            for future in futures:  # summed in this order, so that results are bitwise reproducible
                pairs += future.result()
    K = np.empty((len(pairs), n, n))
    row, column = np.triu_indices(n)
    K[:, row, column] = pairs
    K[:, column, row] = pairs
    if incompatible and len(mesh.cells.get(KIND, ())):
        K += _of_bricks(mesh.nodes, mesh.cells[KIND], tensors[of_cell[KIND]], u, Phi)
    return K


def _of_bricks(nodes: Array, cells: IntArray, tensors: Array, u: Array, Phi: Array) -> Array:
    """Return Phiᵀ K_geo Phi, (k, n, n), of bricks with incompatible modes; tensors: stiffness of cells, (n, 6, 6)."""
    n = Phi.shape[1]
    K = np.zeros((u.shape[1], n, n))
    for rows, dofs in brick_chunks(cells):
        B, volumes = brick_operators(nodes[cells[rows]], tensors[rows])
        sigma = gradient_stress(B @ u[dofs][:, None], tensors[rows]) * volumes[:, :, None, None]
        sigma = sigma.reshape(*volumes.shape, 1, 3, 3, -1)
        H = (B @ Phi[dofs][:, None]).reshape(*volumes.shape, 3, 3, n)  # u_c,b
        for j in range(len(K)):
            K[j] += H.reshape(-1, n).T @ (sigma[..., j] @ H).reshape(-1, n)
    return (K + K.transpose(0, 2, 1)) / 2


def integrated_cells(
    mesh: Mesh, kind: str, of_cell: Mapping[str, IntArray], integration: str = "full"
) -> list[IntegratedCells]:
    """Return the cells of a type with the quadrature of their geometric stiffness.

    In a rigid rotation, the geometric stiffness must do the same work as the nodal forces K u, to roundoff. This holds
    with the quadrature points of the stiffness. For a quadratic tetrahedron with straight edges the four stress points
    suffice, because sigma · grad N has degree 2. A curved tetrahedron uses the points of its stiffness.
    """
    cells = mesh.cells[kind]
    if not len(cells):
        return []
    material, element = of_cell[kind], reference_element(kind, integration)
    if kind != "tetra10":
        return [IntegratedCells(cells, material, element.stiffness)]
    is_curved = bends_of_cells(mesh.nodes, cells) > CURVED
    return [
        IntegratedCells(cells[own], material[own], table)
        for own, table in ((~is_curved, element.stress), (is_curved, element.stiffness))
        if own.any()
    ]


def bends_of_cells(nodes: Array, cells: IntArray) -> Array:
    """Return the distance of mid-side nodes of quadratic tetrahedra from the edge centres, over cell size, (n,)."""
    x = nodes[cells]
    x = x - x[:, :1]
    straight = shape_values("tetra", CELL_SHAPES["tetra10"].nodes)[0] @ x[:, :4]
    return np.asarray(np.abs(x - straight).max(axis=(1, 2)) / np.abs(x[:, :4]).max(axis=(1, 2)))


def _pairs_of(
    nodes: Array, cells: IntArray, material: IntArray, tensors: Array, table: ShapeTable, states: Array, columns: Array
) -> Array:
    """Return the sum over the quadrature points of these cells, (n_states, n_pairs)."""
    from fe_models.elements.solids.stress_kernels import stress_and_products

    n_states, n = states.shape[2], columns.shape[2]
    n_points, n_pairs = len(table.weights), n * (n + 1) // 2
    n_chunk = min(len(cells), max(1, int(CHUNK_BYTES / (48 * n_points * max(n_pairs + n_states, 1)))))
    sigma = np.empty((n_chunk, n_points, 6, n_states))
    products = np.empty((n_chunk, n_points, 6, n_pairs))
    total = np.zeros((n_states, n_pairs))
    for begin in range(0, len(cells), n_chunk):
        rows = slice(begin, min(begin + n_chunk, len(cells)))
        n_rows = rows.stop - begin
        stress_and_products(
            nodes, cells[rows], material[rows], tensors, table.gradients, table.weights, states, columns,
            sigma[:n_rows], products[:n_rows],
        )  # fmt: skip
        total += sigma[:n_rows].reshape(-1, n_states).T @ products[:n_rows].reshape(-1, n_pairs)
    return total


# geometric stiffness of a distributed mesh: each rank computes its cells, and rank 0 sums small matrices --------------


def spread_geometric_stiffness(
    parts: SpreadMesh, materials: tuple[AnyMaterial, ...], u: Array, Phi: SpreadColumns, rules: Mapping[str, Any]
) -> Array:
    """Return Phiᵀ K_geo(sigma_j) Phi, (k, n, n), as `projected_geometric_stiffness` does, for a distributed mesh.

    Parameters
    ----------
    u
        Displacements of the states, on rank 0, (3 n_nodes, k).
    Phi
        Distributed columns, three rows per node in the order of the nodes, (3 n_nodes, n).
    rules
        Keyword arguments of `projected_geometric_stiffness`.
    """
    rows = parts.layout.rows
    if Phi.layout.rows.starts != tuple(3 * start for start in rows.starts):
        raise BodyError(f"geometric_stiffness: columns, {Phi.shape}: their rows are not distributed as the mesh is")
    states = spread_columns(Phi.layout, u)
    found = parts.layout.ask(stiffness_here, parts.key, rows, materials, states.part, Phi.part, dict(rules))
    return np.asarray(np.sum(found, axis=0))


def stiffness_here(
    ranks: Ranks,
    key: str,
    rows: Rows,
    materials: tuple[AnyMaterial, ...],
    u: Part,
    Phi: Part,
    rules: dict[str, Any],
) -> Array:
    """Return the contribution of the cells on this rank."""
    whole: MeshPart = ranks.store[key]
    own = rows.of(ranks.rank)
    part = whole.cells_of(own)
    others = np.sort(part.position[(part.position < own.start) | (part.position >= own.stop)])
    halo = Halo(ranks, rows, others)
    place = np.searchsorted(others, part.position)  # position of each node of the part in [own; others]
    is_own = (part.position >= own.start) & (part.position < own.stop)
    at = np.where(is_own, part.position - own.start, own.stop - own.start + place)
    states, columns = (fields(halo, own_part(ranks, each), at) for each in (u, Phi))
    if not part.mesh.cells:
        return np.zeros((states.shape[1], columns.shape[1], columns.shape[1]))
    return projected_geometric_stiffness(part.mesh, materials, part.of_cell, states, columns, **rules)


def fields(halo: Halo, x: Array, at: np.ndarray) -> Array:
    """Return columns over the nodes of a part, (3 n_part_nodes, k), from own rows, (3 n_own, k), and the halo."""
    n, k = x.shape
    by_node = np.ascontiguousarray(x).reshape(n // 3, 3 * k)
    return np.concatenate([by_node, halo.rows(by_node)])[at].reshape(3 * len(at), k)
