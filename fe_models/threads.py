"""How many threads the compiled loops use."""

import os

__all__ = ["n_threads"]


def n_threads() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
