"""Every number of springs, bushings, contacts and forces in joints counts: by accelerations from their formulas."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import floatframe as ff
from floatframe.model.functions.time_functions import polynomial_of_time

MASS, X, V, DOWN, T = 2.0, 0.3, 0.4, 9.81, 0.5
STAY = ff.SpringDamper("stay", ff.Marker(ff.GROUND), ff.Marker("b"), 30.0, 0.7, 0.25, 1.3,
                       characteristic=polynomial_of_time([0.2, 5.0]))  # fmt: skip
DRIVE = ff.JointForce("drive", "guide", "distance", stiffness=30.0, free=0.1, damping=0.7, preload=1.3,
                      motor=polynomial_of_time([0.2, 3.0]), characteristic=polynomial_of_time([0.1, 4.0]), friction=0.6,
                      friction_coefficient=0.2, friction_speed=0.5)  # fmt: skip
SPRING_NUMBERS = ("stiffness", "damping", "free_length", "preload")
DRIVE_NUMBERS = ("stiffness", "free", "damping", "preload", "friction", "friction_coefficient", "friction_speed")


def acceleration(force, motion):
    """Return the acceleration along a coordinate: of a block on a guide along x, or of a wheel on a hinge about z."""
    J, origin = np.diag([1.5, 1.6, MASS]), (0.0, 0.0, 0.0)
    if motion == "along":
        body = ff.RigidBody("b", MASS, J, position=(X, 0, 0), velocity=(V, 0, 0))
        joint = ff.PrismaticJoint("guide", ff.Marker(ff.GROUND, position=origin), ff.Marker("b"), axis=(1, 0, 0))
    else:
        body = ff.RigidBody("b", 3.0, J, omega_B=(0, 0, V))
        joint = ff.RevoluteJoint("guide", ff.Marker(ff.GROUND, position=origin), ff.Marker("b"), axis=(0, 0, 1))
        force = replace(force, coordinate="angle")
    pull = (0.0, 0.0, -DOWN) if motion == "along" else (0.0, -DOWN * MASS / 3.0, 0.0)  # across the axis, alike
    system = ff.System([body], [joint], [ff.Gravity(pull), force])
    found = ff.analyses.consistent_state(system, t=T).u_dot
    return found[0] if motion == "along" else found[5]


def of_spring(f, x):
    """Return the acceleration of the block by the formula of `SpringDamper`."""
    y = x - f.free_length
    return -(f.stiffness * y + f.damping * V + f.preload + 0.2 + 5.0 * y) / MASS


def of_drive(f, x):
    """Return the acceleration by the formula of `JointForce`."""
    y = x - f.free
    friction = (f.friction + f.friction_coefficient * MASS * DOWN) * np.tanh(V / f.friction_speed)
    given = f.preload + 0.2 + 3.0 * T + 0.1 + 4.0 * y
    return (-f.stiffness * y - f.damping * V + given - friction) / MASS


CASES = [(STAY, name, of_spring, "along") for name in SPRING_NUMBERS]
CASES += [(DRIVE, name, of_drive, motion) for motion in ("along", "about") for name in DRIVE_NUMBERS]


@pytest.mark.parametrize(("force", "name", "formula", "motion"), CASES)
def test_a_number_that_is_doubled_acts_as_the_formula_says(force, name, formula, motion):
    doubled = replace(force, **{name: 2 * getattr(force, name)})
    x = X if motion == "along" else 0.0  # the angle as assembled
    assert_allclose(acceleration(force, motion), formula(force, x), rtol=1e-10)
    assert_allclose(acceleration(doubled, motion), formula(doubled, x), rtol=1e-10)
    assert abs(formula(doubled, x) - formula(force, x)) > 1e-3


J_BALL, AXES_A, AXES_B = np.diag([1.5, 1.6, 1.9]), Rotation.from_rotvec([0.4, -0.7, 0.3]), [0.5, 0.2, -0.6]
OMEGA, VELOCITY, PLACE_A = np.array([0.3, -0.5, 0.8]), np.array([0.2, 0.1, -0.3]), np.array([0.7, -0.4, 0.2])


def wrench_on_ball(force, place):
    """Return force in ground axes and torque in body axes on a turned, moving ball, by its accelerations."""
    turned = AXES_A * Rotation.from_rotvec(AXES_B)
    ball = ff.RigidBody("b", MASS, J_BALL, position=place, orientation=np.roll(turned.as_quat(), 1), velocity=VELOCITY,
                        omega_B=OMEGA)  # fmt: skip
    u_dot = ff.analyses.consistent_state(ff.System([ball], [], [force])).u_dot
    return MASS * u_dot[:3], J_BALL @ u_dot[3:6] + np.cross(OMEGA, J_BALL @ OMEGA)


def on_ground():
    """Return the marker of the ground, turned and off the origin."""
    return ff.Marker(ff.GROUND, position=PLACE_A, triad=AXES_A.as_matrix())


ENTRIES = np.random.default_rng(8).uniform(0.5, 2.0, (2, 6, 6))
SLEEVE = ff.forces.Bushing(
    "sleeve", on_ground(), ff.Marker("b"), 10 * (ENTRIES[0] + ENTRIES[0].T), ENTRIES[1] + 9 * np.eye(6),
    np.array([1.0, -2.0, 3.0, -1.5, 2.5, 0.5]), {"y": polynomial_of_time([0.0, 0.0, 40.0])},
)  # fmt: skip
OF_SLEEVE = [(name, (i, j)) for name in ("stiffness", "damping") for i in range(6) for j in range(6)]
OF_SLEEVE += [("preload", (i,)) for i in range(6)] + [("characteristics", ())]


def doubled_bushing(name, place):
    """Return the bushing with one of its numbers doubled, of a symmetric matrix also the one across the diagonal."""
    if name == "characteristics":
        return replace(SLEEVE, characteristics={"y": polynomial_of_time([0.0, 0.0, 80.0])})
    values = np.array(getattr(SLEEVE, name))
    places = {place, place[::-1]} if name == "stiffness" else {place}
    for each in places:
        values[each] *= 2.0
    return replace(SLEEVE, **{name: values})


def of_bushing(f, square):
    """Return the wrench by the formula of `Bushing`: theta_dot = L(theta)^-1 omega, and the torque does its work."""
    theta, d = np.array(AXES_B), np.array([0.03, -0.05, 0.04])
    S, angle = np.cross(np.eye(3), theta), np.linalg.norm(theta)
    L = np.eye(3) + (1 - np.cos(angle)) / angle**2 * S + (angle - np.sin(angle)) / angle**3 * S @ S
    to_A = AXES_A.as_matrix().T
    omega_A = Rotation.from_rotvec(theta).as_matrix() @ OMEGA
    rates = np.concatenate([to_A @ VELOCITY, np.linalg.solve(L, omega_A)])
    F = f.stiffness @ np.concatenate([d, theta]) + f.damping @ rates + f.preload
    F[1] += square * d[1] ** 2
    torque_A = -np.linalg.solve(L.T, F[3:])
    return -to_A.T @ F[:3], Rotation.from_rotvec(theta).as_matrix().T @ torque_A


@pytest.mark.parametrize(("name", "place"), OF_SLEEVE)
def test_a_number_of_a_bushing_that_is_doubled_acts_as_the_formula_says(name, place):
    position = PLACE_A + AXES_A.apply([0.03, -0.05, 0.04])
    doubled = doubled_bushing(name, place)
    before, after = of_bushing(SLEEVE, 40.0), of_bushing(doubled, 80.0 if name == "characteristics" else 40.0)
    for found, formula in ((wrench_on_ball(SLEEVE, position), before), (wrench_on_ball(doubled, position), after)):
        assert_allclose(np.concatenate(found), np.concatenate(formula), rtol=1e-9, atol=1e-9)
    assert np.abs(np.concatenate(after) - np.concatenate(before)).max() > 1e-3


TOUCH = ff.forces.SphereContact("touch", on_ground(), ff.Marker("b"), radius_b=0.2, axis=np.array([1.0, 2.0, -2.0]) / 3,
                         stiffness=900.0, exponent=1.4, restitution=0.4, dissipation="hunt-crossley", friction=0.3,
                         friction_speed=0.25, slow=1.5)  # fmt: skip
PAIR = replace(TOUCH, radius_a=0.3, stiffness=None, modulus=2e4, exponent=1.5)
OF_TOUCH = ("radius_b", "stiffness", "exponent", "restitution", "friction", "friction_speed", "slow")
OF_PAIR = ("radius_a", "radius_b", "modulus", "restitution", "friction", "friction_speed", "slow")


def of_contact(f, place):
    """Return the wrench by the formula of `SphereContact`, where v_0 is the smallest speed of impact."""
    d = place - PLACE_A
    if f.radius_a is None:
        N, k = AXES_A.as_matrix() @ f.axis, f.stiffness
        depth = f.radius_b - N @ d
    else:
        N = d / np.linalg.norm(d)
        depth = f.radius_a + f.radius_b - np.linalg.norm(d)
        k = 4 / 3 * f.modulus * np.sqrt(f.radius_a * f.radius_b / (f.radius_a + f.radius_b))
    normal = k * depth**f.exponent * (1 - 1.5 * (1 - f.restitution) / f.slow * (N @ VELOCITY))
    turned = AXES_A * Rotation.from_rotvec(AXES_B)
    slip = VELOCITY + np.cross(turned.apply(OMEGA), -f.radius_b * N)
    slip = slip - N * (N @ slip)
    F = normal * N - f.friction * normal * slip / np.sqrt(slip @ slip + f.friction_speed**2)
    return F, turned.inv().apply(np.cross(-f.radius_b * N, F))


@pytest.mark.parametrize(("contact", "name"), [(TOUCH, name) for name in OF_TOUCH] + [(PAIR, name) for name in OF_PAIR])
def test_a_number_of_a_contact_that_is_doubled_acts_as_the_formula_says(contact, name):
    across = AXES_A.as_matrix() @ TOUCH.axis if contact is TOUCH else np.array([0.6, 0.0, 0.8])
    place = PLACE_A + (0.17 if contact is TOUCH else 0.46) * across
    doubled = replace(contact, **{name: 2 * getattr(contact, name)})
    before, after = of_contact(contact, place), of_contact(doubled, place)
    for found, formula in ((wrench_on_ball(contact, place), before), (wrench_on_ball(doubled, place), after)):
        assert_allclose(np.concatenate(found), np.concatenate(formula), rtol=1e-9, atol=1e-9)
    assert np.abs(np.concatenate(after) - np.concatenate(before)).max() > 1e-3
