"""Rotors: drives at other speeds, free spin that runs down, Campbell diagrams; states and statics."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    Gravity,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    linearize,
    static_equilibrium,
)
from floatframe.analyses import campbell, named_state_space, steady_rotation
from floatframe.analyses.linear import parameter_study
from floatframe.design.gradients.parameters import value_at, with_value
from floatframe.errors import ConvergenceError, ModelError
from floatframe.forces import Bushing
from floatframe.joints import PlanarJoint
from floatframe.model.elements.expressions import ExpressionElement
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.model.rotations import rotation_exp

OMEGA = 100.0  #: of the disc in its bearings


def disc(offset=0.0, damping=0.0, mm=1.0, drive=None):
    """Return a disc in round bearings, and a shaft that turns it by a stiff coupling; mm: unit of length by m."""
    J = np.diag([0.1, 0.1, 0.2]) / mm**2
    body = RigidBody("disc", 10.0, J, center_of_mass=(offset / mm, 0, 0))
    shaft = RigidBody("shaft", 1.0, 0.01 * np.eye(3) / mm**2)
    plane = PlanarJoint("plane", GROUND, Marker("disc"), axis=(0, 0, 1))
    motions = {} if drive is None else {"angle": polynomial_of_time([0.0, drive])}
    hinge = RevoluteJoint("motor", GROUND, Marker("shaft"), axis=(0, 0, 1), motions=motions)
    across = np.array([1.0, 1, 0, 0, 0, 0])
    bearing = Bushing("bearing", Marker(GROUND), Marker("disc"), 10.0 * OMEGA**2 * across, damping * across)
    coupling = Bushing("coupling", Marker("shaft"), Marker("disc"), stiffness=np.array([0, 0, 0, 0, 0, 1e5]) / mm**2)
    return System([body, shaft], [plane, hinge], [bearing, coupling])


@pytest.mark.parametrize("mm", [1.0, 1e-3])
@pytest.mark.parametrize("drive", [None, 7.0])
def test_a_campbell_diagram_has_a_line_for_each_mode(drive, mm):
    """Whirls of OMEGA, seen from axes that turn with W, have OMEGA ± W; the torsion stays, and crosses one of them."""
    speeds = np.linspace(0.0, 80.0, 9)
    torsion = np.sqrt(1e5 * (1 / 0.2 + (0.0 if drive else 1 / 0.01)))
    locus = campbell(disc(mm=mm, drive=drive), speeds)
    lines = [np.abs(OMEGA + speeds), np.abs(OMEGA - speeds), np.full(9, torsion)] + ([] if drive else [np.zeros(9)])
    found = 2 * np.pi * locus.frequencies
    assert found.shape[1] == len(lines)
    apart = [min(np.abs(column - line).max() for line in lines) for column in found.T]
    assert_allclose(apart, 0.0, rtol=0, atol=1e-6 * OMEGA)


@pytest.mark.parametrize("damping", [0.0, 20.0])
@pytest.mark.parametrize("n_speeds", [4, 7, 18])
def test_whirls_keep_their_lines_beyond_the_critical_speed(n_speeds, damping):
    """Seen from turning axes the forward whirl stands still at W = OMEGA; beyond it both whirls have one shape."""
    speeds = np.linspace(0.0, 280.0, n_speeds)
    locus = campbell(disc(drive=7.0, damping=damping), speeds)
    found = 2 * np.pi * locus.frequencies
    lines = [OMEGA + speeds, np.abs(OMEGA - speeds), np.full(n_speeds, np.sqrt(1e5 / 0.2))]
    assert found.shape[1] == len(lines)
    apart = [min(np.abs(column - line).max() for line in lines) for column in found.T]
    assert_allclose(apart, 0.0, rtol=0, atol=2e-4 * OMEGA)


def test_a_spring_that_a_rotation_winds_up_is_named():
    """A bearing shell on the shaft, held by a torsion spring from the ground: it cannot turn with the rotor."""
    system = disc()
    shell = RigidBody("shell", 0.1, 1e-3 * np.eye(3))
    sleeve = RevoluteJoint("sleeve", Marker("disc"), Marker("shell"), axis=(0, 0, 1))
    holder = Bushing("holder", Marker(GROUND), Marker("shell"), stiffness=np.array([0, 0, 0, 0, 0, 1e3]))
    held = replace(
        system, bodies=[*system.bodies, shell], joints=[*system.joints, sleeve], forces=[*system.forces, holder]
    )
    assert np.isfinite(campbell(held, [0.0]).eigenvalues).all()
    with pytest.raises(ModelError, match=r"later, forces are unbalanced .* 'shell'; .* torsion spring to the ground"):
        campbell(held, [0.0, 50.0])


def test_whirls_that_speeds_far_apart_leave_undecided_are_not_joined(monkeypatch):
    """From W = 150 to 280 each whirl changes by more than the two differ: without steps between, their lines end."""
    monkeypatch.setattr(parameter_study, "MOST_HALVINGS", 0)
    found = campbell(disc(drive=7.0), [150.0, 280.0]).eigenvalues
    joined = np.isfinite(found).all(axis=0)
    assert joined.sum() == 1
    assert_allclose(found[:, joined].imag, np.sqrt(1e5 / 0.2), rtol=1e-9)


def test_a_mode_that_is_not_met_again_ends_its_line():
    """A mode of one body at one value, of another body at the next: two lines, each with a gap."""
    from floatframe.analyses import root_locus

    def build(value):
        stiff = np.array([1.0, 0, 0, 0, 0, 0]) * 100.0
        bodies = [RigidBody(name, 1.0, np.eye(3), position=(0, 2.0 * k, 0)) for k, name in enumerate("ab")]
        held = "a" if value < 1.5 else "b"
        fixed = {name: {} if name == held else {"distance": 0.0} for name in "ab"}
        rails = [PrismaticJoint(f"rail {n}", GROUND, Marker(n), axis=(1, 0, 0), motions=fixed[n]) for n in "ab"]
        springs = [Bushing(f"spring {n}", Marker(GROUND, position=(0, 2.0 * k, 0)), Marker(n), stiffness=stiff)
                   for k, n in enumerate("ab")]  # fmt: skip
        system = System(bodies, rails, springs)
        return linearize(system, static_equilibrium(system), inputs=(), outputs=())

    locus = root_locus(build, [1.0, 2.0])
    assert locus.eigenvalues.shape == (2, 2)
    assert_allclose(locus.eigenvalues[[0, 1], [0, 1]].imag, 10.0, rtol=1e-9)
    assert np.isnan(locus.eigenvalues[[0, 1], [1, 0]]).all()
    assert np.isnan(locus.frequencies[0, 1])


@pytest.mark.parametrize("mm", [1.0, 1e-3])
def test_a_drive_at_another_speed_is_named(mm):
    system = disc(mm=mm, drive=80.0)
    steady_rotation(system, (0, 0, 80.0))
    for speed in (80.01, 81.0, 79.0):
        with pytest.raises(ModelError, match="a motion drives joint 'motor' at a speed that differs from"):
            steady_rotation(system, (0, 0, speed))


def test_a_rotor_that_runs_down_slowly_turns_steadily():
    """Unbalance e = 1 µm in damped bearings slows it by the torque d W |x|², x = m e W²/(k - m W² + i d W).

    An unbalance of a decimetre slows it by more than is steady, and is refused.
    """
    system = disc(offset=1e-6, damping=20.0)
    about = steady_rotation(system, (0, 0, 60.0))
    x = 10.0 * 1e-6 * 60.0**2 / abs(10.0 * OMEGA**2 - 10.0 * 60.0**2 + 20.0j * 60.0)
    assert_allclose(np.linalg.norm(about.state.r[0, :2]), x, rtol=1e-6)
    assert about.residual <= 1e-9
    with pytest.raises(ConvergenceError, match="no equilibrium found"):
        steady_rotation(disc(offset=1e-1, damping=20.0), (0, 0, 60.0))


@pytest.mark.parametrize("mm", [1.0, 1e-3])
@pytest.mark.parametrize("speed", [17.3, 46.2, 178.19, 640.0])
def test_a_small_unbalance_far_from_the_origin_turns_steadily(speed, mm):
    """|x| = m e W²/|k - m W²| of e = 0.1 µm, 60 m away and turned: inertia forces have the rounding of places."""
    R, place, e = rotation_exp(np.array([0.4, -0.7, 0.3])), np.array([30.0, -20.0, 50.0]) / mm, 1e-7 / mm
    J = R @ np.diag([0.1, 0.1, 0.2]) @ R.T / mm**2
    body = RigidBody("disc", 10.0, J, position=place, center_of_mass=e * R[:, 0])
    plane = PlanarJoint("plane", Marker(GROUND, position=place), Marker("disc"), axis=R[:, 2])
    across = np.array([1.0, 1, 0, 0, 0, 0])
    bearing = Bushing("bearing", Marker(GROUND, position=place, triad=R), Marker("disc"), 10.0 * OMEGA**2 * across)
    about = steady_rotation(System([body], [plane], [bearing]), speed * R[:, 2], center=place)
    x = e * speed**2 / abs(OMEGA**2 - speed**2)
    atol = 4 * np.finfo(float).eps * np.abs(place).max()
    assert_allclose(np.linalg.norm(about.state.r[0] - place), x, rtol=1e-6, atol=atol)
    assert about.residual <= 1e-6


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_mass_held_by_an_observer_and_its_feedback_comes_to_rest(formulation):
    """m x'' = u + f, u = -K z, z' = (A - B K - L C) z + L x: the flow without velocities leads away from the rest."""
    m, f = 2.0, 30.0
    A, B, C = np.array([[0, 1.0], [0, 0]]), np.array([[0], [1 / m]]), np.array([[1.0, 0]])
    K, L = np.array([[10.0, 6.4]]), np.array([[1.73], [1.0]])
    own = A - B @ K - L @ C
    assert np.linalg.eigvals(np.block([[A, -B @ K], [L @ C, own]])).real.max() < 0
    expected = np.linalg.solve(np.block([[A, -B @ K], [L @ C, own]]), [0, -f / m, 0, 0])
    rates = {f"z{i}": f"({own[i, 0]!r})*z0 + ({own[i, 1]!r})*z1 + ({L[i, 0]!r})*b_x".replace("np.float64", "")
             for i in range(2)}  # fmt: skip
    feedback = ExpressionElement("feedback", {"g": Marker(GROUND), "b": Marker("b")}, {"b_Fx": "-10.0*z0 - 6.4*z1"},
                                 {"z0": 0.0, "z1": 0.0}, rates)  # fmt: skip
    rail = PrismaticJoint("rail", Marker(GROUND), Marker("b"), axis=(1, 0, 0))
    system = System([RigidBody("b", m, np.eye(3))], [rail], [Gravity((f / m, 0, 0))], elements=[feedback])
    found = static_equilibrium(system, formulation=formulation)
    assert_allclose(found.state.r[0, 0], expected[0], rtol=1e-7)


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_coordinate_that_states_alone_hold_comes_to_rest(formulation):
    """Poles of feedback and observer as drawn at random, on a turned rail away from the origin; statics of the loop.

    In joint coordinates, long steps were lost in rounding and counted as rest, 5 % away.
    """
    m, f = 0.14851687, -7.3850724
    poles, observer = (-1.37821785, -2.03753833), (-7.46085066, -7.17296216)
    A, B, C = np.array([[0, 1.0], [0, 0]]), np.array([[0], [1 / m]]), np.array([[1.0, 0]])
    K = np.array([[m * poles[0] * poles[1], -m * sum(poles)]])
    L = np.array([[-sum(observer)], [observer[0] * observer[1]]])
    own = A - B @ K - L @ C
    expected = np.linalg.solve(np.block([[A, -B @ K], [L @ C, own]]), [0, -f / m, 0, 0])
    rates = {f"z{i}": f"({own[i, 0]:.17g})*z0 + ({own[i, 1]:.17g})*z1 + ({L[i, 0]:.17g})*b_x" for i in range(2)}
    R, place = rotation_exp(np.array([0.4, -0.7, 0.3])), np.array([3.0, -2.0, 5.0])
    ends = {"g": Marker(GROUND, position=place, triad=R), "b": Marker("b", triad=R)}
    push = {"b_Fx": f"-({K[0, 0]:.17g})*z0 - ({K[0, 1]:.17g})*z1"}
    feedback = ExpressionElement("feedback", ends, push, {"z0": 0.0, "z1": 0.0}, rates)
    rail = PrismaticJoint("rail", Marker(GROUND, position=place), Marker("b"), axis=R[:, 0])
    body = RigidBody("b", m, m * np.eye(3), position=place)
    system = System([body], [rail], [Gravity(f / m * R[:, 0])], elements=[feedback])
    found = static_equilibrium(system, formulation=formulation)
    assert_allclose((found.state.r[0] - place) @ R[:, 0], expected[0], rtol=1e-7)


