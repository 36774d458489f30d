"""Appearance of bodies, wheels, ground, rails and elements: plain data for films, pictures and pages.

A *geometry* (box, cylinder, wheel, road, ...) has its own axes and returns `Piece`s: triangles and lines of one colour.
A `Shape` is a geometry with a position, a colour and, on a flexible body, the interface that carries it. Bodies carry
shapes (`RigidBody(shapes=...)`, `FlexibleBody(shapes=...)`), and a system has surroundings (`System(scene=...)`).
`Element.drawn()` returns `MarkerShapes`, `Stretched` and `Arrow`, which follow the markers of the element. Shapes do
not affect the motion.
"""

from floatframe.model.shapes.drawn import Arrow, MarkerShapes, Stretched
from floatframe.model.shapes.grounds import Plane, Road, Terrain, Track
from floatframe.model.shapes.mesh import Mesh
from floatframe.model.shapes.piece import Piece
from floatframe.model.shapes.prisms import Box, Extrusion
from floatframe.model.shapes.rounds import Cylinder, Revolution, Sphere
from floatframe.model.shapes.shape import Geometry, Shape
from floatframe.model.shapes.sweeps import Line, Tube
from floatframe.model.shapes.wheels import RailWheel, Wheel

__all__ = [
    "GEOMETRIES",
    "Arrow",
    "Box",
    "Cylinder",
    "Extrusion",
    "Geometry",
    "Line",
    "MarkerShapes",
    "Mesh",
    "Piece",
    "Plane",
    "RailWheel",
    "Revolution",
    "Road",
    "Shape",
    "Sphere",
    "Stretched",
    "Terrain",
    "Track",
    "Tube",
    "Wheel",
]

#: shape classes by name in a system file, with their fields as keys
GEOMETRIES = {
    "box": Box,
    "sphere": Sphere,
    "cylinder": Cylinder,
    "revolution": Revolution,
    "extrusion": Extrusion,
    "tube": Tube,
    "wheel": Wheel,
    "rail-wheel": RailWheel,
    "line": Line,
    "mesh": Mesh,
    "plane": Plane,
    "terrain": Terrain,
    "road": Road,
    "track": Track,
}
