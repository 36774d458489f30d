"""Mesh of a CAD file: tetrahedra of the requested size, with the faces of interfaces as groups."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.cad.cad_model import CadModel, CadPart, open_cad
from fe_models.files.cad.face_selectors import chosen_faces
from fe_models.files.cad.gmsh_model import gmsh_call
from fe_models.files.gmsh import read_gmsh
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units
from fe_models.meshes.cells.raw_mesh import mesh_from_raw
from fe_models.meshes.mesh import Mesh

__all__ = ["MeshSize", "mesh_cad"]

SMALLEST = 0.05  #: default of the smallest element size (sharp curvature, small features) divided by the largest
MOST_ELEMENTS = 5e6  #: estimated number of elements above which the size is probably in a wrong unit


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class MeshSize:
    """Element sizes for the mesh of a CAD geometry.

    Parameters
    ----------
    size
        Largest edge of an element [length].
    smallest
        Smallest edge of an element at curved surfaces and small features [length]; None: 0.05 times `size`.
    curvature
        Number of elements around a full circle; 0: the size does not follow curvature.
    order
        Order of the tetrahedra; 1: four nodes, 2: ten nodes, with middle nodes on the surfaces.
    optimise
        Whether the tetrahedra are improved after meshing.

    Raises
    ------
    MeshError
        Unless sizes are above zero and in order, the order is 1 or 2, and the curvature is 0 or from 3 to 1000.
    """

    size: float
    smallest: float | None = None
    curvature: float = 12.0
    order: int = 2
    optimise: bool = True

    def __post_init__(self) -> None:
        for key in ("size", "smallest"):
            value = getattr(self, key)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise MeshError(f"mesh size: {key}: expected a length above zero, got {value}")
        if self.smallest is not None and self.smallest > self.size:
            raise MeshError(f"mesh size: smallest: expected at most the size {self.size:g}, got {self.smallest:g}")
        if self.order not in (1, 2):
            raise MeshError(f"mesh size: order: expected 1 (tetra) or 2 (tetra10), got {self.order}")
        if self.curvature and not 3 <= self.curvature <= 1000:
            raise MeshError(
                f"mesh size: curvature: expected 3 to 1000 elements around a circle, or 0, got {self.curvature:g}"
            )

    def description(self, symbol: str) -> str:
        """Return a description of the sizes with the symbol of the length unit."""
        curvature = f", {self.curvature:g} elements around a circle" if self.curvature else ""
        optimised = "" if self.optimise else ", not optimised"
        return f"{self.size:.6g} {symbol}{curvature}, order {self.order}{optimised}"


def mesh_cad(path: str | Path, size: MeshSize, *, units: Units | str, faces: Iterable[str] = ()) -> Mesh:
    """Mesh the solids of a CAD file.

    Parameters
    ----------
    path
        STEP, IGES or BREP file, as in `fe_models.files.cad.cad_model.read_cad`.
    size
        Element sizes, in the length unit of `units`.
    units
        Unit system of the mesh.
    faces
        Selectors (`fe_models.files.cad.face_selectors`); each makes a group of faces with its text as name.

    Returns
    -------
    Mesh
        Mesh with the groups of cells "solid 1", ... and one for each name of a solid in the file. Its groups of faces
        are "face 1", ..., one for each name of a face in the file, and `faces`. `Mesh.origin` records the geometry and
        how it was meshed.

    Raises
    ------
    MeshError
        If `read_cad` raises it, the size is unreasonable, or gmsh cannot mesh the body with it.
    InterfaceError
        If a selector chooses nothing.
    MeshingError
        If gmsh is not installed.
    """
    selectors = tuple(dict.fromkeys(faces))
    with open_cad(path, units=units) as model:
        _set_size(model, size)
        _name_groups(model, selectors)
        gmsh, part = model.gmsh, model.part
        where = f"geometry {path}"
        advice = f"try another [mesh_size] size than {size.size:g} {part.units.length_symbol}, or mend the geometry"
        with TemporaryDirectory(prefix="mesh") as folder:
            file = Path(folder) / "part.msh"
            with gmsh_call(f"{where}: gmsh could not mesh it", advice=advice):
                gmsh.model.mesh.generate(3)
                gmsh.model.mesh.renumberNodes()
                gmsh.model.mesh.renumberElements()
                gmsh.write(str(file))
            _require_whole(where, gmsh, advice)
            raw = read_gmsh(file, file.read_bytes())
        raw = replace(raw, nodes=raw.nodes / model.scale, node_numbers=None)
        return replace(mesh_from_raw(raw, Path(path), part.digest), origin=_origin(part, size, gmsh))


def _set_size(model: CadModel, size: MeshSize) -> None:
    """Set the element sizes in gmsh in its unit; the options are restored when the model is closed."""
    largest = size.size * model.scale
    volume = model.part.volume
    estimate = 9 * volume / size.size**3  # a tetrahedron with edges of length h has a volume of about h³/9
    if estimate > MOST_ELEMENTS:
        extent = float(np.linalg.norm(model.part.hi - model.part.lo))
        symbol = model.part.units.length_symbol
        raise MeshError(
            f"geometry {model.part.path}: [mesh_size] size = {size.size:g} {symbol} would make about {estimate:.2g} "
            f"tetrahedra of a body {extent:.4g} {symbol} large; expected a size of {extent / 200:.2g} {symbol} or more"
        )
    put = model.gmsh.option.setNumber
    put("Mesh.MeshSizeMax", largest)
    put("Mesh.MeshSizeMin", largest * SMALLEST if size.smallest is None else size.smallest * model.scale)
    put("Mesh.MeshSizeFromCurvature", size.curvature)
    put("Mesh.ElementOrder", size.order)
    put("Mesh.Optimize", int(size.optimise))
    put("Mesh.OptimizeNetgen", int(size.optimise))
    put("Mesh.HighOrderOptimize", int(size.optimise))


def _name_groups(model: CadModel, selectors: tuple[str, ...]) -> None:
    """Create physical groups of solids, faces and selections."""
    gmsh, part = model.gmsh, model.part
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    groups: dict[tuple[int, str], list[int]] = {}
    for k, (tag, name) in enumerate(zip(solids, part.solids, strict=True), start=1):
        groups[3, f"solid {k}"] = [tag]
        if name:
            groups.setdefault((3, _plain(name)), []).append(tag)
    for face in part.faces:
        if not face.is_inner:
            groups[2, f"face {face.number}"] = [face.tag]
    for text in selectors:
        if (2, text) not in groups:
            groups[2, text] = [face.tag for face in chosen_faces(text, part.faces)]
    for (dim, name), tags in groups.items():
        gmsh.model.addPhysicalGroup(dim, tags, name=name)


def _plain(name: str) -> str:
    """Return a name without quotes and line ends, which mesh files cannot contain."""
    return " ".join(name.replace('"', "'").split())


def _require_whole(where: str, gmsh: ModuleType, advice: str) -> None:
    """Raise an error unless every solid has elements and none is inverted."""
    for _, tag in gmsh.model.getEntities(3):
        _, elements, _ = gmsh.model.mesh.getElements(3, tag)
        if not elements or not len(elements[0]):
            raise MeshError(f"{where}: gmsh made no elements of solid {tag}; {advice}")
        worst = float(np.min(gmsh.model.mesh.getElementQualities(np.concatenate(elements), "minSICN")))
        if worst <= 0:
            raise MeshError(f"{where}: gmsh made inverted elements (quality {worst:.2g}); {advice}")


def _origin(part: CadPart, size: MeshSize, gmsh: ModuleType) -> dict[str, str]:
    made = {"geometry": part.description, "mesh size": size.description(part.units.length_symbol)}
    return made | {"gmsh": str(gmsh.GMSH_API_VERSION)}
