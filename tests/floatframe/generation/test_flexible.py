"""Generated code of trees with flexible bodies against the recursive model: the same numbers to rounding."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.generation.generate import generate
from floatframe.rotations import rotation_matrix
from tests.floatframe.generation.flexible_systems import SYSTEMS, bent_motion
from tests.floatframe.generation.test_generate import ROUNDOFF, c_function, near, python_function

STATES = range(3)


class Case:
    """A system, its model and several motions."""

    def __init__(self, name):
        self.name, self.system = name, SYSTEMS[name]()
        self.model = ff.relative_model(self.system)
        self.motions = [bent_motion(self.model, seed) for seed in STATES]


@pytest.fixture(scope="module", params=SYSTEMS)
def case(request):
    return Case(request.param)


def test_forces_of_a_motion(case):
    run = python_function(case.system, "inverse")
    for motion in case.motions:
        near(run(*motion), case.model.inverse_dynamics(*motion))


def test_the_mass_matrix(case):
    run = python_function(case.system, "mass")
    for z, _, _ in case.motions:
        near(run(z), case.model.mass_matrix(z))


def test_accelerations_under_forces(case):
    run = python_function(case.system, "forward")
    for z, z_dot, force in case.motions:
        condition = np.linalg.cond(case.model.mass_matrix(z))
        near(run(z, z_dot, force), case.model.forward_dynamics(z, z_dot, force), condition)


def test_places_and_velocities_of_bodies_and_interfaces(case):
    run = python_function(case.system, "kinematics")
    for z, z_dot, _ in case.motions:
        r, R, v, omega, *own = run(z, z_dot)
        state = case.model.state(z, z_dot)
        u = np.split(state.u, np.cumsum([6 + (xq.stop - xq.start) for xq in case.model.expansion.xq_of])[:-1])
        size = max(1.0, np.abs(state.u).max())
        for i in range(len(case.system.bodies)):
            assert_allclose(r[i], state.r[i], rtol=0, atol=100 * ROUNDOFF)
            assert_allclose(R[i], rotation_matrix(state.p[i]), rtol=0, atol=100 * ROUNDOFF)
            assert_allclose(v[i], u[i][:3], rtol=0, atol=100 * ROUNDOFF * size)
            assert_allclose(R[i].T @ omega[i], u[i][3:6], rtol=0, atol=100 * ROUNDOFF * size)
        markers = [
            ff.Marker(body.name, interface.name)
            for body in case.system.bodies if isinstance(body, ff.FlexibleBody)
            for interface in body.reduced.interfaces
        ]  # fmt: skip
        for marker, *found in zip(markers, *own, strict=True):
            place, axes = case.model.pose(z, marker)
            assert_allclose(found[0], place, rtol=0, atol=100 * ROUNDOFF)
            assert_allclose(found[1], axes, rtol=0, atol=100 * ROUNDOFF)
            speed = case.model.jacobian(z, marker) @ z_dot
            assert_allclose([*found[2], *found[3]], speed, rtol=0, atol=100 * ROUNDOFF * size)


def test_c_has_the_numbers_of_the_model(case, tmp_path):
    if case.name == "mixed tree":
        pytest.skip("a compiler takes ten seconds")
    force = np.zeros(case.model.n_rates)
    run = c_function(generate(case.system), tmp_path)
    for motion in case.motions:
        run([force], *motion)
        near(force, case.model.inverse_dynamics(*motion))
