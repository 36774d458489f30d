"""The decorators of compiled functions, and the type of their arrays.

`inner` is for functions that only compiled code calls, `loops` for those of them whose loops run over modes or
matrices, `matrix_loops` for long ones of these with many callers, `small` for what is written into its
callers: a few operations, or a part of one function; `view` for one that returns a part of an array,
`entry` for what Python calls, `kept_entry` where it has one signature and no room for its cache is no error. The lean
compiler makes them with a numba that it knows, plain numba with any other, see kernels/compiler/choice.py.
"""

from floatframe.engine.kernels.compiler.choice import is_lean

if is_lean:
    from floatframe.engine.kernels.compiler.lean import (
        array_type,
        array_value,
        entry,
        inner,
        loops,
        matrix_loops,
        small,
        view,
    )
else:
    from floatframe.engine.kernels.compiler.plain import (
        array_type,
        array_value,
        entry,
        inner,
        loops,
        matrix_loops,
        small,
        view,
    )

__all__ = ["array_type", "array_value", "entry", "inner", "kept_entry", "loops", "matrix_loops", "small", "view"]


def kept_entry(function):
    """Return the compiled function that Python calls.

    It is stored on disk, or compiled in each process if impossible.
    """
    try:
        return entry(function)
    except RuntimeError:  # no folder for the cache
        return entry(function, cache=False)
