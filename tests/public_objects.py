"""All public objects of a package: those at its top and in its namespaces."""

import importlib
from functools import cache
from types import ModuleType
from typing import Any

from fe_models.door import Door, door_names, namespaces

__all__ = ["public_objects"]


@cache
def public_objects(package: str) -> dict[str, Any]:
    """Return what a package and its namespaces offer whose doors check arguments, by "namespace.name"."""
    doors = [each for module in namespaces(package) if isinstance(each := importlib.import_module(module), Door)]
    found = {
        f"{door.__name__}.{name}": getattr(door, name)
        for door in doors
        if door.argument_error
        for name in door_names(door.__name__)
    }
    return {name: each for name, each in found.items() if not isinstance(each, ModuleType)}