def test_a_number_of_a_tensor_that_was_turned_may_vary():
    """Symmetric but for the last bits, as a product of matrices leaves it: both entries of a pair change."""
    R = rotation_exp(np.array([0.4, -0.7, 0.3]))
    J = R @ np.diag([1.0, 1.2, 1.5]) @ R.T
    J[0, 1] = np.nextafter(J[1, 0], 1.0)
    system = System([RigidBody("b", 1.0, J)], [], [])
    changed = with_value(system, "bodies.b.inertia.0.1", J[0, 1] + 0.01)
    assert changed.bodies[0].inertia[1, 0] == changed.bodies[0].inertia[0, 1]
    assert value_at(changed, "bodies.b.inertia.1.0") == J[0, 1] + 0.01


def test_states_are_no_rounding_of_motions_that_joints_hold():
    """A sledge on a rail that lies anyhow, seen without its joint coordinate: its state is a way along the rail."""
    R = rotation_exp(np.array([0.4, -0.7, 0.3]))
    body = RigidBody("b", 1.0, 0.1 * np.eye(3), position=(300.0, -200.0, 500.0), orientation=(0.5, 0.5, 0.5, 0.5))
    rail = PrismaticJoint("rail", GROUND, Marker("b"), axis=R[:, 0])
    spring = Bushing("spring", GROUND, Marker("b"), stiffness=np.full(6, 100.0))
    system = System([body], [rail], [spring])
    linear = linearize(system, static_equilibrium(system), inputs=(), outputs=())
    motions = linear.motions
    held = [k for k, unit in enumerate(motions.units) if unit == "rad"]
    assert held
    assert not motions.rows[held].any()
    kept = [k for k, rank in enumerate(motions.ranks) if rank == 2]
    own = replace(motions, names=tuple(motions.names[k] for k in kept), units=tuple(motions.units[k] for k in kept),
                  rows=motions.rows[kept], ranks=(2,) * len(kept))  # fmt: skip
    space = named_state_space(replace(linear, motions=own))
    assert np.abs(space.A).max() < 101.0
    assert space.states[0] in ("b x", "b y", "b z")
