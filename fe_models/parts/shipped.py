"""Meshes that are part of the package."""

from importlib.resources import files
from pathlib import Path

from fe_models.parts.errors import PartError

__all__ = ["SHIPPED_MESHES", "shipped_mesh"]

#: file of each mesh, in mm: `ConnectingRod` with default dimensions, and `SLENDER_ROD` in elements of 7 mm
SHIPPED_MESHES = {"connecting_rod": "connecting_rod.msh", "slender_rod": "slender_rod.msh"}


def shipped_mesh(name: str) -> Path:
    """Return the path of a mesh of the package, such as "connecting_rod" (tet10, mm, groups of its mesher).

    Raises
    ------
    PartError
        If there is no such mesh, or the package was installed without unpacked files.
    """
    if name not in SHIPPED_MESHES:
        raise PartError(f"shipped_mesh: no mesh {name!r}; choices: {', '.join(SHIPPED_MESHES)}")
    resource = files("fe_models.parts") / "data" / SHIPPED_MESHES[name]
    path = Path(str(resource))
    if not path.is_file():
        raise PartError(f"shipped_mesh: {path} is missing; install the package unpacked, with pip")
    return path
