"""Bodies relative to their centre of mass, and the motion of one body over a step.

With v the velocity of the centre of mass and a = omega × s + 1C q_dot, s = s(q)/m, 1C = ds/dq (divided by the mass
here, and including K_t of a stiffened body, docs/theory.md §7), the kinetic energy separates:

    T = m |v|²/2 + T_r,   T_r = 1/2 omega·J omega + omega·B q_dot + 1/2 q_dot·M q_dot - m |a|²/2 = 1/2 wᵀ M_c(q) w
    Pi = J omega + B q_dot - m s × a,   Y = Bᵀ omega + M q_dot - m 1Cᵀ a,   w = (omega, q_dot)

with J, B, M of theory.md §6 about the frame origin, of degree two in q. The product rule with mean values gives the
changes of products between q_0 and q_1, so that w_0ᵀ (M_c(q_1) - M_c(q_0)) w_1 = 2 Σ (q_1 - q_0)_k N_k exactly, with N
from `inertia_force`.
"""

from typing import NamedTuple

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.body import (
    axial,
    block,
    column,
    column_sum,
    constant_products,
    coupling,
    inertia_rate,
    modal_matrix,
    modal_term,
    shape_moments,
    tensor,
    tensor_sum,
    trace_less,
)
from floatframe.engine.kernels.compiler.compilation import inner, loops
from floatframe.engine.kernels.dense import matrix_at, rows_of
from floatframe.engine.kernels.model import C2, C3, DAMPING, K_TRANSLATION, MASS, S_AB, STIFFNESS
from floatframe.engine.kernels.rotation import matrix_of_euler_parameters
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    matrix_sum,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    scaled_matrix,
    sub,
    turned,
    turned_back,
    vector,
)
from floatframe.engine.structure_preserving.kernels.records import (
    FILTER,
    FREE_TURNING,
    STIFFNESS_FILTER,
    TURNED_PRODUCTS,
    VARIATIONAL,
)

__all__ = ["begin_bodies", "body_inertia", "body_step", "end_rates", "interval", "keep_bodies", "move_bodies"]


@inner
def cayley(theta):
    """Return the rotation matrix of the Cayley vector theta."""
    s = 1.0 / (1.0 + 0.25 * dot(theta, theta))
    x, y, z = theta
    a = 0.5 * s
    return (
        (1.0 - a * (y * y + z * z), a * x * y - s * z, a * x * z + s * y),
        (a * x * y + s * z, 1.0 - a * (x * x + z * z), a * y * z - s * x),
        (a * x * z - s * y, a * y * z + s * x, 1.0 - a * (x * x + y * y)),
    )


@loops
def center(types, t, n, q, C):
    """Return the centre of mass s(q)/m in the body; write its derivative by q, 1C(q)/m, into C, (3, n)."""
    s, f = shape_moments(types, t, n, q, C), 1.0 / types.mass[t]
    for a in range(3):
        for k in range(n):
            C[a, k] *= f
    return scaled(f, s)


@loops
def momenta(types, step, t, n, q, omega, q_dot, Y):
    """Return the angular momentum Pi, and write the modal momenta Y, (n,)."""
    V, C = matrix_at(step.V, 0, 9, n), matrix_at(step.C, 0, 3, n)
    s = shape_moments(types, t, n, q, C)
    a = scaled(1.0 / types.mass[t], add(cross(omega, s), column_sum(C, q_dot)))
    Pi = sub(turned(types.J0[t], omega), cross(s, a))
    if n == 0:
        return Pi
    constant_products(types, t, S_AB, q, V)
    Y[:] = 0.0
    modal_term(types, t, n, MASS, 1.0, q_dot, Y)
    second = block(types, t, C2, 3, n)
    for k in range(n):
        B = coupling(second, V, k)
        Y[k] += dot(B, omega) - dot(column(C, k), a)
        Pi = add(Pi, scaled(q_dot[k], B))
    third = tensor_sum(block(types, t, C3, 9, n), q)
    G = matrix_sum(third, scaled_matrix(0.5, trace_less(tensor_sum(V, q))))  # J = J0 + G + Gᵀ
    return add(Pi, add(turned(G, omega), turned_back(G, omega)))


class ModalMotion(NamedTuple):
    """Modal coordinates of a body with its angular velocity and their rates."""

    q: Array  #: (n,)
    omega: tuple[float, float, float]
    rate: Array  #: (n,)


