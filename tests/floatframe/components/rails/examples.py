"""Systems, bodies and helpers that several tests share: law, wheelset."""

import numpy as np

from floatframe import Gravity, RigidBody
from floatframe.components.rails.contact_search import Pair
from floatframe.components.rails.profile import Profile
from floatframe.components.rails.standard_profiles import cone


def circular_rail():
    """A head of one circle of 300 mm and steep sides, on which a cone meets no change of curvature."""
    y = np.linspace(-0.0355, 0.0355, 1421)
    z = np.sqrt(0.3**2 - y**2) - 0.3
    return Profile("rail", y, z - 12.0 * np.maximum(np.abs(y) - 0.034, 0.0) ** 2 / 0.0015, "circle")


NEW = Pair()
CONE = Pair(wheel=cone(0.05), rail=circular_rail(), inclination=0.0, gauge=1.459)
MASS, I_X, I_Y, LOAD = 1500.0, 900.0, 110.0, 6e4
DOWN = Gravity((0, 0, -2 * LOAD / MASS))  #: the weight of a vehicle, on the axle alone


def axle(V, spin, r, p=(1.0, 0.0, 0.0, 0.0), velocity=None, share=1.0):
    return RigidBody(
        "axle", mass=share * MASS, inertia=share * np.diag([I_X, I_Y, I_X]), position=r, orientation=p,
        velocity=(V, 0, 0) if velocity is None else velocity, omega_B=(0, spin, 0),
    )  # fmt: skip
