"""Measured modes from a table (.csv): a row per measured direction, a column per mode, headed by its frequency.

    point, direction, x, y, z, 103.2 Hz 1.1 %, 251.9 Hz 0.8 %
    5012,  +z,        0, 0, 5, 0.31,           -0.02

x, y, z may be omitted if points are node numbers; a direction is x, -y, ... or three numbers separated by blanks.
"""

import csv
import re
from pathlib import Path

import numpy as np

from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes
from fe_models.foundation.arrays import Array

__all__ = ["read_mode_table"]

HEADING = re.compile(r"^\s*([0-9.eE+-]+)\s*Hz(?:\s+([0-9.eE+-]+)\s*%)?\s*$")
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def read_mode_table(path: Path, length: float, *, given: float | None = None) -> MeasuredModes:
    """Read the modes of a table.

    Parameters
    ----------
    length
        Length unit of the model [m].
    given
        Length unit of x, y, z [m]; None: the length unit of the model.

    Raises
    ------
    CorrelationError
        With the line number, if a heading, a direction or a number is invalid.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise CorrelationError(f"{path}: cannot be read as a table of text: {error}") from error
    delimiter = ";" if text.count(";") > text.count(",") else ","
    rows = [(k, row) for k, row in enumerate(csv.reader(text.splitlines(), delimiter=delimiter), start=1)
            if row and any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#")]  # fmt: skip
    if len(rows) < 2:
        raise CorrelationError(f"{path}: expected a line of headings and lines of points, got {len(rows)} lines")
    headings = [cell.strip() for cell in rows[0][1]]
    names = [name.lower() for name in headings]
    if names[:2] != ["point", "direction"]:
        raise CorrelationError(f"{path}: line {rows[0][0]}: expected headings point, direction; got {headings[:2]}")
    has_places = names[2:5] == ["x", "y", "z"]
    first = 5 if has_places else 2
    modes = [HEADING.match(heading) for heading in headings[first:]]
    if not modes or not all(modes):
        wrong = next((h for h, m in zip(headings[first:], modes, strict=True) if m is None), "none")
        raise CorrelationError(f'{path}: line {rows[0][0]}: expected modes such as "103.2 Hz 1.1 %", got {wrong!r}')
    factor = 1.0 if given is None else given / length
    points, directions, places, values = [], [], [], []
    for line, row in rows[1:]:
        where = f"{path}: line {line}"
        if len(row) != len(headings):
            raise CorrelationError(f"{where}: expected {len(headings)} values, got {len(row)}")
        points.append(whole_number(where, row[0]))
        directions.append(direction_of(where, row[1]))
        places.append([factor * number(where, cell) for cell in row[2:5]] if has_places else [np.nan] * 3)
        values.append([number(where, cell) for cell in row[first:]])
    damping = [float(mode[2] or 0.0) / 100 for mode in modes if mode]
    return MeasuredModes(
        np.array([number(f"{path}: headings", mode[1]) for mode in modes if mode]),
        np.array(values),
        np.array(points),
        np.array(directions),
        np.array(places),
        np.array(damping) if any(damping) else np.zeros(0),
        source=str(path),
    )


def number(where: str, cell: str) -> float:
    """Return the number in a cell."""
    try:
        return float(cell)
    except ValueError:
        raise CorrelationError(f"{where}: expected a number, got {cell.strip()!r}") from None


def whole_number(where: str, cell: str) -> int:
    """Return the point number in a cell, an integer."""
    if not re.fullmatch(r"\s*\d+\s*", cell):
        raise CorrelationError(f"{where}: expected the number of a point, got {cell.strip()!r}")
    return int(cell)


def direction_of(where: str, cell: str) -> Array:
    """Return the unit vector of a direction: x, +x, -y, or three numbers separated by blanks."""
    word = cell.strip().lower()
    if (axis := word.lstrip("+-")) in AXES and len(word) - len(axis) <= 1:
        return (-1.0 if word.startswith("-") else 1.0) * np.array(AXES[axis])
    parts = word.split()
    if len(parts) != 3:
        raise CorrelationError(f"{where}: direction: expected x, -y, ... or three numbers, got {cell.strip()!r}")
    return np.array([number(where, part) for part in parts])
