"""Relative kinematics: bodies move as their joints say, and reactions are those of the constraints."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    JointForce,
)
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.engine.kernels.entry import evaluate_and_linearize
from floatframe.engine.tree.kernels.entry import motion_of_bodies, moved
from floatframe.engine.tree.topology import tree_of
from tests.floatframe.engine.tree.examples import CASES, JOINTS
from tests.floatframe.engine.tree.pairs import RelativeIterate, pair


def started(make, is_apart, swap, t=0.37):
    system = pair(make, is_apart=is_apart, swap=swap)
    made = consistent_motion(system, t=t)
    return system, made, RelativeIterate(system, made.state, made.u_dot, made.w, t)


@pytest.mark.parametrize(("make", "is_apart", "n_free", "swap"), CASES)
def test_consistent_motion_and_its_reactions_are_found_from_the_joints(make, is_apart, n_free, swap):
    """Accelerations and reactions that the absolute formulation solves for leave no relative residual."""
    system, made, iterate = started(make, is_apart, swap)
    assert len(tree_of(system).coordinates) == 6 + n_free
    assert tree_of(system).tree.is_reversed.any() != swap  # the second body is the heavier, and free
    before = iterate.absolute()
    iterate.forget_frames()
    motion_of_bodies(iterate.model, iterate.work, iterate.tree, iterate.joints)
    for one, other in zip(iterate.absolute(), before, strict=True):
        assert_allclose(one, other, rtol=0, atol=1e-11 * max(np.abs(other).max(), 1.0))
    iterate.work.state.w[:] = np.nan  # not used, and overwritten
    residual = iterate.project()
    assert_allclose(residual, 0, rtol=0, atol=1e-10 * np.abs(made.w).max())
    assert_allclose(iterate.work.state.w, made.w, rtol=0, atol=1e-10 * np.abs(made.w).max())


@pytest.mark.parametrize(("make", "is_apart", "n_free", "swap"), CASES)
def test_velocities_and_accelerations_are_derivatives_along_the_coordinates(make, is_apart, n_free, swap):
    """Along x = s z_dot, q = q + s q_dot (rates held, so no z_ddot) r, R and u change as u and u_dot say."""
    _, _, iterate = started(make, is_apart, swap)
    model, work, joints, s = iterate.model, iterate.work, iterate.joints, 1e-5
    joints.acceleration[:] = 0.0
    work.state.u_dot[:] = 0.0
    q, q_dot = work.state.q.copy(), work.state.u[iterate.is_modal].copy()
    placed = []
    for step in (-s, 0.0, s):
        work.state.q[:] = q + step * q_dot
        moved(model, work, iterate.tree, joints, step * joints.rate)
        placed.append(iterate.absolute())
    before, (_, R, u, u_dot), after = placed
    r_dot, R_dot, change = ((after[k] - before[k]) / (2 * s) for k in range(3))
    scale = np.abs(u).max() ** 2 + 1.0
    for i, u0 in enumerate(model.bodies.u0[:-1]):
        assert_allclose(r_dot[i], u[u0 : u0 + 3], rtol=0, atol=1e-9 * scale)
        x, y, z = u[u0 + 3 : u0 + 6]
        assert_allclose(R[i].T @ R_dot[i], [[0, -z, y], [z, 0, -x], [-y, x, 0]], rtol=0, atol=1e-9 * scale)
    assert_allclose(change, u_dot, rtol=0, atol=1e-9 * scale)


def test_forces_along_a_coordinate_belong_to_its_equation():
    """Spring, damper and motor of a hinge: the absolute equations with them leave no relative residual."""
    force = JointForce("spring", "j", "angle", stiffness=3.0, damping=0.4, free=0.2, preload=1.5)
    make, is_apart, _ = JOINTS["revolute"]
    system = pair(make, is_apart=is_apart, forces=[force])
    made = consistent_motion(system)
    iterate = RelativeIterate(system, made.state, made.u_dot, made.w)
    assert_allclose(iterate.project(), 0, rtol=0, atol=1e-10 * np.abs(made.w).max())
    assert_allclose(iterate.work.state.w, made.w, rtol=0, atol=1e-10 * np.abs(made.w).max())


def test_reactions_of_the_tree_satisfy_the_rows_of_their_joints():
    """Whatever the motion: with the wrenches found, rigid residuals of the absolute equations are zero."""
    make, is_apart, _ = JOINTS["cylindrical"]
    _, _, iterate = started(make, is_apart, False)
    rng = np.random.default_rng(3)
    iterate.joints.acceleration[:] = rng.normal(size=len(iterate.joints.acceleration))
    iterate.work.state.u_dot[:] = rng.normal(size=len(iterate.work.state.u_dot))
    motion_of_bodies(iterate.model, iterate.work, iterate.tree, iterate.joints)
    residual = iterate.project()
    u0 = int(iterate.model.bodies.u0[0])  # the first body hangs at the second, a free one
    evaluate_and_linearize(iterate.model, iterate.work, 1.0, 0.0, 0.0)
    assert_allclose(iterate.work.bodies.residual[u0 : u0 + 6], 0, rtol=0, atol=1e-10)
    modes = [int(m) + k for i, m in enumerate(iterate.tree.m0) for k in range(iterate.model.bodies.n_q[i])]
    assert_allclose(iterate.work.bodies.residual[iterate.is_modal], residual[modes], rtol=0, atol=1e-10)
