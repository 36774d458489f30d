from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.modes.families.receptance import boundary_scale, largest_error, receptance_of_modes, receptance_of_pencil
from fe_models.body.couplings.couplings import couple
from tests.bodies import beam, chain

FREQUENCIES = np.array([0.7, 3.1, 5.5, 20.0])


@pytest.fixture(scope="module")
def body():
    return couple(chain(6))


def direct(body, frequencies, loss):
    """The inverse of the dense dynamic stiffness at the boundary."""
    scale = boundary_scale(body)
    H = []
    for f in frequencies:
        Z = (1 + 1j * loss) * body.K.toarray() - (2 * np.pi * f) ** 2 * body.M.toarray()
        H.append(np.linalg.inv(Z)[np.ix_(body.b, body.b)] * np.outer(scale, scale))
    return np.array(H)


def test_all_modes_give_the_inverse_of_the_dynamic_stiffness(body):
    omega2, Phi = np.linalg.eigh(body.K.toarray() / 2.0)  # every mass is 2
    found = receptance_of_modes(body, Phi / np.sqrt(2.0), np.maximum(omega2, 0), loss=0.02).at(FREQUENCIES)
    exact = direct(body, FREQUENCIES, 0.02)
    assert_allclose(found, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_a_pencil_of_any_columns_with_massless_directions_gives_it_too():
    free = chain(6)
    M = free.M.toarray()
    M[2, 2] = 0.0
    body = couple(replace(free, M=M))
    V = np.random.default_rng(1).normal(size=(6, 6))
    found = receptance_of_pencil(V[body.b], V.T @ body.K @ V, V.T @ body.M @ V, loss=0.02, omega2=100.0)
    exact = direct(body, FREQUENCIES, 0.02)
    roundoff = 1e-12 * np.linalg.cond(V) * np.abs(exact).max()  # a solve in the columns V
    assert_allclose(found.at(FREQUENCIES), exact, rtol=0, atol=roundoff)


def test_rotations_are_displacements_at_a_lever_of_the_body_length():
    body = couple(beam(3, length=2.0))
    assert_allclose(boundary_scale(body), [1, 1, 1, 2, 2, 2] * 2, rtol=1e-12)


def test_error_is_the_largest_over_the_frequencies(body):
    H = direct(body, FREQUENCIES, 0.02)
    wrong = H.copy()
    wrong[1] *= 1.3
    wrong[2] *= 1.1
    assert_allclose(largest_error(wrong, H), 0.3, rtol=1e-12)
