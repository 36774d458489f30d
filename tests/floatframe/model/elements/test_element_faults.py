"""What is wrong with a law of a user is told: on request, while compiling, and in a motion."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose, assert_array_equal

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PrismaticJoint,
    RigidBody,
    SpringDamper,
    System,
    integrate,
    inverse_dynamics,
    kinematics,
)
from floatframe.analyses import check_element, open_equations
from floatframe.design import sensitivities
from floatframe.engine.open_equations import radau, rattle
from floatframe.errors import ConvergenceError, ModelError, ResultsError
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Ida, newmark
from floatframe.integrators.relative import RelativeGeneralizedAlpha
from floatframe.integrators.relative_ode import METHODS, RelativeOde
from floatframe.integrators.variational import Variational
from floatframe.model import Element, ElementLaw
from floatframe.model.elements import POSITION
from floatframe.model.functions.time_functions import harmonic
from floatframe.results import element_motion
from floatframe.results.sensors import measured
from floatframe.sensors import ElementSensor, PlaceSensor
from floatframe.simulation import Event, resume
from tests.floatframe.model.elements.laws import Circuit, Disc, Jack, Spring
from tests.floatframe.model.elements.public_elements_examples import METHOD

ENDS = Marker(GROUND), Marker("b", position=(0.1, 0.2, 0.3))


class Law(Element):
    """An element whose law is given."""

    def __init__(self, function, markers=ENDS, **options):
        self.name, self.markers, self.function, self.options = "e", markers, function, options

    def law(self, placed):
        return ElementLaw(function=self.function, **self.options)


def falling(*elements, forces=()):
    body = RigidBody("b", 1.0, np.eye(3), position=(1, 0, 0), velocity=(0, 0, 1.0))
    return System([body], forces=[Gravity((0, 0, -10.0)), *forces], elements=elements)


GOOD = {
    "complex": Spring("e", *ENDS, 20.0, 1.0),
    "given": Spring("e", *ENDS, 20.0, 1.0, how="given"),
    "Python": Spring("e", *ENDS, 20.0, 1.0, how="Python, complex"),
    "a state": Jack("e", ENDS[1]),
    "an equation": Circuit("e", ENDS[1], 3.0),
    "held": Disc("e", ENDS[1], 0.5),
}


@pytest.mark.parametrize("case", GOOD)
def test_a_good_element_is_found_good(case):
    found = check_element(falling(GOOD[case]), "e")
    assert found.findings == ()
    assert found.derivative_error < 1e-6  # rounding of the differences


@njit
def square(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[1, 2] = x[1, 14] ** 2


@njit
def powered(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[1, 2] = x[1, 14] ** data[0]


@njit
def wrong_slopes(t, x, z, lam, data, slopes):
    slopes[8, 20] = 3.0


@njit
def two_parts(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[1, 2] = -x[1, 14] * x[1, 14]
    wrench[1, 3] = 1.0


def outside(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[2, 0] = 1.0


def counting(t, x, z, lam, data, wrench, z_dot, g, outputs, calls=[0]):  # noqa: B006
    calls[0] += 1
    wrench[1, 0] = calls[0]


def greedy(t, x, z, lam, data, wrench, z_dot, g, outputs):
    data[0] = 2.0


@njit
def rooted(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[1, 2] = np.sqrt(data[0] - x[1, 2])


@njit
def held_speed(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[1, 2] = lam[0]
    g[0] = x[1, 2] + x[1, 14]


FAULTS = {
    "a wrong tangent": (Law(square, tangent=wrong_slopes), "its tangent gives 3, differences 2"),
    "a complex power": (Law(powered, data=[4.0], tangent="complex"), "write v*v"),
    "outside": (Law(outside), "raised IndexError: index 2 is out of bounds"),
    "random": (Law(counting), "two calls with the same numbers give different results"),
    "inputs": (Law(greedy, data=[1.0]), "its function changes data, which is an input"),
    "no number": (Law(rooted, data=[0.2999]), "element 'e' is not finite (NaN or infinity) in the initial position"),
    "what does nothing": (Law(two_parts, acts=("none", "force")), "moment x on marker 2: written, but acts = 'force'"),
    "opposite": (Law(two_parts, is_opposite=True), "is_opposite says the forces on both markers are opposite"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_a_faulty_element_is_told_from_a_good_one(case):
    element, told = FAULTS[case]
    system = falling(element)
    if case == "a complex power":  # a base below zero
        system = System([RigidBody("b", 1.0, np.eye(3), velocity=(0, 0, -1.0))], elements=[element])
    found = check_element(system, "e")
    assert not found.is_good
    assert any(told in each for each in found.findings), found.findings


def test_what_a_held_position_may_not_depend_on_is_told():
    element = Law(held_speed, multipliers=("f",), holds=(POSITION,))
    place = RigidBody("b", 1.0, np.eye(3), position=(0, 0, -0.3))
    found = check_element(System([place], elements=[element]), "e")
    told = (
        "g of f depends on velocity z of marker 2, but constrains a position, which may depend only on positions and "
        "time"
    )
    assert any(told in each for each in found.findings), found.findings


def test_an_element_that_is_not_there_is_not_checked():
    with pytest.raises(ResultsError, match="check_element: no element 'f'"):
        check_element(falling(Jack("e", ENDS[1])), "f")


@njit
def two_arguments(t, x):
    return x


@njit
def real_only(t, x, z, lam, data, wrench, z_dot, g, outputs):
    wrench[1, 0] = max(x[1, 0], 0.0)


def failing(t, x, z, lam, data, wrench, z_dot, g, outputs):
    raise ArithmeticError("out of reach")


class Broken(Law):
    def law(self, placed):
        return {}["missing"]


REFUSED = {
    "arguments": (Law(two_arguments), "element 'e': its function cannot be compiled as function(t, x, z, lam"),
    "complex": (Law(real_only, tangent="complex"), "cannot be compiled with complex numbers"),
    "raises": (Law(failing), "element 'e': its function raised ArithmeticError: out of reach"),
    "its law": (Broken(square), "element 'e': its law raised KeyError: 'missing'"),
    "units": (
        Law(square, states=("p",), state_units=("Pa", "m")),
        "state_units: expected 1, one for each of its states",
    ),
    "start": (Law(square, states=("p", "q"), start=(1.0,)), "start: expected 2, one for each of its states, got 1"),
    "names": (Law(square, outputs=("a", "a")), "outputs: expected names that differ"),
    "tangent": (Law(square, tangent="exact"), "tangent: expected a function or one of differences, complex"),
    "holds": (Law(square, multipliers=("f",), holds=(7,)), "holds: expected POSITION, VELOCITY or NOTHING"),
    "energy": (Law(square, energy="E"), "energy: expected one of its outputs, got 'E'"),
    "stops": (Law(square, stops={"off": "it left"}), "stops: expected names of its outputs, got 'off'"),
    "acts": (Law(square, acts=("force",)), "acts: expected one of wrench, force, moment, none for each of 2 markers"),
    "opposite": (Law(square, markers=ENDS[1:], is_opposite=True), "is_opposite: expected two markers with a force"),
    "the ground alone": (Law(square, markers=ENDS[:1]), "all its markers are on the ground, where nothing moves"),
    "no markers": (Law(square, markers=()), "markers: expected one Marker at least"),
    "no body": (Law(square, markers=[Marker("c")]), "element 'e': marker 1: no body 'c'"),
    "data": (Law(square, data=[np.nan]), "data: expected finite numbers"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_law_that_does_not_fit_is_refused_in_one_message(case):
    element, told = REFUSED[case]
    with pytest.raises(ModelError) as error:
        integrate(falling(element), METHOD, 0.01, 1e-3)
    assert told in str(error.value)


def test_elements_are_elements_and_have_names_of_their_own():
    with pytest.raises(ModelError, match="elements: expected a list, each of it an Element"):
        falling("spring")
    with pytest.raises(ModelError, match="the name 'e' is used twice"):
        falling(Jack("e", ENDS[1]), Circuit("e", ENDS[1]))


def test_what_becomes_no_number_in_a_motion_is_told_with_the_motion_so_far():
    with pytest.raises(ConvergenceError, match="element 'e' is not finite") as error:
        integrate(falling(Law(rooted, data=[0.33])), METHOD, 1.0, 1e-3)
    assert 0.02 < error.value.trajectory.t[-1] < 0.05


@njit
def watched(t, x, z, lam, data, wrench, z_dot, g, outputs):
    outputs[0] = x[0, 2] - 0.04


@njit
def rooted_and_watched(t, x, z, lam, data, wrench, z_dot, g, outputs):
    outputs[0] = x[0, 2] - 0.04
    wrench[0, 2] = 1e-3 * np.sqrt(0.044 - x[0, 2])


def rising(element):
    return System([RigidBody("b", 1.0, np.eye(3), velocity=(0, 0, 1.0))], elements=[element])


def test_an_output_may_end_a_run_with_its_words_and_the_motion_so_far():
    element = Law(watched, [Marker("b")], outputs=("high",), stops={"high": "it is above its ceiling"})
    with pytest.raises(ConvergenceError, match="element 'e': it is above its ceiling") as error:
        integrate(rising(element), METHOD, 1.0, 1e-3)
    assert abs(error.value.trajectory.t[-1] - 0.04) < 2e-3


EVERY_METHOD = {
    "alpha": METHOD,
    "alpha, error control": GeneralizedAlpha(0.9, error_tolerance=1e-5),
    "newmark": newmark(),
    "relative": RelativeGeneralizedAlpha(0.9),
    "conserving": EnergyMomentum(),
    "decaying": EnergyDecaying(),
    "variational": Variational(),
    "ida": Ida(1e-6, 1e-8),
    **{name: RelativeOde(name) for name in METHODS},
}


@pytest.mark.parametrize("method", EVERY_METHOD)
@pytest.mark.parametrize("every", [1, 4])
def test_a_stop_ends_a_run_of_every_method_before_the_output_beyond_it(method, every):
    """The ceiling is passed at 40 ms, between the steps, or outputs, that end at 36 and 42 ms."""
    if method == "ida":
        pytest.importorskip("sksundae", reason="the extra 'ida' is not installed")
    element = Law(watched, [Marker("b")], outputs=("high",), stops={"high": "it is above its ceiling"})
    with pytest.raises(ConvergenceError, match="element 'e': it is above its ceiling") as error:
        integrate(rising(element), EVERY_METHOD[method], 0.096, 6e-3, output_every=every)
    assert_allclose(error.value.trajectory.t, np.arange(0.0, 0.04, 6e-3 * every), rtol=0, atol=1e-15)


@pytest.mark.parametrize("method", ["BDF", "Radau"])
def test_where_a_law_ends_beyond_its_stop_the_stop_is_told(method):
    """Under the ceiling at 40 ms the root of the law ends at 44 ms."""
    element = Law(rooted_and_watched, [Marker("b")], outputs=("high",), stops={"high": "it is above its ceiling"})
    with pytest.raises(ConvergenceError, match="element 'e': it is above its ceiling"):
        integrate(rising(element), EVERY_METHOD[method], 0.096, 1e-3)


@pytest.mark.parametrize("method", [radau, rattle])
def test_examples_on_open_equations_refuse_elements_that_may_end_a_run(method):
    eq = open_equations(rising(Law(watched, [Marker("b")], outputs=("high",), stops={"high": "it is high"})))
    x, v, _, _ = eq.start()
    with pytest.raises(ModelError, match=f"{method.__name__}: element 'e': it is high: an output may end a run"):
        method(eq, x, v, np.linspace(0.0, 0.1, 11))


def test_a_stop_reached_at_the_end_of_a_step_ends_a_run_of_a_conserving_scheme():
    """The last step begins below the ceiling, is below it in its middle, and ends above."""
    element = Law(watched, [Marker("b")], outputs=("high",), stops={"high": "it is above its ceiling"})
    with pytest.raises(ConvergenceError, match="element 'e': it is above its ceiling") as error:
        integrate(rising(element), EnergyMomentum(), 0.041, 0.0082)
    assert_allclose(error.value.trajectory.t, 0.0082 * np.arange(5), atol=1e-15)


def test_what_is_no_number_where_a_conserving_step_ends_is_told():
    """The marker, 0.3 above the body, passes the place where the root ends in the second half of the last step."""
    with pytest.raises(ConvergenceError, match="element 'e' is not finite") as error:
        integrate(rising(Law(rooted, data=[0.34])), EnergyMomentum(), 0.041, 0.0082)
    assert_allclose(error.value.trajectory.t, 0.0082 * np.arange(5), atol=1e-15)


class Watching(Law):
    def events(self):
        return [Event("high", "e.high", level=0.0, direction="rising", stop=True)]


def test_events_watch_outputs_and_elements_bring_their_own():
    motion = integrate(rising(Watching(watched, [Marker("b")], outputs=("high",))), METHOD, 1.0, 1e-3)
    assert abs(motion.t[-1] - 0.04) < 1e-10
    assert motion.head.summary["events"][0]["name"] == "high"


class EndOfPatienceError(Exception):
    """Ends a run."""


def test_a_run_with_states_is_resumed_bit_for_bit(tmp_path):
    def system():
        return falling(Jack("e", ENDS[1]), Spring("s", *ENDS, 20.0, 1.0))

    def interrupt(progress):
        if progress.n_steps >= 400:
            raise EndOfPatienceError

    method = GeneralizedAlpha(0.9)
    whole = integrate(system(), method, 0.6, 1e-3)
    with pytest.raises(EndOfPatienceError):
        integrate(system(), method, 0.6, 1e-3, output=tmp_path / "run.h5", progress=interrupt)
    again = resume(system(), tmp_path / "run.h5")
    assert_array_equal(again.body("b").r, whole.body("b").r)
    states = [element_motion(system(), motion, "e").states["p"] for motion in (again, whole)]
    assert_array_equal(*states)


def test_schemes_that_do_not_know_elements_name_them():
    with pytest.raises(ModelError, match="Variational: element 'e' has multipliers of its own"):
        integrate(falling(Disc("e", ENDS[1], 0.5)), Variational(), 0.01, 1e-3)
    for method in (EnergyMomentum(), Variational()):
        with pytest.raises(ModelError, match=f"{type(method).__name__}: element 'e' depends on accelerations"):
            integrate(falling(Law(square, accelerations=True)), method, 0.01, 1e-3)
    with pytest.raises(ModelError, match="open_equations: 'e' has states of its own"):
        open_equations(falling(Jack("e", ENDS[1])))


def driven_guide():
    motion = {"distance": harmonic(0.1, 2.0)}
    return PrismaticJoint("guide", Marker(GROUND), Marker("b"), axis=(0, 0, 1), motions=motion)


def test_analyses_that_do_not_know_states_name_the_element():
    guide = PrismaticJoint(
        "guide", Marker(GROUND), Marker("b"), axis=(0, 0, 1), motions={"distance": harmonic(0.1, 2.0)}
    )
    driven = System([RigidBody("b", 1.0, np.eye(3))], [guide], elements=[Jack("e", ENDS[1])])
    told = "kinematics: element 'e' has states or multipliers, which follow only from integration in time"
    with pytest.raises(ModelError, match=told):
        kinematics(driven, [0.0, 0.1])
    with pytest.raises(ModelError, match="sensitivities: element 'e' has states, which are not differentiated"):
        sensitivities(
            lambda values: falling(Jack("e", ENDS[1], area=values["A"])), ["p x"], {"A": 1e-3}, t_end=0.1, h=1e-3
        )


def test_a_driven_motion_takes_the_force_of_an_element():
    """The drive holds weight, inertia and the spring."""
    guide = PrismaticJoint(
        "guide", Marker(GROUND), Marker("b"), axis=(0, 0, 1), motions={"distance": harmonic(0.1, 2.0)}
    )
    ends = Marker(GROUND, position=(0, 0, -1)), Marker("b")
    forces = []
    for parts in ({"elements": [Spring("e", *ends, 40.0)]}, {"forces": [SpringDamper("e", *ends, stiffness=40.0)]}):
        system = System([RigidBody("b", 1.0, np.eye(3))], [guide], **parts)
        forces.append(inverse_dynamics(system, [0.0, 0.1, 0.2]).drives["guide.distance"].force)
    assert_allclose(forces[0], forces[1], rtol=0, atol=1e-10)


@pytest.mark.parametrize("output", ["p z", "pull tension"])
def test_motions_are_differentiated_by_numbers_of_an_element(output):
    def system(values):
        made = falling(Spring("e", *ENDS, values["k"], 2.0, 1.0))
        sensors = [PlaceSensor("p", Marker("b"), "position"), ElementSensor("pull", "e", "tension")]
        return replace(made, sensors=sensors)

    found = sensitivities(system, [output], {"k": 30.0}, t_end=0.2, h=1e-3)
    sensor, column = output.split()
    ends = []
    for k in (29.97, 30.03):
        whole = system({"k": k})
        motion = integrate(whole, GeneralizedAlpha(tolerance=1e-13), 0.2, 1e-3)
        ends.append(measured(whole, motion)[sensor].columns[column][-1])
    assert_allclose(found.gradient[0, 0], (ends[1] - ends[0]) / 0.06, rtol=1e-4)


def test_open_equations_know_springs_as_elements():
    spring = SpringDamper("e", *ENDS, stiffness=20.0, damping=1.0, preload=3.0)
    equations = [open_equations(falling(Spring("e", *ENDS, 20.0, 1.0, 3.0))), open_equations(falling(forces=[spring]))]
    x, v = equations[0].start()[:2]
    x, v = x + 0.1, v + 0.1
    forces = [each.force(0.0, x, v) for each in equations]
    assert_allclose(forces[0], forces[1], rtol=1e-12, atol=1e-12)
    tangents = [each.tangents(0.0, x, v, 0 * v, np.zeros(0)) for each in equations]
    assert_allclose(tangents[0].by_x, tangents[1].by_x, rtol=1e-9, atol=1e-9)
    assert_allclose(tangents[0].by_v, tangents[1].by_v, rtol=1e-9, atol=1e-9)
