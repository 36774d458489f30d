"""Torques along hinges in steps of many radians: impulse and work are those of the torque, whatever the turn.

A step turns a body by 2 atan(theta/2) where its mean angular velocity is theta/h.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe import JointForce, Marker, RevoluteJoint, RigidBody, System, UserForce
from floatframe.model.functions.time_functions import constant
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp

SCHEMES = [ff.integrators.EnergyMomentum(), ff.integrators.EnergyDecaying(), ff.integrators.Variational()]
NAMES = [type(scheme).__name__ for scheme in SCHEMES]
TILT = np.array([0.5, -0.8, 1.1])
AXIS = rotation_exp(TILT)[:, 2]
J = 0.01
OF_BALANCE = 1e-9  #: rounding, of the kinetic energy


def wheel(speed, *forces):
    """A wheel about a tilted axis of the ground, off the origin."""
    place = np.array([3.0, -2.0, 5.0])
    hinge = RevoluteJoint("hinge", Marker("ground", position=place), Marker("wheel"), axis=AXIS)
    p = euler_parameters_of_rotation_vector(TILT)
    body = RigidBody("wheel", 1.0, np.diag([0.02, 0.02, J]), position=place, orientation=p, omega_B=(0.0, 0.0, speed))
    return System([body], [hinge], list(forces))


def speed_at_end(system, scheme, t_end, h):
    """Return the speed of the wheel at the end, with the balance of energy held."""
    motion = ff.integrate(system, scheme, t_end, h, watch="off")
    assert np.ptp(motion.energies.balance) < OF_BALANCE * motion.energies.kinetic.max()
    return motion.body("wheel").omega_B[-1, 2]


@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
@pytest.mark.parametrize("turn", [0.1, 1.0, 6.0])
def test_a_motor_speeds_a_wheel_up_by_its_torque(scheme, turn):
    """1 N m on 0.01 kg m²: 100 rad/s in a second."""
    h = 1e-3
    motor = JointForce("T", "hinge", "angle", motor=constant(1.0))
    assert_allclose(speed_at_end(wheel(turn / h, motor), scheme, 0.05, h), turn / h + 5.0, rtol=0, atol=1e-6)


@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_a_brake_slows_a_wheel_by_its_torque(scheme):
    """6 rad in a step of 20 ms, a brake of 0.5 N m: 50 rad/s in a second."""
    h = 0.02
    brake = JointForce("brake", "hinge", "angle", friction=0.5, friction_speed=0.1)
    assert_allclose(speed_at_end(wheel(6.0 / h, brake), scheme, 1.0, h), 6.0 / h - 50.0, rtol=0, atol=1e-6)


@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
@pytest.mark.parametrize("turn", [1.0, 3.0, 10.0])
@pytest.mark.parametrize("kind", ["damper", "user force"])
def test_a_damper_slows_a_wheel_by_its_exponential(scheme, turn, kind):
    """The midpoint rule has exp(-c h/J) to (c h/J)³/12 in a step."""
    h, c = 0.01, 0.01
    force = JointForce("d", "hinge", "angle", damping=c)
    if kind == "user force":
        angle = ff.joints.JointCoordinate("hinge", "angle")
        force = UserForce("d", {"phi": angle}, forces={"phi": "-c*phi_dot"}, parameters={"c": c})
    after = speed_at_end(wheel(turn / h, force), scheme, 0.5, h)
    assert_allclose(after, turn / h * np.exp(-0.5), rtol=1e-5)


@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_a_damper_between_two_free_wheels_keeps_their_angular_momentum(scheme):
    """Coaxial wheels that drift: their relative speed falls by exp(-c (1/J_1 + 1/J_2) t)."""
    p, drift, c, h = euler_parameters_of_rotation_vector(TILT), np.array([4.0, -7.0, 2.0]), 0.02, 0.01
    bodies = [
        RigidBody(name, 1.0, np.diag([0.6 * size, 0.6 * size, size]), orientation=p, velocity=drift, omega_B=(0, 0, w))
        for name, size, w in (("one", J, 400.0), ("other", 3 * J, -100.0))
    ]
    hinge = RevoluteJoint("hinge", Marker("one"), Marker("other"), axis=(0, 0, 1))
    system = System(bodies, [hinge], [JointForce("d", "hinge", "angle", damping=c)])
    motion = ff.integrate(system, scheme, 0.2, h, watch="off")
    one, other = motion.body("one").omega_B[-1, 2], motion.body("other").omega_B[-1, 2]
    assert_allclose(one - other, 500.0 * np.exp(-c * (1 / J + 1 / (3 * J)) * 0.2), rtol=2e-4)
    assert_allclose(J * one + 3 * J * other, J * 400.0 - 3 * J * 100.0, rtol=0, atol=1e-8)
    assert np.ptp(motion.energies.balance) < OF_BALANCE * motion.energies.kinetic[0]


@pytest.mark.parametrize("scheme", SCHEMES[:2], ids=NAMES[:2])
def test_a_motor_on_a_carrier_that_tumbles_keeps_momenta_and_balance(scheme):
    """A wheel at 3 rad a step about a tilted axis of a free body: torques are internal, work is that of the motor."""
    tilt = euler_parameters_of_rotation_vector(TILT)
    carrier = RigidBody("carrier", 5.0, np.diag([0.2, 0.3, 0.25]), omega_B=(2.0, -1.0, 3.0), velocity=(1, 2, 3))
    spin = rotation_exp(TILT).T @ np.array([2.0, -1.0, 3.0]) + np.array([0, 0, 300.0])
    wheel = RigidBody("wheel", 1.0, np.diag([0.02, 0.02, J]), orientation=tilt, omega_B=spin, velocity=(1, 2, 3))
    hinge = RevoluteJoint("hinge", Marker("carrier"), Marker("wheel"), axis=AXIS)
    motor = JointForce("T", "hinge", "angle", motor=constant(0.4), damping=1e-4)
    motion = ff.integrate(System([carrier, wheel], [hinge], [motor]), scheme, 0.2, 0.01, watch="off")
    assert np.ptp(motion.energies.balance) < OF_BALANCE * motion.energies.kinetic[0]
    L = motion.angular_momentum
    assert_allclose(L, np.broadcast_to(L[0], L.shape), rtol=0, atol=1e-8 * np.abs(L).max())
    fine = ff.integrate(System([carrier, wheel], [hinge], [motor]), ff.GeneralizedAlpha(0.8), 0.2, 2e-4, watch="off")
    relative = [m.body("wheel").omega_B[-1, 2] - 300.0 for m in (motion, fine)]
    assert_allclose(relative[0], relative[1], rtol=0, atol=0.05 * abs(relative[1]))
