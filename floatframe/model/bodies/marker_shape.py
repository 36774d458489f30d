"""A marker relative to its body: undeformed position, motion due to the modes, and motion with the body.

q are the modal coordinates. K_P is the second-order part for a stiffened body (docs/theory.md §7). In body axes:

    Psi(q) = Psi - K_P q                      derivative of displacement and rotation vector by q, (6, n)
    (d, theta) = 1/2 (Psi + Psi(q)) q         rho = c + d,  axes = exp(theta) triad
    rates      Psi(q) q_dot                   second rates  Psi(q) q_ddot - (K_P q_dot) q_dot
    spin       nu = L(theta) theta_dot        L the left Jacobian of the rotation vector, nu_dot as in rotations.py

With position r, matrix R = R_GB and velocities v (ground axes), omega (body axes) of the body:

    position      r + R rho                         acceleration   v_dot + R (alpha × rho + omega × (omega × rho)
    velocity      v + R (omega × rho + rho_dot)                    + 2 omega × rho_dot + rho_ddot)
    axes          R exp(theta) triad                angular velocity  R (omega + nu)
    angular acceleration  R (alpha + omega × nu + nu_dot)

Arrays may be stacks, with vectors along the last axis. Functions of q alone also accept complex q. The time loop uses
the same formulas compiled, in kernels/marker.py; a test compares both.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.reduction.basis.node_results import are_spread
from fe_models.body.couplings.couplings import mean_motion
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.records import frozen_copies
from floatframe.model.rotations import cross, left_jacobian, rotated, rotation_exp, spin_rate, tilde

__all__ = [
    "BodyFrameMotion",
    "MarkerMotion",
    "MarkerShape",
    "MotionInBody",
    "bending_of",
    "interface_shape",
    "is_turning",
    "marker_motion",
    "motion_in_body",
    "node_shape",
]


@frozen_copies
@dataclass(frozen=True, eq=False)
class MarkerShape:
    """A marker relative to its body: position, axes and shape functions."""

    position: Array  #: position on the undeformed body, body frame, (3,)
    triad: Array  #: axes on the undeformed body as columns, body frame, (3, 3)
    #: displacement and rotation for unit modes, undeformed, (6, n); None: the marker does not deform
    psi: Array | None = None
    #: geometric change K_P of the shapes of a stiffened body, symmetric in the modes, (6, n, n); None: zero
    bend: Array | None = None

    def shapes(self, q: Array) -> Array:
        """Return the shapes Psi(q) of the deformed body, (..., 6, n)."""
        if self.psi is None:
            return np.zeros((6, q.shape[-1]))
        return self.psi if self.bend is None else self.psi - bent(self.bend, q)

    def deformation(self, q: Array) -> Array:
        """Return displacement and rotation vector due to the modes, (..., 6)."""
        if self.psi is None:
            return np.zeros((*q.shape[:-1], 6))
        return rotated(self.psi if self.bend is None else self.psi - 0.5 * bent(self.bend, q), q)

    def rates(self, q: Array, q_dot: Array, q_ddot: Array) -> tuple[Array, Array]:
        """Return first and second rates of `deformation`, (..., 6) each."""
        shapes = self.shapes(q)
        second = rotated(shapes, q_ddot)
        if self.bend is not None:
            second = second - rotated(bent(self.bend, q_dot), q_dot)
        return rotated(shapes, q_dot), second

    def pose(self, q: Array) -> tuple[Array, Array]:
        """Return position rho, (..., 3), and axes, (..., 3, 3), in the deformed body."""
        if self.psi is None:
            return self.position, self.triad
        d = self.deformation(q)
        return self.position + d[..., :3], rotation_exp(d[..., 3:]) @ self.triad

    def jacobian(self, q: Array) -> Array:
        """Return the Jacobian of translation and rotation by small motions (dx, dtheta, dq), (6, 6 + n), at q, (n,)."""
        d = self.deformation(q)
        J = np.zeros((6, 6 + len(q)))
        J[:3, :3] = J[3:, 3:6] = np.eye(3)
        J[:3, 3:6] = -tilde(self.position + d[:3])
        if self.psi is not None:
            shapes = self.shapes(q)
            J[:3, 6:] = shapes[:3]
            J[3:, 6:] = left_jacobian(d[3:]) @ shapes[3:]
        return J


def bent(K: Array, x: Array) -> Array:
    """Return the product Σ_l K [a, k, l] x_l, (..., 6, n)."""
    n = K.shape[-1]
    return (x @ K.reshape(6 * n, n).T).reshape(*x.shape[:-1], 6, n)


def bending_of(reduced: ReducedBody, name: str) -> Array:
    """Return K_P of an interface, (6, n_q, n_q); zero if the body has none or excludes loads on this interface."""
    if reduced.geometric is None:
        return np.zeros((6, reduced.n_q, reduced.n_q))
    place = [interface.name for interface in reduced.interfaces].index(name)
    return reduced.geometric.of_interface(place)


def interface_shape(reduced: ReducedBody, name: str, *, is_stiffened: bool) -> MarkerShape:
    """Return the marker at an interface with the interface's axes; `BodyError` if it does not exist."""
    interface = reduced.interface(name)
    bend = bending_of(reduced, name) if is_stiffened else None
    return MarkerShape(interface.position, interface.triad, np.asarray(interface.Psi), bend)


