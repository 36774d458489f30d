"""Systems, bodies and helpers that several tests share: bad input."""

import numpy as np

from floatframe import GROUND, Marker, RevoluteJoint, RigidBody, SphericalJoint, System
from floatframe.components.mechanisms.rods import slender_inertia
from floatframe.joints import UniversalJoint

CRANK = """
[system]
units = "m-kg-s"
gravity = [0, -9.81, 0]

[bodies.crank]
mass = 1.0
inertia = [[1e-3, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]
center_of_mass = [0.1, 0, 0]
rotation_vector = [0, 0, 1.5707963267948966]

[bodies.rod]
mass = 1.0
inertia = [[1e-3, 0, 0], [0, 0.03, 0], [0, 0, 0.03]]
center_of_mass = [0.3, 0, 0]
position = [0, 0.2, 0]
rotation_vector = [0, 0, -0.339836909454]

[bodies.block]
mass = 1.0
inertia = [[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]]
position = [0.565685424949, 0, 0]

[joints.main]
type = "revolute"
body_a = "ground"
body_b = "crank"
marker_a = [0, 0, 0]
axis = [0, 0, 1]

[joints.pin]
type = "revolute"
body_a = "crank"
body_b = "rod"
marker_a = [0.2, 0, 0]
axis = [0, 0, 1]

[joints.gudgeon]
type = "point-on-line"
body_a = "block"
body_b = "rod"
marker_a = [0, 0, 0]
marker_b = [0.6, 0, 0]
axis = [0, 0, 1]

[joints.guide]
type = "prismatic"
body_a = "ground"
body_b = "block"
marker_a = [0, 0, 0]
marker_b = [0, 0, 0]
axis = [1, 0, 0]

[run]
t_end = 0.5
h = 1e-3
"""
TURN = '\n[joints.main.motions.angle]\ntype = "polynomial"\ncoefficients = [0.0, 4.0]\n'


def parallelogram(angle):
    """Two equal cranks and a coupler as long as the ground; flat at angle 0, where it could fold over."""
    tip = 0.3 * np.array([np.cos(angle), np.sin(angle), 0])
    turn = [np.cos(angle / 2), 0, 0, np.sin(angle / 2)]

    def bar(name, length, **placed):
        return RigidBody(name, 1.0, slender_inertia(1.0, length), center_of_mass=(length / 2, 0, 0), **placed)

    bodies = [bar("crank", 0.3, orientation=turn), bar("coupler", 1.0, position=tip),
              bar("rocker", 0.3, position=(1, 0, 0), orientation=turn)]  # fmt: skip
    joints = [
        RevoluteJoint("main", GROUND, Marker("crank")),
        SphericalJoint("pin", Marker("crank", position=(0.3, 0, 0)), Marker("coupler")),
        UniversalJoint("knee", Marker("rocker", position=(0.3, 0, 0)), Marker("coupler", position=(1.0, 0, 0)),
                       axis=(0, 0, 1), axis_b=(0, 1, 0)),
        RevoluteJoint("rest", Marker(GROUND, position=(1, 0, 0)), Marker("rocker")),
    ]  # fmt: skip
    return System(bodies, joints)
