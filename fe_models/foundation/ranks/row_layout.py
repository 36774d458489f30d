"""Where rows of matrices and tall columns lie among the ranks, and how all of these are asked at once."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import Any

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows

__all__ = ["RowLayout", "asked", "dropped", "new_key"]

numbers = count()
dropped: list[str] = []  #: keys that nobody names any more; told with the next question


@dataclass(frozen=True, eq=False)
class RowLayout:
    """Which row of all lies where: the k-th as they lie on the ranks, one after another, is row order[k] of all."""

    ranks: Ranks
    order: IntArray  #: (n,)
    rows: Rows  #: which of the places each rank has

    @property
    def n(self) -> int:
        """Number of all rows."""
        return self.rows.n

    @cached_property
    def position(self) -> np.ndarray:
        """The place of each row, (n,) int32."""
        position = np.empty(len(self.order), np.int32)
        position[self.order] = np.arange(len(self.order), dtype=np.int32)
        return position

    def is_like(self, other: "RowLayout") -> bool:
        """Return whether rows of both lie alike."""
        if self is other:
            return True
        return self.rows == other.rows and (self.order is other.order or np.array_equal(self.order, other.order))

    def ask(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(ranks, *arguments) on all ranks, after they have forgotten what has no name."""
        return asked(self.ranks, function, *arguments)


def asked(ranks: Ranks, function: Callable[..., Any], *arguments: Any) -> list[Any]:
    """Call function(ranks, *arguments) on all ranks, after they have forgotten what has no name."""
    return ranks.everywhere(asked_here, [dropped.pop() for _ in range(len(dropped))], function, *arguments)


def new_key() -> str:
    """Return a key that no rank has used."""
    return f"rows {next(numbers)}"


def asked_here(ranks: Ranks, forgotten: list[str], function: Callable[..., Any], *arguments: Any) -> Any:
    """Forget what nobody names, then call the function."""
    for key in forgotten:
        ranks.store.pop(key, None)
    return function(ranks, *arguments)
