"""Reactions of constraints that repeat others, against dense least squares over the equations of motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.integrators import EnergyMomentum
from floatframe.model.rotations import rotation_matrix, tilde

TURN = rotation_matrix(np.array([0.8, 0.3, -0.4, np.sqrt(1 - 0.89)]))  #: of the whole system
PLACE = np.array([300.0, -200.0, 50.0])
FALL = np.array([0.7, -9.0, 2.5])
AXIS = TURN[:, 2]
CORNERS = {"foot": (0.0, 0.0, 0.0), "left": (0.0, 1.0, 0.3), "right": (1.5, 1.0, -0.2), "end": (1.5, 0.0, 0.1)}


def parallelogram(unit=1.0, heavy=1.0):
    """Three bars on four parallel hinges, which repeat three constraints; masses and moments of all bars differ.

    unit: metres in a unit of length are 1/unit. heavy: by which the mass of the first bar is multiplied.
    """
    corner = {name: unit * (PLACE + TURN @ place) for name, place in CORNERS.items()}
    ends = {"crank": ("foot", "left", 2.0 * heavy), "rod": ("left", "right", 5.0), "rocker": ("right", "end", 1.0)}
    omega = 1.3 * AXIS
    velocity = {"foot": np.zeros(3), "end": np.zeros(3)}
    velocity |= {name: np.cross(omega, corner["left"] - corner["foot"]) for name in ("left", "right")}
    bodies = []
    for k, (name, (a, b, mass)) in enumerate(ends.items()):
        center = unit * np.array([0.1, 0.05, -0.07]) * (k + 1)
        J = mass * unit**2 * (np.diag([0.2, 0.3, 0.4]) + 0.02 * (k + 1) * np.ones((3, 3)))
        spin = np.zeros(3) if name == "rod" else omega
        middle = 0.5 * (velocity[a] + velocity[b])
        place = 0.5 * (corner[a] + corner[b])
        bodies.append(RigidBody(name, mass, J, center, place, velocity=middle, omega_B=spin))
    at = {name: body.position for name, body in zip(ends, bodies, strict=True)} | {GROUND: np.zeros(3)}
    pairs = {
        "foot": (GROUND, "crank"), "left": ("crank", "rod"), "right": ("rod", "rocker"), "end": (GROUND, "rocker"),
    }  # fmt: skip
    joints = [
        RevoluteJoint(name, *(Marker(each, position=corner[name] - at[each]) for each in pair), AXIS)
        for name, pair in pairs.items()
    ]
    brake = JointForce("brake", "right", "angle", damping=0.9 * unit**2)
    return System(bodies, joints, [Gravity(unit * FALL), brake], redundant="minimum-norm")


def door(unit=1.0, heavy=1.0):
    """A leaf on three hinges of one line at uneven distances, which repeat ten constraints."""
    omega = 0.9 * AXIS
    foot = unit * PLACE
    position = foot + unit * TURN @ (0.6, 0.2, 0.1)
    J, center = unit**2 * np.diag([0.5, 0.8, 1.1]), unit * np.array([0.1, -0.2, 0.3])
    velocity = np.cross(omega, position - foot)
    leaf = RigidBody("leaf", 7.0 * heavy, J, center, position, velocity=velocity, omega_B=omega)
    places = {f"hinge {z:g}": foot + unit * z * AXIS for z in (-0.7, 0.2, 1.0)}
    joints = [
        RevoluteJoint(name, Marker("leaf", position=x - position), Marker(GROUND, position=x), AXIS)
        for name, x in places.items()
    ]
    brake = JointForce("brake", "hinge 0.2", "angle", damping=2.0 * unit**2)
    return System([leaf], joints, [Gravity(unit * FALL), brake], redundant="minimum-norm")


def shared(system, motion, k):
    """Return force and moment of each joint on its marker A at output k, (n_joints, 6), from the motion of the bodies.

    Forces f and moments n about two axes normal to that of the hinge, of least sum of f²(1/m_a + 1/m_b) +
    n²(1/J_a + 1/J_b), under the rates of momentum and angular momentum about the centre of mass of each body; the
    moment along the axis is that of the hinge's own law, known.
    """
    index = {body.name: i for i, body in enumerate(system.bodies)}
    A, b = np.zeros((6 * len(index), 5 * len(system.joints))), np.zeros(6 * len(index))
    center, axes, light = {}, {GROUND: np.eye(3)}, {GROUND: (0.0, 0.0)}
    origin = {GROUND: np.zeros(3)}
    for name, i in index.items():
        body, now = system.bodies[i], motion.body(name)
        R, omega, alpha = rotation_matrix(now.p[k]), now.omega_B[k], now.omega_B_dot[k]
        c, J = body.center_of_mass, body.inertia
        a = now.v_dot[k] + R @ (np.cross(alpha, c) + np.cross(omega, np.cross(omega, c)))
        b[6 * i : 6 * i + 3] = body.mass * (a - system.forces[0].acceleration)
        b[6 * i + 3 : 6 * i + 6] = R @ (J @ alpha + np.cross(omega, J @ omega))
        center[name], axes[name], origin[name] = now.r[k] + R @ c, R, now.r[k]
        light[name] = 1 / body.mass, 3 / np.trace(J)
    weights, bases = [], []
    for j, joint in enumerate(system.joints):
        ends = [(joint.marker_a, 1.0), (joint.marker_b, -1.0)]
        body = joint.marker_a.body
        point = origin[body] + axes[body] @ joint.marker_a.position
        normal = np.linalg.svd(AXIS[None])[2][1:]
        along = motion.reaction(joint.name).moment[k] @ AXIS * AXIS
        for marker, sign in ends:
            if marker.body == GROUND:
                continue
            i, arm = index[marker.body], point - center[marker.body]
            A[6 * i : 6 * i + 3, 5 * j : 5 * j + 3] = sign * np.eye(3)
            A[6 * i + 3 : 6 * i + 6, 5 * j : 5 * j + 3] = sign * tilde(arm)
            A[6 * i + 3 : 6 * i + 6, 5 * j + 3 : 5 * j + 5] = sign * normal.T
            b[6 * i + 3 : 6 * i + 6] -= sign * along
        mobility = np.sum([light[marker.body] for marker, _ in ends], axis=0)
        weights += [mobility[0]] * 3 + [mobility[1]] * 2
        bases.append((normal, along))
    root = 1 / np.sqrt(weights)
    rows = 1 / np.linalg.norm(A * root, axis=1)
    x = root * np.linalg.lstsq(rows[:, None] * A * root, rows * b, rcond=1e-9)[0]
    own = zip(x.reshape(-1, 5), bases, strict=True)
    return np.array([[*each[:3], *(each[3:] @ normal + along)] for each, (normal, along) in own])


@pytest.mark.parametrize(("make", "unit", "heavy"), [(door, 1e3, 1.0), (door, 1.0, 30.0), (parallelogram, 1.0, 30.0)])
def test_reactions_are_those_of_least_norm_in_both_formulations_at_every_step(make, unit, heavy):
    """At 2e-5 s the rounding of places 360 m away is 1e5 N for what balances itself: it was told as reactions."""
    system = make(unit, heavy)
    runs = [(GeneralizedAlpha(0.8), h, formulation) for h in (5e-3, 2e-5) for formulation in ("absolute", "relative")]
    for method, h, formulation in (*runs, (EnergyMomentum(), 5e-3, None)):
        motion = integrate(system, method, 20 * h, h, formulation=formulation)
        for k in (0, 1, 20):
            expected = shared(system, motion, k)
            reactions = [motion.reaction(joint.name) for joint in system.joints]
            for part, found in ((slice(0, 3), "force"), (slice(3, 6), "moment")):
                size = np.abs(expected[:, part]).max()
                got = [getattr(each, found)[k] for each in reactions]
                assert_allclose(got, expected[:, part], rtol=0, atol=5e-6 * size, err_msg=f"{h} {formulation} {found}")
