"""Sizes of memory as text, such as "8GB"."""

import re
import sys

from cms.errors import MemoryBudgetError

__all__ = ["memory_bytes", "resident_bytes"]

UNITS = {
    "": 1.0, "B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12, "KiB": 2.0**10, "MiB": 2.0**20, "GiB": 2.0**30,
    "TiB": 2.0**40,
}  # fmt: skip
#: smallest plausible size [bytes]; a smaller size is probably in a wrong unit, because Python alone needs more
LEAST = 5e7


def memory_bytes(text: str | float) -> float:
    """Return a size in bytes from a text such as "8GB", "800 MB" or "7.5GiB", or from a number of bytes.

    Raises
    ------
    MemoryBudgetError
        If it is not a size, its unit is unknown, or it is smaller than any run needs.

    Examples
    --------
    >>> memory_bytes("8GB")
    8000000000.0
    """
    found = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]*)?(?:[eE][0-9]+)?)\s*([A-Za-z]*)\s*", str(text))
    if found is None or isinstance(text, bool):
        raise MemoryBudgetError(f'memory = {text!r}: expected a number with a unit, such as "8GB" or "800MB"')
    units = {unit.lower(): factor for unit, factor in UNITS.items()}
    if found[2].lower() not in units:
        raise MemoryBudgetError(
            f"memory = {text!r}: unknown unit {found[2]!r}; choices: {', '.join(filter(None, UNITS))}"
        )
    size = float(found[1]) * units[found[2].lower()]
    if size < LEAST:
        raise MemoryBudgetError(f'memory = {text!r} is {size:.3g} bytes, less than any run takes; did you mean "8GB"?')
    return size


def resident_bytes() -> float:
    """Return the current memory of this process [bytes]; its peak memory if the current one is unknown."""
    try:
        with open("/proc/self/statm") as file:
            pages = int(file.read().split()[1])
        import resource

        return float(pages) * resource.getpagesize()
    except OSError:
        pass
    try:
        import resource
    except ImportError:  # the module is missing on Windows
        return 3e8
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * (1 if sys.platform == "darwin" else 1024)
