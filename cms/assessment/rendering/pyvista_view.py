"""Views drawn off-screen by pyvista (VTK, OpenGL), only in the worker process: VTK without OpenGL can crash.

Parts that look alike are drawn as one mesh, which is made once. A frame writes the new positions and colours into its
arrays. Without a graphics card most of the time goes into the lighting of pixels, so faces of one colour are lit here.
"""

from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from cms.assessment.rendering.camera import VIEW_ANGLE, Camera
from cms.assessment.rendering.film import Image, average_of_blocks
from cms.assessment.rendering.light import GLOSS, LIGHTS, ambient, diffuse, lit
from cms.assessment.rendering.scene import Lines, Scene, Surface, frame_of
from cms.assessment.rendering.shape import colormap, surface_edges, triangle_normals
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["pyvista_view"]

OVERSAMPLING = 2  #: size of the drawing before averaging divided by the final size, which smooths edges
EDGE_COLOR = "#212d38"
FRONT = 1  #: the buffer of a window that is read

Part = TypeVar("Part", Surface, Lines)


def pyvista_view(scene: Scene, camera: Camera) -> Callable[[int], Image]:
    """Return a function that draws a frame as (height, width, 3) uint8."""
    import pyvista
    from matplotlib.colors import ListedColormap

    size = [OVERSAMPLING * n for n in camera.size]
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=size, lighting="none")
    plotter.set_background(scene.background)
    plotter.disable_anti_aliasing()
    plotter.render_window.SetMultiSamples(0)
    if hasattr(plotter.renderer, "SetUseOIT"):  # sorting translucent pixels takes as long as all the rest
        plotter.renderer.SetUseOIT(False)
    for towards, strength in LIGHTS:
        place = tuple(towards.tolist())
        light = pyvista.Light(position=place, focal_point=(0, 0, 0), light_type="camera light", intensity=strength)
        plotter.add_light(light)
    colors = ListedColormap(colormap())
    updates = []
    for group in alike(scene.surfaces, look_of_surface):
        add = add_plain if group[0].scalars is None else partial(add_colored, limits=scene.color_limits, colors=colors)
        updates.append(add(plotter, group, camera))
    updates += [add_lines(plotter, group) for group in alike(scene.lines, look_of_lines)]
    view = plotter.camera
    view.position, view.focal_point, view.up = camera.eye, camera.focal_point, camera.axes[1]
    view.view_angle = VIEW_ANGLE
    plotter.show(auto_close=False)

    def draw(frame: int) -> Image:
        for update in updates:
            update(frame)
        plotter.reset_camera_clipping_range()
        plotter.render()
        return average_of_blocks(pixels_of(plotter.render_window), OVERSAMPLING)[::-1]

    return draw


