"""Superelement of another program: K and M over boundary dofs and modal coordinates, including rigid motion."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cms.errors import ForeignBodyError
from cms.exchange.importers.element_rows import ForeignRows
from fe_models.files.matrices.foreign_matrices import SCALAR, ForeignMatrices, pair_keys
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.records import FrozenMapping, frozen_copies

__all__ = ["RecoveryRows", "Superelement", "superelement_of_matrices"]

LARGEST = 20_000  #: largest number of rows of a dense matrix (3 GB each)
TRIANGLE = 1e-8  #: largest |A - Aᵀ| / |A| that counts as rounding


@frozen_copies
@dataclass(frozen=True, eq=False)
class RecoveryRows:
    """Rows that give the displacement of additional nodes from the dofs x of a superelement: u = matrix @ x."""

    dofs: IntArray  #: (node number, component 0-5) of each row, basic axes, (n_rows, 2)
    matrix: Array  #: factors of x, (n_rows, n_dof)

    def __post_init__(self) -> None:
        object.__setattr__(self, "dofs", frozen(self.dofs, np.int64))
        object.__setattr__(self, "matrix", frozen(self.matrix))
        if self.dofs.shape != (len(self.matrix), 2):
            raise ForeignBodyError(
                f"recovery: expected (node, component) of each of {len(self.matrix)} rows, got {self.dofs.shape}"
            )


@frozen_copies
@dataclass(frozen=True, eq=False)
class Superelement:
    """Reduced matrices over the dofs of boundary nodes and modal coordinates, in basic axes and foreign units.

    Raises
    ------
    ForeignBodyError
        If shapes do not fit, a matrix is not finite or not symmetric, or a node has no position.
    """

    name: str
    K: Array  #: stiffness, (n_dof, n_dof)
    M: Array  #: mass, (n_dof, n_dof)
    dofs: IntArray  #: (node number, component 0-5) of each dof; component `SCALAR` is a modal coordinate, (n_dof, 2)
    node_numbers: IntArray  #: numbers of `nodes`, (n_nodes,)
    nodes: Array  #: node positions in basic axes, (n_nodes, 3)
    D: Array | None = None  #: viscous damping, (n_dof, n_dof)
    recovery: RecoveryRows | None = None
    tables: Mapping[str, ForeignRows] = field(default_factory=dict)  #: additional rows by name: forces, stresses
    loads: Mapping[str, Array] = field(default_factory=dict)  #: forces of each named load on the dofs, (n_dof,)
    program: str = ""  #: program that wrote the files
    provenance: Mapping[str, str] = field(default_factory=dict)  #: files, digests, assumptions

    def __post_init__(self) -> None:
        where = f"superelement {self.name!r}"
        put = object.__setattr__
        put(self, "dofs", frozen(self.dofs, np.int64))
        put(self, "node_numbers", frozen(self.node_numbers, np.int64))
        put(self, "nodes", frozen(self.nodes))
        n = len(self.dofs)
        if self.dofs.shape != (n, 2) or not n:
            raise ForeignBodyError(f"{where}: dofs: expected (node, component) of every row, got {self.dofs.shape}")
        if n > LARGEST:
            raise ForeignBodyError(f"{where}: expected a reduced body of at most {LARGEST} rows, got {n}; reduce it")
        for name in ("K", "M", "D"):
            matrix = getattr(self, name)
            if matrix is not None:
                put(self, name, frozen(checked_matrix(f"{where}: {name}", np.asarray(matrix, dtype=float), n)))
        if self.nodes.shape != (len(self.node_numbers), 3) or not np.isfinite(self.nodes).all():
            raise ForeignBodyError(
                f"{where}: nodes: expected a finite position (x, y, z) for each of {len(self.node_numbers)} numbers, "
                f"got shape {self.nodes.shape}"
            )
        require_unique(f"{where}: node_numbers", self.node_numbers)
        require_unique(f"{where}: dofs", pair_keys(self.dofs), "{0} has two rows for one dof")
        loads = {name: frozen(load) for name, load in self.loads.items()}
        for name, load in loads.items():
            if load.shape != (n,) or not np.isfinite(load).all():
                raise ForeignBodyError(f"{where}: load {name!r}: expected {n} finite forces, got shape {load.shape}")
        put(self, "loads", FrozenMapping(loads))
        put(self, "tables", FrozenMapping(dict(self.tables)))
        for name, rows in self.tables.items():
            if rows.matrix.shape[1] != n:
                raise ForeignBodyError(f"{where}: {name}: expected rows over {n} dofs, got shape {rows.matrix.shape}")
        put(self, "provenance", FrozenMapping(dict(self.provenance)))
        placed = [self.dofs[self.dofs[:, 1] != SCALAR, 0]]
        if self.recovery is not None:
            placed.append(self.recovery.dofs[:, 0])
            if self.recovery.matrix.shape[1] != n or not np.isfinite(self.recovery.matrix).all():
                raise ForeignBodyError(
                    f"{where}: recovery: expected finite rows over {n} dofs, got shape {self.recovery.matrix.shape}"
                )
        lost = np.setdiff1d(np.concatenate(placed), self.node_numbers)
        if len(lost):
            raise ForeignBodyError(
                f"{where}: nodes {listed(lost)} have dofs but no position in the files; give their positions "
                "(nodes = a table of number, x, y, z, or a mesh or deck that has these numbers)"
            )

    @property
    def is_modal(self) -> np.ndarray:
        """Whether each row is a modal coordinate, (n_dof,) bool."""
        return np.asarray(self.dofs[:, 1] == SCALAR)

    def places(self, numbers: IntArray) -> IntArray:
        """Return the rows of `nodes` with these numbers."""
        order = np.argsort(self.node_numbers)
        return np.asarray(order[np.searchsorted(self.node_numbers[order], numbers)])


def checked_matrix(where: str, matrix: Array, n: int) -> Array:
    """Return the symmetric part of a matrix; raise `ForeignBodyError` unless it is square, finite and symmetric."""
    if matrix.shape != (n, n):
        raise ForeignBodyError(f"{where}: expected ({n}, {n}), as many rows as dofs, got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ForeignBodyError(
            f"{where}: expected finite numbers, got {int((~np.isfinite(matrix)).sum())} that are not"
        )
    defect, size = np.abs(matrix - matrix.T).max(), np.abs(matrix).max()
    if defect > TRIANGLE * size:
        triangle = min(np.abs(np.tril(matrix, -1)).max(initial=0.0), np.abs(np.triu(matrix, 1)).max(initial=0.0))
        hint = "; one triangle is zero: only half of a symmetric matrix was written" if triangle == 0 else ""
        raise ForeignBodyError(f"{where}: expected a symmetric matrix, |A - Aᵀ| is {defect / size:.1e} of |A|{hint}")
    return np.asarray((matrix + matrix.T) / 2)


def require_unique(where: str, keys: IntArray, text: str = "{0}: a number is there twice") -> None:
    """Raise `ForeignBodyError` if a key is duplicated."""
    if len(np.unique(keys)) != len(keys):
        raise ForeignBodyError(text.format(where))


def listed(numbers: IntArray, most: int = 6) -> str:
    """Return the first numbers of a list as text."""
    rest = f" and {len(numbers) - most} more" if len(numbers) > most else ""
    return ", ".join(str(int(number)) for number in numbers[:most]) + rest


def superelement_of_matrices(
    foreign: ForeignMatrices, name: str, places: Mapping[int, Array] | None = None
) -> Superelement:
    """Return the superelement of imported matrices: rows without node position are modal coordinates.

    Parameters
    ----------
    foreign
        Stiffness and mass with the dofs of their rows.
    places
        Node number -> position, for nodes without position in the files; other positions must agree with the files.

    Raises
    ------
    ForeignBodyError
        If a matrix or the list of rows is missing, or rows are held.
    """
    where = f"superelement {name!r}"
    for role in ("K", "M"):
        if getattr(foreign, role) is None:
            raise ForeignBodyError(f"{where}: {role} is missing; also give the file that contains it")
    if foreign.dofs is None:
        raise ForeignBodyError(
            f"{where}: the files do not say which dof each row is; give the file that lists them too (.asm or .pch of "
            "Nastran, .dof of CalculiX, *MATRIX INPUT of Abaqus)"
        )
    if len(foreign.constrained):
        raise ForeignBodyError(
            f"{where}: {len(foreign.constrained)} rows are held by the other program; write the superelement without "
            "supports: a floating frame carries free bodies"
        )
    known: dict[int, Array] = {}
    if foreign.nodes is not None and foreign.node_numbers is not None:
        known = dict(zip(map(int, foreign.node_numbers), foreign.nodes, strict=True))
    for number, place in (places or {}).items():
        known.setdefault(int(number), np.asarray(place, dtype=float))
    numbers = np.array(sorted(known), dtype=np.int64)
    assert foreign.K is not None
    assert foreign.M is not None
    if foreign.K.shape[0] > LARGEST:
        raise ForeignBodyError(
            f"{where}: {foreign.K.shape[0]} rows are a full model, not a reduced one; take it as matrices of a job "
            "(`matrices = ...`, cms reduce)"
        )
    return Superelement(
        name=name,
        K=foreign.K.toarray(),
        M=foreign.M.toarray(),
        D=None if foreign.D is None else foreign.D.toarray(),
        dofs=foreign.dofs,
        node_numbers=numbers,
        nodes=np.array([known[int(number)] for number in numbers]).reshape(-1, 3),
        loads=dict(foreign.loads),
        program=foreign.program,
        provenance={
            "source": foreign.program or "matrices of another program",
            **{f"file {path}": digest for path, digest in foreign.files.items()},
            **{f"note {k + 1}": note for k, note in enumerate(foreign.notes)},
        },
    )
