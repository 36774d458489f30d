"""The model and the working arrays as the kernels see them: each is one pointer to a table of addresses and shapes.

A table has for each field of the kind (`Model`, `Work`, ...) the address of its array, then its shape; a kernel that
reads `work.m_r` gets the array back from there. Tables and arrays belong to Python, so that the kernels count no
references; numbers in a table do not change while a kernel runs, so that they may be kept in registers.
"""

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, register_model
from numba.np.arrayobj import make_array

from fe_models.foundation.arrays import IntArray
from floatframe.kernels.compiler.compilation import array_type, array_value
from floatframe.kernels.model import Memory, Model, Rows, Work

__all__ = ["as_memory", "as_model", "as_rows", "as_work", "table_of"]

N_DIMENSIONS = {  # of the fields that are not vectors
    "S": 2, "J0": 3, "block0": 2, "is_diagonal": 2, "m_position": 2, "m_triad": 3, "row_x": 2, "row_y": 2, "row_z": 2,
    "piece": 2, "springs": 2, "bushings": 2, "bushing_table": 2, "contacts": 2, "joint_forces": 2, "l_force": 2,
    "l_torque": 2, "line_axis": 2, "line": 2, "state_base": 2,
    "r": 2, "R": 3, "theta": 2, "a_B": 2, "J": 3, "turning": 3, "D_q_dot": 3, "first": 2, "rho": 2, "rho_dot": 2,
    "T_left": 3,
    "angle": 2, "angle_dot": 2, "spin": 2, "m_r": 2, "m_A": 3, "m_v": 2, "m_omega": 2, "m_wrench": 2, "m_bias": 2,
    "P": 3, "V": 3, "Z": 3, "p": 2,
}  # fmt: skip
N_DIMENSIONS_ROWS = {"r": 3, "p": 3, "q": 2, "u": 2, "u_dot": 2, "w": 2, "diagnostics": 2, "drift": 3}
WORD = ir.IntType(64)


class Structure(types.Type):
    """A pointer to a table, with a named array for each field."""

    def __init__(self, kind):
        self.fields = {}  # name: (type of the array, where its address stands)
        n_dimensions = N_DIMENSIONS_ROWS if kind is Rows else N_DIMENSIONS
        place = 0
        for name, annotation in kind.__annotations__.items():
            number = types.int64 if "int" in str(annotation).lower() else types.float64
            n = n_dimensions.get(name, 1)
            self.fields[name] = (array_type(number, n), place)
            place += 1 + n
        super().__init__(f"Structure({kind.__name__})")


register_model(Structure)(models.OpaqueModel)


@infer_getattr
class StructureFields(AttributeTemplate):
    """Types of the fields."""

    key = Structure

    def generic_resolve(self, structure, name):  # type: ignore[override]
        """Return the type of a field, None if there is none of that name."""
        return structure.fields.get(name, (None,))[0]


@lower_getattr_generic(Structure)
def get_field(context, builder, structure, pointer, name):
    """Return the array of a field, made of the address and the shape in the table."""
    kind, place = structure.fields[name]
    table = builder.bitcast(pointer, WORD.as_pointer())
    words = []
    for k in range(1 + kind.ndim):
        word = builder.load(builder.gep(table, [WORD(place + k)], inbounds=True))
        word.set_metadata("invariant.load", builder.module.add_metadata([]))
        words.append(word)
    data = builder.inttoptr(words[0], context.get_data_type(kind.dtype).as_pointer())
    return array_value(context, builder, kind, data, words[1:])


def converter(kind):
    """Return a compiled function from a table to the structure of that kind."""
    structure = Structure(kind)

    @intrinsic
    def convert(typing_context, table):
        def generate(context, builder, signature, arguments):
            array = make_array(signature.args[0])(context, builder, arguments[0])
            return builder.bitcast(array.data, cgutils.voidptr_t)

        return structure(table), generate

    return convert


as_model, as_work, as_memory, as_rows = converter(Model), converter(Work), converter(Memory), converter(Rows)


def table_of(data: Model | Work | Memory | Rows) -> IntArray:
    """Return addresses and shapes of the arrays, which the caller keeps alive."""
    words: list[int] = []
    for array in data:
        words.append(array.__array_interface__["data"][0])
        words += array.shape
    return np.array(words, np.int64)
