"""The ellipse of Hertz against elliptic integrals by quadrature, the displacement it causes, and printed values."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import dblquad, quad

from floatframe.components.rails.hertz import ellipse


@pytest.mark.parametrize(("A", "B"), [(1.0, 1.0), (1.0, 1.3), (1.1, 0.05), (0.02, 3.0)])
def test_the_ellipse_solves_the_integral_equations_of_hertz(A, B):
    """Of the potential of an ellipsoid: A = c int dw/((a² + w) D), B = c int dw/((b² + w) D), approach = c int dw/D."""
    E, N = 2.0, 3.0
    found = ellipse(np.array(A), np.array(B), E)
    a, b = found.a_1 * N ** (1 / 3), found.b_1 * N ** (1 / 3)

    def integral(weight):  # w = tan²(t) b²: a finite interval without singularity
        def f(t):
            w = (b * np.tan(t)) ** 2
            return weight(w) / np.sqrt((a**2 + w) * (b**2 + w)) * 2 * b / np.cos(t) ** 2

        return quad(f, 0, np.pi / 2, epsabs=0, epsrel=1e-11)[0]

    c = 3 * N / (4 * np.pi * E)
    assert_allclose(c * integral(lambda w: 1 / (a**2 + w)), A, rtol=1e-8)
    assert_allclose(c * integral(lambda w: 1 / (b**2 + w)), B, rtol=1e-8)
    assert_allclose((N / found.stiffness) ** (2 / 3), c * integral(lambda w: 1.0), rtol=1e-8)
    assert_allclose(found.ratio, a / b, rtol=1e-13)


def test_the_pressure_presses_the_surfaces_into_each_other():
    """Boussinesq: u = int p/(pi E* distance) at the middle and beside it must be approach - A x² - B y²."""
    A, B, E, N = 1.0, 2.5, 1.0, 1.0
    found = ellipse(np.array(A), np.array(B), E)
    a, b = float(found.a_1), float(found.b_1)
    approach = float((N / found.stiffness) ** (2 / 3))
    for x, y in ((0.0, 0.0), (0.4 * a, 0.0), (0.0, 0.5 * b)):

        def density(r, t, x=x, y=y):
            u, v = (x + r * np.cos(t)) / a, (y + r * np.sin(t)) / b
            return np.sqrt(max(0.0, 1 - u * u - v * v))

        def reach(t, x=x, y=y):
            p = (np.cos(t) / a) ** 2 + (np.sin(t) / b) ** 2
            q = x * np.cos(t) / a**2 + y * np.sin(t) / b**2
            return (-q + np.sqrt(q * q + p * (1 - (x / a) ** 2 - (y / b) ** 2))) / p

        volume = dblquad(density, 0, 2 * np.pi, 0, reach, epsabs=1e-7, epsrel=1e-7)[0]
        u = 3 * N / (2 * np.pi * a * b) * volume / (np.pi * E)
        assert_allclose(u, approach - A * x * x - B * y * y, rtol=1e-5)


def test_a_ball_on_a_plane_is_the_closed_form():
    R, E, N = 0.5, 2e11, 1e4
    found = ellipse(np.array(1 / (2 * R)), np.array(1 / (2 * R)), E)
    assert_allclose(found.a_1 * N ** (1 / 3), (3 * N * R / (4 * E)) ** (1 / 3), rtol=1e-9)
    assert_allclose(found.stiffness, 4 / 3 * E * np.sqrt(R), rtol=1e-9)


def test_the_ellipse_of_contact_is_that_of_another_program():
    """CONTACT's example of FASTSIM: A, B = 0.8464, 2.406 1/m, G = 82 GPa, nu = 0.28, 82 kN: 8, 4, 0.09267 mm."""
    found = ellipse(np.array(0.8464), np.array(2.406), 82e9 / 0.72)
    cube = 82e3 ** (1 / 3)
    assert_allclose([found.a_1 * cube, found.b_1 * cube], [8e-3, 4e-3], rtol=2e-4)
    assert_allclose((82e3 / found.stiffness) ** (2 / 3), 9.267e-5, rtol=2e-4)


def test_exchanged_curvatures_exchange_the_axes():
    one, other = (
        ellipse(np.array([0.3, 0.8]), np.array([0.8, 0.3]), 1.0),
        ellipse(np.array([0.8, 0.3]), np.array([0.3, 0.8]), 1.0),
    )
    assert_allclose(one.a_1, other.b_1, rtol=1e-14)
    assert_allclose(one.stiffness, other.stiffness, rtol=1e-14)
