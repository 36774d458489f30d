"""Von Mises stress of vibrations: its largest value over a cycle, and its rms and distribution in random vibration.

For the six components sigma, vm² = sigmaᵀ A sigma. For sigma(t) = Re(s exp(i omega t))

    vm²(t) = ½ (s^H A s + Re(sᵀ A s exp(2 i omega t))),   largest: ½ (s^H A s + |sᵀ A s|)

For a Gaussian sigma with covariance Sigma, the mean square is exactly tr(A Sigma) (Segalman et al. (2000)), which is
the integral of the density tr(A S(f)). vm is not Gaussian and never negative: vm² is Σ lambda_k chi²_1 with the
eigenvalues lambda of Lᵀ A L, Sigma = L Lᵀ.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from fe_models.foundation.arrays import Array

__all__ = ["VON_MISES", "RandomVonMises", "cycle_von_mises", "exceeded", "random_von_mises", "von_mises_density"]

#: matrix A of the von Mises stress, for components xx yy zz yz xz xy
VON_MISES = np.array(
    [
        [1, -0.5, -0.5, 0, 0, 0],
        [-0.5, 1, -0.5, 0, 0, 0],
        [-0.5, -0.5, 1, 0, 0, 0],
        [0, 0, 0, 3, 0, 0],
        [0, 0, 0, 0, 3, 0],
        [0, 0, 0, 0, 0, 3],
    ]
)
WITHIN_3_SIGMA = 0.9973002039367398  #: probability that a Gaussian lies within three standard deviations
NEGLIGIBLE = 1e-9  #: relative size of a negligible eigenvalue
STEPS = 801


def cycle_von_mises(stress: Array) -> Array:
    """Return the largest von Mises stress over a cycle of complex amplitudes, (..., 6) -> (...)."""
    hermitian = np.einsum("...a,ab,...b->...", stress.conj(), VON_MISES, stress).real
    bilinear = np.abs(np.einsum("...a,ab,...b->...", stress, VON_MISES, stress))
    return np.asarray(np.sqrt(np.maximum(hermitian + bilinear, 0.0) / 2))


def von_mises_density(density: Array) -> Array:
    """Return tr(A S(f)) of spectral densities of the components, (..., 6, 6) complex -> (...)."""
    return np.asarray(np.einsum("ab,...ba->...", VON_MISES, density).real)


class RandomVonMises(NamedTuple):
    """Von Mises stress of a Gaussian stress."""

    rms: float  #: exact root mean square
    quantile: float  #: value that is not exceeded 99.73 % of the time, like 3 sigma of a Gaussian
    factor: float  #: quantile divided by rms: 3 if one component dominates, otherwise less


def random_von_mises(covariance: Array) -> RandomVonMises:
    """Return the rms, and the value that is not exceeded 99.73 % of the time, for a covariance (6, 6)."""
    values, axes = np.linalg.eigh((covariance + covariance.T) / 2)
    L = axes * np.sqrt(np.maximum(values, 0.0))
    lam = np.linalg.eigvalsh(L.T @ VON_MISES @ L)
    total = float(lam.sum())
    if total <= 0:
        return RandomVonMises(0.0, 0.0, 3.0)
    share = lam[lam > NEGLIGIBLE * total] / total
    square = float(brentq(lambda x: exceeded(share, x) - (1 - WITHIN_3_SIGMA), 1.0, 10.0, xtol=1e-9))
    return RandomVonMises(float(np.sqrt(total)), float(np.sqrt(total * square)), float(np.sqrt(square)))


def exceeded(lam: Array, x: float) -> float:
    """Return the probability of Σ lam_k z_k² > x for independent standard normal z_k.

    P = 1/(2 pi i) ∫ exp(-s x)/s Π (1 - 2 lam_k s)^(-1/2) ds, upwards between 0 and the first branch point
    b = 1/(2 max lam). On the parabola s = b/2 + i u + u²/(4 b), which opens around the branch cut, the integrand decays
    like exp(-u² x/(4 b)), so that the trapezoidal rule converges faster than any power of the step.
    """
    b = 1 / (2 * float(lam.max()))
    end = np.sqrt(4 * b * 40 / x) + 10 * b
    u = np.linspace(-end, end, STEPS)
    s = b / 2 + 1j * u + u**2 / (4 * b)
    factors = np.prod(np.sqrt(1 - 2 * lam[:, None] * s), axis=0)
    values = np.exp(-s * x) / s / factors * (1j + u / (2 * b))
    return float((values.sum() * (u[1] - u[0]) / (2j * np.pi)).real)
