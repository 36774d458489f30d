"""The type of the arrays in kernels: contiguous, owned by Python, indexed from zero.

It is numba's array type with other code for access to numbers and parts: without tests for negative indices, without
clipping of slices that have an end, and without reference counts. As an argument it consists only of address and shape.

Kernels must not index from the end. User functions may; their arrays are of the type `SafeBlock`.
"""

import operator

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.extending import lower_builtin, lower_getattr, register_model
from numba.np.arrayobj import (
    array_reshape,
    array_reshape_vararg,
    getitem_array_tuple,
    getitem_arraynd_intp,
    setitem_array,
)

__all__ = ["Block", "SafeBlock", "make_block", "parts_of"]

N_ITEMS, ITEM_SIZE, DATA, SHAPE, STRIDES = 2, 3, 4, 5, 6  # positions of fields in numba's structure of an array
WORD = ir.IntType(64)
BITS = 8  # bits of a byte


class Block(types.Array):
    """A contiguous array of numbers in C order."""

    words = "block"  #: prefix of the name of the type
    from_end = False  #: whether negative indices count from the end, and slices are clipped to the array

    def __init__(self, dtype, ndim):
        super().__init__(dtype, ndim, "C", name=f"{self.words}({dtype}, {ndim}d)")

    def copy(self, dtype=None, ndim=None, layout=None, readonly=None):
        """Return the type of a part, a block if the part is contiguous; numba passes `readonly` only for new arrays."""
        if layout in (None, "C") and readonly is None:
            return type(self)(dtype or self.dtype, self.ndim if ndim is None else ndim)
        return super().copy(dtype, ndim, layout, readonly)


class SafeBlock(Block):
    """A block for user functions, in which indices and slices have the meaning of Python."""

    words = "safe block"
    from_end = True


@register_model(Block)
@register_model(SafeBlock)
class BlockModel(models.ArrayModel):
    """numba's data model of an array, passed as an argument by its address and shape."""

    def get_argument_type(self):
        """Return the types of the parts of an argument."""
        return self._models[DATA].get_argument_type(), (WORD,) * self._fe_type.ndim

    def as_argument(self, builder, value):
        """Return the parts of an argument."""
        shape = tuple(builder.extract_value(value, (SHAPE, k)) for k in range(self._fe_type.ndim))
        return builder.extract_value(value, DATA), shape

    def from_argument(self, builder, value):
        """Return the structure from the parts of an argument."""
        return assemble(builder, self._fe_type, self.get_value_type(), value[0], value[1])


