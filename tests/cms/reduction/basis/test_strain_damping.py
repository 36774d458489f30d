"""Damping of strain patterns, beside the dense matrix, and its file."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import ModeSetError
from cms.modes.mode_sets.classical import craig_bampton
from cms.reduction.basis.strain_damping import KEYS, StrainDamping, read_strain_damping, strain_damping_bytes
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.units import UNIT_SYSTEMS
from tests.bodies import bar
from tests.thread_ranks import ThreadRanks


def coupled(ranks=None):
    return couple(bar(nx=6, ny=2, nz=2, kind="hexahedron", ranks=ranks))


def damping_of(body, beta=2e-6):
    shapes = np.random.default_rng(1).normal(size=(body.n_dof, 3))
    return StrainDamping.of_body(body, beta, np.array([3e-6, 0.0, 5e-6]), body.K @ shapes / 1e6)


@pytest.mark.parametrize("ranks", [None, ThreadRanks(2)])
def test_reduced_damping_is_that_of_the_dense_matrix(ranks):
    one, body = coupled(), coupled(ranks)
    damping = damping_of(one)
    reduced = reduce(body, craig_bampton(body, n_modes=6), damping=damping, geometric=False)
    dense = 2e-6 * one.K.toarray() + damping.forces @ np.diag(damping.coefficients) @ damping.forces.T
    undamped = reduce(replace(one, D=dense), craig_bampton(one, n_modes=6), geometric=False)
    signs = np.sign(np.sum(reduced.Phi * undamped.Phi, axis=(0, 1)))
    assert_allclose(reduced.D * np.outer(signs, signs), undamped.D, rtol=0, atol=1e-7 * np.abs(undamped.D).max())


def test_the_file_holds_the_damping_to_the_last_digit(tmp_path):
    damping = damping_of(coupled())
    path = tmp_path / "part.npz"
    path.write_bytes(strain_damping_bytes(damping))
    read = read_strain_damping(path)
    for key in KEYS:
        assert_array_equal(getattr(read, key), getattr(damping, key))
    assert str(read) == str(damping)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: {"units": UNIT_SYSTEMS["mm-t-s"].name}, "its units are mm-t-s, those of the body m-kg-s"),
        (lambda d: {"positions": d.positions[::-1]}, "its nodes have other positions, or another order"),
        (lambda d: {"components": np.roll(d.components, 1)}, "its dofs have other components"),
    ],
)
def test_damping_of_another_body_is_refused(change, message):
    body = coupled()
    damping = damping_of(body)
    with pytest.raises(ModeSetError, match=f"belongs to another body than .*: {message}.*run it again"):
        reduce(body, craig_bampton(body, n_modes=2), damping=replace(damping, **change(damping)), geometric=False)


@pytest.mark.parametrize("change", [{"beta": -1.0}, {"coefficients": np.array([1.0, -1.0, 0.0])}, {"beta": np.nan}])
def test_negative_and_missing_coefficients_are_refused(change):
    with pytest.raises(
        ModeSetError, match=r"expected finite forces, and coefficients of 0 or more.*run cms split again"
    ):
        replace(damping_of(coupled()), **change)


def test_files_without_all_entries_are_refused(tmp_path):
    np.savez(tmp_path / "part.npz", beta=1.0)
    with pytest.raises(ModeSetError, match="expected a file that cms split wrote"):
        read_strain_damping(tmp_path / "part.npz")
