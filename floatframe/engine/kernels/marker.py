"""Motion of a marker from the motion of its body, and transfer of a wrench from the marker to the body.

Let [rho - c; th] = Psi q - 1/2 qᵀ K_P q (K_P, (6, n, n), is zero unless the body is stiffened), and let
Psi(q) = Psi - K_P q be its derivative (index t: rows of rho, r: rows of th). With E = exp(th), T' the left Jacobian at
th, and nu = T' th_dot, all in body axes,

    position     r + R rho                        velocity          v + R (omega × rho + rho_dot)
    axes         R E triad                        angular velocity  R (omega + nu)
    variation    dr_P = R (dx + dphi × rho + Psi_t(q) dq),  dphi_P = R (dphi + T' Psi_r(q) dq)
    wrench (f, m in body axes)  ->  f;  rho × f + m;  Psi_t(q)ᵀ f + (T' Psi_r(q))ᵀ m
"""

from floatframe.engine.kernels.compiler.compilation import loops, small, view
from floatframe.engine.kernels.dense import add_products, flat, matrix_at
from floatframe.engine.kernels.rotation import exp_matrix, left_jacobian, left_jacobian_derivative
from floatframe.engine.kernels.vector import (
    add,
    add_column,
    copy,
    cross,
    dot,
    matrix,
    product,
    put,
    put_column,
    put_matrix,
    put_sum,
    scaled,
    turned,
    turned_back,
    unit,
    vector,
)

__all__ = [
    "bent_bias", "bent_by", "bent_rate", "body_omega", "marker_columns", "marker_motion", "marker_stiffness",
    "pose_on_body", "repeat_motion", "shape", "shape_sum", "shapes_of", "wrench_to_body",
]  # fmt: skip


@view
def shapes_of(model, psi, m):
    """Return the shapes of marker m, (6, n); psi: of all markers, undeformed or Psi(q)."""
    return matrix_at(psi, model.markers.psi0[m], 6, model.bodies.n_q[model.markers.body[m]])


@view
def bending_of(model, m):
    """Return the matrices K_P of a stiffened body at marker m, (n, 6 n): row l is [6, k]."""
    n = model.bodies.n_q[model.markers.body[m]]
    return matrix_at(model.markers.bend, model.markers.bend0[m], n, 6 * n)


@loops
def marker_motion(model, work, m):
    """Write position, axes and velocities of marker m."""
    i, markers, own = model.markers.body[m], work.markers, model.markers
    if i < 0:
        put(markers.r[m], 0, vector(own.position[m]))
        put(markers.v[m], 0, (0.0, 0.0, 0.0))
        put(markers.omega[m], 0, (0.0, 0.0, 0.0))
        put_matrix(markers.A[m], matrix(own.triad[m]))
        return
    put(markers.rho[m], 0, vector(own.position[m]))
    if own.psi0[m] >= 0:
        elastic_motion(model, work, m, i)
    pose_on_body(model, work, m)


@loops
def repeat_motion(model, work, m):
    """Write position, axes and velocities of marker m from the deformation at an earlier marker with its shapes."""
    markers, other = work.markers, model.markers.same[m]
    put(markers.rho[m], 0, vector(markers.rho[other]))
    put(markers.rho_dot[m], 0, vector(markers.rho_dot[other]))
    put(markers.angle[m], 0, vector(markers.angle[other]))
    put(markers.angle_dot[m], 0, vector(markers.angle_dot[other]))
    put(markers.spin[m], 0, vector(markers.spin[other]))
    put_matrix(markers.T_left[m], matrix(markers.T_left[other]))
    if model.markers.bend0[m] >= 0:
        copy(flat(shapes_of(model, markers.psi, other)), flat(shapes_of(model, markers.psi, m)))
    pose_on_body(model, work, m)


@small
def body_omega(bodies, state, i):
    """Return the angular velocity of body i, body axes."""
    return vector(state.u[bodies.u0[i] + 3 :])


@loops
def pose_on_body(model, work, m):
    """Write position, axes and velocities of marker m in ground axes from its motion in its body."""
    i, markers, triad = model.markers.body[m], work.markers, model.markers.triad[m]
    R, omega = work.state.R[i], body_omega(model.bodies, work.state, i)
    if model.markers.psi0[m] >= 0:
        put_matrix(markers.A[m], product(R, product(exp_matrix(vector(markers.angle[m])), triad)))
    else:
        put_matrix(markers.A[m], product(R, triad))
    rho = vector(markers.rho[m])
    own = add(cross(omega, rho), vector(markers.rho_dot[m]))
    put(markers.r[m], 0, add(vector(work.state.r[i]), turned(R, rho)))
    put(markers.v[m], 0, add(vector(work.state.u[model.bodies.u0[i] :]), turned(R, own)))
    put(markers.omega[m], 0, turned(R, add(omega, vector(markers.spin[m]))))


