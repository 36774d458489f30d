import itertools

import numpy as np
import scipy.sparse as sp
from numpy.testing import assert_array_equal

from cms.linear_algebra.substructures.dissection import dissect, node_graph


def grid(nx, ny):
    """Nodes of a grid, joined along both axes and across."""
    points = np.array([[x, y, 0.0] for x in range(nx) for y in range(ny)])
    near = [(i, j) for i, j in itertools.combinations(range(len(points)), 2) if abs(points[i] - points[j]).max() == 1]
    row, column = np.array(near).T
    half = sp.coo_array((np.ones(len(near)), (row, column)), shape=(len(points),) * 2)
    return sp.csr_array(half + half.T), points


def owners(found):
    of_node = np.empty(len(found.order), dtype=int)
    for t in range(found.n):
        of_node[found.order[found.starts[t] : found.starts[t + 1]]] = t
    return of_node


def dissected(nx=17, ny=6, leaf=12, last=()):
    graph, points = grid(nx, ny)
    weights = np.ones(len(points), dtype=int)
    return graph, points, dissect(graph, points, weights, leaf=leaf, last=np.array(last, dtype=int))


def test_only_a_substructure_and_one_that_encloses_it_share_edges():
    graph, _, found = dissected()
    of_node, first = owners(found), found.first_of_subtrees()
    edges = sp.coo_array(graph)
    low, high = np.sort(np.stack([of_node[edges.row], of_node[edges.col]]), axis=0)
    assert (first[high] <= low).all()
    assert found.n > 8


def test_every_node_has_one_owner_and_parts_are_small():
    _, points, found = dissected()
    assert_array_equal(np.sort(found.order), np.arange(len(points)))
    is_leaf = ~np.isin(np.arange(found.n), found.parents)
    assert np.diff(found.starts)[is_leaf].max() <= 12


def test_the_first_separator_is_the_shortest_line_across():
    _, points, found = dissected()
    root = found.order[found.starts[-2] :]
    assert len(root) == 6
    assert len(np.unique(points[root, 0])) == 1


def test_nodes_that_must_be_last_are_in_the_root():
    _, _, found = dissected(last=[0, 50, 101])
    assert set(found.order[found.starts[-2] :].tolist()) >= {0, 50, 101}


def test_parts_without_a_common_edge_need_no_separator():
    graph, points, _ = dissected()
    two = sp.csr_array(sp.block_diag([graph, graph]))
    apart = np.concatenate([points, points + np.array([100.0, 0, 0])])
    found = dissect(two, apart, np.ones(len(apart), dtype=int), leaf=len(points), last=np.zeros(0, dtype=int))
    assert_array_equal(np.diff(found.starts), [len(points), len(points), 0])


def test_nodes_are_neighbours_by_stiffness_or_mass():
    K = sp.csc_array(np.array([[1.0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1]]))
    M = sp.csc_array(np.array([[1.0, 0, 0, 0], [0, 1, 2, 0], [0, 2, 1, 0], [0, 0, 0, 1]]))
    graph, node = node_graph(K, M, np.array([7, 7, 3, 9]))
    assert_array_equal(node, [1, 1, 0, 2])
    assert_array_equal(graph.toarray() > 0, [[0, 1, 1], [1, 0, 0], [1, 0, 0]])
