import logging

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import cms
from cms.errors import BodyError, FactorizationError, ModeSetError
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.superlu import SuperLuFactor
from cms.linear_algebra.substructures import modes as modes_module
from cms.linear_algebra.substructures.modes import Interior, multilevel_modes
from cms.linear_algebra.substructures.tree import substructure_tree
from fe_models.foundation.solver import Solver
from tests.bodies import bar
from tests.cms.linear_algebra.substructures.shells import between, panel

N = 24


@pytest.fixture(scope="module")
def shell():
    return panel()


@pytest.fixture(scope="module")
def direct(shell):
    """All modes far beyond the wanted ones, by block Lanczos."""
    return cms.modes.craig_bampton_ir(shell, n_modes=2 * N)


@pytest.fixture(scope="module")
def modes(shell):
    return cms.modes.multilevel(shell, n_modes=ModeCount(N, verify=True), inertia_relief=True)


def interior_of(body):
    i = body.i
    K, M = (sp.csc_array(A[i][:, i]) for A in (body.K, body.M))
    return Interior(K, M, body.dofs[i, 0], body.nodes, np.zeros(len(i), bool))


def relative_errors(modes, direct):
    found = modes.frequencies[np.isfinite(modes.frequencies)]
    return found / direct.frequencies[np.isfinite(direct.frequencies)][: len(found)] - 1


def test_frequencies_lie_above_the_true_ones_and_within_the_tolerance(modes, direct):
    errors = relative_errors(modes, direct)
    assert len(errors) == N
    assert errors.min() > -1e-8  # of the direct solver
    assert 1e-8 < errors.max() < 1e-3
    assert modes.options["verified"].startswith("yes: ")
    assert modes.options["above tolerance"] == "none"


def test_the_estimated_error_is_no_less_than_the_true_one(modes, direct):
    estimated = modes.data["frequency error"]
    assert np.isnan(estimated[:-N]).all()
    true = relative_errors(modes, direct)
    assert (estimated[-N:] >= true - 2 * true**2 - 1e-9).all()  # to first order, and rounding
    assert estimated[-N:].max() < 4 * relative_errors(modes, direct).max()


@pytest.mark.parametrize("times", [2.5, 4.0])
def test_a_guess_that_is_too_high_keeps_no_more_modes_of_substructures(shell, direct, monkeypatch, times):
    guessed = modes_module.guessed_omega2
    monkeypatch.setattr(modes_module, "guessed_omega2", lambda *of: times * guessed(*of))
    kept = int(
        cms.modes.multilevel(shell, n_modes=N, cutoff_factor=3.0)
        .options["eigensolver"]
        .split(" in a tree, ")[1]
        .split()[0]
    )
    highest = (2 * np.pi * direct.frequencies[np.isfinite(direct.frequencies)][N - 1]) ** 2
    interior = interior_of(shell)
    dissection = interior.dissection(modes_module.LEAF)
    K, M = (dissection.in_order(A) for A in (interior.K, interior.M))
    least, most = (
        len(substructure_tree(dissection, K, M, 9 * factor * highest, multipliers=np.zeros(0, int)).omega2)
        for factor in (1.0, 1.4)
    )
    assert least <= kept <= most


def test_static_columns_are_those_of_craig_bampton(shell, modes, direct):
    n_static = len(modes.labels) - N
    assert modes.labels[:n_static] == direct.labels[:n_static]
    assert_allclose(modes.columns[:, :n_static], direct.columns[:, :n_static], rtol=0, atol=1e-9)
    force = shell.K @ modes.columns[:, :12]
    assert_allclose(force[shell.i], 0, rtol=0, atol=1e-9 * np.abs(force).max())


def test_modes_are_orthonormal_and_vanish_on_the_boundary(shell, modes):
    Phi = modes.columns[:, -N:]
    assert (Phi[shell.b] == 0).all()
    assert_allclose(Phi.T @ (shell.M @ Phi), np.eye(N), rtol=0, atol=1e-10)
    omega2 = (2 * np.pi * modes.frequencies[-N:]) ** 2
    assert_allclose(Phi.T @ (shell.K @ Phi), np.diag(omega2), rtol=0, atol=1e-8 * omega2.max())


def test_many_modes_of_substructures_need_no_step(shell, direct):
    modes = cms.modes.multilevel(shell, n_modes=N)
    assert "0 steps" in modes.options["eigensolver"]
    assert 1e-6 < relative_errors(modes, direct).max() < 1e-3


def test_a_tighter_tolerance_takes_more_steps_and_is_met(shell, direct):
    modes = cms.modes.multilevel(shell, n_modes=N, tolerance=1e-6, cutoff_factor=3.0)
    assert "1 steps" not in modes.options["eigensolver"]
    assert np.abs(relative_errors(modes, direct)).max() < 1e-6


