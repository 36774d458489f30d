"""Parametric parts, meshed by gmsh, and meshes included in the package."""

from fe_models.errors import MeshingError
from fe_models.parts.bracket import Bracket, mesh_bracket
from fe_models.parts.connecting_rod import SHIPPED_MESHES, SLENDER_ROD, ConnectingRod, mesh_connecting_rod, shipped_mesh
from fe_models.parts.engine_body import EngineBody, engine_body_mesh, mesh_deck
from fe_models.parts.errors import PartError
from fe_models.parts.gmsh_session import PartMesh

__all__ = [
    "SHIPPED_MESHES",
    "SLENDER_ROD",
    "Bracket",
    "ConnectingRod",
    "EngineBody",
    "MeshingError",
    "PartError",
    "PartMesh",
    "engine_body_mesh",
    "mesh_bracket",
    "mesh_connecting_rod",
    "mesh_deck",
    "shipped_mesh",
]
