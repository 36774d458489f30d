"""A humanoid of 21 links, written for these tests: as a system, and in MuJoCo's language (MJCF).

A free trunk; waist, neck, shoulders, hips and ankles of two or three hinges in one place, elbows and knees of one. In
both descriptions a link is a body in its own frame, at `at` in that of its parent, whose hinges turn about axes through
its origin. Capsules along z give masses and inertias, by formulas here, not by either program.
"""

from dataclasses import dataclass

import numpy as np

import floatframe as ff

DENSITY = 1000.0


@dataclass(frozen=True)
class Link:
    name: str
    parent: str  #: "" for the trunk, which is free
    at: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float
    length: float  #: of the cylinder, down along -z from the origin; 0: a link of next to no size
    armature: float = 0.0


def limb(side, y):
    """Return arm and leg of one side."""
    x, z = (1, 0, 0), (0, 0, 1)
    return [
        Link(f"{side} collar", "chest", (0, y * 0.17, 0.2), x, 0.03, 0.02),
        Link(f"{side} upper arm", f"{side} collar", (0, 0, 0), (0, 1, 0), 0.04, 0.28),
        Link(f"{side} forearm", f"{side} upper arm", (0, 0, -0.3), (0, 0.8, 0.6), 0.03, 0.26),
        Link(f"{side} hip", "trunk", (0, y * 0.1, -0.05), z, 0.04, 0.03),
        Link(f"{side} pelvis", f"{side} hip", (0, 0, 0), x, 0.04, 0.03),
        Link(f"{side} thigh", f"{side} pelvis", (0, 0, 0), (0, 1, 0), 0.06, 0.38),
        Link(f"{side} shin", f"{side} thigh", (0, 0, -0.42), (0, 1, 0), 0.045, 0.36),
        Link(f"{side} ankle", f"{side} shin", (0, 0.01 * y, -0.42), (0, 1, 0), 0.03, 0.02),
        Link(f"{side} foot", f"{side} ankle", (0, 0, 0), x, 0.035, 0.08),
    ]


LINKS = [
    Link("trunk", "", (0, 0, 1.0), (0, 0, 0), 0.13, 0.2),
    Link("chest", "trunk", (0, 0, 0.15), (0, 0, 1), 0.12, 0.25),
    Link("head", "chest", (0, 0, 0.3), (0, 1, 0), 0.09, 0.1),
    *limb("left", 1.0),
    *limb("right", -1.0),
]


def capsule(radius, length):
    """Return mass and the moments about the centre, across and along, of a cylinder with half balls at its ends."""
    cylinder, ball = DENSITY * np.pi * radius**2 * length, DENSITY * 4 / 3 * np.pi * radius**3
    along = cylinder * radius**2 / 2 + ball * 0.4 * radius**2
    across = cylinder * (radius**2 / 4 + length**2 / 12)
    across += ball * (0.4 * radius**2 + length**2 / 4 + 3 / 8 * radius * length)
    return cylinder + ball, across, along


def system():
    """Return the humanoid as a system."""
    bodies, joints, places = [], [], {"": np.zeros(3)}
    for link in LINKS:
        places[link.name] = places[link.parent] + link.at
        mass, across, along = capsule(link.radius, link.length)
        center = (0.0, 0.0, -link.length / 2)
        inertia = np.diag([across, across, along])
        bodies.append(ff.RigidBody(link.name, mass, inertia, center, position=places[link.name]))
        if link.parent:
            ends = ff.Marker(link.parent, position=link.at), ff.Marker(link.name)
            joints.append(ff.RevoluteJoint(f"{link.name} hinge", *ends, axis=link.axis))
    return ff.System(bodies, joints, [ff.Gravity((0.0, 0.0, -9.81))], name="humanoid")


def mjcf():
    """Return the humanoid in MJCF, without contacts."""

    def body(link, depth):
        mass, across, along = capsule(link.radius, link.length)
        pad = "  " * depth
        joint = f'<joint type="hinge" axis="{numbers(link.axis)}"/>' if link.parent else "<freejoint/>"
        inertial = (
            f'<inertial pos="0 0 {-link.length / 2!r}" mass="{mass!r}" diaginertia="{across!r} {across!r} {along!r}"/>'
        )
        inner = "".join(body(child, depth + 1) for child in LINKS if child.parent == link.name)
        opened = f'{pad}<body name="{link.name}" pos="{numbers(link.at)}">\n{pad}  {joint}\n{pad}  {inertial}\n'
        return f"{opened}{inner}{pad}</body>\n"

    def numbers(values):
        return " ".join(repr(float(value)) for value in values)

    return (
        '<mujoco model="humanoid">\n  <option gravity="0 0 -9.81"/>\n'
        '  <compiler balanceinertia="false" boundmass="0" boundinertia="0"/>\n'
        f"  <worldbody>\n{body(LINKS[0], 2)}  </worldbody>\n</mujoco>\n"
    )
