"""Elimination order and fill of the block factorisation of connections that share bodies; computed once per system."""

from heapq import heapify, heappop, heappush

from fe_models.foundation.arrays import IntArray
from floatframe.engine.kernels.model import Elimination
from floatframe.engine.kernels.records import filled

__all__ = ["plan_elimination"]


def plan_elimination(sizes: list[int], ends_of_bodies: list[list[int]], connection_of: IntArray) -> Elimination:
    """Plan the block LU factorisation of a structurally symmetric matrix.

    (1) two connections are neighbours if both have an end on the same body;
    (2) the connection with the fewest neighbours is eliminated next, and its neighbours become neighbours of each other
        (minimum degree: no fill for chains and trees);
    (3) every block of the factors that is not zero gets its position in one flat array.

    Parameters
    ----------
    sizes
        Number of rows of each connection.
    ends_of_bodies
        Markers that are ends of connections, for each body.
    connection_of
        Connection of each marker.
    """
    n = len(sizes)
    neighbours: list[set[int]] = [set() for _ in range(n)]
    for ends in ends_of_bodies:
        group = {int(connection_of[m]) for m in ends}
        for j in group:
            neighbours[j] |= group - {j}
    place: dict[tuple[int, int], int] = {}
    n_store = 0

    def block(i: int, j: int) -> int:
        nonlocal n_store
        if (i, j) not in place:
            place[i, j] = n_store
            n_store += sizes[i] * sizes[j]
        return place[i, j]

    diagonal = [block(j, j) for j in range(n)]
    pairs = [(a, b) for ends in ends_of_bodies for a in ends for b in ends]
    pair_block = [block(int(connection_of[a]), int(connection_of[b])) for a, b in pairs]
    order: list[int] = []
    after: list[int] = []
    lower: list[int] = []
    upper: list[int] = []
    update: list[int] = []
    after0, update0 = [0], [0]
    waiting = [(len(neighbours[j]), j) for j in range(n)]  # an entry is skipped if its number has changed since then
    heapify(waiting)
    is_left = [True] * n
    while waiting:
        n_neighbours, j = heappop(waiting)
        if not is_left[j] or n_neighbours != len(neighbours[j]):
            continue
        is_left[j] = False
        later = sorted(neighbours[j])
        order.append(j)
        for i in later:
            neighbours[i] |= neighbours[j] - {i}
            neighbours[i].discard(j)
            heappush(waiting, (len(neighbours[i]), i))
            after.append(i)
            lower.append(block(i, j))
            upper.append(block(j, i))
        update.extend(block(i, k) for i in later for k in later)
        after0.append(len(after))
        update0.append(len(update))

    return filled(
        Elimination(),
        order=order,
        diagonal=diagonal,
        n_store=n_store,
        pair_row=[a for a, _ in pairs],
        pair_column=[b for _, b in pairs],
        pair_block=pair_block,
        after0=after0,
        after=after,
        after_lower=lower,
        after_upper=upper,
        update0=update0,
        update=update,
    )
