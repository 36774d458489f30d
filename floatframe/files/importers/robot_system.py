"""A robot as a system: links as bodies, in the requested configuration.

(1) links without mass, and links that are fixed to another link, become places on the body that carries them; masses of
    fixed links are added to this body (`combined`), unless they shall remain separate bodies
(2) the root is fixed to the ground, or is a free body
(3) bodies are placed by the configuration: link after link from the root,
        T_child = T_parent T_origin T_joint(value)
(4) a joint is at a marker with the axes of its frame on both bodies. An angle of a system is zero as placed, but a
    distance is not, so that

        value of the robot = value at the start + angle of the system, or = distance of the system

(5) limits become stops (couplers with limits), damping and friction become joint forces, and a joint that follows
    another becomes a coupler
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError, UrdfError
from floatframe.files.importers.frames import Frame
from floatframe.files.importers.mesh_files import mesh_of, mesh_path
from floatframe.files.importers.robot import MeshFile, Picture, Robot, RobotJoint
from floatframe.model.bodies.coordinates import JointCoordinateName
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.mass_properties import MassProperties, combined
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.forces import Force, Gravity, JointForce
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import FixedJoint, Joint, PlanarJoint, PrismaticJoint, RevoluteJoint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler, Limits
from floatframe.model.rotations import euler_parameters, rotation_exp, rotation_log
from floatframe.model.shapes.shape import Shape
from floatframe.model.system import System

__all__ = ["FlexibleLink", "RobotSystem", "robot_system"]

PLACE = 1e-3  #: largest distance of an interface from its joint, relative to the size of the flexible body


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FlexibleLink:
    """A reduced body that replaces a link.

    Its mass and inertia replace those of the description, and the joints of the link are at its interfaces. An
    interface must have the position of its joint; its triad is arbitrary.

    Parameters
    ----------
    body
        The reduced body, or the path of its modal file.
    interfaces
        Name of the interface of the body at each joint of the link, by name of the joint.
    position
        Position of the mesh origin in the frame of the link, (3,) [m].
    rotation_vector
        Rotation vector of the mesh axes in the frame of the link, (3,) [rad].
    """

    body: ReducedBody | str | os.PathLike[str]
    interfaces: Mapping[str, str]
    position: GivenArray = given(np.zeros(3))
    rotation_vector: GivenArray = given(np.zeros(3))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RobotSystem:
    """A robot as a system, with the positions of its links in the bodies.

    Parameters
    ----------
    system
        The system.
    robot
        The robot as its file describes it.
    values
        Coordinates of the joints as placed, by name.
    carriers
        The body (or the ground) of each link, and the frame of the link in it.
    interfaces
        Interfaces of flexible links by joint, for each link.
    """

    system: System
    robot: Robot
    values: Mapping[str, float]
    carriers: Mapping[str, tuple[str, Frame]]
    interfaces: Mapping[str, Mapping[str, str]]

    def place(self, link: str) -> Marker:
        """Return the frame of a link as a marker.

        Raises
        ------
        UrdfError
            If there is no such link, or it is flexible: only interfaces are places on a flexible link.
        """
        self.robot.link(link)
        body, frame = self.carriers[link]
        if body in self.interfaces:
            names = ", ".join(dict.fromkeys(self.interfaces[body].values()))
            raise UrdfError(
                f"robot {self.robot.name!r}: link {link!r} is flexible, so that its frame is not a place on it; its "
                f"interfaces are: {names}"
            )
        return Marker(body, position=frame.x, triad=frame.R)

    def coordinate(self, joint: str) -> JointCoordinateName:
        """Return the coordinate of a joint with a position, for couplers, forces and sensors."""
        return JointCoordinateName(joint, coordinate_of(self.robot, joint))

    def offset(self, joint: str) -> float:
        """Return the joint value at zero coordinate: value = offset + coordinate."""
        return offset_of(self.robot, self.values, joint)


def coordinate_of(robot: Robot, joint: str) -> str:
    """Return the name of the coordinate of a joint in a system."""
    found = robot.joint(joint)
    if not found.has_value:
        raise UrdfError(f"robot {robot.name!r}: joint {joint!r} is {found.type}; it has no single coordinate")
    return "distance" if found.type == "prismatic" else "angle"


def offset_of(robot: Robot, values: Mapping[str, float], joint: str) -> float:
    """(4): return the joint value at which its coordinate is zero."""
    return 0.0 if robot.joint(joint).type == "prismatic" else values[joint]


def robot_system(
    robot: Robot,
    *,
    configuration: Mapping[str, float] | None = None,
    rates: Mapping[str, float] | None = None,
    motions: Mapping[str, TimeFunction] | None = None,
    is_free: bool = False,
    position: Array | Sequence[float] = (0.0, 0.0, 0.0),
    rotation_vector: Array | Sequence[float] = (0.0, 0.0, 0.0),
    gravity: Array | Sequence[float] = (0.0, 0.0, -9.81),
    flexible: Mapping[str, FlexibleLink] | None = None,
    merge_fixed: bool = True,
    stops: bool = True,
    pictures: str = "visual",
    packages: Mapping[str, str | os.PathLike[str]] | None = None,
) -> RobotSystem:
    """Return the system of a robot, in m, kg and s.

    Parameters
    ----------
    robot
        The description.
    configuration
        Values of joints as placed, by name [rad or m]; default: zero, and the resulting values of following joints.
    rates
        Initial speeds of joints, by name [rad/s or m/s]; default: zero, and the resulting speeds of following joints.
    motions
        Drives of joints, by name, in values of the robot; joints that follow others cannot be driven. The initial value
        and rate are those of the motion at t = 0 if neither is given. A driven joint has no stop and no drag.
    is_free
        Whether the root link moves freely; otherwise it is fixed to the ground, and its mass has no effect.
    position, rotation_vector
        Position and rotation vector of the root link in ground axes, (3,) each [m, rad].
    gravity
        Acceleration of free fall, ground axes, (3,) [m/s²]; URDF has none.
    flexible
        Reduced bodies that replace links, by name of the link.
    merge_fixed
        Whether links that are fixed to each other are one body; otherwise each link with mass is a separate body.
    stops
        Whether limits of joints act as stops.
    pictures
        Shapes of the bodies: "visual", "collision" or "none".
    packages
        Folders of the ROS packages in the names of meshes, by name of the package.

    Raises
    ------
    UrdfError
        If a moving body has no mass, an inertia tensor is impossible, a value is beyond active limits, a mesh is not
        found, or an interface of a flexible link is not at its joint.
    """
    if pictures not in ("visual", "collision", "none"):
        raise UrdfError(f"pictures: expected visual, collision or none, got {quoted(pictures)}")
    drives = dict(motions or {})
    return Builder(
        robot,
        values_of(robot, {name: drive(0.0) for name, drive in drives.items()} | dict(configuration or {})),
        values_of(robot, {name: drive(0.0, 1) for name, drive in drives.items()} | dict(rates or {}), what="rates"),
        drives,
        dict(flexible or {}),
        is_free=is_free,
        base=Frame(
            array_of_shape("position", position, (3,)),
            rotation_exp(array_of_shape("rotation_vector", rotation_vector, (3,))),
        ),
        merges=merge_fixed,
        stops=stops,
        pictures=pictures,
        packages=dict(packages or {}),
    ).robot_system(array_of_shape("gravity", gravity, (3,)))


def shifted(function: TimeFunction, by: float) -> TimeFunction:
    """Return a function of time plus a constant."""
    pieces = function.pieces.copy()
    pieces[:, 0] += by
    return TimeFunction(function.begins, pieces)


def values_of(robot: Robot, given: Mapping[str, float], what: str = "configuration") -> dict[str, float]:
    """Return the values (or rates) of all joints that have one; followers are computed from their leaders."""
    values = {}
    for name, value in given.items():
        joint = robot.joint(name)
        where = f"{robot.where(joint.line)}: {what}: joint {name!r}"
        if not joint.has_value:
            raise UrdfError(f"{where} is {joint.type}; it has no single value")
        if joint.mimic is not None:
            raise UrdfError(f"{where} follows {joint.mimic.joint!r}; give that one")
        values[name] = number(f"{what}: {name}", value)

    def value_of(joint: RobotJoint) -> float:
        if joint.mimic is None:
            return values.get(joint.name, 0.0)
        offset = joint.mimic.offset if what == "configuration" else 0.0
        return joint.mimic.multiplier * value_of(robot.joint(joint.mimic.joint)) + offset

    return {joint.name: value_of(joint) for joint in robot.joints if joint.has_value}


def range_of(robot: Robot, joint: RobotJoint) -> tuple[float | None, float | None]:
    """Return the limits of a joint, reduced by the limits of joints that follow it."""
    low = -np.inf if joint.limits.lower is None else joint.limits.lower
    high = np.inf if joint.limits.upper is None else joint.limits.upper
    for follower in robot.joints:
        if follower.mimic is None or follower.mimic.joint != joint.name or follower.mimic.multiplier == 0:
            continue
        ends = [
            (end - follower.mimic.offset) / follower.mimic.multiplier
            for end, none in zip(range_of(robot, follower), (-np.inf, np.inf), strict=True)
            for end in (none if end is None else end,)
        ]
        low, high = max(low, min(ends)), min(high, max(ends))
    return (None if low == -np.inf else float(low)), (None if high == np.inf else float(high))


class Builder:
    """Creates the parts of a system from a robot."""

    def __init__(
        self,
        robot: Robot,
        values: dict[str, float],
        rates: dict[str, float],
        drives: dict[str, TimeFunction],
        flexible: dict[str, FlexibleLink],
        *,
        is_free: bool,
        base: Frame,
        merges: bool,
        stops: bool,
        pictures: str,
        packages: dict[str, str | os.PathLike[str]],
    ) -> None:
        self.robot, self.values, self.rates, self.drives, self.flexible = robot, values, rates, drives, flexible
        self.is_free, self.base, self.merges, self.stops = is_free, base, merges, stops
        self.pictures, self.packages = pictures, packages
        for name in flexible:
            robot.link(name)
        self.units: Units = unit_system("m-kg-s")
        self.reduced = {name: self.read(name, each) for name, each in flexible.items()}
        self.carriers: dict[str, tuple[str, Frame]] = {}
        #: links of each rigid body; the body frame is the frame of the first link
        self.parts: dict[str, list[str]] = {}
        self.placed: dict[str, Frame] = {}  #: frames of the links in ground axes
        #: velocities of the link origins and angular velocities, ground axes
        self.moving: dict[str, tuple[Array, Array]] = {}
        for link in robot.order:
            self.carry(link)

    def read(self, name: str, link: FlexibleLink) -> ReducedBody:
        """Return the reduced body that replaces a link, in m, kg and s."""
        from cms.body.modal_file.file import convert_units, read

        body = link.body if isinstance(link.body, ReducedBody) else read(Path(link.body))
        return body if body.units == self.units else convert_units(body, self.units)

    def error(self, link: str, words: str) -> UrdfError:
        """Return an error about a link."""
        return UrdfError(f"{self.robot.where(self.robot.link(link).line)}: link {quoted(link)}: {words}")

    # Bodies ----------------------------------------------------------------------------------------------------------

    def carry(self, link: str) -> None:
        """(1), (2), (3): place a link, whose parent is already placed, and record the body that carries it."""
        joint = self.robot.parent_joint.get(link)
        if joint is None:
            self.placed[link] = self.base
            self.moving[link] = np.zeros(3), np.zeros(3)
            if link in self.flexible and not self.is_free:
                raise self.error(link, "the root is fixed to the ground and cannot be flexible; make it free (is_free)")
            if not self.is_free:
                self.carriers[link] = GROUND.name, self.base
                return
            self.begin_body(link)
            return
        turn = self.joint_frame(joint)
        self.placed[link] = self.placed[joint.parent] @ turn
        self.moving[link] = self.motion(joint)
        body, frame = self.carriers[joint.parent]
        is_fixed = joint.type == "fixed" and link not in self.flexible and body not in self.flexible
        if is_fixed and (self.merges or self.robot.link(link).mass == 0):
            self.carriers[link] = body, frame @ turn
            if body != GROUND.name:
                self.parts[body].append(link)
        else:
            self.begin_body(link)

    def begin_body(self, link: str) -> None:
        """Start a new body with a link."""
        self.carriers[link] = link, Frame()
        if link not in self.flexible:
            self.parts[link] = [link]

    def joint_frame(self, joint: RobotJoint) -> Frame:
        """Return T_origin T_joint(value), the frame of the child link relative to the parent link."""
        value, turn = self.values.get(joint.name, 0.0), Frame()
        if joint.type == "prismatic":
            turn = Frame(value * joint.axis)
        elif joint.has_value and value:
            turn = Frame(R=rotation_exp(value * joint.axis))
        return Frame(joint.pose.xyz, joint.pose.rotation) @ turn

    def motion(self, joint: RobotJoint) -> tuple[Array, Array]:
        """Return the velocity of the origin of the child link of a joint and its angular velocity, ground axes."""
        v, omega = self.moving[joint.parent]
        v = v + np.cross(omega, self.placed[joint.child].x - self.placed[joint.parent].x)
        rate = self.rates.get(joint.name, 0.0) * (self.placed[joint.child].R @ joint.axis)
        return (v + rate, omega) if joint.type == "prismatic" else (v, omega + rate)

    def properties(self, link: str, frame: Frame) -> MassProperties | None:
        """Return the mass properties of a link in the axes of the body that carries it; None if it has no mass."""
        inertial = self.robot.link(link).inertial
        if inertial is None or inertial.mass == 0:
            if inertial is not None and np.any(inertial.tensor):
                raise self.error(link, "has no mass, but moments of inertia; give it a mass")
            return None
        R = inertial.pose.rotation
        try:
            RigidBody(link, inertial.mass, inertial.tensor)
        except ModelError as error:
            raise self.error(link, str(error).removeprefix(f"rigid body {link!r}: ")) from None
        is_plain = not inertial.pose.rpy.any()  # keeps every digit
        tensor = inertial.tensor if is_plain else R @ inertial.tensor @ R.T
        if (frame.R == np.eye(3)).all() and not frame.x.any():
            return MassProperties(inertial.mass, inertial.pose.xyz, tensor)
        return MassProperties(inertial.mass, frame.x + frame.R @ inertial.pose.xyz, frame.R @ tensor @ frame.R.T)

    def rigid_body(self, name: str) -> RigidBody:
        """Return the rigid body of a link and of all links fixed to it."""
        made = [(link, self.properties(link, self.carriers[link][1])) for link in self.parts[name]]
        masses = [each for _, each in made if each is not None]
        if not masses:
            fixed = ", ".join(map(repr, self.parts[name][1:]))
            also = f", nor have {fixed}, which are fixed to it" if fixed else ""
            hint = "" if self.merges else "; or merge links that are fixed to each other (merge_fixed)"
            raise self.error(
                name, f"moves, but has no mass{also}; give it <inertial> with a mass and moments of inertia{hint}"
            )
        whole = masses[0] if len(masses) == 1 else combined(*masses)
        at, (v, omega) = self.placed[name], self.moving[name]
        try:
            return RigidBody(
                name, **whole.arguments, position=at.x, orientation=euler_parameters(at.R), velocity=v,
                omega_B=at.R.T @ omega, shapes=self.shapes(name),
            )  # fmt: skip
        except ModelError as error:
            raise self.error(name, str(error)) from None

    def flexible_body(self, name: str) -> FlexibleBody:
        """Return the flexible body that replaces a link."""
        given = self.flexible[name]
        mesh = self.placed[name] @ self.mesh_frame(name)
        v, omega = self.moving[name]
        return FlexibleBody(
            name, self.reduced[name], position=mesh.x, orientation=euler_parameters(mesh.R),
            velocity=v + np.cross(omega, mesh.x - self.placed[name].x), omega_B=mesh.R.T @ omega,
            source="" if isinstance(given.body, ReducedBody) else str(given.body),
        )  # fmt: skip

    def mesh_frame(self, name: str) -> Frame:
        """Return the mesh axes of a flexible link relative to the link frame."""
        given = self.flexible[name]
        where = f"flexible link {name!r}"
        return Frame(
            array_of_shape(f"{where}: position", given.position, (3,)),
            rotation_exp(array_of_shape(f"{where}: rotation_vector", given.rotation_vector, (3,))),
        )

    def shapes(self, name: str) -> tuple[Shape, ...]:
        """Return the shapes of the links of a body."""
        if self.pictures == "none":
            return ()
        found = []
        for link in self.parts[name]:
            described = self.robot.link(link)
            pictures = described.visuals if self.pictures == "visual" else described.collisions
            found += [self.shape(picture, self.carriers[link][1]) for picture in pictures]
        return tuple(found)

    def shape(self, picture: Picture, frame: Frame) -> Shape:
        """Return a picture of a link in the axes of the body that carries it."""
        geometry = picture.geometry
        drawn = (
            mesh_of(geometry, mesh_path(geometry.file, self.robot.source, self.packages))
            if isinstance(geometry, MeshFile)
            else geometry
        )
        at = frame @ Frame(picture.pose.xyz, picture.pose.rotation)
        color, opacity = None, 1.0
        if picture.color is not None:
            color = "#" + "".join(f"{round(255 * part):02x}" for part in picture.color[:3])
            opacity = picture.color[3] or 1.0
        return Shape(drawn, at.x, rotation_log(at.R), color=color, opacity=opacity)

    # Joints ----------------------------------------------------------------------------------------------------------

    def marker(self, link: str, joint: RobotJoint, frame: Frame) -> Marker:
        """(4): return the marker of a joint on a link, at a frame given in the link."""
        body, own = self.carriers[link]
        if link in self.flexible:
            return self.interface_marker(link, joint, frame)
        at = own @ frame
        return Marker(body, position=at.x, triad=at.R)

    def interface_marker(self, link: str, joint: RobotJoint, frame: Frame) -> Marker:
        """Return the marker at the interface of a flexible link for a joint, with the axes of the joint."""
        given, reduced = self.flexible[link], self.reduced[link]
        names = [each.name for each in reduced.interfaces]
        if joint.name not in given.interfaces:
            raise self.error(
                link, f"flexible: the interface of joint {joint.name!r} is unknown; give it in interfaces; choices: "
                f"{', '.join(names) or 'none'}"
            )  # fmt: skip
        name = given.interfaces[joint.name]
        if name not in names:
            raise self.error(link, f"flexible: there is no interface {quoted(name)}{nearest(name, names)}")
        interface = reduced.interface(name)
        in_link = (
            self.mesh_frame(link)
            @ Frame(reduced.frame.origin, reduced.frame.axes)
            @ Frame(interface.position, interface.triad)
        )
        size = float(np.ptp(np.asarray(reduced.nodes), axis=0).max()) if len(reduced.nodes) else 1.0
        way = float(np.linalg.norm(in_link.x - frame.x))
        if way > PLACE * size:
            raise self.error(
                link, f"flexible: interface {name!r} is {way:.4g} m from joint {joint.name!r}, at "
                f"{np.round(in_link.x, 6).tolist()} in the frame of the link where the joint is at "
                f"{np.round(frame.x, 6).tolist()}; check position and rotation_vector of its mesh axes"
            )  # fmt: skip
        return Marker(link, name, triad=in_link.R.T @ frame.R)

    def joint(self, joint: RobotJoint) -> Joint | None:
        """Return a joint of the system; None if it has no constraint, or connects a body to itself."""
        if self.carriers[joint.parent][0] == self.carriers[joint.child][0] or joint.type == "floating":
            return None
        a = self.marker(joint.parent, joint, Frame(joint.pose.xyz, joint.pose.rotation))
        b = self.marker(joint.child, joint, Frame())
        if joint.type == "fixed":
            return FixedJoint(joint.name, a, b, rotation=np.eye(3))
        if joint.type == "planar":
            return PlanarJoint(joint.name, a, b, axis=joint.axis, axis_b=joint.axis)
        drive = {}
        if joint.name in self.drives:
            given = self.drives[joint.name]
            offset = offset_of(self.robot, self.values, joint.name)
            drive = {coordinate_of(self.robot, joint.name): shifted(given, -offset)}
        if joint.type == "prismatic":
            return PrismaticJoint(joint.name, a, b, axis=joint.axis, motions=drive)
        return RevoluteJoint(joint.name, a, b, axis=joint.axis, axis_b=joint.axis, motions=drive)

    def force(self, joint: RobotJoint) -> Force | None:
        """(5): return damping and friction of a joint; None if it has none."""
        if not joint.has_value or joint.name in self.drives or not (joint.damping or joint.friction):
            return None
        coordinate = coordinate_of(self.robot, joint.name)
        return JointForce(f"{joint.name} drag", joint.name, coordinate, damping=joint.damping, friction=joint.friction)

    def couplers(self, joint: RobotJoint) -> list[CoordinateCoupler]:
        """(5): return the coupler of a joint to its leader, or its stops at the limits."""
        if not joint.has_value or joint.name in self.drives:
            return []
        own = JointCoordinateName(joint.name, coordinate_of(self.robot, joint.name))
        if joint.mimic is not None:
            leader = JointCoordinateName(joint.mimic.joint, coordinate_of(self.robot, joint.mimic.joint))
            factor = joint.mimic.multiplier
            terms = [(own, 1.0)] + [(leader, -factor)] * (factor != 0)
            offsets = [offset_of(self.robot, self.values, name) for name in (joint.name, joint.mimic.joint)]
            held = joint.mimic.offset + factor * offsets[1] - offsets[0]
            return [CoordinateCoupler(f"{joint.name} mimic", terms, held)]
        lower, upper = range_of(self.robot, joint)
        if not self.stops or (lower is None and upper is None):
            return []
        value = self.values[joint.name]
        where = f"{self.robot.where(joint.line)}: joint {joint.name!r}"
        if (lower is not None and value < lower) or (upper is not None and value > upper):
            bounds = f"{'-inf' if lower is None else f'{lower:g}'} to {'inf' if upper is None else f'{upper:g}'}"
            raise UrdfError(
                f"{where}: is at {value:g}, beyond its limits {bounds}; give its initial value "
                f"(configuration, --at {joint.name}=VALUE), or disable limits"
            )
        if lower is not None and upper is not None and not lower < upper:
            raise UrdfError(f"{where}: its limits {lower:g} to {upper:g} allow no motion; make it fixed")
        offset = offset_of(self.robot, self.values, joint.name)
        stop = Limits(None if lower is None else lower - offset, None if upper is None else upper - offset)
        return [CoordinateCoupler(f"{joint.name} stop", [(own, 1.0)], limits=stop)]

    # The system ------------------------------------------------------------------------------------------------------

    def robot_system(self, gravity: Array) -> RobotSystem:
        """Return the system and the positions of its links."""
        robot = self.robot
        bodies = [
            self.flexible_body(link) if link in self.flexible else self.rigid_body(link)
            for link in robot.order
            if link in self.parts or link in self.flexible
        ]
        if not bodies:
            raise UrdfError(f"{robot.where()}: it cannot move: all links are fixed to the ground; see is_free")
        in_order = [robot.parent_joint[link] for link in robot.order[1:]]
        joints = [made for joint in in_order if (made := self.joint(joint)) is not None]
        forces: list[Force] = [Gravity(gravity)] if gravity.any() else []
        forces += [drag for joint in in_order if (drag := self.force(joint)) is not None]
        system = System(
            bodies, joints, forces, self.units, robot.name,
            couplers=[coupler for joint in in_order for coupler in self.couplers(joint)],
        )  # fmt: skip
        interfaces = {name: dict(each.interfaces) for name, each in self.flexible.items()}
        return RobotSystem(system, robot, self.values, self.carriers, interfaces)
