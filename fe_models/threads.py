"""How many threads the compiled loops use."""

import os

__all__ = ["n_threads"]


MOST_THREADS = 16  #: each holds a workspace over all nodes, and memory traffic limits them well before


def n_threads() -> int:
    """Return the number of processors this process may use, at most `MOST_THREADS`."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(available, MOST_THREADS)
