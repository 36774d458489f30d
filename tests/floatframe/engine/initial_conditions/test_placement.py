"""Bodies placed far from their joints are told or refused, never closed silently."""

import logging

import numpy as np
import pytest

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    static_equilibrium,
)
from floatframe.analyses import consistent_state
from floatframe.errors import ModelError
from floatframe.model.forces import Gravity
from floatframe.model.functions.time_functions import constant
from floatframe.sensors import PlaceSensor, measured
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

LINK = np.diag([0.01, 0.1, 0.1])


def link(away, **options):
    """Return a link of 1 m on a hinge at the origin, placed `away` from it."""
    body = RigidBody("link", 1.0, LINK, position=(0.5 + away, 0.0, 0.0))
    post = Marker(GROUND, position=(0.0, 0.0, 0.0))
    joint = RevoluteJoint("hinge", post, Marker("link", position=(-0.5, 0.0, 0.0)), **options)
    return System([body], [joint], [Gravity((0, -9.81, 0))])


def test_a_body_beside_its_joint_is_closed_in_silence(caplog):
    with caplog.at_level(logging.WARNING):
        consistent_state(link(0.01))
    assert caplog.text == ""


@pytest.mark.parametrize("begin", [consistent_state, static_equilibrium])
def test_a_body_half_its_length_away_is_told(caplog, begin):
    with caplog.at_level(logging.WARNING):
        begin(link(0.5))
    assert "body 'link' was placed 0.5 from the position that its joints require, 1 of its size" in caplog.text


def test_a_body_far_out_of_reach_is_refused():
    told = r"body 'link' was placed 30 from the position that its joints require.*size of 0.5"
    with pytest.raises(ModelError, match=told):
        consistent_state(link(30.0))


def test_a_flexible_body_far_out_of_reach_is_refused():
    reduced = reduced_body(random_point_masses(3, 2), stiffness(3))
    body = FlexibleBody("arm", reduced, position=(30.0, 0.0, 0.0))
    system = System([body], [RevoluteJoint("pin", Marker(GROUND, position=(0, 0, 0)), Marker("arm", "end_a"))])
    with pytest.raises(ModelError, match=r"body 'arm' was placed .* from the position that its joints require"):
        integrate(system, GeneralizedAlpha(), 1e-3, 1e-3)


def test_a_drive_may_turn_a_body_far_at_its_start(caplog):
    with caplog.at_level(logging.WARNING):
        consistent_state(link(0.0, motions={"angle": constant(1.0)}))
    assert "was placed 0.479 from" in caplog.text  # the chord of one radian at 0.5 m


@pytest.mark.parametrize(
    ("offset", "tolerance", "is_refused"),
    [(0.0, 0.0, False), (0.05, 1e-3, True), (0.05, 0.03, False), (5.0, 0.1, True)],
)
def test_a_sensor_beside_the_kept_nodes_is_refused(offset, tolerance, is_refused):
    reduced = reduced_body(random_point_masses(3, 2), stiffness(3))
    system = System([FlexibleBody("arm", reduced)])
    motion = integrate(system, GeneralizedAlpha(), 1e-3, 1e-3)
    sensor = PlaceSensor("place", Marker("arm", position=reduced.nodes[4] + [0.0, offset, 0.0], tolerance=tolerance))
    if is_refused:
        with pytest.raises(ModelError, match=r"body 'arm': no kept node is at .* nearest: node index"):
            measured(system, motion, [sensor])
    else:
        assert np.isfinite(measured(system, motion, [sensor])["place"].columns["x"]).all()
