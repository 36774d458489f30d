"""Exciting motions: finite Fourier series within limits whose linear form is well conditioned.

Of coordinate k, over one period T = 2 pi / w, with N harmonics [1]_

    x_k = c_k + Σ_l (a_kl sin(l w t) - b_kl cos(l w t)) / (l w),

so that rates and accelerations are series too, the motion repeats (averages lower the noise) and its band is known.
The coefficients minimise the logarithm of the condition number of the rows of the base parameters, columns in their
typical size, within limits of position, rate, acceleration and torque at the instants of one period.

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
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.identification.base_parameters import BaseParameters, form_rows, typical
from floatframe.identification.tree_samples import TreeSamples, tree_samples
from floatframe.relative.topology import tree_of

__all__ = ["ExcitingMotion", "MotionLimits", "exciting_motion"]


@dataclass(frozen=True)
class MotionLimits:
    """What a coordinate may do."""

    low: float  #: [m or rad]
    high: float
    rate: float  #: largest, [m/s or rad/s]
    acceleration: float = np.inf  #: [m/s² or rad/s²]
    torque: float = np.inf  #: [N or N m], of the parameters of the system


@dataclass(frozen=True, eq=False)
class ExcitingMotion:
    """A periodic motion."""

    names: tuple[str, ...]  #: of the coordinates
    period: float  #: [s]
    coefficients: Array  #: c, a_1, b_1, ..., a_N, b_N of each coordinate, (n_c, 1 + 2 N)
    condition: float  #: of the rows of base parameters in their typical size

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return positions, rates and accelerations, each (n, n_c), at times, (n,) [s]."""
        n = (self.coefficients.shape[1] - 1) // 2
        return tuple(block @ self.coefficients.T for block in series(np.asarray(t, dtype=float), self.period, n))  # type: ignore[return-value]


def series(t: Array, period: float, n: int) -> tuple[Array, Array, Array]:
    """Return the matrices from coefficients to positions, rates, accelerations, each (len(t), 1 + 2 n)."""
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
    n_starts: int = 4,
    max_iterations: int = 40,
    seed: int = 0,
) -> ExcitingMotion:
    """Return a motion within limits that tells the base parameters well.

    Parameters
    ----------
    base
        What is to be told.
    limits
        Of every coordinate, by its name.
    period
        Of the motion [s].
    n_harmonics
        N.
    n_instants
        At which rows are taken and limits kept; between them positions may leave them by what the last harmonic does.
    n_starts, max_iterations, seed
        Random beginnings, the best of which is improved by SLSQP.

    Raises
    ------
    ModelError
        If a coordinate has no limits or impossible ones, or no motion keeps them.
    """
    form = base.form
    names = tuple(column.name for column in tree_of(form.system).columns)
    bounds = [checked(name, limits, names) for name in names]
    if not period > 0 or n_harmonics < 1 or n_instants < 2 * n_harmonics + 1:
        raise ModelError(
            f"exciting_motion: expected period > 0, n_harmonics >= 1 and at least {2 * n_harmonics + 1} instants, got "
            f"period = {period}, n_harmonics = {n_harmonics}, n_instants = {n_instants}"
        )
    t = np.arange(n_instants) * period / n_instants
    blocks = series(t, period, n_harmonics)
    n_c, width = len(names), 1 + 2 * n_harmonics
    size = typical(form)[base.kept]
    has_torque_limits = any(np.isfinite(each.torque) for each in bounds)
    largest = np.array([each.torque for each in bounds])

    def motion(x: Array) -> TreeSamples:
        C = x.reshape(n_c, width)
        return tree_samples(form.system, *(block @ C.T for block in blocks))

    def condition(x: Array) -> float:
        s = la.svdvals(base.rows(form_rows(form, motion(x), base.source)) / size)
        return float(np.log(s[0] / max(s[-1], s[0] * 1e-14)))

    def torque_room(x: Array) -> Array:
        tau = form.torques(motion(x)) @ form.values
        finite = np.isfinite(largest)
        return 1.0 - np.abs(tau[:, finite]).max(axis=0) / largest[finite]

    rows, low, high = [], [], []
    for k, each in enumerate(bounds):
        for block, (least, most) in zip(
            blocks,
            ((each.low, each.high), (-each.rate, each.rate), (-each.acceleration, each.acceleration)),
            strict=True,
        ):
            if np.isfinite(least) or np.isfinite(most):
                A = np.zeros((n_instants, n_c * width))
                A[:, k * width : (k + 1) * width] = block
                rows.append(A)
                low += [least] * n_instants
                high += [most] * n_instants
    inside = LinearConstraint(np.vstack(rows), low, high)
    rng = np.random.default_rng(seed)
    starts = []
    for _ in range(n_starts * 10):
        x = shrunk(rng.normal(size=n_c * width), bounds, blocks, width)
        for _ in range(8 if has_torque_limits else 0):
            if torque_room(x).min() > 0:
                break
            x = shrunk(x, bounds, blocks, width, factor=0.7)
        if not has_torque_limits or torque_room(x).min() > 0:
            starts.append((condition(x), x))
    if not starts:
        raise ModelError(
            "exciting_motion: no motion keeps the limits of torque, at rest neither, it seems; allow larger torques"
        )
    starts.sort(key=lambda each: each[0])
    constraints: list = [inside]
    if has_torque_limits:
        constraints.append({"type": "ineq", "fun": torque_room})
    found = minimize(
        condition,
        starts[0][1],
        method="SLSQP",
        constraints=constraints,
        options={"maxiter": max_iterations, "ftol": 1e-3},
    )
    best = shrunk(found.x, bounds, blocks, width, factor=1.0)
    is_within = not has_torque_limits or torque_room(best).min() >= -1e-6
    if not is_within or condition(best) > starts[0][0]:
        best = starts[0][1]
    return ExcitingMotion(names, period, best.reshape(n_c, width), float(np.exp(condition(best))))


