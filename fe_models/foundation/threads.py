"""Threads: how many, and keeping the pools of two libraries out of each other's way."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

__all__ = ["bounded_threads", "n_processors", "n_threads", "one_blas_thread", "thread_environment"]

MOST_THREADS = 16  #: each holds a workspace over all nodes, and memory traffic limits them well before
LIBRARIES = ("OMP", "MKL", "OPENBLAS", "NUMBA")

bound: int | None = None  #: of this process, set by `bounded_threads`


def n_processors() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def n_threads() -> int:
    """Return the number of threads for one piece of work: of processors, at most `MOST_THREADS`, or as bounded."""
    return min(n_processors(), MOST_THREADS, bound or MOST_THREADS)


def thread_environment(n: int) -> dict[str, str]:
    """Return the variables that hold the libraries of a process to n threads, if they are set before it begins."""
    return {f"{name}_NUM_THREADS": str(n) for name in LIBRARIES}


@contextmanager
def bounded_threads(n: int | None) -> Iterator[None]:
    """Hold this process to n threads: ours, and those of the libraries loaded so far; None: leave them."""
    global bound
    before, bound = bound, n if n is not None else bound
    limits: Any = nullcontext()
    if n is not None:
        from threadpoolctl import threadpool_limits

        limits = threadpool_limits(n)
    try:
        with limits:
            yield
    finally:
        bound = before


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep NumPy's own BLAS (OpenBLAS) to one thread while another library solves in turns with it.

    Its threads wait for their next task on the processor for some 50 ms, which the solver then lacks: block solves of
    48 thousand dofs took 0.11 s instead of 0.05 s.
    """
    from threadpoolctl import ThreadpoolController

    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
