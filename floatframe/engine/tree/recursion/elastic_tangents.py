"""How the motion of a marker in its flexible body changes with the modes and their rates (docs/recursive.md §5).

With th_dot = Psi_r(q) q_dot, nu = T(th) th_dot, nu_dot = T th_ddot + c(th, th_dot), and of mode j, in axes of the body

    phi = T Psi_r                          turn of the marker
    by q      d rho_dot  = -(K_P q_dot)_t,   d rho_ddot = -(K_P q_ddot)_t,   the same with r for th_dot, th_ddot
              d nu = L(th, th_dot) Psi_r + T d th_dot
              d nu_dot = L(th, th_ddot) Psi_r + T d th_ddot + c_th Psi_r + c_w d th_dot
    by q_dot  Psi_t; -2 (K_P q_dot)_t;  phi;  -2 T (K_P q_dot)_r + c_w Psi_r

L(th, v) = d(T v)/dth; c and its derivatives as in relative/kernels/elastic_turning.py.

What is seen from the marker, which turns by phi: d_P x = dx - phi × x. Then Y = (d_P v, d_P omega) and
X = (d_P a - 2 d_P omega × v, d_P alpha + omega × d_P omega), which hold for all that hangs at the marker.
"""

from floatframe.engine.kernels.compiler.compilation import loops, small
from floatframe.engine.kernels.dense import add_products
from floatframe.engine.kernels.marker import shape
from floatframe.engine.kernels.rotation import left_jacobian_derivative
from floatframe.engine.kernels.vector import add, cross, dot, put, scaled, sub, turned, vector
from floatframe.engine.tree.kernels.elastic_turning import turning_bias_by_angle, turning_bias_by_rate

__all__ = ["carried_change", "put_marker_changes"]


@loops
def put_marker_changes(model, marker_work, m, body, R, arm, sign, out, scratch):
    """Write what the modes and their rates change at marker m, for all that hangs at it; ground axes, a point at arm.

    body: v, omega, a, alpha of the marker and omega, alpha of its body, body axes. out, (n, 18): Y, X by q; X by q_dot
    (whose Y is the column of the mode itself).
    """
    o, n = model.markers.psi0[m], out.shape[0]
    if o < 0:
        out[:, :] = 0.0
        return
    i, markers = model.markers.body[m], marker_work.markers
    u0, first = model.bodies.u0[i] + 6, model.markers.bend0[m]
    v, omega_P, a, alpha_P, omega, alpha = body
    psi, T = markers.psi[o : o + 6 * n], markers.T_left[m]
    th, th_dot, zero = vector(markers.angle[m]), vector(markers.angle_dot[m]), (0.0, 0.0, 0.0)
    th_ddot = zero
    q_ddot, q_dot = marker_work.state.u_dot[u0 : u0 + n], marker_work.state.u[u0 : u0 + n]
    for k in range(n):
        _, r = shape(psi, n, k)
        th_ddot = add(th_ddot, scaled(q_ddot[k], r))
    bend, bend_dot = scratch[0, : 6 * n], scratch[1, : 6 * n]
    if first >= 0:
        K = model.markers.bend[first : first + 6 * n * n]
        for j in range(6 * n):
            bend[j], bend_dot[j] = 0.0, 0.0
        add_products(K, q_dot, bend)
        add_products(K, q_ddot, bend_dot)
        for k in range(n):
            _, r = shape(bend, n, k)
            th_ddot = sub(th_ddot, scaled(q_dot[k], r))
    by_angle, by_second = left_jacobian_derivative(th, th_dot, 1.0), left_jacobian_derivative(th, th_ddot, 1.0)
    for k in range(n):
        d, r = shape(psi, n, k)
        phi = turned(T, r)
        d_1, r_1, d_2, r_2 = zero, zero, zero, zero
        if first >= 0:
            d_1, r_1 = shape(bend, n, k)
            d_2, r_2 = shape(bend_dot, n, k)
        slip, turn_rate = scaled(-1.0, d_1), scaled(-1.0, r_1)
        nu = add(turned(by_angle, r), turned(T, turn_rate))
        bias = add(turning_bias_by_angle(th, th_dot, r), turning_bias_by_rate(th, th_dot, turn_rate))
        nu_dot = add(sub(turned(by_second, r), turned(T, r_2)), bias)
        dv = sub(add(cross(omega, d), slip), cross(phi, v))
        dw = sub(nu, cross(phi, omega_P))
        moved = add(cross(alpha, d), add(cross(omega, cross(omega, d)), scaled(2.0, cross(omega, slip))))
        da = sub(sub(moved, d_2), cross(phi, a))
        dalpha = sub(add(cross(omega, nu), nu_dot), cross(phi, alpha_P))
        put_motion(out[k], 0, sign, R, arm, dv, dw)
        put_motion(out[k], 6, sign, R, arm, sub(da, scaled(2.0, cross(dw, v))), add(dalpha, cross(omega_P, dw)))
        nu_dot = sub(turning_bias_by_rate(th, th_dot, r), scaled(2.0, turned(T, r_1)))
        da = sub(scaled(2.0, cross(omega, d)), scaled(2.0, d_1))
        dalpha = add(cross(omega, phi), nu_dot)
        put_motion(out[k], 12, sign, R, arm, sub(da, scaled(2.0, cross(phi, v))), add(dalpha, cross(omega_P, phi)))


@small
def put_motion(row, first, sign, R, arm, v, w):
    """Write sign times a motion (v, w) in ground axes, of a point at arm."""
    turn = scaled(sign, turned(R, w))
    put(row, first, add(scaled(sign, turned(R, v)), cross(turn, arm)))
    put(row, first + 3, turn)


@loops
def carried_change(model, marker_work, m, f, t, i, j, n):
    """Return the change by mode j of the modal force i of a wrench (f, t) on marker m that turns with it; body axes."""
    o, first, markers = model.markers.psi0[m], model.markers.bend0[m], marker_work.markers
    psi, T = markers.psi[o : o + 6 * n], markers.T_left[m]
    d, r = shape(psi, n, i)
    _, r_j = shape(psi, n, j)
    phi = turned(T, r_j)
    turn = turned(left_jacobian_derivative(vector(markers.angle[m]), r, 1.0), r_j)
    move = (0.0, 0.0, 0.0)
    if first >= 0:
        K = model.markers.bend[first + 6 * n * j : first + 6 * n * (j + 1)]
        k_d, k_r = shape(K, n, i)
        move, turn = scaled(-1.0, k_d), sub(turn, turned(T, k_r))
    return dot(sub(move, cross(phi, d)), f) + dot(sub(turn, cross(phi, turned(T, r))), t)
