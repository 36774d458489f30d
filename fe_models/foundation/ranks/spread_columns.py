"""Tall columns distributed by rows over all ranks: rank 0 stores its own rows, and a key for the rows of the others.

They implement the protocol `fe_models.foundation.tall.columns.Columns`.

The rows are distributed like those of the matrices of a body (`SpreadMatrix`), so products need no redistribution. All
ranks compute operations such as Xᵀ Y with their own rows at once, and rank 0 sums the small results.
"""

import operator
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.row_layout import RowLayout, new_key
from fe_models.foundation.ranks.rows import Rows, collected, own_rows, receive, send
from fe_models.foundation.ranks.trim import give_back

__all__ = [
    "Part", "SpreadColumns", "own_part", "rows_of", "spread_beside", "spread_columns", "spread_parts",
]  # fmt: skip

COLUMNS = 4  #: number of columns that pass through rank 0 at a time


class Part(NamedTuple):
    """Columns of which every rank keeps its rows under a key."""

    key: str
    first: int
    last: int


class SpreadColumns:
    """Distributed columns, (n, k), with their own order of rows; freed when the last reference is dropped.

    Rows are indexed in the order of the dofs. `X[:, a:b]` is a view of the same columns; `X[:, index]` is a copy;
    `X[rows]` is an array of rank 0, and so is `X.whole()`.
    """

    __array_ufunc__ = None  #: makes NumPy leave sums and products to this class
    ndim = 2

    def __init__(self, layout: RowLayout, part: Part, source: object = None) -> None:
        """Refer to columns that all ranks keep; source: the owner of the columns, if this is a view of its columns."""
        self.layout, self.part, self.source = layout, part, source
        self.shape = (layout.n, part.last - part.first)
        if source is None:
            layout.free_with(self, part.key)

    __iter__ = None  #: iteration over rows is not supported

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype: Any = None, copy: Any = None) -> Array:
        """Return `whole()`, for callers that only accept arrays."""
        return self.whole() if dtype is None else self.whole().astype(dtype)

    def __getitem__(self, index: Any) -> Any:
        """Return columns X[:, c], or rows X[r] and X[r, c] of indices r as an array of rank 0."""
        rows, columns = index if isinstance(index, tuple) else (index, slice(None))
        if np.isscalar(rows) or np.isscalar(columns):
            raise IndexError("SpreadColumns: expected X[:, columns] or X[rows], lists of them; take X[:, [k]] for one")
        X = self._columns(columns)
        if isinstance(rows, slice):
            if rows != slice(None):
                raise IndexError("SpreadColumns: expected X[:, columns] or X[index of rows]; take whole() for slices")
            return X
        index = np.asarray(rows)
        return rows_of(X, np.flatnonzero(index) if index.dtype == bool else index.astype(np.int64))

    def _columns(self, columns: Any) -> "SpreadColumns":
        if isinstance(columns, slice):
            first, last, step = columns.indices(self.shape[1])
            if step == 1:
                part = Part(self.part.key, self.part.first + first, self.part.first + max(first, last))
                return SpreadColumns(self.layout, part, self)
        index = np.arange(self.shape[1])[columns]
        return self.made(len(index), chosen, self, index)

    def __add__(self, other: "SpreadColumns") -> "SpreadColumns":
        if not isinstance(other, SpreadColumns):
            return NotImplemented
        return self.made(self.shape[1], operator.add, self, other)

    def __sub__(self, other: "SpreadColumns") -> "SpreadColumns":
        if not isinstance(other, SpreadColumns):
            return NotImplemented
        return self.made(self.shape[1], operator.sub, self, other)

    def __mul__(self, factors: Any) -> "SpreadColumns":
        """Return the columns times a number, or times one factor each, (k,)."""
        return self.made(self.shape[1], operator.mul, self, factors)

    __rmul__ = __mul__

    def __imul__(self, factors: Any) -> "SpreadColumns":
        """Multiply the columns by a number, or by one factor each, (k,), in place."""
        self.on_rows(scale, self, factors)
        return self

    def __truediv__(self, factors: Any) -> "SpreadColumns":
        """Return the columns divided by a number, or by one factor each, (k,)."""
        return self.made(self.shape[1], operator.truediv, self, factors)

    def on_rows(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(*arguments) on all ranks, each with its own rows of distributed columns; return the results."""
        return self.layout.ask(called_here, function, named(arguments))

    def made(self, k: int, function: Callable[..., Array], *arguments: Any) -> "SpreadColumns":
        """Return the columns, (n, k), whose rows function(*arguments) returns on each rank; see `on_rows`."""
        found = SpreadColumns(self.layout, Part(new_key(), 0, k))
        self.layout.ask(kept_here, found.part.key, function, named(arguments))
        return found

    def like(self, X: Any) -> "SpreadColumns":
        """Return columns X, (n, l), distributed by rows like these columns."""
        return spread_columns(self.layout, X)

    def beside(self, *blocks: Any) -> "SpreadColumns":
        """Return a copy of blocks of columns, side by side, distributed by rows like these columns."""
        return spread_beside(self.layout, *blocks)

    def parts(self, width: int = COLUMNS) -> Iterator[tuple[slice, Array]]:
        """Yield blocks of columns as arrays of rank 0, (n, width), with the slice of their columns."""
        for first in range(0, self.shape[1], width):
            some = slice(first, min(first + width, self.shape[1]))
            lying = self.layout.ask(collected_here, self.layout.rows, self[:, some].part)[0]
            x = np.empty(lying.shape)
            x[self.layout.order] = lying
            yield some, x

    def whole(self) -> Array:
        """Return all columns as an array of rank 0, (n, k)."""
        X = np.empty(self.shape)
        for some, x in self.parts():
            X[:, some] = x
        return X


def spread_columns(layout: RowLayout, X: Any) -> SpreadColumns:
    """Distribute columns of rank 0, (n, k), by rows; distributed columns are returned unchanged."""
    return X if isinstance(X, SpreadColumns) else spread_beside(layout, X)


def spread_beside(layout: RowLayout, *blocks: Any) -> SpreadColumns:
    """Return columns side by side, distributed, (n, k); the blocks may be on rank 0 or distributed."""
    return spread_parts(layout, sum(X.shape[1] for X in blocks), blocks)


def spread_parts(layout: RowLayout, k: int, blocks: Iterable[Any]) -> SpreadColumns:
    """Distribute k columns that arrive in consecutive blocks."""
    found = SpreadColumns(layout, Part(new_key(), 0, k))  # created first, so that a failing block frees them
    key = found.part.key
    layout.ask(room_here, key, layout.rows, k)
    at = 0
    for X in blocks:
        if isinstance(X, SpreadColumns):
            layout.ask(put_here, key, at, X.part)
        else:
            for first in range(0, X.shape[1], COLUMNS):
                layout.ranks.store["columns"] = X[:, first : first + COLUMNS][layout.order]
                layout.ask(given_here, key, layout.rows, at + first)
        at += X.shape[1]
    return found


def rows_of(X: SpreadColumns, index: IntArray) -> Array:
    """Return some rows of the columns, (len(index), k), on rank 0."""
    place = X.layout.position[index]
    result: Array = X.layout.ask(rows_here, X.part, place, X.layout.rows)[0]
    return result


def named(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the arguments with distributed columns replaced by their keys."""
    return tuple(each.part if isinstance(each, SpreadColumns) else each for each in arguments)


def own_part(ranks: Ranks, part: Part) -> Array:
    """Return this rank's rows of some columns, (n_own, k), a view."""
    kept: Array = ranks.store[part.key]
    return kept[:, part.first : part.last]


def owned(ranks: Ranks, arguments: tuple[Any, ...]) -> list[Any]:
    """Return the arguments with keys replaced by this rank's rows."""
    return [own_part(ranks, each) if isinstance(each, Part) else each for each in arguments]


def called_here(ranks: Ranks, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Call a function with this rank's rows."""
    return function(*owned(ranks, arguments))


def kept_here(ranks: Ranks, key: str, function: Callable[..., Array], arguments: tuple[Any, ...]) -> None:
    """Keep the rows that a function returns for this rank's rows."""
    ranks.store[key] = np.asfortranarray(function(*owned(ranks, arguments)))


def chosen(X: Array, columns: IntArray) -> Array:
    """Return some columns of this rank's rows."""
    return X[:, columns]


def scale(X: Array, factors: Any) -> None:
    """Multiply this rank's rows of columns by a number, or by one factor for each column."""
    X *= factors


def room_here(ranks: Ranks, key: str, rows: Rows, k: int) -> None:
    """Allocate this rank's rows of new columns."""
    give_back()
    ranks.store[key] = np.zeros((rows.count(ranks.rank), k), order="F")


def put_here(ranks: Ranks, key: str, first: int, X: Part) -> None:
    """Write this rank's rows of columns, starting at a column."""
    ranks.store[key][:, first : first + X.last - X.first] = own_part(ranks, X)


def given_here(ranks: Ranks, key: str, rows: Rows, first: int) -> None:
    """Write this rank's rows of columns that are on rank 0, starting at a column."""
    x = own_rows(ranks, rows, ranks.store.pop("columns", None))
    ranks.store[key][:, first : first + x.shape[1]] = x


def collected_here(ranks: Ranks, rows: Rows, X: Part) -> Array | None:
    """Return the columns on rank 0, in the order of distribution."""
    return collected(ranks, rows, own_part(ranks, X))


def rows_here(ranks: Ranks, X: Part, place: np.ndarray, rows: Rows) -> Array | None:
    """Return the rows at some positions on rank 0; each rank sends its own."""
    mine, k = own_part(ranks, X), X.last - X.first
    owner = np.searchsorted(rows.starts, place, side="right") - 1
    where = [np.flatnonzero(owner == rank) for rank in range(ranks.size)]
    found = mine[place[where[ranks.rank]] - rows.starts[ranks.rank]]
    if ranks.rank:
        send(ranks, found, 0)
        return None
    result = np.empty((len(place), k))
    result[where[0]] = found
    for other in range(1, ranks.size):
        result[where[other]] = receive(ranks, len(where[other]) * k, np.float64, other).reshape(-1, k)
    return result
