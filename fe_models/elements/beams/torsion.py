"""Saint-Venant torsion of a rectangle, from the series of its stress function.

The stress function of a rectangle b x h (|y| <= b/2, |z| <= h/2) with psi = 0 on the boundary and laplacian -2:
psi = b²/4 - y² - (8 b²/pi³) Σ_odd (-1)^((n-1)/2) / n³ · cos(n pi y/b) cosh(n pi z/b) / cosh(n pi h/(2 b)).
J = 2 ∫ psi, and the shear stress for the torque T is tau_xz = -(T/J) ∂psi/∂y.
"""

import numpy as np

__all__ = ["rectangle_torsion_constant", "rectangle_torsion_stress"]

_ODD = np.arange(1.0, 400.0, 2.0)


def rectangle_torsion_constant(b: float, h: float) -> float:
    """Return the torsion constant J of a rectangle [m⁴]: (l t³/3) (1 - 192 t/(pi⁵ l) Σ_odd tanh(n pi l/(2 t)) / n⁵)."""
    t, length = min(b, h), max(b, h)
    series = (np.tanh(_ODD * np.pi * length / (2 * t)) / _ODD**5).sum()
    return float(length * t**3 / 3 * (1 - 192 * t / (np.pi**5 * length) * series))


def rectangle_torsion_stress(b: float, h: float) -> float:
    """Return the shear stress at the mid-point of the side y = b/2 for a unit torque [1/m³].

    This is -∂psi/∂y = b (1 - (8/pi²) Σ_odd 1 / (n² cosh(n pi h/(2 b)))), divided by J. It is the maximum if b <= h.
    """
    argument = np.minimum(_ODD * np.pi * h / (2 * b), 300.0)
    series = (1 / (_ODD**2 * np.cosh(argument))).sum()
    return float(b * (1 - 8 / np.pi**2 * series) / rectangle_torsion_constant(b, h))
