"""Views drawn off-screen by VTK (OpenGL), only in the worker process: VTK without OpenGL can crash.

Parts that look alike are drawn as one mesh, which is made once. A frame writes the new positions and colours into its
arrays. Without a graphics card most of the time goes into the lighting of pixels, so faces of one colour are lit here.
The modules of VTK come with pyvista, whose own import and plotter take longer than the drawing of a picture.
"""

from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from cms.assessment.rendering.camera import VIEW_ANGLE, Camera
from cms.assessment.rendering.film import Image, average_of_blocks
from cms.assessment.rendering.light import GLOSS, LIGHTS, ambient, diffuse, lit
from cms.assessment.rendering.scene import Lines, Scene, Surface, frame_of
from cms.assessment.rendering.shape import colormap, rgb_of, surface_edges, triangle_normals
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["vtk_view"]

OVERSAMPLING = 2  #: size of the drawing before averaging divided by the final size, which smooths edges
EDGE_COLOR = "#212d38"
FRONT = 1  #: the buffer of a window that is read

Part = TypeVar("Part", Surface, Lines)


def vtk_view(scene: Scene, camera: Camera) -> Callable[[int], Image]:
    """Return a function that draws a frame as (height, width, 3) uint8."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the classes of vtkRenderingCore are abstract without it
    from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

    window, renderer = vtkRenderWindow(), vtkRenderer()
    window.SetShowWindow(False)
    window.SetUseOffScreenBuffers(True)
    window.SetMultiSamples(0)
    window.SetSize([OVERSAMPLING * n for n in camera.size])
    window.AddRenderer(renderer)
    renderer.SetBackground(rgb_of(scene.background))
    if hasattr(renderer, "SetUseOIT"):  # sorting translucent pixels takes as long as all the rest
        renderer.SetUseOIT(False)
    add_lights(renderer)
    updates = []
    for group in alike(scene.surfaces, look_of_surface):
        add = add_plain if group[0].scalars is None else partial(add_colored, limits=scene.color_limits)
        updates.append(add(renderer, group, camera))
    updates += [add_lines(renderer, group) for group in alike(scene.lines, look_of_lines)]
    view = renderer.GetActiveCamera()
    view.SetPosition(*camera.eye)
    view.SetFocalPoint(*camera.focal_point)
    view.SetViewUp(*camera.axes[1])
    view.SetViewAngle(VIEW_ANGLE)

    def draw(frame: int) -> Image:
        for update in updates:
            update(frame)
        renderer.ResetCameraClippingRange()
        window.Render()
        return average_of_blocks(pixels_of(window), OVERSAMPLING)[::-1]

    return draw


def add_lights(renderer: Any) -> None:
    """Add the lights, which move with the camera."""
    from vtkmodules.vtkRenderingCore import vtkLight

    renderer.AutomaticLightCreationOff()
    for towards, strength in LIGHTS:
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*towards)
        light.SetFocalPoint(0, 0, 0)
        light.SetIntensity(strength)
        renderer.AddLight(light)


def pixels_of(window: Any) -> Image:
    """Return the pixels that a window has drawn, from its lowest row upwards, (height, width, 4) uint8.

    Read with their opacity, as OpenGL stores them: without it, each is converted, which takes ten times longer.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

    width, height = window.GetActualSize()
    pixels = vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, width - 1, height - 1, FRONT, pixels, 0)
    return np.asarray(vtk_to_numpy(pixels)).reshape(height, width, 4)


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


def add_plain(renderer: Any, surfaces: Sequence[Surface], camera: Camera) -> Callable[[int], None]:
    """Add surfaces of one colour with their sharp edges; return the function that updates them for a frame."""
    moved, nodes, triangles = surface_mesh(surfaces)
    mesh, color = moved[0], np.array(rgb_of(surfaces[0].color))

    def shades(points: Array) -> Image:
        normals = triangle_normals(points, triangles) @ camera.towards_eye.T
        normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)  # both sides are lit
        return np.asarray(255 * lit(color, normals, shows_numbers=False), dtype=np.uint8)

    put_scalars(mesh.GetCellData(), shades(nodes(0)))
    unlit(added(renderer, mesh, opacity=surfaces[0].opacity))
    add_edges(renderer, surfaces[0], moved[1:])

    def update(frame: int) -> None:
        if surfaces[0].n_frames > 1:
            points = nodes(frame)
            place(moved, points)
            put_scalars(mesh.GetCellData(), shades(points))

    return update


