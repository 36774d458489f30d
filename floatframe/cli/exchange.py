"""The command `floatframe import`, and the output of `floatframe info` for a robot."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import guarded, print_table, say

if TYPE_CHECKING:
    from floatframe.files.importers.robot import Robot

__all__ = ["import_command", "print_robot"]


@guarded
def import_command(
    robot: Annotated[Path, typer.Argument(help="A description of a robot (.urdf).")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder to write; default: its name.")] = None,
    at: Annotated[list[str], typer.Option(help="JOINT=VALUE, an initial value in rad or m; repeatable.")] = [],  # noqa: B006
    free: Annotated[
        bool, typer.Option("--free", help="The root link moves freely; otherwise it is fixed to the ground.")
    ] = False,
    keep_fixed: Annotated[
        bool, typer.Option("--keep-fixed", help="Links fixed to each other remain separate bodies.")
    ] = False,
    no_stops: Annotated[bool, typer.Option("--no-stops", help="Ignore the limits of joints.")] = False,
    gravity: Annotated[float, typer.Option(help="Acceleration of free fall along -z, m/s².")] = 9.81,
    pictures: Annotated[str, typer.Option(help="Shapes of the bodies: visual, collision or none.")] = "visual",
    package: Annotated[list[str], typer.Option(help="NAME=FOLDER of a package of meshes; may be repeated.")] = [],  # noqa: B006
    flexible: Annotated[
        list[str], typer.Option(help="LINK=FILE, a modal file in the place of a link; may be repeated.")
    ] = [],  # noqa: B006
    interface: Annotated[
        list[str], typer.Option(help="LINK.JOINT=NAME, the interface of a flexible link at a joint; may be repeated.")
    ] = [],  # noqa: B006
) -> None:
    """Read a robot (URDF, MJCF) as a system file.

    Its surfaces and modal files are written next to it.

    Example: floatframe import arm.urdf -o arm --at elbow=0.5
    """
    from floatframe.errors import UrdfError
    from floatframe.files.importers.read_urdf import read_urdf
    from floatframe.files.importers.robot_system import FlexibleLink, robot_system
    from floatframe.files.importers.system_tables import write_system

    found = read_urdf(robot)
    placed = {}
    for name, text in pairs("--at", at).items():
        try:
            placed[name] = float(text)
        except ValueError:
            raise UrdfError(f"--at {name}={text}: expected a number") from None
    interfaces: dict[str, dict[str, str]] = {}
    for words, name in pairs("--interface", interface).items():
        link, _, joint = words.partition(".")
        interfaces.setdefault(link, {})[joint] = name
    links = {
        link: FlexibleLink(Path(file), interfaces.pop(link, {})) for link, file in pairs("--flexible", flexible).items()
    }
    if interfaces:
        raise UrdfError(f"--interface: {', '.join(interfaces)}: not flexible; name its modal file by --flexible")
    made = robot_system(
        found, configuration=placed, is_free=free, gravity=(0.0, 0.0, -gravity), flexible=links,
        merge_fixed=not keep_fixed, stops=not no_stops, pictures=pictures,
        packages={name: Path(path) for name, path in pairs("--package", package).items()},
    )  # fmt: skip
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)
    folder = output or Path(found.name)
    for path in write_system(made, folder):
        say(f"wrote {path}")


def pairs(option: str, given: list[str]) -> dict[str, str]:
    """Return NAME=VALUE options by name."""
    from floatframe.errors import UrdfError

    found = {}
    for words in given:
        name, sign, value = words.partition("=")
        if not (name and sign and value):
            raise UrdfError(f"{option} {words}: expected NAME=VALUE")
        found[name] = value
    return found


def print_robot(path: Path, *, as_json: bool) -> None:
    """Print links and joints of a robot."""
    from floatframe.files.importers.read_urdf import read_urdf

    robot = read_urdf(path)
    record = robot_record(robot)
    if as_json:
        typer.echo(json_module.dumps(record, indent=2, ensure_ascii=True))
        return
    print_table(
        "Robot",
        ("", ""),
        [
            ("name", robot.name),
            ("links", f"{len(robot.links)}, root {robot.root}"),
            ("joints", f"{len(robot.joints)}, {record['freedoms']} degrees of freedom"),
            ("mass", f"{record['mass']:.6g} kg"),
            *(("note", note) for note in robot.notes),
        ],
    )
    print_table(
        "Links",
        ("link", "mass [kg]>", "principal moments [kg m²]", "pictures"),
        [
            (each["name"], f"{each['mass']:.6g}", ", ".join(f"{x:.4g}" for x in each["moments"]) or "none",
             ", ".join(each["pictures"]) or "none")
            for each in record["links"]
        ],
    )  # fmt: skip
    print_table(
        "Joints",
        ("joint", "type", "from", "to", "limits", "effort>", "velocity>", "follows"),
        [
            (
                each["name"], each["type"], each["parent"], each["child"],
                "" if each["lower"] is None else f"{each['lower']:.4g} to {each['upper']:.4g}",
                "" if each["effort"] is None else f"{each['effort']:.4g}",
                "" if each["velocity"] is None else f"{each['velocity']:.4g}", each["follows"] or "",
            )
            for each in record["joints"]
        ],
    )  # fmt: skip


def robot_record(robot: "Robot") -> dict[str, Any]:
    """Return the record of a robot for `info`; moments of inertia that no body can have are marked by a note."""
    import numpy as np

    from floatframe.files.importers.robot import MeshFile

    freedoms = {"fixed": 0, "planar": 3, "floating": 6}
    links = []
    for link in robot.links:
        tensor = None if link.inertial is None else link.inertial.tensor
        moments = [] if tensor is None else np.linalg.eigvalsh(tensor).tolist()
        pictures = [
            each.geometry.file if isinstance(each.geometry, MeshFile) else type(each.geometry).__name__.lower()
            for each in link.visuals
        ]
        links.append({"name": link.name, "mass": link.mass, "moments": moments, "pictures": pictures})
    return {
        "name": robot.name,
        "root": robot.root,
        "mass": sum(link.mass for link in robot.links),
        "freedoms": sum(freedoms.get(joint.type, 1) for joint in robot.joints if joint.mimic is None),
        "links": links,
        "joints": [
            {
                "name": joint.name, "type": joint.type, "parent": joint.parent, "child": joint.child,
                "lower": joint.limits.lower, "upper": joint.limits.upper, "effort": joint.limits.effort,
                "velocity": joint.limits.velocity, "follows": joint.mimic.joint if joint.mimic else None,
            }
            for joint in robot.joints
        ],
        "notes": list(robot.notes),
    }  # fmt: skip