@loops
def inertia_force(types, discrete, step, t, start, end, q_mean, C_mean, out):
    """Write N_k, (n,), the modal inertia force 1/2 w_0ᵀ M_c,k w_1 between two motions."""
    (q_0, omega_0, rate_0), (q_1, omega_1, rate_1), n = start, end, q_mean.shape[0]
    m, C = types.mass[t], matrix_at(step.C, 0, 3, n)
    V, W = matrix_at(step.V, 0, 9, n), matrix_at(step.W, 0, 9, n)
    constant_products(types, t, S_AB, q_mean, V)
    third = block(types, t, C3, 9, n)
    for k in range(n):
        D = inertia_rate(third, V, k)
        out[k] = dot(omega_0, add(turned(D, omega_1), turned_back(D, omega_1)))
    s_0 = center(types, t, n, q_0, C)
    a_rate_0, a_rate_1 = column_sum(C, rate_0), column_sum(C, rate_1)
    s_mean = scaled(0.5, add(s_0, center(types, t, n, q_1, C)))
    a_rate_0 = scaled(0.5, add(a_rate_0, column_sum(C, rate_0)))
    a_rate_1 = scaled(0.5, add(a_rate_1, column_sum(C, rate_1)))
    for turn in range(2):
        omega, other = (omega_0, omega_1) if turn == 0 else (omega_1, omega_0)
        other_rate = rate_1 if turn == 0 else rate_0
        a = add(cross(omega, s_mean), a_rate_0 if turn == 0 else a_rate_1)
        constant_products(discrete, t, TURNED_PRODUCTS, other_rate, W)
        across = scaled(m, cross(a, other))
        for k in range(n):
            out[k] += dot(omega, axial(tensor(W, k))) - dot(column(C_mean, k), across)
        if types.has_unit_loads[t]:
            constant_products(types, t, K_TRANSLATION, other_rate, C)
            for k in range(n):
                out[k] -= dot(column(C, k), a)
    for k in range(n):
        out[k] *= 0.5


@inner
def begin_bodies(model, step, memory):
    """Write centres of mass, velocities and momenta of all bodies for the state in the memory."""
    for i in range(model.bodies.kind.shape[0]):
        t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
        R = matrix_of_euler_parameters(memory.p[i])
        put_matrix(step.R_0[i], R)
        for k in range(4):
            step.p_0[i, k] = memory.p[i, k]
        q, q_dot, omega = memory.q[q0 : q0 + n], memory.u[u0 + 6 : u0 + 6 + n], vector(memory.u[u0 + 3 :])
        for k in range(n):
            step.q_0[q0 + k] = q[k]
        C = matrix_at(step.C, 0, 3, n)
        s = center(model.body_types, t, n, q, C)
        put(step.s_0[i], 0, s)
        put(step.c_0[i], 0, add(vector(memory.r[i]), turned(R, s)))
        a = add(cross(omega, s), column_sum(C, q_dot))
        put(step.w_0, u0, add(vector(memory.u[u0:]), turned(R, a)))
        for k in range(u0 + 3, u0 + 6 + n):
            step.w_0[k] = memory.u[k]
        put_momenta(model, step, i, q, step.w_0, step.P_0)


@inner
def put_momenta(model, step, i, q, w, P):
    """Write the momenta m v, Pi and Y of body i for velocities w."""
    t, n, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.u0[i]
    put(P, u0, scaled(model.body_types.mass[t], vector(w[u0:])))
    omega, q_dot = vector(w[u0 + 3 :]), w[u0 + 6 : u0 + 6 + n]
    put(P, u0 + 3, momenta(model.body_types, step, t, n, q, omega, q_dot, P[u0 + 6 : u0 + 6 + n]))


@inner
def move_bodies(model, step):
    """Copy the configuration at the end of the step to its beginning."""
    for i in range(model.bodies.kind.shape[0]):
        n, q0, u0 = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
        p, half = step.p_0[i], scaled(0.5, vector(step.z[u0 + 3 :]))
        w, v = p[0], vector(p[1:])
        a, b = w - dot(v, half), add(add(scaled(w, half), v), cross(v, half))
        size = (a * a + dot(b, b)) ** 0.5
        p[0] = a / size
        put(p, 1, scaled(1.0 / size, b))
        R = matrix_of_euler_parameters(p)
        put_matrix(step.R_0[i], R)
        put_sum(step.c_0[i], 0, vector(step.d[i]))
        put(step.z, u0, turned_back(R, vector(step.d[i])))
        put(step.s_0[i], 0, vector(step.s_1[i]))
        for k in range(q0, q0 + n):
            step.q_0[k] = step.q_1[k]


