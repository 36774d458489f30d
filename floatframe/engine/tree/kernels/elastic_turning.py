"""Motion of a marker relative to its flexible body up to second rates, in body axes.

With the elastic angle th, its rate w and the left Jacobian T at th, the angular velocity is nu = T w, its rate
T w_dot + c, c = (dT/dth [w]) w. With a = a(|th|), b = b(|th|) of kernels/rotation.py, p = th·w, x = th × w, y = th × x

    c = a' p x + b' p y + b w × x,   a' = (da/dt)/t, b' = (db/dt)/t, and likewise a'' and b'' from a' and b'.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, loops, small
from floatframe.engine.kernels.marker import bent_bias, shape_sum, shapes_of
from floatframe.engine.kernels.rotation import left_jacobian_derivative, quotient_b, quotient_da, quotient_db
from floatframe.engine.kernels.vector import add, cross, dot, scaled, sub, turned, vector

__all__ = [
    "deformation_accelerations",
    "elastic_body_in_joint",
    "elastic_carrier",
    "second_turning",
    "spin_matrix",
]

SERIES_UP_TO = 4.0  #: value of t² below which series replace the closed forms, which lose digits there


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


@inner
def quotient_dda(x):
    """Return (d a'/dt)/t of x = t², a' = (t sin t - 2 (1 - cos t))/t⁴; by a series below t = 2."""
    if x > SERIES_UP_TO:
        t = math.sqrt(x)
        c = math.cos(t)
        return (x * c - 5 * t * math.sin(t) + 8 * (1 - c)) / (x * x * x)
    y = 1 / 763809585467056128000000
    y = 1 / 3122224243826688000 + x * (-1 / 1410110003939180544000 + x * y)
    y = 1 / 28582025472000 + x * (-1 / 8447576417280000 + x * y)
    y = 1 / 726485760 + x * (-1 / 124540416000 + x * y)
    y = 1 / 75600 + x * (-1 / 5987520 + x * y)
    y = 1 / 90 + x * (-1 / 1680 + x * y)
    return y


@inner
def quotient_ddb(x):
    """Return (d b'/dt)/t of x = t², b' = ((1 - cos t) - 3 (t - sin t)/t)/t⁴; by a series below t = 2."""
    if x > SERIES_UP_TO:
        t = math.sqrt(x)
        s = math.sin(t)
        return (t * s + 8 + 7 * math.cos(t) - 15 * s / t) / (x * x * x)
    y = 1 / 20622858807610515456000000
    y = 1 / 71811157608013824000 + x * (-1 / 35252750098479513600000 + x * y)
    y = 1 / 543058483968000 + x * (-1 / 177399104762880000 + x * y)
    y = 1 / 10897286400 + x * (-1 / 2117187072000 + x * y)
    y = 1 / 831600 + x * (-1 / 77837760 + x * y)
    y = 1 / 630 + x * (-1 / 15120 + x * y)
    return y


@inner
def turning_bias_by_angle(th, w, d):
    """Return the change of c for a change d of the rotation vector th."""
    x = dot(th, th)
    p, m, b = dot(th, w), cross(th, w), quotient_b(x)
    y = cross(th, m)
    da, db = quotient_da(x), quotient_db(x)
    dp, dm, along = dot(d, w), cross(d, w), dot(th, d)
    dy = add(cross(d, m), cross(th, dm))
    first = scaled(quotient_dda(x) * along * p + da * dp, m)
    second = scaled(quotient_ddb(x) * along * p + db * dp, y)
    third = add(scaled(da * p, dm), scaled(db * p, dy))
    return add(add(first, second), add(third, add(scaled(db * along, cross(w, m)), scaled(b, cross(w, dm)))))


@inner
def second_turning(th, w, nu, v, b, b_1):
    """Return (d²T/dth² [w, w]) v, with nu = T w, b = T v and b_1 = (dT/dth [w]) v.

    Variations of a motion fulfil (dT [w]) v - (dT [v]) w = nu × b. Its derivative along w is
    (d²T [w, w]) v = (d²T [v, w]) w + c × b + nu × b_1.
    """
    turning = add(cross(turning_bias(th, w), b), cross(nu, b_1))
    return add(turning_bias_by_angle(th, w, v), turning)


# motion of a marker in its flexible body to second order, and what a joint at it adds (docs/recursive.md §2) ----------
# With Psi(q) = Psi - K_P q, th_dot = Psi_r q_dot:
#
#     rho_ddot = Psi_t q_ddot - (K_P q_dot)_t q_dot        nu_dot = T th_ddot + c


@loops
def marker_rates(model, work, m):
    """Return rho_ddot and nu_dot of marker m, whose position and velocity in its body are known."""
    markers, zero = work.markers, (0.0, 0.0, 0.0)
    if model.markers.psi0[m] < 0:
        return zero, zero
    rho_ddot, th_ddot = deformation_accelerations(model, work, m, model.markers.body[m])
    c = turning_bias(vector(markers.angle[m]), vector(markers.angle_dot[m]))
    return rho_ddot, add(turned(markers.T_left[m], th_ddot), c)


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


@loops
def elastic_carrier(model, work, m, omega, alpha, a):
    """Return omega, alpha and point acceleration of marker m from the motion of its body, body axes."""
    markers = work.markers
    rho_ddot, nu_dot = marker_rates(model, work, m)
    nu, U = vector(markers.spin[m]), spin_matrix(omega, alpha)
    moved = relative_acceleration(omega, U, vector(markers.rho[m]), vector(markers.rho_dot[m]), rho_ddot)
    return add(omega, nu), add(alpha, add(cross(omega, nu), nu_dot)), add(a, moved)


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
