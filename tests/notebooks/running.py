"""Notebooks are run as a reader runs them, from the first cell to the last, with claims between their lines."""

import ast
import json
import os
from collections.abc import Mapping, Sequence

import nbformat
from nbclient import NotebookClient

from tests.root import ROOT

NOTEBOOKS = ROOT / "notebooks"
SCREEN = 40  #: lines of a cell


def cells(name: str) -> list[tuple[str, str, list]]:
    """Return kind, source and stored outputs of the cells of a notebook."""
    stored = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return [(cell["cell_type"], "".join(cell["source"]), cell.get("outputs", [])) for cell in stored]


def run(name: str, claims: Mapping[str, Sequence[str]] | None = None) -> None:
    """Run a notebook with statements after those that begin with the keys of `claims`."""
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    place(claims or {}, notebook.cells)
    client = NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(NOTEBOOKS)}})
    client.execute(env=os.environ | {"PYTHONPATH": str(ROOT)})


def place(claims: Mapping[str, Sequence[str]], found: list) -> None:
    """Write claims into cells of code, each after the one statement that begins with its key."""
    for start, statements in claims.items():
        places = [
            (cell, statement)
            for cell in found
            if cell.cell_type == "code"
            for statement in statements_of(cell.source)
            if cell.source.split("\n")[statement.lineno - 1].strip().startswith(start)
        ]
        if len(places) != 1:
            raise ValueError(f"expected one statement that begins with {start!r}, found {len(places)}")
        cell, statement = places[0]
        lines = cell.source.split("\n")
        lines[statement.end_lineno : statement.end_lineno] = [" " * statement.col_offset + each for each in statements]
        cell.source = "\n".join(lines)


def statements_of(source: str) -> list[ast.stmt]:
    """Return all statements of a cell."""
    return [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.stmt)]
