"""Registries that other packages extend by entry points, without an edit here (docs/extending.md)."""

import logging
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

__all__ = ["Registry"]

log = logging.getLogger(__name__)

Entry = TypeVar("Entry")


class Registry(MutableMapping[str, Entry]):
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
        Makes the entry from the loaded object and the name of its package; None: the object itself.
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
        made: Callable[[Any, str], Entry] | None = None,
    ) -> None:
        self.group = group
        self.known = dict(own)
        self.error = error
        self.kind = kind
        self.is_kind = is_kind
        self.prefix = prefix
        self.made = made

    @cached_property
    def points(self) -> dict[str, EntryPoint]:
        """Entry points by name that are not loaded yet."""
        found: dict[str, EntryPoint] = {}
        for point in entry_points(group=self.group):
            name = f"{self.prefix}{point.name}"
            if name in self.known or name in found:
                other = package_of(found[name]) if name in found else "this project"
                log.warning("%s %r of %s: left out, %s has it", self.group, name, package_of(point), other)
            else:
                found[name] = point
        return found

    def __getitem__(self, name: str) -> Entry:
        if name not in self.known and name in self.points:
            self.known[name] = self.loaded(name, self.points[name])
            del self.points[name]
        return self.known[name]

    def loaded(self, name: str, point: EntryPoint) -> Entry:
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
        return found if self.made is None else self.made(found, package_of(point))

    def __setitem__(self, name: str, entry: Entry) -> None:
        self.known[name] = entry

    def __delitem__(self, name: str) -> None:
        del self.known[name]

    def __iter__(self) -> Iterator[str]:
        return iter([*self.known, *self.points])

    def __len__(self) -> int:
        return len(self.known) + len(self.points)

    def __contains__(self, name: object) -> bool:
        return name in self.known or name in self.points


def package_of(point: EntryPoint) -> str:
    """Return name and version of the package of an entry point."""
    return "a package without a name" if point.dist is None else f"package {point.dist.name} {point.dist.version}"
