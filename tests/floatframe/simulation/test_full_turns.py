"""Angles through full turns: counted in the engine, whatever happens between two outputs."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import floatframe.simulation.integrate as integration
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    System,
    UserForce,
    integrate,
    kinematics,
    read_results,
)
from floatframe.errors import ResultsError
from floatframe.integrators import EnergyMomentum, Ida, Variational
from floatframe.joints import (
    CoordinateCoupler,
    CylindricalJoint,
    JointCoordinate,
    PlanarJoint,
    ScrewJoint,
    UniversalJoint,
)
from floatframe.model.functions.time_functions import harmonic, polynomial_of_time
from floatframe.model.rotations import rotation_matrix
from floatframe.results import motion_table
from floatframe.sensors import AngleSensor, measured
from floatframe.simulation import Event, resume
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

FAST = 100.0  # rad/s; 100 steps of 1 ms are 1.6 turns
INERTIA = np.diag([1.0, 1.0, 2.0])


def wheel(speed=FAST, **options):
    return RigidBody("wheel", 1.0, INERTIA, omega_B=(0, 0, speed), **options)


def on_axle(speed=FAST, joint=RevoluteJoint, **options):
    """Return a free wheel on an axle along z of the ground, with a sensor of its angle."""
    sensor = AngleSensor("turned", Marker(GROUND), Marker("wheel"))
    axle = joint("axle", GROUND, Marker("wheel"), axis=(0, 0, 1))
    return System([wheel(speed)], [axle], sensors=[sensor], **options)


METHODS = [GeneralizedAlpha(), GeneralizedAlpha(error_tolerance=1e-4), EnergyMomentum(), Variational(), Ida(1e-6, 1e-8)]


@pytest.mark.parametrize(
    ("method", "speed"),
    [
        *product(METHODS[:-1], (FAST, -FAST)),
        (METHODS[-1], -FAST),
        pytest.param(METHODS[-1], FAST, marks=pytest.mark.long),
    ],
)
def test_a_wheel_has_turned_by_speed_times_time(method, speed):
    """w t, though outputs are 1.6 turns apart; the discrete schemes have an error of second order, up to 0.1²/3."""
    system = on_axle(speed)
    motion = integrate(system, method, 0.5, 1e-3, output_every=100)
    assert len(motion.t) == 6
    turned = JointCoordinate("axle", "angle").measure(system, motion)
    assert_allclose(turned.value, speed * motion.t, rtol=1.1 * 0.1**2 / 3, atol=0)
    assert_allclose(turned.rate, speed, rtol=1e-6, atol=0)
    assert_allclose(measured(system, motion)["turned"].columns["angle"], turned.value, rtol=0, atol=1e-9)
    turns = np.round((turned.value - speed * motion.t) / (2 * np.pi))
    assert not turns.any()


def test_even_a_step_of_more_than_half_a_turn_is_counted():
    system = on_axle(1000.0)
    motion = integrate(system, GeneralizedAlpha(), 0.2, 0.01, output_every=4)  # 10 rad a step
    assert_allclose(motion.joint("axle").angle, 1000.0 * motion.t, rtol=1e-6, atol=0)


JOINTS = {  # from the ground to the wheel, about its axis z
    "revolute": (RevoluteJoint("j", GROUND, Marker("wheel"), axis=(0, 0, 1)), "angle", 1),
    "revolute from the wheel": (RevoluteJoint("j", Marker("wheel"), GROUND, axis=(0, 0, 1)), "angle", -1),
    "cylindrical": (CylindricalJoint("j", GROUND, Marker("wheel"), axis=(0, 0, 1)), "angle", 1),
    "screw": (ScrewJoint("j", GROUND, Marker("wheel"), axis=(0, 0, 1), lead=1e-3), "angle", 1),
    "planar": (PlanarJoint("j", GROUND, Marker("wheel"), axis=(0, 0, 1)), "angle", 1),
    "universal": (UniversalJoint("j", GROUND, Marker("wheel"), axis=(0, 0, 1), axis_b=(1, 0, 0)), "angle", 1),
    "its axis of B": (UniversalJoint("j", GROUND, Marker("wheel"), axis=(1, 0, 0), axis_b=(0, 0, 1)), "angle_b", 1),
}


@pytest.mark.parametrize("kind", JOINTS)
def test_every_joint_with_an_angle_counts_its_turns(kind):
    joint, name, sign = JOINTS[kind]
    system = System([wheel()], [joint])
    motion = integrate(system, GeneralizedAlpha(), 0.5, 1e-3, output_every=100)
    found = JointCoordinate("j", name).measure(system, motion)
    assert_allclose(found.value, sign * FAST * motion.t, rtol=1e-6, atol=1e-9)


def test_two_bodies_that_turn_have_the_angle_between_them():
    """Two wheels one on the other: the second turns by -3 w t against the first, which the ground sees turn by w t."""
    second = RigidBody("second", 1.0, INERTIA, omega_B=(0, 0, -2 * FAST))
    joints = [RevoluteJoint("a", GROUND, Marker("wheel"), axis=(0, 0, 1)),
              RevoluteJoint("b", Marker("wheel"), Marker("second"), axis=(0, 0, 1))]  # fmt: skip
    system = System([wheel(), second], joints)
    motion = integrate(system, GeneralizedAlpha(), 0.5, 1e-3, output_every=100)
    assert_allclose(motion.joint("b").angle, -3 * FAST * motion.t, rtol=1e-6, atol=0)


def test_a_flexible_wheel_counts_its_turns_and_adds_its_elastic_ones():
    """The counted turns are those of its frame; the angle is that of the interface, which trembles by a little."""
    reduced = reduced_body(random_point_masses(3, 5), stiffness(3, omega=300.0), name="wheel")
    hub = reduced.interfaces[0]
    body = FlexibleBody("wheel", reduced, omega_B=(0, 0, FAST), velocity=np.cross(hub.position, (0, 0, FAST)))
    system = System([body], [RevoluteJoint("axle", GROUND, Marker("wheel", hub.name), axis=(0, 0, 1))])
    coarse, fine = (integrate(system, GeneralizedAlpha(), 0.2, 1e-4, output_every=n) for n in (1000, 10))
    a, b = (motion.joint("axle").angle for motion in (coarse, fine))
    assert abs(b[-1]) > 15
    assert_allclose(a, b[::100], rtol=0, atol=1e-12)


def test_a_driven_angle_begins_where_its_drive_says():
    """An angle of two turns + 50 t reads so, not less by full turns."""
    drive = {"angle": polynomial_of_time([4 * np.pi, 50.0])}
    joint = RevoluteJoint("axle", GROUND, Marker("wheel"), axis=(0, 0, 1), motions=drive)
    system = System([wheel(0.0)], [joint])
    for motion in (
        integrate(system, GeneralizedAlpha(), 0.4, 1e-3, output_every=100),
        kinematics(system, np.linspace(0.0, 0.4, 3)),
    ):
        turned = motion.joint("axle").angle
        assert_allclose(turned, 4 * np.pi + 50 * motion.t, rtol=0, atol=1e-9)


def test_turns_are_counted_where_the_speed_changes_between_outputs():
    """A motor brakes and turns back between two outputs: the angle of its equation, not of any guess from the ends."""
    motor = JointForce("motor", "axle", "angle", motor=polynomial_of_time([0.0, -8000.0]))
    system = replace(on_axle(200.0), forces=[motor])
    motion = integrate(system, GeneralizedAlpha(), 0.5, 2.5e-4, output_every=1000)
    exact = 200.0 * motion.t - 8000.0 / 2 * motion.t**3 / 6
    assert_allclose(motion.joint("axle").angle, exact, rtol=0, atol=1e-3)


def test_results_on_disk_and_exports_have_the_turns(tmp_path):
    system = on_axle()
    path = tmp_path / "wheel.h5"
    integrate(system, GeneralizedAlpha(), 0.5, 1e-3, output_every=100, output=path)
    motion = read_results(path)
    assert motion.head.angles is not None
    assert len(motion.head.angles) == 2  # the sensor has its zero elsewhere than the joint, or the same
    turned = JointCoordinate("axle", "angle").measure(system, motion).value
    assert_allclose(turned, FAST * motion.t, rtol=1e-6, atol=0)
    motion_table(motion, system=system).write(tmp_path / "wheel.csv")
    head, *_, last = (tmp_path / "wheel.csv").read_text().splitlines()
    columns = dict(zip(head.split(","), map(float, last.split(",")), strict=True))
    assert_allclose(columns["turned angle [rad]"], FAST * 0.5, rtol=1e-6, atol=0)
    assert_allclose(columns["axle.angle value [rad]"], FAST * 0.5, rtol=1e-6, atol=0)


@pytest.mark.parametrize("method", [GeneralizedAlpha(), EnergyMomentum()], ids=["alpha", "energy-momentum"])
def test_a_resumed_run_counts_on_bit_for_bit(method, tmp_path, monkeypatch):
    system = on_axle()
    whole = integrate(system, method, 0.6, 1e-3, output_every=100)
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)

    class KilledError(Exception):
        pass

    def kill(progress):
        if progress.n_steps >= 450:
            raise KilledError

    path = tmp_path / "out.h5"
    with pytest.raises(KilledError):
        integrate(system, method, 0.6, 1e-3, output_every=100, output=path, progress=kill)
    again = resume(system, path)
    assert_array_equal(again.source.read("angle"), whole.source.read("angle"))
    assert again.source.read("angle")[-1, 0] > 50


def test_turns_go_on_after_an_event():
    """Switched at 0.17 s, after 17 rad: the angle goes on, and the events after it see the whole of it."""
    push = PointForce("push", Marker("wheel"), (1.0, 0, 0))
    events = [Event("push", at=0.17, switch_on=("push",)), Event("turned", "axle.angle", level=40.0, record=True),
              Event("halt", "turned", level=45.0, stop=True)]  # fmt: skip
    system = replace(on_axle(), forces=[push], events=events)
    motion = integrate(system, GeneralizedAlpha(), 1.0, 1e-3, output_every=100)
    assert [e["name"] for e in motion.head.summary["events"]] == ["push", "turned", "halt"]
    assert_allclose([e["t"] for e in motion.head.summary["events"]], [0.17, 0.40, 0.45], rtol=1e-6, atol=0)
    assert_allclose(motion.joint("axle").angle, FAST * motion.t, rtol=1e-6, atol=1e-9)


def geared(**options):
    """Return two wheels on the ground, the second geared to turn twice as fast the other way."""
    second = RigidBody("second", 1.0, INERTIA, position=(1.0, 0, 0), omega_B=(0, 0, -2 * FAST))
    joints = [RevoluteJoint("a", GROUND, Marker("wheel"), axis=(0, 0, 1)),
              RevoluteJoint("b", GROUND, Marker("second"), axis=(0, 0, 1))]  # fmt: skip
    gear = CoordinateCoupler("gear", [(JointCoordinate("a", "angle"), 2.0), (JointCoordinate("b", "angle"), 1.0)])
    return System([wheel(), second], joints, couplers=[gear], **options)


def test_a_gear_holds_through_an_event():
    """Its angles have turned by 17 and 34 rad when the event makes the state anew: nothing may jump."""
    push = PointForce("push", Marker("wheel"), (1.0, 0, 0))
    system = geared(forces=[push], events=[Event("push", at=0.17, switch_on=("push",))])
    motion = integrate(system, GeneralizedAlpha(), 0.5, 1e-3, output_every=100)
    a, b = (JointCoordinate(name, "angle").measure(system, motion).value for name in "ab")
    assert_allclose(a, FAST * motion.t, rtol=1e-6, atol=1e-9)
    assert_allclose(b, -2 * a, rtol=1e-9, atol=1e-9)


def test_states_of_control_go_on_through_an_event():
    """An integral of one over time is t, and a force of it accelerates the wheel by t³/6, whatever is switched when."""
    push = PointForce("push", Marker("wheel"), (1.0, 0, 0))
    control = UserForce("control", {"phi": JointCoordinate("axle", "angle")}, forces={"phi": "2 * s"},
                        rates={"s": "1 + 0 * phi"}, states={"s": 0.0})  # fmt: skip
    system = replace(on_axle(0.0), forces=[push, control], events=[Event("push", at=0.17, switch_on=("push",))])
    motion = integrate(system, GeneralizedAlpha(), 1.0, 1e-3, output_every=100)
    assert_allclose(motion.joint("axle").angle, motion.t**3 / 6, rtol=0, atol=1e-5)


def test_a_controller_sees_the_whole_angle_after_an_event():
    """Held by a spring through 20 rad, from a wound start: the torque of the event's restart is that of before."""
    push = PointForce("push", Marker("wheel"), (1.0, 0, 0))
    spring = UserForce("spring", {"phi": JointCoordinate("axle", "angle")}, forces={"phi": "-2 * phi"})
    base = replace(on_axle(20.0), forces=[push, spring])  # 20 sin t
    pushed = replace(base, events=[Event("push", at=1.37, switch_on=("push",))])
    motion = integrate(pushed, GeneralizedAlpha(), 6.0, 2e-3, output_every=50)
    assert_allclose(motion.joint("axle").angle, 20 * np.sin(motion.t), rtol=0, atol=1e-3)


def test_a_sensor_made_after_the_run_goes_by_the_rates_or_refuses():
    """Steady turning it follows through any number of turns; where the speed jumps between outputs it says so."""
    late = AngleSensor("late", Marker(GROUND, triad=rotation_matrix(np.array([0.8, 0, 0, 0.6]))), Marker("wheel"))
    system = on_axle()
    motion = integrate(system, GeneralizedAlpha(), 0.5, 1e-3, output_every=100)
    found = measured(system, motion, [late])["late"].columns["angle"]
    assert_allclose(found - found[0], FAST * motion.t, rtol=1e-6, atol=1e-9)
    motor = JointForce("motor", "axle", "angle", motor=harmonic(4000.0, 20.0))  # the speed comes and goes between
    braked = replace(on_axle(0.0), forces=[motor])
    motion = integrate(braked, GeneralizedAlpha(), 0.5, 2.5e-4, output_every=800)
    with pytest.raises(ResultsError, match=r"sensor 'late': the angle cannot be followed from t = .*output_every"):
        measured(braked, motion, [late])
