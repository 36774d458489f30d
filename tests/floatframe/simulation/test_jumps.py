"""A force that jumps keeps its impulse, wherever the jump lies between the steps."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models
from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    JointForce,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    System,
    UserForce,
    integrate,
)
from floatframe.integrators import EnergyMomentum, Ida
from floatframe.joints import JointCoordinate
from floatframe.model.functions.time_functions import constant, piecewise
from floatframe.sensors import AngleSensor, ControlSensor, PlaceSensor, measured
from floatframe.simulation import Event
from floatframe.simulation.jumps import jumps_of_steps
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

H, MASS, FORCE = 0.01, 2.0, 30.0


def pulse(first, last, size=1.0):
    return piecewise([-1.0, first, last], [constant(0.0), constant(size), constant(0.0)])


def struck(first, last, marker=None, body=None):
    body = body or RigidBody("body", MASS, np.eye(3))
    load = PointForce("blow", marker or Marker("body"), (FORCE, 0, 0), amplitude=pulse(first, last))
    return System([body], [], [load])


PULSES = [(0.0123, 0.0456), (0.0201, 0.0203), (0.02, 0.05), (0.011, 0.019), (0.0, 0.03), (0.05, 0.0999)]


@pytest.mark.parametrize(("method", "first", "last"), [
    *((method, *pulse) for method in (GeneralizedAlpha(0.8), EnergyMomentum()) for pulse in PULSES),
    *((Ida(), *pulse) for pulse in PULSES[:2]),
    *(pytest.param(Ida(), *pulse, marks=pytest.mark.long) for pulse in PULSES[2:]),
])  # fmt: skip
def test_the_momentum_is_the_impulse(method, first, last):
    """To 1e-6; the pulse begins and ends in a step, at its ends, within one, at the start."""
    motion = integrate(struck(first, last), method, 0.1, H)
    momentum = MASS * motion.body("body").v[:, 0]
    assert_allclose(momentum[-1], FORCE * (last - first), rtol=1e-6)
    before = motion.t <= first
    assert_allclose(momentum[before], 0.0, atol=1e-6 * FORCE * (last - first))


def test_position_and_work_of_a_pulse_are_exact():
    first, last = 0.0123, 0.0456
    motion = integrate(struck(first, last), GeneralizedAlpha(0.8), 0.1, H)
    speed = FORCE * (last - first) / MASS
    expected = speed * (last - first) / 2 + speed * (0.1 - last)
    assert_allclose(motion.body("body").r[-1, 0], expected, rtol=1e-6)
    assert_allclose(motion.energies.work[-1], MASS * speed**2 / 2, rtol=1e-5)
    assert_allclose(motion.t, H * np.arange(11), rtol=1e-12)


def test_a_flexible_body_keeps_the_impulse_on_its_interface():
    body = FlexibleBody("body", reduced_body(random_point_masses(3, 2), stiffness(3)))
    motion = integrate(struck(0.0123, 0.0456, Marker("body", "end_a"), body), GeneralizedAlpha(0.8), 0.1, H / 10)
    impulse = FORCE * (0.0456 - 0.0123)  # the rest is of second order in h, as without jumps: 4e-5 at H
    assert_allclose(motion.linear_momentum[-1], [impulse, 0, 0], rtol=0, atol=1e-6 * impulse)


def test_a_motor_that_jumps_keeps_its_angular_impulse():
    wheel = RigidBody("wheel", 1.0, np.diag([1.0, 1.0, 0.5]))
    motor = JointForce("motor", "hinge", "angle", motor=pulse(0.0123, 0.0456, 4.0))
    system = System([wheel], [RevoluteJoint("hinge", Marker(GROUND, position=(0, 0, 0)), Marker("wheel"))], [motor])
    motion = integrate(system, GeneralizedAlpha(0.8), 0.1, H)
    assert_allclose(motion.body("wheel").omega_B[-1, 2], 4.0 * (0.0456 - 0.0123) / 0.5, rtol=1e-6)


def test_steps_of_jumps_are_those_they_end_or_lie_in():
    system = struck(0.0123, 0.05)
    assert jumps_of_steps(system, 0.0, H, 10) == {1: [0.0123], 4: [0.05]}
    assert jumps_of_steps(system, 0.02, H, 10) == {2: [0.05]}
    assert jumps_of_steps(struck(0.0, 0.03), 0.0, H, 10) == {2: [0.03]}


def test_a_jump_beside_an_event_keeps_its_impulse():
    sensor = PlaceSensor("place", Marker("body"))
    passing = Event("passing", "place", level=0.005, column="x", record=True)
    system = replace(struck(0.0123, 0.0456), sensors=[sensor], events=[passing])
    motion = integrate(system, GeneralizedAlpha(0.8), 0.1, H)
    assert len(motion.t) == 12  # one of the event
    assert_allclose(MASS * motion.body("body").v[-1, 0], FORCE * (0.0456 - 0.0123), rtol=1e-6)


def test_states_of_user_forces_and_counted_turns_go_on_over_a_jump():
    """The state is the time, the body turns at two turns a second: neither begins anew where the force jumps."""
    body = RigidBody("body", MASS, np.eye(3), omega_B=(0, 0, 4 * np.pi))
    hinge = RevoluteJoint("hinge", GROUND, Marker("body"), (0, 0, 1))
    clock = UserForce("clock", {"phi": JointCoordinate("hinge", "angle")}, {}, {"z": "1"}, {"z": 0.0})
    blow = PointForce("blow", Marker("body"), (FORCE, 0, 0), amplitude=pulse(0.505, 0.6))
    sensors = [ControlSensor("clock", "clock"), AngleSensor("turn", Marker(GROUND), Marker("body"))]
    system = System([body], [hinge], [clock, blow], sensors=sensors)
    found = measured(system, integrate(system, GeneralizedAlpha(), 0.8, H))
    assert_allclose(found["clock"].columns["z"], found["clock"].t, rtol=0, atol=1e-9)
    assert_allclose(found["turn"].columns["angle"], 4 * np.pi * found["turn"].t, rtol=0, atol=1e-6)


def test_a_jump_inside_a_step_is_as_exact_in_joint_coordinates():
    """A free rod is pushed at its end, the push turns round within a step: fine steps in absolute coordinates tell."""
    line = fe_models.beams.BeamLine(1.0, 1.0, 3e5, 300.0, 450.0, 300.0, 1e-3, 1e-3)
    reduced = cms.reduction.beam_from_assumed_modes(
        line, name="rod", units=unit_system("m-kg-s"), n_axial=1, n_bending=2, frame=cms.NodalFrame("start")
    )
    rod = FlexibleBody("rod", reduced, stiffening=False, position=(3.0, -40.0, 7.0), omega_B=(-0.2, 0.5, 0.9))
    h = 0.03
    turned = piecewise([0.0, 7.3 * h], [constant(1.0), constant(-1.0)])
    push = PointForce("push", Marker("rod", "end"), force=(1.0, 2.0, -1.0), amplitude=turned)
    system = System([rod], [], [push])
    fine = integrate(system, GeneralizedAlpha(0.9), 20 * h, h / 32, output_every=640).body("rod").r[-1]
    errors = [
        np.abs(integrate(system, GeneralizedAlpha(0.9), 20 * h, h, formulation=each).body("rod").r[-1] - fine).max()
        for each in ("absolute", "relative")
    ]
    assert errors[1] < 1.5 * errors[0]