def pixels_of(window: Any) -> Image:
    """Return the pixels that a window has drawn, from its lowest row upwards, (height, width, 3) uint8."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

    width, height = window.GetActualSize()
    pixels = vtkUnsignedCharArray()
    window.GetPixelData(0, 0, width - 1, height - 1, FRONT, pixels, 0)
    return np.asarray(vtk_to_numpy(pixels)).reshape(height, width, 3)


def look_of_surface(surface: Surface) -> Hashable:
    """Return what surfaces of one mesh have in common."""
    has_scalars = surface.scalars is not None
    return surface.n_frames, has_scalars, "" if has_scalars else surface.color, surface.opacity, surface.has_edges


def look_of_lines(lines: Lines) -> Hashable:
    """Return what lines of one mesh have in common."""
    return lines.n_frames, lines.color, lines.width, lines.opacity


def alike(parts: Sequence[Part], look: Callable[[Part], Hashable]) -> list[list[Part]]:
    """Return the parts in groups of equal look, in the order of their first parts."""
    groups: dict[Hashable, list[Part]] = {}
    for part in parts:
        groups.setdefault(look(part), []).append(part)
    return list(groups.values())


def add_plain(plotter: Any, surfaces: Sequence[Surface], camera: Camera) -> Callable[[int], None]:
    """Add surfaces of one colour with their sharp edges; return the function that updates them for a frame."""
    from matplotlib.colors import to_rgb

    moved, nodes, triangles = surface_mesh(surfaces)
    mesh, color = moved[0], np.array(to_rgb(surfaces[0].color))

    def shades(points: Array) -> Image:
        normals = triangle_normals(points, triangles) @ camera.towards_eye.T
        normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)  # both sides are lit
        return np.asarray(255 * lit(color, normals, shows_numbers=False), dtype=np.uint8)

    mesh.cell_data["shades"] = shades(nodes(0))
    plotter.add_mesh(mesh, scalars="shades", rgb=True, lighting=False, opacity=surfaces[0].opacity)
    add_edges(plotter, surfaces[0], moved[1:])

    def update(frame: int) -> None:
        if surfaces[0].n_frames > 1:
            points = nodes(frame)
            place(moved, points)
            np.asarray(mesh.cell_data["shades"])[:] = shades(points)
            mesh.GetCellData().GetScalars().Modified()

    return update


def add_colored(
    plotter: Any, surfaces: Sequence[Surface], _: Camera, *, limits: tuple[float, float], colors: Any
) -> Callable[[int], None]:
    """Add surfaces whose colours show numbers, with sharp edges; return the function that updates them for a frame."""
    moved, nodes, _triangles = surface_mesh(surfaces)
    mesh = moved[0]

    def scalars(frame: int) -> Array:
        return np.concatenate([frame_of(s.scalars, frame, 1) for s in surfaces if s.scalars is not None])

    mesh.point_data["scalars"] = scalars(0)
    plotter.add_mesh(
        mesh, scalars="scalars", cmap=colors, clim=limits, opacity=surfaces[0].opacity, smooth_shading=False,
        ambient=ambient(shows_numbers=True), diffuse=diffuse(shows_numbers=True), specular=1.4 * GLOSS[True],
        specular_power=25.0, show_scalar_bar=False,
    )  # fmt: skip
    add_edges(plotter, surfaces[0], moved[1:])

    def update(frame: int) -> None:
        if surfaces[0].n_frames > 1:
            place(moved, nodes(frame))
        np.asarray(mesh.point_data["scalars"])[:] = scalars(frame)
        mesh.GetPointData().GetScalars().Modified()

    return update


def surface_mesh(surfaces: Sequence[Surface]) -> tuple[list[Any], Callable[[int], Array], IntArray]:
    """Return the mesh of surfaces and that of their sharp edges, if any, their nodes in a frame, and triangles."""
    import pyvista

    nodes, triangles = joined([s.nodes_at for s in surfaces], [s.triangles for s in surfaces])
    meshes: list[Any] = [pyvista.PolyData.from_regular_faces(nodes(0), triangles)]
    edges, _, is_sharp = surface_edges(nodes(0), triangles)
    if surfaces[0].has_edges and is_sharp.any():
        meshes.append(line_mesh(nodes(0), edges[is_sharp]))
    return meshes, nodes, triangles


def add_edges(plotter: Any, surface: Surface, meshes: Sequence[Any]) -> None:
    """Add the sharp edges of a surface, which are drawn in front of it."""
    for mesh in meshes:
        plotter.add_mesh(mesh, color=EDGE_COLOR, line_width=2.4, lighting=False,
                         opacity=0.75 if surface.opacity == 1 else 0.35)  # fmt: skip
    plotter.mapper.SetResolveCoincidentTopologyToPolygonOffset()


def add_lines(plotter: Any, group: Sequence[Lines]) -> Callable[[int], None]:
    """Add lines of one look; return the function that updates them for a frame."""
    first = group[0]
    points, segments = joined([lines.points_at for lines in group], [lines.segments for lines in group])
    mesh = line_mesh(points(0), segments)
    plotter.add_mesh(mesh, color=first.color, line_width=1.5 * first.width, opacity=first.opacity, lighting=False)

    def update(frame: int) -> None:
        if first.n_frames > 1:
            place([mesh], points(frame))

    return update


def joined(
    points_at: Sequence[Callable[[int], Array]], cells: Sequence[IntArray]
) -> tuple[Callable[[int], Array], IntArray]:
    """Return the function that gives the points of all parts in a frame, (n, 3), and the cells of all parts."""
    starts = np.cumsum([0, *(len(at(0)) for at in points_at)])
    numbered = np.concatenate([each + start for each, start in zip(cells, starts, strict=False)])
    return lambda frame: np.concatenate([at(frame) for at in points_at]), numbered


def place(meshes: Sequence[Any], points: Array) -> None:
    """Write the positions of a frame into meshes with the same points."""
    for mesh in meshes:
        np.asarray(mesh.points)[:] = points
        mesh.GetPoints().Modified()


def line_mesh(points: Array, segments: IntArray) -> Any:
    """Return segments as VTK lines."""
    import pyvista

    cells = np.column_stack([np.full(len(segments), 2), segments])
    return pyvista.PolyData(np.array(points), lines=cells.ravel())
