"""Jumps inside elements, controllers and user forces: every step that one lies in is cut there, by every method."""

import logging
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    UserForce,
    integrate,
)
from floatframe.components import drives
from floatframe.components.hydraulics import components
from floatframe.errors import ModelError
from floatframe.integrators import EnergyMomentum, Ida, RelativeOde
from floatframe.joints import JointCoordinate
from floatframe.model.elements import Element, ElementLaw
from floatframe.model.elements.expressions import ExpressionElement
from floatframe.model.functions.tables import linear_table
from floatframe.model.functions.time_functions import constant, harmonic, piecewise
from floatframe.simulation.jumps import jump_times
from floatframe.simulation.step_advice import knot_words

FIRST, LAST, SIZE = 0.0131, 0.0161, 100.0  #: of the pulse
MASS, H, END = 2.0, 0.02, 0.1
SPEED = SIZE * (LAST - FIRST) / MASS

METHODS = {
    "default": (GeneralizedAlpha(0.8), None),
    "controlled": (GeneralizedAlpha(0.8, error_tolerance=1e-8), None),
    "conserving": (EnergyMomentum(), None),
    "ida": (Ida(rtol=1e-7, atol=1e-9), None),
    "relative": (GeneralizedAlpha(0.8), "relative"),
    "ode": (RelativeOde("BDF"), "relative"),
}
method_of = pytest.mark.parametrize(("method", "formulation"), METHODS.values(), ids=METHODS)


def pulse(size=SIZE, t=(FIRST, LAST)):
    return piecewise([-1.0, *t], [constant(0.0), constant(size), constant(0.0)])


def on_rail(forces=(), elements=()):
    """A box on a rail, off the origin, along an oblique axis."""
    axis = np.array([1.0, 2.0, -2.0]) / 3
    box = RigidBody("box", MASS, np.diag([1.0, 2.0, 3.0]), position=(5.0, -3.0, 2.0))
    rail = PrismaticJoint("rail", Marker(GROUND, position=(5.0, -3.0, 2.0)), Marker("box"), axis=axis)
    return System([box], [rail], list(forces), elements=list(elements))


def speed_along(motion):
    return float(motion.body("box").v[-1] @ np.array([1.0, 2.0, -2.0]) / 3)


def user_force(text, **given):
    return on_rail([UserForce("push", {"x": JointCoordinate("rail", "distance")}, {"x": text}, **given)])


@njit
def switched_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    if data[0] <= t < data[1]:
        for k in range(3):
            wrench[0, k] = data[2] * x[0, 3 + 3 * k]


@dataclass(frozen=True, eq=False)
class Thruster(Element):
    """A force along the x axis of a marker between two times, which its law alone knows."""

    name: str
    marker: Marker
    says_when: bool = True

    def law(self, placed):
        knots = (FIRST, LAST) if self.says_when else ()
        return ElementLaw(function=switched_law, data=[FIRST, LAST, SIZE], acts=["force"], knots=knots)


def switched_function(t, x, v, z, Q, z_dot):
    Q[0] = SIZE if FIRST <= t < LAST else 0.0


def thruster():
    axis = np.array([1.0, 2.0, -2.0]) / 3
    across = np.cross(axis, [0, 0, 1.0]) / np.linalg.norm(np.cross(axis, [0, 0, 1.0]))
    triad = np.column_stack([axis, across, np.cross(axis, across)])
    return on_rail(elements=[Thruster("push", Marker("box", position=np.zeros(3), triad=triad))])


def expression_element():
    places = {"a": Marker(GROUND, position=(5.0, -3.0, 2.0)), "b": Marker("box", position=np.zeros(3))}
    terms = {"late": "2*t - 0.0262", "on": "1 if late >= 0 else 0"}
    forces = {f"b_F{c}": f"100*on*(t < 0.0161)*({e})" for c, e in (("x", "1/3"), ("y", "2/3"), ("z", "-2/3"))}
    return on_rail(elements=[ExpressionElement("push", places, forces, terms=terms)])


