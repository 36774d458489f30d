"""Couplings of matrices by rows on all ranks: what stays, stays where it is; what is new comes from rank 0."""

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import IntArray
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows
from fe_models.foundation.ranks.spread_matrix import OwnRows, SpreadMatrix
from fe_models.foundation.ranks.trim import give_back

__all__ = ["spread_extension"]

KEY = "rows that stay"


def spread_extension(A: SpreadMatrix, keep: IntArray, more: sp.csc_array) -> SpreadMatrix:
    """Return [[A[keep][:, keep], 0], [0, 0]] + more, (n_new, n_new), by rows on all ranks.

    Rows that stay lie on the ranks that have them, in their order; the last rank has those after them.

    Parameters
    ----------
    keep
        Dofs that stay: the first of the new ones, in this order, (n_kept,).
    more
        Symmetric, (n_new, n_new): the rows and columns of reference nodes and multipliers.
    """
    n_kept, n_new = len(keep), more.shape[0]
    new = np.full(len(A.order), -1, np.int64)
    new[keep] = np.arange(n_kept)
    staying = new[A.order]
    block = A.block(A.ordered(keep))
    assert block is not None
    block.keep(KEY)
    order = np.concatenate([staying[staying >= 0], np.arange(n_kept, n_new)])
    rows = Rows((*block.rows.starts[:-1], n_new))
    by_rows = sp.csr_array(sp.csr_array((more.data, more.indices, more.indptr), shape=more.shape)[order])
    place = np.empty(n_new, by_rows.indices.dtype)
    place[order] = np.arange(n_new, dtype=place.dtype)
    by_rows = sp.csr_array((by_rows.data, place[by_rows.indices], by_rows.indptr), shape=more.shape)
    return SpreadMatrix(A.ranks, order, rows, extended_here, rows, by_rows)


def extended_here(ranks: Ranks, rows: Rows, more: sp.csr_array) -> OwnRows:
    """Return this rank's rows of the result."""
    stay: OwnRows = ranks.store.pop(KEY)
    own = rows.of(ranks.rank)
    indptr = np.concatenate([stay.indptr, np.full(own.stop - own.start + 1 - len(stay.indptr), stay.indptr[-1])])
    A = sp.csr_array((stay.data, stay.indices, indptr.astype(np.int32)), shape=(own.stop - own.start, rows.n))
    del stay
    if (added := more[own]).nnz:
        A = sp.csr_array(A + added)
    A.sort_indices()
    give_back()
    return OwnRows(A.indptr.astype(np.int32), A.indices.astype(np.int32), A.data)
