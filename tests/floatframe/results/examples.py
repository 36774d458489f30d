"""Systems, bodies and helpers that several tests share: results file, sensors."""

from dataclasses import replace

import numpy as np

from floatframe import GROUND, FlexibleBody, Gravity, Marker, RigidBody, SphericalJoint, System
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness
from tests.synthetic import synthetic_reduced_body


def pendulum():
    reduced = reduced_body(random_point_masses(3, 3), stiffness(3), name="rod")
    bob = RigidBody("bob", 0.5, 0.1 * np.eye(3), position=reduced.interface("end_a").position)
    joints = [
        SphericalJoint("pin", GROUND, Marker("rod", "end_b")),
        SphericalJoint("link", Marker("rod", "end_a"), Marker("bob")),
    ]
    return System([FlexibleBody("rod", reduced), bob], joints, [Gravity((0, 0, -9.81))])


SYSTEM = pendulum()
RNG = np.random.default_rng(4)
SPIN = """
[system]
units = "mm-t-s"

[bodies.part]
file = "part.h5"
omega_B = [0, 0, 3]

[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "part"
marker_b = "{}"
axis = [0, 0, 1]

[sensors.tip]
type = "velocity"
body = "part"
marker = "{}"

[sensors."largest stress"]
type = "von-mises"
body = "part"

[sensors.energy]
type = "energy"

[sensors.load]
type = "reaction"
of = "hinge"
axes = "marker"

[run]
t_end = 0.01
h = 1e-4
"""
BODY = synthetic_reduced_body()
BODY = replace(BODY, stress=RNG.normal(size=(len(BODY.nodes), 6, BODY.n_q)))
TEXT = SPIN.format(BODY.interfaces[0].name, BODY.interfaces[-1].name)
