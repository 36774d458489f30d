"""The mesh of a shell body: nodes, triangles, quads, lines of stiffeners, and their groups."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.errors import ShellError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.meshes.mesh import freeze_mesh, require_members, require_nodes

__all__ = ["FLAT_TYPES", "ShellMesh", "flat_plate", "mapped_shell"]

FLAT_TYPES = ("triangle", "quad")  #: cell types, with meshio names and node order


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ShellMesh:
    """Nodes and flat cells of one body; lines between its nodes may represent stiffeners.

    Parameters
    ----------
    nodes
        Positions of the nodes, (n_nodes, 3), in the length unit of the model.
    cells
        Cells by type in `FLAT_TYPES`, (n_cells, 3) and (n_cells, 4).
    cell_sets
        Rows of `cells` of each group, by cell type.
    lines
        End nodes of stiffeners, (n_lines, 2).
    line_sets
        Rows of `lines` of each group.
    node_sets
        Nodes of each group.
    source
        File it was read from, or how it was made.
    digest
        sha256 of that file.
    included
        sha256 of each file that the source includes.
    node_numbers
        Numbers of the nodes in the file, (n_nodes,); empty: none.
    cell_numbers
        Numbers of the cells in the file, (n_cells,), by cell type.
    line_numbers
        Numbers of the lines in the file, (n_lines,); empty: none.
    notes
        Descriptions of what the reader left out or changed.

    Raises
    ------
    ShellError
        If shapes do not fit, a cell refers to an unknown node, or a coordinate is not finite.
    """

    nodes: Array
    cells: Mapping[str, IntArray]
    cell_sets: Mapping[str, Mapping[str, IntArray]] = field(default_factory=dict)
    lines: IntArray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    line_sets: Mapping[str, IntArray] = field(default_factory=dict)
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    source: str = ""
    digest: str = ""
    included: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    node_numbers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    cell_numbers: Mapping[str, IntArray] = field(default_factory=dict)
    line_numbers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_mesh(self)
        object.__setattr__(self, "lines", self.lines.reshape(-1, 2))
        require_nodes("shell mesh", self.nodes, ShellError)
        for kind, cells in self.cells.items():
            if kind not in FLAT_TYPES:
                raise ShellError(f"shell mesh: cells: expected types {', '.join(FLAT_TYPES)}, got {kind!r}")
            if cells.ndim != 2 or cells.shape[1] != len(kind.replace("triangle", "123").replace("quad", "1234")):
                raise ShellError(f"shell mesh: {kind}: expected (n_cells, nodes per cell), got {cells.shape}")
        members = [
            *[(kind, cells, len(self.nodes)) for kind, cells in self.cells.items()],
            ("lines", self.lines, len(self.nodes)),
            *[(f"node set {g!r}", m, len(self.nodes)) for g, m in self.node_sets.items()],
            *[(f"line set {g!r}", m, len(self.lines)) for g, m in self.line_sets.items()],
            *[
                (f"cell set {g!r}", rows, len(self.cells.get(kind, ())))
                for g, by_type in self.cell_sets.items()
                for kind, rows in by_type.items()
            ],
        ]
        require_members("shell mesh", members, ShellError)

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return sum(len(cells) for cells in self.cells.values())

    def cell_name(self, kind: str, row: int) -> str:
        """Return the name of a cell for messages, with its number in the file if it has one."""
        return f"{kind} {self.cell_numbers[kind][row] if kind in self.cell_numbers else row}"


def mapped_shell(
    surface: Callable[[Array, Array], Array], n_u: int, n_v: int, *, kind: str = "quad", name: str = "shell"
) -> ShellMesh:
    """Return a grid of n_u × n_v quads, or twice as many triangles, mapped from the unit square to a surface.

    The cells form the group `name`; the nodes of the sides form the node sets "u0", "u1", "v0", "v1". The normal is
    along ∂X/∂u × ∂X/∂v. Diagonals of triangles alternate.

    Parameters
    ----------
    surface
        Function from u and v, (n,) each in 0..1, to X, (n, 3) [m].
    n_u, n_v
        Numbers of cells along u and v.
    name
        Name of the group of cells.
    kind
        "quad" or "triangle".
    """
    if n_u < 1 or n_v < 1 or kind not in FLAT_TYPES:
        raise ShellError(
            f"mapped_shell: expected n_u, n_v >= 1 and a kind of {', '.join(FLAT_TYPES)}, got {n_u}, {n_v}, {kind!r}"
        )
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, n_u + 1), np.linspace(0, 1, n_v + 1), indexing="ij"))
    index = np.arange(u.size).reshape(n_u + 1, n_v + 1)
    cells = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    if kind == "triangle":
        is_odd = (np.add.outer(np.arange(n_u), np.arange(n_v)) % 2).astype(bool).ravel()
        cells = np.where(is_odd[:, None], np.roll(cells, -1, axis=1), cells)
        cells = np.stack([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    return ShellMesh(
        nodes=surface(u, v),
        cells={kind: cells},
        cell_sets={name: {kind: np.arange(len(cells))}},
        node_sets={"u0": index[0], "u1": index[-1], "v0": index[:, 0], "v1": index[:, -1]},
        source=f"grid of {n_u} x {n_v} {kind}s",
    )


def flat_plate(a: float, b: float, n_a: int, n_b: int, *, kind: str = "quad", name: str = "shell") -> ShellMesh:
    """Return the mesh of a rectangle 0..a × 0..b in the x-y plane, normal z; see `mapped_shell`.

    Parameters
    ----------
    a, b
        Lengths of the sides along x and y [m].
    n_a, n_b
        Numbers of cells along x and y.
    kind
        "quad" or "triangle".
    name
        Name of the group of cells.
    """
    return mapped_shell(lambda u, v: np.stack([a * u, b * v, 0 * u], axis=1), n_a, n_b, kind=kind, name=name)
