"""Newton's method in joint coordinates at coarse steps: exact factors where approximate ones lead away."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from fe_models.body.beam_line import BeamLine
from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)

GRAVITY = Gravity((0.0, -9.81, 0.0))


@pytest.fixture(scope="module")
def flexible_top():
    """A rod in mean axes on a ball joint, whose fastest mode has 60 periods in a step of 10 ms."""
    line = BeamLine(1.0, 0.785, 2.1e7, 175.0, 175.0, 112.0, 6.3e-6, 6.3e-6)
    reduced = cms.reduction.beam_from_assumed_modes(
        line, name="rod", units=unit_system("m-kg-s"), n_axial=2, n_bending=4, damping=cms.reduction.ModalDamping(0.02)
    )
    ball = SphericalJoint("ball", Marker(GROUND, position=np.zeros(3)), Marker("rod", "start"))
    rod = FlexibleBody("rod", reduced, stiffening=False, omega_B=(1.0, 3.0, 4.0))
    return System([rod], [ball], [GRAVITY])


def test_a_flexible_body_on_a_ball_joint_turns_as_in_fine_steps(flexible_top):
    """It failed in the sixth step of 10 ms, where absolute coordinates run."""
    fine = integrate(flexible_top, GeneralizedAlpha(0.8), 0.6, 2e-3).body("rod").omega_B[-1]
    found = integrate(flexible_top, GeneralizedAlpha(0.8), 0.6, 0.01, formulation="relative").body("rod").omega_B[-1]
    assert_allclose(found, fine, rtol=0, atol=0.01 * np.linalg.norm(fine))


@pytest.mark.parametrize("omega_B", [(0.0, 0.0, 5.0), (5.0, 0.0, 0.0), (3.0, 0.0, 4.0)])
def test_a_heavy_top_that_turns_by_half_a_radian_a_step_runs(omega_B):
    """Its weight swings it to and fro; the energy stays within 0.3 of the weight times the lever."""
    rod = RigidBody("rod", 2.0, np.diag([0.05, 0.2, 0.25]), center_of_mass=(0.5, 0.02, 0.01), omega_B=omega_B)
    ball = SphericalJoint("ball", Marker(GROUND, position=np.zeros(3)), Marker("rod", position=np.zeros(3)))
    motion = integrate(
        System([rod], [ball], [GRAVITY]), GeneralizedAlpha(0.8), 20.0, 0.1, formulation="relative", watch="off"
    )
    assert len(motion.t) == 201
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 0.3 * 2.0 * 9.81 * 0.5
