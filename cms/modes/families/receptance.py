"""Receptance of the boundary: displacement of each boundary dof per unit force on each boundary dof, over frequency."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, frozen

__all__ = ["Receptance", "boundary_scale", "largest_error", "receptance_of_modes", "receptance_of_pencil"]


def boundary_scale(body: FEBody) -> Array:
    """Return the length that converts each boundary dof to a translation: 1, or the body length for rotations, (n_b,).

    A rotation times this length is comparable to a translation, and a moment divided by it is comparable to a force.
    """
    return np.where(body.dofs[body.b, 1] >= 3, body.length, 1.0)


@dataclass(frozen=True, eq=False)
class Receptance:
    """Receptance as a sum over modes: H(omega) = Σ_k b_k b_kᵀ / ((1 + i eta) k_k - omega² m_k), diagonal k and m."""

    b: Array  #: modes at the boundary dofs, scaled, (n_b, n)
    k: Array  #: modal stiffness, (n,)
    m: Array  #: modal mass, (n,); 0 for static shapes
    loss: float  #: loss factor eta: twice the modal damping ratio at resonance

    def __post_init__(self) -> None:
        for name in ("b", "k", "m"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def at(self, frequencies: Array) -> np.ndarray:
        """Return H at these frequencies, (n_f, n_b, n_b) complex [m/N with scaled rotations]."""
        omega2 = (2 * np.pi * np.asarray(frequencies)) ** 2
        dynamic = (1 + 1j * self.loss) * self.k - omega2[:, None] * self.m
        return np.einsum("bk,fk,ck->fbc", self.b, 1 / dynamic, self.b, optimize=True)


def receptance_of_modes(body: FEBody, Phi: Array, omega2: Array, *, loss: float) -> Receptance:
    """Return the receptance of M-orthonormal modes, (n_dof, n); rigid-body modes have omega² = 0."""
    return Receptance(boundary_scale(body)[:, None] * Phi[body.b], omega2, np.ones(len(omega2)), loss)


def receptance_of_pencil(b: Array, K: Array, M: Array, *, loss: float, omega2: float) -> Receptance:
    """Return the receptance of reduced matrices K and M.

    Parameters
    ----------
    b
        Scaled boundary rows of the columns, (n_b, n).
    K, M
        Pencil of the columns, (n, n); K + omega² M positive definite.
    omega2
        A positive number of the magnitude of K / M [1/s²], such as the first elastic omega².
    """
    mu, Y = la.eigh(M, K + omega2 * M)
    return Receptance(b @ Y, 1 - omega2 * mu, np.maximum(mu, 0.0), loss)


def largest_error(H: np.ndarray, reference: np.ndarray) -> float:
    """Return the largest |H - H_ref| / |H_ref| over the frequencies, with Frobenius norms."""
    return float((np.linalg.norm(H - reference, axis=(1, 2)) / np.linalg.norm(reference, axis=(1, 2))).max())
