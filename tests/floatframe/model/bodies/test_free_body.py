"""A free flexible body that spins and vibrates: energy and momenta, without and with gravity."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, Gravity, integrate
from tests.floatframe.model.bodies.examples import spinning
from tests.floatframe.orders import slope

STEPS = np.array([8e-3, 4e-3, 2e-3, 1e-3])


@pytest.fixture(scope="module")
def motions():
    return [integrate(spinning(), GeneralizedAlpha(0.9, 1e-10), 2.0, h, output_every=5) for h in STEPS]


def test_energy_error_falls_with_the_square_of_the_step(motions):
    errors = [np.abs(m.energies.total - m.energies.total[0]).max() for m in motions]
    assert np.ptp(motions[0].energies.strain) > 0.1 * motions[0].energies.total[0]  # it does vibrate
    assert_allclose(slope(STEPS, errors), 2, rtol=0, atol=0.15)


def test_momentum_errors_fall_with_the_square_of_the_step(motions):
    for of in ("linear_momentum", "angular_momentum"):
        errors = [np.abs(getattr(m, of) - getattr(m, of)[0]).max() for m in motions]
        assert errors[-1] < 1e-4 * np.abs(getattr(motions[-1], of)).max()
        assert_allclose(slope(STEPS, errors), 2, rtol=0, atol=0.15)


def test_gravity_on_a_soft_body_conserves_energy_to_second_order():
    """Gravity acts on the deformed body: no drift that is independent of the step."""
    system = spinning([Gravity((0.0, 2.0, -9.81))])
    errors = []
    for h in STEPS:
        total = integrate(system, GeneralizedAlpha(0.9, 1e-10), 2.0, h, output_every=5).energies.total
        errors.append(np.abs(total - total[0]).max())
    assert_allclose(slope(STEPS, errors), 2, rtol=0, atol=0.15)


def test_a_falling_body_moves_as_a_floating_one_in_falling_axes(motions):
    g = np.array([0.0, 2.0, -9.81])
    floating = motions[-1]
    falling = integrate(spinning([Gravity(g)]), GeneralizedAlpha(0.9, 1e-10), 2.0, STEPS[-1], output_every=5)
    t = floating.t[:, None]
    # a position under constant acceleration is exact but for the first-order filter of the algorithmic acceleration
    assert_allclose(falling.body("body").r - 0.5 * g * t**2, floating.body("body").r, rtol=0, atol=1e-5)
    assert_allclose(falling.body("body").q, floating.body("body").q, rtol=0, atol=1e-7)
