"""Glyphs of joints, springs and bushings: they stand at their markers in every frame, and boxes reach connections."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, Marker, RigidBody, integrate
from floatframe.pictures.animation import motion_scene
from floatframe.pictures.film_times import film_times
from floatframe.pictures.glyphs import BUSHING_COLOR, JOINT_COLOR, SPRING_COLOR, glyphs
from floatframe.pictures.stage import box_of
from floatframe.sensors import PlaceSensor, measured
from tests.floatframe.analyses.examples import machine

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def swing():
    system = machine()
    return system, integrate(system, GeneralizedAlpha(0.8), 0.1, 2e-3, output_every=10)


def test_springs_and_bushings_lie_between_their_markers(swing):
    system, motion = swing
    rows = np.arange(len(motion.t))
    lines = glyphs(system, motion, rows, 1.0, 1.0, UP)
    found = measured(system, motion, [PlaceSensor("end", Marker("arm", "end_a")),
                                      PlaceSensor("block", Marker("block", position=(-0.1, 0, 0.05)))])  # fmt: skip
    end, other = (np.column_stack([found[name].columns[x] for x in "xyz"]) for name in ("end", "block"))
    coil = next(line for line in lines if line.color == SPRING_COLOR and line.points.shape[1] > 50)
    ends = (coil.points[:, 0] + coil.points[:, -1]) / 2  # coil and damper lie beside the line, by the same way
    assert np.linalg.norm(ends - (end + np.array([0.0, 3.0, 2.0])) / 2, axis=1).max() < 0.05
    link = next(line for line in lines if line.color == BUSHING_COLOR and line.points.shape[1] == 2)
    assert_allclose(link.points[:, 0], end, rtol=0, atol=1e-9)
    assert_allclose(link.points[:, 1], other, rtol=0, atol=1e-9)


def test_a_ring_stands_about_the_axis_of_its_hinge(swing):
    system, motion = swing
    lines = glyphs(system, motion, np.arange(len(motion.t)), 1.0, 1.0, UP)
    ring = next(line for line in lines if line.color == JOINT_COLOR and line.points.shape[1] > 20)
    middle = ring.points[:, :-1].mean(axis=1)
    assert_allclose(ring.points[..., 1], np.broadcast_to(middle[:, 1:2], ring.points.shape[:2]), atol=1e-12)
    assert_allclose(np.linalg.norm(ring.points - middle[:, None], axis=2), 0.022, rtol=1e-9)


def test_a_film_of_a_known_system_has_its_glyphs(swing):
    system, motion = swing
    bodies = {body.name: getattr(body, "reduced", body) for body in system.bodies}
    times = film_times(motion.t, fps=25.0, speed=1.0, n_nodes=100)
    scenes = [motion_scene(motion, bodies, times, system=known) for known in (None, system)]
    colors = [{line.color for line in scene.lines} for scene in scenes]
    assert not {SPRING_COLOR, BUSHING_COLOR, JOINT_COLOR} & colors[0]
    assert {SPRING_COLOR, BUSHING_COLOR, JOINT_COLOR} <= colors[1]


def test_a_box_is_bounded_but_reaches_the_connections_of_its_body():
    heavy = RigidBody("heavy", 1.0, np.diag([50.0, 60.0, 70.0]))
    free = box_of(heavy, 0.1)[0]
    assert np.abs(free).max() > 5.0
    assert_allclose(np.abs(box_of(heavy, 0.1, 0.5)[0]).max(), 0.5)
    reaching = np.abs(box_of(heavy, 0.1, 0.5, np.array([[0.0, 2.0, 0.0]]))[0]).max(axis=0)
    assert_allclose(reaching, [0.5, 2.0, 0.5])
