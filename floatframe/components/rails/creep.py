"""Creep forces of an elliptic contact: linear, linear with saturation, Polach, FASTSIM; and their derivatives.

Each is a function law(creepage, patch, options) -> (F_x, F_y, M) on the wheel; `options` are further parameters of a
law. x points in the rolling direction, z away from the rail. Numbers may be float64 or complex128 (a step along the
imaginary axis gives derivatives); comparisons use real parts.
"""

from typing import NamedTuple

import numpy as np

from fe_models.foundation.kernels.jit import jit

__all__ = [
    "N_CREEP_INPUTS",
    "Creepage",
    "Patch",
    "creep_force",
    "creep_slopes",
    "fastsim",
    "fastsim_of_flexibilities",
    "linear_creep",
    "polach",
    "saturated_creep",
]

N_CREEP_INPUTS = 11  #: inputs of `creep_force` that change: xi, eta, phi, N, a, b, c11, c22, c23, c33 and V
TINY = 1e-30  # step along the imaginary axis


class Creepage(NamedTuple):
    """Velocity of the wheel surface relative to the rail, divided by the rolling speed."""

    xi: complex  #: longitudinal
    eta: complex  #: lateral
    phi: complex  #: spin [rad/m]


class Patch(NamedTuple):
    """An elliptic contact."""

    N: complex  #: normal force [N]
    a: complex  #: semi-axis in the rolling direction [m]
    b: complex  #: the other semi-axis [m]
    c11: complex  #: Kalker's coefficients
    c22: complex
    c23: complex
    c33: complex
    G: float  #: shear modulus [Pa]
    mu: float  #: friction coefficient


SMALL = 1e-8  #: creepage below which the direction in Polach's law is smoothed


@jit
def linear_creep(creepage, patch, options):
    """Return Kalker's linear forces, without a friction limit."""
    (xi, eta, phi), G = creepage, patch.G
    c2 = patch.a * patch.b
    c = np.sqrt(c2)
    return (
        -c2 * G * patch.c11 * xi,
        -c2 * G * (patch.c22 * eta + c * patch.c23 * phi),
        c2 * c * G * (patch.c23 * eta - c * patch.c33 * phi),
    )


@jit
def saturated_creep(creepage, patch, options):
    """Return the linear forces, with resultant F limited to mu N (e - e²/3 + e³/27), e = F/(mu N) <= 3 (Shen 1983)."""
    fx, fy, m = linear_creep(creepage, patch, options)
    N, mu = patch.N, patch.mu
    e2 = (fx * fx + fy * fy) / (mu * mu * N * N)
    if e2.real < 1e-20:
        return fx, fy, m
    e = np.sqrt(e2)
    factor = 1 - e / 3 + e2 / 27 if e.real < 3 else 1 / e
    return fx * factor, fy * factor, m * factor


