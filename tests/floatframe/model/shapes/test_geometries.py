"""Surfaces of geometries: closed, facing outward, of the volume that formulas give."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import ModelError
from floatframe.model.shapes import (
    GEOMETRIES,
    Box,
    Cylinder,
    Extrusion,
    RailWheel,
    Revolution,
    Road,
    Shape,
    Sphere,
    Stretched,
    Terrain,
    Track,
    Tube,
    Wheel,
)

AROUND = np.sin(2 * np.pi / 48) / (2 * np.pi / 48)  #: area of the polygon of 48 corners by that of its circle
L_PROFILE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]


def volume(piece):
    """Signed volume inside triangles: above 0 where they face outward."""
    a, b, c = (piece.nodes[piece.triangles[:, k]] for k in range(3))
    return np.einsum("na,na->", a, np.cross(b, c)) / 6


def open_edges(piece):
    """Edges that are not met once in each direction, points at one place taken as one."""
    _, same = np.unique(np.round(piece.nodes, 9), axis=0, return_inverse=True)
    t = same.reshape(-1)[piece.triangles]
    edges = [tuple(edge) for edge in np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])]
    return [edge for edge in edges if edges.count(edge) != edges.count(edge[::-1])]


@pytest.mark.parametrize(
    ("geometry", "expected"),
    [
        (Box((1, 2, 3)), 6.0),
        (Cylinder(1, 2), 2 * np.pi * AROUND),
        (Cylinder(1, 2, axis=(1, -1, 2), inner_radius=0.5), 1.5 * np.pi * AROUND),
        (Cylinder(1, 3, end_radius=0), np.pi * AROUND),
        (Revolution([(1, 0), (2, 0), (2, 1), (1, 1)], is_closed=True), 3 * np.pi * AROUND),
        (Extrusion(L_PROFILE, 2, axis=(1, 0, 0)), 6.0),
        (Extrusion(L_PROFILE[::-1], 2, axis=(1, 1, 0)), 6.0),
        (Tube([(0, 0, 0), (0, 0, 2)], 0.1), 0.02 * np.pi * np.sin(np.pi / 8) / (np.pi / 8)),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, float) else "",
)
def test_a_surface_is_closed_faces_outward_and_has_its_volume(geometry, expected):
    (piece,) = geometry.pieces()
    assert_allclose(volume(piece), expected, rtol=1e-12)
    assert open_edges(piece) == []


def test_a_sphere_is_closed_and_nearly_of_its_volume():
    (piece,) = Sphere(2.0).pieces()
    assert open_edges(piece) == []
    assert_allclose(volume(piece), 4 / 3 * np.pi * 8, rtol=0.01)
    assert_allclose(np.linalg.norm(piece.nodes, axis=1), 2.0, rtol=1e-12)


@pytest.mark.parametrize(
    "wheel", [Wheel(0.3, 0.2), RailWheel(0.46), RailWheel(0.46, flange_side=-1), Wheel(0.3, 0.2, axis=(0, 0, 1))]
)
def test_a_wheel_faces_outward_reaches_its_radius_and_is_seen_to_turn(wheel):
    pieces = wheel.pieces()
    assert all(volume(piece) > 0 for piece in pieces[:2])
    nodes = np.concatenate([piece.nodes for piece in pieces])
    across = nodes - np.outer(nodes @ wheel.axis, wheel.axis)
    height = getattr(wheel, "flange_height", 0.0)
    assert_allclose(np.linalg.norm(across, axis=1).max(), wheel.radius + height, rtol=2e-3)
    colors = {piece.color for piece in pieces}
    assert len(colors) >= 3  # a body of one colour, round about its axis, would seem to stand still


def test_the_flange_is_on_the_side_that_is_named():
    for side in (1, -1):
        tyre = RailWheel(0.46, flange_side=side).pieces()[0]
        highest = tyre.nodes[np.linalg.norm(tyre.nodes[:, [0, 2]], axis=1).argmax()]
        assert highest[1] * side > 0


def test_rails_lie_a_gauge_apart_with_their_tops_in_the_points_and_canted():
    points = np.stack([np.linspace(0, 10, 21), np.zeros(21), np.full(21, 0.3)], axis=1)
    rails = Track(points, gauge=1.5, cant=0.15).pieces()[0]
    left, right = rails.nodes[rails.nodes[:, 1] > 0], rails.nodes[rails.nodes[:, 1] < 0]
    angle = np.arcsin(0.1)
    for rail, side in ((left, 1), (right, -1)):
        top = rail[np.argmax(rail @ np.array([0, -np.sin(angle), np.cos(angle)]))]
        assert_allclose(top[2], 0.3 + side * 0.075, atol=0.02 * 0.1725 + 0.18 * 0.1725 * 0.1)
        assert_allclose(top[1], side * 0.75 * np.cos(angle), atol=0.2 * 0.1725)


def test_grounds_face_upwards():
    for geometry in (Terrain([0, 1], [0, 1], np.zeros((2, 2))), Road([(0, 0, 0), (5, 0, 0), (9, 3, 0)], 3.0)):
        piece = geometry.pieces()[0]
        a, b, c = (piece.nodes[piece.triangles[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a)[:, 2] > 0).all()
        assert piece.is_ground


@pytest.mark.parametrize("kind", ["coil", "strut", "rod"])
def test_what_is_stretched_between_markers_reaches_from_one_to_the_other(kind):
    pieces = Stretched(kind, radius=0.05).pieces(2.0)
    for part in pieces:
        z = part.piece.nodes[:, 2]
        assert_allclose(z.min(), 0.0, atol=0.02)
        if part.follows == "stretch":
            assert_allclose(z.max(), 1.0, atol=0.02)
        else:
            assert z.max() > 1.0  # more than half of the length, so that rod and cylinder overlap
        assert volume(part.piece) > 0


def test_a_shape_turns_then_moves_and_colours_its_geometry():
    shape = Shape(Box((2, 1, 1)), position=(5, 0, 0), rotation_vector=(0, 0, np.pi / 2), color="steel", opacity=0.5)
    (piece,) = shape.pieces()
    assert_allclose(np.ptp(piece.nodes, axis=0), (1, 2, 1), rtol=1e-12)
    assert_allclose(piece.nodes.mean(axis=0), (5, 0, 0), atol=1e-12)
    assert (piece.color, piece.opacity) == ("#9aa7b3", 0.5)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: Box((1, 0, 1)), "three edges above 0"),
        (lambda: Cylinder(1, 2, inner_radius=1), "less than the radius"),
        (lambda: Wheel(0.3, 0.2, rim_radius=0.3), "less than the radius 0.3"),
        (lambda: Wheel(0.3, 0.2, n_spokes=2.5), "whole number"),
        (lambda: RailWheel(0.4, flange_side=2), "expected 1, -1 or 0"),
        (lambda: Tube([(0, 0, 0), (0, 0, 0)], 1), "points 1 and 2 are the same"),
        (lambda: Track([(0, 0, 0), (1, 0, 0)], 1.5, cant=2.0), "less than the gauge"),
        (lambda: Terrain([0, 0], [0, 1], np.zeros((2, 2))), "rising"),
        (lambda: Stretched("cable"), "coil, strut, rod, line"),
        (lambda: Shape(Box((1, 1, 1)), color="#12"), "#rrggbb"),
        (lambda: Shape(3), "expected a geometry"),
        (lambda: GEOMETRIES["extrusion"]([(0, 0), (1, 1)], 1), "3 or more"),
    ],
)
def test_bad_numbers_are_refused_with_what_was_expected(made, words):
    with pytest.raises(ModelError, match=words):
        made()
