"""A picture of the faces of a CAD file from two opposite sides, with the number of each visible face."""

import os
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from cms.assessment.rendering import Drawing, Scene, Surface, Triad, render_picture
from cms.assessment.rendering.annotations import layout_of
from cms.assessment.rendering.camera import fitted_camera
from cms.assessment.report.view import view_axes
from fe_models.files.cad.cad_surface import CadSurface
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["draw_faces", "visible_points"]

COLOURS = ("#a9c4de", "#e8c39e", "#b5d6a7", "#d9b3d1", "#e5dc9a", "#a8d5d1", "#e0aaa5", "#c2bbe0", "#cdbfa8", "#b6c9c0")
CHOSEN, OTHERS = "#e07b39", "#d5dbe0"
EDGEWISE = 0.05  #: cosine between normal and line of sight below which a triangle counts as invisible
TRIED = 60  #: number of triangles of a face that are tried as a place for its number
SIZE = (1000, 800)  #: width and height of each of the two views [px]


def draw_faces(surface: CadSurface, path: str | Path, *, chosen: Iterable[int] = ()) -> Drawing:
    """Draw all faces with their numbers into a PNG file, in two views side by side.

    Parameters
    ----------
    surface
        Part with triangles on its faces.
    path
        Name of the file; ends in .png.
    chosen
        Numbers of faces to highlight; only these are numbered. Empty: all faces are numbered.
    """
    from PIL import Image

    target = Path(path)
    direction, up = view_axes(surface.nodes)
    wanted = set(chosen)
    with tempfile.TemporaryDirectory(prefix=".faces-", dir=target.parent) as folder:
        sides = [Path(folder) / "first.png", Path(folder) / "second.png"]
        drawings = [
            render_picture(_scene(surface, towards, up, wanted, words), side)
            for towards, words, side in ((direction, "", sides[0]), (-direction, ", from behind", sides[1]))
        ]
        images = [Image.open(side) for side in sides]
        both = Image.new("RGB", (sum(image.width for image in images), images[0].height))
        both.paste(images[0], (0, 0))
        both.paste(images[1], (images[0].width, 0))
        for image in images:
            image.close()
        whole = Path(folder) / target.name
        both.save(whole)
        os.replace(whole, target)
    return Drawing(target, drawings[0].backend, drawings[0].note)


def _scene(surface: CadSurface, direction: Array, up: Array, chosen: set[int], words: str) -> Scene:
    part = surface.part
    size = float(np.linalg.norm(part.hi - part.lo))
    symbol = part.units.length_symbol
    extent = " x ".join(f"{x:.5g}" for x in part.hi - part.lo)
    scene = Scene(
        surfaces=tuple(
            Surface(rows, surface.nodes, color=_colour(number, chosen), name=f"face {number}")
            for number, rows in surface.triangles.items()
        ),
        title=f"{part.path.name}: faces{words}",
        captions=(part.description, f"{extent} {symbol}"),
        direction=direction,
        up=up,
        size=SIZE,
    )
    eye = fitted_camera(scene, layout_of(scene).view[2:]).eye
    points = visible_points(surface.nodes, surface.triangles, eye)
    labels = [
        Triad(point, np.eye(3), size=1e-6 * size, label=str(number))
        for number, point in points.items()
        if not chosen or number in chosen
    ]
    return replace(scene, triads=tuple(labels))


def _colour(number: int, chosen: set[int]) -> str:
    if chosen:
        return CHOSEN if number in chosen else OTHERS
    return COLOURS[(number - 1) % len(COLOURS)]


def visible_points(nodes: Array, triangles: dict[int, IntArray], eye: Array) -> dict[int, Array]:
    """Return for each visible face the centre of one of its visible triangles, near the centre of the face.

    Parameters
    ----------
    nodes
        Node positions, (n_nodes, 3).
    triangles
        Triangles of each face by its number, (n, 3).
    eye
        Position of the eye, (3,).
    """
    corners = nodes[np.concatenate(list(triangles.values()))]
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    found = {}
    for number, rows in triangles.items():
        X = nodes[rows]
        middles = X.mean(axis=1)
        towards = (eye - middles) / np.linalg.norm(eye - middles, axis=1, keepdims=True)
        facing = np.abs(np.einsum("na,na->n", _unit_normals(X), towards))
        away = np.linalg.norm(middles - middles.mean(axis=0), axis=1)
        order = np.argsort(away / max(float(away.max()), 1e-300) - facing, kind="stable")
        for k in (*order[:TRIED], *order[TRIED :: max(1, len(order) // TRIED)]):
            if facing[k] > EDGEWISE and not _is_hidden(middles[k] + 1e-5 * size * towards[k], eye, corners):
                found[number] = middles[k]
                break
    return found


def _unit_normals(X: Array) -> Array:
    normals = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))


def _is_hidden(point: Array, eye: Array, corners: Array) -> bool:
    """Return whether a triangle, corners (n, 3, 3), hides a point: p + t (e - p) = a + u (b - a) + v (c - a)."""
    towards = eye - point
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(towards, edge_2)
    det = np.einsum("na,na->n", edge_1, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        arm = point - corners[:, 0]
        u = np.einsum("na,na->n", arm, across) / det
        turned = np.cross(arm, edge_1)
        v = turned @ towards / det
        t = np.einsum("na,na->n", edge_2, turned) / det
        return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)).any())
