"""Physically consistent parameters that fit measurements: masses and inertias of a real mass distribution.

A rigid body is real if its pseudo-inertia P (`inertial_parameters.pseudo_inertia`) is positive definite. With P = L Lᵀ,
where exp(.) keeps the diagonal of L positive, every choice of the ten unknowns l of a body is real. The fit is

    min |S^(-1/2) (W phi - y)|² + weight² Σ_bodies |l - l_prior|²,

The second term keeps values that the measurement does not determine near those of the system file. The deviations of
base parameters are those of `estimate`; this finds one real robot among all with the same base parameters.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.optimize import least_squares

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.design.identification.estimation import Estimate
from floatframe.design.identification.inertial_parameters import PAIRS, pseudo_inertia, system_with
from floatframe.errors import ModelError
from floatframe.model.system import System

__all__ = ["RealParameters", "real_parameters"]

LOWER = np.tril_indices(4)


@presented
@dataclass(frozen=True, eq=False)
class RealParameters:
    """Physically consistent parameters, and the quality of their fit."""

    phi: Array  #: inertial parameters, (p,)
    system: System  #: the system with these bodies
    excess: float  #: squared weighted misfit divided by that of the base parameters, minus one
    least: Array  #: smallest eigenvalue of the pseudo-inertia of each body, relative to its largest
    is_fit: bool  #: whether the misfit can be noise: within 5 sigma of the chi-squared value of the base parameters


def real_parameters(estimate: Estimate, *, prior: Array | None = None, weight: float = 1e-2) -> RealParameters:
    """Return real bodies whose torques fit the measurements of an estimate.

    Parameters
    ----------
    estimate
        The estimate, with its motion, measurements and noise.
    prior
        Parameters of real bodies, (p,), to which values that are not measured stay close; default: those of the system.
    weight
        Weight of the distance from the prior: with 1, a factor e in a size of a body counts as one standard deviation.

    Raises
    ------
    ModelError
        If the prior is not real.
    """
    form = estimate.base.form
    phi_0 = form.values if prior is None else np.asarray(prior, dtype=float)
    n_b = len(form.system.bodies)
    inertial = phi_0[: 10 * n_b].reshape(n_b, 10)
    start = []
    for body, phi in zip(form.system.bodies, inertial, strict=True):
        P = pseudo_inertia(phi)
        values = la.eigvalsh(P)
        if values[0] <= 0:
            raise ModelError(
                f"real_parameters: body {body.name!r}: the prior is not a real body (its pseudo-inertia has the "
                f"eigenvalue {values[0]:.3g}); a point mass or a rod without thickness: give it a small extent"
            )
        start.append(log_cholesky(P))
    free = phi_0[10 * n_b :]
    W, y = estimate.measured.rows(form)
    rows = estimate.base.rows(W)
    root = np.sqrt(estimate.weights) / estimate.sigma
    # R factor of the weighted rows of base parameters: the misfit is |R (B phi - beta)|² for any number of rows
    R = la.qr((rows * root[..., None]).reshape(-1, len(estimate.values)), mode="r")[0][: len(estimate.values)]
    RB = R @ estimate.base.B
    aim = R @ estimate.values
    size = np.maximum(np.abs(free), 1.0)
    l_0 = np.concatenate([*start, free / size])
    scale = np.concatenate([np.ones(10 * n_b), np.zeros(len(free))])

    def parameters(x: Array) -> Array:
        own = [parameters_of_cholesky(x[10 * i : 10 * i + 10]) for i in range(n_b)]
        return np.concatenate([*own, x[10 * n_b :] * size])

    def defect(x: Array) -> Array:
        return np.concatenate([RB @ parameters(x) - aim, weight * scale * (x - l_0)])

    found = least_squares(defect, l_0, x_scale="jac", max_nfev=200)
    phi = parameters(found.x)
    best = float((((y - rows @ estimate.values) * root) ** 2).sum())
    extra = float(((RB @ phi - aim) ** 2).sum())
    P = pseudo_inertia(phi[: 10 * n_b].reshape(n_b, 10))
    spectrum = np.linalg.eigvalsh(P)
    return RealParameters(
        phi, system_with(form.system, phi[: 10 * n_b]), extra / max(best, np.finfo(float).tiny),
        spectrum[:, 0] / spectrum[:, -1], extra < len(aim) + 5 * np.sqrt(2 * len(aim)),
    )  # fmt: skip


def log_cholesky(P: Array) -> Array:
    """Return ten unknowns: logarithms of the diagonal of the Cholesky factor, and its other entries divided by it."""
    L = la.cholesky(P, lower=True)
    d = np.diag(L)
    return np.array([np.log(L[a, a]) if a == b else L[a, b] / d[b] for a, b in zip(*LOWER, strict=True)])


def parameters_of_cholesky(x: Array) -> Array:
    """Return the inertial parameters, (10,), of ten unknowns."""
    L = np.zeros((4, 4))
    L[LOWER] = x
    d = np.exp(np.diag(L))
    L = np.tril(L, -1) * d[None] + np.diag(d)
    P = L @ L.T
    J = np.trace(P[:3, :3]) * np.eye(3) - P[:3, :3]
    return np.array([P[3, 3], *P[:3, 3], *(J[pair] for pair in PAIRS)])
