"""Systems, bodies and helpers that several tests share: clearances."""

import numpy as np

from floatframe import GROUND, Gravity, Marker, RigidBody, System
from floatframe.components.clearances import HingeWithPlay

NUMBERS = {"stiffness": 4e5, "damping": 0.3, "friction": 0.2, "friction_speed": 0.01, "radius": 0.01}
M, J, ARM, PLAY, G = 2.0, 0.05, 0.2, 1e-3, 9.81
START = np.array([ARM * np.sin(1.2), -ARM * np.cos(1.2), 1.2])  # of the centre of mass and the angle from below


def pendulum(exponent):
    """Return a pendulum about z whose pin is in the middle of its bearing when it is let go."""
    turned = np.cos(START[2] / 2), 0.0, 0.0, np.sin(START[2] / 2)
    body = RigidBody("bob", M, np.diag([J, J, J]), position=(*START[:2], 0.0), orientation=turned)
    hinge = HingeWithPlay("hinge", Marker(GROUND), Marker("bob", position=(0, ARM, 0)), radial_play=PLAY, length=0.05,
                          exponent=exponent, **(NUMBERS | {"stiffness": 2e5 * (1e3) ** (exponent - 1)}))  # fmt: skip
    return System([body], forces=[Gravity((0, -G, 0))], elements=[hinge])
