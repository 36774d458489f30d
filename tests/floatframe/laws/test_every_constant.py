"""Every number of a law counts: one that is twice as large differs from the closed form of the law."""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from importlib import import_module
from pkgutil import iter_modules

import pytest
from numpy.testing import assert_array_equal

import floatframe.components
import floatframe.model
from fe_models.foundation.units import Quantity
from floatframe.components.aerodynamics import LiftingSurface
from floatframe.components.bearings import Bearing
from floatframe.components.cables import Cable
from floatframe.components.clearances import Backlash, BallWithPlay, HingeWithPlay
from floatframe.components.drives import AntiSkidBrake, DcMotor, InductionMotor, Pid, PidDrive, SpeedControl, TorqueMap
from floatframe.components.friction import BristleFriction
from floatframe.components.hydraulics import (
    Accumulator,
    CheckValve,
    Cylinder,
    DirectionalValve,
    Fluid,
    Node,
    OleoStrut,
    Orifice,
    Pipe,
    Pump,
    ReliefValve,
)
from floatframe.components.rails import ContactLaws, Pair, Track, WheelOnRail, Wheelset
from floatframe.components.rails.profile import Profile
from floatframe.components.wheels import BrushTyre, LinearTyre, MagicFormulaTyre
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements.registry import element_class
from tests.floatframe.laws import contacts, drives, hydraulics, others, rails
from tests.floatframe.laws.form import CLOSE, differences, expected, silent_numbers

FORMS = drives.FORMS | hydraulics.FORMS | contacts.FORMS | others.FORMS | rails.FORMS
CONTACT = {"exponent": 1.0, "damping": 0.0, "friction": 0.0, "friction_speed": 1e-3, "radius": 0.0}
TYRE = {"friction": 1.0, "damping": 0.0, "relaxation_x": 0.0, "relaxation_y": 0.0, "rolling_resistance": 0.0,
        "flattening": 1 / 3, "low_speed": 1.0, "settling_time": 0.02}  # fmt: skip
VALVE = {"cracking": 0.0, "discharge": 0.7, "leakage": 0.0}
#: what the pages and classes promise where a number is not given, in SI units
DEFAULTS = {
    AntiSkidBrake: {"reference_time": 0.02, "sensor_time": 5e-3, "time_constant": 0.02, "friction_speed": 0.5,
                    "speed": 0.0},
    Backlash: {"exponent": 1.0, "damping": 0.0},
    BallWithPlay: CONTACT,
    Bearing: {"damping": 0.0, "axial_stiffness": 0.0, "axial_damping": 0.0, "tilt_stiffness": 0.0, "tilt_damping": 0.0},
    BristleFriction: {"damping": 0.0, "viscous": 0.0, "elastic": 0.7, "speed": 0.0},
    BrushTyre: TYRE,
    Cable: {"damping": 0.0},
    DcMotor: {"ratio": 1.0, "friction": 0.0, "friction_speed": 1.0, "damping": 0.0, "current": 0.0},
    HingeWithPlay: CONTACT | {"length": 0.0, "axial_play": 0.0, "turn_stiffness": 0.0, "turn_damping": 0.0,
                              "turn_free": 0.0},
    InductionMotor: {"boost": 0.0, "ratio": 1.0, "damping": 0.0},
    LiftingSurface: {"zero_lift": 0.0, "most_lift": 1.5, "zero_drag": 0.0, "induced_drag": 0.0, "factor": 1.0},
    LinearTyre: TYRE | {"camber_stiffness": 0.0, "trail": 0.0},
    MagicFormulaTyre: {"settling_time": 0.02},
    OleoStrut: {"exponent": 1.3, "discharge": 0.9, "friction": 0.0, "friction_area": 0.0, "friction_speed": 0.01,
                "stop_damping": 0.0},
    PidDrive: {"time_constant": 0.0},
    SpeedControl: {"rate_time": 0.0, "speed": 0.0},
    TorqueMap: {"time_constant": 0.0, "ratio": 1.0},
    Wheelset: {"spin_inertia": 0.0, "spin": 0.0},
    WheelOnRail: {"spin_inertia": 0.0, "spin": 0.0},
    # parts of elements
    Accumulator: {"exponent": 1.4},
    CheckValve: VALVE,
    ContactLaws: {"friction": 0.3, "shear_modulus": 8.2e10, "poisson": 0.28, "smoothing": 2e-5, "damping": 0.0,
                  "low_speed": 0.05, "strips": 12},
    Cylinder: {"rod_area": 0.0, "head_dead_volume": 0.0, "rod_dead_volume": 0.0, "leakage": 0.0, "friction": 0.0,
               "friction_speed": 1e-3, "damping": 0.0, "stop_stiffness": 0.0, "stop_damping": 0.0},
    DirectionalValve: {"opening": 0.0, "time_constant": 0.0, "overlap": 0.0, "discharge": 0.7, "leakage": 0.0},
    Fluid: {"air": 0.0, "air_exponent": 1.4, "vapour_pressure": 0.0},
    Node: {"volume": 0.0},
    Orifice: {"discharge": 0.7},
    Pair: {"radius": 0.46, "running_circles": 1.5, "gauge": 1.435, "inclination": 1 / 40},
    Pid: {"ki": 0.0, "kd": 0.0, "integral": 0.0},
    Pipe: {"segments": 1, "friction_factor": 0.0, "flow": 0.0},
    Pump: {"leakage": 0.0, "drag": 0.0},
    ReliefValve: VALVE,
    Track: {"heading": 0.0},
}  # fmt: skip
NEEDED = {
    ("Cylinder", "rod_area"),
    ("Cylinder", "head_dead_volume"),
    ("Cylinder", "rod_dead_volume"),
    ("Pid", "ki"),
    ("Pid", "kd"),
    ("Node", "volume"),
    ("Track", "heading"),
}  #: by a part beside it, or where markers are placed


