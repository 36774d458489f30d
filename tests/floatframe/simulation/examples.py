"""Systems, bodies and helpers that several tests share: events, restart."""

import numpy as np
from numpy.testing import assert_array_equal

from floatframe import (
    GROUND,
    FlexibleBody,
    Gravity,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
)
from floatframe.results.sensors import PlaceSensor
from floatframe.results.writer import last_restart
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness


def swing(softness=0.2):
    body = FlexibleBody(
        "body", reduced_body(random_point_masses(3, 5, softness=softness), stiffness(3)), omega_B=(0, 1, 3)
    )
    joint = SphericalJoint("pin", GROUND, Marker("body", "end_b"))
    spring = SpringDamper("stay", Marker(GROUND, position=(2, 0, 1)), Marker("body", "end_a"), 30.0, 0.5)
    return System([body], [joint], [Gravity((0, 0, -9.81)), spring])


class StopHereError(Exception):
    """Raised by a progress callback to end a run."""


def steps_on_record(path):
    """Return after how many steps the run to these results, which was interrupted, will go on."""
    _, record = last_restart(path.with_name(path.name + ".segments"))
    return int(record["n_done"])


def assert_same(one, other):
    assert one.is_complete
    for name in ("t", "position", "euler_parameters", "q", "u", "u_dot", "w", "diagnostics", "drift"):
        assert_array_equal(one.source.read(name), other.source.read(name), err_msg=name)


G = 9.81


def falling(*events, forces=()):
    """Return a block on a vertical guide, let go at rest; the coordinate is its height."""
    block = RigidBody("block", 2.0, np.eye(3))
    guide = PrismaticJoint("guide", Marker(GROUND), Marker("block"), axis=(0, 0, 1))
    sensors = [PlaceSensor("place", Marker("block"), "position")]
    return System([block], [guide], [Gravity((0, 0, -G)), *forces], sensors=sensors, events=events)


def double_pendulum(*events, forces=()):
    """Return two bars in a row, let go horizontally."""
    bodies = [RigidBody("upper", 1.0, 0.1 * np.eye(3), position=(0.5, 0, 0)),
              RigidBody("lower", 2.0, 0.2 * np.eye(3), position=(1.5, 0, 0))]  # fmt: skip
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("upper", position=(-0.5, 0, 0)), axis=(0, 1, 0))
    knee = RevoluteJoint("knee", Marker("upper", position=(0.5, 0, 0)), Marker("lower", position=(-0.5, 0, 0)),
                         axis=(0, 1, 0))  # fmt: skip
    sensors = [PlaceSensor("place", Marker("lower"), "position")]
    return System(bodies, [hinge, knee], [Gravity((0, 0, -G)), *forces], sensors=sensors, events=events)
