"""Consistent initial conditions, and what is refused."""

import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.analyses import consistent_state, mobility
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.initial import solve_accelerations
from floatframe.engine.initial_conditions.newton_equations import displaced, set_iterate
from floatframe.engine.kernels.entry import evaluate_and_linearize, rates_of_constraints
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.model.state import State
from tests.floatframe.engine.kernels.examples import system_with_everything
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

LINK = np.diag([0.1, 0.1, 0.1])


def constraints(system, state):
    """Return residual, rate and second rate at zero acceleration of all held quantities."""
    model = compiled_system(system).model
    work = new_work(model)
    set_iterate(work, state)
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    held = (model.rows.kind == 0) | (model.rows.kind == 1)
    return (work.connections.g[held], *(part[held] for part in rates_of_constraints(model, work)))


def open_chain():
    """Two links and a flexible one, each a little off its joint, with velocities that do not fit."""
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3))
    bodies = [
        RigidBody("first", 1.0, LINK, position=(0.01, 0.02, 0), omega_B=(0.3, 1.0, 0)),
        RigidBody("second", 1.0, LINK, position=(1.0, -0.01, 0.02), velocity=(0.1, 0, 0.3)),
        FlexibleBody("third", flexible, position=(3.3, 0.1, 0.0), omega_B=(0.1, 0.2, 0.3)),
    ]
    joints = [
        RevoluteJoint("a", Marker(GROUND), Marker("first"), axis=(0, 1, 0), axis_b=(0.02, 1, 0)),
        SphericalJoint("b", Marker("first", position=(1, 0, 0)), Marker("second")),
        FixedJoint("c", Marker("second", position=(2, 0, 0)), Marker("third", "end_b")),
    ]
    return System(bodies, joints, [Gravity((0, 0, -9.81))])


def test_open_joints_are_closed_and_velocities_made_to_fit():
    system = open_chain()
    g, rate, _ = constraints(system, compiled_system(system).placed)
    assert np.abs(g).max() > 5e-3
    assert np.abs(rate).max() > 0.1
    start = consistent_state(system)
    g, rate, _ = constraints(system, start.state)
    assert_allclose(g, 0, rtol=0, atol=1e-11)
    assert_allclose(rate, 0, rtol=0, atol=1e-12)


def test_assembly_moves_bodies_rather_than_deforming_them():
    start = consistent_state(open_chain())
    assert np.abs(start.state.q).max() < 5e-3 * np.abs(start.state.r - compiled_system(open_chain()).placed.r).max()


