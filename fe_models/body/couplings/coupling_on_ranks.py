"""Bodies whose stiffness and mass are distributed by rows over all ranks.

A coupling leaves the kept rows on their ranks and takes the new rows from rank 0. A body that rank 0 has made alone
distributes its rows with `spread_body`.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, Recovery
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows, even_rows, spread
from fe_models.foundation.ranks.spread_matrix import OwnRows, SpreadMatrix
from fe_models.foundation.ranks.trim import give_back
from fe_models.foundation.sparse.submatrix import nearby_order

__all__ = ["spread_body", "spread_extension"]

KEY = "rows that stay"
KEY_OF_WHOLE = "rows of rank 0"


def spread_extension(A: SpreadMatrix, keep: IntArray, more: sp.csc_array) -> SpreadMatrix:
    """Return [[A[keep][:, keep], 0], [0, 0]] + more, (n_new, n_new), distributed by rows over all ranks.

    Kept rows stay on their ranks, in their order. The last rank also holds the new rows, after its own.

    Parameters
    ----------
    keep
        Kept dofs; they become the first dofs of the result, in this order, (n_kept,).
    more
        Symmetric matrix, (n_new, n_new), with the rows and columns of reference nodes and multipliers.
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
    """Return the rows of the result on this rank."""
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


def spread_body(body: FEBody, ranks: Ranks) -> FEBody:
    """Return a body whose K and M are distributed by rows over all ranks, instead of complete matrices on rank 0.

    The rows are ordered so that neighbours are near, and are cut into parts with about as many entries of K each. With
    one rank, or if the body is distributed already (as bodies of solid meshes are), the body itself is returned.
    """
    if ranks.size == 1 or body.layout is not None:
        return body
    order = nearby_order(body.K, body.dofs, np.arange(body.n_dof))
    rows = even_rows(np.concatenate([[0], np.cumsum(np.diff(body.K.indptr)[order])]), ranks.size)
    # Without a recovery, `mesh_displacement` would return the distributed columns themselves. With a map without layout
    # it gathers them.
    recovery = body.recovery or Recovery(sp.eye_array(body.n_dof, format="csr"), body.dofs)
    return replace(
        body,
        K=spread_whole(ranks, body.K, order, rows),
        M=spread_whole(ranks, body.M, order, rows),
        recovery=replace(recovery, layout=None),
    )


def spread_whole(ranks: Ranks, A: sp.csc_array, order: IntArray, rows: Rows) -> SpreadMatrix:
    """Distribute a symmetric matrix from rank 0 over all ranks, by rows in the given order."""
    by_rows = sp.csr_array((A.data, A.indices, A.indptr), shape=A.shape)[order]
    place = np.empty(len(order), by_rows.indices.dtype)
    place[order] = np.arange(len(order), dtype=place.dtype)
    by_rows = sp.csr_array((by_rows.data, place[by_rows.indices], by_rows.indptr), shape=A.shape)
    by_rows.sort_indices()
    ranks.store[KEY_OF_WHOLE] = (by_rows.indptr, by_rows.indices, by_rows.data)
    del by_rows
    return SpreadMatrix(ranks, order, rows, given_here, rows)


def given_here(ranks: Ranks, rows: Rows) -> OwnRows:
    """Return the rows on this rank of a matrix that rank 0 has."""
    return OwnRows(*spread(ranks, rows, ranks.store.pop(KEY_OF_WHOLE, None)))
