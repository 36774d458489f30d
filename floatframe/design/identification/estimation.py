"""Base parameters from measured torques and reactions, with their standard deviations.

(1) W beta = y + e: rows of the linear form for each channel and instant, columns of the base parameters.
(2) Ordinary least squares gives the residuals e, and their standard deviation sigma_k is the noise of channel k.
(3) Rows are divided by the sigma_k of their channel and solved again, until the sigma_k converge (weighted).
(4) Rows whose residual is far above the noise lose weight, w = min(1, c sigma_k / |e|), until all values converge
    (robust [1]_).
(5) Deviations assume white noise: the variances of beta are the diagonal of C = (Wᵀ S⁻¹ W)⁻¹. Rows that follow each
    other faster than the noise changes contain less information than this assumes: see `whiteness`.

References
----------
.. [1] Huber (1964), Annals of Mathematical Statistics 35, 73-101.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.design.identification.base_parameters import (
    BaseParameters,
    base_parameters,
    typical_forces,
    typical_rows,
)
from floatframe.design.identification.regressors import LinearForm
from floatframe.design.identification.tree_samples import TreeSamples
from floatframe.errors import ModelError

__all__ = ["METHODS", "Estimate", "Measured", "estimate"]

METHODS = ("ordinary", "weighted", "robust")
HUBER = 1.345  #: residual, in sigma, above which a row loses weight; 95 % efficient without outliers
UNFIT = 0.3  #: misfit of a channel above which the model does not describe the measurement
SURE = 4.0  #: number of deviations below zero at which a nonnegative parameter is clearly negative
POSITIVE = ("motor-inertia(", "viscous(", "coulomb(")  #: parameters of drives that cannot be negative
POOR = 1e4  #: condition number of the weighted rows, columns scaled, above which the excitation is poor
#: largest correlation of neighbouring residuals of white noise, in 1/sqrt(n) (99.5 %); the fit itself reduces it
WHITE = 2.6
ROUNDS = 30  #: largest number of updates of weights
BASE = ("base F_x", "base F_y", "base F_z", "base M_x", "base M_y", "base M_z")


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Measured:
    """A motion with its measurements.

    Parameters
    ----------
    samples
        The motion at the sampled instants.
    torques
        Torques of the coordinates, (n, n_c) [N, N m].
    reactions
        Force and moment of the ground on the tree about `point`, ground axes, (n, 6).
    point
        Reference point of the reactions, (3,) [m]; None: the origin.
    time
        Times, (n,) [s].
    smooth
        Filter over the instants (axis 0), for the measurements and for the linear form; None: no filter.
    used
        Instants to use, after filtering.
    """

    samples: TreeSamples
    torques: Array | None = None
    reactions: Array | None = None
    point: Array | None = None
    time: Array | None = None
    smooth: Callable[[Array], Array] | None = None
    used: slice = field(default_factory=lambda: slice(None))

    def __post_init__(self) -> None:
        n, n_c = len(self.samples.x), self.samples.n_independent
        if self.torques is None and self.reactions is None:
            raise ModelError("identification: expected measured torques, reactions, or both; got none")
        for name, values, width in (("torques", self.torques, n_c), ("reactions", self.reactions, 6)):
            if values is not None and np.shape(values) != (n, width):
                raise ModelError(
                    f"identification: {name}: expected {n} rows of {width} columns, one row for each instant of the "
                    f"motion; got an array {np.shape(values)}"
                )
            if values is not None and not np.isfinite(values).all():
                raise ModelError(f"identification: {name}: expected finite numbers, got NaN or infinity")

    @property
    def source(self) -> str:
        """The measured quantities, one of `base_parameters.SOURCES`."""
        if self.torques is None:
            return "reactions"
        return "torques" if self.reactions is None else "both"

    @property
    def times(self) -> Array:
        """Times of the used instants, or their indices, (n_used,)."""
        return (np.arange(float(len(self.samples.x))) if self.time is None else np.asarray(self.time))[self.used]

    def rows(self, form: LinearForm) -> tuple[Array, Array]:
        """Return the linear form, (n_used, channels, p), and the measured values, (n_used, channels)."""
        W, y = [], []
        if self.torques is not None:
            W.append(form.torques(self.samples))
            y.append(np.asarray(self.torques, dtype=float))
        if self.reactions is not None:
            W.append(form.reactions(self.samples, self.point))
            y.append(np.asarray(self.reactions, dtype=float))
        made, measured = np.concatenate(W, axis=1), np.concatenate(y, axis=1)
        if self.smooth is not None:
            made, measured = self.smooth(made), self.smooth(measured)
        return made[self.used], measured[self.used]


@presented
@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated base parameters."""

    base: BaseParameters
    measured: Measured
    values: Array  #: beta, (n_base,)
    covariance: Array  #: (n_base, n_base)
    sigma: Array  #: standard deviation of the noise of the channels, (channels,) [N or N m]
    residuals: Array  #: measured minus modelled values, (n, channels)
    weights: Array  #: weights of robust estimation, 1 for full weight, (n, channels)
    condition: float  #: condition number of the weighted rows, with columns of length one
    whiteness: Array  #: correlation of neighbouring residuals of each channel, (channels,)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the values, (n_base,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def relative_deviations(self) -> Array:
        """Standard deviations divided by the values, (n_base,)."""
        return self.deviations / np.maximum(np.abs(self.values), np.finfo(float).tiny)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measured channels."""
        names = [column.name for column in self.base.form.columns]
        return (
            *(names if self.measured.torques is not None else ()),
            *(BASE if self.measured.reactions is not None else ()),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons why the deviations are unreliable, as text."""
        said = []
        if self.condition > POOR:
            worst = self.base.names[int(np.argmax(self.relative_deviations))]
            said.append(
                f"poor excitation: condition number {self.condition:.2g}, least accurate {worst}; measure "
                "another motion (exciting_motion finds one)"
            )
        unfit = [
            f"{name} by {share:.0%}"
            for name, share in zip(self.channels, self.misfit(self.measured), strict=True)
            if share > UNFIT
        ]
        if unfit:
            said.append(
                f"the model misses {', '.join(unfit)} of the measured values: check friction, units (degrees given "
                "as rad), signs, the zero of angles (as the system is placed), gravity, exchanged columns, noise"
            )
        negative = [
            name
            for name, value, deviation in zip(self.base.names, self.values, self.deviations, strict=True)
            if name.startswith(POSITIVE) and value < -SURE * deviation
        ]
        if negative:
            said.append(
                f"{', '.join(negative)} are negative, which is impossible; check the signs of torques and positions"
            )
        n = len(self.residuals)
        coloured = [name for name, r in zip(self.channels, self.whiteness, strict=True) if r > WHITE / np.sqrt(n)]
        if coloured:
            said.append(
                f"residuals of {', '.join(coloured)} are not white: the model lacks an effect, or rows follow each "
                "other faster than the noise changes; the deviations are too small; take fewer rows"
            )
        return tuple(said)

    def predicted(self, measured: Measured) -> Array:
        """Return the channels of another motion, predicted by the estimate, (n, channels), for validation."""
        return self.compared(measured)[0]

    def misfit(self, measured: Measured) -> Array:
        """Return the rms residual of each channel of another motion, relative to the rms of the measurement."""
        predicted, y = self.compared(measured)
        size = np.sqrt((y**2).mean(axis=0))
        return np.sqrt(((y - predicted) ** 2).mean(axis=0)) / np.where(size > 0, size, 1.0)

    def compared(self, measured: Measured) -> tuple[Array, Array]:
        """Return the channels of another motion, predicted and measured, (n, channels) each."""
        if measured.source != self.measured.source:
            raise ModelError(
                f"identification: estimated from {self.measured.source}, but the other motion has {measured.source}"
            )
        W, y = measured.rows(self.base.form)
        return self.base.rows(W) @ self.values, y


