"""Choice of the compiler for the kernels: the lean compiler for supported versions of numba, otherwise plain numba.

The lean compiler (kernels/compiler/lean.py) replaces inner parts of numba, which change from one version to the next.
Plain numba compiles the same kernels with any version that the project supports. Measured with numba 0.68.1 on a quiet
machine (`python -m benchmarks.floatframe_vs_exudyn` with either compiler, before version 0.2.0), per step:

| | one body with 8 / 20 / 50 modes | chain of ten with 8 / 20 / 50 modes | first compilation |
|---|---|---|---|
| plain | 4.9 / 10.3 / 44.5 µs | 51.5 / 117 / 400 µs | 124 s |
| lean | 3.5 / 8.0 / 40.0 µs | 37.6 / 94.5 / 372 µs | 15 to 20 s |

So a step of plain numba takes 1.07 to 1.40 times as long, and the first compilation six to eight times.

Kernels can also run as plain Python (kernels/compiler/interpreted.py), with checked indices, for debugging and as a
reference for both compilers.
"""

import os

import numba
from numba.core import config

from floatframe.errors import FloatframeError

__all__ = ["KNOWN_VERSIONS", "VARIABLE", "is_interpreted", "is_lean", "level", "words"]

KNOWN_VERSIONS = ("0.68",)  #: versions of numba whose internals the lean compiler supports
VARIABLE = "FLOATFRAME_COMPILER"  #: environment variable that selects one of `CHOICES`
CHOICES = ("lean", "plain", "interpreted")

installed = ".".join(numba.__version__.split(".")[:2])


def chosen() -> str:
    """Return the compiler to use; `FloatframeError` if the requested compiler is unknown or cannot be used."""
    asked = os.environ.get(VARIABLE, "")
    if asked not in ("", *CHOICES):
        raise FloatframeError(f"environment variable {VARIABLE}: expected one of {', '.join(CHOICES)}, got {asked!r}")
    if asked == "lean" and installed not in KNOWN_VERSIONS:
        raise FloatframeError(
            f"environment variable {VARIABLE}: the lean compiler supports numba {', '.join(KNOWN_VERSIONS)}, but "
            f"{numba.__version__} is installed; unset the variable to compile with plain numba"
        )
    return asked or ("lean" if installed in KNOWN_VERSIONS else "plain")


is_lean = chosen() == "lean"
is_interpreted = chosen() == "interpreted"
level = int(config.OPT)  # type: ignore[attr-defined]  #: level of optimisation, from NUMBA_OPT


def words() -> str:
    """Describe how the kernels are compiled, in one line for the user."""
    if is_lean:
        return f"lean, with numba {numba.__version__}"
    if is_interpreted:
        return f"interpreted as Python with checked indices (requested by {VARIABLE})"
    asked = f"requested by {VARIABLE}"
    why = asked if os.environ.get(VARIABLE) else f"the faster lean compiler needs numba {', '.join(KNOWN_VERSIONS)}"
    return f"plain, with numba {numba.__version__} ({why})"
