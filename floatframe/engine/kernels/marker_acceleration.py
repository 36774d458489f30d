"""Acceleration of a marker from the motion of its body, the reverse, and the derivatives of it in a Newton step.

With rho, th, T' and nu as in kernels/marker.py, a the acceleration of the frame origin and alpha that of the axes,

    rho_ddot = Psi_t(q) q_ddot - (K_P q_dot)_t q_dot      nu_dot = T' th_ddot + c,  c = (dT'/dth [th_dot]) th_dot
    acceleration           a + alpha × rho + omega × (omega × rho) + 2 omega × rho_dot + rho_ddot
    angular acceleration   alpha + omega × nu + nu_dot

in body axes (docs/recursive.md §2).
"""

from floatframe.engine.kernels.compiler.compilation import inner, loops, small
from floatframe.engine.kernels.dense import matrix_at
from floatframe.engine.kernels.marker import bent_bias, bent_by, bent_rate, body_omega, shape, shape_sum, shapes_of
from floatframe.engine.kernels.rotation import left_jacobian_derivative
from floatframe.engine.kernels.vector import add, cross, put, put_column, scaled, sub, turned, turned_back, unit, vector

__all__ = [
    "acceleration_columns", "deformation_accelerations", "elastic_body_in_joint", "elastic_carrier",
    "marker_acceleration", "marker_acceleration_bias", "spin_matrix", "turning_bias",
]  # fmt: skip

ZERO = (0.0, 0.0, 0.0)


@inner
def deformation_accelerations(model, work, m, i):
    """Return the second rates of position and elastic rotation vector of marker m relative to its body i."""
    d, th = shape_sum(shapes_of(model, work.markers.psi, m), work.state.u_dot[model.bodies.u0[i] + 6 :])
    b_t, b_r = bent_bias(model, work, m, i)
    return add(d, b_t), add(th, b_r)


@inner
def turning_bias(th, w):
    """Return the velocity term c of the elastic angular acceleration."""
    return turned(left_jacobian_derivative(th, w, 1.0), w)


@loops
def rates_in_body(model, work, m, second):
    """Return rho_ddot and nu_dot of marker m on a flexible body; second: the second rates of rho and th."""
    markers = work.markers
    c = turning_bias(vector(markers.angle[m]), vector(markers.angle_dot[m]))
    return second[0], add(turned(markers.T_left[m], second[1]), c)


@loops
def marker_rates(model, work, m):
    """Return rho_ddot and nu_dot of marker m, whose position and velocity in its body are known."""
    if model.markers.psi0[m] < 0:
        return ZERO, ZERO
    return rates_in_body(model, work, m, deformation_accelerations(model, work, m, model.markers.body[m]))


@small
def spin_matrix(omega, alpha):
    """Return U = alpha~ + omega~ omega~, the acceleration of points per unit distance."""
    x, y, z = omega
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return (
        (-(yy + zz), xy - alpha[2], xz + alpha[1]),
        (xy + alpha[2], -(xx + zz), yz - alpha[0]),
        (xz - alpha[1], yz + alpha[0], -(xx + yy)),
    )


@small
def relative_acceleration(omega, U, rho, rho_dot, rho_ddot):
    """Return the acceleration of a body point minus the acceleration of the frame origin, body axes."""
    return add(add(turned(U, rho), scaled(2.0, cross(omega, rho_dot))), rho_ddot)


@small
def carried(markers, m, omega, alpha, a, rates):
    """Return omega, alpha and acceleration of marker m from the motion of its body, body axes.

    rates: rho_ddot and nu_dot.
    """
    nu, U = vector(markers.spin[m]), spin_matrix(omega, alpha)
    moved = relative_acceleration(omega, U, vector(markers.rho[m]), vector(markers.rho_dot[m]), rates[0])
    return add(omega, nu), add(alpha, add(cross(omega, nu), rates[1])), add(a, moved)


@loops
def elastic_carrier(model, work, m, omega, alpha, a):
    """Return omega, alpha and point acceleration of marker m from the motion of its body, body axes."""
    return carried(work.markers, m, omega, alpha, a, marker_rates(model, work, m))


@loops
def elastic_body_in_joint(model, work, m, omega, alpha, a):
    """Return omega, alpha and origin acceleration of a flexible body from the motion of its marker m, body axes."""
    markers = work.markers
    rho_ddot, nu_dot = marker_rates(model, work, m)
    nu = vector(markers.spin[m])
    own = sub(omega, nu)
    turning = sub(alpha, add(cross(own, nu), nu_dot))
    U = spin_matrix(own, turning)
    moved = relative_acceleration(own, U, vector(markers.rho[m]), vector(markers.rho_dot[m]), rho_ddot)
    return own, turning, sub(a, moved)