def estimate(
    form: LinearForm, measured: Measured, *, method: str = "weighted", base: BaseParameters | None = None
) -> Estimate:
    """Return the base parameters that fit measurements best.

    Parameters
    ----------
    form
        The model, see `linear_form`.
    measured
        A motion, with torques, reactions, or both.
    method
        One of `METHODS`.
    base
        Combinations to estimate; default: those found by the rank of the form over random motions.

    Raises
    ------
    ModelError
        If there are fewer rows than parameters, or the motion does not determine some combinations, which are named.
    """
    if method not in METHODS:
        raise ModelError(f"estimate: method: expected one of {', '.join(METHODS)}, got {method!r}")
    if base is None:
        base = base_parameters(form, source=measured.source, by="samples")
    elif base.source != measured.source:
        raise ModelError(f"estimate: base parameters are those of {base.source}, but measured were {measured.source}")
    every, y = measured.rows(form)
    W = base.rows(every)
    n, n_channels, n_base = W.shape
    if n * n_channels <= n_base:
        raise ModelError(
            f"estimate: {n} instants of {n_channels} channels cannot determine {n_base} parameters; measure longer"
        )
    if not y.any():
        raise ModelError("estimate: all measured torques and reactions are zero")
    require_excited(base, every)
    alike = typical_forces(form, measured.source)  # weights of forces and torques until their noise is known
    sigma, weights = alike, np.ones((n, n_channels))
    beta = solved(W, y, sigma, weights)
    for _ in range(1 if method == "ordinary" else ROUNDS):
        e = y - W @ beta
        before = sigma
        sigma = noise(e, weights, n_base / n_channels)
        if method == "ordinary":
            sigma = alike * np.sqrt(((sigma / alike) ** 2).mean())
            break
        if method == "robust":
            weights = np.minimum(1.0, HUBER * sigma / np.maximum(np.abs(e), 1e-300))
        beta = solved(W, y, sigma, weights)
        if np.allclose(sigma, before, rtol=1e-8, atol=0.0):
            break
    e = y - W @ beta
    A = (W * np.sqrt(weights)[..., None] / sigma[:, None]).reshape(-1, n_base)
    size = np.linalg.norm(A, axis=0)
    s, Vt = la.svd(A / size, full_matrices=False)[1:]
    half = (Vt.T / s) / size[:, None]
    after = (e[1:] * e[:-1]).sum(axis=0) / np.maximum((e**2).sum(axis=0), np.finfo(float).tiny)
    return Estimate(base, measured, beta, half @ half.T, sigma, e, weights, float(s[0] / s[-1]), after)


