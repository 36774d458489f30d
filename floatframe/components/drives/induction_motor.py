"""A three-phase induction motor on a shaft, with flux linkages of stator and rotor as states, in stator axes.

Space vectors a + j b (amplitude-invariant: their magnitude is the peak of the phase quantities) describe voltage u,
currents i and flux linkages psi. p is the number of pole pairs and omega the mechanical speed of the rotor. Rotor
currents and fluxes are referred to the stator:

    dpsi_s/dt = u - R_s i_s,    dpsi_r/dt = j p omega psi_r - R_r i_r,
    psi_s = L_s i_s + L_m i_r,  psi_r = L_m i_s + L_r i_r,    L_s = L_ls + L_m, L_r = L_lr + L_m,
    T = 3/2 p Im(conj(psi_s) i_s).

The input power 3/2 Re(u conj(i_s)) equals 3/2 (R_s |i_s|² + R_r |i_r|²) + T omega plus the rate of the magnetic energy
3/4 Re(psi_s conj(i_s) + psi_r conj(i_r)).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numba import njit

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.drives.shaft import Z_AXIS, check_shaft, required, shaft_numbers, time_functions
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.curves import function_at, function_integral_at, function_numbers
from floatframe.model.elements.pairs import add_torque, direction_of, turning_speed
from floatframe.model.elements.unit_names import outputs_in
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["InductionMotor"]

STATES = ("stator flux a", "stator flux b", "rotor flux a", "rotor flux b")
OUTPUTS = (
    ("torque", "N m"), ("speed", "rad/s"), ("slip", "1"), ("frequency", "Hz"), ("voltage", "V"), ("current", "A"),
    ("current 1", "A"), ("current 2", "A"), ("current 3", "A"), ("rotor current", "A"), ("power in", "W"),
    ("power lost", "W"), ("power out", "W"), ("energy", "J"),
)  # fmt: skip
FIRST_HARMONIC = 23


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class InductionMotor(Element):
    """Torque on marker b (rotor) relative to marker a (stator) about an axis, for a supply frequency and amplitude.

    The voltage is the peak value of a phase. Without it, the amplitude follows the frequency (V/f): boost +
    (rated_voltage - boost) |f|/rated_frequency, and rated_voltage above the rated frequency. With a negative frequency
    the field rotates backwards. `harmonics` are added to the supply, each as [order, amplitude relative to the
    fundamental]; a negative order rotates backwards. A six-step inverter has [-5, 1/5], [7, -1/7], [-11, -1/11], [13,
    1/13]; an unbalanced supply has the order -1.

    With a gear, the motor rotates `ratio` times as fast as b relative to a, and its torque on b is multiplied by
    `ratio`.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    stator_resistance: float  #: stator resistance R_s [ohm]
    rotor_resistance: float  #: rotor resistance R_r, referred to the stator [ohm]
    stator_leakage: float  #: leakage inductance L_ls of the stator [H]
    rotor_leakage: float  #: leakage inductance L_lr of the rotor, referred to the stator [H]
    magnetizing: float  #: magnetizing inductance L_m [H]
    pole_pairs: int
    frequency: TimeFunction | float  #: supply frequency as a function of time [Hz]
    #: peak phase voltage as a function of time [V]; None: from constant V/f
    voltage: TimeFunction | float | None = None
    rated_voltage: float | None = None  #: peak phase voltage at the rated frequency, for constant V/f [V]
    rated_frequency: float | None = None  #: rated frequency, for constant V/f [Hz]
    boost: float = 0.0  #: voltage amplitude at standstill, for constant V/f [V]
    harmonics: Sequence[Sequence[float]] = ()  #: order of each harmonic, and its amplitude relative to the fundamental
    axis: GivenArray = given(Z_AXIS)  #: axis in axes of marker a, (3,)
    ratio: float = 1.0  #: gear ratio, speed of the motor divided by the speed of b
    damping: float = 0.0  #: viscous damping of the motor: torque divided by speed [N m s]
    fluxes: Sequence[float] = (0.0, 0.0, 0.0, 0.0)  #: initial flux linkages of stator a, b and rotor a, b [V s]

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        check_shaft(self)
        required(
            self,
            above=("stator_resistance", "rotor_resistance", "magnetizing", "rated_voltage", "rated_frequency"),
            at_least=("stator_leakage", "rotor_leakage", "boost", "damping"),
            real=("ratio",),
        )
        if self.ratio == 0:
            raise ModelError(f"{where}: ratio: expected a number other than 0")
        if self.stator_leakage + self.rotor_leakage == 0:
            raise ModelError(f"{where}: stator_leakage: expected leakage above 0 of stator or rotor, got none")
        if not isinstance(self.pole_pairs, int) or self.pole_pairs < 1:
            raise ModelError(f"{where}: pole_pairs: expected 1, 2, 3, ..., got {self.pole_pairs!r}")
        time_functions(self, "frequency", "voltage")
        by_ratio = self.rated_voltage is not None and self.rated_frequency is not None
        if self.frequency is None or (self.voltage is None) != by_ratio:
            given = "both" if by_ratio else "neither: missing supply"
            raise ModelError(f"{where}: expected a voltage, or rated_voltage and rated_frequency for V/f, got {given}")
        table = np.array(self.harmonics, dtype=float).reshape(-1, 2) if len(self.harmonics) else np.zeros((0, 2))
        object.__setattr__(self, "harmonics", array_of_shape(f"{where}: harmonics", table, table.shape))
        object.__setattr__(self, "fluxes", array_of_shape(f"{where}: fluxes", self.fluxes, (4,)))

    def frequencies(self, t: Array) -> Array:
        """Return the highest supply frequency at times t, (n_t,), including harmonics [Hz]."""
        assert isinstance(self.frequency, TimeFunction)  # ensured by __post_init__
        orders = np.abs(np.asarray(self.harmonics)[:, 0])
        return np.abs(self.frequency.at(t)) * max([1.0, *orders])

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the motor."""
        L_s, L_r = self.stator_leakage + self.magnetizing, self.rotor_leakage + self.magnetizing
        data = [self.stator_resistance, self.rotor_resistance, L_s, L_r, self.magnetizing, self.pole_pairs, self.ratio]
        data += [self.damping, self.rated_voltage or 0.0, self.rated_frequency or 0.0, self.boost]
        harmonics = np.asarray(self.harmonics)
        assert isinstance(self.frequency, TimeFunction)  # ensured by __post_init__
        at_frequency = FIRST_HARMONIC + harmonics.size
        frequency = function_numbers(self.frequency)
        amplitude = [] if self.voltage is None else function_numbers(self.voltage)  # type: ignore[arg-type]
        at_amplitude = at_frequency + len(frequency) if amplitude else 0
        from_zero = function_integral_at(np.array(frequency), 0, 0.0)
        data += [
            *shaft_numbers(self.axis, placed)[:3],
            0,
            0,
            0,
            0,
            0,
            len(harmonics),
            at_frequency,
            at_amplitude,
            from_zero,
        ]
        data = [*data, *harmonics.ravel(), *frequency, *amplitude]
        return ElementLaw(
            function=induction_motor_law,
            data=data,
            states=STATES,
            start=self.fluxes,
            state_units=["V s"] * 4,
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("moment", "moment"),
            energy="energy",
            power_in="power in",
            power_lost="power lost",
        )


@njit
def induction_motor_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the torque of a motor, the rates of its fluxes, and its outputs; see the module docstring."""
    R_s, R_r, L_s, L_r, L_m, p, ratio = data[0], data[1], data[2], data[3], data[4], data[5], data[6]
    n_harmonics, at_frequency, at_amplitude = int(data[19]), int(data[20]), int(data[21])
    f = function_at(data, at_frequency, t)
    theta = 2.0 * pi * (function_integral_at(data, at_frequency, t) - data[22])
    if at_amplitude > 0:
        U = function_at(data, at_amplitude, t)
    else:
        U = data[10] + (data[8] - data[10]) * min(1.0, abs(f) / data[9])
    u_a, u_b = U * np.cos(theta), U * np.sin(theta)
    for k in range(n_harmonics):
        order, part = data[FIRST_HARMONIC + 2 * k], data[FIRST_HARMONIC + 2 * k + 1]
        u_a += U * part * np.cos(order * theta)
        u_b += U * part * np.sin(order * theta)
    e = direction_of(x, 0, data, 11)
    speed = turning_speed(x, 0, 1, e)
    omega = ratio * speed
    psi_sa, psi_sb, psi_ra, psi_rb = z[0], z[1], z[2], z[3]
    D = L_s * L_r - L_m * L_m
    i_sa, i_sb = (L_r * psi_sa - L_m * psi_ra) / D, (L_r * psi_sb - L_m * psi_rb) / D
    i_ra, i_rb = (L_s * psi_ra - L_m * psi_sa) / D, (L_s * psi_rb - L_m * psi_sb) / D
    z_dot[0], z_dot[1] = u_a - R_s * i_sa, u_b - R_s * i_sb
    z_dot[2], z_dot[3] = -R_r * i_ra - p * omega * psi_rb, -R_r * i_rb + p * omega * psi_ra
    air_gap = 1.5 * p * (psi_sa * i_sb - psi_sb * i_sa)
    torque = ratio * (air_gap - data[7] * omega)
    add_torque(wrench, 0, 1, torque, e)
    outputs[0], outputs[1], outputs[3], outputs[4] = torque, speed, f, U
    outputs[2] = 1.0 - p * omega / (2.0 * pi * f) if f != 0.0 else 0.0 * omega
    outputs[5] = np.sqrt(i_sa * i_sa + i_sb * i_sb)
    outputs[6] = i_sa
    outputs[7], outputs[8] = -0.5 * i_sa + np.sqrt(0.75) * i_sb, -0.5 * i_sa - np.sqrt(0.75) * i_sb
    outputs[9] = np.sqrt(i_ra * i_ra + i_rb * i_rb)
    outputs[10] = 1.5 * (u_a * i_sa + u_b * i_sb)
    heat = R_s * (i_sa * i_sa + i_sb * i_sb) + R_r * (i_ra * i_ra + i_rb * i_rb)
    outputs[11] = 1.5 * heat + data[7] * omega * omega
    outputs[12] = torque * speed
    outputs[13] = 0.75 * (psi_sa * i_sa + psi_sb * i_sb + psi_ra * i_ra + psi_rb * i_rb)
