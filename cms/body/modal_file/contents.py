"""Content of a file: datasets and attributes by path, with checked access for a reader."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cms.errors import ModalFileError
from fe_models.foundation.hdf5_file import Attribute

__all__ = ["Attribute", "Content", "Contents", "Dataset"]


@dataclass(frozen=True, eq=False)
class Dataset:
    """An array with its unit and description in the file."""

    values: Any  #: float64 or int64 array, or a tuple of strings
    unit: str = "1"
    description: str = ""


@dataclass(frozen=True, eq=False)
class Content:
    """Content of a file: datasets by path, and attributes by name for each group path."""

    format: str
    version: int
    datasets: Mapping[str, Dataset]
    attributes: Mapping[str, Mapping[str, Attribute]] = field(default_factory=dict)


class Contents:
    """Datasets and attributes of a file by path; missing ones and wrong types raise errors that name the path."""

    def __init__(self, content: Content) -> None:
        self.content = content

    def value(self, path: str) -> Any:
        """Return the values of a dataset: an array, one number, or a tuple of strings."""
        if path not in self.content.datasets:
            raise ModalFileError(f"dataset {path} is missing; the file was not written by a complete writer")
        values = self.content.datasets[path].values
        return values if isinstance(values, tuple) or np.ndim(values) else float(values)

    def attribute(self, path: str, name: str, kind: type) -> Any:
        """Return an attribute after checking its type."""
        value = self.content.attributes.get(path, {}).get(name)
        if not isinstance(value, kind):
            got = "nothing" if value is None else repr(value)
            raise ModalFileError(f"attribute {name!r} of {path}: expected {kind.__name__}, got {got}")
        return value

    def numbered(self, group: str) -> tuple[str, ...]:
        """Return the paths of the numbered groups inside a group; none if the group does not exist."""
        if group not in self.content.attributes:
            return ()
        count = self.attribute(group, "count", int)
        held = sum(path.startswith(f"{group}/") for path in self.content.attributes)
        if count != held:  # checked before this many paths are created
            raise ModalFileError(
                f"attribute 'count' of {group}: expected {held}, the number of its groups, got {count:g}"
            )
        return tuple(f"{group}/{k}" for k in range(count))

    def has(self, group: str, name: str | None = None) -> bool:
        """Return whether an optional group exists and, if it has this attribute, is marked as present."""
        there = group in self.content.attributes
        return there and (name is None or bool(self.attribute(group, name, int)))
