"""The matrices of geometric stiffness as a reduced body carries them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.body.geometric_stiffness import GeometricStiffness, RotatedLoads, SpreadLoads
from cms.body.invariants import NodalSums
from cms.body.modal_file.file import convert_units
from cms.errors import BodyError
from floatframe.model.bodies.mode_choice import with_modes
from tests.synthetic import synthetic_reduced_body

ROUNDOFF = 1e-12
N_Q = 5


def random_stiffness(n_q=N_Q, n_interfaces=2, seed=0):
    rng = np.random.default_rng(seed)

    def symmetric(*shape):
        A = rng.normal(size=(*shape, n_q, n_q))
        return A + np.swapaxes(A, -1, -2)

    turned = RotatedLoads(*(rng.normal(size=(*loads, 3, n_q)) for loads in ((3,), (3,), (6,), (n_interfaces, 6))))
    spread = SpreadLoads(symmetric(6), rng.normal(size=(6, 3, n_q)), rng.normal(size=(6, 3, 3)))
    return GeometricStiffness(symmetric(3), symmetric(3), symmetric(6), symmetric(n_interfaces, 6), turned, spread)


def body():
    reduced = synthetic_reduced_body(n_q=N_Q)
    sums = NodalSums(1.0, np.zeros(3), np.eye(3), np.zeros((3, N_Q)), np.zeros((3, N_Q)))
    return replace(reduced, geometric=random_stiffness(), nodal_sums=sums)


def test_shapes_that_do_not_fit_are_refused():
    K = random_stiffness()
    with pytest.raises(BodyError, match=r"spin: expected shape \(6, 5, 5\), got \(3, 5, 5\)"):
        replace(K, spin=K.rotation)
    with pytest.raises(BodyError, match="2 interfaces, but geometric stiffness of 3"):
        replace(body(), geometric=random_stiffness(n_interfaces=3))
    with pytest.raises(BodyError, match="5 modes, but geometric stiffness of 4"):
        replace(body(), geometric=random_stiffness(n_q=4))


def test_a_matrix_that_is_not_symmetric_is_refused_and_rounding_is_not():
    K = random_stiffness()
    skew = np.triu(np.ones((N_Q, N_Q)), 1)
    with pytest.raises(BodyError, match="rotation: expected symmetric matrices"):
        replace(K, rotation=K.rotation + 1e-3 * skew)
    almost = replace(K, rotation=K.rotation + 1e-14 * skew)
    assert_array_equal(almost.rotation, np.swapaxes(almost.rotation, 1, 2))


def test_a_body_without_modes_has_empty_matrices():
    K = random_stiffness(n_q=0)
    assert K.spin.shape == (6, 0, 0)
    assert K.interfaces.shape == (2, 6, 0, 0)


def test_other_modes_are_a_congruence():
    K, Z = random_stiffness(), np.random.default_rng(1).normal(size=(N_Q, 3))
    x = np.array([0.3, -1.0, 2.0])
    other = K.transformed(Z)
    for name in ("translation", "rotation", "spin", "interfaces"):
        expected = np.einsum("k,...kl,l->...", Z @ x, getattr(K, name), Z @ x)
        found = np.einsum("k,...kl,l->...", x, getattr(other, name), x)
        assert_allclose(found, expected, rtol=0, atol=1e2 * ROUNDOFF * np.abs(expected).max())
        turned = getattr(K.turned, name) @ Z
        assert_allclose(getattr(other.turned, name), turned, rtol=0, atol=1e2 * ROUNDOFF * np.abs(turned).max())
    assert_allclose(other.spread.K, Z.T @ K.spread.K @ Z, rtol=0, atol=1e2 * ROUNDOFF * np.abs(K.spread.K).max())
    assert_array_equal(other.spread.turned, K.spread.turned @ Z)
    assert_array_equal(other.spread.turned_rigid, K.spread.turned_rigid)


def test_some_of_the_modes_keep_their_entries():
    reduced = body()
    chosen = with_modes(reduced, [3, 0])
    assert_array_equal(chosen.geometric.spin, reduced.geometric.spin[:, [[3], [0]], [3, 0]])
    assert_array_equal(chosen.geometric.interfaces, reduced.geometric.interfaces[..., [[3], [0]], [3, 0]])
    assert_array_equal(chosen.geometric.turned.interfaces, reduced.geometric.turned.interfaces[..., [3, 0]])
    assert chosen.geometric.spread is None  # their resultants are not those of a body without nodal sums
    spread = reduced.geometric.of_modes([3, 0]).spread
    assert_array_equal(spread.K, reduced.geometric.spread.K[:, [[3], [0]], [3, 0]])
    assert_array_equal(spread.turned, reduced.geometric.spread.turned[..., [3, 0]])


def test_the_energy_of_a_load_is_the_same_in_other_units():
    """1/2 qᵀ K_j q times the amplitude of load j, taken in two unit systems."""
    reduced = body()  # mm, t, s
    other = convert_units(reduced, "in-slinch-s")
    old, new = reduced.units, other.units

    def number(value, **dimensions):
        """Return a number of the new system."""
        return value * old.to_si(**dimensions) / new.to_si(**dimensions)

    q = np.random.default_rng(2).normal(size=N_Q)
    q_new = q * np.sqrt(old.mass / new.mass) * old.length / new.length
    dimensions = {
        "translation": [{"length": 1, "time": -2}],
        "rotation": [{"time": -2}],
        "spin": [{"time": -2}],
        "interfaces": 3 * [{"mass": 1, "length": 1, "time": -2}] + 3 * [{"mass": 1, "length": 2, "time": -2}],
    }
    for name, of_rows in dimensions.items():
        work = np.einsum("k,...kl,l->...", q, getattr(reduced.geometric, name), q)
        work_new = np.einsum("k,...kl,l->...", q_new, getattr(other.geometric, name), q_new)
        amplitude = np.array([number(1.0, **row) for row in of_rows])
        expected = number(1.0, mass=1, length=2, time=-2) * work
        assert_allclose(work_new * amplitude, expected, rtol=ROUNDOFF, atol=0)
        turned = np.einsum("...xk,k->x...", getattr(reduced.geometric.turned, name), q)
        turned_new = np.einsum("...xk,k->x...", getattr(other.geometric.turned, name), q_new)
        expected = number(1.0, mass=1, length=2, time=-2) * turned
        assert_allclose(turned_new * amplitude, expected, rtol=ROUNDOFF, atol=0)
