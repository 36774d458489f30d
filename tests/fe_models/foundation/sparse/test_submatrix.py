import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.foundation.sparse.submatrix import PrincipalBlock, principal_block, scalar_part


@pytest.mark.parametrize("index", [[0, 1, 2], [1, 4, 5, 9], [9], list(range(10)), [0, 9]])
def test_principal_block_is_what_indexing_gives(index):
    A = sp.random_array((10, 10), density=0.12, rng=np.random.default_rng(0), format="csc")
    assert np.diff(A.indptr).min() == 0  # an empty column
    block = principal_block(A, np.array(index))
    assert_array_equal(block.toarray(), A.toarray()[np.ix_(index, index)])
    assert block.has_canonical_format


def symmetric(n, density, seed=0):
    A = sp.random_array((n, n), density=density, rng=np.random.default_rng(seed), format="csc")
    return sp.csc_array(A + A.T + 4 * sp.eye_array(n))


@pytest.mark.parametrize("limit", [0, 10**9])  # compiled, and by SciPy
@pytest.mark.parametrize("n_parts", [1, 3])
def test_a_principal_block_in_any_order_is_sorted_and_what_indexing_gives(monkeypatch, limit, n_parts):
    monkeypatch.setattr("fe_models.foundation.sparse.submatrix.SMALL", limit)
    monkeypatch.setattr("fe_models.foundation.threads.n_threads", lambda: n_parts)
    A = sp.kron(symmetric(40, 0.1), np.ones((3, 3)), format="csc")  # rows come in runs
    index = np.random.default_rng(1).permutation(120)[:95]
    index[:12] = np.sort(index[:12])
    block = principal_block(A, index)
    assert_array_equal(block.toarray(), A.toarray()[np.ix_(index, index)])
    assert (np.concatenate([np.diff(part) for part in np.split(block.indices, block.indptr[1:-1])]) > 0).all()


def test_products_with_a_principal_block_need_no_copy_of_it():
    generator = np.random.default_rng(3)
    A = sp.csc_array(sp.random_array((30, 30), density=0.3, rng=generator))
    index = generator.permutation(30)[:17]
    block, x = PrincipalBlock(A, index), generator.standard_normal((17, 2))
    whole = A.toarray()[np.ix_(index, index)]
    assert block.shape == (17, 17)
    assert_array_equal(principal_block(block.A, block.index).toarray(), whole)
    assert_array_equal(block.diagonal(), np.diag(whole))
    assert_allclose(block @ x, whole @ x, rtol=0, atol=1e-14)
    assert_allclose(block @ x[:, 0], whole @ x[:, 0], rtol=0, atol=1e-14)


def test_the_scalar_part_of_a_mass_ends_where_the_components_differ():
    S = symmetric(12, 0.3)
    M = sp.kron(S, sp.eye_array(3), format="csc")
    assert_array_equal(scalar_part(M).toarray(), S.toarray())
    for row, column in ((30, 30), (30, 31), (31, 28), (28, 31)):  # of the node 10: its own, and that of an earlier one
        other = M.tolil()
        other[row, column] += 0.5
        other[column, row] = other[row, column]
        assert_array_equal(scalar_part(sp.csc_array(other)).toarray(), S.toarray()[:10, :10])
    bordered = sp.block_array([[M, sp.csc_array(np.ones((36, 2)))], [np.ones((2, 36)), np.eye(2)]], format="csc")
    bordered.sort_indices()
    assert_array_equal(scalar_part(bordered).toarray(), S.toarray())


def test_a_matrix_without_a_scalar_part_has_an_empty_one():
    assert scalar_part(symmetric(9, 0.5)).shape == (0, 0)
    assert scalar_part(sp.csc_array((2, 2))).shape == (0, 0)
