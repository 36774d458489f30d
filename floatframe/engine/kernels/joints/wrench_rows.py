"""Rows that define the wrench of a joint: zero along free directions, and balance of its parts on A and B.

A kind consists of two functions: `value`(model, work, k, a, b, w) with w the wrench of the connection, and
`derivatives`(model, work, k, a, b, w, c_k, by, V), which writes row r of P (times c_k) and of V. Both rows
must be zero before. A direction E that rotates with a marker changes by dphi × E, so that
d(E · W) = dphi · (E × W) + E · dW.
"""

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.relative_motion import direction, distance, put_pair
from floatframe.engine.kernels.vector import add, cross, dot, put, put_sum, scaled, sub, vector
from floatframe.model.joints.rows.kinds import FORCE, GAUGE_B, MOMENT, MOMENT_B, THREAD

__all__ = [
    "arm_derivatives",
    "arm_value",
    "gauge_derivatives",
    "gauge_value",
    "rod_derivatives",
    "rod_value",
]


@small
def gauge(rows, markers, k, a, b):
    """Return E, part and c of row k, E · (part + c F) = 0. E is fixed in B for GAUGE_B; only THREAD has c."""
    if rows.kind[k] == GAUGE_B:
        return direction(markers, b, rows.y[k]), rows.part[k], 0.0
    E = direction(markers, a, rows.x[k])
    if rows.kind[k] == THREAD:
        return E, MOMENT_B, rows.c[k]
    return E, rows.part[k], 0.0


@small
def gauge_value(model, work, k, a, b, w):
    """Return the value of GAUGE, GAUGE_B or THREAD."""
    E, part, c = gauge(model.rows, work.markers, k, a, b)
    g = dot(E, vector(w[part:]))
    return g if c == 0.0 else g + c * dot(E, vector(w))


@small
def gauge_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of GAUGE, GAUGE_B or THREAD."""
    E, part, c = gauge(model.rows, work.markers, k, a, b)
    turn = cross(E, add(vector(w[part:]), scaled(c, vector(w))))
    put(by.b if model.rows.kind[k] == GAUGE_B else by.a, 3, scaled(c_k, turn))
    put(V, part, E)
    put_sum(V, FORCE, scaled(c, E))


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
