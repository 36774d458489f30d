"""Assembly of solid elements on several ranks: each rank assembles a part of the mesh and keeps its rows of K and M.

(1) rank 0 orders the nodes so that neighbours are near, and cuts the order into parts with similar numbers of entries
(2) every rank receives only the elements that touch its nodes
(3) it assembles them and keeps the rows of its own nodes; these rows are complete, so no sums pass between ranks
(4) it also keeps its rows of the scalar mass M_s, for the mass integrals of the body

Every rank whose nodes touch an element at a cut computes that element. Entries equal those of a single process bitwise,
because the elements of a node are added in the same order.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fe_models.body.material import AnyMaterial
from fe_models.elements.solids.assembly import assemble, node_graph, require_assemblable
from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.row_layout import RowLayout, asked, new_key
from fe_models.foundation.ranks.rows import Rows, even_rows
from fe_models.foundation.ranks.spread_matrix import OwnRows, SpreadMatrix
from fe_models.foundation.ranks.trim import give_back
from fe_models.foundation.threads import in_threads
from fe_models.meshes.mesh import Mesh

__all__ = ["MeshPart", "SpreadMesh", "assemble_on_ranks"]

KEY = "assembled rows"  #: key in the store of a rank for assembled rows that it has not yet delivered
MATRICES = ("K", "M", "M_s")
KEPT = (*MATRICES, "mesh")


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Part of the mesh that a rank needs."""

    mesh: Mesh  #: elements that touch the nodes of the rank, and all nodes of these elements
    of_cell: Mapping[str, IntArray]  #: material index of each cell, by cell type
    position: np.ndarray  #: position of each node of the part in the global order, (n_part_nodes,)
    own: np.ndarray  #: indices of the nodes that the rank owns, in global order, (n_own,)

    def cells_of(self, rows: slice) -> "MeshPart":
        """Return the cells whose first node in global order is owned by the rank; each cell has one such rank."""
        first = {kind: self.position[cells].min(axis=1) for kind, cells in self.mesh.cells.items()}
        index = {kind: np.flatnonzero((at >= rows.start) & (at < rows.stop)) for kind, at in first.items()}
        cells = {kind: self.mesh.cells[kind][some] for kind, some in index.items() if len(some)}
        of_cell = {kind: self.of_cell[kind][some] for kind, some in index.items() if len(some)}
        return MeshPart(Mesh(self.mesh.nodes, cells), of_cell, self.position, self.own)


class SpreadMesh:
    """Distributed mesh: each rank stores the cells that touch its nodes until the last reference is dropped."""

    def __init__(self, layout: RowLayout) -> None:
        """Let each rank store the part of the mesh that it assembled; layout is the distribution of the nodes."""
        self.layout, self.key = layout, new_key()
        layout.ask(mesh_here, self.key)
        layout.free_with(self, self.key)


def assemble_on_ranks(
    ranks: Ranks,
    mesh: Mesh,
    materials: tuple[AnyMaterial, ...],
    of_cell: Mapping[str, IntArray],
    options: Mapping[str, Any],
) -> tuple[SpreadMatrix, SpreadMatrix, SpreadMatrix, SpreadMesh]:
    """Return K, M = M_s ⊗ 1₃, M_s and the mesh, all distributed over the ranks.

    Parameters
    ----------
    materials, of_cell
        As for `fe_models.elements.solids.assembly.assemble`.
    options
        Keyword arguments of this function.
    """
    kinds = require_assemblable(mesh)
    lists = {kind: np.ascontiguousarray(mesh.cells[kind], dtype=np.int32) for kind in kinds}
    order, rows = node_order(list(lists.values()), len(mesh.nodes), ranks.size)  # (1)
    ranks.store[KEY] = [mesh_part(mesh, lists, of_cell, order, rows, rank) for rank in range(ranks.size)]  # (2)
    try:
        asked(ranks, assemble_here, materials, dict(options))  # (3)
    # the message refers to a part of the mesh; repeat the assembly in one process, where it refers to the whole mesh
    except MeshError:
        asked(ranks, forget_here)  # drop the rows on ranks without an error
        assemble(mesh, materials, of_cell, **options)
        raise
    of_dofs = (3 * order[:, None] + np.arange(3)).ravel()
    dof_rows = Rows(tuple(3 * start for start in rows.starts))
    M_s = SpreadMatrix(ranks, order, rows, handed_here, "M_s")  # (4)
    K, M = (SpreadMatrix(ranks, of_dofs, dof_rows, handed_here, name) for name in ("K", "M"))
    return K, M, M_s, SpreadMesh(M_s.layout)


