"""Conserving, decaying and variational schemes: energy, momenta, joints, order, restart.

Energies and momenta are those of the compiled diagnostics, about the frame origin: a second road to the formulas about
the centre of mass on which the schemes stand.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import cms
import fe_models
import floatframe.simulation.integrate as integration
from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    integrate,
)
from floatframe.components.mechanisms import four_bar
from floatframe.errors import ModelError
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.model.functions.time_functions import cycloidal_spin_up
from floatframe.model.functions.time_functions import table as table_function
from floatframe.model.rotations import (
    left_jacobian,
    right_jacobian,
    rotation_exp,
    rotation_matrix,
    tilde,
)
from floatframe.simulation import resume
from tests.floatframe.engine.structure_preserving.in_python.markers import mean_jacobian
from tests.floatframe.engine.structure_preserving.in_python.rotation import cayley, cayley_parameters, relative_cayley
from tests.floatframe.integrators.examples import (  # noqa: F401
    KNOWN,
    SCHEMES,
    STIFFENED,
    energy_defect,
    errors_of,
    floating_pair,
    momentum_defects,
    pendulum,
)
from tests.floatframe.model.bodies.examples import spinning
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import PointMasses, random_point_masses, reduced_body, stiffness
from tests.floatframe.simulation.examples import StopHereError, assert_same, steps_on_record


def test_free_body_keeps_energy_and_momenta_in_steps_that_are_far_too_long():
    """A radian a step: the motion is wrong, what it conserves is not; generalized-alpha loses both in a fifth of it."""
    motion = integrate(spinning(), EnergyMomentum(), 5.0, 0.25)
    assert np.ptp(motion.energies.strain) > 0.1 * motion.energies.total[0]
    assert energy_defect(motion) < 1e-11
    assert max(momentum_defects(motion)) < 1e-11
    other = integrate(spinning(), GeneralizedAlpha(0.9, 1e-11), 2.0, 0.05)
    assert energy_defect(other) > 0.01
    assert max(momentum_defects(other)) > 0.01


def test_gravity_on_a_soft_pendulum_conserves_energy():
    system = pendulum()
    undamped = reduced_body(random_point_masses(3, 11), stiffness(3, omega=3.5), name="pendulum")
    body = FlexibleBody("body", undamped, position=system.bodies[0].position, omega_B=system.bodies[0].omega_B,
                        velocity=system.bodies[0].velocity)  # fmt: skip
    motion = integrate(System([body], system.joints, system.forces), EnergyMomentum(), 2.0, 0.05)
    assert np.abs(motion.body("body").q).max() > 0.3
    assert energy_defect(motion) < 1e-11
    assert motion.drift("pin").distance.max() < 1e-13


@pytest.mark.parametrize("name", SCHEMES)
def test_motion_converges_with_second_order_to_that_of_minimal_coordinates(name, exact):
    """The oracle has no joint, no frame origin apart from the pin, and another integrator."""
    steps = np.array([0.01, 0.005, 0.0025, 0.00125])  # the dissipation of the fastest mode is of third order there
    motions = [integrate(pendulum(), SCHEMES[name], 0.4, h, output_every=round(0.02 / h)) for h in steps]
    errors = np.array([errors_of_all(motion, exact) for motion in motions])
    for column, what in enumerate(("rotation", "q", "omega", "q_dot", "force on the ground")):
        assert abs(slope(steps, errors[:, column]) - 2) < 0.2, (what, errors[:, column])


def errors_of_all(motion, exact):
    """Return the largest errors of rotation, q, omega, q_dot and force at all output times."""
    body, force, worst = motion.body("body"), motion.reaction("pin").force, np.zeros(5)
    for k, t in enumerate(motion.t):
        p, q, omega, q_dot, reaction = exact(t)
        found = (rotation_matrix(body.p[k]), body.q[k], body.omega_B[k], body.q_dot[k], force[k])
        for j, (a, b) in enumerate(zip(found, (rotation_matrix(p), q, omega, q_dot, reaction), strict=True)):
            worst[j] = max(worst[j], np.abs(a - b).max())
    return worst


@pytest.mark.parametrize("kind", KNOWN)
def test_joints_do_no_work_and_add_no_momentum(kind):
    """A pair in space with a stiff spring between: energy and both momenta, the joint closed at every step."""
    motion = integrate(floating_pair(kind), EnergyMomentum(), 0.5, 0.05, output_every=5)
    assert np.ptp(motion.energies.kinetic) > 1e-3 * motion.energies.kinetic[0]
    assert energy_defect(motion) < 1e-11
    assert max(momentum_defects(motion)) < 1e-11
    drift = motion.drift("joint")
    assert max(drift.distance.max(), drift.angle.max()) < 1e-12


@pytest.mark.parametrize("kind", ["revolute", "distance", "universal"])
def test_stiffened_bodies_are_conserved_too(kind):
    """Mass, markers and centre of mass of degree two in q."""
    system = floating_pair(kind, body=STIFFENED)
    motion = integrate(system, EnergyMomentum(), 0.5, 0.05, output_every=5)
    assert energy_defect(motion) < 1e-11
    assert max(momentum_defects(motion)) < 1e-11
    plain = integrate(floating_pair(kind), EnergyMomentum(), 0.5, 0.05, output_every=5)
    assert np.abs(motion.body("soft").q - plain.body("soft").q).max() > 1e-4


@pytest.mark.parametrize("method", SCHEMES.values(), ids=SCHEMES)
def test_stiffened_pair_moves_alike_beside_a_free_body_of_more_modes(method):
    """Work arrays of a step are as long as the body with most modes needs, here longer than those of the pair."""
    pair = floating_pair("universal", body=STIFFENED)
    free = FlexibleBody("free", reduced_body(random_point_masses(7, 5), stiffness(7, omega=6.0)), position=(5, 0, 0))
    alone, beside = (
        integrate(system, method, 0.3, 0.05)
        for system in (pair, System([*pair.bodies, free], pair.joints, pair.forces))
    )
    for name in ("soft", "block"):
        assert_allclose(beside.body(name).r, alone.body(name).r, rtol=0, atol=1e-12)
        assert_allclose(beside.body(name).q, alone.body(name).q, rtol=0, atol=1e-12)


def test_stiffened_pair_moves_as_with_generalized_alpha():
    """All three schemes, none of whose formulas are those of the kernels: the difference falls with h²."""
    system = floating_pair("revolute", body=STIFFENED)
    fine = integrate(system, GeneralizedAlpha(0.9, 1e-11), 0.1, 2.5e-4, output_every=400).body("soft").q[-1]
    for method in SCHEMES.values():
        ends = [integrate(system, method, 0.1, h, output_every=10).body("soft").q[-1] for h in (0.01, 0.005)]
        errors = [np.abs(end - fine).max() for end in ends]
        assert 3 < errors[0] / errors[1] < 5.5, (method, errors)
        assert errors[1] < 0.03 * np.abs(fine).max()


@pytest.mark.parametrize("kind", ["revolute", "screw", "universal", "distance", "planar"])
def test_variational_scheme_closes_joints_in_positions_and_velocities_and_keeps_momenta(kind):
    motion = integrate(floating_pair(kind), Variational(), 0.5, 0.05, output_every=5)
    assert max(momentum_defects(motion)) < 1e-11
    drift = motion.drift("joint")
    for values in (drift.distance, drift.angle, drift.distance_rate, drift.angle_rate):
        assert values.max() < 1e-11
    assert 1e-8 < energy_defect(motion) < 2e-2


def test_forces_in_joints_and_on_bodies_balance_energy_exactly():
    """Springs, dampers, friction by the normal force, tables: what enters and leaves is what is said."""
    table = table_function([-4.0, -2.0, 0.0, 2.0, 4.0], [-9.0, -3.0, 0.0, 2.0, 7.0])
    forces = [
        JointForce("mount", "joint", "angle", stiffness=3.0, free=0.2, damping=0.4, preload=0.1, characteristic=table,
                   friction=0.05, friction_coefficient=0.1, friction_speed=0.2),
        SpringDamper("rope", Marker("soft", "end_b"), Marker(GROUND, position=(0, 3, 1)), 2.0, 0.6, preload=0.3),
        PointForce("push", Marker("soft", "end_a"), (1.0, 0.5, -0.4), (0.1, 0.2, 0.0), is_follower=True),
        PointForce("wind", Marker("block", position=(0.2, 0, 0)), (0.0, 0.5, 0.4), (0.1, 0.2, -0.3)),
        Gravity((0.0, 1.0, -9.81)),
    ]  # fmt: skip
    motion = integrate(floating_pair("revolute", forces), EnergyMomentum(), 0.5, 0.05)
    assert motion.energies.dissipated[-1] > 1e-2
    assert np.diff(motion.energies.dissipated).min() > 0
    assert energy_defect(motion) < 1e-11


def test_driven_joint_balances_energy_exactly():
    motions = {"angle": cycloidal_spin_up(4.0, 0.3)}
    motion = integrate(floating_pair("revolute", motions=motions), EnergyMomentum(), 0.5, 0.05)
    assert abs(motion.energies.work[-1]) > 0.1
    assert energy_defect(motion) < 1e-11
    closed = integrate(floating_pair("revolute", motions=motions), Variational(), 0.5, 0.05)
    assert closed.drift("joint").angle_rate.max() < 1e-11


def test_closed_loops_that_share_their_reactions_keep_their_energy():
    """A four-bar linkage in space: three constraints repeat others, and give way far below the energy of the motion."""
    plain = four_bar()
    system = System(plain.bodies, plain.joints, [Gravity((0, -9.81, 0))], redundant="minimum-norm")
    motion = integrate(system, EnergyMomentum(), 0.2, 0.02, output_every=5)
    assert np.ptp(motion.energies.kinetic) > 0.3
    assert energy_defect(motion) < 1e-8
    assert max(motion.drift(name).distance.max() for name in motion.head.joints) < 1e-6


def test_energy_of_the_decaying_scheme_never_rises():
    """Not by rounding of the tolerance either, at steps that resolve the modes and such that do not."""
    for h in (0.5, 0.1, 0.02):
        motion = integrate(spinning(), EnergyDecaying(0.3), 20 * h, h)
        total = motion.energies.total
        assert np.diff(total).max() <= 1e-12 * total[0]
        assert total[-1] < 0.999 * total[0]
        assert max(momentum_defects(motion)) < 1e-11


def test_decaying_scheme_has_its_spectral_radius_and_is_the_conserving_one_for_one():
    """A mode that moves no frame, 1e4 radians a step: rho_inf of its amplitude is left after each."""
    places = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
    phi = np.zeros((4, 3, 1))
    phi[0, 0], phi[1, 0] = 1.0, -1.0
    reduced = reduced_body(PointMasses(np.ones(4), places, phi), np.array([[2e8]]))
    system = System([FlexibleBody("body", reduced, q=[1e-3])])
    q = integrate(system, EnergyDecaying(0.6), 4.0, 1.0).body("body").q[:, 0]
    assert_allclose(np.abs(q[1:] / q[:-1]), 0.6, rtol=1e-3)
    one = integrate(spinning(), EnergyDecaying(1.0), 0.2, 0.02)
    other = integrate(spinning(), EnergyMomentum(), 0.2, 0.02)
    assert_allclose(one.body("body").q, other.body("body").q, rtol=0, atol=1e-14)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_unresolved_modes_do_not_brake_a_falling_rod_whose_frame_stands_at_its_hinge(rho):
    """SciPy: theta'' = -(3 g/2 L) sin(theta) of a rigid rod; the axes of the frame stand at the held end."""
    line = fe_models.beams.BeamLine(
        1.0, 1.0, 4e9, 4e6, 6e6, 4e6, 1e-3, 1e-3
    )  # first bending mode: 1100 periods a second
    rod = cms.reduction.beam_from_assumed_modes(
        line, name="rod", units=unit_system("m-kg-s"), n_axial=1, n_bending=2, n_torsion=1,
        frame=cms.NodalFrame("start"),
    )  # fmt: skip
    place, h, t_end = np.array([30.0, -20.0, 10.0]), 0.01, 1.0
    body = FlexibleBody("rod", rod, position=place, omega_B=(0.0, 0.0, 0.8))
    hinge = RevoluteJoint("hinge", Marker("ground", position=place), Marker("rod", "start"), axis=(0, 0, 1))
    motion = integrate(System([body], [hinge], [Gravity((0, -9.81, 0))]), EnergyDecaying(rho), t_end, h)
    R = rotation_matrix(motion.body("rod").p)
    angle = np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    exact = solve_ivp(
        lambda t, y: [y[1], -1.5 * 9.81 * np.cos(y[0])], (0, t_end), [0.0, 0.8], t_eval=motion.t, rtol=1e-10, atol=1e-12
    )
    assert np.ptp(exact.y[0]) > 2.5
    assert_allclose(angle, exact.y[0], rtol=0, atol=0.01)


def test_energy_of_the_variational_scheme_stays_in_a_band():
    """No drift: the band of the second half is that of the first, and narrows with the square of the step."""
    bands, n_steps = [], 240
    for h in (0.05, 0.025):
        motion = integrate(spinning(), Variational(), n_steps * h, h, output_every=3)
        error = motion.energies.total - motion.energies.total[0]
        first, second = np.array_split(error, 2)
        assert abs(second.mean() - first.mean()) < 0.3 * np.ptp(error)
        assert np.ptp(second) < 1.3 * np.ptp(first)
        assert max(momentum_defects(motion)) < n_steps * SCHEMES["variational"].tolerance
        bands.append(np.ptp(error))
    assert 2.5 < bands[0] / bands[1] < 6


def test_resumed_run_is_the_uninterrupted_one_bit_for_bit(tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    monkeypatch.setattr(integration, "RESTART_STEPS", 200)
    whole = integrate(spinning(), EnergyMomentum(), 2.5, 0.01, output_every=50)

    def stop(progress):
        raise StopHereError

    with pytest.raises(StopHereError):
        integrate(spinning(), EnergyMomentum(), 2.5, 0.01, output_every=50, output=tmp_path / "run.h5", progress=stop)
    assert steps_on_record(tmp_path / "run.h5") == 200
    assert_same(resume(spinning(), tmp_path / "run.h5"), whole)


def test_massless_modes_are_refused():
    points = random_point_masses(2, 3)
    phi = points.phi.copy()
    phi[:, :, 1] = 0.0
    body = FlexibleBody("body", reduced_body(type(points)(points.m, points.c, phi), stiffness(2)))
    with pytest.raises(ModelError, match="body 'body' has a mode without mass"):
        integrate(System([body]), EnergyMomentum(), 1.0, 0.1)


def test_friction_by_the_normal_force_is_refused_by_the_variational_scheme():
    rub = JointForce("rub", "joint", "angle", friction_coefficient=0.1)
    with pytest.raises(ModelError, match="'rub' has friction by the normal force"):
        integrate(floating_pair("revolute", [rub]), Variational(), 1.0, 0.1)


def test_results_stand_on_the_ground_too():
    """A rigid pendulum on a spherical joint: the force on the ground is weight and centripetal force at the bottom."""
    g, length, omega = 9.81, 0.8, 3.0
    bob = RigidBody("bob", 2.0, 1e-9 * np.eye(3), center_of_mass=(0, 0, -length), omega_B=(0, omega, 0))
    system = System([bob], [SphericalJoint("pin", Marker(GROUND), Marker("bob"))], [Gravity((0, 0, -g))])
    for method in SCHEMES.values():
        motion = integrate(system, method, 0.02, 0.01)
        assert_allclose(motion.reaction("pin").force[0], [0, 0, -2.0 * (g + omega**2 * length)], rtol=1e-9, atol=1e-9)


def test_change_of_a_turning_vector_is_exact():
    rng = np.random.default_rng(3)
    theta, a_0, a_1 = rng.normal(size=(3, 3))
    R_0 = rotation_exp(rng.normal(size=3))
    R_1 = R_0 @ cayley(theta)
    R_m = R_0 @ (np.eye(3) + 0.5 * tilde(theta))
    expected = np.cross(R_0 @ theta, 0.5 * (R_0 @ a_0 + R_1 @ a_1)) + R_m @ (a_1 - a_0)
    assert_allclose(R_1 @ a_1 - R_0 @ a_0, expected, rtol=0, atol=1e-14)
    p = cayley_parameters(np.array([1.0, 0, 0, 0]), theta)
    assert_allclose(rotation_matrix(p), cayley(theta), rtol=0, atol=1e-15)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 0.49, 0.51, 2.0])
def test_elastic_rotations_of_a_step_are_exact(size):
    """The Cayley vector of the relative rotation, and the mean Jacobian that gives it from the change of th."""
    rng = np.random.default_rng(4)
    th_0 = rng.normal(size=3) * 0.4
    th_1 = th_0 + size * rng.normal(size=3) / 3
    psi = relative_cayley(th_0, th_1)
    assert_allclose(cayley(psi) @ rotation_exp(th_0), rotation_exp(th_1), rtol=0, atol=1e-14)
    assert_allclose(mean_jacobian(th_0, th_1) @ (th_1 - th_0), psi, rtol=0, atol=1e-14)
    assert_allclose(rotation_exp(th_1), Rotation.from_rotvec(th_1).as_matrix(), rtol=0, atol=1e-14)
    assert_allclose(left_jacobian(th_1), right_jacobian(th_1).T, rtol=0, atol=1e-12)
