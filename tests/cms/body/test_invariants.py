"""Every invariant against direct sums over point masses, and the identities of docs/theory.md §5."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.body.invariants import moments_from_gram

N_POINTS, N_Q = 11, 4


@pytest.fixture(scope="module")
def points():
    rng = np.random.default_rng(5)
    return rng.uniform(1, 2, N_POINTS), rng.normal(size=(N_POINTS, 3)), rng.normal(size=(N_POINTS, 3, N_Q))


@pytest.fixture(scope="module")
def moments(points):
    mass, c, phi = points
    a = np.concatenate([np.ones((N_POINTS, 1)), c, phi.reshape(N_POINTS, -1)], axis=1)
    return moments_from_gram(a.T @ (mass[:, None] * a))


def test_moments_are_sums_over_points(points, moments):
    mass, c, phi = points
    assert_allclose(moments.m, mass.sum(), rtol=1e-14)
    assert_allclose(moments.S, mass @ c, rtol=0, atol=1e-13)
    assert_allclose(moments.R, np.einsum("n,na,nb->ab", mass, c, c), rtol=0, atol=1e-13)
    assert_allclose(moments.C1, np.einsum("n,nak->ak", mass, phi), rtol=0, atol=1e-13)
    assert_allclose(moments.P, np.einsum("n,na,nbk->abk", mass, c, phi), rtol=0, atol=1e-12)
    assert_allclose(moments.S_kl, np.einsum("n,nak,nbl->abkl", mass, phi, phi), rtol=0, atol=1e-12)


def test_invariants_are_the_integrals_they_are_named_for(points, moments):
    mass, c, phi = points
    unit = np.eye(3)
    for k in range(N_Q):
        phi_k = phi[:, :, k]
        assert_allclose(moments.C2[:, k], mass @ np.cross(c, phi_k), rtol=0, atol=1e-12)
        C3 = sum(m * (x @ p * unit - np.outer(p, x)) for m, x, p in zip(mass, c, phi_k, strict=True))
        assert_allclose(moments.C3[k], C3, rtol=0, atol=1e-12)
        for j in range(N_Q):
            phi_l = phi[:, :, j]
            assert_allclose(moments.C4[k, j], mass @ np.cross(phi_l, phi_k), rtol=0, atol=1e-12)
            C5 = sum(m * (p @ o * unit - np.outer(o, p)) for m, p, o in zip(mass, phi_k, phi_l, strict=True))
            assert_allclose(moments.C5[k, j], C5, rtol=0, atol=1e-12)
            assert_allclose(moments.M[k, j], mass @ (phi_k * phi_l).sum(axis=1), rtol=0, atol=1e-12)


def test_inertia_of_the_deformed_body_is_that_of_the_moved_points(points, moments):
    mass, c, phi = points
    q = np.random.default_rng(6).normal(size=N_Q)
    r = c + phi @ q
    expected = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(mass, r, strict=True))
    assert_allclose(moments.inertia(q), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_identities(moments):
    assert_allclose(np.trace(moments.C3, axis1=1, axis2=2), 2 * np.einsum("aak->k", moments.P), rtol=0, atol=1e-12)
    assert_allclose(moments.C4, -moments.C4.transpose(1, 0, 2), rtol=0, atol=1e-12)
    # the antisymmetric part of 3C_k is that of 2C_k: 3C_k - 3C_kᵀ = P_k - P_kᵀ = tilde(-2C_k)
    x, y, z = moments.C2
    zero = np.zeros(N_Q)
    tilde = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    antisymmetric = moments.C3 - moments.C3.transpose(0, 2, 1)
    assert_allclose(antisymmetric, -np.moveaxis(tilde, 2, 0), rtol=0, atol=1e-12)
