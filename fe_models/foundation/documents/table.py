"""Tables: named columns of numbers or text with units, written to files and read back.

| ending | numbers | text | units and types | meta |
|---|---|---|---|---|
| .csv | exact, 17 digits | exact | units in the heads, types from the cells | not written |
| .json | exact | exact | exact | exact |
| .mat | exact | exact | exact | exact |
| .npz | exact | exact | exact | exact |
| .parquet | exact | exact | exact | exact |
"""

import io
import json
import math
import os
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_models.foundation.documents import TABLE_SUFFIXES
from fe_models.foundation.errors import TableError
from fe_models.foundation.extras import extra_module
from fe_models.foundation.paths import near_file, replace_file
from fe_models.foundation.presentation import Summary, presented
from fe_models.foundation.records import FrozenMapping, checked_fields, frozen_copies
from fe_models.foundation.words import damage, nearest, quoted

if TYPE_CHECKING:
    from pandas import DataFrame
    from rich.table import Table as RichTable
    from xarray import Dataset

__all__ = ["Table", "Tabular", "read_table"]

Column = NDArray[Any]

FORMAT, VERSION = "floatframe table", 1
KINDS = {"b": "boolean", "i": "integer", "f": "float", "c": "complex", "U": "text"}  #: name of each array type
TYPES = {"boolean": bool, "integer": np.int64, "float": np.float64, "complex": np.complex128, "text": np.str_}
MOST_SHOWN = 60  #: largest number of printed rows


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(TableError)
class Table:
    """Named columns with units.

    Parameters
    ----------
    columns
        Values by name, (n_rows,) each: numbers, complex numbers, True and False, or text. None is a missing value: NaN
        among numbers, so that integers with gaps become floats, and empty among texts.
    units
        Unit of a column by its name; "" or no entry: none.
    meta
        Data about the whole table in plain types (text, numbers, lists, dictionaries).

    Raises
    ------
    TableError
        If columns differ in length, a value is neither number nor text, a unit belongs to no column, or a name, unit or
        entry of `meta` cannot be written.
    """

    columns: Mapping[str, ArrayLike]
    units: Mapping[str, str] = field(default_factory=dict)
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        columns = {name: column_of(name, values) for name, values in self.columns.items()}
        lengths = {name: len(values) for name, values in columns.items()}
        if len(set(lengths.values())) > 1:
            words = ", ".join(f"{quoted(name)} {n}" for name, n in list(lengths.items())[:6])
            raise TableError(f"table: expected columns of one length, got {words}")
        for name, unit in self.units.items():
            if name not in columns:
                raise TableError(f"table: unit of the unknown column {quoted(name)}{nearest(str(name), columns)}")
            if not (isinstance(unit, str) and unit.isprintable() and not set("[]") & set(unit)):
                raise TableError(f"table: unit of {quoted(name)}: expected text without brackets, got {quoted(unit)}")
        try:
            json.dumps(dict(self.meta), allow_nan=False)
        except (TypeError, ValueError) as error:
            raise TableError(f"table: meta: expected text, finite numbers, lists, dictionaries: {error}") from None
        object.__setattr__(self, "columns", FrozenMapping(columns))
        object.__setattr__(self, "units", FrozenMapping({name: self.units.get(name, "") for name in columns}))
        object.__setattr__(self, "meta", FrozenMapping(self.meta))

    @classmethod
    def of_rows(
        cls, names: Sequence[str], rows: Iterable[Sequence[Any]], units: Mapping[str, str] | None = None,
        meta: Mapping[str, Any] | None = None,
    ) -> "Table":  # fmt: skip
        """Return a table of rows, each with a value for every name.

        Raises
        ------
        TableError
            If a row has another number of values.
        """
        kept = [tuple(row) for row in rows]
        for k, row in enumerate(kept):
            if len(row) != len(names):
                raise TableError(f"table, row {k + 1}: expected {len(names)} values, got {len(row)}")
        if len(set(names)) != len(names):
            raise TableError(f"table: expected different names of columns, got {quoted(list(names))}")
        columns = list(zip(*kept, strict=True)) if kept else [()] * len(names)
        return cls(dict(zip(names, columns, strict=True)), units or {}, meta or {})

    def __getitem__(self, name: str) -> Column:
        """Return a column by its name; `TableError` if there is none."""
        if name not in self.columns:
            raise TableError(f"table: no column {quoted(name)}{nearest(name, self.columns)}")
        return np.asarray(self.columns[name])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.columns)

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return max((len(self[name]) for name in self.columns), default=0)

    @property
    def heads(self) -> tuple[str, ...]:
        """Names of the columns with their units in brackets."""
        return tuple(head(name, self.units[name]) for name in self.columns)

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Yield the rows in plain types."""
        return zip(*(self[name].tolist() for name in self.columns), strict=True)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the table in the format of the suffix, one of `TABLE_SUFFIXES`; the file is complete or not written.

        .parquet needs pyarrow (`pip install "floatframe[parquet]"`).

        Raises
        ------
        TableError
            If the ending is unknown, the format cannot hold the table, or the file cannot be written.
        """
        target = Path(path)
        content = self.content(target.suffix, f"table {target}")
        try:
            replace_file(target, content)
        except OSError as error:
            raise TableError(f"table {target}: cannot be written: {error.strerror or error}") from error
        return target

    def content(self, suffix: str, where: str = "table") -> bytes:
        """Return the bytes of a file with this suffix.

        Raises
        ------
        TableError
            If the ending is unknown, or the format cannot hold the table.
        """
        form = format_of(suffix, where)
        try:
            return form.content(self)
        except (UnicodeError, ValueError, OverflowError, TypeError, MemoryError) as error:
            if isinstance(error, TableError):
                raise
            raise TableError(f"{where}: {suffix} cannot hold it: {error}") from error

    def record(self) -> dict[str, Any]:
        """Return the table in plain types, as .json holds it.

        NaN is None, an infinity the text "inf" or "-inf", a complex column two lists.
        """
        record = header_of(self)
        for each in record["columns"]:
            values = self[each["name"]]
            is_complex = values.dtype.kind == "c"
            parts = {"real": values.real, "imag": values.imag} if is_complex else {"": values}
            found = {key: [json_number(v) for v in part.tolist()] for key, part in parts.items()}
            each["values"] = found if is_complex else found[""]
        return record

    def to_dataframe(self, index: str | None = None) -> "DataFrame":
        """Return a pandas DataFrame, with the units by column in `attrs["units"]`, and a column as index.

        Needs pandas (`pip install "floatframe[tables]"`).
        """
        pandas = extra_module("pandas", extra="tables", purpose="a table as a DataFrame")
        frame: DataFrame = pandas.DataFrame({name: self[name] for name in self.columns})
        frame.attrs = {"units": dict(self.units), **self.meta}
        return frame if index is None else frame.set_index(self.known(index))

    def to_xarray(self, index: str | None = None) -> "Dataset":
        """Return an xarray Dataset over a column (default: over the number of the row), with the unit in `attrs`.

        Needs xarray (`pip install "floatframe[tables]"`).
        """
        xarray = extra_module("xarray", extra="tables", purpose="a table as a Dataset")
        over = "row" if index is None else self.known(index)
        parts = {name: (over, self[name], {"units": self.units[name]}) for name in self.columns}
        along = {over: parts.pop(over, (over, np.arange(self.n_rows)))}
        found: Dataset = xarray.Dataset(parts, coords=along, attrs=dict(self.meta))
        return found

    def known(self, name: str) -> str:
        """Return the name after checking that such a column exists; raise `TableError` otherwise."""
        self[name]
        return name

    def summary(self) -> Summary:
        """Return size and first rows."""
        return Summary(f"Table of {self.n_rows} rows", [], self.heads, [shown_row(row) for row in self.rows()])

    def __rich__(self) -> "RichTable":
        """Return the table for printing by rich: the first `MOST_SHOWN` rows, with numbers right-aligned."""
        from rich import box
        from rich.markup import escape
        from rich.table import Table as RichTable

        shown = RichTable(box=box.SIMPLE_HEAD, pad_edge=False)
        for name, title in zip(self.names, self.heads, strict=True):
            is_text = self[name].dtype.kind == "U"
            shown.add_column(escape(title), justify="left" if is_text else "right", overflow="fold")
        for _, row in zip(range(MOST_SHOWN), self.rows(), strict=False):
            shown.add_row(*map(escape, shown_row(row)))
        if self.n_rows > MOST_SHOWN:
            shown.caption = f"... and {self.n_rows - MOST_SHOWN} more rows"
        return shown


