"""Symmetry and definiteness of the matrices in a modal file."""

import numpy as np
import scipy.linalg as la

from cms.assessment.quality.record import QualityRecord, judge
from cms.assessment.quality.reference.free_pencil import whole_pencil
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array

__all__ = ["check_definiteness", "check_kinetic_energy", "check_symmetry", "negativity", "scaled"]


def check_symmetry(reduced: ReducedBody) -> QualityRecord:
    """M, K, D, the second moment R and the moments S_ab,kl = S_ba,lk are symmetric: largest defect over |A|."""
    matrices = {
        "M": reduced.M,
        "K": reduced.K,
        "D": reduced.D,
        "R": reduced.moments.R,
        "S_kl": reduced.moments.S_kl.transpose(0, 2, 1, 3).reshape(3 * reduced.n_q, 3 * reduced.n_q),
    }
    defects = {name: asymmetry(A) for name, A in matrices.items()}
    name = max(defects, key=lambda key: defects[key])
    reason = f"largest defect |A - Aᵀ| / |A| is {defects[name]:.1e}, of {name}"
    return judge("symmetry", defects[name], reason, {"defects": defects})


def check_definiteness(reduced: ReducedBody) -> QualityRecord:
    """M and D have no negative eigenvalue, K only positive ones: smallest eigenvalue divided by the largest, scaled."""
    values = {name: negativity(getattr(reduced, name)) for name in ("M", "K", "D")}
    stiffness = np.diag(reduced.K)
    if reduced.n_q and (stiffness <= 0).any():
        values["K"] = max(values["K"], 1.0)
    name = max(values, key=lambda key: values[key])
    if values[name] > 0:
        reason = f"{name} has an eigenvalue of {-values[name]:.1e} of its largest, or no energy in some mode"
    else:
        reason = "M and D have no negative eigenvalue, K has positive ones only"
    return judge("definiteness", values[name], reason, {"negative": values})


def check_kinetic_energy(reduced: ReducedBody) -> QualityRecord:
    """The mass matrix of rigid and elastic motion together has no negative eigenvalue (scaled to a unit diagonal)."""
    M = whole_pencil(reduced).M
    value = negativity(M)
    reason = (
        f"some motion would have negative kinetic energy ({-value:.1e} of the largest eigenvalue)"
        if value > 0
        else "every motion of the free body has positive kinetic energy"
    )
    return judge("kinetic-energy", value, reason, {"eigenvalues": la.eigvalsh(scaled(M))})


def asymmetry(A: Array) -> float:
    """Largest |A - Aᵀ| over the largest |A|; 0 for a zero matrix."""
    size = np.abs(A).max(initial=0.0)
    return float(np.abs(A - A.T).max(initial=0.0) / size) if size > 0 else 0.0


def negativity(A: Array) -> float:
    """Return the smallest eigenvalue of A, scaled to a unit diagonal, divided by the largest, if negative.

    Rounding is 0.
    """
    if not A.size or not A.any():
        return 0.0
    values = la.eigvalsh(scaled(A))
    least = float(values[0] / np.abs(values).max())
    return -least if least < -len(values) * np.finfo(float).eps else 0.0


def scaled(A: Array) -> Array:
    """Return the symmetric part of A with rows and columns divided by the root of |diagonal| (1 where that is zero)."""
    diagonal = np.abs(np.diag(A))
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    return (A + A.T) / 2 / np.outer(size, size)
