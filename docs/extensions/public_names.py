"""API pages of all public names: one page a namespace, made from the stubs of the packages and their namespaces."""

import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

from sphinx.application import Sphinx

from fe_models.door import names_of, namespaces

PACKAGES = {
    "fe_models": "what a finite element body is",
    "cms": "reduction, modal file, quality",
    "floatframe": "motion of systems of bodies",
}


def public_names(module: str) -> list[str]:
    """Return the public names of a namespace, without the namespaces below it."""
    names = [name for name in names_of(module) if not isinstance(thing(module, name), ModuleType)]
    return sorted(names, key=str.lower)


def thing(module: str, name: str) -> Any:
    """Return what a namespace offers under a name; a function without the check of its arguments."""
    found = getattr(importlib.import_module(module), name)
    return inspect.unwrap(found) if inspect.isfunction(found) else found


def names_from_below(module: str) -> dict[str, str]:
    """Return the public names that a namespace takes from a package below, with their namespace there."""
    below: dict[int, str] = {}
    for package in PACKAGES:
        if module.split(".")[0] == package:
            break
        for other in namespaces(package):
            below = {id(thing(other, name)): other for name in public_names(other)} | below
    return {name: below[id(found)] for name in public_names(module) if id(found := thing(module, name)) in below}


def write_pages(app: Sphinx) -> None:
    """Write api/index.rst, and one page for each package and each namespace, into the source folder."""
    folder = Path(app.srcdir) / "api"
    pages = {"index": index_page()}
    for package, words in PACKAGES.items():
        modules = list(namespaces(package))[1:]
        pages[package] = package_page(package, words, modules)
        pages |= {module: namespace_page(module) for module in modules}
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
        "All public names, by package and namespace; names that are not listed here may change.",
        "",
    ]
    return "\n".join([*lines, ".. toctree::", "   :maxdepth: 2", "", *(f"   {package}" for package in PACKAGES), ""])


def package_page(package: str, words: str, modules: list[str]) -> str:
    """Return the page of a package: its docstring, its namespaces, and the names at its top."""
    lines = [*heading(f"{package}: {words}", "="), f".. automodule:: {package}", "   :no-members:", ""]
    lines += [".. toctree::", "   :maxdepth: 1", "", *(f"   {name}" for name in modules), ""]
    return "\n".join([*lines, *entries(package)])


def namespace_page(module: str) -> str:
    """Return the page of a namespace."""
    return "\n".join([*heading(module, "="), first_line(module), "", *entries(module)])


def entries(owner: str) -> list[str]:
    """Return the table of names of a namespace and the entry of each; names from a package below are only linked."""
    shared = names_from_below(owner)
    names = [name for name in public_names(owner) if name not in shared]
    lines = [f".. currentmodule:: {owner}", ""]
    if shared:
        links = ", ".join(f":obj:`~{other}.{name}`" for name, other in sorted(shared.items()))
        lines += [f"Also available here, and described in their own package: {links}.", ""]
    if names:
        lines += [".. autosummary::", "   :nosignatures:", "", *(f"   {name}" for name in names), ""]
    for name in names:
        found = thing(owner, name)
        if inspect.isclass(found):
            lines += [f".. autoclass:: {name}", "   :members:", ""]
        elif callable(found):
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
