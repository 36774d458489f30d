"""Equations of motion of one body, complete in the deformation (docs/theory.md §6-7), and their tangent.

Components are in body axes; a is the acceleration of the frame origin minus gravity, alpha the angular acceleration.
With W_ab = S_ab q, 1C(q) = 1C + K_t q, s = S + 1C q + 1/2 qᵀ K_t q (K_t and K_r are zero unless the body is stiffened):

    T_k    = (tr W_k) 1 - W_k                                  (= Σ_l 5C_lk q_l)
    D_k    = 3C_k + T_k
    B_k    = 2C_k + (W_zy - W_yz, W_xz - W_zx, W_yx - W_xy)_k  (= 2C_k + Σ_l 4C_kl q_l)
    J      = J0 + G + Gᵀ,  G = Σ q_k (3C_k + T_k/2)
    Y_k    = Σ_l 4C_kl q_dot_l
    (1) m a + alpha × s + 1C(q) q_ddot + q_dotᵀK_t q_dot + 2 omega × (1C(q) q_dot) + omega × (omega × s)  = f
    (2) s × a + J alpha + Σ B_k q_ddot_k + q_dotᵀK_r q_dot + 2 (Σ q_dot_k D_k) omega + omega × (J omega)  = tau
    (3) 1C_k(q)·a + B_k·alpha + (M q_ddot)_k + 2 Y_k·omega - omegaᵀ D_k omega + (D q_dot + K q)_k         = h_k

The matrices K_ab and K_r of a stiffened body are part of its S_ab (`compiling.stiffening`), so that the formulas for B,
D and J include them. Most of the cost is one pass over S_ab (9 n² numbers), one over 4C (3 n²), and one over K_t and
K_r (6 n²).
"""

from typing import NamedTuple

from floatframe.engine.kernels.compiler.compilation import loops, small, view
from floatframe.engine.kernels.dense import add_products, flat, matrix_at, rows_of
from floatframe.engine.kernels.model import C1, C2, C3, C4, DAMPING, K_ROTATION, K_TRANSLATION, MASS, S_AB, STIFFNESS
from floatframe.engine.kernels.vector import (
    add,
    add_column,
    axial,
    copy,
    cross,
    dot,
    matrix,
    matrix_sum,
    product,
    put,
    put_block,
    put_column,
    put_matrix,
    put_sum,
    scaled,
    scaled_matrix,
    sub,
    tilde,
    transposed,
    turned,
    turned_back,
    unit,
    unit_matrix,
    vector,
)

__all__ = [
    "NewtonWeights",
    "body_forces",
    "body_mass_product",
    "body_tangent",
    "constant_products",
    "coupling",
    "gyroscopic",
    "inertia_rate",
    "modal_block",
    "modal_matrix",
    "modal_number",
    "modal_term",
    "moved_inertia",
    "newton_block",
    "shape_moments",
]


class NewtonWeights(NamedTuple):
    """Weights of a Newton matrix: changes of accelerations, velocities and positions by its unknowns."""

    c_m: float  #: of the mass
    c_d: float  #: of the damping
    c_k: float  #: of the stiffness


@view
def block(types, t, which, rows, columns):
    """Return one constant matrix (rows, columns) of a type of bodies as a view of the flat array of all matrices."""
    return matrix_at(types.blocks, types.block0[t, which], rows, columns)


@view
def modal_matrix(types, t, which, n):
    """Return one constant matrix (n, n) of a type of bodies, which is not stored as a diagonal."""
    return block(types, t, which, n, n)


@view
def modal_diagonal(types, t, which, n):
    """Return one constant matrix (n, n) of a type of bodies that is stored as a diagonal, as a vector."""
    return block(types, t, which, 1, n)[0]


@view
def newton_block(model, work, i):
    """Return the Newton matrix of body i, (6 + n, 6 + n), as a view of the flat array of all matrices."""
    n = 6 + model.bodies.n_q[i]
    return matrix_at(work.solver.H, model.bodies.h0[i], n, n)


