"""The structure of the house: three packages in a row, no circles, rooms that can be overlooked.

All of it is read off the syntax trees: every import counts, those inside functions and those for types alike.
"""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.import_graph import PACKAGES, files_of, graph, modules, statements, tree_of
from tests.root import ROOT

MOST_MODULES = 18  #: of a room, its __init__ not counted
MOST_AT_THE_TOP = 10  #: of a package


def circles(arrows: dict[str, set[str]]) -> list[list[str]]:
    """Return the strongly connected components of more than one node (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(arrows.get(name, ())):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            component = []
            while name not in component:
                component.append(stack.pop())
            if len(component) > 1:
                found.append(sorted(component))

    for name in sorted(arrows):
        if name not in index:
            visit(name)
    return found


def test_the_search_for_circles_finds_them():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set()}) == [["b", "c"]]


def test_every_import_names_a_module_that_exists():
    assert {name: missing for name, names in graph().items() if (missing := sorted(names - set(modules())))} == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_point_downward(package):
    """Command lines included, and imports inside functions or for types only as well."""
    allowed = PACKAGES[: PACKAGES.index(package) + 1]
    upward = {
        name: wrong
        for name, names in graph().items()
        if name.split(".")[0] == package and (wrong := sorted(n for n in names if n.split(".")[0] not in allowed))
    }
    assert upward == {}


#: rooms of public elements
OF_ELEMENTS = (
    "aerodynamics", "bearings", "cables", "clearances", "drives", "friction", "hydraulics", "rails", "wheels",
)  # fmt: skip


def test_the_core_knows_no_element_by_its_name():
    """Rooms of public elements come in by the registry alone; only machines and each other may import them."""
    rooms = tuple(f"floatframe.{room}" for room in OF_ELEMENTS)
    free = (*rooms, "floatframe.machines")
    wrong = [
        f"{name} imports {other}"
        for name, others in graph().items()
        for other in others
        if other.startswith(rooms) and not name.startswith(free)
    ]
    assert not wrong, wrong


def test_no_module_imports_itself_by_way_of_others():
    assert circles(graph()) == []


def test_no_room_imports_itself_by_way_of_others():
    """A module that stands above rooms, such as cms/reduction/reduction.py, is a place of its own."""
    above = {path.parent for path in modules().values() if [f for f in path.parent.glob("*/__init__.py")]}
    place = {name: name if path.parent in above else str(path.parent) for name, path in modules().items()}
    arrows: dict[str, set[str]] = {}
    for name, others in graph().items():
        arrows.setdefault(place[name], set()).update({place[other] for other in others} - {place[name]})
    assert circles(arrows) == []


#: wings of each package: one imports itself and those before it; modules beside them are errors and names for all
WINGS = {
    "fe_models": ("foundation", "meshes", "body", "elements", "checks", "assembly", "files", "parts"),
    "cms": ("linear_algebra", "body", "modes", "reduction", "assessment", "exchange", "jobs", "cli"),
    "floatframe": (
        "model", "components", "engine", "integrators", "results", "simulation", "analyses", "files", "pictures",
        "design", "durability", "machines", "cli",
    ),
}  # fmt: skip


@pytest.mark.parametrize("package", PACKAGES)
def test_wings_import_those_before_them(package):
    wings = WINGS[package]
    assert {path.parent.name for path in (ROOT / package).glob("*/__init__.py")} == set(wings)

    def rank(name: str) -> int:
        parts = name.split(".")
        return wings.index(parts[1]) if len(parts) > 1 and parts[1] in wings else -1

    upward = {
        name: wrong
        for name, names in graph().items()
        if name.startswith(f"{package}.")
        and rank(name) >= 0
        and (wrong := sorted(n for n in names if n.startswith(f"{package}.") and rank(n) > rank(name)))
    }
    assert upward == {}


def test_the_foundation_imports_nothing_of_ours_but_itself():
    outward = {
        name: wrong
        for name, names in graph().items()
        if name.startswith("fe_models.foundation")
        and (wrong := sorted(n for n in names if not n.startswith("fe_models.foundation")))
    }
    assert outward == {}


def test_rooms_can_be_overlooked():
    crowded = {}
    for folder in {path.parent for path in modules().values()}:
        count = len([path for path in folder.glob("*.py") if path.name != "__init__.py"])
        if count > (MOST_AT_THE_TOP if folder.parent == ROOT else MOST_MODULES):
            crowded[str(folder.relative_to(ROOT))] = count
    assert crowded == {}


def test_every_room_says_what_is_in_it():
    silent = [name for name, path in modules().items() if path.name == "__init__.py" and not doc_of(path)]
    assert silent == []


def doc_of(path: Path) -> str | None:
    return ast.get_docstring(tree_of(path))


def test_no_package_imports_the_tests():
    for package in PACKAGES:
        for path in files_of(package):
            nodes = statements(tree_of(path)) if "tests" in path.read_text() else []
            wrong = [
                node for node in nodes if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith("tests.")
            ]
            assert not wrong, path


#: in the text of a file: only where it matches are the imports read off the tree
IMPORTED_TEST = re.compile(r"^ *(?:from|import) (?:[^\n(]*\([^)]*|[^\n]*)\btest_", re.MULTILINE)


def test_tests_share_helpers_and_fixtures_and_import_no_other_tests():
    """What several tests need stands in a plain module beside them, such as `examples.py`, or in a conftest.py."""
    files = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in files_of("tests")}
    tests = {name for name in files if name.rpartition(".")[2].startswith("test_")}
    wrong = {}
    for name, path in files.items():
        if not IMPORTED_TEST.search(path.read_text(encoding="utf-8")):
            continue
        nodes = [node for node in statements(tree_of(path)) if isinstance(node, ast.Import | ast.ImportFrom)]
        named = {f"{node.module}.{a.name}" for node in nodes if isinstance(node, ast.ImportFrom) for a in node.names}
        named |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}
        named |= {a.name for node in nodes if isinstance(node, ast.Import) for a in node.names}
        if named & tests:
            wrong[name] = sorted(named & tests)
    assert wrong == {}


HEAVY = ["skfem", "meshio", "pyvista", "vtk", "numba", "matplotlib", "gmsh", "typer", "rich"]


@pytest.mark.parametrize("module", HEAVY)
def test_importing_the_packages_leaves_the_heavy_libraries_alone(module):
    code = f"import sys, cms, floatframe, fe_models; sys.exit({module!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_output_of_the_core_goes_through_the_command_line():
    """No print outside the command lines and the rendering worker."""
    talkers = []
    for path in modules().values():
        parts, text = path.relative_to(ROOT).parts, path.read_text()
        if "cli" in parts or "print" not in text:
            continue
        calls = [node for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call)]
        if any(isinstance(c.func, ast.Name) and c.func.id == "print" for c in calls):
            talkers.append(str(path.relative_to(ROOT)))
    assert [name for name in talkers if "rendering" not in name] == []


#: what stays of the house when numba is there: kernels are compiled on import, the worker is the entry of a process
NOT_ALONE = ("floatframe.engine.kernels", "cms.assessment.rendering.worker")


@pytest.mark.long
def test_every_module_can_be_imported_first():
    """Each in an interpreter whose modules of ours are forgotten before: no circle of imports at run time."""
    code = """
import importlib, sys
failed = []
for name in {names!r}:
    for known in [m for m in sys.modules if m.split(".")[0] in {packages!r} and "kernels" not in m]:
        del sys.modules[known]
    try:
        importlib.import_module(name)
    except ImportError as error:
        failed.append(f"{{name}}: {{error}}")
print("\\n".join(failed))
sys.exit(bool(failed))
"""
    names = [name for name in modules() if not name.startswith(NOT_ALONE) and not name.endswith("__main__")]
    result = subprocess.run(
        [sys.executable, "-c", code.format(packages=PACKAGES, names=names)], cwd=ROOT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stdout + result.stderr
