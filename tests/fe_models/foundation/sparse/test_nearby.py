import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fe_models.body.couplings.couplings import couple
from fe_models.foundation.sparse.submatrix import nearby_order, principal_block, scalar_part
from tests.bodies import bar


@pytest.fixture
def shuffled():
    """A long bar, coupled, whose first nodes are numbered at random."""
    body = couple(bar(nx=30, ny=2, nz=2))
    return body, np.random.default_rng(0).permutation(len(body.nodes))


def test_neighbours_come_near_and_the_mass_keeps_its_scalar_part(monkeypatch, shuffled):
    monkeypatch.setattr("fe_models.foundation.sparse.submatrix.FEW_DOFS", 0)
    body, number = shuffled
    dofs = np.stack([number[body.dofs[:, 0]], body.dofs[:, 1]], axis=1)
    by_number = np.lexsort((dofs[:, 1], dofs[:, 0]))  # the dofs as a program would have them that numbers so
    K, M = principal_block(body.K, by_number), principal_block(body.M, by_number)
    dofs = dofs[by_number]
    index = np.setdiff1d(np.arange(len(dofs)), np.flatnonzero(np.isin(by_number, body.b)))[2:]  # cuts a node in two
    order = nearby_order(K, dofs, index)
    assert_array_equal(np.sort(order), index)
    n_whole = 3 * (len(np.unique(dofs[index, 0])) - 1)
    far, near = (np.abs(np.subtract(*principal_block(K, i).nonzero())).max() for i in (index, order[:n_whole]))
    assert near < 0.3 * far
    mass = principal_block(M, order)
    S = scalar_part(mass)
    assert 3 * S.shape[0] == n_whole
    assert_array_equal(np.kron(S.toarray(), np.eye(3)), mass.toarray()[:n_whole, :n_whole])


def test_few_dofs_stay_as_they_are(shuffled):
    body, _ = shuffled
    assert_array_equal(nearby_order(body.K, body.dofs, body.i), body.i)