@inner
def keep_bodies(model, step, memory):
    """Write the final configuration, with velocities w_1, into the memory."""
    for i in range(model.bodies.kind.shape[0]):
        t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
        q, q_dot, omega = step.q_0[q0 : q0 + n], step.w_1[u0 + 6 : u0 + 6 + n], vector(step.w_1[u0 + 3 :])
        for k in range(4):
            memory.p[i, k] = step.p_0[i, k]
        for k in range(n):
            memory.q[q0 + k] = q[k]
        R = matrix(step.R_0[i])
        C = matrix_at(step.C, 0, 3, n)
        s = center(model.body_types, t, n, q, C)
        put(memory.r[i], 0, sub(vector(step.c_0[i]), turned(R, s)))
        a = add(cross(omega, s), column_sum(C, q_dot))
        put(memory.u, u0, sub(vector(step.w_1[u0:]), turned(R, a)))
        for k in range(u0 + 3, u0 + 6 + n):
            memory.u[k] = step.w_1[k]


@inner
def body_step(model, step, i):
    """Compute the motion of body i over the step from its unknowns.

    Forces of the variational scheme act at one configuration, where the angular velocity is (1 + theta²/4) theta/h. For
    rotations about a principal axis it belongs exactly to the momentum of the interval.
    """
    t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    types, R, theta = model.body_types, matrix(step.R_0[i]), vector(step.z[u0 + 3 :])
    put(step.d[i], 0, turned(R, vector(step.z[u0:])))
    is_interval = step.is_still and step.is_closing < 2
    turn = scaled(1.0 + 0.25 * dot(theta, theta), theta) if is_interval else theta
    put(step.theta_G[i], 0, turned(R, turn))
    if not step.is_closing:
        put_matrix(step.R_1[i], product(R, cayley(theta)))
    if step.is_still:
        put_matrix(step.R_m[i], R)
    else:
        x, y, z = 0.5 * theta[0], 0.5 * theta[1], 0.5 * theta[2]
        put_matrix(step.R_m[i], product(R, ((1.0, -z, y), (z, 1.0, -x), (-y, x, 1.0))))
    for k in range(n):
        dq = step.z[u0 + 6 + k]
        step.dq[q0 + k] = dq
        if not step.is_closing:
            step.q_1[q0 + k] = step.q_0[q0 + k] + dq
        step.q_mean[q0 + k] = step.q_0[q0 + k] + (0.0 if step.is_still else 0.5 * dq)
    if not step.is_closing:
        put(step.s_1[i], 0, center(types, t, n, step.q_1[q0 : q0 + n], matrix_at(step.C, 0, 3, n)))
    put(step.s_mean[i], 0, center(types, t, n, step.q_mean[q0 : q0 + n], rows_of(step.C_mean, 3, q0, n)))


@inner
def end_rates(model, discrete, step, i):
    """(1): compute the velocities of body i at the end of a conserving step."""
    t, n, q0, u0, h = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i], step.h
    put(step.w_1, u0, sub(scaled(2.0 / h, vector(step.d[i])), vector(step.w_0[u0:])))
    for k in range(3, 6 + n):
        step.w_1[u0 + k] = 2.0 * step.z[u0 + k] / h - step.w_0[u0 + k]
    if n == 0 or not discrete.is_filtered:
        return
    omega, x, Y = vector(step.w_1[u0 + 3 :]), step.w_1[u0 + 6 : u0 + 6 + n], step.vector[:n]
    Pi = momenta(model.body_types, step, t, n, step.q_1[q0 : q0 + n], omega, x, Y)
    turning = sub(Pi, vector(step.P_0[u0 + 3 :]))
    F, E = modal_matrix(discrete, t, FILTER, n), block(discrete, t, FREE_TURNING, 3, n)
    for k in range(n):
        Y[k] -= step.P_0[u0 + 6 + k] + dot(column(E, k), turning)
    for k in range(n):
        rate = 0.0
        for j in range(n):
            rate += F[k, j] * Y[j]
        x[k] -= 2.0 * rate
        omega = add(omega, scaled(2.0 * rate, column(E, k)))
    put(step.w_1, u0 + 3, omega)


