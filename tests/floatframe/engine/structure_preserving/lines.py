"""A free beam with a block that slides along it: momenta are kept."""

import numpy as np

import cms
import fe_models
from floatframe import FlexibleBody, Marker, RigidBody, SpringDamper, System
from floatframe.joints import SlidingJoint
from floatframe.model.functions.time_functions import polynomial_of_time

__all__ = ["SLIDING", "sliding"]

STATIONS = {f"s{k}": 0.25 * k for k in range(5)}


def soft_beam(*, geometric: bool = False):
    """Return a beam of 1 m whose first mode has a period of 0.2 s."""
    line = fe_models.beams.BeamLine(1.0, 1.0, 1e4, 2.0, 2.0, 0.05, rho_Iy=5e-3, rho_Iz=5e-3)
    return cms.reduction.beam_from_assumed_modes(
        line, name="beam", units=cms.unit_system("m-kg-s"), stations=STATIONS, n_axial=0, n_bending=2, n_torsion=1,
        geometric=geometric,
    )  # fmt: skip


def sliding(*, is_aligned=False, is_driven=False, geometric=False, speed=1.5):
    """Return a beam that flies and spins and a block that slides along it, with a spring between both."""
    omega = np.array([0.4, 1.0, 3.0])
    body = FlexibleBody("beam", soft_beam(geometric=geometric), velocity=(0.3, 0.1, -0.2), omega_B=omega)
    place = np.array([0.4, 0.0, 0.0])
    velocity = np.array([0.3, 0.1, -0.2]) + np.cross(omega, place) + np.array([speed, 0, 0])
    block = RigidBody("block", 0.3, np.diag([2e-3, 3e-3, 2.5e-3]), position=place, velocity=velocity,
                      omega_B=omega)  # fmt: skip
    motions = {"distance": polynomial_of_time([0.4, speed, -2.0])} if is_driven else {}
    joint = SlidingJoint("joint", Marker("beam", "s0"), Marker("block"), line=tuple(STATIONS)[1:],
                         is_aligned=is_aligned, motions=motions)  # fmt: skip
    spring = SpringDamper("stay", Marker("beam", "s4"), Marker("block", position=(0, 0.1, 0.1)), 20.0)
    return System([body, block], [joint], [spring], cms.unit_system("m-kg-s"))


SLIDING = {
    "point on a line": sliding,
    "body on a line": lambda: sliding(is_aligned=True),
    "body on a line that bends its interfaces": lambda: sliding(is_aligned=True, geometric=True),
    "driven point on a line": lambda: sliding(is_driven=True),
    "driven body on a line": lambda: sliding(is_aligned=True, is_driven=True),
}
