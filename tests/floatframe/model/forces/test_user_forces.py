"""User forces: expressions, Python functions and jitted ones, with states."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    UserForce,
    integrate,
    linearize,
    system_modes,
)
from floatframe.analyses import named_state_space
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.entry import evaluate_and_linearize
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.integrators import EnergyMomentum
from floatframe.joints import AxialDistance, CoordinateCoupler, JointCoordinate, PointDistance
from floatframe.model.functions.time_functions import harmonic, table
from floatframe.model.state import State
from floatframe.results import user_force_motion
from floatframe.simulation import resume
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.forces.examples import HUB, J, pid, wheel
from tests.floatframe.model.functions.examples import EXPRESSIONS
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

METHOD = GeneralizedAlpha(0.9, 1e-11)


@njit
def nonlinear(t, x, v, z, Q, z_dot):
    Q[0] = -3.0 * x[0] + x[1] * v[0] + z[0]
    Q[1] = math.sin(x[0]) - v[1] * z[1] + t
    z_dot[0] = -z[0] * abs(z[0]) + x[0] * v[1]
    z_dot[1] = math.cos(z[0]) + x[1]


def plainly(t, x, v, z, Q, z_dot):
    nonlinear.py_func(t, x, v, z, Q, z_dot)


BY_EXPRESSIONS = {
    "forces": {"a": "-3*a + b*a_dot + p", "b": "sin(a) - b_dot*q + t"},
    "rates": {"p": "-p*abs(p) + a*b_dot", "q": "cos(p) + b"},
    "states": {"p": 0.4, "q": -0.3},
}
BY_FUNCTION = {"forces": ("a", "b"), "states": {"p": 0.4, "q": -0.3}}
WAYS = {
    "expressions": BY_EXPRESSIONS,
    "jitted": {**BY_FUNCTION, "function": nonlinear},
    "python": {**BY_FUNCTION, "function": plainly},
}


def two_bodies(way):
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3), interfaces=2)
    bodies = [
        FlexibleBody("first", flexible, omega_B=(0.3, -0.2, 0.5), velocity=(0.1, 0.3, -0.2)),
        RigidBody("second", 2.0, np.diag([1.0, 1.5, 2.0]), (0.1, -0.2, 0.3), omega_B=(-0.4, 0.2, 0.3)),
    ]
    a = Marker("first", "end_a", triad=turned_triad(4))
    b = Marker("second", position=(0.4, 0.2, -0.3), triad=turned_triad(5))
    hinge = RevoluteJoint("hinge", a, b, axis=(0.2, 1.0, 0.3))
    coordinates = {
        "a": JointCoordinate("hinge", "angle"),
        "b": AxialDistance(Marker("first", "end_b"), Marker("second"), (1, 0.2, 0)),
        "seen": PointDistance(Marker(GROUND, position=(3, 1, 0)), Marker("second")),
    }
    return System(bodies, [hinge], [Gravity((0.5, -1.0, -9.81)), UserForce("user", coordinates, **WAYS[way])])


@pytest.mark.parametrize("way", WAYS)
def test_newton_matrix_is_the_derivative_of_the_residual(way):
    def prepare(iterate):
        iterate.work.states.kappa[...], iterate.work.states.rho[...] = 0.3, 0.8

    tolerance = 4e-9 if way == "expressions" else 1e-6  # functions are differenced
    assert_tangent_is_exact(two_bodies(way), prepare=prepare, tolerance=tolerance)


def test_three_ways_to_write_a_force_give_one_motion():
    motions = [integrate(two_bodies(way), METHOD, 0.1, 1e-3) for way in WAYS]
    for motion in motions[1:]:
        assert_allclose(motion.body("second").r, motions[0].body("second").r, rtol=0, atol=1e-9)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_kernels_evaluate_an_expression_as_python_does(text):
    x, y, z = 1.3, 0.8, -0.6
    ends = Marker(GROUND), Marker("b")
    names = {name: AxialDistance(*ends, axis) for name, axis in zip("xyz", np.eye(3), strict=True)}
    force = UserForce("f", names, forces={"x": text}, parameters={"k": 2.5})
    system = System([RigidBody("b", 1.0, np.eye(3))], [], [force])
    model = compiled_system(system).model
    work = new_work(model)
    set_iterate(work, State(np.array([[x, y, z]]), np.array([[1.0, 0, 0, 0]]), np.zeros(0), np.zeros(6)))
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    known = {name: getattr(math, name) for name in dir(math)} | {"abs": abs, "min": min, "max": max, "pi": math.pi}
    known["sign"] = lambda value: float(np.sign(value))
    expected = eval(text.replace("^", "**"), known, {"x": x, "y": y, "z": z, "k": 2.5})
    assert_allclose(work.users.outputs[0], expected, rtol=1e-14, atol=1e-15)


def test_a_spring_by_expression_is_that_of_a_joint_force():
    plain = wheel(JointForce("s", "hub", "angle", stiffness=8.0, damping=0.6), 2.0)
    own = wheel(UserForce("s", HUB, {"phi": "-k*phi - c*phi_dot"}, parameters={"k": 8.0, "c": 0.6}), 2.0)
    first, second = (integrate(system, METHOD, 1.0, 1e-3) for system in (plain, own))
    assert_allclose(first.body("wheel").omega_B, second.body("wheel").omega_B, rtol=0, atol=1e-11)
    balance = second.energies.balance
    assert np.abs(balance - balance[0]).max() < 1e-5 * balance[0]


def test_a_line_of_force_is_that_of_a_spring():
    bodies = [RigidBody("b", 1.0, np.eye(3), position=(1.0, 0.5, 0), velocity=(0, 1.0, 0.3))]
    ends = Marker(GROUND), Marker("b", position=(0.1, 0.2, 0))
    spring = SpringDamper("s", *ends, stiffness=5.0, damping=0.3, free_length=0.4)
    own = UserForce("s", {"l": PointDistance(*ends)}, {"l": "-5*(l - 0.4) - 0.3*l_dot"})
    first, second = (integrate(System(bodies, [], [f]), METHOD, 1.0, 1e-3) for f in (spring, own))
    assert_allclose(first.body("b").r, second.body("b").r, rtol=0, atol=1e-10)
    assert_allclose(first.body("b").p, second.body("b").p, rtol=0, atol=1e-10)


def test_a_pid_drives_a_wheel_to_its_aim_against_a_load():
    """Beyond a full turn; the integral holds the constant load: ki e = T."""
    system = wheel([pid(), JointForce("load", "hub", "angle", preload=-6.0)])
    motion = integrate(system, METHOD, 12.0, 5e-3)
    control = user_force_motion(system, motion, "pid")
    assert_allclose(control.value["phi"][-1], 8.0, rtol=0, atol=1e-3)
    assert_allclose(control.states["e"][-1], -6.0 / 30.0, rtol=0, atol=1e-3)
    assert_allclose(control.force["phi"][-1], 6.0, rtol=0, atol=1e-2)
    assert_allclose(control.rate["phi"], motion.body("wheel").omega_B[:, 2], rtol=0, atol=1e-9)
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 1e-3 * motion.energies.kinetic.max()


@pytest.mark.parametrize("rho_inf", [0.0, 0.6, 0.9, 1.0])
def test_states_are_integrated_with_second_order(rho_inf):
    """The closed loop J phi'' = -kp phi - kd phi' - u, u' = (phi - u)/T against its matrix exponential."""
    from scipy.linalg import expm

    kp, kd, T, ku = 40.0, 1.0, 0.2, 25.0
    force = UserForce("loop", HUB, {"phi": "-kp*phi - kd*phi_dot - ku*u"}, {"u": "(phi - u)/T"}, {"u": 0.3},
                      {"kp": kp, "kd": kd, "ku": ku, "T": T})  # fmt: skip
    A = np.array([[0, 1, 0], [-kp / J, -kd / J, -ku / J], [1 / T, 0, -1 / T]])
    exact = expm(A) @ [0.0, 2.0, 0.3]
    steps, errors = [0.02, 0.01, 0.005, 0.0025], []
    for h in steps:
        system = wheel(force, 2.0)
        motion = integrate(system, GeneralizedAlpha(rho_inf, 1e-12), 1.0, h)
        found = user_force_motion(system, motion, "loop")
        errors.append(abs(found.states["u"][-1] - exact[2]) + abs(found.value["phi"][-1] - exact[0]))
    assert abs(slope(steps, errors) - 2) < 0.15


def test_states_are_right_with_steps_of_all_sizes():
    """Step control with rejected steps, against the same with small fixed ones."""
    system = wheel([pid(), JointForce("load", "hub", "angle", preload=-6.0)])
    method = GeneralizedAlpha(0.8, 1e-10, error_tolerance=1e-5)
    motion = integrate(system, method, 2.0, 0.05)
    exact = integrate(system, GeneralizedAlpha(0.8, 1e-10), 2.0, 1e-3)
    found, expected = (user_force_motion(system, each, "pid") for each in (motion, exact))
    assert_allclose(found.states["e"][-1], expected.states["e"][-1], rtol=0, atol=1e-3)
    assert_allclose(found.value["phi"][-1], expected.value["phi"][-1], rtol=0, atol=5e-3)


def test_a_filter_alone_follows_its_equation():
    """z' = (sin 3t - z)/T, seen by nothing; also a nonlinear one, z' = -z³: z = 1/sqrt(1 + 2 t)."""
    force = UserForce("filter", HUB, {}, {"z": "(s(t) - z)/T", "y": "-y^3"}, {"z": 0.0, "y": 1.0}, {"T": 0.3},
                      {"s": harmonic(1.0, 3.0)})  # fmt: skip
    system = wheel(force, 1.0)
    motion = integrate(system, METHOD, 2.0, 1e-3)
    t, w, T = motion.t, 3.0, 0.3
    exact = (np.sin(w * t) - w * T * (np.cos(w * t) - np.exp(-t / T))) / (1 + (w * T) ** 2)
    states = user_force_motion(system, motion, "filter").states
    assert_allclose(states["z"], exact, rtol=0, atol=1e-5)
    assert_allclose(states["y"], 1 / np.sqrt(1 + 2 * t), rtol=0, atol=1e-5)


def test_a_stiff_state_follows_in_one_step():
    """A filter of 1e-6 s is stable with steps of 1e-3 s."""
    force = UserForce("lag", HUB, {"phi": "-8*z"}, {"z": "(phi - z)/1e-6"}, {"z": 0.0})
    system = wheel(force, 2.0)
    motion = integrate(system, GeneralizedAlpha(0.6, 1e-10), 1.0, 1e-3)
    plain = integrate(
        wheel(JointForce("s", "hub", "angle", stiffness=8.0), 2.0), GeneralizedAlpha(0.6, 1e-10), 1.0, 1e-3
    )
    assert_allclose(motion.body("wheel").omega_B, plain.body("wheel").omega_B, rtol=0, atol=1e-3)


def test_a_table_in_an_expression_is_the_table():
    x = np.linspace(-3, 3, 13)
    hard = table(x, -(x**3))
    own = wheel(UserForce("s", HUB, {"phi": "f(phi)"}, functions={"f": hard}), 2.0)
    plain = wheel(JointForce("s", "hub", "angle", characteristic=hard), 2.0)
    first, second = (integrate(system, METHOD, 0.5, 1e-3) for system in (plain, own))
    assert_allclose(first.body("wheel").omega_B, second.body("wheel").omega_B, rtol=0, atol=1e-11)


def test_a_resumed_run_has_the_states_it_would_have_had(tmp_path):
    system = wheel([pid(), JointForce("load", "hub", "angle", preload=-6.0)])
    whole = integrate(system, METHOD, 3.0, 5e-3)

    class StoppedError(Exception):
        pass

    def stop(progress):
        if progress.n_steps >= 400:
            raise StoppedError

    with pytest.raises(StoppedError):
        integrate(system, METHOD, 3.0, 5e-3, output=tmp_path / "run.h5", progress=stop)
    again = resume(system, tmp_path / "run.h5")
    np.testing.assert_array_equal(again.source.read("w"), whole.source.read("w"))


def test_an_error_in_a_function_ends_the_run_with_its_words():
    def fails(t, x, v, z, Q, z_dot):
        if t > 0.05:
            raise ZeroDivisionError("the valve is stuck")
        Q[0] = 1.0

    system = wheel(UserForce("valve", HUB, ("phi",), function=fails))
    with pytest.raises(ModelError, match="force 'valve': its function raised ZeroDivisionError: the valve is stuck"):
        integrate(system, METHOD, 0.2, 1e-3)


def test_an_error_of_the_model_in_a_function_is_told_with_the_name_of_the_force():
    def fails(t, x, v, z, Q, z_dot):
        raise ModelError("the table ends here")

    with pytest.raises(ModelError, match="force 'u': its function raised ModelError: the table ends here"):
        integrate(wheel(UserForce("u", HUB, ("phi",), function=fails)), METHOD, 0.01, 1e-3)


def test_connections_are_told_with_their_kind():
    """A coupler is given among joints, and a spring among forces."""
    spring = SpringDamper("s", Marker(GROUND), Marker("wheel"), 1.0)
    coupler = CoordinateCoupler("c", [(HUB["phi"], 1.0)], harmonic(0.1, 2.0))
    system = wheel([spring, UserForce("u", HUB, {"phi": "0"})])
    compiled = compiled_system(replace(system, joints=[*system.joints, coupler]))
    told = sorted(compiled.connection_words(c) for c in range(len(compiled.connection_names)))
    assert told == ["force 's'", "force 'u'", "joint 'c'", "joint 'hub'"]


@pytest.mark.parametrize("made", [lambda function: function, njit], ids=["python", "numba"])
def test_a_function_that_returns_its_force_is_refused(made):
    """Nobody would read what it returns, and the motion would be one without the force."""

    def returns(t, x, v, z, Q, z_dot):
        return -100.0 * x[0]

    with pytest.raises(ModelError, match=r"force 'u': its function\(.*\) returns a value \(float(64)?\), which has no"):
        integrate(wheel(UserForce("u", HUB, ("phi",), function=made(returns))), METHOD, 0.01, 1e-3)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize("method", [METHOD, EnergyMomentum()], ids=["generalized-alpha", "conserving"])
@pytest.mark.parametrize("kind", ["python", "numba", "expression"])
def test_a_force_that_becomes_no_number_is_named(kind, method):
    def ends(t, x, v, z, Q, z_dot):
        Q[0] = np.sqrt(0.0205 - t)

    force = {
        "python": UserForce("u", HUB, ("phi",), function=ends),
        "numba": UserForce("u", HUB, ("phi",), function=njit(ends)),
        "expression": UserForce("u", HUB, {"phi": "sqrt(0.0205 - t)"}),
    }[kind]
    with pytest.raises(ConvergenceError, match="force 'u' is not finite") as error:
        integrate(wheel(force), method, 0.1, 1e-3)
    assert error.value.trajectory.t[-1] == pytest.approx(0.02)


def test_an_interrupt_in_a_function_passes_through():
    def interrupted(t, x, v, z, Q, z_dot):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(wheel(UserForce("u", HUB, ("phi",), function=interrupted)), METHOD, 0.2, 1e-3)


def test_a_jitted_function_that_does_not_fit_is_refused():
    @njit
    def wrong(t, x):
        return x

    with pytest.raises(ModelError, match="its function cannot be compiled as function"):
        _ = compiled_system(wheel(UserForce("u", HUB, ("phi",), function=wrong)))


def test_control_with_states_is_linearised_with_its_states():
    linear = linearize(wheel(pid()))
    A = np.array([[0, 1, 0], [-40 / J, -4 / J, -30 / J], [1, 0, 0]])
    assert linear.states == ("pid.e",)
    assert_allclose(named_state_space(linear).A, A, rtol=0, atol=1e-12 * np.abs(A).max())
    exact = np.linalg.eigvals(A)
    exact = exact[exact.imag >= 0]
    found = system_modes(linear).eigenvalues
    assert_allclose(found, exact[np.argsort(np.abs(exact))], rtol=1e-10)


def test_a_state_that_does_not_stand_is_not_linearised():
    system = wheel([pid(), JointForce("load", "hub", "angle", preload=-6.0)])
    with pytest.raises(ModelError, match=r"state 'pid\.e' is not at rest: its rate is -0\.15"):
        linearize(system)  # with e = 0 at the start the wheel stands where -40 phi = 6


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: UserForce("u", {}), "coordinates: expected a dict with at least one coordinate"),
        (lambda: UserForce("u", {"phi": 3}), "coordinates: phi: expected a coordinate of a joint"),
        (lambda: UserForce("u", {"a b": HUB["phi"]}, {}), "expected a name of letters, digits and _, got 'a b'"),
        (lambda: UserForce("u", {"sin": HUB["phi"]}, {}), "the name 'sin' is used twice, or is the name of a function"),
        (lambda: UserForce("u", HUB, {"psi": "1"}), "no coordinate 'psi'; choices: phi"),
        (lambda: UserForce("u", HUB, {}), "expected forces or states, got none"),
        (lambda: UserForce("u", HUB, {}, {"e": "phi"}), "a rate and an initial value for each state"),
        (lambda: UserForce("u", HUB, {"phi": "1"}, function=nonlinear), "with a function, forces names coordinates"),
        (lambda: UserForce("u", HUB, ("phi",)), "expected expressions by coordinate, or a function"),
        (lambda: UserForce("u", HUB, {"phi": "1"}, functions={"f": np.sin}), "functions: f: expected a function of"),
        (
            lambda: compiled_system(wheel(UserForce("u", HUB, {"phi": "-k*phi"}))),
            "forces: phi: unknown name 'k' at column 2",
        ),
        (
            lambda: compiled_system(wheel(UserForce("u", HUB, {"phi": "e"}, {"e": "1+"}, {"e": 0.0}))),
            "rates: e: .* not an exp",
        ),
    ],
)  # fmt: skip
def test_impossible_user_forces_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()
