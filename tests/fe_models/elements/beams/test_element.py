import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp

from fe_models.elements.beams.element import (
    bending_shapes,
    interpolation,
    local_stiffness,
    stiffness_about_shear_center,
)

ROUNDOFF = 1e-12
E, G, A, Iy, Iz, J, A_sy, A_sz, L = 2.1e11, 8.1e10, 1e-3, 3e-7, 2e-7, 4e-7, 8e-4, 7e-4, 0.3
ONE = np.ones(1)
PHI_Y, PHI_Z = 12 * E * Iz / (G * A_sy * L**2) * ONE, 12 * E * Iy / (G * A_sz * L**2) * ONE


def stiffness(shear_center=(0.0, 0.0)):
    K = local_stiffness(E * A * ONE, G * J * ONE, E * Iy * ONE, E * Iz * ONE, PHI_Y, PHI_Z, L * ONE)
    return stiffness_about_shear_center(K, np.array([shear_center]))[0]


def strain_energy_matrix(shear_center):
    """∫ EA u'² + GJ theta_x'² + EIz theta_z'² + EIy theta_y'² + GA_sy (v_s' - theta_z)² + GA_sz (w_s' + theta_y)²."""
    xi, w = np.polynomial.legendre.leggauss(6)
    xi, w = (xi + 1) / 2, w / 2
    h = 1e-3
    y_s, z_s = shear_center

    def fields(at):
        N = interpolation(at, PHI_Y, PHI_Z, L * ONE, np.array([shear_center]))[0]
        v_s, w_s = N[:, 1] - z_s * N[:, 3], N[:, 2] + y_s * N[:, 3]
        return np.stack([N[:, 0], N[:, 3], N[:, 5], N[:, 4], v_s, w_s], axis=1)

    # the exact derivative of a cubic by a five-point difference
    d = (fields(xi - 2 * h) - 8 * fields(xi - h) + 8 * fields(xi + h) - fields(xi + 2 * h)) / (12 * h * L)
    at = fields(xi)
    strains = [d[:, 0], d[:, 1], d[:, 2], d[:, 3], d[:, 4] - at[:, 2], d[:, 5] + at[:, 3]]
    moduli = [E * A, G * J, E * Iz, E * Iy, G * A_sy, G * A_sz]
    return sum(c * L * np.einsum("p,pi,pj->ij", w, e, e) for c, e in zip(moduli, strains, strict=True))


@pytest.mark.parametrize("shear_center", [(0.0, 0.0), (0.02, -0.03)])
def test_stiffness_is_the_energy_of_the_interpolated_fields(shear_center):
    K = stiffness(shear_center)
    assert_allclose(K, strain_energy_matrix(shear_center), rtol=0, atol=1e-9 * np.abs(K).max())


def test_shapes_solve_the_equations_of_the_timoshenko_beam():
    """Second road: the boundary value problem solved numerically for a unit rotation of the first end."""

    def equations(x, y):
        _, theta, curvature, gamma = y
        return np.stack([gamma + theta, curvature, -G * A_sy * gamma / (E * Iz), np.zeros_like(x)])

    def ends(a, b):
        return np.array([a[0], a[1] - 1, b[0], b[1]])

    x = np.linspace(0, L, 21)
    solution = solve_bvp(equations, ends, x, np.zeros((4, 21)), tol=1e-8)
    deflection, rotation = bending_shapes(x / L, PHI_Y, L * ONE)
    assert_allclose(deflection[0, :, 1], solution.sol(x)[0], rtol=0, atol=1e-6 * L)
    assert_allclose(rotation[0, :, 1], solution.sol(x)[1], rtol=0, atol=1e-6)


def test_shapes_carry_rigid_motion_and_unit_end_values():
    N = interpolation(np.array([0.0, 0.37, 1.0]), PHI_Y, PHI_Z, L * ONE, np.array([[0.02, -0.03]]))[0]
    assert_allclose(N[0], np.eye(12)[:6], rtol=0, atol=ROUNDOFF)
    assert_allclose(N[2], np.eye(12)[6:], rtol=0, atol=ROUNDOFF)
    rotation_z = np.zeros(12)
    rotation_z[[5, 7, 11]] = 1, L, 1
    rotation_y = np.zeros(12)
    rotation_y[[4, 8, 10]] = 1, -L, 1
    assert_allclose(N[1] @ rotation_z, [0, 0.37 * L, 0, 0, 0, 1], rtol=0, atol=ROUNDOFF)
    assert_allclose(N[1] @ rotation_y, [0, 0, -0.37 * L, 0, 1, 0], rtol=0, atol=ROUNDOFF)


def test_cantilever_of_one_element_deflects_exactly():
    """Tip force P: P L³/(3 E I) + P L/(kappa G A); tip moment: M L²/(2 E I); rotation P L²/(2 E I)."""
    free = stiffness()[6:, 6:]
    u = np.linalg.solve(free, np.eye(6))
    assert_allclose(u[1, 1], L**3 / (3 * E * Iz) + L / (G * A_sy), rtol=1e-12)
    assert_allclose(u[2, 2], L**3 / (3 * E * Iy) + L / (G * A_sz), rtol=1e-12)
    assert_allclose(u[1, 5], L**2 / (2 * E * Iz), rtol=1e-12)
    assert_allclose(u[2, 4], -(L**2) / (2 * E * Iy), rtol=1e-12)
    assert_allclose(u[0, 0], L / (E * A), rtol=1e-12)
    assert_allclose(u[3, 3], L / (G * J), rtol=1e-12)


def test_a_force_at_the_shear_center_does_not_twist():
    y_s, z_s = 0.02, -0.03
    f = np.array([0, 1.0, 0, -z_s, 0, 0])  # unit force along y at the shear centre, brought to the centroid
    u = np.linalg.solve(stiffness((y_s, z_s))[6:, 6:], f)
    assert abs(u[3]) <= ROUNDOFF * np.abs(u).max() / L
    assert_allclose(u[1], L**3 / (3 * E * Iz) + L / (G * A_sy), rtol=1e-12)
