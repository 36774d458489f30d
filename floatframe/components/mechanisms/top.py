"""The heavy symmetric top with a fixed point."""

import numpy as np

from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity
from floatframe.model.joints import SphericalJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.model.system import System

__all__ = ["spinning_top"]


def spinning_top(
    *,
    mass: float = 1.0,
    arm: float = 0.1,
    inertia: tuple[float, float] = (0.002, 0.001),
    tilt: float = 0.5,
    spin: float = 300.0,
    precession: float = 0.0,
    gravity: float = 9.81,
) -> System:
    """Return a body "top" on a spherical joint "tip" at the origin, its z axis tilted about x, under gravity along -z.

    Parameters
    ----------
    mass
        Mass [kg].
    arm
        Distance of the centre of mass from the tip [m].
    inertia
        Principal moments about the centre of mass, transverse and axial [kg m²].
    tilt
        Angle of the axis from the vertical [rad].
    spin
        Initial angular velocity about the axis of the top [rad/s].
    precession
        Initial angular velocity about the vertical [rad/s].
    gravity
        Gravity along -z [m/s²].
    """
    across, along = inertia
    up = np.array([0.0, np.sin(tilt), np.cos(tilt)])  # the vertical in body axes
    body = RigidBody(
        "top",
        mass,
        np.diag([across, across, along]),
        center_of_mass=np.array([0.0, 0.0, arm]),
        orientation=euler_parameters_of_rotation_vector(np.array([tilt, 0.0, 0.0])),
        omega_B=np.array([0.0, 0.0, spin]) + precession * up,
    )
    return System(
        [body], [SphericalJoint("tip", GROUND, Marker("top"))], [Gravity(np.array([0, 0, -gravity]))], name="top"
    )