@loops
def column(A, k):
    """Return the first three numbers of column k of a matrix A [a, k]."""
    return A[0, k], A[1, k], A[2, k]


@loops
def tensor(A, k):
    """Return matrix k of a tensor A [ab, k]."""
    return column(A, k), column(A[3:], k), column(A[6:], k)


@loops
def column_sum(A, x):
    """Return Σ A[a, k] x_k."""
    total = (0.0, 0.0, 0.0)
    for k in range(A.shape[1]):
        total = add(total, scaled(x[k], column(A, k)))
    return total


@loops
def tensor_sum(A, x):
    """Return Σ A[ab, k] x_k."""
    return column_sum(A, x), column_sum(A[3:], x), column_sum(A[6:], x)


@loops
def trace_less(W):
    """Return (tr W) 1 - W for a matrix W."""
    x, y, z = W[0][0], W[1][1], W[2][2]
    return (y + z, -W[0][1], -W[0][2]), (-W[1][0], x + z, -W[1][2]), (-W[2][0], -W[2][1], x + y)


@loops
def coupling(second, W, k):
    """Return B_k, the coupling of mode k with rotation, from the invariants 2C (`second`) and W."""
    return add(column(second, k), axial(tensor(W, k)))


@loops
def inertia_rate(third, W, k):
    """Return D_k, where dJ/dq_k = D_k + D_kᵀ, from the invariants 3C (`third`) and W."""
    return matrix_sum(tensor(third, k), trace_less(tensor(W, k)))


@loops
def moved_inertia(m, s, J, p):
    """Shift first moment s and inertia J of a mass m by p, the vector from the new to the old reference point."""
    y = add(s, scaled(0.5 * m, p))
    d = 2.0 * dot(p, y)
    rows = (
        sub(J[0], add(scaled(y[0], p), scaled(p[0], y))),
        sub(J[1], add(scaled(y[1], p), scaled(p[1], y))),
        sub(J[2], add(scaled(y[2], p), scaled(p[2], y))),
    )
    return add(s, scaled(m, p)), matrix_sum(rows, ((d, 0.0, 0.0), (0.0, d, 0.0), (0.0, 0.0, d)))


@small
def modal_number(types, t, n, which, k):
    """Return entry k of the diagonal of a modal matrix M, K or D."""
    if types.is_diagonal[t, which - MASS]:
        return modal_diagonal(types, t, which, n)[k]
    return modal_matrix(types, t, which, n)[k, k]


@loops
def modal_term(types, t, n, which, factor, x, out):
    """Add `factor` times the product of a modal matrix M, K or D with x to `out`, (n_q,)."""
    if types.is_diagonal[t, which - MASS]:
        diagonal = modal_diagonal(types, t, which, n)
        for k in range(n):
            out[k] += factor * (diagonal[k] * x[k])
    else:
        A = modal_matrix(types, t, which, n)
        for k in range(n):
            total = 0.0
            for j in range(n):
                total += A[k, j] * x[j]
            out[k] += factor * total


@loops
def constant_products(types, t, which, x, out):
    """Write Σ_l A_l x_l for one constant array of a type of bodies, whose matrices A_l have the shape of `out`."""
    products = flat(out)
    products[:] = 0.0
    add_products(block(types, t, which, x.shape[0], products.shape[0]), x, products)


@loops
def shape_moments(types, t, n, q, first):
    """Write 1C(q) = ds/dq of a type of bodies into `first`, (3, n); return its first moment s(q)."""
    own = block(types, t, C1, 3, n)
    copy(flat(own), flat(first))
    if types.has_unit_loads[t]:
        add_products(block(types, t, K_TRANSLATION, n, 3 * n), q, flat(first))
    return add(vector(types.S[t]), scaled(0.5, add(column_sum(own, q), column_sum(first, q))))


