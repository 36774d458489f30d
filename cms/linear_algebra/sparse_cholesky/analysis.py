"""Symbolic analysis of a sparse symmetric matrix: elimination order, fronts, and the cost of the factorisation."""

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

LEAF = 12  #: number of vertices (mostly mesh nodes) up to which a part is not dissected further
MANY = 5000  #: number of vertices above which parts of a graph are dissected in parallel
SHARES = 8  #: parts that are dissected in parallel have at most 1 / SHARES of all vertices
FEW = 24  #: number of columns up to which small fronts are always merged, whatever zeros this adds
SIMILAR = 0.7  #: share of common neighbours from which consecutive vertices are merged; below 0.66 at adjacent nodes
FEWER = 0.9  #: ratio of the numbers of vertices below which they are merged
SHARE = 0.5  #: allowed share of zeros in a merged front with about `FEW` columns; smaller in larger fronts


@dataclass(frozen=True, eq=False)
class Fronts:
    """Dense fronts of a multifrontal factorisation, children before parents; rows and columns are reordered."""

    order: IntArray  #: matrix row at position k, (n,)
    first: IntArray  #: first column of each front, (n_fronts + 1,)
    begin: IntArray  #: start of the rows below each front in `rows`, (n_fronts + 1,)
    rows: IntArray  #: rows below the columns of all fronts, ascending within each front
    above: IntArray  #: parent of each front, (n_fronts,); -1: none

    @property
    def width(self) -> IntArray:
        """Number of columns of each front, (n_fronts,)."""
        return np.diff(self.first)

    @property
    def below(self) -> IntArray:
        """Number of rows below the columns of each front, (n_fronts,)."""
        return np.diff(self.begin)

    @property
    def n_entries(self) -> int:
        """Number of entries of the factor, without the zeros in its storage."""
        w, u = self.width, self.below
        return int((w * (w + 1) // 2 + w * u).sum())

    @cached_property
    def stored(self) -> IntArray:
        """Start of each front among the stored numbers of the factor, and their end.

        Numbers are stored in tiles of eight rows: up to the diagonal within the columns of a front, all columns below.
        """
        columns, below = -(-self.width // 8), -(-self.below // 8)
        return np.concatenate([[0], np.cumsum(32 * columns * (columns + 1) + 8 * below * self.width)])

    @property
    def n_stored(self) -> int:
        """Number of stored numbers of the factor, with the zeros."""
        return int(self.stored[-1])

    @cached_property
    def place(self) -> IntArray:
        """Position of each row below a front in its parent front: columns of the parent first, then its rows below."""
        from cms.linear_algebra.sparse_cholesky import kernels

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

    (1) merge rows with the same neighbours, such as the dofs of a node, to one vertex
    (2) order the vertices by nested dissection
    (3) build the elimination tree in postorder; columns of the factor with nearly the same rows form one front
    """
    from cms.linear_algebra.sparse_cholesky import kernels

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
    at = np.concatenate([[0], np.cumsum(sizes)])  # convert vertices to rows of the matrix
    members = np.argsort(inverse(order)[group], kind="stable")
    lengths = sizes[rows]
    ends = np.concatenate([[0], np.cumsum(lengths)])
    expanded = np.repeat(at[rows] - ends[:-1], lengths) + np.arange(ends[-1])
    return Fronts(members, at[first], ends[begin], expanded.astype(np.int32), above)


def dissection_order(lower: sp.csc_array) -> IntArray:
    """Return an elimination order by nested dissection, (n,): the row at position k."""
    start, neighbours, weight, group = quotient(lower)
    order = nested_dissection(start, neighbours, weight)
    return np.argsort(inverse(order)[group], kind="stable")


def nested_dissection(start: IntArray, neighbours: IntArray, weight: IntArray) -> IntArray:
    """Return an elimination order of a graph by nested dissection, (n_v,): the vertex at position k.

    Parts below the first cuts are dissected separately, in threads; the result does not depend on their number.
    """
    from cms.linear_algebra.sparse_cholesky.dissection_kernels import dissect
    from cms.linear_algebra.sparse_cholesky.separator_kernels import Graph, workspace

    n = len(weight)
    graph, order = Graph(start, neighbours, weight), np.arange(n)
    small = n // SHARES if n > MANY else 0
    parts = dissect(graph, workspace(n), order, 0, n, LEAF, small)
    if parts:
        with ThreadPoolExecutor(n_threads()) as pool:
            list(pool.map(lambda part: dissect(graph, workspace(n), order, part[0], part[1], LEAF, 0), parts))
    return order


def quotient(lower: sp.csc_array) -> "tuple[IntArray, IntArray, IntArray, IntArray]":
    """Return the graph of a matrix in which rows with equal neighbours form one vertex.

    The rows of a node may differ, because entries of regular meshes that cancel are not stored. Consecutive vertices
    with similar neighbours are therefore merged, with the neighbours of both, as long as this leaves far fewer.

    Returns
    -------
    start, neighbours
        Compressed rows of the graph, without the vertex itself.
    weight
        Number of matrix rows in each vertex, (n_v,).
    group
        Vertex of each row, (n,).
    """
    from cms.linear_algebra.sparse_cholesky import kernels

    keys = np.random.default_rng(0).integers(1, 2**63, size=lower.shape[0], dtype=np.uint64)
    # equal sums of random numbers over a row and its neighbours identify equal rows, except for one case in 2**64
    total = kernels.sums_over_rows(lower.indptr, lower.indices, keys)
    _, representative, group = np.unique(total, return_index=True, return_inverse=True)
    rank = inverse(np.argsort(representative, kind="stable"))  # vertices are ordered by their first rows
    group = rank[group].astype(np.int32)
    representative = np.sort(representative)
    start, neighbours = kernels.graph_of(lower.indptr, lower.indices, representative, group)
    while (run := kernels.runs_of_similar(start, neighbours, SIMILAR))[-1] + 1 < FEWER * len(run):
        start, neighbours = kernels.contracted(start, neighbours, run)
        group = run[group].astype(np.int32)
    return start, neighbours, np.bincount(group), group


def renumbered(start: IntArray, neighbours: IntArray, order: IntArray) -> "tuple[IntArray, IntArray]":
    """Return the graph with renumbered vertices: order[k] becomes k."""
    rank = inverse(order).astype(np.int32)
    lengths = np.diff(start)[order]
    begin = np.concatenate([[0], np.cumsum(lengths)])
    places = np.repeat(start[:-1][order] - begin[:-1], lengths) + np.arange(begin[-1])
    return begin, rank[neighbours[places]]


def inverse(order: "Array | IntArray") -> IntArray:
    """Return the position of each element in the order."""
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank
