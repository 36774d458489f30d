"""Records of arrays in the kernels: each record is a pointer to a table of addresses and shapes.

The table of a record (`records.tabled`) contains the address and then the shape of each array, in order; a record
inside a record has a part of the table. A kernel that reads `work.markers.r` makes the array from these numbers. A
single number (declared without a shape) is read and written directly, `work.counted.evaluations += 1`. Tables and
arrays belong to Python, so that the kernels count no references. Addresses and shapes in a table do not change while a
kernel runs, so that they may be kept in registers.
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, lower_setattr_generic, register_model
from numba.np.arrayobj import make_array

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.compiler.choice import is_interpreted
from floatframe.engine.kernels.compiler.compilation import array_type, array_value
from floatframe.engine.kernels.compiler.interpreted import record_at
from floatframe.engine.kernels.records import Declared

__all__ = ["Structure", "converter", "n_words", "table_of_numbers"]

WORD = ir.IntType(64)


def n_words(declared) -> int:
    """Return the number of table words for an array, number or record."""
    return 1 + len(declared.shape) if isinstance(declared, Declared) else sum(map(n_words, declared))


def type_of(declared) -> types.Type:
    """Return the type that the kernels see for an array, number or record."""
    if not isinstance(declared, Declared):
        return Structure(declared)
    number = from_dtype(np.dtype(declared.dtype))
    return array_type(number, len(declared.shape)) if declared.shape else number


class Structure(types.Type):
    """A pointer to a table, with a named array, number or record for each declared field."""

    def __init__(self, declaration):
        self.fields: dict[str, tuple[types.Type, int]] = {}  # name: (type, index of its part of the table)
        place = 0
        for name, declared in zip(declaration._fields, declaration, strict=True):
            self.fields[name] = type_of(declared), place
            place += n_words(declared)
        super().__init__(f"Structure({type(declaration).__name__} of {n_words(declaration)} words)")


register_model(Structure)(models.OpaqueModel)


@infer_getattr
class StructureFields(AttributeTemplate):
    """Types of the fields of a record."""

    key = Structure

    def generic_resolve(self, structure, name):  # type: ignore[override]
        """Return the type of a field; None if there is no field with this name."""
        return structure.fields.get(name, (None,))[0]


def word_of(builder, pointer, place):
    """Return one word of a table."""
    table = builder.bitcast(pointer, WORD.as_pointer())
    word = builder.load(builder.gep(table, [WORD(place)], inbounds=True))
    word.set_metadata("invariant.load", builder.module.add_metadata([]))
    return word


def address_of(context, builder, number, pointer, place):
    """Return the address of the numbers of a field, as a pointer to their type."""
    return builder.inttoptr(word_of(builder, pointer, place), context.get_data_type(number).as_pointer())


@lower_getattr_generic(Structure)
def get_field(context, builder, structure, pointer, name):
    """Return a field: an array with address and shape from the table, a number, or a record."""
    kind, place = structure.fields[name]
    if isinstance(kind, Structure):
        table = builder.bitcast(pointer, WORD.as_pointer())
        return builder.bitcast(builder.gep(table, [WORD(place)], inbounds=True), cgutils.voidptr_t)
    if not isinstance(kind, types.Array):
        return builder.load(address_of(context, builder, kind, pointer, place))
    data = address_of(context, builder, kind.dtype, pointer, place)
    shape = [word_of(builder, pointer, place + 1 + k) for k in range(kind.ndim)]
    return array_value(context, builder, kind, data, shape)


@lower_setattr_generic(Structure)
def set_field(context, builder, signature, arguments, name):
    """Write a field that holds a number."""
    kind, place = signature.args[0].fields[name]
    value = context.cast(builder, arguments[1], signature.args[1], kind)
    builder.store(value, address_of(context, builder, kind, arguments[0], place))


def converter(declaration):
    """Return the function of kernels that converts a table to the structure of a declaration."""
    if is_interpreted:
        return lambda table: record_at(declaration, table)
    structure = Structure(declaration)

    @intrinsic
    def convert(typing_context, table):
        def generate(context, builder, signature, arguments):
            array = make_array(signature.args[0])(context, builder, arguments[0])
            return builder.bitcast(array.data, cgutils.voidptr_t)

        return structure(table), generate

    return convert


@lru_cache
def numbers_of(record) -> tuple[dict[str, tuple[int, bool]], IntArray]:
    """Return the index of each number of a class of records, whether it is an integer, and addresses from the first."""
    declared = record()._asdict()
    places = {name: (k, each.dtype is np.int64) for k, (name, each) in enumerate(declared.items())}
    return places, 8 * np.arange(len(places))


def table_of_numbers(declaration, values: Mapping[str, float]) -> tuple[IntArray, Array]:
    """Return the table of a record of numbers, zero if not given, and the numbers, which the caller must keep alive."""
    places, offsets = numbers_of(type(declaration))  # type: ignore[arg-type]
    reals = np.zeros(len(places))
    integers = reals.view(np.int64)
    for name, value in values.items():
        if name not in places:
            unknown = ", ".join(name for name in values if name not in places)
            raise TypeError(f"{type(declaration).__name__} has no numbers {unknown}")
        index, is_integer = places[name]
        if is_integer:
            integers[index] = value
        else:
            reals[index] = value
    return reals.__array_interface__["data"][0] + offsets, reals
