"""Equilibria and steady rotations in relative coordinates: those of the absolute formulation, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    static_equilibrium,
)
from floatframe.analyses import snapshot, steady_rotation
from floatframe.engine.tree.topology import tree_of
from floatframe.errors import ConvergenceError
from floatframe.forces import Bushing
from floatframe.joints import JointCoordinate
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from tests.floatframe.analyses.relative.examples import CASES
from tests.floatframe.engine.tree.mechanisms import MECHANISMS, falling
from tests.floatframe.model.elements.laws import Jack

G = 9.81


def lifted():
    """A weight on a spring over a jack, whose pressure is a state of its own, at the end of a hinged arm."""
    arm = RigidBody("arm", 4.0, np.eye(3), position=(0.5, 0.0, 0.0))
    hinge = RevoluteJoint("hinge", GROUND, Marker("arm", position=(-0.5, 0.0, 0.0)), axis=(0, 1, 0))
    spring = JointForce("spring", "hinge", "angle", stiffness=2000.0)
    jack = Jack("jack", Marker("arm", position=(0.5, 0.0, 0.0)))
    return System([arm], [hinge], [Gravity((0, 0, -G)), spring], elements=[jack])


SYSTEMS = {
    **CASES,
    "top": lambda: falling(MECHANISMS["top"]()),
    "shaft": MECHANISMS["shaft"],
    "slider-crank": lambda: falling(MECHANISMS["flexible slider-crank"]()),
    "jack": lifted,
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_both_formulations_find_the_same_equilibrium(name):
    system, omega = SYSTEMS[name](), np.zeros(3)
    if name == "turning":
        system, omega = replace(system, forces=[]), np.array([0.0, 0.0, 12.0])
    absolute, relative = (
        steady_rotation(system, omega, tolerance=1e-11, formulation=each) for each in ("absolute", "relative")
    )
    force, bent = np.abs(absolute.w).max(initial=1.0), np.abs(absolute.state.q).max(initial=1e-6)
    assert_allclose(relative.state.r, absolute.state.r, rtol=0, atol=1e-8)
    assert_allclose(relative.state.q, absolute.state.q, rtol=0, atol=1e-7 * bent)
    assert_allclose(relative.state.u, absolute.state.u, rtol=0, atol=1e-6)
    assert_allclose(relative.w, absolute.w, rtol=0, atol=1e-7 * force)
    parts, still = tree_of(system), snapshot(system, relative)
    for joint in system.joints:
        if joint.name not in (*parts.cut, *parts.constrained):
            assert still.drift(joint.name).distance.max() < 1e-13
            assert still.drift(joint.name).angle.max() < 1e-13


def test_a_long_chain_with_springs_hangs_as_its_coordinates_say():
    """Links with torsion springs at the wall: M_k = k phi_k, the weight beyond each hinge, summed from the tip."""
    n, length, mass, stiffness = 30, 1.0 / 30, 0.2, 40.0
    links = [RigidBody(f"link {k}", mass, 1e-4 * np.eye(3), position=((k + 0.5) * length, 0.0, 0.0)) for k in range(n)]
    ends = [Marker(f"link {k}", position=(side * length / 2, 0.0, 0.0)) for k in range(n) for side in (-1, 1)]
    hinges = [
        RevoluteJoint(f"hinge {k}", Marker(GROUND) if k == 0 else ends[2 * k - 1], ends[2 * k], axis=(0, 0, 1))
        for k in range(n)
    ]
    springs = [JointForce(f"spring {k}", f"hinge {k}", "angle", stiffness=stiffness) for k in range(n)]
    system = System(links, hinges, [Gravity((0.0, -G, 0.0)), *springs])
    rest = static_equilibrium(system, formulation="relative")
    still = snapshot(system, rest)
    angles = np.array([JointCoordinate(f"hinge {k}", "angle").measure(system, still).value[0] for k in range(n)])
    x = rest.state.r[:, 0] - length / 2 * np.cos(np.cumsum(angles))  # of the hinges
    moments = [mass * G * (rest.state.r[k:, 0] - x[k]).sum() for k in range(n)]
    assert_allclose(-stiffness * angles, moments, rtol=1e-7)
    assert angles.sum() < -0.3


@pytest.mark.parametrize("hangs", [True, False])
def test_a_conical_pendulum_stands_where_weight_and_centrifugal_force_say(hangs):
    """m g l = (J_t - J_a + m l²) omega² cos(angle), on a ball, and held by a stiff spring at a body that is free.

    Rates of the ball in axes of the body change with its tilt, and velocities of the free body with its place.
    """
    m, l, J_t, J_a, omega = 2.0, 0.5, 0.03, 0.01, 6.0  # noqa: E741
    rod = RigidBody("rod", m, np.diag([J_t, J_t, J_a]), position=(l * np.sin(0.4), 0, -l * np.cos(0.4)),
                    orientation=euler_parameters_of_rotation_vector(np.array([0.0, -0.4, 0.0])))  # fmt: skip
    top = Marker("rod", position=(0.0, 0.0, l))
    ball = [SphericalJoint("ball", GROUND, top)] if hangs else []
    held = [] if hangs else [Bushing("ball", Marker(GROUND), top, [1e8] * 3 + [0] * 3)]
    system = System([rod], ball, [Gravity((0.0, 0.0, -G)), *held])
    found = steady_rotation(system, (0.0, 0.0, omega), formulation="relative", tolerance=1e-10)
    cosine = m * G * l / ((J_t - J_a + m * l**2) * omega**2)
    assert_allclose(-found.state.r[0, 2] / l, cosine, rtol=1e-8 if hangs else 1e-6)


def test_what_can_fall_has_no_equilibrium_in_relative_coordinates_either():
    system = falling(System([RigidBody("ball", 1.0, np.eye(3))]))
    with pytest.raises(ConvergenceError, match="no equilibrium found"):
        static_equilibrium(system, max_iterations=30, formulation="relative")
