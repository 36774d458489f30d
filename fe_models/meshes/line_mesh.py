"""The mesh of a frame: nodes, straight two-node lines, and groups for sections and interfaces."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from fe_models.errors import BeamError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.meshes.mesh import freeze_mesh, require_members, require_nodes

__all__ = ["LineMesh", "divide_lines", "straight_line"]


# line mesh ------------------------------------------------------------------------------------------------------------


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class LineMesh:
    """Nodes and two-node lines of one body.

    Parameters
    ----------
    nodes
        Positions of the nodes, (n_nodes, 3), in the length unit of the model.
    lines
        End nodes, (n_lines, 2).
    line_sets
        Rows of `lines` of each group.
    node_sets
        Nodes of each group.
    orientations
        Vector towards the local y axis of each line, (n_lines, 3); NaN rows: default.
    offsets
        Vectors from node to axis end, mesh axes, (n_lines, 2, 3) [m]; None: zero.
    source
        File it was read from, or how it was made.
    digest
        sha256 of that file.
    included
        sha256 of each file that the source includes.
    node_numbers
        Numbers of the nodes in the file, (n_nodes,); empty: none.
    line_numbers
        Numbers of the lines in the file, (n_lines,); empty: none.
    notes
        Descriptions of what the reader left out or changed.

    Raises
    ------
    BeamError
        If shapes do not fit, a line refers to an unknown node, or a coordinate is not finite.
    """

    nodes: Array
    lines: IntArray
    line_sets: Mapping[str, IntArray] = field(default_factory=dict)
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    orientations: Array | None = None
    offsets: Array | None = None
    source: str = ""
    digest: str = ""
    included: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    node_numbers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    line_numbers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_mesh(self)
        object.__setattr__(self, "lines", self.lines.reshape(-1, 2))
        n = len(self.lines)
        require_nodes("line mesh", self.nodes, BeamError)
        members = [
            ("lines", self.lines, len(self.nodes)),
            *[(f"node set {g!r}", m, len(self.nodes)) for g, m in self.node_sets.items()],
            *[(f"line set {g!r}", m, n) for g, m in self.line_sets.items()],
        ]
        require_members("line mesh", members, BeamError)
        for name, shape in (("orientations", (n, 3)), ("offsets", (n, 2, 3))):
            given = getattr(self, name)
            if given is not None and given.shape != shape:
                raise BeamError(f"line mesh: {name}: expected {shape}, got {given.shape}")


def straight_line(start: object, end: object, n: int, *, name: str = "beam") -> LineMesh:
    """Return a straight line of n equal elements; its node sets are "start" and "end", its line set is `name`.

    Parameters
    ----------
    start, end
        Points, (3,) [m].
    n
        Number of elements.
    name
        Name of the line set.
    """
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    if n < 1 or a.shape != (3,) or b.shape != (3,):
        raise BeamError(f"straight_line: expected two points (3,) and n >= 1, got {start}, {end}, n = {n}")
    s = np.linspace(0.0, 1.0, n + 1)[:, None]
    return LineMesh(
        nodes=(1 - s) * a + s * b,
        lines=np.stack([np.arange(n), np.arange(1, n + 1)], axis=1),
        line_sets={name: np.arange(n)},
        node_sets={"start": np.array([0]), "end": np.array([n])},
        source=f"straight line of {n} elements",
    )


# division of lines into equal pieces: a frame is described by long lines and computed with short ones -----------------


def divide_lines(mesh: LineMesh, n: ArrayLike) -> LineMesh:
    """Return the mesh with each line divided into equal pieces.

    The new nodes come after the old ones, line by line from the first end. They have no numbers in the file. Groups of
    lines contain all pieces. A group of nodes with the same name that contained all line ends also receives the new
    nodes. Orientations do not change, and offsets of the axis are interpolated linearly.

    Parameters
    ----------
    mesh
        Mesh of lines.
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
