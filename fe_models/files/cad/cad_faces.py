"""Faces of a solid: kind of surface, position, size and outward direction."""

from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields

__all__ = ["FACE_KINDS", "CadFace", "cad_faces"]

FACE_KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "other")
NAMED = {"Plane": "plane", "Cylinder": "cylinder", "Cone": "cone", "Sphere": "sphere", "Torus": "torus"}
SAMPLES = np.linspace(0.08, 0.92, 7)  #: fractions of the ranges of both surface parameters at which a face is sampled
EQUAL = 1e-5  #: relative difference up to which curvatures or directions are equal
KERNEL_TOLERANCE = 1e-7  #: margin that the CAD kernel adds to its bounding boxes
INSIDE = 1e-5  #: distance from a face, divided by the diagonal, of the points that are tested for being in the material


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class CadFace:
    """One face of the geometry, in the length unit of the job.

    Parameters
    ----------
    number
        Number in the list of faces, from 1.
    tag
        Tag of the face in gmsh.
    kind
        Kind of its surface, in `FACE_KINDS`.
    area
        Area [square of the length unit].
    centre
        Centroid of the area, (3,).
    lo
        Lower corner of the bounding box, (3,).
    hi
        Upper corner of the bounding box, (3,).
    normal
        Outward normal of a plane, (3,).
    radius
        Radius of a cylinder or sphere.
    axis
        Direction of the axis of a cylinder, (3,); its first large component is positive.
    point
        Point on the axis of a cylinder nearest to the centroid, or centre of a sphere, (3,).
    is_hole
        Whether the material is outside of a cylinder or sphere.
    colour
        Colour in the file, "#rrggbb".
    solids
        Numbers of the solids that the face bounds, from 1.
    """

    number: int
    tag: int
    kind: str
    area: float
    centre: Array
    lo: Array
    hi: Array
    normal: Array | None = None
    radius: float | None = None
    axis: Array | None = None
    point: Array | None = None
    is_hole: bool | None = None
    colour: str = ""
    solids: tuple[int, ...] = ()

    @property
    def is_inner(self) -> bool:
        """Whether the face is between two solids."""
        return len(self.solids) > 1


def cad_faces(gmsh: ModuleType, scale: float) -> tuple[CadFace, ...]:
    """Return the faces of the open model that bound solids, by ascending number.

    Parameters
    ----------
    gmsh
        The module gmsh, with the synchronised geometry in its model.
    scale
        Length unit of the job, in units of the model.
    """
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    diagonal = float(np.linalg.norm(box[3:] - box[:3]))
    number_of = {tag: k for k, (_, tag) in enumerate(gmsh.model.getEntities(3), start=1)}
    faces: list[CadFace] = []
    for _, tag in gmsh.model.getEntities(2):
        above, _ = gmsh.model.getAdjacencies(2, tag)
        if len(above):
            solids = tuple(number_of[int(v)] for v in above)
            face = _face(gmsh, tag, [int(v) for v in above], solids, scale, diagonal)
            faces.append(replace(face, number=len(faces) + 1))
    return tuple(faces)


def _face(
    gmsh: ModuleType, tag: int, volumes: list[int], solids: tuple[int, ...], scale: float, diagonal: float
) -> CadFace:
    red, green, blue, alpha = gmsh.model.getColor(2, tag)
    points, normals, curvatures, directions = _sampled(gmsh, tag)
    kind = NAMED.get(gmsh.model.getType(2, tag)) or _kind_of(curvatures, directions, diagonal)
    box = _box(gmsh, tag, points)
    centre = np.array(gmsh.model.occ.getCenterOfMass(2, tag))
    normal = radius = axis = point = is_hole = None
    outward = _outward(gmsh, volumes, points, normals, diagonal) if len(volumes) == 1 and len(points) else None
    if kind == "plane" and len(normals):
        normal = _rounded(outward[0] if outward is not None else normals[0])
    elif kind in ("cylinder", "sphere") and len(points):
        radius, point, axis = _axis(kind, points, normals, curvatures, directions, centre)
        if outward is not None:
            arm = outward[1] - point
            is_hole = bool(outward[0] @ (arm - (0 if axis is None else arm @ axis * axis)) < 0)
    return CadFace(
        number=0,
        tag=tag,
        kind=kind,
        area=gmsh.model.occ.getMass(2, tag) / scale**2,
        centre=centre / scale,
        lo=box[0] / scale,
        hi=box[1] / scale,
        normal=normal,
        radius=None if radius is None else radius / scale,
        axis=axis,
        point=None if point is None else point / scale,
        is_hole=is_hole,
        colour=f"#{red:02x}{green:02x}{blue:02x}" if alpha else "",
        solids=solids,
    )


