import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.couplings.couplings import couple
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from tests.bodies import bar

ROUNDOFF = 1e-12


@pytest.fixture
def eager(monkeypatch):
    """Whatever is only worth while for large matrices is done for small ones."""
    monkeypatch.setattr("fe_models.foundation.sparse.sparse_product.SMALL", 1)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("k", [1, 16, 37])
def test_products_with_the_mass_of_a_solid_are_those_of_scipy(eager, order, k):
    """Coupled: the reference nodes make a border of M_s ⊗ 1₃."""
    M = couple(bar(nx=6, ny=2, nz=2, kind="tetra10")).M
    product = SymmetricProduct(M)
    assert 0.8 * M.shape[0] < product._n_lead < M.shape[0]
    x = np.asarray(np.random.default_rng(0).standard_normal((M.shape[0], k)), order=order)
    result = product @ x
    assert_allclose(result, M @ x, rtol=0, atol=ROUNDOFF * np.abs(M.data).max())
    assert result.flags["C_CONTIGUOUS" if order == "C" else "F_CONTIGUOUS"]


def test_products_with_a_scalar_mass_repeat_bit_for_bit_whatever_the_threads(eager, monkeypatch):
    M = bar(nx=6, ny=2, nz=2, kind="tetra10").M
    x = np.random.default_rng(0).standard_normal((M.shape[0], 16))
    results = []
    for n in (1, 3):
        monkeypatch.setattr("fe_models.foundation.sparse.sparse_product.n_threads", lambda n=n: n)
        results.append(SymmetricProduct(M) @ x)
    assert_array_equal(results[0], results[1])
    assert_array_equal(results[0], M @ x)


def test_a_stiffness_goes_the_plain_way(eager):
    K = bar(nx=4, ny=2, nz=2).K
    assert SymmetricProduct(K)._n_lead == 0
    x = np.random.default_rng(0).standard_normal((K.shape[0], 5))
    assert_allclose(SymmetricProduct(K) @ x, K @ x, rtol=0, atol=ROUNDOFF * np.abs(K.data).max())


def test_a_matrix_without_entries_gives_zeros(eager):
    assert_array_equal(SymmetricProduct(sp.csc_array((6, 6))) @ np.ones((6, 2)), np.zeros((6, 2)))
