"""Systems that cannot be: one message that says what, where and what to do, exit code 2, and nothing half-written."""

from dataclasses import replace

import numpy as np
import pytest

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.analyses import consistent_state
from floatframe.analyses.system_check import check_system
from floatframe.components.mechanisms import slider_crank
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.simulation.step_advice import step_advice
from tests.floatframe.command import run_floatframe
from tests.floatframe.examples import CRANK, TURN, parallelogram
from tests.floatframe.point_masses import random_point_masses, reduced_body

PUSH = '\n[joints.guide.motions.distance]\ntype = "polynomial"\ncoefficients = [{}, {}]\n'


def refused(folder, text, command="run"):
    """Run the command on a file that it must refuse; return the message."""
    (folder / "crank.toml").write_text(text)
    result = run_floatframe(command, folder / "crank.toml", code=2)
    errors = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1
    assert "Traceback" not in result.output
    return errors[0]


@pytest.mark.parametrize(("old", "new", "words"), [
    # impossible assembly: the rod is too short to reach
    ("marker_a = [0, 0, 0]\nmarker_b = [0, 0, 0]", "marker_a = [0, 2, 0]\nmarker_b = [0, 0, 0]",
     ["cannot be closed", "is open by", "check lengths"]),
    # unknown names
    ('body_b = "rod"\nmarker_a = [0.2', 'body_b = "rot"\nmarker_a = [0.2', ["joints.pin.body_b", "did you mean 'rod'"]),
    ("[run]", '[forces.motor]\ntype = "joint-force"\njoint = "mian"\ncoordinate = "angle"\npreload = 1.0\n[run]',
     ["no joint 'mian'", "did you mean 'main'"]),
    ("[run]", '[forces.motor]\ntype = "joint-force"\njoint = "main"\ncoordinate = "angel"\npreload = 1.0\n[run]',
     ["no coordinate 'angel'", "did you mean 'angle'"]),
    ("marker_a = [0.2, 0, 0]", 'marker_a = "end"', ["body 'crank' is not flexible and has no interface 'end'"]),
    # no mass, no inertia about an axis
    ("mass = 1.0\ninertia = [[1e-3, 0, 0], [0, 0.03", "mass = 0\ninertia = [[1e-3, 0, 0], [0, 0.03",
     ["bodies.rod.mass = 0: expected a number above 0"]),
    ("inertia = [[1e-3, 0, 0], [0, 0.03, 0]", "inertia = [[0, 0, 0], [0, 0.03, 0]",
     ["'rod'", "no inertia about its axis [1, 0, 0]", "distance joint"]),
])  # fmt: skip
def test_impossible_systems_are_refused_by_the_command(tmp_path, old, new, words):
    assert CRANK.count(old) == 1
    message = refused(tmp_path, CRANK.replace(old, new))
    for word in words:
        assert word in message
    assert [path.name for path in tmp_path.iterdir()] == ["crank.toml"]


@pytest.mark.parametrize("place", [0.565685424949, 0.7])
def test_drives_that_prescribe_one_motion_are_named_whether_they_agree_or_not(tmp_path, place):
    message = refused(tmp_path, CRANK.replace("\n[run]", TURN + PUSH.format(place, 0.0) + "\n[run]"))
    assert "conflicting drives: the drive of 'distance' of joint 'guide' and the drive of 'angle' of" in message
    assert "remove one of them" in message


def test_a_drive_against_what_the_joints_hold_is_named():
    bar = RigidBody("bar", 1.0, np.eye(3))
    hinges = [
        RevoluteJoint("one", GROUND, Marker("bar"), axis=(0, 0, 1)),
        RevoluteJoint("two", GROUND, Marker("bar", position=(1, 0, 0)), axis=(0, 0, 1), motions={"angle": 0.0}),
    ]
    with pytest.raises(ModelError, match="the drive of 'angle' of joint 'two' prescribes a motion that the joints"):
        consistent_state(System([bar], hinges))


def test_a_drive_past_the_reach_of_the_mechanism_tells_time_joint_and_advice_and_keeps_the_results(tmp_path):
    """The block goes outward from 0.566 to 0.8 = crank + rod, the dead point, which it reaches after 0.047 at 5."""
    message = refused(tmp_path, CRANK.replace("\n[run]", PUSH.format(0.565685424949, 5.0) + "\n[run]"))
    for words in (
        "from t = 0.0",
        "joint 'g",
        "singular position",
        "a drive out of reach",
        "the motion so far is in",
        "which floatframe plot, animate and info can read",
    ):
        assert words in message
    assert (tmp_path / "crank.h5.segments").is_dir()
    for command in ("plot", "info"):
        result = run_floatframe(command, tmp_path / "crank.h5.segments", code=0)
    assert "did not reach its end" in result.stdout


