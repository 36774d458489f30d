"""What imports what, read off the syntax trees: every import counts, those inside functions and for types alike.

The packages import each other's modules; tests import modules, and a module guards what it reaches on the way
(`guards`): `python -m tests --guards PATH ...` names the tests of a module, nearest first.

Not seen: modules whose names are put together while the program runs (`importlib.import_module(f"...{name}")`), what a
test starts by the name of a command, data files that a test reads by their path, and pages. A test that imports a
module need not use it either: whether it fails when a line is wrong, only a wrong line tells.
"""

import ast
import re
import subprocess
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from fe_models.door import door_names
from floatframe.engine.kernels.compiler.garbage import without_garbage_collection
from tests.root import ROOT

__all__ = [
    "PACKAGES",
    "all_uses",
    "changed_files",
    "files_of",
    "graph",
    "guards",
    "modules",
    "named_modules",
    "statements",
    "tree_of",
]

PACKAGES = ("fe_models", "cms", "floatframe")  #: each imports itself and those before it
AROUND = ("tests", "benchmarks")  #: what else is on the way from a test to a module
NAMED = re.compile(rf"\b(?:{'|'.join(PACKAGES + AROUND)})(?:\.\w+)+")  #: a module in a string


def files_of(package: str) -> list[Path]:
    """Return the files of a package, sorted."""
    return sorted((ROOT / package).rglob("*.py"))


def module_name(path: Path) -> str:
    """Return the name by which a file is imported."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def tree_of(path: Path) -> ast.Module:
    """Return the syntax tree of a file.

    It is not cached: the trees of all files take 400 MB. Garbage collection would add half of the parser's time.
    """
    with without_garbage_collection():
        return ast.parse(path.read_text(encoding="utf-8"))


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements in a tree, those inside functions, classes and branches alike, without expressions."""
    for name in BLOCKS:
        for node in getattr(tree, name, ()):
            yield node
            yield from statements(node)


BLOCKS = ("body", "handlers", "orelse", "finalbody", "cases")  #: fields with statements, or with nodes that have some


@cache
def modules() -> dict[str, Path]:
    """Return the modules of the packages by name."""
    return {module_name(path): path for package in PACKAGES for path in files_of(package)}


@cache
def test_modules() -> dict[str, Path]:
    """Return the modules of tests and benchmarks by name."""
    return {module_name(path): path for package in AROUND for path in files_of(package)}


@cache
def public_names(package: str) -> dict[str, str]:
    """Return the module of each name that a package or namespace imports when it is first used."""
    path = modules().get(package)
    if path is None or not path.with_suffix(".pyi").exists():
        return {}
    return {name: source for name, (source, _) in door_names(package).items()}


def all_public_modules(package: str) -> set[str]:
    """Return the modules of all public names of a package and of its namespaces."""
    sources = set(public_names(package).values())
    return sources.union(*(all_public_modules(source) for source in sources if public_names(source)))


