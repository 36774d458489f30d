"""Gmsh model of a parametric part: opening, meshing, and writing with groups."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.cad.gmsh_model import gmsh_model

__all__ = ["PartMesh", "cylinder_faces", "mesh_and_write", "part_model"]


@dataclass(frozen=True)
class PartMesh:
    """Meshed part: its file, its exact volume, and the quality of its worst element."""

    path: Path
    volume: float  #: volume of the exact geometry, before meshing [length³]
    n_nodes: int
    n_elements: int
    worst_quality: float  #: smallest scaled inverse condition number of an element; 1 is best, <= 0 is inverted


@contextmanager
def part_model(name: str, size: float, order: int) -> Iterator[ModuleType]:
    """Open an empty gmsh model for one part; it is always closed, and gmsh options are restored."""
    if not (np.isfinite(size) and size > 0):
        raise MeshError(f"part {name!r}: size: expected a positive element size, got {size}")
    if order not in (1, 2):
        raise MeshError(f"part {name!r}: order: expected 1 (tet4) or 2 (tet10), got {order}")
    options = {"Mesh.ElementOrder": order, "Mesh.MeshSizeMax": size, "Mesh.MeshSizeMin": size / 20}
    with gmsh_model(name, options) as gmsh:
        yield gmsh


def cylinder_faces(gmsh: ModuleType, low: np.ndarray, high: np.ndarray) -> list[int]:
    """Return the cylindrical faces inside the box from low to high, (3,) [length] each, ascending."""
    slack = 1e-4 * float(np.linalg.norm(np.subtract(high, low)))
    box = [*(np.asarray(low) - slack), *(np.asarray(high) + slack)]
    found = gmsh.model.getEntitiesInBoundingBox(*box, dim=2)
    return sorted(tag for dim, tag in found if gmsh.model.getType(dim, tag) == "Cylinder")


def mesh_and_write(gmsh: ModuleType, *, name: str, groups: dict[str, list[int]], path: Path) -> PartMesh:
    """Mesh the only volume of the open model, and write it with its groups in binary Gmsh 4.1 format.

    Raises
    ------
    MeshError
        If the geometry is not one solid, a group is empty, or an element is inverted.
    """
    if path.suffix != ".msh":
        raise MeshError(f"part {name!r}: expected a path that ends in .msh, got {path}")
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    if len(volumes) != 1:
        raise MeshError(f"part {name!r}: expected one solid, got {len(volumes)}; the parameters do not fit together")
    gmsh.model.addPhysicalGroup(3, volumes, name=name)
    for group, faces in groups.items():
        if not faces:
            raise MeshError(f"part {name!r}: no face for group {group!r}; the parameters do not fit together")
        gmsh.model.addPhysicalGroup(2, faces, name=group)
    volume = float(gmsh.model.occ.getMass(3, volumes[0]))
    try:
        gmsh.model.mesh.generate(3)
    except Exception as error:  # gmsh raises a bare Exception
        raise MeshError(f"part {name!r}: gmsh could not mesh it ({error}); try another size") from error
    gmsh.model.mesh.renumberNodes()
    gmsh.model.mesh.renumberElements()
    _, element_tags, node_tags = gmsh.model.mesh.getElements(3)
    elements = np.concatenate(element_tags)
    worst = float(np.min(gmsh.model.mesh.getElementQualities(elements, "minSICN")))
    if worst <= 0:
        raise MeshError(f"part {name!r}: gmsh made inverted elements (quality {worst:.2g}); try a smaller size")
    path.parent.mkdir(parents=True, exist_ok=True)
    gmsh.write(str(path))
    n_nodes = len(np.unique(np.concatenate(node_tags)))
    return PartMesh(path, volume, n_nodes, len(elements), worst)
