"""Generated code against the recursive model: the same numbers to rounding, from every language."""

import ctypes
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.errors import ModelError
from floatframe.generation.generate import generate
from floatframe.generation.grouping import carried_inwards
from floatframe.generation.links import tree_terms
from tests.floatframe.identification.robots import random_tree, six_axes
from tests.floatframe.relative.random_trees import KINDS, system_of
from tests.floatframe.relative.random_trees import random_tree as random_links

ROUNDOFF = 1e-12


def puma():
    return six_axes()


def all_charts():
    return system_of(random_links(9, np.random.default_rng(3), kinds=KINDS[:-1], free_base=True))


SYSTEMS = {
    "six axes": puma,
    "all charts, free base": all_charts,
    "parallel axes": lambda: random_tree(4, 6, "RPCU"),
}


class Case:
    """A system, its model and a random motion."""

    def __init__(self, system):
        self.system, self.model = system, ff.relative_model(system)
        rng = np.random.default_rng(0)
        z = self.model.positions()[0]
        self.z = self.model.moved(z, rng.normal(size=self.model.n_rates))
        self.z_dot, self.z_ddot, self.force = rng.normal(size=(3, self.model.n_rates))


@pytest.fixture(scope="module", params=SYSTEMS)
def case(request):
    return Case(SYSTEMS[request.param]())


def python_function(system, what, **options):
    code = generate(system, what=what, language="python", name="generated", **options)
    space = {}
    exec(compile(code.files["generated.py"], "generated.py", "exec"), space)
    return space["generated"]


def near(got, expected, factor=1.0):
    expected = np.asarray(expected)
    assert_allclose(got, expected, rtol=0, atol=factor * ROUNDOFF * np.abs(expected).max())


def test_forces_of_a_motion(case):
    expected = case.model.inverse_dynamics(case.z, case.z_dot, case.z_ddot)
    near(python_function(case.system, "inverse")(case.z, case.z_dot, case.z_ddot), expected)
    residual = python_function(case.system, "residual")(case.z, case.z_dot, case.z_ddot, case.force)
    near(residual, expected - case.force)


def test_the_mass_matrix(case):
    near(python_function(case.system, "mass")(case.z), case.model.mass_matrix(case.z))


def test_accelerations_under_forces(case):
    expected = case.model.forward_dynamics(case.z, case.z_dot, case.force)
    condition = np.linalg.cond(case.model.mass_matrix(case.z))
    near(python_function(case.system, "forward")(case.z, case.z_dot, case.force), expected, condition)


def test_places_and_velocities(case):
    r, R, v, omega = python_function(case.system, "kinematics")(case.z, case.z_dot)
    for i, body in enumerate(case.system.bodies):
        place, axes = case.model.pose(case.z, ff.Marker(body.name))
        speed = case.model.jacobian(case.z, ff.Marker(body.name)) @ case.z_dot
        assert_allclose(r[i], place, rtol=0, atol=100 * ROUNDOFF)
        assert_allclose(R[i], axes, rtol=0, atol=ROUNDOFF)
        assert_allclose([*v[i], *omega[i]], speed, rtol=0, atol=100 * ROUNDOFF)


def test_derivatives_of_the_forces(case):
    got = python_function(case.system, "jacobian")(case.z, case.z_dot, case.z_ddot)
    for ours, expected in zip(got, case.model.derivatives(case.z, case.z_dot, case.z_ddot), strict=True):
        near(ours, expected)


def test_many_motions_at_once_are_those_one_by_one():
    case = Case(puma())
    run = python_function(case.system, "inverse")
    z, v, a = np.random.default_rng(1).normal(size=(3, 6, 5))
    together = run(z, v, a)
    assert together.shape == (6, 5)
    near(together, np.array([run(*each) for each in zip(z.T, v.T, a.T, strict=True)]).T)


