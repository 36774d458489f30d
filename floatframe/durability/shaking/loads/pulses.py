"""Shock pulses of test specifications, and accelerations synthesised for a shock response spectrum.

An acceleration is the sum of shapes of one of two kinds, one for each frequency of the target. Their amplitudes are
corrected repeatedly by the ratio of the target to the spectrum of the sum:

- wavelets a sin(2 pi f t) sin(2 pi f t/N), 0 <= t <= N/(2 f), N odd and 3 or more, which begin and end at rest;
- damped sines a exp(-zeta omega t) sin(omega t), as in a pyroshock. Each has two slow damped sines, whose amplitudes
  cancel the velocity and displacement at its end (Smallwood & Nord (1974) compensate with a single delayed one).
"""

import math
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.durability.shaking.loads.levels import Level
from floatframe.durability.shaking.responses.response_spectrum import shock_response_spectrum
from floatframe.errors import ModelError

__all__ = ["PULSES", "SHAPES", "Synthesis", "damped_sines", "pulse", "synthesised"]

PULSES = ("half-sine", "terminal-peak", "initial-peak", "triangle", "trapezoid")
EDGE = 0.1  #: rise and fall of a trapezoid by default, relative to the duration
POINTS = 400  #: number of points of a pulse
WAVELETS_PER_OCTAVE = 6
ROUNDS = 60
POINTS_A_CYCLE = 20  #: points per cycle of the highest wavelet
#: shapes of a history for a spectrum, by name
SHAPES = {"wavelets": "wavelets, which end at rest", "damped-sines": "damped sines, compensated to end at rest"}
DECAY = 0.05  #: damping ratio zeta of damped sines by default
#: frequencies of the two compensating damped sines, relative to the lowest frequency of the target, and their zeta
SLOW, SLOW_DECAY = (0.5, 0.25), 0.8
ENDED = 1e3  #: factor by which the first damped sine has decayed at the end
MOST_NUMBERS = 100_000_000  #: largest number of values of the shapes
FADE = 0.05  #: last fraction of the duration, over which damped sines are faded to zero


