"""Values at nodes from sampling points, by polynomials fitted to patches of elements (superconvergent patch recovery).

(1) the patch of a corner consists of the samples of all elements that share it
(2) its coordinates are principal axes of the samples about their mean, each scaled to the variance 1; directions in
    which the samples do not spread are left out
(3) a complete polynomial of the given order is fitted by least squares. A small ridge leaves out quadratic terms that
    the samples do not determine, as in a wall of one layer of elements
(4) a corner takes the polynomial of its own patch, a middle node the mean of those of its corners. With linear
    polynomials, a corner that has few elements takes the mean of the neighbours that have many

The patches follow Zienkiewicz & Zhu [1]_. Everything but the values depends on the mesh alone.

References
----------
.. [1] Zienkiewicz & Zhu (1992), Int. J. Numer. Meth. Engng 33, 1331-1364.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.threads import in_threads

__all__ = ["PatchCells", "PatchRecovery", "patch_recovery"]

FLAT = 1e-6  #: spread of samples in a direction over the largest spread, below which they are flat
RIDGE = 1e-9, 0.03  #: ridge of linear and of quadratic terms, per sample
FEW, MANY = 0.6, 0.8  #: share of the samples of the neighbour with most; below, above: few, many samples


@dataclass(frozen=True, eq=False)
class PatchCells:
    """Cells of one type with their samples."""

    nodes: IntArray  #: nodes of each cell, corners first, (n_cells, n_a)
    n_corners: int  #: number of corners of a cell
    middles: tuple[tuple[int, ...], ...]  #: corners of each further node
    samples: Array  #: positions of the samples, (n_cells, n_samples, 3) [m]


@dataclass(frozen=True, eq=False)
class PatchRecovery:
    """The linear map from samples to nodes: moments of the samples of each patch, and weights of these at nodes."""

    inside: sp.csr_array  #: samples of each patch, (n_patches, n_samples), with unit entries
    basis: Array  #: terms of the polynomial of each patch at its samples, (n_entries of inside, n_terms)
    start: IntArray  #: first pair of each node, (n_nodes + 1,)
    patches: IntArray  #: patch of each pair, (n_pairs,)
    weights: Array  #: weights of the moments of the patch of each pair, (n_pairs, n_terms)

    def at_nodes(self, values: Array) -> Array:
        """Return the recovered values at the nodes, (n_nodes, k), of values at the samples, (n_samples, k)."""
        from fe_models.elements.recovery.patch_kernels import write_moments, write_node_values

        k = values.shape[1]
        moments, found = np.empty((self.inside.shape[0], self.basis.shape[1], k)), np.empty((len(self.start) - 1, k))
        in_threads(write_moments, (self.inside.indptr, self.inside.indices, self.basis, values), (moments,))
        in_threads(write_node_values, (self.start, self.patches, self.weights, moments), (found,))
        return found


def patch_recovery(nodes: Array, groups: Sequence[PatchCells], order: int) -> PatchRecovery:
    """Return the map from samples, numbered by group, cell and point, to nodes.

    Parameters
    ----------
    nodes
        Positions, (n_nodes, 3) [m].
    groups
        Cells, whose samples belong to the same smooth field.
    order
        Order of the polynomials, 1 or 2.
    """
    corner_nodes = np.unique(np.concatenate([group.nodes[:, : group.n_corners].ravel() for group in groups]))
    number = np.full(len(nodes), -1, np.int64)
    number[corner_nodes] = np.arange(len(corner_nodes))
    samples = np.concatenate([group.samples.reshape(-1, 3) for group in groups])
    n_patches = len(corner_nodes)
    inside = samples_of_patches(number, groups, (n_patches, len(samples)))  # (1)
    start, row = inside.indptr[:-1], np.repeat(np.arange(n_patches), np.diff(inside.indptr))
    count = np.diff(inside.indptr)[:, None]

    def total(values: Array) -> Array:
        return np.asarray(np.add.reduceat(values, start))

    center = nodes[corner_nodes] + total(samples[inside.indices] - nodes[corner_nodes][row]) / count
    offset = samples[inside.indices] - center[row]  # (2)
    spread = np.empty((n_patches, 3, 3))
    for i in range(3):
        for j in range(i + 1):
            spread[:, i, j] = spread[:, j, i] = total(offset[:, i] * offset[:, j]) / count[:, 0]
    variance, axes = np.linalg.eigh(spread)
    is_flat = variance <= FLAT**2 * variance[:, 2:]
    scale = np.where(is_flat, 0.0, 1 / np.sqrt(np.where(is_flat, 1.0, variance)))
    to_local = axes * scale[:, None]

    def basis(patch: IntArray, away: Array) -> Array:
        return polynomial(np.einsum("na,nab->nb", away, to_local[patch]), order)

    b = basis(row, offset)
    n_terms = b.shape[1]
    G = np.empty((n_patches, n_terms, n_terms))
    for i in range(n_terms):
        for j in range(i + 1):
            G[:, i, j] = G[:, j, i] = total(b[:, i] * b[:, j])
    ridge = np.concatenate([[0.0], np.full(3, RIDGE[0]), np.full(n_terms - 4, RIDGE[1])])
    G[:, range(n_terms), range(n_terms)] += count * ridge  # (3)
    node, patch = patches_of_nodes(number, groups)  # (4)
    if order == 1:
        node, patch = with_many_samples(inside, node, patch)
    n_pairs = np.bincount(node, minlength=len(nodes))
    at = basis(patch, nodes[node] - center[patch]) / n_pairs[node, None]
    at = np.einsum("ni,nij->nj", at, np.linalg.inv(G)[patch])
    return PatchRecovery(inside, b, np.concatenate([[0], np.cumsum(n_pairs)]), patch, at)


def samples_of_patches(number: IntArray, groups: Sequence[PatchCells], shape: tuple[int, int]) -> sp.csr_array:
    """Return which samples belong to each patch, (n_patches, n_samples), with unit entries."""
    rows, columns, first = [], [], 0
    for group in groups:
        n, p = group.samples.shape[:2]
        points = first + np.arange(n * p).reshape(n, 1, p)
        points, corners = np.broadcast_arrays(points, number[group.nodes[:, : group.n_corners], None])
        rows.append(corners.ravel())
        columns.append(points.ravel())
        first += n * p
    i, j = np.concatenate(rows), np.concatenate(columns)
    return sp.csr_array((np.ones(len(i)), (i, j)), shape)


def patches_of_nodes(number: IntArray, groups: Sequence[PatchCells]) -> tuple[IntArray, IntArray]:
    """Return pairs of a node and a patch whose polynomial it takes, (n_pairs,) each, by step (4)."""
    nodes = [np.flatnonzero(number >= 0)]
    corners = [number[nodes[0]]]
    for group in groups:
        for k, parents in enumerate(group.middles, start=group.n_corners):
            for parent in parents:
                nodes.append(group.nodes[:, k])
                corners.append(number[group.nodes[:, parent]])
    n_patches = len(corners[0])
    pairs = np.unique(np.concatenate(nodes) * n_patches + np.concatenate(corners))
    return pairs // n_patches, pairs % n_patches


def with_many_samples(inside: sp.csr_array, node: IntArray, patch: IntArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of `patches_of_nodes` with neighbours in place of the patches that have few samples."""
    count, shared = np.diff(inside.indptr), sp.csr_array(inside @ inside.T)
    row = np.repeat(np.arange(len(count)), np.diff(shared.indptr))
    most = np.maximum.reduceat(count[shared.indices], shared.indptr[:-1])
    has_few = count < FEW * most
    takes = np.where(has_few[row], count[shared.indices] >= MANY * most[row], shared.indices == row)
    of_patch = sp.csr_array((takes.astype(float), shared.indices, shared.indptr), shared.shape)
    pairs = sp.csr_array((np.ones(len(node)), (node, patch)), (int(node.max()) + 1, len(count))) @ of_patch
    pairs.eliminate_zeros()
    found = sp.coo_array(pairs)
    return found.coords[0], found.coords[1]


def polynomial(x: Array, order: int) -> Array:
    """Return the terms of a complete polynomial of order 1 or 2 at points x, (n, 3): (n, 4) or (n, 10)."""
    linear = [np.ones(len(x)), *x.T]
    if order == 1:
        return np.stack(linear, axis=1)
    return np.stack([*linear, *(x[:, i] * x[:, j] for i in range(3) for j in range(i + 1))], axis=1)
