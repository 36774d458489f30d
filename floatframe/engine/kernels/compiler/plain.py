"""Kernels compiled by plain numba of any supported version, slower but only with numba's public interface.

The names are those of kernels/compiler/lean.py, where their purpose is described.
"""

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils

from fe_models.foundation.kernels.jit import stored

__all__ = ["array_type", "array_value", "entry", "inner", "loops", "matrix_loops", "small", "view"]

WORD = ir.IntType(64)
BYTES = 8  # bytes of a number

inner = small = loops = matrix_loops = view = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)


def entry(function, *, cache=True):
    """Return the compiled function that Python calls."""
    compiled = njit(function, error_model="numpy")
    return stored(compiled) if cache else compiled


def array_type(dtype, ndim):
    """Return the type of a contiguous array in the kernels."""
    return types.Array(dtype, ndim, "C")


def array_value(context, builder, kind, data, shape):
    """Return the value of an array at an address whose memory Python owns."""
    array = context.make_array(kind)(context, builder)
    strides = [WORD(BYTES)]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(size, strides[0]))
    n_items = WORD(1)
    for size in shape:
        n_items = builder.mul(n_items, size)
    array.data = data
    array.shape = cgutils.pack_array(builder, shape)
    array.strides = cgutils.pack_array(builder, strides)
    array.itemsize = WORD(BYTES)
    array.nitems = n_items
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()
