"""A thin elastic beam that turns steadily about an axis across it: its bending frequencies, by two roads.

Small transverse motion w(x, t) of a uniform beam, x from its root at alpha L from the axis; L = EI = rho A = 1:

    w'''' - (T w')' - (omega² + delta eta²) w = 0,   T = eta² (alpha (1 - x) + (1 - x²)/2)

eta: speed; delta = 0 across the plane of rotation (flap), 1 in it (lag, without the Coriolis force of the stiff axis).
"""

import numpy as np
from numpy.polynomial import Legendre, Polynomial, legendre
from scipy.linalg import eigh

X, WEIGHTS = legendre.leggauss(60)


def ritz(K, M, delta, eta):
    """Return frequencies of K - (omega² + delta eta²) M."""
    return np.sqrt(np.maximum(eigh(K - delta * eta**2 * M, M, eigvals_only=True), 0.0))


def cantilever_frequencies(eta, alpha=0.0, *, delta=0, n=14):
    """Return frequencies of the clamped beam by x² times Legendre polynomials, ascending, the first about n/2 good."""
    x, weights = (X + 1) / 2, WEIGHTS / 2
    shapes = [Legendre.basis(k, domain=[0, 1]).convert(kind=Polynomial) * Polynomial([0, 0, 1]) for k in range(n)]
    v, d, dd = (np.array([shape.deriv(order)(x) for shape in shapes]) for order in range(3))
    T = eta**2 * (alpha * (1 - x) + (1 - x**2) / 2)
    return ritz((dd * weights) @ dd.T + (d * weights * T) @ d.T, (v * weights) @ v.T, delta, eta)


def free_frequencies(eta, *, delta=0, n=16):
    """Return frequencies of the free beam that spins about its middle: two of rigid motions first."""
    x, weights = X / 2, WEIGHTS / 2
    shapes = [Legendre.basis(k, domain=[-0.5, 0.5]).convert(kind=Polynomial) for k in range(n)]
    v, d, dd = (np.array([shape.deriv(order)(x) for shape in shapes]) for order in range(3))
    T = eta**2 * (0.25 - x**2) / 2
    return ritz((dd * weights) @ dd.T + (d * weights * T) @ d.T, (v * weights) @ v.T, delta, eta)


def end_condition(omega, eta, alpha, *, n=120):
    """Return the determinant of w''(1) = w'''(1) = 0 by the power series of w (Frobenius); zero at a frequency."""
    rows = []
    for start in (2, 3):
        c = np.zeros(n)
        c[start] = 1.0
        for k in range(n - 4):
            tension = (alpha + 0.5) * (k + 2) * (k + 1) * c[k + 2] - alpha * (k + 1) ** 2 * c[k + 1]
            tension -= 0.5 * k * (k + 1) * c[k]
            value = (eta**2 * tension + omega**2 * c[k]) / ((k + 4) * (k + 3) * (k + 2) * (k + 1))
            if k + 4 > 3:
                c[k + 4] = value
        w = Polynomial(c)
        rows.append([w.deriv(2)(1.0), w.deriv(3)(1.0)])
    return float(np.linalg.det(np.array(rows)))


def whirl_frequencies(n, *, E, rho, A, inertia, length, speed):
    """Return forward and backward whirl of mode n of a pinned round Rayleigh shaft, in axes at rest.

    (A + I k²) omega² - 2 I k² Omega omega - E I k⁴/rho = 0, k = n pi/L: rotary inertia, polar moment 2 I, no shear.
    """
    k = n * np.pi / length
    mass, gyro = A + inertia * k**2, inertia * k**2 * speed
    root = np.sqrt(gyro**2 + mass * E * inertia * k**4 / rho)
    return (root + gyro) / mass, (root - gyro) / mass
