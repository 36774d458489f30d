"""Doors: packages and namespaces whose public names stand in a stub beside them (`.pyi`) and are loaded on first use.

`open_door(__name__, "floatframe.errors:ModelError")` in `__init__.py`, or in a module such as `joints.py`, does four
things:

(1) a name of the stub is imported from its module when it is first used;
(2) a function then checks its arguments against its annotations (`at_door`);
(3) `__all__` and `dir()` list the names of the stub;
(4) a name that another namespace of the same package offers is answered with that place.

Type checkers and editors read the same stub.

Another package adds to a `Registry` by entry points, without an edit here (docs/extending.md).
"""

import ast
import logging
import os
import sys
from collections import UserDict
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec, resolve_name
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["Door", "Registry", "door_names", "names_of", "namespaces", "open_door", "package_of", "places_of"]

log = logging.getLogger(__name__)

Entry = TypeVar("Entry")


def open_door(module: str, error: str | None = None) -> None:
    """Let a module load the names of its stub on first use.

    Parameters
    ----------
    module
        `__name__` of the module.
    error
        "module:class" of the error for an argument of another kind; None: functions do not check their arguments.
    """
    door = sys.modules[module]
    door.__class__ = Door
    # with a path, even an empty one, `from module import name` first asks `__getattr__`, which may say where a name is
    door.__dict__.setdefault("__path__", [])
    door.__dict__["argument_error"] = error


class Door(ModuleType):
    """A module that loads the names of its stub on first use."""

    argument_error: str | None

    def __getattr__(self, name: str) -> Any:
        here = self.__dict__["__name__"]
        if name.startswith("__") and name != "__all__":
            raise AttributeError(f"module {here!r} has no attribute {name!r}")
        sources = door_names(here)
        if name == "__all__":
            return sorted(sources)
        if name not in sources:
            raise self.unknown_name_error(name)
        source, attribute = sources[name]
        found = import_module(source) if attribute is None else getattr(import_module(source), attribute)
        if attribute is not None and self.argument_error is not None:
            from fe_models.foundation.records import at_door

            module, _, error = self.argument_error.partition(":")
            found = at_door(here, name, found, getattr(import_module(module), error))
        self.__dict__[name] = found
        return found

    def unknown_name_error(self, name: str) -> ImportError | AttributeError:
        """Return the error for a name that this module does not offer; it names the modules that offer it, if any."""
        here = self.__name__
        package = here.partition(".")[0]
        text = f"module {here!r} has no attribute {name!r}"
        folders = getattr(self, "__path__", [])
        if name.startswith("_") or any(has_module(folder, name) for folder in folders):
            return AttributeError(text)
        places = places_of(package).get(name, [])
        if not places:
            return AttributeError(text)
        text = f"{name} is in {' and '.join(places)}: {' or '.join(f'{place}.{name}' for place in places)}"
        # `from package import name` replaces the text of an AttributeError by its own
        is_imported = sys._getframe(2).f_globals.get("__name__") == "importlib._bootstrap"
        return ImportError(text, name=here) if is_imported else AttributeError(text)

    def __dir__(self) -> list[str]:
        return sorted(door_names(self.__name__))

    def __setattr__(self, name: str, value: Any) -> None:
        # the import of a module below binds it here; a public name that is spelt like its module stays
        is_below = isinstance(value, ModuleType) and value.__name__ == f"{self.__name__}.{name}"
        _, attribute = door_names(self.__name__).get(name, ("", None)) if is_below else ("", None)
        if attribute is None:
            super().__setattr__(name, value)


def has_module(folder: str, name: str) -> bool:
    """Whether a folder has a module or a package of a name."""
    return os.path.exists(os.path.join(folder, name)) or os.path.exists(os.path.join(folder, f"{name}.py"))


@cache
def door_names(module: str) -> dict[str, tuple[str, str | None]]:
    """Return the public names of a door, each with its module and its name there; None: the module itself."""
    path = file_of(module)
    package = module if os.path.basename(path) == "__init__.py" else module.rpartition(".")[0]
    names: dict[str, tuple[str, str | None]] = {}
    for node in tree_of(stub_of(path)).body:
        if not isinstance(node, ast.ImportFrom):
            continue
        source = resolve_name("." * node.level + (node.module or ""), package) if node.level else str(node.module)
        for alias in node.names:
            is_module = node.level > 0 and not node.module
            names[alias.asname or alias.name] = (f"{source}.{alias.name}", None) if is_module else (source, alias.name)
    return names


