"""What elements show of themselves in films: shapes at their markers, parts stretched between two of them."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.compiling.markers import MarkerData, find_marker
from floatframe.elements.element import Element, markers_of
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.trajectory import Trajectory
from floatframe.shapes import Drawn, Piece, Stretched
from floatframe.shapes.drawn import SECOND, STRETCH, StretchedPiece
from floatframe.system import System

__all__ = ["element_pieces"]

Placed = tuple[Piece, Array]  #: a piece, and its nodes in ground axes, (n, 3) or (n_frames, n, 3)
COLOR = "#2a7f62"


def element_pieces(system: System, trajectory: Trajectory, rows: IntArray) -> list[Placed]:
    """Return the pieces of all elements with their nodes over the frames; arrows of loads are left to pages."""
    return [each for element in system.elements for each in pieces_of(system, trajectory, rows, element)]


def pieces_of(system: System, trajectory: Trajectory, rows: IntArray, element: Element) -> list[Placed]:
    """Return the pieces of an element."""
    shown = tuple(element.drawn())
    if not shown:
        return []
    ends = [find_marker(system, f"element {element.name!r}", marker) for marker in markers_of(element)]
    found: list[Placed] = []
    for each in shown:
        if isinstance(each, Drawn):
            for piece in each.shape.pieces():
                coloured = piece if piece.color else replace(piece, color=COLOR)
                found.append((coloured, piece.nodes if each.marker is None else
                              at_marker(system, trajectory, rows, ends[each.marker], piece.nodes)))  # fmt: skip
        elif isinstance(each, Stretched):
            a, b = (end_motion(system, trajectory, ends[k]).position[rows] for k in (each.first, each.second))
            length = float(np.linalg.norm(b[0] - a[0]))
            if length > 0:
                found += [(part.piece, stretched(part, a, b)) for part in each.pieces(length)]
    return found


def at_marker(system: System, trajectory: Trajectory, rows: IntArray, end: MarkerData, nodes: Array) -> Array:
    """Return nodes in the axes of a marker over the frames, ground axes, (n_frames, n, 3)."""
    place = end_motion(system, trajectory, end)
    return np.asarray(place.position[rows][:, None] + np.einsum("tab,nb->tna", place.axes[rows], nodes))


def stretched(part: StretchedPiece, a: Array, b: Array) -> Array:
    """Return the nodes of a part between two points, (n_frames, 3) each, over the frames, (n_frames, n, 3)."""
    d = b - a
    length = np.linalg.norm(d, axis=1, keepdims=True)
    z = d / np.maximum(length, 1e-300)
    if part.follows == SECOND:
        a, z = b, -z
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z).mean(axis=0)))], z)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
    axes = np.stack([x, np.cross(z, x), z * length if part.follows == STRETCH else z], axis=2)
    return np.asarray(a[:, None] + np.einsum("tab,nb->tna", axes, part.piece.nodes))
