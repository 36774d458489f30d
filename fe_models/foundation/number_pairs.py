"""Text files of two columns of numbers: a history, a level over frequency, masses of nodes."""

from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.paths import near_file
from fe_models.foundation.words import is_number, quoted

__all__ = ["read_pairs"]


def read_pairs(path: Path, columns: str, error: type[Exception], where: str = "") -> tuple[Array, IntArray]:
    """Return the numbers of a file, (n, 2), and the line number of each row, (n,).

    Commas, semicolons or blanks separate the columns. Empty lines, text from # on, and a heading in the first line are
    skipped.

    Parameters
    ----------
    columns
        Names of the columns for messages, such as "Hz and g".
    error
        Raised if the file cannot be read, or a line does not have two finite numbers; the message names the line.
    where
        Beginning of the messages, such as the option that names the file.
    """
    place = f"{where}: {path}" if where else str(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as problem:
        raise error(f"{place}: cannot be read: {problem.strerror}{near_file(path)}") from problem
    except UnicodeDecodeError:
        raise error(f"{place}: expected a text file of two columns, {columns}") from None
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            first, second = map(float, words)
        except ValueError:
            if not rows and len(words) >= 2 and not is_number(words[0]):
                continue  # a heading
            raise error(f"{place}, line {number}: expected two numbers, {columns}, got {quoted(line)}") from None
        if not np.isfinite([first, second]).all():
            raise error(f"{place}, line {number}: expected finite numbers, got {quoted(line)}")
        rows.append([first, second])
        lines.append(number)
    if not rows:
        raise error(f"{place}: expected lines of two numbers, {columns}, got none")
    return np.array(rows), np.array(lines)
