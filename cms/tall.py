"""Products of tall arrays, (n, k) with n much larger than k, by slices of rows in threads.

NumPy's own BLAS threads wait for their next task on the processor, which the sparse solver working in turns with them
then lacks; ours sleep. The slices are summed in their order, so that results repeat bit for bit.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numpy as np

from cms.arrays import Array
from cms.threads import n_threads

__all__ = ["combine", "inner", "subtract"]

SMALL = 20_000  #: rows below which threads cost more than they bring


def inner(X: Array, Y: Array) -> Array:
    """Return Xᵀ Y, (k, l)."""
    parts = _by_rows(len(X), lambda rows: X[rows].T @ Y[rows])
    return np.sum(parts, axis=0)


def combine(X: Array, C: Array) -> Array:
    """Return X C in C order, (n, l)."""
    result = np.empty((len(X), C.shape[1]))

    def multiply(rows: slice) -> None:
        np.matmul(X[rows], C, out=result[rows])

    _by_rows(len(X), multiply)
    return result


def subtract(Y: Array, X: Array, C: Array) -> None:
    """Take X C from Y, (n, l), in place."""

    def update(rows: slice) -> None:
        Y[rows] -= X[rows] @ C

    _by_rows(len(X), update)


def _by_rows(n: int, work: Callable[[slice], Array | None]) -> list:
    n_parts = n_threads() if n > SMALL else 1
    if n_parts == 1:
        return [work(slice(0, n))]
    bounds = np.linspace(0, n, n_parts + 1).astype(int)
    return list(_pool().map(work, [slice(a, b) for a, b in pairwise(bounds)]))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(n_threads())
