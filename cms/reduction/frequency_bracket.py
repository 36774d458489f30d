"""Largest errors of frequencies that the corrections of a mode set allow, where modes are close to its cutoff.

Let V be the free modes of a mode set, scaled to unit strain energy, and W an orthonormal basis of everything beside
them, Vᵀ K W = 0. The mass of the body in this basis is [mu_V, B; Bᵀ, A], and its eigenvalues are mu = 1 / omega².

(1) The shapes beside V have mu_out = 1 / omega_cut² at most, omega_cut the highest vibration mode of the set. So for
    mu > mu_out as many eigenvalues exceed mu as those of mu_V - mu + B (mu - A)⁻¹ Bᵀ exceed 0 (Haynsworth).
(2) The function (mu - x)⁻¹ is convex, hence (mu - A)⁻¹ <= 1 / mu + A / (mu (mu - mu_out)). The corrections contain the
    range of Bᵀ, so that B Bᵀ and B A Bᵀ are known.
(3) Shapes beside V that were found above mu_out join V.
(4) Let D be the eigenvalues of V and the found shapes, and C their coupling by (2), scaled by its root. The number of
    positive eigenvalues of D - mu + C Cᵀ is that of D - mu plus the negative ones of 1 + Cᵀ (D - mu)⁻¹ C.
(5) Frequency k is wrong by e at most if no more than k eigenvalues reach mu = (1 + e)² / omega_k², k from 0.

The Rayleigh-Ritz method with the corrections is the lower end: it takes (mu - A)⁻¹ in their span alone. The distance of
the two ends is large where modes lie close to each other and to the cutoff.
"""

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array

__all__ = ["largest_errors"]

#: tried ratios of an error to its estimate
FACTORS = (1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


def largest_errors(errors: Array, omega2: Array, masses: tuple[Array, Array, Array], cutoff: float) -> Array:
    """Return the largest f_reduced / f - 1 of each judged frequency, (n,); NaN: not limited.

    Parameters
    ----------
    errors
        Estimates of f_reduced / f - 1 above zero, (n,).
    omega2
        Squared angular frequencies of the judged modes, (n,).
    masses
        mu_V, (n_V,), and the parts of B, (n_V, n_X), and of A, (n_X, n_X), in the span of the corrections.
    cutoff
        Highest angular frequency of the vibration modes of the set.
    """
    (mu_V, B, A), mu_out = masses, 1 / cutoff**2
    tau, U = la.eigh(A)
    B, is_found = B @ U, tau > mu_out  # (3)
    near = B[:, is_found]
    D, Z = la.eigh(np.block([[np.diag(mu_V), near], [near.T, np.diag(tau[is_found])]]))
    C, tau = Z[: len(mu_V)].T @ B[:, ~is_found], tau[~is_found]

    def exceeding(mu: float) -> float:
        """Return the largest number of eigenvalues above mu."""
        if mu <= mu_out:
            return np.inf
        scaled = C * np.sqrt(1 / mu + np.maximum(tau, 0.0) / (mu * (mu - mu_out)))  # (2)
        inertia = la.eigvalsh(np.eye(len(tau)) + scaled.T @ (scaled / (D - mu)[:, None])) if len(tau) else np.ones(0)
        return float((D > mu).sum() + (inertia < 0).sum())  # (4)

    largest = np.full(len(errors), np.nan)
    for k, error in enumerate(errors):  # (5)
        tried = (factor * error for factor in FACTORS)
        largest[k] = next((e for e in tried if exceeding((1 + e) ** 2 / omega2[k]) <= k), np.nan)
    return largest
