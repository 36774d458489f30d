"""Products of tall arrays, (n, k) with n much larger than k, by slices of rows in threads.

NumPy's own BLAS threads wait for their next task on the processor, which the sparse solver working in turns with them
then lacks; ours sleep. The slices are summed in their order, so that results repeat bit for bit.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.threads import n_threads

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

__all__ = ["combine", "combined", "inner", "ordered", "subtract"]

SMALL = 20_000  #: rows below which threads cost more than they bring
SLICE = 8192  #: rows at a time; what is made of them on the way stays in the cache


def inner(X: Array, Y: Array) -> Array:
    """Return Xᵀ Y, (k, l)."""
    parts = _by_rows(len(X), lambda rows: X[rows].T @ Y[rows])
    return np.sum(parts, axis=0)


def combine(X: Array, C: Array, *, order: Literal["C", "F"] | None = None) -> Array:
    """Return X C, (n, l), in the order of X or the one given."""
    order = order or _order(X)
    result = np.empty((len(X), C.shape[1]), order=order)

    def multiply(rows: slice) -> None:
        if order == "C":
            np.matmul(X[rows], C, out=result[rows])
        else:
            np.matmul(C.T, X[rows].T, out=result[rows].T)

    _by_rows(len(X), multiply)
    return result


def combined(X: Array, C: Array) -> Array:
    """Return X C, (n, m), in the place of X, (n, k), which is lost; an array of its own where m is much less than k."""
    k, m = C.shape
    if not k // 2 <= m <= k:
        return combine(X, C)

    def update(rows: slice) -> None:
        for first in range(rows.start, rows.stop, SLICE):
            part = slice(first, min(first + SLICE, rows.stop))
            X[part, :m] = X[part] @ C

    _by_rows(len(X), update)
    if m == k or not X.flags.c_contiguous:
        return X[:, :m]
    whole = X.reshape(-1)  # rows close up, so that what is left lies in one piece, as sparse products want it
    for first in range(0, len(X), SLICE):
        last = min(first + SLICE, len(X))
        whole[first * m : last * m] = X[first:last, :m].ravel()
    return whole[: len(X) * m].reshape(-1, m)


def subtract(Y: Array, X: Array, C: Array) -> None:
    """Take X C from Y, (n, l), in place."""
    order = _order(Y)

    def update(rows: slice) -> None:
        for first in range(rows.start, rows.stop, SLICE):
            part = slice(first, min(first + SLICE, rows.stop))
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

    def copy(rows: slice) -> None:
        for first in range(rows.start, rows.stop, SLICE):
            part = slice(first, min(first + SLICE, rows.stop))
            result[part] = X[part]

    _by_rows(len(X), copy)
    return result


def _order(X: Array) -> Literal["C", "F"]:
    """Return the order in which X lies, or nearly lies (a part of its rows or columns)."""
    return "C" if X.strides[1] <= X.strides[0] else "F"


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
