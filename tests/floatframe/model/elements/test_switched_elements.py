"""Elements that events switch on and off: against built-in forces, free flight, impacts and a valve in closed form."""

from dataclasses import dataclass, replace

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
)
from floatframe.errors import ModelError
from floatframe.model.elements import Element, ElementLaw
from floatframe.model.elements.switched_off import SwitchedOff
from floatframe.results import element_motion
from floatframe.results.energy_balance import balance_defect
from floatframe.simulation import Event
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.elements.laws import Ball, Spring

G = 9.81
NUMBERS = {"stiffness": 80.0, "damping": 2.0, "preload": 5.0}
EVENTS = (
    Event("cut", "guide.distance", level=-0.5, direction="falling", switch_off=("spring",)),
    Event("tied", "guide.distance", level=-1.1, direction="falling", switch_on=("spring",)),
)


def hanging(**parts):
    block = RigidBody("block", 2.0, np.eye(3))
    guide = PrismaticJoint("guide", Marker(GROUND), Marker("block"), axis=(0, 0, 1))
    return System([block], [guide], [Gravity((0, 0, -G)), *parts.pop("forces", ())], events=EVENTS, **parts)


def test_a_spring_is_cut_and_tied_again_as_the_built_in_one():
    ends = Marker(GROUND, position=(0.4, 0, 0)), Marker("block")
    own = Spring("spring", *ends, **NUMBERS)
    built_in = hanging(forces=[SpringDamper("spring", *ends, free_length=0.4, **NUMBERS)])
    system = hanging(elements=[own])
    motions = [integrate(each, GeneralizedAlpha(), 1.2, 2e-3) for each in (built_in, system)]
    times = [[e["t"] for e in motion.head.summary["events"]] for motion in motions]
    assert len(times[0]) > 1
    assert_allclose(times[1], times[0], rtol=0, atol=1e-9)
    assert_allclose(motions[1].body("block").r, motions[0].body("block").r, rtol=0, atol=1e-9)
    assert_allclose(balance_defect(motions[1]), balance_defect(motions[0]), atol=1e-9)
    tension = element_motion(system, motions[1], "spring").outputs["tension"]
    is_cut = (motions[1].t > times[0][0]) & (motions[1].t < times[0][1])
    assert_array_equal(tension[is_cut], 0.0)
    assert np.abs(tension[~is_cut]).min() > 0


def pinned(*events, velocity=(0, 0, 0)):
    """Return a body whose point the element holds at the origin."""
    body = RigidBody("body", 3.0, np.diag([0.4, 0.5, 0.6]), position=(0.5, 0, 0), velocity=velocity)
    return System([body], elements=[Ball("pin", Marker(GROUND), Marker("body", position=(-0.5, 0, 0)))], events=events)


def test_what_a_pin_lets_go_flies_on():
    """A body that turns about a pin at 2 rad/s leaves it with the speed of its centre of mass and its spin."""
    system = pinned(Event("release", at=0.3, switch_off=("pin",)))
    system = replace(system, bodies=[replace(system.bodies[0], omega_B=(0, 0, 2.0), velocity=(0, 1.0, 0))])
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-10), 0.8, 1e-3)
    body, late = motion.body("body"), motion.t > 0.3005
    turn = 2.0 * 0.3
    speed = 2.0 * 0.5 * np.array([-np.sin(turn), np.cos(turn), 0])
    place = 0.5 * np.array([np.cos(turn), np.sin(turn), 0]) + np.outer(motion.t[late] - 0.3, speed)
    assert_allclose(body.r[late], place, rtol=0, atol=2e-6)
    assert_allclose(body.omega_B[late, 2], 2.0, rtol=1e-6)


def test_a_pin_that_catches_a_body_takes_its_impulse():
    """A bar that flies along the x axis is caught at its end in the origin: it stops dead; across, it turns."""
    ends = [Event("caught", at=0.25, switch_on=("pin",))]
    along = pinned(*ends, velocity=(1.0, 0, 0))
    along = replace(along, bodies=[replace(along.bodies[0], position=(0.25, 0, 0))])
    motion = integrate(along, GeneralizedAlpha(), 0.5, 1e-2)
    assert_allclose(motion.body("body").v[-1], 0.0, atol=1e-9)
    impulse = motion.head.summary["events"][0]["impulse"]
    assert_allclose(sorted(np.abs(list(impulse.values()))), [0, 0, 3.0], atol=1e-9)
    across = pinned(*ends, velocity=(0, 1.0, 0))
    across = replace(across, bodies=[replace(across.bodies[0], position=(0.5, -0.25, 0))])
    motion = integrate(across, GeneralizedAlpha(), 0.5, 1e-2)
    assert_allclose(motion.body("body").omega_B[-1, 2], 3.0 * 0.5 / (0.6 + 3.0 * 0.25), rtol=1e-5)


def test_what_is_not_in_its_place_is_not_caught():
    system = pinned(Event("caught", at=0.2, switch_on=("pin",)), velocity=(1.0, 0, 0))
    with pytest.raises(ModelError, match="element 'pin' is to hold the position of its multiplier"):
        integrate(system, GeneralizedAlpha(), 0.5, 1e-2)


@njit
def open_valve(t, x, z, lam, data, wrench, z_dot, g, outputs):
    z_dot[0] = -z[0] / data[0]
    outputs[0] = z[0]


@njit
def shut_valve(t, x, z, lam, data, wrench, z_dot, g, outputs):
    z_dot[0] = -0.1 * z[0] / data[0]
    outputs[0] = -1.0


@dataclass(frozen=True, eq=False)
class Tank(Element):
    """A level that falls through a valve, slowly where it is shut."""

    name: str
    marker: Marker

    def law(self, placed):
        return ElementLaw(
            function=open_valve, off=shut_valve, data=[0.2], states=("level",), start=(1.0,), outputs=("flow",),
            tangent="complex", acts=("none",),
        )  # fmt: skip


def test_a_valve_is_shut_and_opened_and_leaks():
    body = RigidBody("body", 1.0, np.eye(3))
    events = (Event("shut", at=0.2, switch_off=("tank",)), Event("open", at=0.6, switch_on=("tank",)))
    system = System([body], elements=[Tank("tank", Marker("body"))], events=events)
    motion = integrate(system, GeneralizedAlpha(), 0.8, 1e-3)
    seen = element_motion(system, motion, "tank")
    exponent = np.interp(motion.t, [0, 0.2, 0.6, 0.8], [0, 1.0, 1.2, 2.2])
    assert_allclose(seen.states["level"], np.exp(-exponent), rtol=0, atol=2e-5)
    assert_array_equal(seen.outputs["flow"][(motion.t > 0.2001) & (motion.t < 0.5999)], -1.0)


def test_the_tangent_of_what_is_off_is_exact():
    system = pinned()
    assert_tangent_is_exact(replace(system, elements=[SwitchedOff(system.elements[0])]))
