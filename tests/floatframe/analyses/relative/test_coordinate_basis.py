"""Linearisation in the coordinates of joints: names, the same dynamics, and the Newton matrix of the tree."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import block_diag

from floatframe import FlexibleBody, Marker, linearize, static_equilibrium, system_modes
from floatframe.analyses import named_state_space, steady_rotation
from floatframe.analyses.relative.coordinate_basis import coordinate_names, dependent_coordinates
from floatframe.components.mechanisms import slider_crank
from floatframe.engine.compiling.file_frames import motion_of_engine, small_motions_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.engine.tree.kernels.entry import motion_of_joints, newton_matrix
from floatframe.engine.tree.kernels.tree import new_joint_work
from floatframe.engine.tree.topology import tree_of
from floatframe.engine.tree.tree_motions import coordinate_motions
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.results.small_motions.joint_rates import coordinate_rows
from floatframe.sensors import Channel
from tests.floatframe.analyses.relative.examples import CASES


@cache
def found(name):
    """System, steady motion, linearised in both formulations with an input and outputs."""
    system = CASES[name]()
    about = static_equilibrium(system)
    if name == "turning":
        system = replace(system, forces=[])
        about = steady_rotation(system, (0.0, 0.0, 12.0))
    flexible = next(body.name for body in reversed(system.bodies) if isinstance(body, FlexibleBody))
    inputs = [Channel("push", Marker(flexible, "b"), (0.2, 1.0, 0.1))]
    outputs = [*inputs, Channel("turn", Marker(flexible, "end"), (0.1, 0.2, 1.0), quantity="rotation")]
    both = {
        each: linearize(system, about, inputs=inputs, outputs=outputs, formulation=each)
        for each in ("absolute", "relative")
    }
    return system, about, both


@pytest.mark.parametrize("name", CASES)
def test_both_formulations_have_the_same_modes_and_responses(name):
    _, _, both = found(name)
    absolute, relative = both["absolute"], both["relative"]
    assert relative.n_z == absolute.n_z
    first, second = (system_modes(each).eigenvalues for each in (absolute, relative))
    apart = np.abs(first[:, None] - second)  # in no order: real parts without damping are rounding
    assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 1e-9 * np.abs(first).max()
    frequencies = [0.1, 1.3, 7.0, 60.0]
    expected = absolute.response(frequencies)
    assert_allclose(relative.response(frequencies), expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["double pendulum", "free", "turning"])
def test_matrices_of_a_tree_are_those_of_its_newton_matrix(name):
    """A second road: rows of joints nowhere, geometric stiffness from forces over subtrees."""
    system, about, both = found(name)
    compiled, tree = compiled_system(system), tree_of(system).tree
    model, work, joints = compiled.model, new_work(compiled.model), new_joint_work(compiled.model, tree)
    state, u_dot = motion_of_engine(compiled, about.state, about.u_dot)
    set_iterate(work, state, u_dot, about.w)
    motion_of_joints(model, work, tree, joints)
    M, CK, K = (newton_matrix(model, work, tree, joints, *c) for c in ((1, 0, 0), (0, 1, 1), (0, 0, 1)))
    n = int(tree.s0[-1])
    if name == "free":  # springs beside the tree: dw = -V⁻¹ C ds; the frame of its file, in body axes
        by_s = [-np.linalg.solve(part[n:, n:], part[n:, :n]) for part in (CK, K)]
        CK, K, M = CK[:n, :n] + CK[:n, n:] @ by_s[0], K[:n, :n] + K[:n, n:] @ by_s[1], M[:n, :n]
        by_tree = coordinate_motions(compiled, tree, state)
        T = np.linalg.lstsq(by_tree, engine_motions(compiled, state, both), rcond=None)[0]
        M, CK, K = (T.T @ part @ T for part in (M, CK, K))
    relative = both["relative"]
    for own, expected in ((relative.M, M), (relative.C, CK - K), (relative.K, K)):
        assert_allclose(own, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def engine_motions(compiled, state, both):
    """N of the relative formulation in the frames of the engine."""
    return np.linalg.solve(block_diag(*small_motions_of_file(compiled, state.q)), both["relative"].N)


@pytest.mark.parametrize("name", CASES)
def test_each_coordinate_moves_at_rate_one_of_what_it_is_named_after(name):
    """Rates of joint coordinates and of body frames by N are rows of a unit matrix."""
    system, about, both = found(name)
    relative, compiled = both["relative"], compiled_system(system)
    state, u_dot = motion_of_engine(compiled, about.state, about.u_dot)
    work = new_work(compiled.model)
    set_iterate(work, state, u_dot, about.w)
    linearized(compiled.model, work, 1.0, 0.0, 0.0)
    rows = coordinate_rows(system, compiled, work, state)
    N = engine_motions(compiled, state, both)
    known = {name: row @ N for name, row in rows.items()}
    first = 0
    for body, mass in zip(relative.body_names, relative.body_masses, strict=True):
        names = [*(f"{body} {c}" for c in ("x", "y", "z", "rx", "ry", "rz"))]
        names += [f"{body} mode {k + 1}" for k in range(len(mass) - 6)]
        known |= dict(zip(names, relative.N[first : first + len(mass)], strict=True))
        first += len(mass)
    assert len(relative.coordinates) == relative.n_z > 20
    for k, (name, row) in enumerate(zip(relative.coordinates, np.eye(relative.n_z), strict=True)):
        assert_allclose(known[name], row, rtol=0, atol=1e-11, err_msg=f"{k}")


def test_states_of_a_state_space_are_the_coordinates():
    _, _, both = found("four-bar")
    relative = both["relative"]
    states = relative.coordinates
    assert states[0] == "main.angle"
    space = named_state_space(relative)
    assert space.states == (*states, *(f"{name} rate" for name in states))
    assert_allclose(space.A[len(states) :, : len(states)], -np.linalg.solve(relative.M, relative.K), rtol=0,
                    atol=1e-9 * np.abs(space.A).max())  # fmt: skip
    massive, _ = relative.with_mass()
    assert massive.coordinates == states


def test_dependent_coordinates_leave_a_system_that_can_be_solved():
    rng = np.random.default_rng(3)
    C = rng.normal(size=(4, 9))
    C = np.vstack([C, C[0] + C[1]])  # repeats others
    C[:, 8] = 1e-3 * C[:, 8]  # far out, but hardly moves what is held
    dependent = dependent_coordinates(C, np.arange(9))
    assert len(dependent) == 4
    assert 8 not in dependent
    assert np.linalg.cond(C[:4, dependent]) < 100
    assert_allclose(dependent_coordinates(np.zeros((2, 3)), np.arange(3)), [])


def test_names_leave_out_what_is_driven():
    assert coordinate_names(slider_crank(angle=0.3)) == ("main.angle", "pin.angle", "guide.distance")
    driven = slider_crank(angle=0.3, drive=polynomial_of_time([0.3, 1.0]))
    assert coordinate_names(driven) == ("pin.angle", "guide.distance")


def test_formulations_that_are_none_are_told():
    system, _, _ = found("double pendulum")
    with pytest.raises(ModelError, match="formulation: expected one of absolute, relative, got 'relativ'; did you"):
        linearize(system, formulation="relativ")
    with pytest.raises(ModelError, match="formulation: expected one of absolute, relative"):
        static_equilibrium(system, formulation="joints")
