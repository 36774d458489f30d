"""Systems, bodies and helpers that several tests share: bristle friction."""

import numpy as np

from floatframe import GROUND, Marker, PrismaticJoint, RigidBody, SpringDamper, System
from floatframe.components.friction import BristleFriction
from floatframe.model.functions.time_functions import polynomial_of_time

NUMBERS = {"coulomb": 1.0, "static": 1.5, "stribeck_speed": 0.01, "stiffness": 1e4, "damping": 100.0, "viscous": 0.4}


def pulled(**options):
    """Return a block of 1 kg that is pulled over the ground by a spring whose other end moves at 0.1 m/s."""
    block = RigidBody("block", 1.0, np.eye(3))
    puller = RigidBody("puller", 1.0, np.eye(3), position=(1.0, 0, 0), velocity=(0.1, 0, 0))
    rails = [PrismaticJoint("rail", Marker(GROUND), Marker("block"), axis=(1, 0, 0)),
             PrismaticJoint("drive", Marker(GROUND), Marker("puller"), axis=(1, 0, 0),
                            motions={"distance": polynomial_of_time([1.0, 0.1])})]  # fmt: skip
    spring = SpringDamper("spring", Marker("block"), Marker("puller"), stiffness=20.0)
    friction = BristleFriction("friction", Marker(GROUND), Marker("block"), axis=(1, 0, 0), **(NUMBERS | options))
    return System([block, puller], rails, [spring], elements=[friction])
