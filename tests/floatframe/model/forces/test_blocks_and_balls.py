"""Bodies under dry friction in runs with default settings: blocks that slide to rest, a ball that rolls in the end."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe import GeneralizedAlpha, Gravity, JointForce, Marker, PrismaticJoint, RigidBody, System
from floatframe.forces import SphereContact

G = 9.81
GROUND, BODY = Marker("ground"), Marker("b")
FIELD = Gravity((0, 0, -G))
METHODS = {
    "default": GeneralizedAlpha(),
    "momentum": ff.integrators.EnergyMomentum(),
    "controlled": GeneralizedAlpha(error_tolerance=1e-6),
}
WAY = 2.0**2 / (2 * 0.4 * G)  #: of a block of 2 m/s under mu = 0.4


def block(height):
    return RigidBody("b", 2.0, np.diag([0.02, 0.03, 0.04]), position=(0, 0, height), velocity=(2, 0, 0))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("h", [1e-3, 1e-2])
@pytest.mark.parametrize(
    "friction", [{"friction": 0.4 * 2 * G}, {"friction_coefficient": 0.4}], ids=["force", "coefficient"]
)
def test_a_block_on_a_guide_slides_to_rest(name, h, friction):
    guide = PrismaticJoint("guide", GROUND, BODY, axis=(1, 0, 0))
    system = System([block(0.0)], [guide], [FIELD, JointForce("rub", "guide", "distance", **friction)])
    motion = ff.integrate(system, METHODS[name], 1.0, h)
    assert_allclose(motion.body("b").r[-1, 0], WAY, rtol=1e-3)
    assert abs(motion.body("b").v[-1, 0]) < 1e-6


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_a_block_on_four_feet_slides_to_rest_on_a_plane(formulation, h):
    feet = [
        SphereContact(
            f"foot {i} {j}", GROUND, Marker("b", position=(0.1 * i, 0.1 * j, -0.05)), radius_b=0.05, stiffness=1e5,
            restitution=0.5, friction=0.4,
        )
        for i in (-1, 1)
        for j in (-1, 1)
    ]  # fmt: skip
    motion = ff.integrate(System([block(0.1)], [], [FIELD, *feet]), GeneralizedAlpha(), 1.0, h, formulation=formulation)
    assert_allclose(motion.body("b").r[-1, 0], WAY, rtol=2e-3)
    assert_allclose(motion.body("b").v[-1], 0.0, atol=1e-3)  # friction creeps below v_s


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_a_ball_that_bounces_with_friction_rolls_in_the_end(formulation, h):
    """Its angular momentum about the plane stays: v = 5/7 of the speed at which it slid in."""
    ball = RigidBody("b", 1.0, 0.004 * np.eye(3), position=(0, 0, 0.4), velocity=(1, 0, 0))
    contact = SphereContact("c", GROUND, BODY, radius_b=0.1, stiffness=1e6, restitution=0.5, friction=0.3)
    motion = ff.integrate(System([ball], [], [FIELD, contact]), GeneralizedAlpha(), 2.5, h, formulation=formulation)
    assert_allclose(motion.body("b").v[-1], [5 / 7, 0, 0], atol=2e-3)
    assert_allclose(motion.body("b").omega_B[-1, 1], 50 / 7, rtol=2e-3)
    assert motion.energies.total.max() < motion.energies.total[0] * (1 + 1e-3)
