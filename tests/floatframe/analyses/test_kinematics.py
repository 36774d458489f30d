"""Driven motion against closed forms and equilibria; what is free or singular is named."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    kinematics,
    read_results,
    static_equilibrium,
)
from floatframe.analyses import consistent_state, frozen_bodies, quasi_static_bodies, steady_rotation
from floatframe.analyses.snapshot import snapshot
from floatframe.components.mechanisms import double_pendulum, four_bar, slider_crank
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.joints import (
    CoordinateCoupler,
    CylindricalJoint,
    DistanceJoint,
    JointCoordinate,
    PointOnPlane,
    RollingDisc,
    ScrewJoint,
    UniversalJoint,
)
from floatframe.model.functions.time_functions import constant, harmonic, polynomial_of_time
from floatframe.model.rotations import rotation_matrix
from floatframe.results.sensors import coordinate_sensors
from floatframe.results.small_motions.joint_rates import coordinate_rows
from floatframe.sensors import measured
from tests.floatframe.examples import parallelogram
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

R, LENGTH, OMEGA, START = 0.15, 0.35, 20.0, 0.3
CRANK = slider_crank(crank=R, rod=LENGTH, drive=polynomial_of_time([0, OMEGA]), angle=START)
ROUNDOFF = 1e-12


def slider_of(angle):
    """Place of the slider, and its first and second derivative by the crank angle."""
    s, c = np.sin(angle), np.cos(angle)
    root = np.sqrt(LENGTH**2 - (R * s) ** 2)
    first = -R * s - R**2 * s * c / root
    second = -R * c - R**2 * (c**2 - s**2) / root - (R**2 * s * c) ** 2 / root**3
    return R * c + root, first, second


@pytest.mark.parametrize("n_times", [20, 4])
def test_slider_of_a_driven_crank_is_that_of_the_closed_form_however_far_the_times_are_apart(n_times):
    motion = kinematics(CRANK, np.linspace(0, 0.5, n_times + 1))
    x, x1, x2 = slider_of(START + OMEGA * motion.t)
    slider = motion.body("slider")
    assert_allclose(slider.r[:, 0], x, rtol=0, atol=ROUNDOFF)
    assert_allclose(slider.v[:, 0], OMEGA * x1, rtol=0, atol=ROUNDOFF * OMEGA)
    assert_allclose(slider.v_dot[:, 0], OMEGA**2 * x2, rtol=0, atol=ROUNDOFF * OMEGA**2)
    assert motion.drift("pin").distance.max() < ROUNDOFF


def test_work_of_the_drive_is_the_energy_of_the_mechanism():
    defects = []
    for n_times in (50, 100):
        energies = kinematics(CRANK, np.linspace(0, 0.5, n_times + 1)).energies
        defects.append(np.abs(energies.balance - energies.balance[0]).max() / np.ptp(energies.kinetic))
    assert defects[1] < 0.05
    assert_allclose(defects[0] / defects[1], 4, rtol=0.1)  # the work is summed by the trapezoidal rule


def test_rocker_of_a_driven_four_bar_is_that_of_the_integrated_motion():
    system = four_bar(drive=harmonic(1.0, 3.0))
    motion = kinematics(system, np.linspace(0, 1, 11))
    computed = integrate(system, GeneralizedAlpha(0.8), 1.0, 1e-3, output_every=100)
    for name, found in measured(system, motion, coordinate_sensors(system)).items():
        other = measured(system, computed, coordinate_sensors(system))[name]
        assert_allclose(found.value, other.value, rtol=0, atol=1e-7)
        assert_allclose(found.rate, other.rate, rtol=0, atol=1e-4)


def arm(K, points, drive, **gravity):
    """A flexible body on a driven hinge, away from its axis."""
    body = FlexibleBody("arm", reduced_body(points, K), position=-points.c[np.argmin(points.c[:, 0])])
    hinge = RevoluteJoint("hinge", GROUND, Marker("arm", "end_b"), axis=(0, 1, 0), motions={"angle": drive})
    return System([body], [hinge], [Gravity((0, 0, -9.81))] if gravity.get("gravity") else [])


POINTS = random_point_masses(3, 5, softness=0.1)
STIFF = stiffness(3, omega=30.0)


def test_held_body_deforms_as_in_its_equilibrium():
    system = arm(STIFF, POINTS, constant(0.0), gravity=True)
    motion = kinematics(system, [0.0, 1.0], elasticity=quasi_static_bodies)
    rest = static_equilibrium(system, tolerance=1e-12)
    assert np.abs(rest.state.q).max() > 1e-3
    for row in motion.body("arm").q:
        assert_allclose(row, rest.state.q, rtol=0, atol=1e-9 * np.abs(rest.state.q).max())
    assert_allclose(motion.reaction("hinge").force[1], rest.w[:3], rtol=1e-9, atol=1e-9)


def test_body_turned_steadily_deforms_as_in_its_steady_rotation():
    speed = 5.0
    motion = kinematics(
        arm(STIFF, POINTS, polynomial_of_time([0, speed])), [0.0, 0.7, 1.3], elasticity=quasi_static_bodies
    )
    free = arm(STIFF, POINTS, constant(0.0))
    free = System(free.bodies, [RevoluteJoint("hinge", GROUND, Marker("arm", "end_b"), axis=(0, 1, 0))])
    turning = steady_rotation(free, (0, speed, 0), tolerance=1e-12)
    assert np.abs(turning.state.q).max() > 1e-3
    for row in motion.body("arm").q:
        assert_allclose(row, turning.state.q, rtol=0, atol=1e-8 * np.abs(turning.state.q).max())


def test_frozen_bodies_keep_their_shape():
    system = arm(STIFF, POINTS, harmonic(1.0, 2.0), gravity=True)
    motion = kinematics(system, np.linspace(0, 1, 5), elasticity=frozen_bodies)
    assert not motion.body("arm").q.any()
    assert motion.body("arm").r.any()


def test_quasi_static_motion_is_the_slow_limit_of_the_integrated_one():
    """The difference is the inertia of the modes, which falls with the square of the speed."""
    stiff = stiffness(3, omega=300.0)
    errors = []
    for slowness in (1.0, 2.0):
        system = arm(stiff, POINTS, polynomial_of_time([0, 0, 0, 1.0 / slowness**3]), gravity=True)
        t_end = 0.6 * slowness
        motion = kinematics(system, [0.0, t_end], elasticity=quasi_static_bodies)
        start = kinematics(system, [0.0, 1e-6], elasticity=quasi_static_bodies).state(0)
        computed = integrate(system, GeneralizedAlpha(0.8), t_end, t_end / 3000, state=start, output_every=3000)
        errors.append(np.abs(computed.body("arm").q[-1] - motion.body("arm").q[-1]).max())
        assert errors[-1] < 2e-3 * np.abs(motion.body("arm").q[-1]).max()
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (slider_crank(), r"not fully driven: 'main.angle' is free \(driven: nothing\)"),
        (double_pendulum(), "'hinge 1.angle', 'hinge 2.angle' are free"),
        (System([RigidBody("stone", 1.0, np.eye(3))]), "6 motions of 'stone' that change no joint coordinate"),
        (
            System(
                double_pendulum().bodies,
                [
                    RevoluteJoint("a", GROUND, Marker("rod 1"), motions={"angle": 0.0}),
                    RevoluteJoint("b", Marker("rod 1", position=(1, 0, 0)), Marker("rod 2")),
                ],
            ),
            r"'b.angle' is free \(driven: a.angle\)",
        ),
    ],
)
def test_what_is_free_is_named(system, words):
    with pytest.raises(ModelError, match=words):
        kinematics(system, [0.0, 1.0])


def driven_parallelogram(drive):
    system = parallelogram(0.4)
    main = system.joints[0]
    return System(
        system.bodies,
        [RevoluteJoint("main", main.marker_a, main.marker_b, motions={"angle": drive}), *system.joints[1:]],
    )


def test_singular_position_is_named_whether_it_is_met_or_passed():
    at = driven_parallelogram(polynomial_of_time([0, -0.4]))
    with pytest.raises(ConvergenceError, match=r"singular position at t = 1: the constraints of joints .*'pin'") as met:
        kinematics(at, np.linspace(0, 2, 11))
    with pytest.raises(ConvergenceError, match=r"singular position between t = 0\.8\d* and 1\.\d*") as passed:
        kinematics(at, np.linspace(0, 2, 10))
    for error in (met, passed):
        assert 3 <= len(error.value.trajectory.t) < 7
        assert not error.value.trajectory.is_complete


def test_drive_out_of_reach_leaves_the_motion_so_far_in_the_file(tmp_path):
    plain = slider_crank(crank=R, rod=LENGTH, angle=1.0)
    place = slider_of(1.0)[0]
    guide = plain.joints[3]
    driven = replace(guide, motions={"distance": polynomial_of_time([place, 0.1])})
    system = System(plain.bodies, [*plain.joints[:3], driven])
    with pytest.raises(ConvergenceError, match=r"t = 0\.9\d*: joint .*beyond the reach.*the motion so far is in"):
        kinematics(system, np.linspace(0, 2, 41), output=tmp_path / "out.h5")
    part = read_results(tmp_path / "out.h5")
    assert not part.is_complete
    assert part.t[-1] <= (R + LENGTH - place) / 0.1
    assert part.t[-1] > (R + LENGTH - place) / 0.1 - 0.1


def test_results_in_a_file_are_those_in_memory(tmp_path):
    times = np.linspace(0, 0.1, 6)
    memory = kinematics(CRANK, times)
    file = kinematics(CRANK, times, output=tmp_path / "crank.h5")
    for name in ("position", "u", "u_dot", "w", "diagnostics"):
        assert_allclose(file.source.read(name), memory.source.read(name), rtol=0, atol=0)
    assert file.head.run["integrator"] == "Kinematics"
    assert file.is_complete
    value = JointCoordinate("main", "angle").measure(CRANK, file).value
    assert_allclose(value, OMEGA * times, rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("times", [[0.0], [0.0, 0.0], [[0.0, 1.0]], [0.0, np.nan]])
def test_impossible_times_are_refused(times):
    with pytest.raises(ModelError, match="at least two increasing numbers"):
        kinematics(CRANK, times)


@pytest.mark.parametrize(
    "joint",
    [
        UniversalJoint("j", GROUND, Marker("body"), axis=(1, 0, 0), axis_b=(0, 1, 0)),
        ScrewJoint("j", GROUND, Marker("body"), axis=(0, 0, 1), lead=0.3),
        CylindricalJoint("j", GROUND, Marker("body"), axis=(0.6, 0, 0.8)),
        DistanceJoint("j", Marker(GROUND), Marker("body", position=(1, 2, 0.5)), 2.0),
        PointOnPlane("j", GROUND, Marker("body"), axis=(0, 0, 1)),
    ],
)
def test_rates_of_joint_coordinates_are_those_of_the_motion(joint):
    body = RigidBody("body", 1.0, np.eye(3), omega_B=(0.3, 0.4, 0.5), velocity=(0.1, -0.2, 0.3))
    system = System([body], [joint])
    found = consistent_state(system)
    motion = snapshot(system, found.state, found.u_dot, found.w)
    work = new_work(compiled_system(system).model)
    set_iterate(work, found.state)
    rows = coordinate_rows(system, compiled_system(system), work, found.state)
    R = rotation_matrix(found.state.p[0])
    u = np.concatenate([R.T @ found.state.u[:3], found.state.u[3:]])
    assert set(rows) == {f"j.{name}" for name in joint.coordinates}
    for name, row in rows.items():
        assert_allclose(row @ u, measured(system, motion, coordinate_sensors(system))[name].rate[0], rtol=0, atol=1e-12)


def test_gears_pass_the_motion_of_a_drive_on():
    wheels = [RigidBody(f"wheel {k}", 1.0, np.eye(3), position=(k, 0, 0)) for k in (1, 2)]
    hinges = [RevoluteJoint("one", GROUND, Marker("wheel 1"), motions={"angle": harmonic(1.0, 2.0)}),
              RevoluteJoint("two", Marker(GROUND, position=(2, 0, 0)), Marker("wheel 2"))]  # fmt: skip
    gear = CoordinateCoupler("gear", [(JointCoordinate("one", "angle"), 20.0), (JointCoordinate("two", "angle"), 50.0)])
    with pytest.raises(ModelError, match=r"'two.angle' is free"):
        kinematics(System(wheels, hinges), [0.0, 1.0])
    system = System(wheels, hinges, couplers=[gear])
    motion = kinematics(system, np.linspace(0, 2, 9))
    one, two = (JointCoordinate(name, "angle").measure(system, motion) for name in ("one", "two"))
    assert_allclose(two.value, -0.4 * one.value, rtol=0, atol=1e-11)
    assert_allclose(one.force, -(1 + 0.4**2) * 4.0 * np.sin(2 * motion.t), rtol=0, atol=1e-11)


def test_rolling_is_refused():
    disc = RigidBody("disc", 1.0, np.eye(3), position=(0, 0, 1.0))
    with pytest.raises(ModelError, match="joint 'roll' rolls: it constrains velocities"):
        kinematics(System([disc], [RollingDisc("roll", Marker(GROUND), Marker("disc"), radius=1.0)]), [0.0, 1.0])
