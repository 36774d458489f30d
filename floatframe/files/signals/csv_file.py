"""Signals from text tables with any usual delimiter, decimal point or comma, and a head with units."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import quoted, shortened
from floatframe.errors import SignalError
from floatframe.files.signals.signal_units import parsed_unit

__all__ = ["RawTable", "read_csv"]

DELIMITERS = (";", "\t", "|", ",", " ")
LOOKED_AT = 50  #: number of lines from which the delimiter and decimal sign are determined
MOST_HEAD = 100  #: largest number of lines before the first number
EMPTY_FIELDS = {"", "nan", "NaN", "NAN", "null", "NULL", "-", "n/a", "N/A", "#N/A"}  #: fields without a number
POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
COMMA = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eEdD][+-]?\d+)?")
UNIT_AT_END = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*(?:\([^()]*\)[^()]*)*)\))\s*")


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns of a file with names and units; the time, if any, is one of the columns."""

    values: Array  #: (n_t, n_columns), NaN for missing numbers
    names: tuple[str, ...]
    units: tuple[str, ...]
    lines: Array | None = None  #: line numbers in the file, from 1, (n_t,); None: rows are counted
    notes: tuple[str, ...] = ()


def read_csv(path: Path, *, decimal: str | None = None, delimiter: str | None = None) -> RawTable:
    """Return the columns of a text table.

    Without `decimal` and `delimiter`, both are determined from the lines with numbers; an ambiguous file is refused.
    The head consists of the lines before the first line of numbers: names with units in brackets, "acc [m/s^2]" or "acc
    (g)", or names on one line and units on the next. Lines that begin with # or % are skipped.

    Raises
    ------
    SignalError
        If rows have different numbers of fields, or a field is not a number; the message has the line number.
    """
    text, notes = decoded(path)
    rows = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip(" \t;,") and not line.lstrip().startswith(("#", "%"))
    ]
    if not rows:
        raise SignalError(f"{path}: expected a table with a head and rows of numbers, got an empty file")
    if decimal not in (None, ".", ",") or delimiter not in (None, *DELIMITERS):
        raise SignalError(
            f"{path}: expected decimal '.' or ',' and a delimiter of ; , | tab or space, got {decimal!r} and "
            f"{delimiter!r}"
        )
    delimiter = delimiter or delimiter_of(path, rows, decimal)
    split = [(number, fields_of(line, delimiter)) for number, line in rows]
    decimal = decimal or decimal_of(path, split, delimiter)
    first = next((k for k, (_, fields) in enumerate(split) if is_numeric(fields, decimal)), None)
    if first is None or first > MOST_HEAD:
        raise SignalError(
            f"{path}: no row of numbers in its first lines, with {name_of(delimiter)} between columns and decimal "
            f"{'comma' if decimal == ',' else 'point'}; state delimiter and decimal"
        )
    if all(len(fields) > 1 and not fields[-1] for _, fields in split[first:]):  # every line ends with a delimiter
        split = [(number, fields if fields[-1] else fields[:-1]) for number, fields in split]
    width = len(split[first][1])
    names, units = head_of(split[:first], width)
    values = numbers_of(path, split[first:], width, decimal)
    lines = np.array([number for number, _ in split[first:]], dtype=float)
    if delimiter != "," or decimal != ".":
        notes.append(f"{name_of(delimiter)} between columns, decimal {'comma' if decimal == ',' else 'point'}")
    return RawTable(values, names, units, lines, tuple(notes))


def decoded(path: Path) -> tuple[str, list[str]]:
    """Return the text of a file, and notes if its encoding is not UTF-8."""
    content = path.read_bytes()
    if b"\0" in content[:4096] and not content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise SignalError(f"{path}: expected a text table, got binary data; is it in another format?")
    for encoding in ("utf-16",) if content.startswith((b"\xff\xfe", b"\xfe\xff")) else ("utf-8-sig", "cp1252"):
        try:
            return content.decode(encoding), [] if encoding == "utf-8-sig" else [f"text in {encoding}"]
        except UnicodeDecodeError:
            continue
    raise SignalError(f"{path}: expected a text table in UTF-8 or Windows-1252")


def fields_of(line: str, delimiter: str) -> list[str]:
    """Return the fields of a line; if spaces are delimiters, a unit in brackets belongs to the preceding name."""
    if delimiter == " ":
        return re.sub(r"\s+([\[(])", r"\1", line.strip()).split()
    if '"' in line:
        import csv

        fields = next(csv.reader([line], delimiter=delimiter))
    else:
        fields = line.split(delimiter)
    return [field.strip() for field in fields]


