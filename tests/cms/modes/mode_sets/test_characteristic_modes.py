import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import ModeSetError
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.mode_sets import craig_bampton, craig_bampton_ir, guyan, rubin
from cms.modes.mode_sets.characteristic_modes import with_characteristic_modes
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import TisserandFrame, frame_condition
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import bar

ROUNDOFF = 1e-12


def body_of(kinds):
    free = bar(nx=6, ny=2, nz=2, width=0.3, height=0.25, kind="hexahedron")
    return couple(
        replace(free, interfaces=[replace(x, kind=kind) for x, kind in zip(free.interfaces, kinds, strict=True)])
    )


@pytest.fixture(scope="module")
def body():
    return body_of(["nodes", "nodes"])


@pytest.fixture(scope="module")
def modes(body):
    return craig_bampton(body, n_modes=6)


@pytest.mark.parametrize("together", [False, True])
def test_all_modes_span_all_constraint_modes(body, modes, together):
    found = with_characteristic_modes(modes, body, n_modes=1000, together=together)
    assert found.columns.shape == modes.columns.shape
    angles = la.subspace_angles(found.columns / np.linalg.norm(found.columns, axis=0), modes.columns)
    assert angles.max() < 1e-6
    assert_allclose(reduce(body, found).free_frequencies, reduce(body, modes).free_frequencies, rtol=1e-7)


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize("kinds", [("nodes", "nodes"), ("nodes", "rigid")])
def test_rigid_motion_of_every_interface_stays_in_the_span(kinds, together):
    body = body_of(kinds)
    whole = guyan(body)
    few = with_characteristic_modes(whole, body, n_modes=0, together=together)
    for interface in body.interfaces:
        motion = np.zeros((body.n_dof, 6))  # this interface moves, the others are held
        motion[interface.dofs] = rigid_motion_of_dofs(body.nodes, body.dofs)[interface.dofs]
        expected = whole.columns @ motion[body.b]
        V = few.columns / np.linalg.norm(few.columns, axis=0)
        rest = expected - V @ np.linalg.lstsq(V, expected, rcond=None)[0]
        assert_allclose(rest, 0, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert few.columns.shape[1] == 12


def test_modes_of_one_interface_are_the_lowest_of_its_constrained_pencil(body, modes):
    """Second road: full dense pencil of the interface with R projected out by a penalty-free constraint."""
    found = with_characteristic_modes(modes, body, n_modes=4)
    interface = body.interfaces[0]
    columns = np.flatnonzero([group == "constraint left" for group in modes.groups])
    Psi_C = modes.columns[:, columns]
    K_c, M_c = Psi_C.T @ (body.K @ Psi_C), Psi_C.T @ (body.M @ Psi_C)
    R = rigid_motion_of_dofs(body.nodes, body.dofs)[interface.dofs]
    free_of_R = la.null_space(R.T @ M_c)
    omega2 = la.eigvals(la.solve(free_of_R.T @ M_c @ free_of_R, free_of_R.T @ K_c @ free_of_R)).real
    exact = np.sqrt(np.sort(omega2)[:4]) / (2 * np.pi)
    assert_allclose(found.data["interface modes left"], exact, rtol=1e-7)


def test_reduced_frequencies_lie_above_those_of_all_constraint_modes_and_fall(body, modes):
    whole, before = reduce(body, modes).free_frequencies[:8], np.full(8, np.inf)
    for n in (0, 2, 4, 8, 16):
        found = reduce(body, with_characteristic_modes(modes, body, n_modes=n)).free_frequencies[:8]
        assert (found >= whole * (1 - 1e-9)).all()
        assert (found <= before * (1 + 1e-9)).all()
        before = found
    assert_allclose(before, whole, rtol=1e-2)


def test_a_cutoff_takes_all_modes_below_it(body, modes):
    every = with_characteristic_modes(modes, body, n_modes=1000).data["interface modes right"]
    cutoff = (every[4] + every[5]) / 2
    assert_allclose(
        with_characteristic_modes(modes, body, ModeCount(cutoff=cutoff)).data["interface modes right"],
        every[every <= cutoff],
        rtol=1e-9,
    )


def test_vibration_modes_stay_and_stay_last(body, modes):
    found = with_characteristic_modes(modes, body, n_modes=3)
    assert found.labels[-6:] == modes.labels[-6:]
    assert_allclose(found.columns[:, -6:], modes.columns[:, -6:], rtol=0, atol=0)
    assert found.columns.shape[1] == 2 * (6 + 3) + 6
    assert found.is_static.sum() == 18
    assert "interface left modes" in reduce(body, found).sources


def test_rigid_interfaces_keep_their_constraint_modes():
    body = body_of(["nodes", "rigid"])
    modes = craig_bampton_ir(body, n_modes=2)
    found = with_characteristic_modes(modes, body, n_modes=3)
    assert sum(label.startswith("constraint right") for label in found.labels) == 6
    assert sum(label.startswith("inertia") for label in found.labels) == 6
    assert found.columns.shape[1] == 6 + 3 + 6 + 6 + 2


@pytest.mark.parametrize(("n_modes", "text"), [(None, "either a number or a cutoff"), (-1, "0 or more")])
def test_impossible_numbers_are_refused(body, modes, n_modes, text):
    with pytest.raises(ModeSetError, match=text):
        with_characteristic_modes(modes, body, n_modes)


def test_sets_and_bodies_without_such_modes_are_refused(body):
    with pytest.raises(ModeSetError, match="has 0 constraint modes of interface 'left'"):
        with_characteristic_modes(rubin(body, n_modes=2), body, n_modes=3)
    rigid = body_of(["rigid", "rigid"])
    with pytest.raises(ModeSetError, match="no interface of kind 'nodes'"):
        with_characteristic_modes(guyan(rigid), rigid, n_modes=3)


def free_body_load(body, f):
    """The load with the rigid-body acceleration it causes: what a free body answers by deformation alone."""
    R = rigid_motion_of_dofs(body.nodes, body.dofs)
    return f - body.M @ (R @ np.linalg.solve(R.T @ (body.M @ R), R.T @ f))


def test_static_answers_are_exact_to_loads_whose_motion_is_kept_and_improve_for_others():
    """Loads that hold a kept shape of the interface against its stiffness; unit loads at the rigid one from below."""
    body = body_of(["nodes", "rigid"])
    whole = guyan(body)
    few = with_characteristic_modes(whole, body, n_modes=5)
    u = few.columns @ np.random.default_rng(0).normal(size=few.columns.shape[1])
    f = body.K @ u  # on boundary dofs alone
    assert np.abs(f[body.i]).max() < 1e-8 * np.abs(f).max()
    found = finish(body, few, frame_condition(body, TisserandFrame()))
    answer = found.Phi @ (found.Phi.T @ f / np.diag(found.K))
    rest = u - answer
    R = rigid_motion_of_dofs(body.nodes, body.dofs)
    rest -= R @ np.linalg.lstsq(R, rest, rcond=None)[0]
    assert_allclose(rest, 0, rtol=0, atol=1e-8 * np.abs(answer).max())

    F = np.eye(body.n_dof)[:, body.interface("right").dofs]
    F = free_body_load(body, F)
    compliance = []
    for n in (0, 3, 10, 1000):
        modes = with_characteristic_modes(whole, body, n_modes=n)
        Phi = finish(body, modes, frame_condition(body, TisserandFrame()))
        H = Phi.Phi.T @ F
        compliance.append(np.einsum("kj,kj->j", H, H / np.diag(Phi.K)[:, None]))
    size = compliance[-1]
    for fewer, more in itertools.pairwise(compliance):
        assert (fewer <= more + 1e-9 * size).all()
    full = finish(body, whole, frame_condition(body, TisserandFrame()))
    H = full.Phi.T @ F
    assert_allclose(size, np.einsum("kj,kj->j", H, H / np.diag(full.K)[:, None]), rtol=1e-7)


def test_constraint_modes_of_rigid_interfaces_stay_as_they_are():
    body = body_of(["nodes", "rigid"])
    whole = craig_bampton_ir(body, n_modes=2)
    few = with_characteristic_modes(whole, body, n_modes=3)
    rows = [[k for k, group in enumerate(modes.groups) if group == "constraint right"] for modes in (whole, few)]
    assert len(rows[0]) == 6
    assert_array_equal(few.columns[:, rows[1]], whole.columns[:, rows[0]])