@jit
def polach(creepage, patch, options, V):
    """Return Polach's forces (1999, 2005); options = (k_A, k_S, A, B), V the rolling speed.

    (1)  friction falls with the slip speed w = V |creepage|: mu (A + (1 - A) exp(-B w))
    (2)  eta_c = eta + phi a if its magnitude is larger, else eta;  nu_c = |(xi, eta_c)|
    (3)  e = (1/4) pi G a b C_jj nu_c/(mu N),  C_jj² = ((C11 xi)² + (C22 eta)²)/|(xi, eta)|²
    (4)  F = (2 mu N/pi) (k_A e/(1 + (k_A e)²) + atan(k_S e)), opposite to the creepage
    (5)  lateral force of spin: (9/16) a mu N K (1 + 6.3 (1 - exp(-a/b))) phi/nu_c,
         K = |e_M| (d³/3 - d²/2 + 1/6) - (1 - d²)^(3/2)/3 < 0,  d = (e_M² - 1)/(e_M² + 1),
         e_M = (8/3) G b sqrt(a b) C23 eta_c/((1 + 6.3 (1 - exp(-a/b))) mu N)
    """
    xi, eta, phi = creepage
    N, a, b, c11, c22, c23, _, G, mu = patch
    k_a, k_s, low, fall = options[0], options[1], options[2], options[3]
    eta_c = eta
    turned = eta + phi * a
    if abs(turned.real) > abs(eta.real):
        eta_c = turned
    plain2 = xi * xi + eta * eta + SMALL * SMALL
    nu = np.sqrt(plain2)
    nu_c = np.sqrt(xi * xi + eta_c * eta_c + SMALL * SMALL)
    f = mu * (low + (1 - low) * np.exp(-fall * V * nu)) * N
    c2 = ((c11 * xi) ** 2 + (c22 * eta) ** 2 + c11 * c22 * SMALL * SMALL) / plain2
    e = 0.25 * np.pi * G * a * b * np.sqrt(c2) * nu_c / f
    F = 2 * f / np.pi * (k_a * e / (1 + (k_a * e) ** 2) + np.arctan(k_s * e))
    fx = -F * xi / nu_c
    fy = -F * eta / nu_c
    shape = 1 + 6.3 * (1 - np.exp(-a / b))
    e_m = 8 / 3 * G * b * np.sqrt(a * b) * c23 * eta_c / (shape * f)
    if e_m.real < 0:
        e_m = -e_m
    d = (e_m * e_m - 1) / (e_m * e_m + 1)
    root = np.sqrt(1 - d * d + 1e-30)
    K = e_m * (d * d * d / 3 - d * d / 2 + 1 / 6) - root * root * root / 3
    fy = fy + 9 / 16 * a * f * K * shape * phi / nu_c
    return fx, fy, 0 * fx


