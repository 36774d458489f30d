"""Threads: how many, and keeping the pools of two libraries out of each other's way."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["n_threads", "one_blas_thread"]

MOST_THREADS = 16  #: each holds a workspace over all nodes, and memory traffic limits them well before


def n_threads() -> int:
    """Return the number of processors this process may use, at most `MOST_THREADS`."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(available, MOST_THREADS)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep NumPy's own BLAS (OpenBLAS) to one thread while another library solves in turns with it.

    Its threads wait for their next task on the processor for some 50 ms, which the solver then lacks: block solves of
    48 thousand dofs took 0.11 s instead of 0.05 s.
    """
    from threadpoolctl import ThreadpoolController

    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
