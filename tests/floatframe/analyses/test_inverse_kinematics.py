"""Inverse kinematics against closed forms, in trees and loops, within limits and out of reach."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize

from floatframe import GROUND, Marker, RevoluteJoint, RigidBody, System
from floatframe.analyses.inverse_kinematics import Target, inverse_kinematics, least_within
from floatframe.components.mechanisms import slider_crank
from floatframe.errors import ModelError
from floatframe.files.importers.read_urdf import read_urdf
from floatframe.files.importers.robot_system import robot_system
from floatframe.joints import CoordinateCoupler, JointCoordinate, Limits
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from tests.floatframe.files.importers.random_robots import random_robot

A, B = 0.7, 0.5


def turned(angle):
    return euler_parameters_of_rotation_vector([0, 0, angle])


def two_links(shoulder, elbow, couplers=()):
    """Two links along x, turned about z."""
    angles = np.array([shoulder, shoulder + elbow])
    knee = A * np.array([np.cos(shoulder), np.sin(shoulder), 0])
    links = [
        RigidBody(name, 1.0, 0.01 * np.eye(3), position=r, orientation=turned(angle))
        for name, r, angle in (("upper", np.zeros(3), angles[0]), ("fore", knee, angles[1]))
    ]
    joints = [
        RevoluteJoint("shoulder", GROUND, Marker("upper")),
        RevoluteJoint("elbow", Marker("upper", position=(A, 0, 0)), Marker("fore")),
    ]
    return System(links, joints, couplers=couplers)


TIP = Marker("fore", position=(B, 0, 0))


@pytest.mark.parametrize("side", [1, -1])
def test_an_elbow_bends_to_the_side_where_it_was_placed(side):
    goal = np.array([0.3, 0.8, 0.0])
    found = inverse_kinematics(two_links(0.3, 0.4 * side), Target(TIP, goal))
    elbow = side * np.arccos((goal @ goal - A**2 - B**2) / (2 * A * B))
    shoulder = np.arctan2(goal[1], goal[0]) - np.arctan2(B * np.sin(elbow), A + B * np.cos(elbow))
    assert found.is_reached
    assert_allclose(found.coordinates["elbow.angle"], elbow - 0.4 * side, rtol=0, atol=1e-9)
    assert_allclose(found.coordinates["shoulder.angle"], shoulder - 0.3, rtol=0, atol=1e-9)
    assert found.position_error < 1e-10
    assert_allclose(found.state.r[1], A * np.array([np.cos(shoulder), np.sin(shoulder), 0]), rtol=0, atol=1e-9)


def test_out_of_reach_it_stretches_towards_the_target():
    goal = np.array([1.0, 2.0, 0.0])
    found = inverse_kinematics(two_links(0.3, 0.4), Target(TIP, goal))
    assert not found.is_reached
    assert_allclose(found.position_error, np.sqrt(5.0) - A - B, rtol=1e-6, atol=0)
    assert_allclose(found.coordinates["shoulder.angle"] + 0.3, np.arctan2(2, 1), rtol=0, atol=1e-2)


def test_within_limits_it_comes_as_near_as_they_allow():
    """Against SciPy's minimiser over the angles of the closed form; limits by name, and by a stop of the system."""
    goal, low, high = np.array([-0.2, 0.9]), (-0.5, -0.3), (1.2, 0.9)

    def way(x):
        return np.hypot(*(A * np.array([np.cos(x[0]), np.sin(x[0])]) + B * np.array([np.cos(sum(x)), np.sin(sum(x))])
                          - goal))  # fmt: skip

    expected = minimize(lambda x: way(x) ** 2, (0.3, 0.4), bounds=list(zip(low, high, strict=True)), tol=1e-14)
    stop = CoordinateCoupler(
        "stop", [(JointCoordinate("elbow", "angle"), -1.0)], limits=Limits(-(high[1] - 0.4), -(low[1] - 0.4))
    )
    found = inverse_kinematics(
        two_links(0.3, 0.4, [stop]), Target(TIP, (*goal, 0)), limits={"shoulder.angle": (low[0] - 0.3, high[0] - 0.3)}
    )
    assert not found.is_reached
    assert_allclose(found.position_error, np.sqrt(expected.fun), rtol=1e-6, atol=0)
    x = [found.coordinates["shoulder.angle"] + 0.3, found.coordinates["elbow.angle"] + 0.4]
    assert_allclose(x, expected.x, rtol=0, atol=1e-4)
    assert set(found.at_limits) == {
        name for name, value, a, b in zip(("shoulder.angle", "elbow.angle"), expected.x, low, high, strict=True)
        if min(value - a, b - value) < 1e-6
    }  # fmt: skip
    assert found.at_limits
    assert (np.array(x) <= np.array(high) + 1e-10).all()


