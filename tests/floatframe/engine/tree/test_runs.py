"""Runs in relative coordinates: events, controlled steps, restarts, files, and what is refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.components.mechanisms import chain, double_pendulum, four_bar, slider_crank
from floatframe.engine.tree.topology import tree_of
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.system_file.read_system import read_system
from floatframe.forces import Bushing
from floatframe.integrators import EnergyMomentum
from floatframe.model.functions.time_functions import harmonic
from floatframe.simulation import Event, resume
from tests.floatframe.engine.tree.examples import rubbed_block
from tests.floatframe.engine.tree.mechanisms import DOWN, beam, falling
from tests.floatframe.simulation.examples import StopHereError


def test_a_stop_is_found_where_it_is_in_both_formulations():
    """An event on a joint coordinate ends the run at one time."""
    system = double_pendulum(angles=(0.3, -1.0))
    hinge = system.joints[1].name
    stopped = System(system.bodies, system.joints, system.forces, events=[
        Event("there", f"{hinge}.angle", level=0.4, stop=True)])  # fmt: skip
    times = [
        integrate(stopped, GeneralizedAlpha(1.0, 1e-11), 2.0, 1e-3, formulation=formulation).head.summary["events"][0][
            "t"
        ]
        for formulation in ("absolute", "relative")
    ]
    assert 0.1 < times[0] < 1.9
    assert_allclose(times[1], times[0], rtol=0, atol=2e-5)


def test_controlled_steps_keep_the_error_that_is_asked_for():
    """Against a motion with small fixed steps; a smaller tolerance takes more steps and errs less."""
    system = double_pendulum(angles=(0.3, -1.0))
    exact = integrate(system, GeneralizedAlpha(1.0, 1e-12), 1.0, 1e-4, output_every=1000, formulation="relative")
    errors, counts = [], []
    for tolerance in (1e-6, 1e-8):
        method = GeneralizedAlpha(1.0, 1e-12, error_tolerance=tolerance)
        motion = integrate(system, method, 1.0, 0.1, formulation="relative")
        errors.append(np.abs(motion.body("rod 2").r - exact.body("rod 2").r).max())
        counts.append(motion.head.summary["n_steps"])
    assert counts[1] > 3 * counts[0]
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] < 1e-4


def test_a_loose_tolerance_leaves_far_less_than_the_error_of_the_step():
    """Links with modes that the step does not resolve, where it ends early by what the next correction should be."""
    system, h, t_end = chain(5, angles=(0.3, -0.2, 0.1, 0.4, -0.3), rod=beam()), 2e-3, 0.2

    def places(tolerance, every=1, formulation="relative"):
        method = GeneralizedAlpha(tolerance=tolerance)
        motion = integrate(system, method, t_end, h / every, output_every=10 * every, formulation=formulation)
        return np.hstack([motion.body(body.name).r for body in system.bodies])

    fine, tight, loose = places(1e-10, 8), places(1e-12), places(1e-6)
    error = np.sqrt(np.mean((tight - fine) ** 2))
    assert np.sqrt(np.mean((loose - tight) ** 2)) < 0.1 * error
    absolute = places(1e-6, formulation="absolute")
    assert np.sqrt(np.mean((loose - fine) ** 2)) < 1.2 * np.sqrt(np.mean((absolute - fine) ** 2))


@pytest.mark.parametrize("name", ["chain", "loop"])
def test_a_resumed_run_is_the_uninterrupted_one_bit_for_bit(name, tmp_path):
    """With factors of the Newton matrix that outlive a step."""
    system = falling(four_bar(angle=1.0)) if name == "loop" else chain(3, angles=(0.3, -0.5, 1.0))
    h, t_end, path = 1e-3, 0.9, tmp_path / "run.h5"

    def stop(progress):
        if progress.t > 0.5:
            raise StopHereError

    whole = integrate(system, GeneralizedAlpha(), t_end, h, output_every=10, formulation="relative")
    other = integrate(system, GeneralizedAlpha(), t_end, h, output_every=10, formulation="relative", batch_steps=70)
    with pytest.raises(StopHereError):
        integrate(
            system, GeneralizedAlpha(), t_end, h, output_every=10, formulation="relative", output=path, progress=stop
        )
    again = resume(system, path)
    for motion in (other, again):
        for body in system.bodies:
            assert_array_equal(motion.body(body.name).r, whole.body(body.name).r)
        assert_array_equal(motion.energies.total, whole.energies.total)


def test_a_system_file_asks_for_the_formulation(tmp_path):
    text = """
