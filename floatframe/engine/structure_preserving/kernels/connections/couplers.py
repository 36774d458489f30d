"""Couplers over a step, see `floatframe.engine.structure_preserving.couplers` for the formulas."""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.structure_preserving.kernels.coordinates import (
    add_coordinate_force,
    coordinate_change,
    ends_of_step,
)
from floatframe.engine.structure_preserving.kernels.rows import held

__all__ = ["add_coupler_reaction", "coupler_change", "coupler_rate", "coupler_value"]


@inner
def coupler_value(model, step, c):
    """Return the value of the row of coupler c at the end of the step."""
    i = model.connections.item[c]
    k = model.elements.core[i]
    constant, _ = held(model, k, step.t_1)
    total = -constant
    for p in range(model.elements.coordinate0[i], model.elements.coordinate0[i + 1]):
        row, a, b = model.coordinates.row[p], model.coordinates.a[p], model.coordinates.b[p]
        _, end = ends_of_step(model, step, row, a, b)
        total += model.coordinates.factor[p] * end
    return model.rows.x[k, 0] * total


@inner
def add_coupler_reaction(model, discrete, step, c, f):
    """Add the loads of coupler c with multiplier f: their work is f times the change of its row."""
    i = model.connections.item[c]
    scale = model.rows.x[model.elements.core[i], 0]
    for p in range(model.elements.coordinate0[i], model.elements.coordinate0[i + 1]):
        row, a, b = model.coordinates.row[p], model.coordinates.a[p], model.coordinates.b[p]
        add_coordinate_force(model, discrete, step, row, a, b, scale * model.coordinates.factor[p] * f)


@inner
def coupler_change(model, discrete, step, c):
    """Return the change of the row of coupler c by the motion over the step."""
    i, total = model.connections.item[c], 0.0
    for p in range(model.elements.coordinate0[i], model.elements.coordinate0[i + 1]):
        row, a, b = model.coordinates.row[p], model.coordinates.a[p], model.coordinates.b[p]
        total += model.coordinates.factor[p] * coordinate_change(model, discrete, step, row, a, b)
    return model.rows.x[model.elements.core[i], 0] * total


@inner
def coupler_rate(model, c, t):
    """Return the rate of the row of coupler c while nothing moves."""
    k = model.elements.core[model.connections.item[c]]
    _, rate = held(model, k, t)
    return -model.rows.x[k, 0] * rate
