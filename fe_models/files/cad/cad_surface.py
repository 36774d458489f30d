"""Triangles of the faces of a CAD file for drawing: a coarse mesh of the surface."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_models.files.cad.cad_model import CadPart, open_cad
from fe_models.files.cad.gmsh_model import gmsh_call
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units

__all__ = ["CadSurface", "surface_of_cad"]

AROUND = 36  #: number of triangles around a full circle
FINENESS = 0.05  #: largest edge length divided by the diagonal of the body


@dataclass(frozen=True, eq=False)
class CadSurface:
    """A CAD part with triangles on its outer faces."""

    part: CadPart
    nodes: Array  #: node positions, (n_nodes, 3), in the length unit of `units` of the part
    triangles: dict[int, IntArray]  #: triangles of each face, (n, 3), by face number


def surface_of_cad(path: str | Path, *, units: Units | str) -> CadSurface:
    """Read a CAD file as `read_cad` does, and triangulate its outer faces.

    Raises
    ------
    MeshError
        If `read_cad` raises it, or gmsh cannot mesh a face.
    """
    with open_cad(path, units=units) as model:
        gmsh, part = model.gmsh, model.part
        diagonal = float(np.linalg.norm(part.hi - part.lo)) * model.scale
        gmsh.option.setNumber("Mesh.MeshSizeMax", FINENESS * diagonal)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 1e-4 * diagonal)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", AROUND)
        with gmsh_call(f"geometry {path}: gmsh could not mesh its faces", advice="mend the geometry"):
            gmsh.model.mesh.generate(2)
        tags, points, _ = gmsh.model.mesh.getNodes()
        place = np.zeros(int(tags.max()) + 1, np.int64)
        place[tags] = np.arange(len(tags))
        triangles = {}
        for face in part.faces:
            if not face.is_inner:
                _, _, nodes = gmsh.model.mesh.getElements(2, face.tag)
                triangles[face.number] = place[np.concatenate(nodes).astype(np.int64)].reshape(-1, 3)
        return CadSurface(part, points.reshape(-1, 3) / model.scale, triangles)
