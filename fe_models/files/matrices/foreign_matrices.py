"""Unchecked mass and stiffness matrices of another program, in one record for all readers."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import dofs_of
from fe_models.errors import MatrixError
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import FrozenMapping, checked_fields, frozen_copies

__all__ = ["SCALAR", "ForeignMatrices", "pair_keys"]

SCALAR = -1  #: component number of a dof without position: a scalar point or a modal coordinate
ROLES = ("K", "M", "D")


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ForeignMatrices:
    """Matrices, the dofs of their rows, and the nodes of these dofs, as far as the files contain them.

    The reader of one file sets the fields that the file contains; `joined` combines the files of a model. Matrices have
    both triangles: if a file has only one, its reader mirrors it and records the stored one in `triangle`.

    Parameters
    ----------
    K
        Stiffness, (n_dof, n_dof).
    M
        Mass, (n_dof, n_dof).
    D
        Viscous damping, (n_dof, n_dof).
    dofs
        (node number, component 0-5 or `SCALAR`) of every row, (n_dof, 2); None: the files do not state it.
    row_nodes
        Number of the node of every 3 or 6 consecutive rows, (n,), for files without `dofs`.
    node_numbers
        Numbers of `nodes`, (n_nodes,).
    nodes
        Positions in the basic axes of the model, (n_nodes, 3); None: the files do not state them.
    systems
        Axes of the dofs of a node by its number, as columns in basic axes, (3, 3); other nodes have basic axes.
    loads
        Forces over the rows by name, (n_dof,).
    others
        Further matrices of the files by name, unchanged.
    triangle
        Stored triangle of each matrix by its name: both, lower, upper, diagonal.
    constrained
        Constrained rows, (n,).
    removed
        Dofs without rows because they are constrained, (node number, component), (n, 2).
    program
        Program that wrote the files, if they name it.
    files
        sha256 of each file by its path.
    notes
        Descriptions of what the readers left out, changed or assumed.

    Raises
    ------
    MatrixError
        If shapes do not fit together.
    """

    K: sp.csc_array | None = None
    M: sp.csc_array | None = None
    D: sp.csc_array | None = None
    dofs: IntArray | None = None
    row_nodes: IntArray | None = None
    node_numbers: IntArray | None = None
    nodes: Array | None = None
    systems: Mapping[int, Array] = field(default_factory=dict)
    loads: Mapping[str, Array] = field(default_factory=dict)
    others: Mapping[str, Any] = field(default_factory=dict)
    triangle: Mapping[str, str] = field(default_factory=dict)
    constrained: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    removed: IntArray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    program: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        n = None
        for role in ROLES:
            matrix = getattr(self, role)
            if matrix is None:
                continue
            matrix = sp.csc_array(matrix)
            put(self, role, matrix)
            if matrix.shape[0] != matrix.shape[1]:
                raise MatrixError(f"{role}: expected a square matrix, got {matrix.shape[0]} x {matrix.shape[1]}")
            if n is not None and matrix.shape[0] != n:
                raise MatrixError(f"{role}: expected {n} rows as the matrix before it, got {matrix.shape[0]}")
            n = matrix.shape[0]
        if self.dofs is not None:
            put(self, "dofs", frozen(self.dofs, np.int64))
            if self.dofs.ndim != 2 or self.dofs.shape[1] != 2:
                raise MatrixError(f"dofs: expected (node, component) of every row, got shape {self.dofs.shape}")
            if n is not None and len(self.dofs) != n:
                raise MatrixError(f"dofs: expected {n}, one for each row of the matrices, got {len(self.dofs)}")
            if len(self.dofs) and not (SCALAR <= self.dofs[:, 1].min() and self.dofs[:, 1].max() <= 5):
                raise MatrixError(
                    f"dofs: expected components 0 to 5, got {self.dofs[:, 1].min()} to {self.dofs[:, 1].max()}"
                )
            n = len(self.dofs)
        if self.row_nodes is not None:
            put(self, "row_nodes", frozen(self.row_nodes, np.int64))
            if n is not None and n not in (3 * len(self.row_nodes), 6 * len(self.row_nodes)):
                raise MatrixError(
                    f"row_nodes: expected 3 or 6 of {n} rows to each node, got a list of {len(self.row_nodes)} nodes"
                )
        if (self.nodes is None) != (self.node_numbers is None):
            raise MatrixError("nodes: expected positions and numbers of the nodes together, got one of them")
        if self.nodes is not None and self.node_numbers is not None:
            put(self, "nodes", frozen(self.nodes))
            put(self, "node_numbers", frozen(self.node_numbers, np.int64))
            if self.nodes.shape != (len(self.node_numbers), 3):
                raise MatrixError(
                    f"nodes: expected ({len(self.node_numbers)}, 3) positions, one for each number, got "
                    f"{self.nodes.shape}"
                )
        for name, load in self.loads.items():
            if n is not None and np.shape(load) != (n,):
                raise MatrixError(f"load {name!r}: expected {n} forces, one for each row, got shape {np.shape(load)}")
        for name in ("loads", "systems"):
            put(self, name, FrozenMapping({key: frozen(value) for key, value in getattr(self, name).items()}))
        for name in ("others", "triangle", "files"):
            put(self, name, FrozenMapping(dict(getattr(self, name))))
        put(self, "constrained", frozen(self.constrained, np.int64))
        put(self, "removed", frozen(np.reshape(self.removed, (-1, 2)), np.int64))
        put(self, "notes", tuple(self.notes))

    @property
    def n_dof(self) -> int | None:
        """Number of rows; None if only nodes are known."""
        for role in ROLES:
            if (matrix := getattr(self, role)) is not None:
                return int(matrix.shape[0])
        return None if self.dofs is None else len(self.dofs)


def pair_keys(dofs: IntArray) -> IntArray:
    """Return one integer for each (node number, component), (n,), for look-up in other lists."""
    return np.asarray(dofs[:, 0] * 8 + dofs[:, 1], dtype=np.int64)


def joined(parts: Iterable[ForeignMatrices], where: str) -> ForeignMatrices:
    """Combine the contents of several files of one model.

    (1) take each matrix from the only file that has it; rows are in the order of the file with most dofs
    (2) rows that a file lacks are zero in its matrices (dofs without mass); a note reports them
    (3) collect nodes, systems, loads, notes and files

    Raises
    ------
    MatrixError
        If two files have the same matrix, or their rows do not fit.
    """
    parts = with_dofs(list(parts), where)
    dofs = order_of(parts, where)  # (1)
    matrices: dict[str, sp.csc_array] = {}
    loads: dict[str, Array] = {}
    notes: list[str] = []
    constrained = [np.zeros(0, np.int64)]
    for part in parts:
        place = None if dofs is None or part.dofs is None else rows_in(dofs, part.dofs)
        for role in ROLES:
            matrix = getattr(part, role)
            if matrix is None:
                continue
            if role in matrices:
                raise MatrixError(f"{where}: {role} is in two of the files; expected each matrix once")
            matrices[role] = matrix if place is None else placed(matrix, place, len(dofs))  # type: ignore[arg-type]
            if place is not None and len(place) < len(dofs):  # type: ignore[arg-type]
                notes.append(f"{len(dofs) - len(place)} rows that {role} lacks are zero there")  # type: ignore[arg-type] # (2)
        for name, load in part.loads.items():
            whole = load if place is None else np.zeros(len(dofs))  # type: ignore[arg-type]
            if place is not None:
                whole[place] = load
            loads[name] = whole
        constrained.append(part.constrained if place is None else place[part.constrained])
        notes += part.notes
    sizes = {role: matrix.shape[0] for role, matrix in matrices.items()}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{role} {n}" for role, n in sizes.items())
        raise MatrixError(f"{where}: expected matrices with the same rows, got {listed} rows; are they of one model?")
    if dofs is not None and sizes and len(dofs) not in sizes.values():
        raise MatrixError(
            f"{where}: expected a list of {next(iter(sizes.values()))} dofs, one for each row, got {len(dofs)}; are "
            "they of one model?"
        )
    with_nodes = [part for part in parts if part.nodes is not None]
    return ForeignMatrices(
        K=matrices.get("K"),
        M=matrices.get("M"),
        D=matrices.get("D"),
        dofs=dofs,
        nodes=with_nodes[0].nodes if with_nodes else None,
        node_numbers=with_nodes[0].node_numbers if with_nodes else None,
        systems={number: R for part in parts for number, R in part.systems.items()},
        loads=loads,
        others={name: value for part in parts for name, value in part.others.items()},
        triangle={role: stored for part in parts for role, stored in part.triangle.items()},
        constrained=np.unique(np.concatenate(constrained)),
        removed=np.unique(np.concatenate([part.removed for part in parts]), axis=0),
        program=", ".join(dict.fromkeys(part.program for part in parts if part.program)),
        files={path: digest for part in parts for path, digest in part.files.items()},
        notes=tuple(dict.fromkeys(notes)),
    )


def with_dofs(parts: list[ForeignMatrices], where: str) -> list[ForeignMatrices]:
    """Return the parts with a list of nodes, which have 3 or 6 rows each, converted to a list of dofs."""
    sizes = [part.n_dof or 0 for part in parts if part.K is not None or part.M is not None or part.D is not None]
    made = []
    for part in parts:
        if part.row_nodes is not None:
            n, n_nodes = max(sizes, default=0), len(part.row_nodes)
            if n not in (3 * n_nodes, 6 * n_nodes):
                raise MatrixError(f"{where}: expected 3 or 6 of {n} rows to each node of the list, got {n_nodes} nodes")
            part = replace(part, dofs=dofs_of(part.row_nodes, n // n_nodes), row_nodes=None)
        made.append(part)
    return made


def order_of(parts: list[ForeignMatrices], where: str) -> IntArray | None:
    """Return the dofs of all files in the order of the file with most dofs; None if no file names them."""
    named = [part.dofs for part in parts if part.dofs is not None]
    if not named:
        return None
    order = max(named, key=len)
    for other in named:
        if not np.isin(pair_keys(other), pair_keys(order)).all():
            raise MatrixError(
                f"{where}: the files name different dofs: {len(other)} in one, {len(order)} in another, and some of "
                "the first are not in the second; are they of one model?"
            )
    return order


def rows_in(dofs: IntArray, wanted: IntArray) -> IntArray:
    """Return the rows of the wanted dofs in a list that contains all of them."""
    keys = pair_keys(dofs)
    order = np.argsort(keys)
    return np.asarray(order[np.searchsorted(keys[order], pair_keys(wanted))])


def placed(matrix: sp.csc_array, rows: IntArray, n: int) -> sp.csc_array:
    """Return a matrix with its rows and columns moved to other positions of a larger matrix."""
    if len(rows) == n and np.array_equal(rows, np.arange(n)):
        return matrix
    entries = sp.coo_array(matrix)
    return sp.csc_array((entries.data, (rows[entries.row], rows[entries.col])), shape=(n, n))