@loops
def first_moments(model, work, i):
    """Write s(q), 1C(q) = ds/dq, and for a stiffened body K_t q_dot and K_r q_dot, into work.bodies."""
    types, bodies = model.body_types, work.bodies
    t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i] + 6
    if n == 0:
        put(bodies.s[i], 0, vector(types.S[t]))
        return
    put(bodies.s[i], 0, shape_moments(types, t, n, work.state.q[q0 : q0 + n], rows_of(bodies.C1, 3, q0, n)))
    if types.has_unit_loads[t]:
        q_dot = work.state.u[u0 : u0 + n]
        constant_products(types, t, K_TRANSLATION, q_dot, rows_of(bodies.K_t_q_dot, 3, q0, n))
        constant_products(types, t, K_ROTATION, q_dot, rows_of(bodies.K_r_q_dot, 3, q0, n))


@loops
def body_forces(model, work, i):
    """Write inertia and elastic forces of body i, (1) to (3), into the residual, and s, 1C, W, Y, J, D_q_dot."""
    types, bodies, R = model.body_types, work.bodies, work.state.R[i]
    t, n, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.u0[i]
    u, u_dot = work.state.u[u0 : u0 + 6 + n], work.state.u_dot[u0 : u0 + 6 + n]
    a, omega, alpha = turned_back(R, sub(u_dot, model.gravity)), vector(u[3:]), vector(u_dot[3:])
    put(bodies.a_B[i], 0, a)
    first_moments(model, work, i)
    f, tau = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if n > 0:
        f, tau = modal_forces(model, work, i, a)
    else:
        put_matrix(bodies.J[i], types.J0[t])
        put_matrix(bodies.D_q_dot[i], (tau, tau, tau))
    m, s, J, residual = types.mass[t], vector(bodies.s[i]), bodies.J[i], bodies.residual[u0 : u0 + 6]
    f = add(f, add(scaled(m, a), add(cross(alpha, s), cross(omega, cross(omega, s)))))
    tau = add(tau, add(cross(s, a), add(turned(J, alpha), cross(omega, turned(J, omega)))))
    put(residual, 0, f)
    put(residual, 3, tau)


@loops
def modal_forces(model, work, i, a):
    """Write the modal forces (3) of body i and W, Y, J, D_q_dot; return the modal terms of (1) and (2)."""
    types, bodies = model.body_types, work.bodies
    t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i] + 6
    q, q_dot, q_ddot = work.state.q[q0 : q0 + n], work.state.u[u0 : u0 + n], work.state.u_dot[u0 : u0 + n]
    omega, alpha = vector(work.state.u[u0 - 3 :]), vector(work.state.u_dot[u0 - 3 :])
    W, Y, first = rows_of(bodies.W, 9, q0, n), rows_of(bodies.Y, 3, q0, n), rows_of(bodies.C1, 3, q0, n)
    constant_products(types, t, S_AB, q, W)
    constant_products(types, t, C4, q_dot, Y)
    second, third, h = block(types, t, C2, 3, n), block(types, t, C3, 9, n), bodies.residual[u0 : u0 + n]
    zero = (0.0, 0.0, 0.0)
    tau, G, D_q_dot = zero, (zero, zero, zero), (zero, zero, zero)
    for k in range(n):
        D_k, B_k = inertia_rate(third, W, k), coupling(second, W, k)
        G = matrix_sum(G, scaled_matrix(0.5 * q[k], matrix_sum(tensor(third, k), D_k)))  # C_k + T_k/2
        D_q_dot = matrix_sum(D_q_dot, scaled_matrix(q_dot[k], D_k))
        tau = add(tau, scaled(q_ddot[k], B_k))
        h[k] = (
            dot(column(first, k), a) + dot(B_k, alpha) + 2 * dot(column(Y, k), omega) - dot(omega, turned(D_k, omega))
        )
    put_matrix(bodies.J[i], matrix_sum(matrix(types.J0[t]), matrix_sum(G, transposed(G))))
    put_matrix(bodies.D_q_dot[i], D_q_dot)
    modal_term(types, t, n, MASS, 1.0, q_ddot, h)
    modal_term(types, t, n, DAMPING, 1.0, q_dot, h)
    modal_term(types, t, n, STIFFNESS, 1.0, q, h)
    f = add(column_sum(first, q_ddot), cross(scaled(2.0, omega), column_sum(first, q_dot)))
    tau = add(tau, scaled(2.0, turned(D_q_dot, omega)))
    if types.has_unit_loads[t]:
        f = add(f, column_sum(rows_of(bodies.K_t_q_dot, 3, q0, n), q_dot))
        tau = add(tau, column_sum(rows_of(bodies.K_r_q_dot, 3, q0, n), q_dot))
    return f, tau


