"""Nastran's matrix files as parts of a model: OP4, OP2, DMIG in punch files and decks, rows of superelements."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fe_models.errors import MatrixError
from fe_models.files.bulk_data.cards import Card, read_cards
from fe_models.files.bulk_data.coordinate_systems import read_grid_points
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.triangles import mirrored
from fe_models.files.nastran_matrices.dmig import dmig_matrices
from fe_models.files.nastran_matrices.op2 import read_op2
from fe_models.files.nastran_matrices.op4 import read_op4
from fe_models.files.nastran_matrices.raw_matrix import NastranMatrix, matrix_named, real_square
from fe_models.files.nastran_matrices.superelement import extrn_rows
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["read_op2_part", "read_op4_part", "read_punch_part"]

SETS = ("aa", "xx", "gg", "aax", "2gg")  #: endings of the usual names: analysis set, EXTSEOUT, all grid points, DMIG
USUAL = {
    "K": tuple(f"k{end}" for end in SETS),
    "M": tuple(f"m{end}" for end in SETS),
    "D": ("bxx1", *(f"b{end}" for end in SETS)),
}
LOADS = ("PX", "PX1", "PA", "PAX", "PG")  #: of which each column is a load
STRUCTURAL_DAMPING = ("K4XX", "K4XX1", "K4AA", "K4GG", "K4AAX")
SQUARE = 1  #: form of a matrix with both triangles


def read_op4_part(path: Path, request: Request) -> ForeignMatrices:
    """Read an OP4 file; rows and places come from the .pch file of the same name, where one stands beside it.

    Raises
    ------
    MatrixError
        If the file is damaged, has no stiffness or mass, or complex ones.
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
                notes.append(f"rows and places of {path.name} from {beside.name}, beside it")
            break
    if dofs is None:
        return _part(where, matrices, request)
    return _part(where, matrices, request, dofs=dofs, notes=tuple(notes), **part)


def read_op2_part(path: Path, request: Request) -> ForeignMatrices:
    """Read the matrices of an OP2 file; the dofs of the rows are not said.

    Raises
    ------
    MatrixError
        As `read_op4_part`.
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
    """Return the grid points of the cards as fields of `ForeignMatrices`; none: no fields."""
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
    """Return the named matrices of a file, rows of DMIG matrices brought together."""
    there = [matrix for matrix in matrices if matrix.matrix.nnz]  # Nastran writes a single zero for what it has not
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
    """Bring matrices that name their rows to the union of these; those that do not are left as they are."""
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
