"""Products of tall arrays, (n, k) with n much larger than k, in slices of rows in threads.

NumPy's own BLAS threads poll for their next task and thereby block processors for the sparse solver; our threads sleep.
Slices are summed in order, so results are bitwise reproducible. Arrays on disk (`fe_models.foundation.tall.on_disk`)
are processed in smaller slices. Distributed columns (`SpreadColumns`) are processed on their ranks; arrays used
together with them are sent there, and results stay distributed.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.spread_columns import SpreadColumns, on_rows, spread_columns, spread_with
from fe_models.foundation.tall.on_disk import row_slices, zeros_like
from fe_models.foundation.threads import n_threads

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

__all__ = ["combine", "combined", "dots", "inner", "ordered", "put", "rows_times", "squares", "subtract"]

SMALL = 20_000  #: rows below which threads cost more than they save
SLICE = 8192  #: number of rows at a time; intermediate results stay in the cache


def inner(X: Any, Y: Any) -> Array:
    """Return Xᵀ Y, (k, l)."""
    if (found := next((each for each in (X, Y) if isinstance(each, SpreadColumns)), None)) is not None:
        layout = found.layout
        return _sum(iter(on_rows(layout, inner, spread_columns(layout, X), spread_columns(layout, Y))))

    def multiply(rows: slice) -> Array:
        return _sum(X[some].T @ Y[some] for some in row_slices(rows, X, Y))

    return np.sum(_by_rows(len(X), multiply), axis=0)


def dots(X: Any, Y: Any) -> Array:
    """Return Σ_n X_nk Y_nk for every column, (k,)."""
    if isinstance(X, SpreadColumns):
        return _sum(iter(on_rows(X.layout, dots, X, Y)))
    return np.asarray(np.einsum("nk,nk->k", X, Y))


def rows_times(S: Any, X: Any) -> Array:
    """Return S X, (m, k), for a sparse matrix S, (m, n), that reads few rows of X."""
    if not isinstance(X, SpreadColumns):
        return np.asarray(S @ X)
    S = sp.csr_array(S)
    read = np.unique(S.indices).astype(np.int64)
    return np.asarray(S[:, read] @ X[read])


def squares(d: Array, X: Any) -> Array:
    """Return Σ_n d_n X_nk² for every column, (k,)."""
    if isinstance(X, SpreadColumns):
        return _sum(iter(on_rows(X.layout, _weighted_squares, spread_columns(X.layout, d[:, None]), X)))
    return _sum(np.einsum("n,nk,nk->k", d[some], X[some], X[some]) for some in row_slices(len(X), X))


def _weighted_squares(d: Array, X: Array) -> Array:
    return squares(d[:, 0], X)


def combine(X: Any, C: Array, *, order: Literal["C", "F"] | None = None) -> Any:
    """Return X C, (n, l), in the memory order of X or the given one."""
    if isinstance(X, SpreadColumns):
        return spread_with(X.layout, C.shape[1], combine, X, C)
    order = order or _order(X)
    shape = (len(X), C.shape[1])
    result = zeros_like(X, shape) if order == "C" else np.empty(shape, order=order)

    def multiply(rows: slice) -> None:
        for some in row_slices(rows, X, result):
            if order == "C":
                np.matmul(X[some], C, out=result[some])
            else:
                np.matmul(C.T, X[some].T, out=result[some].T)

    _by_rows(len(X), multiply)
    return result


def combined(X: Any, C: Array) -> Any:
    """Return X C, (n, m), in the memory of X, (n, k), which is overwritten; a new array if m is much smaller than k."""
    k, m = C.shape
    if isinstance(X, SpreadColumns) or not m or not k // 2 <= m <= k:
        return combine(X, C)

    def update(rows: slice) -> None:
        for part in row_slices(rows, X, height=SLICE):
            X[part, :m] = X[part] @ C

    _by_rows(len(X), update)
    if m == k or not X.flags.c_contiguous:
        return X[:, :m]
    whole = X.reshape(-1)  # rows are packed, so that the result is contiguous, as sparse products need it
    for part in row_slices(len(X), X, height=SLICE):
        whole[part.start * m : part.stop * m] = X[part, :m].ravel()
    return whole[: len(X) * m].reshape(-1, m)


def subtract(Y: Any, X: Any, C: Array) -> None:
    """Subtract X C from Y, (n, l), in place."""
    if isinstance(Y, SpreadColumns):
        on_rows(Y.layout, subtract, Y, spread_columns(Y.layout, X), C)
        return
    order = _order(Y)

    def update(rows: slice) -> None:
        for part in row_slices(rows, X, Y, height=SLICE):
            if order == "C":
                Y[part] -= X[part] @ C
            else:
                Y.T[:, part] -= C.T @ X.T[:, part]

    _by_rows(len(X), update)


def ordered(X: Array, order: Literal["C", "F"]) -> Array:
    """Return X, (n, k), in C or Fortran order; NumPy's own copy of a tall array misses the cache at every entry."""
    if _order(X) == order:
        return X
    result = np.empty(X.shape, order=order)
    put(X, result)
    return result


def put(X: Array, target: Array) -> None:
    """Copy X, (n, k), into an array of the same shape, in any memory order."""

    def copy(rows: slice) -> None:
        for part in row_slices(rows, X, height=SLICE):
            target[part] = X[part]

    _by_rows(len(X), copy)


def _order(X: Array) -> Literal["C", "F"]:
    """Return the memory order of X, also if X is a part of the rows or columns of an array."""
    return "C" if X.strides[1] <= X.strides[0] else "F"


def _sum(parts: Iterator[Array]) -> Array:
    """Return the sum of parts, which are not all held in memory."""
    total = next(parts)
    for part in parts:
        total += part
    return total


def _by_rows(n: int, work: Callable[[slice], Array | None]) -> list:
    n_parts = n_threads() if n > SMALL else 1
    if n_parts == 1:
        return [work(slice(0, n))]
    bounds = np.linspace(0, n, n_parts + 1).astype(int)
    with _numpy_blas().limit(limits=1):
        return list(_pool().map(work, [slice(a, b) for a, b in pairwise(bounds)]))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(n_threads())


@cache
def _numpy_blas() -> "ThreadpoolController":
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(internal_api="openblas")
