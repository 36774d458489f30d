"""Surface files that a robot description names, and their contents.

Names are `package://NAME/rest` (of ROS), `file:///path`, or a path relative to the description. A package is searched
for in the folder that the caller gives, then in the folders above the description (as NAME/rest, or as the folder NAME
itself), then in the folders in ROS_PACKAGE_PATH.
"""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.paths import near_file
from fe_models.foundation.words import quoted
from floatframe.errors import ModelError, UrdfError
from floatframe.files.importers.robot import MeshFile
from floatframe.model.shapes.mesh import Mesh, mesh_file

__all__ = ["mesh_of", "mesh_path", "stl_bytes"]

VARIABLE = "ROS_PACKAGE_PATH"


def mesh_path(name: str, source: str, packages: Mapping[str, str | os.PathLike[str]] | None = None) -> Path:
    """Return the path of the file that a name in a description refers to.

    Parameters
    ----------
    name
        Name as written in the description.
    source
        Path of the description; "": the description is not in a file, and names of files are paths.
    packages
        Folders of packages by their names.

    Raises
    ------
    UrdfError
        If there is no such file; the message lists the searched paths.
    """
    tried = list(candidates(unquote(name) if "://" in name else name, source, packages or {}))
    for path in tried:
        if path.is_file():
            return path
    where = source or "robot"
    if not tried:
        raise UrdfError(
            f"{where}: mesh {quoted(name)}: expected package://NAME/..., file://... or a path; got another scheme"
        )
    if name.startswith("package://"):
        package = name.removeprefix("package://").split("/")[0]
        raise UrdfError(
            f"{where}: mesh {quoted(name)}: not found; looked for {', '.join(str(path) for path in tried[:4])}"
            f"{' and others' if len(tried) > 4 else ''}; say where package {quoted(package)} is (packages, --package "
            f"{package}=FOLDER), or omit pictures"
        )
    raise UrdfError(f"{where}: mesh {quoted(name)}: no such file: {tried[0]}{near_file(tried[0])}")


def candidates(name: str, source: str, packages: Mapping[str, str | os.PathLike[str]]) -> Iterator[Path]:
    """Yield possible paths of a file; the first existing one is used."""
    folder = Path(source).resolve().parent if source else Path.cwd()
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        if package in packages:
            yield Path(packages[package]) / rest
            return
        for above in (folder, *folder.parents):
            if above.name == package:
                yield above / rest
            yield above / package / rest
        for listed in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
            if Path(listed).name == package:
                yield Path(listed) / rest
            yield Path(listed) / package / rest
    elif name.startswith("file://"):
        yield folder / name.removeprefix("file://")
    elif "://" not in name:
        yield folder / name


def mesh_of(mesh: MeshFile, path: Path) -> Mesh:
    """Return the surface in a file in units of the robot, mirrored if the scale is negative.

    Raises
    ------
    UrdfError
        If the file contains no readable surface.
    """
    try:
        surface = mesh_file(path)
    except ModelError as error:
        raise UrdfError(str(error)) from None
    if (mesh.scale == 1.0).all():
        return surface
    is_mirrored = np.prod(mesh.scale) < 0  # keeps normals outward
    return Mesh(surface.nodes * mesh.scale, surface.triangles[:, ::-1] if is_mirrored else surface.triangles)


def stl_bytes(nodes: Array, triangles: IntArray) -> bytes:
    """Return a surface as binary STL: 80 bytes, number of triangles, then normal, three corners and two bytes each.

    The format has single precision: coordinates are rounded to about 1e-7 of their magnitude.
    """
    corners = np.asarray(nodes)[np.asarray(triangles)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    rows = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    rows["corners"] = corners
    return b"binary STL".ljust(80) + np.uint32(len(corners)).tobytes() + rows.tobytes()