def test_a_consistent_state_is_left_alone():
    start = consistent_state(open_chain())
    again = consistent_state(open_chain(), start.state)
    assert_allclose(again.state.r, start.state.r, rtol=0, atol=1e-12)
    assert_allclose(again.state.u, start.state.u, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_rates_are_the_derivatives_of_the_constraints_along_a_motion(seed):
    """g along q + u s, u held: slope and curvature at random states far from closed joints."""
    system = system_with_everything()
    rng = np.random.default_rng(seed)
    model = compiled_system(system).model
    n_b, n_q, n_u = len(model.bodies.kind), int(model.bodies.q0[-1]), int(model.bodies.u0[-1])
    p = np.array([euler_parameters_of_rotation_vector(rng.normal(size=3)) for _ in range(n_b)])
    state = State(rng.normal(size=(n_b, 3)), p, rng.normal(size=n_q), rng.normal(size=n_u))
    _, rate, bias = constraints(system, state)
    s = 1e-4
    before, at, after = (constraints(system, displaced(model, state, k * s * state.u))[0] for k in (-1, 0, 1))
    assert_allclose((after - before) / (2 * s), rate, rtol=0, atol=1e-6 * np.abs(bias).max())
    assert_allclose((after - 2 * at + before) / s**2, bias, rtol=0, atol=1e-6 * np.abs(bias).max())


def test_accelerations_keep_the_joints_closed():
    system = open_chain()
    start = consistent_state(system)
    s = 1e-3
    gap = []
    for k in (s, 2 * s):
        x = k * start.state.u + 0.5 * k**2 * start.u_dot
        gap.append(np.abs(constraints(system, displaced(compiled_system(system).model, start.state, x))[0]).max())
    assert 7 < gap[1] / gap[0] < 9  # third order in time


def test_accelerations_do_not_change_when_the_markers_change_sides():
    system = open_chain()
    swapped = [SphericalJoint("b", Marker("second"), Marker("first", position=(1, 0, 0)))]
    other = System(system.bodies, [system.joints[0], *swapped, system.joints[2]], system.forces)
    state = consistent_state(system).state
    first = solve_accelerations(compiled_system(system), new_work(compiled_system(system).model), state)
    second = solve_accelerations(compiled_system(other), new_work(compiled_system(other).model), state)
    assert_allclose(second[0], first[0], rtol=0, atol=1e-10 * np.abs(first[0]).max())
    assert_allclose(second[1][6:9], -first[1][6:9], rtol=0, atol=1e-10 * np.abs(first[1]).max())


def four_bar(last_joint):
    """A parallelogram of three links in the plane y = 0."""
    up = euler_parameters_of_rotation_vector([0, -np.pi / 2, 0])
    bodies = [
        RigidBody("crank", 1.0, LINK, orientation=up),
        RigidBody("coupler", 1.0, LINK, position=(0, 0, 1)),
        RigidBody("rocker", 1.0, LINK, position=(2, 0, 0), orientation=up),
    ]
    joints = [
        RevoluteJoint("j1", GROUND, Marker("crank"), axis=(0, 1, 0)),
        RevoluteJoint("j2", Marker("crank", position=(1, 0, 0)), Marker("coupler"), axis=(0, 1, 0)),
        RevoluteJoint("j3", GROUND, Marker("rocker"), axis=(0, 1, 0)),
        last_joint("j4", Marker("coupler", position=(2, 0, 0)), Marker("rocker", position=(1, 0, 0))),
    ]
    return System(bodies, joints, [Gravity((0, 0, -9.81))])


def test_redundant_constraints_are_refused_in_words():
    def hinge(name, a, b):
        return RevoluteJoint(name, a, b, axis=(0, 1, 0))

    with pytest.raises(ModelError, match=r"^3 of 20 constraints repeat others.*'j1', 'j2', 'j3', 'j4'"):
        consistent_state(four_bar(hinge))


def test_a_loop_without_redundant_constraints_runs():
    """The loop closed by a spherical joint and with one hinge relaxed has the mobility one."""
    system = four_bar(SphericalJoint)
    joints = [system.joints[0], SphericalJoint("j2", system.joints[1].marker_a, system.joints[1].marker_b)]
    flat = System(system.bodies, [*joints, system.joints[2], system.joints[3]], system.forces)
    with_spin = consistent_state(flat)  # the coupler may spin about its own line: 18 - 16 = 2 freedoms
    assert with_spin.w.shape == (18,)
    motion = integrate(flat, GeneralizedAlpha(), 0.2, 1e-3)
    assert motion.drift("j4").distance.max() < 1e-13


def test_a_state_that_is_none_of_this_system_is_refused():
    system = open_chain()
    placed = compiled_system(system).placed
    with pytest.raises(ModelError, match="state: u: expected finite numbers"):
        consistent_state(system, State(placed.r, placed.p, placed.q, placed.u * np.nan))
    with pytest.raises(ModelError, match=r"state: q: expected shape \(3,\), got \(2,\)"):
        consistent_state(system, State(placed.r, placed.p, placed.q[:2], placed.u))
    with pytest.raises(ModelError, match=r"p of body 'second'.*of length 1"):
        consistent_state(system, State(placed.r, placed.p * [[1], [2], [1]], placed.q, placed.u))


def test_an_impossible_assembly_names_the_open_joint():
    bodies = [RigidBody("link", 1.0, LINK)]
    joints = [
        SphericalJoint("near", Marker(GROUND), Marker("link")),
        SphericalJoint("far", Marker(GROUND, position=(3, 0, 0)), Marker("link", position=(1, 0, 0))),
    ]
    with pytest.raises(ModelError, match=r"cannot be closed.*joint '(far|near)' is open by"):
        consistent_state(System(bodies, joints))


def test_modes_without_mass_move_as_springs():
    """A massless shape: no division by its mass; it follows the force on it statically."""
    points = random_point_masses(2, 3)
    phi = np.concatenate([points.phi, np.zeros((len(points.m), 3, 1))], axis=2)
    massless = type(points)(points.m, points.c, phi)
    K = np.diag([40.0, 60.0, 500.0])
    reduced = reduced_body(massless, K)
    assert reduced.M[2, 2] == 0.0
    system = System([FlexibleBody("body", reduced)], [FixedJoint("clamp", GROUND, Marker("body", "end_b"))],
                    [Gravity((0, 0, -9.81))])  # fmt: skip
    motion = integrate(system, GeneralizedAlpha(0.5), 0.5, 1e-3)
    body, reaction = motion.body("body"), motion.reaction("clamp")
    Psi = reduced.interface("end_b").Psi
    late = motion.t > 0.1
    moment = reaction.moment[late] @ Psi[3:, 2]  # small rotations: the marker moment on the mode
    force = reaction.force[late] @ Psi[:3, 2]
    assert_allclose(K[2, 2] * body.q[late, 2], -(moment + force), rtol=0, atol=0.05 * np.abs(moment).max())
    assert np.abs(motion.energies.balance - motion.energies.balance[0]).max() < 0.02 * np.ptp(motion.energies.kinetic)


def hinges(last):
    return [*(RevoluteJoint(j.name, j.marker_a, j.marker_b, axis=(0, 1, 0)) for j in four_bar(last).joints)]


def test_mobility_is_counted_and_true():
    """A planar four-bar of hinges: Gruebler says -2, it moves in one way; 3 constraints of the last joint repeat."""
    bodies = four_bar(SphericalJoint).bodies
    found = mobility(System(bodies, hinges(SphericalJoint)))
    assert (found.gruebler, found.mobility, found.n_freedoms) == (-2, 1, 1)
    assert found.redundant == {"j4": 3}
    free = mobility(four_bar(SphericalJoint))
    assert (free.gruebler, free.mobility, free.redundant) == (0, 1, {"j4": 1})


def test_redundant_joints_move_as_those_without_and_share_their_load():
    """A parallelogram in its plane: the same motion; loads along the axes are none by symmetry of least norm."""
    bodies = four_bar(SphericalJoint).bodies
    gravity = [Gravity((0, 0, -9.81))]
    joints = hinges(SphericalJoint)
    full = System(bodies, joints, gravity, redundant="minimum-norm")
    j1, _, j3, _ = joints
    ball = SphericalJoint("j2", joints[1].marker_a, joints[1].marker_b)
    plain = System(bodies, [j1, ball, j3, SphericalJoint("j4", joints[3].marker_a, joints[3].marker_b)], gravity)
    first = integrate(full, GeneralizedAlpha(0.8, 1e-9), 0.3, 1e-3)
    second = integrate(plain, GeneralizedAlpha(0.8, 1e-9), 0.3, 1e-3)
    for body in ("crank", "rocker"):
        assert_allclose(first.body(body).r, second.body(body).r, rtol=0, atol=1e-8)
        assert_allclose(first.body(body).p, second.body(body).p, rtol=0, atol=1e-7)
    assert first.drift("j4").distance.max() < 1e-9


def test_a_door_on_two_hinges_hangs_on_both_alike():
    """Two hinges on one line: the weight is shared half and half, by least norm."""
    door = RigidBody("door", 4.0, np.eye(3), (0.5, 0, 0))
    joints = [RevoluteJoint(f"h{k}", Marker(GROUND, position=(0, 0, z)), Marker("door", position=(0, 0, z)))
              for k, z in enumerate((-1.0, 1.0))]  # fmt: skip
    system = System([door], joints, [Gravity((0, 0, -9.81))], redundant="minimum-norm")
    start = consistent_state(system)
    assert_allclose(start.w[[2, 8]], -0.5 * 4.0 * 9.81, rtol=1e-6, atol=0)
    with pytest.raises(ModelError, match="redundant: expected one of refuse, minimum-norm"):
        System([door], joints, redundant="drop")


@pytest.mark.parametrize(("share", "is_told"), [(0.9, False), (1.1, True)])
def test_friction_that_raises_its_own_reaction_above_it_is_told(share, is_told, caplog):
    """Friction c |N| on an eccentric hinge accelerates by c |N| / I, which adds m d c |N| / I to the reaction N."""
    m, I_z, arm = 2.0, 0.18, np.array([0.3, -0.2, 0.1])
    d = np.hypot(*arm[:2])
    c = share * (I_z + m * d**2) / (m * d)
    body = RigidBody("arm", m, np.diag([0.11, 0.15, I_z]), position=-arm, omega_B=(0, 0, 3.0))
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("arm", position=arm), axis=(0, 0, 1))
    rub = JointForce("rub", "hinge", "angle", friction_coefficient=c)
    system = System([body], [hinge], [rub, Gravity((1.0, -9.81, 0))])
    with caplog.at_level(logging.WARNING):
        start = consistent_state(system)
        assert caplog.text.count("accelerations at t = 0 were not found") == is_told
        caplog.clear()
        integrate(system, GeneralizedAlpha(), 2e-3, 1e-3)
        assert caplog.text.count("were not found") == is_told, "once for a run"
    if not is_told:  # I u_dot = moment of the reaction - c |N|, the reaction from m a = gravity + N
        omega_dot = start.u_dot[5]
        N = m * (start.u_dot[:3] - np.array([1.0, -9.81, 0]))
        moment = np.cross(arm, N)[2] - c * np.hypot(*N[:2])
        assert_allclose(I_z * omega_dot, moment, rtol=1e-6, atol=0)
