"""Exciting motions: finite Fourier series within limits, with a well conditioned linear form.

Coordinate k, over one period T = 2 pi / w, with N harmonics, is [1]_

    x_k = c_k + Σ_l (a_kl sin(l w t) - b_kl cos(l w t)) / (l w),

so that rates and accelerations are series too, the motion repeats (averages lower the noise) and its band is known.
The coefficients minimise the logarithm of the condition number of the rows of the base parameters, with rows and
columns divided by typical magnitudes, within limits of position, rate, acceleration and torque at the instants of one
period.

References
----------
.. [1] Swevers et al. (1997), IEEE Transactions on Robotics and Automation 13, 730-740.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.optimize import LinearConstraint, minimize

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.design.identification.base_parameters import (
    BaseParameters,
    form_rows,
    typical_coordinates,
    typical_rows,
)
from floatframe.errors import ModelError

__all__ = ["ExcitingMotion", "MotionLimits", "exciting_motion"]

SINGULAR = 1e-14  #: ratio of singular values that counts as zero
SMALLER = 9  #: number of decreasing amplitudes that are tried to satisfy torque limits


@dataclass(frozen=True)
@checked_fields(ModelError)
class MotionLimits:
    """The limits of a coordinate.

    Parameters
    ----------
    low
        Lower limit of the position [m or rad].
    high
        Upper limit of the position [m or rad].
    rate
        Largest rate [m/s or rad/s].
    acceleration
        Largest acceleration [m/s² or rad/s²].
    torque
        Largest torque, with the parameters of the system [N or N m].
    """

    low: float
    high: float
    rate: float
    acceleration: float = np.inf
    torque: float = np.inf


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ExcitingMotion:
    """A periodic motion.

    Parameters
    ----------
    names
        Names of the coordinates.
    period
        Period [s].
    coefficients
        c, a_1, b_1, ..., a_N, b_N of each coordinate, (n_c, 1 + 2 N).
    condition
        Condition number of the rows of base parameters in typical units.
    """

    names: tuple[str, ...]
    period: float
    coefficients: Array
    condition: float

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return positions, rates and accelerations, each (n, n_c), at times, (n,) [s]."""
        n = (self.coefficients.shape[1] - 1) // 2
        return tuple(block @ self.coefficients.T for block in series(np.asarray(t, dtype=float), self.period, n))  # type: ignore[return-value]


def series(t: Array, period: float, n: int) -> tuple[Array, Array, Array]:
    """Return the matrices from coefficients to positions, rates and accelerations, (len(t), 1 + 2 n) each."""
    w = 2 * np.pi / period
    x, v, a = (np.zeros((len(t), 1 + 2 * n)) for _ in range(3))
    x[:, 0] = 1.0
    for k in range(1, n + 1):
        s, c = np.sin(k * w * t), np.cos(k * w * t)
        x[:, 2 * k - 1], x[:, 2 * k] = s / (k * w), -c / (k * w)
        v[:, 2 * k - 1], v[:, 2 * k] = c, s
        a[:, 2 * k - 1], a[:, 2 * k] = -k * w * s, k * w * c
    return x, v, a


