"""The type of the arrays in kernels: contiguous, owned by Python, indexed from zero up.

It is numba's array type with its own code for single numbers: no test for negative indices, no counted references.
Kernels must not index from the end.
"""

import operator

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.extending import lower_builtin, register_model
from numba.np.arrayobj import getitem_array_tuple, getitem_arraynd_intp, setitem_array

__all__ = ["Block"]

DATA, SHAPE = 4, 5  # places in numba's structure of an array
WORD = ir.IntType(64)


class Block(types.Array):
    """A contiguous array of numbers in C order."""

    def __init__(self, dtype, ndim):
        super().__init__(dtype, ndim, "C", name=f"block({dtype}, {ndim}d)")

    def copy(self, dtype=None, ndim=None, layout=None, readonly=None):
        """Return the type of a part: a block while it is contiguous."""
        if layout in (None, "C"):
            return Block(dtype or self.dtype, self.ndim if ndim is None else ndim)
        return super().copy(dtype, ndim, layout, readonly)


register_model(Block)(models.ArrayModel)


def pointer_to(context, builder, block, value, kinds, indices):
    """Return the place of one number."""
    offset = None
    for k, (kind, index) in enumerate(zip(kinds, indices, strict=True)):
        index = context.cast(builder, index, kind, types.intp)
        if offset is None:
            offset = index
        else:
            offset = builder.add(builder.mul(offset, builder.extract_value(value, (SHAPE, k))), index)
    return builder.gep(builder.extract_value(value, DATA), [offset], inbounds=True)


def is_number(block, kinds):
    """Whether an index of these types denotes one number."""
    return len(kinds) == block.ndim and all(isinstance(kind, types.Integer) for kind in kinds)


def parts_of(builder, kind, index):
    """Return types and values of the parts of an index."""
    if isinstance(kind, types.BaseTuple):
        return tuple(kind), [builder.extract_value(index, k) for k in range(len(kind))]  # type: ignore[arg-type]
    return (kind,), [index]


@lower_builtin(operator.getitem, Block, types.Integer)
@lower_builtin(operator.getitem, Block, types.BaseTuple)
def get_item(context, builder, signature, arguments):
    """Return one number, or a part as numba does it."""
    block, kind = signature.args
    kinds, indices = parts_of(builder, kind, arguments[1])
    if is_number(block, kinds):
        return builder.load(pointer_to(context, builder, block, arguments[0], kinds, indices))
    plain = getitem_array_tuple if isinstance(kind, types.BaseTuple) else getitem_arraynd_intp
    return plain(context, builder, signature, arguments)


@lower_builtin(operator.setitem, Block, types.Integer, types.Number)
@lower_builtin(operator.setitem, Block, types.BaseTuple, types.Number)
def set_item(context, builder, signature, arguments):
    """Write one number, or many as numba does it."""
    block, kind, of_value = signature.args
    kinds, indices = parts_of(builder, kind, arguments[1])
    if not is_number(block, kinds):
        return setitem_array(context, builder, signature, arguments)
    value = context.cast(builder, arguments[2], of_value, block.dtype)
    builder.store(value, pointer_to(context, builder, block, arguments[0], kinds, indices))
    return context.get_dummy_value()
