"""Systems, bodies and helpers that several tests share: wheels in motion."""

import numpy as np

import floatframe as ff
from floatframe.components import wheels

G, R0, K, M = 9.81, 0.3, 2e5, 20.0
DOWN = ff.Gravity((0, 0, -G))


def linear(name="tyre", marker=None, **changes):
    numbers = {"radius": R0, "stiffness": K, "slip_stiffness": 8e4, "cornering_stiffness": 6e4}
    numbers |= {"relaxation_x": 0.2, "relaxation_y": 0.4} | changes
    return wheels.LinearTyre(name, ff.Marker(ff.GROUND), marker or ff.Marker("wheel"), **numbers)


def wheel(height=R0, **motion):
    return ff.RigidBody("wheel", M, np.diag([0.5, 1.0, 0.5]), position=(0, 0, height), **motion)