@loops
def body_mass_product(model, work, i, v, out):
    """Write the generalised momenta M u of body i into out, (6 + n_q,); v: its velocities, v_GO in body axes.

    `body_forces` must have been called for this configuration.
    """
    types, bodies = model.body_types, work.bodies
    t, n, q0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i]
    s, v_O, omega, q_dot = vector(bodies.s[i]), vector(v), vector(v[3:]), v[6:]
    first = rows_of(bodies.C1, 3, q0, n)
    put(out, 0, add(scaled(types.mass[t], v_O), add(cross(omega, s), column_sum(first, q_dot))))
    put(out, 3, add(cross(s, v_O), turned(bodies.J[i], omega)))
    if n > 0:
        W, second = rows_of(bodies.W, 9, q0, n), block(types, t, C2, 3, n)
        for k in range(n):
            B_k = coupling(second, W, k)
            put_sum(out, 3, scaled(q_dot[k], B_k))
            out[6 + k] = dot(column(first, k), v_O) + dot(B_k, omega)
        modal_term(types, t, n, MASS, 1.0, q_dot, out[6:])


@loops
def gyroscopic(omega, J, D):
    """Return the derivative of omega × J omega + 2 D omega by omega, which is omega~ J - (J omega)~ + 2 D."""
    turning = matrix_sum(product(tilde(omega), J), tilde(scaled(-1.0, turned(J, omega))))
    return matrix_sum(scaled_matrix(2.0, D), turning)


@loops
def body_tangent(model, work, i, weights, H, turn):
    """Write the derivative of (1) to (3) into H, (6 + n, 6 + n).

    Columns are (dx, dtheta, dq) with da = c_m dx, dalpha = c_m dtheta, dq_ddot = c_m dq, domega = c_d dtheta,
    dq_dot = c_d dq, and c_k times the derivatives by q. The derivative by the rotation of the body (da = a × dphi) is
    written into turn, (6 + n, 3), without weight. `body_forces` must have been called for this iterate. With
    v = 1C(q) q_dot

        d(1) = m da - tilde(s) dalpha - (2 tilde(v) + tilde(omega × s) + tilde(omega) tilde(s)) domega + ...
        d(2) = tilde(s) da + J dalpha + (2 Σ q_dot_k D_k + tilde(omega) J - tilde(J omega)) domega + ...
    """
    c_m, c_d, _ = weights
    bodies, n, q0, u0 = work.bodies, model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    m, a, s, J = model.body_types.mass[model.bodies.kind[i]], vector(bodies.a_B[i]), vector(bodies.s[i]), bodies.J[i]
    omega, q_dot = vector(work.state.u[u0 + 3 :]), work.state.u[u0 + 6 : u0 + 6 + n]
    v, gyro = column_sum(rows_of(bodies.C1, 3, q0, n), q_dot), gyroscopic(omega, J, matrix(bodies.D_q_dot[i]))
    spin = matrix_sum(tilde(add(scaled(2.0, v), cross(omega, s))), product(tilde(omega), tilde(s)))
    H[:, :] = 0.0
    turn[:, :] = 0.0
    put_block(H, 0, 0, scaled_matrix(c_m * m, unit_matrix()))
    put_block(H, 3, 0, tilde(scaled(c_m, s)))
    put_block(H, 0, 3, matrix_sum(tilde(scaled(-c_m, s)), scaled_matrix(-c_d, spin)))
    put_block(H, 3, 3, matrix_sum(scaled_matrix(c_m, matrix(J)), scaled_matrix(c_d, gyro)))
    put_block(turn, 0, 0, tilde(scaled(m, a)))
    put_block(turn, 3, 0, product(tilde(s), tilde(a)))
    if n > 0:
        modal_tangent(model, work, i, weights, H, turn)
    if work.state.spins[i] != 0:
        spin_columns(model, work, i, c_d, H)


