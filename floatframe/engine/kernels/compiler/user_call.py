"""Calls from the kernels to a user's function by its address, which need no compilation of the kernels."""

import ctypes
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from floatframe.engine.kernels.compiler.choice import is_interpreted

__all__ = ["call_law", "call_user_function"]


def pointer_to(context, builder, array_type, value):
    """Return the address of the first number of an array."""
    number = context.get_data_type(array_type.dtype).as_pointer()
    return builder.bitcast(make_array(array_type)(context, builder, value).data, number)


def write_call(context, builder, signature, arguments):
    """Write a call of the C function at the address in the first argument, with pointers to the arrays that follow."""
    pointers = [
        pointer_to(context, builder, array_type, value)
        for array_type, value in zip(signature.args[1:], arguments[1:], strict=True)
    ]
    kind = ir.FunctionType(ir.VoidType(), [pointer.type for pointer in pointers])
    builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), pointers)
    return context.get_dummy_value()


def call_by_address(typing_context, address, inputs, outputs):
    """Call the C function void f(const double *inputs, double *outputs) at an address."""
    return types.void(address, inputs, outputs), write_call


def call_law_by_address(typing_context, address, head, inputs, data, outputs):
    """Call the C function void f(const int64 *head, const double *inputs, const double *data, double *outputs)."""
    return types.void(address, head, inputs, data, outputs), write_call


def call_from_python(address, *arrays):
    """Call the C function at an address with pointers to the arrays, in interpreted kernels."""
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(arrays))(int(address))
    function(*[array.ctypes.data for array in arrays])


def kernel_call(typed_call: Any) -> Any:
    """Return what kernels call."""
    return call_from_python if is_interpreted else intrinsic(typed_call)


call_user_function: Any = kernel_call(call_by_address)  #: call in kernels: call_user_function(address, inputs, outputs)
call_law: Any = kernel_call(call_law_by_address)  #: call in kernels: call_law(address, head, inputs, data, outputs)
