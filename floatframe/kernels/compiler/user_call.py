"""Calls from the kernels to a user's function through its address, so that nothing is compiled for it."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

__all__ = ["call_user_function"]


def call_by_address(typing_context, address, inputs, outputs):
    """Call the C function void f(const double *inputs, double *outputs) at an address."""

    def generate(context, builder, signature, arguments):
        number = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [number, number])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        pointers = []
        for array_type, value in zip(signature.args[1:], arguments[1:], strict=True):
            data = make_array(array_type)(context, builder, value).data
            pointers.append(builder.bitcast(data, number))
        builder.call(function, pointers)
        return context.get_dummy_value()

    return types.void(address, inputs, outputs), generate


call_user_function: Any = intrinsic(call_by_address)  #: call_user_function(address, inputs, outputs) in kernels