@loops
def spin_columns(model, work, i, c_d, H):
    """Add the derivative of w dtheta × e: rotation of a spinning body's axis e changes its angular acceleration.

    w: spin; see `kernels.generalized_alpha`. The columns of alpha in (1) to (3) are -tilde(s), J, Bᵀ.
    """
    types, bodies = model.body_types, work.bodies
    t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    e = vector(types.axis[t])
    turn = scaled(c_d * dot(e, vector(work.state.u[u0 + 3 :])), e)
    s = vector(bodies.s[i])
    for r in range(3):
        put_sum(H[r], 3, cross(turn, cross(s, unit(r))))
        put_sum(H[3 + r], 3, cross(turn, vector(bodies.J[i, r])))
    W, second = rows_of(bodies.W, 9, q0, n), block(types, t, C2, 3, n)
    for k in range(n):
        put_sum(H[6 + k], 3, cross(turn, coupling(second, W, k)))


@loops
def modal_tangent(model, work, i, weights, H, turn):
    """Write the rows and columns of the modes into H; see `body_tangent`.

    These are the derivatives of (1) by q, of (2) by q without the sums over modes (see `modal_columns`), and of (3) by
    a, alpha, omega. In the code b = 1C_k.
    """
    c_m, c_d, c_k = weights
    types, bodies = model.body_types, work.bodies
    t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    W, Y, first = rows_of(bodies.W, 9, q0, n), rows_of(bodies.Y, 3, q0, n), rows_of(bodies.C1, 3, q0, n)
    second, third = block(types, t, C2, 3, n), block(types, t, C3, 9, n)
    a, omega, alpha = vector(bodies.a_B[i]), vector(work.state.u[u0 + 3 :]), vector(work.state.u_dot[u0 + 3 :])
    for k in range(n):
        b, D_k, B_k = column(first, k), inertia_rate(third, W, k), coupling(second, W, k)
        J_k = matrix_sum(D_k, transposed(D_k))  # dJ/dq_k
        D_omega, J_omega, turning = turned(D_k, omega), turned(J_k, omega), cross(omega, b)
        by_q = add(cross(alpha, b), cross(omega, turning))
        put_column(H, 0, 6 + k, add(scaled(c_m, b), add(scaled(2 * c_d, turning), scaled(c_k, by_q))))
        by_q = add(cross(b, a), add(turned(J_k, alpha), cross(omega, J_omega)))
        put_column(H, 3, 6 + k, add(scaled(c_m, B_k), add(scaled(2 * c_d, D_omega), scaled(c_k, by_q))))
        put(H[6 + k], 0, scaled(c_m, b))
        put(H[6 + k], 3, add(scaled(c_m, B_k), scaled(c_d, sub(scaled(2.0, column(Y, k)), J_omega))))
        put(turn[6 + k], 0, cross(b, a))
    modal_columns(model, work, i, c_d, c_k, H)
    if types.has_unit_loads[t]:
        stiffened_columns(model, work, i, c_d, c_k, H)
    modal_block(types, t, n, MASS, c_m, H)
    modal_block(types, t, n, DAMPING, c_d, H)
    modal_block(types, t, n, STIFFNESS, c_k, H)


