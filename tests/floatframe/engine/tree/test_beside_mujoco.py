"""A humanoid beside MuJoCo: forces, mass matrix, accelerations. `python -m tests --external`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from tests.floatframe.engine.tree import humanoid

pytestmark = pytest.mark.external


@pytest.fixture(scope="module")
def both():
    """Return our model and MuJoCo's with its data, and where each of our rates stands in MuJoCo's."""
    mujoco = pytest.importorskip("mujoco")
    theirs = mujoco.MjModel.from_xml_string(humanoid.mjcf())
    names = [theirs.body(k).name for k in range(1, theirs.nbody)]
    order = [0] * 6 + [6 + names.index(link.name) - 1 for link in humanoid.LINKS[1:]]
    order[:6] = range(6)
    return ff.analyses.relative_model(humanoid.system()), mujoco, theirs, mujoco.MjData(theirs), np.array(order)


def random_motion(model, seed=0):
    rng = np.random.default_rng(seed)
    z = np.concatenate([rng.normal(size=3), np.zeros(4), 0.6 * rng.normal(size=model.n_rates - 6)])
    z[3:7] = euler_parameters_of_rotation_vector(rng.normal(size=3))
    return z, rng.normal(size=model.n_rates), rng.normal(size=model.n_rates)


def put(both, z, z_dot, z_ddot=None):
    """Write a motion into MuJoCo's data: rates of the free trunk are ours, ground and body axes; positions one more."""
    _, mujoco, theirs, data, order = both
    data.qpos[:7] = z[:7]
    data.qpos[1 + order[6:]] = z[7:]
    data.qvel[order] = z_dot
    if z_ddot is not None:
        data.qacc[order] = z_ddot
    else:
        mujoco.mj_forward(theirs, data)


def test_the_tree_has_a_link_for_each_of_theirs(both):
    model, _, theirs, *_ = both
    assert model.n_rates == theirs.nv == 26
    assert model.n_z == theirs.nq == 27


def test_forces_are_those_of_mujoco(both):
    model, mujoco, theirs, data, order = both
    z, z_dot, z_ddot = random_motion(model)
    put(both, z, z_dot, z_ddot)
    mujoco.mj_inverse(theirs, data)
    got = model.inverse_dynamics(z, z_dot, z_ddot)
    assert_allclose(got, data.qfrc_inverse[order], rtol=0, atol=1e-11 * np.abs(got).max())


def test_the_mass_matrix_is_that_of_mujoco(both):
    model, mujoco, theirs, data, order = both
    z, z_dot, _ = random_motion(model, 1)
    put(both, z, z_dot)
    columns = np.zeros((theirs.nv, theirs.nv))
    for k, unit in enumerate(np.eye(theirs.nv)):
        mujoco.mj_mulM(theirs, data, columns[k], unit)
    M = model.mass_matrix(z)
    assert_allclose(M, columns[np.ix_(order, order)], rtol=0, atol=1e-12 * np.abs(M).max())


def test_accelerations_are_those_of_mujoco(both):
    model, _, _, data, order = both
    z, z_dot, force = random_motion(model, 2)
    data.qfrc_applied[order] = force
    put(both, z, z_dot)
    got = model.forward_dynamics(z, z_dot, force)
    assert_allclose(got, data.qacc[order], rtol=0, atol=1e-10 * np.linalg.cond(model.mass_matrix(z)))
    data.qfrc_applied[:] = 0.0


def test_places_are_those_of_mujoco(both):
    model, _, _, data, _ = both
    z, z_dot, _ = random_motion(model, 3)
    put(both, z, z_dot)
    foot = ff.Marker("left foot")
    assert_allclose(model.pose(z, foot)[0], data.body("left foot").xpos, rtol=0, atol=1e-12)
