"""Reading of mesh files: the suffix selects the format, and all faults of a file raise the same error."""

from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path
from typing import TypeVar

import numpy as np

from fe_models.door import Registry
from fe_models.errors import FeModelsError, MeshError
from fe_models.files.abaqus.mesh import read_abaqus
from fe_models.files.cad.cad_units import CAD_FORMATS
from fe_models.files.gmsh import read_gmsh
from fe_models.files.med import read_med
from fe_models.files.nastran.mesh import read_nastran
from fe_models.files.vtk import read_vtk
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.formats import ReadFormat, by_suffix
from fe_models.foundation.paths import bytes_of, file_digest, reading
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.cells.line_cells import line_mesh_from_raw
from fe_models.meshes.cells.raw_mesh import LINES, RawMesh, mesh_from_raw, require_nodes
from fe_models.meshes.cells.shell_cells import shell_mesh_from_raw
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import FACE_TYPES, SOLID_TYPES, Mesh
from fe_models.meshes.node_cloud import NodeCloud
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = [
    "MESHES", "MESH_FORMATS", "geometry_from_raw", "read_geometry", "read_line_mesh", "read_mesh", "read_shell_mesh",
]  # fmt: skip


# geometry -------------------------------------------------------------------------------------------------------------
# Geometry that accompanies matrices: nodes with numbers and groups, and solid cells if all cells are known.


def geometry_from_raw(raw: RawMesh, path: Path, digest: str) -> Mesh | NodeCloud:
    """Return the mesh of a file if all elements are known solids, otherwise only its nodes and groups.

    Geometric selections find surface nodes in a mesh of solids, and all nodes otherwise.

    Parameters
    ----------
    raw
        Content of the file.
    path, digest
        Name of the file and its sha256, for the record and the messages.

    Raises
    ------
    MeshError
        If there are no nodes, or the known part of the mesh is invalid.
    """
    kinds = {block.kind for block in raw.blocks if len(block.nodes)}
    lone = kinds - {"vertex"}
    if lone and lone <= {*SOLID_TYPES, *FACE_TYPES} and lone & {*SOLID_TYPES}:
        return mesh_from_raw(raw, path, digest)
    known = tuple(block for block in raw.blocks if block.kind in (*SOLID_TYPES, *FACE_TYPES, *LINES))
    nodes, blocks = require_nodes(f"mesh {path}", RawMesh(raw.nodes, known, node_numbers=raw.node_numbers))
    node_sets = {name: np.unique(members) for name, members in raw.node_sets.items()}
    of_lines: dict[str, list[IntArray]] = {}
    faces: dict[str, dict[str, list[IntArray]]] = {}
    for block in blocks:
        for group, rows in block.groups.items():
            if block.kind in LINES:
                of_lines.setdefault(group, []).append(block.nodes[rows].ravel())
            elif block.kind in FACE_TYPES:
                faces.setdefault(group, {}).setdefault(block.kind, []).append(block.nodes[rows])
    for group, parts in of_lines.items():
        node_sets.setdefault(group, np.unique(np.concatenate(parts)))
    return NodeCloud(
        nodes,
        node_sets,
        {group: {kind: np.concatenate(parts) for kind, parts in by.items()} for group, by in faces.items()},
        source=str(path),
        digest=digest,
        included=raw.included,
        node_numbers=np.zeros(0, np.int64) if raw.node_numbers is None else raw.node_numbers,
        notes=raw.notes,
    )


# read mesh ------------------------------------------------------------------------------------------------------------


M = TypeVar("M")

#: reads the content of a file: path and bytes
MeshReader = Callable[[Path, bytes], RawMesh]

MESHES: tuple[ReadFormat[MeshReader], ...] = (
    ReadFormat("MSH 2.2, 4.1", "Gmsh", "mesh", (".msh",), tried="Gmsh 4.15", read=read_gmsh),
    ReadFormat("VTK, VTU", "ParaView", "mesh", (".vtk", ".vtu"), tried="meshio 5.3, pyvista", read=read_vtk),
    ReadFormat(
        "input deck", "Abaqus, CalculiX", "mesh", (".inp",), tried="decks of ccx 2.20",
        lost="all but the mesh and its sets", read=read_abaqus,
    ),
    ReadFormat(
        "bulk data", "Nastran", "mesh", (".bdf", ".nas", ".dat", ".fem", ".blk", ".bulk"), lost="all but the mesh",
        read=read_nastran,
    ),
    ReadFormat("MED", "Salome, code_aster", "mesh", (".med",), read=read_med),
)  # fmt: skip
#: format by suffix: those of this project, and those of other packages by entry points
MESH_FORMATS: Registry[ReadFormat[MeshReader]] = Registry(
    "fe_models.readers", by_suffix(MESHES), MeshError, prefix=".",
    made=lambda suffix, reader, package: ReadFormat("mesh", package, "mesh", (suffix,), read=reader),
)  # fmt: skip


