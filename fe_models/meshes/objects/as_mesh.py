"""One door for meshes of other Python libraries: told by their class, none of them imported here."""

from pathlib import Path
from typing import Any

from fe_models.errors import MeshError
from fe_models.meshes.cells.line_cells import line_mesh_from_raw
from fe_models.meshes.cells.raw_mesh import RawMesh, mesh_from_raw
from fe_models.meshes.cells.shell_cells import shell_mesh_from_raw
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.node_cloud import NodeCloud
from fe_models.meshes.objects.meshio_mesh import raw_from_meshio
from fe_models.meshes.objects.pyvista_grid import raw_from_pyvista
from fe_models.meshes.objects.skfem_basis import raw_from_basis
from fe_models.meshes.objects.skfem_mesh import raw_from_skfem
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["as_line_mesh", "as_mesh", "as_shell_mesh", "selectable"]

KNOWN = {
    ("meshio", "Mesh"): raw_from_meshio,
    ("pyvista", "UnstructuredGrid"): raw_from_pyvista,
    ("skfem", "AbstractBasis"): raw_from_basis,
    ("skfem", "Mesh"): raw_from_skfem,
}  #: library and class, or base class -> what it says


def as_mesh(mesh_like: Any) -> Mesh:
    """Return the solid mesh that an object is: one of ours as it is, or of meshio, pyvista or scikit-fem.

    Parameters
    ----------
    mesh_like
        A `fe_models.Mesh`, `meshio.Mesh`, `pyvista.UnstructuredGrid`, a mesh of scikit-fem (`MeshTet1`, `MeshTet2`,
        `MeshHex1`, `MeshHex2`, `MeshWedge1`), or a vector basis on one, whose nodes are those of its element.

    Raises
    ------
    MeshError
        If it is none of these, has no solid cells, or cells of an unknown kind.
    """
    if isinstance(mesh_like, Mesh):
        return mesh_like
    return mesh_from_raw(*_said(mesh_like))


def selectable(mesh_like: Any) -> Mesh | ShellMesh | LineMesh | NodeCloud:
    """Return a mesh or nodes on which selections choose: ours as they are, of other libraries their solid mesh."""
    return mesh_like if isinstance(mesh_like, Mesh | ShellMesh | LineMesh | NodeCloud) else as_mesh(mesh_like)


def as_shell_mesh(mesh_like: Any) -> ShellMesh:
    """Return the mesh of all triangles and quads of an object, as `as_mesh`; `MeshTri1`, `MeshQuad1` lie at z = 0."""
    if isinstance(mesh_like, ShellMesh):
        return mesh_like
    return shell_mesh_from_raw(*_said(mesh_like), None, ())


def as_line_mesh(mesh_like: Any) -> LineMesh:
    """Return the mesh of all lines of an object, as `as_mesh`."""
    if isinstance(mesh_like, LineMesh):
        return mesh_like
    return line_mesh_from_raw(*_said(mesh_like), None)


def _said(mesh_like: Any) -> tuple[RawMesh, Path, str]:
    """Return what an object says, a name for messages, and no digest."""
    bases = [(base.__module__.partition(".")[0], base.__name__) for base in type(mesh_like).__mro__]
    for base in bases:
        if base in KNOWN:
            return KNOWN[base](mesh_like), Path(".".join(bases[0])), ""
    known = ", ".join(".".join(name) for name in KNOWN)
    raise MeshError(f"mesh: expected a mesh of fe_models, or one of {known}; got {'.'.join(bases[0])}")
