"""Signals from MATLAB files: vectors, tables and structures of version 5 (SciPy) and 7.3 (h5py)."""

import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import damage, nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.csv_file import RawTable

__all__ = ["read_mat", "sound_variables"]


# mat elements ---------------------------------------------------------------------------------------------------------
# Check of the elements of a MATLAB file of version 5 before it is read: tags, sizes and dimensions must be consistent.
#
# SciPy's reader does not check the contents of a damaged file, and can crash the program. A file consists of a head of
# 128 bytes and elements: a tag (type and size with 4 bytes each, or 2 in a small element) and data, padded to 8 bytes.
# An array is an element that contains elements: flags with its class, dimensions, name, and numbers, or the arrays of
# its fields or cells.


NUMBERS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}  #: number of bytes of a number by type
TEXT = (1, 2, 3, 4, 16, 17, 18)
INT8, INT32, UINT32, MATRIX, COMPRESSED = 1, 5, 6, 14, 15
CELL, STRUCT, CHAR, NUMERIC = 1, 2, 4, range(6, 16)  #: classes of arrays
MOST_LEVELS = 20
MOST_BYTES = 1 << 33  #: largest size of an uncompressed element


def sound_variables(where: str, content: bytes) -> list[str]:
    """Return the names of the variables with numbers, text, structures and cells, after checking all their elements.

    Raises
    ------
    SignalError
        If an element does not fit into the one around it, or its numbers do not fill its dimensions.
    """
    order = {b"IM": "<", b"MI": ">"}[content[126:128]]
    names = []
    for kind, first, last in elements(where, content, 128, len(content), order):
        data, begin, end = content, first, last
        if kind == COMPRESSED:
            data = unpacked(where, content[first:last])
            parts = list(elements(where, data, 0, len(data), order))
            if len(parts) != 1:
                raise damaged(where, f"a compressed part of {len(parts)} elements")
            kind, begin, end = parts[0]
        if kind != MATRIX:
            raise damaged(where, f"an element of type {kind} in the place of a variable")
        name, is_known = checked_array(where, data, begin, end, order, MOST_LEVELS)
        if name and is_known:
            names.append(name)
    return names


def damaged(where: str, what: str) -> SignalError:
    """Return the error of a damaged file."""
    return SignalError(f"{where}: {what}; the file is damaged")


def unpacked(where: str, packed: bytes) -> bytes:
    """Return the data of a compressed element."""
    try:
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(packed, MOST_BYTES)
    except zlib.error as error:
        raise damaged(where, f"a compressed part cannot be unpacked ({error})") from error
    if not unpacker.eof:
        raise damaged(where, "a compressed part is cut off")
    return data


def elements(where: str, data: bytes, at: int, end: int, order: str) -> Iterator[tuple[int, int, int]]:
    """Yield type, begin and end of the data of each element between two positions."""
    while at < end:
        if at + 8 > end:
            raise damaged(where, f"{end - at} bytes are left at byte {at} where an element begins")
        kind, size = struct.unpack_from(f"{order}II", data, at)
        if kind >> 16:  # a small element: its tag contains its size and data
            size, kind = kind >> 16, kind & 0xFFFF
            first, following = at + 4, at + 8
            if size > 4:
                raise damaged(where, f"a small element of {size} bytes at byte {at}")
        else:
            first = at + 8
            following = first + size + (0 if kind == COMPRESSED else -size % 8)
        if first + size > end:
            raise damaged(where, f"an element of {size} bytes at byte {at}, where {end - first} are left")
        yield kind, first, first + size
        at = following


