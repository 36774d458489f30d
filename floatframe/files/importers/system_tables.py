"""A robot as a system file: a folder with the file, surfaces and modal files, ready for `floatframe run`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_files
from floatframe.errors import UrdfError
from floatframe.files.importers.mesh_files import stl_bytes
from floatframe.files.importers.robot_system import RobotSystem
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity, JointForce
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import JOINTS, FixedJoint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler
from floatframe.model.shapes import Box, Cylinder, Mesh
from floatframe.model.shapes.shape import Shape

__all__ = ["write_system"]

TYPES = {kind: name for name, kind in JOINTS.data.items()}  # those of other packages are not loaded


def write_system(found: RobotSystem, folder: Path, *, t_end: float = 1.0, h: float = 1e-3) -> tuple[Path, ...]:
    """Write the system of a robot to a folder; return the files, the system file first.

    Raises
    ------
    UrdfError
        If a file cannot be written, or a flexible link did not come from a modal file.
    """
    writer = Writer(found, folder)
    tables = writer.tables() | {"run": {"t_end": t_end, "h": h}}
    head = f"# {found.robot.name}" + (f", from {Path(found.robot.source).name}" if found.robot.source else "")
    path = folder / f"{found.robot.name}.toml"
    files = {path: f"{head}\n{tomlkit.dumps(tables)}".encode(), **writer.files}
    try:
        for each in files:
            each.parent.mkdir(parents=True, exist_ok=True)
        replace_files(files)
    except OSError as error:
        raise UrdfError(f"{folder}: cannot be written: {error.strerror}") from error
    return tuple(files)


class Writer:
    """Creates the tables of a system file, and stores the files that they name."""

    def __init__(self, found: RobotSystem, folder: Path) -> None:
        self.found, self.folder = found, folder
        self.files: dict[Path, bytes] = {}

    def tables(self) -> dict[str, Any]:
        """Return the tables."""
        system = self.found.system
        gravity = [force.acceleration.tolist() for force in system.forces if isinstance(force, Gravity)]
        return {
            "system": {"name": system.name, "units": system.units.name} | ({"gravity": gravity[0]} if gravity else {}),
            "bodies": {body.name: self.body(body) for body in system.bodies},
            "joints": {joint.name: joint_table(joint) for joint in system.joints},
            "couplers": {coupler.name: coupler_table(coupler) for coupler in system.couplers},
            "forces": {force.name: force_table(force) for force in system.forces if isinstance(force, JointForce)},
        }

    def body(self, body: RigidBody | FlexibleBody) -> dict[str, Any]:
        """Return the table of a body."""
        place = {"position": body.drawn_position.tolist(), "euler_parameters": body.orientation.tolist()}
        if body.velocity.any() or body.omega_B.any():
            place |= {"velocity": body.velocity.tolist(), "omega_B": body.omega_B.tolist()}
        if isinstance(body, FlexibleBody):
            if not body.source:
                raise UrdfError(f"flexible link {body.name!r}: a system file needs its modal file; give its path")
            path = self.folder / Path(body.source).name
            self.files[path] = Path(body.source).read_bytes()
            return {"file": path.name, **place}
        own = {
            "mass": body.mass, "inertia": body.inertia.tolist(), "center_of_mass": body.center_of_mass.tolist(), **place
        }  # fmt: skip
        shapes = [self.shape(body, k, each) for k, each in enumerate(body.shapes) if isinstance(each, Shape)]
        return own | ({"shapes": shapes} if shapes else {})

    def shape(self, body: RigidBody, k: int, shape: Shape) -> dict[str, Any]:
        """Return the table of the shapes of a body."""
        geometry = shape.geometry
        if isinstance(geometry, Box):
            table: dict[str, Any] = {"type": "box", "size": geometry.size.tolist()}
        elif isinstance(geometry, Cylinder):
            table = {"type": "cylinder", "radius": geometry.radius, "length": geometry.length}
        elif isinstance(geometry, Mesh):
            name = f"meshes/{body.name}_{k}.stl"
            self.files[self.folder / name] = stl_bytes(geometry.nodes, geometry.triangles)
            table = {"type": "mesh", "file": name}
        else:
            table = {"type": "sphere", "radius": geometry.radius}  # type: ignore[attr-defined]
        for key in ("position", "rotation_vector"):
            if getattr(shape, key).any():
                table[key] = getattr(shape, key).tolist()
        if shape.color is not None:
            table["color"] = shape.color
        return table | ({"opacity": shape.opacity} if shape.opacity < 1 else {})


def marker_keys(side: str, marker: Any) -> dict[str, Any]:
    """Return the keys for a marker."""
    assert isinstance(marker, Marker)  # joints of a robot always have markers
    keys: dict[str, Any] = {f"body_{side}": body_name(marker.body)}
    if marker.interface is not None:
        keys[f"marker_{side}"] = marker.interface
    elif marker.position is not None:
        keys[f"marker_{side}"] = marker.position.tolist()
    triad: Array | None = marker.triad
    if triad is not None and (triad != np.eye(3)).any():
        keys[f"triad_{side}"] = triad.T.tolist()
    return keys


def joint_table(joint: Any) -> dict[str, Any]:
    """Return the table of a joint."""
    table = {"type": TYPES[type(joint)], **marker_keys("a", joint.marker_a), **marker_keys("b", joint.marker_b)}
    if isinstance(joint, FixedJoint):
        return table | ({} if joint.rotation is None else {"rotation": joint.rotation.tolist()})
    axis_b = getattr(joint, "axis_b", None)
    return table | {"axis": joint.axis.tolist()} | ({} if axis_b is None else {"axis_b": axis_b.tolist()})


def coupler_table(coupler: CoordinateCoupler) -> dict[str, Any]:
    """Return the table of a coupler."""
    terms = [
        {"joint": coordinate.joint, "coordinate": coordinate.coordinate, "factor": factor}  # type: ignore[union-attr]
        for coordinate, factor in coupler.terms
    ]
    table: dict[str, Any] = {"terms": terms}
    if isinstance(coupler.constant, TimeFunction):
        table["constant"] = coupler.constant(0.0)
    if coupler.limits is not None:
        limits: Mapping[str, float | None] = {"lower": coupler.limits.lower, "upper": coupler.limits.upper}
        table["limits"] = {key: value for key, value in limits.items() if value is not None}
    return table


def force_table(force: JointForce) -> dict[str, Any]:
    """Return the table of damping and friction."""
    keys = ("joint", "coordinate", "damping", "friction")
    return {"type": "joint-force"} | {key: value for key in keys if (value := getattr(force, key))}
