"""A tyre with the Magic Formula, defined by a tyre property file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit
from numba.extending import register_jitable

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import UNIT_SYSTEMS, Dimensions, Units
from floatframe.components.wheels.coefficients import COEFFICIENTS, NEEDED_COMBINED
from floatframe.components.wheels.contact import (
    LOW_SPEED,
    RADIUS,
    SIGMA_X,
    SIGMA_Y,
    contact,
    grip_at,
    normal_force,
    put_wrenches,
    touching,
)
from floatframe.components.wheels.looks import tyre_looks
from floatframe.components.wheels.magic_formula import (
    ALPHA_HIGH,
    ALPHA_LOW,
    BREFF,
    C_LAT,
    C_LONG,
    C_VERTICAL,
    DP,
    DREFF,
    FREFF,
    GAMMA_HIGH,
    GAMMA_LOW,
    IS_61,
    KAPPA_HIGH,
    KAPPA_LOW,
    LFZO,
    LOAD,
    LOAD_HIGH,
    LOAD_LOW,
    LSGAL,
    LSGKP,
    PCFX1,
    PCFX2,
    PCFX3,
    PCFY1,
    PCFY2,
    PCFY3,
    PFZ1,
    PKY3,
    PTX1,
    PTX2,
    PTX3,
    PTY1,
    PTY2,
    QFZ1,
    QFZ2,
    QRE0,
    QV1,
    QV2,
    SIDE,
    SIGMA_FROM_FILE,
    SIGN,
    SPEED,
    forces_and_moments,
    peaks_and_stiffnesses,
)
from floatframe.components.wheels.numbers import tyre_law, tyre_numbers
from floatframe.components.wheels.outputs import show, show_energy
from floatframe.components.wheels.reading import Read, properties_of_table, tyre_of_table
from floatframe.components.wheels.roads.road import FlatRoad, Road
from floatframe.components.wheels.slip import direction, hold_tread, tread_slip
from floatframe.components.wheels.tyre_fields import SETTLING_TIME, check_road, landing_depth
from floatframe.components.wheels.tyre_file import TyreProperties
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.smooth import absolute
from floatframe.model.shapes import Arrow, MarkerShapes

__all__ = ["MagicFormulaTyre", "magic_formula_law", "magic_formula_law_at_rest"]


# the law of a tyre with the Magic Formula: contact, tread and validity ranges around the formula ----------------------


SHORTEST = 0.05  #: smallest relaxation length of a tyre with a small load, divided by its radius


@register_jitable(error_model="numpy")
def held(value, low, high):
    """Return a number clamped to a range, and 1 if it was outside (else 0)."""
    if value.real < low:
        return low + 0.0 * value, 1.0
    if value.real > high:
        return high + 0.0 * value, 1.0
    return value, 0.0


@register_jitable(error_model="numpy")
def relaxation(data, df, load, K_x, K_y, gamma):
    """Return the relaxation lengths along x and y [m].

    They are computed from the coefficients p_T if the file has them, otherwise as slip stiffness divided by the
    stiffness of the carcass. A value given for the element overrides both.
    """
    if data[SIGMA_FROM_FILE] == 0.0:
        return data[SIGMA_X] + 0.0 * load, data[SIGMA_Y] + 0.0 * load
    R_0, F_0, dp = data[RADIUS], data[LOAD], data[DP]
    if data[PTX1] != 0.0:
        x = load * (data[PTX1] + data[PTX2] * df) * np.exp(-data[PTX3] * df) * R_0 / F_0 * data[LSGKP]
    else:
        stiffness = data[C_LONG] * (1.0 + data[PCFX1] * df + data[PCFX2] * df * df) * (1.0 + data[PCFX3] * dp)
        x = absolute(K_x) / stiffness
    if data[PTY1] != 0.0:
        y = data[PTY1] * np.sin(2.0 * np.arctan(load / (data[PTY2] * F_0 * data[LFZO])))
        y = y * (1.0 - data[PKY3] * absolute(gamma)) * R_0 * data[LFZO] * data[LSGAL]
    else:
        stiffness = data[C_LAT] * (1.0 + data[PCFY1] * df + data[PCFY2] * df * df) * (1.0 + data[PCFY3] * dp)
        y = absolute(K_y) / stiffness
    least = SHORTEST * R_0
    return x if x.real > least else least + 0.0 * x, y if y.real > least else least + 0.0 * y


@njit(error_model="numpy")
def magic_formula_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write wrenches, rates and outputs of a tyre with the Magic Formula.

    (1) contact; R_free = R_0 (q_re0 + q_V1 (R_0 Omega/V_0)²), deflection d = R_free - rho
    (2) F_z = (1 + q_V2 R_0/V_0 |Omega|)(1 + p_Fz1 dp)(q_Fz1 d/R_0 + q_Fz2 (d/R_0)²) F_0 + damping
    (3) R_e = R_free - F_0/c_z (D_reff atan(B_reff F_z/F_0) + F_reff F_z/F_0); V_sx = V_x - R_e Omega
    (4) slips of the tread, clamped to the ranges of the file; below the range of the load, the forces at the lowest
        load are scaled in proportion
    (5) the formula, in signs and on the side of the file, converted to ISO axes
    """
    x_W, y_W, n, _, point, d, rho, sine, cosine, V_x, V_y, Omega, rate, left = contact(x, data)  # (1)
    zero = 0.0 * d
    R_0, F_0, V_0 = data[RADIUS], data[LOAD], data[SPEED]
    spin = R_0 * Omega / V_0
    R_free = R_0 * (data[QRE0] + data[QV1] * spin * spin)
    d = d + R_free - R_0
    is_down = d.real > 0.0
    landed = touching(data, d)
    stiffening = 1.0 + data[QV2] * absolute(spin)
    q = d / R_0
    spring = (1.0 + data[PFZ1] * data[DP]) * (data[QFZ1] * q + data[QFZ2] * q * q) * F_0  # (2)
    F_z = normal_force(data, d, landed, rate, cosine, stiffening * spring)
    f = F_z / F_0
    R_e = R_free - F_0 / data[C_VERTICAL] * (data[DREFF] * np.arctan(data[BREFF] * f) + data[FREFF] * f)  # (3)
    V_sx = V_x - R_e * Omega
    load, over = held(F_z, data[LOAD_LOW], data[LOAD_HIGH])  # (4)
    share = F_z / load if F_z.real < data[LOAD_LOW] else 1.0 + zero
    clamped = over if F_z.real > 0.0 else 0.0
    gamma, over = held(np.arctan(sine / cosine), data[GAMMA_LOW], data[GAMMA_HIGH])
    clamped += over
    side, sign = data[SIDE], data[SIGN]
    c = np.sin(gamma) if data[IS_61] > 0.0 else gamma
    grip = grip_at(x, data, point)
    df, mu_x, K_x, mu_y, K_y = peaks_and_stiffnesses(data, load, side * c, grip)
    sigma = relaxation(data, df, load, K_x, K_y, gamma)
    scale = 3.0 * mu_x * load / absolute(K_x), 3.0 * mu_y * load / absolute(K_y)
    kappa, tangent = tread_slip(data, sigma, scale, z, z_dot, V_x, V_sx, V_y, landed)
    kappa_held, over = held(kappa, data[KAPPA_LOW], data[KAPPA_HIGH])
    clamped += over
    alpha_held, over = held(np.arctan(tangent), data[ALPHA_LOW], data[ALPHA_HIGH])
    clamped += over
    F = zero, zero, F_z  # (5)
    M = zero, zero, zero
    if F_z.real > 0.0:
        forward = direction(V_x, data[LOW_SPEED])
        F_x, F_y, M_x, M_y, M_z = forces_and_moments(
            data, load, kappa_held, side * alpha_held, side * gamma, R_0, V_x, forward, absolute(forward), grip
        )
        turning = direction(R_0 * Omega, data[LOW_SPEED])
        F = share * F_x, sign * side * share * F_y, F_z
        M = side * share * M_x, -share * M_y * turning, sign * side * share * M_z
    power = put_wrenches(x, wrench, (x_W, y_W, n, point), F, M)
    energy, rising = zero, zero
    if is_down:
        energy = (1.0 + data[PFZ1] * data[DP]) * (data[QFZ1] / 2.0 + data[QFZ2] * q / 3.0) * q * d * F_0
        rising = spring * rate
    show(outputs, F, M, (kappa, tangent, sine), (d, rho), (V_x, V_sx, V_y), point)
    show_energy(outputs, energy, -power - rising, left, clamped + zero)


