"""SciPy's solvers on independent coordinates: against generalized-alpha, with loops closed to rounding."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm

import floatframe.simulation.integrate as integration
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RigidBody,
    System,
    integrate,
    linearize,
    read_results,
    static_equilibrium,
)
from floatframe.components.mechanisms import four_bar, pendulum, slider_crank, spinning_top
from floatframe.errors import ModelError
from floatframe.integrators import RelativeOde
from floatframe.integrators.relative_ode import partition_of
from floatframe.model.bodies.mode_choice import with_modes
from floatframe.model.functions.time_functions import smooth_step
from floatframe.results import coupler_motion, element_motion
from floatframe.simulation import resume
from tests.floatframe.engine.tree.examples import rubbed_block
from tests.floatframe.engine.tree.mechanisms import DOWN, MECHANISMS, beam
from tests.floatframe.model.elements.element_accelerations_examples import pair
from tests.floatframe.model.elements.element_states_examples import jack_matrix, lifted
from tests.floatframe.model.elements.laws import Circuit
from tests.floatframe.model.forces.examples import pid, wheel
from tests.floatframe.model.joints.examples import wheels


@pytest.mark.parametrize("name", ["slider-crank", "four-bar", "satellite"])
def test_the_solver_agrees_with_generalized_alpha_and_keeps_energy_and_loops(name):
    system = MECHANISMS[name]()
    fine = [
        integrate(system, GeneralizedAlpha(1.0, 1e-11), 0.1, 0.05 / k, output_every=k, formulation="relative")
        for k in (50, 100)
    ]
    motion = integrate(system, RelativeOde("DOP853", 1e-9, 1e-11), 0.1, 0.05)
    for body in system.bodies:
        coarse, close = (each.body(body.name).r for each in fine)
        error = np.abs(coarse - close).max()
        assert_allclose(motion.body(body.name).r, close, rtol=0, atol=error + 1e-9)
    if name != "satellite":  # it is pushed
        assert np.ptp(motion.energies.total) < 1e-8
    for joint in system.joints:
        drift = motion.drift(joint.name)
        for of_joint in (drift.distance, drift.angle, drift.distance_rate, drift.angle_rate):
            assert of_joint.max() < 1e-11


def test_a_stiff_solver_follows_a_loop_through_dead_centres():
    """A slider-crank over more than a turn: the guide's distance, or the rod's angle, cannot be free everywhere."""
    system = slider_crank(angle=0.3, speed=40.0)
    motion = integrate(system, RelativeOde("BDF", 1e-6, 1e-8), 0.17, 0.17)
    fine = integrate(system, GeneralizedAlpha(1.0, 1e-11), 0.17, 1e-4, output_every=1700, formulation="relative")
    assert np.ptp(motion.energies.total) < 1e-3 * motion.energies.total[0]
    assert_allclose(motion.body("slider").r[-1], fine.body("slider").r[-1], rtol=0, atol=1e-3)


def test_rotations_are_counted_from_anew_after_two_radians():
    """A fast top, many turns: energy is kept, and the tip stays."""
    motion = integrate(spinning_top(), RelativeOde("DOP853", 1e-9, 1e-11), 0.04, 0.02)
    assert np.ptp(motion.energies.total) < 1e-6 * np.abs(motion.energies.total).max()
    assert motion.drift("tip").distance.max() < 1e-12


def test_a_partition_solves_what_it_should_and_knows_when_it_is_worn():
    rng = np.random.default_rng(0)
    C = rng.normal(size=(3, 7))
    made = partition_of(C, ("a", "b", "c"), np.ones(7))
    y = rng.normal(size=7)
    y[made.dependent] = made.solved(C, -C[:, made.independent] @ y[made.independent])
    assert_allclose(C @ y, 0, rtol=0, atol=1e-12)
    assert not made.is_worn(C)
    worn = C.copy()
    worn[:, made.dependent[0]] = worn[:, made.dependent[1]] + 1e-6
    assert made.is_worn(worn)


def test_singular_positions_are_told_in_words():
    C = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]])
    with pytest.raises(ModelError, match="1 of 2 constraints of 'ring', 'pin' repeat others here"):
        partition_of(C, ("ring", "pin"), np.ones(3))
    with pytest.raises(ModelError, match="joint 'pin' holds what cannot move"):
        partition_of(np.array([[1.0, 0.0], [0.0, 0.0]]), ("ring", "pin"), np.ones(2))


def test_solvers_that_are_none_are_refused():
    with pytest.raises(ModelError, match="RelativeOde: method 'BFD'; did you mean 'BDF'"):
        RelativeOde("BFD")


def soft_rod(length=1.0):
    """A slender beam with its two lowest modes, stiffened."""
    return with_modes(beam(length), [0, 1])


@pytest.mark.parametrize("name", ["pendulum", "four-bar"])
def test_flexible_bodies_move_as_generalized_alpha_says_with_small_steps(name):
    """Large motions of a tree and of a loop, modes and their stiffening included."""
    if name == "pendulum":
        system = pendulum(angle=0.5, rod=soft_rod())
    else:
        system = replace(four_bar(angle=0.3, flexible_coupler=soft_rod(0.9)), forces=[DOWN])
    fine = [
        integrate(system, GeneralizedAlpha(1.0, 1e-11), 0.1, 0.05 / k, output_every=k, formulation="relative")
        for k in (100, 200)
    ]
    motion = integrate(system, RelativeOde("Radau", 1e-7, 1e-9), 0.1, 0.05)
    for body in system.bodies:
        for part in ("r", "q"):
            coarse, close, own = (getattr(each.body(body.name), part) for each in (*fine, motion))
            allowed = 0.5 * np.abs(coarse - close).max(initial=0.0) + 1e-7
            assert_allclose(own, close, rtol=0, atol=allowed)
            if part == "q" and close.size:  # they bend, and what is allowed is little beside it
                assert allowed < 0.01 * np.abs(close).max()


def test_a_clamped_beam_swings_about_its_sag_as_its_modes_say():
    """Small motions in closed form, q = q_s (1 - cos(omega t)): the minimal coordinates of a linear structure."""
    body = FlexibleBody("rod", soft_rod())
    clamp = FixedJoint("clamp", GROUND, Marker("rod", "start"))
    system = System([body], [clamp], [Gravity((0.0, -1e-3, 0.0))])
    rest, modes = static_equilibrium(system, formulation="relative"), linearize(system, formulation="relative")
    found = integrate(system, RelativeOde("DOP853", 1e-10, 1e-14), 0.3, 0.1)
    values, shapes = eigh(modes.K, modes.M)
    sag = shapes.T @ modes.M @ rest.state.q
    exact = np.array([shapes @ (sag * (1 - np.cos(np.sqrt(values) * t))) for t in found.t])
    assert_allclose(found.body("rod").q, exact, rtol=0, atol=1e-5 * np.abs(exact).max())


def test_states_of_an_element_are_unknowns_of_the_solver():
    """A stiff pressure under a weight on a spring: a linear system of three states, in closed form."""
    system = lifted()
    jack, A = system.elements[0], jack_matrix(system.elements[0])
    b = np.array([0.0, -10.0, jack.stiffness * jack.leak * jack.supply])
    still = np.linalg.solve(A, -b)
    motion = integrate(system, RelativeOde("Radau", 1e-9, 1e-12), 0.1, 0.02)
    exact = np.array([expm(A * t) @ (np.array([0.0, 0.0, 3e5]) - still) + still for t in motion.t])
    assert_allclose(element_motion(system, motion, "jack").states["p"], exact[:, 2], rtol=0, atol=1e-3)
    assert_allclose(motion.body("b").r[:, 2], exact[:, 0], rtol=0, atol=1e-8)


def test_multipliers_of_an_element_are_found_with_the_reactions():
    """flow + flow³ = b beside two states that decay and swing."""
    system = System([RigidBody("b", 1.0, np.eye(3))], elements=[Circuit("c", Marker("b"), 1.0, "complex")])
    motion = integrate(system, RelativeOde("DOP853", 1e-10, 1e-12), 1.0, 0.25)
    found, t = element_motion(system, motion, "c"), motion.t
    exact = 0.5 * (np.cos(t) + np.sin(t) + np.exp(-t))
    assert_allclose(found.states["b"], exact, rtol=0, atol=1e-8)
    flow = found.multipliers["flow"]
    assert_allclose(flow + flow**3, exact, rtol=0, atol=1e-8)


def test_gears_turn_as_one_reduced_inertia_over_many_turns():
    ratio, torque = np.pi / 2, 7.0
    system = wheels(ratio, torque=torque)
    motion = integrate(system, RelativeOde("DOP853", 1e-9, 1e-11), 3.0, 0.5)
    alpha = torque / (0.7 + 0.3 / ratio**2)
    assert_allclose(motion.body("b").omega_B[:, 2], -alpha / ratio * motion.t, rtol=0, atol=1e-8)
    signals = coupler_motion(system, motion, "gear")
    assert_allclose(signals.value[:, 0], alpha * motion.t**2 / 2, rtol=0, atol=1e-7)
    assert signals.value[-1, 0] > 4 * np.pi
    assert_allclose(signals.force[:, 0], -0.3 / ratio**2 * alpha, rtol=1e-8)


def test_a_controller_with_a_state_moves_a_wheel_as_its_equations_say():
    """J phi'' = -kp (phi - aim) - kd phi' - ki e, e' = phi - aim: by SciPy's solver over three states of its own."""
    system = wheel(pid())
    motion = integrate(system, RelativeOde("DOP853", 1e-9, 1e-11), 2.0, 0.5)
    aim, J = smooth_step(0.0, 1.0, 0.0, 8.0), system.bodies[0].inertia[2, 2]

    def slope(t, y):
        return [y[1], (-40.0 * (y[0] - aim(t)) - 4.0 * y[1] - 30.0 * y[2]) / J, y[0] - aim(t)]

    exact = solve_ivp(slope, (0.0, 2.0), [0.0, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-12, t_eval=motion.t).y
    assert_allclose(motion.body("wheel").omega_B[:, 2], exact[1], rtol=0, atol=1e-6)


def test_friction_by_the_force_in_its_joint_is_solved_with_it():
    """A block with an arm on a rail: N depends on the motion, and the motion on mu N."""
    system = rubbed_block()
    fine = integrate(system, GeneralizedAlpha(1.0, 1e-12), 0.2, 5e-5, output_every=2000)
    motion = integrate(system, RelativeOde("Radau", 1e-8, 1e-10), 0.2, 0.1)
    assert_allclose(motion.body("block").r, fine.body("block").r, rtol=0, atol=2e-7)


def test_an_interrupted_run_goes_on_to_the_same_motion(tmp_path, monkeypatch):
    """Work too: it is summed over the outputs, and the record keeps it."""
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    system, path = rubbed_block(), tmp_path / "run.h5"

    def stop(progress):
        if progress.t > 0.09:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(system, RelativeOde("BDF", 1e-8, 1e-10), 0.2, 0.01, output=path, progress=stop)
    assert not read_results(path).is_complete
    motion, whole = resume(system, path), integrate(system, RelativeOde("BDF", 1e-8, 1e-10), 0.2, 0.01)
    assert motion.is_complete
    assert_allclose(motion.body("block").r, whole.body("block").r, rtol=0, atol=1e-6)
    assert whole.energies.dissipated[-1] > 0.3
    assert_allclose(motion.energies.dissipated, whole.energies.dissipated, rtol=0, atol=1e-5)


def test_elements_that_feel_accelerations_are_refused_by_name():
    with pytest.raises(ModelError, match=r"RelativeOde: element '\w+' depends on accelerations"):
        integrate(pair("rigid")[0], RelativeOde(), 0.1, 0.1)
