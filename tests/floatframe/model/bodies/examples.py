"""Systems, bodies and helpers that several tests share: free body."""

import numpy as np

from floatframe import FlexibleBody, System
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

N_Q = 4


def spinning(forces=()):
    reduced = reduced_body(random_point_masses(N_Q, 3), stiffness(N_Q, omega=6.0))
    q = np.array([0.3, -0.2, 0.1, 0.25])
    body = FlexibleBody("body", reduced, velocity=(0.4, -0.3, 1.0), omega_B=(1.5, -2.0, 1.0), q=q)
    return System([body], forces=forces)
