"""A soft flexible pendulum on a spherical joint against an independent solution in minimal coordinates.

With the joint at particle P, which moves by phi_P q in the body, the joint is the origin of coordinates in which
particle p lies at y_p = c_p - c_P + (phi_p - phi_P) q: rotation and q remain, without constraint. The sums over the
particles are taken as they stand, and SciPy's DOP853 integrates.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, integrate
from tests.floatframe.integrators.examples import N_Q, OMEGA, T_END, accelerations, errors_of, pendulum
from tests.floatframe.orders import slope

STEPS = np.array([4e-3, 2e-3, 1e-3, 5e-4])


@pytest.fixture(scope="module", params=[0.0, 0.8], ids=["rho_inf=0", "rho_inf=0.8"])
def motions(request):
    return [integrate(pendulum(), GeneralizedAlpha(request.param, 1e-10), T_END, h) for h in STEPS]


def test_start_has_the_accelerations_and_the_reaction_of_the_minimal_coordinates(motions):
    alpha, q_ddot, force = accelerations(np.array([1.0, 0, 0, 0]), np.zeros(N_Q), OMEGA, np.zeros(N_Q))
    body = motions[0].body("body")
    scale = np.abs(np.concatenate([alpha, q_ddot, force])).max()
    assert_allclose(body.omega_B_dot[0], alpha, rtol=0, atol=1e-11 * scale)
    assert_allclose(body.q_ddot[0], q_ddot, rtol=0, atol=1e-11 * scale)
    assert_allclose(motions[0].reaction("pin").force[0], force, rtol=0, atol=1e-11 * scale)


def test_motion_is_that_of_the_minimal_coordinates(motions, exact):
    """Deflections reach a tenth of the length: no term of second order is small here."""
    assert np.abs(motions[-1].body("body").q).max() > 0.3
    errors = errors_of(motions[-1], exact)
    assert errors[0] < 1e-5
    assert errors[1] < 1e-5
    assert errors[4] < 1e-3


def test_positions_velocities_and_reactions_converge_with_second_order(motions, exact):
    errors = np.array([errors_of(motion, exact) for motion in motions])
    for column, name in enumerate(("rotation", "q", "omega", "q_dot", "force on the ground")):
        assert abs(slope(STEPS, errors[:, column]) - 2) < 0.15, (name, errors[:, column])


def test_joint_stays_closed_to_roundoff_and_its_velocity_to_third_order(motions):
    """Velocities are held too, by one back substitution a step: what it leaves is of third order, and small."""
    distance = [m.drift("pin").distance.max() for m in motions]
    assert max(distance) < 1e-13
    rates = np.array([m.drift("pin").distance_rate.max() for m in motions])
    assert (rates < STEPS**3).all()


def test_without_stabilisation_velocities_of_the_joint_close_to_second_order():
    motions = [integrate(pendulum(), GeneralizedAlpha(0.8, 1e-10, stabilized=False), 0.2, h) for h in STEPS[:3]]
    rates = [m.drift("pin").distance_rate.max() for m in motions]
    assert abs(slope(STEPS[:3], rates) - 2) < 0.15


def test_energy_balance_closes_with_second_order(motions):
    errors = [np.abs(m.energies.balance - m.energies.balance[0]).max() for m in motions]
    assert motions[-1].energies.dissipated[-1] > 0.01
    assert abs(slope(STEPS, errors) - 2) < 0.15
