"""Elements of expressions beside built-in forces."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, Gravity, Marker, RigidBody, System, integrate
from floatframe.analyses import check_element
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.forces import Bushing
from floatframe.model.elements.expressions import ExpressionElement
from floatframe.model.functions.time_functions import harmonic
from floatframe.results import element_motion, point_motion
from floatframe.results.energy_balance import balance_defect, energy_scale
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.elements.expression_element_examples import as_expressions
from tests.floatframe.model.elements.public_elements_examples import METHOD, built_in, places


def test_springs_by_expressions_move_as_the_built_in_ones():
    by_text, oracle = (integrate(system, METHOD, 0.1, 1e-3) for system in (as_expressions(), built_in()))
    assert_allclose(places(by_text), places(oracle), rtol=0, atol=1e-12)
    assert np.abs(balance_defect(by_text) - balance_defect(oracle)).max() < 1e-11 * energy_scale(oracle)


def turning(element=None, forces=()):
    bodies = [
        RigidBody("a", 2.0, np.diag([0.1, 0.2, 0.25]), position=(1, 0, 0), omega_B=(1, 2, 3)),
        RigidBody("b", 1.0, np.diag([0.1, 0.2, 0.25]), position=(1.2, 0.3, 0), omega_B=(1, -2, 3)),
    ]
    return System(bodies, forces=[Gravity((0, 0, -9.81)), *forces], elements=[element] if element else [])


MOMENTS = {
    **{f"b_M{axis}": f"-k*b_r{axis} - c*b_w{axis}" for axis in "xyz"},
    **{f"b_F{axis}": f"-q*b_{axis} + u*sin(t)" for axis in "xyz"},
}


def test_the_tangent_of_expressions_is_exact_for_large_turns():
    element = ExpressionElement(
        "e", {"a": Marker("a"), "b": Marker("b")}, MOMENTS, {"u": 0.3}, {"u": "atan2(b_vx, -1 - u^2) + f(b_y)"},
        parameters={"k": 3.0, "c": 0.2, "q": 5.0}, functions={"f": harmonic(0.2, 3.0)},
    )  # fmt: skip

    def prepare(iterate):
        iterate.work.states.kappa[...], iterate.work.states.rho[...] = 0.3, 0.8

    assert_tangent_is_exact(turning(element), prepare=prepare, tolerance=1e-8)
    assert check_element(turning(element), "e").findings == ()


def test_what_acts_on_all_markers_balances():
    """Forces across the line of the markers too: momentum and angular momentum of free bodies stay."""
    element = ExpressionElement(
        "e",
        {"a": Marker("a", position=(0.1, 0.2, 0)), "b": Marker("b")},
        {"b_Fx": "3*b_y", "b_Fz": "1 + b_vx", "b_My": "2"},
    )
    system = replace(turning(element), forces=())
    motion = integrate(system, METHOD, 0.05, 1e-3)
    wrench = element_motion(system, motion, "e").wrench
    arms = [point_motion(motion, name, place).position for name, place in (("a", (0.1, 0.2, 0)), ("b", (0, 0, 0)))]
    assert np.abs(wrench[:, 1, :3]).max() > 1
    assert_allclose(wrench[:, :, :3].sum(axis=1), 0, atol=1e-12)
    moments = sum(wrench[:, m, 3:] + np.cross(arms[m], wrench[:, m, :3]) for m in range(2))
    assert_allclose(moments, 0, atol=1e-12)


def test_a_turning_spring_is_a_bushing_for_small_turns():
    """The rotation vector of a bushing against that of the element: equal; the moments differ by its second order."""
    ends = Marker("a"), Marker("b")
    stiffness = np.diag([0, 0, 0, 3.0, 3.0, 3.0])
    bushing = turning(forces=[Bushing("e", *ends, stiffness=stiffness)])
    element = ExpressionElement("e", {"a": ends[0], "b": ends[1]}, {f"b_M{x}": f"-3*b_r{x}" for x in "xyz"})
    h = 1e-3
    found, exact = (integrate(system, METHOD, 20 * h, h).body("b").omega_B for system in (turning(element), bushing))
    assert_allclose(found, exact, rtol=0, atol=1e-6)
    assert np.abs(exact - exact[0]).max() > 1e-3


def test_a_system_file_holds_expressions(tmp_path):
    (tmp_path / "s.toml").write_text("""
[system]
units = "m-kg-s"
[bodies.b]
mass = 2.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [0, 0, 0.1]
[elements.e]
type = "elements.expressions"
places.ground = {body = "ground", marker = [0, 0, 0]}
places.b = {body = "b", marker = [0, 0, 0]}
forces = {b_Fz = "-k*b_z - p(t)*0 - z"}
states = {z = 0.0}
rates = {z = "(b_z - z)/T"}
parameters = {k = 50.0, T = 0.1}
outputs = {stretch = "b_z"}
output_units = {stretch = "m"}
functions.p = {type = "harmonic", amplitude = 1.0, omega = 3.0}
[sensors.e]
type = "element"
of = "e"
[run]
t_end = 0.2
h = 1e-3
""")
    system, run = read_system(tmp_path / "s.toml")
    motion = integrate(system, METHOD, run.t_end, run.h)
    seen = element_motion(system, motion, "e")
    assert_allclose(seen.outputs["stretch"], motion.body("b").r[:, 2], rtol=0, atol=1e-15)
    assert_allclose(motion.body("b").v_dot[:, 2], (-50 * seen.outputs["stretch"] - seen.states["z"]) / 2, atol=1e-9)


def run_with(text, **terms):
    element = ExpressionElement("e", PAIR, {"b_Fx": text}, terms=terms)
    return integrate(System([RigidBody("b", 1.0, np.eye(3))], elements=[element]), METHOD, 0.1, 0.1)


PAIR = {"a": Marker(GROUND), "b": Marker("b")}
BAD = {
    "component": (lambda: ExpressionElement("e", PAIR, {"b_Fq": "1"}), "forces: no component 'b_Fq'"),
    "first": (lambda: ExpressionElement("e", PAIR, {"a_Fx": "1"}), "forces: no component 'a_Fx'"),
    "one place": (lambda: ExpressionElement("e", {"a": Marker("b")}), "places: expected two markers at least"),
    "rates": (lambda: ExpressionElement("e", PAIR, states={"z": 0.0}), "expected a rate and an initial value"),
    "name": (lambda: ExpressionElement("e", PAIR, parameters={"t": 1.0}), "used once, got 't'"),
    "term": (lambda: ExpressionElement("e", PAIR, terms={"b_x": "1"}), "used once, got 'b_x'"),
    "later term": (lambda: run_with("late", early="late", late="1"), "element 'e': terms: early: unknown name 'late'"),
    "expression": (lambda: run_with("c"), "element 'e': forces: b_Fx: unknown name 'c'"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_with_expressions_is_told(case):
    make, told = BAD[case]
    with pytest.raises(ModelError) as error:
        make()
    assert told in str(error.value)
