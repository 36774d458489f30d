"""Identification of any system from measured outputs, by fitting its computed motion to the measured one.

A linear form needs the complete measured motion. It cannot identify systems in which some coordinates are not measured
(flexible links, elastic drives, loops). For these the motion is computed and its outputs y(t, p) are compared with the
measurement: the output error method, which is maximum likelihood for white noise on the outputs [1]_.

(1) r = (measured - y(p)) / sigma of each channel at each time, J = dy/dp / sigma by differences of complete runs
(2) Gauss-Newton step in the logarithms of the parameters, which keep their signs: least-squares solution of J dx = r,
    limited to a factor e, and shortened until the sum of squares decreases
(3) sigma of each channel from its residuals; repeat from (1) until the parameters change by less than a small fraction
    of their deviations
(4) deviations from C = (Jᵀ J)⁻¹, the bound of Cramér and Rao for white noise

Derivatives of an earlier fit (`near`) are used as long as steps shrink with them, so that each of many measurements of
one system takes few runs.

References
----------
.. [1] Ljung (1999), System Identification, §7.
"""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.design.gradients.outputs import columns_of, wanted_of
from floatframe.errors import FloatframeError, ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.integrators.integrator import Integrator
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.sensors import measured as measured_by
from floatframe.simulation.integrate import integrate

__all__ = ["MeasuredOutputs", "OutputFit", "computed_outputs", "fit_outputs"]

