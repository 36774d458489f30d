"""Bases of mode sets: columns in blocks, the half of each Gram matrix, shapes in the place of the columns."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.linear_algebra import independent
from cms.linear_algebra.independent import Products, gram_in_blocks, independent_basis
from cms.modes.mode_sets.classical import craig_bampton, unrestrained_attachment
from cms.reduction.basis import finishing
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import NodalFrame, TisserandFrame, frame_condition
from fe_models.body.couplings.couplings import couple
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall import columns
from tests.bodies import bar

ROUNDOFF = 1e-12


@pytest.fixture(scope="module")
def body():
    return couple(bar(4, 2, 2, length=0.2, width=0.1, height=0.1))


@pytest.fixture(scope="module")
def modes(body):
    return craig_bampton(body, n_modes=15)


def test_a_gram_matrix_in_blocks_is_that_at_once(body, modes, monkeypatch):
    V = modes.columns
    monkeypatch.setattr(independent, "PRODUCT_BYTES", 1.0)  # 16 columns at a time
    for A in (body.K, body.M):
        G = gram_in_blocks(V, SymmetricProduct(A))
        assert_array_equal(G, G.T)
        size = np.sqrt(np.diag(G))
        assert_allclose(G / np.outer(size, size), V.T @ (A @ V) / np.outer(size, size), rtol=0, atol=1e3 * ROUNDOFF)


@pytest.mark.parametrize("frame", [TisserandFrame(), NodalFrame("left")], ids=["mean axes", "nodal"])
def test_shapes_of_the_columns_and_of_an_orthonormal_basis_are_the_same(body, modes, frame, monkeypatch):
    condition = frame_condition(body, frame)
    formed = []
    make = independent.orthonormal_basis
    for place in (independent, finishing):
        monkeypatch.setattr(place, "orthonormal_basis", lambda *given: formed.append(1) or make(*given))
    kept = modes.columns.copy()
    at_once = finish(body, modes, condition)
    assert not formed
    monkeypatch.setattr(independent, "TRUSTED_CONDITION", 0.0)
    twice = finish(body, modes, condition)
    assert len(formed) == 1
    assert_array_equal(modes.columns, kept)  # they belong to the set
    assert_allclose(np.diag(at_once.K), np.diag(twice.K), rtol=1e-9)
    for found in (at_once, twice):
        Phi = found.Phi
        assert_allclose(Phi.T @ (body.M @ Phi), np.eye(Phi.shape[1]), rtol=0, atol=1e-10)
        assert np.abs(condition.rigid_part(Phi)).max() < 1e-9 * np.abs(Phi).max()
    assert_allclose(np.abs(np.einsum("nk,nk->k", at_once.Phi, body.M @ twice.Phi)), 1.0, rtol=0, atol=1e-6)


def test_rounding_that_counts_has_the_basis_formed(body, modes, monkeypatch):
    condition = frame_condition(body, TisserandFrame())
    formed = []
    make = finishing.orthonormal_basis
    monkeypatch.setattr(finishing, "orthonormal_basis", lambda *given: formed.append(1) or make(*given))
    monkeypatch.setattr(finishing, "TRUSTED_ROUNDING", 1e-30)
    assert_allclose(finish(body, modes, condition).Phi.shape, (body.n_dof, modes.columns.shape[1] - 6))
    assert len(formed) == 1


@pytest.mark.parametrize("condition", [1e1, 1e2, 1e3, 1e4, 1e5])
def test_the_estimate_of_rounding_bounds_what_ill_conditioned_columns_lose(body, modes, condition, monkeypatch):
    """Mixed columns whose Gram matrix is trusted all the same: G_M within the shapes is 1 to rounding, Phi is not."""
    frame = frame_condition(body, TisserandFrame())
    monkeypatch.setattr(independent, "TRUSTED_CONDITION", np.inf)
    monkeypatch.setattr(independent, "TRUSTED_PIVOT", 1e-7)
    rng, k = np.random.default_rng(0), modes.columns.shape[1]
    turns = [np.linalg.qr(rng.normal(size=(k, k)))[0] for _ in range(2)]
    unit = modes.columns / np.sqrt(np.einsum("nk,nk->k", modes.columns, (body.K + 1e9 * body.M) @ modes.columns))
    mixed = replace(modes, columns=unit @ (turns[0] * np.geomspace(1.0, 1 / condition, k)) @ turns[1])
    pencil, pencils = finishing.elastic_pencil, []
    monkeypatch.setattr(finishing, "elastic_pencil", lambda *given: pencils.append(pencil(*given)) or pencils[-1])

    def defect():
        Phi = finish(body, mixed, frame).Phi
        return np.abs(Phi.T @ (body.M @ Phi) - np.eye(Phi.shape[1])).max()

    found = defect()
    estimate = pencils[0].rounding
    assert found < finishing.TRUSTED_ROUNDING
    assert len(pencils) == (2 if estimate > finishing.TRUSTED_ROUNDING else 1)
    monkeypatch.setattr(finishing, "TRUSTED_ROUNDING", np.inf)
    monkeypatch.setattr(finishing, "ORTHONORMAL_DEFECT", np.inf)  # the shapes are not normalised again either
    lost = defect()
    assert lost < estimate < 1e3 * max(lost, ROUNDOFF)
    assert lost > 1e-9 or condition < 1e5


def test_columns_that_differ_by_little_and_redundant_ones_are_told_apart(body):
    """One column is a sum of two others, one is another but for a millionth: too near for the Gram matrix to say."""
    omega2 = 1e9
    W = body.K + omega2 * body.M
    V = unrestrained_attachment(body, n_modes=30).columns
    before = np.linalg.matrix_rank(V / np.linalg.norm(V, axis=0), tol=1e-9)
    apart = np.random.default_rng(0).normal(size=body.n_dof)
    apart *= 1e-6 * np.sqrt((V[:, 7] @ (W @ V[:, 7])) / (apart @ (W @ apart)))
    V = np.column_stack([V, V[:, 7] + V[:, 8], V[:, 7] + apart])
    products = Products.of_body(body)
    G_K, G_M = gram_in_blocks(V, products.K), gram_in_blocks(V, products.M)
    basis, redundant = independent_basis(V, G_K, G_M, products, body, omega2)
    assert V.shape[1] - len(redundant) == before + 1
    Q = basis.combine(np.eye(basis.Z.shape[1]))
    assert_allclose(Q.T @ (W @ Q), np.eye(before + 1), rtol=0, atol=1e-9)
    assert_allclose(basis.G_K, Q.T @ (body.K @ Q), rtol=0, atol=1e-9)
    assert_allclose(basis.G_M, Q.T @ (body.M @ Q), rtol=0, atol=1e-9 / omega2)
    assert_allclose(V @ basis.T, Q, rtol=0, atol=1e-8 * np.abs(Q).max())
    for column in V.T:
        rest = column - Q @ (Q.T @ (W @ column))
        assert rest @ (W @ rest) < 1e-18 * (column @ (W @ column))


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("m", [3, 6, 9, 10])
def test_a_product_in_the_place_of_its_factor_lies_in_one_piece(m, order, monkeypatch):
    monkeypatch.setattr(columns, "SLICE", 7)
    rng = np.random.default_rng(0)
    X, C = np.asarray(rng.normal(size=(50, 10)), order=order), rng.normal(size=(10, m))
    expected = X @ C
    found = columns.combined(X, C)
    assert np.shares_memory(found, X) == (m >= 5)
    assert found.flags[f"{order}_CONTIGUOUS"]
    assert_allclose(found, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())