def read_mesh(path: str | Path) -> Mesh:
    """Read the mesh of one body from a file.

    The suffix names the format: Gmsh 2.2 and 4.1 (.msh), VTK (.vtk, .vtu), Abaqus and CalculiX (.inp), Nastran
    (.bdf, .nas, .dat, .fem, .blk, .bulk), MED (.med). Cells of two dimensions become faces; cells of one dimension and
    points become node sets. They select interfaces and are no part of the body. `Mesh.notes` lists what was left out.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    Mesh
        Mesh with the sha256 of the file as `digest`.

    Raises
    ------
    MeshError
        If the file is missing, unreadable, damaged, of an unknown or unsupported kind, or could only be read with
        another meaning than in its own program.
    """
    return _read(path, mesh_from_raw)


def read_geometry(path: str | Path) -> Mesh | NodeCloud:
    """Read nodes, numbers and groups from a deck or mesh that accompanies matrices.

    Parameters
    ----------
    path
        A mesh file of a known format, or a complete deck.

    Returns
    -------
    Mesh or NodeCloud
        Mesh if all elements are known solids, otherwise the nodes and their groups.

    Raises
    ------
    MeshError
        As for `read_mesh`, but elements may be of any kind.
    """
    from fe_models.files.read_deck import DECK_FORMATS, parse_deck

    path = Path(path)
    suffix = path.suffix.lower()
    if suffix in DECK_FORMATS and (suffix not in MESH_FORMATS or MESH_FORMATS[suffix].read is read_nastran):
        return geometry_from_raw(parse_deck(path).mesh, path, file_digest(str(path)))  # coordinate systems, INCLUDE
    return _read(path, geometry_from_raw)


def read_line_mesh(path: str | Path, *, groups: Iterable[str] | None = None) -> LineMesh:
    """Read the lines of a frame from a mesh file, with the readers of `read_mesh`.

    Cells with two nodes are beams, and cells with three nodes are two beams each: Gmsh curves, VTK lines, Abaqus B31
    and B32, Nastran CBAR and CBEAM, MED SE2. Their groups select sections (Gmsh physical curves, Abaqus element sets,
    Nastran pid_7); groups of points select interfaces. Solids, faces and nodes on no line are left out, with a note.

    Parameters
    ----------
    path
        The file.
    groups
        Only the lines of these groups; None: all lines.

    Raises
    ------
    MeshError
        As for `read_mesh`, and if there are no lines or a group is unknown.
    """
    wanted = None if groups is None else tuple(groups)
    return _read(path, lambda raw, path, digest: line_mesh_from_raw(raw, path, digest, wanted))


def read_shell_mesh(
    path: str | Path, *, groups: Iterable[str] | None = None, stiffeners: Iterable[str] = ()
) -> ShellMesh:
    """Read the triangles and quads of a shell from a mesh file, by the same readers as `read_mesh`.

    Cells with three or four nodes are shells, and cells with six or nine nodes are four shells each: Gmsh surfaces,
    VTK, Abaqus S3 and S4, Nastran CTRIA3 and CQUAD4, MED TR3 and QU4. Their groups select thicknesses (Gmsh physical
    surfaces, Abaqus element sets, Nastran pid_7); groups of points and lines select interfaces. Solids, and nodes of
    neither shells nor stiffeners, are left out, with a note.

    Parameters
    ----------
    path
        The file.
    groups
        Only the cells of these groups; None: all triangles and quads.
    stiffeners
        Groups of lines that are beams on the shell; other lines only select nodes.

    Raises
    ------
    MeshError
        As for `read_mesh`, and if there are no triangles or quads or a group is unknown.
    """
    wanted, lines = None if groups is None else tuple(groups), tuple(stiffeners)
    return _read(path, lambda raw, path, digest: shell_mesh_from_raw(raw, path, digest, wanted, lines))


def _read(path: str | Path, convert: Callable[[RawMesh, Path, str], M]) -> M:
    """Read a file and convert its content; every fault becomes one message."""
    path = Path(path)
    where = f"mesh {path}"
    suffix = path.suffix.lower()
    is_there = path.exists() and not path.is_dir()  # otherwise `bytes_of` names the fault
    if is_there and suffix in CAD_FORMATS:
        raise MeshError(
            f"{where}: this is a CAD geometry, which must be meshed: a table [mesh_size] in a job, or "
            f"fe_models.files.mesh_cad(path, fe_models.files.MeshSize(size), units=...)"
        )
    if is_there and suffix not in MESH_FORMATS:
        raise MeshError(f"{where}: unknown suffix {quoted(suffix)}{nearest(suffix, MESH_FORMATS)}")
    data = bytes_of(where, path, MeshError, hint=_neighbours)
    known = MESH_FORMATS[suffix]
    with reading(where, path, known, MeshError, FeModelsError):
        return convert(known.read(path, data), path, sha256(data).hexdigest())


def _neighbours(path: Path) -> str:
    """Name the mesh files in the folder of a missing file."""
    if not path.parent.is_dir():
        return f"; the folder {path.parent} does not exist"
    files = [p.name for p in path.parent.iterdir() if p.suffix.lower() in MESH_FORMATS]
    return nearest(path.name, files[:20]) if files else ""
