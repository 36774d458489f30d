"""Generated code against the recursive model: the same numbers to rounding, from every language."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.design.generation.generate import LANGUAGES, generate
from floatframe.design.generation.links import GRAVITY, tree_terms
from floatframe.design.generation.routines import ROUTINES, carried_inwards
from floatframe.design.identification.inertial_parameters import parameters_of, point_mass, system_with
from floatframe.engine.tree.recursion import newton_euler
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.design.generation.calls import (
    CALLS,
    SYSTEMS,
    Case,
    agree,
    all_charts,
    arguments,
    few,
    near,
    outputs_of,
    puma,
    python_function,
    wheels,
)


@pytest.fixture(scope="module")
def few_case():
    return Case(few())


@pytest.fixture(scope="module", params=SYSTEMS)
def case(request):
    return Case(SYSTEMS[request.param]())


@pytest.mark.parametrize("what", [what for what in ROUTINES if what != "sensitivity"])
def test_python_has_the_numbers_of_the_model(case, what):
    run = python_function(case.system, what)
    for motion in case.motions:
        agree(outputs_of(run(*arguments(what, motion))), case, what, motion)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("what", ROUTINES)
def test_every_routine_is_the_same_in_every_language(few_case, what, language, tmp_path):
    """That of Python against the model above and below; here all others against it."""
    case = few_case
    code = generate(case.system, what=what, language=language)
    run, plain = CALLS[language](code, tmp_path), python_function(case.system, what)
    own = [code.parameter_values] if code.parameter_names else []
    assert list(code.inputs) == [*ROUTINES[what].inputs, *(["parameters"] if own else [])]
    for motion in case.motions:
        got = outputs_of(run(*arguments(what, motion), *own))
        for one, other, shape in zip(
            got, outputs_of(plain(*arguments(what, motion), *own)), code.outputs.values(), strict=True
        ):
            assert other.shape == shape
            if language in ("casadi", "matlab"):  # matrices; what has more axes has its rows one below the other
                width = shape[-1] if len(shape) > 1 else 1
                assert np.shape(one) == (other.size // width, width)
            near(np.reshape(one, shape), other)


def test_generated_forces_come_from_the_source_of_the_engine(monkeypatch):
    """A law of joints that is changed in the kernels changes in the code: here all forces of hinges turn their sign."""

    def joint_forces(nodes, work, k, f, t):
        work.force[nodes.v0[k]] = -t[2]

    case = Case(puma())
    forces = [python_function(case.system, "inverse")(case.z, case.z_dot, case.z_ddot)]
    monkeypatch.setattr(newton_euler, "joint_forces", SimpleNamespace(py_func=joint_forces))
    forces += [python_function(case.system, "inverse")(case.z, case.z_dot, case.z_ddot)]
    assert_allclose(forces[1], -forces[0], rtol=1e-14, atol=0)


def test_many_motions_at_once_are_those_one_by_one():
    case = Case(puma())
    run = python_function(case.system, "inverse")
    z, v, a = np.random.default_rng(1).normal(size=(3, 6, 5))
    together = run(z, v, a)
    assert together.shape == (6, 5)
    near(together, np.array([run(*each) for each in zip(z.T, v.T, a.T, strict=True)]).T)


@pytest.mark.parametrize("system", ["all charts, free base", "screws"])
def test_parameters_as_symbols_have_the_effect_of_their_numbers(system):
    case = Case(SYSTEMS[system]())
    run = python_function(case.system, "inverse", parameters=["*"])
    values = generate(case.system, parameters=["*"]).parameter_values
    for z, z_dot, z_ddot, _ in case.motions:
        near(run(z, z_dot, z_ddot, values), case.model.inverse_dynamics(z, z_dot, z_ddot))


@pytest.mark.parametrize("system", ["six axes", "all charts, free base", "screws"])
def test_sensitivities_are_what_a_change_of_all_bodies_does(system):
    """The forces are linear in inertial parameters: masses added at random points change them by just that."""
    case = Case(SYSTEMS[system]())
    names = [body.name for body in case.system.bodies]
    values = generate(case.system, what="sensitivity", parameters=names).parameter_values
    run = python_function(case.system, "sensitivity", parameters=names)
    assert_allclose(values, np.concatenate([parameters_of(body) for body in case.system.bodies]), rtol=0, atol=0)
    rng = np.random.default_rng(4)
    for z, z_dot, z_ddot, _ in case.motions:
        by = run(z, z_dot, z_ddot, values)
        added = np.concatenate([rng.uniform(0.1, 1) * point_mass(rng.normal(size=3)) for _ in names])
        other = ff.analyses.relative_model(system_with(case.system, values + added))
        before, after = (model.inverse_dynamics(z, z_dot, z_ddot) for model in (case.model, other))
        near(by @ values, before)
        assert_allclose(by @ added, after - before, rtol=0, atol=1e-12 * np.abs(after).max())


def test_sensitivities_to_gravity_are_what_another_gravity_does():
    case = Case(all_charts())
    run = python_function(case.system, "sensitivity", parameters=["gravity"])
    z, z_dot, z_ddot, _ = case.motions[1]
    gravity = np.array([3.0, -2.0, 5.0])
    other = ff.analyses.relative_model(ff.System(case.system.bodies, case.system.joints, [ff.Gravity(gravity)]))
    code = generate(case.system, what="sensitivity", parameters=["gravity"])
    assert code.parameter_names == GRAVITY
    change = other.inverse_dynamics(z, z_dot, z_ddot) - case.model.inverse_dynamics(z, z_dot, z_ddot)
    near(run(z, z_dot, z_ddot, code.parameter_values) @ (gravity - code.parameter_values), change)


def test_sensitivities_to_the_bodies_below_a_joint_alone():
    case = Case(puma())
    run = python_function(case.system, "sensitivity", parameters=["link?"])
    by = run(case.z, case.z_dot, case.z_ddot, generate(case.system, parameters=["link?"]).parameter_values)
    assert_allclose(by[5, :50], 0, rtol=0, atol=0)  # the last motor carries the last link alone


def test_accelerations_and_matrices_with_symbols():
    case = Case(few())
    for what in ("mass", "forward", "jacobian", "residual"):
        run = python_function(case.system, what, parameters=["*"])
        values = generate(case.system, what=what, parameters=["*"]).parameter_values
        for motion in case.motions:
            agree(outputs_of(run(*arguments(what, motion), values)), case, what, motion)


@pytest.mark.parametrize("system", SYSTEMS)
def test_c_has_the_numbers_of_the_model(system, tmp_path):
    case = Case(SYSTEMS[system]())
    for what in ("inverse",) if system == "all charts, free base" else ("inverse", "mass", "forward"):
        run = CALLS["c"](generate(case.system, what=what), tmp_path)
        for motion in case.motions:
            agree(run(*arguments(what, motion)), case, what, motion)


def test_a_wheel_does_not_turn_with_its_hub_where_that_changes_nothing():
    """The round one does not; those out of balance, oval, and with a body on them do."""
    tree = carried_inwards(tree_terms(ff.analyses.relative_model(wheels()).expansion))
    assert [link.is_round for link in tree.links] == [False, True, False, False, False, False]
    text = generate(wheels(), name="f").files["f.c"]
    assert [f"z[{k}]" in text for k in range(6)] == [True, False, True, True, True, True]


def test_no_link_on_a_hinge_keeps_more_than_seven_numbers():
    """Those of a body on a hinge that can be told from a motion of its parent; the third moves with that."""
    tree = carried_inwards(tree_terms(ff.analyses.relative_model(puma()).expansion))
    kept = [[*link.s, *link.P[np.triu_indices(3)], link.mass] for link in tree.links]
    assert [sum(not value.is_constant(0.0) for value in each) for each in kept] == [7] * 6


def test_specialised_code_needs_far_fewer_operations_than_the_general_recursion():
    code = generate(puma())
    assert code.operations.total < 0.3 * sum(code.general)


def test_prescribed_coordinates_are_coordinates_as_any_but_in_accelerations():
    case = Case(puma())
    joints = [replace(case.system.joints[0], motions={"angle": harmonic(1.0, 1.0)}), *case.system.joints[1:]]
    driven = replace(case.system, joints=joints)
    motion = case.z, case.z_dot, case.z_ddot
    near(python_function(driven, "inverse")(*motion), case.model.inverse_dynamics(*motion))
    with pytest.raises(ModelError, match=r"coordinate 'joint1/angle' is prescribed .* or take what = \"residual\""):
        generate(driven, what="forward")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"what": "reverse"}, "what: expected one of inverse, residual, mass"),
        ({"language": "fortran"}, "language: expected one of c, python, casadi, matlab"),
        ({"parameters": ["link9"]}, "'link9' matches no parameter"),
        ({"parameters": "link1"}, "expected a list of names"),
        ({"name": "2 fast"}, "expected letters, digits and underscores"),
    ],
)
def test_what_there_is_not_is_told(options, message):
    with pytest.raises(ModelError, match=message):
        generate(puma(), **options)