class Tabular:
    """A result that can be a table: `to_table`, and the same table for pandas and xarray.

    Classes that derive from it have the method `to_table`.
    """

    is_indexed: ClassVar[bool] = True  #: whether the first column is the index

    def to_table(self, *given: Any, **options: Any) -> Table:
        """Return the result as a table with units."""
        raise NotImplementedError

    def to_dataframe(self, *given: Any, **options: Any) -> "DataFrame":
        """Return the table of `to_table`, with the same arguments, as a pandas DataFrame, units in `attrs["units"]`.

        Needs pandas (`pip install "floatframe[tables]"`).
        """
        table = self.to_table(*given, **options)
        return table.to_dataframe(table.names[0] if self.is_indexed else None)

    def to_xarray(self, *given: Any, **options: Any) -> "Dataset":
        """Return the table of `to_table`, with the same arguments, as an xarray Dataset, the unit of each in `attrs`.

        Needs xarray (`pip install "floatframe[tables]"`).
        """
        table = self.to_table(*given, **options)
        return table.to_xarray(table.names[0] if self.is_indexed else None)


def column_of(name: str, values: ArrayLike) -> Column:
    """Return the values of a column as a read-only array of one of the `TYPES`, (n_rows,)."""
    if not (isinstance(name, str) and name and name.isprintable()):
        raise TableError(f"table: expected a name of printable characters for a column, got {quoted(name)}")
    array: Any = np.asarray(values, dtype=object) if isinstance(values, list | tuple) else np.asarray(values)
    if array.ndim != 1:
        raise TableError(f"table, column {quoted(name)}: expected values in one row each, got shape {array.shape}")
    if array.dtype == object:
        array = typed(name, array.tolist())
    elif array.dtype.kind == "u" and array.size and array.max() > np.iinfo(np.int64).max:
        raise TableError(f"table, column {quoted(name)}: {array.max()} is larger than integers of 64 bits")
    if array.dtype.kind not in "biufcU":
        raise TableError(f"table, column {quoted(name)}: expected numbers or text, got {array.dtype}")
    kind = KINDS["i" if array.dtype.kind == "u" else array.dtype.kind]
    array = np.array(array, dtype=None if kind == "text" else TYPES[kind])
    if kind == "text" and any("\0" in text for text in array.tolist()):
        raise TableError(f"table, column {quoted(name)}: text with the character NUL cannot be written")
    array.flags.writeable = False
    return np.asarray(array)