def assemble(builder, block, structure, data, shape):
    """Return the structure of an array at an address, with its strides and number of items computed from the shape."""
    n, size = len(shape), WORD(block.dtype.bitwidth // BITS)
    known = [ir.Constant(part, ir.Undefined) for part in structure.elements]
    known[0], known[1] = (ir.Constant(part, None) for part in structure.elements[:2])
    known[ITEM_SIZE] = size
    strides = [ir.Constant(WORD, ir.Undefined)] * (n - 1) + [size]
    known[STRIDES] = ir.Constant(structure.elements[STRIDES], strides)
    value = builder.insert_value(ir.Constant(structure, known), data, DATA)
    n_items = None
    for k in range(n - 1, -1, -1):
        value = builder.insert_value(value, shape[k], (SHAPE, k))
        n_items = shape[k] if n_items is None else builder.mul(n_items, shape[k])
        if k > 0:
            value = builder.insert_value(value, builder.mul(n_items, size), (STRIDES, k - 1))
    return builder.insert_value(value, n_items, N_ITEMS)


def make_block(context, builder, kind, data, shape):
    """Return the value of an array of type `kind` at an address, with the given shape."""
    return assemble(builder, kind, context.get_value_type(kind), data, shape)


def shape_of(builder, block, value):
    """Return the shape of an array as a tuple of integers."""
    return [builder.extract_value(value, (SHAPE, k)) for k in range(block.ndim)]


def offset_of(context, builder, block, value, kinds, indices):
    """Return the offset, in elements, of the element at the indices; missing indices are zero."""
    offset = None
    for k in range(block.ndim):
        if offset is not None:
            offset = builder.mul(offset, builder.extract_value(value, (SHAPE, k)))
        if k < len(kinds):
            index = context.cast(builder, indices[k], kinds[k], types.intp)
            if block.from_end:
                index = from_start(builder, index, builder.extract_value(value, (SHAPE, k)))
            offset = index if offset is None else builder.add(offset, index)
    return offset


def from_start(builder, index, n):
    """Return an index that counts from the start; a negative one counts from the end."""
    if isinstance(index, ir.Constant) and isinstance(index.constant, int):
        return index if index.constant >= 0 else builder.add(index, n)
    return builder.select(builder.icmp_signed("<", index, WORD(0)), builder.add(index, n), index)


def within(builder, bound, n):
    """Return a slice bound counted from the start and clipped to between zero and the size, as numba does."""
    bound = from_start(builder, bound, n)
    bound = builder.select(builder.icmp_signed("<", bound, WORD(0)), WORD(0), bound)
    return builder.select(builder.icmp_signed("<", bound, n), bound, n)


def place(builder, value, offset):
    """Return the address of the number at an offset from an address."""
    return builder.gep(builder.extract_value(value, DATA), [offset], inbounds=True)


def parts_of(builder, kind, index):
    """Return the types and values of the parts of an index."""
    if isinstance(kind, types.BaseTuple):
        return tuple(kind), [builder.extract_value(index, k) for k in range(len(kind))]  # type: ignore[arg-type]
    return (kind,), [index]


def is_number(block, kinds):
    """Whether an index of these types selects one number."""
    return len(kinds) == block.ndim and all(isinstance(kind, types.Integer) for kind in kinds)


def is_part(kinds):
    """Whether an index of these types selects a contiguous part: numbers, then at most one slice."""
    last = kinds[-1]
    is_slice = isinstance(last, types.SliceType) and not last.has_step
    return all(isinstance(kind, types.Integer) for kind in kinds[:-1]) and (is_slice or isinstance(last, types.Integer))


def get_part(context, builder, signature, value, kinds, indices):
    """Return the part of a block that an index selects."""
    block, part = signature.args[0], signature.return_type
    shape = shape_of(builder, block, value)
    rest = shape[len(kinds) :]
    kinds, indices = list(kinds), list(indices)
    if isinstance(kinds[-1], types.SliceType):
        first, end = (builder.extract_value(indices[-1], k) for k in range(2))
        n = shape[len(kinds) - 1]
        if block.from_end:
            first, end = within(builder, first, n), within(builder, end, n)
            end = builder.select(builder.icmp_signed("<", end, first), first, end)
        else:
            end = builder.select(builder.icmp_signed("<", end, n), end, n)  # a missing end is the largest integer
        rest.insert(0, builder.sub(end, first))
        kinds[-1], indices[-1] = types.intp, first
    offset = offset_of(context, builder, block, value, kinds, indices)
    return make_block(context, builder, part, place(builder, value, offset), rest)


@lower_builtin(operator.getitem, Block, types.Integer)
@lower_builtin(operator.getitem, Block, types.SliceType)
@lower_builtin(operator.getitem, Block, types.BaseTuple)
def get_item(context, builder, signature, arguments):
    """Return one number or a contiguous part; numba handles all other indices."""
    block, kind = signature.args
    kinds, indices = parts_of(builder, kind, arguments[1])
    if is_number(block, kinds):
        offset = offset_of(context, builder, block, arguments[0], kinds, indices)
        return builder.load(place(builder, arguments[0], offset))
    if is_part(kinds):
        return get_part(context, builder, signature, arguments[0], kinds, indices)
    plain = getitem_array_tuple if isinstance(kind, types.BaseTuple) else getitem_arraynd_intp
    return plain(context, builder, signature, arguments)


@lower_builtin(operator.setitem, Block, types.Integer, types.Number)
@lower_builtin(operator.setitem, Block, types.BaseTuple, types.Number)
def set_item(context, builder, signature, arguments):
    """Write one number; numba handles all other assignments."""
    block, kind, of_value = signature.args
    kinds, indices = parts_of(builder, kind, arguments[1])
    if not is_number(block, kinds):
        return setitem_array(context, builder, signature, arguments)
    value = context.cast(builder, arguments[2], of_value, block.dtype)
    offset = offset_of(context, builder, block, arguments[0], kinds, indices)
    builder.store(value, place(builder, arguments[0], offset))
    return context.get_dummy_value()


@lower_builtin("array.reshape", Block, types.BaseTuple)
def reshape(context, builder, signature, arguments):
    """Return the same numbers in another shape; their count is checked only in user functions."""
    if signature.args[0].from_end:
        return array_reshape(context, builder, signature, arguments)
    kinds, shape = parts_of(builder, signature.args[1], arguments[1])
    shape = [context.cast(builder, n, kind, types.intp) for n, kind in zip(shape, kinds, strict=True)]
    data = builder.extract_value(arguments[0], DATA)
    return make_block(context, builder, signature.return_type, data, shape)


@lower_builtin("array.reshape", Block, types.Integer)
def flatten(context, builder, signature, arguments):
    """Return the same numbers as a vector."""
    if signature.args[0].from_end:
        return array_reshape_vararg(context, builder, signature, arguments)
    shape = [context.cast(builder, arguments[1], signature.args[1], types.intp)]
    data = builder.extract_value(arguments[0], DATA)
    return make_block(context, builder, signature.return_type, data, shape)


@lower_getattr(Block, "shape")
def get_shape(context, builder, kind, value):
    """Return the shape of an array."""
    return builder.extract_value(value, SHAPE)


@lower_getattr(Block, "size")
def get_size(context, builder, kind, value):
    """Return the number of elements of an array."""
    return builder.extract_value(value, N_ITEMS)