LAWS = {
    "table of t": lambda: user_force("f(t)", functions={"f": pulse()}),
    "table of 3 t": lambda: user_force("f(3*t)", functions={"f": pulse(t=(3 * FIRST, 3 * LAST))}),
    "comparison": lambda: user_force(
        "100*(t >= 0.0131)*(t < 0.0161)"
    ),
    "sign": lambda: user_force("50*(sign(t - 0.0131) - sign(t**3 - 0.0161**3))"),
    "expression element": expression_element,
    "knots of a law": thruster,
    "knots of a function": lambda: on_rail(
        [UserForce("push", {"x": JointCoordinate("rail", "distance")}, ["x"], function=switched_function,
                   knots=(FIRST, LAST))]
    ),
}  # fmt: skip


@pytest.mark.parametrize("make", LAWS.values(), ids=LAWS)
def test_a_pulse_in_a_law_keeps_its_impulse(make):
    """Both jumps lie in one step of 20 ms."""
    for h in (H, 3e-3):
        assert_allclose(speed_along(integrate(make(), GeneralizedAlpha(0.8), END, h)), SPEED, rtol=1e-6)


#: expressions that jump where no comparison stands, and when they do
JUMPING = {
    "min(3, max(-3, tan(40*(t - 0.0131) + pi/2)))": [0.0131, 0.0131 + np.pi / 40],
    "min(3, max(-3, 0.01/(t - 0.0131)))": [0.0131],
    "min(3, max(-3, 0.01/(0.0131 - t)))": [0.0131],
    "atan(0.002/(t - 0.0131))": [0.0131],
    "atan2(0.0131 - t, -0.1 - t)": [0.0131],
    "atan2(sin(60*t), cos(60*t))": [np.pi / 60],
}


@pytest.mark.parametrize("text", JUMPING)
def test_cuts_of_atan2_poles_of_tan_and_of_quotients_end_steps(text):
    """The impulse beside a quadrature that knows where the expression jumps. Steps over a kink err by h²."""
    own = {name: getattr(np, name) for name in ("sin", "cos", "tan", "pi")}
    own |= {"min": min, "max": max, "atan": np.arctan, "atan2": np.arctan2}
    ends = [0.0, *JUMPING[text], END]
    impulse = sum(
        quad(lambda t: eval(text, own | {"t": t}), a, b, epsabs=1e-10, limit=200)[0] for a, b in pairwise(ends)
    )
    motion = integrate(user_force(text), GeneralizedAlpha(0.8), END, 5e-4)
    assert_allclose(MASS * speed_along(motion), impulse, rtol=0, atol=8e-5)


@pytest.mark.parametrize("text", ["tan(40*t)", "1/(0.0131 - t)", "1e-9*tan(40*t)", "min(5, tan(40*t))"])
def test_an_expression_that_grows_without_bound_is_refused(text):
    with pytest.raises(ModelError, match=r"forces.push: an expression grows without bound near t = 0\.0"):
        integrate(user_force(text), GeneralizedAlpha(0.8), END, H)


@pytest.mark.parametrize(
    ("method", "formulation"), [m for k, m in METHODS.items() if k != "ida"]
)  # knows no user force
def test_a_pulse_keeps_its_impulse_by_every_method(method, formulation):
    system = user_force("f(t)", functions={"f": pulse()})
    assert_allclose(speed_along(integrate(system, method, END, H, formulation=formulation)), SPEED, rtol=1e-6)


@method_of
def test_a_controller_follows_a_target_that_jumps(method, formulation):
    """m v' = k (target - v): v = target (1 - exp(-k t/m)) in the pulse, which decays after it."""
    axis = (1 / 3, 2 / 3, -2 / 3)
    pid = drives.PidDrive(
        "pid", Marker(GROUND, position=(5.0, -3.0, 2.0)), Marker("box"),
        controller=drives.Pid(target=pulse(3.0), kp=40.0), controlled="rate", axis=axis,
    )  # fmt: skip
    rate = 40.0 / MASS
    expected = 3.0 * -np.expm1(-rate * (LAST - FIRST)) * np.exp(-rate * (0.04 - LAST))
    motion = integrate(on_rail(elements=[pid]), method, 0.04, 1e-3, formulation=formulation)
    assert_allclose(speed_along(motion), expected, rtol=1e-3)


