"""The campaign of verdicts: bodies that were judged wrongly."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import cms
from cms.assessment.quality.of_body.recovery_rows import check_recovery_forces
from cms.assessment.quality.reference.full_reference import FullReference
from cms.linear_algebra.solvers.factorization import factorize
from tests.campaign.sound_bodies import sound_body
from tests.campaign.verdicts import judged


@pytest.mark.parametrize("seed", [120157, 120682, 170504, 170540])
def test_stress_that_is_rounding_alone_is_judged_alike_in_all_units(seed):
    """Rows of the middle surface of a plate, which has no stress where it bends."""
    body = sound_body(seed).reduced
    systems = ("m-kg-s", "mm-t-s", "in-slinch-s")
    found = [check_recovery_forces(cms.body.convert_units(body, units)).value for units in systems]
    assert max(found) < 1e-6
    assert_allclose(found, found[0], rtol=1e-6)
    table = body.recovery["all"]
    dynamic = np.array(table.dynamic)
    size = np.linalg.norm(np.ptp(body.nodes, axis=0))
    stiffness = (np.diag(body.K) / np.abs(body.Phi).max(axis=(0, 1)) ** 2).max()
    dynamic[0, table.quantities.index("stress"), 0] = 1e-2 * stiffness / size**2
    wrong = replace(body, recovery={"all": replace(table, dynamic=dynamic)})
    assert check_recovery_forces(wrong).verdict == "fail"


@pytest.mark.parametrize("seed", [170049, 170157])
def test_a_well_conditioned_matrix_with_multipliers_is_not_called_singular(seed):
    """Matched pivots grew without bound: ten negative pivots for six multipliers, and solutions of no digit."""
    body = sound_body(seed).body
    inner = np.setdiff1d(np.arange(body.n_dof), body.b)
    K_ii = sp.csc_array(body.K)[inner][:, inner]
    x = np.random.default_rng(1).normal(size=len(inner))
    with factorize(K_ii, definite=False) as factor:
        assert factor.inertia.n_negative == np.sum(np.linalg.eigvalsh(K_ii.toarray()) < 0) == 6
        assert_allclose(factor.solve(K_ii @ x), x, rtol=0, atol=1e-8 * np.abs(x).max())


def test_coordinates_in_columns_that_nearly_repeat_each_other_are_compared():
    """Rounding of 2000 times the mode hides V A = Phi; the work of the columns shows a wrong sign all the same."""
    sound = sound_body(281074)
    columns = sound.reduced.columns
    wrong = np.array(columns.A)
    wrong[:, 17] *= -1
    with FullReference(sound.body, band=1.5 * sound.reduced.free_frequencies[0] / sound.body.units.time) as reference:
        for A, verdict in ((columns.A, "pass"), (wrong, "fail")):
            body = replace(sound.reduced, columns=replace(columns, A=A))
            assert judged(sound, body, reference)["sources"].verdict == verdict


@pytest.mark.parametrize("seed", [120160, 120251])
def test_approximated_moments_are_compared_after_a_change_of_frame(seed):
    sound = sound_body(seed)
    assert "carried" in sound.words
    assert not sound.reduced.moments.is_exact
    moments = sound.reduced.moments
    S_kl = np.array(moments.S_kl)
    S_kl[0, 1, 0] *= -1
    S_kl[1, 0, :, 0] *= -1
    with FullReference(sound.body, band=1.5 * sound.reduced.free_frequencies[0]) as reference:
        for changed, verdict in ((moments, "pass"), (replace(moments, S_kl=S_kl), "fail")):
            body = replace(sound.reduced, moments=changed)
            assert judged(sound, body, reference)["invariants"].verdict == verdict
