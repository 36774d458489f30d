"""Coordinate couplers (gears): Σ a_p x_p - c(t) = 0 over the coordinates of a connection.

The multiplier lam is the last unknown; the force along coordinate p is Q_p = a_p lam. The constraint row is divided by
its largest coefficient (`row_x`), so that all rows have entries of similar size. While a coupler is not engaged, its
row is lam = 0.

Described in `floatframe.model.joints.coordinate_coupler`.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.coordinate import (
    coordinate_gradient,
    coordinate_motion,
    coordinate_second_rate,
    coordinate_tangent_rate,
    derivatives_along_coordinates,
    indices_of,
    rows_along_coordinates,
)
from floatframe.engine.kernels.joints.relative_motion import prescribed
from floatframe.model.joints.rows.kinds import RELEASED

__all__ = ["coupler_derivatives", "coupler_power", "coupler_rate", "coupler_rates", "coupler_rows"]


@inner
def coupler_rows(model, work, c, c_k):
    """Write the residual of coupler c, and its wrenches."""
    i, first, last = indices_of(model, c)
    k = model.elements.core[i]
    lam = work.state.w[k]
    rows_along_coordinates(model, work, c, c_k)
    total = 0.0
    if model.rows.kind[k] != RELEASED:
        held, _, _ = prescribed(model, work, k)
        total = -held
    for p in range(first, last):
        x, _ = coordinate_motion(model, work, p)
        total += model.coordinates.factor[p] * x
    work.connections.g[k] = c_k * lam if model.rows.kind[k] == RELEASED else model.rows.x[k, 0] * total


@inner
def coupler_derivatives(model, work, c, c_k):
    """Write the derivatives of coupler c: P by the motion of its markers, V by its own wrench."""
    i, first, last = indices_of(model, c)
    k, V = model.elements.core[i], work.connections.V[c]
    derivatives_along_coordinates(model, work, c, c_k)
    r = k - model.connections.w0[c]
    if model.rows.kind[k] == RELEASED:
        V[r, r] = 1.0
        return
    for p in range(first, last):
        coordinate_gradient(model, work, p, r, model.coordinates.factor[p] * model.rows.x[k, 0], 0.0)


@inner
def coupler_rate(model, work, c):
    """Return the rate of the constraint row of coupler c; zero while it is not engaged."""
    i, first, last = indices_of(model, c)
    k = model.elements.core[i]
    if model.rows.kind[k] == RELEASED:
        return 0.0
    _, rate, _ = prescribed(model, work, k)
    total = -rate
    for p in range(first, last):
        total += model.coordinates.factor[p] * coordinate_tangent_rate(model, work, p)
    return model.rows.x[k, 0] * total


@inner
def coupler_rates(model, work, c, rate, bias):
    """Write the rate of the constraint row of coupler c, and its second rate at zero u_dot."""
    i, first, last = indices_of(model, c)
    k = model.elements.core[i]
    rate[k], bias[k] = coupler_rate(model, work, c), 0.0
    if model.rows.kind[k] == RELEASED:
        return
    _, _, second = prescribed(model, work, k)
    second = -second
    for p in range(first, last):
        factor = model.coordinates.factor[p]
        second += factor * coordinate_second_rate(
            model, work, p, work.markers.bias[model.coordinates.a[p]], work.markers.bias[model.coordinates.b[p]]
        )
    bias[k] = model.rows.x[k, 0] * second


@inner
def coupler_power(model, work, c):
    """Return the power lam dc/dt that a time-dependent constant of the coupler supplies."""
    k = model.elements.core[model.connections.item[c]]
    if model.rows.kind[k] == RELEASED:
        return 0.0
    _, first, _ = prescribed(model, work, k)
    return work.state.w[k] * first
