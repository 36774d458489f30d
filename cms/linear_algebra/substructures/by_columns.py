"""Parallel work on slices of columns, in threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from fe_models.foundation.threads import bounded_threads, n_threads

__all__ = ["by_columns"]

COLUMNS = 64  #: largest number of columns that a thread processes at a time


def by_columns(k: int, work: Callable[[slice], None]) -> None:
    """Call `work` with slices of k columns, in threads with one BLAS thread each."""
    n = n_threads()
    width = max(1, min(COLUMNS, -(-k // n)))
    slices = [slice(a, min(a + width, k)) for a in range(0, k, width)]
    with bounded_threads(1), ThreadPoolExecutor(n) as pool:
        list(pool.map(work, slices))