def pulse(kind: str, amplitude: float, duration: float, *, edge: float = EDGE) -> tuple[Array, Array]:
    """Return times and accelerations of a pulse, (n,) each, linear between the points (a half-sine has 401).

    A terminal peak rises linearly and drops to zero within 1/1000 of the duration; an initial peak is its mirror image.

    Parameters
    ----------
    kind
        One of PULSES.
    amplitude
        Largest acceleration, in any unit; the result has the same unit.
    duration
        Duration of the pulse [s].
    edge
        Rise and fall of a trapezoid, relative to its duration, up to 0.5.
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


@presented
@dataclass(frozen=True, eq=False)
class Synthesis:
    """An acceleration synthesised for a target spectrum, and the deviation of its spectrum."""

    time: Array  #: times of the pulse, (n_t,) [s]
    acceleration: Array  #: acceleration at these times, (n_t,), in the unit of the target
    frequencies: Array  #: frequencies at which the spectra are compared, (n_f,) [Hz]
    target: Array  #: target spectrum, (n_f,)
    reached: Array  #: spectrum of the pulse, (n_f,)

    @property
    def decibels(self) -> Array:
        """Deviation 20 log10(reached / target), (n_f,) [dB]."""
        return np.asarray(20 * np.log10(self.reached / self.target))


def synthesised(target: Level, Q: float = 10.0, duration: float | None = None) -> Synthesis:
    """Return an acceleration of wavelets whose shock response spectrum approximates a target.

    (1) wavelets at frequencies 1/6 octave apart, of alternating sign, as many half-cycles as fit into the duration
    (2) `matched`

    Parameters
    ----------
    target
        Maximum absolute acceleration over natural frequency.
    Q
        Amplification of the masses.
    duration
        Duration of the acceleration [s]; default: five cycles of its lowest frequency.
    """
    duration = 5 / target.first if duration is None else duration
    if not duration * target.first >= 1.5:
        raise ModelError(
            f"{target.where}: duration {duration:g} s contains less than three half-cycles of the first frequency, "
            f"{target.first:g} Hz; "
            f"expected {1.5 / target.first:.4g} s or more"
        )
    f, t = grid(target, duration)
    waves = np.empty((len(f), len(t)))
    for k, own in enumerate(f):
        cycles = max(3, 2 * math.floor(own * duration - 0.5) + 1)
        cycles = min(cycles, 2 * 15 + 1)
        inside = t <= cycles / (2 * own)
        waves[k] = np.where(inside, np.sin(2 * np.pi * own * t) * np.sin(2 * np.pi * own * t / cycles), 0.0)
    return matched(target, Q, f, t, waves)


def damped_sines(target: Level, Q: float = 10.0, duration: float | None = None, *, decay: float = DECAY) -> Synthesis:
    """Return an acceleration of damped sines whose shock response spectrum approximates a target.

    (1) w_k = exp(-zeta omega_k t) sin(omega_k t) at frequencies 1/6 octave apart, faded to zero in the last twentieth
    (2) w_k - C c_k: two slow damped sines C, at a half and a quarter of the first frequency, cancel the velocity and
        the displacement of w_k, linear between its samples, at the end
    (3) `matched`

    Parameters
    ----------
    target
        Maximum absolute acceleration over natural frequency.
    Q
        Amplification of the masses.
    duration
        Duration of the acceleration [s]; default: until the first damped sine has decayed to a thousandth.
    decay
        Damping ratio zeta of the sines.

    Raises
    ------
    ModelError
        If the duration contains less than three cycles of the first frequency, or the decay is not between 0 and 0.5.
    """
    if not 0.005 <= decay <= 0.5:
        raise ModelError(f"{target.where}: decay: expected a ratio from 0.005 to 0.5, got {decay:g}")
    duration = math.log(ENDED) / (2 * np.pi * decay * target.first) if duration is None else duration
    if not duration * target.first >= 3:
        raise ModelError(
            f"{target.where}: duration {duration:g} s contains less than three cycles of the first frequency, "
            f"{target.first:g} Hz; expected {3 / target.first:.4g} s or more"
        )
    f, t = grid(target, duration)
    x = (t / t[-1] - (1 - FADE)) / FADE
    fade = 0.5 * (1 + np.cos(np.pi * np.clip(x, 0.0, 1.0)))

    def rung(frequencies: Array, zeta: float) -> Array:
        phase = 2 * np.pi * frequencies[:, None] * t
        return np.asarray(np.exp(-zeta * phase) * np.sin(phase) * fade)

    waves = rung(f, decay)  # (1)
    slow = rung(np.array(SLOW) * target.first, SLOW_DECAY)
    h = float(t[1])
    waves -= np.linalg.solve(left_by(slow, h), left_by(waves, h)).T @ slow  # (2)
    return matched(target, Q, f, t, waves)


def left_by(waves: Array, h: float) -> Array:
    """Return the velocity and displacement at the end of accelerations (n, n_t), linear between samples, (2, n)."""
    a, b = waves[:, :-1], waves[:, 1:]
    steps = np.cumsum(h * (a + b) / 2, axis=1)
    before = np.concatenate([np.zeros((len(waves), 1)), steps[:, :-1]], axis=1)
    return np.stack([steps[:, -1], (h * before + h**2 * (a / 3 + b / 6)).sum(axis=1)])


def grid(target: Level, duration: float) -> tuple[Array, Array]:
    """Return the frequencies of the shapes, and times that resolve the highest frequency."""
    n = max(2, math.ceil(WAVELETS_PER_OCTAVE * math.log2(target.last / target.first)) + 1)
    h = 1 / (POINTS_A_CYCLE * target.last)
    n_t = math.ceil(duration / h) + 1
    if n * n_t > MOST_NUMBERS:
        raise ModelError(
            f"{target.where}: {n} shapes at {n_t} times are too many; take a shorter duration or a lower last frequency"
        )
    t: Array = h * np.arange(n_t, dtype=np.float64)
    return np.asarray(np.geomspace(target.first, target.last, n), dtype=np.float64), t


def matched(target: Level, Q: float, f: Array, t: Array, waves: Array) -> Synthesis:
    """Return the sum of shapes whose spectrum approximates the target.

    (1) start with amplitudes of alternating sign
    (2) multiply the amplitudes by (target/spectrum)^0.6, with the spectrum of the sum at the frequencies of the shapes
    (3) repeat (2) 60 times, and return the sum with the smallest maximum deviation, compared at 1/12 octave

    Parameters
    ----------
    f, t
        Frequencies of the shapes, (n,) [Hz], and equal times, (n_t,) [s].
    waves
        The shapes, (n, n_t).
    """
    h, wanted = float(t[1]), target.at(f)
    amplitude = wanted / Q * (-1.0) ** np.arange(len(f))
    best, least = amplitude, math.inf
    for _ in range(ROUNDS):
        reached = shock_response_spectrum(amplitude @ waves, h, f, Q)
        away = float(np.abs(np.log(reached / wanted)).max())
        if away < least:
            best, least = amplitude.copy(), away
        amplitude = amplitude * (wanted / reached) ** 0.6
    a = best @ waves
    fine = np.geomspace(target.first, target.last, 2 * len(f) - 1)
    return Synthesis(np.asarray(t, dtype=float), a, fine, target.at(fine), shock_response_spectrum(a, h, fine, Q))