def test_where_a_few_modes_are_above_the_tolerance_one_step_improves_all(shell, direct):
    before = cms.modes.multilevel(shell, n_modes=N, cutoff_factor=14.0)
    tolerance = np.sort(before.data["frequency error"][-N:])[-4]
    modes = cms.modes.multilevel(shell, n_modes=N, cutoff_factor=14.0, tolerance=tolerance)
    assert "1 steps" in modes.options["eigensolver"]
    assert relative_errors(before, direct).max() > tolerance
    assert relative_errors(modes, direct).max() < tolerance
    Phi = modes.columns[:, -N:]
    assert_allclose(Phi.T @ (shell.M @ Phi), np.eye(N), rtol=0, atol=1e-10)


def test_what_stays_above_the_tolerance_is_told(shell, caplog):
    with caplog.at_level(logging.WARNING):
        modes = cms.modes.multilevel(shell, n_modes=N, tolerance=1e-10, cutoff_factor=1.2)
    above = modes.data["frequency error"][-N:] > 1e-10
    if not above.any():
        pytest.fail("choose a case that does not converge")
    assert modes.options["above tolerance"].split(", ") == [str(k + 1) for k in np.flatnonzero(above)]
    assert f"{above.sum()} of {N} frequencies" in caplog.text


def test_a_cutoff_finds_all_modes_below_it(shell, direct):
    frequencies = direct.frequencies[np.isfinite(direct.frequencies)]
    cutoff = (frequencies[N - 1] + frequencies[N]) / 2
    modes = cms.modes.multilevel(shell, n_modes=ModeCount(cutoff=cutoff, verify=True))
    assert len(relative_errors(modes, direct)) == N
    assert np.abs(relative_errors(modes, direct)).max() < 1e-3


def test_modes_that_come_below_a_cutoff_late_are_not_left_out(shell, direct, monkeypatch):
    frequencies = direct.frequencies[np.isfinite(direct.frequencies)]
    cutoff = (frequencies[N - 1] + frequencies[N]) / 2
    monkeypatch.setattr("cms.linear_algebra.substructures.modes.MARGIN", frequencies[N - 4] / cutoff)
    modes = cms.modes.multilevel(shell, n_modes=ModeCount(cutoff=cutoff))
    assert len(relative_errors(modes, direct)) == N
    assert modes.data["frequency error"][-N:].max() < 1e-3
    monkeypatch.setattr("cms.linear_algebra.substructures.modes.GUARDS", 1)
    monkeypatch.setattr("cms.linear_algebra.substructures.modes.GUARD_SHARE", 0.0)
    with pytest.raises(cms.errors.CmsError, match=r"are below this frequency.*choose a larger cutoff_factor"):
        cms.modes.multilevel(shell, n_modes=ModeCount(cutoff=cutoff))


def test_a_body_that_is_one_leaf_is_solved_exactly():
    body = cms.couple(bar(nx=3, kind="hexahedron"))
    modes, direct = cms.modes.multilevel(body, n_modes=5), cms.craig_bampton(body, n_modes=5)
    assert modes.options["substructures"].startswith("1 in 1 levels")
    assert_allclose(relative_errors(modes, direct), 0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", ["rigid", "distributing"])
def test_solids_with_both_kinds_of_interfaces(kind):
    body = between(kind)
    modes, direct = cms.modes.multilevel(body, n_modes=ModeCount(8, verify=True)), cms.craig_bampton(body, n_modes=12)
    errors = relative_errors(modes, direct)
    assert errors.min() > -1e-8
    assert errors.max() < 1e-3
    scale = np.abs(direct.columns[:, :12]).max()
    assert_allclose(modes.columns[:, :12], direct.columns[:, :12], rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("solver", [None, Solver("slepc", SuperLuFactor)])  # whose own search needs its own factor
def test_other_sets_of_the_same_families_use_the_tree(shell, monkeypatch, direct, solver):
    with cms.modes.Families(shell, solver=solver) as families:
        cms.modes.multilevel(families, n_modes=2)
        monkeypatch.setattr("cms.modes.families.fixed_interface.factorize", None)
        other = cms.craig_bampton(families, n_modes=6)
        assert "tree of" in families.fixed.factorization.description
    frequencies = direct.frequencies[np.isfinite(direct.frequencies)]
    assert_allclose(other.frequencies[-6:], frequencies[:6], rtol=1e-8)


def test_the_reduced_body_is_that_of_craig_bampton(shell, modes, tmp_path):
    """Rigid moments are exact, the modal ones obey tr S_kl = M; free frequencies are close."""
    one = cms.reduce(shell, modes, geometric=False)
    two = cms.reduce(shell, cms.modes.craig_bampton_ir(shell, n_modes=N), geometric=False)
    assert_allclose(one.moments.m, two.moments.m, rtol=1e-12)
    assert_allclose(one.moments.R, two.moments.R, rtol=0, atol=1e-9 * np.abs(two.moments.R).max())
    rotary = 0.05  # inertia, which is no part of the moments
    assert_allclose(np.einsum("aakl->kl", one.moments.S_kl), one.M, rtol=0, atol=rotary)
    ratio = one.free_frequencies[:20] / two.free_frequencies[:20]
    assert np.abs(ratio - 1).max() < 1e-3
    cms.write(one, tmp_path / "panel.h5")
    assert cms.read(tmp_path / "panel.h5").provenance == one.provenance


def test_no_modes_at_all_are_constraint_modes(shell):
    assert cms.modes.multilevel(shell, n_modes=0).labels == cms.modes.guyan(shell).labels


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"n_modes": 10**6}, "interior dofs; choose"),
        ({"n_modes": 3, "tolerance": 0.0}, "tolerance = 0; expected 1e-10 to 0.1"),
        ({"n_modes": 3, "cutoff_factor": 1.0}, "cutoff_factor = 1; expected 1.2 to 100"),
        ({"n_modes": ModeCount(cutoff=1e-3)}, "lies below the first fixed-interface mode"),
    ],
)
def test_bad_options_are_refused(shell, options, words):
    with pytest.raises(ModeSetError, match=words):
        cms.modes.multilevel(shell, **options)


