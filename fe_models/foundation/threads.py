"""Number of threads, and separation of the thread pools of two libraries."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from typing import Any

__all__ = ["bounded_threads", "in_threads", "n_processors", "n_threads", "one_blas_thread", "thread_environment"]

#: largest number of threads; each has a workspace over all nodes, and memory bandwidth is exhausted by fewer threads
MOST_THREADS = 16
LIBRARIES = ("OMP", "MKL", "OPENBLAS", "NUMBA")

bound: int | None = None  #: limit of this process, set by `bounded_threads`


def n_processors() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def n_threads() -> int:
    """Return the number of threads for a task: the number of processors, limited by `MOST_THREADS` and `bound`."""
    return min(n_processors(), MOST_THREADS, bound or MOST_THREADS)


def in_threads(kernel: Callable[..., Any], inputs: tuple[Any, ...], outputs: tuple[Any, ...]) -> None:
    """Run kernel(*inputs, part, n_parts, *outputs) for every part, each in a thread."""
    n_parts = n_threads()
    with ThreadPoolExecutor(n_parts) as pool:
        list(pool.map(lambda part: kernel(*inputs, part, n_parts, *outputs), range(n_parts)))


def thread_environment(n: int) -> dict[str, str]:
    """Return the environment variables that limit the libraries in a new process to n threads."""
    return {f"{name}_NUM_THREADS": str(n) for name in LIBRARIES}


@contextmanager
def bounded_threads(n: int | None) -> Iterator[None]:
    """Limit this process to n threads, including those of loaded libraries; None: no limit."""
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
    """Limit NumPy's own BLAS (OpenBLAS) to one thread while another library solves in alternation with it.

    Threads of OpenBLAS poll for the next task for about 50 ms and block the processors for the solver. Block solves of
    48 thousand dofs took 0.11 s instead of 0.05 s.
    """
    from threadpoolctl import ThreadpoolController

    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