def test_a_loop_is_led_by_any_of_its_bodies():
    """The slider of a crank of 0.1 and a rod of 0.3 at x: the angle of the crank by the law of cosines."""
    system = slider_crank(angle=0.4)
    slider = system.bodies[-1]
    start = system.bodies[-1].position[0]
    goal = start - 0.03
    found = inverse_kinematics(system, Target(Marker(slider.name), (goal, *slider.position[1:])))
    assert found.is_reached
    again = inverse_kinematics(system, Target(Marker(slider.name), slider.position))
    assert again.n_iterations == 0
    crank, rod = (np.linalg.norm(p) for p in (system.bodies[1].position, slider.position - system.bodies[1].position))
    angle = np.arccos((crank**2 + goal**2 - rod**2) / (2 * crank * goal))
    assert_allclose(found.coordinates["main.angle"] + 0.4, angle, rtol=0, atol=1e-8)


def test_a_robot_of_many_joints_meets_place_and_turn(tmp_path):
    """A pose it can have, and the description placed by what was found has it."""
    path = tmp_path / "robot.urdf"
    path.write_text(random_robot(11, 8, ("revolute", "prismatic", "continuous")))
    robot = read_urdf(path)
    last = robot.order[-1]
    rng = np.random.default_rng(2)
    names = [joint.name for joint in robot.joints]

    def pose(values):
        body = robot_system(robot, configuration=values).system.body(last)
        return body.position, rotation_matrix(body.orientation)

    near = {name: rng.uniform(-0.5, 0.5) for name in names}
    r, R = pose(near)
    made = robot_system(robot)
    limits = {}
    found = inverse_kinematics(made.system, Target(Marker(last), r, R), limits=limits)
    assert found.is_reached
    values = {
        name: made.offset(name) + found.coordinates[f"{name}.{made.coordinate(name).coordinate}"] for name in names
    }
    x, X = pose(values)
    assert_allclose(x, r, rtol=0, atol=1e-9)
    assert_allclose(X, R, rtol=0, atol=1e-9)
    assert not limits  # what is given is not changed


def test_the_inner_problem_is_solved_exactly():
    rng = np.random.default_rng(5)
    for _ in range(20):
        J, e, X = rng.normal(size=(4, 6)), rng.normal(size=4), rng.normal(size=(5, 6))
        lower, upper = -rng.uniform(0, 0.2, 5), rng.uniform(0, 0.2, 5)
        a = least_within(J, e, 1e-3, X, lower, upper)
        best = minimize(
            lambda a, J=J, e=e: np.sum((J @ a - e) ** 2) + 1e-3 * a @ a, np.zeros(6), method="SLSQP",
            constraints=[{"type": "ineq", "fun": lambda a, X=X, u=upper: u - X @ a},
                         {"type": "ineq", "fun": lambda a, X=X, low=lower: X @ a - low}],
            options={"ftol": 1e-14, "maxiter": 500},
        )  # fmt: skip
        assert (X @ a >= lower - 1e-10).all()
        assert (X @ a <= upper + 1e-10).all()
        assert np.sum((J @ a - e) ** 2) + 1e-3 * a @ a <= best.fun + 1e-8


@pytest.mark.parametrize(
    ("targets", "options", "words"),
    [
        ([], {}, "at least one target"),
        (Target(TIP), {}, r"target 1: expected Target\(marker, position or rotation\)"),
        (Target(Marker(GROUND), (0, 0, 0)), {}, "its marker is on the ground"),
        (Target(Marker("hand"), (0, 0, 0)), {}, "hand"),
        (Target(TIP, (0, 0)), {}, r"expected shape \(3,\)"),
        (Target(TIP, rotation=2 * np.eye(3)), {}, "orthonormal"),
        (Target(TIP, (0, 0, 0)), {"limits": {"elbow.distance": (0, 1)}}, "no coordinate 'elbow.distance'"),
        (Target(TIP, (0, 0, 0)), {"limits": {"elbow.angle": (0.1, 1)}}, "placed at 0, beyond its limits 0.1 to 1"),
    ],
)
def test_impossible_targets_are_refused(targets, options, words):
    with pytest.raises(ModelError, match=words):
        inverse_kinematics(two_links(0.3, 0.4), targets, **options)
