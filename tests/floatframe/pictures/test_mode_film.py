"""Films of system modes: what moves in them is the mode, about the equilibrium."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

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
    linearize,
    system_modes,
)
from floatframe.errors import ModelError, ResultsError
from floatframe.forces import Bushing
from floatframe.pictures.body_colors import VON_MISES
from floatframe.pictures.glyphs import BUSHING_COLOR, JOINT_COLOR, SPRING_COLOR
from floatframe.pictures.mode_film import mode_scene
from tests.floatframe.cli.examples import PENDULUM
from tests.floatframe.command import run_floatframe
from tests.synthetic import synthetic_reduced_body

QUARTERS = np.exp(0.5j * np.pi * np.arange(4))


def test_pendulum_swings_about_its_hinge_to_both_sides_of_where_it_hangs():
    rod = RigidBody("rod", 2.0, np.diag([1e-3, 0.2, 0.2]), center_of_mass=(0.5, 0, 0))
    hinge = RevoluteJoint("hinge", GROUND, Marker("rod"), axis=(0, 0, 1))
    system = System([rod], [hinge], [Gravity((0, -9.81, 0))])
    linear = linearize(system)
    scene = mode_scene(system, linear.equilibrium, system_modes(linear), 1, QUARTERS)
    box, ghost = scene.surfaces
    centers = box.nodes.mean(axis=1)
    assert_allclose(np.linalg.norm(centers, axis=1), 0.5, rtol=1e-12)  # it turns about the hinge
    assert_allclose(centers[[1, 3]], [[0, -0.5, 0]] * 2, rtol=0, atol=1e-9)
    assert_allclose(centers[0] * [-1, 1, 1], centers[2], rtol=0, atol=1e-9)
    assert 0.01 < abs(centers[0, 0]) < 0.3
    assert_allclose(ghost.nodes.mean(axis=0), [0, -0.5, 0], rtol=0, atol=1e-9)
    assert_allclose(box.scalars.max(), 1, rtol=1e-12)
    assert_allclose(box.scalars[1], 0, rtol=0, atol=1e-9)
    # the displacement of a point grows with its distance from the hinge
    distance = np.linalg.norm(box.nodes[1][:, :2], axis=1)
    assert_allclose(box.scalars[0], distance / distance.max(), rtol=1e-6)
    assert "0.5958 Hz" in scene.title
    assert "rod 100 %" in scene.captions[0]


def test_flexible_body_moves_by_frame_and_modes_together():
    reduced = synthetic_reduced_body()
    pin = SphericalJoint("pin", GROUND, Marker("part", reduced.interfaces[0].name))
    system = System([FlexibleBody("part", reduced)], [pin], units=reduced.units)
    linear = linearize(system)
    modes = system_modes(linear)
    number = len(modes.eigenvalues)
    scene = mode_scene(system, linear.equilibrium, modes, number, QUARTERS)
    nodes = scene.surfaces[0].nodes
    rest = nodes[1]
    assert_allclose(nodes[0] - rest, -(nodes[2] - rest), rtol=0, atol=0.05 * np.abs(nodes[0] - rest).max())
    moved = np.linalg.norm(nodes[0] - rest, axis=1)
    assert_allclose(scene.surfaces[0].scalars[0], moved / moved.max(), rtol=0, atol=0.02)
    with pytest.raises(ModelError, match=f"expected 1 to {number}"):
        mode_scene(system, linear.equilibrium, modes, number + 1, QUARTERS)
    if reduced.stress is None:
        with pytest.raises(ResultsError, match="contains no stress modes"):
            mode_scene(system, linear.equilibrium, modes, 1, QUARTERS, color=VON_MISES)


def test_eig_draws_modes_into_films_and_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr("floatframe.pictures.mode_film.N_FRAMES", 3)
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM)

    def modes(*words, code=0):
        result = run_floatframe("modes", path, *words, code=code)
        return " ".join(result.output.split())

    assert "pendulum.mode1.gif" in modes("--animate", 1)
    assert (tmp_path / "pendulum.mode1.gif").read_bytes().startswith(b"GIF8")
    modes("-a", 1, "-o", tmp_path / "one.png")
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")
    assert "expected 1 to 1, the modes" in modes("-a", 4, code=2)
    assert "--animate with the number of one mode" in modes("-o", tmp_path / "x.gif", code=2)
    assert "did you mean 'von-mises'" in modes("-a", 1, "--color", "von-mise", code=2)


def test_joints_springs_and_bushings_are_drawn_and_move_with_the_mode():
    """A disc on a bushing beside one on a spring: what is drawn ends at their markers in every frame."""
    one = RigidBody("one", 1.0, np.eye(3), position=(1.0, 0, 0))
    two = RigidBody("two", 1.5, np.eye(3), position=(2.0, 0, 0))
    mount = Bushing("mount", GROUND, Marker("one"), [900.0, 500, 400, 50, 60, 70])
    coil = SpringDamper("coil", Marker("one"), Marker("two"), 300.0, 0.0)
    guide = PrismaticJoint("guide", GROUND, Marker("two"), axis=(1, 0, 0))
    system = System([one, two], [guide], [mount, coil])
    linear = linearize(system)
    modes = system_modes(linear)
    moving = 0
    for number in range(1, len(modes.eigenvalues) + 1):
        scene = mode_scene(system, linear.equilibrium, modes, number, QUARTERS)
        assert {JOINT_COLOR, SPRING_COLOR, BUSHING_COLOR} <= {line.color for line in scene.lines}
        (spring,) = (line for line in scene.lines if line.color == SPRING_COLOR)
        for frame in range(4):
            ends, bodies = spring.points[frame][[0, -1]], scene.surfaces[::2]
            assert_allclose(ends, [body.nodes[frame].mean(axis=0) for body in bodies], rtol=0, atol=1e-6)
        moving += np.ptp(spring.points, axis=0).max() > 0.01
    assert moving >= 3  # along the line, and the block across it in both directions
