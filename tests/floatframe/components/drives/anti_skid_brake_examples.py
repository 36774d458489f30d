"""Systems, bodies and helpers that several tests share: anti skid brake."""

import numpy as np

from floatframe import GROUND, Marker, RevoluteJoint, RigidBody, System
from floatframe.components.drives import AntiSkidBrake

J, R = 1.5, 0.3
NUMBERS = {
    "pressure": 1e7, "gain": 3e-4, "build_rate": 3e7, "release_rate": 1.2e8, "radius": R, "slip": 0.15,
    "slip_band": 0.05, "reference_deceleration": 8.0, "drop_out": 5.0, "deceleration": 40.0,
    "deceleration_band": 20.0, "sensor_time": 4e-3, "time_constant": 0.015,
}  # fmt: skip


def brake(**changes):
    return AntiSkidBrake("brake", Marker(GROUND), Marker("wheel"), **(NUMBERS | changes))


def bench(**changes):
    wheel = RigidBody("wheel", mass=20.0, inertia=np.diag([0.9, J, 0.9]), omega_B=(0, 100.0, 0))
    hinge = RevoluteJoint("hinge", Marker(GROUND), Marker("wheel"), axis=(0, 1, 0))
    return System([wheel], [hinge], [], elements=[brake(speed=100.0, **changes)])
