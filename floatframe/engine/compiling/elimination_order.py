"""Elimination order and fill of the block factorisation of connections that share bodies; computed once per system."""

from heapq import heapify, heappop, heappush

from fe_models.foundation.arrays import IntArray
from floatframe.engine.compiling.bodies import integers, offsets
from floatframe.engine.kernels.model import Elimination
from floatframe.engine.kernels.records import filled

__all__ = ["plan_elimination"]


def plan_elimination(sizes: list[int], ends_of_bodies: list[list[int]], connection_of: IntArray) -> Elimination:
    """Plan the block LU factorisation of a structurally symmetric matrix.

    (1) two connections are neighbours if both have an end on the same body;
    (2) the connection with the fewest neighbours is eliminated next, and its neighbours become neighbours of each other
        (minimum degree: no fill for chains and trees);
    (3) for each connection, one flat array stores the diagonal block, the blocks of its row with all neighbours that
        are eliminated later as one matrix (upper panel), and the blocks of its column likewise (lower panel).

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
    order, later = least_degrees(neighbours)
    position = {j: step for step, j in enumerate(order)}
    diagonal, upper, lower, width = [0] * n, [0] * n, [0] * n, [0] * n
    first_in_panel: list[dict[int, int]] = [{} for _ in range(n)]  # first column of each later neighbour
    n_store = 0
    for j in order:
        later[j].sort(key=position.__getitem__)
        for i in later[j]:
            first_in_panel[j][i] = width[j]
            width[j] += sizes[i]
        diagonal[j], upper[j] = n_store, n_store + sizes[j] ** 2
        lower[j] = upper[j] + sizes[j] * width[j]
        n_store = lower[j] + sizes[j] * width[j]

    def block(i: int, k: int) -> tuple[int, int]:
        """Return index and row stride of block (i, k)."""
        if i == k:
            return diagonal[i], sizes[i]
        if position[i] < position[k]:
            return upper[i] + first_in_panel[i][k], width[i]
        return lower[k] + first_in_panel[k][i] * sizes[k], sizes[k]

    pairs = [(a, b) for ends in ends_of_bodies for a in ends for b in ends]
    pair_blocks = [block(int(connection_of[a]), int(connection_of[b])) for a, b in pairs]
    runs = [joined_runs([(*block(i, k), sizes[k]) for k in later[j]]) for j in order for i in later[j]]
    return filled(
        Elimination(),
        order=order,
        diagonal=diagonal,
        upper=upper,
        lower=lower,
        width=width,
        n_store=n_store,
        pair0=offsets(integers([len(ends) ** 2 for ends in ends_of_bodies])),
        pair_row=[a for a, _ in pairs],
        pair_column=[b for _, b in pairs],
        pair_block=[first for first, _ in pair_blocks],
        pair_stride=[stride for _, stride in pair_blocks],
        after0=offsets(integers([len(later[j]) for j in order])),
        after=[i for j in order for i in later[j]],
        run0=offsets(integers([len(of_row) for of_row in runs])),
        run=[first for of_row in runs for first, _, _ in of_row],
        run_stride=[stride for of_row in runs for _, stride, _ in of_row],
        run_length=[length for of_row in runs for _, _, length in of_row],
    )


def least_degrees(neighbours: list[set[int]]) -> tuple[list[int], list[list[int]]]:
    """Return the elimination order of least degree, and for each connection its neighbours that are eliminated later.

    `neighbours` is overwritten.
    """
    order: list[int] = []
    later: list[list[int]] = [[] for _ in neighbours]
    waiting = [(len(others), j) for j, others in enumerate(neighbours)]  # skipped if the number has changed since then
    heapify(waiting)
    is_left = [True] * len(neighbours)
    while waiting:
        n_neighbours, j = heappop(waiting)
        if not is_left[j] or n_neighbours != len(neighbours[j]):
            continue
        is_left[j] = False
        order.append(j)
        later[j] = sorted(neighbours[j])
        for i in later[j]:
            neighbours[i] |= neighbours[j] - {i}
            neighbours[i].discard(j)
            heappush(waiting, (len(neighbours[i]), i))
    return order, later


def joined_runs(blocks: list[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """Return blocks (index, row stride, number of columns) with those joined that are side by side in one panel."""
    runs: list[tuple[int, int, int]] = []
    for first, stride, length in blocks:
        if runs and runs[-1][:2] == (first - runs[-1][2], stride):
            runs[-1] = (*runs[-1][:2], runs[-1][2] + length)
        else:
            runs.append((first, stride, length))
    return runs
