"""Rotations in the kernels: exponential map and its Jacobians, written into arrays that are given.

With t = |theta|: exp = 1 + s tilde + a tilde², right Jacobian T = 1 - a tilde + b tilde², left Jacobian Tᵀ, with
s = sin t / t, a = (1 - cos t)/t², b = (t - sin t)/t³; below t = 1/2 their series (the next term is under 1e-17).
"""

import math

from floatframe.kernels.compiler.compilation import inner

__all__ = [
    "cross",
    "exp_matrix",
    "left_jacobian",
    "left_jacobian_derivative",
    "matrix_of_euler_parameters",
    "right_jacobian",
    "rotate_euler_parameters",
]

SERIES_BELOW = 0.25  # t² at the switch


@inner
def quotient_s(x):
    """Return sin t / t of x = t²."""
    if x < SERIES_BELOW:
        return 1 + x * (
            -1 / 6 + x * (1 / 120 + x * (-1 / 5040 + x * (1 / 362880 + x * (-1 / 39916800 + x / 6227020800))))
        )
    t = math.sqrt(x)
    return math.sin(t) / t


@inner
def quotient_a(x):
    """Return (1 - cos t)/t² of x = t²."""
    if x < SERIES_BELOW:
        return 1 / 2 + x * (
            -1 / 24 + x * (1 / 720 + x * (-1 / 40320 + x * (1 / 3628800 + x * (-1 / 479001600 + x / 87178291200))))
        )
    return (1 - math.cos(math.sqrt(x))) / x


@inner
def quotient_b(x):
    """Return (t - sin t)/t³ of x = t²."""
    if x < SERIES_BELOW:
        return 1 / 6 + x * (-1 / 120 + x * (1 / 5040 + x * (-1 / 362880 + x * (1 / 39916800 - x / 6227020800))))
    t = math.sqrt(x)
    return (t - math.sin(t)) / (x * t)


@inner
def quotient_da(x):
    """Return (da/dt)/t of x = t²."""
    if x < SERIES_BELOW:
        return -1 / 12 + x * (1 / 180 + x * (-1 / 6720 + x * (1 / 453600 + x * (-1 / 47900160 + x / 7264857600))))
    t = math.sqrt(x)
    return (t * math.sin(t) - 2 * (1 - math.cos(t))) / (x * x)


@inner
def quotient_db(x):
    """Return (db/dt)/t of x = t²."""
    if x < SERIES_BELOW:
        return -1 / 60 + x * (1 / 1260 + x * (-1 / 60480 + x * (1 / 4989600 + x * (-1 / 622702080 + x / 108972864000))))
    t = math.sqrt(x)
    return ((1 - math.cos(t)) - 3 * (t - math.sin(t)) / t) / (x * x)


@inner
def cross(a0, a1, a2, b0, b1, b2):
    """Return a × b as three numbers."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@inner
def polynomial(th, first, second, out):
    """Write 1 + first tilde(th) + second tilde(th)² into out, (3, 3)."""
    x, y, z = th[0], th[1], th[2]
    out[0, 0] = 1 - second * (y * y + z * z)
    out[1, 1] = 1 - second * (x * x + z * z)
    out[2, 2] = 1 - second * (x * x + y * y)
    out[0, 1] = second * x * y - first * z
    out[1, 0] = second * x * y + first * z
    out[0, 2] = second * x * z + first * y
    out[2, 0] = second * x * z - first * y
    out[1, 2] = second * y * z - first * x
    out[2, 1] = second * y * z + first * x


@inner
def exp_matrix(th, out):
    """Write the rotation matrix of a rotation vector."""
    x = th[0] * th[0] + th[1] * th[1] + th[2] * th[2]
    polynomial(th, quotient_s(x), quotient_a(x), out)


@inner
def right_jacobian(th, out):
    """Write T(th)."""
    x = th[0] * th[0] + th[1] * th[1] + th[2] * th[2]
    polynomial(th, -quotient_a(x), quotient_b(x), out)


@inner
def left_jacobian(th, out):
    """Write T(th)ᵀ."""
    x = th[0] * th[0] + th[1] * th[1] + th[2] * th[2]
    polynomial(th, quotient_a(x), quotient_b(x), out)


@inner
def left_jacobian_derivative(th, v0, v1, v2, sign, out):
    """Write d(Tᵀ v)/dth for sign = +1, d(T v)/dth for sign = -1, (3, 3), v held.

    Tᵀ v = v + a th × v + b th × (th × v), and th × (th × v) = th (th·v) - v t².
    """
    x = th[0] * th[0] + th[1] * th[1] + th[2] * th[2]
    a, b, da, db = quotient_a(x) * sign, quotient_b(x), quotient_da(x) * sign, quotient_db(x)
    dot = th[0] * v0 + th[1] * v1 + th[2] * v2
    c0, c1, c2 = cross(th[0], th[1], th[2], v0, v1, v2)
    v = (v0, v1, v2)
    c = (c0, c1, c2)
    for i in range(3):
        along = da * c[i] + db * (th[i] * dot - v[i] * x)
        for j in range(3):
            out[i, j] = along * th[j] + b * (th[i] * v[j] - 2 * v[i] * th[j])
        out[i, i] += b * dot
    out[0, 1] += a * v2
    out[1, 0] -= a * v2
    out[0, 2] -= a * v1
    out[2, 0] += a * v1
    out[1, 2] += a * v0
    out[2, 1] -= a * v0


@inner
def matrix_of_euler_parameters(p, out):
    """Write R_GB of p = (w, x, y, z)."""
    w, x, y, z = p[0], p[1], p[2], p[3]
    out[0, 0] = w * w + x * x - y * y - z * z
    out[1, 1] = w * w - x * x + y * y - z * z
    out[2, 2] = w * w - x * x - y * y + z * z
    out[0, 1] = 2 * (x * y - w * z)
    out[1, 0] = 2 * (x * y + w * z)
    out[0, 2] = 2 * (x * z + w * y)
    out[2, 0] = 2 * (x * z - w * y)
    out[1, 2] = 2 * (y * z - w * x)
    out[2, 1] = 2 * (y * z + w * x)


@inner
def rotate_euler_parameters(p, th, out):
    """Write p * exp(th/2), made of length one again, into out, (4,)."""
    x = 0.25 * (th[0] * th[0] + th[1] * th[1] + th[2] * th[2])
    s = 0.5 * quotient_s(x)
    c = 1 - x * quotient_a(x)
    b0, b1, b2 = s * th[0], s * th[1], s * th[2]
    w = p[0] * c - p[1] * b0 - p[2] * b1 - p[3] * b2
    c0, c1, c2 = cross(p[1], p[2], p[3], b0, b1, b2)
    v0 = p[0] * b0 + c * p[1] + c0
    v1 = p[0] * b1 + c * p[2] + c1
    v2 = p[0] * b2 + c * p[3] + c2
    scale = 1 / math.sqrt(w * w + v0 * v0 + v1 * v1 + v2 * v2)
    out[0] = w * scale
    out[1] = v0 * scale
    out[2] = v1 * scale
    out[3] = v2 * scale
