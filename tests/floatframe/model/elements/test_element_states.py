"""States and multipliers of elements: in motions, at rest, linearised, held at velocity level."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Marker,
    RigidBody,
    SpringDamper,
    System,
    frequency_response,
    integrate,
    linearize,
    static_equilibrium,
    system_modes,
)
from floatframe.analyses import BaseMotion, Column, consistent_state, named_state_space, root_locus
from floatframe.errors import ModelError
from floatframe.joints import RollingDisc
from floatframe.results import element_motion
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.sensors import Channel, ElementSensor, PlaceSensor
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.elements.element_states_examples import DAMPER, MASS, SPRING, G, disc, jack_matrix, lifted
from tests.floatframe.model.elements.laws import Circuit, Disc, Spring, Yielding, yielding_law
from tests.floatframe.orders import slope

METHOD = GeneralizedAlpha(0.9, 1e-11)


def test_a_stiff_pressure_moves_as_an_independent_integration_says():
    system = lifted()
    jack = system.elements[0]
    b = np.array([0, -G, jack.stiffness * jack.leak * jack.supply])
    A = jack_matrix(jack)
    exact = solve_ivp(lambda t, x: A @ x + b, (0, 0.1), [0, 0, 3e5], method="Radau", rtol=1e-10, atol=1e-10).y[:, -1]
    steps, errors, defects = [1e-3, 5e-4, 2.5e-4, 1.25e-4], [], []
    for h in steps:
        motion = integrate(system, METHOD, 0.1, h)
        p = element_motion(system, motion, "jack").states["p"][-1]
        errors.append(abs(p - exact[2]) / 1e6 + abs(motion.body("b").r[-1, 2] - exact[0]))
        defects.append(np.abs(balance_defect(motion)).max() / energy_scale(motion))
    assert abs(slope(steps, errors) - 2) < 0.15
    assert abs(slope(steps, defects) - 2) < 0.15


def test_the_tangent_of_states_and_equations_is_exact():
    def prepare(iterate):
        iterate.work.states.kappa[...], iterate.work.states.rho[...] = 0.3, 0.8

    assert_tangent_is_exact(lifted(stiffness=3.0, area=2.0, leak=0.7), prepare=prepare)
    body = RigidBody("b", 1.0, np.eye(3))
    for tangent, tolerance in (("complex", 4e-9), ("differences", 1e-7)):
        circuit = Circuit("c", Marker("b"), 2.0, tangent)
        assert_tangent_is_exact(System([body], elements=[circuit]), prepare=prepare, tolerance=tolerance)


@pytest.mark.parametrize("tangent", ["complex", "differences"])
def test_states_that_move_no_body_converge_in_every_step(tangent):
    system = System([RigidBody("b", 1.0, np.eye(3))], elements=[Circuit("c", Marker("b"), 1e6, tangent)])
    motion = integrate(system, METHOD, 1.0, 1e-2)
    found = element_motion(system, motion, "c")
    a, b, flow, t = found.states["a"], found.states["b"], found.multipliers["flow"], motion.t
    assert_allclose(b, 0.5 * (np.cos(t) + np.sin(t) + np.exp(-t)), rtol=0, atol=3e-6)
    assert_allclose((a**3)[1:], b[1:], rtol=0, atol=2e-6)
    assert_allclose(flow + flow**3, b, rtol=0, atol=1e-9)


def test_old_derivatives_of_a_law_serve_many_steps():
    """A derivative by differences takes 26 evaluations, for three numbers of r, phi, v, omega each, and the state."""
    calls = []

    def counted(*arguments):
        calls.append(1)
        yielding_law(*arguments)

    body = RigidBody("b", 1.0, np.eye(3), velocity=(0, 0, 1.0))
    system = System([body], elements=[Yielding("y", Marker("b"), counted, "differences")])
    steps = 200
    motion = integrate(system, GeneralizedAlpha(0.9), 1e-3 * steps, 1e-3, watch="off")
    assert len(calls) < 12 * steps
    compiled = System([body], elements=[Yielding("y", Marker("b"))])
    exact = integrate(compiled, GeneralizedAlpha(0.9, 1e-13), 1e-3 * steps, 1e-3, watch="off")
    assert_allclose(motion.body("b").r, exact.body("b").r, rtol=0, atol=1e-8)


def test_at_rest_states_stand_and_a_motion_goes_on_from_there():
    system = lifted()
    rest = static_equilibrium(system)
    assert_allclose(rest.state.r[0, 2], (1e6 * 1e-3 - MASS * G) / SPRING, rtol=1e-9)
    motion = integrate(system, METHOD, 0.02, 1e-3, state=rest.state)
    assert_allclose(element_motion(system, motion, "jack").states["p"], 1e6, rtol=1e-9)
    assert_allclose(motion.body("b").r[:, 2], rest.state.r[0, 2], rtol=0, atol=1e-9)


def test_an_element_may_say_what_holds_at_rest():
    rest = static_equilibrium(lifted(is_closed=True))
    assert_allclose(rest.state.r[0, 2], (2e6 * 1e-3 - MASS * G) / SPRING, rtol=1e-9)


def test_the_state_of_another_system_is_not_taken_for_its_own():
    rest = static_equilibrium(lifted())
    other = System(lifted().bodies, lifted().joints, elements=[*lifted().elements, Circuit("c", Marker("b"))])
    with pytest.raises(ModelError, match=r"expected the 22 unknowns of this system's .*, got 15"):
        consistent_state(other, rest.state)


def test_states_are_among_the_modes():
    system = lifted()
    linear = linearize(system)
    A = jack_matrix(system.elements[0])
    assert_allclose(named_state_space(linear).A, A, rtol=0, atol=1e-10 * np.abs(A).max())
    exact = np.linalg.eigvals(A)
    modes = system_modes(linear)
    assert_allclose(modes.eigenvalues, exact[np.argsort(np.abs(exact))], rtol=1e-9)
    assert modes.states == ("jack.p",)
    lam, ratio = modes.eigenvalues, modes.state_shapes[0] / modes.shapes[2]  # p/z of each mode
    assert_allclose(ratio, -lam * 1e12 * 1e-3 / (lam + 1e3), rtol=1e-8)


def test_modes_with_states_are_followed_where_they_pass_each_other():
    """A pressure that moves nothing decays faster and faster, past the vibration of the body."""
    leaks = np.linspace(1e-11, 1e-10, 10)
    locus = root_locus(lambda leak: linearize(lifted(area=0.0, leak=leak)), leaks)
    assert_allclose(locus.eigenvalues[:, 0], -1e12 * leaks, rtol=1e-9)
    body = -DAMPER / (2 * MASS) + 1j * np.sqrt(SPRING / MASS - (DAMPER / (2 * MASS)) ** 2)
    assert_allclose(locus.eigenvalues[:, 1], np.full(len(leaks), body), rtol=1e-9)


def test_a_response_sees_outputs_of_elements():
    system = lifted()
    jack = ElementSensor("jack", "jack")
    push = Channel("push", Marker("b"), (0, 0, 1))
    f = np.array([0.5, 3.0, 20.0])
    found = frequency_response(linearize(system, inputs=[push], outputs=[jack]), f)
    at = found.outputs.index("jack.force"), found.outputs.index("jack.p")
    A, b = jack_matrix(system.elements[0]), np.array([0, 1 / MASS, 0])
    x = np.array([np.linalg.solve(2j * np.pi * each * np.eye(3) - A, b) for each in f])
    assert_allclose(found.values[:, at[0], 0], 1e-3 * x[:, 2], rtol=1e-9)
    assert_allclose(found.values[:, at[1], 0], x[:, 2], rtol=1e-9)


def test_outputs_are_linear_in_places_and_velocities():
    system = lifted()
    ends = Marker(GROUND, position=(0, 0, -2)), Marker("b")
    spring = Spring("s", *ends, 50.0, 0.7, acts=("none", "force"), is_opposite=False)
    system = System(system.bodies, system.joints, system.forces, elements=[*system.elements, spring])
    linear = linearize(system, outputs=[ElementSensor("s", "s", "tension")])
    scale = linear.N[2, 0]
    assert_allclose(linear.L[0], [50 * scale, 0], rtol=1e-9, atol=1e-9)
    assert_allclose(linear.L_rate[0], [0.7 * scale, 0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("how", ["complex", "differences", "given", "Python, complex"])
def test_a_base_shakes_what_elements_hold_to_the_ground(how):
    ends = Marker(GROUND, position=(0, 0, -2)), Marker("b")
    rail = lifted().joints
    shaken = BaseMotion("shake", (0, 0, 1), rate=0, joints=("s",))
    found = []
    for parts in (
        {"elements": [Spring("s", *ends, 50.0, 0.7, how=how)]},
        {"forces": [SpringDamper("s", *ends, stiffness=50.0, damping=0.7)]},
    ):
        linear = linearize(System(lifted().bodies, rail, **parts), inputs=[shaken],
                           outputs=[Column(PlaceSensor("b", Marker("b"), "position"), "z")])  # fmt: skip
        found.append(frequency_response(linear, np.array([0.1, 1.0])).values)
    assert np.abs(found[1]).min() > 1e-3
    assert_allclose(found[0], found[1], rtol=1e-7)


def test_velocities_that_are_held_roll_a_disc_as_the_built_in_joint_does():
    joint = disc(joints=[RollingDisc("rim", Marker(GROUND), Marker("disc"), 0.8, axis=(0, 0, 1), axis_b=(0, 1, 0))])
    element = disc(elements=[Disc("rim", Marker("disc"), 0.8)])
    start = [consistent_state(system) for system in (joint, element)]
    assert_allclose(start[1].state.u, start[0].state.u, rtol=0, atol=1e-10)
    assert_allclose(start[1].u_dot, start[0].u_dot, rtol=0, atol=1e-8)
    plain = GeneralizedAlpha(0.9, 1e-11, stabilized=False)  # rates of positions that elements hold are not held
    motions = [integrate(system, plain, 0.5, 1e-3) for system in (joint, element)]
    assert_allclose(motions[1].body("disc").r, motions[0].body("disc").r, rtol=0, atol=1e-9)
    assert_allclose(motions[1].body("disc").p, motions[0].body("disc").p, rtol=0, atol=1e-9)
    force = motions[0].reaction("rim").force
    held = element_motion(element, motions[1], "rim").multipliers
    assert_allclose(np.abs(held["N"]), np.abs(force[:, 2]), rtol=0, atol=1e-5)


def test_the_tangent_of_velocities_that_are_held_is_exact():
    assert_tangent_is_exact(disc(elements=[Disc("rim", Marker("disc"), 0.8)]))
