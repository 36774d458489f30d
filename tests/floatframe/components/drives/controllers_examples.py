"""Systems, bodies and helpers that several tests share: controllers."""

import numpy as np

from floatframe import GROUND, Marker, RevoluteJoint, RigidBody, System
from floatframe.components.drives import DcMotor, InductionMotor, Pid, PidDrive, SpeedControl, TorqueMap
from floatframe.model.functions.time_functions import harmonic, polynomial_of_time

J = 0.4
A, B = Marker(GROUND, position=(0, 0, 0)), Marker("rotor", position=(0, 0, 0))


def turned(*elements, omega=0.0):
    rotor = RigidBody("rotor", mass=2.0, inertia=np.diag([0.3, 0.3, J]), omega_B=(0, 0, omega))
    return System([rotor], [RevoluteJoint("hinge", A, B, axis=(0, 0, 1))], [], elements=elements)


def every_drive():
    pid = Pid(harmonic(0.5, 9.0, 0.0, 3.0), 2.0, 5.0, 0.1, 0.01, -40.0, 50.0)
    yield DcMotor("motor", A, B, 0.5, 2e-3, 0.1, voltage=harmonic(20.0, 3.0), ratio=3.0, friction=0.1, damping=0.01)
    for controlled in ("speed", "angle", "current"):
        yield DcMotor("motor", A, B, 0.5, 2e-3, 0.1, controller=pid, controlled=controlled)
    yield InductionMotor(
        "motor", A, B, 0.5, 0.4, 2e-3, 3e-3, 0.06, 2, polynomial_of_time([5.0, 20.0]), rated_voltage=310.0,
        rated_frequency=50.0, boost=10.0, harmonics=[[-5, 0.2]], damping=0.01,
    )  # fmt: skip
    for controlled in ("angle", "speed", "distance", "rate"):
        yield PidDrive("motor", A, B, pid, controlled, time_constant=0.1 if controlled == "rate" else 0.0)
    yield SpeedControl("motor", A, B, 30.0, 12.0, 0.2, 0.01, limit=500.0)
    yield TorqueMap("motor", A, B, [0, 100], [0, 1], [[0, 40], [-8, 60]], controller=pid, time_constant=0.1)
