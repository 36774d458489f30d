"""Linear forms give the torques and reactions of the equations of motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import Gravity, Marker, RevoluteJoint, System
from floatframe.design.identification.barycentric import barycentric_parameters
from floatframe.design.identification.base_parameters import random_samples
from floatframe.design.identification.inertial_parameters import (
    body_from_parameters,
    parameters_in,
    parameters_of,
    pseudo_inertia,
)
from floatframe.design.identification.regressors import linear_form
from floatframe.design.identification.tree_samples import tree_samples
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.engine.tree.recursive import relative_model
from floatframe.errors import ModelError
from tests.floatframe.design.identification.robots import DOWN, random_tree, six_axes, some_body

KINDS = ("R", "P", "C", "U", "L", "F")


@pytest.mark.parametrize("seed", range(6))
def test_torques_are_those_of_the_recursive_inverse_dynamics(seed):
    system = random_tree(seed, 5, KINDS)
    form, model = linear_form(system), relative_model(system)
    samples = random_samples(form)
    tau = form.torques(samples) @ form.values
    for k in range(3):
        expected = model.inverse_dynamics(samples.x[k], samples.rate[k], samples.acceleration[k])
        assert_allclose(tau[k], getattr(expected, "forces", expected), rtol=0, atol=1e-11 * np.abs(tau).max())


def test_reactions_are_those_that_the_absolute_equations_find():
    """A double pendulum that is let go: the wrench of its first hinge on it, about the hinge."""
    rng = np.random.default_rng(5)
    bodies = [some_body("one", rng), some_body("two", rng, position=(0.6, 0.1, 0))]
    hinges = [
        RevoluteJoint("first", Marker("ground"), Marker("one"), axis=(0, 0.6, 0.8)),
        RevoluteJoint("second", Marker("one", position=(0.6, 0.1, 0)), Marker("two"), axis=(1, 0, 0)),
    ]
    system = System(bodies, hinges, [Gravity(DOWN)])
    made = consistent_motion(system)
    model = relative_model(system)
    z_ddot = model.forward_dynamics(np.zeros(2), np.zeros(2), np.zeros(2))
    form = linear_form(system)
    zero = np.zeros((1, 2))
    samples = tree_samples(system, zero, zero, np.asarray(z_ddot).reshape(1, 2))
    reaction = (form.reactions(samples) @ form.values)[0]
    assert_allclose(reaction[:3], -made.w[:3], rtol=0, atol=1e-10 * np.abs(made.w).max())
    assert_allclose(form.torques(samples) @ form.values, 0, rtol=0, atol=1e-10 * np.abs(made.w).max())


@pytest.mark.parametrize("kinds", [("R", "S", "U"), KINDS])
def test_barycentric_parameters_give_the_same_torques_with_fewer_columns(kinds):
    form = linear_form(random_tree(3, 5, kinds))
    samples = random_samples(form)
    Y, augmented = form.torques(samples), barycentric_parameters(form)
    assert len(augmented.names) == len(augmented.kept) < len(form.names)
    tau = Y @ form.values
    assert_allclose(Y[..., augmented.kept] @ augmented.values(form.values), tau, rtol=0, atol=1e-11 * np.abs(tau).max())


def test_barycentric_parameters_of_a_pendulum_pair_are_those_of_the_formula():
    system = six_axes()
    form, phi = linear_form(system), linear_form(system).values
    augmented = barycentric_parameters(form)
    named = dict(zip(augmented.names, augmented.values(phi), strict=True))
    d = np.array((0.4318, 0, -0.0934))  # from link 2 to the joint of link 3
    mass = sum(body.mass for body in system.bodies[2:])
    assert_allclose(named["S_x'(link2)"], phi[11] + mass * d[0], rtol=1e-13)
    assert_allclose(named["J_yy'(link2)"], phi[17] + mass * (d[0] ** 2 + d[2] ** 2), rtol=1e-13)
    assert_allclose(named["J_xz'(link2)"], phi[16] - mass * d[0] * d[2], rtol=1e-13)


def test_parameters_come_back_from_their_body_and_from_other_frames():
    rng = np.random.default_rng(2)
    body = some_body("body", rng)
    phi = parameters_of(body)
    assert_allclose(parameters_of(body_from_parameters(body, phi)), phi, rtol=1e-13)
    assert np.linalg.eigvalsh(pseudo_inertia(phi)).min() > 0
    moved = some_body("body", np.random.default_rng(2))
    R, r = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
    R *= np.linalg.det(R)
    c = r + R @ moved.center_of_mass
    J = R @ moved.inertia @ R.T + moved.mass * (c @ c * np.eye(3) - np.outer(c, c))
    there = parameters_in(r, R) @ phi
    assert_allclose(there[1:4], moved.mass * c, rtol=1e-12)
    assert_allclose(there[[4, 5, 9]], [J[0, 0], J[0, 1], J[2, 2]], rtol=1e-12)


def test_what_is_no_tree_of_rigid_bodies_is_refused_by_name():
    system = six_axes()
    loop = RevoluteJoint("closing", Marker("ground"), Marker("link6"), axis=(0, 0, 1))
    closed = System(system.bodies, [*system.joints, loop], system.forces)
    with pytest.raises(ModelError, match="is a constraint beside its joints"):
        tree_samples(closed, *np.zeros((3, 2, 6)))
    with pytest.raises(ModelError, match="no term 'viscos'"):
        linear_form(system, ["viscos"])
    with pytest.raises(ModelError, match="one column for each of"):
        tree_samples(system, np.zeros((2, 5)), np.zeros((2, 5)), np.zeros((2, 5)))
