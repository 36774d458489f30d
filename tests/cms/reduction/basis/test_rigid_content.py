"""Rigid-body motion is found by its vectors: no ratio of frequencies is taken for it."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose

from cms.assessment.quality.body_check import check_body
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.linear_algebra.independent import independent_columns
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import craig_bampton_ir
from cms.reduction.basis.finishing import elastic_directions, orthonormal_motions
from cms.reduction.basis.frames import NodalFrame, TisserandFrame
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.free_pencil import free_elastic_modes
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import beam, chain

ROUNDOFF = 1e-12


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left")], ids=str)
@pytest.mark.parametrize("n", [8, 20])
def test_a_body_of_many_decades_of_frequency_keeps_all_its_modes(n, frame):
    """Frequencies from 1 to 3700 in a nodal frame: the slow modes come back from the moments of the file."""
    body = couple(beam(n))
    reduced = reduce(body, craig_bampton_ir(body, n_modes=30), frame=frame)
    if isinstance(frame, NodalFrame):
        assert reduced.frequencies.max() / reduced.frequencies.min() > 1500
    own, _, is_massive = free_elastic_modes(reduced)
    assert is_massive.sum() == reduced.n_q == len(reduced.free_frequencies)
    assert_allclose(np.sqrt(own) / (2 * np.pi), reduced.free_frequencies, rtol=1e-7)
    assert [record.name for record in check_body(reduced) if record.verdict == "fail"] == []


def masses_on_soft_and_stiff_springs(ratio):
    """Four pairs of unit masses, stiff springs inside the pairs, soft ones between: frequencies of two scales."""
    body = chain(8, 1.0, 1.0)
    stiffness = np.array([ratio**2, 1.0] * 3 + [ratio**2])
    K = np.diag(np.r_[stiffness, 0]) + np.diag(np.r_[0, stiffness])
    K -= np.diag(stiffness, 1) + np.diag(stiffness, -1)
    return couple(replace(body, K=sp.csc_array(K)))


@pytest.mark.parametrize("ratio", [10.0, 1e3, 1e5])
def test_slow_modes_of_a_stiff_body_are_not_rigid_motion(ratio):
    """The pairs move as masses of two on unit springs, to the second order of soft over stiff."""
    body = masses_on_soft_and_stiff_springs(ratio)
    unit = ModeSet("unit", np.eye(8), tuple(f"dof {k}" for k in range(8)), np.full(8, np.nan))
    with Families(body) as families:
        omega2 = free_basis(body, unit, families).omega2
    assert len(omega2) == 7
    # of the pairs alone: a row of four masses of two, corrected by a stiff spring of half the length: exact by 2 x 2
    slow = 2 * np.sin(np.arange(1, 4) * np.pi / 8) ** 2
    assert_allclose(omega2[:3], slow, rtol=3 / ratio**2 + 1e-16 * ratio**2 * 100)
    exact = la.eigvalsh(body.K.toarray())[1:]
    assert_allclose(omega2[3:], exact[3:], rtol=1e-12)


def test_the_span_of_rigid_motion_and_shapes_loses_the_rigid_motion_alone():
    """Directions of [rigid, elastic] in the norm W are the elastic ones, whatever mixture the columns are."""
    body = couple(beam(6))
    K, M = body.K.toarray(), body.M.toarray()
    values, V = la.eigh(K, M)
    omega2 = values[6]
    R = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
    mix = np.random.default_rng(1).normal(size=(10, 10))
    X = np.hstack([R[:, :4], V[:, 6:12]]) @ mix
    Q, _ = independent_columns(X, body, omega2)
    N = R @ orthonormal_motions(R.T @ M @ R, omega2)
    W = K + omega2 * M
    C = Q.X.T @ W @ N
    E = N - Q.X @ C
    Z = elastic_directions(C, E.T @ W @ E)
    assert Z.shape == (10, 6)
    shapes = Q.X @ Z
    assert_allclose(R.T @ M @ shapes, 0, atol=1e3 * ROUNDOFF * np.abs(M).max())
    found = la.eigh(shapes.T @ K @ shapes, shapes.T @ M @ shapes, eigvals_only=True)
    assert_allclose(found, values[6:12], rtol=1e-9)


def test_a_motion_without_inertia_has_no_length():
    mass = np.diag([2.0, 2.0, 2.0, 0.0, 1.0, 1.0])
    S = orthonormal_motions(mass, 4.0)
    assert S.shape == (6, 5)
    assert_allclose(4.0 * S.T @ mass @ S, np.eye(5), atol=ROUNDOFF)


def test_a_direction_without_stiffness_and_mass_is_no_shape():
    with pytest.raises(np.linalg.LinAlgError, match="neither stiffness nor mass"):
        elastic_eigenvectors(np.diag([1.0, 0.0]), np.diag([1.0, 0.0]), 1.0)


def test_columns_of_rounding_alone_leave_no_basis():
    body = couple(beam(4))
    X = 1e-300 * np.ones((body.n_dof, 2))
    basis, redundant = independent_columns(X, body, 1.0)
    assert basis.X.shape == (body.n_dof, 0)
    assert redundant.tolist() == [0, 1]
