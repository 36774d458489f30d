"""Systems, bodies and helpers that several tests share: public elements."""

import numpy as np

from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Gravity, Marker, RigidBody, SpringDamper, System
from tests.floatframe.model.elements.laws import Spring
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

METHOD = GeneralizedAlpha(0.9, 1e-11)
ENDS = (Marker("a", position=(0.1, 0.2, 0.3)), Marker("b", position=(0.3, 0.1, 0.2)))
HELD = (Marker(GROUND, position=(0, 0, 1)), Marker("a", position=(0.3, 0.3, 0.3)))


def two_bodies():
    inertia = np.diag([0.1, 0.2, 0.25])
    return [
        RigidBody("a", mass=2.0, inertia=inertia, position=(1, 0, 0), omega_B=(1, 2, 3)),
        RigidBody("b", mass=1.0, inertia=inertia, position=(2, 0.3, 0), omega_B=(1, -2, 3)),
    ]


def sprung(elements=(), forces=()):
    return System(two_bodies(), [], [*forces, Gravity((0, 0, -9.81))], elements=elements)


def built_in():
    return sprung(
        forces=[
            SpringDamper("s", *ENDS, stiffness=200.0, damping=1.0, preload=1.0),
            SpringDamper("g", *HELD, stiffness=300.0, damping=2.0, preload=1.0),
        ]
    )


def as_elements(**options):
    return sprung([Spring("s", *ENDS, 200.0, 1.0, 1.0, **options), Spring("g", *HELD, 300.0, 2.0, 1.0, **options)])


def places(motion):
    return np.concatenate([motion.body(name).r for name in motion.body_names], axis=1)


def pendulum(joint=(), elements=()):
    flexible = reduced_body(random_point_masses(3, 3), stiffness(3))
    body = FlexibleBody("b", flexible, omega_B=(0.3, -0.2, 0.5))
    return System([body], joint, [Gravity((0, 0, -9.81))], elements=elements)


def hinge():
    place = pendulum().bodies[0].reduced.interfaces[0].position
    return Marker(GROUND, position=place), Marker("b", "end_a")
