"""Reading of URDF, the robot description format of ROS, to a `Robot`.

Elements and attributes are those of the specification (docs/robots.md has the table). Other elements are listed in
`Robot.notes`; invalid elements are refused with their line number. Nothing is added: a link without <inertial> has no
mass, and a missing number has the default of the specification or is an error.
"""

import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import near_file
from fe_models.foundation.words import quoted, shortened
from floatframe.errors import ModelError, UrdfError
from floatframe.files.importers.robot import (
    JOINT_TYPES,
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
from floatframe.model.shapes import Box, Cylinder, Sphere

__all__ = ["Element", "read_urdf", "read_xml"]


# an XML file as a tree whose elements know their line, so that messages can name it -----------------------------------
# The parser is Python's own (expat). A document type is refused before its content is parsed: descriptions of robots
# have none, and it could refer to other files, or to entities that expand without limit.


MOST_BYTES = 50_000_000  #: largest size of a file in bytes; a robot with hundreds of links has about 100 kB
MOST_NESTED = 50


@dataclass(eq=False)
class Element:
    """An XML element with its attributes and child elements."""

    tag: str
    attributes: dict[str, str]
    line: int  #: line number in the file, from 1
    children: list["Element"] = field(default_factory=list)

    def all(self, tag: str) -> list["Element"]:
        """Return the child elements with a tag in the order of the file."""
        return [child for child in self.children if child.tag == tag]


def read_xml(path: Path) -> Element:
    """Return the XML tree of a file.

    Raises
    ------
    UrdfError
        If there is no such file, it is not well-formed XML, it is too large, or its first element has another tag.
    """
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise UrdfError(f"{path}: expected a file of up to {MOST_BYTES // 1_000_000} MB, got {size / 1e6:.0f} MB")
        content = path.read_bytes()
    except FileNotFoundError:
        raise UrdfError(f"{path}: no such file{near_file(path)}") from None
    except OSError as error:
        raise UrdfError(f"{path}: cannot be read: {error.strerror}") from error
    tree = parsed(path, content)
    if tree.tag != "robot":
        raise UrdfError(f"{path}, line {tree.line}: expected <robot> as first element, got <{shortened(tree.tag)}>")
    return tree


def parsed(path: Path, content: bytes) -> Element:
    """Return the root element of an XML text with all its children."""
    parser = expat.ParserCreate()
    top = Element("", {}, 0)
    open_elements = [top]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > MOST_NESTED:
            raise UrdfError(f"{path}, line {parser.CurrentLineNumber}: elements are nested deeper than {MOST_NESTED}")
        element = Element(tag, attributes, parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def doctype(name: str, *_: object) -> None:
        raise UrdfError(
            f"{path}, line {parser.CurrentLineNumber}: expected no document type, got <!DOCTYPE {quoted(name)}>; "
            "remove it"
        )

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _: open_elements.pop()
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise UrdfError(f"{path}, line {error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}") from None
    except (ValueError, LookupError) as error:  # an encoding that does not exist
        raise UrdfError(f"{path}: cannot be read as XML: {error}") from None
    return top.children[0]


# read urdf ------------------------------------------------------------------------------------------------------------


Color = tuple[float, float, float, float]

READ = {  #: child elements that are read, by the tag of their parent
    "robot": ("link", "joint", "material"),
    "link": ("inertial", "visual", "collision"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "geometry": ("box", "cylinder", "sphere", "mesh"),
    "material": ("color",),
}
TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def read_urdf(path: str | os.PathLike[str]) -> Robot:
    """Read a URDF file.

    Parameters
    ----------
    path
        Name of the URDF file.

    Raises
    ------
    UrdfError
        If the file is not valid, or is a xacro file that must be expanded first; the message has the line number.
    """
    return Reader(Path(path)).robot()


class Reader:
    """Reads one file; collects materials and counts elements that are ignored."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.colors: dict[str, Color] = {}
        self.unread: Counter[str] = Counter()

    def robot(self) -> Robot:
        """Return the robot in the file."""
        top = read_xml(self.path)
        self.refuse_macros(top)
        for element in top.all("material"):
            color = self.color(element)
            if color is not None:
                self.colors[self.text(element, "name")] = color
        links = [self.link(element) for element in top.all("link")]
        joints = [self.joint(element) for element in top.all("joint")]
        self.count_unread(top)
        notes = tuple(f"{count} × <{tag}> not read" for tag, count in sorted(self.unread.items()))
        return Robot(self.text(top, "name"), links, joints, str(self.path), notes)

    def refuse_macros(self, top: Element) -> None:
        """Raise `UrdfError` if the file must be expanded by xacro first."""
        left = [top]
        while left:
            element = left.pop()
            left += element.children
            is_macro = element.tag.startswith("xacro:") or any("${" in value for value in element.attributes.values())
            if is_macro:
                raise UrdfError(
                    f"{self.path}, line {element.line}: a macro of xacro, which is not URDF yet; expand the file "
                    "first: xacro robot.urdf.xacro > robot.urdf"
                )

    def count_unread(self, element: Element) -> None:
        """Count child elements that are ignored."""
        known = READ.get(element.tag)
        for child in element.children:
            if known is not None and child.tag not in known:
                self.unread[child.tag] += 1
            elif known is not None:
                self.count_unread(child)

    def error(self, element: Element, words: str) -> UrdfError:
        """Return an error about an element."""
        return UrdfError(f"{self.path}, line {element.line}: <{element.tag}>: {words}")

    # Numbers and words -----------------------------------------------------------------------------------------------

    def text(self, element: Element, key: str) -> str:
        """Return a required attribute, which must not be empty."""
        value = element.attributes.get(key, "").strip()
        if not value:
            raise self.error(element, f"expected the attribute {key}, a text, got none")
        return value

    def numbers(self, element: Element, key: str, n: int, default: Array | None = None) -> Array:
        """Return an attribute as n numbers, (n,)."""
        if key not in element.attributes and default is not None:
            return default
        words = self.text(element, key).split()
        try:
            values = np.array([float(word) for word in words])
        except ValueError:
            values = np.full(1, np.nan)
        if len(values) != n or not np.isfinite(values).all():
            found = quoted(element.attributes[key])
            many = "a finite number" if n == 1 else f"{n} finite numbers"
            raise self.error(element, f"{key}: expected {many}, got {found}")
        return values

    def number(self, element: Element, key: str, default: float | None = None) -> float:
        """Return an attribute as a number."""
        return float(self.numbers(element, key, 1, None if default is None else np.array([default]))[0])

    def optional(self, element: Element | None, key: str) -> float | None:
        """Return an attribute as a number; None if the attribute or the element is missing."""
        return None if element is None or key not in element.attributes else self.number(element, key)

    def one(self, element: Element, tag: str) -> Element | None:
        """Return the child element with a tag; None if there is none, `UrdfError` if there are several."""
        found = element.all(tag)
        if len(found) > 1:
            raise self.error(element, f"expected one <{tag}>, got {len(found)}")
        return found[0] if found else None

    def needed(self, element: Element, tag: str) -> Element:
        """Return the required child element with a tag."""
        found = self.one(element, tag)
        if found is None:
            raise self.error(element, f"expected <{tag}> in it, got none")
        return found

    def pose(self, element: Element) -> Pose:
        """Return the pose in the <origin> of an element."""
        origin = self.one(element, "origin")
        if origin is None:
            return Pose()
        zero = np.zeros(3)
        return Pose(self.numbers(origin, "xyz", 3, zero), self.numbers(origin, "rpy", 3, zero))

    # Links -----------------------------------------------------------------------------------------------------------

    def link(self, element: Element) -> Link:
        """Return the link of a <link> element."""
        inertial = self.one(element, "inertial")
        return Link(
            self.text(element, "name"),
            None if inertial is None else self.inertial(inertial),
            tuple(self.picture(each) for each in element.all("visual")),
            tuple(self.picture(each) for each in element.all("collision")),
            element.line,
        )

    def inertial(self, element: Element) -> Inertial:
        """Return the mass properties of an <inertial> element."""
        at = self.needed(element, "mass")
        mass = self.number(at, "value")
        if mass < 0:
            raise self.error(at, f"expected a mass of 0 or more, got {mass:g}")
        at = self.needed(element, "inertia")
        xx, xy, xz, yy, yz, zz = (self.number(at, key) for key in TENSOR)
        return Inertial(mass, self.pose(element), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))

    def picture(self, element: Element) -> Picture:
        """Return the picture of a <visual> or <collision> element."""
        at = self.needed(element, "geometry")
        shapes = [child for child in at.children if child.tag in READ["geometry"]]
        if len(shapes) != 1:
            choices = ", ".join(f"<{tag}>" for tag in READ["geometry"])
            got = ", ".join(f"<{child.tag}>" for child in at.children) or "none"
            raise self.error(at, f"expected one of {choices}, got {got}")
        material = self.one(element, "material") if element.tag == "visual" else None
        color = None
        if material is not None:
            color = self.color(material)
            name = material.attributes.get("name", "")
            if color is None and name in self.colors:
                color = self.colors[name]
            elif color is None and not material.all("texture"):
                raise self.error(material, f"there is no material {quoted(name)} with a color in this file")
            if color is not None and name:
                self.colors.setdefault(name, color)  # as in other readers: it may be used again below
        return Picture(self.geometry(shapes[0]), self.pose(element), color, element.attributes.get("name", ""))

    def geometry(self, element: Element) -> Box | Cylinder | Sphere | MeshFile:
        """Return the geometry of a <geometry> element."""
        try:
            if element.tag == "box":
                return Box(self.numbers(element, "size", 3))
            if element.tag == "cylinder":
                return Cylinder(self.number(element, "radius"), self.number(element, "length"))
            if element.tag == "sphere":
                return Sphere(self.number(element, "radius"))
        except ModelError as error:
            raise self.error(element, str(error)) from None
        scale = self.numbers(element, "scale", 3, np.ones(3))
        if not scale.all():
            raise self.error(element, f"scale: expected numbers other than zero, got {element.attributes['scale']!r}")
        return MeshFile(self.text(element, "filename"), scale)

    def color(self, element: Element) -> Color | None:
        """Return the <color> of a <material>; None if it has none."""
        at = self.one(element, "color")
        if at is None:
            return None
        rgba = self.numbers(at, "rgba", 4)
        if rgba.min() < 0 or rgba.max() > 1:
            raise self.error(at, f"rgba: expected numbers from 0 to 1, got {at.attributes['rgba']!r}")
        red, green, blue, opacity = rgba.tolist()
        return red, green, blue, opacity

    # Joints ----------------------------------------------------------------------------------------------------------

    def joint(self, element: Element) -> RobotJoint:
        """Return the joint of a <joint> element."""
        kind = self.text(element, "type")
        if kind not in JOINT_TYPES:
            raise self.error(element, f"type: expected one of {', '.join(JOINT_TYPES)}, got {quoted(kind)}")
        limit, dynamics, mimic = (self.one(element, tag) for tag in ("limit", "dynamics", "mimic"))
        if kind == "revolute" and limit is None:
            raise self.error(
                element, 'a revolute joint has limits: expected <limit lower="..." upper="...">, got none; a joint '
                "without limits has the type continuous"
            )  # fmt: skip
        if kind == "continuous" and limit is not None and {"lower", "upper"} & set(limit.attributes):
            self.unread["limit lower/upper of a continuous joint"] += 1
        if kind in ("planar", "floating", "fixed") and dynamics is not None:
            self.unread[f"dynamics of a {kind} joint"] += 1
        return RobotJoint(
            self.text(element, "name"),
            kind,
            self.text(self.needed(element, "parent"), "link"),
            self.text(self.needed(element, "child"), "link"),
            self.pose(element),
            self.axis(element, kind),
            self.limits(limit, kind),
            damping=0.0 if dynamics is None else self.number(dynamics, "damping", 0.0),
            friction=0.0 if dynamics is None else self.number(dynamics, "friction", 0.0),
            mimic=None if mimic is None else self.mimic(mimic),
            line=element.line,
        )

    def axis(self, element: Element, kind: str) -> Array:
        """Return the unit axis of a joint, (3,); the x axis if <axis> is missing."""
        at = self.one(element, "axis")
        if at is None or kind not in WITH_AXIS:
            return np.array([1.0, 0.0, 0.0])
        axis = self.numbers(at, "xyz", 3)
        length = float(np.linalg.norm(axis))
        if length == 0:
            raise self.error(at, "xyz: expected a direction, got the zero vector")
        return axis if abs(length - 1) < 1e-15 else axis / length

    def limits(self, element: Element | None, kind: str) -> JointLimits:
        """Return the limits of a joint; missing limits of revolute and prismatic joints are 0, as URDF specifies."""
        effort, velocity = self.optional(element, "effort"), self.optional(element, "velocity")
        if element is None or kind not in ("revolute", "prismatic"):
            return JointLimits(None, None, effort, velocity)
        return JointLimits(self.number(element, "lower", 0.0), self.number(element, "upper", 0.0), effort, velocity)

    def mimic(self, element: Element) -> Mimic:
        """Return the leader and factors of a <mimic> element."""
        return Mimic(
            self.text(element, "joint"), self.number(element, "multiplier", 1.0), self.number(element, "offset", 0.0)
        )