def noise(e: Array, weights: Array, spent: float) -> Array:
    """Return the noise of channels from their residuals, corrected for the number of fitted parameters."""
    n = len(e)
    if weights.min() < 1.0:  # robust: the median ignores outliers
        return np.median(np.abs(e), axis=0) / 0.6744897501960817 + np.finfo(float).tiny
    return np.sqrt((e**2).sum(axis=0) / max(n - spent, 1.0)) + np.finfo(float).tiny


def solved(W: Array, y: Array, sigma: Array, weights: Array) -> Array:
    """Return the weighted least-squares solution, (n_base,), with scaled columns."""
    root = np.sqrt(weights) / sigma
    A = (W * root[..., None]).reshape(-1, W.shape[-1])
    size = np.linalg.norm(A, axis=0)
    return la.lstsq(A / size, (y * root).ravel(), lapack_driver="gelsy")[0] / size


def require_excited(base: BaseParameters, rows: Array) -> None:
    """Raise `ModelError` with the combinations that a motion, with its rows (n, n_channels, p), does not excite."""
    A = base.rows(typical_rows(base.form, rows, base.source))
    size = np.linalg.norm(A, axis=0)
    seen = size > 1e-10 * size.max()
    missing = [name for name, is_seen in zip(base.names, seen, strict=True) if not is_seen]
    if not missing:
        s, Vt = la.svd(A / size, full_matrices=False)[1:]
        hidden = Vt[s <= 1e-9 * s[0]]
        missing = [base.names[j] for j in np.flatnonzero(np.abs(hidden).max(axis=0, initial=0.0) > 0.1)]
    if missing:
        shown = "; ".join(missing[:6]) + ("; ..." if len(missing) > 6 else "")
        raise ModelError(
            f"estimate: the motion does not determine {len(missing)} of {len(base.names)} combinations: {shown}; move "
            "all joints together, at several speeds (exciting_motion finds such a motion)"
        )
