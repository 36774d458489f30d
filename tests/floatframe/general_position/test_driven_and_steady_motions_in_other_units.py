"""Driven and steady motions, poses, and studies over a parameter in other units, off the origin: those in SI."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import cms
from fe_models.body.fe_body import Interface
from floatframe import (
    GROUND,
    FlexibleBody,
    Gravity,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    inverse_dynamics,
    kinematics,
    linearize,
    system_modes,
)
from floatframe.analyses import campbell, root_locus, steady_motion
from floatframe.analyses.inverse_kinematics import Target, inverse_kinematics
from floatframe.components.bearings import Bearing
from floatframe.components.mechanisms import slider_crank
from floatframe.design.studies.study import run_study
from floatframe.design.studies.study_file import read_study
from floatframe.model.functions.time_functions import harmonic, polynomial_of_time
from tests.bodies import beam, with_interfaces
from tests.floatframe.components.wheels.car import Car
from tests.floatframe.other_units import SI, SIZES, in_units, other_units

R = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
PLACE = np.array([300.0, -200.0, 150.0])
UNITS = ["mm-kg-ms", "in-slinch-s"]
TIMES = np.linspace(0, 0.3, 7)


def elsewhere(system, other, turn=R, place=PLACE):
    """Return a system in other units, or of another size, turned and off the origin; in SI, as it is."""
    return system if other.units == SI else in_units(system, other.units, turn, place)


def directions(other):
    """Return the rotation of the moved system and its place in its units; none in SI."""
    return (np.eye(3), np.zeros(3)) if other.units == SI else (R, PLACE * other.factor("m"))


# driven motions -------------------------------------------------------------------------------------------------------


@cache
def flexible_tool():
    ends = [Interface(name, "nodes", np.array([k]), np.array([k / 3, 0, 0])) for name, k in (("left", 0), ("right", 3))]
    part = cms.couple(with_interfaces(beam(n=3), *ends))
    return cms.reduce(part, cms.craig_bampton(part, n_modes=2))


@cache
def manipulator():
    """A driven hinge, a driven slide in it, and a flexible tool on a driven hinge at its end, with a stay."""
    places = np.array([0.5, -0.2, 0.4]), np.array([1.1, -0.1, 0.5]), np.array([1.3, -0.1, 0.5])
    arm = RigidBody("arm", 2.0, np.diag([0.1, 0.12, 0.14]), (0.3, 0.05, 0.02), position=places[0])
    block = RigidBody("block", 0.7, np.diag([0.02, 0.03, 0.04]), (0.01, 0.02, 0.03), position=places[1])
    tool = FlexibleBody("tool", flexible_tool(), position=places[2])
    joints = [
        RevoluteJoint("hinge", Marker(GROUND, position=places[0]), Marker("arm"), axis=(0.6, 0.8, 0),
                      motions={"angle": harmonic(0.8, 9.0, 0.3)}),
        PrismaticJoint("slide", Marker("arm", position=places[1] - places[0]), Marker("block"), axis=(0.8, 0, 0.6),
                       motions={"distance": polynomial_of_time([0.0, 0.4, -2.0])}),
        RevoluteJoint("wrist", Marker("block", position=places[2] - places[1]), Marker("tool", "left"), axis=(0, 0, 1),
                      motions={"angle": polynomial_of_time([0.1, 3.0])}),
    ]  # fmt: skip
    stay = SpringDamper("stay", Marker(GROUND, position=(0.2, 0.1, 1.5)), Marker("block"), 90.0, 2.0, 0.9)
    return System([arm, block, tool], joints, [Gravity((0.5, -1.0, -9.81)), stay])


@cache
def crank():
    """A loop, driven, whose plane lies across gravity."""
    plain = slider_crank(drive=harmonic(1.2, 8.0), angle=0.4)
    return System(plain.bodies, plain.joints, [Gravity((0.3, -9.81, 1.0))])


SYSTEMS = {"manipulator": manipulator, "crank": crank}


@cache
def driven(name, analysis, units):
    other = other_units(units)
    return analysis(elsewhere(SYSTEMS[name](), other), TIMES * other.factor("s"))


@pytest.mark.parametrize("units", [*UNITS, *SIZES])
@pytest.mark.parametrize("name", SYSTEMS)
def test_driven_bodies_move_alike_in_other_units(name, units):
    a, b = driven(name, kinematics, "m-kg-s"), driven(name, kinematics, units)
    other = other_units(units)
    for body in a.body_names:
        one, two = a.body(body), b.body(body)
        assert_allclose((two.r / other.factor("m") - PLACE) @ R, one.r, rtol=0, atol=1e-9)
        for key, unit in (("v", "m/s"), ("v_dot", "m/s^2")):
            expected = getattr(one, key)
            found = getattr(two, key) / other.factor(unit) @ R
            assert_allclose(found, expected, rtol=0, atol=1e-8 * max(np.abs(expected).max(), 1.0), err_msg=body)
        assert_allclose(two.omega_B / other.factor("1/s"), one.omega_B, rtol=0, atol=1e-8 * 10)


@pytest.mark.parametrize("units", [*UNITS, *SIZES])
@pytest.mark.parametrize("name", SYSTEMS)
def test_drives_and_reactions_are_alike_in_other_units(name, units):
    a, b = driven(name, inverse_dynamics, "m-kg-s"), driven(name, inverse_dynamics, units)
    other = other_units(units)
    assert set(a.drives) == set(b.drives) != set()
    for key, one in a.drives.items():
        value, force = ("rad", "N m") if key.endswith("angle") else ("m", "N")
        two = b.drives[key]
        assert_allclose(two.value / other.factor(value), one.value, rtol=0, atol=1e-9)
        assert_allclose(two.rate / other.factor(f"{value}/s"), one.rate, rtol=0, atol=1e-8)
        scale = np.abs(one.force).max()
        assert scale > 0.01
        assert_allclose(two.force / other.factor(force), one.force, rtol=0, atol=1e-7 * scale, err_msg=key)
    for joint in SYSTEMS[name]().joints:
        one, two = a.motion.reaction(joint.name), b.motion.reaction(joint.name)
        for kind, unit in (("force", "N"), ("moment", "N m")):
            expected, found = getattr(one, kind), getattr(two, kind) / other.factor(unit) @ R
            assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(one.force).max(), err_msg=joint.name)


@cache
def reached(units, has_rotation):
    other = other_units(units)
    plain = manipulator()
    free = replace(plain, joints=[replace(joint, motions={}) for joint in plain.joints])
    turn, place = directions(other)
    goal = Target(Marker("block", position=np.array([0.1, 0.0, 0.05]) * other.factor("m")),
                  turn @ np.array([1.0, 0.3, 0.2]) * other.factor("m") + place,
                  turn @ R if has_rotation else None)  # fmt: skip
    limits = {"slide.distance": (-0.05 * other.factor("m"), 0.02 * other.factor("m"))}
    return inverse_kinematics(elsewhere(free, other), goal, limits=limits)


@pytest.mark.parametrize("units", [*UNITS, *SIZES])
@pytest.mark.parametrize("has_rotation", [False, True])
def test_poses_that_reach_a_target_are_alike_in_other_units(has_rotation, units):
    """Errors of place and rotation are weighed by the size of the system, which does not depend on its direction."""
    a, b, other = reached("m-kg-s", has_rotation), reached(units, has_rotation), other_units(units)
    assert not a.is_reached
    assert a.at_limits == b.at_limits != ()
    assert_allclose(b.position_error / other.factor("m"), a.position_error, rtol=1e-7)
    assert (a.rotation_error > 0.1) == has_rotation
    assert_allclose(b.rotation_error, a.rotation_error, rtol=1e-6)
    assert_allclose(b.coordinates["hinge.angle"], a.coordinates["hinge.angle"], rtol=0, atol=1e-6)
    assert_allclose(b.coordinates["slide.distance"] / other.factor("m"), a.coordinates["slide.distance"], atol=1e-9)


# steady motions -------------------------------------------------------------------------------------------------------


@cache
def curve(units):
    """Return a car in a curve of 60 m: steer angle, push and small motions about it."""
    other = other_units(units)

    def car(steer, push):
        plain = Car().system(15.0, steer=steer)
        ahead = PointForce("push", Marker("chassis"), force=(push / other.factor("N"), 0, 0), is_follower=True)
        return elsewhere(replace(plain, forces=[*plain.forces, ahead]), other)

    turn, _ = directions(other)
    return steady_motion(car, "chassis", 15.0 * other.factor("m/s"), curvature=other.factor("1/m") / 60,
                         unknown={"steer": 0.04, "push": 10.0 * other.factor("N")}, axis=turn[:, 2])  # fmt: skip


LONG = [
    pytest.param(units, marks=pytest.mark.long) for units in ("in-slinch-s", "micrometres")
]  # a second and more each


@pytest.mark.parametrize("units", ["mm-kg-ms", "1000 km", *LONG])
def test_a_steady_curve_is_alike_in_other_units(units):
    a, b, other = curve("m-kg-s"), curve(units), other_units(units)
    assert_allclose(b.found["steer"], a.found["steer"], rtol=1e-6)
    assert_allclose(b.found["push"] / other.factor("N"), a.found["push"], rtol=1e-6)
    assert_allclose(b.speed / other.factor("m/s"), a.speed, rtol=1e-12)
    for wheel, spin in a.spins.items():
        assert_allclose(b.spins[wheel] / other.factor("1/s"), spin, rtol=1e-6, err_msg=wheel)
    found, expected = (
        system_modes(linearize(each.system, each.equilibrium, inputs=(), outputs=())).eigenvalues for each in (b, a)
    )
    found = found / other.factor("Hz")
    clear = expected[np.abs(expected) > 1e-2]  # the circle itself has zero modes
    apart = [np.abs(found - each).min() / abs(each) for each in clear]
    assert_allclose(apart, 0, atol=1e-4)


# over a parameter -----------------------------------------------------------------------------------------------------


@cache
def rotor():
    disc = RigidBody("disc", 3.0, np.diag([0.03, 0.03, 0.05]))
    return System([disc], [SphericalJoint("hub", Marker(GROUND, position=(0, 0, -0.2)),
                                          Marker("disc", position=(0, 0, -0.2)))],
                  [Gravity((0, 0, -9.81))],
                  elements=[Bearing("bearing", Marker(GROUND, position=(0, 0, 0.0)), Marker("disc"), 3e4, 3.0,
                                    tilt_stiffness=300.0, tilt_damping=0.03)])  # fmt: skip


@cache
def campbell_values(units):
    other, speeds = other_units(units), np.array([0.0, 150.0, 400.0])
    turn, place = directions(other)
    found = campbell(elsewhere(rotor(), other), speeds * other.factor("1/s"), axis=turn[:, 2], center=place)
    return found.eigenvalues / other.factor("1/s")


@pytest.mark.parametrize("units", [*UNITS, *SIZES])
def test_campbell_diagrams_are_alike_in_other_units(units):
    a, b = campbell_values("m-kg-s"), campbell_values(units)
    lines = [x[:, (np.abs(x) > 1.0).all(axis=0)] for x in (a, b)]  # without the turning, which costs nothing
    assert lines[0].shape == lines[1].shape == (3, 2)
    a, b = (x[:, np.argsort(x[-1].imag)] for x in lines)
    assert_allclose(b, a, rtol=0, atol=1e-6 * np.abs(a).max())


@cache
def locus(units):
    other, plain = other_units(units), manipulator()
    arm = replace(plain, joints=[replace(plain.joints[0], motions={}), *plain.joints[1:]])

    def at(value):
        stay = replace(arm.forces[1], stiffness=value / other.factor("N/m"))
        return linearize(elsewhere(replace(arm, forces=[arm.forces[0], stay]), other))

    return root_locus(at, np.array([50.0, 200.0, 900.0]) * other.factor("N/m")).eigenvalues / other.factor("1/s")


@pytest.mark.parametrize("units", [*UNITS, *SIZES])
def test_root_loci_are_alike_in_other_units(units):
    a, b = locus("m-kg-s"), locus(units)
    assert_allclose(np.sort_complex(b), np.sort_complex(a), rtol=1e-6, atol=1e-7 * np.abs(a).max())


PENDULUM = """
[system]
units = "{units}"
gravity = [0, 0, {g}]

