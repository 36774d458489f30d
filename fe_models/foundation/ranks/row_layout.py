"""Distribution of the rows of matrices and tall columns over the ranks, and requests to all of these ranks."""

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import Any

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows

__all__ = ["RowLayout", "asked", "new_key"]

numbers = count()


@dataclass(frozen=True, eq=False)
class RowLayout:
    """Assignment of rows to ranks: row order[k] is at position k, where positions run through all ranks in order."""

    ranks: Ranks
    order: IntArray  #: row at each position, (n,)
    rows: Rows  #: positions on each rank

    @property
    def n(self) -> int:
        """Number of all rows."""
        return self.rows.n

    @cached_property
    def position(self) -> np.ndarray:
        """Position of each row, (n,) int32."""
        position = np.empty(len(self.order), np.int32)
        position[self.order] = np.arange(len(self.order), dtype=np.int32)
        return position

    def is_like(self, other: "RowLayout") -> bool:
        """Return whether both layouts assign rows identically."""
        if self is other:
            return True
        return self.rows == other.rows and (self.order is other.order or np.array_equal(self.order, other.order))

    def ask(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(ranks, *arguments) on all ranks, after they have dropped data without references."""
        return asked(self.ranks, function, *arguments)

    def free_with(self, owner: object, key: str) -> None:
        """Drop the data of a key on all ranks, with the first request after the owner has been garbage-collected."""
        weakref.finalize(owner, self.ranks.unreferenced.append, key).atexit = False


def asked(ranks: Ranks, function: Callable[..., Any], *arguments: Any) -> list[Any]:
    """Call function(ranks, *arguments) on all ranks, after they have dropped data without references."""
    keys = ranks.unreferenced
    return ranks.everywhere(asked_here, [keys.pop() for _ in range(len(keys))], function, *arguments)


def new_key() -> str:
    """Return a key that no rank has used."""
    return f"rows {next(numbers)}"


def asked_here(ranks: Ranks, forgotten: list[str], function: Callable[..., Any], *arguments: Any) -> Any:
    """Drop data without references, then call the function."""
    for key in forgotten:
        ranks.store.pop(key, None)
    return function(ranks, *arguments)