def _box(gmsh: ModuleType, tag: int, points: Array) -> Array:
    """Return the corners of the bounding box, (2, 3), from the kernel, or from samples if the kernel is inaccurate."""
    if gmsh.model.getType(2, tag) in NAMED:
        box = np.array(gmsh.model.getBoundingBox(2, tag)).reshape(2, 3)
        return box + np.array([[KERNEL_TOLERANCE], [-KERNEL_TOLERANCE]])
    found = [points]
    for _, curve in gmsh.model.getBoundary([(2, tag)], oriented=False):
        (low,), (high,) = gmsh.model.getParametrizationBounds(1, curve)
        found.append(np.array(gmsh.model.getValue(1, curve, np.linspace(low, high, 33))).reshape(-1, 3))
    everything = np.concatenate(found)
    return np.stack([everything.min(axis=0), everything.max(axis=0)])


def _sampled(gmsh: ModuleType, tag: int) -> tuple[Array, Array, Array, Array]:
    """Return points, normals, (n, 3), principal curvatures by ascending size, (n, 2), and their directions, (n, 2, 3).

    The points are inside the borders of the face.
    """
    lo, hi = (np.array(bound) for bound in gmsh.model.getParametrizationBounds(2, tag))
    grid = np.stack(np.meshgrid(SAMPLES, SAMPLES, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = [uv for uv in lo + grid * (hi - lo) if gmsh.model.isInside(2, tag, uv, parametric=True)]
    if not inside:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 2, 3))
    uv = np.concatenate(inside)
    points = np.array(gmsh.model.getValue(2, tag, uv)).reshape(-1, 3)
    normals = np.array(gmsh.model.getNormal(tag, uv)).reshape(-1, 3)
    first, second, along_first, along_second = (np.array(x) for x in gmsh.model.getPrincipalCurvatures(tag, uv))
    curvatures = np.stack([first, second], axis=1)
    directions = np.stack([along_first.reshape(-1, 3), along_second.reshape(-1, 3)], axis=1)
    order = np.argsort(np.abs(curvatures), axis=1)
    return (
        points,
        normals,
        np.take_along_axis(curvatures, order, axis=1),
        np.take_along_axis(directions, order[:, :, None], axis=1),
    )


def _kind_of(curvatures: Array, directions: Array, diagonal: float) -> str:
    """Return the true kind of a revolution, an extrusion or a spline surface from its curvatures."""
    if not len(curvatures):
        return "other"
    small, large = np.abs(curvatures).T
    if large.max() * diagonal < EQUAL:
        return "plane"
    if np.ptp(large) > EQUAL * large.max():
        return "other"
    if small.max() < EQUAL * large.max():
        along = directions[:, 0]
        return "cylinder" if np.linalg.norm(np.cross(along, along[0]), axis=1).max() < EQUAL else "other"
    return "sphere" if np.abs(small - large).max() < EQUAL * large.max() else "other"


def _axis(
    kind: str, points: Array, normals: Array, curvatures: Array, directions: Array, centre: Array
) -> tuple[float, Array, Array | None]:
    """Return radius, a point on the axis next to the centroid (or the centre), and direction of the axis."""
    radius = 1 / float(np.abs(curvatures[:, 1]).mean())
    axis = None if kind == "sphere" else _rounded(directions[0, 0])
    if axis is not None and axis[np.abs(axis) > 0.1][0] < 0:
        axis = -axis
    middles = []
    for side in (1, -1):  # the axis is where the normals of all points meet
        middle = points + side * radius * normals
        if axis is not None:
            middle = middle - np.outer((middle - centre) @ axis, axis)
        middles.append(middle)
    middle = min(middles, key=lambda candidates: float(np.ptp(candidates, axis=0).max()))
    return radius, middle.mean(axis=0), axis


def _outward(
    gmsh: ModuleType, volumes: list[int], points: Array, normals: Array, diagonal: float
) -> tuple[Array, Array] | None:
    """Return the outward normal and the point at which it was determined; None if it is undetermined."""
    for step in (INSIDE, INSIDE * 10):
        for point, normal in zip(points, normals, strict=True):
            ahead, behind = (
                bool(gmsh.model.isInside(3, volumes[0], point + side * step * diagonal * normal)) for side in (1, -1)
            )
            if ahead != behind:
                return (-normal if ahead else normal), point
    return None


def _rounded(direction: Array) -> Array:
    """Return the direction with components within rounding set to zero."""
    unit = direction / np.linalg.norm(direction)
    cut = np.where(np.abs(unit) < 1e-9, 0.0, unit)
    return np.asarray(cut / np.linalg.norm(cut))