def exciting_motion(
    base: BaseParameters,
    limits: Mapping[str, MotionLimits],
    *,
    period: float,
    n_harmonics: int = 5,
    n_instants: int = 60,
    n_starts: int = 40,
    max_iterations: int = 40,
    seed: int = 0,
) -> ExcitingMotion:
    """Return a motion within limits that determines the base parameters accurately.

    Parameters
    ----------
    base
        The base parameters to determine.
    limits
        Limits of every coordinate, by its name.
    period
        Period of the motion [s].
    n_harmonics
        Number of harmonics N.
    n_instants
        Number of instants of the rows, at which the limits hold; between them the last harmonic may exceed the limits.
    n_starts, max_iterations, seed
        Number and seed of random starts, the best of which is improved by SLSQP, and its largest number of iterations.

    Raises
    ------
    ModelError
        If a coordinate has no limits or impossible ones, or no motion satisfies them.
    """
    form = base.form
    names = tuple(column.name for column in form.columns)
    bounds = [checked(name, limits, names) for name in names]
    if not period > 0 or n_harmonics < 1 or n_instants < 2 * n_harmonics + 1:
        raise ModelError(
            "exciting_motion: expected period above 0, n_harmonics of 1 or more and at least "
            f"{2 * n_harmonics + 1} instants, got "
            f"period = {period}, n_harmonics = {n_harmonics}, n_instants = {n_instants}"
        )
    t = np.arange(n_instants) * period / n_instants
    blocks = series(t, period, n_harmonics)
    n_c, width = len(names), 1 + 2 * n_harmonics
    largest = np.array([each.torque for each in bounds])
    is_limited = np.isfinite(largest)

    known: dict[bytes, tuple[float, float]] = {}  # the objective and its constraint evaluate the same motions

    def judged(x: Array) -> tuple[float, float]:
        """Return the logarithm of the condition number, and the smallest margin of a torque as a share of its limit."""
        key = x.tobytes()
        if key not in known:
            C = x.reshape(n_c, width)
            samples = form.samples(*(block @ C.T for block in blocks))
            rows = typical_rows(form, form_rows(form, samples, base.source), base.source)
            s = la.svdvals(base.rows(rows))
            room = np.inf
            if is_limited.any():
                tau = form.torques(samples)[:, is_limited] @ form.values
                room = float((1.0 - np.abs(tau).max(axis=0) / largest[is_limited]).min())
            known[key] = float(np.log(s[0] / max(s[-1], s[0] * SINGULAR))), room
        return known[key]

    scale = np.concatenate([
        scales_of(each, size, period, width)
        for each, size in zip(bounds, typical_coordinates(form, form.columns), strict=True)
    ])  # fmt: skip
    rows, low, high = [], [], []
    for k, each in enumerate(bounds):
        part = slice(k * width, (k + 1) * width)
        for block, (least, most) in zip(
            blocks,
            ((each.low, each.high), (-each.rate, each.rate), (-each.acceleration, each.acceleration)),
            strict=True,
        ):
            if np.isfinite(least) or np.isfinite(most):
                A, unit = np.zeros((n_instants, n_c * width)), np.abs(block * scale[part]).max()
                A[:, part] = block * scale[part] / unit
                rows.append(A)
                low += [least / unit] * n_instants
                high += [most / unit] * n_instants
    inside = LinearConstraint(np.vstack(rows), low, high)
    rng = np.random.default_rng(seed)
    starts = []
    for _ in range(n_starts):
        x = scaled_into(rng.normal(size=n_c * width) * scale, bounds, blocks, 0.95)
        for _ in range(SMALLER):
            if judged(x)[1] > 0:
                starts.append(x)
                break
            x = scaled_into(x, bounds, blocks, 0.7)
    if not starts:
        raise ModelError(
            "exciting_motion: no random motion satisfies the torque limits, however small; allow larger torques"
        )
    start = min(starts, key=lambda x: judged(x)[0])
    constraints: list = [inside]
    if is_limited.any():
        constraints.append({"type": "ineq", "fun": lambda x: judged(x * scale)[1]})
    found = minimize(
        lambda x: judged(x * scale)[0], start / scale, method="SLSQP", constraints=constraints,
        options={"maxiter": max_iterations, "ftol": 1e-3},
    )  # fmt: skip
    best = kept_within(found.x * scale, bounds, blocks)
    if judged(best)[1] < -1e-6 or judged(best)[0] > judged(start)[0]:
        best = start
    return ExcitingMotion(names, period, best.reshape(n_c, width), float(np.exp(judged(best)[0])))


def checked(name: str, limits: Mapping[str, MotionLimits], names: tuple[str, ...]) -> MotionLimits:
    """Return the limits of a coordinate; `ModelError` if they are missing or empty."""
    for given in limits:
        if given not in names:
            raise ModelError(f"exciting_motion: limits: no coordinate {quoted(given)}{nearest(given, list(names))}")
    if name not in limits:
        raise ModelError(f"exciting_motion: limits: expected limits of every coordinate, got none for {quoted(name)}")
    each = limits[name]
    if not each.low < each.high or min(each.rate, each.acceleration, each.torque) <= 0:
        raise ModelError(
            f"exciting_motion: limits of {quoted(name)}: expected low < high and rate, acceleration, torque above 0; "
            f"got {each}"
        )
    return each


def scales_of(each: MotionLimits, size: float, period: float, width: int) -> Array:
    """Return typical magnitudes of the coefficients of a coordinate, (width,): of c, and of the a and b of its rate.

    The offset c is half of the range, or `size` without limits; the rate is that times 2 pi / period.
    """
    half = 0.5 * (each.high - each.low)
    if not np.isfinite(half):
        half = size
    return np.concatenate([[half], np.full(width - 1, 2 * np.pi / period * half)])


def ratios_of(c: Array, each: MotionLimits, blocks: tuple[Array, Array, Array]) -> float:
    """Return the largest fraction of its limits that a coordinate uses, about its offset c[0]."""
    room = min(each.high - c[0], c[0] - each.low)
    swing = np.abs(blocks[0][:, 1:] @ c[1:]).max() / max(room, np.finfo(float).tiny)
    return float(
        max(swing, np.abs(blocks[1] @ c).max() / each.rate, np.abs(blocks[2] @ c).max() / each.acceleration, 1e-300)
    )


def scaled_into(x: Array, bounds: list[MotionLimits], blocks: tuple[Array, Array, Array], share: float) -> Array:
    """Return coefficients that use a fraction of their limits, about an offset in the inner third of the range."""
    C = x.reshape(len(bounds), -1).copy()
    for c, each in zip(C, bounds, strict=True):
        if np.isfinite(each.high - each.low):
            middle, half = 0.5 * (each.high + each.low), 0.5 * (each.high - each.low)
            c[0] = np.clip(c[0], middle - 0.3 * half, middle + 0.3 * half)
        c[1:] *= share / ratios_of(c, each, blocks)
    return C.ravel()


def kept_within(x: Array, bounds: list[MotionLimits], blocks: tuple[Array, Array, Array]) -> Array:
    """Return coefficients within their limits; those beyond are scaled down."""
    C = x.reshape(len(bounds), -1).copy()
    for c, each in zip(C, bounds, strict=True):
        c[1:] *= min(1.0, 1.0 / ratios_of(c, each, blocks))
    return C.ravel()
