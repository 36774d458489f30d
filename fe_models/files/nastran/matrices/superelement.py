"""External superelements of Nastran (EXTSEOUT): matrices of an .op4 file with the rows of its .asm and .pch files.

Matrices of Nastran are in the displacement systems (CD) of the grid points. They are converted to basic axes:
K = T K_local Tᵀ, where T has the axes of each grid point on its diagonal.
"""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.nastran.bulk_data.cards import Card, read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import GridPoints, read_grid_points
from fe_models.files.nastran.matrices.dti import EMPTY, SCALAR, RecoveryRows, element_rows, grid_rows
from fe_models.files.nastran.matrices.op4 import is_op4, read_op4
from fe_models.files.nastran.matrices.raw_matrix import NastranMatrix, dense_matrix, matrix_named, real_square
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["SCALAR", "TEXTS", "ElementRows", "NastranSuperelement", "Recovery", "extrn_rows", "read_superelement"]

TEXTS = (".pch", ".asm")  #: suffixes of the text files with the same name as the .op4 file
STIFFNESS, MASS, DAMPING = ("KXX", "KAA"), ("MXX", "MAA"), ("BXX", "BXX1", "BAA")
LOADS, OTHER_DAMPING = ("PX", "PX1", "PA", "PAA"), ("K4XX", "K4XX1", "K4AA")


@dataclass(frozen=True, eq=False)
class Recovery:
    """Recovery of grid point displacements, u = matrix @ u_superelement."""

    matrix: Array  #: recovery matrix, (n_rows, n_dof); rows are in basic axes if the axes of the grid point are known
    rows: IntArray  #: (id, component 0-5 or `SCALAR`) of each row, (n_rows, 2)
    unplaced: IntArray  #: ids of grid points with unknown position and axes; their rows are in their own axes


@dataclass(frozen=True, eq=False)
class ElementRows:
    """Recovery of element forces or stresses from the displacements of the superelement."""

    matrix: Array  #: recovery matrix, (n_rows, n_dof), in the axes of each element
    elements: IntArray  #: (element type of Nastran, id, item from 1) of each row, (n_rows, 3); type 34 is CBAR


@dataclass(frozen=True, eq=False)
class NastranSuperelement:
    """Content of the files of an external superelement, in basic axes and units of its model."""

    where: str  #: names of its files, for messages
    K: sp.csc_array  #: stiffness, (n_dof, n_dof)
    M: sp.csc_array  #: mass, (n_dof, n_dof)
    D: sp.csc_array | None  #: viscous damping, (n_dof, n_dof)
    dofs: IntArray  #: (id, component 0-5 or `SCALAR`) of each row, (n_dof, 2)
    positions: Mapping[int, Array]  #: position of each grid point defined in the files, (3,), by id
    loads: Array  #: load vectors, (n_dof, n_loads); (n_dof, 0) if there are none
    displacement: Recovery | None  #: recovery matrix MUG1
    forces: ElementRows | None  #: recovery matrix MEF1
    stresses: ElementRows | None  #: recovery matrix MES1
    files: Mapping[str, str] = field(default_factory=dict)  #: sha256 of each file, by path
    notes: tuple[str, ...] = ()  #: notes on data that were included, assumed or omitted

    @property
    def grid_ids(self) -> list[int]:
        """Return the grid points of the rows, in the order of the rows."""
        return list(dict.fromkeys(self.dofs[self.dofs[:, 1] != SCALAR, 0].tolist()))

    @property
    def scalar_ids(self) -> list[int]:
        """Return the scalar points (modal coordinates) of the rows, in the order of the rows."""
        return self.dofs[self.dofs[:, 1] == SCALAR, 0].tolist()


