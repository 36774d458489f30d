"""Signals from MATLAB files: vectors, tables and structures of version 5 (SciPy) and 7.3 (h5py)."""

import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import damage, nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.csv_file import RawTable
from floatframe.files.signals.mat_elements import sound_variables

__all__ = ["read_mat"]

MOST_INFLATED = 1100  #: bytes that deflate makes of one at most
DEEPEST = 8  #: structures in structures
MOST_COLUMNS = 10000
TIME_WORDS = ("t", "time", "times", "zeit")


def read_mat(path: Path, *, time: str | None = None, rate: float | None = None) -> RawTable:
    """Return the vectors of a MATLAB file that are as long as its times, as columns.

    A vector is a column under its name, a table (n_t, k) the columns "name 1", "name 2", ...; fields of structures are
    called "structure.field", and values beside a text `label` by that. Units are texts: `unit` or `units` in the
    structure, or a variable NAME_unit. What has another length is left out, and said.

    Raises
    ------
    SignalError
        If it is no MATLAB file or damaged, the time is not in it, or a vector is complex.
    """
    with path.open("rb") as file:
        head = file.read(520)
    is_7 = head[512:520] == b"\x89HDF\r\n\x1a\n" or head[:8] == b"\x89HDF\r\n\x1a\n"
    if not is_7 and not (head[:6] == b"MATLAB" and head[126:128] in (b"IM", b"MI")):
        raise SignalError(f"{path}: expected a MATLAB file of version 5 to 7.3, got another kind of file (version 4?)")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            content = content_7(path) if is_7 else content_5(path)
    except SignalError:
        raise
    except Exception as error:  # whatever a reader stumbles over in foreign bytes
        raise SignalError(f"{path}: {damage(error)}") from error
    columns: dict[str, tuple[Array, str]] = {}
    for name, values, unit in columns_of(content):
        if np.iscomplexobj(values):
            raise SignalError(f"{path}: {name}: expected real numbers, got complex ones")
        columns[name] = (np.asarray(values, dtype=float), unit)
        if len(columns) > MOST_COLUMNS:
            raise SignalError(f"{path}: more than {MOST_COLUMNS} columns; expected signals over time")
    if not columns:
        raise SignalError(f"{path}: expected vectors of numbers, got {', '.join(list(content)[:20]) or 'nothing'}")
    if time is not None and time not in columns:
        raise SignalError(f"{path}: no variable {quoted(time)} with the time{nearest(time, columns)}")
    times = [name for name in columns if name.rpartition(".")[2].lower() in TIME_WORDS] if rate is None else []
    leading = time or (times[0] if times else None)
    lengths = [len(values) for values, _ in columns.values()]
    n = len(columns[leading][0]) if leading else max(set(lengths), key=lengths.count)
    kept = {name: column for name, column in columns.items() if len(column[0]) == n}
    left = [name for name in columns if name not in kept]
    notes = [f"left out, of another length than {n}: {', '.join(left[:20])}"] if left else []
    return RawTable(
        np.column_stack([values for values, _ in kept.values()]),
        tuple(kept),
        tuple(unit for _, unit in kept.values()),
        None,
        tuple(notes),
    )


def content_5(path: Path) -> dict[str, Any]:
    """Return the variables of a file of version 5: arrays, text, dictionaries for structures."""
    import scipy.io

    wanted = sound_variables(str(path), path.read_bytes())
    found = scipy.io.loadmat(
        path, variable_names=wanted, squeeze_me=True, struct_as_record=False, chars_as_strings=True
    )
    return {name: plain_5(value) for name, value in found.items() if not name.startswith("__")}


def plain_5(value: Any) -> Any:
    """Return a structure of SciPy's reader as a dictionary, one text as it is."""
    if hasattr(value, "_fieldnames"):
        return {name: plain_5(getattr(value, name)) for name in value._fieldnames}
    return value


def content_7(path: Path) -> dict[str, Any]:
    """Return the variables of a file of version 7.3."""
    import h5py

    with h5py.File(path, "r") as file:
        return {name: plain_7(path, file[name], DEEPEST) for name in file if not name.startswith("#")}


def plain_7(path: Path, entry: Any, depth: int) -> Any:
    """Return an array of HDF5 as MATLAB has it, text, a dictionary for a group; None for what is none of them."""
    if hasattr(entry, "keys"):
        return {name: plain_7(path, entry[name], depth - 1) for name in entry} if depth else None
    claimed, stored = entry.size * entry.dtype.itemsize, entry.id.get_storage_size()
    if claimed > MOST_INFLATED * max(stored, 1):
        raise SignalError(f"{path}: {entry.name} claims {claimed} bytes and has {stored}; the file is damaged")
    if entry.dtype.kind not in "fiubV" or entry.attrs.get("MATLAB_empty", 0):
        return None
    values = np.asarray(entry[()])
    if entry.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, values.ravel(order="F").tolist()))
    if values.dtype.names is not None:  # complex numbers
        if set(values.dtype.names) != {"real", "imag"}:
            return None
        values = values["real"] + 1j * values["imag"]
    return np.squeeze(values.T)


def columns_of(content: Mapping[str, Any], prefix: str = "", depth: int = DEEPEST) -> Iterator[tuple[str, Array, str]]:
    """Yield name, values and unit of every vector, and of every column of a table, in structures too."""
    words = {name.lower(): value for name, value in content.items() if isinstance(value, str)}
    common = words.get("unit", words.get("units", "")) if prefix else ""
    label = words.get("label", words.get("name", "")) if prefix else ""
    for name, value in content.items():
        if isinstance(value, Mapping):
            if depth:
                yield from columns_of(value, f"{prefix}{name}.", depth - 1)
            continue
        values = np.asarray(value)
        if values.dtype.kind not in "fiubc" or values.ndim not in (1, 2) or values.size < 2:
            continue
        own = words.get(f"{name}_unit".lower(), words.get(f"{name}_units".lower()))
        is_time = name.lower() in TIME_WORDS
        unit = own if own is not None else "" if is_time else common
        shown = label if label and name.lower() in ("values", "data", "value") else f"{prefix}{name}"
        if values.ndim == 1:
            yield shown, values, unit
        else:
            table = values if values.shape[0] >= values.shape[1] else values.T
            for k in range(table.shape[1]):
                yield f"{shown} {k + 1}", table[:, k], unit
