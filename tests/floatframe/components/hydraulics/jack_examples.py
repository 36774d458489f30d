"""Systems, bodies and helpers that several tests share: jack."""

import numpy as np

from floatframe import GROUND, Gravity, Marker, PrismaticJoint, RigidBody, System
from floatframe.components.hydraulics import Accumulator, Circuit, Cylinder, Fluid, Node, Orifice

MASS, FALL, AREA = 400.0, 9.81, 2e-3
K, AMBIENT, RHO = 1.4e9, 101325.0, 870.0
HEAD_VOLUME, GAS_NODE, HOLE = 5e-5, 2e-5, 1.5e-5
GAS, CHARGE, EXPONENT = 5e-4, 1.2e6, 1.4
START, STROKE = 2.6e6, 0.2


def jack(pressure=START):
    body = RigidBody("mass", mass=MASS, inertia=np.eye(3), position=(0, 0, 0.3 + STROKE))
    base, top = Marker(GROUND, position=(0, 0, 0)), Marker("mass", position=(0, 0, 0))
    guide = PrismaticJoint("guide", Marker(GROUND, position=(0, 0, 0.3 + STROKE)), top, axis=(0, 0, 1))
    cylinder = Cylinder(
        "jack", base, top, AREA, head="head", stroke=0.4, retracted_length=0.3, head_dead_volume=HEAD_VOLUME
    )
    parts = [cylinder, Orifice("hole", "head", "gas", HOLE), Accumulator("ball", "gas", GAS, CHARGE, EXPONENT)]
    nodes = {"head": Node(0.0, pressure), "gas": Node(GAS_NODE, pressure)}
    circuit = Circuit("circuit", Fluid(RHO, K, AMBIENT), parts, nodes)
    return System([body], [guide], [Gravity((0, 0, -FALL))], elements=[circuit])
