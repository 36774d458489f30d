"""How inner functions are compiled."""

from numba import njit

__all__ = ["inner", "merged"]

#: for functions that only compiled code calls: no wrappers for Python, and no test before each division
inner = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy")

#: the same for functions with one caller, of which they become part: everything below a compiled function is optimised
#: once more with it, so that each level of calls costs
merged = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy", inline="always")
