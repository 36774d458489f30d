"""Meshes from files: one function, which reads truthfully or says why it cannot."""

from fe_models.importers.read_mesh import MESH_FORMATS, read_mesh

__all__ = ["MESH_FORMATS", "read_mesh"]
