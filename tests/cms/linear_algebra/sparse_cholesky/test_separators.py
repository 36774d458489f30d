"""Separators of graphs: what refinement must keep, and what it must find."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_array_equal

from cms.linear_algebra.sparse_cholesky.separator_kernels import (
    BETWEEN,
    HERE,
    THERE,
    Graph,
    cost_of,
    refine,
    start_cut,
    workspace,
)


def grid_graph(n, m, weight):
    path = [sp.diags_array([np.ones(k - 1), np.ones(k - 1)], offsets=[1, -1]) for k in (n, m)]
    A = sp.csr_array(sp.kronsum(path[1], path[0], format="csr"))
    return Graph(A.indptr.astype(np.int64), A.indices.astype(np.int32), weight)


@pytest.mark.parametrize("seed", range(4))
def test_a_refined_separator_separates_costs_no_more_and_its_weights_are_right(seed):
    rng = np.random.default_rng(seed)
    graph = grid_graph(11, 13, rng.integers(1, 5, 143))
    cut, vertices = workspace(143), np.arange(143)
    cut.mark[:] = 7
    cut.mark[rng.integers(0, 143, 9)] = 3  # of another part
    vertices = np.flatnonzero(cut.mark == 7)
    cut.side[:] = rng.integers(0, 2, 143)
    start_cut(graph, cut, vertices, THERE)
    before = cost_of(cut.size)
    cost = refine(graph, cut)
    assert cost <= before
    assert cost == cost_of(cut.size)
    side = np.where(cut.mark == 7, cut.side, -1)
    assert_array_equal(cut.size, [graph.weight[side == which].sum() for which in (HERE, THERE, BETWEEN)])
    assert_array_equal(np.sort(cut.separator[: cut.length[0]]), np.flatnonzero(side == BETWEEN))
    rows = np.repeat(np.arange(143), np.diff(graph.start))
    assert not ((side[rows] == HERE) & (side[graph.neighbours] == THERE)).any()


def test_a_slanted_cut_of_a_strip_becomes_its_width():
    """A strip of 5 times 40 vertices cut along a slant of 45 degrees and more: no separator has less than 5."""
    graph = grid_graph(40, 5, np.ones(200, np.int64))
    cut = workspace(200)
    cut.mark[:] = 1
    x, y = np.divmod(np.arange(200), 5)
    cut.side[:] = np.where(x + 2 * y < 24, HERE, THERE)
    start_cut(graph, cut, np.arange(200), HERE)
    assert cut.size[BETWEEN] > 5
    refine(graph, cut)
    assert cut.size[BETWEEN] == 5
