"""Display of public objects: a few lines as text, a small table in a notebook."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from fe_models.foundation.words import shortened

__all__ = ["Summary", "listed", "presented", "shown_in_notebooks", "text_of"]

Class = TypeVar("Class", bound=type)

LONGEST_VALUE = 70  #: largest number of characters of a value
MOST_ROWS = 12  #: largest number of rows in the table of a summary
WIDEST = 118  #: largest number of characters in a row of this table
FEW = 6  #: largest number of names or list items in the output
SMALL_ARRAY = 12  #: largest number of entries of an array whose numbers are in the output


@dataclass(frozen=True)
class Summary:
    """Text and table that describe an object.

    Parameters
    ----------
    title
        Kind and name of the object.
    rows
        Labels and values.
    headings
        Headings of the table below the rows, if there is one.
    table
        Rows of this table; the first `MOST_ROWS` are shown, and as text the columns that fit into `WIDEST` characters.
    """

    title: str
    rows: Sequence[tuple[str, str]] = ()
    headings: Sequence[str] = ()
    table: Sequence[Sequence[str]] = ()

    def text(self) -> str:
        """Return the summary as text."""
        width = max((len(label) for label, _ in self.rows), default=0)
        lines = [self.title, *(f"  {label:<{width}}  {value}" for label, value in self.rows)]
        shown = [list(self.headings), *(list(row) for row in self.table[:MOST_ROWS])] if self.table else []
        widths = [max(len(row[k]) for row in shown) for k in range(len(self.headings))] if shown else []
        ends = [sum(widths[: k + 1]) + 2 * (k + 1) for k in range(len(widths))]
        n_fit = max(1, sum(end <= WIDEST for end in ends))
        lines += [
            "  " + "  ".join(f"{cell:<{n}}" for cell, n in zip(row[:n_fit], widths, strict=False)).rstrip()
            for row in shown
        ]
        if len(self.table) > MOST_ROWS:
            lines.append(f"  ... and {len(self.table) - MOST_ROWS} more")
        if n_fit < len(widths):
            lines.append(f"  ... and {len(widths) - n_fit} more columns")
        return "\n".join(lines)

    def html(self) -> str:
        """Return the summary as tables of HTML."""
        cell = lambda kind, text: f"<{kind} style='text-align:left'>{html.escape(text)}</{kind}>"  # noqa: E731
        rows = [f"<tr>{cell('th', label)}{cell('td', value)}</tr>" for label, value in self.rows]
        parts = [f"<b>{html.escape(self.title)}</b>", *(["<table>", *rows, "</table>"] if rows else [])]
        if self.table:
            parts.append("<table><tr>" + "".join(cell("th", heading) for heading in self.headings) + "</tr>")
            parts += [f"<tr>{''.join(cell('td', each) for each in row)}</tr>" for row in self.table[:MOST_ROWS]]
            parts.append("</table>")
        if len(self.table) > MOST_ROWS:
            parts.append(f"... and {len(self.table) - MOST_ROWS} more")
        return "".join(parts)


def presented(kind: Class) -> Class:
    """Decorate a data class: `repr` and notebooks show its `summary`, or else its fields that differ from defaults."""

    def show(self: Any) -> Summary:
        found: Summary = self.summary() if hasattr(kind, "summary") else summary_of_fields(self)
        return found

    def text(self: Any) -> str:
        found = show(self)
        if not hasattr(kind, "summary") and len(found.title) + sum(len(a) + len(b) + 3 for a, b in found.rows) < 100:
            return f"{type(self).__name__}({', '.join(f'{label}={value}' for label, value in found.rows)})"
        return found.text()

    kind.__repr__ = text  # type: ignore[method-assign, assignment]
    kind._repr_html_ = lambda self: show(self).html()  # type: ignore[attr-defined]
    return kind


def shown_in_notebooks(kind: Class) -> Class:
    """Decorate a data class: notebooks show its fields that differ from defaults; `repr` stays that of a data class."""
    kind._repr_html_ = lambda self: summary_of_fields(self).html()  # type: ignore[attr-defined]
    return kind


def summary_of_fields(value: Any) -> Summary:
    """Return the summary of a data class: its name, and the fields that differ from their defaults."""
    rows = []
    for part in fields(value):
        if not part.repr:
            continue
        found = getattr(value, part.name, None)
        default = part.default if part.default_factory is MISSING else part.default_factory()
        if default is not MISSING and is_same(found, default):
            continue
        rows.append((part.name, text_of(found)))
    return Summary(type(value).__name__, rows)


def is_same(a: Any, b: Any) -> bool:
    """Return whether a value equals the default."""
    if a is b:
        return True
    try:
        return type(a) is type(b) and bool(np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b)
    except (ValueError, TypeError):
        return False


def text_of(value: Any) -> str:
    """Return a value as a short text on one line."""
    import scipy.sparse as sp  # not above: drawing processes have no matrices

    if isinstance(value, np.ndarray):
        if not 0 < value.size <= SMALL_ARRAY:
            return f"array {value.shape}"
        numbers = np.array2string(value, separator=", ", formatter={"float_kind": "{:.6g}".format})
        return shortened(" ".join(numbers.split()), LONGEST_VALUE)
    if sp.issparse(value):
        return f"sparse {value.shape}, {value.nnz} entries"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Path):
        return shortened(str(value), LONGEST_VALUE)
    if isinstance(value, Mapping):
        if len(value) > 4:
            return f"{len(value)} entries"
        return shortened(
            "{" + ", ".join(f"{key!r}: {text_of(each)}" for key, each in value.items()) + "}", LONGEST_VALUE
        )
    if isinstance(value, tuple | list):
        if len(value) > FEW:
            return f"{len(value)} items"
        inner = ", ".join(text_of(each) for each in value)
        return shortened(
            f"[{inner}]" if isinstance(value, list) else f"({inner}{',' * (len(value) == 1)})", LONGEST_VALUE
        )
    if is_dataclass(value) and not isinstance(value, type):
        name = getattr(value, "name", None)
        return f"{type(value).__name__}({name!r})" if isinstance(name, str) else type(value).__name__
    return shortened(repr(value).replace("\n", " "), LONGEST_VALUE)


def listed(names: Sequence[str]) -> str:
    """Return the number of names, and the first names."""
    more = f", ... and {len(names) - FEW} more" if len(names) > FEW else ""
    return f"{len(names)}: {', '.join(names[:FEW])}{more}" if names else "none"
