"""The decorators of compiled functions, and the type of their arrays.

    inner           a function that only compiled code calls
    loops           an inner function whose loops run over modes or matrices
    matrix_loops    a long function of this kind with many callers
    small           an inner function that is inlined: a few operations, or a part of one function
    view            an inlined function that returns parts of arrays
    entry           a function that Python calls, whose code is stored (fe_models/foundation/kernels/jit.py)

The lean compiler compiles them if it supports the installed numba, otherwise plain numba. To debug kernels, they can
run as Python; see kernels/compiler/choice.py.
"""

from floatframe.engine.kernels.compiler.choice import is_interpreted, is_lean

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
elif is_interpreted:
    from floatframe.engine.kernels.compiler.interpreted import (
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

__all__ = ["array_type", "array_value", "entry", "inner", "loops", "matrix_loops", "small", "view"]
