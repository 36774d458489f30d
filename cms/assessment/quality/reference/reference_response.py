"""Response of the full model at its ports, in an enriched basis whose error is estimated from the residual.

(1) compute free modes up to twice the band
(2) add the static response to the port loads (exact at frequency 0) and its first inertia correction G M G f
(3) apply Rayleigh-Ritz; after n corrections the error due to the missing mode k is of order (ω² / ω_k²)^n
(4) compute the residual r = P f - (K - ω² M) u of the response at the top of the band, between two modes, and e = G r.
    The error of H_ij is r_iᵀ (K - ω² M)⁻¹ r_j, of second order. Since r has no part along the kept modes, and the
    others lie above twice the band, the error is at most 4/3 r_iᵀ e_j. (At the ports e itself is zero: the basis
    contains G f, so f_iᵀ G r_j = 0)
(5) while this error is above the tolerance, add e to the basis and repeat from (3)
"""

from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.reference.port_model import PortModel
from cms.assessment.quality.reference.ports import Ports
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.reduction.basis.free_basis import FreeBasis, ritz_basis
from fe_models.foundation.sparse.sparse_product import SymmetricProduct

__all__ = ["RESPONSE_TOLERANCE", "ReferenceResponse", "reference_response"]

MODES_BEYOND = 2.0  #: highest frequency of the free modes divided by the band
RESPONSE_TOLERANCE = 1e-5  #: largest relative error of the reference response at the top of the band
UNSEEN_GAIN = 4 / 3  #: largest lambda / (lambda - omega²) of modes above twice the band
MOST_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class ReferenceResponse:
    """Response of the full model at its ports, and its accuracy."""

    model: PortModel
    basis: FreeBasis
    error: float  #: estimated relative error of the response at `checked_at`
    checked_at: float  #: frequency at which the error is estimated [cycles per time unit]


def reference_response(families: Families, ports: Ports, band: float) -> ReferenceResponse:
    """Compute the response of the full model up to a band: steps (1) to (5) of this module.

    Parameters
    ----------
    band
        Highest frequency [cycles per time unit of the body].

    Raises
    ------
    QualityError
        If the error remains above the tolerance.
    """
    body = families.body
    M, K = SymmetricProduct(body.M), SymmetricProduct(body.K)
    F = ports.loads()
    modes = families.free_modes(ModeCount(cutoff=MODES_BEYOND * band))  # (1)
    static = families.flexibility(F)  # (2)
    X = np.hstack([modes.Phi, static, families.flexibility(M @ static)])
    N = families.free.N
    F_elastic = families.project(F)
    size = np.tile(np.repeat([1.0, body.length], 3), len(ports.names))
    for _ in range(MOST_ROUNDS):
        basis = ritz_basis(body, X, N)  # (3)
        omega2 = between_modes(basis, (2 * np.pi * band) ** 2)  # (4)
        gain = 1 / np.where(basis.is_massive, basis.omega2 - omega2, basis.omega2)
        u = basis.Phi @ (gain[:, None] * (basis.Phi.T @ F))
        r = F_elastic - (K @ u) + omega2 * (M @ u)
        e = families.flexibility(r)
        weight = np.outer(size, size)
        error = UNSEEN_GAIN * np.linalg.norm(weight * (r.T @ e)) / np.linalg.norm(weight * (ports.A @ u))
        if error < RESPONSE_TOLERANCE:
            model = PortModel(ports.names, basis.omega2, basis.is_massive, ports.A @ basis.Phi, ports.A @ N)
            return ReferenceResponse(model, basis, float(error), float(np.sqrt(omega2) / (2 * np.pi)))
        X = np.hstack([X, e])  # (5)
    raise QualityError(
        f"body {body.name!r}: the response of the full model up to {band:.4g} (cycles per time unit) is known to "
        f"{error:.1e} only after {MOST_ROUNDS} rounds, expected {RESPONSE_TOLERANCE:.0e}; lower the band"
    )


def between_modes(basis: FreeBasis, omega2: float) -> float:
    """Return the middle of the gap between the two modes adjacent to omega², as a squared frequency."""
    levels = np.concatenate([[0.0], basis.omega2[basis.is_massive]])
    above = int(np.searchsorted(levels, omega2))
    return float(omega2 if above >= len(levels) else (levels[above - 1] + levels[above]) / 2)
