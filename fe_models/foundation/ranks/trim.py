"""Memory that was freed, given back to the machine: glibc keeps it, and peaks of one rank then add up."""

import ctypes

__all__ = ["give_back"]


def give_back() -> None:
    """Let the allocator return what is free; nothing where it is not that of glibc."""
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):
        trim(0)
