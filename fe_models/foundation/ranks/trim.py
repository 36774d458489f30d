"""Return of freed memory to the operating system; glibc keeps it, so that peaks of several ranks would add up."""

import ctypes

__all__ = ["give_back"]


def give_back() -> None:
    """Make the allocator return free memory; does nothing if the allocator is not glibc's."""
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
        trim(0)
