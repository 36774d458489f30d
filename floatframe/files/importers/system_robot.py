"""A system as a robot: a tree of rigid bodies that URDF can represent.

(1) the tree: from the ground (or the only free body) along the joints; a joint that closes a loop is refused
(2) the frame of a link is at the marker of the joint that carries it, because in URDF a joint and its child link have
    the same frame; masses and pictures are transformed to this frame
(3) with the motion T(value) of a joint and the link placed at T in its parent, the pose of the joint is T T(value)⁻¹
(4) damping and friction of joint forces, stops and couplers of two joints are written with their joints; parts that
    URDF cannot represent are listed
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import replace_file
from fe_models.foundation.presentation import presented
from floatframe.engine.compiling.markers import joint_markers
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import UrdfError
from floatframe.files.importers.frames import Frame, rpy_of
from floatframe.files.importers.mesh_files import stl_bytes
from floatframe.files.importers.robot import (
    WITH_AXIS,
    Inertial,
    JointLimits,
    Link,
    MeshFile,
    Mimic,
    Picture,
    Pose,
    Robot,
    RobotJoint,
)
from floatframe.model.bodies.coordinates import JointCoordinateName
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity, JointForce
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import FixedJoint, Joint, PlanarJoint, PrismaticJoint, RevoluteJoint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.model.shapes import Box, Cylinder, Sphere
from floatframe.model.shapes.piece import joined
from floatframe.model.shapes.shape import Shape
from floatframe.model.system import System

__all__ = ["ExportedRobot", "robot_of_system", "urdf_text", "write_urdf"]


TYPES: dict[type, str] = {
    RevoluteJoint: "continuous", PrismaticJoint: "prismatic", FixedJoint: "fixed", PlanarJoint: "planar",
}  # fmt: skip


@presented
@dataclass(frozen=True, eq=False)
class ExportedRobot:
    """A robot exported from a system."""

    robot: Robot
    meshes: Mapping[str, bytes]  #: surface files, by their path relative to the description
    notes: tuple[str, ...]  #: notes on parts that URDF cannot represent and that are omitted


def robot_of_system(
    system: System, *, values: Mapping[str, float] | None = None, limits: Mapping[str, JointLimits] | None = None
) -> ExportedRobot:
    """Return a system of rigid bodies in a tree as a robot.

    Parameters
    ----------
    system
        System of rigid bodies, in m, kg and s.
    values
        Joint values in the placed configuration, by name; default: all are zero as placed.
    limits
        Limits of joints, by name; limits that stops of the system define may be omitted. URDF requires all four
        limits of a revolute or prismatic joint.

    Raises
    ------
    UrdfError
        If there is a flexible body, a loop, a joint that URDF does not have, or other units.
    """
    return Exporter(system, dict(values or {}), dict(limits or {})).exported()


class Exporter:
    """Creates links and joints from a system."""

    def __init__(self, system: System, values: dict[str, float], limits: dict[str, JointLimits]) -> None:
        self.system, self.values, self.limits = system, values, limits
        self.where = f"system {system.name!r}"
        self.notes: list[str] = []
        self.meshes: dict[str, bytes] = {}
        if system.units.name != "m-kg-s":
            raise UrdfError(f"{self.where}: URDF is in m, kg and s, but the system in {system.units.name!r}")
        flexible = [body.name for body in system.bodies if not isinstance(body, RigidBody)]
        if flexible:
            raise UrdfError(
                f"{self.where}: URDF has no flexible bodies; replace by rigid bodies: {', '.join(flexible)}"
            )
        self.bodies = {body.name: body for body in placed_bodies(system) if isinstance(body, RigidBody)}
        known = {joint.name for joint in system.joints}
        for name in [*values, *limits]:
            if name not in known:
                raise UrdfError(f"{self.where}: there is no joint {name!r}; choices: {', '.join(sorted(known))}")
        placed = compiled_system(system).placed
        names = [body.name for body in system.bodies]
        self.ends: dict[str, tuple[tuple[str, Frame], tuple[str, Frame]]] = {}
        for joint in system.joints:
            a, b = (
                (names[end.body] if end.body >= 0 else GROUND.name, Frame(end.shape.position, end.shape.triad))
                for end in joint_markers(system, joint, placed)
            )
            self.ends[joint.name] = a, b
        self.frames: dict[str, Frame] = {}  #: frames of the links in their bodies
        self.made: list[RobotJoint] = []

    def at(self, body: str) -> Frame:
        """Return the assembled frame of a body in ground axes."""
        if body == GROUND.name:
            return Frame()
        found = self.bodies[body]
        return Frame(found.drawn_position, rotation_matrix(found.orientation))

    # Joints ----------------------------------------------------------------------------------------------------------

    def exported(self) -> ExportedRobot:
        """Return the exported robot."""
        root = self.root()
        self.frames[root] = Frame()
        self.follow(root)
        for name in self.bodies:
            if name not in self.frames:  # no joint carries it
                at = self.at(name)
                self.frames[name] = Frame()
                self.made.append(RobotJoint(f"{name} floating", "floating", root, name, pose_of(at)))
                self.follow(name)
        links = [Link(GROUND.name)] if root == GROUND.name else []
        links += [self.link(body) for body in self.bodies.values()]
        self.note_the_rest()
        return ExportedRobot(Robot(self.system.name, links, self.made), self.meshes, tuple(self.notes))

    def root(self) -> str:
        """(1): return the ground, or the first body if all are connected and none is attached to the ground."""
        if any(GROUND.name in (a[0], b[0]) for a, b in self.ends.values()):
            return GROUND.name
        reached, left = set(), [next(iter(self.bodies))]
        while left:
            name = left.pop()
            if name not in reached:
                reached.add(name)
                left += [b[0] if a[0] == name else a[0] for a, b in self.ends.values() if name in (a[0], b[0])]
        return next(iter(self.bodies)) if reached == set(self.bodies) else GROUND.name

    def follow(self, start: str) -> None:
        """(1): add the joints that a link carries, outwards, in the order of the system."""
        left, used = [start], {joint.name for joint in self.made}
        while left:
            parent = left.pop(0)
            for joint in self.system.joints:
                (a, _), (b, _) = self.ends[joint.name]
                if joint.name in used or parent not in (a, b):
                    continue
                child = b if a == parent else a
                if child in self.frames:
                    raise UrdfError(
                        f"{self.where}: joint {joint.name!r} closes a loop; URDF describes trees: remove it, "
                        "and close the loop in the program that reads the description"
                    )
                used.add(joint.name)
                self.made.append(self.joint(joint, parent, child))
                left.append(child)

    def joint(self, joint: Joint, parent: str, child: str) -> RobotJoint:
        """(2), (3): return a joint, and store the frame of its child link."""
        if type(joint) not in TYPES:
            raise UrdfError(
                f"{self.where}: joint {joint.name!r}: URDF has no {type(joint).__name__}; it has revolute, prismatic, "
                "planar, fixed and floating joints"
            )
        if getattr(joint, "motions", None):
            self.notes.append(f"prescribed motion of joint {joint.name!r}")
        (a, frame_a), (_, frame_b) = self.ends[joint.name]
        is_forward = a == parent
        self.frames[child] = frame_b if is_forward else frame_a
        in_parent = self.at(parent) @ self.frames[parent]
        placed = in_parent.inverse @ self.at(child) @ self.frames[child]
        kind, axis, turn = TYPES[type(joint)], np.array([1.0, 0.0, 0.0]), Frame()
        if kind != "fixed":
            along = self.at(a).R @ frame_a.R @ joint.axis  # type: ignore[attr-defined]
            axis = (self.at(child) @ self.frames[child]).R.T @ (along if is_forward else -along)
            axis = rounded(axis)
            value = self.values.get(joint.name, 0.0)
            turn = Frame(value * axis) if kind == "prismatic" else Frame(R=rotation_exp(value * axis))
        damping, friction = self.drag(joint.name)
        lower, upper, mimic = self.limits_and_mimic(joint)
        given = self.limits.get(joint.name, JointLimits())
        low = given.lower if given.lower is not None else lower
        high = given.upper if given.upper is not None else upper
        if kind == "continuous" and low is not None and high is not None:
            kind = "revolute"
        elif kind == "continuous" and (low is not None or high is not None):
            self.notes.append(f"limit on one side of joint {joint.name!r}")
            low = high = None
        pose = pose_of(placed @ turn.inverse)
        limited = JointLimits(low, high, given.effort, given.velocity)
        return RobotJoint(joint.name, kind, parent, child, pose, axis, limited, damping, friction, mimic)

    def offset(self, name: str) -> float:
        """Return the joint value at which its coordinate is zero."""
        joint = next(each for each in self.system.joints if each.name == name)
        if not isinstance(joint, PrismaticJoint):
            return self.values.get(name, 0.0)
        (a, frame_a), (b, frame_b) = self.ends[name]
        frame = self.at(a) @ frame_a
        distance = (frame.R.T @ ((self.at(b) @ frame_b).x - frame.x)) @ joint.axis
        return float(self.values.get(name, 0.0) - distance)

    def drag(self, name: str) -> tuple[float, float]:
        """(4): return damping and friction along a joint."""
        damping = friction = 0.0
        for force in self.system.forces:
            if isinstance(force, JointForce) and force.joint == name and is_drag(force):
                damping, friction = damping + force.damping, friction + force.friction
        return damping, friction

    def limits_and_mimic(self, joint: Joint) -> tuple[float | None, float | None, Mimic | None]:
        """(4): return the limits of a joint from its stops, and the joint that it follows."""
        low: float | None = None
        high: float | None = None
        mimic = None
        for coupler in self.system.couplers:
            terms = joint_terms(coupler)
            if terms is None or terms[0][0] != joint.name:
                continue
            if coupler.limits is not None and len(terms) == 1:
                ends = [
                    None if end is None else end / terms[0][1] + self.offset(joint.name)
                    for end in (coupler.limits.lower, coupler.limits.upper)
                ]
                low, high = ends if terms[0][1] > 0 else reversed(ends)
            elif is_mimic(coupler):
                (_, own), (leader, other) = terms
                given = coupler.constant
                held = given(0.0) if isinstance(given, TimeFunction) else self.sum_as_placed(terms)
                factor = -other / own
                offset = held / own + self.offset(joint.name) - factor * self.offset(leader)
                mimic = Mimic(leader, factor, offset)
        return low, high, mimic

    def sum_as_placed(self, terms: list[tuple[str, float]]) -> float:
        """Return the assembled coordinate sum, which a coupler without a constant holds."""
        return sum(factor * (self.values.get(name, 0.0) - self.offset(name)) for name, factor in terms)

    def note_the_rest(self) -> None:
        """(4): note the parts that are omitted."""
        for force in self.system.forces:
            if isinstance(force, Gravity):
                self.notes.append("gravity")
            elif not (isinstance(force, JointForce) and is_drag(force)):
                self.notes.append(f"force {force.name!r}")
        for coupler in self.system.couplers:
            terms = joint_terms(coupler)
            is_said = terms is not None and ((coupler.limits is not None and len(terms) == 1) or is_mimic(coupler))
            if not is_said:
                self.notes.append(f"coupler {coupler.name!r}")
        for kind in ("elements", "sensors", "inputs", "outputs", "events", "fmus"):
            self.notes += [f"{kind.removesuffix('s')} {each.name!r}" for each in getattr(self.system, kind)]
        if any(body.velocity.any() or body.omega_B.any() for body in self.bodies.values()):
            self.notes.append("velocities at the start")
        if self.system.scene:
            self.notes.append("scene")

    # Links -----------------------------------------------------------------------------------------------------------

    def link(self, body: RigidBody) -> Link:
        """(2): return the link of a body."""
        own = self.frames[body.name].inverse
        is_same = not own.x.any() and (own.R == np.eye(3)).all()
        center = body.center_of_mass if is_same else own.x + own.R @ body.center_of_mass
        tensor = body.inertia if is_same else own.R @ body.inertia @ own.R.T
        shapes = [each for each in body.shapes if isinstance(each, Shape)]  # all: bodies convert geometries
        visuals = tuple(self.picture(body, k, shape, own) for k, shape in enumerate(shapes))
        return Link(body.name, Inertial(body.mass, Pose(center), tensor), visuals)

    def picture(self, body: RigidBody, k: int, shape: Shape, own: Frame) -> Picture:
        """Return the shapes of a body."""
        geometry = shape.geometry
        at = own @ Frame(shape.position, rotation_exp(shape.rotation_vector))
        color = shape.color
        if isinstance(geometry, Cylinder) and geometry.end_radius is None and not geometry.inner_radius:
            at = at @ Frame(R=turn_to(geometry.axis))
            drawn: Box | Cylinder | Sphere | MeshFile = Cylinder(geometry.radius, geometry.length)
        elif isinstance(geometry, Box | Sphere):
            drawn = geometry
        else:
            whole = joined([piece for piece in geometry.pieces() if len(piece.triangles)])
            color = color or whole.color or None
            name = f"meshes/{body.name}_{k}.stl"
            self.meshes[name] = stl_bytes(whole.nodes, whole.triangles)
            drawn = MeshFile(name)
        rgba = None if color is None else (*(int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)), shape.opacity)
        return Picture(drawn, pose_of(at), rgba)  # type: ignore[arg-type]


def joint_terms(coupler: CoordinateCoupler) -> list[tuple[str, float]] | None:
    """Return the joints of a coupler with their factors; None if it couples other coordinates."""
    if not all(isinstance(coordinate, JointCoordinateName) for coordinate, _ in coupler.terms):
        return None
    return [(coordinate.joint, factor) for coordinate, factor in coupler.terms]  # type: ignore[union-attr]


def is_mimic(coupler: CoordinateCoupler) -> bool:
    """Whether a coupler permanently lets one joint follow another."""
    held = coupler.constant
    is_constant = not (isinstance(held, TimeFunction) and (len(held.pieces) > 1 or held.pieces[:, 1:7].any()))
    return coupler.acts and is_constant and len(coupler.terms) == 2


def is_drag(force: JointForce) -> bool:
    """Whether a joint force consists only of damping and friction."""
    others = force.stiffness, force.preload, force.friction_coefficient, force.motor, force.characteristic
    return not any(others)


def rounded(axis: Array) -> Array:
    """Return an axis whose components near zero or one are exact."""
    near = np.round(axis)
    return near if np.abs(axis - near).max() < 1e-15 else axis / np.linalg.norm(axis)


def turn_to(axis: Array) -> Array:
    """Return the smallest rotation from z to an axis, (3, 3)."""
    z = np.array([0.0, 0.0, 1.0])
    normal, cosine = np.cross(z, axis), float(z @ axis)
    sine = float(np.linalg.norm(normal))
    if sine == 0.0:
        return np.eye(3) if cosine > 0 else rotation_exp(np.array([np.pi, 0.0, 0.0]))
    return rotation_exp(np.arctan2(sine, cosine) * normal / sine)


def pose_of(frame: Frame) -> Pose:
    """Return a frame in the form of URDF."""
    return Pose(frame.x, rpy_of(frame.R))


# A `Robot` written as URDF: every number by the digits that read the same again ---------------------------------------


TENSOR = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def write_urdf(robot: Robot, path: str | os.PathLike[str]) -> None:
    """Write a robot to a file; an existing file is replaced completely or not at all.

    Parameters
    ----------
    robot
        The robot.
    path
        Name of the URDF file.

    Raises
    ------
    UrdfError
        If the file cannot be written, or a limit that URDF requires is unknown.
    """
    text = urdf_text(robot)
    try:
        replace_file(Path(path), text.encode("utf-8"))
    except OSError as error:
        raise UrdfError(f"{path}: cannot be written: {error.strerror}") from error


def urdf_text(robot: Robot) -> str:
    """Return a robot as URDF text; `UrdfError` if a limit that URDF requires is unknown."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoteattr(robot.name)}>"]
    for link in robot.links:
        lines += link_lines(link)
    for joint in robot.joints:
        lines += joint_lines(robot, joint)
    return "\n".join([*lines, "</robot>", ""])


def numbers(values: Array | tuple[float, ...] | list[float]) -> str:
    """Return numbers in quotes, with the fewest digits that are read back exactly."""
    return '"' + " ".join(number(value) for value in values) + '"'


def number(value: float) -> str:
    """Return a number with the fewest digits that are read back exactly."""
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
    """Return an XML element around indented lines."""
    if not inside:
        return [f"  <{head}/>"]
    return [f"  <{head}>", *(f"  {line}" for line in inside), f"  </{head.split()[0]}>"]


def origin_lines(pose: Pose) -> list[str]:
    """Return the line of a pose; none for the identity."""
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
    """Return the lines of a visual or collision shape; `material`: name of its colour."""
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
