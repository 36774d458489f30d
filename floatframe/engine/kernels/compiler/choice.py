"""Choice of the compiler for the kernels: the lean compiler for supported versions of numba, otherwise plain numba.

The lean compiler (kernels/compiler/lean.py) replaces inner parts of numba, which change from one version to the next.
Plain numba compiles the same kernels with any version that the project supports. The compilation, which happens once,
takes several times as long, and a step takes somewhat longer (docs/multibody.md has the figures).

Kernels can also run as plain Python (kernels/compiler/interpreted.py), with checked indices, for debugging and as a
reference for both compilers.
"""

import os

import numba
from numba.core import config

from floatframe.errors import FloatframeError

__all__ = ["KNOWN_VERSIONS", "VARIABLE", "compiler", "is_interpreted", "is_lean", "level", "words"]

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
compiler = f"{chosen()} at level {level}"  #: the settings that determine the machine code of a given source


def words() -> str:
    """Describe how the kernels are compiled, in one line for the user."""
    if is_lean:
        return f"lean, with numba {numba.__version__}"
    if is_interpreted:
        return f"interpreted as Python with checked indices (requested by {VARIABLE})"
    asked = f"requested by {VARIABLE}"
    why = asked if os.environ.get(VARIABLE) else f"the faster lean compiler needs numba {', '.join(KNOWN_VERSIONS)}"
    return f"plain, with numba {numba.__version__} ({why})"
