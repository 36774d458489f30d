"""Change of the forces of a body with the motion of its carrier, ground axes, moments about one point O.

With mass m, first moment s and inertia J about O, momentum p, and D = Σ q_dot_k D_k of the modes (kernels/body.py), the
residual of the body changes, relative to its carrier, by

    I xi_ddot + N xi_dot,   I = [[m, -s~], [s~, J]],   N = [[0, -2 p~], [0, Q]]
    Q y = 2 s × (y × v) - J (omega × y) + y × J omega + omega × J y + 2 D y - 2 r × (p × y)

where in Q the origin of the body is at r, its velocity is v, and s, J are about this origin. The residual of mode k
changes by (b, B)·xi_ddot and by the product of the rotation part of xi_dot with
2 v × b - B × omega + 2 Y - (D_k + D_kᵀ) omega.
"""

from floatframe.engine.kernels.body import block, column, column_sum, coupling, gyroscopic, inertia_rate
from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.dense import rows_of
from floatframe.engine.kernels.model import C2, C3
from floatframe.engine.kernels.vector import (
    add,
    congruent,
    cross,
    matrix,
    matrix_sum,
    product,
    scaled,
    scaled_matrix,
    sub,
    tilde,
    transposed,
    turned,
)

__all__ = ["mode_row", "moments_of_body", "momentum_of_modes", "turning_of_momentum"]


@small
def moments_of_body(model, work, i, R):
    """Return mass, first moment and inertia of body i about its origin, ground axes; call after its forces."""
    m = model.body_types.mass[model.bodies.kind[i]]
    return m, turned(R, work.bodies.s[i]), congruent(R, matrix(work.bodies.J[i]))


@inner
def momentum_of_modes(model, work, i, R):
    """Return the modal momentum of body i and Σ q_dot_k D_k, ground axes."""
    n, q0, u0 = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i] + 6
    p = column_sum(rows_of(work.bodies.C1, 3, q0, n), work.state.u[u0 : u0 + n])
    return turned(R, p), congruent(R, matrix(work.bodies.D_q_dot[i]))


@inner
def turning_of_momentum(m, s, J, by_modes, r, v, omega):
    """Return momentum p and Q about O of a body at r; m, s, J: about its origin, by_modes: from `momentum_of_modes`."""
    p = add(by_modes[0], add(scaled(m, v), cross(omega, s)))
    Q = matrix_sum(scaled_matrix(-2.0, product(tilde(s), tilde(v))), scaled_matrix(-1.0, product(J, tilde(omega))))
    Q = matrix_sum(Q, gyroscopic(omega, J, by_modes[1]))
    return p, matrix_sum(Q, scaled_matrix(-2.0, product(tilde(r), tilde(p))))


@inner
def mode_row(model, work, i, k, R, v, omega):
    """Return b, B and the rotation derivatives of modal row k of body i about its origin; v, omega: body axes."""
    bodies, t, n, q0 = work.bodies, model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i]
    W, Y = rows_of(bodies.W, 9, q0, n), rows_of(bodies.Y, 3, q0, n)
    b, B = column(rows_of(bodies.C1, 3, q0, n), k), coupling(block(model.body_types, t, C2, 3, n), W, k)
    D = inertia_rate(block(model.body_types, t, C3, 9, n), W, k)
    turning = add(cross(B, omega), turned(matrix_sum(D, transposed(D)), omega))
    row = add(scaled(2.0, cross(v, b)), sub(scaled(2.0, column(Y, k)), turning))
    return turned(R, b), turned(R, B), turned(R, row)