def typed(name: str, values: list[Any]) -> Column:
    """Return Python values (None for missing ones) as an array of one type."""
    known = [value for value in values if value is not None]
    for value in known:
        if not isinstance(value, str | bool | int | float | complex | np.generic):
            raise TableError(f"table, column {quoted(name)}: expected numbers or text, got {quoted(value)}")
    if not known:
        return np.full(len(values), "" if values else np.nan)
    texts = [isinstance(value, str) for value in known]
    if all(texts):
        if any(value.endswith("\0") for value in known):
            raise TableError(f"table, column {quoted(name)}: text with the character NUL cannot be written")
        return np.array(["" if value is None else value for value in values])
    if any(texts):
        raise TableError(
            f"table, column {quoted(name)}: expected only numbers or only text, got {quoted(known[texts.index(True)])} "
            f"and {quoted(known[texts.index(False)])}"
        )
    has_gaps = len(known) < len(values)
    found = np.array([math.nan if value is None else value for value in values])
    if found.dtype == object:
        raise TableError(f"table, column {quoted(name)}: a number does not fit into 64 bits")
    return found.astype(float) if has_gaps and found.dtype.kind != "c" else found


def shown_row(row: Sequence[Any]) -> list[str]:
    """Return the cells of a row as short texts."""
    return [f"{cell:.6g}" if isinstance(cell, float | complex) else str(cell) for cell in row]


# what all formats share -----------------------------------------------------------------------------------------------


def header_of(table: Table) -> dict[str, Any]:
    """Return all data of a table except its values."""
    columns = [
        {"name": name, "unit": table.units[name], "type": KINDS[table[name].dtype.kind]} for name in table.columns
    ]
    return {"format": FORMAT, "version": VERSION, "columns": columns, "meta": dict(table.meta)}


