"""Frozen data classes whose pickled and deep copies are frozen too.

NumPy makes writable copies of read-only arrays, and a mapping proxy cannot be pickled at all.
"""

from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp

__all__ = ["FrozenMapping", "frozen_copies"]

Class = TypeVar("Class", bound=type)
Key = TypeVar("Key")
Item = TypeVar("Item")


class FrozenMapping(dict[Key, Item]):
    """An immutable mapping whose copies are immutable too."""

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise TypeError("this mapping cannot be changed; make a dict of it")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return restored_mapping, (dict(self),)


def restored_mapping(items: dict[Any, Any]) -> "FrozenMapping[Any, Any]":
    """Return the mapping from its pickled items, with read-only arrays."""
    return FrozenMapping({key: read_only(value) for key, value in items.items()})


def frozen_copies(kind: Class) -> Class:
    """Decorate a frozen data class: copies hold only its fields, without cached values, and arrays are read-only."""

    def state(self: Any) -> dict[str, Any]:
        return {part.name: getattr(self, part.name) for part in fields(self)}

    def restore(self: Any, values: dict[str, Any]) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, read_only(value))

    kind.__getstate__ = state  # type: ignore[method-assign, assignment]
    kind.__setstate__ = restore  # type: ignore[attr-defined]
    return kind


def read_only(value: Any) -> Any:
    """Return the value with read-only arrays, also in tuples and sparse matrices."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, tuple):
        for each in value:
            read_only(each)
    elif sp.issparse(value):
        for name in ("data", "indices", "indptr"):
            read_only(getattr(value, name, None))
    return value