@loops
def marker_acceleration(model, work, m, out):
    """Write the acceleration (3) and angular acceleration (3) of marker m at the iterate into out, ground axes."""
    out[:] = 0.0
    i = model.markers.body[m]
    if i < 0:
        return
    R, omega, u_dot = work.state.R[i], body_omega(model.bodies, work.state, i), work.state.u_dot[model.bodies.u0[i] :]
    _, alpha, moved = elastic_carrier(model, work, m, omega, vector(u_dot[3:]), ZERO)
    put(out, 0, add(vector(u_dot), turned(R, moved)))
    put(out, 3, turned(R, alpha))


@loops
def marker_acceleration_bias(model, work, m, out):
    """Write the acceleration (3) and angular acceleration (3) of marker m at zero u_dot into out, ground axes."""
    out[:] = 0.0
    i = model.markers.body[m]
    if i < 0:
        return
    R, omega, rates = work.state.R[i], body_omega(model.bodies, work.state, i), (ZERO, ZERO)
    if model.markers.psi0[m] >= 0:
        rates = rates_in_body(model, work, m, bent_bias(model, work, m, i))
    _, alpha, moved = carried(work.markers, m, omega, ZERO, ZERO, rates)
    put(out, 0, turned(R, moved))
    put(out, 3, turned(R, alpha))


@loops
def acceleration_columns(model, work, m, weights, turning, row):
    """Write c_k times the derivatives of marker m's acceleration by the unknowns of a step, body axes.

    They are written into row, (6, 6 + n). In a step, accelerations change by c_m/c_k and velocities by c_d/c_k times
    the change of the unknowns, and the body rotates by `turning` dtheta. Without the acceleration of the frame origin,
    in body axes,

        a = omega_dot × rho + Psi_t q_ddot + omega × (omega × rho + 2 rho_dot) - q_dotᵀ K_P,t q_dot
        alpha = omega_dot + T' Psi_r q_ddot + omega × nu + ...

    In alpha, the derivatives of T' and its rate by q and q_dot are omitted: they are of the size of elastic rotations.
    """
    c_m, c_d, c_k = weights
    i = model.markers.body[m]
    n, u0, omega = model.bodies.n_q[i], model.bodies.u0[i], body_omega(model.bodies, work.state, i)
    R, rho, rho_dot = work.state.R[i], vector(work.markers.rho[m]), vector(work.markers.rho_dot[m])
    omega_dot, nu = vector(work.state.u_dot[u0 + 3 :]), vector(work.markers.spin[m])
    now = work.markers.acceleration[model.markers.accelerated[m]]
    of_frame = vector(work.state.u_dot[u0:])
    a, alpha = turned_back(R, sub(vector(now), of_frame)), turned_back(R, vector(now[3:]))
    row[:, :] = 0.0
    for b in range(3):
        t, e = scaled(c_k, (turning[0, b], turning[1, b], turning[2, b])), unit(b)
        row[b, b] = c_m
        by_spin = add(cross(e, add(cross(omega, rho), scaled(2.0, rho_dot))), cross(omega, cross(e, rho)))
        put_column(row, 0, 3 + b, add(add(scaled(c_m, cross(e, rho)), scaled(c_d, by_spin)), cross(t, a)))
        put_column(row, 3, 3 + b, add(add(scaled(c_m, e), scaled(c_d, cross(e, nu))), cross(t, alpha)))
    if model.markers.psi0[m] < 0:
        return
    psi, T, is_bent = shapes_of(model, work.markers.psi, m), work.markers.T_left[m], model.markers.bend0[m] >= 0
    bend_dot, bend_ddot = matrix_at(work.markers.bend_dot, 0, 6, n), matrix_at(work.markers.bend_ddot, 0, 6, n)
    if is_bent:
        bent_rate(model, work, m, i, bend_dot)
        bent_by(model, m, work.state.u_dot[u0 + 6 : u0 + 6 + n], bend_ddot)
    for k in range(n):
        d, th = shape(psi, k)
        turn = turned(T, th)
        by_rate = scaled(2.0, cross(omega, d))
        by_place = add(cross(omega_dot, d), cross(omega, cross(omega, d)))
        if is_bent:
            d_dot, _ = shape(bend_dot, k)
            d_ddot, _ = shape(bend_ddot, k)
            by_rate = sub(by_rate, scaled(2.0, d_dot))
            by_place = sub(by_place, add(d_ddot, scaled(2.0, cross(omega, d_dot))))
        put_column(row, 0, 6 + k, add(add(scaled(c_m, d), scaled(c_d, by_rate)), scaled(c_k, by_place)))
        put_column(row, 3, 6 + k, add(scaled(c_m, turn), scaled(c_d, cross(omega, turn))))
