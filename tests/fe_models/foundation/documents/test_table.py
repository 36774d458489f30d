"""Tables written and read back: numbers of all kinds, text, units, in every format."""

import csv
import io
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.foundation.documents import TABLE_SUFFIXES
from fe_models.foundation.documents.table import Table, TableError, read_table

TEXTS = ["plain", 'with "quotes", commas', "Lager außen ü²", " spaces ", "", "two\nlines\r\nhere", "17", "nan", "True"]
N = len(TEXTS)


def general(n: int = N) -> Table:
    """Columns of every type, with NaN, infinities, numbers that need 17 digits, and names that need care."""
    rng = np.random.default_rng(29)
    x = rng.normal(size=N) * 10.0 ** rng.integers(-300, 300, N)
    x[1], x[4], x[5] = np.nan, np.inf, -np.inf
    z = rng.normal(size=N) + 1j * rng.normal(size=N)
    z[2] = complex(np.nan, np.inf)
    columns = {
        "t": np.arange(N) / 3,
        "Knoten": np.array([2**62 + 1, -7, 0, 11, 2**53 + 1, 5, 6, 7, 8]),
        "tip x, y/z": x,
        'end "a" [b]': np.full(N, np.nan),
        "H ü": z,
        "note": np.array(TEXTS),
        "end": np.array(TEXTS[::-1]),
        "file": np.arange(N) % 2 == 0,
    }
    units = {"t": "s", "tip x, y/z": "m/s²", "H ü": "mm/(N m)"}
    return Table({name: values[:n] for name, values in columns.items()}, units, {"system": "Kurbel ü", "n": [1, 2.5]})


def assert_same(found: Table, table: Table) -> None:
    assert found.names == table.names
    assert dict(found.units) == dict(table.units)
    for name in table.names:
        assert found[name].dtype.kind == table[name].dtype.kind, name
        assert_array_equal(found[name], table[name], strict=table[name].dtype.kind != "U")


@pytest.mark.parametrize("suffix", TABLE_SUFFIXES)
@pytest.mark.parametrize("n", [N, 1])
def test_a_table_is_read_back_as_it_was(suffix, n, tmp_path):
    table = general(n)
    found = read_table(table.write(tmp_path / f"table{suffix}"))
    assert_same(found, table)
    assert dict(found.meta) == ({} if suffix == ".csv" else dict(table.meta))


@pytest.mark.parametrize("suffix", TABLE_SUFFIXES)
def test_an_empty_table_is_read_back_with_heads(suffix, tmp_path):
    table = general(0)
    found = read_table(table.write(tmp_path / f"table{suffix}"))
    assert found.n_rows == 0
    assert found.heads == table.heads
    if suffix != ".csv":  # without a cell nothing says what type a column has
        assert_same(found, table)


def test_other_programs_read_the_csv(tmp_path):
    pandas = pytest.importorskip("pandas")
    table = general()
    path = table.write(tmp_path / "table.csv")
    rows = list(csv.reader(io.StringIO(path.read_bytes().decode(), newline="")))
    assert [row[rows[0].index("note")] for row in rows[1:]] == TEXTS
    frame = pandas.read_csv(path)
    assert_allclose(frame["tip x, y/z [m/s²]"], table["tip x, y/z"], rtol=1e-15, atol=0)
    assert_array_equal(frame["Knoten"], table["Knoten"])


def test_numpy_matlab_and_json_files_are_plain_to_others(tmp_path):
    import scipy.io

    table = general()
    with np.load(table.write(tmp_path / "table.npz"), allow_pickle=False) as archive:
        assert_array_equal(archive["Knoten"], table["Knoten"])
    found = scipy.io.loadmat(table.write(tmp_path / "table.mat"), squeeze_me=True, struct_as_record=False)
    assert_array_equal(found["tip_x_y_z"].values, table["tip x, y/z"])
    assert found["tip_x_y_z"].unit == "m/s²"
    assert found["x_end"].label == "end"

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    record = json.loads(table.write(tmp_path / "table.json").read_bytes(), parse_constant=refuse)
    assert record["columns"][0] == {"name": "t", "unit": "s", "type": "float", "values": table["t"].tolist()}


