"""The model and the working arrays as the inner functions see them: one pointer each instead of hundreds of arguments.

Python hands plain tuples of arrays to the entries; an entry packs each into a structure and passes that on. (Passed
on as tuples they would cost each inner function some nine hundred machine arguments, and minutes of compilation.)
"""

import numpy as np
from numba import typeof, types
from numba.experimental import structref

from floatframe.kernels.compilation import merged
from floatframe.kernels.model import Memory, Model, Rows, Work

__all__ = ["pack_memory", "pack_model", "pack_rows", "pack_work"]

N_DIMENSIONS = {  # of the fields that are not vectors
    "S": 2, "J0": 3, "block0": 2, "is_diagonal": 2, "m_position": 2, "m_triad": 3, "row_x": 2, "row_y": 2,
    "springs": 2, "l_force": 2, "l_torque": 2,
    "r": 2, "R": 3, "theta": 2, "a_B": 2, "J": 3, "turning": 3, "D_q_dot": 3, "rho": 2, "rho_dot": 2, "T_left": 3,
    "angle": 2, "angle_dot": 2, "spin": 2, "m_r": 2, "m_A": 3, "m_v": 2, "m_omega": 2, "m_wrench": 2, "m_bias": 2,
    "P": 3, "V": 3, "Z": 3, "p": 2,
}  # fmt: skip
N_DIMENSIONS_ROWS = {"r": 3, "p": 3, "q": 2, "u": 2, "u_dot": 2, "w": 2, "diagnostics": 2, "drift": 3}


@structref.register
class Structure(types.StructRef):
    """A heap object with named arrays."""


def packer(kind, n_dimensions):
    """Return a compiled function from a tuple of arrays to the structure with the same fields.

    The assignments are written out as source text, since numba knows no loop over the names of fields.
    """
    fields = []
    for name, annotation in kind.__annotations__.items():
        dtype = np.int64 if "int" in str(annotation) else np.float64
        fields.append((name, typeof(np.zeros((1,) * n_dimensions.get(name, 1), dtype))))
    lines = [f"    packed.{name} = data.{name}" for name, _ in fields]
    text = "\n".join(["def pack(data):", "    packed = new(structure)", *lines, "    return packed"])
    scope = {"new": structref.new, "structure": Structure(fields)}
    exec(text, scope)
    return merged(scope["pack"])


pack_model = packer(Model, N_DIMENSIONS)
pack_work = packer(Work, N_DIMENSIONS)
pack_memory = packer(Memory, N_DIMENSIONS)
pack_rows = packer(Rows, N_DIMENSIONS_ROWS)
