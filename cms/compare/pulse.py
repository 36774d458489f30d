"""The reference motion of a comparison: a short force pulse at an interface, and the free response to it.

The force acts on boundary dofs along one direction, f(t) = direction * sin²(pi t / T) for 0 < t < T. Every elastic free
mode answers as an oscillator; modes that were not found answer statically:

    u(t) = sum_k phi_k (q_k(t) - q_k,static(t)) + u_static f(t),  q_k,static = phi_kᵀ f / omega_k²

Rigid-body motion is left out, since the deformation error looks at the deformation (THEORY §8).
"""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array
from cms.errors import CompareError
from cms.fe_body import FEBody

__all__ = ["Motion", "Pulse", "default_pulse", "pulse_response"]

SAMPLES = 400  #: of the motion that are compared
STEPS_A_PERIOD = 40  #: of the highest mode, in the exact recursion for a force linear between steps
PERIODS = 4.0  #: of the first mode, after the pulse
MOST_STEPS = 40_000


@dataclass(frozen=True, eq=False)
class Pulse:
    """A unit force pulse on boundary dofs."""

    direction: Array  #: over the boundary dofs, (n_b,) [N, N m]
    where: str  #: in words


@dataclass(frozen=True, eq=False)
class Motion:
    """A deformation over time: coefficients of displacements."""

    t: Array  #: (n_t,) [s]
    force: Array  #: f(t) of the unit pulse, (n_t,)
    modes: Array  #: coefficients of the elastic free modes, (n_modes, n_t)
    static: Array  #: coefficient of the static response to the pulse, (1, n_t)
    duration: float  #: of the pulse [s]


def default_pulse(body: FEBody, interface: str | None = None) -> Pulse:
    """Return a unit force at an interface (the first by default) along the diagonal of the mesh axes.

    Raises
    ------
    CompareError
        If the body has no interface, or that one has no translation.
    """
    if not body.interfaces:
        raise CompareError(f"body {body.name!r} has no interface for the pulse of the reference motion to act on")
    chosen = body.interfaces[0] if interface is None else body.interface(interface)
    on_it = np.isin(body.b, np.asarray(chosen.dofs))
    is_translation = body.dofs[body.b, 1] < 3
    acting = on_it & is_translation
    if not acting.any():
        raise CompareError(f"interface {chosen.name!r} of body {body.name!r} has no translation for a force to act on")
    direction = acting / np.sqrt(acting.sum())
    return Pulse(direction, f"a unit force pulse at {chosen.name}, equal along x, y and z")


def pulse_response(omega2: Array, at_b: Array, pulse: Pulse, *, band: float, damping: float) -> Motion:
    """Return the elastic response of the free body to a pulse whose spectrum ends at about the band.

    Parameters
    ----------
    omega2
        Of the elastic free modes, (n_modes,) [1/s²].
    at_b
        M-orthonormal modes at the boundary dofs, (n_b, n_modes).
    band
        Highest frequency [Hz]; the pulse lasts 2 / band, so that its main lobe ends there.
    damping
        Ratio of every mode.
    """
    duration = 2.0 / band
    t_end = duration + PERIODS * 2 * np.pi / np.sqrt(omega2[0])
    highest = np.sqrt(omega2[-1]) / (2 * np.pi)
    n_steps = int(np.clip(STEPS_A_PERIOD * highest * t_end, SAMPLES, MOST_STEPS))
    every = max(1, n_steps // SAMPLES)
    n_steps = every * (n_steps // every)
    t = np.linspace(0.0, t_end, n_steps + 1)
    force = np.where(t < duration, np.sin(np.pi * t / duration) ** 2, 0.0)
    load = at_b.T @ pulse.direction
    q = oscillators(omega2, damping, load, force, t[1])
    kept = slice(None, None, every)
    return Motion(
        t=t[kept],
        force=force[kept],
        modes=(q - (load / omega2)[:, None] * force)[:, kept],
        static=force[None, kept],
        duration=duration,
    )


def oscillators(omega2: Array, damping: float, load: Array, force: Array, h: float) -> Array:
    """Solve q_ddot + 2 zeta omega q_dot + omega² q = load f(t) from rest, f linear between steps: exact recursion.

    (1) over a step from t to t + h, f = f_0 + (f_1 - f_0) s / h
    (2) particular solution a + b s:  b = load (f_1 - f_0) / (h omega²),  a = load f_0 / omega² - 2 zeta b / omega
    (3) homogeneous part from q - a and q_dot - b by the damped oscillator's transition over h

    Returns
    -------
    Array
        (n_modes, n_steps + 1).
    """
    omega = np.sqrt(omega2)
    damped = omega * np.sqrt(1 - damping**2)
    decay, c, s = np.exp(-damping * omega * h), np.cos(damped * h), np.sin(damped * h)
    ratio = damping * omega / damped
    q, v = np.zeros(len(omega2)), np.zeros(len(omega2))
    out = np.zeros((len(omega2), len(force)))
    for k in range(len(force) - 1):
        b = load * (force[k + 1] - force[k]) / (h * omega2)  # (2)
        a = load * force[k] / omega2 - 2 * damping * b / omega
        dq, dv = q - a, v - b  # (3)
        q_h = decay * (dq * (c + ratio * s) + dv * s / damped)
        v_h = decay * (dv * (c - ratio * s) - dq * omega2 * s / damped)
        q, v = q_h + a + b * h, v_h + b
        out[:, k + 1] = q
    return out
