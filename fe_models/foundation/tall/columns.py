"""Tall columns, (n, k) with n much larger than k: the protocol `Columns`, and operations on columns of any kind.

Arrays of this process, in memory or on disk (`fe_models.foundation.tall.on_disk`), are processed in slices of rows in
threads. NumPy's own BLAS threads poll for their next task and thereby block processors for the sparse solver; our
threads sleep. Slices are summed in order, so results are bitwise reproducible.

Columns of every other kind implement `Columns`, such as those that are distributed over ranks (`SpreadColumns`). The
same functions then run in the processes that store the rows: arrays used together with such columns are sent there, and
results stay there. Callers therefore need not know where columns are stored.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.on_disk import is_on_disk, row_slices, zeros_like
from fe_models.foundation.threads import n_threads

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

__all__ = [
    "Columns", "are_finite", "beside", "combine", "combine_in_place", "combined", "copied", "dots", "elsewhere", "gram",
    "in_memory", "inner", "of_this_process", "ordered", "put", "rows_times", "subtract",
]  # fmt: skip

SMALL = 20_000  #: number of rows below which threads cost more than they save
SLICE = 8192  #: number of rows at a time; intermediate results stay in the cache


class Columns(Protocol):
    """Columns, (n, k), whose rows are not an array of this process.

    `X[:, a:b]` and `X[:, index]` are columns of the same kind; `X[rows]` is an array. Sums, differences and products
    with factors, one for each column, are columns of the same kind.
    """

    shape: tuple[int, int]

    def __getitem__(self, index: Any) -> Any: ...
    def __add__(self, other: Any) -> Any: ...
    def __sub__(self, other: Any) -> Any: ...
    def __mul__(self, factors: Any) -> Any: ...
    def __imul__(self, factors: Any) -> Any: ...
    def __truediv__(self, factors: Any) -> Any: ...

    def on_rows(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(*arguments) for each part of the rows; `Columns` among the arguments become these rows."""

    def made(self, k: int, function: Callable[..., Array], *arguments: Any) -> "Columns":
        """Return the columns, (n, k), whose rows function(*arguments) returns for each part; see `on_rows`."""

    def like(self, X: Any) -> "Columns":
        """Return columns X, (n, l), with rows in the same place as these columns."""

    def beside(self, *blocks: Any) -> "Columns":
        """Return a copy of blocks of columns, side by side, with rows in the same place as these columns."""

    def parts(self) -> Iterator[tuple[slice, Array]]:
        """Yield blocks of a few columns as arrays of this process, (n, width), with the slice of their columns."""

    def whole(self) -> Array:
        """Return all columns as an array of this process, (n, k)."""


def elsewhere(*columns: Any) -> Columns | None:
    """Return the first of some columns that is not an array of this process; None if all are arrays."""
    return next((X for X in columns if not isinstance(X, np.ndarray)), None)


# products -------------------------------------------------------------------------------------------------------------


def inner(X: Any, Y: Any) -> Array:
    """Return Xᵀ Y, (k, l)."""
    if (far := elsewhere(X, Y)) is not None:
        return np.asarray(sum(far.on_rows(inner, far.like(X), far.like(Y))))
    return np.sum(_by_rows(lambda some: X[some].T @ Y[some], X, Y, is_sum=True), axis=0)


def gram(X: Any, AX: Any) -> Array:
    """Return Xᵀ A X for symmetric A, as the mean of the computed product and its transpose."""
    G = inner(X, AX)
    return (G + G.T) / 2


def dots(X: Any, Y: Any, d: Array | None = None) -> Array:
    """Return Σ_n X_nk Y_nk for each column, (k,); with weights d, (n,) or (n, 1): Σ_n d_n X_nk Y_nk."""
    if (far := elsewhere(X, Y)) is not None:
        there = [far.like(X), far.like(Y), *([] if d is None else [far.like(d.reshape(-1, 1))])]
        return np.asarray(sum(far.on_rows(dots, *there)))
    total = np.zeros(X.shape[1])
    for some in row_slices(len(X), X, Y):
        if d is None:
            total += np.einsum("nk,nk->k", X[some], Y[some])
        else:
            total += np.einsum("n,nk,nk->k", d.ravel()[some], X[some], Y[some])
    return total


def rows_times(S: Any, X: Any) -> Array:
    """Return S X, (m, k), for a sparse matrix S, (m, n), that reads few rows of X."""
    if elsewhere(X) is None:
        return np.asarray(S @ X)
    S = sp.csr_array(S)
    read = np.unique(S.indices).astype(np.int64)
    return np.asarray(S[:, read] @ X[read])


def combine(X: Any, C: Array, *, order: Literal["C", "F"] | None = None) -> Any:
    """Return X C, (n, l), in the memory order of X or the given one."""
    if (far := elsewhere(X)) is not None:
        return far.made(C.shape[1], combine, X, C)
    order = order or _order(X)
    shape = (len(X), C.shape[1])
    if order == "C":
        result = zeros_like(X, shape)
        _by_rows(lambda some: np.matmul(X[some], C, out=result[some]), X, result)
    else:
        result = np.empty(shape, order=order)
        _by_rows(lambda some: np.matmul(C.T, X[some].T, out=result[some].T), X, result)
    return result


