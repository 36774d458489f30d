"""VTK meshes, legacy (.vtk) and XML (.vtu), through meshio; whole-number cell data become groups."""

import contextlib
import io
import re
from pathlib import Path

from fe_models.errors import MeshError
from fe_models.meshes.cells.raw_mesh import RawMesh
from fe_models.meshes.objects.meshio_mesh import raw_from_meshio

__all__ = ["read_vtk"]

_SUPPORTED = "supported are linear and quadratic tetrahedra and hexahedra, and linear wedges; mesh the part again"
_WITHOUT_SIZE = ("wedge12", "wedge15", "wedge18", "pyramid13", "hexahedron24", "quad6", "triangle7")  # in meshio


def read_vtk(path: Path, data: bytes) -> RawMesh:
    """Return the nodes and cells, with a group `<array>_<value>` for every value of whole-number cell data.

    Whole-number point data that contain only 0 and 1 become node sets. Linear wedges that do
    not have the orientation that VTK defines are reversed.

    Parameters
    ----------
    path
        Path of the file, read by meshio.
    data
        Content of the file, which is checked for data that meshio would ignore.

    Raises
    ------
    MeshError
        If meshio cannot read the file or would drop cells, or if the file has several pieces (meshio keeps the last).
    """
    import meshio

    where = f"mesh {path}"
    if path.suffix.lower() == ".vtu":
        pieces = len(re.findall(rb"<Piece[\s>]", data))
        if pieces > 1:
            raise MeshError(
                f"{where}: the file has {pieces} pieces; expected one. Merge them (in ParaView: Merge "
                f"Blocks, then save again)"
            )
    said = io.StringIO()
    mesh, failure = None, None
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:
        failure = error
    words = " ".join(said.getvalue().split())
    if "cannot handle" in words:
        kind = re.search(r"type (\d+)", words)
        raise MeshError(f"{where}: unsupported cells{f' of VTK type {kind[1]}' if kind else ''}; {_SUPPORTED}")
    if isinstance(failure, KeyError) and failure.args[0] in _WITHOUT_SIZE:
        raise MeshError(f"{where}: unsupported cells of type {failure.args[0]}; {_SUPPORTED}") from failure
    if mesh is None:
        reason = words if isinstance(failure, SystemExit) else f"{words} {failure}".strip()
        raise MeshError(
            f"{where}: could not be read as a VTK file: it is damaged or of another kind "
            f"({' '.join(reason.split())[:200] or type(failure).__name__})"
        ) from failure
    return raw_from_meshio(mesh)