def kinds():
    """Return the names of all elements that there are."""
    return [
        f"{package}.{kind}" for wing in (floatframe.components, floatframe.model)
        for package in (each.name for each in iter_modules(wing.__path__))
        for kind in getattr(import_module(f"{wing.__name__}.{package}"), "ELEMENTS", {})
    ]  # fmt: skip


def numeric_defaults(cls):
    """Return the fields of a class that are a number where it is not given."""
    return {each.name for each in fields(cls) if type(each.default) in (int, float, Quantity)}


@pytest.mark.parametrize("name", FORMS)
def test_a_law_is_its_closed_form(name):
    form = FORMS[name]
    assert max(differences(form, form.law(), expected(form))) < CLOSE


@pytest.mark.parametrize("name", FORMS)
def test_no_constant_can_be_twice_as_large_unnoticed(name):
    assert set(silent_numbers(FORMS[name])) == FORMS[name].silent_places


def test_every_element_has_a_form():
    assert "wheels.linear-tyre" in kinds()
    assert {element_class(kind) for kind in kinds()} == {type(form.element) for form in FORMS.values()}


def test_every_part_of_an_element_with_defaults_is_listed():
    kinds_of_parts = {type(part) for form in FORMS.values() for part in parts_of(form.element)}
    assert {each for each in kinds_of_parts if numeric_defaults(each)} - {Marker, Profile} <= set(DEFAULTS)


def parts_of(part):
    """Yield a dataclass and all dataclasses in it."""
    if isinstance(part, tuple | list):
        for each in part:
            yield from parts_of(each)
    elif isinstance(part, Mapping):
        yield from parts_of(tuple(part.values()))
    elif is_dataclass(part) and not isinstance(part, type):
        yield part
        for each in fields(part):
            yield from parts_of(getattr(part, each.name))


@pytest.mark.parametrize("cls", DEFAULTS)
def test_a_number_that_is_not_given_is_the_one_of_the_page(cls):
    """Beside the closed forms, in which all numbers are given: the law without it is that with the number below."""
    assert numeric_defaults(cls) <= set(DEFAULTS[cls])
    for key, value in DEFAULTS[cls].items():
        made = 0
        for form in FORMS.values():
            laws = [law_with(form, cls, key, number) for number in (MISSING, value)]
            if laws[0] is not None:
                assert_array_equal(laws[0].data, laws[1].data, err_msg=key)
                assert laws[0].start == laws[1].start
                made += 1
        assert made > 0 or (cls.__name__, key) in NEEDED


def law_with(form, cls, key, value):
    """Return the law of a form where the part of that class has another number, or none; None if it cannot be."""
    element = with_number(form.element, cls, key, value)
    if element is form.element:
        return None
    try:
        return replace(form, element=element).law()
    except floatframe.errors.ModelError:
        return None


def with_number(part, cls, key, value):
    """Return a dataclass whose parts of a class have another number, or are made without it."""
    if isinstance(part, tuple | list):
        parts = [with_number(each, cls, key, value) for each in part]
        return part if all(a is b for a, b in zip(parts, part, strict=True)) else type(part)(parts)
    if isinstance(part, dict):
        return part
    if not is_dataclass(part) or isinstance(part, type):
        return part
    values = {each.name: getattr(part, each.name) for each in fields(part)}
    changed = {name: with_number(each, cls, key, value) for name, each in values.items()}
    is_meant = type(part) is cls
    if not is_meant and all(changed[name] is values[name] for name in values):
        return part
    if is_meant:
        changed.pop(key)
        if value is not MISSING:
            changed[key] = value
    try:
        return type(part)(**changed)
    except floatframe.errors.ModelError:
        return part
