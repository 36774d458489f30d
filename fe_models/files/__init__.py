"""Files of other programs: meshes (`read_mesh`), whole decks (`decks`), matrices, CAD.

A reader reads exactly, or explains why it cannot.
"""

from fe_models.files.read_mesh import MESH_FORMATS, read_mesh

__all__ = ["MESH_FORMATS", "read_mesh"]
