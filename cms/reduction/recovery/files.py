"""Recovery matrices in files: for other programs (npz, mat, op4), or as a table (csv, json, parquet).

The coordinates x are z = (d, theta, q) or (u_b, eta). Rows = displacement @ x + velocity @ x' + acceleration @ x'' +
load @ p. Mass M, damping D and stiffness K over x are included.
"""

import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.modal_file.file import convert_units
from cms.body.recovery_table import N_RIGID, ORDERS, RecoveryTable, row_table
from cms.body.reduced_body import ReducedBody
from cms.errors import ExportError, RecoveryError
from cms.reduction.interface_model import InterfaceModel, interface_model
from cms.reduction.recovery.interface_rows import node_words
from cms.reduction.recovery.load_columns import WRENCH, forces_of_loads, on_coordinates
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.files.nastran.matrices.write_op4 import op4_parts
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array
from fe_models.foundation.documents.table import Table
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.paths import replace_files
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.seal import reason
from fe_models.foundation.units import Dimensions, Units, unit_text
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "OVER",
    "RECOVERY_FORMATS",
    "CraigBampton",
    "InterfaceRows",
    "RecoveryFiles",
    "craig_bampton_matrices",
    "write_recovery",
]


OVER = ("modes", "interfaces")
OP4_NAMES = {"displacement": "DRMD", "velocity": "DRMV", "acceleration": "DRMA", "load": "DRMF", "M": "MXX", "K": "KXX",
             "D": "BXX", "rigid": "RBM"}  # fmt: skip
LENGTH, NONE, MODAL = Dimensions(0, 1), Dimensions(), Dimensions(0.5, 1)


