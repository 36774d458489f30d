from .export import export_body as export_body
from .import_body import import_body as import_body
from .importers.inertia import FullMass as FullMass
from .importers.inertia import MeshMass as MeshMass
from .importers.inertia import NodalMasses as NodalMasses
