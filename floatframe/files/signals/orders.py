"""Order tracking: spectra over orders of a rotation with varying speed, from samples at equal angles.

(1) The angle θ(t) of the rotation is known at the samples, or is the integral of its speed.
(2) Between the samples, angle and signal are quintic splines. Newton's method gives the times t_j with
    θ(t_j) = θ_0 + 2 pi j/S, and the signal is evaluated as x(t_j). The number S of samples per turn is so large that
    even at the slowest speed n_min [turns per second] S n_min is the rate of the signal, so that there is no aliasing.
(3) Blocks of whole turns are transformed; the line k of a block of R turns is the order k/R.

A line of order o whose speed changes stays one line, where over frequency it is smeared (Fyfe & Munck (1997)).
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.records import frozen_copies
from floatframe.errors import SignalError
from floatframe.files.signals.signals import Signal
from floatframe.files.signals.spectra import window_corrections, window_samples
from floatframe.model.functions.tables import quintic_table

__all__ = ["SpectralMap", "angle_of_speed", "frequency_map", "order_cut", "order_map"]

SLOW = 0.05  #: speed, relative to the highest speed, below which the rotation is excluded
MOST_SAMPLES = 2e7  #: largest number of samples at equal angles
LEAST_SAMPLES = 16
NEWTON = 4  #: number of Newton steps for the times of equal angles


@frozen_copies
@dataclass(frozen=True, eq=False)
class SpectralMap:
    """Amplitudes of blocks of a signal, over orders or frequencies."""

    kind: str  #: "order" or "frequency"
    name: str
    times: Array  #: time at the middle of each block (for orders, at half its turns), (n_b,) [s]
    speeds: Array | None  #: speed at these times, (n_b,) [rad/s]
    lines: Array  #: orders [-] or frequencies [Hz], (n_l,)
    amplitudes: Array  #: (n_b, n_l) in `unit`
    unit: str
    is_rms: bool
    resolution: float  #: spacing of lines
    noise_bandwidth: float  #: noise bandwidth of the window, in lines
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for key in ("times", "lines", "amplitudes", *(() if self.speeds is None else ("speeds",))):
            object.__setattr__(self, key, frozen(np.array(getattr(self, key), dtype=float)))


def angle_of_speed(time: Array, speed: Array) -> Array:
    """Return the angle for a speed [rad/s], beginning at zero, (n_t,) [rad]; the speed is a quintic spline."""
    from scipy.interpolate import make_interp_spline

    if len(time) < 6:
        raise SignalError(f"orders: expected six or more samples of the speed, got {len(time)}")
    return make_interp_spline(time, speed, k=5).antiderivative()(time)


def order_map(
    signal: Signal,
    angle: Array,
    *,
    max_order: float = 10.0,
    resolution: float = 0.25,
    overlap: float = 0.75,
    window: str = "hann",
    is_rms: bool = False,
    slowest: float | None = None,
) -> SpectralMap:
    """Return amplitudes over orders for blocks of turns, steps (2) and (3) of this module.

    Parameters
    ----------
    signal
        Signal at equidistant times.
    angle
        Angle of the rotation at these times, (n_t,) [rad], with all turns; see `angle_of_speed`.
    max_order
        Highest order shown.
    resolution
        Spacing of orders; a block has 1/resolution turns.
    overlap
        Fraction of a block that it shares with the next one.
    window, is_rms
        As for `amplitude_spectrum`.
    slowest
        Speed below which the rotation is excluded [rad/s]; default: 5 % of the highest speed.

    Raises
    ------
    SignalError
        If the rotation has no part fast enough, or there are fewer turns than a block has.

    References
    ----------
    Fyfe & Munck (1997).
    """
    where = f"orders of {signal.name!r}"
    t, rate = signal.time, signal.rate
    angle = np.array(angle, dtype=float)
    if angle.shape != t.shape or not np.isfinite(angle).all() or len(t) < LEAST_SAMPLES:
        raise SignalError(f"{where}: expected an angle at each of {LEAST_SAMPLES} or more times, got {angle.shape}")
    if not 0 < resolution <= 1 or not max_order > 0 or not 0 <= overlap < 1:
        raise SignalError(
            f"{where}: expected 0 < resolution <= 1, max_order > 0 and 0 <= overlap < 1, got {resolution:g}, "
            f"{max_order:g}, {overlap:g}"
        )
    angle = angle * (1.0 if angle[-1] >= angle[0] else -1.0)
    speed = np.gradient(angle, t)
    limit = SLOW * float(speed.max()) if slowest is None else float(slowest)
    first, last = fastest_part(speed, limit, where)
    notes = []
    if first > 0 or last < len(t) - 1:
        notes.append(f"from t = {t[first]:.6g} to {t[last]:.6g} s, where the rotation is faster than {limit:.6g} rad/s")
    slow = float(speed[first : last + 1].min()) / (2 * np.pi)
    fast = float(speed[first : last + 1].max()) / (2 * np.pi)
    per_turn = int(np.ceil(max(rate / slow, 2.56 * max_order)))
    turns = float(angle[last] - angle[first]) / (2 * np.pi)
    n_turns = round(1 / resolution)
    if turns < n_turns:
        raise SignalError(
            f"{where}: {turns:.4g} turns, a block has {n_turns}; take a coarser resolution than {resolution:g}"
        )
    if turns * per_turn > MOST_SAMPLES:
        raise SignalError(
            f"{where}: {turns:.4g} turns with {per_turn} samples each, for the slowest speed {slow * 2 * np.pi:.4g} "
            f"rad/s, are more than {MOST_SAMPLES:.0e}; exclude slow speeds (slowest)"
        )
    if max_order * fast > rate / 2:
        notes.append(f"orders above {rate / 2 / fast:.4g} lie above half the rate at the highest speed")
    n_points = int(turns * per_turn) + 1
    theta = angle[first] + 2 * np.pi / per_turn * np.arange(n_points)
    times = times_of_angles(t[first : last + 1], angle[first : last + 1], theta)
    x = quintic_table(t, signal.values).at(times)
    n = n_turns * per_turn
    starts = np.arange(0, n_points - n + 1, max(1, round(n * (1 - overlap))))
    k = np.arange(int(np.floor(max_order / resolution + 1e-9)) + 1)
    amplitudes = block_amplitudes(x, starts, n, window, is_rms)[:, : len(k)]
    middle = times[np.minimum(starts + n // 2, n_points - 1)]  # middle in angle, where the window is largest
    speeds = quintic_table(t, angle).at(middle, 1)
    c = window_corrections(window, n)
    return SpectralMap(
        "order", signal.name, middle, speeds, k / n_turns, amplitudes, signal.unit, is_rms, 1 / n_turns,
        c.noise_bandwidth, (*notes, f"window {window}, blocks of {n_turns} turns, {per_turn} samples a turn"),
    )  # fmt: skip


def fastest_part(speed: Array, limit: float, where: str) -> tuple[int, int]:
    """Return the first and last index of the longest part of the record that is faster than a limit."""
    fast = speed > max(limit, 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fast, [False]]).astype(np.int8)))
    if not len(edges):
        raise SignalError(f"{where}: the rotation is nowhere faster than {limit:g} rad/s; is this its angle or speed?")
    begins, ends = edges[::2], edges[1::2] - 1
    longest = int(np.argmax(ends - begins))
    if ends[longest] - begins[longest] < LEAST_SAMPLES:
        raise SignalError(
            f"{where}: only {ends[longest] - begins[longest] + 1} samples are faster than {limit:g} rad/s"
        )
    return int(begins[longest]), int(ends[longest])


def times_of_angles(t: Array, angle: Array, theta: Array) -> Array:
    """Return the times at which an increasing angle has given values, by Newton's method on its quintic spline."""
    curve = quintic_table(t, angle)
    times = np.interp(theta, angle, t)
    before_end = np.nextafter(t[-1], -np.inf)
    for _ in range(NEWTON):
        times = np.clip(times - (curve.at(times) - theta) / curve.at(times, 1), t[0], before_end)
    return times


def block_amplitudes(x: Array, starts: IntArray, n: int, window: str, is_rms: bool) -> Array:
    """Return the amplitudes of the lines of blocks of n samples, (n_b, n//2 + 1)."""
    w = window_samples(window, n)
    factor = np.full(n // 2 + 1, (1.0 if is_rms else np.sqrt(2.0)) * np.sqrt(2.0) / w.sum())
    factor[0] = 1 / w.sum()
    if n % 2 == 0:
        factor[-1] = 1 / w.sum()
    return np.array([np.abs(np.fft.rfft(x[k : k + n] * w)) * factor for k in starts])


def order_cut(orders: SpectralMap, order: float, half_width: float | None = None) -> Array:
    """Return the amplitude of one order over the blocks, (n_b,), from the power near the order.

    Lines within half_width, by default two of the resolution (the main lobe of hann), are added in power and divided
    by the noise bandwidth of the window.
    """
    half = 2 * orders.resolution if half_width is None else half_width
    near = np.abs(orders.lines - order) <= half * (1 + 1e-9)
    if not near.any():
        raise SignalError(f"order {order:g} of {orders.name!r}: orders end at {orders.lines[-1]:g}")
    return np.sqrt((orders.amplitudes[:, near] ** 2).sum(axis=1) / orders.noise_bandwidth)


def frequency_map(
    signal: Signal,
    speed: Array | None = None,
    *,
    n_segment: int | None = None,
    overlap: float = 0.75,
    window: str = "hann",
    is_rms: bool = False,
) -> SpectralMap:
    """Return amplitudes over frequencies for segments of a record (waterfall), with the mean speed of each if known.

    n_segment: samples of a segment, by default a sixteenth of the record; speed: (n_t,) [rad/s].
    """
    rate, n_t = signal.rate, len(signal.time)
    n = max(n_t // 16, LEAST_SAMPLES) if n_segment is None else n_segment
    if not LEAST_SAMPLES <= n <= n_t:
        raise SignalError(f"waterfall of {signal.name!r}: a segment of {n} samples: expected {LEAST_SAMPLES} to {n_t}")
    starts = np.arange(0, n_t - n + 1, max(1, round(n * (1 - overlap))))
    amplitudes = block_amplitudes(signal.values - signal.values.mean(), starts, n, window, is_rms)
    speeds = None if speed is None else np.array([np.mean(speed[k : k + n]) for k in starts])
    return SpectralMap(
        "frequency", signal.name, signal.time[starts] + (n - 1) / (2 * rate), speeds, np.arange(n // 2 + 1) * rate / n,
        amplitudes, signal.unit, is_rms, rate / n, window_corrections(window, n).noise_bandwidth,
        (f"window {window}, segments of {n} samples",),
    )  # fmt: skip
