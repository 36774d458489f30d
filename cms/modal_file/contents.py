"""Datasets and attributes of a file that was read, asked for by path."""

from typing import Any

import numpy as np

from cms.errors import ModalFileError
from fe_models.foundation.arrays import require_shape
from fe_models.foundation.sealed_hdf5 import Content

__all__ = ["Contents"]


class Contents:
    """Datasets and attributes of a file by path, with words for what is missing or of another kind."""

    def __init__(self, content: Content) -> None:
        self.content = content

    def array(self, path: str) -> np.ndarray:
        """Return the numbers of a dataset."""
        values = self._values(path)
        if isinstance(values, tuple):
            raise ModalFileError(f"dataset {path}: expected numbers, got text")
        return values

    def number(self, path: str) -> float:
        """Return the one number of a dataset."""
        values = self.array(path)
        require_shape(f"dataset {path}", values, ())
        return float(values)

    def arrays(self, group: str, *names: str) -> dict[str, Any]:
        """Return the numbers of datasets of a group by name."""
        return {name: self.array(f"{group}/{name}") for name in names}

    def words(self, path: str) -> tuple[str, ...]:
        """Return the strings of a dataset."""
        values = self._values(path)
        if not isinstance(values, tuple):
            raise ModalFileError(f"dataset {path}: expected text, got numbers")
        return values

    def attribute(self, path: str, name: str, kind: type) -> Any:
        """Return an attribute of that kind."""
        value = self.content.attributes.get(path, {}).get(name)
        if not isinstance(value, kind):
            got = "nothing" if value is None else repr(value)
            raise ModalFileError(f"attribute {name!r} of {path}: expected {kind.__name__}, got {got}")
        return value

    def numbered(self, group: str) -> tuple[str, ...]:
        """Return the paths of the groups that a group counts; none if it is not there."""
        if group not in self.content.attributes:
            return ()
        count = self.attribute(group, "count", int)
        held = sum(path.startswith(f"{group}/") for path in self.content.attributes)
        if count != held:  # before as many paths are made
            raise ModalFileError(f"attribute 'count' of {group}: expected {held}, as many as it holds, got {count:g}")
        return tuple(f"{group}/{k}" for k in range(count))

    def has(self, group: str, name: str | None = None) -> bool:
        """Whether an optional group is there, and says so by its attribute where it has one."""
        there = group in self.content.attributes
        return there and (name is None or bool(self.attribute(group, name, int)))

    def _values(self, path: str) -> Any:
        if path not in self.content.datasets:
            raise ModalFileError(f"dataset {path} is missing; the file was not written by a complete writer")
        return self.content.datasets[path].values
