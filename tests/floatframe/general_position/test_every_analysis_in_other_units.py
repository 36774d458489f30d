"""Analyses in other units, turned and off the origin: equilibrium, modes, responses and state space are those in SI."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fe_models.foundation.units import unit_system
from floatframe import (
    GROUND,
    Gravity,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    linearize,
    static_equilibrium,
    system_modes,
)
from floatframe.analyses import named_state_space
from floatframe.forces import Bushing
from floatframe.joints import JointCoordinate
from floatframe.sensors import Channel
from tests.floatframe.other_units import Other, in_units

R = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
PLACE = np.array([300.0, -200.0, 150.0])
FREQUENCIES = np.array([0.4, 3.0, 25.0])
K = np.diag([3e4, 2e4, 4e4, 300.0, 200.0, 250.0]) + 50.0
TIP = Marker("arm", position=(0.6, 0, 0))
UNITS = ["mm-t-s", "mm-kg-ms", "in-slinch-s"]


@cache
def system():
    """An arm on a hinge with spring, damper and preload, a stay, and a block that it carries on a bushing."""
    arm = RigidBody("arm", 2.0, np.diag([0.1, 0.12, 0.14]), (0.3, 0.05, 0.02), position=(0.5, -0.2, 0.4))
    block = RigidBody("block", 0.7, np.diag([0.02, 0.03, 0.04]), (0.01, 0.02, 0.03), position=(1.1, -0.1, 0.5))
    hinge = RevoluteJoint("hinge", Marker(GROUND, position=(0.5, -0.2, 0.4)), Marker("arm"), axis=(0.6, 0.8, 0))
    forces = [
        Gravity((0.5, -1.0, -9.81)),
        JointForce("rub", "hinge", "angle", stiffness=60.0, free=0.1, damping=0.3, preload=0.2),
        SpringDamper("stay", Marker(GROUND, position=(0.2, 0.1, 1.5)), TIP, 90.0, 2.0, 0.9),
        Bushing("mount", Marker("arm", position=(0.6, 0.1, 0.1)), Marker("block"), K, 1e-3 * K, preload=np.arange(6.0)),
    ]
    return System([arm, block], [hinge], forces)


INPUTS = (
    Channel("push", Marker("block", position=(0.05, 0, 0.02)), (0.6, 0, 0.8)),
    Channel("turn", Marker("block"), (0, 0.6, 0.8), "rotation"),
    JointCoordinate("hinge", "angle", "torque", rate=0),
)
OUTPUTS = (
    Channel("rate", TIP, (0, 1, 0), rate=1),
    JointCoordinate("hinge", "angle", "angle", rate=0),
    Channel("acceleration", Marker("block"), (1, 0, 0), rate=2),
)
GIVEN, SEEN = ("N", "N m", "N m"), ("m/s", "rad", "m/s^2")


@cache
def analysed(units):
    """Return equilibrium, modes, responses and state space in units; of the moved system unless these are SI."""
    other = Other(unit_system(units))
    is_si = units == "m-kg-s"
    whole = system() if is_si else in_units(system(), other.units, R, PLACE)
    channels = INPUTS, OUTPUTS
    if not is_si:
        channels = tuple(tuple(turned(other.part(each)) for each in group) for group in channels)
    inputs, outputs = channels
    at_rest = static_equilibrium(whole)
    linear = linearize(whole, at_rest, inputs=inputs, outputs=outputs)
    frequencies = FREQUENCIES * other.factor("Hz")
    return at_rest, system_modes(linear).eigenvalues, linear.response(frequencies), named_state_space(linear)


def turned(channel):
    """Return a channel whose direction is in ground axes, turned with the system; coordinates have none."""
    return replace(channel, direction=R @ channel.direction) if isinstance(channel, Channel) else channel


@pytest.mark.parametrize("units", UNITS)
def test_equilibria_are_alike_in_other_units_and_elsewhere(units):
    a, b, other = analysed("m-kg-s")[0], analysed(units)[0], Other(unit_system(units))
    assert_allclose((b.state.r / other.factor("m") - PLACE) @ R, a.state.r, rtol=0, atol=1e-8)


@pytest.mark.parametrize("units", UNITS)
def test_modes_and_state_spaces_are_alike_in_other_units_and_elsewhere(units):
    (_, modes, _, space), (_, found, _, other_space) = analysed("m-kg-s"), analysed(units)
    factor = Other(unit_system(units)).factor("Hz")
    scale = np.abs(modes).max()
    assert_allclose(np.sort_complex(found / factor), np.sort_complex(modes), rtol=0, atol=1e-7 * scale)
    poles = np.sort_complex(np.linalg.eigvals(other_space.A)) / factor
    assert_allclose(poles, np.sort_complex(np.linalg.eigvals(space.A)), rtol=0, atol=1e-7 * scale)
    assert other_space.states == space.states


@pytest.mark.parametrize("units", UNITS)
def test_frequency_responses_are_alike_in_other_units_and_elsewhere(units):
    a, b, other = analysed("m-kg-s")[2], analysed(units)[2], Other(unit_system(units))
    for i, seen in enumerate(SEEN):
        for k, given in enumerate(GIVEN):
            factor = other.factor(seen) / other.factor(given)
            assert_allclose(b[:, i, k] / factor, a[:, i, k], rtol=1e-7, atol=1e-9 * np.abs(a[:, i, k]).max())