@dataclass(frozen=True, eq=False)
class RecoveryFiles:
    """The written files."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]  #: description of the names and units, and of omitted data


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
    return RecoveryFiles(tuple(files), (*notes, f"left out by the rows: {content.table.truncated or 'unknown'}"))


def chosen(body: ReducedBody, name: str | None) -> RecoveryTable:
    """Return the table with this name, or the only table."""
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
        names, units = table.coordinates, table.coordinate_units
        matrices = dict(zip(ORDERS, table.dynamic, strict=True)) | {"load": table.static}
        equations = {"M": M, "D": D, "K": K}
        loads, load_units = table.loads, table.load_units
    else:
        made = craig_bampton_matrices(body)
        rows = made.recover(table)
        n_modes = len(made.M) - made.n_b
        names = (*made.boundary, *(f"mode {k + 1}" for k in range(n_modes)))
        kinds = [NONE if name.endswith(("rx", "ry", "rz")) else LENGTH for name in made.boundary] + [MODAL] * n_modes
        units = tuple(unit_text(body.units, kind) for kind in kinds)
        matrices = {order: getattr(rows, order) for order in ORDERS} | {"load": rows.load}
        equations = {"M": made.M, "D": made.D, "K": made.K, "rigid": made.rigid}
        loads = rows.loads
        load_units = tuple(table.load_units[table.loads.index(name)] for name in loads)
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
    """Return a NumPy archive; texts are arrays of fixed length, without pickled objects."""
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
    """Return an OUTPUT4 file with matrix names of eight characters, and two tables that name rows and columns."""
    matrices = {OP4_NAMES[name]: matrix for name, matrix in {**content.matrices, **content.equations}.items()}
    kept = {name: matrix for name, matrix in matrices.items() if matrix.size and np.any(matrix)}
    rows, columns = (path.with_name(f"{path.stem}_{what}.csv") for what in ("rows", "columns"))
    words = ", ".join(f"{OP4_NAMES[name]} {name}" for name in (*content.matrices, *content.equations))
    zero = ", ".join(name for name in matrices if name not in kept)
    notes = (
        f"matrices: {words}",
        *((f"zero and left out: {zero}",) if zero else ()),
        f"op4 has no labels and units: {rows.name} names those of the rows, {columns.name} those of the columns",
    )
    files = {
        path: b"".join(op4_parts(f"OP4 file {path}", kept)),
        rows: row_table(content.table, {}, {}, {}).content(".csv"),
        columns: Table.of_rows(("matrix", "column", "name", "unit"), column_words(content)).content(".csv"),
    }
    return files, notes


def column_words(content: _Content) -> list[tuple[str, int, str, str]]:
    """Return matrix, number, name and unit of each column; the units are those of the coordinates, not their rates."""
    of_x = zip(content.coordinates, content.coordinate_units, strict=True)
    of_loads = zip(content.loads, content.load_units, strict=True)
    words = [("DRMD DRMV DRMA", k + 1, name, unit) for k, (name, unit) in enumerate(of_x)]
    return words + [("DRMF", k + 1, name, unit) for k, (name, unit) in enumerate(of_loads)]


def table_files(path: Path, content: _Content) -> Files:
    """Return one table: names, number and unit of each row, then its entries; zero matrices are omitted."""
    coordinates = dict(zip(content.coordinates, content.coordinate_units, strict=True))
    loads = dict(zip(content.loads, content.load_units, strict=True))
    table = row_table(content.table, content.matrices, coordinates, loads)
    zero = [name for name, matrix in content.matrices.items() if not np.any(matrix)]
    notes = (
        "units in brackets are units of the coordinate; for its velocity and acceleration divide by time and time²",
        *((f"zero and left out: {', '.join(zero)}",) if zero else ()),
        "mass, damping and stiffness are not in the table",
    )
    return {path: table.content(path.suffix)}, notes


RECOVERY_FORMATS: dict[str, Callable[[Path, _Content], Files]] = {
    ".npz": npz_files,
    ".mat": mat_files,
    ".op4": op4_files,
    ".csv": table_files,
    ".json": table_files,
    ".parquet": table_files,
}  #: writer of each file suffix


# craig-Bampton matrices of a reduced body with its rigid part, and recovery rows over the same coordinates ------------
# The coordinates are y = (u_b, eta): motions of the interfaces in mesh axes, then fixed-interface modes of unit mass
# (`interface_model`). With z = T y, the rows of a table become
#
#     rows = D_0 T y + D_1 T y' + D_2 T y'' + L_b p_b + L p,   p_b = f_b of the rows of interface forces
#
# where p_b are the loads at interfaces and p the others. If the base is driven, p_b is no input: it is replaced by f_b
# = (M y'' + D y' + K y - G p)_b.


@presented
@dataclass(frozen=True, eq=False)
class InterfaceRows:
    """Rows over (u_b, eta): `displacement` @ y + `velocity` @ y' + `acceleration` @ y'' + `load` @ p."""

    table: RecoveryTable  #: table of the rows: labels, quantities, units
    displacement: Array  #: factor of y, (n_rows, n_b + n_modes)
    velocity: Array  #: factor of the first derivative of y, (n_rows, n_b + n_modes)
    acceleration: Array  #: factor of the second derivative of y, (n_rows, n_b + n_modes)
    loads: tuple[str, ...]  #: loads of the table, except those at interfaces
    load: Array  #: response of the rows to unit load amplitudes, (n_rows, n_loads)

    def values(self, y: Array, y_dot: Array, y_ddot: Array, p: Array | None = None) -> Array:
        """Return row values, (..., n_rows), for motions, (..., n_b + n_modes), and load amplitudes, (..., n_loads)."""
        total = y @ self.displacement.T + y_dot @ self.velocity.T + y_ddot @ self.acceleration.T
        return np.asarray(total if p is None else total + np.asarray(p) @ self.load.T)


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class CraigBampton:
    """Mass, stiffness and damping over (u_b, eta), and the rigid motions in these coordinates.

    Parameters
    ----------
    body
        The reduced body.
    M
        Mass, (n, n), n = n_b + n_modes.
    K
        Stiffness, (n, n), without coupling between boundary and modes.
    D
        Damping, (n, n).
    T
        Transformation z = T y, (6 + n_q, n).
    boundary
        Name of each boundary dof, such as "tip ux", (n_b,).
    about
        Reference point of the rigid motions, mesh coordinates, (3,) [m].
    rigid
        Motions of the boundary dofs under the six rigid motions, mesh axes, (n_b, 6).
    """

    body: ReducedBody
    M: Array
    K: Array
    D: Array
    T: Array
    boundary: tuple[str, ...]
    about: Array
    rigid: Array

    @property
    def n_b(self) -> int:
        """Number of boundary dofs."""
        return len(self.boundary)

    @property
    def M_rigid(self) -> Array:
        """Mass matrix of the rigid motions, (6, 6), from the reduced boundary; exact if the mode set contains them."""
        b = slice(self.n_b)
        return np.asarray(self.rigid.T @ self.M[b, b] @ self.rigid)

    @property
    def frequencies(self) -> Array:
        """Frequencies of the fixed-interface modes, (n_modes,), cycles per time unit; infinite for massless modes."""
        inner = slice(self.n_b, None)
        mass, stiffness = np.diag(self.M)[inner], np.diag(self.K)[inner]
        omega2 = np.divide(stiffness, mass, out=np.full(len(mass), np.inf), where=mass > 0)
        return np.asarray(np.sqrt(omega2) / (2 * np.pi))

    def recover(self, table: RecoveryTable | str) -> InterfaceRows:
        """Return the rows of a table as functions of (u_b, eta) and their rates.

        Interface loads are expressed by M, D and K through the equations of motion.

        Parameters
        ----------
        table
            A table of this body, or its name in `ReducedBody.recovery`.

        Raises
        ------
        RecoveryError
            If the table belongs to another body, a load acts at a node that is not kept, or an interface does not
            transmit the wrench of a single node (kind "nodes" with several nodes).
        """
        if isinstance(table, str):
            if table not in self.body.recovery:
                known = ", ".join(self.body.recovery) or "none"
                raise RecoveryError(f"body {self.body.name!r}: no recovery table {table!r}; there are {known}")
            table = self.body.recovery[table]
        if table.n_q != self.body.n_q or table.system != self.body.units:
            raise RecoveryError(
                f"recovery {table.name!r}: of {table.n_q} modes in {table.system.name}; expected one of body "
                f"{self.body.name!r}, {self.body.n_q} modes in {self.body.units.name}"
            )
        T = self.T if not self.body.is_held else np.vstack([np.zeros((N_RIGID, self.T.shape[1])), self.T])
        position, rate, acceleration = (matrix @ T for matrix in table.dynamic)
        L, other, G = self._split(table, T)
        for total, matrix in ((position, self.K), (rate, self.D), (acceleration, self.M)):
            total += L @ matrix[: self.n_b]
        load = table.static[:, other] - L @ G[: self.n_b]
        loads = tuple(table.loads[k] for k in other)
        return InterfaceRows(table, position, rate, acceleration, loads, load)

    def _split(self, table: RecoveryTable, T: Array) -> tuple[Array, list[int], Array]:
        """Return the part that is static in f_b, the other columns, and the forces of other loads on y, (n, n_other).

        A wrench at an interface acts on the single node of the interface, in axes of B.
        """
        A = self.body.frame.axes
        turn = np.kron(np.eye(2), A.T)
        L = np.zeros((table.n_rows, self.n_b))
        names = [f"{interface.name} {word}" for interface in self.body.interfaces for word in WRENCH]
        other = [k for k, name in enumerate(table.loads) if name not in names]
        forces = forces_of_loads(self.body, [table.loads[k] for k in other])
        for interface in self.body.interfaces:
            if f"{interface.name} fx" not in table.loads:
                continue
            first = table.loads.index(f"{interface.name} fx")
            static = table.static[:, first : first + 6]
            rows = [k for k, word in enumerate(self.boundary) if word.rpartition(" ")[0] == interface.name]
            if len(rows) in (3, 6):
                L[:, rows] = (static @ turn)[:, : len(rows)]
            elif static.any():
                raise RecoveryError(
                    f"recovery {table.name!r}: interface {interface.name!r} has {len(rows)} dofs of several nodes, but "
                    "the static part only has the total wrench; expected an interface with one node"
                )
        return L, other, T.T @ forces