def read_superelement(files: str | Path | Iterable[str | Path]) -> NastranSuperelement:
    """Read an external superelement.

    (1) matrices from the .op4 file: KXX or KAA, MXX or MAA, BXX, PX, MUG1, MEF1, MES1
    (2) rows of the matrices: grid points and scalar points in the order of the EXTRN card of the .pch file
    (3) positions and displacement systems: GRID and CORD cards of all text files, including bulk data of the model
    (4) rows of MUG1, MEF1, MES1: tables TUG1, TEF1, TES1 of the .pch file
    (5) convert everything to basic axes

    Parameters
    ----------
    files
        One of the .op4, .pch or .asm files; the others with the same name in its folder are read too. Or all files,
        including bulk data that defines grid points of the recovery.

    Raises
    ------
    MatrixError
        If a file or matrix is missing, damaged or given twice, sizes do not fit the rows, rows of a grid point cannot
        be converted to basic axes, or a matrix is complex.
    MeshError
        If the cards do not define the grid points.
    """
    paths = [Path(files)] if isinstance(files, (str, Path)) else [Path(path) for path in files]
    notes = []
    if len(paths) == 1 and paths[0].suffix.lower() in (".op4", *TEXTS):
        beside = [path for path in _companions(paths[0]) if path.is_file()]
        paths = [path for path in beside if path.suffix != paths[0].suffix] + paths
        notes.append(f"read together: {', '.join(sorted(path.name for path in paths))}")
    where = f"superelement {', '.join(sorted(path.name for path in paths))}"
    matrices, cards, digests = _contents(where, paths)
    if not matrices:
        raise MatrixError(f"{where}: expected an .op4 file with the matrices, got none; give it too")
    K = real_square(matrix_named(where, matrices, *STIFFNESS))  # (1)
    M = real_square(matrix_named(where, matrices, *MASS))
    n = K.shape[0]
    if M.shape != K.shape:
        raise MatrixError(f"{where}: stiffness has {n} rows, mass {M.shape[0]}; expected the same")
    dofs = extrn_rows(where, cards)  # (2)
    if len(dofs) != n:
        raise MatrixError(
            f"{where}: EXTRN names {len(dofs)} rows, the matrices have {n}; these files do not belong together"
        )
    points = read_grid_points(cards)  # (3)
    missing = [number for number, component in dofs.tolist() if component != SCALAR and number not in points.positions]
    if missing:
        raise MatrixError(
            f"{where}: the position of grid point {missing[0]} is in none of the files; give the .asm or .pch file, "
            "or the bulk data of the model"
        )
    T = _turn(where, dofs, points)  # (5)
    D = _optional(where, matrices, DAMPING, n)
    structural = _optional(where, matrices, OTHER_DAMPING, n)
    if structural is not None:
        notes.append(f"{structural.name}: structural damping is left out; give a modal damping in its place")
    load = _optional(where, matrices, LOADS, n, square=False)
    displacement, forces, stresses = _recoveries(where, matrices, cards, points, T)
    if displacement is not None and len(displacement.unplaced):
        notes.append(
            f"MUG1: {len(displacement.unplaced)} grid points of the recovery have no position in these files (first: "
            f"{displacement.unplaced[0]}); give the bulk data of the model for them"
        )
    return NastranSuperelement(
        where=where,
        K=sp.csc_array(T @ K @ T.T),
        M=sp.csc_array(T @ M @ T.T),
        D=None if D is None else sp.csc_array(T @ real_square(D) @ T.T),
        dofs=dofs,
        positions=points.positions,
        loads=np.zeros((n, 0)) if load is None else T @ dense_matrix(load, n, load.matrix.shape[1], "its header"),
        displacement=displacement,
        forces=forces,
        stresses=stresses,
        files=digests,
        notes=tuple(notes),
    )


def _companions(path: Path) -> list[Path]:
    """Return the paths of the files that belong together, with suffixes in the same letter case."""
    return [path.with_suffix(suffix.upper() if path.suffix.isupper() else suffix) for suffix in (".op4", *TEXTS)]


def _contents(where: str, paths: list[Path]) -> tuple[list[NastranMatrix], list[Card], dict[str, str]]:
    """Read the matrices and the cards of all files."""
    matrices: list[NastranMatrix] = []
    cards: list[Card] = []
    digests: dict[str, str] = {}
    for path in paths:
        try:
            content = path.read_bytes()
        except OSError as error:
            raise MatrixError(f"{where}: {path} cannot be read: {error.strerror or error}") from error
        digests[str(path)] = hashlib.sha256(content).hexdigest()
        if is_op4(content[:4096]) or path.suffix.lower() == ".op4":
            if matrices:
                raise MatrixError(f"{where}: expected one .op4 file, got a second one, {path}")
            matrices = list(read_op4(path))
        else:
            cards += read_cards(str(path), content.decode("utf-8", "replace"))
    return matrices, cards, digests