def table_of(header: Any, values: Callable[[int, str], Any]) -> Table:
    """Return a table from its header and a function that returns the values of column k by index and name."""
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise TableError(f"expected a {FORMAT}")
    if header["version"] != VERSION:
        raise TableError(f"version {header['version']} of the {FORMAT}; this program reads version {VERSION}")
    columns = {
        each["name"]: np.asarray(values(k, each["name"]), dtype=TYPES[each["type"]]).reshape(-1)
        for k, each in enumerate(header["columns"])
    }
    return Table(columns, {each["name"]: each["unit"] for each in header["columns"]}, header["meta"])


def head(name: str, unit: str) -> str:
    """Return "name [unit]", or the name; empty brackets follow a name that itself ends with brackets."""
    return f"{name} [{unit}]" if unit or HEAD.fullmatch(name) else name


def real_columns(table: Table) -> Iterator[tuple[str, str, Column]]:
    """Yield name, unit and values, with "name real" and "name imag" in place of a complex column."""
    for name in table.columns:
        values, unit = table[name], table.units[name]
        if values.dtype.kind != "c":
            yield name, unit, values
        else:
            yield f"{name} real", unit, values.real
            yield f"{name} imag", unit, values.imag


def complex_column(real: Column, imag: Column) -> Column:
    """Return complex numbers from their parts; 1j * imag would be wrong for non-finite parts."""
    found = np.empty(len(real), dtype=complex)
    found.real, found.imag = real, imag
    return found


# CSV ------------------------------------------------------------------------------------------------------------------


HEAD = re.compile(r"(.+) \[([^\[\]]*)\]", re.DOTALL)
NUMBER = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|inf|nan)", re.IGNORECASE)
INTEGER = re.compile(r"[+-]?\d{1,19}")
CELL = re.compile(r'(?:"((?:[^"]|"")*)"|([^,"\r\n]*))(,|\r\n|\r|\n|\Z)')
BOOLEANS = {"True": True, "False": False}


def csv_content(table: Table) -> bytes:
    """Return comma-separated values.

    A NaN is an empty cell. Whole numbers in a column with such gaps are written without decimal point. Text that could
    be read as a number is quoted.
    """
    parts = list(real_columns(table))
    names = [name for name, _, _ in parts]
    if len(set(names)) != len(names):
        raise TableError(f"a complex column and others have the heads {', '.join(names)}; rename one")
    heads = [csv_text(head(name, unit)) for name, unit, _ in parts]
    lines = [",".join(heads), *(",".join(row) for row in zip(*(cells_of(c) for _, _, c in parts), strict=True))]
    if len(parts) == 1:
        lines = [line or '""' for line in lines]  # a reader would skip an empty line
    return ("\n".join(lines) + "\n").encode()


def cells_of(values: Column) -> list[str]:
    """Return the cells of a column."""
    if values.dtype.kind == "U":
        return [csv_text(value) for value in values.tolist()]
    is_gap = np.isnan(values) if values.dtype.kind == "f" else np.zeros(len(values), dtype=bool)
    if not is_gap.any() or is_gap.all():
        return [repr(value) for value in values.tolist()]
    known = values[~is_gap]
    are_whole = bool(np.all((known == np.trunc(known)) & (np.abs(known) < 2**53) & ~((known == 0) & np.signbit(known))))
    return ["" if value != value else repr(int(value) if are_whole else value) for value in values.tolist()]


def csv_text(text: str) -> str:
    """Return a text, in quotes if it contains delimiters or resembles another value."""
    is_plain = not (set(',"\r\n') & set(text) or NUMBER.fullmatch(text) or text in BOOLEANS or text != text.strip())
    return text if is_plain else '"' + text.replace('"', '""') + '"'


def read_csv(content: bytes) -> Table:
    """Return the table of comma-separated values, as `csv_content` writes them."""
    text, at, rows = content.decode("utf-8-sig"), 0, [[]]  # type: ignore[var-annotated]
    while at < len(text):
        found = CELL.match(text, at)
        if found is None:
            raise TableError(f"line {text.count(chr(10), 0, at) + 1}: a quote inside a cell that is not in quotes")
        rows[-1].append((found[2], False) if found[1] is None else (found[1].replace('""', '"'), True))
        at = found.end()
        if found[3] and found[3] != ",":
            rows.append([])
    if not rows[-1]:
        rows.pop()
    if not rows:
        raise TableError("expected a head and rows, got an empty file")
    heads = [cell for cell, _ in rows[0]]
    for k, row in enumerate(rows[1:], start=2):
        if len(row) != len(heads):
            raise TableError(f"row {k}: expected {len(heads)} cells as in the head, got {len(row)}")
    named = [(found[1], found[2]) if (found := HEAD.fullmatch(each)) else (each, "") for each in heads]
    values = [column_of_cells([row[k] for row in rows[1:]]) for k in range(len(heads))]
    columns, units, k = {}, {}, 0
    while k < len(named):
        (name, unit), (other, other_unit) = named[k], named[k + 1] if k + 1 < len(named) else ("", "")
        stem = name.removesuffix(" real")
        kinds = [each.dtype.kind for each in values[k : k + 2]]
        if stem != name and other == f"{stem} imag" and unit == other_unit and kinds == ["f", "f"]:
            columns[stem], units[stem], k = complex_column(*values[k : k + 2]), unit, k + 2
        else:
            if name in columns:
                raise TableError(f"two columns are called {quoted(name)}")
            columns[name], units[name], k = values[k], unit, k + 1
    return Table(columns, units)


