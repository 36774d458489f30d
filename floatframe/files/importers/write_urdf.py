"""A `Robot` written as URDF: every number by the digits that read the same again."""

import os
from pathlib import Path
from xml.sax.saxutils import quoteattr

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_file
from floatframe.errors import UrdfError
from floatframe.files.importers.robot import WITH_AXIS, Inertial, Link, MeshFile, Picture, Pose, Robot, RobotJoint
from floatframe.model.shapes import Box, Cylinder

__all__ = ["urdf_text", "write_urdf"]

TENSOR = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def write_urdf(robot: Robot, path: str | os.PathLike[str]) -> None:
    """Write a robot; an existing file is replaced completely or not at all.

    Raises
    ------
    UrdfError
        If the file cannot be written, or a limit that URDF asks for is not known.
    """
    text = urdf_text(robot)
    try:
        replace_file(Path(path), text.encode("utf-8"))
    except OSError as error:
        raise UrdfError(f"{path}: cannot be written: {error.strerror}") from error


def urdf_text(robot: Robot) -> str:
    """Return a robot as text; `UrdfError` if a limit required by URDF is unknown."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoteattr(robot.name)}>"]
    for link in robot.links:
        lines += link_lines(link)
    for joint in robot.joints:
        lines += joint_lines(robot, joint)
    return "\n".join([*lines, "</robot>", ""])


def numbers(values: Array | tuple[float, ...] | list[float]) -> str:
    """Return numbers in quotes, the shortest digits that read the same."""
    return '"' + " ".join(number(value) for value in values) + '"'


def number(value: float) -> str:
    """Return the shortest digits that read the same."""
    text = repr(float(value))
    return text.removesuffix(".0")


def link_lines(link: Link) -> list[str]:
    """Return the lines of a link."""
    inside = [] if link.inertial is None else inertial_lines(link.inertial)
    for tag, pictures in (("visual", link.visuals), ("collision", link.collisions)):
        for picture in pictures:
            inside += picture_lines(tag, picture, f"{link.name} {len(inside)}")
    return wrapped(f"link name={quoteattr(link.name)}", inside)


def wrapped(head: str, inside: list[str]) -> list[str]:
    """Return an element with its lines, indented."""
    if not inside:
        return [f"  <{head}/>"]
    return [f"  <{head}>", *(f"  {line}" for line in inside), f"  </{head.split()[0]}>"]


def origin_lines(pose: Pose) -> list[str]:
    """Return the line of a pose; none for the frame itself."""
    if not (pose.xyz.any() or pose.rpy.any()):
        return []
    rpy = f" rpy={numbers(pose.rpy)}" if pose.rpy.any() else ""
    return [f"  <origin xyz={numbers(pose.xyz)}{rpy}/>"]


def inertial_lines(inertial: Inertial) -> list[str]:
    """Return the lines of mass properties."""
    tensor = " ".join(f'{key}="{number(inertial.tensor[place])}"' for key, place in TENSOR.items())
    return wrapped(
        "inertial",
        [*origin_lines(inertial.pose), f'  <mass value="{number(inertial.mass)}"/>', f"  <inertia {tensor}/>"],
    )


def picture_lines(tag: str, picture: Picture, material: str) -> list[str]:
    """Return the lines of a visual or a collision; `material`: the name of its colour."""
    shape = picture.geometry
    if isinstance(shape, Box):
        inner = f"<box size={numbers(shape.size)}/>"
    elif isinstance(shape, Cylinder):
        inner = f'<cylinder radius="{number(shape.radius)}" length="{number(shape.length)}"/>'
    elif isinstance(shape, MeshFile):
        scale = "" if (shape.scale == 1.0).all() else f" scale={numbers(shape.scale)}"
        inner = f"<mesh filename={quoteattr(shape.file)}{scale}/>"
    else:
        inner = f'<sphere radius="{number(shape.radius)}"/>'
    lines = [*origin_lines(picture.pose), f"  <geometry>{inner}</geometry>"]
    if picture.color is not None:
        lines.append(f"  <material name={quoteattr(material)}><color rgba={numbers(picture.color)}/></material>")
    name = f" name={quoteattr(picture.name)}" if picture.name else ""
    return wrapped(tag + name, lines)


def joint_lines(robot: Robot, joint: RobotJoint) -> list[str]:
    """Return the lines of a joint."""
    inside = [*origin_lines(joint.pose), f"  <parent link={quoteattr(joint.parent)}/>"]
    inside.append(f"  <child link={quoteattr(joint.child)}/>")
    if joint.type in WITH_AXIS:
        inside.append(f"  <axis xyz={numbers(joint.axis)}/>")
    limits = [
        f'{name}="{number(value)}"'
        for name in ("lower", "upper", "effort", "velocity")
        if (value := getattr(joint.limits, name)) is not None
    ]
    if joint.type in ("revolute", "prismatic"):
        missing = [name for name in ("lower", "upper", "effort", "velocity") if getattr(joint.limits, name) is None]
        if missing:
            raise UrdfError(
                f"robot {robot.name!r}: joint {joint.name!r}: URDF requires limits of a {joint.type} "
                f"joint; {', '.join(missing)} not given"
            )
    if limits:
        inside.append(f"  <limit {' '.join(limits)}/>")
    if joint.damping or joint.friction:
        inside.append(f'  <dynamics damping="{number(joint.damping)}" friction="{number(joint.friction)}"/>')
    if joint.mimic is not None:
        inside.append(
            f'  <mimic joint={quoteattr(joint.mimic.joint)} multiplier="{number(joint.mimic.multiplier)}" '
            f'offset="{number(joint.mimic.offset)}"/>'
        )
    return wrapped(f"joint name={quoteattr(joint.name)} type={quoteattr(joint.type)}", inside)
