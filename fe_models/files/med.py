"""MED meshes (Salome, Code_Aster), with their groups.

Files are read with h5py. meshio does not convert the node order of MED, in which every solid cell is inverted for it,
and fails if only some cell types have families. A MED file is an HDF5 file: /ENS_MAA/<mesh>/<step>/NOE contains the
nodes, MAI the cells by type, FAM the family of each, and /FAS/<mesh> the names of the groups of each family.
"""

import io
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh, mirrored_cells, mirrored_order

__all__ = ["read_med"]

_TYPES = {
    "PO1": "vertex",
    "SE2": "line",
    "SE3": "line3",
    "TR3": "triangle",
    "TR6": "triangle6",
    "QU4": "quad",
    "QU8": "quad8",
    "QU9": "quad9",
    "TE4": "tetra",
    "T10": "tetra10",
    "HE8": "hexahedron",
    "H20": "hexahedron20",
    "PY5": "pyramid",
    "P13": "P13",  # no file has shown the order of its middle nodes
    "PE6": "wedge",
    "P15": "P15",  # nor of these
}


def read_med(path: Path, data: bytes) -> RawMesh:
    """Return the nodes, cells and groups of a MED file with one mesh at one step.

    Solid cells are converted to the orientation of meshio (VTK). Files in which they already have it, such as those
    from meshio, are recognised by the sign of the Jacobian.

    Parameters
    ----------
    path
        File name, for messages.
    data
        Content of the file.

    Raises
    ------
    MeshError
        If the file is no MED file, or has several meshes or steps.
    """
    import h5py

    where = f"mesh {path}"
    try:
        file = h5py.File(io.BytesIO(data), "r")
    except OSError as error:
        raise MeshError(f"{where}: expected a MED file (HDF5), but it is damaged or of another kind") from error
    with file:
        meshes = list(file.get("ENS_MAA", ()))
        if len(meshes) != 1:
            raise MeshError(f"{where}: expected one mesh, got {len(meshes)}: {', '.join(meshes) or 'none'}")
        mesh = file["ENS_MAA"][meshes[0]]
        dim = int(mesh.attrs["ESP"])
        families = file["FAS"][meshes[0]] if "FAS" in file and meshes[0] in file["FAS"] else mesh.get("FAS", {})
        if "NOE" not in mesh:
            steps = list(mesh)
            if len(steps) != 1:
                raise MeshError(f"{where}: expected one time step, got {len(steps)}")
            mesh = mesh[steps[0]]
        coordinates = mesh["NOE"]["COO"]
        n_nodes = int(coordinates.attrs["NBR"])
        nodes = coordinates[()].reshape(n_nodes, dim, order="F").astype(float)
        node_names = _family_names(families.get("NOEUD", {}))
        node_sets = _members(mesh["NOE"]["FAM"][()], node_names) if "FAM" in mesh["NOE"] else {}
        cell_names = _family_names(families.get("ELEME", {}))
        blocks = []
        for code, group in mesh["MAI"].items():
            connectivity = group["NOD"]
            count = int(connectivity.attrs["NBR"])
            cells = connectivity[()].reshape(count, -1, order="F").astype(np.int64) - 1
            groups = _members(group["FAM"][()], cell_names) if "FAM" in group else {}
            numbers = group["NUM"][()].astype(np.int64) if "NUM" in group else None
            kind = _TYPES.get(code, code)
            blocks.append(RawBlock(kind, _oriented(kind, nodes, cells), groups, numbers))
        numbers = mesh["NOE"]["NUM"][()].astype(np.int64) if "NUM" in mesh["NOE"] else None
    return RawMesh(nodes, tuple(blocks), node_sets, numbers)


def _oriented(kind: str, nodes: np.ndarray, cells: IntArray) -> IntArray:
    """Return the cells in the orientation of VTK."""
    if kind not in CELL_SHAPES or CELL_SHAPES[kind].dim < 3 or not cells.size or not np.isfinite(nodes).all():
        return cells
    if nodes.shape[1] != 3 or cells.min() < 0 or cells.max() >= len(nodes):
        return cells
    return cells[:, mirrored_order(kind)] if mirrored_cells(kind, nodes, cells) else cells


def _family_names(families: Any) -> dict[int, list[str]]:
    """Return the names of the groups (80 characters each) of each family number."""
    names = {}
    for family in families.values():
        if "GRO" in family:
            rows = np.atleast_2d(
                family["GRO"]["NOM"][()].view(np.uint8)
                if family["GRO"]["NOM"].dtype.kind == "i"
                else family["GRO"]["NOM"][()]
            )
            texts = [bytes(bytearray(np.asarray(row, np.uint8))).decode("utf-8", "replace") for row in rows]
            names[int(family.attrs["NUM"])] = [text.split("\0")[0].strip() for text in texts]
    return names


def _members(tags: np.ndarray, names: dict[int, list[str]]) -> dict[str, IntArray]:
    """Return the members of each group, from the family of each node or cell."""
    groups: dict[str, list[IntArray]] = {}
    for tag in np.unique(tags):
        for name in names.get(int(tag), []):
            groups.setdefault(name, []).append(np.flatnonzero(tags == tag))
    return {name: np.sort(np.concatenate(parts)) for name, parts in groups.items()}