@jit
def fastsim_of_flexibilities(creepage, patch, flexibilities, cells):
    """Return the forces of Kalker's simplified theory (1982) with flexibilities (L1, L2, L3) [m³/N].

    The surface displacement is L times the local traction. Each of m_y strips has m_x cells; cells = (m_x, m_y). From
    the leading edge of a strip, u = x/a decreases from sqrt(1 - v²), v = y/b:

    (1)  dt_x = (xi/L1 - phi b v/L3) a du,  dt_y = (eta/L2 + phi a u/L3) a du  without slip
    (2)  if |t| exceeds the bound mu p, p = 2 N (1 - u² - v²)/(pi a b), it is reduced to the bound
    (3)  force = sum of t over cells of equal width in their strip, with the tractions at their middle
    """
    (xi, eta, phi), (L1, L2, L3), (m_x, m_y) = creepage, flexibilities, cells
    N, a, b, mu = patch.N, patch.a, patch.b, patch.mu
    fx = 0 * (xi + N)
    fy = 0 * (xi + N)
    m = 0 * (xi + N)
    bound_0 = 2 * mu * N / (np.pi * a * b)
    gx, gx_v = xi / L1 * a, phi * b / L3 * a
    gy, gy_u = eta / L2 * a, phi * a / L3 * a
    dv = 2.0 / m_y
    # the strips at v and -v together, because the processor can compute their tractions in parallel
    for j in range((m_y + 1) // 2):
        v = -1 + (j + 0.5) * dv
        edge = np.sqrt(1 - v * v)
        du = 2 * edge / m_x
        tx, ty, sx, sy, su = 0 * fx, 0 * fx, 0 * fx, 0 * fx, 0 * fx
        tx_2, ty_2, sx_2, sy_2, su_2 = tx, tx, tx, tx, tx
        for i in range(m_x):
            u = edge - (i + 0.5) * du
            step = du if i > 0 else 0.5 * du
            dt_y = (gy + gy_u * (u + 0.5 * step)) * step
            tx, ty = tx - (gx - gx_v * v) * step, ty - dt_y
            tx_2, ty_2 = tx_2 - (gx + gx_v * v) * step, ty_2 - dt_y
            bound = bound_0 * (1 - u * u - v * v)
            limit = (bound * bound).real
            square, square_2 = tx * tx + ty * ty, tx_2 * tx_2 + ty_2 * ty_2
            if square.real > limit:
                cut = bound / np.sqrt(square)
                tx, ty = tx * cut, ty * cut
            if square_2.real > limit:
                cut = bound / np.sqrt(square_2)
                tx_2, ty_2 = tx_2 * cut, ty_2 * cut
            sx, sy, su = sx + tx, sy + ty, su + u * ty
            sx_2, sy_2, su_2 = sx_2 + tx_2, sy_2 + ty_2, su_2 + u * ty_2
        cell = a * b * du * dv
        if 2 * j + 1 == m_y:  # the strip in the middle is alone
            sx_2, sy_2, su_2 = 0 * sx, 0 * sy, 0 * su
        fx = fx + (sx + sx_2) * cell
        fy = fy + (sy + sy_2) * cell
        m = m + (a * (su + su_2) - b * v * (sx - sx_2)) * cell
    return fx, fy, m


@jit
def fastsim(creepage, patch, options):
    """Return FASTSIM's forces with flexibilities from the linear coefficients; options = (cells along, strips).

    L1 = 8 a/(3 G C11), L2 = 8 a/(3 G C22), L3 = pi a sqrt(a/b)/(4 G C23): forces at vanishing creepage are the linear
    ones.
    """
    a, G = patch.a, patch.G
    L1 = 8 * a / (3 * G * patch.c11)
    L2 = 8 * a / (3 * G * patch.c22)
    L3 = np.pi * a * np.sqrt(a / patch.b) / (4 * G * patch.c23)
    cells = int(options[0].real), int(options[1].real)
    return fastsim_of_flexibilities(creepage, patch, (L1, L2, L3), cells)


@jit
def creep_force(law, creepage, patch, options, V):
    """Return (F_x, F_y, M) at a rolling speed V, by the law with a number in `CREEP_LAWS`."""
    if law == 0:
        return linear_creep(creepage, patch, options)
    if law == 1:
        return saturated_creep(creepage, patch, options)
    if law == 2:
        return polach(creepage, patch, options, V)
    return fastsim(creepage, patch, options)


@jit
def creep_slopes(law, creepage, patch, options, V, slopes):
    """Return `creep_force`; write its derivatives by xi, eta, phi, N, a, b, c11 to c33, V to slopes, (3, 11)."""
    if law == 3:
        return fastsim_slopes(creepage, patch, options, slopes)
    (xi, eta, phi), (N, a, b, c11, c22, c23, c33, G, mu) = creepage, patch
    at = np.empty(N_CREEP_INPUTS, np.complex128)
    for k in range(N_CREEP_INPUTS):
        at[0], at[1], at[2], at[3], at[4], at[5] = xi, eta, phi, N, a, b
        at[6], at[7], at[8], at[9], at[10] = c11, c22, c23, c33, V
        at[k] += TINY * 1j
        moved, around = Creepage(at[0], at[1], at[2]), Patch(at[3], at[4], at[5], at[6], at[7], at[8], at[9], G, mu)
        fx, fy, m = creep_force(law, moved, around, options, at[10])
        slopes[0, k], slopes[1, k], slopes[2, k] = fx.imag / TINY, fy.imag / TINY, m.imag / TINY
    return fx.real, fy.real, m.real


@jit
def fastsim_slopes(creepage, patch, options, slopes):
    """Return the forces of `fastsim`; write their derivatives to slopes, see `creep_slopes`.

    With the flexibilities of `fastsim`, the recursion has five inputs: g_x = (3/8) G C11 xi, g_y = (3/8) G C22 eta,
    k b and k a with k = (4/pi) G C23 phi sqrt(b/a), and the bound B = 2 mu N/(pi a b):

    (1)  dt_x = (g_x - k b v) du,  dt_y = (g_y + k a u) du  without slip
    (2)  where |t| = |tau| exceeds the bound, t = B (1 - u² - v²) tau/|tau|, and a derivative dtau of tau becomes
         dt = B (1 - u² - v²)/|tau| (dtau - tau (tau·dtau)/|tau|²)
    (3)  the derivative by k b is -v times that by g_x; that by B follows from f = sum of inputs times derivatives,
         because f is homogeneous in the five inputs
    """
    (xi, eta, phi), (N, a, b, c11, c22, c23, _, G, mu) = creepage, patch
    m_x, m_y = int(options[0]), int(options[1])
    per_k = 4 / np.pi * G * np.sqrt(b / a)
    gx, gy, k = 0.375 * G * c11 * xi, 0.375 * G * c22 * eta, per_k * c23 * phi
    bound_0 = 2 * mu * N / (np.pi * a * b)
    dv = 2.0 / m_y
    f = np.zeros((5, 3))  # F_x, F_y and M, then their derivatives by g_x, k b, g_y, k a
    m_a, m_b = 0.0, 0.0  # moments of t_y u and t_x v, by which M = a m_a - b m_b
    for j in range(m_y):
        v = -1 + (j + 0.5) * dv
        edge = np.sqrt(1 - v * v)
        du = 2 * edge / m_x
        # tractions and their derivatives by g_x, g_y and k a; their sums
        tx, ty, x_1, y_1, x_2, y_2, x_3, y_3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        sx, sy, su, sx_1, sy_1, su_1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        sx_2, sy_2, su_2, sx_3, sy_3, su_3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(m_x):
            u = edge - (i + 0.5) * du
            step = du if i > 0 else 0.5 * du
            middle = u + 0.5 * step
            tx, ty = tx - (gx - k * b * v) * step, ty - (gy + k * a * middle) * step
            x_1, y_2, y_3 = x_1 - step, y_2 - step, y_3 - middle * step
            bound = bound_0 * (1 - u * u - v * v)
            t2 = tx * tx + ty * ty
            if t2 > bound * bound:
                size = np.sqrt(t2)
                cut, nx, ny = bound / size, tx / size, ty / size
                w_1, w_2, w_3 = nx * y_1 - ny * x_1, nx * y_2 - ny * x_2, nx * y_3 - ny * x_3
                across_x, across_y = -ny * cut, nx * cut
                x_1, y_1 = across_x * w_1, across_y * w_1
                x_2, y_2 = across_x * w_2, across_y * w_2
                x_3, y_3 = across_x * w_3, across_y * w_3
                tx, ty = tx * cut, ty * cut
            sx, sy, su = sx + tx, sy + ty, su + u * ty
            sx_1, sy_1, su_1 = sx_1 + x_1, sy_1 + y_1, su_1 + u * y_1
            sx_2, sy_2, su_2 = sx_2 + x_2, sy_2 + y_2, su_2 + u * y_2
            sx_3, sy_3, su_3 = sx_3 + x_3, sy_3 + y_3, su_3 + u * y_3
        area = a * b * du * dv
        m_a, m_b = m_a + area * su, m_b + area * v * sx
        add_forces(f[0], area, sx, sy, a * su - b * v * sx)
        add_forces(f[1], area, sx_1, sy_1, a * su_1 - b * v * sx_1)
        add_forces(f[2], -v * area, sx_1, sy_1, a * su_1 - b * v * sx_1)
        add_forces(f[3], area, sx_2, sy_2, a * su_2 - b * v * sx_2)
        add_forces(f[4], area, sx_3, sy_3, a * su_3 - b * v * sx_3)
    for r in range(3):
        value, by_gx, by_kb, by_gy, by_ka = f[0, r], f[1, r], f[2, r], f[3, r], f[4, r]
        by_bound = (value - gx * by_gx - k * b * by_kb - gy * by_gy - k * a * by_ka) / bound_0
        by_k = b * by_kb + a * by_ka
        slopes[r, 0] = 0.375 * G * c11 * by_gx
        slopes[r, 1] = 0.375 * G * c22 * by_gy
        slopes[r, 2] = per_k * c23 * by_k
        slopes[r, 3] = bound_0 / N * by_bound
        slopes[r, 4] = (value - 0.5 * k * by_k - bound_0 * by_bound) / a + k * by_ka
        slopes[r, 5] = (value + 0.5 * k * by_k - bound_0 * by_bound) / b + k * by_kb
        slopes[r, 6] = 0.375 * G * xi * by_gx
        slopes[r, 7] = 0.375 * G * eta * by_gy
        slopes[r, 8] = per_k * phi * by_k
        slopes[r, 9], slopes[r, 10] = 0.0, 0.0
    slopes[2, 4] += m_a
    slopes[2, 5] -= m_b
    return f[0, 0], f[0, 1], f[0, 2]


@jit
def add_forces(f, factor, fx, fy, m):
    """Add the forces and the moment of a strip, times a factor, to f, (3,)."""
    f[0] += factor * fx
    f[1] += factor * fy
    f[2] += factor * m
