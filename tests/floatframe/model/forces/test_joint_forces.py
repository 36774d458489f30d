"""Forces along joint coordinates, load cases on bodies, tables and factors over time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from fe_models.body.load_cases import ReducedLoadCase
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    integrate,
)
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.forces import BodyLoad
from floatframe.joints import CylindricalJoint, PlanarJoint, UniversalJoint
from floatframe.model.functions.time_functions import harmonic, smooth_step, table
from tests.floatframe.engine.kernels.examples import C_K, Iterate, newton_matrices
from tests.floatframe.model.joints.examples import AXIS, pair
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

METHOD = GeneralizedAlpha(0.9, 1e-11)
TABLE = table(np.linspace(-9, 9, 19), -(np.linspace(-9, 9, 19) ** 3))
EVERYTHING = {"stiffness": 3.0, "free": 0.2, "damping": 0.7, "preload": 0.4, "motor": harmonic(0.5, 2.0),
              "characteristic": TABLE, "friction": 0.3, "friction_coefficient": 0.2, "friction_speed": 0.8}  # fmt: skip
LOADED = {
    "revolute": (RevoluteJoint, ["angle"]),
    "prismatic": (PrismaticJoint, ["distance"]),
    "cylindrical": (CylindricalJoint, ["distance", "angle"]),
    "planar": (PlanarJoint, ["first", "angle"]),
    "universal": (UniversalJoint, ["angle", "angle_b"]),
}


@pytest.mark.parametrize(("joint", "coordinates"), LOADED.values(), ids=LOADED)
def test_newton_matrix_is_the_derivative_of_the_residual(joint, coordinates):
    plain = pair(lambda *ends: joint("j", *ends, axis=AXIS))
    forces = [JointForce(f"f {name}", "j", name, **EVERYTHING) for name in coordinates]
    forces += [JointForce("second", "j", coordinates[0], damping=0.4)]
    iterate = Iterate(System(plain.bodies, plain.joints, forces), 1)
    iterate.work.state.time[...] = 0.37
    exact, approximate = newton_matrices(iterate)
    assert_allclose(exact, approximate, rtol=0, atol=1e-8 * max(np.abs(approximate).max(), 1 / C_K))


def wheel(forces, omega=0.0, inertia=0.7):
    body = RigidBody("wheel", 1.0, np.diag([0.5, 0.5, inertia]), omega_B=(0, 0, omega))
    return System([body], [RevoluteJoint("hub", GROUND, Marker("wheel"), axis=(0, 0, 1))], forces)


def angles(motion):
    p = motion.body("wheel").p
    return np.unwrap(2 * np.arctan2(p[:, 3], p[:, 0]))


def test_a_torsional_spring_damper_swings_as_in_closed_form():
    """I th_ddot + c th_dot + k th = 0; the energy balance holds."""
    k, c, inertia = 8.0, 0.6, 0.7
    motion = integrate(wheel([JointForce("s", "hub", "angle", stiffness=k, damping=c)], omega=2.0), METHOD, 2.0, 1e-3)
    delta = c / (2 * inertia)
    omega = np.sqrt(k / inertia - delta**2)
    exact = 2.0 / omega * np.exp(-delta * motion.t) * np.sin(omega * motion.t)
    assert_allclose(angles(motion), exact, rtol=0, atol=1e-5)
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 1e-4 * balance[0]


def test_friction_brings_a_wheel_to_rest_in_the_time_of_coulomb():
    """omega falls by T/I in time until it is of the order of the regularisation."""
    T, inertia = 0.7, 0.7
    motion = integrate(wheel([JointForce("brake", "hub", "angle", friction=T)], omega=1.0), METHOD, 1.5, 1e-3)
    rate = motion.body("wheel").omega_B[:, 2]
    early = motion.t < 0.95
    assert_allclose(rate[early], 1.0 - T / inertia * motion.t[early], rtol=0, atol=2e-3)
    assert np.abs(rate[motion.t > 1.1]).max() < 1e-3
    assert_allclose(motion.energies.dissipated[-1], 0.5 * inertia, rtol=1e-3, atol=0)


def test_friction_by_normal_force_slows_a_block_as_on_a_table():
    """A block pressed on its rail by N slows by mu N/m; the press is a force normal to the axis."""
    mu, N, m = 0.3, 12.0, 2.0
    block = RigidBody("block", m, np.eye(3), velocity=(1.0, 0, 0))
    system = System(
        [block],
        [PrismaticJoint("rail", GROUND, Marker("block"), axis=(1, 0, 0))],
        [JointForce("rub", "rail", "distance", friction_coefficient=mu),
         PointForce("press", Marker("block"), (0, 0, -N))],
    )  # fmt: skip
    motion = integrate(system, METHOD, 0.4, 1e-3)
    assert_allclose(motion.body("block").v[:, 0], 1.0 - mu * N / m * motion.t, rtol=0, atol=2e-3)


def test_a_motor_turns_a_wheel_by_its_torque():
    inertia, torque = 0.7, smooth_step(0.0, 1.0, 0.0, 2.0)
    motion = integrate(wheel([JointForce("motor", "hub", "angle", motor=torque)]), METHOD, 1.0, 1e-3)
    exact = [2.0 / inertia * (2.5 * t**4 - 3 * t**5 + t**6) for t in motion.t]
    assert_allclose(motion.body("wheel").omega_B[:, 2], exact, rtol=0, atol=1e-6)
    energy = motion.energies
    assert_allclose(energy.work[-1], energy.kinetic[-1], rtol=1e-5, atol=0)


def test_a_spring_with_a_table_swings_as_by_another_integrator():
    """m x_ddot = -(x - l_0) - x³ (cubic hardening) along a line, against DOP853."""
    block = RigidBody("block", 1.5, np.eye(3), position=(2.6, 0, 0))
    spring = SpringDamper("s", Marker(GROUND), Marker("block"), stiffness=1.0, free_length=2.0,
                          characteristic=table(np.linspace(-3, 3, 25), np.linspace(-3, 3, 25) ** 3))  # fmt: skip
    motion = integrate(System([block], [], [spring]), METHOD, 3.0, 1e-3)
    d = solve_ivp(lambda t, y: [y[1], -(y[0] + y[0] ** 3) / 1.5], (0, 3.0), [0.6, 0.0], method="DOP853",
                  rtol=1e-11, atol=1e-12, t_eval=motion.t)  # fmt: skip
    assert_allclose(motion.body("block").r[:, 0] - 2.0, d.y[0], rtol=0, atol=1e-5)


def test_a_force_follows_its_amplitude_over_time():
    body = RigidBody("block", 2.0, np.eye(3))
    force = PointForce("push", Marker("block"), (3.0, 0, 0), amplitude=harmonic(1.0, 5.0, np.pi / 2))
    motion = integrate(System([body], [], [force]), METHOD, 1.0, 1e-3)
    assert_allclose(motion.body("block").r[:, 0], 1.5 * (1 - np.cos(5 * motion.t)) / 25, rtol=0, atol=1e-6)


def test_a_load_case_acts_as_the_forces_that_make_it_up():
    """A force on one mass of a soft body: as a load case and as a follower at the interface there, small motion."""
    from dataclasses import replace

    n = 3
    plain = reduced_body(random_point_masses(n, 3), stiffness(n, omega=60.0))
    place = plain.interface("end_a")
    f = np.array([1e-3, -2e-3, 0.5e-3])
    case = ReducedLoadCase("push", "force", f, np.cross(place.position, f), place.Psi[:3].T @ f)
    part = replace(plain, load_cases=(case,))
    by_case = integrate(System([FlexibleBody("b", part)], [], [BodyLoad("load", "b", "push")]), METHOD, 0.5, 1e-3)
    # a follower turns with the interface, a load case with the body: alike while the deformation is small
    by_marker = integrate(
        System([FlexibleBody("b", part)], [], [PointForce("load", Marker("b", "end_a"), f, is_follower=True)]),
        METHOD, 0.5, 1e-3,
    )  # fmt: skip
    for name in ("r", "q"):
        first, second = getattr(by_case.body("b"), name), getattr(by_marker.body("b"), name)
        assert_allclose(first, second, rtol=0, atol=1e-4 * np.abs(second).max())
    work = by_case.energies.work
    assert_allclose(work[-1], (by_case.energies.total - by_case.energies.total[0])[-1], rtol=1e-3, atol=0)


@pytest.mark.parametrize(
    ("forces", "words"),
    [
        ([JointForce("f", "hbu", "angle", damping=1.0)], "no joint 'hbu'; did you mean 'hub'"),
        ([JointForce("f", "hub", "angel", damping=1.0)], "no coordinate 'angel' that can take a force.*'angle'"),
        ([BodyLoad("f", "wheel", "wind")], "'wheel' is not flexible and has no load cases"),
    ],
)
def test_forces_on_what_is_not_there_are_refused(forces, words):
    with pytest.raises(ModelError, match=words):
        _ = compiled_system(wheel(forces))


def test_a_prescribed_coordinate_takes_no_force():
    body = RigidBody("wheel", 1.0, np.eye(3))
    hub = RevoluteJoint("hub", GROUND, Marker("wheel"), motions={"angle": 0.0})
    with pytest.raises(ModelError, match="the coordinate 'angle' of joint 'hub' is prescribed"):
        _ = compiled_system(System([body], [hub], [JointForce("f", "hub", "angle", damping=1.0)]))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: JointForce("f", "hub", "angle"), "at least one part above zero"),
        (lambda: JointForce("f", "hub", "angle", damping=-1.0), "damping: expected a number of 0 or more"),
        (lambda: JointForce("f", "hub", "angle", motor=np.sin), "motor: expected a function of"),
        (lambda: BodyLoad("f", "wheel", "wind", np.sin), "amplitude: expected a number or a function"),
        (lambda: PointForce("f", Marker("b"), amplitude=2.0), "amplitude: expected a function"),
    ],
)
def test_impossible_forces_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()