@pytest.mark.parametrize(("method", "formulation"), [m for k, m in METHODS.items() if k != "ida"])  # knows no states
def test_a_motor_runs_up_from_when_its_supply_jumps(method, formulation):
    """L i' = u - R i - k w, J w' = k i, beside SciPy from the jump on."""
    R, L, k, J, begin, end = 0.5, 1e-2, 0.05, 1e-3, 0.0137, 0.06
    supply = piecewise([0.0, begin], [constant(0.0), constant(24.0)])
    motor = drives.DcMotor("m", Marker(GROUND, position=(1, 2, 3)), Marker("rotor"), resistance=R, inductance=L,
                           constant=k, voltage=supply)  # fmt: skip
    rotor = RigidBody("rotor", 1.0, np.diag([J, J, J]), position=(1, 2, 3))
    system = System([rotor], [RevoluteJoint("hinge", Marker(GROUND, position=(1, 2, 3)), Marker("rotor"))],
                    elements=[motor])  # fmt: skip
    exact = solve_ivp(lambda t, y: [(24.0 - R * y[0] - k * y[1]) / L, k * y[0] / J], (begin, end), [0.0, 0.0],
                      rtol=1e-10, atol=1e-10).y[1, -1]  # fmt: skip
    motion = integrate(system, method, end, 2e-3, formulation=formulation)
    assert_allclose(motion.body("rotor").omega_B[-1, 2], exact, rtol=2e-3)


@pytest.mark.parametrize("method", [GeneralizedAlpha(0.8), EnergyMomentum()], ids=str)
def test_a_current_that_settles_in_less_than_a_step_keeps_its_impulse(method):
    """It settles in 0.1 ms; a pulse of 3 ms in one step of 20 ms, and beside the ends of steps of 10 ms."""
    hinge = RevoluteJoint("hinge", Marker(GROUND, position=(1, 2, 3)), Marker("rotor"))
    rotor = RigidBody("rotor", 1.0, np.eye(3), position=(1, 2, 3))
    motor = drives.DcMotor("m", Marker(GROUND, position=(1, 2, 3)), Marker("rotor"), resistance=1.0, inductance=1e-4,
                           constant=1.0, voltage=pulse())  # fmt: skip
    u, y = SIZE, np.zeros(2)
    for begin, end in ((FIRST, LAST), (LAST, END)):
        y = solve_ivp(lambda t, y, u=u: [(u - y[0] - y[1]) / 1e-4, y[0]], (begin, end), y, method="Radau",
                      rtol=1e-9, atol=1e-12).y[:, -1]  # fmt: skip
        u = 0.0
    for h in (H, 0.01, 0.0043):
        motion = integrate(System([rotor], [hinge], elements=[motor]), method, END, h)
        assert_allclose(motion.body("rotor").omega_B[-1, 2], y[1], rtol=2e-3)
        assert not motion.validity


def test_jumps_are_found_in_whatever_holds_a_function_of_time():
    """In components of circuits, controllers of drives and motors of joints; not in tables over a way."""
    valve = components.Orifice("valve", "p", "q", area=1e-5, opening=pulse(1.0, (0.2, 0.3)))

    @dataclass(frozen=True, eq=False)
    class Circuit(Element):
        name: str
        parts: tuple

    pid = drives.PidDrive("pid", Marker(GROUND), Marker("box"), drives.Pid(target=pulse(1.0, (0.5, 0.6)), kp=1.0))
    forces = [
        JointForce("push", "rail", "distance", motor=pulse(1.0, (0.1, 0.4)), characteristic=pulse(1.0, (0.77, 0.78))),
        UserForce("user", {"x": JointCoordinate("rail", "distance")}, {"x": "f(x) + x*(x < 0.3)"},
                  functions={"f": pulse()}),
    ]  # fmt: skip
    system = on_rail(forces, [pid])
    assert jump_times(system, 0.0, 0.1, 10) == [0.1, 0.4, 0.5, 0.6]
    assert jump_times(system, 0.1, 0.1, 4) == [0.4, 0.5]

    from floatframe.engine.compiling.time_laws import functions_in

    held = Circuit("circuit", (valve,))
    (found,) = functions_in(held, "elements.circuit", False, held, "")
    assert found.where == "elements.circuit.parts.valve.opening"
    assert_allclose(found.function.jumps(0)[0], [0.2, 0.3])


