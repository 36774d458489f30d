"""Every joint: what it holds, that its reactions do no work and balance, and its tangent."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.analyses import consistent_state
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced
from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.connections.connection import write_velocity_gaps
from floatframe.engine.kernels.entry import as_model, as_work, rates_of_constraints
from floatframe.errors import ModelError, ResultsError
from floatframe.joints import (
    CylindricalJoint,
    DistanceJoint,
    JointCoordinate,
    PlanarJoint,
    PointOnLine,
    PointOnPlane,
    ScrewJoint,
    UniversalJoint,
)
from floatframe.model.functions.time_functions import harmonic, polynomial_of_time
from floatframe.model.joints.rows import is_held_position
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix
from floatframe.results.sensors import coordinate_sensors
from floatframe.sensors import measured
from tests.floatframe.engine.kernels.examples import C_K, Iterate, newton_matrices
from tests.floatframe.model.joints.examples import AXIS, CASES, JOINTS, held, pair

DRIVE = harmonic(0.3, 2.0, 0.4, 0.1)
DRIVEN = {
    "revolute": lambda *ends: RevoluteJoint("j", *ends, axis=AXIS, motions={"angle": DRIVE}),
    "prismatic": lambda *ends: PrismaticJoint("j", *ends, axis=AXIS, motions={"distance": DRIVE}),
    "cylindrical": lambda *ends: CylindricalJoint("j", *ends, axis=AXIS, motions={"distance": DRIVE, "angle": DRIVE}),
    "screw": lambda *ends: ScrewJoint("j", *ends, axis=AXIS, lead=0.7, motions={"angle": DRIVE}),
    "planar": lambda *ends: PlanarJoint("j", *ends, axis=AXIS, motions={"first": DRIVE, "angle": DRIVE}),
    "point-on-line": lambda *ends: PointOnLine("j", *ends, axis=AXIS, motions={"distance": DRIVE}),
    "point-on-plane": lambda *ends: PointOnPlane("j", *ends, axis=AXIS, motions={"second": DRIVE}),
    "universal": lambda *ends: UniversalJoint("j", *ends, axis=(1, 0.1, 0), motions={"angle": DRIVE}),
    "universal about b": lambda *ends: UniversalJoint("j", *ends, axis=(1, 0.1, 0), motions={"angle_b": DRIVE}),
    "universal twice": lambda *ends: UniversalJoint("j", *ends, motions={"angle": DRIVE, "angle_b": DRIVE}),
    "screw along": lambda *ends: ScrewJoint("j", *ends, axis=AXIS, lead=0.7, motions={"distance": DRIVE}),
    "distance": lambda *ends: DistanceJoint("j", *ends, motions={"distance": harmonic(0.1, 2.0, 0.4, 1.1)}),
}  # fmt: skip
CASES += [pytest.param(make, id=f"{name} driven") for name, make in DRIVEN.items()]


@pytest.mark.parametrize("make", CASES)
def test_newton_matrix_is_the_derivative_of_the_residual(make):
    iterate = Iterate(pair(make), 1)
    iterate.work.state.time[...] = 0.37
    exact, approximate = newton_matrices(iterate)
    assert_allclose(exact, approximate, rtol=0, atol=2e-9 * max(np.abs(approximate).max(), 1 / C_K))


@pytest.mark.parametrize("make", CASES)
def test_rates_are_the_derivatives_of_what_is_held_along_a_motion(make):
    """From a closed joint on: the second rate of a screw is that of parallel axes."""
    system = pair(make)
    model = compiled_system(system).model
    t, s = 0.37, 1e-4
    start = consistent_state(system, t=t).state
    g, rate, bias = held(system, start, t)
    is_position = np.isfinite(bias)
    assert_allclose(g, 0, rtol=0, atol=1e-10)
    assert_allclose(rate[is_position], 0, rtol=0, atol=1e-10)
    before, at, after = (held(system, displaced(model, start, k * s * start.u), t + k * s)[0] for k in (-1, 0, 1))
    scale = max(np.abs(bias[is_position]).max(), 1.0)
    assert_allclose((after - before) / (2 * s), rate, rtol=0, atol=1e-6 * scale)
    second = (after - 2 * at + before) / s**2
    assert_allclose(second[is_position], bias[is_position], rtol=0, atol=1e-6 * scale)


@pytest.mark.parametrize(("make", "n_held"), JOINTS.values(), ids=JOINTS)
def test_number_of_constraints_is_that_of_the_joint(make, n_held):
    system = pair(make)
    start = consistent_state(system)
    assert len(held(system, start.state, 0.0)[0]) == n_held


@pytest.mark.parametrize("make", [make for make, _ in JOINTS.values()], ids=JOINTS)
def test_reactions_balance_and_do_no_work(make):
    """On two bodies alone: momentum keeps its value, and energy does but for the order of the integrator."""
    system = pair(make)
    free = System(system.bodies, system.joints)
    steps, defects = (2e-3, 1e-3), []
    for h in steps:
        motion = integrate(free, GeneralizedAlpha(1.0, 1e-12), 0.2, h)
        energy = motion.energies.total
        defects.append(np.abs(energy - energy[0]).max() / energy[0])
        for momentum in (motion.linear_momentum, motion.angular_momentum):
            assert_allclose(momentum, momentum[:1] + 0 * momentum, rtol=0, atol=2e-5 * np.abs(momentum).max())
        drift = motion.drift("j")
        assert drift.distance.max() < 1e-10
        assert drift.angle.max() < 1e-10
    assert defects[1] < 2e-4
    assert defects[1] < 0.3 * defects[0] or defects[0] < 1e-9


def test_a_slider_on_an_incline_falls_as_in_closed_form():
    """s = g sin(a) t²/2; reaction: the weight normal to the axis, and none along it."""
    slope = 0.4
    axis = np.array([np.cos(slope), 0.0, -np.sin(slope)])
    body = RigidBody("block", 2.0, np.eye(3), (0.3, 0.1, 0.2))
    system = System([body], [PrismaticJoint("rail", GROUND, Marker("block"), axis=axis)], [Gravity((0, 0, -9.81))])
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-12), 1.0, 1e-2)
    exact = 0.5 * 9.81 * np.sin(slope) * motion.t[:, None] ** 2 * axis
    assert_allclose(motion.body("block").r, exact, rtol=0, atol=1e-10)
    force = motion.reaction("rail").force  # on the ground
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    assert_allclose(force, np.tile(-2.0 * 9.81 * np.cos(slope) * normal, (len(force), 1)), rtol=0, atol=1e-9)


def test_a_screw_turns_under_its_weight_as_in_closed_form():
    """(m p² + I) th_ddot = -m g p, p = lead/(2 pi), over several turns."""
    lead, m, inertia, g = 0.5, 2.0, 0.03, 9.81
    p = lead / (2 * np.pi)
    nut = RigidBody("nut", m, np.diag([0.05, 0.05, inertia]))
    system = System([nut], [ScrewJoint("thread", GROUND, Marker("nut"), axis=(0, 0, 1), lead=lead)],
                    [Gravity((0, 0, -g))])  # fmt: skip
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-12), 1.0, 1e-3)
    rate = -m * g * p / (m * p**2 + inertia)
    assert abs(0.5 * rate) > 4 * np.pi
    assert_allclose(motion.body("nut").r[:, 2], 0.5 * p * rate * motion.t**2, rtol=0, atol=1e-9)
    assert_allclose(motion.body("nut").omega_B[:, 2], rate * motion.t, rtol=0, atol=1e-7)


def test_a_rod_makes_a_pendulum_with_the_tension_of_a_pendulum():
    """Point mass on a rod from rest at 90 degrees: tension 3 m g cos(angle)."""
    bob = RigidBody("bob", 2.0, 1e-3 * np.eye(3), position=(1.5, 0, 0))
    system = System([bob], [DistanceJoint("rod", Marker(GROUND), Marker("bob"))], [Gravity((0, 0, -9.81))])
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-11), 1.0, 1e-3)
    r = motion.body("bob").r
    assert_allclose(np.linalg.norm(r, axis=1), 1.5, rtol=0, atol=1e-12)
    cosine = -r[:, 2] / 1.5
    assert_allclose(np.linalg.norm(motion.reaction("rod").force, axis=1), 3 * 2.0 * 9.81 * cosine, rtol=0, atol=1e-3)


def test_a_universal_joint_turns_unevenly_as_in_closed_form():
    """Shafts at an angle b: tan(out) = tan(in)/cos(b) for a drive at constant speed."""
    b, speed = 0.5, 3.0
    direction = np.array([np.cos(b), np.sin(b), 0.0])
    R = rotation_exp(np.array([0.0, 0.0, b]))  # x of the output shaft along its direction
    first = RigidBody("in", 1.0, 0.1 * np.eye(3))
    second = RigidBody("out", 1.0, 0.1 * np.eye(3), orientation=euler_parameters_of_rotation_vector([0, 0, b]))
    joints = [
        RevoluteJoint("drive", GROUND, Marker("in"), axis=(1, 0, 0), motions={"angle": polynomial_of_time([0, speed])}),
        UniversalJoint("cross", Marker("in"), Marker("out"), axis=(0, 0, 1), axis_b=(0, 1, 0)),
        # the cross holds the point: the bearing need only hold the axis
        PointOnLine("bearing", Marker(GROUND), Marker("out", position=(1.0, 0, 0)), axis=direction),
    ]
    motion = integrate(System([first, second], joints), GeneralizedAlpha(0.8, 1e-11), 1.0, 1e-3)
    angle = speed * motion.t
    arm = motion.body("out")
    found = np.array([rotation_matrix(p)[:, 1] for p in arm.p]) @ R  # y of the output in its bearing
    turned = np.unwrap(np.arctan2(found[:, 2], found[:, 1]))
    exact = np.unwrap(np.arctan2(np.sin(angle) * np.cos(b), np.cos(angle)))
    assert_allclose(turned, exact, rtol=0, atol=1e-6)


def test_driven_joints_follow_their_motion_and_tell_the_torque():
    """A wheel: torque I f''; a block on a rail: force m f''."""
    wheel = RigidBody("wheel", 1.0, np.diag([0.4, 0.4, 0.7]))
    block = RigidBody("block", 3.0, np.eye(3))
    swing = harmonic(0.5, 4.0)
    system = System(
        [wheel, block],
        [
            RevoluteJoint("hub", GROUND, Marker("wheel"), axis=(0, 0, 1), motions={"angle": swing}),
            PrismaticJoint("rail", GROUND, Marker("block"), axis=(1, 0, 0), motions={"distance": swing}),
        ],
    )
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-12), 1.0, 1e-3)
    angle = 0.5 * np.sin(4 * motion.t)
    p = motion.body("wheel").p
    assert_allclose(2 * np.arctan2(p[:, 3], p[:, 0]), angle, rtol=0, atol=1e-11)
    assert_allclose(motion.body("block").r[:, 0], angle, rtol=0, atol=1e-12)
    on_ground = motion.reaction("hub").moment[:, 2], motion.reaction("rail").force[:, 0]
    assert_allclose(on_ground[0], 0.7 * 16 * angle, rtol=0, atol=2e-4)
    assert_allclose(on_ground[1], 3.0 * 16 * angle, rtol=0, atol=1e-3)
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 1e-4 * np.ptp(motion.energies.kinetic)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RevoluteJoint("j", GROUND, Marker("b"), motions={"turn": 1.0}), "no coordinate 'turn'; choices"),
        (lambda: RevoluteJoint("j", GROUND, Marker("b"), motions={"angle": np.sin}), "can be sampled with"),
        (lambda: ScrewJoint("j", GROUND, Marker("b"), lead=0.0), "lead: expected a number other than zero"),
        (lambda: DistanceJoint("j", GROUND, Marker("b"), distance=-1.0), "distance: expected a number above 0"),
    ],
)  # fmt: skip
def test_impossible_joints_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


def test_a_rod_without_direction_is_refused():
    body = RigidBody("b", 1.0, np.eye(3))
    with pytest.raises(ModelError, match="its points coincide as placed"):
        _ = compiled_system(System([body], [DistanceJoint("j", Marker(GROUND), Marker("b"))]))


def test_both_angles_of_a_universal_joint_are_what_its_drives_say():
    system = pair(DRIVEN["universal twice"])
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-11), 0.3, 1e-3)
    found = measured(system, motion, coordinate_sensors(system))
    assert set(found) == {"j.angle", "j.angle_b"}
    for coordinate in found.values():
        assert_allclose(coordinate.value, [DRIVE(t) for t in motion.t], rtol=0, atol=1e-9)
    energy = motion.energies
    power = sum(each.force * each.rate for each in found.values())
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(motion.t))])
    assert_allclose(energy.work, work, rtol=0, atol=1e-3 * np.abs(work).max())


def test_screw_driven_by_its_distance_takes_the_force_of_its_turning_inertia():
    """m x'' + J (2 pi/lead)² x'' along the drive; angle and distance in their fixed ratio."""
    lead, J, m = 0.7, 0.05, 2.0
    nut = RigidBody("nut", m, np.diag([0.1, 0.1, J]))
    x = polynomial_of_time([0.0, 0.0, 0.2, 0.3])
    slope = lead / (2 * np.pi)
    for name, motion in (("distance", x), ("angle", polynomial_of_time([0.0, 0.0, 0.2 / slope, 0.3 / slope]))):
        screw = ScrewJoint("j", GROUND, Marker("nut"), axis=(0, 0, 1), lead=lead, motions={name: motion})
        system = System([nut], [screw])
        found = measured(system, integrate(system, GeneralizedAlpha(0.9, 1e-12), 1.0, 1e-3), coordinate_sensors(system))
        along, about = found["j.distance"], found["j.angle"]
        assert_allclose(along.value, [x(t) for t in along.t], rtol=0, atol=1e-9)
        assert_allclose(about.value, along.value / slope, rtol=0, atol=1e-9)
        assert_allclose(along.force, [(m + J / slope**2) * x(t, 2) for t in along.t], rtol=0, atol=1e-3)
        assert_allclose(about.force, along.force * slope, rtol=1e-12, atol=0)


def test_coordinates_of_driven_joints_are_their_motions_and_forces_those_of_newton():
    """Rate and value as prescribed; torque I f'', force m f''; flexible bodies too."""
    system = pair(DRIVEN["cylindrical"])
    motion = integrate(system, GeneralizedAlpha(0.8, 1e-11), 0.3, 1e-3)
    found = measured(system, motion, coordinate_sensors(system))
    assert set(found) == {"j.distance", "j.angle"}
    for coordinate in found.values():
        assert_allclose(coordinate.value, [DRIVE(t) for t in motion.t], rtol=0, atol=1e-9)
        assert_allclose(coordinate.rate, [DRIVE(t, 1) for t in motion.t], rtol=0, atol=1e-4)
    wheel = RigidBody("wheel", 1.0, np.diag([0.4, 0.4, 0.7]))
    hub = RevoluteJoint("hub", GROUND, Marker("wheel"), axis=(0, 0, 1), motions={"angle": harmonic(0.5, 4.0)})
    one = System([wheel], [hub])
    turned = JointCoordinate("hub", "angle").measure(one, integrate(one, GeneralizedAlpha(0.9, 1e-12), 1.0, 1e-3))
    assert_allclose(turned.force, -0.7 * 16 * turned.value, rtol=0, atol=2e-4)
    with pytest.raises(ResultsError, match="no coordinate 'turn'"):
        JointCoordinate("hub", "turn").measure(one, integrate(one, GeneralizedAlpha(), 0.01, 1e-3))


MOVES = {name: make for name, (make, _) in JOINTS.items() if make(Marker("a"), Marker("b")).coordinates}
MOVES["distance"] = DRIVEN["distance"]  # else it keeps its length


@pytest.mark.parametrize("make", MOVES.values(), ids=MOVES)
def test_rates_of_coordinates_between_two_flying_bodies_are_the_slopes_of_their_values(make):
    system = pair(make)
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-11), 0.1, 5e-4)
    for name, coordinate in measured(system, motion, coordinate_sensors(system)).items():
        slope = (coordinate.value[2:] - coordinate.value[:-2]) / (motion.t[2:] - motion.t[:-2])
        assert np.abs(coordinate.rate).max() > 0.05, name
        assert_allclose(slope, coordinate.rate[1:-1], rtol=0, atol=2e-5 * np.abs(coordinate.rate).max(), err_msg=name)


def cheap_rates(model_table, work_table):
    model, work = as_model(model_table), as_work(work_table)
    for c in range(model.connections.size.shape[0]):
        write_velocity_gaps(model, work, c, -1.0, work.connections.rate)


compiled_cheap_rates = entry(cheap_rates, cache=False)  # inner functions have no machine code of their own


@pytest.mark.parametrize("make", CASES)
def test_cheap_rates_of_held_positions_are_their_rates(make):
    """At an open joint with any velocities; the second route is that which differences along a motion confirm."""
    iterate = Iterate(pair(make), 1)
    model, work = iterate.model, iterate.work
    work.state.time[...] = 0.37
    iterate.residual(np.zeros_like(iterate.u), np.zeros_like(iterate.w))
    rate, _ = rates_of_constraints(model, work)
    work.connections.g[:], work.connections.rate[:] = 0.0, np.nan
    compiled_cheap_rates(model.table, work.table)
    rows = is_held_position(model.rows.kind)
    assert np.abs(rate[rows]).min() > 1e-3
    assert_allclose(work.connections.rate[rows], rate[rows], rtol=0, atol=1e-12 * np.abs(rate).max())
    assert (work.connections.rate[~rows] == 0.0).all()