@cache
def places_of(package: str) -> dict[str, list[str]]:
    """Return the public names of a package and of its namespaces, each with the modules that offer it."""
    places: dict[str, list[str]] = {}
    for module in namespaces(package):
        for name in names_of(module):
            places.setdefault(name, []).append(module)
    return places


def namespaces(module: str) -> Iterator[str]:
    """Yield a module that offers public names, and the namespaces below it; those without a stub are not imported."""
    yield module
    if os.path.exists(stub_of(file_of(module))):
        for source, attribute in door_names(module).values():
            if attribute is None:
                yield from namespaces(source)


def names_of(module: str) -> list[str]:
    """Return the names that a namespace offers by its stub, or else by its `__all__`."""
    path = file_of(module)
    if os.path.exists(stub_of(path)):
        return list(door_names(module))
    for node in tree_of(path).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    return []


def file_of(module: str) -> str:
    """Return the file of a module, which is not imported."""
    spec = find_spec(module)
    return str(spec.origin if spec else None)


def stub_of(path: str) -> str:
    """Return the stub beside a file."""
    return f"{os.path.splitext(path)[0]}.pyi"


def tree_of(path: str) -> ast.Module:
    """Return the syntax tree of a file."""
    with open(path, encoding="utf-8") as file:
        return ast.parse(file.read())


class Registry(UserDict[str, Entry]):
    """Entries by name: those of this project, and entry points of installed packages, loaded when they are used.

    Parameters
    ----------
    group
        Group of the entry points, such as "cms.mode_sets".
    own
        Entries of this project; an entry point of the same name is left out, with a warning.
    error
        Raised if an entry point cannot be loaded or is of another kind; the message names its package.
    kind
        What an entry point names, for messages, such as "a function".
    is_kind
        Whether a loaded object is of this kind.
    prefix
        Put before the name of an entry point, such as "." for suffixes.
    made
        Makes the entry from its name, the loaded object and the name of its package; None: the object itself.
    """

    def __init__(
        self,
        group: str,
        own: Mapping[str, Entry],
        error: type[Exception],
        *,
        kind: str = "a function",
        is_kind: Callable[[Any], bool] = callable,
        prefix: str = "",
        made: Callable[[str, Any, str], Entry] | None = None,
    ) -> None:
        from importlib.metadata import entry_points  # slow, and a door is opened by every import of the packages

        super().__init__(own)
        self.group = group
        self.error = error
        self.kind = kind
        self.is_kind = is_kind
        self.made = made
        self.not_loaded: dict[str, EntryPoint] = {}
        for point in entry_points(group=group):
            name = f"{prefix}{point.name}"
            if name in self.data:
                other = package_of(self.not_loaded[name]) if name in self.not_loaded else "this project"
                log.warning("%s %r of %s: left out, %s has it", group, name, package_of(point), other)
            else:
                self.not_loaded[name] = point
                self.data[name] = point  # type: ignore[assignment]  # until it is used

    def __getitem__(self, name: str) -> Entry:
        if name in self.not_loaded:
            self.data[name] = self.loaded(name, self.not_loaded[name])
            del self.not_loaded[name]
        return self.data[name]

    def loaded(self, name: str, point: "EntryPoint") -> Entry:
        """Return the entry of an entry point."""
        where = f"{self.group} {name!r} of {package_of(point)}"
        try:
            found = point.load()
        except Exception as failure:
            raise self.error(
                f"{where}: {point.value} cannot be loaded: {type(failure).__name__}: {failure}; repair or remove the "
                "package"
            ) from failure
        if not self.is_kind(found):
            raise self.error(f"{where}: {point.value}: expected {self.kind}, got {found!r}")
        return found if self.made is None else self.made(name, found, package_of(point))


def package_of(point: "EntryPoint") -> str:
    """Return name and version of the package of an entry point."""
    return "a package without a name" if point.dist is None else f"package {point.dist.name} {point.dist.version}"
