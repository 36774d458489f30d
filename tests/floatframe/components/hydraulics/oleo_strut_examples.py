"""Systems, bodies and helpers that several tests share: oleo strut."""

import numpy as np

from floatframe import GROUND, Gravity, Marker, PrismaticJoint, RigidBody, SpringDamper, System
from floatframe.components.hydraulics import Fluid, OleoStrut
from floatframe.model.functions.tables import monotone_table

UPPER, LOWER, FALL, SPEED = 1100.0, 60.0, 9.81, 2.5
OIL = Fluid(870.0, 1.4e9, 101325.0)
GAS, CHARGE, A_GAS, A_OIL = 1.6e-3, 1.5e6, 4.0e-3, 3.2e-3
AREA = monotone_table([0.0, 0.1, 0.2, 0.3], [1.6e-4, 1.4e-4, 1.0e-4, 0.6e-4])
RECOIL, STROKE, LENGTH, N, DISCHARGE = 6e-5, 0.32, 0.8, 1.3, 0.9
STOP, STOP_DAMPING, SEAL, SEAL_AREA, SLOW = 4e6, 0.3, 300.0, 2e-5, 0.02
TYRE, TYRE_DAMPING, HEIGHT = 2.5e5, 300.0, 0.3


def strut(a, b, axis, **options):
    numbers = {
        "gas_volume": GAS, "charge": CHARGE, "gas_area": A_GAS, "oil_area": A_OIL, "area": AREA, "stroke": STROKE,
        "extended_length": LENGTH, "stop_stiffness": STOP, "recoil_area": RECOIL, "exponent": N, "discharge": DISCHARGE,
        "friction": SEAL, "friction_area": SEAL_AREA, "friction_speed": SLOW, "stop_damping": STOP_DAMPING,
        "axis": axis,
    }  # fmt: skip
    return OleoStrut("strut", a, b, OIL, **(numbers | options))


def drop(**options):
    bodies = [
        RigidBody(name, mass=mass, inertia=np.eye(3), position=(0, 0, z), velocity=(0, 0, -SPEED))
        for name, mass, z in (("upper", UPPER, HEIGHT + LENGTH), ("lower", LOWER, HEIGHT))
    ]
    at = {body.name: Marker(body.name, position=(0, 0, 0)) for body in bodies}
    base = Marker(GROUND, position=(0, 0, 0))
    guides = [
        PrismaticJoint(f"guide {name}", Marker(GROUND, position=(0, 0, 0)), at[name], axis=(0, 0, 1)) for name in at
    ]
    tyre = SpringDamper("tyre", base, at["lower"], TYRE, TYRE_DAMPING, free_length=HEIGHT)
    shock = strut(at["upper"], at["lower"], (0, 0, -1), **options)
    return System(bodies, guides, [Gravity((0, 0, -FALL)), tyre], elements=[shock])
