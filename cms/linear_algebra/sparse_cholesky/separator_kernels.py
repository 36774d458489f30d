"""Compiled refinement of a separator, which divides a part of a graph into two sides without a common edge."""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.foundation.kernels.jit import jit

__all__ = ["BETWEEN", "HERE", "THERE", "Cut", "Graph", "cost_of", "refine", "start_cut", "workspace"]


HERE, THERE, BETWEEN = 0, 1, 2  # sides of a vertex, and the separator
PENALTY = 1.5  #: exponent of the shares of both sides in the cost of a separator, which penalises uneven halves
PASSES = 6  #: number of passes over a separator; no pass may increase its cost
LARGEST = 0.7  #: largest share of the vertices on one side
LEAST = 30  #: number of moves without success that end a pass, in addition to a quarter of the separator vertices
BETTER = 1.0 - 1e-9


class Graph(NamedTuple):
    """Graph with vertex weights; compressed rows do not contain the vertex itself."""

    start: IntArray
    neighbours: IntArray
    weight: IntArray


class Cut(NamedTuple):
    """Workspace over all vertices; only one part is in use at a time."""

    mark: IntArray  #: part of each vertex
    side: np.ndarray  #: HERE, THERE or BETWEEN, as small integers
    separator: IntArray  #: vertices of the separator, the first length[0] of the array
    length: IntArray
    size: IntArray  #: weights of HERE, THERE and BETWEEN, (3,)
    place: IntArray  #: position of each vertex in the separator
    pull: IntArray  #: weight that enters the separator from the other side if a vertex moves to each side, (2, n)
    locked: IntArray  #: whether a vertex has moved in this pass
    changes: IntArray  #: moves of a pass, as 3 vertex + previous side


def workspace(n: int) -> Cut:
    """Return a workspace for a graph of n vertices."""
    integers = [np.zeros(n, np.int64) for _ in range(5)]
    mark, separator, place, locked, changes = integers
    mark[:] = -1
    side, length, size = np.zeros(n, np.int8), np.zeros(1, np.int64), np.zeros(3, np.int64)
    return Cut(mark, side, separator, length, size, place, np.zeros((2, n), np.int64), locked, changes)


@jit
def cost_of(size):
    """Return the weight of a separator times a power of the shares of both sides; infinite if one side is empty."""
    if size[HERE] <= 0 or size[THERE] <= 0:
        return np.inf
    share = size[HERE] / (size[HERE] + size[THERE])
    return size[BETWEEN] / (share * (1.0 - share)) ** PENALTY


@jit
def enter(graph, cut, v):
    """Move a vertex from its side into the separator."""
    was, part = cut.side[v], cut.mark[v]
    cut.size[was] -= graph.weight[v]
    cut.size[BETWEEN] += graph.weight[v]
    cut.side[v] = BETWEEN
    cut.separator[cut.length[0]], cut.place[v] = v, cut.length[0]
    cut.length[0] += 1
    cut.pull[0, v] = cut.pull[1, v] = 0
    for e in range(graph.start[v], graph.start[v + 1]):
        u = graph.neighbours[e]
        if cut.mark[u] == part:
            if cut.side[u] == BETWEEN:
                cut.pull[1 - was, u] -= graph.weight[v]
            else:
                cut.pull[1 - cut.side[u], v] += graph.weight[u]


@jit
def leave(graph, cut, v, to):
    """Move a vertex from the separator to a side."""
    part = cut.mark[v]
    cut.size[BETWEEN] -= graph.weight[v]
    cut.size[to] += graph.weight[v]
    cut.side[v] = to
    cut.length[0] -= 1
    last = cut.separator[cut.length[0]]
    cut.separator[cut.place[v]], cut.place[last] = last, cut.place[v]
    for e in range(graph.start[v], graph.start[v + 1]):
        u = graph.neighbours[e]
        if cut.mark[u] == part and cut.side[u] == BETWEEN:
            cut.pull[1 - to, u] += graph.weight[v]


@jit
def start_cut(graph, cut, vertices, chosen):
    """Determine the separator, given the sides: the vertices of one side that have an edge to the other."""
    cut.length[0] = 0
    cut.size[:] = 0
    for v in vertices:
        cut.size[cut.side[v]] += graph.weight[v]
    for v in vertices:
        if cut.side[v] != chosen:
            continue
        for e in range(graph.start[v], graph.start[v + 1]):
            u = graph.neighbours[e]
            if cut.mark[u] == cut.mark[v] and cut.side[u] == 1 - chosen:
                enter(graph, cut, v)
                break


@jit
def best_move(graph, cut, largest):
    """Return the vertex and the side whose move makes the separator lightest; -1 if no move is allowed."""
    vertex, to, most = -1, 0, np.iinfo(np.int64).min
    for k in range(cut.length[0]):
        v = cut.separator[k]
        if cut.locked[v]:
            continue
        for side in range(2):
            if cut.pull[side, v] < cut.size[1 - side] and cut.size[side] + graph.weight[v] <= largest:
                gain = 2 * (graph.weight[v] - cut.pull[side, v]) + (cut.size[side] < cut.size[1 - side])
                if gain > most:
                    vertex, to, most = v, side, gain
    return vertex, to


@jit
def refine(graph, cut):
    """Improve a separator by moving its vertices to a side; neighbours on the other side enter it. Return its cost.

    (1) among the vertices that have not moved in this pass, move the one with the largest gain, even if the gain is
        negative; its neighbours on the other side enter the separator
    (2) restore the best separator of the pass; end when a pass brings no gain
    """
    best = cost_of(cut.size)
    largest = LARGEST * cut.size.sum()
    patience = LEAST + cut.length[0] // 4
    for _ in range(PASSES):
        before = best
        n_changes = kept = idle = 0
        while idle < patience:
            v, to = best_move(graph, cut, largest)  # (1)
            if v == -1 or n_changes + 1 + graph.start[v + 1] - graph.start[v] > cut.changes.size:
                break
            cut.locked[v] = 1
            leave(graph, cut, v, to)
            cut.changes[n_changes] = 3 * v + BETWEEN
            n_changes += 1
            for e in range(graph.start[v], graph.start[v + 1]):
                u = graph.neighbours[e]
                if cut.mark[u] == cut.mark[v] and cut.side[u] == 1 - to:
                    enter(graph, cut, u)
                    cut.changes[n_changes] = 3 * u + 1 - to
                    n_changes += 1
            cost = cost_of(cut.size)
            idle += 1
            if cost < BETTER * best:
                best, kept, idle = cost, n_changes, 0
        for k in range(n_changes):
            cut.locked[cut.changes[k] // 3] = 0
        while n_changes > kept:  # (2)
            n_changes -= 1
            v, was = cut.changes[n_changes] // 3, cut.changes[n_changes] % 3
            if was == BETWEEN:
                enter(graph, cut, v)
            else:
                leave(graph, cut, v, was)
        if not best < before:
            break
    return best