@njit(error_model="numpy")
def magic_formula_law_at_rest(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the results for a standing wheel, whose tread is deformed by the displacement of the wheel."""
    magic_formula_law(t, x, z, lam, data, wrench, z_dot, g, outputs)
    hold_tread(x, data, outputs[10], z, z_dot)


# magic formula tyre ---------------------------------------------------------------------------------------------------


CONVENTIONS = {"iso": 1.0, "adapted-sae": -1.0}
SIDES = ("left", "right")
#: ranges of the inputs if the file gives none
WIDEST = {"kappa": (-1.5, 1.5), "alpha": (-1.5, 1.5), "gamma": (-1.0, 1.0)}
LOADS = 1e-3, 1e3  #: range of the load, relative to the nominal load, if the file gives none
SI = UNIT_SYSTEMS["m-kg-s"]
LENGTH, FORCE, SPEED_DIMENSIONS = (
    Dimensions(length=1),
    Dimensions(mass=1, length=1, time=-2),
    Dimensions(length=1, time=-1),
)
STIFFNESS, DAMPING = Dimensions(mass=1, time=-2), Dimensions(mass=1, time=-1)
PRESSURE = Dimensions(mass=1, length=-1, time=-2)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class MagicFormulaTyre(Element):
    """A tyre with the Magic Formula 5.2 or 6.1: combined slip, relaxation and standstill, without turn slip.

    Marker A lies on the road, with z up. Marker B is at the wheel centre, on the spinning body. The values of the file
    are converted to units of the system; the fields here are in units of the system. Axes, signs and formulas:
    docs/wheels.md.
    """

    name: str
    marker_a: Marker  #: marker on the road: z up, x along the road
    marker_b: Marker  #: marker at the wheel centre, on the spinning body
    tyre: TyreProperties  #: tyre properties from `read_tyre_file`
    convention: str = "iso"  #: sign convention of the file: "iso" (W axes of ISO 8855, as TYDEX) or "adapted-sae"
    side: str | None = None  #: mounted side, "left" or "right"; the tyre is mirrored if the file is for the other side
    pressure: float | None = None  #: inflation pressure; None: that of the file
    is_combined: bool | None = None  #: whether slip is combined; None: according to USE_MODE of the file
    #: relaxation lengths; None: from the file; 0: none, so that the wheel creeps at a standstill
    relaxation_x: float | None = None
    relaxation_y: float | None = None
    low_speed: float | None = (
        None  #: speed below which the wheel is treated as nearly standing; None: VXLOW of the file, or 1 m/s
    )
    settling_time: float = SETTLING_TIME  #: settling time tau of the damped tread at a standstill [s]
    landing_depth: float | None = None  #: deflection over which damping and tread forces build up; None: radius/500
    #: spin axis, pointing left, in axes of marker B
    axis: GivenArray = given((0.0, 1.0, 0.0))
    road: Road = field(default_factory=FlatRoad)  #: road in axes of marker A

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        if not isinstance(self.tyre, TyreProperties):
            raise ModelError(f"{where}: tyre: expected the result of read_tyre_file, got {self.tyre!r}")
        if self.convention not in CONVENTIONS:
            raise ModelError(f"{where}: convention: expected one of {', '.join(CONVENTIONS)}, got {self.convention!r}")
        if self.side is not None and self.side not in SIDES:
            raise ModelError(f"{where}: side: expected one of {', '.join(SIDES)}, got {self.side!r}")
        if self.tyre.cornering_stiffness * CONVENTIONS[self.convention] > 0:
            other = next(name for name in CONVENTIONS if name != self.convention)
            raise ModelError(
                f"{where}: convention: {self.tyre.source} has PKY1 = {self.tyre.coefficients['PKY1']:g}, which means a "
                f"side force along positive slip angles, contrary to {self.convention!r}; is it a file of {other!r}?"
            )
        if (self.relaxation_x is None) != (self.relaxation_y is None):
            raise ModelError(
                f"{where}: expected both relaxation_x and relaxation_y, or neither to use the values of the tyre file"
            )
        for key in ("settling_time", "relaxation_x", "relaxation_y"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), at_least=0.0))
        for key in ("pressure", "low_speed", "landing_depth"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), above=0.0))
        object.__setattr__(self, "axis", unit_vector(f"{where}: axis", self.axis))
        self._combined(where)

    def _combined(self, where: str) -> bool:
        """Return whether slip is combined; `ModelError` if the file does not state it, or lacks coefficients for it."""
        is_combined = self.tyre.is_combined if self.is_combined is None else self.is_combined
        lacking = [key for key in NEEDED_COMBINED if self.tyre.coefficients[key] == 0.0]
        if is_combined is None:
            raise ModelError(
                f"{where}: is_combined: {self.tyre.source} has no USE_MODE of 3 (pure slip) or 4 (combined "
                "slip); give is_combined"
            )
        if is_combined and lacking:
            raise ModelError(
                f"{where}: combined slip needs {', '.join(lacking)}, missing in {self.tyre.source}; "
                "choose is_combined=False for forces of pure slip"
            )
        return is_combined

    @classmethod
    def from_table(cls, name: str, table: Mapping[str, Any], read: Read) -> "MagicFormulaTyre":
        """Return the tyre of [elements.NAME]; its file is `file` or `shipped`, with `version` if the file lacks it."""
        values = dict(table)
        return tyre_of_table(name, values, read, cls, tyre=properties_of_table(values, read))

    def drawn(self) -> tuple[MarkerShapes | Arrow, ...]:
        """Return the drawn wheel, road and force."""
        return tyre_looks(self.tyre.radius, self.axis, self.road, width=self.tyre.width, is_in_metres=True)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the element law for the markers in the assembled position, in units of the system."""
        where = f"element {self.name!r}"
        units, tyre, p = placed.units, self.tyre, self.tyre.coefficients
        radius = tyre.radius * LENGTH.factor(SI, units)
        check_road(where, self.road, radius)
        load, stiffness = tyre.load * FORCE.factor(SI, units), tyre.stiffness * STIFFNESS.factor(SI, units)
        low_speed = self.low_speed or (tyre.low_speed or 1.0) * SPEED_DIMENSIONS.factor(SI, units)
        is_from_file = self.relaxation_x is None or self.relaxation_y is None
        sigma = (radius, radius) if is_from_file else (self.relaxation_x or 0.0, self.relaxation_y or 0.0)
        common = [radius, stiffness, tyre.damping * DAMPING.factor(SI, units)]
        common += [landing_depth(self.landing_depth, radius)]
        common += [low_speed, self.settling_time, *sigma]
        quarter = (stiffness * radius / load) ** 2 - 4 * p["QFZ2"]
        if quarter < 0:
            raise ModelError(f"{where}: QFZ2 = {p['QFZ2']:g} of {tyre.source} does not fit its vertical stiffness")
        formula = dict(p) | {"QFZ1": p["QFZ1"] or float(np.sqrt(quarter))}
        relative = self._relative_pressure(where, units)
        own = [float(tyre.version == 61), float(self._combined(where)), relative - 1.0, relative, load]
        own += [tyre.speed * SPEED_DIMENSIONS.factor(SI, units), CONVENTIONS[self.convention], self._side()]
        for name, widest in WIDEST.items():
            own += tyre.ranges.get(name, widest)
        loads = tyre.ranges.get("load", (LOADS[0] * tyre.load, LOADS[1] * tyre.load))
        own += [max(loads[0], LOADS[0] * tyre.load) * FORCE.factor(SI, units), loads[1] * FORCE.factor(SI, units)]
        own += [
            stiffness * (1 + p["PFZ1"] * (relative - 1.0)),
            float(is_from_file),
            *self._carcass(where, units, is_from_file),
        ]
        own += [formula[key] for key in COEFFICIENTS]
        data = tyre_numbers(where, placed, common, self.axis, own, self.road)
        return tyre_law(magic_formula_law, magic_formula_law_at_rest, data, placed, sigma)

    def _side(self) -> float:
        """Return -1 for a tyre on the side opposite to that of the file, else 1."""
        return -1.0 if self.side is not None and self.tyre.side in SIDES and self.side != self.tyre.side else 1.0

    def _carcass(self, where: str, units: Units, is_from_file: bool) -> list[float]:
        """Return carcass stiffnesses for the relaxation lengths; `ModelError` if the file lacks them."""
        found = []
        for key, name, stiffness in (
            ("PTX1", "LONGITUDINAL_STIFFNESS", self.tyre.carcass[0]),
            ("PTY1", "LATERAL_STIFFNESS", self.tyre.carcass[1]),
        ):
            if is_from_file and self.tyre.coefficients[key] == 0.0 and not stiffness:
                raise ModelError(
                    f"{where}: relaxation lengths: {self.tyre.source} has neither {key} nor {name}; "
                    "give relaxation_x and relaxation_y (0 for none)"
                )
            found.append((stiffness or 1.0) * STIFFNESS.factor(SI, units))
        return found

    def _relative_pressure(self, where: str, units: Units) -> float:
        """Return the pressure divided by the nominal pressure; `ModelError` if it is out of the range of the file."""
        tyre = self.tyre
        if self.pressure is not None:
            pressure = self.pressure * PRESSURE.factor(units, SI)
        else:
            pressure = tyre.pressure or tyre.nominal_pressure or 1.0
        if tyre.nominal_pressure is None:
            if self.pressure is not None:
                raise ModelError(
                    f"{where}: pressure: {tyre.source} has no NOMPRES, so its forces do not depend on the pressure"
                )
            return 1.0
        low, high = tyre.ranges.get("pressure", (0.0, np.inf))
        if not low <= pressure <= high:
            raise ModelError(
                f"{where}: pressure: expected {low:g} to {high:g} Pa, the range of {tyre.source}, got {pressure:g} Pa"
            )
        return pressure / tyre.nominal_pressure