def node_order(lists: list[np.ndarray], n_nodes: int, size: int) -> tuple[IntArray, Rows]:
    """Step (1): return the node at each position, (n_nodes,), and the positions of each rank."""
    graph = node_graph(lists, n_nodes)
    starts = graph.row_start.astype(np.int32)
    A = sp.csr_array((np.ones(len(graph.columns), np.int8), graph.columns, starts), shape=(n_nodes, n_nodes))
    order = reverse_cuthill_mckee(A, symmetric_mode=True).astype(np.int64)
    return order, even_rows(np.concatenate([[0], np.cumsum(np.diff(graph.row_start)[order])]), size)


def mesh_part(
    mesh: Mesh,
    lists: Mapping[str, np.ndarray],
    of_cell: Mapping[str, IntArray],
    order: IntArray,
    rows: Rows,
    rank: int,
) -> MeshPart:
    """Step (2): return the elements that touch the nodes of a rank."""
    is_own = np.zeros(len(order), bool)
    is_own[order[rows.of(rank)]] = True
    chosen = {kind: np.flatnonzero(is_own[cells].any(axis=1)) for kind, cells in lists.items()}
    is_there = is_own.copy()
    for kind, index in chosen.items():
        is_there[lists[kind][index]] = True
    nodes = np.flatnonzero(is_there)
    new = np.full(len(order), -1, np.int32)
    new[nodes] = np.arange(len(nodes), dtype=np.int32)
    position = np.empty(len(order), np.int32)
    position[order] = np.arange(len(order), dtype=np.int32)
    part = Mesh(mesh.nodes[nodes], {kind: new[lists[kind][index]] for kind, index in chosen.items() if len(index)})
    return MeshPart(
        part,
        {kind: np.asarray(of_cell[kind])[index] for kind, index in chosen.items() if len(index)},
        position[nodes],
        new[order[rows.of(rank)]],
    )


def assemble_here(ranks: Ranks, materials: tuple[AnyMaterial, ...], options: dict[str, Any]) -> None:
    """Step (3): assemble and store the rows of K, M and M_s on this rank, with columns in global order."""
    parts = ranks.store.pop(KEY, None) or [None] * ranks.size
    part: MeshPart = parts[0] if ranks.size == 1 else ranks.comm.alltoall(parts)[0]
    del parts
    ranks.store[f"{KEY} mesh"] = part
    if not len(part.own):  # there are fewer nodes than ranks
        for name in MATRICES:
            ranks.store[f"{KEY} {name}"] = OwnRows(np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros(0))
        return
    K, M_s = assemble(part.mesh, materials, part.of_cell, **options)
    dofs = (3 * part.own[:, None] + np.arange(3)).ravel()
    # columns of a symmetric matrix are its rows
    own_K = sp.csr_array((K.data, K.indices, K.indptr), shape=K.shape)[dofs]
    del K
    own_M = sp.csr_array(M_s[part.own])
    del M_s
    of_dofs = (3 * part.position[:, None] + np.arange(3, dtype=np.int32)).ravel()
    ranks.store[f"{KEY} K"] = OwnRows(own_K.indptr, of_dofs[own_K.indices], own_K.data)
    columns = part.position[own_M.indices]
    ranks.store[f"{KEY} M"] = expanded_rows(own_M.indptr, columns, own_M.data)
    ranks.store[f"{KEY} M_s"] = OwnRows(own_M.indptr.astype(np.int32), columns, own_M.data)
    give_back()


def forget_here(ranks: Ranks) -> None:
    """Drop the assembled rows and the mesh part of this rank."""
    for key in (KEY, *(f"{KEY} {name}" for name in KEPT)):
        ranks.store.pop(key, None)
    give_back()


def mesh_here(ranks: Ranks, key: str) -> None:
    """Store the mesh part of this rank under another key."""
    ranks.store[key] = ranks.store.pop(f"{KEY} mesh")


def handed_here(ranks: Ranks, name: str) -> OwnRows:
    """Return the assembled rows, and remove them from the store."""
    rows: OwnRows = ranks.store.pop(f"{KEY} {name}")
    return rows


def expanded_rows(indptr: np.ndarray, columns: np.ndarray, data: Array) -> OwnRows:
    """Return the rows of S ⊗ 1₃, given rows of the scalar matrix S."""
    from fe_models.elements.solids.assembly_kernels import expand_mass

    n = 3 * len(data)
    wide, indices, values = np.zeros(3 * len(indptr) - 2, np.int32), np.empty(n, np.int32), np.empty(n)
    in_threads(expand_mass, (indptr.astype(np.int64), columns, data), (wide, indices, values))
    return OwnRows(wide, indices, values)