@inner
def body_inertia(model, discrete, step, i):
    """Write the inertia residual of body i in its initial axes: h/2 times the change of momentum."""
    t, n, q0, u0, h = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i], step.h
    m, R, out = model.body_types.mass[t], matrix(step.R_0[i]), step.residual
    if step.is_closing:
        q, omega = step.q_0[q0 : q0 + n], scaled(1.0 / h, vector(step.z[u0 + 3 :]))
        rate, Y = step.w_1[u0 + 6 : u0 + 6 + n], step.P_1[u0 + 6 : u0 + 6 + n]
        for k in range(n):
            rate[k] = step.z[u0 + 6 + k] / h
        Pi = momenta(model.body_types, step, t, n, q, omega, rate, Y)
        put(out, u0, sub(scaled(m, vector(step.z[u0:])), scaled(h, turned_back(R, vector(step.P_0[u0:])))))
        put(out, u0 + 3, scaled(h, sub(Pi, vector(step.P_0[u0 + 3 :]))))
        for k in range(n):
            out[u0 + 6 + k] = h * (Y[k] - step.P_0[u0 + 6 + k])
        return
    d, theta, Pi_0 = vector(step.z[u0:]), vector(step.z[u0 + 3 :]), vector(step.P_0[u0 + 3 :])
    C_mean, N = rows_of(step.C_mean, 3, q0, n), step.force
    put(out, u0, scaled(m, sub(d, scaled(h, turned_back(R, vector(step.w_0[u0:]))))))
    if discrete.scheme == VARIATIONAL:
        interval(model, discrete, step, i)
        Pi = vector(step.P_1[u0 + 3 :])
        turning = add(add(Pi, scaled(0.5, cross(theta, Pi))), scaled(0.25 * dot(theta, Pi), theta))
        put(out, u0 + 3, scaled(h, sub(turning, Pi_0)))
        for k in range(n):
            out[u0 + 6 + k] = h * (step.P_1[u0 + 6 + k] - step.P_0[u0 + 6 + k]) - 0.5 * h * h * N[k]
        return
    end_rates(model, discrete, step, i)
    put_momenta(model, step, i, step.q_1[q0 : q0 + n], step.w_1, step.P_1)
    Pi = vector(step.P_1[u0 + 3 :])
    turning = add(sub(Pi, Pi_0), scaled(0.5, cross(theta, add(Pi, Pi_0))))
    put(out, u0 + 3, scaled(0.5 * h, turning))
    if n == 0:
        return
    q_mean = step.q_mean[q0 : q0 + n]
    start = ModalMotion(step.q_0[q0 : q0 + n], vector(step.w_0[u0 + 3 :]), step.w_0[u0 + 6 : u0 + 6 + n])
    end = ModalMotion(step.q_1[q0 : q0 + n], vector(step.w_1[u0 + 3 :]), step.w_1[u0 + 6 : u0 + 6 + n])
    inertia_force(model.body_types, discrete, step, t, start, end, q_mean, C_mean, N)
    subtract_elastic(model.body_types, discrete, step, t, n, q_mean, step.dq[q0 : q0 + n], N)
    for k in range(n):
        out[u0 + 6 + k] = 0.5 * h * (step.P_1[u0 + 6 + k] - step.P_0[u0 + 6 + k]) - 0.5 * h * h * N[k]


@loops
def subtract_elastic(types, discrete, step, t, n, q_mean, dq, N):
    """Subtract elastic forces K q and damping forces D dq/h from the modal forces, with numerical dissipation in q."""
    q = step.vector[:n]
    for k in range(n):
        q[k] = q_mean[k]
    if discrete.is_filtered:
        X = modal_matrix(discrete, t, STIFFNESS_FILTER, n)
        for k in range(n):
            for j in range(n):
                q[k] += X[k, j] * dq[j]
    modal_term(types, t, n, STIFFNESS, -1.0, q, N)
    modal_term(types, t, n, DAMPING, -1.0 / step.h, dq, N)


@inner
def interval(model, discrete, step, i):
    """Write the momenta Pi and Y between two configurations into P_1 and the modal force into `force`; variational."""
    t, n, q0, u0, h = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i], step.h
    omega, rate, q = scaled(1.0 / h, vector(step.z[u0 + 3 :])), step.w_1[u0 + 6 : u0 + 6 + n], step.middle[:n]
    for k in range(n):
        rate[k] = step.dq[q0 + k] / h
        q[k] = step.q_0[q0 + k] + 0.5 * step.dq[q0 + k]
    put(step.P_1, u0 + 3, momenta(model.body_types, step, t, n, q, omega, rate, step.P_1[u0 + 6 : u0 + 6 + n]))
    if n:
        C = matrix_at(step.C_interval, 0, 3, n)
        center(model.body_types, t, n, q, C)
        middle = ModalMotion(q, omega, rate)
        inertia_force(model.body_types, discrete, step, t, middle, middle, q, C, step.force)
        subtract_elastic(model.body_types, discrete, step, t, n, q, step.dq[q0 : q0 + n], step.force)
