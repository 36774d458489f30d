"""Systems, bodies and helpers that several tests share: lifting surface."""

import numpy as np

import floatframe as ff
from floatframe.components.aerodynamics import LiftingSurface
from floatframe.model.functions.time_functions import polynomial_of_time, smooth_step

NUMBERS = {"area": 12.0, "lift_slope": 5.0, "density": 1.2, "zero_lift": -0.1, "zero_drag": 0.03, "induced_drag": 0.05}
WING = ff.Marker("glider")


def surface(**changes):
    return LiftingSurface("wing", WING, **(NUMBERS | changes))


def glider(**changes):
    body = ff.RigidBody("glider", 500.0, np.eye(3), velocity=(30.0, 0, -1.0))
    level = ff.joints.ConstantOrientation("level", ff.Marker("ground"), ff.Marker("glider"))
    wing = surface(factor=smooth_step(0.5, 1.0, 1.0, 0.2), zero_lift=polynomial_of_time([-0.1, 0.02]), **changes)
    return ff.System([body], [level], [ff.Gravity((0, 0, -9.81))], elements=[wing])
