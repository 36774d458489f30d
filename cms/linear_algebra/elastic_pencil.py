"""Eigenvectors of a small dense pencil without rigid-body motion, massless directions included."""

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array

__all__ = ["elastic_eigenvectors", "stiffness_scale", "turn_to_diagonal"]

INDEPENDENT = 1e-14  #: smallest eigenvalue of the norm W, scaled to a unit diagonal, of an independent direction
MASSLESS = 1e-12  #: modal mass times omega_1² below which a shape of unit W-length is static
#: largest ratio of omega² within a band in step (4); stiff modes cause a rounding error of 1e-10 in the softest
BAND = 1e6


def elastic_eigenvectors(G_K: Array, G_M: Array, omega2_1: float) -> tuple[Array, Array]:
    """Solve K z = omega² M z for a pencil without common null space, that is without rigid-body motion.

    (1) transform to a basis in which W = K + omega_1² M is the identity, after scaling W to a unit diagonal
    (2) an eigenvalue mu of M in this basis gives omega² = (1 - omega_1² mu) / mu
    (3) solve again in nearly diagonal form, for relative accuracy at the stiff end of the spectrum
    (4) after (3) the softest modes still have an error of eps times the stiffest omega²: solve each band of the
        spectrum once more by itself

    Returns
    -------
    Z
        Coefficients by ascending omega², M-normalised (W-normalised if there is no mass), (k, k).
    is_massive
        Whether each vector has mass, (k,) bool.

    Raises
    ------
    numpy.linalg.LinAlgError
        If some direction has neither stiffness nor mass.
    """
    W = G_K + omega2_1 * G_M
    size = np.sqrt(np.maximum(np.diag(W), 0.0))
    if not (size > 0).all():
        raise np.linalg.LinAlgError("a direction has neither stiffness nor mass")
    energy, directions = la.eigh(W / np.outer(size, size))  # (1)
    if len(energy) and energy[0] <= INDEPENDENT * energy[-1]:
        raise np.linalg.LinAlgError(
            f"a direction has {energy[0] / energy[-1]:.1e} of the energy of the others, which is rounding"
        )
    basis = directions / np.sqrt(energy) / size[:, None]
    mu, Y = la.eigh(basis.T @ G_M @ basis)  # (2)
    mu, Z = mu[::-1], (basis @ Y)[:, ::-1]
    is_massive = mu * omega2_1 > MASSLESS
    Z[:, is_massive] /= np.sqrt(mu[is_massive])
    massive = Z[:, is_massive]
    if massive.shape[1]:  # (3)
        _, Y = la.eigh(massive.T @ G_K @ massive, massive.T @ G_M @ massive)
        massive = massive @ Y
        massive = massive @ turn_to_diagonal(massive.T @ G_K @ massive)  # (4)
        Z[:, is_massive] = massive
    return Z, is_massive


def stiffness_scale(K: Array, M: Array) -> float:
    """Return the smallest positive K_kk / M_kk [1/s²]; 1 if there is none."""
    stiffness, mass = np.diag(K), np.diag(M)
    has_both = (mass > 0) & (stiffness > 0)
    return float((stiffness[has_both] / mass[has_both]).min()) if has_both.any() else 1.0


def turn_to_diagonal(G_K: Array) -> Array:
    """Return an orthogonal matrix, (k, k), that diagonalises a nearly diagonal, ascending stiffness, band by band.

    A second pass has shifted bands (its first is narrower), for close modes that a border of the first pass separates.
    """
    turn = np.eye(len(G_K))
    for width in (BAND, np.sqrt(BAND)):
        G, bands, first = turn.T @ G_K @ turn, np.zeros_like(G_K), 0
        omega2 = np.maximum(np.diag(G), np.finfo(float).eps * np.diag(G).max(initial=0.0))
        while first < len(omega2):
            stiffer = omega2[first:] > width * omega2[first]
            last = first + int(np.argmax(stiffer)) if stiffer.any() else len(omega2)
            bands[first:last, first:last] = la.eigh(G[first:last, first:last])[1]
            first, width = last, BAND
        turn = turn @ bands
    return turn