def delimiter_of(path: Path, rows: list[tuple[int, str]], decimal: str | None) -> str:
    """Return the delimiter between columns, from the last lines examined, which contain numbers."""
    lines = [line.strip() for _, line in rows[-LOOKED_AT:]]
    for delimiter in (";", "\t", "|"):
        if all(delimiter in line for line in lines):
            return delimiter
    if all("," in line for line in lines):
        spaced = [line.split() for line in lines]
        same = len({len(fields) for fields in spaced}) == 1 and len(spaced[0]) > 1
        as_decimal = all(COMMA.fullmatch(field) for fields in spaced for field in fields)
        if same and as_decimal:
            return " "  # 0,001 1,5: decimal commas; if commas separated columns, a blank would follow each of them
        has_point = any("." in line for line in lines)
        counts = {line.count(",") for line in lines}
        if decimal == "," or (not has_point and len(counts) == 1 and two_ways(lines)):
            raise SignalError(
                f"{path}, line {rows[-1][0]}: {quoted(rows[-1][1])} can be read with commas between columns or as "
                "decimal commas; state decimal = ',' or '.' and the delimiter"
            )
        return ","
    return " "


def two_ways(lines: list[str]) -> bool:
    """Return whether lines of integers between commas might be numbers with decimal commas."""
    return all(re.fullmatch(r"[+-]?\d+(,[+-]?\d+)+", line) and line.count(",") == 1 for line in lines)


def decimal_of(path: Path, split: list[tuple[int, list[str]]], delimiter: str) -> str:
    """Return the decimal sign of the fields in the last lines examined."""
    if delimiter == ",":
        return "."
    fields = [(number, field) for number, line in split[-LOOKED_AT:] for field in line]
    commas = [(number, field) for number, field in fields if "," in field and COMMA.fullmatch(field)]
    points = [(number, field) for number, field in fields if "." in field and POINT.fullmatch(field)]
    if commas and points:
        raise SignalError(
            f"{path}: numbers with decimal comma ({quoted(commas[0][1])}, line {commas[0][0]}) and with decimal point "
            f"({quoted(points[0][1])}, line {points[0][0]}); expected one of them, or state decimal"
        )
    return "," if commas else "."


def is_numeric(fields: list[str], decimal: str) -> bool:
    """Return whether all fields are numbers or empty, and at least one is a number."""
    pattern = COMMA if decimal == "," else POINT
    known = [pattern.fullmatch(field) is not None for field in fields]
    return any(known) and all(ok or field in EMPTY_FIELDS for ok, field in zip(known, fields, strict=True))


def head_of(lines: list[tuple[int, list[str]]], width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of the columns, from the last lines before the numbers that fit the columns."""
    fitting = [fields for _, fields in lines if len(fields) == width]
    if not fitting:
        return tuple(f"column {k + 1}" for k in range(width)), ("",) * width
    last = fitting[-1]
    bare = [field.strip("[]() ") for field in last]
    has_units = len(fitting) > 1 and all(parsed_unit(field) is not None for field in bare) and any(bare)
    heads = fitting[-2] if has_units else last
    names, units = zip(*(name_and_unit(head) for head in heads), strict=True)
    if has_units:
        units = tuple(unit or below for unit, below in zip(units, bare, strict=True))
    return tuple(name or f"column {k + 1}" for k, name in enumerate(names)), tuple(units)


def name_and_unit(head: str) -> tuple[str, str]:
    """Return name and unit of "acc [m/s^2]" or "acc (g)"; brackets without a unit belong to the name."""
    found = UNIT_AT_END.fullmatch(head.strip())
    if found is None:
        return head.strip(), ""
    square, unit = found[2] is not None, (found[2] if found[2] is not None else found[3]).strip()
    if not square and parsed_unit(unit) is None:
        return head.strip(), ""
    return found[1].strip(), unit


def numbers_of(path: Path, split: list[tuple[int, list[str]]], width: int, decimal: str) -> Array:
    """Return the numbers of rows, NaN for empty fields; `SignalError` with the line of the first invalid field."""
    for number, fields in split:
        if len(fields) != width:
            raise SignalError(
                f"{path}, line {number}: expected {width} fields as in the first row of numbers, got {len(fields)}: "
                f"{shortened(' '.join(fields), 60)}"
            )
    flat = [field for _, fields in split for field in fields]
    if decimal == ",":
        flat = [field.replace(",", ".") for field in flat]
    try:
        values = np.array(flat, dtype=float)  # unchanged, if all are numbers
    except ValueError:
        values = np.array([number_or_nan(path, field, split[k // width][0], k % width) for k, field in enumerate(flat)])
    return values.reshape(-1, width)


def number_or_nan(path: Path, field: str, line: int, column: int) -> float:
    """Return a number, NaN for an empty field; `SignalError` for other text."""
    if field in EMPTY_FIELDS:
        return np.nan
    try:
        return float(field.replace("d", "e").replace("D", "e"))
    except ValueError:
        raise SignalError(
            f"{path}, line {line}: expected a number in column {column + 1}, got {quoted(field)}"
        ) from None


def name_of(delimiter: str) -> str:
    """Return a delimiter as text."""
    return {";": "semicolons", "\t": "tabs", "|": "bars", ",": "commas", " ": "spaces"}[delimiter]