def checked(name: str, limits: Mapping[str, MotionLimits], names: tuple[str, ...]) -> MotionLimits:
    """Return the limits of a coordinate; `ModelError` if there are none, or nothing fits in."""
    for given in limits:
        if given not in names:
            raise ModelError(f"exciting_motion: limits: no coordinate {quoted(given)}{nearest(given, list(names))}")
    if name not in limits:
        raise ModelError(f"exciting_motion: limits: expected those of every coordinate, none for {quoted(name)}")
    each = limits[name]
    if not each.low < each.high or min(each.rate, each.acceleration, each.torque) <= 0:
        raise ModelError(
            f"exciting_motion: limits of {quoted(name)}: expected low < high and rate, acceleration, torque above 0; "
            f"got {each}"
        )
    return each


def shrunk(
    x: Array, bounds: list[MotionLimits], blocks: tuple[Array, Array, Array], width: int, factor: float = 0.95
) -> Array:
    """Return coefficients within the limits of position, rate and acceleration, scaled about the middle."""
    C = x.reshape(len(bounds), width).copy()
    for c, each in zip(C, bounds, strict=True):
        if not np.isfinite(each.high - each.low):
            middle, half = 0.0, np.inf
        else:
            middle, half = 0.5 * (each.high + each.low), 0.5 * (each.high - each.low)
        swing = blocks[0][:, 1:] @ c[1:]
        offset = np.clip(c[0], middle - 0.3 * half, middle + 0.3 * half) if factor < 1.0 else c[0]
        room = half - abs(offset - middle) if np.isfinite(half) else np.inf
        ratios = [
            np.abs(swing).max() / max(room, 1e-12),
            np.abs(blocks[1] @ c).max() / each.rate,
            np.abs(blocks[2] @ c).max() / each.acceleration,
        ]
        most = max(ratios)
        c[0] = offset
        c[1:] *= factor / most if factor < 1.0 else min(1.0, 1.0 / max(most, 1e-300))
    return C.ravel()
