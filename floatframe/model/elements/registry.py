"""Elements by name: "wheels.magic-formula-tyre" is an entry in `ELEMENTS` of the package `wheels`.

A package of elements, of the project or of a user, defines in its `__init__`

    ELEMENTS = {"magic-formula-tyre": "wheels.magic_formula:MagicFormulaTyre"}

The package is imported when one of its names is used, and the module of an element when the element is used.
"""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import TypeGuard

from fe_models.door import Registry
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.elements.element import Element

__all__ = ["element_class", "known_elements"]

log = logging.getLogger(__name__)

#: packages of floatframe in which elements are searched first
OWN = ("floatframe.components", "floatframe.model")


def is_element(found: object) -> TypeGuard[type[Element]]:
    """Whether an object is a class of elements."""
    return isinstance(found, type) and issubclass(found, Element)


#: element classes of other packages by entry points, "PACKAGE.ELEMENT"
ELEMENT_TYPES: Registry[type[Element]] = Registry(
    "floatframe.elements", {}, ModelError, kind="a class that derives from Element", is_kind=is_element
)


def element_class(name: str, folder: Path | None = None) -> type[Element]:
    """Return the class of an element by the name of its type.

    Parameters
    ----------
    name
        "PACKAGE.ELEMENT"; the package is one of floatframe, or one on the Python path.
    folder
        Folder of the system file, in which modules are searched for last.

    Raises
    ------
    ModelError
        If there is no such package or element, or the package cannot be imported.
    """
    package, _, element = name.rpartition(".")
    if not package or not element:
        raise ModelError(f'type of element {quoted(name)}: expected "PACKAGE.ELEMENT", such as "wheels.linear-tyre"')
    if not any(is_module(f"{wing}.{package}") for wing in OWN) and name in ELEMENT_TYPES:
        return ELEMENT_TYPES[name]
    with searched(folder):
        module = package_named(name, package)
        known = getattr(module, "ELEMENTS", None)
        if not isinstance(known, dict):
            raise ModelError(f"type of element {quoted(name)}: package {module.__name__} names no elements: {EXPECTED}")
        if element not in known:
            raise ModelError(
                f"type of element {quoted(name)}: package {module.__name__} has no element {quoted(element)}"
                f"{nearest(element, list(known))}"
            )
        return class_at(name, str(known[element]), module.__name__)


def known_elements() -> dict[str, type[Element]]:
    """Return the element classes of floatframe and of installed packages by name; those that fail are left out."""
    names = [
        f"{package.name}.{element}"
        for wing in OWN
        for package in iter_modules(import_module(wing).__path__)
        for element in getattr(import_module(f"{wing}.{package.name}"), "ELEMENTS", {})
    ]
    found = {}
    for name in (*names, *ELEMENT_TYPES):
        try:
            found[name] = element_class(name)
        except ModelError as error:
            log.warning("%s", error)
    return found


EXPECTED = 'expected ELEMENTS = {"name": "module:Class"} in its __init__.py'


@contextmanager
def searched(folder: Path | None) -> Iterator[None]:
    """Append a folder to Python's module search path within a `with` block."""
    added = None if folder is None else str(folder.resolve())
    if added is None or added in sys.path:
        yield
        return
    sys.path.append(added)
    try:
        yield
    finally:
        sys.path.remove(added)


def is_module(name: str) -> bool:
    """Whether there is a module of a name on Python's path."""
    try:
        return find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def package_named(name: str, package: str) -> ModuleType:
    """Return the imported package of elements."""
    where = f"type of element {quoted(name)}"
    for each in (*(f"{wing}.{package}" for wing in OWN), package):
        if not is_module(each):
            continue
        try:
            return import_module(each)
        except Exception as error:
            raise ModelError(f"{where}: package {each} cannot be imported: {type(error).__name__}: {error}") from error
    raise ModelError(
        f"{where}: there is no package {quoted(package)}, neither in {OWN} nor on Python's path; install "
        "it, put it next to the system file, or name its folder in PYTHONPATH"
    )


def class_at(name: str, place: str, package: str) -> type[Element]:
    """Return the class that a text "module:Class" names."""
    where = f"type of element {quoted(name)}"
    module_name, _, class_name = place.partition(":")
    try:
        module = import_module(module_name)
    except Exception as error:
        raise ModelError(
            f"{where}: module {module_name} of package {package} cannot be imported: {type(error).__name__}: {error}"
        ) from error
    found = getattr(module, class_name, None)
    if not is_element(found):
        raise ModelError(
            f"{where}: {place}: expected a class that derives from floatframe.model.elements.Element, got {found!r}"
        )
    return found
