"""Rows that define the wrench of a joint: zero along free directions, and balance of its parts on A and B.

A kind consists of two functions: `value`(model, work, k, a, b, w) with w the wrench of the connection, and
`derivatives`(model, work, k, a, b, w, c_k, by, V), which writes row r of P (times c_k) and of V. Both rows
must be zero before. A direction E that rotates with a marker changes by dphi × E, so that
d(E · W) = dphi · (E × W) + E · dW.
"""

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.relative_motion import direction, distance, put_pair
from floatframe.engine.kernels.vector import add, cross, dot, put, scaled, sub, vector
from floatframe.model.joints.rows.kinds import FORCE, MOMENT, MOMENT_B

__all__ = [
    "arm_derivatives",
    "arm_value",
    "gauge_b_derivatives",
    "gauge_b_value",
    "gauge_derivatives",
    "gauge_value",
    "rod_derivatives",
    "rod_value",
    "thread_derivatives",
    "thread_value",
]


@small
def gauge_value(model, work, k, a, b, w):
    """Return the value of GAUGE: E · part."""
    rows = model.rows
    return dot(direction(work.markers, a, rows.x[k]), vector(w[rows.part[k] :]))


@small
def gauge_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of GAUGE."""
    rows = model.rows
    part, E = rows.part[k], direction(work.markers, a, rows.x[k])
    put(by.a, 3, scaled(c_k, cross(E, vector(w[part:]))))
    put(V, part, E)


@inner
def gauge_b_value(model, work, k, a, b, w):
    """Return the value of GAUGE_B: D · part."""
    rows = model.rows
    return dot(direction(work.markers, b, rows.y[k]), vector(w[rows.part[k] :]))


@inner
def gauge_b_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of GAUGE_B."""
    rows = model.rows
    part, D = rows.part[k], direction(work.markers, b, rows.y[k])
    put(by.b, 3, scaled(c_k, cross(D, vector(w[part:]))))
    put(V, part, D)


@inner
def thread_value(model, work, k, a, b, w):
    """Return the value of THREAD: E · (N + c F)."""
    rows = model.rows
    W = add(vector(w[MOMENT_B:]), scaled(rows.c[k], vector(w)))
    return dot(direction(work.markers, a, rows.x[k]), W)


@inner
def thread_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of THREAD."""
    rows = model.rows
    c, E = rows.c[k], direction(work.markers, a, rows.x[k])
    W = add(vector(w[MOMENT_B:]), scaled(c, vector(w)))
    put(by.a, 3, scaled(c_k, cross(E, W)))
    put(V, MOMENT_B, E)
    put(V, FORCE, scaled(c, E))


@small
def arm_value(model, work, k, a, b, w):
    """Return the value of ARM, x · (M - N - d × F), x in ground axes; without N if only the force acts on B."""
    M = sub(vector(w[MOMENT:]), cross(distance(work.markers, a, b), vector(w)))
    if len(w) > MOMENT_B:
        M = sub(M, vector(w[MOMENT_B:]))
    return dot(vector(model.rows.x[k]), M)


@small
def arm_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of ARM; (x × d) · F = d · (F × x)."""
    x, d = vector(model.rows.x[k]), distance(work.markers, a, b)
    put(V, FORCE, cross(d, x))
    put(V, MOMENT, x)
    if len(w) > MOMENT_B:
        put(V, MOMENT_B, scaled(-1.0, x))
    put_pair(by, 0, scaled(c_k, cross(vector(w), x)))


@inner
def rod_value(model, work, k, a, b, w):
    """Return the value of ROD: x · (F - mu d), x in ground axes."""
    return dot(vector(model.rows.x[k]), sub(vector(w), scaled(w[3], distance(work.markers, a, b))))


@inner
def rod_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of ROD."""
    x = vector(model.rows.x[k])
    put(V, FORCE, x)
    V[3] = -dot(x, distance(work.markers, a, b))
    put_pair(by, 0, scaled(c_k * w[3], x))
