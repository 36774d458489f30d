"""Robots from URDF move in absolute coordinates as in Pinocchio's joint coordinates, from the same file."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose

from floatframe.analyses import consistent_state
from floatframe.engine.open_equations import open_equations
from floatframe.files.importers.read_urdf import read_urdf
from floatframe.files.importers.robot_system import robot_system
from floatframe.model.rotations import rotation_matrix
from tests.floatframe.files.importers.random_robots import random_robot

GRAVITY = (0.7, -1.1, -9.81)


def state_vectors(model, values, rates):
    """q and v of Pinocchio for values and rates by joint; a continuous joint is cosine and sine there."""
    q, v = pin.neutral(model), np.zeros(model.nv)
    for joint, name in enumerate(model.names):
        if joint == 0:
            continue
        i, k, x = model.idx_qs[joint], model.idx_vs[joint], values[name]
        q[i : i + model.nqs[joint]] = [x] if model.nqs[joint] == 1 else [np.cos(x), np.sin(x)]
        v[k] = rates[name]
    return q, v


@pytest.fixture(scope="module", params=[(1, 3, True), (2, 9, True), (2, 9, False), (3, 20, True)], ids=str)
def case(request, tmp_path_factory):
    seed, n, merges = request.param
    path = tmp_path_factory.mktemp("urdf") / "robot.urdf"
    path.write_text(random_robot(seed, n))
    robot = read_urdf(path)
    rng = np.random.default_rng(seed)
    values = {joint.name: rng.uniform(-1, 1) for joint in robot.joints if joint.has_value}
    rates = {name: rng.uniform(-2, 2) for name in values}
    model = pin.buildModelFromUrdf(str(path))
    model.gravity.linear[:] = GRAVITY
    q, v = state_vectors(model, values, rates)

    def made(**options):
        return robot_system(robot, configuration=values, gravity=GRAVITY, merge_fixed=merges, **options)

    return robot, made, values, rates, model, q, v


def test_accelerations_of_all_links_are_those_of_the_articulated_body_algorithm(case):
    _, made, _, rates, model, q, v = case
    found = made(rates=rates)
    start = consistent_state(found.system)
    data = model.createData()
    a = pin.aba(model, data, q, v, np.zeros(model.nv))
    pin.forwardKinematics(model, data, q, v, a)
    pin.updateFramePlacements(model, data)
    scale = np.abs(a).max()
    for k, body in enumerate(found.system.bodies):
        frame = model.getFrameId(body.name, pin.FrameType.BODY)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        expected = pin.getFrameClassicalAcceleration(model, data, frame, axes)
        speed = pin.getFrameVelocity(model, data, frame, axes)
        R = rotation_matrix(start.state.p[k])
        assert_allclose(start.state.r[k], data.oMf[frame].translation, rtol=0, atol=1e-12)
        assert_allclose(R, data.oMf[frame].rotation, rtol=0, atol=1e-12)
        u, u_dot = start.state.u[6 * k : 6 * k + 6], start.u_dot[6 * k : 6 * k + 6]
        assert_allclose(u, [*speed.linear, *R.T @ speed.angular], rtol=0, atol=1e-11)
        assert_allclose(u_dot, [*expected.linear, *R.T @ expected.angular], rtol=0, atol=1e-9 * scale)


def test_the_mass_matrix_along_the_joints_is_that_of_the_composite_bodies(case):
    """Jᵀ M J over the velocities of the bodies that unit rates of the joints give."""
    _, made, _, rates, model, q, _ = case
    base = made()
    equations = open_equations(base.system)
    x, *_ = equations.start()
    columns = np.zeros((equations.n_v, model.nv))
    for name in rates:
        bodies = made(rates={name: 1.0}).system.bodies
        joint = model.getJointId(name)
        columns[:, model.idx_vs[joint]] = np.concatenate([[*body.velocity, *body.omega_B] for body in bodies])
    M = pin.crba(model, model.createData(), q)
    M = np.triu(M) + np.triu(M, 1).T
    assert_allclose(columns.T @ equations.mass(x) @ columns, M, rtol=0, atol=1e-12 * np.abs(M).max())


def test_every_link_is_placed_where_pinocchio_has_it(case):
    """Merged ones and frames without mass too."""
    robot, made, _, _, model, q, _ = case
    found = made()
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    for link in robot.order:
        marker, frame = found.place(link), model.getFrameId(link, pin.FrameType.BODY)
        body = next((each for each in found.system.bodies if each.name == marker.body), None)
        r, R = (np.zeros(3), np.eye(3)) if body is None else (body.position, rotation_matrix(body.orientation))
        assert_allclose(r + R @ marker.position, data.oMf[frame].translation, rtol=0, atol=1e-12)
        assert_allclose(R @ marker.triad, data.oMf[frame].rotation, rtol=0, atol=1e-12)
