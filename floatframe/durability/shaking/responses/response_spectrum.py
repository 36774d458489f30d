"""Shock response spectra: the largest response of single masses to an acceleration of their base.

For a mass with natural frequency f and amplification Q, z is its motion relative to the base, and its absolute
acceleration is a = -(2 zeta omega z_dot + omega² z). Spectra are max |a|, max |z|, and the pseudo-velocity
omega max |z|. The primary spectrum covers the given time. The residual spectrum covers the free vibration after it,
whose largest value follows from the state in closed form.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.durability.shaking.responses.time_steps import oscillator
from floatframe.errors import ModelError

__all__ = ["KINDS", "octave_frequencies", "shock_response_spectrum"]

KINDS = ("acceleration", "displacement", "pseudo-velocity")
#: points per cycle of the highest frequency; a peak between samples is missed by at most 1 - cos(pi/40) = 0.3 %
POINTS_A_CYCLE = 40


@dataclass(frozen=True, eq=False)
class _Free:
    """Largest values of free vibration."""

    acceleration: float
    displacement: float


def octave_frequencies(first: float, last: float, per_octave: int = 12) -> Array:
    """Return frequencies from first to last, with a number per octave, (n,) [Hz]."""
    n = max(2, round(np.log2(last / first) * per_octave) + 1)
    return np.geomspace(first, last, n)


def shock_response_spectrum(
    acceleration: Array,
    h: float,
    frequencies: Array,
    Q: float = 10.0,
    kind: str = "acceleration",
    *,
    residual: bool = True,
) -> Array:
    """Return the shock response spectrum of an acceleration that is linear between its samples, (n_f,).

    Parameters
    ----------
    acceleration
        Acceleration of the base, (n_t,), in any unit.
    h
        Time between samples [s].
    frequencies
        Natural frequencies [Hz], (n_f,).
    Q
        Amplification, 1/(2 zeta).
    kind
        "acceleration" (absolute, in the unit of the base), "displacement" (relative, this unit times s²) or
        "pseudo-velocity" (this unit times s).
    residual
        Whether the free vibration after the last sample is included.
    """
    if kind not in KINDS:
        raise ModelError(f"shock_response_spectrum: kind: expected one of {', '.join(KINDS)}, got {kind!r}")
    if not Q > 0.5:
        raise ModelError(f"shock_response_spectrum: Q: expected a number above 0.5, got {Q!r}")
    a = np.asarray(acceleration, dtype=float)
    zeta = 1 / (2 * Q)
    found = np.empty(len(frequencies))
    for k, f in enumerate(frequencies):
        omega = 2 * np.pi * float(f)
        own, step = refined(a, h, f)
        z = oscillator(omega, zeta, -own, step)
        absolute = -(2 * zeta * omega * z.rate + omega**2 * z.value)
        largest = {"acceleration": np.abs(absolute).max(), "displacement": np.abs(z.value).max()}
        if residual:
            free = free_peaks(omega, zeta, float(z.value[-1]), float(z.rate[-1]))
            largest["acceleration"] = max(largest["acceleration"], free.acceleration)
            largest["displacement"] = max(largest["displacement"], free.displacement)
        largest["pseudo-velocity"] = omega * largest["displacement"]
        found[k] = largest[kind]
    return found


def refined(a: Array, h: float, f: float) -> tuple[Array, float]:
    """Return samples that resolve a frequency, on the same linear pieces, and their time step."""
    n = int(np.ceil(POINTS_A_CYCLE * f * h))
    if n <= 1 or len(a) < 2:
        return a, h
    places = np.arange((len(a) - 1) * n + 1) / n
    return np.interp(places, np.arange(len(a)), a), h / n


def free_peaks(omega: float, zeta: float, z: float, z_dot: float) -> _Free:
    """Return the largest |a| and |z| of free vibration from a state, a = -(2 zeta omega z_dot + omega² z)."""
    damped = omega * np.sqrt(1 - zeta**2)
    mu = complex(-zeta * omega, damped)
    amplitude = complex(z, -(z_dot + zeta * omega * z) / damped)  # z = Re(amplitude exp(mu t))
    return _Free(first_extremum(mu**2 * amplitude, mu), first_extremum(amplitude, mu))


def first_extremum(c: complex, mu: complex) -> float:
    """Return the largest |Re(c exp(mu t))| for t >= 0: the initial value, or the first extremum."""
    if c == 0:
        return 0.0
    # Re(c mu exp(mu t)) = 0: the phase of c mu + Im(mu) t is an odd multiple of pi/2
    phase = float(np.angle(c * mu))
    t = ((np.pi / 2 - phase) % np.pi) / mu.imag
    return float(max(abs(c.real), abs((c * np.exp(mu * t)).real)))
