"""Analysis of a sparse symmetric matrix before its numbers: order of elimination, fronts, and what they will cost."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import IntArray
from fe_models.foundation.threads import n_threads

if TYPE_CHECKING:
    from fe_models.foundation.arrays import Array

__all__ = ["Fronts", "analyse", "dissection_order"]

LEAF = 12  #: vertices, mostly nodes of the mesh, below which a part is not dissected further
MANY = 5000  #: vertices above which parts of a graph are dissected beside each other
SHARES = 8  #: of all vertices, as large as such parts are at most
FEW = 24  #: columns up to which small fronts are joined whatever zeros that brings
SHARE = 0.5  #: of zeros that is allowed in a front of about so many columns; less in larger ones


@dataclass(frozen=True, eq=False)
class Fronts:
    """Dense fronts of a multifrontal factorisation, each after its children; rows and columns in the new order."""

    order: IntArray  #: the row of the matrix that comes k-th, (n,)
    first: IntArray  #: first column of each front, (n_fronts + 1,)
    begin: IntArray  #: where the rows below a front begin in `rows`, (n_fronts + 1,)
    rows: IntArray  #: rows below the columns of all fronts, ascending in each
    above: IntArray  #: parent of each front, -1: none, (n_fronts,)

    @property
    def width(self) -> IntArray:
        """Columns of each front, (n_fronts,)."""
        return np.diff(self.first)

    @property
    def below(self) -> IntArray:
        """Rows below the columns of each front, (n_fronts,)."""
        return np.diff(self.begin)

    @property
    def n_entries(self) -> int:
        """Entries of the factor."""
        w, u = self.width, self.below
        return int((w * (w + 1) // 2 + w * u).sum())

    @cached_property
    def stored(self) -> IntArray:
        """Where the numbers of each front begin among those that are stored for the factor, and their end.

        Tiles of eight rows: up to their diagonal in the columns of a front, over all its columns below.
        """
        columns, below = -(-self.width // 8), -(-self.below // 8)
        return np.concatenate([[0], np.cumsum(32 * columns * (columns + 1) + 8 * below * self.width)])

    @property
    def n_stored(self) -> int:
        """Numbers that are stored for the factor."""
        return int(self.stored[-1])

    @cached_property
    def place(self) -> IntArray:
        """The place of each row below a front in the front of its parent: its columns first, then the rows below."""
        from cms.sparse_cholesky import kernels

        return kernels.places_above(self.begin, self.rows, self.first, self.above)

    @property
    def front_operations(self) -> "Array":
        """Multiplications and additions of the factorisation of each front, (n_fronts,)."""
        w, u = self.width.astype(float), self.below.astype(float)
        return w**3 / 3 + u * w**2 + u**2 * w

    @property
    def operations(self) -> float:
        """Multiplications and additions of the factorisation."""
        return float(self.front_operations.sum())


def analyse(lower: sp.csc_array) -> Fronts:
    """Return the fronts of the symmetric matrix with this lower triangle.

    (1) rows with the same neighbours, such as the dofs of a node, are one vertex
    (2) nested dissection of the vertices
    (3) elimination tree, in postorder; columns of the factor with nearly the same rows are one front
    """
    from cms.sparse_cholesky import kernels

    start, neighbours, weight, group = quotient(lower)  # (1)
    order = nested_dissection(start, neighbours, weight)  # (2)
    start, neighbours = renumbered(start, neighbours, order)
    parent = kernels.elimination_tree(start, neighbours)  # (3)
    post = kernels.postorder(parent)
    start, neighbours = renumbered(start, neighbours, post)
    order = order[post]
    rank = inverse(post)
    parent = np.where(parent[post] >= 0, rank[parent[post]], -1)
    sizes = weight[order]
    count = kernels.weighted_counts(start, neighbours, parent, sizes)
    front, above = kernels.amalgamate(parent, count, sizes, FEW, SHARE)
    by_front = np.argsort(front, kind="stable")
    start, neighbours = renumbered(start, neighbours, by_front)
    order, sizes = order[by_front], sizes[by_front]
    first = np.searchsorted(front[by_front], np.arange(len(above) + 1))
    begin, rows = kernels.front_rows(start, neighbours, first, above)
    at = np.concatenate([[0], np.cumsum(sizes)])  # from vertices to rows of the matrix
    members = np.argsort(inverse(order)[group], kind="stable")
    lengths = sizes[rows]
    ends = np.concatenate([[0], np.cumsum(lengths)])
    expanded = np.repeat(at[rows] - ends[:-1], lengths) + np.arange(ends[-1])
    return Fronts(members, at[first], ends[begin], expanded.astype(np.int32), above)


def dissection_order(lower: sp.csc_array) -> IntArray:
    """Return an order of elimination by nested dissection, (n,): the row that comes k-th."""
    start, neighbours, weight, group = quotient(lower)
    order = nested_dissection(start, neighbours, weight)
    return np.argsort(inverse(order)[group], kind="stable")


def nested_dissection(start: IntArray, neighbours: IntArray, weight: IntArray) -> IntArray:
    """Return an order of elimination of a graph by nested dissection, (n_v,): the vertex that comes k-th.

    Parts below the first cuts are dissected by themselves, in threads; on their number nothing depends.
    """
    from cms.sparse_cholesky.dissection_kernels import dissect
    from cms.sparse_cholesky.separator_kernels import Graph, workspace

    n = len(weight)
    graph, order = Graph(start, neighbours, weight), np.arange(n)
    small = n // SHARES if n > MANY else 0
    parts = dissect(graph, workspace(n), order, 0, n, LEAF, small)
    if parts:
        with ThreadPoolExecutor(n_threads()) as pool:
            list(pool.map(lambda part: dissect(graph, workspace(n), order, part[0], part[1], LEAF, 0), parts))
    return order


def quotient(lower: sp.csc_array) -> "tuple[IntArray, IntArray, IntArray, IntArray]":
    """Return the graph of a matrix with rows of equal neighbours as one vertex.

    Returns
    -------
    start, neighbours
        Its compressed rows, the vertex itself left out.
    weight
        Rows of the matrix in each vertex, (n_v,).
    group
        Vertex of each row, (n,).
    """
    from cms.sparse_cholesky import kernels

    keys = np.random.default_rng(0).integers(1, 2**63, size=lower.shape[0], dtype=np.uint64)
    # equal sums of random numbers over a row and its neighbours: equal rows, but for one case in 2**64
    total = kernels.sums_over_rows(lower.indptr, lower.indices, keys)
    _, representative, group = np.unique(total, return_index=True, return_inverse=True)
    rank = inverse(np.argsort(representative, kind="stable"))  # vertices in the order of their first rows
    group = rank[group].astype(np.int32)
    representative = np.sort(representative)
    start, neighbours = kernels.graph_of(lower.indptr, lower.indices, representative, group)
    return start, neighbours, np.bincount(group), group


def renumbered(start: IntArray, neighbours: IntArray, order: IntArray) -> "tuple[IntArray, IntArray]":
    """Return the graph with the vertices in another order: order[k] becomes k."""
    rank = inverse(order).astype(np.int32)
    lengths = np.diff(start)[order]
    begin = np.concatenate([[0], np.cumsum(lengths)])
    places = np.repeat(start[:-1][order] - begin[:-1], lengths) + np.arange(begin[-1])
    return begin, rank[neighbours[places]]


def inverse(order: "Array | IntArray") -> IntArray:
    """Return the place of each element of an order."""
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank
