"""A record that begins later, runs slower and has other numbers gives the same results, in its own time and numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.files.signals import (
    Signal,
    amplitude_spectrum,
    filtered,
    frequency_map,
    integrated_twice,
    order_map,
    psd,
    resampled,
    transfer_estimate,
    without_drift,
)
from floatframe.files.signals.analysis import even_signals
from floatframe.files.signals.drift import DRIFTS
from floatframe.files.signals.signals import Signals

LATE, SLOW, FACTOR = 7.25, 2.5, -3.0
RATE = 400.0
TIME = np.arange(1601) / RATE
ANGLE = 2 * np.pi * (3 * TIME + 0.4 * TIME**2)


def record(*, is_other: bool):
    """Return a signal with two lines, noise, a drift and an order; and how slow it is, its factor and its beginning."""
    noise = np.random.default_rng(1).normal(size=len(TIME))
    values = 0.3 + 0.05 * TIME**2 + np.sin(2 * np.pi * 31 * TIME) + 0.2 * np.sin(3 * ANGLE) + 0.1 * noise
    s, c, t_0 = (SLOW, FACTOR, LATE) if is_other else (1.0, 1.0, 0.0)
    return Signal("a", t_0 + s * TIME, c * values, "m/s^2"), s, c, t_0


def of_spectrum(found, s, c, power):
    return {"f": found.frequencies * s, "values": found.values / np.abs(c) ** power / (s if power == 2 else 1.0),
            "resolution": found.resolution * s, "n": found.n_averages}  # fmt: skip


def of_map(found, s, c, t_0, by_time):
    pace = s if by_time else 1.0
    return {"t": (found.times - t_0) / s, "speeds": found.speeds * s, "lines": found.lines * pace,
            "values": found.amplitudes / np.abs(c), "resolution": found.resolution * pace}  # fmt: skip


def of_signal(found, s, c, t_0):
    return {"t": (found.time - t_0) / s, "values": found.values / c}


def twice(signal, s, c, t_0, drift):
    motion, _ = integrated_twice(signal, position=0.3 * c * s**2, velocity=-0.2 * c * s, drift=drift)
    at = signal.time[:-1:7] + 0.3 * s / RATE
    return {f"rate {order}": motion.at(at, order) / (c * s ** (2 - order)) for order in range(3)}


def uneven(signal):
    keep = np.flatnonzero(np.arange(len(signal.time)) % 7 != 3)
    return Signal("a", signal.time[keep], signal.values[keep], signal.unit)


def of_resampling(signal, s, c, t_0, rate, **options):
    found, report = resampled(signal, rate / s, **options)
    sizes = [report.peak_before, report.peak_after, report.rms_before, report.rms_after]
    rates = np.multiply([report.rate_before, report.rate_after], s)
    own = {"rates": rates, "sizes": np.divide(sizes, np.abs(c)), "above": report.above_nyquist}
    return of_signal(found, s, c, t_0) | own


def of_usual_rate(signal, s, c, t_0):
    signal = uneven(signal)
    found = even_signals(Signals(signal.time, signal.values[:, None], ("a",), (signal.unit,)))
    return of_signal(found[1], s, c, t_0)


WAYS = {
    "fewer samples": lambda x, s, c, t_0: of_resampling(x, s, c, t_0, 130.0),
    "mirrored": lambda x, s, c, t_0: of_resampling(x, s, c, t_0, 50.0, anti_alias=False),
    "more samples": lambda x, s, c, t_0: of_resampling(x, s, c, t_0, 910.0),
    "uneven": lambda x, s, c, t_0: of_resampling(uneven(x), s, c, t_0, 300.0),
    "usual rate": of_usual_rate,
    "low": lambda x, s, c, t_0: of_signal(filtered(x, low_pass=40.0 / s), s, c, t_0),
    "high": lambda x, s, c, t_0: of_signal(filtered(x, high_pass=5.0 / s), s, c, t_0),
    **{
        f"drift {name}": lambda x, s, c, t_0, name=name: of_signal(
            without_drift(x, name, 2.0 / s if name == "high-pass" else None), s, c, t_0
        )
        for name in DRIFTS
    },
    **{f"twice {name}": lambda x, s, c, t_0, name=name: twice(x, s, c, t_0, name) for name in ("mean", "baseline")},
    "density": lambda x, s, c, t_0: of_spectrum(psd(x.values, x.rate), s, c, 2),
    "amplitude": lambda x, s, c, t_0: of_spectrum(amplitude_spectrum(x.values, x.rate), s, c, 1),
    "orders": lambda x, s, c, t_0: of_map(order_map(x, ANGLE, max_order=5.0, resolution=0.25), s, c, t_0, False),
    "waterfall": lambda x, s, c, t_0: of_map(
        frequency_map(x, (2 * np.pi * (3 + 0.8 * TIME)) / s), s, c, t_0, True
    ),
    "response": lambda x, s, c, t_0: {
        "H": transfer_estimate(x.values, np.roll(x.values, 3) / c, x.rate).H1 * c,
        "f": transfer_estimate(x.values, np.roll(x.values, 3), x.rate).frequencies * s,
    },
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_another_beginning_pace_and_factor_change_nothing_else(way):
    own, other = (WAYS[way](*record(is_other=is_other)) for is_other in (False, True))
    for key, expected in own.items():
        size = np.abs(expected).max()
        assert_allclose(other[key], expected, rtol=0, atol=2e-9 * size, err_msg=key)
