"""Systems, bodies and helpers that several tests share: element states."""

import numpy as np

from floatframe import GROUND, Gravity, JointForce, Marker, PrismaticJoint, RigidBody, System
from tests.floatframe.model.elements.laws import Jack

MASS, SPRING, DAMPER, G = 10.0, 1e4, 3.0, 10.0


def lifted(**options):
    """Return a mass on a spring-damper over a jack."""
    body = RigidBody("b", MASS, np.eye(3))
    rail = PrismaticJoint("rail", Marker(GROUND), Marker("b"), axis=(0, 0, 1))
    spring = JointForce("k", "rail", "distance", stiffness=SPRING, damping=DAMPER)
    return System([body], [rail], [Gravity((0, 0, -G)), spring], elements=[Jack("jack", Marker("b"), **options)])


def jack_matrix(jack):
    """Return A of x' = A x + b, x = (z, v, p)."""
    return np.array(
        [
            [0, 1, 0],
            [-SPRING / MASS, -DAMPER / MASS, jack.area / MASS],
            [0, -jack.stiffness * jack.area, -jack.stiffness * jack.leak],
        ]
    )


def disc(**parts):
    inertia = np.diag([0.5, 1.0, 0.5])
    tilt = np.array([np.cos(0.15), np.sin(0.15), 0, 0])  # leans by 0.3 rad
    body = RigidBody(
        "disc",
        2.0,
        inertia,
        position=(0, 0, 0.8 * np.cos(0.3)),
        orientation=tilt,
        velocity=(1.6, 0.1, 0),
        omega_B=(0.2, 2.0, 0.3),
    )
    return System([body], parts.get("joints", ()), [Gravity((0, 0, -9.81))], elements=parts.get("elements", ()))