def test_a_singular_position_at_the_start_is_told_from_redundant_joints():
    consistent_state(parallelogram(0.4))
    with pytest.raises(ModelError, match=r"a singular position: .* begin in another position"):
        consistent_state(parallelogram(0.0))


def test_gravity_of_another_unit_system_is_noted(tmp_path, caplog):
    path = tmp_path / "crank.toml"
    path.write_text(CRANK.replace('"m-kg-s"', '"mm-t-s"').replace("t_end = 0.5", "t_end = 1e-3"))
    run_floatframe("run", path)
    assert "gravity is 9.81 mm/s², but on earth 9806.65: is it in other units?" in caplog.text


def test_inertia_of_a_giant_is_noted(tmp_path, caplog):
    path = tmp_path / "crank.toml"
    path.write_text(CRANK.replace("inertia = [[1e-3, 0, 0], [0, 0.03, 0], [0, 0, 0.03]]",
                                  "inertia = [[1e4, 0, 0], [0, 3e5, 0], [0, 0, 3e5]]"))  # fmt: skip
    run_floatframe("check", path)
    assert "rigid body 'rod' has mass and inertia of a part with a radius of gyration of 548 m" in caplog.text
    caplog.clear()
    path.write_text(CRANK)
    run_floatframe("check", path)
    assert not caplog.text


POINTS = random_point_masses(3, 5, softness=1e-3)
OMEGA = 2 * np.pi * np.array([5.0, 40.0, 1000.0])


def vibrating():
    K = np.diag(np.diag(POINTS.moments().M) * OMEGA**2)
    pin = SphericalJoint("pin", GROUND, Marker("rod", "end_a"))
    return System([FlexibleBody("rod", reduced_body(POINTS, K))], [pin], [Gravity((0, 0, -9.81))])


def test_what_a_step_size_follows_of_the_modes_is_said_in_numbers():
    advice = step_advice(vibrating(), 1e-3)
    assert (advice.n_modes, advice.n_followed, advice.n_unseen) == (3, 2, 1)
    np.testing.assert_allclose([advice.slowest, advice.fastest], [5.0, 1000.0], rtol=1e-12)
    np.testing.assert_allclose([advice.h_slowest, advice.h_fastest], [1 / 100, 1 / 20000], rtol=1e-12)
    assert "resolves 2 of 3 modes" in advice.words
    assert "mode 3 of body 'rod', has 1 steps in its period of 0.001: the slowest mode needs h = 0.01" in advice.words
    assert step_advice(slider_crank(), 1e-3) is None


def test_a_step_size_that_follows_no_mode_is_noted_and_one_that_fails_is_advised(caplog):
    integrate(vibrating(), GeneralizedAlpha(), 0.1, 0.05)
    assert "h = 0.05 resolves 0 of 3 modes" in caplog.text
    caplog.clear()
    integrate(vibrating(), GeneralizedAlpha(), 0.01, 0.005)
    assert "follows" not in caplog.text
    with pytest.raises(ConvergenceError, match=r"h = 0.5 resolves 0 of 3 modes .* the slowest mode needs h = 0.01"):
        integrate(vibrating(), GeneralizedAlpha(max_iterations=2), 1.0, 0.5)


def test_a_check_says_of_a_step_what_the_run_says(caplog):
    system = vibrating()
    integrate(system, GeneralizedAlpha(), 0.1, 0.049)  # three steps of 1/30
    by_name = {each.name: each for each in check_system(system, t_end=0.1, h=0.049)}
    assert by_name["body modes"].verdict == "warn"
    assert f"system 'system': {by_name['body modes'].reason}" in caplog.messages
    with pytest.raises(ModelError) as refused:
        integrate(system, GeneralizedAlpha(), 0.1, 0.4)
    last = [each for each in check_system(system, t_end=0.1, h=0.4) if each.name == "step"][-1]
    assert (last.verdict, last.reason) == ("fail", str(refused.value))
    names = [each.name for each in check_system(system, t_end=0.1, h=0.049, has_fixed_steps=False)]
    assert "body modes" not in names


def test_a_mode_without_mass_and_stiffness_is_named():
    K = np.diag([4.0, 9.0, 0.0])
    body = reduced_body(POINTS, K)
    M = np.array(body.M)
    M[2] = M[:, 2] = 0.0
    with pytest.raises(ModelError, match=r"body 'rod': mode 3 .* has neither mass nor stiffness"):
        _ = compiled_system(System([FlexibleBody("rod", replace(body, M=M))]))


def test_a_motor_on_a_driven_coordinate_is_refused():
    system = slider_crank(drive=polynomial_of_time([0.0, 5.0]))
    with pytest.raises(ModelError, match="the coordinate 'angle' of joint 'main' is prescribed"):
        _ = compiled_system(System(system.bodies, system.joints, [JointForce("motor", "main", "angle", preload=1.0)]))