def craig_bampton_matrices(body: ReducedBody, *, about: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> CraigBampton:
    """Return the Craig-Bampton matrices of a reduced body.

    Parameters
    ----------
    body
        The reduced body.
    about
        Reference point of the rigid motions, mesh coordinates [m].

    Raises
    ------
    RecoveryError
        If its modes do not move the interface dofs independently, or the body can move with fixed interfaces.
    """
    try:
        model = interface_model(body)
    except ExportError as error:
        raise RecoveryError(f"Craig-Bampton matrices: {error}") from error
    point = np.asarray(about, dtype=float)
    return CraigBampton(
        body, model.M, model.K, model.D, model.T, boundary_words(model), point, boundary_motion(model, point)
    )


def boundary_words(model: InterfaceModel) -> tuple[str, ...]:
    """Return the names of the boundary dofs."""
    return tuple(
        f"{word} {MOTION_COMPONENTS[component]}"
        for node, word in zip(model.nodes, node_words(model.nodes), strict=True)
        for component in node.components
    )


def boundary_motion(model: InterfaceModel, about: Array) -> Array:
    """Return the boundary dofs in the six rigid motions about a point, mesh axes, (n_b, 6)."""
    rows = [np.zeros((0, 6))]
    for node in model.nodes:
        motion = np.vstack([rigid_motion_of_points(node.position[None], about)[0], np.eye(6)[3:]])
        rows.append(motion[node.components])
    return np.concatenate(rows)
