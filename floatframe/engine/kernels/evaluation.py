"""Evaluation of the whole system at one iterate: residuals, and their derivatives for each body.

Described in `floatframe.model.forces.loads`, `floatframe.integrators.ida`.
"""

from floatframe.engine.kernels.body import body_forces, body_tangent, newton_block
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import connection_derivatives, connection_rows
from floatframe.engine.kernels.dense import rows_of
from floatframe.engine.kernels.joints.deformed_line import slide_marker
from floatframe.engine.kernels.marker import (
    marker_columns,
    marker_motion,
    marker_stiffness,
    repeat_motion,
    wrench_to_body,
)
from floatframe.engine.kernels.marker_acceleration import acceleration_columns
from floatframe.engine.kernels.rotation import right_jacobian, spin_jacobian
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import put, put_matrix, put_sum, scaled, turned, turned_back, vector

__all__ = [
    "evaluate",
    "evaluate_bodies",
    "evaluate_markers",
    "linearize",
    "linearize_body",
    "slide_markers",
    "tangent_of_body",
]


@inner
def evaluate(model, work, c_k):
    """Write the residuals of bodies and rows for the iterate in `work`; c_k weights the rows of wrenches."""
    evaluate_markers(model, work)
    for c in range(model.connections.size.shape[0]):
        connection_rows(model, work, c, c_k)
    evaluate_bodies(model, work)


@inner
def evaluate_markers(model, work):
    """Write the motion of all markers and set their wrenches to zero."""
    for m in range(model.markers.body.shape[0]):
        if model.markers.same[m] >= 0:
            repeat_motion(model, work, m)
        else:
            marker_motion(model, work, m)
    slide_markers(model, work)


@inner
def slide_markers(model, work):
    """Move sliding markers to their current positions and set the wrenches of all markers to zero."""
    work.markers.wrench[:, :] = 0.0
    for k in range(model.lines.marker.shape[0]):
        slide_marker(model, work, k)


@inner
def evaluate_bodies(model, work):
    """Write the residuals of bodies, including loads and the wrenches of connections."""
    for k in range(model.loads.marker.shape[0]):
        load_wrench(model, work, k)
    for i in range(model.bodies.kind.shape[0]):
        body_forces(model, work, i)
    for m in range(model.markers.body.shape[0]):
        wrench_to_body(model, work, m)
    for d in range(model.body_loads.body.shape[0]):
        body_load(model, work, d)
    work.counted.evaluations += 1


@inner
def load_wrench(model, work, k):
    """Write the wrench of load k on its marker, ground axes."""
    m = model.loads.marker[k]
    f, t = vector(model.loads.force[k]), vector(model.loads.torque[k])
    factor = 1.0
    if model.loads.factor[k] >= 0:
        factor, _, _ = time_function(model.functions, model.loads.factor[k], work.state.time)
    if model.markers.is_follower[m]:
        f, t = turned(work.markers.A[m], f), turned(work.markers.A[m], t)
    put(work.markers.wrench[m], 0, scaled(factor, f))
    put(work.markers.wrench[m], 3, scaled(factor, t))


@inner
def body_load(model, work, d):
    """Subtract load case d, fixed in the axes of its body, from the residual."""
    i, first = model.body_loads.body[d], model.body_loads.value0[d]
    factor, _, _ = time_function(model.functions, model.body_loads.factor[d], work.state.time)
    for k in range(6 + model.bodies.n_q[i]):
        work.bodies.residual[model.bodies.u0[i] + k] -= factor * model.body_loads.values[first + k]


@inner
def tangent_of_body(model, work, i, weights, H, turning):
    """Write the tangent of body i into H, (6 + n, 6 + n); each wrench is constant in ground axes or marker axes.

    turning, (3, 3): rotation of the body by its unknown dtheta, see `marker_columns`.
    """
    _, _, c_k = weights
    n = model.bodies.n_q[i]
    turn = work.bodies.by_turn[model.bodies.u0[i] : model.bodies.u0[i + 1]]
    body_tangent(model, work, i, weights, H, turn)
    for e in range(model.bodies.end0[i], model.bodies.end0[i + 1]):
        marker_stiffness(model, work, model.bodies.ends[e], c_k, H, turn)
    for e in range(model.bodies.load0[i], model.bodies.load0[i + 1]):
        marker_stiffness(model, work, model.bodies.loaded[e], c_k, H, turn)
    for r in range(6 + n):
        put_sum(H[r], 3, scaled(c_k, turned_back(turning, turn[r])))


@inner
def turning_by_unknown(model, work, i):
    """Return the rotation of body i for a change of its unknown dtheta, body axes.

    R exp(theta) rotates by T(theta) dtheta. If the spin is integrated separately, the orientation is
    R exp(x) exp(xi e), with x normal to e and the unknowns in the axes of the iterate. In these axes it rotates by the
    change of xi along e, and by T(x) dx across e.
    """
    theta = vector(work.state.theta[i])
    if work.state.spins[i] == 0:
        return right_jacobian(theta)
    return spin_jacobian(vector(model.body_types.axis[model.bodies.kind[i]]), theta)


@inner
def linearize(model, work, weights):
    """Write H of every body, J_row and J_column of every end, P and V of every connection, without factorisation."""
    for i in range(model.bodies.kind.shape[0]):
        linearize_body(model, work, i, weights)
    for c in range(model.connections.size.shape[0]):
        connection_derivatives(model, work, c, weights.c_k)


@inner
def linearize_body(model, work, i, weights):
    """Write H of body i, and J_row and J_column of its ends, without factorisation."""
    _, c_d, c_k = weights
    n, rate, turning = 6 + model.bodies.n_q[i], c_d / c_k if c_k > 0.0 else 0.0, work.bodies.T_right[i]
    put_matrix(turning, turning_by_unknown(model, work, i))
    tangent_of_body(model, work, i, weights, newton_block(model, work, i), turning)
    for e in range(model.bodies.end0[i], model.bodies.end0[i + 1]):
        m = model.bodies.ends[e]
        o = model.markers.x0[m]
        column = rows_of(work.solver.J_column, 6, o, n)
        row = rows_of(work.solver.J_row, 12, o, n)
        marker_columns(model, work, m, rate, turning, column, row)
        if model.markers.accelerated[m] >= 0:
            o = model.markers.a0[m]
            row_a = rows_of(work.solver.J_a, 6, o, n)
            acceleration_columns(model, work, m, weights, turning, row_a)
