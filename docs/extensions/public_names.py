"""API pages of all public names: one page a room of a package, made from the stubs (`__init__.pyi`) of the packages."""

import ast
import importlib
import inspect
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "fe_models": "what a finite element body is",
    "cms": "reduction, modal file, quality",
    "floatframe": "motion of systems of bodies",
}


def public_names(package: str) -> dict[str, str]:
    """Return the public names of a package and the room of each, "" for the package itself."""
    tree = ast.parse((ROOT / package / "__init__.pyi").read_text(encoding="utf-8"))
    rooms = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module:
            room = node.module
            while room and not (ROOT / package / room.replace(".", "/")).is_dir():
                room = room.rpartition(".")[0]
            rooms |= {alias.asname or alias.name: room for alias in node.names}
    return rooms


def names_from_below(package: str) -> dict[str, str]:
    """Return the public names that a package imports from another package, with that package."""
    below: dict[int, str] = {}
    for other in PACKAGES:
        module = importlib.import_module(other)
        if other == package:
            return {
                name: below[id(thing)] for name in public_names(package) if id(thing := getattr(module, name)) in below
            }
        below |= {id(getattr(module, name)): other for name in public_names(other)}
    return {}


def further_modules(package: str) -> list[str]:
    """Return the rooms whose `__all__` is public by module path, in addition to the names of the package."""
    return [name for name in FURTHER if name.split(".")[0] == package]


#: used by module path, with their own `__all__`
FURTHER = (
    "fe_models.parts", "floatframe.components.drives", "floatframe.components.hydraulics",
    "floatframe.components.mechanisms",
)  # fmt: skip


def write_pages(app: Sphinx) -> None:
    """Write api/index.rst, and one page for each package and each room, into the source folder."""
    folder = Path(app.srcdir) / "api"
    pages = {"index": index_page()}
    for package, words in PACKAGES.items():
        rooms: dict[str, list[str]] = {}
        shared = names_from_below(package)
        for name, room in public_names(package).items():
            if name not in shared:
                rooms.setdefault(room, []).append(name)
        files = []
        for room in sorted(rooms):
            page = f"{package}.{room}" if room else f"{package}.top"
            files.append(page)
            pages[page] = room_page(package, room, sorted(rooms[room], key=str.lower))
        for module in further_modules(package):
            files.append(module)
            pages[module] = module_page(module)
        pages[package] = package_page(package, words, files, shared)
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.rst"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def index_page() -> str:
    """Return the page that links to the packages."""
    lines = [
        *heading("Names", "="),
        "All public names, by package and room; names that are not listed here may change.",
        "",
    ]
    return "\n".join([*lines, ".. toctree::", "   :maxdepth: 2", "", *(f"   {package}" for package in PACKAGES), ""])


def package_page(package: str, words: str, files: list[str], shared: dict[str, str]) -> str:
    """Return the page of a package: its docstring, its rooms, and the names that it imports from another package."""
    lines = [*heading(f"{package}: {words}", "="), f".. automodule:: {package}", "   :no-members:", ""]
    if shared:
        names = ", ".join(f":obj:`~{other}.{name}`" for name, other in sorted(shared.items()))
        lines += [f"Also available here, and described in their own package: {names}.", ""]
    return "\n".join([*lines, ".. toctree::", "   :maxdepth: 1", "", *(f"   {name}" for name in files), ""])


def room_page(package: str, room: str, names: list[str]) -> str:
    """Return the page of a room: a table of its public names, followed by the entry of each."""
    title = f"{package}.{room}" if room else f"{package}, top level"
    about = first_line(f"{package}.{room}" if room else package)
    return "\n".join([*heading(title, "="), about, "", *entries(package, names)])


def module_page(module: str) -> str:
    """Return the page of a module with its own `__all__`, without the public names of its package."""
    package = module.split(".")[0]
    names = sorted(set(importlib.import_module(module).__all__) - set(public_names(package)), key=str.lower)
    return "\n".join([*heading(module, "="), first_line(module), "", *entries(module, names)])


def entries(owner: str, names: list[str]) -> list[str]:
    """Return the table of names of a module and the entry of each."""
    module = importlib.import_module(owner)
    lines = [f".. currentmodule:: {owner}", "", ".. autosummary::", "   :nosignatures:", ""]
    lines += [f"   {name}" for name in names] + [""]
    for name in names:
        thing = getattr(module, name)
        if inspect.isclass(thing):
            lines += [f".. autoclass:: {name}", "   :members:", ""]
        elif callable(thing):
            lines += [f".. autofunction:: {name}", ""]
        else:
            lines += [f".. autodata:: {name}", "   :no-value:", ""]
    return lines


def first_line(module: str) -> str:
    """Return the first line of a module's docstring, including references to pages and sections."""
    line = (importlib.import_module(module).__doc__ or "").strip().split("\n")[0]
    return re.sub(r"(?:docs/)?(\w+)\.md", r":doc:`\1 </\1>`", line)


def heading(text: str, mark: str) -> list[str]:
    """Return an underlined heading."""
    return [text, mark * len(text), ""]


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for its sources."""
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
