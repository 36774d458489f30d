"""Lines cut into equal ones: a frame is described by its long lines, and computed with short ones."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fe_models.errors import BeamError
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.line_mesh import LineMesh

__all__ = ["divide_lines"]


def divide_lines(mesh: LineMesh, n: ArrayLike) -> LineMesh:
    """Return the mesh with each line cut into equal ones.

    The new nodes come after the old ones, line by line, from its first end on; their numbers in the file go on from the
    highest. Groups of lines keep all pieces; a group of nodes of the same name that held all their ends takes the new
    nodes, too. Orientations stay, offsets of the axis are linear between the ends.

    Parameters
    ----------
    mesh
        Any lines.
    n
        Pieces of each line, one number or (n_lines,), 1 or more.

    Raises
    ------
    BeamError
        If a number is no whole number from 1 on.
    """
    given = np.asarray(n)
    if given.ndim > 1 or (given.ndim == 1 and given.shape != (len(mesh.lines),)):
        raise BeamError(f"divide_lines: expected one number or {len(mesh.lines)}, got {given.shape}")
    if given.dtype == bool or not np.issubdtype(given.dtype, np.integer) or (given < 1).any():
        raise BeamError(f"divide_lines: expected whole numbers from 1 on, got {given.tolist()}")
    pieces = np.broadcast_to(given, len(mesh.lines)).astype(np.int64)
    of_line = np.repeat(np.arange(len(pieces)), pieces)  # the old line of each new one
    k = np.arange(len(of_line)) - np.repeat(np.cumsum(pieces) - pieces, pieces)  # its place in that
    start, end = k / pieces[of_line], (k + 1) / pieces[of_line]
    is_inner = k > 0  # a new line whose first end is a new node
    number = len(mesh.nodes) + np.cumsum(is_inner) - 1
    X = mesh.nodes[mesh.lines[of_line]]
    added = (1 - start)[:, None] * X[:, 0] + start[:, None] * X[:, 1]
    first = np.where(is_inner, number, mesh.lines[of_line, 0])
    last = np.append(first[1:], -1)
    last = np.where(k + 1 < pieces[of_line], last, mesh.lines[of_line, 1])
    offsets = None
    if mesh.offsets is not None:
        ends = mesh.offsets[of_line]
        offsets = np.stack([(1 - s)[:, None] * ends[:, 0] + s[:, None] * ends[:, 1] for s in (start, end)], axis=1)
    numbers = mesh.node_numbers
    if numbers.size:
        numbers = np.concatenate([numbers, np.full(int(is_inner.sum()), -1)])  # the file does not number them
    line_sets = {group: np.flatnonzero(np.isin(of_line, rows)) for group, rows in mesh.line_sets.items()}
    node_sets: dict[str, IntArray] = dict(mesh.node_sets)
    for group, rows in mesh.line_sets.items():
        if group in node_sets and np.array_equal(node_sets[group], np.unique(mesh.lines[rows])):
            pieces_of = line_sets[group]
            node_sets[group] = np.unique(np.concatenate([first[pieces_of], last[pieces_of]]))
    return replace(
        mesh,
        nodes=np.concatenate([mesh.nodes, added[is_inner]]),
        lines=np.stack([first, last], axis=1),
        line_sets=line_sets,
        node_sets=node_sets,
        orientations=None if mesh.orientations is None else mesh.orientations[of_line],
        offsets=offsets,
        node_numbers=numbers,
        line_numbers=mesh.line_numbers[of_line] if mesh.line_numbers.size else mesh.line_numbers,
    )
