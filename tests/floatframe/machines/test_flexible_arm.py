"""The flexible arm: its generated equations in an optimiser and in its controllers beside the engine."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.machines import flexible_arm
from floatframe.machines.flexible_arm import control, study
from floatframe.machines.flexible_arm.collocation import SMOOTHING
from floatframe.model.functions.point_to_point import quintic
from floatframe.model.functions.time_functions import harmonic
from floatframe.results.energy_balance import balance_defect, energy_scale


@pytest.fixture(scope="module")
def parts():
    return flexible_arm.links()


@pytest.fixture(scope="module")
def found(parts):
    return flexible_arm.moves(parts)


@pytest.fixture(scope="module")
def motions(parts, found):
    return flexible_arm.compared(parts, found)


def steered(system, move, h):
    """Return the motion of the arm under the torques of a move, without feedback."""
    motors = tuple(
        ff.JointForce(f"motor {joint}", joint, "angle", motor=move.torque_function(f"{joint}/angle"))
        for joint in study.TARGET
    )
    return ff.integrate(
        replace(system, forces=motors), ff.integrators.trapezoidal(), study.DURATION, h, formulation="relative"
    )


def test_the_links_are_strips_with_a_mass_at_their_ends(parts):
    """Clamped: the lowest frequency of each against 3 EI / (L³ (m + 33/140 of the strip)) with the mass as a point."""
    for link, thickness, mass in ((parts.upper, 0.005, 0.6), (parts.forearm, 0.003, 0.25)):
        strip = 2700.0 * 0.5 * 0.05 * thickness
        assert_allclose(link.moments.m, mass + strip, rtol=1e-9)
        stiffness = 3 * 70e9 * 0.05 * thickness**3 / 12 / 0.5**3
        expected = np.sqrt(stiffness / (mass + 33 / 140 * strip))
        assert_allclose(np.sqrt(link.K[0, 0] / link.M[0, 0]), expected, rtol=5e-3)


def missed(system, move):
    """Return how far the engine is from the optimiser, (n_z,), at most over the move, and at its end."""
    h = 2.5e-4
    model, motion = ff.analyses.relative_model(system), steered(system, move, h)
    every = round((move.t[1] - move.t[0]) / h)
    z = np.array([model.positions(motion.state(every * k))[0] for k in range(len(move.t))])
    return np.abs(z - move.z).max(axis=0), np.abs(z - move.z)[-1]


def test_the_engine_goes_where_the_optimiser_says(parts, found):
    """The same modes in two codes: what is between them is the discretisation, and falls with it."""
    system, fine = flexible_arm.arm(parts, modes=flexible_arm.BENDING), found["flexible"]
    assert_allclose(fine.z[-1, [0, 3]], list(study.TARGET.values()), rtol=0, atol=1e-9)
    over, at_the_end = missed(system, fine)
    assert (over < 5e-3 * np.abs(fine.z).max(axis=0)).all()
    assert (at_the_end[[0, 3]] < 5e-5).all()
    target = {f"{joint}/angle": angle for joint, angle in study.TARGET.items()}
    coarse = flexible_arm.optimal_move(system, target, study.DURATION, torque=study.LARGEST, n_intervals=40)
    resolved = [0, 1, 3, 4]  # hinges and first modes; the second ones have four points a period, or fewer
    assert (missed(system, coarse)[0][resolved] > 5 * over[resolved]).all()


def test_the_least_effort_of_a_rigid_link_is_that_of_a_quadratic_programme(parts):
    """Straight lines of torque integrated exactly: linear equations for the least cost between rest and rest."""
    n, h, s = 60, 1.0 / 60, SMOOTHING
    one = ff.System(*(each[:1] for each in systems_parts(flexible_arm.arm(parts, is_rigid=True))), name="one")
    inertia = float(ff.analyses.relative_model(one).mass_matrix(np.zeros(1))[0, 0])
    move = flexible_arm.optimal_move(one, {"shoulder/angle": 1.0}, 1.0, torque=[8.0], n_intervals=n)
    bend = np.diff(np.eye(n + 1), 2, axis=0) / h**2
    weight = h * (np.eye(n + 1) + s**4 * bend.T @ bend)
    rate, place = np.zeros((2, n + 1))  # at the end, by each torque
    for k in range(n):
        place += h * rate
        place[k : k + 2] += h**2 * np.array([1 / 3, 1 / 6])
        rate[k : k + 2] += h / 2
    held = np.vstack([rate, place, np.eye(n + 1)[[0, 1, n - 1, n]]])
    wanted = np.array([0.0, inertia / 8.0, 0.0, 0.0, 0.0, 0.0])
    u = np.linalg.solve(weight, held.T @ np.linalg.solve(held @ np.linalg.solve(weight, held.T), wanted))
    assert_allclose(move.torque[:, 0], 8.0 * u, rtol=0, atol=1e-7 * np.abs(8.0 * u).max())
    assert_allclose(move.cost, u @ weight @ u, rtol=1e-8)


def systems_parts(system):
    return system.bodies, system.joints


def test_computed_torque_leads_a_rigid_arm_exactly(parts):
    """Its expressions are the inverse dynamics of the engine: what is left is the error of the steps."""
    rigid = flexible_arm.arm(parts, is_rigid=True)
    aims = {joint: quintic(0.0, study.DURATION, 0.0, value) for joint, value in study.TARGET.items()}

    def error(h):
        control = flexible_arm.computed_torque(rigid, aims, study.BANDWIDTH, (100.0, 100.0))
        each = flexible_arm.controlled(rigid, control, t_end=study.DURATION, h=h)
        columns = ff.sensors.measured(each.system, each.motion)["elbow"].columns["value"]
        return np.abs(columns - aims["elbow"].at(each.motion.t)).max()

    coarse, fine = error(2e-3), error(1e-3)
    assert fine < 2e-5
    assert_allclose(np.log2(coarse / fine), 2, rtol=0, atol=0.15)


def test_torques_belong_to_the_hinges_of_their_aims_in_any_order(parts):
    rigid, largest = flexible_arm.arm(parts, is_rigid=True), {"shoulder": 8.0, "elbow": 3.0}
    aims = {joint: quintic(0.0, 0.8, 0.0, value) for joint, value in study.TARGET.items()}
    first, second = (
        flexible_arm.computed_torque(rigid, {joint: aims[joint] for joint in order}, 10.0, [largest[j] for j in order])
        for order in (("shoulder", "elbow"), ("elbow", "shoulder"))
    )
    assert first.forces == second.forces


def test_the_optimal_move_with_modes_leaves_a_hundredth_of_the_vibration(motions):
    rigid, optimal_rigid, flexible = motions.values()
    assert flexible.residual < 1e-3
    assert optimal_rigid.residual > 50 * flexible.residual
    assert rigid.residual > 50 * flexible.residual


def test_motors_keep_their_limits_and_energy_is_theirs(motions):
    for each in motions.values():
        assert (np.abs(each.torque).max(axis=0) <= np.array(study.LARGEST) * (1 + 1e-9)).all()
        assert np.abs(balance_defect(each.motion)).max() < 2e-3 * energy_scale(each.motion)


def test_what_cannot_be_is_told(parts):
    rigid = flexible_arm.arm(parts, is_rigid=True)
    move = flexible_arm.optimal_move
    with pytest.raises(ff.errors.ModelError, match="target: expected some of shoulder/angle, elbow/angle, got wrist"):
        move(rigid, {"wrist": 1.0}, 1.0, torque=[1.0])
    with pytest.raises(ff.errors.ModelError, match="a torque above 0 for each motor"):
        move(rigid, {"shoulder/angle": 1.0}, 1.0, torque=[1.0, 1.0])
    with pytest.raises(ff.errors.ConvergenceError, match="allow more time or torque"):
        move(rigid, {"shoulder/angle": 1.0, "elbow/angle": 0.0}, 0.2, torque=[1.0, 1.0], n_intervals=10)
    with pytest.raises(ff.errors.ModelError, match=r"expected a tree of rigid bodies on hinges, got .*mode 1"):
        flexible_arm.computed_torque(flexible_arm.arm(parts), {}, 1.0, ())
    with pytest.raises(ff.errors.ModelError, match="expected its hinges shoulder, elbow, got elbow"):
        flexible_arm.computed_torque(rigid, {"elbow": quintic(0.0, 1.0, 0.0, 1.0)}, 1.0, (1.0,))
    with pytest.raises(ff.errors.ModelError, match="expected a function of polynomials"):
        control.rate_of(harmonic(1.0, 1.0))