def node_shape(reduced: ReducedBody, nodes: int | IntArray, *, is_stiffened: bool) -> MarkerShape:
    """Return the marker at a kept node, or for the mean motion of several nodes, with the axes of the body frame.

    A single node rotates if its rotation is kept (`ReducedBody.kept`), otherwise it does not rotate (`is_turning`).
    Several nodes rotate by the mean rotation of their translations (an RBE3 with equal weights), or not at all if they
    lie on a line. For a stiffened body with quadratic modes, the displacement is of second order, Phi q + ½ Σ q_k q_l
    g_kl.
    """
    rows = np.atleast_1d(np.asarray(nodes, dtype=np.int64))
    psi = np.concatenate([reduced.Phi[rows].mean(axis=0), rotation_of_nodes(reduced, rows)])
    bend = None
    if is_stiffened and reduced.quadratic is not None:
        second = -reduced.quadratic[rows].mean(axis=0)
        bend = np.concatenate([second, np.zeros((3, reduced.n_q, reduced.n_q))])
    return MarkerShape(reduced.nodes[rows].mean(axis=0), np.eye(3), psi, bend)


def rotation_of_nodes(reduced: ReducedBody, rows: IntArray) -> Array:
    """Return the rotation shapes of a node, or the mean of several nodes, (3, n_q); zero if they are unknown."""
    if not is_turning(reduced, rows):
        return np.zeros((3, reduced.n_q))
    if len(rows) == 1:
        assert reduced.kept is not None
        return np.asarray(reduced.kept.of_node(int(rows[0])))
    points = np.asarray(reduced.nodes[rows])
    A = mean_motion(points, np.full(len(rows), 1.0 / len(rows)), points.mean(axis=0))
    return np.asarray(A[3:] @ np.asarray(reduced.Phi)[rows].reshape(A.shape[1], reduced.n_q))


def is_turning(reduced: ReducedBody, rows: IntArray) -> bool:
    """Return whether a node has kept rotations, or several nodes define a mean rotation."""
    if len(rows) == 1:
        return reduced.kept is not None and reduced.kept.of_node(int(rows[0])) is not None
    return are_spread(np.asarray(reduced.nodes[rows]))


class MotionInBody(NamedTuple):
    """Motion of a marker relative to its body, in body axes."""

    rho: Array  #: position relative to the frame origin, (..., 3)
    rho_dot: Array
    rho_ddot: Array
    axes: Array  #: axes as columns, (..., 3, 3)
    spin: Array  #: angular velocity relative to the body, (..., 3)
    spin_dot: Array


def motion_in_body(shape: MarkerShape, q: Array, q_dot: Array, q_ddot: Array) -> MotionInBody:
    """Return the motion of a marker relative to its body, for stacks (..., n)."""
    rho, axes = shape.pose(q)
    rate, second = shape.rates(q, q_dot, q_ddot)
    zero = np.zeros((*q.shape[:-1], 3))
    if shape.psi is None:
        return MotionInBody(rho + zero, zero, zero, np.broadcast_to(axes, (*q.shape[:-1], 3, 3)), zero, zero)
    theta = shape.deformation(q)[..., 3:]
    spin = rotated(left_jacobian(theta), rate[..., 3:])
    return MotionInBody(
        rho, rate[..., :3], second[..., :3], axes, spin, spin_rate(theta, rate[..., 3:], second[..., 3:])
    )


class BodyFrameMotion(NamedTuple):
    """Motion of a body frame."""

    r: Array  #: position of the frame origin, ground axes, (..., 3)
    R: Array  #: rotation matrix R_GB, (..., 3, 3)
    v: Array  #: velocity of the frame origin, ground axes, (..., 3)
    omega: Array  #: angular velocity, body axes, (..., 3)
    v_dot: Array  #: acceleration of the frame origin, ground axes, (..., 3)
    alpha: Array  #: rate of omega, body axes, (..., 3)


class MarkerMotion(NamedTuple):
    """Motion of a marker in ground axes."""

    position: Array  #: position of the marker, (..., 3)
    velocity: Array
    acceleration: Array
    axes: Array  #: axes as columns, (..., 3, 3)
    omega: Array  #: angular velocity, (..., 3)
    alpha: Array  #: angular acceleration, (..., 3)


def marker_motion(body: BodyFrameMotion, own: MotionInBody) -> MarkerMotion:
    """Return a marker's motion from the motion of its body frame and its motion relative to the body."""
    R, omega, alpha = body.R, body.omega, body.alpha
    arm = cross(omega, own.rho)
    relative = cross(alpha, own.rho) + cross(omega, arm) + 2 * cross(omega, own.rho_dot) + own.rho_ddot
    return MarkerMotion(
        position=body.r + rotated(R, own.rho),
        velocity=body.v + rotated(R, arm + own.rho_dot),
        acceleration=body.v_dot + rotated(R, relative),
        axes=R @ own.axes,
        omega=rotated(R, omega + own.spin),
        alpha=rotated(R, alpha + cross(omega, own.spin) + own.spin_dot),
    )