def add_colored(
    renderer: Any, surfaces: Sequence[Surface], _: Camera, *, limits: tuple[float, float]
) -> Callable[[int], None]:
    """Add surfaces whose colours show numbers, with sharp edges; return the function that updates them for a frame."""
    moved, nodes, _triangles = surface_mesh(surfaces)
    mesh = moved[0]

    def scalars(frame: int) -> Array:
        return np.concatenate([frame_of(s.scalars, frame, 1) for s in surfaces if s.scalars is not None])

    put_scalars(mesh.GetPointData(), scalars(0))
    actor = added(renderer, mesh, opacity=surfaces[0].opacity)
    mapper, look = actor.GetMapper(), actor.GetProperty()
    mapper.SetLookupTable(lookup_table())
    mapper.SetScalarRange(limits)
    mapper.SetInterpolateScalarsBeforeMapping(True)
    look.SetInterpolationToFlat()
    look.SetAmbient(ambient(shows_numbers=True))
    look.SetDiffuse(diffuse(shows_numbers=True))
    look.SetSpecular(1.4 * GLOSS[True])
    look.SetSpecularPower(25.0)
    add_edges(renderer, surfaces[0], moved[1:])

    def update(frame: int) -> None:
        if surfaces[0].n_frames > 1:
            place(moved, nodes(frame))
        put_scalars(mesh.GetPointData(), scalars(frame))

    return update


def surface_mesh(surfaces: Sequence[Surface]) -> tuple[list[Any], Callable[[int], Array], IntArray]:
    """Return the mesh of surfaces and that of their sharp edges, if any, their nodes in a frame, and triangles."""
    nodes, triangles = joined([s.nodes_at for s in surfaces], [s.triangles for s in surfaces])
    meshes = [mesh_of(nodes(0), triangles)]
    edges, _, is_sharp = surface_edges(nodes(0), triangles)
    if surfaces[0].has_edges and is_sharp.any():
        meshes.append(mesh_of(nodes(0), edges[is_sharp]))
    return meshes, nodes, triangles


def add_edges(renderer: Any, surface: Surface, meshes: Sequence[Any]) -> None:
    """Add the sharp edges of a surface, which are drawn in front of it."""
    for mesh in meshes:
        actor = added(renderer, mesh, opacity=0.75 if surface.opacity == 1 else 0.35)
        unlit(actor, EDGE_COLOR, width=2.4)
        actor.GetMapper().SetResolveCoincidentTopologyToPolygonOffset()


def add_lines(renderer: Any, group: Sequence[Lines]) -> Callable[[int], None]:
    """Add lines of one look; return the function that updates them for a frame."""
    first = group[0]
    points, segments = joined([lines.points_at for lines in group], [lines.segments for lines in group])
    mesh = mesh_of(points(0), segments)
    unlit(added(renderer, mesh, opacity=first.opacity), first.color, width=1.5 * first.width)

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


def added(renderer: Any, mesh: Any, *, opacity: float) -> Any:
    """Add a mesh to the view; return its actor."""
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(mesh)
    actor.SetMapper(mapper)
    actor.GetProperty().SetOpacity(opacity)
    renderer.AddActor(actor)
    return actor


def unlit(actor: Any, color: str = "#ffffff", width: float = 1.0) -> None:
    """Draw an actor in its own colours, in this one if it has none, with lines of this width [px]."""
    look = actor.GetProperty()
    look.LightingOff()
    look.SetColor(rgb_of(color))
    look.SetLineWidth(width)


def lookup_table() -> Any:
    """Return the colour map for a mapper."""
    from vtkmodules.vtkCommonCore import vtkLookupTable

    table = vtkLookupTable()
    colors = colormap()
    table.SetNumberOfTableValues(len(colors))
    for k, color in enumerate(colors):
        table.SetTableValue(k, *color)
    return table


def mesh_of(points: Array, cells: IntArray) -> Any:
    """Return triangles, (n, 3), or segments, (n, 2), as a mesh of VTK with its own points."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    mesh, array = vtkPolyData(), vtkCellArray()
    mesh.SetPoints(vtkPoints())
    place([mesh], points)
    ends = np.arange(0, cells.size + 1, cells.shape[1])
    array.SetData(numpy_to_vtkIdTypeArray(ends, deep=True), numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    if cells.shape[1] == 3:
        mesh.SetPolys(array)
    else:
        mesh.SetLines(array)
    return mesh


def put_scalars(data: Any, values: Array | Image) -> None:
    """Give points or cells the numbers, (n,), or colours, (n, 3) uint8, that they show."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    data.SetScalars(numpy_to_vtk(np.ascontiguousarray(values), deep=True))


def place(meshes: Sequence[Any], points: Array) -> None:
    """Write the positions of a frame into meshes with the same points."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    for mesh in meshes:
        mesh.GetPoints().SetData(numpy_to_vtk(np.array(points, dtype=np.float32), deep=True))
