"""Recovery matrices in files for other programs (npz, mat, op4, csv), with names and units.

The coordinates x are z = (d, theta, q) or (u_b, eta). Rows = displacement @ x + velocity @ x' + acceleration @ x'' +
load @ p. Mass M, damping D and stiffness K over x are included.
"""

import csv
import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.modal_file.file import convert_units
from cms.body.recovery_table import RecoveryTable
from cms.body.reduced_body import ReducedBody
from cms.errors import RecoveryError
from cms.reduction.recovery.craig_bampton import craig_bampton_matrices
from cms.reduction.recovery.load_columns import on_coordinates
from fe_models.files.nastran_matrices.write_op4 import op4_parts
from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_files
from fe_models.foundation.seal import reason
from fe_models.foundation.units import Dimensions, Units, unit_text
from fe_models.foundation.words import nearest, quoted

__all__ = ["OVER", "RECOVERY_FORMATS", "RecoveryFiles", "write_recovery"]

OVER = ("modes", "interfaces")
ORDERS = ("displacement", "velocity", "acceleration")
OP4_NAMES = {"displacement": "DRMD", "velocity": "DRMV", "acceleration": "DRMA", "load": "DRMF", "M": "MXX", "K": "KXX",
             "D": "BXX", "rigid": "RBM"}  # fmt: skip
LENGTH, NONE, MODAL, UNIT_MASS = Dimensions(0, 1), Dimensions(), Dimensions(0.5, 1), Dimensions(0.5, 1)


