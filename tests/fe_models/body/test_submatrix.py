import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_array_equal

from fe_models.body.submatrix import principal_block


@pytest.mark.parametrize("index", [[0, 1, 2], [1, 4, 5, 9], [9], list(range(10)), [0, 9]])
def test_principal_block_is_what_indexing_gives(index):
    A = sp.random_array((10, 10), density=0.12, rng=np.random.default_rng(0), format="csc")
    assert np.diff(A.indptr).min() == 0  # an empty column
    block = principal_block(A, np.array(index))
    assert_array_equal(block.toarray(), A.toarray()[np.ix_(index, index)])
    assert block.has_canonical_format
