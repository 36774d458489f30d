"""Meshes from files: one function, which reads exactly or explains why it cannot."""

from fe_models.files.read_mesh import MESH_FORMATS, read_mesh

__all__ = ["MESH_FORMATS", "read_mesh"]
