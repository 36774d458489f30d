"""A surface of triangles, such as one read from a file."""

import os
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from floatframe.errors import ModelError
from floatframe.model.shapes.piece import Piece

__all__ = ["Mesh", "mesh_file"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface of triangles."""

    nodes: Array  #: nodes of the surface, (n, 3) [m]
    triangles: IntArray  #: node indices of each triangle, (n_triangles, 3)

    def __post_init__(self) -> None:
        put = object.__setattr__
        nodes = np.array(self.nodes, dtype=float)
        if nodes.ndim != 2 or nodes.shape[1] != 3 or not len(nodes) or not np.isfinite(nodes).all():
            raise ModelError(f"mesh: nodes: expected finite positions (n, 3), got shape {nodes.shape}")
        nodes.flags.writeable = False
        put(self, "nodes", nodes)
        put(self, "triangles", frozen(self.triangles, np.int64))
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3 or not len(self.triangles):
            raise ModelError(f"mesh: triangles: expected (n, 3), got {self.triangles.shape}")
        if self.triangles.min() < 0 or self.triangles.max() >= len(nodes):
            raise ModelError(
                f"mesh: triangles: expected nodes 0 to {len(nodes) - 1}, got {self.triangles.min()} to "
                f"{self.triangles.max()}"
            )

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface as a piece."""
        return (Piece(self.nodes, self.triangles),)


def mesh_file(path: str | os.PathLike[str], *, scale: float = 1.0) -> Mesh:
    """Return the surface in a file of triangles or of a volume mesh (.stl, .obj, .ply, .vtk, .vtu, .msh, ...).

    Parameters
    ----------
    scale
        Factor on its coordinates, such as 0.001 for a drawing in millimetres in a system in metres.

    Raises
    ------
    ModelError
        If the file cannot be read, or contains no surface.
    """
    import pyvista as pv

    try:
        found = pv.read(os.fspath(path))
        surface = (found if isinstance(found, pv.PolyData) else found.extract_surface(algorithm=None)).triangulate()
    except Exception as error:  # the readers of the formats raise different errors
        raise ModelError(f"mesh: {path}: cannot be read as a surface: {error}") from error
    triangles = surface.faces.reshape(-1, 4)[:, 1:] if surface.n_cells else np.zeros((0, 3), np.int64)
    if not len(triangles):
        raise ModelError(f"mesh: {path}: contains no faces")
    return Mesh(scale * np.asarray(surface.points, dtype=float), triangles)
