"""The contents of a page besides flexible surfaces: pieces on carriers, parts stretched between carriers, arrows."""

from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.rotations import rotation_matrix
from floatframe.model.shapes import Piece, Plane
from floatframe.model.shapes.drawn import StretchedPiece
from floatframe.pictures.animation import GLASS, LARGEST, RIGID_COLOR, connections, hides_flexible
from floatframe.pictures.element_looks import dressed_bodies
from floatframe.pictures.looks import looks_of
from floatframe.pictures.stage import box_of
from floatframe.pictures.viewer.carriers import GROUND_CARRIER, Carriers

__all__ = ["Between", "Cast", "Force", "Placed", "bodies_cast", "scene_cast"]

CUBE = 0.04  #: half edge of the cube for an unknown body, divided by the size of the scene


@dataclass(frozen=True, eq=False)
class Placed:
    """A piece in the axes of a carrier."""

    piece: Piece
    carrier: int
    kind: str = "body"  #: group of the piece: "body", "scene", "joint" or "force"


@dataclass(frozen=True, eq=False)
class Between:
    """A part stretched between two carriers."""

    parts: tuple[StretchedPiece, ...]
    first: int
    second: int
    kind: str = "force"


@dataclass(frozen=True, eq=False)
class Force:
    """An arrow at a carrier."""

    name: str
    values: Array  #: force vectors in ground axes, (n, 3) [N]
    carrier: int
    color: str = "#c2452d"
    at: Array | None = None  #: start of the arrow in ground axes, (n, 3) [m]; None: the carrier
    is_of_element: bool = False  #: whether an element requested it


@dataclass
class Cast:
    """All drawn objects besides flexible surfaces."""

    carriers: Carriers
    placed: list[Placed] = field(default_factory=list)
    between: list[Between] = field(default_factory=list)
    forces: list[Force] = field(default_factory=list)
    #: infinite ground planes: upward direction, height along it, spacing of grid lines (None: automatic)
    planes: list[tuple[Array, float, float | None]] = field(default_factory=list)
    on_ground: set[object] = field(default_factory=set)  #: ground shapes that elements have already drawn

    def add_plane(self, plane: Plane, position: Array, axes: Array) -> None:
        """Add a flat ground."""
        normal = axes @ plane.normal
        self.planes.append((normal, float(position @ normal), plane.step))

    @property
    def has_ground(self) -> bool:
        """Return whether there is a ground."""
        return bool(self.planes) or any(each.piece.is_ground for each in self.placed)


def bodies_cast(cast: Cast, bodies: dict[str, RigidBody | FlexibleBody | None], size: float) -> None:
    """Add the shapes of bodies; for rigid bodies without shapes, the box of the inertia, or a cube.

    Parameters
    ----------
    bodies
        Bodies by name; None: unknown.
    size
        Length that scales objects without a size of their own [m].
    """
    carriers = cast.carriers
    trajectory, rows = carriers.trajectory, carriers.rows
    motions = {name: trajectory.body(name) for name in bodies}
    frames = {name: (motion.r[rows[:1]], rotation_matrix(motion.p[rows[:1]])) for name, motion in motions.items()}
    flexible = {name: body.reduced for name, body in bodies.items() if isinstance(body, FlexibleBody)}
    dressed = dressed_bodies(carriers.system)
    for i, (name, body) in enumerate(bodies.items()):
        looks = () if body is None else looks_of(body)
        for look in looks:
            piece = look.piece if look.piece.color else replace(look.piece, color=RIGID_COLOR)
            cast.placed.append(Placed(piece, carriers.of_shape(i, look.carrier)))
        if looks or name in dressed or (isinstance(body, FlexibleBody) and len(body.reduced.surface)):
            continue
        if isinstance(body, FlexibleBody):
            corners, triangles = box_around(body.reduced.nodes, CUBE * size)
        else:
            most = np.inf if carriers.system is None else LARGEST * size
            corners, triangles = box_of(body, CUBE * size, most, connections(carriers.system, name))
        opacity = GLASS if hides_flexible(name, corners, frames, flexible) else 1.0
        piece = Piece(corners, triangles, color=RIGID_COLOR, opacity=opacity)
        cast.placed.append(Placed(piece, carriers.of_body(i)))


def scene_cast(cast: Cast) -> None:
    """Add the surroundings."""
    system = cast.carriers.system
    for shape in () if system is None else system.scene:
        geometry = getattr(shape, "geometry", shape)
        if isinstance(geometry, Plane):
            cast.add_plane(geometry, getattr(shape, "position", np.zeros(3)), np.eye(3))
        for piece in shape.pieces():
            coloured = piece if piece.color else replace(piece, color=RIGID_COLOR)
            cast.placed.append(Placed(coloured, GROUND_CARRIER, "scene"))


def box_around(nodes: Array, least: float) -> tuple[Array, IntArray]:
    """Return the box round the nodes of a body without a surface: corners, (8, 3), and triangles."""
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    corners, triangles = box_of(None, 1.0)
    return (low + high) / 2 + corners * np.maximum((high - low) / 2, 0.2 * least), triangles
