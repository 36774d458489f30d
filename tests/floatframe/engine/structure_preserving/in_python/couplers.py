"""Couplers over a step: Σ a_p x_p = c(t_1) at its end, by forces a_p lam along the coordinates.

Formulas: `floatframe.engine.structure_preserving.kernels.held_rows`.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.engine.structure_preserving.system import coordinates_of
from tests.floatframe.engine.structure_preserving.in_python.constraints import Loads, Pair, Span, held
from tests.floatframe.engine.structure_preserving.in_python.coordinates import (
    add_coordinate_force,
    coordinate_ends,
    counted,
)


def coupler_value(model: Model, c: int, pairs: list[Pair], span: Span) -> Array:
    """Return the value of the row of coupler c at the end of a step."""
    i = int(model.connections.item[c])
    k = int(model.elements.core[i])
    total: Array = np.array(-held(model, k, span.t_1))
    for p, pair in zip(coordinates_of(model, i), pairs, strict=True):
        row = int(model.coordinates.row[p])
        _, end = coordinate_ends(model, row, pair)
        total = total + model.coordinates.factor[p] * counted(model, row, end, span.w[row])
    return np.asarray(model.rows.x[k, 0] * total)


def add_coupler_reaction(model: Model, c: int, pairs: list[Pair], loads: list[Loads], f: Array) -> None:
    """Add the loads of coupler c with multiplier f, (...,), whose work is f times the change of its row."""
    i = int(model.connections.item[c])
    scale = model.rows.x[int(model.elements.core[i]), 0]
    for p, pair, load in zip(coordinates_of(model, i), pairs, loads, strict=True):
        row = int(model.coordinates.row[p])
        add_coordinate_force(model, row, pair, load, scale * model.coordinates.factor[p] * f)
