"""Nested dissection of the interior of a body: parts, separators between them, and separators of separators."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import maximum_bipartite_matching

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Dissection", "dissect", "node_graph"]

DIRECTIONS = 3  #: number of principal axes of a part that are tried as normals of its cut


@dataclass(frozen=True, eq=False)
class Dissection:
    """A tree of substructures in elimination order: children before parents, the root last.

    Substructure t owns the dofs `order[starts[t] : starts[t + 1]]`. A leaf is a part. All other substructures are
    separators; without a separator, the subtrees of its children have no common entry of K or M.
    """

    order: IntArray  #: dofs in elimination order, (n,)
    starts: IntArray  #: start of each substructure in `order`, and its end, (n_substructures + 1,)
    parents: IntArray  #: parent of each substructure, (n_substructures,); -1 for the root

    @property
    def n(self) -> int:
        """Number of substructures."""
        return len(self.parents)

    def first_of_subtrees(self) -> IntArray:
        """Return the first substructure of each subtree; a subtree is contiguous and ends with its root."""
        first = np.arange(self.n)
        for t, parent in enumerate(self.parents[:-1].tolist()):
            first[parent] = min(first[parent], first[t])
        return first

    def in_order(self, A: sp.csc_array) -> sp.csc_array:
        """Return a matrix in elimination order, (n, n)."""
        rank = np.empty(len(self.order), dtype=A.indices.dtype)
        rank[self.order] = np.arange(len(rank))
        entries = (A.data, (rank[A.indices], np.repeat(rank, np.diff(A.indptr))))
        return sp.csc_array(sp.coo_array(entries, shape=A.shape))


def node_graph(K: sp.csc_array, M: sp.csc_array, nodes: IntArray) -> tuple[sp.csr_array, IntArray]:
    """Return the graph of nodes that share an entry of K or M, and the node of each dof, renumbered from 0.

    Parameters
    ----------
    K, M
        Symmetric, (n, n).
    nodes
        Node of every dof, with any numbers, (n,).
    """
    _, node = np.unique(nodes, return_inverse=True)
    n_nodes = int(node.max()) + 1
    graph = sp.csr_array((n_nodes, n_nodes), dtype=np.int8)
    for A in (K, M):
        ones = np.ones(A.nnz, dtype=np.int8)
        columns = np.repeat(node, np.diff(A.indptr))
        part = sp.csr_array(sp.coo_array((ones, (node[A.indices], columns)), shape=(n_nodes, n_nodes)))
        part.data[:] = 1
        graph = sp.csr_array(graph + part)
    graph.setdiag(0)
    graph.eliminate_zeros()
    return sp.csr_array(graph), node


def dissect(graph: sp.csr_array, points: Array, weights: IntArray, *, leaf: int, last: IntArray) -> Dissection:
    """Divide nodes recursively until no part is larger than a leaf.

    All parts of one level are divided together.

    (1) the cut of a part is the plane normal to one of its principal axes through its weighted centre, for the axis
        that cuts the fewest edges
    (2) the separator is the smallest set of nodes that touches every cut edge (from a maximum matching, by Koenig's
        theorem)

    Parameters
    ----------
    graph
        Adjacency of nodes that share an entry, (n_nodes, n_nodes), symmetric, without a diagonal.
    points
        Positions, (n_nodes, 3) [m].
    weights
        Number of dofs of each node, (n_nodes,).
    leaf
        Largest number of dofs of a part.
    last
        Nodes that belong to the root regardless of the cuts.

    Returns
    -------
    Dissection
        Tree of the nodes: `order` and `starts` refer to nodes.
    """
    n = len(points)
    of_node = np.full(n, -1)  # substructure that owns a node; -1: the node is still in a part
    part = np.zeros(n, dtype=np.int64)  # substructure that will own the node (or its cut), for nodes without owner
    of_node[last] = 0
    parents = [-1]
    edges = sp.coo_array(sp.triu(graph, 1))
    row, column = edges.row, edges.col
    while True:
        inside = np.flatnonzero(of_node < 0)
        sizes = np.bincount(part[inside], weights[inside], minlength=len(parents))
        is_leaf = sizes <= leaf
        is_leaf[0] &= len(parents) > 1 or not len(last)
        done = inside[is_leaf[part[inside]]]
        of_node[done] = part[done]
        inside = inside[~is_leaf[part[inside]]]
        if not len(inside):
            break
        kept = (of_node[row] < 0) & (of_node[column] < 0) & (part[row] == part[column])
        row, column = row[kept], column[kept]
        _, compact = np.unique(part[inside], return_inverse=True)
        local = np.full(n, -1)
        local[inside] = np.arange(len(inside))
        side = _best_sides(points[inside], weights[inside], compact, local[row], local[column])
        cut = side[local[row]] != side[local[column]]
        separator = inside[_cover(local[row[cut]], local[column[cut]], side)]
        of_node[separator] = part[separator]
        rest = np.flatnonzero(of_node < 0)
        halves = 2 * part[rest] + side[local[rest]]
        numbers, which = np.unique(halves, return_inverse=True)
        part[rest] = len(parents) + which
        parents += (numbers // 2).tolist()
    return _ordered(of_node, np.array(parents))


def _best_sides(points: Array, weights: IntArray, part: IntArray, row: IntArray, column: IntArray) -> IntArray:
    """Step (1): return the side of each node relative to the cut of its part, 0 or 1."""
    n_parts = int(part.max()) + 1
    mass = np.bincount(part, weights, minlength=n_parts)
    centre = np.stack([np.bincount(part, weights * x, minlength=n_parts) for x in points.T], axis=1) / mass[:, None]
    arm = points - centre[part]
    spread = np.empty((n_parts, 3, 3))
    for a in range(3):
        for b in range(3):
            spread[:, a, b] = np.bincount(part, weights * arm[:, a] * arm[:, b], minlength=n_parts)
    axes = np.linalg.eigh(spread)[1][:, :, ::-1]  # longest axis first
    best, fewest = np.zeros(len(points), dtype=np.int64), np.full(n_parts, np.iinfo(np.int64).max)
    for k in range(DIRECTIONS):
        height = np.einsum("na,na->n", arm, axes[part, :, k])
        in_order = np.lexsort((height, part))
        below = np.cumsum(weights[in_order]) - weights[in_order] / 2
        starts = np.concatenate([[0.0], np.cumsum(mass)[:-1]])
        side = np.empty(len(points), dtype=np.int64)
        side[in_order] = below - starts[part[in_order]] > mass[part[in_order]] / 2
        cut = np.bincount(part[row[side[row] != side[column]]], minlength=n_parts)
        better = cut < fewest
        fewest = np.where(better, cut, fewest)
        best = np.where(better[part], side, best)
    return best


def _cover(row: IntArray, column: IntArray, side: IntArray) -> IntArray:
    """Step (2): return the smallest set of nodes that covers every edge between the sides, by Koenig's theorem."""
    if not len(row):
        return np.zeros(0, dtype=np.int64)
    swap = side[row] == 1
    left, right = np.where(swap, column, row), np.where(swap, row, column)
    lefts, a = np.unique(left, return_inverse=True)
    rights, b = np.unique(right, return_inverse=True)
    ones = np.ones(len(a), dtype=np.int8)
    between = sp.csr_array((ones, (a, b)), shape=(len(lefts), len(rights)))
    of_left = maximum_bipartite_matching(between, perm_type="column")  # the matched partner of each left node, or -1
    of_right = np.full(len(rights), -1)
    of_right[of_left[of_left >= 0]] = np.flatnonzero(of_left >= 0)
    reached_left = of_left < 0
    reached_right = np.zeros(len(rights), dtype=bool)
    while True:  # alternating paths from unmatched nodes: forward along any edge, back along a matched edge
        hit = np.zeros(len(rights), dtype=bool)
        hit[b[reached_left[a]]] = True
        new = hit & ~reached_right
        if not new.any():
            break
        reached_right |= new
        back = of_right[new]
        reached_left[back[back >= 0]] = True
    return np.concatenate([lefts[~reached_left], rights[reached_right]])


def _ordered(of_node: IntArray, parents: IntArray) -> Dissection:
    """Return the tree in postorder; empty substructures are removed, and their children move up."""
    counts = np.bincount(of_node, minlength=len(parents))
    up = parents.copy()
    for t in range(1, len(parents)):  # parents come first in this order
        while up[t] > 0 and counts[up[t]] == 0:
            up[t] = up[up[t]]
    children: list[list[int]] = [[] for _ in parents]
    for t in range(1, len(parents)):
        if counts[t]:
            children[up[t]].append(t)
    postorder: list[int] = []
    stack = [0]
    while stack:  # the root comes first; the order is reversed at the end
        t = stack.pop()
        postorder.append(t)
        stack += children[t]
    postorder.reverse()
    rank = np.full(len(parents), -1)
    rank[postorder] = np.arange(len(postorder))
    new_parents = np.array([rank[up[t]] if t else -1 for t in postorder])
    by = rank[of_node]
    order = np.argsort(by, kind="stable")
    starts = np.searchsorted(by[order], np.arange(len(postorder) + 1))
    return Dissection(order, starts, new_parents)
