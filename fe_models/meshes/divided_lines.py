"""Division of lines into equal pieces: a frame is described by long lines and computed with short ones."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fe_models.errors import BeamError
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.line_mesh import LineMesh

__all__ = ["divide_lines"]


def divide_lines(mesh: LineMesh, n: ArrayLike) -> LineMesh:
    """Return the mesh with each line divided into equal pieces.

    The new nodes come after the old ones, line by line from the first end. Their numbers in the file continue from the
    highest number. Groups of lines keep all pieces. A group of nodes with the same name that held all line ends also
    receives the new nodes. Orientations stay, and offsets of the axis are interpolated linearly.

    Parameters
    ----------
    mesh
        Any mesh of lines.
    n
        Number of pieces of each line, 1 or more: one number for all lines, or (n_lines,).

    Raises
    ------
    BeamError
        If a number is not a whole number of 1 or more.
    """
    given = np.asarray(n)
    if given.ndim > 1 or (given.ndim == 1 and given.shape != (len(mesh.lines),)):
        raise BeamError(f"divide_lines: expected one number or {len(mesh.lines)}, got {given.shape}")
    if given.dtype == bool or not np.issubdtype(given.dtype, np.integer) or (given < 1).any():
        raise BeamError(f"divide_lines: expected whole numbers from 1 on, got {given.tolist()}")
    pieces = np.broadcast_to(given, len(mesh.lines)).astype(np.int64)
    of_line = np.repeat(np.arange(len(pieces)), pieces)  # the old line of each new line
    # position of each new line within its old line
    k = np.arange(len(of_line)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    start, end = k / pieces[of_line], (k + 1) / pieces[of_line]
    is_inner = k > 0  # the first end of the new line is a new node
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
        numbers = np.concatenate([numbers, np.full(int(is_inner.sum()), -1)])  # new nodes have no number in the file
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
