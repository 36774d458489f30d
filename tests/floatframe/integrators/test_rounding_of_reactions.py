"""Reactions and accelerations in steps so short that the rounding of positions over h² is larger than they are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, GeneralizedAlpha, Gravity, Marker, RigidBody, SphericalJoint, System, integrate
from floatframe.analyses import consistent_state

FALL = np.array([1.0, -2.0, -9.0])
PLACE = np.array([300.0, -200.0, 100.0])


def chain(unit, place, omega):
    """Two links on ball joints, along gravity; unit: metres in a unit of length are 1/unit."""
    down = unit * FALL / np.linalg.norm(FALL)
    inertia = unit**2 * np.diag([0.1, 0.2, 0.15])
    bodies = [
        RigidBody(
            name, mass, inertia, position=unit * place + part * down, velocity=np.cross(omega, part * down),
            omega_B=omega,
        )
        for name, mass, part in (("upper", 2.0, 0.5), ("lower", 1.0, 1.5))
    ]  # fmt: skip
    joints = [
        SphericalJoint("top", Marker(GROUND, position=unit * place), Marker("upper", position=-0.5 * down)),
        SphericalJoint("knee", Marker("upper", position=0.5 * down), Marker("lower", position=-0.5 * down)),
    ]
    return System(bodies, joints, [Gravity(unit * FALL)])


@pytest.mark.parametrize(("unit", "place"), [(1.0, PLACE), (1e3, PLACE), (1.0, 0 * PLACE)])
@pytest.mark.parametrize("h", [1e-5, 1e-6])
def test_a_system_at_rest_has_its_weight_for_reaction_and_no_acceleration(unit, place, h):
    """300 m away they were wrong by 29 % and 47 % of gravity at a microsecond, at the origin by 0.1 %."""
    motion = integrate(chain(unit, place, np.zeros(3)), GeneralizedAlpha(0.8), 60 * h, h, watch="off")
    for name, mass in (("top", 3.0), ("knee", 1.0)):
        expected = np.broadcast_to(mass * unit * FALL, (61, 3))
        assert_allclose(motion.reaction(name).force, expected, rtol=0, atol=1e-11 * unit * 9.3 * mass)
    for body in ("upper", "lower"):
        assert np.abs(motion.body(body).v_dot).max() < 1e-11 * unit * 9.3
        assert np.abs(motion.body(body).omega_B_dot).max() < 1e-10 * 9.3


def test_reactions_of_a_motion_are_those_of_its_positions_and_velocities():
    """Against the linear system of a start at the same state, which takes no differences but corrects velocities."""
    system = chain(1.0, PLACE, np.array([0.3, 0.2, -0.5]))
    motion = integrate(system, GeneralizedAlpha(0.8), 50e-6, 1e-6, watch="off")
    for k in (1, 25, 50):
        start = consistent_state(system, motion.state(k))
        force = np.concatenate([motion.reaction(name).force[k] for name in ("top", "knee")])
        assert_allclose(force, start.w, rtol=0, atol=1e-6 * np.abs(start.w).max())
        for i, body in enumerate(("upper", "lower")):
            found = np.r_[motion.body(body).v_dot[k], motion.body(body).omega_B_dot[k]]
            assert_allclose(found, start.u_dot[6 * i : 6 * i + 6], rtol=0, atol=1e-6 * 9.3)
