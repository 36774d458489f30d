"""Generated code of trees with flexible bodies against the recursive model: the same numbers to rounding."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.components.mechanisms import chain
from floatframe.design.generation.generate import generate
from floatframe.design.generation.links import tree_terms
from floatframe.engine.tree.recursion.expansion import expansion_of
from floatframe.errors import ModelError
from floatframe.model.rotations import rotation_matrix
from tests.floatframe.design.generation.calls import ROUNDOFF, c_function, matlab_function, near, python_function
from tests.floatframe.design.generation.flexible_systems import (
    SYSTEMS,
    beam,
    bent_motion,
    spun_about_its_length,
    two_link_arm,
)

STATES = range(3)


class Case:
    """A system, its model and several motions."""

    def __init__(self, name):
        self.name, self.system = name, SYSTEMS[name]()
        self.model = ff.analyses.relative_model(self.system)
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


SMALL = [name for name in SYSTEMS if name != "mixed tree"]  # compilers take ten seconds for that


@pytest.fixture(scope="module", params=SMALL)
def small(request):
    return Case(request.param)


def test_c_has_the_numbers_of_the_model(small, tmp_path):
    force = np.zeros(small.model.n_rates)
    run = c_function(generate(small.system), tmp_path)
    for motion in small.motions:
        run([force], *motion)
        near(force, small.model.inverse_dynamics(*motion))


def test_derivatives_of_the_forces(small):
    run = python_function(small.system, "jacobian")
    for motion in small.motions:
        for ours, expected in zip(run(*motion), small.model.derivatives(*motion), strict=True):
            near(ours, expected)


def test_matlab_text_has_the_numbers_of_the_model(small):
    force = matlab_function(generate(small.system, language="matlab", name="f").files["f.m"])
    mass = matlab_function(generate(small.system, what="mass", language="matlab", name="f").files["f.m"])
    motion = small.motions[1]
    near(force(*motion)[0].ravel(), small.model.inverse_dynamics(*motion))
    near(mass(motion[0])[0], small.model.mass_matrix(motion[0]))


def test_casadi_functions_have_the_numbers_of_the_model_and_derivatives_everywhere(small):
    """Those of the undeformed body too, where a rotation vector has no direction."""
    casadi = pytest.importorskip("casadi")
    space = {}
    exec(generate(small.system, language="casadi", name="f").files["f.py"], space)
    function = space["f"]()
    n, n_z = small.model.n_rates, small.model.n_z
    z, v, a = (casadi.SX.sym(name, size) for name, size in (("z", n_z), ("v", n), ("a", n)))
    slopes = casadi.Function("slopes", [z, v, a], [casadi.jacobian(function(z, v, a), v), function(z, v, a)])
    by_z = casadi.Function("by_z", [z, v, a], [casadi.jacobian(function(z, v, a), z)])
    straight = small.motions[0][0].copy()
    for xq in small.model.expansion.xq_of:
        straight[xq] = 0.0
    for motion in (small.motions[0], (straight, *small.motions[1][1:])):
        expected = small.model.derivatives(*motion)
        by_v, force = (np.array(each) for each in slopes(*motion))
        near(force.ravel(), small.model.inverse_dynamics(*motion))
        near(by_v, expected.by_z_dot)
        near(np.array(by_z(*motion)), expected.by_z)  # no rotation with Euler parameters among the coordinates


def test_a_residual_is_the_force_less_that_given(small):
    motion, force = small.motions[2], np.linspace(-1.0, 2.0, small.model.n_rates)
    residual = python_function(small.system, "residual")(*motion, force)
    near(residual, small.model.inverse_dynamics(*motion) - force)


def test_many_motions_at_once_are_those_one_by_one():
    case = Case("two-link arm")
    together = python_function(case.system, "inverse")(
        *(np.stack(each, -1) for each in zip(*case.motions, strict=True))
    )
    near(together.T, [case.model.inverse_dynamics(*motion) for motion in case.motions])


def test_sensitivities_to_a_rigid_link_below_a_flexible_one_are_those_of_differences():
    """Forces are linear in inertial parameters: a difference is exact."""
    case = Case("flexible in the middle")
    motion, names = case.motions[0], ["tool/m", "tool/S_x", "tool/J_yy", "gravity/z"]
    code = generate(case.system, what="sensitivity", parameters=names)
    by = python_function(case.system, "sensitivity", parameters=names)(*motion, code.parameter_values)
    force = python_function(case.system, "inverse", parameters=names)
    values = code.parameter_values
    near(force(*motion, values), case.model.inverse_dynamics(*motion))
    size = np.abs(force(*motion, values)).max()
    for k, step in enumerate(np.eye(len(values))):
        difference = force(*motion, values + step) - force(*motion, values)
        assert_allclose(by[:, k], difference, rtol=0, atol=1e-12 * max(size, np.abs(difference).max()))
    heavier = [replace(body, mass=2.0 * body.mass) if body.name == "tool" else body for body in case.system.bodies]
    moved = ff.analyses.relative_model(replace(case.system, bodies=heavier))
    assert np.abs(moved.inverse_dynamics(*motion) - case.model.inverse_dynamics(*motion)).max() > 1e-6 * size


def test_numbers_of_symmetric_beams_that_are_rounding_vanish():
    """Bending apart in two planes: each mode has shapes and moments along its own direction alone."""
    tree = tree_terms(expansion_of(two_link_arm()))
    for link in tree.links:
        modes = link.modes
        for value in (*modes.C1.ravel(), *modes.X.ravel(), *modes.S.ravel(), *modes.C4.ravel()):
            assert value.value == 0.0 or abs(value.value) > 1e-9
        assert [sum(not x.is_constant(0.0) for x in row) for row in modes.C1] == [1] * modes.n
    assert tree.links[1].own is None  # clamped: the frame of the body is that of its joint


def test_a_body_with_modes_turns_with_its_hinge_even_if_it_is_round():
    """Its modes bend to one side each, which weights and spin tell apart."""
    system = spun_about_its_length()
    model = ff.analyses.relative_model(system)
    z, z_dot, z_ddot = bent_motion(model, 0)
    expected, turned = (model.inverse_dynamics(each, z_dot, z_ddot) for each in (z, z + np.eye(3)[0]))
    assert np.abs(turned - expected).max() > 1
    near(python_function(system, "inverse")(z, z_dot, z_ddot), expected)
    near(python_function(system, "mass")(z), model.mass_matrix(z))


def test_rotations_in_space_are_told_to_be_good_up_to_some_angle_and_those_about_an_axis_not():
    code = generate(two_link_arm(), language="python", name="f")
    assert "up to 4 rad" in code.files["f.py"]
    twisted = chain(2, rod=beam(is_clamped=True, n_bending=0, n_torsion=2))
    code = generate(twisted, language="python", name="f")
    assert "up to 4 rad" not in code.files["f.py"]
    assert code.operations.functions > 4  # two hinges, and the twist at the second
    model = ff.analyses.relative_model(twisted)
    motion = bent_motion(model, 0)
    near(python_function(twisted, "inverse")(*motion), model.inverse_dynamics(*motion))


@pytest.mark.parametrize("names", [["rod 1"], ["rod 2/m"]])
def test_invariants_of_flexible_bodies_are_no_parameters(names):
    with pytest.raises(ModelError, match="its invariants are numbers in the code"):
        generate(two_link_arm(), parameters=names)
