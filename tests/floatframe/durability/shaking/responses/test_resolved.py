"""Integrals over resonances against closed forms and the covariance equation of Lyapunov."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from floatframe.durability.shaking.responses.resolved import resolved_band, weights_of
from floatframe.errors import ModelError


@pytest.mark.parametrize("zeta", [0.3, 0.02, 1e-3, 1e-4])
def test_the_peak_of_a_mass_is_integrated_to_the_arctangent_of_its_band(zeta):
    # |1/(1 - r² + 2 i zeta r)|² over r from 0.1 to 10 by partial fractions in complex numbers
    band = resolved_band(3.0, 300.0, np.array([30.0]), np.array([zeta]))
    r = band.frequencies / 30.0
    value = band.integral(1 / ((1 - r**2) ** 2 + (2 * zeta * r) ** 2)) / 30.0
    poles = np.array([s * np.sqrt(1 - zeta**2) + 1j * t * zeta for s in (1, -1) for t in (1, -1)])
    residues = [1 / np.prod(p - np.delete(poles, k)) for k, p in enumerate(poles)]
    exact = sum(c * (np.log(10.0 - p) - np.log(0.1 - p)) for c, p in zip(residues, poles, strict=True)).real
    assert_allclose(value, exact, rtol=1e-8)


def test_the_bound_lies_above_the_error():
    band = resolved_band(3.0, 300.0, np.array([30.0]), np.array([0.01]))
    r = band.frequencies / 30.0
    values = 1 / ((1 - r**2) ** 2 + (0.02 * r) ** 2)
    fine = resolved_band(3.0, 300.0, np.linspace(29, 31, 41), np.full(41, 0.01))
    r = fine.frequencies / 30.0
    exact = fine.integral(1 / ((1 - r**2) ** 2 + (0.02 * r) ** 2))
    assert abs(band.integral(values) - exact) <= band.error(values)
    assert band.error(values) < 1e-4 * exact


def test_close_modes_under_white_noise_have_the_covariance_of_lyapunov():
    omega, zeta = 2 * np.pi * np.array([20.0, 20.3, 45.0]), np.array([0.01, 0.01, 0.03])
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.diag(omega**2), -np.diag(2 * zeta * omega)]])
    B = np.concatenate([np.zeros(3), [1.0, -0.7, 2.0]])[:, None]
    S = 0.3  # one-sided, per Hz: the covariance of the noise is S/2
    P = la.solve_continuous_lyapunov(A, -B @ B.T * S / 2)
    band = resolved_band(1e-3, 1e6, omega / (2 * np.pi), zeta)
    w = 2 * np.pi * band.frequencies[:, None]
    eta = B[3:, 0] / (omega**2 - w**2 + 2j * zeta * omega * w)
    covariance = band.integral(np.einsum("fk,fl->fkl", eta, eta.conj()).real) * S
    assert_allclose(covariance, P[:3, :3], rtol=0, atol=2e-6 * P[0, 0])  # the band leaves out 1e-3 Hz at its foot
    rates = band.integral(np.einsum("fk,fl->fkl", 1j * w * eta, (1j * w * eta).conj()).real) * S
    assert_allclose(rates, P[3:, 3:], rtol=0, atol=2e-6 * np.abs(P[3:, 3:]).max())


def test_the_weights_are_exact_for_polynomials():
    x = -np.cos(np.pi * np.arange(13) / 12)
    for power in range(13):
        assert_allclose(weights_of(12) @ x**power, 2 / (power + 1) if power % 2 == 0 else 0.0, rtol=0, atol=1e-13)


def test_a_band_that_does_not_rise_is_refused():
    with pytest.raises(ModelError, match="ascending band above 0 Hz, got 10 to 5"):
        resolved_band(10.0, 5.0, np.array([7.0]), np.array([0.01]))


def test_a_wide_band_without_modes_has_panels_by_the_octave():
    """The integral of f^-3 over four decades, which one panel would miss by far."""
    for first, last in ((1.0, 1e4), (3.0, 5.0), (20.0, 2000.0)):
        band = resolved_band(first, last, np.zeros(0), np.zeros(0))
        exact = (first**-2 - last**-2) / 2
        assert_allclose(band.integral(band.frequencies**-3), exact, rtol=1e-12)
        assert band.error(band.frequencies**-3) < 1e-7 * exact
