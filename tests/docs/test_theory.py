"""Formulas that docs/theory.md states and that no other test holds against the code."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from floatframe import GeneralizedAlpha
from floatframe.model.rotations import right_jacobian, rotation_exp, tilde

ROUNDOFF = 1e-12


def turned_by(theta):
    """exp(tilde(theta)) in the closed form of section 0."""
    t = np.linalg.norm(theta)
    return np.eye(3) + np.sin(t) / t * tilde(theta) + (1 - np.cos(t)) / t**2 * tilde(theta) @ tilde(theta)


@pytest.mark.parametrize("seed", range(3))
def test_section_0_the_exponential_map(seed):
    theta = np.random.default_rng(seed).normal(size=3)
    assert_allclose(turned_by(theta), expm(tilde(theta)), rtol=0, atol=ROUNDOFF)
    assert_allclose(rotation_exp(theta), turned_by(theta), rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("seed", range(3))
def test_section_0_its_right_jacobian_gives_the_angular_velocity_in_body_axes_and_its_transpose_in_those_before(seed):
    rng = np.random.default_rng(seed)
    theta, rate = rng.normal(size=3), rng.normal(size=3)
    t = np.linalg.norm(theta)
    T = np.eye(3) - (1 - np.cos(t)) / t**2 * tilde(theta) + (t - np.sin(t)) / t**3 * tilde(theta) @ tilde(theta)
    assert_allclose(right_jacobian(theta), T, rtol=0, atol=ROUNDOFF)
    s = 1e-20  # a step along the imaginary axis: derivatives to rounding
    R_dot = np.array(expm(tilde_complex(theta + 1j * s * rate)).imag / s)
    R = turned_by(theta)
    assert_allclose(R.T @ R_dot, tilde(T @ rate), rtol=0, atol=10 * ROUNDOFF)
    assert_allclose(R_dot @ R.T, tilde(T.T @ rate), rtol=0, atol=10 * ROUNDOFF)


def tilde_complex(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def amplification(parameters, omega_h):
    """One step of generalized-alpha for u_dot = -omega² x with h = 1, as a matrix over (x, u, a, u_dot)."""
    alpha_m, alpha_f, beta, gamma = parameters
    # (1 - alpha_m) a_1 + alpha_m a_0 = (1 - alpha_f) u_dot_1 + alpha_f u_dot_0, with u_dot_1 = -omega² x_1
    new = np.array([[1, 0, -beta, 0], [0, 1, -gamma, 0], [0, 0, 1 - alpha_m, alpha_f - 1], [omega_h**2, 0, 0, 1.0]])
    old = np.array([[1, 1, 0.5 - beta, 0], [0, 1, 1 - gamma, 0], [0, 0, -alpha_m, alpha_f], [0, 0, 0, 0.0]])
    return np.linalg.solve(new, old)


@pytest.mark.parametrize("rho_inf", [0.0, 0.3, 0.8, 1.0])
def test_section_9_roots_of_what_the_step_does_not_resolve_are_minus_rho_inf(rho_inf):
    alpha_m, alpha_f, beta, gamma = GeneralizedAlpha(rho_inf).coefficients
    assert_allclose(gamma, 0.5 + alpha_f - alpha_m, rtol=0, atol=ROUNDOFF)
    assert_allclose(beta, (gamma + 0.5) ** 2 / 4, rtol=0, atol=ROUNDOFF)
    limit = np.array([[1 - gamma / beta, 1 - gamma / (2 * beta)], [-1 / beta, 1 - 1 / (2 * beta)]])
    assert_allclose(np.trace(limit), -2 * rho_inf, rtol=0, atol=ROUNDOFF * 10)
    assert_allclose(np.linalg.det(limit), rho_inf**2, rtol=0, atol=ROUNDOFF * 10)
    characteristic = np.poly(amplification((alpha_m, alpha_f, beta, gamma), 1e6))  # x, u, a and a root of zero
    expected = np.poly([-rho_inf, -rho_inf, -rho_inf, 0.0])
    assert_allclose(characteristic, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("rho_inf", [0.0, 0.3, 0.8, 1.0])
def test_section_9_no_mode_gains_amplitude_in_a_step_of_any_size(rho_inf):
    for omega_h in np.geomspace(1e-2, 1e4, 60):
        roots = np.linalg.eigvals(amplification(GeneralizedAlpha(rho_inf).coefficients, omega_h))
        assert np.abs(roots).max() <= 1 + 1e-7


@pytest.fixture(scope="module")
def rows():
    """Return frames A and B, places, and variations of all of them: (values of the rows, stated variations)."""
    rng = np.random.default_rng(4)
    A, B = turned_by(rng.normal(size=3)), turned_by(rng.normal(size=3))
    r = rng.normal(size=(2, 3))
    return A, B, r, rng.normal(size=(2, 3)), rng.normal(size=(2, 3))


def test_section_10_variations_of_the_rows_of_joints(rows):
    A, B, r, dr, dphi = rows

    def values(s):
        A_s = expm(s * tilde_complex(dphi[0])) @ A
        B_s = expm(s * tilde_complex(dphi[1])) @ B
        d = r[1] + s * dr[1] - r[0] - s * dr[0]
        return np.array([A_s[:, 0] @ B_s[:, 1], A_s[:, 0] @ d, np.sqrt(d @ d)])

    rate = values(1e-20j).imag / 1e-20
    d, x_A, y_B = r[1] - r[0], A[:, 0], B[:, 1]
    stated = [
        np.cross(x_A, y_B) @ (dphi[0] - dphi[1]),
        x_A @ (dr[1] - dr[0]) + np.cross(x_A, d) @ dphi[0],
        d @ (dr[1] - dr[0]) / np.linalg.norm(d),
    ]
    assert_allclose(rate, stated, rtol=0, atol=10 * ROUNDOFF)


def test_section_10_the_wrench_of_a_slide_row_is_in_balance_by_the_arm_row(rows):
    A, _, r, _, _ = rows
    lam, d = 0.7, r[1] - r[0]
    F, M, N = -lam * A[:, 0], lam * np.cross(A[:, 0], d), np.zeros(3)
    assert_allclose(M - N - np.cross(d, F), 0, rtol=0, atol=ROUNDOFF)
    # the same forces as the multiplier times the variation of the row, and no moment about any point
    assert_allclose(np.cross(r[0], F) + M - np.cross(r[1], F) - N, 0, rtol=0, atol=ROUNDOFF)


def test_section_10_a_load_on_a_marker_works_on_its_body_as_on_itself():
    rng = np.random.default_rng(8)
    n = 4
    Psi, q, c = rng.normal(size=(6, n)), 0.3 * rng.normal(size=n), rng.normal(size=3)
    R, r = turned_by(rng.normal(size=3)), rng.normal(size=3)
    F, M = rng.normal(size=3), rng.normal(size=3)
    dx, dphi, dq = rng.normal(size=3), rng.normal(size=3), rng.normal(size=n)
    rho, theta = c + Psi[:3] @ q, Psi[3:] @ q

    def pose(s):
        R_s = R @ expm(s * tilde_complex(dphi))
        q_s = q + s * dq
        return r + s * R @ dx + R_s @ (c + Psi[:3] @ q_s), R_s @ expm(tilde_complex(Psi[3:] @ q_s))

    _, axes = pose(0.0)
    moved, turned = (value.imag / 1e-20 for value in pose(1e-20j))
    spin = turned @ axes.T
    work = F @ moved + M @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    F_B, M_B = R.T @ F, R.T @ M
    h = Psi[:3].T @ F_B + Psi[3:].T @ right_jacobian(theta) @ M_B
    stated = F_B @ dx + (np.cross(rho, F_B) + M_B) @ dphi + h @ dq
    assert_allclose(work, stated, rtol=0, atol=10 * ROUNDOFF)


def test_section_1_the_load_of_a_distributing_interface_has_the_resultant_of_its_reference():
    rng = np.random.default_rng(2)
    levers, w = rng.normal(size=(7, 3)), rng.uniform(0.5, 2, 7)
    G = np.array([np.hstack([np.eye(3), -tilde(x)]) for x in levers])
    N = np.einsum("n,nai,naj->ij", w, G, G)
    f = rng.normal(size=6)
    members = np.einsum("n,nai,i->na", w, G, np.linalg.solve(N, f))
    resultant = np.concatenate([members.sum(axis=0), np.cross(levers, members).sum(axis=0)])
    assert_allclose(resultant, f, rtol=0, atol=10 * ROUNDOFF)
