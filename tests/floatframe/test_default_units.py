"""Defaults with units are the same quantities in every system of units."""

import importlib
import inspect
import pickle
import pkgutil
import re
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.foundation.units import LENGTH, RATE, SPEED, TIME, Dimensions, Quantity, unit_system
from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.components import clearances, drives, hydraulics, wheels
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.records import leaves
from floatframe.forces import SphereContact
from floatframe.joints import ConstantOrientation, RollingDisc, ScrewJoint

UNITS = ("m-kg-s", "mm-t-s", "mm-kg-ms", "in-slinch-s")
A, B = Marker(GROUND, position=(0.0, 0.0, 0.0)), Marker("b", position=(0.0, 0.0, 0.0))
SI = unit_system("m-kg-s")
MF = wheels.read_tyre_file(wheels.shipped_tyre("passenger_car_61"))
OIL = hydraulics.Fluid(density=870.0, bulk_modulus=1.4e9, ambient=1e5)


def rail(force):
    return {"joints": [PrismaticJoint("j", A, B)], "forces": [force]}


def hinge(force):
    return {"joints": [RevoluteJoint("j", A, B)], "forces": [force]}


def elements(make):
    return lambda **given: {"elements": [make(**given)]}


def tyre(kind, **numbers):
    return elements(lambda **given: kind("t", A, B, radius=0.3, stiffness=2e5, relaxation_x=0.2, relaxation_y=0.4,
                                         **numbers, **given))  # fmt: skip


def cylinder(**given):
    part = hydraulics.Cylinder(
        "c", A, B, head_area=1e-3, head="p", stroke=1.0, retracted_length=0.1, head_dead_volume=1e-4, friction=3.0,
        **given,
    )  # fmt: skip
    return {"elements": [hydraulics.Circuit("k", OIL, [part, hydraulics.Supply("s", "p", pressure=2e5)])]}


#: each class with a default that has a unit, its defaults and their SI values
CASES = {
    "joint force on a rail": (
        lambda **given: rail(JointForce("f", "j", "distance", friction=2.0, **given)), {"friction_speed": (1e-3, SPEED)}
    ),
    "joint force on a hinge": (
        lambda **given: hinge(JointForce("f", "j", "angle", friction=2.0, **given)), {"friction_speed": (1e-3, RATE)}
    ),
    "sphere contact": (
        lambda **given: {"forces": [SphereContact("f", A, B, radius_b=0.1, stiffness=1e5, friction=0.2, **given)]},
        {"friction_speed": (1e-3, SPEED), "slow": (1e-3, SPEED)},
    ),
    "screw": (lambda **given: {"joints": [ScrewJoint("j", A, B, **given)]}, {"lead": (1.0, LENGTH)}),
    "rolling disc": (lambda **given: {"joints": [RollingDisc("j", A, B, **given)]}, {"radius": (1.0, LENGTH)}),
    "linear tyre": (
        tyre(wheels.LinearTyre, slip_stiffness=8e4, cornering_stiffness=6e4),
        {"low_speed": (1.0, SPEED), "settling_time": (0.02, TIME)},
    ),
    "brush tyre": (
        tyre(wheels.BrushTyre, nominal_load=3e3, slip_stiffness=8e4, contact_length=0.1),
        {"low_speed": (1.0, SPEED), "settling_time": (0.02, TIME)},
    ),
    "magic formula tyre": (
        elements(lambda **given: wheels.MagicFormulaTyre("t", A, B, MF, **given)),
        {"settling_time": (0.02, TIME)},
    ),
    "ball": (
        elements(lambda **given: clearances.BallWithPlay("e", A, B, play=1e-4, stiffness=1e6, friction=0.1, **given)),
        {"friction_speed": (1e-3, SPEED)},
    ),
    "hinge": (
        elements(lambda **given: clearances.HingeWithPlay("e", A, B, radial_play=1e-4, stiffness=1e6, **given)),
        {"friction_speed": (1e-3, SPEED)},
    ),
    "cylinder": (cylinder, {"friction_speed": (1e-3, SPEED)}),
    "oleo strut": (
        elements(lambda **given: hydraulics.OleoStrut(
            "e", A, B, OIL, gas_volume=1e-3, charge=1e6, gas_area=1e-3, oil_area=1e-3, area=1e-5, stroke=0.5,
            extended_length=0.1, stop_stiffness=1e6, friction=3.0, **given)),
        {"friction_speed": (0.01, SPEED)},
    ),
    "dc motor": (
        elements(lambda **given: drives.DcMotor("m", A, B, resistance=1.0, inductance=1e-3, constant=0.1, voltage=3.0,
                                                friction=0.1, **given)),
        {"friction_speed": (1.0, RATE)},
    ),
    "anti-skid brake": (
        elements(lambda **given: drives.AntiSkidBrake(
            "m", A, B, pressure=1e5, gain=1e-3, build_rate=1e6, release_rate=1e6, radius=0.3, slip=0.1, slip_band=0.05,
            reference_deceleration=8.0, drop_out=2.0, **given)),
        {"reference_time": (0.02, TIME), "sensor_time": (5e-3, TIME), "time_constant": (0.02, TIME),
         "friction_speed": (0.5, RATE)},
    ),
}  # fmt: skip


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(("make", "defaults"), CASES.values(), ids=CASES)
def test_a_compiled_default_is_the_quantity_given_in_units(make, defaults, units):
    """Every number of the compiled system, beside that with the defaults given by hand in its units."""
    u = unit_system(units)
    given = {
        name: value * u.length**-d.length * u.mass**-d.mass * u.time**-d.time for name, (value, d) in defaults.items()
    }
    body = RigidBody("b", 2.0, np.diag([1.0, 2.0, 2.5]), position=(0, 0, 0.3))
    own, by_hand = (compiled_system(System([body], units=u, **make(**each))).model for each in ({}, given))
    addresses = ("laws.address", "laws.tangent")
    for (name, found), (_, expected) in zip(leaves(own), leaves(by_hand), strict=True):
        if name not in addresses:
            assert_allclose(found, expected, rtol=1e-14, atol=0, err_msg=name)
    doubled = compiled_system(System([body], units=u, **make(**{k: 2 * v for k, v in given.items()}))).model
    numbers = zip(leaves(own), leaves(doubled), strict=True)
    assert any(not np.array_equal(a, b) for (name, a), (_, b) in numbers if name not in addresses)


