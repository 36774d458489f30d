"""The example integrators converge at their orders to our own solutions; scipy on the underlying equation too."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import floatframe as ff
from floatframe.components.mechanisms import pendulum
from floatframe.engine.open_equations import open_equations, radau, rattle
from floatframe.model.rotations import rotation_matrix
from tests.floatframe.orders import slope


def swung(n=2):
    """Return n links on each other, frames in their centres of mass, let go from rest: a plane motion."""
    bodies, joints, end, on = [], [], np.zeros(3), ff.Marker(ff.GROUND)
    for k, angle in enumerate((0.3, -0.4, 0.5)[:n]):
        arm = 0.5 * np.array([np.cos(angle), np.sin(angle), 0.0])
        bodies.append(ff.RigidBody(f"link {k}", 1.0 + k, (0.1 + 0.05 * k) * np.eye(3), position=end + arm))
        joints.append(ff.RevoluteJoint(f"pin {k}", on, ff.Marker(f"link {k}", position=-arm)))
        end, on = end + 2 * arm, ff.Marker(f"link {k}", position=arm)
    return ff.System(bodies, joints, [ff.Gravity((0.0, -9.81, 0.0))])


def ends_of_our_own(system, t_end, h):
    """Return x, v and the mean wrenches at the end of a motion of our own, extrapolated from two step sizes."""
    eq = open_equations(system)
    found = []
    for n in (1, 2):
        motion = ff.integrate(system, ff.GeneralizedAlpha(0.9, tolerance=1e-13), t_end, h / n)
        bodies = [motion.body(name) for name in motion.body_names]
        state = ff.State(
            np.array([b.r[-1] for b in bodies]), np.array([b.p[-1] for b in bodies]), np.zeros(0),
            np.concatenate([np.concatenate([b.v[-1], b.omega_B[-1]]) for b in bodies]),
        )  # fmt: skip
        found.append(eq.vectors(state))
    (x_1, v_1), (x_2, v_2) = found
    correction = eq.configurations.difference(x_1, x_2) / 3  # second order
    return eq.configurations.retract(x_2, correction), v_2 + (v_2 - v_1) / 3


def test_radau_is_of_fifth_order_to_our_own_solution():
    system, t_end = swung(), 0.3
    eq = open_equations(system)
    x, v, _, _ = eq.start()
    x_end, v_end = ends_of_our_own(system, t_end, 4e-4)
    lam_end = eq.accelerations(t_end, x_end, v_end)[1]
    steps, errors, of_lam = np.array([6, 8, 11, 15]), [], []
    for n in steps:
        X, V, L = radau(eq, x, v, np.linspace(0, t_end, n + 1))
        difference = eq.configurations.difference(x_end, X[-1])
        errors.append(np.linalg.norm(np.concatenate([difference, V[-1] - v_end])))
        of_lam.append(np.linalg.norm(L[-1] - lam_end))
    assert slope(1 / steps, errors) == pytest.approx(5, abs=0.4)
    assert slope(1 / steps, of_lam) == pytest.approx(5, abs=0.4)


def test_rattle_is_of_second_order_to_our_own_solution():
    system, t_end = swung(), 0.4
    eq = open_equations(system)
    x, v, _, _ = eq.start()
    x_end, v_end = ends_of_our_own(system, t_end, 4e-4)
    steps, errors = np.array([20, 28, 40]), []
    for n in steps:
        X, V = rattle(eq, x, v, np.linspace(0, t_end, n + 1))
        difference = eq.configurations.difference(x_end, X[-1])
        errors.append(np.linalg.norm(np.concatenate([difference, V[-1] - v_end])))
        assert_allclose(eq.constraint(t_end, X[-1]), 0, rtol=0, atol=1e-12)
        assert_allclose(eq.velocity_defect(t_end, X[-1], V[-1]), 0, rtol=0, atol=1e-11)
    assert slope(1 / steps, errors) == pytest.approx(2, abs=0.15)


def test_rattle_keeps_the_energy_bounded_over_many_swings():
    """The energy of a pendulum swings with the step squared and does not drift: four spans are like one."""
    eq = open_equations(swung(1))
    x, v, _, _ = eq.start()
    energy = energy_of(eq, *rattle(eq, x, v, np.arange(201) * 0.04))
    one = np.ptp(energy[:51])
    assert 1e-4 < one < 0.2
    assert np.ptp(energy) < 1.1 * one


def energy_of(eq, X, V):
    """Return kinetic energy and weight over time."""
    masses = [body.mass for body in eq.system.bodies]
    heights = np.array([[x[j + 1] for j, _, _ in eq.configurations.parts()] for x in X])
    return np.array([eq.energy(x, v) for x, v in zip(X, V, strict=True)]) + 9.81 * heights @ masses


def test_radau_on_a_turning_body_keeps_energy_and_momentum_to_its_order():
    """A free top of three moments: energy of a motion on the group, where nothing else loses or gives any."""
    body = ff.RigidBody("top", 2.0, np.diag([1.0, 2.0, 2.5]), omega_B=(0.3, 2.0, 0.1))
    eq = open_equations(ff.System([body]))
    x, v, _, _ = eq.start()
    steps, errors = np.array([6, 8, 12]), []
    for n in steps:
        X, V, _ = radau(eq, x, v, np.linspace(0, 3.0, n + 1))
        errors.append(abs(eq.energy(X[-1], V[-1]) - eq.energy(x, v)))
        assert_allclose(np.linalg.norm(X[-1][3:7]), 1.0, rtol=1e-14)
    assert slope(1 / steps, errors) > 4.6
    assert errors[-1] < 1e-4 * eq.energy(x, v)


def test_scipy_solves_the_underlying_equation():
    system, t_end = swung(), 0.2
    eq = open_equations(system)
    x, v, _, _ = eq.start()
    found = solve_ivp(eq.ordinary, (0, t_end), np.concatenate([x, v]), method="DOP853", rtol=1e-9, atol=1e-9)
    X, V, _ = radau(eq, x, v, np.linspace(0, t_end, 9))
    assert_allclose(eq.configurations.difference(found.y[: eq.n_x, -1], X[-1]), 0, rtol=0, atol=1e-8)
    assert_allclose(found.y[eq.n_x :, -1], V[-1], rtol=0, atol=1e-7)


def test_scipy_gives_the_period_of_a_pendulum():
    """A physical pendulum of 90 degrees: quarter period from the complete elliptic integral."""
    from scipy.special import ellipk

    system = pendulum(length=1.0, mass=1.0, angle=0.0)
    eq = open_equations(system)
    x, v, _, _ = eq.start()
    index = eq.layout.index("v", "rod 1", "omega z")
    J_end = 1 / 3 + 1.0 * 0.01**2 / 4  # slender rod of thickness 0.02
    omega0 = np.sqrt(9.81 * 0.5 / J_end)
    quarter = ellipk(np.sin(np.pi / 4) ** 2) / omega0
    found = solve_ivp(eq.ordinary, (0, quarter), np.concatenate([x, v]), method="DOP853", rtol=1e-10, atol=1e-10)
    speed = found.y[eq.n_x + index, -1]
    assert_allclose(abs(speed), np.sqrt(2) * omega0, rtol=1e-8)  # energy: J w²/2 = m g L/2
    y = np.concatenate([found.y[: eq.n_x, -1], found.y[eq.n_x :, -1]])
    tip = rotation_matrix(y[3:7]) @ [1.0, 0, 0]
    assert_allclose(tip, [0.0, -1.0, 0.0], rtol=0, atol=1e-8)  # hangs straight down then


def test_rattle_refuses_a_turning_body():
    body = ff.RigidBody("top", 2.0, np.diag([1.0, 2.0, 2.5]), omega_B=(0.3, 2.0, 0.1))
    eq = open_equations(ff.System([body], forces=[ff.Gravity((0, 0, -1.0))]))
    x, v, _, _ = eq.start()
    with pytest.raises(ff.errors.ModelError, match="forces that do not depend on velocities"):
        rattle(eq, x, v, np.linspace(0, 0.1, 3))


def test_velocity_constraints_of_rolling_are_integrated():
    """A disc that rolls straight: its place follows its turn, from velocity rows alone."""
    disc = ff.RigidBody(
        "disc", 1.0, np.diag([0.05, 0.1, 0.05]), position=(0, 0, 0.4), velocity=(0.8, 0, 0), omega_B=(0, 2.0, 0)
    )
    rolls = ff.joints.RollingDisc("rolls", ff.Marker(ff.GROUND), ff.Marker("disc"), radius=0.4)
    eq = open_equations(ff.System([disc], [rolls], [ff.Gravity((0, 0, -9.81))]))
    assert list(eq.is_holonomic) == [True, False, False]
    x, v, _, _ = eq.start()
    X, V, L = radau(eq, x, v, np.linspace(0, 0.5, 6))
    assert_allclose(X[-1][:3], [0.4, 0, 0.4], rtol=0, atol=1e-9)
    assert_allclose(np.abs(eq.wrenches(0.5, X[-1], V[-1], L[-1])[2]), 9.81, rtol=1e-8)
