"""Systems, bodies and helpers that several tests share: cable."""

import numpy as np

from floatframe import GROUND, Gravity, Marker, PrismaticJoint, RigidBody, System
from floatframe.components.cables import Cable

G = 9.81


def jumper(**options):
    """Return a mass of 2 kg at rest 0.5 m below the point from which it hangs on a cable of 1 m."""
    mass = RigidBody("mass", 2.0, np.eye(3), position=(0, 0, -0.5))
    guide = PrismaticJoint("guide", Marker(GROUND), Marker("mass"), axis=(0, 0, 1))
    given = {"stiffness": 400.0, "length": 1.0} | options
    return System(
        [mass], [guide], [Gravity((0, 0, -G))], elements=[Cable("rope", [Marker(GROUND), Marker("mass")], **given)]
    )
