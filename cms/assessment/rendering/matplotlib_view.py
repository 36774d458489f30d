"""Views drawn by matplotlib, if there is no OpenGL: faces sorted from far to near, each with one shade."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from cms.assessment.rendering.camera import Camera
from cms.assessment.rendering.film import Image, average_of_blocks
from cms.assessment.rendering.light import lit
from cms.assessment.rendering.scene import Lines, Scene, Surface, frame_of
from cms.assessment.rendering.shape import FEATURE_ANGLE, colormap, rgb_of, surface_edges, triangle_normals
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["matplotlib_view", "smooth_neighbours"]

#: size of the drawing before averaging divided by the final size; smoothing by matplotlib would show seams of faces
OVERSAMPLING = 2


def matplotlib_view(scene: Scene, camera: Camera) -> Callable[[int], Image]:
    """Return a function that draws a frame as (height, width, 3) uint8."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.figure import Figure

    width, height = camera.size
    dpi = 100.0
    figure = Figure(figsize=(OVERSAMPLING * width / dpi, OVERSAMPLING * height / dpi), dpi=dpi)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    drawn = [DrawnSurface(surface, scene) for surface in scene.surfaces]

    def draw(frame: int) -> Image:
        axes.clear()
        axes.set(xlim=(0, width), ylim=(height, 0))
        axes.axis("off")
        figure.set_facecolor(rgb_of(scene.background))
        for lines in scene.lines:
            if lines.is_backdrop:
                axes.add_collection(line_collection(LineCollection, lines, camera, frame))
        parts = [surface.polygons(camera, frame) for surface in drawn]
        depth = np.concatenate([part[0] for part in parts]) if parts else np.zeros(0)
        if len(depth):
            polygons, faces, edges, widths = (np.concatenate([part[k] for part in parts]) for k in range(1, 5))
            order = np.argsort(-depth)
            axes.add_collection(PolyCollection(
                list(polygons[order]), facecolors=faces[order], edgecolors=edges[order],
                linewidths=OVERSAMPLING * widths[order], antialiaseds=False,
            ))  # fmt: skip
        for lines in scene.lines:
            if not lines.is_backdrop:
                axes.add_collection(line_collection(LineCollection, lines, camera, frame))
        canvas.draw()
        return average_of_blocks(np.asarray(canvas.buffer_rgba()), OVERSAMPLING)

    return draw


class DrawnSurface:
    """Surface with data that all frames share: sharp edges, and smoothing of faces."""

    def __init__(self, surface: Surface, scene: Scene) -> None:
        self.surface = surface
        rest = surface.nodes_at(0)
        self.smoothing = smooth_neighbours(rest, surface.triangles)
        self.edges, self.beside, self.is_sharp = surface_edges(rest, surface.triangles)
        # the inside of a closed surface is never visible
        self.is_closed = bool((self.beside[:, 0] != self.beside[:, 1]).all())
        self.limits = scene.color_limits if surface.scalars is not None else (0.0, 1.0)
        self.color = np.array(rgb_of(surface.color))

    def polygons(self, camera: Camera, frame: int) -> tuple[Array, Array, Array, Array, Array]:
        """Return depth (n,), corners (n, 3, 2), face and edge colours (n, 4), edge widths (n,) of all faces and edges.

        A translucent surface is drawn as an outline here, because seams between translucent faces would show.
        """
        surface, triangles = self.surface, self.surface.triangles
        nodes = surface.nodes_at(frame)
        seen = camera.project(nodes)
        normals = triangle_normals(nodes, triangles)
        faces_eye = np.einsum("ta,ta->t", normals, camera.eye - nodes[triangles[:, 0]]) > 0
        is_solid = surface.opacity == 1
        edge_shown = self.is_sharp & surface.has_edges
        if is_solid:
            edge_shown = edge_shown & faces_eye[self.beside].any(axis=1)
        else:
            edge_shown = edge_shown | (faces_eye[self.beside[:, 0]] != faces_eye[self.beside[:, 1]])
        shown = np.flatnonzero(is_solid & (faces_eye | (not self.is_closed)))
        ends = self.edges[edge_shown]
        rgba = self.shaded(normals, faces_eye, camera, frame)[shown]
        edge_depth = seen[ends, 2].mean(axis=1) - 0.004 * camera.distance  # edges are drawn in front of their faces
        edge_color = np.tile([0.13, 0.18, 0.22, 0.75 if is_solid else 0.32], (len(ends), 1))
        return (
            np.concatenate([seen[triangles[shown], 2].mean(axis=1), edge_depth]),
            np.concatenate([seen[triangles[shown], :2], seen[ends[:, [0, 1, 1]], :2]]),
            np.concatenate([rgba, np.zeros((len(ends), 4))]),
            np.concatenate([rgba, edge_color]),
            np.concatenate([np.full(len(rgba), 0.35), np.full(len(ends), 0.75)]),
        )

    def shaded(self, normals: Array, faces_eye: Array, camera: Camera, frame: int) -> Array:
        """Return the colours of all triangles with lighting, (n_triangles, 4)."""
        shading = self.smoothing @ normals
        shading /= np.maximum(np.linalg.norm(shading, axis=1, keepdims=True), 1e-300)
        shading = np.where(faces_eye[:, None], shading, -shading) @ camera.towards_eye.T
        rgb = lit(self.face_colors(frame), shading, shows_numbers=self.surface.scalars is not None)
        return np.concatenate([rgb, np.ones((len(rgb), 1))], axis=1)

    def face_colors(self, frame: int) -> Array:
        """Return the unlit colour of each triangle, (n_triangles, 3)."""
        if self.surface.scalars is None:
            return np.tile(self.color, (len(self.surface.triangles), 1))
        low, high = self.limits
        values = frame_of(self.surface.scalars, frame, 1)[self.surface.triangles].mean(axis=1)
        return colormap()[np.clip((values - low) / (high - low) * 255.999, 0, 255).astype(int)]


def line_collection(kind: Any, lines: Lines, camera: Camera, frame: int) -> Any:
    """Return the segments of a frame as a collection, without segments that begin behind the eye."""
    seen = camera.project(lines.points_at(frame))[lines.segments]
    seen = seen[(seen[..., 2] > 0).all(axis=1)]
    return kind(seen[..., :2], colors=lines.color, linewidths=OVERSAMPLING * lines.width * 0.72, alpha=lines.opacity)


def smooth_neighbours(nodes: Array, triangles: IntArray) -> sp.csr_array:
    """Return the matrix that sums, for each triangle, area normals of neighbours at less than the feature angle.

    It is (n_triangles, n_triangles), with entries 0 and 1, and includes the triangle itself.
    """
    n = len(triangles)
    corner = sp.csr_array((np.ones(3 * n), (np.repeat(np.arange(n), 3), triangles.ravel())), shape=(n, len(nodes)))
    touch = sp.coo_array(corner @ corner.T)
    normals = triangle_normals(nodes, triangles)
    rows, columns = touch.row, touch.col
    near = np.einsum("ea,ea->e", normals[rows], normals[columns]) > np.cos(FEATURE_ANGLE)
    near |= rows == columns
    return sp.csr_array((np.ones(near.sum()), (rows[near], columns[near])), shape=(n, n))