@loops
def modal_columns(model, work, i, c_d, c_k, H):
    """Add the terms with 4C and S_ab to H: the modal block, and the remaining derivatives of (2) by q.

    The modal block gets 2 4C_kj·omega (by q_dot) and B'_kj·alpha - omegaᵀ 5C_jk omega (by q); (2) gets
    Σ_k B'_kj q_ddot_k + 2 Σ_k q_dot_k 5C_jk omega. B'_kj is the derivative of B_k by q_j: 4C_kj, and K_r,kj of a
    stiffened body; both are in S_ab. The second term of the modal block is Σ A_ab S_ab,kj - 2 4C_kj·alpha with
    A = tilde(alpha) + tilde(omega) tilde(omega), because alpha·B'_jk = alpha·B'_kj - 2 alpha·4C_kj.
    """
    types, t, n, u0 = model.body_types, model.bodies.kind[i], model.bodies.n_q[i], model.bodies.u0[i] + 6
    S, four = block(types, t, S_AB, n, 9 * n), block(types, t, C4, n, 3 * n)
    q_dot, q_ddot = work.state.u[u0 : u0 + n], work.state.u_dot[u0 : u0 + n]
    omega, alpha = vector(work.state.u[u0 - 3 :]), vector(work.state.u_dot[u0 - 3 :])
    f = scaled(-2.0, add(scaled(c_d, omega), scaled(c_k, alpha)))
    A = scaled_matrix(c_k, matrix_sum(tilde(alpha), product(tilde(omega), tilde(omega))))
    for j in range(n):
        C_j = matrix_at(four[j], 0, 3, n)  # 4C_kj [a, k]
        S_j = matrix_at(S[j], 0, 9, n)  # ∫ phi_a,k phi_b,j [ab, k]
        out = H[6 + j, 6:]  # row j from column j: 4C is antisymmetric in k, j, the rest symmetric
        for k in range(n):
            S_jk = tensor(S_j, k)
            out[k] = dot(f, column(C_j, k)) + (dot(A[0], S_jk[0]) + dot(A[1], S_jk[1]) + dot(A[2], S_jk[2]))
        by_q = add(axial(tensor_sum(S_j, q_ddot)), scaled(2.0, turned(trace_less(tensor_sum(S_j, q_dot)), omega)))
        add_column(H, 3, 6 + j, scaled(c_k, by_q))


@loops
def stiffened_columns(model, work, i, c_d, c_k, H):
    """Add the terms of K_t beyond s(q) and 1C(q), and the derivatives of q_dotᵀ K_t q_dot and q_dotᵀ K_r q_dot."""
    n, q0, u0 = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    K_t = block(model.body_types, model.bodies.kind[i], K_TRANSLATION, n, 3 * n)
    first_dot = rows_of(work.bodies.K_t_q_dot, 3, q0, n)
    turn_dot = rows_of(work.bodies.K_r_q_dot, 3, q0, n)
    a, omega = scaled(c_k, work.bodies.a_B[i]), vector(work.state.u[u0 + 3 :])
    q_ddot = work.state.u_dot[u0 + 6 : u0 + 6 + n]
    for j in range(n):
        K_j = matrix_at(K_t[j], 0, 3, n)  # [a, k]
        out = H[6 + j, 6:]
        for k in range(n):
            out[k] += dot(a, column(K_j, k))
        x = column(first_dot, j)
        by_q = add(column_sum(K_j, q_ddot), scaled(2.0, cross(omega, x)))
        add_column(H, 0, 6 + j, add(scaled(2 * c_d, x), scaled(c_k, by_q)))
        add_column(H, 3, 6 + j, scaled(2 * c_d, column(turn_dot, j)))


@loops
def modal_block(types, t, n, which, factor, H):
    """Add a modal matrix M, K or D, multiplied by `factor`, to the modal block of H."""
    if types.is_diagonal[t, which - MASS]:
        diagonal = modal_diagonal(types, t, which, n)
        for k in range(n):
            H[6 + k, 6 + k] += factor * diagonal[k]
    else:
        A = modal_matrix(types, t, which, n)
        for k in range(n):
            for j in range(n):
                H[6 + k, 6 + j] += factor * A[k, j]
