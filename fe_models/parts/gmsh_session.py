"""One gmsh model at a time: the library is loaded lazily, options are set for repeatable meshes and restored."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from fe_models.parts.errors import MeshError, MeshingError

__all__ = ["PartMesh", "cylinder_faces", "load_gmsh", "mesh_and_write", "part_model"]

OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # threads change the order of operations, and with it the mesh
    "Mesh.RandomSeed": 1,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 10,  # HXT: fewer and better tetrahedra than Delaunay here, and the same ones every time
    "Mesh.MeshSizeExtendFromBoundary": 1,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 1,
    "Mesh.SaveAll": 0,  # only the named groups: curves and unnamed faces would be noise to a reader
    "Mesh.SecondOrderLinear": 0,
    "Mesh.HighOrderOptimize": 1,  # mid-side nodes go onto the curved faces, the elements behind them give way
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 1,
}


@dataclass(frozen=True)
class PartMesh:
    """A meshed part: the file, and what its geometry and its worst element are."""

    path: Path
    volume: float  #: of the exact geometry, before meshing [length³]
    n_nodes: int
    n_elements: int
    worst_quality: float  #: smallest scaled inverse condition number of an element, 1 is best, <= 0 is inverted


def load_gmsh() -> ModuleType:
    """Return the module gmsh.

    Raises
    ------
    MeshingError
        If it is not installed, or a system library it needs is missing; the text says how to get it.
    """
    try:
        import gmsh
    except ModuleNotFoundError as error:
        raise MeshingError(
            'meshing a part: expected the package gmsh, found none; install it with pip install "floatframe[mesh]"'
        ) from error
    except OSError as error:
        raise MeshingError(
            f"meshing a part: gmsh is installed, but a system library it needs cannot be loaded ({error}); "
            "on Debian or Ubuntu: apt-get install libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1"
        ) from error
    module: ModuleType = gmsh
    return module


@contextmanager
def part_model(name: str, size: float, order: int) -> Iterator[ModuleType]:
    """Open an empty gmsh model for one part, and close it whatever happens; options come back as they were."""
    if not (np.isfinite(size) and size > 0):
        raise MeshError(f"part {name!r}: size: expected a positive element size, got {size}")
    if order not in (1, 2):
        raise MeshError(f"part {name!r}: order: expected 1 (tet4) or 2 (tet10), got {order}")
    gmsh = load_gmsh()
    was_open = bool(gmsh.isInitialized())
    if not was_open:
        gmsh.initialize(interruptible=False)
    options = OPTIONS | {"Mesh.ElementOrder": order, "Mesh.MeshSizeMax": size, "Mesh.MeshSizeMin": size / 20}
    before = {option: gmsh.option.getNumber(option) for option in options}
    try:
        for option, value in options.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add(name)
        try:
            yield gmsh
        finally:
            gmsh.model.remove()
    finally:
        for option, value in before.items():
            gmsh.option.setNumber(option, value)
        if not was_open:
            gmsh.finalize()


def cylinder_faces(gmsh: ModuleType, low: np.ndarray, high: np.ndarray) -> list[int]:
    """Return the cylindrical faces inside the box low..high, each (3,) [length], ascending."""
    slack = 1e-4 * float(np.linalg.norm(np.subtract(high, low)))
    box = [*(np.asarray(low) - slack), *(np.asarray(high) + slack)]
    found = gmsh.model.getEntitiesInBoundingBox(*box, dim=2)
    return sorted(tag for dim, tag in found if gmsh.model.getType(dim, tag) == "Cylinder")


def mesh_and_write(gmsh: ModuleType, *, name: str, groups: dict[str, list[int]], path: Path) -> PartMesh:
    """Mesh the only volume of the open model and write it with its groups as Gmsh 4.1 binary.

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
    except Exception as error:  # gmsh raises bare Exception
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
