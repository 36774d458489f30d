"""A tyre with the Magic Formula, defined by a tyre property file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import TIME, UNIT_SYSTEMS, Dimensions, Quantity, Units
from floatframe.components.wheels.coefficients import COEFFICIENTS, NEEDED_COMBINED
from floatframe.components.wheels.looks import tyre_looks
from floatframe.components.wheels.magic_formula_law import magic_formula_law, magic_formula_law_at_rest
from floatframe.components.wheels.numbers import tyre_law, tyre_numbers
from floatframe.components.wheels.reading import Read, properties_of_table, tyre_of_table
from floatframe.components.wheels.roads.road import FlatRoad, Road
from floatframe.components.wheels.tyre_fields import check_road, landing_depth
from floatframe.components.wheels.tyre_file import TyreProperties
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.shapes import Arrow, Drawn

__all__ = ["MagicFormulaTyre"]

SETTLING_TIME = Quantity(0.02, TIME)

CONVENTIONS = {"iso": 1.0, "adapted-sae": -1.0}
SIDES = ("left", "right")
WIDEST = {"kappa": (-1.5, 1.5), "alpha": (-1.5, 1.5), "gamma": (-1.0, 1.0)}  #: ranges if the file gives none
LOADS = 1e-3, 1e3  #: the same for the load, relative to the nominal load
SI = UNIT_SYSTEMS["m-kg-s"]
LENGTH, FORCE, SPEED = Dimensions(length=1), Dimensions(mass=1, length=1, time=-2), Dimensions(length=1, time=-1)
STIFFNESS, DAMPING = Dimensions(mass=1, time=-2), Dimensions(mass=1, time=-1)
PRESSURE = Dimensions(mass=1, length=-1, time=-2)


@frozen_copies
@dataclass(frozen=True, eq=False)
class MagicFormulaTyre(Element):
    """A tyre with the Magic Formula 5.2 or 6.1: combined slip, relaxation and standstill, without turn slip.

    Marker A lies on the road, with z up. Marker B is at the wheel centre, on the spinning body. The values of the file
    are converted to units of the system; the fields here are in units of the system. Axes, signs and formulas:
    docs/wheels.md.
    """

    name: str
    marker_a: Marker  #: on the road: z up, x along the road
    marker_b: Marker  #: at the wheel centre, on the spinning body
    tyre: TyreProperties  #: from `read_tyre_file`
    convention: str = "iso"  #: sign convention of the file: "iso" (W axes of ISO 8855, as TYDEX) or "adapted-sae"
    side: str | None = None  #: mounted side, "left" or "right"; the tyre is mirrored if the file is for the other side
    pressure: float | None = None  #: inflation pressure; None: that of the file
    is_combined: bool | None = None  #: whether slip is combined; None: according to USE_MODE of the file
    #: relaxation lengths; None: from the file; 0: none, so that it creeps at a standstill
    relaxation_x: float | None = None
    relaxation_y: float | None = None
    low_speed: float | None = (
        None  #: speed below which the wheel is treated as nearly standing; None: VXLOW of the file, or 1 m/s
    )
    settling_time: float = SETTLING_TIME  #: tau, settling time of the damped tread at a standstill [s]
    landing_depth: float | None = None  #: deflection over which damping and tread forces build up; None: radius/500
    #: spin axis, pointing left, in axes of marker B
    axis: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    road: Road = field(default_factory=FlatRoad)  #: in axes of marker A

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        if not isinstance(self.tyre, TyreProperties):
            raise ModelError(f"{where}: tyre: expected what read_tyre_file returns, got {self.tyre!r}")
        if self.convention not in CONVENTIONS:
            raise ModelError(f"{where}: convention: expected one of {', '.join(CONVENTIONS)}, got {self.convention!r}")
        if self.side is not None and self.side not in SIDES:
            raise ModelError(f"{where}: side: expected one of {', '.join(SIDES)}, got {self.side!r}")
        if self.tyre.cornering_stiffness * CONVENTIONS[self.convention] > 0:
            other = next(name for name in CONVENTIONS if name != self.convention)
            raise ModelError(
                f"{where}: convention: {self.tyre.source} has PKY1 = {self.tyre.coefficients['PKY1']:g}, a side force "
                f"along positive slip angles that {self.convention!r} forbids; is it a file of {other!r}?"
            )
        if (self.relaxation_x is None) != (self.relaxation_y is None):
            raise ModelError(f"{where}: expected relaxation_x and relaxation_y, or neither (then the file's)")
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

    def drawn(self) -> tuple[Drawn | Arrow, ...]:
        """Return the drawn wheel, road and force."""
        return tyre_looks(self.tyre.radius, self.axis, self.road, width=self.tyre.width, is_in_metres=True)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the element law for the markers in the assembled configuration, in units of the system."""
        where = f"element {self.name!r}"
        units, tyre, p = placed.units, self.tyre, self.tyre.coefficients
        radius = tyre.radius * LENGTH.factor(SI, units)
        check_road(where, self.road, radius)
        load, stiffness = tyre.load * FORCE.factor(SI, units), tyre.stiffness * STIFFNESS.factor(SI, units)
        low_speed = self.low_speed or (tyre.low_speed or 1.0) * SPEED.factor(SI, units)
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
        own += [tyre.speed * SPEED.factor(SI, units), CONVENTIONS[self.convention], self._side()]
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