def test_a_large_part_of_all_modes_is_refused(shell):
    with pytest.raises(ModeSetError, match="expected at most 1 in 8 of them; take craig-bampton"):
        cms.modes.multilevel(shell, n_modes=len(shell.i) // 7)


@pytest.mark.parametrize("factor", [1.2, 1.5])
@pytest.mark.parametrize("count", [8, 24])
def test_small_cutoff_factors_leave_as_many_modes_as_are_wanted_and_guards(shell, direct, count, factor):
    """Before, 6 to 24 modes of substructures were kept."""
    modes = cms.modes.multilevel(shell, n_modes=count, cutoff_factor=factor)
    errors = relative_errors(modes, direct)
    assert len(errors) == count
    assert modes.data["frequency error"][-count:].max() < 1e-3
    assert -1e-8 < errors.min() <= errors.max() < 1e-3


def test_a_guess_that_is_too_low_is_made_up_for(shell, direct, monkeypatch):
    guessed = modes_module.guessed_omega2
    monkeypatch.setattr(modes_module, "guessed_omega2", lambda *of: guessed(*of) / 40)
    modes = cms.modes.multilevel(shell, n_modes=N, cutoff_factor=3.0)
    assert 0 < relative_errors(modes, direct).max() < 1e-3


def test_more_modes_than_the_substructures_keep_are_refused(shell, monkeypatch):
    monkeypatch.setattr("cms.linear_algebra.substructures.modes.guessed_omega2", lambda *_: 1.0)
    with pytest.raises(cms.errors.CmsError, match="choose a larger cutoff_factor"):
        cms.modes.multilevel(shell, n_modes=N)


def test_interfaces_that_do_not_hold_the_body_are_refused():
    from fe_models.body.fe_body import Interface

    free = bar(nx=4, kind="hexahedron")
    corner = Interface("corner", "nodes", np.array([0]), free.nodes[0], dofs=np.flatnonzero(free.dofs[:, 0] == 0)[:3])
    from dataclasses import replace

    body = cms.couple(replace(free, interfaces=(corner,)))
    with pytest.raises(ModeSetError, match="leave a rigid-body motion free"):
        cms.modes.multilevel(body, n_modes=3)


def test_a_part_that_nothing_holds_is_refused_although_its_pivots_are_positive():
    """Rounding leaves the last pivots of a free part at some 1e-16 of the others, of either sign."""
    body, free = between("rigid"), bar(nx=8, ny=2, nz=2)
    K, M = (sp.block_diag([A[body.i][:, body.i], B], format="csc") for A, B in ((body.K, free.K), (body.M, free.M)))
    nodes = np.concatenate([body.dofs[body.i, 0], len(body.nodes) + free.dofs[:, 0]])
    points = np.concatenate([body.nodes, free.nodes + 10.0])
    interior = Interior(sp.csc_array(K), sp.csc_array(M), nodes, points, np.zeros(len(nodes), bool))
    with pytest.raises(FactorizationError, match="the matrix is singular: a solution leaves"):
        multilevel_modes(interior, ModeCount(8))


def test_a_mechanism_is_told_by_its_nodes():
    from dataclasses import replace

    body = between("rigid")
    K = body.K.tolil()
    loose = body.i[-1]
    K[loose, :] = 0
    K[:, loose] = 0
    with pytest.raises(BodyError, match="with all interfaces held"):
        cms.modes.multilevel(replace(body, K=sp.csc_array(K.tocsc())), n_modes=3)