@loops
def elastic_motion(model, work, m, i):
    """Add the elastic displacement to rho, and write the elastic rotation, its rate and the left Jacobian."""
    n, q0, u0 = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i] + 6
    q, q_dot = work.state.q[q0 : q0 + n], work.state.u[u0 : u0 + n]
    own, psi = shapes_of(model, model.markers.psi, m), shapes_of(model, work.markers.psi, m)
    is_bent = model.markers.bend0[m] >= 0
    if is_bent:
        bent_shapes(model, m, q, 1.0, psi)
    for a in range(3):
        d, d_dot, th, th_dot = 0.0, 0.0, 0.0, 0.0
        t, r = psi[a], psi[3 + a]
        if is_bent:  # Psi q - 1/2 qᵀ K_P q
            for k in range(n):
                d += 0.5 * (own[a, k] + t[k]) * q[k]
                th += 0.5 * (own[3 + a, k] + r[k]) * q[k]
                d_dot += t[k] * q_dot[k]
                th_dot += r[k] * q_dot[k]
        else:
            for k in range(n):
                d += t[k] * q[k]
                th += r[k] * q[k]
                d_dot += t[k] * q_dot[k]
                th_dot += r[k] * q_dot[k]
        work.markers.rho[m, a] += d
        work.markers.rho_dot[m, a] = d_dot
        work.markers.angle[m, a] = th
        work.markers.angle_dot[m, a] = th_dot
    put_matrix(work.markers.T_left[m], left_jacobian(vector(work.markers.angle[m])))
    put(work.markers.spin[m], 0, turned(work.markers.T_left[m], vector(work.markers.angle_dot[m])))


@loops
def bent_shapes(model, m, q, factor, psi):
    """Write Psi - factor K_P q of a marker on a flexible body, (6, n); factor 1 gives the shapes Psi(q)."""
    own, out, scale = flat(shapes_of(model, model.markers.psi, m)), flat(psi), 1.0 / factor
    if model.markers.bend0[m] < 0:
        copy(own, out)
        return
    for k in range(out.shape[0]):
        out[k] = -scale * own[k]
    add_products(bending_of(model, m), q, out)
    for k in range(out.shape[0]):
        out[k] *= -factor


@loops
def bent_rate(model, work, m, i, out):
    """Write the matrix K_P q_dot into out, (6, n); it is minus the rate of Psi(q)."""
    n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
    bent_by(model, m, work.state.u[u0 + 6 : u0 + 6 + n], out)


@loops
def bent_by(model, m, factors, out):
    """Write Σ_l K_P,l factors_l into out, (6, n)."""
    products = flat(out)
    products[:] = 0.0
    add_products(bending_of(model, m), factors, products)


@loops
def bent_bias(model, work, m, i):
    """Return -q_dotᵀ K_P q_dot of marker m, displacement and rotation; a sliding marker interpolates its stations."""
    if model.markers.line[m] >= 0:
        bent = work.lines.bent[model.markers.line[m]]
        return vector(bent), vector(bent[3:])
    if model.markers.bend0[m] < 0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    n, u0 = model.bodies.n_q[i], model.bodies.u0[i] + 6
    bend_dot = matrix_at(work.markers.bend_dot, 0, 6, n)
    bent_rate(model, work, m, i, bend_dot)
    d, th = shape_sum(bend_dot, work.state.u[u0 : u0 + n])
    return scaled(-1.0, d), scaled(-1.0, th)


@small
def shape(psi, k):
    """Return displacement and rotation in column k of the shapes (6, n)."""
    return (psi[0, k], psi[1, k], psi[2, k]), (psi[3, k], psi[4, k], psi[5, k])


@loops
def shape_sum(psi, factors):
    """Return the sum of displacement and rotation over all shapes, (6, n), weighted by `factors`."""
    d, th = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(psi.shape[1]):
        d_k, th_k = shape(psi, k)
        d, th = add(d, scaled(factors[k], d_k)), add(th, scaled(factors[k], th_k))
    return d, th


@small
def wrench_in_body(work, m, i):
    """Return force and moment on marker m in the axes of its body i."""
    R, wrench = work.state.R[i], work.markers.wrench[m]
    return turned_back(R, vector(wrench)), turned_back(R, vector(wrench[3:]))


@loops
def wrench_to_body(model, work, m):
    """Subtract the generalised forces of marker m's wrench from the residual of its body."""
    i = model.markers.body[m]
    if i < 0:
        return
    n, u0, residual = model.bodies.n_q[i], model.bodies.u0[i], work.bodies.residual
    f, t = wrench_in_body(work, m, i)
    tau = add(cross(vector(work.markers.rho[m]), f), t)
    put_sum(residual, u0, scaled(-1.0, f))
    put_sum(residual, u0 + 3, scaled(-1.0, tau))
    if model.markers.psi0[m] >= 0:
        psi = shapes_of(model, work.markers.psi, m)
        s = turned_back(work.markers.T_left[m], t)
        for k in range(n):
            d, th = shape(psi, k)
            residual[u0 + 6 + k] -= dot(d, f) + dot(th, s)


