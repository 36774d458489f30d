"""Compiled loops of nested dissection; imported only where used, because numba takes half a second to import.

Graphs have the form described in `cms.linear_algebra.sparse_cholesky.separator_kernels`.
"""

import numpy as np

from cms.linear_algebra.sparse_cholesky.separator_kernels import HERE, PENALTY, THERE, refine, start_cut
from fe_models.foundation.kernels.jit import jit

__all__ = ["dissect"]


WAYS = 6  #: number of orderings of a part; each gives a cut
NEAR = 1.5  #: largest ratio of a cut's cost to the smallest cost for which it is refined; the best refined cut is used


@jit
def breadth_first(graph, mark, part, first, queue, distance, stamp, stamps):
    """Traverse the part from a vertex, nearest first, into `queue`; return the number of vertices reached."""
    queue[0], stamps[first], distance[first] = first, stamp, 0
    n, k = 1, 0
    while k < n:
        v = queue[k]
        k += 1
        for e in range(graph.start[v], graph.start[v + 1]):
            u = graph.neighbours[e]
            if mark[u] == part and stamps[u] != stamp:
                stamps[u] = stamp
                distance[u] = distance[v] + 1
                queue[n] = u
                n += 1
    return n


@jit
def best_cut(graph, mark, part, vertices, value):
    """Return the best cut of a part by `value`, the side whose boundary is the separator, and the cost.

    A cut c puts vertices with values below c HERE and the others THERE. The vertices HERE that touch THERE are those
    with value < c <= the largest value among their neighbours, and vice versa, so one pass over the edges counts them
    for all cuts. The cost is the lighter of both boundaries, multiplied by a power of the shares of both sides; it is
    infinite if a side is empty.
    """
    start, neighbours, weight = graph.start, graph.neighbours, graph.weight
    low, high = value[vertices[0]], value[vertices[0]]
    for v in vertices:
        low, high = min(low, value[v]), max(high, value[v])
    size = high - low + 2
    count, here, there = np.zeros(size, np.int64), np.zeros(size + 1, np.int64), np.zeros(size + 1, np.int64)
    total = 0
    for v in vertices:
        own = value[v] - low
        least = most = own
        for e in range(start[v], start[v + 1]):
            u = neighbours[e]
            if mark[u] == part:
                least, most = min(least, value[u] - low), max(most, value[u] - low)
        count[own] += weight[v]
        total += weight[v]
        here[own + 1] += weight[v]
        here[most + 1] -= weight[v]
        there[least + 1] += weight[v]
        there[own + 1] -= weight[v]
    cut, chosen, cost = 0, HERE, np.inf
    below = in_here = in_there = 0
    for c in range(1, size - 1):
        below += count[c - 1]
        in_here += here[c]
        in_there += there[c]
        if below == 0 or below == total:
            continue
        share = below / total
        found = min(in_here, in_there) / (share * (1.0 - share)) ** PENALTY
        if found < cost:
            cut, cost = low + c, found
            chosen = HERE if in_here < in_there else THERE
    return cut, chosen, cost


@jit
def dissect(graph, cut, order, lo, hi, leaf, small):
    """Order the vertices order[lo:hi] by nested dissection in place; return the remaining parts as (lo, hi).

    Parts of up to `leaf` vertices are not divided; those of up to `small` vertices are left to other calls.

    (1) connected components are separate parts
    (2) find three vertices far apart; distances to them, and differences of distances, order the part in six ways, each
        with its best cut (`best_cut`)
    (3) the separator consists of the vertices of one half that touch the other, refined; among cuts close to the best
        before refinement, the best after refinement is used; it is ordered last, after both halves
    """
    n = graph.start.size - 1
    mark, side = cut.mark, cut.side
    place, stamps = np.empty(n, np.int64), np.full(n, -1, np.int64)
    distance, value, kept = np.zeros((3, n), np.int64), np.zeros(n, np.int64), np.zeros(n, np.int8)
    cuts, sides, costs = np.zeros(WAYS, np.int64), np.zeros(WAYS, np.int64), np.zeros(WAYS)
    todo, left = [(lo, hi)], [(0, 0)]
    part = stamp = 0
    while len(todo):
        lo, hi = todo.pop()
        m = hi - lo
        if m <= leaf:
            continue
        if m <= small:
            left.append((lo, hi))
            continue
        part += 1
        for k in range(lo, hi):
            mark[order[k]] = part
        stamp += 1  # (1)
        met, n_components = 0, 0
        for k in range(lo, hi):
            v = order[k]
            if stamps[v] != stamp:
                found = breadth_first(graph, mark, part, v, place[met:], distance[0], stamp, stamps)
                if met + found < m or n_components:
                    todo.append((lo + met, lo + met + found))
                met += found
                n_components += 1
        for k in range(m):
            order[lo + k] = place[k]
        if n_components > 1:
            continue
        vertices = order[lo:hi]
        far = order[hi - 1]  # (2)
        for k in range(3):
            stamp += 1
            breadth_first(graph, mark, part, far, place, distance[k], stamp, stamps)
            far = place[m - 1]
            if k == 1:  # the third vertex is far from the first two
                for v in vertices:
                    if min(distance[0, v], distance[1, v]) > min(distance[0, far], distance[1, far]):
                        far = v
        for way in range(WAYS):
            for v in vertices:
                value[v] = way_value(distance, way, v)
            cuts[way], sides[way], costs[way] = best_cut(graph, mark, part, vertices, value)
        least = costs.min()
        if not np.isfinite(least):
            continue
        best = np.inf
        for _ in range(WAYS):  # (3)
            taken = np.argmin(costs)
            if not costs[taken] <= NEAR * least:
                break
            costs[taken] = np.inf
            for v in vertices:
                side[v] = HERE if way_value(distance, taken, v) < cuts[taken] else THERE
            start_cut(graph, cut, vertices, sides[taken])
            cost = refine(graph, cut)
            if cost < best:
                best = cost
                for v in vertices:
                    kept[v] = side[v]
        at = middle = end = 0
        for which in range(3):
            for v in vertices:
                if kept[v] == which:
                    place[at] = v
                    at += 1
            if which == HERE:
                middle = at
            elif which == THERE:
                end = at
        for k in range(m):
            order[lo + k] = place[k]
        if best < np.inf and 0 < middle < end:
            todo.append((lo, lo + middle))
            todo.append((lo + middle, lo + end))
    return left[1:]


@jit
def way_value(distance, way, v):
    """Return the value of a vertex in one of six orderings of a part: three distances and their differences."""
    if way < 3:
        return distance[way, v]
    return distance[way - 3, v] - distance[(way - 2) % 3, v]
