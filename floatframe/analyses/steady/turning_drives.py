"""Drives that rotate a system relative to the ground, set to the speed of a steady rotation."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.markers import joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.functions.time_functions import TimeFunction, polynomial_of_time
from floatframe.model.joints.rows import RelativePlace
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.system import System

__all__ = ["turning_with"]

SAME = 1e-9  #: difference of two rates, relative to the speed, below which they are equal


def turning_with(system: System, omega: Array) -> System:
    """Return the system in which prescribed angles relative to the ground rotate with omega from t = 0.

    Every drive keeps its angle at t = 0. The system is returned unchanged if omega is zero, or if all drives already
    rotate with omega.

    Parameters
    ----------
    omega
        Angular velocity, ground axes, (3,) [rad/s].
    """
    speed = float(np.linalg.norm(omega))
    if speed == 0.0:
        return system
    placed, n_q, joints = compiled_system(system).placed, n_q_of(system), []
    for joint in system.joints:
        given: Mapping[str, TimeFunction] = getattr(joint, "motions", {})
        motions = dict(given)
        if motions and not isinstance(joint, SlidingJoint):
            a, b = joint_markers(system, joint, placed)
            of_b = (b.body >= 0) * omega - (a.body >= 0) * omega
            (r_a, A_a), (r_b, A_b) = (marker_pose(end, placed, n_q) for end in (a, b))
            for row in joint.rows(A_a, A_b, r_b - r_a):
                own = row.coordinate
                if own is None or not own.is_angle or own.name not in motions or not of_b.any():
                    continue
                axis = own.direction(RelativePlace(A_a, A_b, r_b - r_a))
                rate, motion = float(axis @ of_b), motions[own.name]
                if abs(motion(0.0, 1) - rate) > SAME * speed or abs(motion(0.0, 2)) > SAME * speed**2:
                    motions[own.name] = polynomial_of_time([float(motion(0.0)), rate])
            if motions != dict(given):
                joint = replace(joint, motions=motions)
        joints.append(joint)
    if all(one is other for one, other in zip(joints, system.joints, strict=True)):
        return system
    return replace(system, joints=joints)