def imported_modules(path: Path) -> set[str]:
    """Return our modules that a file imports anywhere in it; a public name of a package counts as its module."""
    found = set()
    for node in statements(tree_of(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: relative import"
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner in modules() else public_names(str(node.module)).get(alias.name, node.module))
    return {name for name in found if name.split(".")[0] in PACKAGES}


@cache
def graph() -> dict[str, set[str]]:
    """Return which modules of the packages each of them imports."""
    return {name: imported_modules(path) - {name} for name, path in modules().items()}


# which tests guard a module ------------------------------------------------------------------------------------------


def used_modules(path: Path) -> set[str]:
    """Return what a file imports, with tests and benchmarks, modules named in strings, and names such as `cms.reduce`.

    A package that is used as a whole, such as `getattr(cms, name)`, counts with all of its public names.
    """
    known = modules().keys() | test_modules().keys()
    nodes: dict[type, list] = {}
    for node in ast.walk(tree_of(path)):
        nodes.setdefault(type(node), []).append(node)
    found: set[str] = set()
    packages: dict[str, str] = {}  # name here -> package whose names are imported when they are first used

    def add(name: str, local: str) -> None:
        found.add(name)
        if public_names(name):
            packages[local] = name

    for node in nodes.get(ast.Import, ()):
        for alias in node.names:
            add(alias.name if alias.asname else alias.name.split(".")[0], alias.asname or alias.name.split(".")[0])
            found.add(alias.name)
    for node in nodes.get(ast.ImportFrom, ()):
        for alias in node.names:
            inner = f"{node.module}.{alias.name}"
            public = public_names(str(node.module)).get(alias.name, str(node.module))
            add(inner if inner in known else public, alias.asname or alias.name)
    for node in nodes.get(ast.Constant, ()):
        if isinstance(node.value, str):
            for words in NAMED.findall(node.value):
                parts = words.split(".")
                found |= {".".join(parts[:k]) for k in range(2, len(parts) + 1)}

    def package_at(node: ast.AST) -> str | None:
        """Return the package or namespace that an expression such as `ff.joints` stands for."""
        if isinstance(node, ast.Name):
            return packages.get(node.id)
        outer = package_at(node.value) if isinstance(node, ast.Attribute) else None
        inner = public_names(outer).get(node.attr, "") if outer and isinstance(node, ast.Attribute) else ""
        return inner if public_names(inner) else None

    by_name = set()
    for node in nodes.get(ast.Attribute, ()):
        if package := package_at(node.value):
            inner = f"{package}.{node.attr}"
            found.add(inner if inner in known else public_names(package).get(node.attr, package))
            by_name.add(node.value)
    for node in (*nodes.get(ast.Name, ()), *nodes.get(ast.Attribute, ())):
        if node not in by_name and (package := package_at(node)):
            found |= all_public_modules(package)
    return found & known


@cache
def all_uses() -> dict[str, set[str]]:
    """Return what each module of packages, tests and benchmarks uses, itself left out."""
    return {name: used_modules(path) - {name} for name, path in (modules() | test_modules()).items()}


def guards(names: Iterable[str]) -> dict[str, int]:
    """Return the files of tests that reach any of some modules, by the least number of imports between, nearest first.

    Parameters
    ----------
    names
        Of modules of the packages, tests or benchmarks; a file of tests guards itself.
    """
    users: dict[str, set[str]] = {}
    for name, used in all_uses().items():
        for other in used:
            users.setdefault(other, set()).add(name)
    steps = dict.fromkeys(names, 0)
    row, n = set(steps), 0
    while row:
        n += 1
        row = {user for name in row for user in users.get(name, ())} - steps.keys()
        steps.update(dict.fromkeys(row, n))
    files = {name: path for name, path in test_modules().items() if path.name.startswith("test_")}
    return {str(files[name].relative_to(ROOT)): n for name, n in sorted(steps.items(), key=by_steps) if name in files}


def by_steps(item: tuple[str, int]) -> tuple[int, str]:
    """Order by number of imports, then by name."""
    return item[1], item[0]


def named_modules(words: Iterable[str]) -> set[str]:
    """Return the modules that files, or names of modules, stand for.

    Data in a package stand for all modules of the nearest room above them, pages for the tests of pages, and what
    every test rests on (conftest.py, pyproject.toml) for all tests.
    """
    known = modules() | test_modules()
    found: set[str] = set()
    for word in words:
        path = (ROOT / word).resolve()
        name = module_name(path) if path.suffix in (".py", ".pyi") and path.is_relative_to(ROOT) else word
        if name in known:
            found.add(name)
        elif path.name in ("conftest.py", "pyproject.toml"):
            found |= {name for name in test_modules() if name.startswith("tests.")}
        elif path.suffix in (".md", ".rst", ".ipynb") or path.is_relative_to(ROOT / "docs"):
            found |= {name for name in test_modules() if name.startswith("tests.docs.")}
        elif path.is_relative_to(ROOT):
            room = next((folder for folder in path.parents if (folder / "__init__.py").exists()), None)
            found |= {name for name, file in known.items() if room is not None and file.parent == room}
    return found


def changed_files(base: str = "main") -> list[str]:
    """Return the files that differ from where this branch left a base, those not committed yet among them.

    Raises
    ------
    ValueError
        If there is no such base.
    """

    def git(*words: str) -> list[str]:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            raise ValueError(f"expected a branch or commit to compare with, got {base!r}: {done.stderr.strip()}")
        return done.stdout.splitlines()

    (start,) = git("merge-base", base, "HEAD")
    return sorted({*git("diff", "--name-only", start), *git("ls-files", "--others", "--exclude-standard")})
