import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose
from scipy.special import gammaincinv

from cms.linear_algebra.substructures.modes import Interior
from cms.linear_algebra.substructures.reduced_modes import ApproximateModes
from cms.linear_algebra.substructures.tree import substructure_tree
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.sparse.submatrix import principal_block
from tests.bodies import bar

COUNT = 6


@pytest.fixture(scope="module")
def pencil():
    """Tree without modes of its own, K and M in its order, and all exact eigenpairs."""
    body = couple(bar(nx=10, ny=2, nz=1, kind="hexahedron"))
    i = body.i
    K, M = principal_block(body.K, i), principal_block(body.M, i)
    interior = Interior(K, M, body.dofs[i, 0], body.nodes, np.zeros(len(i), dtype=bool))
    dissection = interior.dissection(30)
    K, M = dissection.in_order(interior.K), dissection.in_order(interior.M)
    tree = substructure_tree(dissection, K, M, 1.0, multipliers=np.zeros(0, dtype=int))
    return tree, K, M, la.eigh(K.toarray(), M.toarray())


def spoiled(pencil, amount):
    """The first modes, and as guards those after them, each with some of one mode far above."""
    tree, K, M, (omega2, Phi) = pencil
    p, n = COUNT + 3, len(omega2)
    X = Phi[:, :p] + amount * Phi[:, n // 2 : n // 2 + p]
    X /= np.sqrt(np.einsum("nk,nk->k", X, M @ X))
    quotient = np.einsum("nk,nk->k", X, K @ X)
    return ApproximateModes(tree, K, M, quotient, np.ascontiguousarray(X))


def test_errors_that_lie_far_above_are_estimated_closely_and_from_above(pencil):
    """Of one disturbing mode far above, the bound is nearly the error itself."""
    modes = spoiled(pencil, 1e-4)
    true = np.sqrt(modes.omega2[:COUNT] / pencil[3][0][:COUNT]) - 1
    found = modes.errors(COUNT)
    assert (found > true).all()
    assert_allclose(found, true, rtol=0.1)


def test_an_error_next_to_the_modes_that_take_part_is_bounded(pencil):
    """The worst case of the bound: all of the error along the first mode that does not take part."""
    tree, K, M, (omega2, Phi) = pencil
    p, amount = COUNT + 3, 1e-3
    X = Phi[:, :p].copy()
    X[:, COUNT - 1] += amount * Phi[:, p]
    X[:, COUNT - 1] /= np.sqrt(1 + amount**2)
    quotient = np.einsum("nk,nk->k", X, K @ X)
    modes = ApproximateModes(tree, K, M, quotient, np.ascontiguousarray(X))
    modes.omega2[-1] = omega2[p]
    true = np.sqrt(quotient[COUNT - 1] / omega2[COUNT - 1]) - 1
    assert_allclose(modes.errors(COUNT)[-1], true, rtol=1e-3)


def test_a_step_takes_off_what_lies_far_above(pencil):
    """The part along a mode shrinks by omega² / omega_k², so the error by its square."""
    modes = spoiled(pencil, 1e-3)
    before = np.sqrt(modes.omega2[:COUNT] / pencil[3][0][:COUNT]) - 1
    modes.improve()
    after = np.sqrt(modes.omega2[:COUNT] / pencil[3][0][:COUNT]) - 1
    n = len(pencil[3][0])
    ratio = (pencil[3][0][:COUNT] / pencil[3][0][n // 2 : n // 2 + COUNT]) ** 2
    rounding = np.finfo(float).eps * pencil[3][0][-1] / pencil[3][0][:COUNT]  # of the dense eigenvalues
    assert (after > -rounding).all()
    assert (after < 1.1 * before * ratio + rounding).all()
    assert_allclose(modes.X.T @ pencil[2] @ modes.X, np.eye(COUNT + 3), rtol=0, atol=1e-10)


def test_what_probes_find_above_the_tolerance_is_measured_by_itself(pencil, monkeypatch):
    modes = spoiled(pencil, 1e-4)
    modes.X[:, 2] += 1e-3 * pencil[3][1][:, -1]
    exact = modes.errors(COUNT)
    monkeypatch.setattr("cms.linear_algebra.substructures.reduced_modes.PROBES", 5)
    probed = modes.errors(COUNT)
    found = modes.errors(COUNT, np.sort(probed)[-1] * 0.99)
    assert np.argmax(probed) == 2
    assert_allclose(found[2], exact[2], rtol=1e-10)
    assert probed[2] > 1.5 * exact[2]
    assert_allclose(np.delete(found, 2), np.delete(probed, 2), rtol=1e-10)


def test_probes_find_residuals_from_above_and_not_far_above(pencil, monkeypatch):
    """The same residuals one by one; those of neighbours point the same way here, so that their sums cancel."""
    modes = spoiled(pencil, 1e-4)
    exact = modes.errors(COUNT)
    monkeypatch.setattr("cms.linear_algebra.substructures.reduced_modes.PROBES", 5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cms.linear_algebra.substructures.reduced_modes.RARE", 0.5)
        middle = modes.errors(COUNT)
    found = modes.errors(COUNT)
    assert (found >= exact).all()
    assert 0.2 < np.mean(middle / exact) < 5
    factor = gammaincinv(2.5, 0.5) / gammaincinv(2.5, 1e-3)
    assert_allclose(found / middle, factor, rtol=0.3)


def test_the_spread_of_white_noise_has_the_flexibility_as_covariance(pencil):
    tree, K, _, _ = pencil
    W = np.eye(K.shape[0])
    tree.spread_ordered(W)
    flexibility = la.inv(K.toarray())
    assert_allclose(W @ W.T, flexibility, rtol=0, atol=1e-10 * np.abs(flexibility).max())
