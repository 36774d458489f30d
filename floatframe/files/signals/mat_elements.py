"""The elements of a MATLAB file of version 5, walked through before a reader takes it: tags, sizes and dimensions fit.

SciPy's reader trusts what a damaged file says, and can take the program along. A file is a head of 128 bytes and
elements: a tag (type and size of 4 bytes each, or of 2 in a small element) and data, filled up to 8 bytes. An array is
an element of elements: flags with its class, dimensions, name, and numbers, or the arrays of its fields or cells.
"""

import struct
import zlib
from collections.abc import Iterator

from floatframe.errors import SignalError

__all__ = ["sound_variables"]

NUMBERS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}  #: bytes of a number by its type
TEXT = (1, 2, 3, 4, 16, 17, 18)
INT8, INT32, UINT32, MATRIX, COMPRESSED = 1, 5, 6, 14, 15
CELL, STRUCT, CHAR, NUMERIC = 1, 2, 4, range(6, 16)  #: classes of arrays
DEEPEST = 20
MOST_BYTES = 1 << 33  #: that a compressed element may unpack to


def sound_variables(where: str, content: bytes) -> list[str]:
    """Return the names of the variables that hold numbers, text, structures and cells, all of them walked through.

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
        name, is_known = checked_array(where, data, begin, end, order, DEEPEST)
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
    """Yield type, begin and end of the data of each element between two places."""
    while at < end:
        if at + 8 > end:
            raise damaged(where, f"{end - at} bytes are left at byte {at} where an element begins")
        kind, size = struct.unpack_from(f"{order}II", data, at)
        if kind >> 16:  # a small element: its size and data stand in the tag
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
    """Return the name of an array, and whether all of it is of known classes and was walked through."""
    if begin == end:
        return "", True  # an empty one, as fields and cells have it
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
