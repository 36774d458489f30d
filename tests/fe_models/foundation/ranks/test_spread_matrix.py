"""A matrix by rows on ranks that are threads, beside the whole matrix."""

import gc

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.foundation.ranks.rows import Rows
from fe_models.foundation.ranks.spread_matrix import COLUMNS, OwnRows, SpreadMatrix, largest_entry, whole_matrix
from tests.thread_ranks import ThreadRanks

N = 60
STARTS = {1: (0, N), 2: (0, 23, N), 4: (0, 23, 23, 40, N)}  # one rank without rows


def own_rows_of(ranks, A, order, rows):
    part = sp.csr_array(A)[order[rows.of(ranks.rank)]][:, order]
    part.sort_indices()
    return OwnRows(part.indptr, part.indices, part.data)


@pytest.fixture(params=STARTS)
def pair(request):
    """A symmetric matrix, one row of which has no diagonal entry, and the same on ranks in another order."""
    generator = np.random.default_rng(request.param)
    half = sp.random_array((N, N), density=0.05, rng=generator)
    A = sp.csc_array(half + half.T + sp.diags_array(np.where(np.arange(N) == 7, 0.0, 3.0)))
    A.eliminate_zeros()
    order, rows = generator.permutation(N), Rows(STARTS[request.param])
    return A, SpreadMatrix(ThreadRanks(request.param), order, rows, own_rows_of, A, order, rows)


def test_what_it_says_of_itself_is_that_of_the_whole_matrix(pair):
    A, spread = pair
    assert spread.shape == A.shape
    assert spread.nnz == A.nnz
    assert largest_entry(spread) == largest_entry(A) == np.abs(A.toarray()).max()
    assert_array_equal(spread.diagonal(), A.diagonal())


def test_the_whole_matrix_comes_back(pair):
    A, spread = pair
    whole = whole_matrix(spread)
    assert (whole != A).nnz == 0
    assert whole.has_sorted_indices
    assert whole_matrix(A) is A


@pytest.mark.parametrize("k", [None, 1, COLUMNS + 3])
def test_products_are_those_of_the_whole_matrix(pair, k):
    A, spread = pair
    x = np.random.default_rng(0).standard_normal(N if k is None else (N, k))
    assert_allclose(spread @ x, A @ x, rtol=0, atol=1e-13)


def test_columns_are_those_of_the_whole_matrix(pair):
    A, spread = pair
    dofs = np.array([40, 3, 59])
    assert_array_equal(spread[:, dofs].toarray(), A.toarray()[:, dofs])
    with pytest.raises(IndexError, match="take whole"):
        spread[dofs, :]


def test_a_block_keeps_its_rows_on_their_ranks(pair):
    """Upper triangles have every diagonal entry, that of a zero too."""
    A, spread = pair
    dofs = spread.ordered(np.delete(np.arange(N), [0, 5, 30, 31]))
    block = spread.block(dofs)
    for upper in (False, True):
        block.keep("block", upper=upper)
        kept = [store.pop("block") for store in spread.ranks.stores]
        assert [len(own.indptr) - 1 for own in kept] == [block.rows.count(rank) for rank in range(spread.ranks.size)]
        found = sp.vstack(
            [sp.csr_array((own.data, own.indices, own.indptr), shape=(len(own.indptr) - 1, len(dofs))) for own in kept]
        )
        expected = A.toarray()[np.ix_(dofs, dofs)]
        assert_array_equal(found.toarray(), np.triu(expected) if upper else expected)
        if upper:
            assert [own.indices[own.indptr[:-1]].tolist() for own in kept] == [
                list(range(N - 4))[block.rows.of(rank)] for rank in range(spread.ranks.size)
            ]


def test_a_block_in_another_order_is_none(pair):
    _, spread = pair
    assert spread.block(spread.order[[3, 2]]) is None


def test_ranks_forget_what_has_no_name(pair):
    A, spread = pair
    other = SpreadMatrix(spread.ranks, spread.order, spread.rows, own_rows_of, A, spread.order, spread.rows)
    del other
    gc.collect()
    spread @ np.ones(N)
    assert [list(store) for store in spread.ranks.stores] == [[spread.key]] * spread.ranks.size