STEP = 1e-3  #: step of central differences, for the logarithm of a parameter
MOST = 1.0  #: largest change of a logarithm in one iteration
STANDS = 1e-3  #: change of the parameters, relative to their deviations, at which the search ends
SHRINKS = 0.3  #: ratio of successive steps up to which old derivatives are reused
ROUNDS = 40  #: largest number of Gauss-Newton iterations
HALVINGS = 8
ALIKE = (
    1e-4  #: singular value of J with unit columns, below which parameters act alike; differences have errors of 1e-5
)
WHITE = 2.6  #: largest correlation of neighbouring residuals of white noise, in 1/sqrt(n) (99.5 %)
TOLERANCE = 1e-10  #: tolerance of Newton iterations in compared runs


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class MeasuredOutputs:
    """Outputs measured at equidistant times, from the beginning of the run.

    Parameters
    ----------
    time
        Times, (n,) [s].
    values
        Values by column of a sensor or coordinate, "tip y", "shoulder.angle force", (n,) each.
    """

    time: Array
    values: Mapping[str, Array]

    def __post_init__(self) -> None:
        t = np.asarray(self.time, dtype=float)
        steps = np.diff(t)
        if t.ndim != 1 or len(t) < 3 or not np.isfinite(t).all() or steps.max() > (1 + 1e-6) * steps.min() > 0:
            raise ModelError("fit_outputs: time: expected at least three equally spaced, increasing times")
        if not self.values:
            raise ModelError("fit_outputs: expected at least one measured output, got none")
        for name, column in self.values.items():
            if np.shape(column) != t.shape:
                raise ModelError(
                    f"fit_outputs: {name!r}: expected {len(t)} values, one for each time, got {np.shape(column)}"
                )
            if not np.isfinite(column).all():
                raise ModelError(f"fit_outputs: {name!r}: expected finite numbers, got NaN or infinity")

    @property
    def table(self) -> Array:
        """The values of all channels, (n, channels)."""
        return np.column_stack([np.asarray(column, dtype=float) for column in self.values.values()])


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class OutputFit:
    """Estimated parameters, and the quality of their fit.

    Parameters
    ----------
    names
        Names of the parameters.
    values
        Estimated values, (n_p,).
    covariance
        Covariance of the values, (n_p, n_p).
    channels
        Names of the measured channels.
    sigma
        Noise of the channels, (channels,).
    predicted
        Outputs of the system with the values, (n, channels).
    residuals
        Measured minus predicted outputs, (n, channels).
    slopes
        Derivatives of the outputs by the parameters, (n, channels, n_p).
    condition
        Condition number of the derivatives divided by the noise, columns of length one.
    n_runs
        Number of computed motions.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    channels: tuple[str, ...]
    sigma: Array
    predicted: Array
    residuals: Array
    slopes: Array
    condition: float
    n_runs: int

    @property
    def deviations(self) -> Array:
        """Standard deviations of the values, (n_p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> Array:
        """Correlation of the errors of the values, (n_p, n_p)."""
        return self.covariance / np.outer(self.deviations, self.deviations)

    @property
    def whiteness(self) -> Array:
        """Correlation of neighbouring residuals of each channel, (channels,)."""
        e = self.residuals
        return np.asarray((e[1:] * e[:-1]).sum(axis=0) / np.maximum((e**2).sum(axis=0), np.finfo(float).tiny))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons why the deviations are unreliable, as text."""
        said = []
        coloured = [
            name
            for name, r in zip(self.channels, self.whiteness, strict=True)
            if r > WHITE / np.sqrt(len(self.residuals))
        ]
        if coloured:
            said.append(
                f"residuals of {', '.join(coloured)} are not white: the model lacks an effect, and the "
                "standard deviations of the parameters are too small"
            )
        c = np.abs(np.triu(self.correlations, 1))
        if c.max(initial=0.0) > 0.99:
            i, j = np.unravel_index(int(np.argmax(c)), c.shape)
            said.append(
                f"{self.names[i]} and {self.names[j]} act nearly alike (their errors correlate by "
                f"{self.correlations[i, j]:+.3f}); measure a motion or an output that distinguishes them"
            )
        return tuple(said)

    def derived(self, function: Callable[[dict[str, float]], float]) -> tuple[float, float]:
        """Return a number that follows from the parameters, such as a frequency, and its standard deviation.

        The deviation follows from first derivatives, by central differences of half a deviation of each parameter.
        """
        at = dict(zip(self.names, self.values.tolist(), strict=True))
        slopes = np.array(
            [
                (function({**at, name: at[name] + 0.5 * d}) - function({**at, name: at[name] - 0.5 * d})) / d
                for name, d in zip(self.names, self.deviations.tolist(), strict=True)
            ]
        )
        return float(function(at)), float(np.sqrt(slopes @ self.covariance @ slopes))


def fit_outputs(
    system_of: Callable[[dict[str, float]], System],
    start: Mapping[str, float],
    measured: MeasuredOutputs,
    *,
    h: float | None = None,
    integrator: Integrator | None = None,
    state: State | None = None,
    sigma: Mapping[str, float] | None = None,
    near: OutputFit | None = None,
) -> OutputFit:
    """Return the parameters with which the computed motion fits the measurements best.

    Parameters
    ----------
    system_of
        Returns the system for a dict of names and values. Its prescribed motions and forces are those of the
        measurement, and it begins as placed, as the measurement did.
    start
        First guesses of the parameters by name; parameters keep these signs, as masses, stiffness and damping do.
    measured
        Columns of sensors or coordinates of the system over time.
    h
        Step of the runs [s], the spacing of the times divided by a whole number; default: this spacing.
    integrator, state
        As for `integrate`; default: generalized-alpha with a tight tolerance.
    sigma
        Known noise of every channel; default: computed from the residuals.
    near
        A fit of another measurement of the same outputs, whose derivatives are used first.

    Raises
    ------
    ModelError
        If an output does not exist, the step does not divide the spacing, there are fewer values than parameters, a
        parameter has no effect, several act alike (the message names them), or the search does not converge.
    """
    names = tuple(start)
    p = np.array([float(start[name]) for name in names])
    if not len(p) or not p.all() or not np.isfinite(p).all():
        raise ModelError(
            "fit_outputs: start: expected finite first guesses other than 0, with the signs of the parameters"
        )
    data, channels = measured.table, tuple(measured.values)
    n, n_y = data.shape
    if n * n_y <= len(p):
        raise ModelError(f"fit_outputs: {n * n_y} values cannot determine {len(p)} parameters; measure longer")
    if near is not None and (near.names != names or near.residuals.shape != data.shape or near.channels != channels):
        raise ModelError("fit_outputs: near: expected a fit of the same parameters and outputs at as many times")
    known = None if sigma is None else sigma_of(sigma, channels)
    run = Runs(system_of, names, measured, h, integrator, state)
    y = run.outputs(p)
    S, is_fresh = (run.slopes(p), True) if near is None else (near.slopes * near.values, False)
    noise = noise_of(data - y, len(p)) if known is None else known
    before = np.inf
    for _ in range(ROUNDS):
        e = data - y
        dx, length = newton_step(S, e, noise, names)
        if length > SHRINKS * before and not is_fresh:
            S, is_fresh, before = run.slopes(p), True, np.inf
            continue
        if length <= STANDS:
            break
        cost, factor = float(((e / noise) ** 2).sum()), min(1.0, MOST / np.abs(dx).max())
        for _ in range(HALVINGS):
            try:
                y_new = run.outputs(p * np.exp(factor * dx))
            except FloatframeError:
                y_new = None
            if y_new is not None and float((((data - y_new) / noise) ** 2).sum()) <= cost * (1 + 1e-12):
                break
            factor *= 0.5
        else:
            y_new = None
        if y_new is None:
            if not is_fresh:
                S, is_fresh, before = run.slopes(p), True, np.inf
                continue
            raise ModelError(
                "fit_outputs: no step lowers the error, from "
                + ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, p, strict=True))
                + "; begin nearer, or with fewer parameters"
            )
        p, y, before = p * np.exp(factor * dx), y_new, length
        noise = noise_of(data - y, len(p)) if known is None else known
        is_fresh = False
        if near is None and length > 1.0:
            S, is_fresh = run.slopes(p), True
    else:
        raise ModelError(f"fit_outputs: parameters did not converge in {ROUNDS} steps; begin nearer, or with fewer")
    S = S / p
    A = (S / noise[:, None]).reshape(-1, len(p))
    length_of = np.linalg.norm(A, axis=0)
    s, Vt = la.svd(A / length_of, full_matrices=False)[1:]
    half = (Vt.T / s) / length_of[:, None]
    return OutputFit(
        names, p, half @ half.T, channels, noise, y, data - y, S, float(s[0] / s[-1]), run.count
    )  # fmt: skip


def computed_outputs(
    system: System, time: Array, outputs: Sequence[str], *, h: float | None = None,
    integrator: Integrator | None = None, state: State | None = None,
) -> MeasuredOutputs:  # fmt: skip
    """Return the outputs that sensors would measure during a motion, without noise; see `fit_outputs`.

    Parameters
    ----------
    system
        The system, with its sensors.
    time
        Equally spaced output times, (n_t,) [s].
    outputs
        Names of sensor columns or coordinates, as for `fit_outputs`.
    h
        Step of the run [s], the spacing of the times divided by a whole number; None: this spacing.
    integrator
        As for `integrate`; None: generalized-alpha with a tight tolerance.
    state
        State at which the motion begins; None: as assembled.

    Raises
    ------
    ModelError
        If an output does not exist, or the step does not divide the spacing of the times.
    """
    t = np.asarray(time, dtype=float)
    distance = float(t[-1] - t[0]) / (len(t) - 1)
    every = 1 if h is None else round(distance / h)
    if every < 1 or (h is not None and abs(every * h / distance - 1) > 1e-6):
        raise ModelError(
            f"fit_outputs: h = {h:.6g}: expected the spacing of the measured times, {distance:.6g}, divided by a "
            "whole number"
        )
    columns = columns_of(system, wanted_of(tuple(outputs)))
    motion = integrate(
        system, integrator or GeneralizedAlpha(tolerance=TOLERANCE), float(t[-1]), distance / every,
        t_start=float(t[0]), state=state, output_every=every,
    )  # fmt: skip
    found = {}
    for name, each in zip(outputs, columns, strict=True):
        seen = measured_by(system, motion, [each.sensor])[each.sensor.name].columns
        column = next(iter(seen)) if not each.column and len(seen) == 1 else each.column
        if column not in seen:
            raise ModelError(f"fit_outputs: output {quoted(name)}: no such column{nearest(column, list(seen))}")
        found[name] = seen[column]
    return MeasuredOutputs(t, found)


class Runs:
    """Motions of a system for given parameters, at the times of a measurement."""

    def __init__(
        self, system_of: Callable[[dict[str, float]], System], names: tuple[str, ...], measured: MeasuredOutputs,
        h: float | None, integrator: Integrator | None, state: State | None,
    ) -> None:  # fmt: skip
        """Store the data that all runs share."""
        self.system_of, self.names, self.measured = system_of, names, measured
        self.h, self.integrator, self.state, self.count = h, integrator, state, 0

    def outputs(self, p: Array) -> Array:
        """Return the outputs of the motion for parameters, (n, channels)."""
        system = self.system_of(dict(zip(self.names, p.tolist(), strict=True)))
        self.count += 1
        with notes_of(is_first=self.count == 1):
            return computed_outputs(
                system, self.measured.time, tuple(self.measured.values), h=self.h, integrator=self.integrator,
                state=self.state,
            ).table  # fmt: skip

    def slopes(self, p: Array) -> Array:
        """Return the derivatives of the outputs by logarithms of the parameters, (n, channels, n_p), step (1)."""
        found = []
        for k in range(len(p)):
            beside = []
            for sign in (1.0, -1.0):
                moved = p.copy()
                moved[k] *= np.exp(sign * STEP)
                try:
                    beside.append(self.outputs(moved))
                except ReportedError as error:
                    raise ModelError(
                        f"fit_outputs: no motion beside {self.names[k]} = {p[k]:.6g}, at {moved[k]:.6g}: {error}"
                    ) from error
            found.append((beside[0] - beside[1]) / (2 * STEP))
        return np.stack(found, axis=-1)


@contextmanager
def notes_of(*, is_first: bool) -> Iterator[None]:
    """Show all log messages of the first run, and only errors of the others."""
    log = logging.getLogger("floatframe")
    level = log.level
    if not is_first:
        log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


def newton_step(S: Array, e: Array, noise: Array, names: tuple[str, ...]) -> tuple[Array, float]:
    """Return the change of the logarithms, and its length in deviations (2); `ModelError` if parameters act alike."""
    A = (S / noise[:, None]).reshape(-1, len(names))
    size = np.linalg.norm(A, axis=0)
    still = [name for name, each in zip(names, size, strict=True) if each == 0.0]
    if still:
        raise ModelError(f"fit_outputs: no output changes with {', '.join(still)}; leave it out, or measure another")
    U, s, Vt = la.svd(A / size, full_matrices=False)
    if s[-1] <= ALIKE * s[0]:
        alike = [name for name, share in zip(names, np.abs(Vt[-1]), strict=True) if share > 0.1]
        raise ModelError(
            f"fit_outputs: {' and '.join(alike)} act alike: the outputs cannot distinguish them; fix all but one"
        )
    along = U.T @ (e / noise).ravel()
    return (Vt.T @ (along / s)) / size, float(np.linalg.norm(along))


def noise_of(e: Array, n_p: int) -> Array:
    """Return the noise of each channel, (channels,), corrected for the number of fitted parameters, step (3)."""
    n, n_y = e.shape
    return np.sqrt((e**2).sum(axis=0) / max(n - n_p / n_y, 1.0)) + np.finfo(float).tiny


def sigma_of(given: Mapping[str, float], channels: tuple[str, ...]) -> Array:
    """Return the given noise of the channels, (channels,)."""
    for name, value in given.items():
        if name not in channels:
            raise ModelError(f"fit_outputs: sigma: no output {quoted(name)}{nearest(name, list(channels))}")
        if not 0 < value < np.inf:
            raise ModelError(f"fit_outputs: sigma of {quoted(name)}: expected a number above 0, got {value:.6g}")
    missing = [name for name in channels if name not in given]
    if missing:
        raise ModelError(f"fit_outputs: sigma: expected the noise of every output, got none for {', '.join(missing)}")
    return np.array([float(given[name]) for name in channels])
