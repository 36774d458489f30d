from .meshes.selections import Box as Box
from .meshes.selections import Cylinder as Cylinder
from .meshes.selections import FaceGroup as FaceGroup
from .meshes.selections import NearestNode as NearestNode
from .meshes.selections import NodeNumbers as NodeNumbers
from .meshes.selections import NodeSet as NodeSet
from .meshes.selections import Plane as Plane
