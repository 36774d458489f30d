"""Finite element models of bodies: meshes, materials, interfaces, solids.

Names are loaded when they are first used, so that `import fe_models` stays light.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "Box": "selections",
    "Cylinder": "selections",
    "FaceGroup": "selections",
    "FeModelsError": "errors",
    "Finding": "mesh_report",
    "InterfaceError": "errors",
    "Material": "material",
    "MaterialError": "errors",
    "Mesh": "mesh",
    "MeshError": "errors",
    "MeshReport": "mesh_report",
    "NearestNode": "selections",
    "NodeSet": "selections",
    "Plane": "selections",
    "body_from_matrices": "matrices",
    "body_from_npz": "matrices",
    "boundary_facets": "boundary",
    "boundary_triangles": "boundary",
    "check_overlap": "interfaces",
    "distributing_interface": "interfaces",
    "drop_unused_nodes": "unused_nodes",
    "nodes_interface": "interfaces",
    "read_mesh": "importers.read_mesh",
    "report_mesh": "mesh_report",
    "rigid_interface": "interfaces",
    "solid_body": "solid",
}  # public name -> module

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
