"""Play in joints against SciPy, closed forms of loads and dead bands, and its energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    static_equilibrium,
)
from floatframe.analyses import check_element
from floatframe.components.clearances import Backlash, BallWithPlay, HingeWithPlay
from floatframe.errors import ModelError
from floatframe.model.elements import Placed
from floatframe.results import element_motion
from floatframe.results.energy_balance import balance_defect
from tests.floatframe.components.clearances.examples import ARM, NUMBERS, PLAY, START, G, J, M, pendulum
from tests.floatframe.finite_differences import assert_tangent_is_exact


def rates(t, y, exponent):
    """The plane motion of the pendulum once more: two contacts side by side act like one that is twice as stiff."""
    k, chi, mu, slow, r = 4e5 * 1e3 ** (exponent - 1), NUMBERS["damping"], NUMBERS["friction"], 0.01, NUMBERS["radius"]
    (X, Y, phi), (U, V, w) = y[:3], y[3:]
    arm = ARM * np.array([-np.sin(phi), np.cos(phi)])
    pin, speed = np.array([X, Y]) + arm, np.array([U, V]) + w * np.array([-arm[1], arm[0]])
    force, moment, way = np.zeros(2), 0.0, np.hypot(*pin)
    if way > PLAY:
        n = pin / way
        N = k * (way - PLAY) ** exponent * max(0.0, 1 + chi * (speed @ n))
        along = np.array([-n[1], n[0]])
        slip = speed @ along + w * r
        force = -N * n - mu * N * slip / np.hypot(slip, slow) * along
        lever = arm + r * n
        moment = lever[0] * force[1] - lever[1] * force[0]
    return [U, V, w, force[0] / M, force[1] / M - G, moment / J]


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_pendulum_that_rattles_in_its_bearing_moves_as_scipy_says(exponent):
    system, t_end = pendulum(exponent), 0.35
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-9), t_end, 5e-5, output_every=100)
    exact = solve_ivp(
        rates, (0, t_end), [*START, 0, 0, 0], "DOP853", args=(exponent,), rtol=1e-10, atol=1e-13, max_step=2e-4,
        t_eval=motion.t,
    )  # fmt: skip
    seen = element_motion(system, motion, "hinge")
    at_pin = np.hypot(exact.y[0] - ARM * np.sin(exact.y[2]), exact.y[1] + ARM * np.cos(exact.y[2]))
    assert at_pin.min() < 0.5 * PLAY
    assert at_pin.max() > PLAY  # it has been off, and on
    assert_allclose(motion.body("bob").r[:, :2], exact.y[:2].T, rtol=0, atol=2e-3 * PLAY)
    assert_allclose(seen.outputs["eccentricity"], at_pin, rtol=0, atol=2e-3 * PLAY)
    assert_allclose(seen.outputs["angle"], exact.y[2] - START[2], rtol=0, atol=1e-5)
    assert_allclose(balance_defect(motion), 0.0, atol=1e-3)


@pytest.mark.parametrize(("load", "exponent"), [(50.0, 1.0), (-50.0, 1.0), (80.0, 1.5)])
def test_a_load_moves_the_pin_by_play_and_the_spring_of_the_contact(load, exponent):
    """Way (F/2k)^(1/n) beyond the play, of two planes that share the load."""
    stiffness, side = 2e5 * 1e3 ** (exponent - 1), np.sign(load)
    block = RigidBody("block", 1.0, np.eye(3), position=(side * 1.1 * PLAY, 0, 0))
    guide = PrismaticJoint("guide", Marker(GROUND), Marker("block"), axis=(1, 0, 0))
    options = {"radial_play": PLAY, "length": 0.05, "stiffness": stiffness, "exponent": exponent}
    hinge = HingeWithPlay("hinge", Marker(GROUND), Marker("block"), **options)
    pull = PointForce("pull", Marker("block"), force=(load, 0, 0))
    found = static_equilibrium(System([block], [guide], [pull], elements=[hinge]))
    way = found.state.r[0, 0]
    assert_allclose(way, side * (PLAY + (abs(load) / (2 * stiffness)) ** (1 / exponent)), rtol=1e-9)


def test_tilt_of_a_loaded_pin_is_that_of_its_lever():
    """Forces W (a/L ± 1/2) in the planes, upward outside and downward inside; way c + N/k in each."""
    W, a, L, k = 30.0, 0.4, 0.1, 5e5
    up, down = W * (a / L + 0.5), W * (a / L - 0.5)
    ways = np.array([PLAY + down / k, -PLAY - up / k])  # of the pin at -L/2 and L/2
    tilt, middle = np.arcsin((ways[1] - ways[0]) / L), ways.mean()
    hinge = HingeWithPlay("hinge", Marker(GROUND), Marker("rod"), radial_play=PLAY, length=L, stiffness=k)
    law = hinge.law(Placed(np.zeros((2, 3)), np.array([np.eye(3)] * 2), (True, False), unit_system("m-kg-s")))
    x = np.zeros((2, 18))
    x[:, 3:12] = np.eye(3).ravel()
    x[1, 1] = middle
    c, s = np.cos(-tilt), np.sin(-tilt)
    x[1, 3:12] = [1, 0, 0, 0, c, -s, 0, s, c]
    wrench, seen = np.zeros((2, 6)), np.zeros(len(law.outputs))
    law.function.py_func(0.0, x, np.zeros(0), np.zeros(0), law.data, wrench, np.zeros(0), np.zeros(0), seen)
    assert_allclose(wrench[1, 1], W, rtol=1e-9)
    assert_allclose(wrench[1, 3], -W * a * c, rtol=1e-9)  # the tilted pin has a shorter lever
    assert_allclose(seen[3], abs(tilt), rtol=1e-9)
    assert seen[5] == 2
    assert_allclose(seen[8:10], PLAY - np.abs(ways), rtol=1e-9)  # gaps in both planes


def test_a_dead_band_turns_a_shaft_back_with_the_speed_that_its_stops_leave():
    """Without loss the shaft rattles for ever: way per period 2 (upper - lower) + two half swings on the stops."""
    shaft = RigidBody("shaft", 1.0, 0.02 * np.eye(3), omega_B=(0, 0, 1.0))
    axle = RevoluteJoint("axle", Marker(GROUND), Marker("shaft"), axis=(0, 0, 1))
    options = {"lower": -0.05, "upper": 0.1, "stiffness": 800.0, "motion": "about"}
    system = System([shaft], [axle], elements=[Backlash("gap", Marker(GROUND), Marker("shaft"), **options)])
    period = 2 * 0.15 + 2 * np.pi * np.sqrt(0.02 / 800.0)
    motion = integrate(system, GeneralizedAlpha(1.0, 1e-10), 3 * period, period / 6000, output_every=6)
    seen = element_motion(system, motion, "gap")
    assert_allclose(seen.outputs["way"][[1000, 2000, 3000]], 0.0, atol=2e-4 * 0.15)
    assert_allclose(seen.outputs["force"].max(), np.sqrt(800.0 * 0.02), rtol=1e-3)  # largest of 39 in a half swing
    assert_allclose(motion.body("shaft").omega_B[[1000, 2000, 3000], 2], 1.0, rtol=1e-4)


def test_a_ball_hangs_in_its_socket():
    ball = RigidBody("ball", 3.0, np.eye(3), position=(0, 0, -1.05 * PLAY))
    guide = PrismaticJoint("guide", Marker(GROUND), Marker("ball"), axis=(0, 0, 1))
    joint = BallWithPlay("joint", Marker(GROUND), Marker("ball"), play=PLAY, stiffness=1e6)
    found = static_equilibrium(System([ball], [guide], [Gravity((0, 0, -G))], elements=[joint]))
    assert_allclose(found.state.r[0, 2], -PLAY - 3.0 * G / 1e6, rtol=1e-9)


@pytest.mark.parametrize("kind", ["hinge", "ball", "along", "about"])
def test_tangent_is_exact_and_the_law_is_right(kind):
    place = {"position": (1.4, -0.5, 2.0), "velocity": (0.02, 0.01, -0.03), "omega_B": (0.1, 0.2, 0.3)}
    body = RigidBody("block", 1.0, np.diag([1.0, 2.0, 1.5]), **place)
    ends = Marker(GROUND), Marker("block", position=(0.01, 0, 0))
    numbers = NUMBERS | {"stiffness": 50.0, "exponent": 1.5}
    if kind == "hinge":
        numbers |= {"turn_stiffness": 3.0, "turn_damping": 0.7, "turn_free": 0.2}
        element = HingeWithPlay("gap", *ends, radial_play=1.0, length=0.5, axial_play=1.0, axis=(0, 1, 1), **numbers)
    elif kind == "ball":
        element = BallWithPlay("gap", *ends, play=1.0, **numbers)
    else:
        del numbers["friction"], numbers["friction_speed"], numbers["radius"]
        element = Backlash("gap", *ends, lower=-2.0, upper=-1.0, motion=kind, **numbers)
    system = System([body], elements=[element])
    assert check_element(system, "gap").findings == ()
    assert_tangent_is_exact(system)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"radial_play": 0.0}, "radial_play: expected a number above 0"),
        ({"stiffness": -1.0}, "stiffness"),
        ({"exponent": 0.5}, "exponent"),
        ({"length": -1.0}, "length"),
        ({"axis": (0, 0, 0)}, "zero vector"),
        ({"marker_b": 3}, "expected a Marker"),
    ],
)
def test_wrong_numbers_are_refused(options, words):
    numbers = {"radial_play": PLAY, "stiffness": 1e5, "marker_b": Marker("block")} | options
    with pytest.raises(ModelError, match=words):
        HingeWithPlay("hinge", Marker(GROUND), **numbers)


def test_a_band_without_width_is_refused():
    with pytest.raises(ModelError, match="expected a value above lower"):
        Backlash("gap", Marker(GROUND), Marker("block"), lower=0.1, upper=0.1, stiffness=1.0)
