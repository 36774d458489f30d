"""Compiled loops of nested dissection; imported where they are used: numba takes half a second to import.

Graphs are compressed rows `start`, `neighbours` without the vertex itself.
"""

import numpy as np
from numba import njit

__all__ = ["dissection"]

jit = njit(cache=True, nogil=True, error_model="numpy")

HERE, THERE, BETWEEN = 0, 1, 2  # the side of a vertex
PENALTY = 1.5  #: power of the shares of both sides, by which a separator is judged: uneven halves cost
PASSES = 6  #: over a separator, each of which may only make it lighter


@jit
def breadth_first(start, neighbours, mark, part, first, queue, distance, stamp, stamps):
    """Walk the part from a vertex, nearest first, into `queue`; returns how many vertices were met."""
    queue[0], stamps[first], distance[first] = first, stamp, 0
    n, k = 1, 0
    while k < n:
        v = queue[k]
        k += 1
        for e in range(start[v], start[v + 1]):
            u = neighbours[e]
            if mark[u] == part and stamps[u] != stamp:
                stamps[u] = stamp
                distance[u] = distance[v] + 1
                queue[n] = u
                n += 1
    return n


@jit
def refine(start, neighbours, weight, mark, part, side, separator, n_separator, sizes):
    """Make a separator lighter: a vertex moves to a side where it draws less weight after it than it takes away."""
    for _ in range(PASSES):
        moved = False
        k = 0
        while k < n_separator:
            v = separator[k]
            pulled_here, pulled_there = 0, 0  # weight that v on this side would pull out of the other
            for e in range(start[v], start[v + 1]):
                u = neighbours[e]
                if mark[u] == part:
                    if side[u] == THERE:
                        pulled_here += weight[u]
                    elif side[u] == HERE:
                        pulled_there += weight[u]
            is_even = pulled_here == pulled_there and sizes[0] < sizes[1]
            to = HERE if pulled_here < pulled_there or is_even else THERE
            pulled = min(pulled_here, pulled_there)
            gain = weight[v] - pulled
            balances = gain == 0 and sizes[to] + weight[v] < sizes[1 - to] - pulled
            if gain > 0 or balances:
                moved = True
                side[v] = to
                sizes[to] += weight[v]
                n_separator -= 1
                separator[k] = separator[n_separator]
                for e in range(start[v], start[v + 1]):
                    u = neighbours[e]
                    if mark[u] == part and side[u] == 1 - to:
                        side[u] = BETWEEN
                        sizes[1 - to] -= weight[u]
                        separator[n_separator] = u
                        n_separator += 1
            else:
                k += 1
        if not moved:
            break
    return n_separator


@jit
def best_cut(start, neighbours, weight, mark, part, vertices, value):
    """Return where a part is best cut by `value`: cut, the side whose touching vertices separate it, and the cost.

    For a cut c below the value of THERE: HERE's vertices that touch THERE are those with value < c <= the largest value
    next to them, and the other way round; so one pass over the edges counts them for all cuts. Cost: the lighter of
    both, by a power of the shares of both sides; -1 where no cut keeps both sides.
    """
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
    cut, chosen, cost = 0, HERE, -1.0
    below = in_here = in_there = 0
    for c in range(1, size - 1):
        below += count[c - 1]
        in_here += here[c]
        in_there += there[c]
        if below == 0 or below == total:
            continue
        share = below / total
        found = min(in_here, in_there) / (share * (1.0 - share)) ** PENALTY
        if cost < 0 or found < cost:
            cut, cost = low + c, found
            chosen = HERE if in_here < in_there else THERE
    return cut, chosen, cost


@jit
def dissection(start, neighbours, weight, leaf):
    """Return an order of elimination by nested dissection, (n,): the vertex that comes k-th.

    (1) components of a part are parts of their own
    (2) three vertices far apart; distances to each and their differences order the part in six ways: the cut with the
        lightest separator for its balance is taken (`best_cut`)
    (3) separator: the vertices of one half that touch the other, refined; last in the order, both halves before it
    """
    n = start.size - 1
    order, place = np.arange(n), np.empty(n, np.int64)
    mark, stamps = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    distance, value = np.zeros((3, n), np.int64), np.zeros(n, np.int64)
    side = np.empty(n, np.int8)
    separator = np.empty(n, np.int64)
    sizes = np.zeros(2, np.int64)
    todo = [(0, n)]
    part = stamp = 0
    while len(todo):
        lo, hi = todo.pop()
        m = hi - lo
        if m <= leaf:
            continue
        part += 1
        for k in range(lo, hi):
            mark[order[k]] = part
        stamp += 1  # (1)
        met, n_components = 0, 0
        for k in range(lo, hi):
            v = order[k]
            if stamps[v] != stamp:
                found = breadth_first(start, neighbours, mark, part, v, place[met:], distance[0], stamp, stamps)
                if met + found < m or n_components:
                    todo.append((lo + met, lo + met + found))
                met += found
                n_components += 1
        order[lo:hi] = place[:m]
        if n_components > 1:
            continue
        vertices = order[lo:hi]
        far = order[hi - 1]  # (2)
        for k in range(3):
            stamp += 1
            breadth_first(start, neighbours, mark, part, far, place, distance[k], stamp, stamps)
            far = place[m - 1]
            if k == 1:  # the third: far from both
                for v in vertices:
                    if min(distance[0, v], distance[1, v]) > min(distance[0, far], distance[1, far]):
                        far = v
        least, cut, chosen, taken = -1.0, 0, HERE, 0
        for way in range(6):
            for v in vertices:
                value[v] = way_value(distance, way, v)
            at_cut, at_side, cost = best_cut(start, neighbours, weight, mark, part, vertices, value)
            if cost >= 0 and (least < 0 or cost < least):
                least, cut, chosen, taken = cost, at_cut, at_side, way
        if least < 0:
            continue
        sizes[:] = 0
        for v in vertices:
            side[v] = HERE if way_value(distance, taken, v) < cut else THERE
            sizes[side[v]] += weight[v]
        n_separator = 0  # (3)
        for v in vertices:
            if side[v] == chosen:
                for e in range(start[v], start[v + 1]):
                    u = neighbours[e]
                    if mark[u] == part and side[u] == 1 - chosen:
                        separator[n_separator] = v
                        n_separator += 1
                        break
        for k in range(n_separator):
            side[separator[k]] = BETWEEN
            sizes[chosen] -= weight[separator[k]]
        refine(start, neighbours, weight, mark, part, side, separator, n_separator, sizes)
        at = middle = end = 0
        for which in range(3):
            for v in vertices:
                if side[v] == which:
                    place[at] = v
                    at += 1
            if which == HERE:
                middle = at
            elif which == THERE:
                end = at
        order[lo:hi] = place[:m]
        if 0 < middle < end:
            todo.append((lo, lo + middle))
            todo.append((lo + middle, lo + end))
    return order


@jit
def way_value(distance, way, v):
    """Return the value of a vertex in one of six orders of a part: three distances, and their differences."""
    if way < 3:
        return distance[way, v]
    return distance[way - 3, v] - distance[(way - 2) % 3, v]
