import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from fe_models.foundation.ranks.product import COLUMNS, RowsProduct
from fe_models.foundation.ranks.rows import collected, even_rows, own_rows, spread
from tests.thread_ranks import on_threads


@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_product_by_rows_is_that_of_the_whole_matrix(size):
    """An entry far from the diagonal touches every rank; the columns take more than one pass."""
    generator = np.random.default_rng(size)
    A = sp.csr_array(
        sp.random_array((50, 50), density=0.1, rng=generator)
        + sp.diags_array([1.0, 2.0], offsets=[-1, 1], shape=(50, 50))
    )
    x = generator.standard_normal((50, COLUMNS + 3))
    rows = even_rows(A.indptr, size)

    def product(ranks):
        is_first = ranks.rank == 0
        own = RowsProduct(ranks, rows, *spread(ranks, rows, (A.indptr, A.indices, A.data) if is_first else None))
        return collected(ranks, rows, own @ own_rows(ranks, rows, x if is_first else None))

    assert_allclose(on_threads(size, product)[0], A @ x, rtol=0, atol=1e-13)