def test_pandas_and_xarray_get_values_and_units():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    table = general()
    frame, data = table.to_dataframe("t"), table.to_xarray("t")
    assert frame.index.name == "t"
    assert frame.attrs["units"]["tip x, y/z"] == "m/s²"
    assert_array_equal(frame["H ü"], table["H ü"])
    assert data["tip x, y/z"].attrs["units"] == "m/s²"
    assert_array_equal(data["tip x, y/z"].sel(t=0.0), table["tip x, y/z"][0])
    assert table.to_xarray().sizes == {"row": N}


def test_rows_with_gaps_become_nan_and_empty_text():
    table = Table.of_rows(("node", "x", "why"), [(3, None, None), (None, 2.5, "fails")], {"x": "m"})
    assert_array_equal(table["node"], [3.0, np.nan])
    assert_array_equal(table["x"], [np.nan, 2.5])
    assert table["why"].tolist() == ["", "fails"]
    assert list(table.rows())[1][1:] == (2.5, "fails")
    assert table.content(".csv") == b"node,x [m],why\n3,,\n,2.5,fails\n"


def test_rich_and_repr_show_heads_and_rows():
    from rich.console import Console

    table = general()
    console = Console(width=200, file=io.StringIO())
    console.print(table)
    assert "tip x, y/z [m/s²]" in console.file.getvalue()
    assert "9223" not in repr(table)
    assert str(2**62 + 1) in repr(table)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Table({"a": [1, 2], "b": [1]}), "columns of one length"),
        (lambda: Table({"a": [1, "x"]}), "only numbers or only text, got 'x' and 1"),
        (lambda: Table({"a": [object()]}), "expected numbers or text"),
        (lambda: Table({"a": np.array(["2020-01-01"], dtype="datetime64[D]")}), "expected numbers or text"),
        (lambda: Table({"a": [2**70]}), "does not fit into 64 bits"),
        (lambda: Table({"a": np.array([2**63], dtype=np.uint64)}), "larger than integers of 64 bits"),
        (lambda: Table({"a": [[1, 2]]}), "shape"),
        (lambda: Table({"a\n": [1]}), "printable"),
        (lambda: Table({"a": ["x\0"]}), "NUL"),
        (lambda: Table({"a": [1]}, {"b": "m"}), "unknown column 'b'"),
        (lambda: Table({"a": [1]}, {"a": "[m]"}), "without brackets"),
        (lambda: Table({"a": [1]}, {}, {"x": np.nan}), "meta"),
        (lambda: Table({"a": [1]}, {}, {"x": object()}), "meta"),
        (lambda: Table.of_rows(("a", "b"), [(1, 2), (3,)]), "row 2: expected 2 values, got 1"),
        (lambda: Table.of_rows(("a", "a"), [(1, 2)]), "different names"),
        (lambda: Table({"a": [1]})["b"], "no column 'b'"),
        (lambda: Table({"a": [1]}).content(".xls"), "unknown ending '.xls'"),
        (lambda: Table({"z": [1j], "z real": [1.0]}).content(".csv"), "rename one"),
    ],
)
def test_what_cannot_be_a_table_is_refused(make, told):
    with pytest.raises(TableError, match=told):
        make()


@pytest.mark.parametrize("suffix", TABLE_SUFFIXES)
def test_text_that_has_no_utf8_leaves_the_old_file(suffix, tmp_path):
    path = tmp_path / f"table{suffix}"
    path.write_text("old")
    try:
        Table({"a": ["\ud800"]}).write(path)
    except TableError:
        assert path.read_text() == "old"
    else:
        assert_same(read_table(path), Table({"a": ["\ud800"]}))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", TABLE_SUFFIXES)
def test_damaged_files_are_refused(suffix, tmp_path):
    path = tmp_path / f"table{suffix}"
    content = general().content(suffix)
    for damaged in (b"", content[: len(content) // 2], b"\xff" * 9 + content[9:-30]):
        path.write_bytes(damaged)
        with pytest.raises(TableError, match=rf"table\{suffix}"):
            read_table(path)
    with pytest.raises(TableError, match="cannot be read"):
        read_table(tmp_path / f"absent{suffix}")
    with pytest.raises(TableError, match="cannot be written"):
        general().write(tmp_path / "no" / f"table{suffix}")
