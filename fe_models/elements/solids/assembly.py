"""Stiffness and consistent mass of a mesh of solid elements, assembled directly into compressed sparse form.

(1) number the element nodes of all elements consecutively, and list for each node the positions at which it occurs;
(2) derive the graph of the nodes: row i lists the nodes that share an element with node i, ascending;
(3) compute element matrices in batches of bounded size, in threads;
(4) after each batch, add the contributions of the elements to the rows of each node, in the order of the elements. Only
    one thread writes to an entry, and the sums do not depend on the number of threads, so results are bitwise
    reproducible;
(5) assemble the scalar mass M_s once and expand it by components, M = M_s ⊗ 1₃.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.body.material import AnyMaterial, Material
from fe_models.elements.solids.elements import ReferenceElement, reference_element
from fe_models.elements.solids.incompatible import KIND, brick_chunks, brick_stiffness
from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.threads import in_threads, n_threads
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.mesh import Mesh

__all__ = ["Progress", "assemble", "expand_scalar_mass"]

Progress = Callable[[float], None]  #: callback that receives the finished fraction, from 0 to 1

BATCH_BYTES = 32e6  #: size of a batch of element matrices [bytes]; larger batches leave the cache and are not faster
LARGEST_INT32 = 2**31 - 1


@dataclass(frozen=True, eq=False)
class NodeGraph:
    """Graph of nodes that share an element, and positions of each node in the element lists."""

    start: IntArray  #: first entry of `places` for each node, (n_nodes + 1,)
    places: np.ndarray  #: positions in the joined element lists, node by node, ascending, (n_places,) int32
    row_start: IntArray  #: first entry of `columns` for each node, (n_nodes + 1,)
    columns: np.ndarray  #: neighbours of each node, including itself, ascending, (n_entries,) int32


@dataclass(frozen=True, eq=False)
class Elasticity:
    """Elastic constants and densities of the materials of a mesh as arrays."""

    properties: Array  #: lam, mu, rho of each material, (n_materials, 3); lam and mu apply only to isotropic materials
    tensors: Array  #: matrix from strain to stress of each material, (n_materials, 6, 6)
    is_general: np.ndarray  #: whether each material is not isotropic, (n_materials,) bool

    @staticmethod
    def of(materials: Sequence[AnyMaterial]) -> "Elasticity":
        """Return the constants of these materials as arrays."""
        rows = [(m.lam, m.mu, m.rho) if isinstance(m, Material) else (0.0, 0.0, m.rho) for m in materials]
        is_general = np.array([not isinstance(m, Material) for m in materials])
        return Elasticity(np.array(rows), np.array([m.stiffness for m in materials]), is_general)


def assemble(
    mesh: Mesh,
    materials: Sequence[AnyMaterial],
    of_cell: Mapping[str, IntArray],
    *,
    incompatible: bool = False,
    integration: str = "full",
    mass: str = "consistent",
    progress: Progress | None = None,
) -> tuple[sp.csc_array, sp.csr_array]:
    """Assemble the stiffness and the scalar mass of all solid cells.

    Parameters
    ----------
    mesh
        Mesh in which every node belongs to a solid cell.
    materials
        Materials in use.
    of_cell
        Index of the material of each cell, (n_cells,), by cell type.
    incompatible
        Whether eight-node bricks have incompatible modes (`fe_models.elements.solids.incompatible`).
    integration, mass
        Names in `INTEGRATIONS` and `MASSES` of `fe_models.elements.solids.elements`. A lumped element mass is the
        diagonal of the consistent mass, scaled to the mass of the element.
    progress
        Callback that receives the finished fraction.

    Returns
    -------
    tuple
        K, (3 n_nodes, 3 n_nodes) [N/m], where dof 3 i + c is component c of node i, and M_s, (n_nodes, n_nodes) [kg].
        Both are exactly symmetric, with sorted indices.

    Raises
    ------
    MeshError
        If there is no solid cell, a cell names a node that does not exist, a node belongs to no solid cell, or an
        element is inverted (Jacobian not positive at a quadrature point).
    """
    from fe_models.elements.solids.assembly_kernels import expand_columns

    kinds = require_assemblable(mesh)
    lists = {kind: np.ascontiguousarray(mesh.cells[kind], dtype=np.int32) for kind in kinds}
    graph = node_graph(list(lists.values()), len(mesh.nodes))
    K_data, M_data = assembled_data(
        mesh.nodes,
        lists,
        Elasticity.of(materials),
        of_cell,
        graph,
        incompatible=incompatible,
        integration=integration,
        mass=mass,
        progress=progress,
    )
    row_start = graph.row_start.astype(np.int32) if len(M_data) <= LARGEST_INT32 else graph.row_start
    M_s = sp.csr_array((M_data, graph.columns, row_start), shape=2 * (len(mesh.nodes),))
    index_type = np.int32 if len(K_data) <= LARGEST_INT32 else np.int64
    indptr, indices = np.zeros(3 * len(graph.row_start) - 2, index_type), np.empty(len(K_data), index_type)
    in_threads(expand_columns, (graph.row_start, graph.columns), (indptr, indices))
    return sorted_csc(K_data, indices, indptr), M_s  # rows of K equal its columns


def expand_scalar_mass(M_s: sp.csr_array) -> sp.csc_array:
    """Return M = M_s ⊗ 1₃, (3 n_nodes, 3 n_nodes), with dofs 3 i + c, from the scalar mass, (n_nodes, n_nodes)."""
    from fe_models.elements.solids.assembly_kernels import expand_mass

    n_nodes, nnz = M_s.shape[0], 3 * M_s.nnz
    index_type = np.int32 if nnz <= LARGEST_INT32 else np.int64
    indptr, indices, data = np.zeros(3 * n_nodes + 1, index_type), np.empty(nnz, index_type), np.empty(nnz)
    row_start, columns = np.asarray(M_s.indptr, np.int64), np.asarray(M_s.indices, np.int32)
    in_threads(expand_mass, (row_start, columns, M_s.data), (indptr, indices, data))
    return sorted_csc(data, indices, indptr)


def node_graph(lists: list[np.ndarray], n_nodes: int) -> NodeGraph:
    """Steps (1) and (2): return the node graph for element lists of all types, (n_cells, nodes per cell) each."""
    from fe_models.elements.solids.assembly_kernels import node_incidence, row_columns, row_counts

    members = np.concatenate([cells.ravel() for cells in lists])
    if members.size > LARGEST_INT32:
        raise MeshError(f"assembly: {members.size} element nodes, expected at most {LARGEST_INT32}")
    offsets = np.cumsum([0, *[cells.size for cells in lists]])
    first = np.concatenate(
        [
            offset + np.repeat(np.arange(0, cells.size, cells.shape[1], dtype=np.int32), cells.shape[1])
            for offset, cells in zip(offsets[:-1].astype(np.int32), lists, strict=True)
        ]
    )
    n_members = np.concatenate([np.full(cells.size, cells.shape[1], np.int8) for cells in lists])
    start, places = node_incidence(members, n_nodes)
    unused = np.flatnonzero(np.diff(start) == 0)
    if unused.size:
        raise MeshError(
            f"assembly: {unused.size} of {n_nodes} nodes belong to no solid cell (first: {unused[0]}); "
            f"drop them first: fe_models.meshes.mesh.drop_unused_nodes(mesh)"
        )
    counts = np.zeros(n_nodes, np.int64)
    in_threads(row_counts, (members, first, n_members, start, places), (counts,))
    row_start = np.concatenate([[0], np.cumsum(counts)])
    columns = np.empty(row_start[-1], np.int32)
    in_threads(row_columns, (members, first, n_members, start, places), (row_start, columns))
    return NodeGraph(start, places, row_start, columns)


def assembled_data(
    nodes: Array,
    lists: Mapping[str, np.ndarray],
    elasticity: "Elasticity",
    of_cell: Mapping[str, IntArray],
    graph: NodeGraph,
    *,
    incompatible: bool,
    integration: str,
    mass: str,
    progress: Progress | None,
) -> tuple[Array, Array]:
    """Steps (3) and (4): compute the entries of K, row by row, and of M_s."""
    from fe_models.elements.solids.assembly_kernels import element_matrices, scatter_elements, tensor_stiffness

    K_data, M_data = np.zeros(9 * len(graph.columns)), np.zeros(len(graph.columns))
    workspace = np.zeros((n_threads(), len(nodes)), np.int32)
    cursor = graph.start[:-1].copy()
    first_place = 0
    for kind, cells in lists.items():
        tables = kernel_tables(reference_element(kind, integration, mass))
        _, of_stiffness, _ = tables
        n_a = len(CELL_SHAPES[kind].nodes)
        # 9 numbers of K and 1 of M_s for each pair of nodes
        n_batch = min(len(cells), max(n_threads(), int(BATCH_BYTES / (80 * n_a**2))))
        K_e, M_e = np.empty((n_batch, 3 * n_a, 3 * n_a)), np.empty((n_batch, n_a, n_a))
        is_inverted = np.zeros(len(cells), bool)
        materials = np.asarray(of_cell[kind])
        for begin in range(0, len(cells), n_batch):
            own = slice(begin, begin + n_batch)
            batch, of_batch = cells[own], materials[own]
            in_threads(
                element_matrices,
                (nodes, batch, elasticity.properties, of_batch, *tables),
                (K_e, M_e, is_inverted[own]),
            )
            if incompatible and kind == KIND and not is_inverted[own].any():
                for rows, _ in brick_chunks(batch):
                    K_e[rows] = brick_stiffness(nodes[batch[rows]], elasticity.tensors[of_batch[rows]])
            elif elasticity.is_general[of_batch].any():
                general = (elasticity.tensors, elasticity.is_general)
                in_threads(tensor_stiffness, (nodes, batch, *general, of_batch, *of_stiffness), (K_e,))
            if mass == "lumped":
                M_e[: len(batch)] = lumped_mass(M_e[: len(batch)])
            in_threads(
                scatter_elements,
                (batch, first_place, graph.start, graph.places, graph.row_start, graph.columns, K_e, M_e),
                (cursor, workspace, K_data, M_data),
            )
            first_place += batch.size
            if progress is not None:
                progress(first_place / len(graph.places))
        if is_inverted.any():
            raise inversion_error(kind, is_inverted)
    return K_data, M_data


def lumped_mass(M_e: Array) -> Array:
    """Return lumped element masses, (n, n_a, n_a): the diagonal of M_e, scaled to the sum of all its entries."""
    diagonal = np.einsum("eaa->ea", M_e)
    total = M_e.sum(axis=(1, 2))
    return np.asarray((diagonal * (total / diagonal.sum(axis=1))[:, None])[:, :, None] * np.eye(M_e.shape[1]))


def kernel_tables(element: ReferenceElement) -> tuple[tuple[np.ndarray, ...], ...]:
    """Return the tables for the kernel: for affine elements, and for stiffness and mass of curved elements.

    The tables of affine elements are the nodes of the reference cell, (n_nodes, 3), the indices of the nodes at e_1,
    e_2, e_3, (3,), and integrals over the cell for pairs b >= a, row by row: ∫ ∂N_a/∂xi_k ∂N_b/∂xi_l in row 3 k + l,
    (9, n_pairs), and ∫ N_a N_b.
    """
    stiffness, mass, nodes = element.stiffness, element.mass, CELL_SHAPES[element.kind].nodes
    on_axes = np.array([int(np.flatnonzero((nodes == axis).all(axis=1))[0]) for axis in np.eye(3)])
    a, b = np.triu_indices(len(nodes))
    gradients = np.einsum("q,qpk,qpl->klp", stiffness.weights, stiffness.gradients[:, a], stiffness.gradients[:, b])
    products = np.einsum("q,qp,qp->p", mass.weights, mass.values[:, a], mass.values[:, b])
    affine = (nodes, on_axes, gradients.reshape(9, -1), products)
    return affine, (stiffness.gradients, stiffness.weights), (mass.values, mass.gradients, mass.weights)


def sorted_csc(data: Array, indices: np.ndarray, indptr: np.ndarray) -> sp.csc_array:
    """Return a square matrix of these arrays with sorted, unique column entries, without check or copy."""
    matrix = sp.csc_array((data, indices, indptr), shape=2 * (len(indptr) - 1,))
    matrix.has_canonical_format = True
    return matrix


def require_assemblable(mesh: Mesh) -> list[str]:
    """Return the types of the solid cells; raise `MeshError` if nodes or cells cannot form a body."""
    kinds = [kind for kind, cells in mesh.cells.items() if len(cells)]
    if not kinds:
        raise MeshError("assembly: the mesh has no solid cells; expected tetrahedra, hexahedra or wedges")
    if not np.isfinite(mesh.nodes).all():
        raise MeshError(
            f"assembly: {(~np.isfinite(mesh.nodes)).any(axis=1).sum()} nodes have coordinates that are not "
            f"finite numbers"
        )
    n_nodes = len(mesh.nodes)
    for kind in kinds:
        cells, expected = mesh.cells[kind], reference_element(kind).mass.values.shape[1]
        if cells.ndim != 2 or cells.shape[1] != expected:
            raise MeshError(f"assembly: {kind}: expected (n_cells, {expected}) nodes, got {cells.shape}")
        if cells.min() < 0 or cells.max() >= n_nodes:
            raise MeshError(f"assembly: {kind}: expected nodes 0..{n_nodes - 1}, got {cells.min()}..{cells.max()}")
    return kinds


def inversion_error(kind: str, is_inverted: np.ndarray) -> MeshError:
    """Return the error that names the inverted elements of a type."""
    rows = np.flatnonzero(is_inverted)
    some = ", ".join(str(row) for row in rows[:5]) + (", ..." if rows.size > 5 else "")
    return MeshError(
        f"assembly: {rows.size} of {len(is_inverted)} {kind} cells are inverted or collapsed (Jacobian "
        f"not positive): cells {some}; expected the node order of VTK; repair the mesh, or straighten "
        f"curved elements there"
    )
