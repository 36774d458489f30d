"""Sections of joints and forces of a system file."""

from typing import Annotated, Any, cast

import numpy as np
from pydantic import Field

from fe_models.foundation.toml_file import Table
from fe_models.foundation.units import Quantity
from floatframe.errors import ModelError
from floatframe.files.system_file.coordinate_section import CoordinateSection
from floatframe.files.system_file.described import (
    KEYS,
    AcceptedTable,
    DescribedSection,
    Either,
    FunctionTable,
    ObjectOf,
    OneOf,
    Signals,
    python_value,
)
from floatframe.files.system_file.motion_section import require_quantity
from floatframe.model.forces import FORCES, Force, PointForce
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import JOINTS, Joint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler, Limits

__all__ = ["CouplerSection", "ForceSection", "JointSection", "coupler_of", "force_of", "joint_of"]


# tables of the system file for joints and couplers: [joints.NAME], [couplers.NAME] ------------------------------------


#: joints by the names that other programs give them
ELSEWHERE = {
    "hinge": "revolute", "pin": "revolute", "continuous": "revolute", "translational": "prismatic",
    "translation": "prismatic", "slider": "prismatic", "slide": "prismatic", "ball": "spherical", "point": "spherical",
    "weld": "fixed", "rigid": "fixed", "bracket": "fixed", "cardan": "universal", "hooke": "universal",
    "homokinetic": "constant-velocity", "helical": "screw", "inline": "point-on-line", "inplane": "point-on-plane",
}  # fmt: skip


#: [joints.NAME]: a joint between two bodies; a file states the directions and lengths of a joint
JointSection = Annotated[
    DescribedSection, OneOf(JOINTS, "joints.NAME", "joint", ELSEWHERE, stated=(np.ndarray, Quantity))
]


class TermSection(CoordinateSection):
    """[[couplers.NAME.terms]]: a coordinate and its coefficient."""

    factor: float = Field(description="a number other than 0, the coefficient of the coordinate")


#: [couplers.NAME.limits]: stops of a linear combination of coordinates
LimitsSection = Annotated[AcceptedTable, ObjectOf(Limits, "couplers.NAME.limits")]
NumberOrFunction = Annotated[Any, Either((KEYS[float], KEYS[TimeFunction]))]


class CouplerSection(Table):
    """[couplers.NAME]: a linear relation between coordinates."""

    terms: list[TermSection] = Field(description="tables [[couplers.NAME.terms]], coordinates with factors")
    constant: NumberOrFunction | None = Field(
        None, description="a number, or a function of time; default: as placed, or as caught by an event"
    )
    engaged: bool = Field(True, description="false: no force until an event switches it on (latch, clutch, brake)")
    limits: LimitsSection | None = Field(None, description="stops: it acts only while the sum is at one of them")


def joint_of(name: str, section: DescribedSection, signals: Signals = None) -> Joint:
    """Return the joint of a table; `signals` are those of the system file, by name."""
    for coordinate, table in (getattr(section, "motions", None) or {}).items():
        expected = ("angle",) if coordinate.startswith("angle") else ("length",)
        if isinstance(table, FunctionTable):
            require_quantity(f"joints.{name}.motions.{coordinate}", table, signals, expected)
    return cast(Joint, section.object_named(name, signals))


def coupler_of(name: str, section: CouplerSection, signals: Signals = None) -> CoordinateCoupler:
    """Return the coupler of a table."""
    terms = [(term.found(), term.factor) for term in section.terms]
    return CoordinateCoupler(
        name,
        terms,
        python_value(section.constant, signals),
        section.engaged,
        None if section.limits is None else section.limits.object_named(),
    )


# tables of the system file for forces: [forces.NAME] ------------------------------------------------------------------


#: [forces.NAME]: a force element
ForceSection = Annotated[DescribedSection, OneOf(FORCES, "forces.NAME", "force")]


def force_of(name: str, section: DescribedSection, signals: Signals = None) -> Force:
    """Return the force of a table; `signals` are those of the system file, by name."""
    motor, law, laws = (getattr(section, key, None) for key in ("motor", "characteristic", "characteristics"))
    if isinstance(motor, FunctionTable):
        require_quantity(f"forces.{name}.motor", motor, signals, ("force", "moment", "number"))
    for key, table in {
        "characteristic": law,
        **{f"characteristics.{key}": each for key, each in (laws or {}).items()},
    }.items():
        if isinstance(table, FunctionTable) and any(True for _ in table.signals()):
            raise ModelError(f"forces.{name}.{key}: a function of a deformation, expected no signal over time")
    if section.described is PointForce and not {"force", "torque"} & section.model_fields_set:
        raise ModelError(f"forces.{name}: expected force or torque or both, got neither")
    return cast(Force, section.object_named(name, signals))