def column_of_cells(cells: list[tuple[str, bool]]) -> Column:
    """Return the values of cells, each given with whether it was in quotes: integers, floats, booleans, or text."""
    texts = [text for text, _ in cells]
    is_text = any(is_quoted for _, is_quoted in cells) or (bool(texts) and not any(texts))
    if is_text:
        return np.array(texts)
    if texts and all(text in BOOLEANS for text in texts):
        return np.array([BOOLEANS[text] for text in texts])
    if texts and all(INTEGER.fullmatch(text) for text in texts):
        try:
            return np.array([int(text) for text in texts], dtype=np.int64)
        except OverflowError:
            pass
    if all(not text or NUMBER.fullmatch(text) for text in texts):
        return np.array([float(text or "nan") for text in texts], dtype=float)
    return np.array(texts)


# JSON, NumPy, MATLAB, Parquet -----------------------------------------------------------------------------------------


def json_content(table: Table) -> bytes:
    """Return the record of a table as JSON."""
    return (json.dumps(table.record(), ensure_ascii=False, allow_nan=False) + "\n").encode()


def json_number(value: Any) -> Any:
    """Return a number for JSON, which has no NaN and no infinity."""
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) else str(value)


def read_json(content: bytes) -> Table:
    """Return the table of `json_content`, or the one under "table" in the record of a command."""
    header = json.loads(content)
    if isinstance(header, dict) and "table" in header:
        header = header["table"]

    def values(k: int, _: str) -> Any:
        each = header["columns"][k]
        found, kind = each["values"], each["type"]
        if kind == "complex":
            real, imag = (np.array([floats(v) for v in found[part]], dtype=float) for part in ("real", "imag"))
            return complex_column(real, imag)
        return [floats(v) for v in found] if kind == "float" else found

    return table_of(header, values)


def floats(value: Any) -> float:
    """Return the number that `json_number` wrote: None is NaN, "inf" and "-inf" are infinities."""
    return math.nan if value is None else float(value)


def npz_content(table: Table) -> bytes:
    """Return a NumPy archive: an array for each column under its name, and the header as table.json."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(TABLE_JSON, json.dumps(header_of(table)))
        for name in table.columns:
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, table[name], allow_pickle=False)
    return buffer.getvalue()


TABLE_JSON = "table.json"


def read_npz(content: bytes) -> Table:
    """Return the table of `npz_content`."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if TABLE_JSON not in archive.namelist():
            raise TableError(f"expected an archive with {TABLE_JSON}, as a {FORMAT} has it")

        def values(_: int, name: str) -> Any:
            with archive.open(f"{name}.npy") as file:
                return np.lib.format.read_array(file, allow_pickle=False)

        return table_of(json.loads(archive.read(TABLE_JSON)), values)


#: words that MATLAB does not take as names of variables
MATLAB_WORDS = {
    "break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if",
    "otherwise", "parfor", "persistent", "return", "spmd", "switch", "table_json", "try", "while",
}  # fmt: skip


def matlab_names(names: Iterable[str]) -> list[str]:
    """Return distinct MATLAB variable names that resemble column names."""
    found: list[str] = []
    for name in names:
        stem = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")[:50]
        stem = stem if stem[:1].isalpha() and stem not in MATLAB_WORDS else f"x_{stem}"
        k = 1
        while (word := stem if k == 1 else f"{stem}_{k}") in found:
            k += 1
        found.append(word)
    return found


