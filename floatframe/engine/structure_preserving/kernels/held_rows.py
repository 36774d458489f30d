"""Rows that hold something over a step, of joints and couplers: one place that knows all kinds."""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.structure_preserving.kernels import deformed_lines, rows
from floatframe.engine.structure_preserving.kernels.connections import couplers, rolling
from floatframe.engine.structure_preserving.kernels.coordinates import (
    add_coordinate_force,
    coordinate_change,
    ends_of_step,
)
from floatframe.engine.structure_preserving.kernels.rows import held
from floatframe.model.joints.rows.kinds import COUPLE, LINE, LINE_TURN, RIM_HEIGHT, ROLL

__all__ = [
    "add_coupler_reaction",
    "add_reaction",
    "coupler_change",
    "coupler_rate",
    "coupler_value",
    "row_change",
    "row_rate",
    "row_value",
]


@inner
def row_value(model, step, c, k):
    """Return the value of row k of connection c at the end of a step."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        return couplers.coupler_value(model, step, c)
    if kind == RIM_HEIGHT:
        return rolling.height_value(model, step, k, a, b)
    if kind == ROLL:
        return rolling.roll_value(model, step, k, a, b)
    if kind == LINE or kind == LINE_TURN:
        return deformed_lines.line_value(model, step, k, a, b)
    return rows.row_value(model, step, k, a, b)


@inner
def add_reaction(model, discrete, step, c, k, f):
    """Add the loads of row k of connection c with multiplier f: their work is f times the change of the row."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        couplers.add_coupler_reaction(model, discrete, step, c, f)
    elif kind == RIM_HEIGHT:
        rolling.add_height_reaction(model, discrete, step, k, a, b, f)
    elif kind == ROLL:
        rolling.add_roll_reaction(model, step, k, a, b, f)
    elif kind == LINE or kind == LINE_TURN:
        deformed_lines.add_line_reaction(model, discrete, step, k, a, b, f)
    else:
        rows.add_reaction(model, discrete, step, k, a, b, f)


@inner
def row_change(model, discrete, step, c, k):
    """Return the change of row k over the step, by the motion alone; those of a rolling disc are in no such need."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        return couplers.coupler_change(model, discrete, step, c)
    if kind == LINE or kind == LINE_TURN:
        return deformed_lines.line_change(model, discrete, step, k, a, b)
    return rows.row_change(model, discrete, step, k, a, b)


@inner
def row_rate(model, step, c, k, t):
    """Return the rate of row k at the beginning of a step while nothing moves: that of a prescribed motion."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        return couplers.coupler_rate(model, c, t)
    if kind == LINE or kind == LINE_TURN:
        return deformed_lines.line_rate(model, step, k, a, b, t)
    return rows.row_rate(model, step, k, a, b, t)


# couplers over a step, see `floatframe.engine.structure_preserving.couplers` for the formulas -------------------------


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