def checked_array(where: str, data: bytes, begin: int, end: int, order: str, depth: int) -> tuple[str, bool]:
    """Return the name of an array, and whether it consists only of known classes and was checked completely."""
    if begin == end:
        return "", True  # an empty array, as in fields and cells
    parts = list(elements(where, data, begin, end, order))
    if len(parts) < 3 or [parts[0][0], parts[1][0], parts[2][0]] != [UINT32, INT32, INT8]:
        raise damaged(where, f"an array without flags, dimensions and name at byte {begin}")
    if parts[0][2] - parts[0][1] != 8 or (parts[1][2] - parts[1][1]) % 4 or parts[1][2] - parts[1][1] < 8:
        raise damaged(where, f"flags or dimensions of another size at byte {begin}")
    (flags,) = struct.unpack_from(f"{order}I", data, parts[0][1])
    dimensions = struct.unpack_from(f"{order}{(parts[1][2] - parts[1][1]) // 4}i", data, parts[1][1])
    name = data[parts[2][1] : parts[2][2]].decode("latin-1")
    n = 1
    for dimension in dimensions:
        if dimension < 0 or n > end - begin:
            raise damaged(where, f"array {name!r} of {dimensions} in {end - begin} bytes")
        n *= dimension
    kind, rest = flags & 0xFF, parts[3:]
    if kind in NUMERIC:
        wanted = 2 if flags & 0x800 else 1
        sizes = [NUMBERS.get(each, 0) * n == last - first for each, first, last in rest]
        if len(rest) != wanted or not all(sizes) or any(each not in NUMBERS for each, _, _ in rest):
            raise damaged(where, f"array {name!r}: its numbers do not fill {dimensions}")
        return name, True
    if kind == CHAR:
        if len(rest) > 1 or any(each not in TEXT or last - first > 4 * n for each, first, last in rest):
            raise damaged(where, f"text {name!r} does not fill {dimensions}")
        return name, bool(rest)
    if kind not in (CELL, STRUCT) or not depth:
        return name, False
    if kind == STRUCT:
        if len(rest) < 2 or rest[0][0] != INT32 or rest[0][2] - rest[0][1] != 4 or rest[1][0] != INT8:
            raise damaged(where, f"structure {name!r} without names of fields")
        (length,) = struct.unpack_from(f"{order}i", data, rest[0][1])
        if length < 1 or (rest[1][2] - rest[1][1]) % length:
            raise damaged(where, f"structure {name!r}: names of fields of {length} bytes")
        n *= (rest[1][2] - rest[1][1]) // length
        rest = rest[2:]
    if len(rest) != n or any(each != MATRIX for each, _, _ in rest):
        raise damaged(where, f"{name!r}: {len(rest)} arrays, expected {n}")
    known = [checked_array(where, data, first, last, order, depth - 1)[1] for _, first, last in rest]
    return name, all(known)


# mat file -------------------------------------------------------------------------------------------------------------


MOST_INFLATED = 1100  #: largest number of bytes that deflate produces from one byte
DEEPEST = 8  #: largest depth of nested structures
MOST_COLUMNS = 10000
TIME_WORDS = ("t", "time", "times", "zeit")


def read_mat(path: Path, *, time: str | None = None, rate: float | None = None) -> RawTable:
    """Return the vectors of a MATLAB file with the length of its times, as columns.

    A vector is a column with its name; a table (n_t, k) gives the columns "name 1", "name 2", .... Fields of structures
    are called "structure.field", or by the text in the field `label` of their structure. Units are texts: `unit` or
    `units` in the structure, or a variable NAME_unit. Vectors of another length are omitted, with a note.

    Raises
    ------
    SignalError
        If the file is damaged or not a MATLAB file, it does not contain the time, or a vector is complex.
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
    except Exception as error:  # a reader can fail in any way on invalid data
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
    notes = [f"omitted, because their length is not {n}: {', '.join(left[:20])}"] if left else []
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
    """Return a structure of SciPy's reader as a dictionary, and a single text unchanged."""
    if hasattr(value, "_fieldnames"):
        return {name: plain_5(getattr(value, name)) for name in value._fieldnames}
    return value


def content_7(path: Path) -> dict[str, Any]:
    """Return the variables of a file of version 7.3."""
    import h5py

    with h5py.File(path, "r") as file:
        return {name: plain_7(path, file[name], DEEPEST) for name in file if not name.startswith("#")}


def plain_7(path: Path, entry: Any, depth: int) -> Any:
    """Return an HDF5 array in MATLAB's order, a text, or a dictionary for a group; None for other entries."""
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
    """Yield name, values and unit of every vector, and of every column of a table, including those in structures."""
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