def combine_in_place(X: Any, C: Array) -> None:
    """Replace the first m columns of X, (n, k), by X C, (n, m)."""
    if (far := elsewhere(X)) is not None:
        far.on_rows(combine_in_place, X, C)
        return
    _by_rows(lambda some: np.copyto(X[some, : C.shape[1]], X[some] @ C), X, height=SLICE)


def combined(X: Any, C: Array) -> Any:
    """Return X C, (n, m), in the memory of X, (n, k), which is overwritten; a new array if m is much smaller than k."""
    k, m = C.shape
    if elsewhere(X) is not None or not m or not k // 2 <= m <= k:
        return combine(X, C)
    combine_in_place(X, C)
    if m == k or not X.flags.c_contiguous:
        return X[:, :m]
    whole = X.reshape(-1)  # rows are packed, so that the result is contiguous, as sparse products need it
    for part in row_slices(len(X), X, height=SLICE):
        whole[part.start * m : part.stop * m] = X[part, :m].ravel()
    return whole[: len(X) * m].reshape(-1, m)


def subtract(Y: Any, X: Any, C: Array) -> None:
    """Subtract X C from Y, (n, l), in place."""
    if (far := elsewhere(Y)) is not None:
        far.on_rows(subtract, Y, far.like(X), C)
    elif _order(Y) == "C":
        _by_rows(lambda some: np.subtract(Y[some], X[some] @ C, out=Y[some]), X, Y, height=SLICE)
    else:
        _by_rows(lambda some: np.subtract(Y.T[:, some], C.T @ X.T[:, some], out=Y.T[:, some]), X, Y, height=SLICE)


# places of columns ----------------------------------------------------------------------------------------------------


def beside(*blocks: Any) -> Any:
    """Return a copy of blocks of columns with equally many rows, side by side.

    The result is on disk if one block is on disk and the result is large. If a block is of another kind of `Columns`,
    so is the result.
    """
    if (far := elsewhere(*blocks)) is not None:
        return far.beside(*blocks)
    width = sum(X.shape[1] for X in blocks)
    stored = next((X for X in blocks if is_on_disk(X)), blocks[0])
    result = zeros_like(stored, (len(stored), width))
    for rows in row_slices(len(stored), *blocks, result):
        np.concatenate([X[rows] for X in blocks], axis=1, out=result[rows])
    return result


def copied(X: Any) -> Any:
    """Return a copy in the same kind of storage: memory, disk or ranks."""
    return beside(X)


def of_this_process(X: Any) -> Array:
    """Return the array itself, in memory or on disk, or other columns as an array in memory."""
    return X if (far := elsewhere(X)) is None else far.whole()


def in_memory(X: Any) -> Array:
    """Return the array itself, or columns from anywhere else as an array in memory, in C order."""
    X = of_this_process(X)
    if not is_on_disk(X):
        return X
    result = np.empty(X.shape)
    for rows in row_slices(len(X), X):
        result[rows] = X[rows]
    return result


def are_finite(X: Any) -> bool:
    """Return whether all entries are finite."""
    if (far := elsewhere(X)) is not None:
        return all(far.on_rows(are_finite, X))
    return all(np.isfinite(X[rows]).all() for rows in row_slices(len(X), X))


# memory order of arrays, and threads ----------------------------------------------------------------------------------


def ordered(X: Array, order: Literal["C", "F"]) -> Array:
    """Return X, (n, k), in C or Fortran order; NumPy's own copy of a tall array misses the cache at every entry."""
    if _order(X) == order:
        return X
    result = np.empty(X.shape, order=order)
    put(X, result)
    return result


def put(X: Any, target: Any) -> None:
    """Copy X, (n, k), into columns of the same shape, in any memory order."""
    if (far := elsewhere(target)) is not None:
        far.on_rows(put, far.like(X), target)
        return
    _by_rows(lambda some: np.copyto(target[some], X[some]), X, height=SLICE)


def _order(X: Array) -> Literal["C", "F"]:
    """Return the memory order of X, also if X is a part of the rows or columns of an array."""
    return "C" if X.strides[1] <= X.strides[0] else "F"


def _by_rows(
    work: Callable[[slice], Any], *arrays: Array, height: int | None = None, is_sum: bool = False
) -> list[Any]:
    """Call work(rows) for slices of the rows of arrays, each thread with its own share of the rows.

    Parameters
    ----------
    work
        Receives slices of rows.
    arrays
        Arrays with equally many rows; those on disk determine the height of the slices.
    height
        Number of rows of a slice if no array is on disk; None: the whole share of a thread.
    is_sum
        Whether the results are summed. The sums, one for each thread, are returned.
    """

    def run(rows: slice) -> Any:
        total = None
        for some in row_slices(rows, *arrays, height=height):
            part = work(some)
            if is_sum:
                total = part if total is None else total + part
        return total

    n = len(arrays[0])
    n_parts = n_threads() if n > SMALL else 1
    if n_parts == 1:
        return [run(slice(0, n))]
    bounds = np.linspace(0, n, n_parts + 1).astype(int)
    with _numpy_blas().limit(limits=1):
        return list(_pool().map(run, [slice(a, b) for a, b in pairwise(bounds)]))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(n_threads())


@cache
def _numpy_blas() -> "ThreadpoolController":
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(internal_api="openblas")
