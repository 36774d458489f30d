"""Notebooks can be read without running them, and a claim between their lines that does not hold ends a run."""

import ast

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

from fe_models.door import names_of, namespaces
from tests.notebooks.running import NOTEBOOKS, SCREEN, cells, place, statements_of
from tests.root import ROOT

NAMES = sorted(path.stem for path in NOTEBOOKS.glob("*.ipynb"))
PACKAGES = ("fe_models", "cms", "floatframe")
#: rooms from which pages of the documentation import
ROOMS = ("floatframe.machines.", "floatframe.files.signals.")
CELL = "for k in range(3):\n    square = k * k\n    print(square)"


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_keeps_what_its_cells_show_and_no_cell_is_longer_than_a_screen(name):
    code = [(source, outputs) for kind, source, outputs in cells(name) if kind == "code"]
    assert any("image/png" in output.get("data", {}) for _, outputs in code for output in outputs)
    assert [source for source, _ in code if len(source.split("\n")) > SCREEN] == []


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_says_what_it_teaches_what_it_needs_and_what_comes_next(name):
    words = [source for kind, source, _ in cells(name) if kind == "markdown"]
    assert words[0].startswith("# ")
    assert "**You learn** " in words[0]
    assert "**You need** " in words[0]
    assert "**Next:** " in words[-1]


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_imports_public_names_and_those_of_documented_rooms(name):
    public = {f"{module}.{each}" for package in PACKAGES for module in namespaces(package) for each in names_of(module)}
    imported = {
        f"{statement.module}.{each.name}"
        for kind, source, _ in cells(name)
        if kind == "code"
        for statement in statements_of(source)
        if isinstance(statement, ast.ImportFrom) and statement.module.split(".")[0] in PACKAGES
        for each in statement.names
    }
    assert {each for each in imported - public if not each.startswith(ROOMS)} == set()


@pytest.mark.parametrize("name", NAMES)
def test_the_claims_of_a_notebook_stand_in_its_test(name):
    assert (ROOT / "tests" / "notebooks" / f"test_{name}.py").exists()
    code = [source for kind, source, _ in cells(name) if kind == "code"]
    assert not [line for source in code for line in source.split("\n") if line.strip().startswith("assert ")]
    assert all(statements_of(source) for source in code)


def test_a_claim_is_placed_after_its_statement_and_fails_where_it_does_not_hold():
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
    place({"square =": ["assert square < 4"]}, book.cells)
    assert book.cells[0].source == CELL.replace("k * k", "k * k\n    assert square < 4")
    with pytest.raises(CellExecutionError, match="assert square < 4"):
        NotebookClient(book, timeout=60).execute()


@pytest.mark.parametrize("start", ["nothing", "s"])
def test_a_claim_without_one_statement_is_refused(start):
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL + "\nsum_of = 1\nsome = 2")])
    with pytest.raises(ValueError, match=f"one statement that begins with '{start}'"):
        place({start: ["assert True"]}, book.cells)
