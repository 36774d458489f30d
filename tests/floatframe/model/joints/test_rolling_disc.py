"""A disc that rolls without slip: steady motions in closed form, limits of stability, energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, GeneralizedAlpha, Gravity, Marker, RigidBody, System, integrate, linearize
from floatframe.analyses import consistent_state, mobility
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.joints import RollingDisc
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix

M, R, G = 2.0, 0.5, 9.81
A, C = 0.25 * M * R**2 * 1.2, 0.5 * M * R**2  # not quite those of a plate


def disc(lean, position, velocity, omega):
    """A disc with its axis along y of the body, leaning about x: axis (0, cos lean, sin lean)."""
    p = euler_parameters_of_rotation_vector(np.array([lean, 0.0, 0.0]))
    body = RigidBody("disc", M, np.diag([A, C, A]), position=position, orientation=p, velocity=velocity,
                     omega_B=rotation_matrix(p).T @ np.array(omega))  # fmt: skip
    return System([body], [RollingDisc("rim", Marker(GROUND), Marker("disc"), R)], [Gravity((0, 0, -G))])


def steady(lean, radius):
    """The disc on a circle of its centre about z, at (0, radius, ...), leaning inwards; and its turning rate.

    Omega² = m g R tan(lean)/((C + m R²) radius/R + A sin(lean)), from dL/dt = rho × F about the centre.
    """
    Omega = np.sqrt(M * G * R * np.tan(lean) / ((C + M * R**2) * radius / R + A * np.sin(lean)))
    spin = -Omega * (radius / R + np.sin(lean))
    axis = np.array([0.0, np.cos(lean), np.sin(lean)])
    system = disc(lean, (0, radius, R * np.cos(lean)), (-Omega * radius, 0, 0), spin * axis + [0, 0, Omega])
    return system, Omega


def test_a_leaning_disc_rolls_on_its_circle():
    lean, radius = 0.4, 1.5
    system, Omega = steady(lean, radius)
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-11), 2.0, 2e-3)
    r, t = motion.body("disc").r, motion.t
    exact = np.stack([-radius * np.sin(Omega * t), radius * np.cos(Omega * t), 0 * t + R * np.cos(lean)], axis=1)
    assert_allclose(r, exact, rtol=0, atol=2e-5)
    force = motion.reaction("rim").force
    towards = -exact * [1, 1, 0] / radius
    expected = -(M * Omega**2 * radius * towards + np.array([0, 0, M * G]))
    assert_allclose(force, expected, rtol=0, atol=1e-3 * M * G)


def test_energy_is_kept_and_its_defect_falls_with_second_order():
    system, _ = steady(0.5, 0.8)
    body = system.bodies[0]
    pushed = RigidBody("disc", M, body.inertia, position=body.position, orientation=body.orientation,
                       velocity=body.velocity, omega_B=np.add(body.omega_B, [0.8, 0, 0]))  # fmt: skip
    system = System([pushed], system.joints, system.forces)
    defects = []
    for h in (4e-3, 2e-3):
        motion = integrate(system, GeneralizedAlpha(1.0, 1e-12), 1.5, h)
        energy = motion.energies.total
        defects.append(np.abs(energy - energy[0]).max() / motion.energies.kinetic.max())
        drift = motion.drift("rim")
        assert np.abs(drift.distance).max() < 1e-9
        assert np.abs(drift.distance_rate[1:]).max() < 1e-2
    assert defects[1] < 1e-4
    assert defects[0] / defects[1] > 3.4


@pytest.mark.parametrize(("factor", "grows"), [(0.8, True), (1.25, False)])
def test_a_disc_that_spins_upright_falls_below_its_critical_rate(factor, grows):
    """Stable for Omega² > m g R/(A + m R²)."""
    Omega = np.sqrt(factor * M * G * R / (A + M * R**2))
    system = disc(1e-3, (0, 0, R), (0, 0, 0), (0, 0, Omega))
    assert (lean_after(system, 2.5) > 20e-3) == grows


@pytest.mark.parametrize(("factor", "grows"), [(0.8, True), (1.25, False)])
def test_a_disc_that_rolls_straight_falls_below_its_critical_speed(factor, grows):
    """Stable for C (C + m R²) omega² > A m g R."""
    omega = np.sqrt(factor * A * M * G * R / (C * (C + M * R**2)))
    system = disc(1e-3, (0, 0, R), (omega * R, 0, 0), (0, omega, 0))
    assert (lean_after(system, 2.5) > 20e-3) == grows


def lean_of(p):
    return np.arcsin(rotation_matrix(p)[2, 1])


def lean_after(system, t_end):
    motion = integrate(system, GeneralizedAlpha(0.95, 1e-10), t_end, 2.5e-3)
    return max(abs(lean_of(p)) for p in motion.body("disc").p)


def test_rolling_leaves_three_ways_to_move():
    system, _ = steady(0.4, 1.5)
    assert mobility(system).n_freedoms == 3


def test_slipping_at_the_start_is_taken_away():
    system = disc(0.1, (0, 0, 0.6), (1.0, 0, 0), (0, 0, 0))
    start = consistent_state(system).state
    assert_allclose(start.r[0, 2], R * np.cos(lean_of(start.p[0])), rtol=1e-9, atol=0)
    rho = R * np.array([0, np.sin(lean_of(start.p[0])), -np.cos(lean_of(start.p[0]))])
    omega = rotation_matrix(start.p[0]) @ start.u[3:6]
    assert_allclose(start.u[:3] + np.cross(omega, rho), 0, rtol=0, atol=1e-9)


def test_a_rolling_disc_is_not_linearised():
    system, _ = steady(0.4, 1.5)
    with pytest.raises(ModelError, match="rolls without slip"):
        linearize(system)


def test_a_disc_that_lies_flat_is_refused():
    with pytest.raises(ModelError, match="lies flat on the plane"):
        _ = compiled_system(disc(np.pi / 2, (0, 0, 0), (0, 0, 0), (0, 0, 0)))


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ((GROUND, Marker("disc")), r"marker_a: expected a Marker, a point of the plane, such as Marker\('ground'"),
        (
            (Marker(GROUND), "disc"),
            r"marker_b: expected a Marker, the centre of the disc, .* got the body 'disc' alone",
        ),
    ],
)
def test_a_body_without_a_place_is_refused(ends, words):
    """Met where the other end is placed, the centre of the disc would lie on its plane."""
    with pytest.raises(ModelError, match=words):
        RollingDisc("roll", *ends, radius=1.0)
