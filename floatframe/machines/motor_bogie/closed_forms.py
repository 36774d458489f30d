"""Torque of an induction motor at constant speed, on a supply with harmonics, by phasors.

At a constant mechanical speed Omega, the equations of the motor are linear with constant coefficients. Each component k
of the supply, U_k e^(j k theta) with d theta/dt = w = 2 pi f, produces its own currents and fluxes e^(j k theta)
(equations in `floatframe.components.drives.induction_motor`):

    [R_s + j k w L_s        j k w L_m         ] [i_s]   [U_k]
    [j (k w - p Omega) L_m  R_r + j (k w - p Omega) L_r] [i_r] = [0]

The torque 3/2 p Im(conj(psi_s) i_s) has a line at n times the supply frequency for every pair of components with b - a
= ±n. With c_n = sum of conj(psi_a) i_b over b - a = n, its amplitude is 3/2 p |c_n - conj(c_-n)|, and the mean torque
is 3/2 p Im c_0. A supply with the orders -5 and 7 gives n = 6 and 12, an unbalanced supply (order -1) n = 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

__all__ = [
    "Motor",
    "ripple_of_leakage", "speed_of_torque", "steady_fluxes", "supply_voltage", "torque_lines", "torque_over_speed",
]  # fmt: skip


@dataclass(frozen=True)
class Motor:
    """Two-axis model of a three-phase machine of about 380 kW, referred to the stator."""

    stator_resistance: float = 0.08  #: stator resistance per phase [ohm]
    rotor_resistance: float = 0.07  #: rotor resistance per phase, referred to the stator [ohm]
    stator_leakage: float = 1.2e-3  #: leakage inductance of the stator [H]
    rotor_leakage: float = 1.2e-3  #: leakage inductance of the rotor, referred to the stator [H]
    magnetizing: float = 22e-3  #: magnetizing inductance [H]
    pole_pairs: int = 2
    rated_voltage: float = 1100.0  #: peak phase voltage at the rated frequency [V]
    rated_frequency: float = 60.0  #: rated supply frequency [Hz]
    boost: float = 25.0  #: peak phase voltage at standstill [V]


def supply_voltage(motor: Motor, f: float) -> float:
    """Return the phase peak voltage at a supply frequency [V]; voltage / frequency is constant up to the rated one."""
    share = min(1.0, abs(f) / motor.rated_frequency)
    return motor.boost + (motor.rated_voltage - motor.boost) * share


def phasors(motor: Motor, order: float, voltage: complex, f: float, speed: float) -> tuple[complex, complex, complex]:
    """Return current and flux linkage of the stator, and flux linkage of the rotor, due to one supply component."""
    w, slip = 2 * np.pi * f * order, 2 * np.pi * f * order - motor.pole_pairs * speed
    L_m = motor.magnetizing
    L_s, L_r = motor.stator_leakage + L_m, motor.rotor_leakage + L_m
    Z = np.array(
        [
            [motor.stator_resistance + 1j * w * L_s, 1j * w * L_m],
            [1j * slip * L_m, motor.rotor_resistance + 1j * slip * L_r],
        ]
    )
    i_s, i_r = np.linalg.solve(Z, [voltage, 0.0])
    return complex(i_s), complex(L_s * i_s + L_m * i_r), complex(L_m * i_s + L_r * i_r)


def torque_lines(motor: Motor, harmonics: Sequence[Sequence[float]], f: float, speed: float) -> dict[int, float]:
    """Return the mean torque (key 0) and the amplitudes of its ripple, by multiple of the supply frequency [N m].

    Parameters
    ----------
    motor
        The motor.
    harmonics
        Order and amplitude (relative to the fundamental) of each harmonic.
    f
        Frequency of the supply [Hz].
    speed
        Speed of the rotor [rad/s].
    """
    U = supply_voltage(motor, f)
    parts = {1: phasors(motor, 1, U, f, speed)}
    for order, share in harmonics:
        parts[int(order)] = phasors(motor, order, U * share, f, speed)
    c: dict[int, complex] = {}
    for a, (_, psi_a, _) in parts.items():
        for b, (i_b, _, _) in parts.items():
            c[b - a] = c.get(b - a, 0.0) + psi_a.conjugate() * i_b
    factor = 1.5 * motor.pole_pairs
    lines = {0: factor * c[0].imag}
    return lines | {n: factor * abs(c[n] - c[-n].conjugate()) for n in sorted(c) if n > 0}


def ripple_of_leakage(motor: Motor, f: float, orders: tuple[int, int] = (5, 7)) -> float:
    """Return the usual estimate of the ripple at six times f for a six-step inverter [N m].

    If only the leakage limits the harmonics and the flux is U/w, the ripple is 3/2 p (U/w) (I_5 - I_7) with
    I_k = U/k / (k w L_leakage).
    """
    w, U = 2 * np.pi * f, supply_voltage(motor, f)
    leakage = motor.stator_leakage + motor.rotor_leakage
    I_5, I_7 = (U / k / (k * w * leakage) for k in orders)
    return float(1.5 * motor.pole_pairs * U / w * (I_5 - I_7))


def speed_of_torque(motor: Motor, f: float, torque: float) -> float:
    """Return the speed at which a sinusoidal supply gives a mean torque below the breakdown torque [rad/s]."""
    from scipy.optimize import brentq, minimize_scalar

    synchronous = 2 * np.pi * f / motor.pole_pairs

    def mean(speed: float) -> float:
        return torque_lines(motor, (), f, speed)[0]

    slip = 2 * np.pi * 10.0 / motor.pole_pairs
    breakdown = minimize_scalar(lambda s: -mean(synchronous - s), bounds=(0.0, slip), method="bounded").x
    return float(brentq(lambda s: mean(synchronous - s) - torque, 0.0, breakdown, xtol=1e-12)) * -1.0 + synchronous


def steady_fluxes(motor: Motor, f: float, speed: float) -> tuple[float, float, float, float]:
    """Return the flux linkages at theta = 0 for constant speed on the fundamental, in the form of the element [V s]."""
    _, psi_s, psi_r = phasors(motor, 1, supply_voltage(motor, f), f, speed)
    return psi_s.real, psi_s.imag, psi_r.real, psi_r.imag


def torque_over_speed(motor: Motor, f: float, speed: float, at: float) -> complex:
    """Return the torque change divided by a small oscillation of the speed, at a frequency [N m s].

    In axes that rotate with the field, fluxes are psi = psi_0 + x, with x separated into real and imaginary parts. The
    equations of small motions are dx/dt = A x + b dOmega, with b = j p psi_r0 from the rotor flux, and dT = c x. The
    result is c (2 pi j f' - A)^-1 b.
    """
    p, L_m = motor.pole_pairs, motor.magnetizing
    L = np.array([[motor.stator_leakage + L_m, L_m], [L_m, motor.rotor_leakage + L_m]])
    R = np.diag([motor.stator_resistance, motor.rotor_resistance])
    w = 2 * np.pi * f
    complex_A = -R @ np.linalg.inv(L) - 1j * np.diag([w, w - p * speed])
    i_s, psi_s, psi_r = phasors(motor, 1, supply_voltage(motor, f), f, speed)
    A = np.block([[complex_A.real, -complex_A.imag], [complex_A.imag, complex_A.real]])  # of [Re x, Im x]
    b = np.array([0, (1j * p * psi_r).real, 0, (1j * p * psi_r).imag])
    to_current = np.linalg.inv(L)[0]  # i_s = to_current @ psi
    # d Im(conj(psi_s) i_s) = Im(conj(x_s) i_s0 + conj(psi_s0) to_current x)
    by_real = (np.conj(psi_s) * to_current).imag + np.array([i_s.imag, 0.0])
    by_imag = (1j * np.conj(psi_s) * to_current).imag + np.array([-i_s.real, 0.0])
    c = 1.5 * p * np.concatenate([by_real, by_imag])
    return complex(c @ np.linalg.solve(2j * np.pi * at * np.eye(4) - A, b))
