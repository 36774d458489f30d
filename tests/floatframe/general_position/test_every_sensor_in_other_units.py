"""Every sensor in other units: what it measures, in the units that it states."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from fe_models.body.fe_body import Interface
from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    UserForce,
    integrate,
)
from floatframe.components.drives import DcMotor
from floatframe.files.signals.signal_units import unit_factor
from floatframe.forces import Bushing
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.model.functions.time_functions import harmonic, polynomial_of_time
from floatframe.results.sensors import (
    SENSORS,
    AngleSensor,
    BushingSensor,
    Channel,
    ControlSensor,
    CouplerSensor,
    DisplacementSensor,
    ElementSensor,
    ElongationSensor,
    EnergySensor,
    InterfaceForceSensor,
    LeftOutSensor,
    ModeSensor,
    MomentumSensor,
    PlaceSensor,
    ReactionSensor,
    RecoverySensor,
    SpringSensor,
    StrainGauge,
    StressChannel,
    StressSensor,
    VonMisesSensor,
    measured,
)
from floatframe.results.sensors.places import PLACE_QUANTITIES
from tests.bodies import beam, with_interfaces
from tests.floatframe.other_units import Other, in_units

H, STEPS = 1e-3, 6
UNITS = ["mm-kg-ms", "in-slinch-s"]
K = np.diag([3e4, 2e4, 4e4, 300.0, 200.0, 250.0]) + 50.0
NUMBER = "index in the model, from 0"
#: the words of sensors and of the table of units
WORDS = {"m/s²": "m/s^2", "rad/s²": "1/s^2", "rad/s": "1/s", "kg^(1/2) m": "kg^0.5 m", "kg m/s": "kg m/s",
         "kg m²/s": "kg m^2/s", "": "1",
         "-": "1", NUMBER: "1", "kg^(1/2) m/s": "kg^0.5 m/s"}  # fmt: skip
#: electrical ones stay, see `other_units`; the root is no unit of signals
UNREADABLE = ("A", "V", NUMBER, "kg^(1/2) m", "kg^(1/2) m/s")


@cache
def rod():
    """A beam with stress, kept nodes and a recovery table."""
    ends = [Interface(name, "nodes", np.array([k]), np.array([k / 3, 0, 0])) for name, k in (("left", 0), ("right", 3))]
    part = cms.couple(with_interfaces(beam(n=3), *ends))
    rows = (cms.reduction.Rows("acceleration", at=("right",)), cms.reduction.Rows("net force", about=(0.1, 0.2, 0.0)))
    reduced = cms.reduce(
        part, cms.craig_bampton(part, n_modes=4), recovery=[cms.reduction.RecoveryRequest("table", rows=rows)],
        errors=True,
    )  # fmt: skip
    stress = 1e9 * np.random.default_rng(4).normal(size=(len(reduced.nodes), 6, reduced.n_q))
    return replace(reduced, stress=stress)


@cache
def system():
    """Return two bases, a rod and an arm that move, off the origin, with each thing that a sensor looks at."""
    place, spin = np.array([3.0, -2.0, 1.5]), np.array([0.3, 1.0, 3.0])
    body = FlexibleBody("rod", rod(), position=place, omega_B=spin, q=1e-5 * np.arange(1, rod().n_q + 1))
    along, beside = np.array([1.0, 0, 0]), np.array([0.2, 0.3, 0])
    tip = place + along
    arm = RigidBody("arm", 0.5, np.diag([0.1, 0.12, 0.14]), (0.1, 0.05, 0), position=tip,
                    velocity=np.cross(spin, along), omega_B=spin - np.array([0, 2.0, 0]))  # fmt: skip
    rotor = RigidBody("rotor", 0.3, np.diag([0.02, 0.03, 0.04]), position=tip + beside, omega_B=(0, 0, 7.0),
                      velocity=(0.2, 0.4, -0.1))  # fmt: skip
    end = Marker("arm", position=(0.3, 0.1, 0.05))
    base, other_base = Marker(GROUND, position=place), Marker(GROUND, position=tip + beside)
    joints = [SphericalJoint("pin", base, Marker("rod", "left")),
              RevoluteJoint("knee", Marker("rod", "right"), Marker("arm"), axis=(0, 1, 0)),
              SphericalJoint("hub", other_base, Marker("rotor"))]  # fmt: skip
    forces = [
        Gravity((0.5, -1.0, -9.81)),
        SpringDamper("stay", other_base, end, 50.0, 2.0, 0.1, preload=3.0),
        Bushing("mount", Marker("arm"), Marker("rotor", position=(0.05, 0, 0.02)), K, 1e-3 * K, preload=np.arange(6.0)),
        JointForce("rub", "knee", "angle", stiffness=5.0, free=0.1, damping=0.3, preload=0.2, friction=0.4,
                   friction_speed=0.3),
        PointForce("push", end, (1.0, 0.5, -0.4), (0.1, 0.2, 0.0), amplitude=harmonic(2.0, 70.0, 0.3, 0.5)),
    ]  # fmt: skip
    motor = DcMotor("motor", Marker("arm"), Marker("rotor"), 0.5, 2e-3, 0.07, voltage=harmonic(6.0, 50.0), friction=0.1,
                    friction_speed=2.0, damping=0.01, axis=(0.6, 0, 0.8))  # fmt: skip
    latch = CoordinateCoupler("latch", [(JointCoordinate("knee", "angle"), 1.5)], polynomial_of_time([0.0, -3.0, 40.0]))
    return System([body, arm, rotor], joints, forces, couplers=[latch], elements=[motor])


def controlled(plain, torque):
    """Return the system with a user force, whose expression has one number with a unit."""
    user = UserForce("user", {"phi": JointCoordinate("knee", "angle")}, {"phi": "M*cos(phi)"}, parameters={"M": torque})
    return replace(plain, forces=(*plain.forces, user))


def sensors():
    """Return every sensor, with every quantity of those that have several."""
    tip, arm = Marker("rod", "right"), Marker("arm", position=(0.3, 0.1, 0.05))
    found = [PlaceSensor(f"place {each}", arm, each, Marker("rotor")) for each in PLACE_QUANTITIES]
    found += [Channel(f"channel {q} {rate}", arm, (0.6, 0, 0.8), q, tip, rate)
              for q in ("translation", "rotation") for rate in range(3)]  # fmt: skip
    found += [JointCoordinate("knee", "angle", f"coordinate {rate}", rate=rate) for rate in range(2)]
    return [
        *found,
        AngleSensor("angle", tip, Marker("arm"), (0, 1, 0)),
        BushingSensor("bushing", "mount"),
        ControlSensor("control", "user"),
        JointCoordinate("knee", "angle", "knee"),
        CouplerSensor("coupler", "latch"),
        DisplacementSensor("displacement", tip),
        ElementSensor("element", "motor"),
        ElongationSensor("elongation", "rod", np.array([0.0, 0, 0]), np.array([1.0, 0, 0])),
        EnergySensor("energy"),
        InterfaceForceSensor("interface", "rod", "right"),
        LeftOutSensor("left out", "rod"),
        ModeSensor("mode", "rod", 2),
        MomentumSensor("momentum"),
        ReactionSensor("reaction", "knee", "marker"),
        RecoverySensor("recovery", "rod", "table"),
        SpringSensor("spring", "stay"),
        StrainGauge("strain", "rod", np.array([0.6, 0.8, 0]), 2.1e11, 0.3, position=np.array([1.0, 0, 0])),
        StressChannel("stress channel", "rod", "xx", np.array([1.0, 0, 0])),
        StressSensor("stress", "rod", position=np.array([1.0, 0, 0])),
        VonMisesSensor("von Mises", "rod"),
    ]


@cache
def in_si():
    whole = controlled(system(), 2.0)
    motion = integrate(whole, GeneralizedAlpha(0.9, 1e-11), STEPS * H, H)
    return measured(whole, motion, sensors())


@cache
def elsewhere(units):
    other = Other(unit_system(units))
    twin, h = controlled(in_units(system(), other.units), 2.0 * other.factor("N m")), H * other.factor("s")
    motion = integrate(twin, GeneralizedAlpha(0.9, 1e-11), STEPS * h, h)
    return measured(twin, motion, [other.part(each) for each in sensors()])


def test_every_sensor_is_there():
    assert {type(each) for each in sensors()} == {*SENSORS.values(), Channel, StressChannel}


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", [each.name for each in sensors()])
def test_a_sensor_measures_alike_in_other_units(name, units):
    a, b, other = in_si()[name], elsewhere(units)[name], Other(unit_system(units))
    assert max(np.abs(values).max() for values in a.columns.values()) > 0
    for key, values in a.columns.items():
        factor = other.factor(WORDS.get(a.units[key], a.units[key]))
        scale = max(np.abs(each).max() for k, each in a.columns.items() if a.units[k] == a.units[key])
        assert_allclose(b.columns[key] / factor, values, rtol=0, atol=1e-6 * scale, err_msg=f"{key} [{a.units[key]}]")
        if a.units[key] not in UNREADABLE:
            assert_allclose(unit_factor(a.units[key], b.units[key]), factor, rtol=1e-9, err_msg=key)