def test_a_square_wave_is_cut_at_every_edge():
    """sign(sin(w t)) of 35 edges: the speed is the sum of its halves."""
    system = user_force("7*sign(sin(w*t))", parameters={"w": 50 * np.pi})
    times = jump_times(system, 0.001, 0.0073, 96)
    assert_allclose(times, 0.02 * np.arange(1, 36), rtol=1e-12)
    assert 0.0 < jump_times(system, 0.0, 0.0073, 96)[0] < 1e-30  # the sign of the sine is 0 at t = 0 alone
    motion = integrate(system, GeneralizedAlpha(0.8), 0.69, 0.0073)
    assert_allclose(speed_along(motion), 7 * 0.01 / MASS, rtol=1e-5)


def test_jumps_that_are_cut_are_not_told_as_knots_that_steps_pass_over():
    system = on_rail([PointForce("blow", Marker("box"), (1, 0, 0), amplitude=pulse())])
    assert knot_words(system, 0.0, H, 5) == ()
    saw = linear_table(np.linspace(0, 0.1, 21), np.arange(21) % 2)
    pushed = user_force("f(t)", functions={"f": pulse()})
    assert knot_words(pushed, 0.0, H, 5) == ()
    (words,) = knot_words(on_rail([PointForce("saw", Marker("box"), (1, 0, 0), amplitude=saw)]), 0.0, H, 5)
    assert "forces.saw.amplitude: steps of 0.02 pass over 14 of the 19 knots" in words


def test_a_run_from_a_jump_takes_the_value_after_it():
    """The run begins at the edge of the pulse: its acceleration and its rate are those after it."""
    for make in (LAWS["table of t"], thruster):
        motion = integrate(make(), GeneralizedAlpha(0.8), END, 1e-3, t_start=FIRST)
        assert_allclose(speed_along(motion), SPEED, rtol=1e-6)


def test_a_smooth_supply_is_not_cut():
    system = user_force("f(t)", functions={"f": harmonic(1.0, 3.0)})
    assert jump_times(system, 0.0, 0.1, 10) == []


def unsaid_function(t, x, v, z, Q, z_dot):
    Q[0] = (1.0 + x[0] ** 2) * (SIZE if t >= 0.0131 else 0.0)


def smooth_function(t, x, v, z, Q, z_dot):
    Q[0] = SIZE * np.sin(2 * np.pi * t / 0.1) * (1 + t)


def by_function(function, **given):
    return on_rail([UserForce("push", {"x": JointCoordinate("rail", "distance")}, ["x"], function=function, **given)])


UNSAID = {
    "function": (lambda: by_function(unsaid_function), "forces.push"),
    "compiled function": (lambda: by_function(njit(unsaid_function)), "forces.push"),
    "law": (
        lambda: on_rail(elements=[Thruster("push", Marker("box", position=np.zeros(3)), says_when=False)]),
        "elements.push",
    ),
}


@pytest.mark.parametrize(("make", "where"), UNSAID.values(), ids=UNSAID)
@pytest.mark.parametrize(("method", "formulation"), [METHODS["default"], METHODS["ode"]], ids=["default", "ode"])
def test_a_jump_that_no_law_declares_is_told_once(make, where, method, formulation, caplog):
    """The jump at 13.1 ms lies in the step from 10 ms, in the second of its halves."""
    with caplog.at_level(logging.WARNING):
        integrate(make(), method, END, 5e-3, formulation=formulation)
    told = [record.getMessage() for record in caplog.records if "jumps with time" in record.getMessage()]
    assert len(told) == 1
    assert f"{where}: its function jumps with time, or varies fast, inside the step of 0.005 from t = 0.01," in told[0]


@pytest.mark.parametrize(
    "make",
    [
        lambda: by_function(unsaid_function, knots=(0.0131,)),
        lambda: by_function(smooth_function),
        thruster,
        lambda: user_force("f(t)", functions={"f": pulse()}),
    ],
    ids=["knots of a function", "smooth", "knots of a law", "table"],
)
def test_what_is_declared_or_smooth_is_not_told(make, caplog):
    with caplog.at_level(logging.WARNING):
        integrate(make(), GeneralizedAlpha(0.8), END, 5e-3)
    assert not [record for record in caplog.records if "jumps with time" in record.getMessage()]