@loops
def marker_columns(model, work, m, rate, turning, column, row):
    """Write the derivatives of marker m's motion by the body unknowns (dx, dtheta, dq), body axes.

    column, (6, 6 + n): derivatives of position and rotation by the body velocities; its transpose maps a wrench to the
    body. row, (12, 6 + n): derivatives of position, rotation, velocity and angular velocity by the unknowns of a step,
    in which domega = rate dtheta, dq_dot = rate dq, and the body rotates by `turning` dtheta, (3, 3).
    """
    i = model.markers.body[m]
    n, omega = model.bodies.n_q[i], body_omega(model.bodies, work.state, i)
    rho, spin = vector(work.markers.rho[m]), add(omega, vector(work.markers.spin[m]))
    arm_dot = add(cross(omega, rho), vector(work.markers.rho_dot[m]))
    column[:, :] = 0.0
    row[:, :] = 0.0
    for b in range(3):
        t = (turning[0, b], turning[1, b], turning[2, b])
        e = unit(b)
        arm = cross(e, rho)
        column[b, b], column[3 + b, 3 + b], row[b, b], row[6 + b, b] = 1.0, 1.0, 1.0, rate
        put_column(column, 0, 3 + b, arm)
        put_column(row, 0, 3 + b, cross(t, rho))
        put_column(row, 3, 3 + b, t)
        put_column(row, 6, 3 + b, add(scaled(rate, arm), cross(t, arm_dot)))
        put_column(row, 9, 3 + b, add(scaled(rate, e), cross(t, spin)))
    if model.markers.psi0[m] < 0:
        return
    slope = left_jacobian_derivative(vector(work.markers.angle[m]), vector(work.markers.angle_dot[m]), 1.0)
    psi, T = shapes_of(model, work.markers.psi, m), work.markers.T_left[m]
    for k in range(n):
        d, th = shape(psi, k)
        turn = turned(T, th)
        put_column(column, 0, 6 + k, d)
        put_column(column, 3, 6 + k, turn)
        put_column(row, 0, 6 + k, d)
        put_column(row, 3, 6 + k, turn)
        put_column(row, 6, 6 + k, add(cross(omega, d), scaled(rate, d)))
        put_column(row, 9, 6 + k, add(turned(slope, th), scaled(rate, turn)))
    if model.markers.bend0[m] >= 0:  # d(Psi(q) q_dot)/dq = -K_P q_dot
        bend_dot = matrix_at(work.markers.bend_dot, 0, 6, n)
        bent_rate(model, work, m, i, bend_dot)
        for k in range(n):
            d, th = shape(bend_dot, k)
            add_column(row, 6, 6 + k, scaled(-1.0, d))
            add_column(row, 9, 6 + k, scaled(-1.0, turned(T, th)))


@loops
def marker_stiffness(model, work, m, c_k, H, turn):
    """Add to H and `turn` the derivative of minus the generalised forces of a constant wrench on marker m.

    A wrench fixed in space rotates relative to the body (turn); a wrench fixed in the marker follows its elastic
    rotation.
    """
    i = model.markers.body[m]
    n, rho = model.bodies.n_q[i], vector(work.markers.rho[m])
    f, t = wrench_in_body(work, m, i)
    is_follower = model.markers.is_follower[m] != 0
    if not is_follower:
        for b in range(3):
            f_turned = cross(f, unit(b))
            add_column(turn, 0, b, scaled(-1.0, f_turned))
            add_column(turn, 3, b, scaled(-1.0, add(cross(rho, f_turned), cross(t, unit(b)))))
    if model.markers.psi0[m] < 0:
        return
    psi, T = shapes_of(model, work.markers.psi, m), work.markers.T_left[m]
    if model.markers.bend0[m] >= 0:  # h = Psi(q)ᵀ [f; Tᵀ m], dPsi(q) = -K_P dq
        s, bending = turned_back(T, t), bending_of(model, m)
        for j in range(n):
            bend, out = matrix_at(bending[j], 0, 6, n), H[6 + j, 6:]
            for k in range(n):
                d, th = shape(bend, k)
                out[k] += c_k * (dot(f, d) + dot(s, th))
    slope = left_jacobian_derivative(vector(work.markers.angle[m]), t, -1.0)
    for j in range(n):
        d, th = shape(psi, j)
        turned_by = turned(T, th)  # rotation of the marker in the body
        add_column(H, 3, 6 + j, scaled(-c_k, cross(d, f)))  # tau: drho × f
        df, ds = (0.0, 0.0, 0.0), turned(slope, th)  # h: Psi_rᵀ d(T m)
        if is_follower:
            df, dt = cross(turned_by, f), cross(turned_by, t)
            add_column(H, 0, 6 + j, scaled(-c_k, df))
            add_column(H, 3, 6 + j, scaled(-c_k, add(cross(rho, df), dt)))
            ds = add(ds, turned_back(T, dt))
        else:
            # row of mode j: Psi_t,j · (f × dphi) + (T' Psi_r,j) · (m × dphi) = dphi · (Psi × f + ...)
            row = add(cross(d, f), cross(turned_by, t))
            for a in range(3):
                turn[6 + j, a] -= row[a]
        for k in range(n):
            d, th = shape(psi, k)
            H[6 + k, 6 + j] -= c_k * (dot(d, df) + dot(th, ds))
