"""A robot as described by URDF: a checked tree of links and joints, in the terms of the file.

A link has one frame. The frame of a joint is at `pose` in the frame of its parent link, and coincides with the frame of
its child link if the joint is at zero. Lengths are in m, masses in kg, angles in rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted, shortened
from floatframe.errors import ModelError, UrdfError
from floatframe.model.checked_values import array_of_shape
from floatframe.model.shapes import Box, Cylinder, Sphere

__all__ = [
    "JOINT_TYPES",
    "Inertial",
    "JointLimits",
    "Link",
    "MeshFile",
    "Mimic",
    "Picture",
    "Pose",
    "Robot",
    "RobotJoint",
]

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")
WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
WITH_VALUE = ("revolute", "continuous", "prismatic")  #: types of joints whose position is one number


@frozen_copies
@dataclass(frozen=True, eq=False)
class Pose:
    """Position and orientation in the form of URDF."""

    xyz: Array = field(default_factory=lambda: np.zeros(3))  #: position, (3,) [m]
    rpy: Array = field(default_factory=lambda: np.zeros(3))  #: roll, pitch and yaw about fixed axes x, y, z, (3,) [rad]

    def __post_init__(self) -> None:
        for name in ("xyz", "rpy"):
            object.__setattr__(self, name, array_of_shape(name, getattr(self, name), (3,)))

    @cached_property
    def rotation(self) -> Array:
        """Rotation matrix R_z(yaw) R_y(pitch) R_x(roll), (3, 3), from the axes of the pose to its reference."""
        (cr, cp, cy), (sr, sp, sy) = np.cos(self.rpy), np.sin(self.rpy)
        return np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )


@frozen_copies
@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass properties of a link."""

    mass: float  #: mass of the link [kg]
    pose: Pose  #: centre of mass and axes of the inertia tensor, in the frame of the link
    tensor: Array  #: inertia tensor about the centre of mass, axes of the pose, (3, 3) [kg m²]


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A surface file as named in the description."""

    file: str  #: name as written: package://..., file://..., or a path relative to the description
    scale: Array = field(default_factory=lambda: np.ones(3))  #: scale factors of the three coordinates, (3,)


@frozen_copies
@dataclass(frozen=True, eq=False)
class Picture:
    """The visual shape of a link, or its collision shape."""

    geometry: Box | Cylinder | Sphere | MeshFile
    pose: Pose = field(default_factory=Pose)
    color: tuple[float, float, float, float] | None = None  #: red, green, blue and opacity, each 0 to 1
    name: str = ""


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class Link:
    """A link of a robot."""

    name: str
    inertial: Inertial | None = None  #: mass properties; None: the link has no mass
    visuals: tuple[Picture, ...] = ()
    collisions: tuple[Picture, ...] = ()
    line: int = 0  #: line number in the file, 0 if there is no file

    @property
    def mass(self) -> float:
        """Mass of the link, 0 without mass properties [kg]."""
        return 0.0 if self.inertial is None else self.inertial.mass


@dataclass(frozen=True)
class JointLimits:
    """Limits of a joint; None for those that are not given."""

    lower: float | None = None  #: lower limit of the position [rad or m]
    upper: float | None = None
    effort: float | None = None  #: largest torque or force [N m or N]
    velocity: float | None = None  #: largest velocity [rad/s or m/s]


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another joint: value = multiplier × value of the other joint + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class RobotJoint:
    """A joint between two links."""

    name: str
    type: str  #: one of `JOINT_TYPES`
    parent: str
    child: str
    pose: Pose = field(default_factory=Pose)  #: pose of the joint frame in the parent link
    axis: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))  #: unit axis in the joint frame, (3,)
    limits: JointLimits = field(default_factory=JointLimits)
    damping: float = 0.0  #: viscous damping [N m s/rad or N s/m]
    friction: float = 0.0  #: Coulomb friction [N m or N]
    mimic: Mimic | None = None
    line: int = 0  #: line number in the file, 0 if there is no file

    @property
    def has_value(self) -> bool:
        """Whether the position of the joint is one number."""
        return self.type in WITH_VALUE


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Robot:
    """A robot, whose joints connect its links to one tree.

    Parameters
    ----------
    name
        Name of the robot.
    links
        The links.
    joints
        The joints between the links.
    source
        Path of its file; "": the robot was made in Python.
    notes
        Elements of the file that are not read.

    Raises
    ------
    UrdfError
        If a name is used twice, a joint names a link that does not exist, a link has two parents, the links are not a
        tree with one root, or a limit or a followed joint is impossible. Masses are checked when bodies are made.
    """

    name: str
    links: Sequence[Link]
    joints: Sequence[RobotJoint] = ()
    source: str = ""
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name in ("links", "joints", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if not self.links:
            raise UrdfError(f"{self.where()}: expected at least one link, got none")
        for kind, parts in (("link", self.links), ("joint", self.joints)):
            seen: dict[str, int] = {}
            for part in parts:
                if part.name in seen:
                    raise UrdfError(
                        f"{self.where(part.line)}: there are two {kind}s {quoted(part.name)}; give each its own name"
                    )
                seen[part.name] = part.line
        for joint in self.joints:
            self.check_joint(joint)
        self.check_tree()

    def where(self, line: int = 0) -> str:
        """Return the start of a message about a line in the file."""
        place = self.source or f"robot {self.name!r}"
        return f"{place}, line {line}" if line else place

    def check_joint(self, joint: RobotJoint) -> None:
        """Raise `UrdfError` if a joint is invalid."""
        where = f"{self.where(joint.line)}: joint {quoted(joint.name)}"
        if joint.type not in JOINT_TYPES:
            raise UrdfError(f"{where}: unknown type {quoted(joint.type)}{nearest(joint.type, JOINT_TYPES)}")
        for what, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in self.by_link:
                raise UrdfError(f"{where}: {what}: there is no link {quoted(name)}{nearest(name, self.by_link)}")
        lower, upper = joint.limits.lower, joint.limits.upper
        if lower is not None and upper is not None and lower > upper:
            raise UrdfError(f"{where}: limits: expected lower <= upper, got {lower:g} and {upper:g}")
        for what in ("effort", "velocity"):
            value = getattr(joint.limits, what)
            if value is not None and value < 0:
                raise UrdfError(f"{where}: limits: {what}: expected 0 or more, got {value:g}")
        for what in ("damping", "friction"):
            if getattr(joint, what) < 0:
                raise UrdfError(f"{where}: {what}: expected 0 or more, got {getattr(joint, what):g}")
        if joint.mimic is not None:
            self.check_mimic(where, joint)

    def check_mimic(self, where: str, joint: RobotJoint) -> None:
        """Raise `UrdfError` if a joint cannot follow the joint that its <mimic> names."""
        assert joint.mimic is not None
        if not joint.has_value:
            raise UrdfError(f"{where}: mimic: a {joint.type} joint has no single value that could follow another")
        leader = self.by_joint.get(joint.mimic.joint)
        if leader is None:
            choices = [each.name for each in self.joints if each.has_value]
            raise UrdfError(
                f"{where}: mimic: there is no joint {quoted(joint.mimic.joint)}{nearest(joint.mimic.joint, choices)}"
            )
        if not leader.has_value:
            raise UrdfError(f"{where}: mimic: joint {quoted(leader.name)} is {leader.type}, it has no single value")
        seen = {joint.name}
        while leader is not None:
            if leader.name in seen:
                raise UrdfError(f"{where}: mimic: joints follow each other in a ring: {', '.join(sorted(seen))}")
            seen.add(leader.name)
            leader = None if leader.mimic is None else self.by_joint.get(leader.mimic.joint)

    def check_tree(self) -> None:
        """Raise `UrdfError` unless joints and links form one tree."""
        parent: dict[str, RobotJoint] = {}
        for joint in self.joints:
            if joint.child in parent:
                raise UrdfError(
                    f"{self.where(joint.line)}: link {quoted(joint.child)} is the child of two joints, "
                    f"{quoted(parent[joint.child].name)} and {quoted(joint.name)}; URDF describes trees: close the "
                    "loop in the system, by a joint between two of its bodies"
                )
            parent[joint.child] = joint
        roots = [link.name for link in self.links if link.name not in parent]
        if len(roots) != 1:
            told = shortened(", ".join(map(repr, roots))) or "none: its joints form a ring"
            raise UrdfError(f"{self.where()}: expected one link that is not a child, the root, got {told}")
        if len(self.order) != len(self.links):
            left = sorted(set(self.by_link) - set(self.order))
            raise UrdfError(
                f"{self.where()}: no joints connect the root {roots[0]!r} to {shortened(', '.join(map(repr, left)))}: "
                "their joints form a ring"
            )

    @cached_property
    def by_link(self) -> dict[str, Link]:
        """Links by their names."""
        return {link.name: link for link in self.links}

    @cached_property
    def by_joint(self) -> dict[str, RobotJoint]:
        """Joints by their names."""
        return {joint.name: joint for joint in self.joints}

    @cached_property
    def parent_joint(self) -> dict[str, RobotJoint]:
        """The joint that carries each link except the root, by name of the link."""
        return {joint.child: joint for joint in self.joints}

    @property
    def root(self) -> str:
        """Name of the link that no joint carries."""
        return next(link.name for link in self.links if link.name not in self.parent_joint)

    @cached_property
    def order(self) -> tuple[str, ...]:
        """Names of the links in depth-first order, starting with the root."""
        children: dict[str, list[str]] = {}
        for joint in self.joints:
            children.setdefault(joint.parent, []).append(joint.child)
        order, left = [], [self.root]
        while left:
            order.append(left.pop())
            left += reversed(children.get(order[-1], []))
        return tuple(order)

    def link(self, name: str) -> Link:
        """Return a link; `UrdfError` lists the choices if it does not exist."""
        if name not in self.by_link:
            raise UrdfError(f"{self.where()}: there is no link {quoted(name)}{nearest(name, self.by_link)}")
        return self.by_link[name]

    def joint(self, name: str) -> RobotJoint:
        """Return a joint; `UrdfError` lists the choices if it does not exist."""
        if name not in self.by_joint:
            raise UrdfError(f"{self.where()}: there is no joint {quoted(name)}{nearest(name, self.by_joint)}")
        return self.by_joint[name]
