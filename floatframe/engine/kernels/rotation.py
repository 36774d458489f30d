"""Rotations in the kernels: exponential map and its Jacobians, with matrices as three rows (`kernels.vector`).

With t = |theta|: exp = 1 + s tilde + a tilde², right Jacobian T = 1 - a tilde + b tilde², left Jacobian Tᵀ, where
s = sin t / t, a = (1 - cos t)/t², b = (t - sin t)/t³. Below t = 1/2 their series are used, whose first omitted term is
less than 1e-17.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.vector import add, axial, cross, dot, product, scaled, sub, turned, unit

__all__ = [
    "after_spin",
    "changed_spin",
    "exp_matrix",
    "left_jacobian",
    "left_jacobian_derivative",
    "matrix_of_euler_parameters",
    "quaternion_of",
    "right_jacobian",
    "rotate_euler_parameters",
    "spin_jacobian",
    "split_spin",
    "turn_of_axis",
    "turned_about",
    "turned_by_spin",
]

SERIES_BELOW = 0.25  # t² at the switch


@inner
def quotient_s(x):
    """Return sin t / t as a function of x = t²."""
    if x < SERIES_BELOW:
        return 1 + x * (
            -1 / 6 + x * (1 / 120 + x * (-1 / 5040 + x * (1 / 362880 + x * (-1 / 39916800 + x / 6227020800))))
        )
    t = math.sqrt(x)
    return math.sin(t) / t


@inner
def quotient_a(x):
    """Return (1 - cos t)/t² as a function of x = t²."""
    if x < SERIES_BELOW:
        return 1 / 2 + x * (
            -1 / 24 + x * (1 / 720 + x * (-1 / 40320 + x * (1 / 3628800 + x * (-1 / 479001600 + x / 87178291200))))
        )
    return (1 - math.cos(math.sqrt(x))) / x


@inner
def quotient_b(x):
    """Return (t - sin t)/t³ as a function of x = t²."""
    if x < SERIES_BELOW:
        return 1 / 6 + x * (-1 / 120 + x * (1 / 5040 + x * (-1 / 362880 + x * (1 / 39916800 - x / 6227020800))))
    t = math.sqrt(x)
    return (t - math.sin(t)) / (x * t)


@inner
def quotient_da(x):
    """Return (da/dt)/t as a function of x = t², a = (1 - cos t)/t²."""
    if x < SERIES_BELOW:
        return -1 / 12 + x * (1 / 180 + x * (-1 / 6720 + x * (1 / 453600 + x * (-1 / 47900160 + x / 7264857600))))
    t = math.sqrt(x)
    return (t * math.sin(t) - 2 * (1 - math.cos(t))) / (x * x)


@inner
def quotient_db(x):
    """Return (db/dt)/t as a function of x = t², b = (t - sin t)/t³."""
    if x < SERIES_BELOW:
        return -1 / 60 + x * (1 / 1260 + x * (-1 / 60480 + x * (1 / 4989600 + x * (-1 / 622702080 + x / 108972864000))))
    t = math.sqrt(x)
    return ((1 - math.cos(t)) - 3 * (t - math.sin(t)) / t) / (x * x)


@inner
def polynomial(th, first, second):
    """Return the matrix 1 + first tilde(th) + second tilde(th)²."""
    x, y, z = th[0], th[1], th[2]
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    return (
        (1 - second * (y * y + z * z), xy - first * z, xz + first * y),
        (xy + first * z, 1 - second * (x * x + z * z), yz - first * x),
        (xz - first * y, yz + first * x, 1 - second * (x * x + y * y)),
    )


@inner
def exp_matrix(th):
    """Return the rotation matrix of a rotation vector."""
    x = dot(th, th)
    return polynomial(th, quotient_s(x), quotient_a(x))


@inner
def right_jacobian(th):
    """Return the right Jacobian T(th) of the exponential map."""
    x = dot(th, th)
    return polynomial(th, -quotient_a(x), quotient_b(x))


@inner
def left_jacobian(th):
    """Return the left Jacobian T(th)ᵀ of the exponential map."""
    x = dot(th, th)
    return polynomial(th, quotient_a(x), quotient_b(x))


@inner
def slope_row(e, f, b, d, a, th, v):
    """Return the row for unit vector e of the matrix f thᵀ + b th vᵀ + d 1 - a tilde(v)."""
    return add(add(scaled(dot(e, f), th), scaled(b * dot(e, th), v)), sub(scaled(d, e), scaled(a, cross(e, v))))


@inner
def left_jacobian_derivative(th, v, sign):
    """Return d(Tᵀ v)/dth for sign = +1 or d(T v)/dth for sign = -1, at constant v.

    Tᵀ v = v + a c + b e with c = th × v, e = th × c = th (th·v) - v t², so that the derivative is

        (da c + db e - 2 b v) thᵀ + b th vᵀ + b (th·v) 1 - a tilde(v)
    """
    x = dot(th, th)
    a, b, da, db = quotient_a(x) * sign, quotient_b(x), quotient_da(x) * sign, quotient_db(x)
    c = cross(th, v)
    f = sub(add(scaled(da, c), scaled(db, cross(th, c))), scaled(2 * b, v))
    d = b * dot(th, v)
    return (
        slope_row(unit(0), f, b, d, a, th, v),
        slope_row(unit(1), f, b, d, a, th, v),
        slope_row(unit(2), f, b, d, a, th, v),
    )


@inner
def turned_about(e, angle, x):
    """Return the vector x rotated by an angle about the unit vector e."""
    s, half = math.sin(angle), math.sin(0.5 * angle)
    c = cross(e, x)
    return add(x, add(scaled(s, c), scaled(2.0 * half * half, cross(e, c))))


@inner
def split_spin(e, th):
    """Return the component of th along the unit vector e, as a number, and the part normal to e."""
    along = dot(e, th)
    return along, sub(th, scaled(along, e))


@inner
def turn_of_axis(e, omega):
    """Return the angular acceleration w omega × e due to the rotation of axis e, where w is the spin rate.

    omega and the result are in axes of the body, as in the following functions.
    """
    return scaled(dot(e, omega), cross(omega, e))


@inner
def after_spin(e, along, omega, rest):
    """Convert omega and alpha - w omega × e to omega and alpha in axes that rotate relatively by `along` about e."""
    omega = turned_about(e, -along, omega)
    return omega, add(turned_about(e, -along, rest), turn_of_axis(e, omega))


@inner
def changed_spin(e, theta, omega, alpha, by_theta, by_omega, by_alpha):
    """Return theta, omega, alpha of a spinning body after a correction, which is linear in axes that do not spin.

    These axes are the axes at the beginning of the step rotated by exp(across), where theta = across + along e. omega
    and alpha - w omega × e are corrected in these axes, and rotated with them by the change of theta.
    """
    rest = sub(alpha, turn_of_axis(e, omega))
    theta = add(theta, turned_about(e, dot(e, theta), by_theta))
    further = -dot(e, by_theta)
    omega = turned_about(e, further, add(omega, by_omega))
    rest = turned_about(e, further, add(rest, by_alpha))
    return theta, omega, add(rest, turn_of_axis(e, omega))


@inner
def turned_by_spin(e, theta):
    """Return the rotation matrix exp(across) exp(along e) of a spinning body."""
    along, across = split_spin(e, theta)
    return product(exp_matrix(across), exp_matrix(scaled(along, e)))


@inner
def spin_jacobian(e, theta):
    """Return the matrix from a change of theta to the body rotation, in body axes: 1 along e, else T(across)."""
    along, across = split_spin(e, theta)
    T = right_jacobian(turned_about(e, -along, across))
    bent = sub(e, turned(T, e))
    return (
        add(T[0], scaled(bent[0], e)),
        add(T[1], scaled(bent[1], e)),
        add(T[2], scaled(bent[2], e)),
    )


@inner
def matrix_of_euler_parameters(p):
    """Return the rotation matrix R_GB for Euler parameters p = (w, x, y, z)."""
    w, x, y, z = p[0], p[1], p[2], p[3]
    return (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )


@inner
def quaternion_of(R):
    """Return scalar and vector of a quaternion of any length for a rotation matrix; the scalar is not negative."""
    w = 1.0 + R[0][0] + R[1][1] + R[2][2]  # 4 w², and 4 w times x
    x = axial(R)
    if w < 1.0:  # more than 120 degrees: the products of x, y, z with the largest of them, times 4
        k = 0 if R[0][0] >= R[1][1] and R[0][0] >= R[2][2] else (1 if R[1][1] >= R[2][2] else 2)
        symmetric = (
            (2.0 + 2 * R[0][0] - w, R[0][1] + R[1][0], R[0][2] + R[2][0]),
            (R[0][1] + R[1][0], 2.0 + 2 * R[1][1] - w, R[1][2] + R[2][1]),
            (R[0][2] + R[2][0], R[1][2] + R[2][1], 2.0 + 2 * R[2][2] - w),
        )
        w, x = x[k], symmetric[k]
        if w < 0.0:
            w, x = -w, scaled(-1.0, x)
    return w, x


@inner
def rotate_euler_parameters(p, th):
    """Return the Euler parameters p * exp(th/2), normalised."""
    x = 0.25 * dot(th, th)
    b, c = scaled(0.5 * quotient_s(x), th), 1 - x * quotient_a(x)
    a = (p[1], p[2], p[3])
    w = p[0] * c - dot(a, b)
    v = add(add(scaled(p[0], b), scaled(c, a)), cross(a, b))
    scale = 1 / math.sqrt(w * w + dot(v, v))
    return scale * w, scale * v[0], scale * v[1], scale * v[2]