[system]
units = "m-kg-s"
gravity = [0, -9.81, 0]
[bodies.bob]
mass = 1.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
position = [1.0, 0.0, 0.0]
[joints.hinge]
type = "spherical"
body_a = "ground"
body_b = "bob"
marker_b = [-1.0, 0.0, 0.0]
[run]
t_end = 0.1
h = 1e-2
formulation = "relative"
"""
    path = tmp_path / "swing.toml"
    path.write_text(text)
    system, run = read_system(path)
    motion = integrate(system, run.integrator, run.t_end, run.h)
    assert motion.head.run["integrator"] == "RelativeGeneralizedAlpha"
    assert motion.drift("hinge").distance.max() < 1e-15
    path.write_text(text + 'scheme = "energy-momentum"\n')
    with pytest.raises(SystemFileError, match="energy-momentum works only in absolute coordinates"):
        read_system(path)


def test_formulations_that_are_none_are_refused():
    with pytest.raises(ModelError, match="formulation: expected one of absolute, relative, got 'joint'"):
        integrate(chain(1), GeneralizedAlpha(), 0.1, 0.01, formulation="joint")
    with pytest.raises(ModelError, match="EnergyMomentum works in absolute coordinates alone"):
        integrate(chain(1), EnergyMomentum(), 0.1, 0.01, formulation="relative")


def test_loops_are_cut_where_the_fewest_constraints_are_left():
    """The ball of a four-bar linkage rather than its hinges; a point on a line has no chart; tree as given twice."""
    assert tree_of(four_bar()).cut == ("pin",)
    parts = tree_of(slider_crank())
    assert parts.cut == ()
    assert parts.constrained == ("gudgeon",)
    assert parts.coordinates == ("main/angle", "pin/angle", "guide/distance")
    for one, other in zip(tree_of(four_bar()).tree, tree_of(four_bar()).tree, strict=True):
        assert_array_equal(one, other)


def test_friction_by_the_normal_force_keeps_a_joint_a_constraint_and_others_not():
    """A block pushed along a rail: both formulations brake it alike."""
    system = rubbed_block()
    assert tree_of(system).constrained == ("rail",)
    assert tree_of(system).coordinates[-1] == "hinge/angle"
    motions = [
        integrate(system, GeneralizedAlpha(0.8, 1e-10), 0.3, 1e-3, formulation=formulation)
        for formulation in ("absolute", "relative")
    ]
    assert_allclose(motions[1].body("block").r, motions[0].body("block").r, rtol=0, atol=2e-6)


def test_a_loop_that_repeats_constraints_is_told_by_the_names_of_its_joints():
    """Four parallel hinges in the plane hold more than they need."""
    bars = [
        RigidBody(name, 1.0, np.eye(3), position=place) for name, place in
        (("left", (0.0, 0.5, 0.0)), ("top", (0.5, 1.0, 0.0)), ("right", (1.0, 0.5, 0.0)))
    ]  # fmt: skip
    joints = [
        RevoluteJoint("a", GROUND, Marker("left", position=(0.0, -0.5, 0.0))),
        RevoluteJoint("b", Marker("left", position=(0.0, 0.5, 0.0)), Marker("top", position=(-0.5, 0.0, 0.0))),
        RevoluteJoint("c", Marker("top", position=(0.5, 0.0, 0.0)), Marker("right", position=(0.0, 0.5, 0.0))),
        RevoluteJoint("d", Marker(GROUND, position=(1.0, 0.0, 0.0)), Marker("right", position=(0.0, -0.5, 0.0))),
    ]
    with pytest.raises(ModelError, match="3 of 20 constraints repeat others"):
        integrate(System(bars, joints, [DOWN]), GeneralizedAlpha(), 0.1, 0.01, formulation="relative")
    shared = System(bars, joints, [DOWN], redundant="minimum-norm")
    absolute = integrate(shared, GeneralizedAlpha(0.8, 1e-10), 0.2, 1e-3)
    relative = integrate(shared, GeneralizedAlpha(0.8, 1e-10), 0.2, 1e-3, formulation="relative")
    assert_allclose(relative.body("top").r, absolute.body("top").r, rtol=0, atol=1e-6)


def test_a_ball_turns_over_and_over_without_a_singular_place():
    """A body on a spherical joint through many turns about a changing axis: energy by the order of the method."""
    body = RigidBody("body", 1.0, np.diag([1.0, 2.0, 2.7]), position=(0.2, 0.1, 0.0), omega_B=(8.0, 0.3, 4.0))
    system = System([body], [SphericalJoint("ball", GROUND, Marker("body", position=(-0.2, -0.1, 0.0)))])
    drift = [
        np.ptp(integrate(system, GeneralizedAlpha(1.0, 1e-12), 3.0, h, formulation="relative").energies.total)
        for h in (1e-2, 5e-3)
    ]
    assert drift[1] < 0.3 * drift[0]
    assert drift[1] < 1e-2 * 40


@pytest.mark.parametrize("n_steps", [80, 640])
def test_the_work_of_a_drive_against_a_spring_is_the_energy_in_it(n_steps):
    """Nothing is left to solve for but the force of the bushing: a driven slide is at its place at once."""
    K = np.diag([1e4, 1e4, 1e4, 10.0, 10.0, 10.0])
    slide = PrismaticJoint(
        "slide", Marker(GROUND, position=np.zeros(3)), Marker("body", position=np.zeros(3)), axis=(1, 0, 0),
        motions={"distance": harmonic(0.1, 5.0)},
    )  # fmt: skip
    spring = Bushing("spring", Marker(GROUND, position=np.zeros(3)), Marker("body", position=np.zeros(3)), K)
    system = System([RigidBody("body", 1.0, np.eye(3), velocity=(0.5, 0, 0))], [slide], [spring])
    energies = integrate(system, GeneralizedAlpha(0.8), 1.0, 1.0 / n_steps, formulation="relative").energies
    stored = energies.kinetic + energies.springs
    of_power = 2 * 1e4 * (0.1 * 5.0) ** 2  # change of the rate of the power K x x_dot
    assert np.abs(energies.work - (stored - stored[0])).max() < 1.1 * of_power / 12 / n_steps**2  # trapezoidal rule
