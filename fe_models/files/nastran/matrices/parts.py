"""Matrix files of Nastran: OP4, OP2, DMIG in punch files and decks, and rows of superelements."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.triangles import mirrored
from fe_models.files.nastran.bulk_data.cards import Card, read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import read_grid_points
from fe_models.files.nastran.matrices.dti import SCALAR
from fe_models.files.nastran.matrices.op2 import read_op2
from fe_models.files.nastran.matrices.op4 import read_op4
from fe_models.files.nastran.matrices.raw_matrix import NastranMatrix, matrix_named, real_square
from fe_models.files.nastran.matrices.superelement import extrn_rows
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["dmig_matrices", "read_op2_part", "read_op4_part", "read_punch_part"]


# dmig -----------------------------------------------------------------------------------------------------------------
# Matrices of Nastran's bulk data (DMIG), by the grid points of their rows and columns: punch files and decks.


DMIG_SQUARE, GENERAL, SYMMETRIC, RECTANGULAR = 1, 2, 6, 9  #: forms of a matrix (IFO)
MOST_COLUMNS = 10_000_000  #: largest number of columns of a rectangular matrix


@dataclass
class _Entries:
    """Content of the cards of one matrix."""

    header: Card
    form: int
    kind: int
    is_polar: bool
    n_columns: int  #: number of columns of a rectangular matrix; 0: not given
    columns: list[tuple[int, int]] = field(default_factory=list)  # point and component, of each entry
    rows: list[tuple[int, int]] = field(default_factory=list)
    values: list[complex] = field(default_factory=list)


def dmig_matrices(cards: Iterable[Card]) -> tuple[NastranMatrix, ...]:
    """Return the matrices of the DMIG cards, in the order of their headers.

    Rows and columns are those that occur on the cards, sorted by point number and component; a square matrix has the
    same for both. For a symmetric matrix (form 6) the cards contain each pair once, and the matrix is mirrored. A
    rectangular matrix (form 9) has columns 1 to NCOL.

    Raises
    ------
    MatrixError
        If a matrix has no header or two headers, an entry is listed twice (form 6: also if both entries of a pair are
        listed), or a form, a type, a component or a column is unknown.
    """
    found: dict[str, _Entries] = {}
    for card in cards:
        if card.name != "DMIG":
            continue
        name = card.text(1).upper()
        if card.text(2) == "0":
            if name in found:
                raise MatrixError(f"{card.where}: matrix {name} has a second header; expected one")
            found[name] = _header(card)
        elif name not in found:
            raise MatrixError(f"{card.where}: a column of {name!r} without a header before it (DMIG {name} 0 ...)")
        else:
            _read_column(card, found[name])
    return tuple(_matrix(name, entries) for name, entries in found.items())


def _header(card: Card) -> _Entries:
    form, kind = card.integer(3), card.integer(4)
    if form not in (DMIG_SQUARE, GENERAL, SYMMETRIC, RECTANGULAR):
        raise MatrixError(f"{card.where} {card.text(1)}: expected form 1, 2, 6 or 9 (IFO), got {form}")
    if kind not in (1, 2, 3, 4):
        raise MatrixError(f"{card.where} {card.text(1)}: expected type 1 to 4 (TIN), got {kind}")
    n_columns = card.integer(8, 0) if form == RECTANGULAR else 0
    if not 0 <= n_columns <= MOST_COLUMNS:
        raise MatrixError(f"{card.where} {card.text(1)}: expected up to {MOST_COLUMNS} columns (NCOL), got {n_columns}")
    return _Entries(card, form, kind, card.integer(6, 0) > 0, n_columns)


def _read_column(card: Card, entries: _Entries) -> None:
    """Read one column: point and component, then groups of point, component, value and imaginary part."""
    if entries.form == RECTANGULAR:
        column = (card.integer(2), 0)
        limit = entries.n_columns or MOST_COLUMNS
        if not 0 < column[0] <= limit or card.integer(3, 0) != 0:
            raise MatrixError(
                f"{card.where} {card.text(1)}: expected a column from 1 to {limit} with component 0, got {column[0]} "
                f"and {card.text(3)!r}"
            )
    else:
        column = _point(card, 2)
    is_complex = entries.kind > 2
    for k in range(5, len(card.fields) + 1, 4):
        if not any(card.text(k + i) for i in range(4)):
            continue
        value: complex = card.real(k + 2)
        if is_complex:
            other = card.real(k + 3, 0.0)
            value = value * np.exp(1j * np.radians(other)) if entries.is_polar else complex(value, other)
        elif card.text(k + 3) and card.real(k + 3) != 0:
            raise MatrixError(
                f"{card.where} {card.text(1)}: an imaginary part in a matrix of type {entries.kind} (real)"
            )
        entries.columns.append(column)
        entries.rows.append(_point(card, k))
        entries.values.append(value)


def _point(card: Card, k: int) -> tuple[int, int]:
    """Return the point, and the component 0-5 or `SCALAR`, in two fields."""
    number, component = card.integer(k), card.integer(k + 1, 0)
    if number < 1 or not 0 <= component <= 6:
        raise MatrixError(
            f"{card.where} {card.text(1)}: expected a point and its component 0 to 6, got {number} and {component}"
        )
    return number, component - 1 if component else SCALAR


def _matrix(name: str, entries: _Entries) -> NastranMatrix:
    where = f"{entries.header.where} {name}"
    if not entries.values:
        raise MatrixError(f"{where}: has a header, but no entries")
    rows = np.array(entries.rows, dtype=np.int64)
    columns = np.array(entries.columns, dtype=np.int64)
    values = np.array(entries.values, dtype=np.complex128 if entries.kind > 2 else np.float64)
    is_square = entries.form in (DMIG_SQUARE, SYMMETRIC)
    row_points, row_index = _numbered(np.concatenate([rows, columns]) if is_square else rows, rows)
    if entries.form == RECTANGULAR:
        n_columns = entries.n_columns or int(columns[:, 0].max())
        column_points = np.stack([np.arange(1, n_columns + 1), np.zeros(n_columns, np.int64)], axis=1)
        column_index: IntArray = columns[:, 0] - 1
    elif is_square:
        column_points, column_index = row_points, _numbered(np.concatenate([rows, columns]), columns)[1]
    else:
        column_points, column_index = _numbered(columns, columns)
    shape = (len(row_points), len(column_points))
    listed = sp.csc_array(sp.coo_array((np.ones(len(values)), (row_index, column_index)), shape=shape))
    if entries.form == SYMMETRIC:
        mirror = row_index != column_index
        row_index, column_index = (
            np.concatenate([row_index, column_index[mirror]]),
            np.concatenate([column_index, row_index[mirror]]),
        )
        values = np.concatenate([values, values[mirror]])
        listed = sp.csc_array(sp.coo_array((np.ones(len(values)), (row_index, column_index)), shape=shape))
    if listed.nnz < len(values):
        both = " or both entries of a pair (form 6 takes each pair once)" if entries.form == SYMMETRIC else ""
        twice = sp.coo_array(listed > 1).nonzero()
        first = row_points[twice[0][0]]
        raise MatrixError(f"{where}: lists an entry twice{both}, in row {first[0]}, component {first[1] + 1}")
    return NastranMatrix(
        name=name,
        matrix=sp.csc_array(sp.coo_array((values, (row_index, column_index)), shape=shape)),
        form=entries.form,
        kind=entries.kind,
        where=where,
        rows=row_points,
        columns=column_points,
    )


def _numbered(points: IntArray, asked: IntArray) -> tuple[IntArray, IntArray]:
    """Return the points in ascending order, (n, 2), and the index of each requested point."""
    keys = 8 * points[:, 0] + points[:, 1] + 1
    unique, first = np.unique(keys, return_index=True)
    return points[first], np.searchsorted(unique, 8 * asked[:, 0] + asked[:, 1] + 1)


# nastran --------------------------------------------------------------------------------------------------------------


SETS = ("aa", "xx", "gg", "aax", "2gg")  #: endings of usual matrix names: analysis set, EXTSEOUT, all grid points, DMIG
USUAL = {
    "K": tuple(f"k{end}" for end in SETS),
    "M": tuple(f"m{end}" for end in SETS),
    "D": ("bxx1", *(f"b{end}" for end in SETS)),
}
LOADS = ("PX", "PX1", "PA", "PAX", "PG")  #: names of matrices whose columns are loads
STRUCTURAL_DAMPING = ("K4XX", "K4XX1", "K4AA", "K4GG", "K4AAX")
SQUARE = 1  #: form of a matrix with both triangles


def read_op4_part(path: Path, request: Request) -> ForeignMatrices:
    """Read an OP4 file; the .pch file with the same name, if there is one, gives rows and positions.

    Raises
    ------
    MatrixError
        If the file is damaged, or has no stiffness and mass, or complex ones.
    """
    where = f"matrices {path}"
    matrices = read_op4(path)
    dofs, notes = None, []
    for suffix in (".pch", ".PCH"):
        beside = path.with_suffix(suffix)
        if beside.is_file():
            cards = list(read_cards(f"matrices {beside}", beside.read_text("utf-8", "replace")))
            if any(card.name == "EXTRN" for card in cards):
                dofs = extrn_rows(where, cards)
                part = _with_points(cards)
                notes.append(f"rows and node positions of {path.name} were read from {beside.name} in the same folder")
            break
    if dofs is None:
        return _part(where, matrices, request)
    return _part(where, matrices, request, dofs=dofs, notes=tuple(notes), **part)


def read_op2_part(path: Path, request: Request) -> ForeignMatrices:
    """Read the matrices of an OP2 file, which does not contain the dofs of the rows.

    Raises
    ------
    MatrixError
        If the file is damaged, or has no stiffness and mass, or complex ones.
    """
    return _part(f"matrices {path}", read_op2(path), request)


def read_punch_part(path: Path, request: Request) -> ForeignMatrices:
    """Read matrices (DMIG), grid points, and rows of a superelement (EXTRN) from bulk data.

    Raises
    ------
    MatrixError
        If the file has none of them, or they are damaged.
    """
    where = f"matrices {path}"
    cards = list(read_cards(where, path.read_text("utf-8", "replace")))
    matrices = dmig_matrices(cards)
    points = _with_points(cards)
    dofs = extrn_rows(where, cards) if any(card.name == "EXTRN" for card in cards) else None
    if not matrices:
        if dofs is None and points["nodes"] is None:
            raise MatrixError(f"{where}: expected matrices (DMIG), rows (EXTRN) or grid points (GRID), got none")
        return ForeignMatrices(dofs=dofs, program="Nastran", **points)
    return _part(where, matrices, request, **points)


def _with_points(cards: list[Card]) -> dict:
    """Return the grid points of the cards as fields of `ForeignMatrices`; empty if there are none."""
    points = read_grid_points(cards)
    numbers = sorted(points.positions)
    if not numbers:
        return {"node_numbers": None, "nodes": None}
    return {
        "node_numbers": np.array(numbers, dtype=np.int64),
        "nodes": np.array([points.positions[number] for number in numbers]),
        "systems": points.axes,
    }


def _part(
    where: str,
    matrices: Iterable[NastranMatrix],
    request: Request,
    *,
    dofs: IntArray | None = None,
    notes: tuple[str, ...] = (),
    **points: object,
) -> ForeignMatrices:
    """Return the named matrices of a file, with the rows of DMIG matrices unified."""
    there = [matrix for matrix in matrices if matrix.matrix.nnz]  # Nastran writes a single zero for a missing matrix
    by_name = {matrix.name: matrix for matrix in there}
    chosen = request.chosen(where, USUAL, by_name)
    picked = {role: matrix_named(where, there, name) for role, name in chosen.items()}
    full, triangle = {}, {}
    for role, raw in picked.items():
        declared = "general" if raw.form == SQUARE else None
        full[role], triangle[role] = mirrored(raw.where, real_square(raw), declared=declared)
    if dofs is None:
        dofs, full = _common_rows(picked, full)
    n = next(iter(full.values())).shape[0]
    if dofs is not None and len(dofs) != n:
        raise MatrixError(
            f"{where}: EXTRN names {len(dofs)} rows, the matrices have {n}; these files do not belong together"
        )
    loads: dict[str, Array] = {}
    for raw in there:
        if raw.name in LOADS and not raw.is_complex and raw.matrix.shape[0] == n and raw.rows is None:
            columns = raw.matrix.toarray()
            loads |= {f"{raw.name} {k + 1}": columns[:, k] for k in range(columns.shape[1])}
    structural = [raw.name for raw in there if raw.name in STRUCTURAL_DAMPING]
    if structural:
        notes = (*notes, f"{', '.join(structural)}: structural damping is left out; give a modal damping in its place")
    used = set(chosen.values()) | {name.partition(" ")[0] for name in loads}
    return ForeignMatrices(
        **full,
        dofs=dofs,
        loads=loads,
        others={raw.name: raw.matrix for raw in there if raw.name not in used},
        triangle=triangle,
        program="Nastran",
        notes=notes,
        **points,  # type: ignore[arg-type]
    )


def _common_rows(picked: dict[str, NastranMatrix], full: dict) -> tuple[IntArray | None, dict]:
    """Extend matrices with named rows to the union of all rows; other matrices do not change."""
    named = {role: raw.rows for role, raw in picked.items() if raw.rows is not None}
    if not named:
        return None, full
    dofs = np.unique(np.concatenate(list(named.values())), axis=0)
    keys = 8 * dofs[:, 0] + dofs[:, 1] + 1
    spread = {}
    for role, rows in named.items():
        place = np.searchsorted(keys, 8 * rows[:, 0] + rows[:, 1] + 1)
        coo = full[role].tocoo()
        spread[role] = type(full[role])((coo.data, (place[coo.row], place[coo.col])), shape=(len(dofs), len(dofs)))
    return dofs, spread
