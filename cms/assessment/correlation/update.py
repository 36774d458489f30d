"""Update of a job to measured frequencies: least squares with sensitivities and prior standard deviations.

With theta = p / p_0 - 1, e_k = (f_k / f_k,measured - 1) / sigma_k over the pairs, and prior standard deviations s:

(1) compute the modes of the model at theta, and pair them with the test by MAC
(2) d f_k / f_k = phiᵀ (dK - omega² dM) phi / (2 omega²) for modes with phiᵀ M phi = 1 (Fox and Kapoor 1968); dK and dM
    are central differences of the assembled matrices, exact if these are linear or quadratic in p
(3) solve (Jᵀ J + S⁻²) d theta = -(Jᵀ e + S⁻² theta), and halve the step until |e|² + |theta / s|² decreases, within
    bounds
(4) the covariance is (Jᵀ J + S⁻²)⁻¹ at the end (Friswell and Mottershead 1995, ch. 8)

Damping is not used here: `fit_damping` uses the measured ratios alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cms.assessment.correlation.correlate import Correlation, Pairing, correlate_modes
from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes
from cms.assessment.correlation.model_modes import modes_of_body
from cms.assessment.correlation.points import Placement
from cms.assessment.quality.record import plain
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array

__all__ = ["Parameter", "Update", "update_model"]

STEP = 1e-3  #: step of theta for finite differences of the matrices
SMALLEST_STEP = 1e-5  #: size of a theta step below which the update has converged
MOST_ITERATIONS = 20
HALVINGS = 8
MODES_BEYOND = 1.3  #: highest computed frequency divided by the highest measured one


@dataclass(frozen=True)
class Parameter:
    """Parameter of the job to update."""

    name: str
    path: str  #: key path in the job, such as "materials.steel.young"
    start: float  #: initial value, not 0
    spread: float = 0.1  #: expected standard deviation divided by the initial value
    least: float = -0.9  #: lower bound of theta = p / start - 1
    most: float = 9.0


@dataclass(frozen=True, eq=False)
class Update:
    """Result of the update."""

    parameters: tuple[Parameter, ...]
    values: Array  #: updated value of each parameter, in its unit, (n,)
    spread: Array  #: standard deviation of each parameter divided by its initial value, (n,)
    correlation: Array  #: correlation matrix of the parameters, (n, n)
    jacobian: Array  #: relative change of frequency per relative change of parameter at the solution, (n_pairs, n)
    frequency_spread: float  #: relative standard deviation of the measured frequencies
    history: tuple[tuple[float, ...], ...]  #: objective and parameter values after each step
    before: Correlation
    after: Correlation
    is_converged: bool

    @property
    def determined(self) -> Array:
        """Information gained about each parameter, (n,): 1 - (spread / prior spread)²; 0 means none."""
        prior = np.array([parameter.spread for parameter in self.parameters])
        return np.asarray(1 - (self.spread / prior) ** 2)

    def as_dict(self) -> dict[str, Any]:
        """Return the result in plain types."""
        return {
            "converged": self.is_converged,
            "frequency_spread": self.frequency_spread,
            "parameters": [
                {"name": p.name, "path": p.path, "start": p.start, "prior_spread": p.spread, "value": float(value),
                 "spread": float(spread), "determined": float(told)}
                for p, value, spread, told in zip(
                    self.parameters, self.values, self.spread, self.determined, strict=True)
            ],
            "correlation": plain(self.correlation),
            "jacobian": plain(self.jacobian),
            "history": [list(step) for step in self.history],
        }  # fmt: skip


def update_model(
    measured: MeasuredModes,
    body_at: Callable[[Array], FEBody],
    parameters: Sequence[Parameter],
    *,
    held: Sequence[str] = (),
    placement: Placement | None = None,
    pairing: Pairing | None = None,
    frequency_spread: float = 0.005,
    most_iterations: int = MOST_ITERATIONS,
) -> Update:
    """Find the parameter values for which the model reproduces the measured frequencies.

    Parameters
    ----------
    body_at
        Function from parameter values, (n,), to the coupled body; its dofs must not depend on the values.
    frequency_spread
        Relative standard deviation of the measured frequencies.

    Raises
    ------
    CorrelationError
        If no modes are paired, a parameter has no effect or is 0, or a standard deviation is not positive.
    """
    if not parameters or any(not p.start for p in parameters):
        raise CorrelationError("update: expected one or more parameters whose start is not 0")
    if not frequency_spread > 0 or any(not p.spread > 0 for p in parameters):
        raise CorrelationError("update: expected spreads above 0")
    start = np.array([p.start for p in parameters])
    prior = np.array([p.spread for p in parameters])
    least, most = (np.array([getattr(p, end) for p in parameters]) for end in ("least", "most"))
    top = MODES_BEYOND * float(measured.frequencies.max())

    def compared(theta: Array) -> tuple[FEBody, Correlation]:
        body = body_at(start * (1 + theta))
        found = correlate_modes(measured, modes_of_body(body, top, held=held), placement=placement, pairing=pairing)
        if not found.pairs:
            raise CorrelationError(
                "update: no measured mode has a partner in the model; look at the MAC (points, axes, least_mac, "
                "window), or pair modes by hand"
            )
        return body, found

    def objective(found: Correlation, theta: Array) -> float:
        """Return the objective over the modes paired at the start; a lost partner counts as an error of `window`."""
        error = dict(zip([pair.measured for pair in found.pairs], found.errors, strict=True))
        window = (pairing or Pairing()).window
        left = np.array([error.get(k, window) for k in wanted]) / frequency_spread
        return float(left @ left + (theta / prior) @ (theta / prior))

    theta = np.zeros(len(parameters))
    body, found = compared(theta)
    before, wanted = found, [pair.measured for pair in found.pairs]
    value = objective(found, theta)
    history = [(value, *start)]
    converged = False
    for _ in range(most_iterations):
        J = relative_jacobian(body, body_at, start, theta, found)
        unmoved = np.flatnonzero(np.abs(J).max(axis=0) < 1e-12)
        if len(unmoved):
            raise CorrelationError(f"update: {parameters[unmoved[0]].path} changes no frequency that is paired")
        A = J.T @ J / frequency_spread**2 + np.diag(prior**-2.0)
        step = -np.linalg.solve(A, J.T @ found.errors / frequency_spread**2 + theta / prior**2)
        for halving in range(HALVINGS):
            trial = np.clip(theta + step / 2**halving, least, most)
            body_new, found_new = compared(trial)
            if (new := objective(found_new, trial)) < value:
                break
        else:
            converged = float(np.abs(step).max()) < 100 * SMALLEST_STEP
            break
        moved = float(np.abs(trial - theta).max())
        theta, body, found, value = trial, body_new, found_new, new
        history.append((value, *(start * (1 + theta))))
        if moved < SMALLEST_STEP:
            converged = True
            break
    J = relative_jacobian(body, body_at, start, theta, found)
    covariance = np.linalg.inv(J.T @ J / frequency_spread**2 + np.diag(prior**-2.0))
    spread = np.sqrt(np.diag(covariance))
    return Update(
        tuple(parameters), start * (1 + theta), spread, covariance / np.outer(spread, spread), J, frequency_spread,
        tuple(history), before, found, converged,
    )  # fmt: skip


def relative_jacobian(
    body: FEBody, body_at: Callable[[Array], FEBody], start: Array, theta: Array, found: Correlation
) -> Array:
    """Return the relative change of each paired frequency per theta, (n_pairs, n): step (2)."""
    columns = found.model.columns
    if columns is None:
        raise CorrelationError("update: expected the modes of a full model")
    chosen = [pair.computed for pair in found.pairs]
    Phi = columns[:, chosen]
    omega2 = (2 * np.pi * found.model.frequencies[chosen] * body.units.time) ** 2
    J = np.empty((len(chosen), len(start)))
    for k in range(len(start)):
        ends = []
        for sign in (1.0, -1.0):
            shifted = theta.copy()
            shifted[k] += sign * STEP
            ends.append(body_at(start * (1 + shifted)))
        if ends[0].n_dof != body.n_dof:
            raise CorrelationError("update: a parameter changes the number of dofs; expected numbers of one mesh")
        dK = sp.csc_array(ends[0].K - ends[1].K) / (2 * STEP)
        dM = sp.csc_array(ends[0].M - ends[1].M) / (2 * STEP)
        J[:, k] = (np.einsum("nk,nk->k", Phi, dK @ Phi) - omega2 * np.einsum("nk,nk->k", Phi, dM @ Phi)) / (2 * omega2)
    return J