def mat_content(table: Table) -> bytes:
    """Return a MAT-file of version 5: a structure for each column, with label, unit and values; texts are cells."""
    from scipy.io import savemat

    variables: dict[str, Any] = {"table_json": json.dumps(header_of(table))}
    for word, name in zip(matlab_names(table.columns), table.columns, strict=True):
        values: Any = table[name][:, None]
        if values.dtype.kind == "U":
            values = values.astype(object)
        variables[word] = {"label": name, "unit": table.units[name], "values": values}
    buffer = io.BytesIO()
    savemat(buffer, variables, do_compression=False)
    return buffer.getvalue()


def read_mat(content: bytes) -> Table:
    """Return the table of `mat_content`."""
    from scipy.io import loadmat

    found = loadmat(io.BytesIO(content), chars_as_strings=True)
    if "table_json" not in found:
        raise TableError(f"expected the variable table_json, as a {FORMAT} has it")
    header = json.loads(found["table_json"].item())
    words = matlab_names(each["name"] for each in header["columns"])

    def values(k: int, _: str) -> Any:
        array = found[words[k]]["values"][0, 0].reshape(-1)
        if array.dtype != object:
            return array
        return [str(text.item()) if text.size else "" for text in array]

    return table_of(header, values)


def parquet_content(table: Table) -> bytes:
    """Return Parquet, with the header in its metadata; a complex column becomes two columns."""
    pyarrow, parquet = parquet_modules()
    parts = [(name, unit, pyarrow.array(values)) for name, unit, values in real_columns(table)]
    fields = [pyarrow.field(name, values.type, metadata={"unit": unit}) for name, unit, values in parts]
    schema = pyarrow.schema(fields, metadata={TABLE_JSON: json.dumps(header_of(table))})
    buffer = io.BytesIO()
    parquet.write_table(pyarrow.table([values for _, _, values in parts], schema=schema), buffer)
    return buffer.getvalue()


def read_parquet(content: bytes) -> Table:
    """Return the table of `parquet_content`."""
    pyarrow, parquet = parquet_modules()
    found = parquet.read_table(pyarrow.BufferReader(content))
    header = json.loads((found.schema.metadata or {}).get(TABLE_JSON.encode(), b"null"))
    arrays = iter(found.columns)

    def values(k: int, _: str) -> Any:
        parts = [next(arrays).to_numpy() for _ in range(2 if header["columns"][k]["type"] == "complex" else 1)]
        return parts[0] if len(parts) == 1 else complex_column(*parts)

    return table_of(header, values)


def parquet_modules() -> tuple[Any, Any]:
    """Return the libraries that write Parquet."""
    options = {"extra": "parquet", "purpose": "Parquet files"}
    return extra_module("pyarrow", **options), extra_module("pyarrow.parquet", **options)


# formats by the ending of the file ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TableFormat:
    """A format of tables."""

    content: Callable[[Table], bytes]
    read: Callable[[bytes], Table]


FORMATS = dict(
    zip(
        TABLE_SUFFIXES,
        (
            TableFormat(csv_content, read_csv),
            TableFormat(json_content, read_json),
            TableFormat(mat_content, read_mat),
            TableFormat(npz_content, read_npz),
            TableFormat(parquet_content, read_parquet),
        ),
        strict=True,
    )
)


def format_of(suffix: str, where: str) -> TableFormat:
    """Return the format of a suffix; raise `TableError` if there is none."""
    if suffix.lower() not in FORMATS:
        raise TableError(f"{where}: unknown ending {quoted(suffix)}{nearest(suffix.lower(), FORMATS)}")
    return FORMATS[suffix.lower()]


def read_table(path: str | os.PathLike[str]) -> Table:
    """Return the table in a file written by `Table.write`, by the suffix of the file.

    Parameters
    ----------
    path
        File of the table. Any CSV with commas, a head and decimal points is read; other formats only if `Table.write`
        wrote the file.

    Raises
    ------
    TableError
        If the file is missing, its ending is unknown, or it is damaged or contains no table.
    """
    source = Path(path)
    where = f"table {source}"
    form = format_of(source.suffix, where)
    try:
        content = source.read_bytes()
    except OSError as error:
        raise TableError(f"{where}: cannot be read: {error.strerror or error}{near_file(source)}") from error
    try:
        return form.read(content)
    except TableError as error:
        raise TableError(f"{where}: {error}") from None
    except ImportError:
        raise
    except Exception as error:  # a reader can fail in any way on damaged data
        raise TableError(f"{where}: {damage(error)}") from error