def test_parameters_as_symbols_have_the_effect_of_their_numbers():
    case = Case(all_charts())
    code = generate(case.system, parameters=["*"])
    run = python_function(case.system, "inverse", parameters=["*"])
    expected = case.model.inverse_dynamics(case.z, case.z_dot, case.z_ddot)
    near(run(case.z, case.z_dot, case.z_ddot, code.parameter_values), expected)


def test_sensitivities_make_up_the_forces_which_are_linear_in_inertial_parameters():
    case = Case(puma())
    names = [body.name for body in case.system.bodies]
    code = generate(case.system, what="sensitivity", parameters=names)
    run = python_function(case.system, "sensitivity", parameters=names)
    by = run(case.z, case.z_dot, case.z_ddot, code.parameter_values)
    near(by @ code.parameter_values, case.model.inverse_dynamics(case.z, case.z_dot, case.z_ddot))
    assert_allclose(by[5, :50], 0, rtol=0, atol=0)  # the last motor carries the last link alone


def c_function(code, folder):
    """Compile as asked for, and return a function of arrays."""
    paths = code.write(folder)
    library = folder / f"{code.name}.so"
    command = ["cc", "-O2", "-Wall", "-Wextra", "-Wno-unused-parameter", "-std=c99", "-pedantic", "-Werror", "-shared"]
    subprocess.run([*command, "-fPIC", str(paths[0]), "-o", str(library), "-lm"], check=True)
    function = getattr(ctypes.CDLL(str(library)), code.name)

    def run(out, *arrays):
        held = [np.ascontiguousarray(each, dtype=float) for each in arrays]
        function(*(ctypes.c_void_p(each.ctypes.data) for each in (*held, *out)))

    return run


@pytest.mark.parametrize("system", SYSTEMS)
def test_c_compiles_without_warnings_and_has_the_numbers_of_the_model(system, tmp_path):
    case = Case(SYSTEMS[system]())
    n = case.model.n_rates
    force, M, z_ddot = np.zeros(n), np.zeros((n, n)), np.zeros(n)
    c_function(generate(case.system), tmp_path)([force], case.z, case.z_dot, case.z_ddot)
    near(force, case.model.inverse_dynamics(case.z, case.z_dot, case.z_ddot))
    c_function(generate(case.system, what="mass"), tmp_path)([M], case.z)
    near(M, case.model.mass_matrix(case.z))
    c_function(generate(case.system, what="forward"), tmp_path)([z_ddot], case.z, case.z_dot, force)
    near(z_ddot, case.z_ddot, np.linalg.cond(M))


def test_a_casadi_function_has_the_numbers_of_the_model():
    pytest.importorskip("casadi")
    case = Case(puma())
    space = {}
    exec(generate(case.system, language="casadi", name="puma").files["puma.py"], space)
    got = np.array(space["puma"]()(case.z, case.z_dot, case.z_ddot)).ravel()
    near(got, case.model.inverse_dynamics(case.z, case.z_dot, case.z_ddot))


def test_no_link_on_a_hinge_keeps_more_than_seven_numbers():
    """Those of a body on a hinge that can be told from a motion of its parent; the third moves with that."""
    tree = carried_inwards(tree_terms(ff.relative_model(puma()).expansion))
    kept = [[*link.s, *link.P[np.triu_indices(3)], link.mass] for link in tree.links]
    assert [sum(not value.is_constant(0.0) for value in each) for each in kept] == [7] * 6


def test_specialised_code_needs_far_fewer_operations_than_the_general_recursion():
    code = generate(puma())
    assert code.operations.total < 0.4 * sum(code.general)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"what": "reverse"}, "what: expected one of inverse, residual, mass"),
        ({"language": "fortran"}, "language: expected one of c, python, casadi, matlab"),
        ({"parameters": ["link9"]}, "'link9' is the name of no parameter"),
        ({"parameters": "link1"}, "expected a list of names"),
        ({"name": "2 fast"}, "expected letters, digits and underscores"),
    ],
)
def test_what_there_is_not_is_told(options, message):
    with pytest.raises(ModelError, match=message):
        generate(puma(), **options)
