"""Shock pulses of test specifications, and accelerations made for a shock response spectrum.

A wavelet a sin(2 pi f t) sin(2 pi f t/N), 0 <= t <= N/(2 f), N odd and 3 or more, begins and ends at rest: neither
velocity nor
displacement is left. One a frequency of the target, with amplitudes corrected by what the spectrum of their sum lacks,
again and again.
"""

import math
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.shaking.loads.levels import Level
from floatframe.shaking.responses.response_spectrum import shock_response_spectrum

__all__ = ["PULSES", "Synthesis", "pulse", "synthesised"]

PULSES = ("half-sine", "terminal-peak", "initial-peak", "triangle", "trapezoid")
EDGE = 0.1  #: of the duration: rise and fall of a trapezoid where none are given
POINTS = 400  #: of a pulse
WAVELETS_PER_OCTAVE = 6
ROUNDS = 60
POINTS_A_CYCLE = 20  #: of the highest wavelet


def pulse(kind: str, amplitude: float, duration: float, *, edge: float = EDGE) -> tuple[Array, Array]:
    """Return times and accelerations of a pulse, (n,) each: straight between the points (a half-sine has 401).

    A terminal peak rises straight and ends at once, within 1/1000 of the duration; an initial one is its mirror.

    Parameters
    ----------
    kind
        One of PULSES.
    edge
        Rise and fall of a trapezoid over its duration, up to 0.5.
    """
    if kind not in PULSES:
        raise ModelError(f"shock: pulse: expected one of {', '.join(PULSES)}, got {kind!r}")
    if not (math.isfinite(duration) and duration > 0):
        raise ModelError(f"shock: duration: expected seconds above 0, got {duration!r}")
    if not (math.isfinite(amplitude) and amplitude != 0):
        raise ModelError(f"shock: amplitude: expected a number other than 0, got {amplitude!r}")
    if not 0 < edge <= 0.5:
        raise ModelError(f"shock: edge: expected a share of the duration between 0 and 0.5, got {edge!r}")
    if kind == "half-sine":
        x = np.linspace(0.0, 1.0, POINTS + 1)
        y = np.sin(np.pi * x)
        y[-1] = 0.0
    else:
        corners: dict[str, tuple[list[float], list[float]]] = {
            "terminal-peak": ([0, 0.999, 1], [0, 1, 0]),
            "initial-peak": ([0, 0.001, 1], [0, 1, 0]),
            "triangle": ([0, 0.5, 1], [0, 1, 0]),
            "trapezoid": ([0, edge, 1 - edge, 1], [0, 1, 1, 0]) if edge < 0.5 else ([0, 0.5, 1], [0, 1, 0]),
        }
        x, y = (np.array(each, dtype=float) for each in corners[kind])
    return np.asarray(x, dtype=float) * duration, np.asarray(y, dtype=float) * amplitude


@dataclass(frozen=True, eq=False)
class Synthesis:
    """An acceleration made for a target, and how far its spectrum is from it."""

    time: Array  #: (n_t,) [s]
    acceleration: Array  #: in the unit of the target, (n_t,)
    frequencies: Array  #: where the spectra are compared, (n_f,) [Hz]
    target: Array  #: (n_f,)
    reached: Array  #: (n_f,)

    @property
    def decibels(self) -> Array:
        """20 log10 of reached over target, (n_f,)."""
        return np.asarray(20 * np.log10(self.reached / self.target))


def synthesised(target: Level, Q: float = 10.0, duration: float | None = None) -> Synthesis:
    """Return an acceleration of wavelets whose shock response spectrum is near a target.

    (1) wavelets at frequencies 1/6 octave apart, of alternating sign, as many half-cycles as fit into the duration
    (2) their sum; its spectrum at their frequencies; amplitudes times (target/spectrum)^0.6
    (3) again, 60 times; the round with the least largest deviation is kept, compared at 1/12 octave

    Parameters
    ----------
    target
        Maximum absolute acceleration over natural frequency.
    Q
        Amplification of the masses.
    duration
        Of the acceleration [s]; default: five cycles of its lowest frequency.
    """
    where = target.where
    duration = 5 / target.first if duration is None else duration
    if not duration * target.first >= 1.5:
        raise ModelError(
            f"{where}: duration {duration:g} s holds less than three half-cycles of the first frequency, "
            f"{target.first:g} Hz; "
            f"expected {1.5 / target.first:.4g} s or more"
        )
    n = max(2, math.ceil(WAVELETS_PER_OCTAVE * math.log2(target.last / target.first)) + 1)
    f = np.geomspace(target.first, target.last, n)
    h = 1 / (POINTS_A_CYCLE * target.last)
    t = np.arange(math.ceil(duration / h) + 1) * h
    waves = np.empty((n, len(t)))
    for k, own in enumerate(f):
        cycles = max(3, 2 * math.floor(own * duration - 0.5) + 1)
        cycles = min(cycles, 2 * 15 + 1)
        inside = t <= cycles / (2 * own)
        waves[k] = np.where(inside, np.sin(2 * np.pi * own * t) * np.sin(2 * np.pi * own * t / cycles), 0.0)
    wanted = target.at(f)
    amplitude = wanted / Q * (-1.0) ** np.arange(n)
    best, least = amplitude, math.inf
    for _ in range(ROUNDS):
        reached = shock_response_spectrum(amplitude @ waves, h, f, Q)
        away = float(np.abs(np.log(reached / wanted)).max())
        if away < least:
            best, least = amplitude.copy(), away
        amplitude = amplitude * (wanted / reached) ** 0.6
    a = best @ waves
    fine = np.geomspace(target.first, target.last, 2 * n - 1)
    return Synthesis(np.asarray(t, dtype=float), a, fine, target.at(fine), shock_response_spectrum(a, h, fine, Q))
