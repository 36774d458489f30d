"""Creep forces of an elliptic contact: linear, linear with saturation, Polach, FASTSIM.

Each is a function law(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options) -> (F_x, F_y, M) on the wheel. xi and
eta are longitudinal and lateral creepage, the velocity of the wheel surface relative to the rail divided by the rolling
speed; phi the spin [rad/m]; N the normal force [N]; a (rolling direction) and b the semi-axes [m]; then Kalker's
coefficients; G [Pa]; mu the friction coefficient; `options` further parameters of a law. x points in the rolling
direction, z away from the rail. Numbers may be float64 or complex128 (a step along the imaginary axis gives
derivatives); comparisons use real parts.
"""

import numba
import numpy as np

__all__ = ["creep_force", "fastsim", "fastsim_of_flexibilities", "linear_creep", "polach", "saturated_creep"]

SMALL = 1e-8  #: creepage below which the direction in Polach's law is smoothed


@numba.njit(cache=True)
def linear_creep(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options):
    """Return Kalker's linear forces, without a friction limit."""
    c2 = a * b
    c = np.sqrt(c2)
    return (
        -c2 * G * c11 * xi,
        -c2 * G * (c22 * eta + c * c23 * phi),
        c2 * c * G * (c23 * eta - c * c33 * phi),
    )


@numba.njit(cache=True)
def saturated_creep(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options):
    """Return the linear forces, with resultant F limited to mu N (e - e²/3 + e³/27), e = F/(mu N) <= 3 (Shen 1983)."""
    fx, fy, m = linear_creep(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options)
    e2 = (fx * fx + fy * fy) / (mu * mu * N * N)
    if e2.real < 1e-20:
        return fx, fy, m
    e = np.sqrt(e2)
    factor = 1 - e / 3 + e2 / 27 if e.real < 3 else 1 / e
    return fx * factor, fy * factor, m * factor


@numba.njit(cache=True)
def polach(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options, V):
    """Return Polach's forces (1999, 2005); options = (k_A, k_S, A, B), V the rolling speed.

    (1)  friction falls with the slip speed w = V |creepage|: mu (A + (1 - A) exp(-B w))
    (2)  eta_c = eta + phi a where that is larger than eta, else eta;  nu_c = |(xi, eta_c)|
    (3)  e = (1/4) pi G a b C_jj nu_c/(mu N),  C_jj² = ((C11 xi)² + (C22 eta)²)/|(xi, eta)|²
    (4)  F = (2 mu N/pi) (k_A e/(1 + (k_A e)²) + atan(k_S e)), against the creepage
    (5)  lateral force of spin: (9/16) a mu N K (1 + 6.3 (1 - exp(-a/b))) phi/nu_c,
         K = |e_M| (d³/3 - d²/2 + 1/6) - (1 - d²)^(3/2)/3 < 0,  d = (e_M² - 1)/(e_M² + 1),
         e_M = (8/3) G b sqrt(a b) C23 eta_c/((1 + 6.3 (1 - exp(-a/b))) mu N)
    """
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


@numba.njit(cache=True)
def fastsim_of_flexibilities(xi, eta, phi, N, a, b, L1, L2, L3, mu, m_x, m_y):
    """Return the forces of Kalker's simplified theory (1982) with flexibilities L1, L2, L3 [m³/N].

    The surface displacement is L times the local traction. In each of m_y strips, from the leading edge, u = x/a
    decreases from sqrt(1 - v²), v = y/b:

    (1)  dt_x = (xi/L1 - phi b v/L3) a du,  dt_y = (eta/L2 + phi a u/L3) a du  without slip
    (2)  if |t| exceeds the bound mu p, p = 2 N (1 - u² - v²)/(pi a b), it is reduced to the bound
    (3)  force = sum of t over cells of equal width in their strip, with the tractions at their middle
    """
    fx = 0 * (xi + N)
    fy = 0 * (xi + N)
    m = 0 * (xi + N)
    bound_0 = 2 * mu * N / (np.pi * a * b)
    gx, gx_v = xi / L1 * a, phi * b / L3 * a
    gy, gy_u = eta / L2 * a, phi * a / L3 * a
    dv = 2.0 / m_y
    for j in range(m_y):
        v = -1 + (j + 0.5) * dv
        edge = np.sqrt(1 - v * v)
        du = 2 * edge / m_x
        tx = 0 * fx
        ty = 0 * fx
        sx = 0 * fx
        sy = 0 * fx
        sm = 0 * fx
        for i in range(m_x):
            u = edge - (i + 0.5) * du
            step = du if i > 0 else 0.5 * du
            middle = u + 0.5 * step
            tx = tx - (gx - gx_v * v) * step
            ty = ty - (gy + gy_u * middle) * step
            bound = bound_0 * (1 - u * u - v * v)
            t2 = tx * tx + ty * ty
            if t2.real > (bound * bound).real:
                cut = bound / np.sqrt(t2)
                tx = tx * cut
                ty = ty * cut
            sx = sx + tx
            sy = sy + ty
            sm = sm + a * u * ty - b * v * tx
        cell = a * b * du * dv
        fx = fx + sx * cell
        fy = fy + sy * cell
        m = m + sm * cell
    return fx, fy, m


@numba.njit(cache=True)
def fastsim(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options):
    """Return FASTSIM's forces with flexibilities from the linear coefficients; options = (cells along, strips).

    L1 = 8 a/(3 G C11), L2 = 8 a/(3 G C22), L3 = pi a sqrt(a/b)/(4 G C23): forces at vanishing creepage are the linear
    ones.
    """
    L1 = 8 * a / (3 * G * c11)
    L2 = 8 * a / (3 * G * c22)
    L3 = np.pi * a * np.sqrt(a / b) / (4 * G * c23)
    return fastsim_of_flexibilities(xi, eta, phi, N, a, b, L1, L2, L3, mu, int(options[0].real), int(options[1].real))


@numba.njit(cache=True)
def creep_force(law, xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options, V):
    """Return (F_x, F_y, M) at a rolling speed V, by the law with a number in `creep_names.CREEP_LAWS`."""
    if law == 0:
        return linear_creep(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options)
    if law == 1:
        return saturated_creep(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options)
    if law == 2:
        return polach(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options, V)
    return fastsim(xi, eta, phi, N, a, b, c11, c22, c23, c33, G, mu, options)
