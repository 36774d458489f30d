"""Views drawn off-screen by pyvista (VTK, OpenGL), only in the worker process: VTK without OpenGL can crash."""

from collections.abc import Callable
from typing import Any

import numpy as np

from cms.assessment.rendering.camera import VIEW_ANGLE, Camera
from cms.assessment.rendering.film import Image
from cms.assessment.rendering.light import GLOSS, LIGHTS, ambient, diffuse
from cms.assessment.rendering.scene import Lines, Scene, Surface, frame_of
from cms.assessment.rendering.shape import FEATURE_ANGLE, colormap, surface_edges
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["pyvista_view"]


def pyvista_view(scene: Scene, camera: Camera) -> Callable[[int], Image]:
    """Return a function that draws a frame as (height, width, 3) uint8."""
    import pyvista
    from matplotlib.colors import ListedColormap

    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(camera.size), lighting="none")
    plotter.set_background(scene.background)
    for towards, strength in LIGHTS:
        place = tuple(towards.tolist())
        light = pyvista.Light(position=place, focal_point=(0, 0, 0), light_type="camera light", intensity=strength)
        plotter.add_light(light)
    colors = ListedColormap(colormap())
    updates = [add_surface(plotter, surface, scene, colors) for surface in scene.surfaces]
    updates += [add_lines(plotter, lines) for lines in scene.lines]
    view = plotter.camera
    view.position, view.focal_point, view.up = camera.eye, camera.focal_point, camera.axes[1]
    view.view_angle = VIEW_ANGLE
    plotter.enable_anti_aliasing("ssaa")

    def draw(frame: int) -> Image:
        for update in updates:
            update(frame)
        plotter.reset_camera_clipping_range()
        plotter.render()
        return np.ascontiguousarray(plotter.screenshot(return_img=True)[..., :3])

    return draw


def add_surface(plotter: Any, surface: Surface, scene: Scene, colors: Any) -> Callable[[int], None]:
    """Add a surface with its sharp edges; return the function that updates it for a frame."""
    import pyvista

    rest = frame_of(surface.nodes, 0, 2)
    whole: Any = pyvista.PolyData.from_regular_faces(rest, surface.triangles.astype(int))
    whole.point_data["node"] = np.arange(len(rest))
    mesh = whole.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=np.rad2deg(FEATURE_ANGLE), consistent_normals=False,
        auto_orient_normals=False,
    )  # fmt: skip
    origin = np.asarray(mesh.point_data["node"])
    shows_numbers = surface.scalars is not None
    look: dict[str, Any] = {"opacity": surface.opacity, "smooth_shading": False,
                            "ambient": ambient(shows_numbers=shows_numbers),
                            "diffuse": diffuse(shows_numbers=shows_numbers),
                            "specular": 1.4 * GLOSS[shows_numbers], "specular_power": 25.0,
                            "show_scalar_bar": False}  # fmt: skip
    if surface.scalars is None:
        plotter.add_mesh(mesh, color=surface.color, **look)
    else:
        mesh.point_data["scalars"] = frame_of(surface.scalars, 0, 1)[origin]
        plotter.add_mesh(mesh, scalars="scalars", cmap=colors, clim=scene.color_limits, **look)
    edges, _, is_sharp = surface_edges(rest, surface.triangles)
    edges = edges[is_sharp]
    outline = None
    if surface.has_edges and len(edges):
        outline = line_mesh(rest, edges)
        plotter.add_mesh(outline, color="#212d38", line_width=2.4, lighting=False,
                         opacity=0.75 if surface.opacity == 1 else 0.35)  # fmt: skip
    plotter.mapper.SetResolveCoincidentTopologyToPolygonOffset()

    def update(frame: int) -> None:
        if surface.n_frames > 1:
            nodes = frame_of(surface.nodes, frame, 2)
            mesh.points = nodes[origin]
            turned = mesh.compute_normals(
                cell_normals=False, split_vertices=False, consistent_normals=False, auto_orient_normals=False
            )
            mesh.point_data["Normals"] = np.asarray(turned.point_data["Normals"])
            if outline is not None:
                outline.points = nodes
        if surface.scalars is not None and surface.scalars.ndim == 2:
            mesh.point_data["scalars"] = frame_of(surface.scalars, frame, 1)[origin]

    return update


def add_lines(plotter: Any, lines: Lines) -> Callable[[int], None]:
    """Add lines; return the function that updates them for a frame."""
    mesh = line_mesh(frame_of(lines.points, 0, 2), lines.segments)
    plotter.add_mesh(mesh, color=lines.color, line_width=1.5 * lines.width, opacity=lines.opacity, lighting=False)

    def update(frame: int) -> None:
        if lines.n_frames > 1:
            mesh.points = frame_of(lines.points, frame, 2)

    return update


def line_mesh(points: Array, segments: IntArray) -> Any:
    """Return segments as VTK lines."""
    import pyvista

    cells = np.column_stack([np.full(len(segments), 2), segments])
    return pyvista.PolyData(np.array(points), lines=cells.ravel())