def extrn_rows(where: str, cards: list[Card]) -> IntArray:
    """Return the (id, component 0-5 or `SCALAR`) of each row from the EXTRN cards, (n_dof, 2).

    Raises
    ------
    MatrixError
        If there is no such card, or it names a row twice, or without valid components.
    """
    found = [card for card in cards if card.name == "EXTRN"]
    if not found:
        raise MatrixError(
            f"{where}: expected an EXTRN card with the grid points of the rows, got none; give the .pch file that "
            "Nastran wrote beside the .op4 file"
        )
    rows: list[tuple[int, int]] = []
    for card in found:
        used = len(card.fields)
        for k in range(1, used + 1, 2):
            if not card.text(k) and not card.text(k + 1):
                continue
            number, components = card.integer(k), card.text(k + 1) or "0"
            if components == "0":
                rows.append((number, SCALAR))
            elif components.isdigit() and set(components) <= set("123456"):
                rows += [(number, int(component) - 1) for component in sorted(set(components))]
            else:
                raise MatrixError(
                    f"{card.where}: grid point {number}: expected components 1 to 6 or 0, got {components!r}"
                )
    if len(set(rows)) < len(rows):
        twice = next(row for k, row in enumerate(rows) if row in rows[:k])
        raise MatrixError(f"{where}: EXTRN names point {twice[0]} twice with the same component")
    return np.array(rows, dtype=np.int64).reshape(-1, 2)


def _turn(where: str, rows: IntArray, points: GridPoints) -> sp.csr_array:
    """Return T in u_basic = T u, (n, n): the axes of each grid point for its translations and rotations."""
    index = {(int(number), int(component)): k for k, (number, component) in enumerate(rows)}
    T = sp.lil_array((len(rows), len(rows)))
    T.setdiag(1.0)
    for number in dict.fromkeys(rows[:, 0].tolist()):
        R = points.axes.get(number)
        if R is None or np.array_equal(R, np.eye(3)):
            continue
        for first in (0, 3):
            places = [index.get((number, first + k)) for k in range(3)]
            given = [place for place in places if place is not None]
            if len(given) not in (0, 3):
                raise MatrixError(
                    f"{where}: grid point {number} has rows for some components only, in a displacement system of its "
                    "own; expected all three translations or rotations, which can be turned to basic axes"
                )
            if given:
                T[np.ix_(given, given)] = R
    return sp.csr_array(T)


def _optional(
    where: str, matrices: list[NastranMatrix], names: tuple[str, ...], n: int, *, square: bool = True
) -> NastranMatrix | None:
    """Return a matrix with n rows; None if it is missing, or represented by a single zero."""
    given = [matrix for matrix in matrices if matrix.name in names and matrix.matrix.nnz]
    if not given:
        return None
    found = matrix_named(where, given, *names)
    n_rows, n_columns = found.matrix.shape
    if n_rows != n or (square and n_columns != n):
        raise MatrixError(f"{found.where}: expected {n} rows as the stiffness, got a matrix of {n_rows} x {n_columns}")
    return found


def _recoveries(
    where: str, matrices: list[NastranMatrix], cards: list[Card], points: GridPoints, T: sp.csr_array
) -> tuple[Recovery | None, ElementRows | None, ElementRows | None]:
    """Return displacements, element forces and element stresses of the superelement, each with its row map."""  # (4)
    n = T.shape[0]

    def rows_of(name: str, table: str, read: RecoveryRows) -> tuple[Array, IntArray] | None:
        if not any(matrix.name == name and matrix.matrix.shape != (1, 1) for matrix in matrices):
            return None
        raw = matrix_named(where, matrices, name)
        rows = read(where, cards, table, raw.matrix.shape[0])
        return dense_matrix(raw, len(rows), n, f"the table {table} with the stiffness"), rows

    displacement = None
    if found := rows_of("MUG1", "TUG1", grid_rows):
        matrix, rows = found
        is_row = rows[:, 1] != EMPTY
        matrix, rows = matrix[is_row], rows[is_row]
        known = np.array([c == SCALAR or number in points.positions for number, c in rows.tolist()], dtype=bool)
        turned = _turn(f"{where}: MUG1", rows, points) @ matrix @ T.T
        displacement = Recovery(np.ascontiguousarray(turned), rows, np.unique(rows[~known, 0]))
    elements = []
    for name, table in (("MEF1", "TEF1"), ("MES1", "TES1")):
        found = rows_of(name, table, element_rows)
        elements.append(None if found is None else ElementRows(np.ascontiguousarray(found[0] @ T.T), found[1]))
    return displacement, elements[0], elements[1]
