"""Laws that jump with the motion: a step in which a switching function passes zero ends there."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Marker,
    PrismaticJoint,
    RigidBody,
    System,
    UserForce,
    integrate,
    static_equilibrium,
)
from floatframe.design import sensitivities
from floatframe.errors import ConvergenceError, ModelError
from floatframe.files.cosimulation.unit import Unit
from floatframe.integrators import EnergyMomentum, Ida, RelativeOde
from floatframe.joints import JointCoordinate
from floatframe.model.elements import Element, ElementLaw
from floatframe.simulation import resume

MASS, H, FORCE = 2.0, 0.02, 100.0
AXIS = np.array([1.0, 2.0, -2.0]) / 3
PLACE = np.array([5.0, -3.0, 2.0])
X = {"x": JointCoordinate("rail", "distance")}
METHODS = {
    "default": (GeneralizedAlpha(0.8), None),
    "controlled": (GeneralizedAlpha(0.8, error_tolerance=1e-8), None),
    "conserving": (EnergyMomentum(), None),
    "relative": (GeneralizedAlpha(0.8), "relative"),
    "ode": (RelativeOde("BDF"), "relative"),
}
method_of = pytest.mark.parametrize(("method", "formulation"), METHODS.values(), ids=METHODS)


def on_rail(forces=(), elements=(), *, speed=2.0, unit="m-kg-s", x=0.0):
    """A box on a rail, off the origin, along an oblique axis; numbers in SI, given in other units."""
    metre, second, kilogram = (1 / getattr(unit_system(unit), each) for each in ("length", "time", "mass"))
    where = PLACE * metre
    box = RigidBody(
        "box", MASS * kilogram, np.diag([1.0, 2.0, 3.0]) * kilogram * metre**2, position=where + x * metre * AXIS,
        velocity=speed * metre / second * AXIS,
    )  # fmt: skip
    rail = PrismaticJoint("rail", Marker(GROUND, position=where), Marker("box", position=np.zeros(3)), axis=AXIS)
    return System([box], [rail], list(forces), elements=list(elements), units=unit_system(unit))


def brake(size=FORCE, metre=1.0):
    """A force against the motion between two places."""
    return UserForce(
        "brake", X, {"x": "-F*(1 + late)*(1 - past)/4"}, parameters={"F": size, "a": 0.1 * metre, "b": 0.13 * metre},
        switches={"late": "x - a", "past": "x - b"},
    )  # fmt: skip


def speed_along(motion):
    return float(motion.body("box").v[-1] @ AXIS)


@njit
def wall_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write a force along the axis of the second marker while it is beyond a place seen from the first, and the gap."""
    way = 0.0
    for k in range(3):
        way += (x[1, k] - x[0, k]) * data[2 + k]
    outputs[0] = way - data[1]
    sign = data[5]
    if sign == 0.0:
        sign = -1.0 if outputs[0] < 0.0 else 1.0
    for k in range(3):
        wrench[1, k] = -data[0] * 0.5 * (1.0 + sign) * data[2 + k]
        wrench[0, k] = -wrench[1, k]


@dataclass(frozen=True, eq=False)
class Wall(Element):
    """A constant force beyond a place."""

    name: str
    a: Marker
    b: Marker
    declares: tuple[str, ...] = ("gap",)

    def law(self, placed):
        data = [FORCE, 0.1, *AXIS] + [0.0] * (1 - len(self.declares))
        return ElementLaw(
            function=wall_law, data=data, outputs=["gap"], output_units=["m"], acts=["force", "force"],
            switches=self.declares,
        )  # fmt: skip


def wall(**given):
    return Wall("wall", Marker(GROUND, position=PLACE), Marker("box", position=np.zeros(3)), **given)


@method_of
@pytest.mark.parametrize("h", [H, 0.0173, 0.1])
def test_a_force_between_two_places_takes_its_work(method, formulation, h):
    motion = integrate(on_rail([brake()]), method, 0.2, h, formulation=formulation)
    assert_allclose(speed_along(motion), np.sqrt(4 - 2 * FORCE * 0.03 / MASS), rtol=1e-7)
    assert_allclose([event["t"] for event in motion.head.summary["events"]], [0.05, 0.07], rtol=1e-7)


@pytest.mark.parametrize("unit", ["mm-kg-ms", "in-slinch-s"])
def test_it_does_in_other_units(unit):
    metre, second, kilogram = (1 / getattr(unit_system(unit), each) for each in ("length", "time", "mass"))
    force = brake(FORCE * kilogram * metre / second**2, metre)
    motion = integrate(on_rail([force], unit=unit), GeneralizedAlpha(0.8), 0.2 * second, H * second)
    assert_allclose(speed_along(motion) * second / metre, 1.0, rtol=1e-7)


