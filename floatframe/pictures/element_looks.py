"""How elements are drawn in films: shapes at their markers, and parts stretched between two markers."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.markers import MarkerData, find_marker
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import body_name
from floatframe.model.elements.element import Element, markers_of
from floatframe.model.shapes import Arrow, MarkerShapes, Piece, Stretched
from floatframe.model.shapes.drawn import SECOND, STRETCH, StretchedPiece
from floatframe.model.system import System
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["drawn_pieces", "dressed_bodies", "element_pieces", "shown_of"]

Placed = tuple[Piece, Array]  #: a piece, and its nodes in ground axes, (n, 3) or (n_frames, n, 3)
COLOR = "#2a7f62"


def shown_of(system: System, element: Element) -> tuple[MarkerShapes | Stretched | Arrow, ...]:
    """Return the drawn parts of an element; default shapes are omitted if its bodies have shapes of their own.

    Raises
    ------
    ModelError
        If a drawn part has another type, or refers to a marker that the element does not have.
    """
    where, markers, found = f"element {element.name!r}", markers_of(element), []
    shapely = {body.name for body in system.bodies if body.shapes}
    for each in element.drawn():
        require_markers(where, each, len(markers))
        if isinstance(each, MarkerShapes) and each.is_default and each.marker is not None:
            if body_name(markers[each.marker].body) in shapely:
                continue
        found.append(each)
    return tuple(found)


def require_markers(where: str, shown: MarkerShapes | Stretched | Arrow, n: int) -> None:
    """Raise `ModelError` unless the drawn parts of an element refer to markers it has."""
    if not isinstance(shown, MarkerShapes | Stretched | Arrow):
        raise ModelError(f"{where}: drawn: expected MarkerShapes, Stretched or Arrow, got {shown!r}")
    numbers = (shown.first, shown.second) if isinstance(shown, Stretched) else (shown.marker,)
    wrong = [number for number in numbers if number is not None and not 0 <= number < n]
    if wrong:
        raise ModelError(f"{where}: drawn: marker {wrong[0]}: expected 0 to {n - 1}, the numbers of its markers")


def dressed_bodies(system: System | None) -> set[str]:
    """Return the names of the bodies on which elements draw shapes, such as wheels of tyres."""
    found = set()
    for element in () if system is None else system.elements:
        for each in shown_of(system, element):  # type: ignore[arg-type]
            if isinstance(each, MarkerShapes) and each.marker is not None:
                found.add(body_name(markers_of(element)[each.marker].body))
    return found


def drawn_pieces(drawn: MarkerShapes, metres: float) -> list[Piece]:
    """Return the pieces of a shape in units of a system whose unit of length has `metres` metres."""
    scale = 1 / metres if drawn.is_in_metres else 1.0
    return [replace(p, nodes=scale * p.nodes, color=p.color or COLOR) for p in drawn.shape.pieces()]


def element_pieces(system: System, trajectory: Trajectory, rows: IntArray) -> list[Placed]:
    """Return the pieces of all elements with their nodes in all frames; load arrows are drawn only in pages.

    A shape on the ground is drawn once, even if several elements have it.
    """
    found: list[Placed] = []
    seen = set()
    for element in system.elements:
        for piece, at in pieces_of(system, trajectory, rows, element):
            key = (piece.color, at.tobytes()) if at.ndim == 2 else None
            if key is None or key not in seen:
                seen.add(key)
                found.append((piece, at))
    return found


def pieces_of(system: System, trajectory: Trajectory, rows: IntArray, element: Element) -> list[Placed]:
    """Return the pieces of an element."""
    shown = shown_of(system, element)
    if not shown:
        return []
    ends = [find_marker(system, f"element {element.name!r}", marker) for marker in markers_of(element)]
    found: list[Placed] = []
    for each in shown:
        if isinstance(each, MarkerShapes):
            end = None if each.marker is None else ends[each.marker]
            for piece in drawn_pieces(each, system.units.length):
                found.append((piece, placed_nodes(system, trajectory, rows, end, piece.nodes)))
        elif isinstance(each, Stretched):
            a, b = (end_motion(system, trajectory, ends[k]).position[rows] for k in (each.first, each.second))
            length = float(np.linalg.norm(b[0] - a[0]))
            if length > 0:
                found += [(part.piece, stretched(part, a, b)) for part in each.pieces(length)]
    return found


def placed_nodes(system: System, trajectory: Trajectory, rows: IntArray, end: MarkerData | None, nodes: Array) -> Array:
    """Return nodes given in the axes of a marker in ground axes: (n, 3) on the ground, else (n_frames, n, 3)."""
    if end is None:
        return nodes
    if end.body < 0:
        return np.asarray(end.shape.position + nodes @ end.shape.triad.T)
    return at_marker(system, trajectory, rows, end, nodes)


def at_marker(system: System, trajectory: Trajectory, rows: IntArray, end: MarkerData, nodes: Array) -> Array:
    """Return nodes given in the axes of a marker in all frames, in ground axes, (n_frames, n, 3)."""
    place = end_motion(system, trajectory, end)
    return np.asarray(place.position[rows][:, None] + np.einsum("tab,nb->tna", place.axes[rows], nodes))


def stretched(part: StretchedPiece, a: Array, b: Array) -> Array:
    """Return the nodes, in all frames, of a part stretched between two points, (n_frames, 3) each: (n_frames, n, 3)."""
    d = b - a
    length = np.linalg.norm(d, axis=1, keepdims=True)
    z = d / np.maximum(length, 1e-300)
    if part.follows == SECOND:
        a, z = b, -z
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z).mean(axis=0)))], z)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
    axes = np.stack([x, np.cross(z, x), z * length if part.follows == STRETCH else z], axis=2)
    return np.asarray(a[:, None] + np.einsum("tab,nb->tna", axes, part.piece.nodes))
