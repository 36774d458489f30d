"""What is measured on a motion: place, velocity and acceleration of an interface or point, angles, stress.

With rho = c + Psi_t q (and the part of second order of a stiffened body), all in body axes, and R = R_GB:

    position      r + R rho                         acceleration  v_dot + R (alpha × rho + omega × (omega × rho)
    velocity      v + R (omega × rho + rho_dot)                          + 2 omega × rho_dot + rho_ddot)
"""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, IntArray
from cms.reduced_body import ReducedBody
from cms.stress_modes import von_mises
from floatframe.errors import ResultsError
from floatframe.recovery import require_same_modes
from floatframe.rotations import right_jacobian, rotation_exp, rotation_matrix
from floatframe.stiffening import interface_deformation, interface_deformation_rates
from floatframe.trajectory import BodyMotion, Trajectory

__all__ = ["PlaceMotion", "interface_motion", "largest_von_mises", "nodal_stress", "point_motion", "rotation_angle"]


@dataclass(frozen=True, eq=False)
class PlaceMotion:
    """Motion of a point with axes, over time, ground axes."""

    t: Array  #: (n_t,) [s]
    position: Array  #: (n_t, 3) [m]
    velocity: Array  #: (n_t, 3) [m/s]
    acceleration: Array  #: (n_t, 3) [m/s²]
    axes: Array  #: columns, (n_t, 3, 3)
    omega: Array  #: angular velocity, (n_t, 3) [rad/s]


def interface_motion(trajectory: Trajectory, body: str, reduced: ReducedBody, interface: str) -> PlaceMotion:
    """Return the motion of the reference point of an interface, with its axes.

    Raises
    ------
    ResultsError
        If there is no such body, or the reduced body is another one.
    BodyError
        If there is no such interface.
    """
    require_same_modes(trajectory, body, reduced)
    place = reduced.interface(interface)
    motion = trajectory.body(body)
    is_stiffened = trajectory.entry(body)[1].is_stiffened
    d = interface_deformation(reduced, interface, motion.q, is_stiffened=is_stiffened)
    d_dot, d_ddot = interface_deformation_rates(
        reduced, interface, motion.q, motion.q_dot, motion.q_ddot, is_stiffened=is_stiffened
    )
    turned = np.array([rotation_exp(theta) for theta in d[:, 3:]])
    spin = np.einsum("tba,tb->ta", np.array([right_jacobian(theta) for theta in d[:, 3:]]), d_dot[:, 3:])
    return _moved(motion, place.position + d[:, :3], d_dot[:, :3], d_ddot[:, :3], turned @ place.triad, spin)


def point_motion(trajectory: Trajectory, body: str, point: Array | tuple[float, float, float]) -> PlaceMotion:
    """Return the motion of a point that is fixed in the frame of a body, with the axes of the frame."""
    motion = trajectory.body(body)
    n_t = len(motion.t)
    rho = np.broadcast_to(np.asarray(point, dtype=float), (n_t, 3))
    zero = np.zeros((n_t, 3))
    return _moved(motion, rho, zero, zero, np.broadcast_to(np.eye(3), (n_t, 3, 3)), zero)


def _moved(motion: BodyMotion, rho: Array, rho_dot: Array, rho_ddot: Array, axes: Array, spin: Array) -> PlaceMotion:
    R = np.array([rotation_matrix(p) for p in motion.p]).reshape(-1, 3, 3)
    omega, alpha = motion.omega_B, motion.omega_B_dot
    arm = np.cross(omega, rho)
    relative = np.cross(alpha, rho) + np.cross(omega, arm) + 2 * np.cross(omega, rho_dot) + rho_ddot

    def in_ground(values: Array) -> Array:
        return np.asarray(np.einsum("tab,tb->ta", R, values))

    return PlaceMotion(
        motion.t,
        position=motion.r + in_ground(rho),
        velocity=motion.v + in_ground(arm + rho_dot),
        acceleration=motion.v_dot + in_ground(relative),
        axes=R @ axes,
        omega=in_ground(omega + spin),
    )


def rotation_angle(a: PlaceMotion, b: PlaceMotion, axis: Array | tuple[float, float, float]) -> Array:
    """Return the angle by which place b has turned against place a about an axis in a, (n_t,) [rad].

    Zero is where the axes of both agree; the angle is followed through full turns from one time to the next.
    """
    e = np.asarray(axis, dtype=float)
    size = np.linalg.norm(e)
    if size == 0:
        raise ResultsError("rotation_angle: axis: expected a direction, got the zero vector")
    e = e / size
    relative = np.einsum("tba,tbc->tac", a.axes, b.axes)  # R_AB
    helper = np.eye(3)[int(np.argmin(np.abs(e)))]
    x = np.cross(e, helper)
    x /= np.linalg.norm(x)
    y = np.cross(e, x)
    turned = relative @ x
    return np.asarray(np.unwrap(np.arctan2(turned @ y, turned @ x)))


def nodal_stress(trajectory: Trajectory, body: str, reduced: ReducedBody, i_time: int) -> Array:
    """Return the stress at the kept nodes at an output time, axes of B, (n_kept, 6) [Pa]: xx yy zz yz xz xy.

    All modes count, static ones included: interface loads are carried exactly where the mode set is statically
    complete.

    Raises
    ------
    ResultsError
        If the modal file holds no stress modes, or the reduced body is another one.
    """
    require_same_modes(trajectory, body, reduced)
    return np.asarray(_stress_modes(body, reduced) @ trajectory.body(body).q[i_time])


def largest_von_mises(trajectory: Trajectory, body: str, reduced: ReducedBody) -> tuple[Array, IntArray]:
    """Return the largest von Mises stress of the kept nodes over time, (n_t,) [Pa], and where it is, (n_t,) index."""
    require_same_modes(trajectory, body, reduced)
    modes, q = _stress_modes(body, reduced), trajectory.body(body).q
    largest, where = np.zeros(len(q)), np.zeros(len(q), np.int64)
    for k, row in enumerate(q):
        stress = von_mises(modes @ row)
        where[k] = int(np.argmax(stress))
        largest[k] = stress[where[k]]
    return largest, where


def _stress_modes(body: str, reduced: ReducedBody) -> Array:
    if reduced.stress is None:
        raise ResultsError(
            f"body {body!r}: its modal file holds no stress modes; reduce it again with stress (and from a mesh, since "
            "bare matrices know no stress)"
        )
    return reduced.stress
