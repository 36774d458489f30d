"""Tables of Nastran (DTI) that describe the rows of a recovery matrix."""

from collections.abc import Callable

import numpy as np

from fe_models.errors import MatrixError
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.foundation.arrays import IntArray

__all__ = ["EMPTY", "SCALAR", "RecoveryRows", "element_rows", "grid_rows"]

RecoveryRows = Callable[[str, list[Card], str, int], IntArray]
GRID, POINT = 1, 2  #: codes of point types
SCALAR, EMPTY = -1, -2  #: components of the rows of a scalar point
END = "ENDREC"


def grid_rows(where: str, cards: list[Card], table: str, n_rows: int) -> IntArray:
    """Return (id, component) of each row, (n_rows, 2), from the table TUG1.

    Components are 0 to 5 for a grid point. A scalar point has as many rows as a grid point: the first one has the
    component `SCALAR`, the others are zero and have the component `EMPTY`.

    Raises
    ------
    MatrixError
        If the table is missing or damaged, or its rows are not the n_rows of the matrix.
    """
    rows: list[tuple[int, int]] = []
    for kind, number, count, first in _entries(where, cards, table):
        if kind not in (GRID, POINT):
            raise MatrixError(f"{where}: {table}: point {number}: expected type 1 (grid) or 2 (scalar), got {kind}")
        _require_next(where, table, number, first, len(rows))
        if not 0 < count <= 6 or (kind == GRID and count != 6):
            raise MatrixError(f"{where}: {table}: point {number}: expected 6 rows, got {count}")
        rows += (
            [(number, k) for k in range(6)] if kind == GRID else [(number, SCALAR), *[(number, EMPTY)] * (count - 1)]
        )
    return _complete(where, table, rows, n_rows)


def element_rows(where: str, cards: list[Card], table: str, n_rows: int) -> IntArray:
    """Return (type, id, item from 1) of each row, (n_rows, 3), from the table TEF1 or TES1.

    Raises
    ------
    MatrixError
        If the table is missing or damaged, or its rows are not the n_rows of the matrix.
    """
    rows: list[tuple[int, int, int]] = []
    for kind, number, count, first in _entries(where, cards, table):
        _require_next(where, table, number, first, len(rows))
        if not 0 < count <= n_rows - len(rows):
            raise MatrixError(f"{where}: {table}: element {number}: {count} rows do not fit the matrix of {n_rows}")
        rows += [(kind, number, item + 1) for item in range(count)]
    return _complete(where, table, rows, n_rows)


def _entries(where: str, cards: list[Card], table: str) -> list[tuple[int, int, int, int]]:
    """Return type, id, components and first row (from 1) of each entry of record 2 of a table."""
    found = [card for card in cards if card.name == "DTI" and card.text(1).upper() == table and card.text(2) == "2"]
    if len(found) != 1:
        raise MatrixError(
            f"{where}: expected one table {table} (DTI, record 2) with the rows of its matrix, got {len(found)}; give "
            "the .pch file that Nastran wrote beside the .op4 file"
        )
    card = found[0]
    words = [word for word in card.fields[2:] if word]
    if END not in words:
        raise MatrixError(f"{card.where}: expected {END} at the end of the record, got none: the file is truncated")
    words = words[: words.index(END)]
    numbers = [word for word in words if not word.isalpha()]  # without the names of the columns, TYPE ID COMP ROW
    try:
        values = [int(word) for word in numbers]
    except ValueError as error:
        raise MatrixError(f"{card.where}: expected integers: {error}") from None
    if len(values) % 4 or not values:
        raise MatrixError(
            f"{card.where}: expected type, id, components and row of each entry, got {len(values)} numbers"
        )
    return [(values[k], values[k + 1], values[k + 2], values[k + 3]) for k in range(0, len(values), 4)]


def _require_next(where: str, table: str, number: int, first: int, n: int) -> None:
    if first != n + 1:
        raise MatrixError(
            f"{where}: {table}: the rows of {number} begin at {first}, expected {n + 1}: the table is damaged or "
            "incomplete"
        )


def _complete(where: str, table: str, rows: list[tuple[int, ...]] | list, n_rows: int) -> IntArray:
    if len(rows) != n_rows:
        raise MatrixError(
            f"{where}: {table} has {len(rows)} rows, its matrix {n_rows}; these files do not belong together"
        )
    return np.array(rows, dtype=np.int64)
