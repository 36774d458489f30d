"""Verdicts about modes: each by its own frequency, one for each motion that costs nothing, rates of what decays."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    linearize,
    static_equilibrium,
    system_modes,
)
from floatframe.analyses import steady_rotation
from floatframe.forces import Bushing
from floatframe.joints import PlanarJoint
from floatframe.model.rotations import euler_parameters, rotation_exp
from tests.floatframe.other_units import SI, in_units

A = rotation_exp(np.array([0.4, -0.7, 0.3]))
PLACE = np.array([3.0, -2.0, 5.0])


def stiff(k):
    """Return a small body on stiff springs, far from the others."""
    K = np.diag([k, k, k, 1e-3 * k, 1e-3 * k, 1e-3 * k])
    body = RigidBody("small", 0.1, 1e-3 * np.eye(3), position=PLACE + 2.0)
    return body, Bushing("stiff", Marker(GROUND, position=PLACE + 2.0), Marker("small"), stiffness=K)


def rotor(axes, k_stiff):
    """Return a disc of 10 kg in bearings of 1e5 N/m and 1 N s/m, and a small body on its axis on round springs."""
    body = RigidBody("rotor", 10.0, np.diag([0.1, 0.1, 0.2]), position=PLACE, orientation=euler_parameters(A))
    plane = PlanarJoint("plane", GROUND, Marker("rotor"), axis=A[:, 2])
    bearing = Bushing("bearing", Marker(GROUND, position=PLACE, triad=A), Marker("rotor"), axes=axes,
                      stiffness=np.array([1e5, 1e5, 0, 0, 0, 0]), damping=np.array([1.0, 1.0, 0, 0, 0, 0]))  # fmt: skip
    small = RigidBody("small", 0.1, 1e-3 * np.eye(3), position=PLACE, orientation=euler_parameters(A))
    springs = Bushing("stiff", Marker(GROUND, position=PLACE, triad=A), Marker("small"),
                      stiffness=k_stiff * np.array([1.0, 1, 1, 0, 0, 0]))  # fmt: skip
    return System([body, small], [plane], [bearing, springs])


def modes_at(system, speed):
    """Return the modes about a steady rotation."""
    about = steady_rotation(system, speed * A[:, 2], center=PLACE)
    return system_modes(linearize(system, about, inputs=(), outputs=()))


@pytest.mark.parametrize("k_stiff", [1e3, 1e9, 1e13])
def test_a_whirl_that_grows_below_a_stiff_mode_is_told(k_stiff):
    """m z'' + d (z' - i W/2 z) + k z = 0 half way, at rest of the rotor's own turning in axes that turn with W."""
    W = 500.0
    modes = modes_at(rotor("half way", k_stiff), W)
    roots = np.roots([10.0, 1.0, 1e5 - 0.5j * W])
    grows = roots[roots.real > 0][0]
    assert not modes.is_stable
    found = modes.eigenvalues[modes.eigenvalues.real > modes.errors]
    assert len(found) == 1
    assert_allclose(found[0].real, grows.real, rtol=1e-6)
    assert_allclose(abs(found[0].imag), abs(grows.imag - W), rtol=1e-8)


@pytest.mark.parametrize("k_stiff", [1e3, 1e9, 1e13])
def test_a_damped_whirl_below_a_stiff_mode_is_stable(k_stiff):
    assert modes_at(rotor("a", k_stiff), 500.0).is_stable


@pytest.mark.parametrize("k_stiff", [1e3, 1e13])
@pytest.mark.parametrize("force", [50.0, 200.0, 400.0])
def test_links_under_a_follower_flutter_below_a_stiff_mode(force, k_stiff):
    """Ziegler's two links without damping: angles a, b; force * l (b - a) acts on a. They vibrate, flutter, topple.

    Beside springs of 1e13 N/m, the asymmetric stiffness of the links was taken for rounding.
    """
    length, m, J, k = 0.5, 2.0, 0.05, 30.0
    x, z, tensor = A[:, 0], A[:, 2], A @ np.diag([J / 2, J, J]) @ A.T
    bodies = [RigidBody(name, m, tensor, position=PLACE + part * length * x)
              for name, part in (("first", 0.5), ("second", 1.5))]  # fmt: skip
    end, begin = 0.5 * length * x, -0.5 * length * x
    joints = [
        RevoluteJoint("low", Marker(GROUND, position=PLACE), Marker("first", position=begin), axis=z),
        RevoluteJoint("knee", Marker("first", position=end), Marker("second", position=begin), axis=z),
    ]
    springs = [JointForce(f"spring {name}", name, "angle", stiffness=k) for name in ("low", "knee")]
    follower = PointForce("push", Marker("second", position=end), force=-force * x, is_follower=True)
    small, bushing = stiff(k_stiff)
    system = System([*bodies, small], joints, [*springs, follower, bushing])
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    M = np.array([[J + 1.25 * m * length**2, m * length**2 / 2], [m * length**2 / 2, J + m * length**2 / 4]])
    K = k * np.array([[2.0, -1], [-1, 1]]) + force * length * np.array([[-1.0, 1], [0, 0]])
    expected = np.sqrt(-np.linalg.eigvals(np.linalg.solve(M, K)).astype(complex))
    for root in (*expected, *-expected):
        if root.imag >= 0:
            assert_allclose(modes.eigenvalues[np.abs(modes.eigenvalues - root).argmin()], root, rtol=1e-9, atol=0)
    assert modes.is_stable == (force < 100.0)


@pytest.mark.parametrize("k_stiff", [1e3, 1e13])
def test_weak_damping_counts_beside_a_stiff_mode(k_stiff):
    """m x'' + d x' + k x = 0 with a rate of 1e-6 per second, below 1e7 rad/s."""
    sledge = RigidBody("sledge", 2.0, np.eye(3))
    rail = PrismaticJoint("rail", GROUND, Marker("sledge"), axis=(1, 0, 0))
    spring = SpringDamper("spring", Marker(GROUND, position=(-1, 0, 0)), Marker("sledge"), 50.0, 4e-6, free_length=1.0)
    small, bushing = stiff(k_stiff)
    system = System([sledge, small], [rail], [spring, bushing])
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    own = np.abs(modes.eigenvalues - 5j).argmin()
    assert_allclose(modes.eigenvalues[own].real, -1e-6, rtol=1e-6)


@pytest.mark.parametrize("has_damper", [False, True])
def test_a_free_body_has_six_motions_that_cost_nothing(has_damper):
    """Beside a sledge that makes the system one with damping or not."""
    body = RigidBody("free", 2.0, np.diag([1.0, 1.5, 2.0]), position=PLACE, center_of_mass=(0.1, 0.2, -0.3))
    sledge = RigidBody("sledge", 1.0, np.eye(3), position=(0, 0, 0))
    rail = PrismaticJoint("rail", GROUND, Marker("sledge"), axis=(1, 0, 0))
    spring = SpringDamper("spring", Marker(GROUND, position=(-1, 0, 0)), Marker("sledge"), 1e6, 3.0 * has_damper)
    system = System([body, sledge], [rail], [spring])
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    assert np.count_nonzero(modes.eigenvalues == 0) == 6
    assert len(modes.eigenvalues) == 7
    assert np.linalg.matrix_rank(modes.shapes[:, :6], tol=1e-6) == 6
    assert modes.is_stable


def free_sledge(A, place, *, damping, along):
    """Return a sledge on a rail, held across it by stiff springs and dampers, and along it by a spring or by nothing.

    The frame of the body, the rail and the springs have different axes.
    """
    B, offset = rotation_exp(np.array([1.1, 0.3, -0.8])), np.array([0.3, -0.7, 0.2])
    at = place + B @ offset
    body = RigidBody("sledge", 2.0, np.diag([1.0, 1.5, 2.0]), position=place, orientation=euler_parameters(B))
    on_ground = Marker(GROUND, position=at, triad=A)
    on_body = Marker("sledge", position=offset, triad=B.T @ A)
    rail = PrismaticJoint("rail", on_ground, on_body, axis=(1, 0, 0))
    across = Bushing("across", on_ground, on_body, stiffness=np.array([along, 1e6, 2e6, 0, 0, 0]),
                     damping=damping * np.array([0.0, 1, 2, 0, 0, 0]))  # fmt: skip
    aside = Marker(GROUND, position=at + 0.5 * A @ np.array([0, 0.6, 0.8]))
    spring = SpringDamper("spring", aside, Marker("sledge", position=offset), 1e6, 3.0 * damping, free_length=0.5)
    return System([body], [rail], [across, spring])


@pytest.mark.parametrize("damping", [0.0, 1.0])
@pytest.mark.parametrize("turn", [0.4, 1.7, 2.9])
@pytest.mark.parametrize("unit", [{}, {"length": 1e3, "time": 1e3}, {"length": 1e-3, "mass": 1e3}])
def test_a_motion_across_all_springs_neither_grows_nor_decays(unit, turn, damping):
    """Stiffness and damping along the rail are sums of large terms that cancel."""
    A_R = rotation_exp(np.array([turn, -0.7 * turn, 0.3]))
    system = in_units(free_sledge(A_R, 3.0 * PLACE, damping=damping, along=0.0), replace(SI, name="other", **unit))
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    assert_array_equal(modes.eigenvalues, 0.0)
    assert modes.is_stable


@pytest.mark.parametrize("turn", [0.4, 1.7, 2.9])
def test_a_soft_spring_along_a_stiff_guide_keeps_its_frequency(turn):
    """Of 1e-10 of the stiffness across: far above rounding, below what other sums take for it."""
    A_R = rotation_exp(np.array([turn, -0.7 * turn, 0.3]))
    system = free_sledge(A_R, np.zeros(3), damping=0.0, along=1e-4)
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    assert_allclose(modes.natural_frequencies, np.sqrt(1e-4 / 2.0) / (2 * np.pi), rtol=1e-3)


@pytest.mark.parametrize("k_stiff", [1e3, 1e6, 1e9, 1e11])
@pytest.mark.parametrize("speed", [0.0, 110.0])
def test_a_rotor_on_its_shaft_turns_freely_once(speed, k_stiff):
    """Beside a small body that may turn about its centre: four motions cost nothing, each vibration is another mode.

    Seen from axes that turn with W, a small body that is tilted stands still or turns backwards with W.
    """
    system = rotor("a", k_stiff)
    shaft = RigidBody("shaft", 1.0, 0.2 * np.eye(3), position=PLACE, orientation=euler_parameters(A))
    hinge = RevoluteJoint("shaft", Marker(GROUND, position=PLACE), Marker("shaft"), axis=A[:, 2])
    holder = Bushing("holder", Marker("shaft"), Marker("rotor"), stiffness=np.array([1e5, 1e5, 0, 0, 0, 1e3]),
                     damping=np.array([100.0, 100.0, 0, 0, 0, 1.0]))  # fmt: skip
    system = replace(system, bodies=[*system.bodies, shaft], joints=[*system.joints, hinge],
                     forces=[holder, system.forces[1]])  # fmt: skip
    found = modes_at(system, speed).eigenvalues
    assert np.count_nonzero(found == 0) == 4
    torsion, small = np.roots([0.1, 1.0, 1e3])[0], np.sqrt(k_stiff / 0.1)
    # a spring and a damper that turn with the rotor: m (z'' + 2 i W z' - W² z) + d z' + k z = 0, z = x + i y
    whirls = np.roots([10.0, 20j * speed + 100.0, 1e5 - 10.0 * speed**2])
    expected = [
        torsion,
        *whirls,
        1j * small,
        1j * (small + speed),
        1j * (small - speed),
        *([1j * speed] if speed else []),
    ]
    found = found[found != 0]
    for part in (np.real, lambda values: np.abs(np.imag(values))):
        assert_allclose(
            np.sort(part(found)), np.sort(part(np.array(expected))), rtol=1e-6, atol=1e-6 * np.abs(whirls).min()
        )


def test_what_is_overdamped_has_its_two_rates():
    """m x'' + d x' + k x = 0 with d far above critical; and a wheel that only a damper holds: 0 and -d/J."""
    sledge = RigidBody("sledge", 2.0, np.eye(3))
    rail = PrismaticJoint("rail", GROUND, Marker("sledge"), axis=(1, 0, 0))
    spring = SpringDamper("spring", Marker(GROUND, position=(-1, 0, 0)), Marker("sledge"), 50.0, 400.0, free_length=1.0)
    wheel = RigidBody("wheel", 1.0, 0.5 * np.eye(3), position=PLACE)
    hinge = RevoluteJoint("hinge", GROUND, Marker("wheel"), axis=(0, 0, 1))
    brake = Bushing("brake", Marker(GROUND, position=PLACE), Marker("wheel"), damping=np.array([0, 0, 0, 0, 0, 6.0]))
    system = System([sledge, wheel], [rail, hinge], [spring, brake])
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    expected = [0.0, *sorted([*np.roots([2.0, 400.0, 50.0]).real, -12.0], key=abs)]
    assert_allclose(modes.eigenvalues, expected, rtol=1e-9, atol=0)


def test_a_slow_mode_beside_a_very_stiff_one_keeps_its_frequency():
    """A pendulum of a minute on a hinge beside springs of 1e13 N/m: 1e-8 of the highest frequency."""
    small, springs = stiff(1e13)
    slow = RigidBody("slow", 1.0, np.eye(3), position=(0, 0, 0))
    hinge = RevoluteJoint("hinge", GROUND, Marker("slow"), axis=(0, 0, 1))
    spring = Bushing("soft", Marker(GROUND), Marker("slow"), stiffness=np.array([0, 0, 0, 0, 0, 1e-2]))
    system = System([slow, small], [hinge], [spring, springs])
    modes = system_modes(linearize(system, static_equilibrium(system), inputs=(), outputs=()))
    assert_allclose(modes.eigenvalues[0], 0.1j, rtol=1e-9)
