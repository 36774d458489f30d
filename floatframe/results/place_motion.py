"""What is measured on a motion: place, velocity and acceleration of an interface or point, angles, stress.

With rho = c + Psi_t q (and the part of second order of a stiffened body), all in body axes, and R = R_GB:

    position      r + R rho                         acceleration  v_dot + R (alpha × rho + omega × (omega × rho)
    velocity      v + R (omega × rho + rho_dot)                          + 2 omega × rho_dot + rho_ddot)
"""

from dataclasses import dataclass

import numpy as np

from cms.reduced_body.reduced_body import ReducedBody
from cms.reduced_body.stress import von_mises
from fe_models.foundation.arrays import Array, IntArray
from floatframe.compiling.stiffening import interface_deformation, interface_deformation_rates
from floatframe.errors import ResultsError
from floatframe.results.recovery import require_same_modes
from floatframe.results.trajectory import BodyMotion, Trajectory
from floatframe.rotations import right_jacobian, rotation_exp, rotation_matrix

__all__ = [
    "PlaceMotion",
    "interface_motion",
    "largest_von_mises",
    "nodal_stress",
    "node_motion",
    "point_motion",
    "rotation_angle",
    "stress_modes",
]


@dataclass(frozen=True, eq=False)
class PlaceMotion:
    """Motion of a point with axes, over time, ground axes."""

    t: Array  #: (n_t,) [s]
    position: Array  #: (n_t, 3) [m]
    velocity: Array  #: (n_t, 3) [m/s]
    acceleration: Array  #: (n_t, 3) [m/s²]
    axes: Array  #: columns, (n_t, 3, 3)
    omega: Array  #: angular velocity of the axes, (n_t, 3) [rad/s]
    alpha: Array | None = None  #: their angular acceleration, (n_t, 3) [rad/s²]; None: they do not turn


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
    triples = list(zip(d[:, 3:], d_dot[:, 3:], d_ddot[:, 3:], strict=True))
    turned = np.array([rotation_exp(theta) for theta, _, _ in triples])
    spin = np.array([spin_of(theta, rate) for theta, rate, _ in triples])
    spin_dot = np.array([spin_rate_of(*three) for three in triples])
    rho = place.position + d[:, :3]
    return _moved(motion, rho, d_dot[:, :3], d_ddot[:, :3], turned @ place.triad, spin, spin_dot)


def node_motion(trajectory: Trajectory, body: str, reduced: ReducedBody, node: int) -> PlaceMotion:
    """Return the motion of a kept node (its index in `ReducedBody.nodes`), with the axes of the body frame.

    Raises
    ------
    ResultsError
        If there is no such body or node, or the reduced body is another one.
    """
    require_same_modes(trajectory, body, reduced)
    if not 0 <= node < len(reduced.nodes):
        raise ResultsError(f"body {body!r}: node: expected 0 to {len(reduced.nodes) - 1}, got {node}")
    motion, shape = trajectory.body(body), reduced.Phi[node]
    n_t, zero = len(motion.t), np.zeros((len(motion.t), 3))
    local = reduced.nodes[node] + motion.q @ shape.T
    axes = np.broadcast_to(np.eye(3), (n_t, 3, 3))
    return _moved(motion, local, motion.q_dot @ shape.T, motion.q_ddot @ shape.T, axes, zero, zero)


def spin_of(theta: Array, rate: Array) -> Array:
    """Return the angular velocity of exp(theta) as seen from the body, (3,)."""
    return np.asarray(right_jacobian(theta).T @ rate)


def spin_rate_of(theta: Array, rate: Array, rate2: Array) -> Array:
    """Return the rate of `spin_of`, (3,): its change along the rate by a central difference, and by the second rate."""
    size = float(np.linalg.norm(rate))
    result = spin_of(theta, rate2)
    if size > 0:
        s = 1e-5 / size
        result = result + (spin_of(theta + s * rate, rate) - spin_of(theta - s * rate, rate)) / (2 * s)
    return np.asarray(result)


def point_motion(trajectory: Trajectory, body: str, point: Array | tuple[float, float, float]) -> PlaceMotion:
    """Return the motion of a point that is fixed in the frame of a body, with the axes of the frame."""
    motion = trajectory.body(body)
    n_t = len(motion.t)
    rho = np.broadcast_to(np.asarray(point, dtype=float), (n_t, 3))
    zero = np.zeros((n_t, 3))
    return _moved(motion, rho, zero, zero, np.broadcast_to(np.eye(3), (n_t, 3, 3)), zero, zero)


def _moved(
    motion: BodyMotion, rho: Array, rho_dot: Array, rho_ddot: Array, axes: Array, spin: Array, spin_dot: Array
) -> PlaceMotion:
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
        alpha=in_ground(alpha + np.cross(omega, spin) + spin_dot),
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
    return np.asarray(stress_modes(body, reduced) @ trajectory.body(body).q[i_time])


def largest_von_mises(trajectory: Trajectory, body: str, reduced: ReducedBody) -> tuple[Array, IntArray]:
    """Return the largest von Mises stress of the kept nodes over time, (n_t,) [Pa], and where it is, (n_t,) index."""
    require_same_modes(trajectory, body, reduced)
    modes, q = stress_modes(body, reduced), trajectory.body(body).q
    largest, where = np.zeros(len(q)), np.zeros(len(q), np.int64)
    for k, row in enumerate(q):
        stress = von_mises(modes @ row)
        where[k] = int(np.argmax(stress))
        largest[k] = stress[where[k]]
    return largest, where


def stress_modes(body: str, reduced: ReducedBody) -> Array:
    """Return the stress modes of a body, (n_kept, 6, n_q); `ResultsError` if its file holds none."""
    if reduced.stress is None:
        raise ResultsError(
            f"body {body!r}: its modal file holds no stress modes; reduce it again with stress (and from a mesh, since "
            "bare matrices know no stress)"
        )
    return reduced.stress
