"""Motions near a steady motion, on which sensors measure, and the derivatives of what they measure.

(1) A sensor measures the steady motion; what it reads is recorded: motions of bodies and of moving grounds, unknowns of
    connections.
(2) It measures again while one variable of what it reads has other values: y at ±h, ±2h, ±3h, ±4h.
(3) The derivative is the central difference of order 8. The difference of order 6 and rounding, eps |y| / h, give its
    error. The step shrinks until the error is below `TOLERANCE`, or no longer falls.
(4) A column has no derivative if (y(h) + y(-h)) / 2 - y(0) is proportional to h down to the smallest step, as for the
    magnitude of a vector that is zero.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.errors import FloatframeError, ResultsError
from floatframe.model.rotations import (
    euler_parameter_product,
    euler_parameters_of_rotation_vector,
    rotated,
    rotation_matrix,
)
from floatframe.model.system import System
from floatframe.results.small_motions.rows import Rows, joined
from floatframe.results.small_motions.small_motions import SmallMotions, SmallPlace
from floatframe.results.trajectory import BodyMotion, Trajectory

__all__ = ["slopes_of"]

Owner = tuple[str, str]  #: ("body", its name), ("ground", the connection) or ("unknowns", "")
Measured = Callable[[System, Trajectory], Mapping[str, Array]]  #: columns of a sensor over time

UNKNOWNS: Owner = ("unknowns", "")
#: descriptions of records that no small motion determines
RECORDS = {"diagnostics": "energies and momenta", "load": "recorded forces", "load_case": "recorded load cases"}
FIRST_STEP = 2.0**-6  #: first step, relative to the scale of the variable
SHRINKS = 8.0  #: ratio of successive steps
LEVELS = 13  #: largest number of steps; the last one is 2e-13 of the scale
TOLERANCE = 1e-12  #: accepted error, relative to the largest derivative of the column
DOUBTFUL = 1e-6  #: error, relative to the largest derivative of the column, above which there is no derivative
KINK = 1e-9  #: smallest change of the derivative in a kink, relative to the largest derivative of the column
EPS = 4 * np.finfo(float).eps
OFFSETS = np.array([1.0, 2.0, 3.0, 4.0])
ORDER_8 = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
ORDER_6 = np.array([3 / 4, -3 / 20, 1 / 60, 0.0])
AT_ONCE = 128  #: largest number of variables that change in one measurement


# motions near by ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class NearbySource:
    """The steady motion once for each row of `steps`, each with its own changes; records what is read."""

    small: SmallMotions
    n_t: int = 1
    steps: Mapping[Owner, Array] = field(default_factory=dict)  #: changes of the variables of an owner, (n_t, n)
    owners: dict[Owner, set[int]] = field(default_factory=dict)  #: what was read; the numbers of the unknowns

    def read(self, name: str) -> Array:
        """Return a dataset; `ResultsError` for one that is no function of the motions of bodies and of unknowns."""
        if name == "w":
            return self.unknowns(range(self.small.n_w))
        if name not in ("t", "angle"):
            raise ResultsError(f"small motions do not determine {RECORDS.get(name, f'the record {name!r}')}")
        return np.repeat(self.small.now.source.read(name), self.n_t, axis=0)

    def unknowns(self, chosen: Sequence[int]) -> Array:
        """Return some unknowns of connections, (n_t, len(chosen))."""
        self.owners.setdefault(UNKNOWNS, set()).update(int(k) for k in chosen)
        w = self.small.now.source.read("w")[:, list(chosen)]
        steps = self.steps.get(UNKNOWNS)
        return np.repeat(w, self.n_t, axis=0) if steps is None else w + steps[:, list(chosen)]

    def frame(self, owner: Owner, now: BodyMotion) -> BodyMotion:
        """Return the motion of a body or ground with its changes, see `frame_variables`."""
        self.owners.setdefault(owner, set())
        n = 6 + now.q.shape[1]
        x, v, a = np.split(self.steps.get(owner, np.zeros((self.n_t, 3 * n))), 3, axis=1)
        p = euler_parameter_product(euler_parameters_of_rotation_vector(x[:, 3:6]), now.p)
        R, back = rotation_matrix(now.p), np.swapaxes(rotation_matrix(p), 1, 2)
        return BodyMotion(
            np.repeat(now.t, self.n_t), now.r + x[:, :3], p, now.q + x[:, 6:],
            now.v + v[:, :3], rotated(back, rotated(R, now.omega_B) + v[:, 3:6]), now.q_dot + v[:, 6:],
            now.v_dot + a[:, :3], rotated(back, rotated(R, now.omega_B_dot) + a[:, 3:6]), now.q_ddot + a[:, 6:],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class NearbyMotion(Trajectory):
    """Motions near a steady motion, one for each of its times, as a sensor reads them."""

    source: NearbySource

    def body(self, name: str) -> BodyMotion:
        """Return the motion of a body."""
        return self.source.frame(("body", name), self.source.small.now.body(name))

    def ground(self, connection: str) -> BodyMotion | None:
        """Return the motion of the ground side of a connection; None if no input moves it."""
        if not any(connection in base.moved for base in self.source.small.bases):
            return None
        zero, none, still = np.zeros((1, 3)), np.zeros((1, 0)), np.array([[1.0, 0.0, 0.0, 0.0]])
        t = self.source.small.now.t
        now = BodyMotion(t, zero, still, none, zero, zero, none, zero, zero, none)
        return self.source.frame(("ground", connection), now)

    def unknowns(self, chosen: Sequence[int]) -> Array:
        """Return some unknowns of connections."""
        return self.source.unknowns(chosen)


def nearby(source: NearbySource) -> NearbyMotion:
    """Return the motions of a source."""
    return NearbyMotion(source.small.now.head, source, is_complete=True)


# variables and their small motions ------------------------------------------------------------------------------------


def frame_variables(small: SmallMotions, owner: Owner) -> tuple[Rows, Array]:
    """Return the variables of a body or ground as rows of small motions, (3 (6 + n_q),), and their scales.

    They are changes of position, rotation, q, velocity, angular velocity, q', acceleration, angular acceleration, q''
    of the frame, in ground axes.
    """
    kind, name = owner
    length, rate = small.compiled.length, float(np.linalg.norm(small.omega)) or 1.0
    if kind == "ground":
        x = np.zeros((6, small.n_x))
        for k, base in enumerate(small.bases):
            if name in base.moved:
                x[:, small.n_u + k] = base.at(np.zeros(3))
        rows = small.by_motion(x)
        place, q, sizes = SmallPlace(np.zeros(3), np.eye(3), rows[:3], rows[3:], small.omega), rows[:0], np.zeros(0)
    else:
        place, q = small.frame_place(name), small.coordinates(name)
        reduced = getattr(small.system.body(name), "reduced", None)
        largest = np.zeros(0) if reduced is None else np.abs(reduced.Phi).max(axis=(0, 1), initial=0.0)
        sizes = length / np.where(largest > 0, largest, length)
    parts = [place.moved, place.rotation, q, place.velocity, place.omega, q.rate]
    parts += [place.acceleration, place.alpha, q.rate.rate]
    scale = np.concatenate([np.full(3, length), np.ones(3), sizes])
    return joined(parts), np.concatenate([scale, rate * scale, rate**2 * scale])


# derivatives ----------------------------------------------------------------------------------------------------------


def slopes_of(measured: Measured, small: SmallMotions) -> tuple[dict[str, Rows], list[str]]:
    """Return measured columns as linear functions of small motions, and the names of those without derivative.

    Raises
    ------
    ResultsError
        If the measurement reads more than motions of bodies and unknowns of connections.
    """
    base = NearbySource(small)
    names = list(measured(small.system, nearby(base)))
    totals = bounds = small.by_motion(np.zeros((len(names), small.n_x)))
    is_smooth = np.ones(len(names), bool)
    for owner, numbers in base.owners.items():
        if owner == UNKNOWNS:
            chosen = np.array(sorted(numbers), dtype=np.int64)
            rows, scales, width = small.by_wrench(chosen.tolist()), np.ones(len(chosen)), small.n_w
            scales = scales * (small.largest_wrench or 1.0)
        else:
            rows, scales = frame_variables(small, owner)
            chosen, width = np.arange(len(scales)), len(scales)
        for first in range(0, len(chosen), AT_ONCE):
            part = slice(first, first + AT_ONCE)
            own = chosen[part]

            def values(k: IntArray, h: Array, owner: Owner = owner, width: int = width, own: IntArray = own) -> Array:
                steps = np.zeros((1 + len(k), width))
                steps[np.arange(1, 1 + len(k)), own[k]] = h
                source = NearbySource(small, len(steps), {owner: steps})
                try:
                    columns = measured(small.system, nearby(source))
                except FloatframeError:  # a law may refuse large changes; smaller ones follow
                    return np.full((len(steps), len(names)), np.nan)
                return np.column_stack([columns[name] for name in names])

            slopes, smooth = derivatives(values, scales[part], len(names))
            totals, is_smooth = totals + rows[part].mapped(slopes), is_smooth & smooth
            bounds = bounds + rows[part].size.mapped(np.abs(slopes))
    totals = totals.without(bounds.mapped(TOLERANCE * np.eye(len(names))))
    columns = {name: totals[k] for k, name in enumerate(names) if is_smooth[k]}
    return columns, [name for k, name in enumerate(names) if not is_smooth[k]]


def derivatives(values: Callable[[IntArray, Array], Array], scales: Array, n_columns: int) -> tuple[Array, Array]:
    """Return the derivatives of columns by variables, (n_columns, n), and which columns have them, (n_columns,).

    Parameters
    ----------
    values
        Function from the numbers of variables, (m,), and their changes, (m,), to the columns without change and with
        each of these, (1 + m, n_columns).
    scales
        Changes of the variables that are large, (n,).
    """
    shape = len(scales), n_columns
    slope, error = np.zeros(shape), np.full(shape, np.inf)
    greatest, even_before, extent = np.zeros(shape), np.zeros(shape), np.zeros(n_columns)
    is_kink, n_worse = np.ones(shape, bool), np.zeros(shape)
    is_good, is_zero = np.zeros(shape, bool), np.zeros(shape, bool)
    for level in range(LEVELS):
        k = np.flatnonzero(~(is_good | is_zero | (n_worse >= 2)).all(axis=1))
        if not len(k):
            break
        h = FIRST_STEP * SHRINKS**-level * scales[k]
        y = values(np.repeat(k, 8), np.outer(h, [*OFFSETS, *-OFFSETS]).ravel())
        now, y = y[0], y[1:].reshape(len(k), 8, n_columns)
        odd, h = y[:, :4] - y[:, 4:], h[:, None]
        new = np.einsum("j,kjc->kc", ORDER_8, odd) / h
        gap = np.abs(new - np.einsum("j,kjc->kc", ORDER_6, odd) / h)
        even = np.abs((y[:, 0] - now) + (y[:, 4] - now)) / (2 * h)
        is_known = np.isfinite(gap)
        greatest[k] = np.fmax(greatest[k], np.abs(y).max(axis=1))
        extent = np.fmax(extent, np.fmax.reduce(np.fmax(np.abs(new), even) * scales[k, None], axis=0))
        largest, noise = extent / scales[k, None], EPS * greatest[k] / h
        grows = (even > even_before[k] / 2) & (even > 100 * (gap + noise)) & (even > KINK * largest)
        even_before[k] = np.where(is_known, even, 0.0)
        is_kink[k] &= grows | ~is_known
        is_zero[k] = is_kink[k] & is_known & (level > 0) & (np.abs(now) <= TOLERANCE * greatest[k])
        found = np.where(is_kink[k] | ~is_known, np.inf, gap + noise)
        is_better = (found < error[k]) & ~is_good[k]
        slope[k], error[k] = np.where(is_better, new, slope[k]), np.where(is_better, found, error[k])
        n_worse[k] = np.where(is_better | np.isinf(found), 0, n_worse[k] + 1)
        is_good[k] |= ~is_kink[k] & (gap <= TOLERANCE * largest + noise)
    is_smooth = is_good | (error * scales[:, None] <= DOUBTFUL * extent)
    slope[np.abs(slope) <= error] = 0.0
    return slope.T, np.asarray(is_smooth.all(axis=0))