#: rails refuse other units by name
OF_SI_ALONE = ("floatframe.components.rails", "floatframe.machines")
UNIT = re.compile(r"\[([^\]]*)\]")


def described(kind):
    """Yield name, default and description of fields that have a number as default.

    The description stands under Parameters in the docstring, or in a comment at the field.
    """
    source, text = inspect.getsource(kind), inspect.getdoc(kind) or ""
    for each in fields(kind):
        if isinstance(each.default, float) and each.default != 0.0:
            words = re.search(rf"^{each.name}\n((?:    .*\n?)+)", text, re.MULTILINE)
            line = re.search(rf"^((?:    #: .*\n)*)    {each.name}:(.*)$", source, re.MULTILINE)
            above, beside = line.groups() if line else ("", "")
            yield each.name, each.default, words.group(1) if words else beside if "#:" in beside else above


def parts():
    import floatframe

    for info in pkgutil.walk_packages(floatframe.__path__, "floatframe."):
        rooms = ("forces", "elements", "drives", "wheels", "clearances", "hydraulics", "aerodynamics", "bearings",
                 "cables", "friction", "joints", "flexible_parts", "rails")  # fmt: skip
        if set(info.name.split(".")[2:3]) & set(rooms) and not info.name.startswith(OF_SI_ALONE):
            module = importlib.import_module(info.name)
            for kind in list(vars(module).values()):
                if inspect.isclass(kind) and is_dataclass(kind) and kind.__module__ == info.name:
                    yield kind


def test_no_default_with_a_unit_is_a_plain_number():
    """The description of a field states its unit in brackets: [m/s]."""
    n_found = 0
    for kind in parts():
        for name, default, line in described(kind):
            unit = UNIT.findall(line)
            if unit and unit[-1] not in ("1", "rad", "-"):
                assert isinstance(default, Quantity), f"{kind.__module__}.{kind.__name__}.{name} = {default} {unit}"
                n_found += 1
    assert n_found >= 19


def test_what_is_given_stays_as_it_is():
    """Also where it has the number of the default."""
    force = JointForce("f", "j", "distance", friction=2.0, friction_speed=1e-3)
    system = System([RigidBody("b", 1.0, np.eye(3))], units=unit_system("mm-t-s"), **rail(force))
    assert system.forces[0] is force
    default = System([RigidBody("b", 1.0, np.eye(3))], units=unit_system("mm-t-s"),
                     **rail(JointForce("f", "j", "distance", friction=2.0)))  # fmt: skip
    assert default.forces[0].friction_speed == 1.0


def test_a_quantity_is_a_number_that_can_be_copied():
    speed = Quantity(2.0, Dimensions(length=1, time=-1))
    again = pickle.loads(pickle.dumps(speed))
    assert again == 2.0
    assert again.dimensions == speed.dimensions
    assert_allclose(speed.in_units(unit_system("in-slinch-s")), 2.0 / 0.0254, rtol=1e-15)
    assert speed.in_units(unit_system("mm-kg-ms"), of_angle=True) == 2e-3
    assert_array_equal(np.array([speed]), [2.0])


def pushed_tyre(units):
    """The way of a wheel on a carriage that is pushed sideways from a standstill [m]."""
    u = unit_system(units)
    length, mass, time = 1 / u.length, 1 / u.mass, 1 / u.time
    force = mass * length / time**2
    z = (0.3 - 300 * 9.81 / 2e5) * length
    body = RigidBody("b", 300 * mass, 1e2 * mass * length**2 * np.eye(3), position=(0, 0, z))
    wheel = wheels.LinearTyre(
        "t", A, B, radius=0.3 * length, stiffness=2e5 * force / length, slip_stiffness=8e4 * force,
        cornering_stiffness=6e4 * force, relaxation_x=0.2 * length, relaxation_y=0.4 * length,
        damping=500 * force * time / length,
    )  # fmt: skip
    forces = [Gravity((0, 0, -9.81 * length / time**2)), PointForce("side", B, force=(0, 500 * force, 0))]
    system = System([body], [ConstantOrientation("o", A, B)], forces, units=u, elements=[wheel])
    return integrate(system, GeneralizedAlpha(0.8), 0.6 * time, 4e-3 * time).body("b").r[:, 1] / length


def test_a_tyre_with_defaults_moves_alike_in_all_units():
    exact = pushed_tyre("m-kg-s")
    assert exact.max() > 2e-3
    for units in UNITS[1:]:
        assert_allclose(pushed_tyre(units), exact, rtol=0, atol=1e-6 * exact.max())