[bodies.rod]
mass = {mass}
inertia = [[{J}, 0, 0], [0, {J}, 0], [0, 0, {J}]]
position = [{half}, 0, 0]

[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "rod"
marker_a = [0, 0, 0]
axis = [0, 1, 0]

[forces.stay]
type = "spring-damper"
body_a = "ground"
body_b = "rod"
marker_a = [{half}, 0, {above}]
marker_b = [0, 0, 0]
stiffness = {stiffness}
damping = {damping}
free_length = {free}

[sensors.tip]
type = "position"
body = "rod"
marker = [{half}, 0, 0]
"""
STUDY = """
system = "pendulum.toml"
analysis = "{analysis}"

[parameters.mass]
path = "bodies.rod.mass"
values = {masses}

[outputs.found]
of = "{of}"
{take}
"""


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(
    ("analysis", "of", "take", "unit"),
    [("modes", "frequency 1", "", "1"), ("modes", "real 1", "", "1"), ("static", "tip z", 'take = "last"', "m")],
)
def test_sweeps_of_a_file_are_alike_in_other_units(analysis, of, take, unit, units, tmp_path):
    """Frequencies and decay stand in hertz and per second in any unit system; what sensors measure, in its units."""
    columns = {}
    for name in ("m-kg-s", units):
        other, folder = other_units(name), tmp_path / name
        folder.mkdir()
        numbers = {"g": (-9.81, "m/s^2"), "mass": (1.5, "kg"), "J": (0.2, "kg m^2"), "half": (0.5, "m"),
                   "above": (1.0, "m"), "stiffness": (80.0, "N/m"), "damping": (3.0, "N s/m"),
                   "free": (0.9, "m")}  # fmt: skip
        in_file = {key: repr(float(value * other.factor(word))) for key, (value, word) in numbers.items()}
        (folder / "pendulum.toml").write_text(PENDULUM.format(units=name, **in_file))
        masses = [float(mass * other.factor("kg")) for mass in (1.0, 1.5, 2.5)]
        (folder / "study.toml").write_text(STUDY.format(analysis=analysis, masses=masses, of=of, take=take))
        table = run_study(read_study(folder / "study.toml"), workers=1)
        assert table.n_failed == 0, table.rows
        columns[name] = table.column("found") / other.factor(unit)
    assert np.ptp(columns["m-kg-s"]) > 1e-3 * np.abs(columns["m-kg-s"]).max()
    assert_allclose(columns[units], columns["m-kg-s"], rtol=1e-6)