@dataclass(frozen=True, eq=False)
class RecoveryFiles:
    """The written files."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]  #: where the names and units are, and what was left out


@dataclass(frozen=True, eq=False)
class _Content:
    """Matrices of a table over x, with the names of their rows and columns."""

    table: RecoveryTable
    matrices: Mapping[str, Array]  #: displacement, velocity, acceleration, load
    coordinates: tuple[str, ...]
    coordinate_units: tuple[str, ...]
    loads: tuple[str, ...]
    load_units: tuple[str, ...]
    equations: Mapping[str, Array]  #: M, D, K over x; the rigid motions of the boundary
    over: str


def write_recovery(
    body: ReducedBody,
    path: str | os.PathLike[str],
    *,
    table: str | None = None,
    over: str = "modes",
    units: Units | str | None = None,
) -> RecoveryFiles:
    """Write a recovery table of a body; files are written completely or not at all.

    Parameters
    ----------
    path
        Path with the suffix of the format, one of `RECOVERY_FORMATS`. op4 has its names in two .csv files beside it.
    table
        Name of the table; None: the only table.
    over
        "modes": over z = (d, theta, q) in axes of B. "interfaces": over the interface motions in mesh axes and the
        fixed-interface modes, with the interface forces eliminated (`CraigBampton.recover`).
    units
        Unit system of the numbers; default: that of the body.

    Raises
    ------
    RecoveryError
        If the table, format or kind of coordinates does not exist, the body has no such coordinates, or the file cannot
        be written.
    """
    path = Path(path)
    if path.suffix.lower() not in RECOVERY_FORMATS:
        raise RecoveryError(
            f"{path}: unknown format of recovery matrices{nearest(path.suffix.lower(), list(RECOVERY_FORMATS))}"
        )
    if over not in OVER:
        raise RecoveryError(f"recovery: over = {quoted(over)}{nearest(over, OVER)}")
    if units is not None:
        body = convert_units(body, units)
    content = content_of(body, chosen(body, table), over)
    files, notes = RECOVERY_FORMATS[path.suffix.lower()](path, content)
    try:
        replace_files(files)
    except OSError as error:
        raise RecoveryError(f"{path}: cannot be written: {reason(error)}; nothing was written") from error
    return RecoveryFiles(tuple(files), (*notes, f"left out by the rows: {content.table.truncated or 'not said'}"))


def chosen(body: ReducedBody, name: str | None) -> RecoveryTable:
    """Return the table of that name, or the only table."""
    known = list(body.recovery)
    if not known:
        raise RecoveryError(
            f"body {body.name!r}: it has no recovery tables; ask for some in its job ([recovery.NAME]) or with --rows"
        )
    if name is None and len(known) > 1:
        raise RecoveryError(f"body {body.name!r}: it has several recovery tables; name one of {', '.join(known)}")
    if name is not None and name not in known:
        raise RecoveryError(f"body {body.name!r}: no recovery table {quoted(name)}{nearest(name, known)}")
    return body.recovery[name or known[0]]


def content_of(body: ReducedBody, table: RecoveryTable, over: str) -> _Content:
    """Return the matrices over z or over the interface coordinates."""
    if over == "modes":
        M, D, K = on_coordinates(body)
        names = (*(f"d {a}" for a in "xyz"), *(f"theta {a}" for a in "xyz"), *(f"q {k + 1}" for k in range(body.n_q)))
        kinds = [LENGTH] * 3 + [NONE] * 3 + [MODAL] * body.n_q
        matrices = dict(zip(ORDERS, table.dynamic, strict=True)) | {"load": table.static}
        equations = {"M": M, "D": D, "K": K}
        loads, load_units = table.loads, table.load_units
    else:
        made = craig_bampton_matrices(body)
        rows = made.recover(table)
        n_modes = len(made.M) - made.n_b
        names = (*made.boundary, *(f"mode {k + 1}" for k in range(n_modes)))
        kinds = [NONE if name.endswith(("rx", "ry", "rz")) else LENGTH for name in made.boundary] + [MODAL] * n_modes
        matrices = {order: getattr(rows, order) for order in ORDERS} | {"load": rows.load}
        equations = {"M": made.M, "D": made.D, "K": made.K, "rigid": made.rigid}
        loads = rows.loads
        load_units = tuple(table.load_units[table.loads.index(name)] for name in loads)
    units = tuple(unit_text(body.units, kind) for kind in kinds)
    return _Content(table, matrices, names, units, loads, load_units, equations, over)


# Formats --------------------------------------------------------------------------------------------------------------

Files = tuple[dict[Path, bytes], tuple[str, ...]]


def arrays_of(content: _Content) -> dict[str, Any]:
    """Return the arrays for npz and mat files; texts are tuples."""
    table = content.table
    return {
        **content.matrices,
        **content.equations,
        "labels": table.labels,
        "quantities": table.quantities,
        "entities": table.entities,
        "numbers": table.numbers,
        "components": table.components,
        "units": table.units,
        "coordinates": content.coordinates,
        "coordinate_units": content.coordinate_units,
        "loads": content.loads,
        "load_units": content.load_units,
        "name": (table.name,),
        "unit_system": (table.system.name,),
        "over": (content.over,),
        "truncated": (table.truncated,),
    }


def npz_files(path: Path, content: _Content) -> Files:
    """Return a NumPy archive; texts are arrays of fixed length, and nothing is pickled."""
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {
        name: np.array(value, dtype=str) if isinstance(value, tuple) else value
        for name, value in arrays_of(content).items()
    }
    np.savez(buffer, **arrays)
    return {path: buffer.getvalue()}, ()


def mat_files(path: Path, content: _Content) -> Files:
    """Return a MAT-file of version 5; texts are cell arrays."""
    from scipy.io import savemat

    def cells(texts: tuple[str, ...]) -> Any:
        column = np.empty((len(texts), 1), dtype=object)
        column[:, 0] = texts
        return column

    buffer = io.BytesIO()
    values = {k: cells(v) if isinstance(v, tuple) else v for k, v in arrays_of(content).items()}
    values["numbers"] = np.asarray(content.table.numbers, dtype=float)[:, None]
    savemat(buffer, values, do_compression=False)
    return {path: buffer.getvalue()}, ()


def op4_files(path: Path, content: _Content) -> Files:
    """Return OUTPUT4 with names of eight characters, and two tables with the names of rows and columns."""
    matrices = {OP4_NAMES[name]: matrix for name, matrix in {**content.matrices, **content.equations}.items()}
    kept = {name: matrix for name, matrix in matrices.items() if matrix.size and np.any(matrix)}
    rows, columns = (path.with_name(f"{path.stem}_{what}.csv") for what in ("rows", "columns"))
    words = ", ".join(f"{OP4_NAMES[name]} {name}" for name in (*content.matrices, *content.equations))
    zero = ", ".join(name for name in matrices if name not in kept)
    notes = (
        f"matrices: {words}",
        *((f"zero and left out: {zero}",) if zero else ()),
        f"op4 holds no labels and units: {rows.name} has those of the rows, {columns.name} those of the columns",
    )
    files = {
        path: b"".join(op4_parts(f"OP4 file {path}", kept)),
        rows: csv_bytes([ROW_HEAD, *row_words(content.table)]),
        columns: csv_bytes([("matrix", "column", "name", "unit"), *column_words(content)]),
    }
    return files, notes


ROW_HEAD = ("label", "quantity", "entity", "number", "component", "unit")


def row_words(table: RecoveryTable) -> list[tuple[Any, ...]]:
    """Return name, number and unit of each row."""
    return list(
        zip(
            table.labels, table.quantities, table.entities, map(int, table.numbers), table.components, table.units,
            strict=True,
        )
    )  # fmt: skip


def column_words(content: _Content) -> list[tuple[str, int, str, str]]:
    """Return matrix, number, name and unit of each column; the units are those of the coordinates, not their rates."""
    of_x = zip(content.coordinates, content.coordinate_units, strict=True)
    of_loads = zip(content.loads, content.load_units, strict=True)
    words = [("DRMD DRMV DRMA", k + 1, name, unit) for k, (name, unit) in enumerate(of_x)]
    return words + [("DRMF", k + 1, name, unit) for k, (name, unit) in enumerate(of_loads)]


def csv_files(path: Path, content: _Content) -> Files:
    """Return one table: names, number and unit of each row, then its entries; zero matrices are left out."""
    head, blocks = list(ROW_HEAD), []
    left: list[str] = []
    for name, matrix in content.matrices.items():
        if not matrix.size or not np.any(matrix):
            left.append(name)
            continue
        of_loads = name == "load"
        columns = content.loads if of_loads else content.coordinates
        units = content.load_units if of_loads else content.coordinate_units
        head += [f"{name}: {column} [{unit}]" for column, unit in zip(columns, units, strict=True)]
        blocks.append(matrix)
    numbers = np.hstack(blocks) if blocks else np.zeros((content.table.n_rows, 0))
    lines = [(*words, *map(repr, own.tolist())) for words, own in zip(row_words(content.table), numbers, strict=True)]
    notes: tuple[str, ...] = (
        "units in brackets are those of the coordinate; its velocity and acceleration are per time",
    )
    if left:
        notes += (f"zero and left out: {', '.join(left)}",)
    return {path: csv_bytes([tuple(head), *lines])}, (*notes, "mass, damping and stiffness are not in the table")


def csv_bytes(rows: list[tuple[Any, ...]]) -> bytes:
    """Return rows as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode("utf-8")


RECOVERY_FORMATS: dict[str, Callable[[Path, _Content], Files]] = {
    ".npz": npz_files,
    ".mat": mat_files,
    ".op4": op4_files,
    ".csv": csv_files,
}  #: by suffix
