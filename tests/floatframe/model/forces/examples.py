"""Systems, bodies and helpers that several tests share: bushing, user forces."""

import numpy as np

from floatframe import GROUND, FlexibleBody, Gravity, Marker, RevoluteJoint, RigidBody, System, UserForce
from floatframe.forces import Bushing
from floatframe.joints import JointCoordinate
from floatframe.model.functions.time_functions import smooth_step
from tests.floatframe.engine.kernels.examples import turned_triad
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness


def mounted(**options):
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3), interfaces=2)
    bodies = [FlexibleBody("first", flexible), RigidBody("second", 2.0, np.diag([1.0, 1.5, 2.0]), (0.1, -0.2, 0.3))]
    a = Marker("first", "end_a", triad=turned_triad(4))
    b = Marker("second", position=(0.4, 0.2, -0.3), triad=turned_triad(5))
    return System(bodies, [], [Gravity((0.5, -1.0, -9.81)), Bushing("mount", a, b, **options)])


J = 0.7


def wheel(force, omega=0.0):
    body = RigidBody("wheel", 1.0, np.diag([0.5, 0.5, J]), omega_B=(0, 0, omega))
    forces = force if isinstance(force, list) else [force]
    return System([body], [RevoluteJoint("hub", GROUND, Marker("wheel"), axis=(0, 0, 1))], forces)


HUB = {"phi": JointCoordinate("hub", "angle")}


def pid():
    return UserForce(
        "pid", HUB, {"phi": "-kp*(phi - aim(t)) - kd*phi_dot - ki*e"}, {"e": "phi - aim(t)"}, {"e": 0.0},
        {"kp": 40.0, "kd": 4.0, "ki": 30.0}, {"aim": smooth_step(0.0, 1.0, 0.0, 8.0)},
    )  # fmt: skip