@method_of
def test_an_element_that_jumps_with_the_motion_is_cut(method, formulation):
    """It meets a constant force at 0.1 m with 2 m/s, is thrown back, and leaves as it came."""
    motion = integrate(on_rail(elements=[wall()]), method, 0.2, H, formulation=formulation)
    assert_allclose(speed_along(motion), -2.0, rtol=1e-7)
    met = 0.1 / 2
    assert_allclose([event["t"] for event in motion.head.summary["events"]], [met, met + 4 * MASS / FORCE], rtol=1e-7)


def test_an_element_is_cut_by_ida_too():
    motion = integrate(on_rail(elements=[wall()]), Ida(1e-6, 1e-8), 0.2, 2 * H)
    assert_allclose(speed_along(motion), -2.0, rtol=1e-7)


def test_without_its_sign_held_the_same_law_errs():
    """The oracle sees the fault that the tests above would have."""
    motion = integrate(on_rail(elements=[wall(declares=())]), GeneralizedAlpha(0.8), 0.2, H)
    assert abs(speed_along(motion) + 2.0) > 1e-4


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_relay_swings_with_its_period(formulation):
    """m x" = -F sign(x) from x0: parabolas, four in a period of 4 sqrt(2 x0 m/F); 8 swings in long steps."""
    relay = UserForce("relay", X, {"x": "-50*side"}, switches={"side": "x"})
    period = 4 * np.sqrt(2 * 0.2 * MASS / 50)
    motion = integrate(
        on_rail([relay], speed=0.0, x=0.2), GeneralizedAlpha(0.8), 8 * period, period / 7, formulation=formulation
    )
    assert_allclose((motion.body("box").r[-1] - PLACE) @ AXIS, 0.2, rtol=1e-5)
    assert len(motion.head.summary["events"]) == 16


def test_a_motion_that_begins_on_the_zero_takes_the_sign_of_its_way():
    for speed in (2.0, -2.0):
        relay = UserForce("relay", X, {"x": "-50*side"}, switches={"side": "x"})
        motion = integrate(on_rail([relay], speed=speed), GeneralizedAlpha(0.8), 0.02, 0.02)
        assert_allclose(speed_along(motion), speed - np.sign(speed) * 0.5, rtol=1e-7)


def test_outside_of_runs_the_sign_is_that_of_the_function():
    """A spring that is three times as stiff beyond 0.1 m, with the load of 40 N: k x = F on either side."""
    text = "-k*(2 + late)*(x - 0.1) - 20 + 40"
    spring = UserForce("spring", X, {"x": text}, parameters={"k": 100.0}, switches={"late": "x - 0.1"})
    for load, x in (("40", 0.1 + 20 / 300), ("10", 0.1 - 10 / 100)):
        changed = replace(spring, forces={"x": text.replace("40", load)})
        state = static_equilibrium(on_rail([changed], speed=0.0)).state
        assert_allclose((state.r[0] - PLACE) @ AXIS, x, rtol=1e-6, atol=1e-9)


def test_a_run_over_switches_goes_on_bit_for_bit(tmp_path):
    system, method, run = on_rail([brake()]), GeneralizedAlpha(0.8), (0.2, 2.5e-4)
    whole = integrate(system, method, *run)
    steps = []

    def interrupt(progress):
        steps.append(progress.n_steps)
        if progress.n_steps >= 400:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        integrate(system, method, *run, output=tmp_path / "box.h5", progress=interrupt)
    again = resume(system, tmp_path / "box.h5")
    np.testing.assert_array_equal(again.state(-1).u, whole.state(-1).u)


def test_a_law_that_switches_to_and_fro_without_end_is_refused():
    held = UserForce("held", X, {"x": "-50*side"}, switches={"side": "x_dot"})
    with pytest.raises(ConvergenceError, match=r"100 events happened in one step: held\.side"):
        integrate(on_rail([held], speed=0.1), GeneralizedAlpha(0.8), 0.1, H)


def test_what_cannot_follow_switches_refuses_them():
    with pytest.raises(ModelError, match=r"'brake\.late' is a switching function: motions over jumps are not diff"):
        sensitivities(lambda p: on_rail([brake(p["F"])]), ["rail.distance"], {"F": FORCE}, t_end=0.1, h=0.01)
    with pytest.raises(ModelError, match=r"the zeros of 'brake\.late' switch a law, which cannot be a part"):
        Unit(on_rail([brake()]), GeneralizedAlpha(0.8), H)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: UserForce("f", X, {"x": "1"}, switches={"x": "x"}), "the name 'x' is used twice"),
        (lambda: UserForce("f", X, ("x",), switches={"a": "x"}, function=print), "rates, parameters, functions and sw"),
        (lambda: integrate(on_rail([UserForce("f", X, {"x": "a"}, switches={"a": "y"})]), GeneralizedAlpha(), 1, 0.1),
         "unknown name 'y'"),
        (lambda: ElementLaw(function=wall_law, switches=["gap"]), "switches: expected names of its outputs, got 'gap'"),
    ],
)  # fmt: skip
def test_impossible_switches_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()
