"""A stiffened body in mean axes, and the transformation to the frame of its file (docs/theory.md §7).

The engine computes the motion of a stiffened body in its mean axes B' for any frame B of its file. The strain of a
body does not depend on the frame, so the modal coordinates of both frames are related by a constant matrix, q = Z q'.
In addition, the rotation vector of B in B' and the position of one point c_p of B are needed, both to second order:

    R = R' exp(theta),  r + R c_p = r' + R' rho,  (rho, theta) = (rho_0, 0) + Psi q' - 1/2 q'ᵀ K q'

These are the kinematics of a marker (`floatframe.model.bodies.marker_shape`). Its Psi and K follow from the definition
of mean axes, written in B (with c̄ = c - S/m and the rotation vector Theta = -theta of B' in B):

(1) the origin of B' is the centre of mass:        m r' = m r + R s(q),  s = S + 1C q + 1/2 qᵀ K_t q
(2) the deformation does not rotate B':            ax(exp(-Theta) A(q)) = 0,  A = ∫ (c + u) c̄ᵀ
(3) first order, with R̄ = ∫ c̄ c̄ᵀ:                 (tr R̄ 1 - R̄) Theta_1 = ax(U_1),  U_1 = ∫ phi q c̄ᵀ
(4) second order:                                  (tr R̄ 1 - R̄) Theta_2 = ax(U_2 - Theta_1~ U_1 + 1/2 Theta_1~² R̄)
    ax(U_2) = 1/2 qᵀ (K_r - S/m × K_t) q: the work of the unit loads of rotation and translation

Here ax(U) = Σ o × f for U = Σ f oᵀ. The two transformations are inverse to each other within rounding. c_p is the
interface to which a nodal frame is attached; its marker then does not move in B, as the engine requires.
"""

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.reduction.basis.frames import TisserandFrame
from cms.reduction.frame_conversion import converted
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.model.bodies.marker_shape import BodyFrameMotion, MarkerShape, marker_motion, motion_in_body
from floatframe.model.rotations import (
    cross,
    euler_parameter_product,
    euler_parameters_of_rotation_vector,
    rotated,
    rotation_matrix,
    tilde,
)

__all__ = ["FrameMotion", "MeanAxes", "mean_axes"]

#: permutation symbol, (a × b)_i = EPSILON_ijk a_j b_k, (3, 3, 3)
EPSILON = np.cross(np.eye(3)[:, None], np.eye(3)[None])
_made: WeakKeyDictionary[ReducedBody, "MeanAxes | None"] = WeakKeyDictionary()


@presented
@dataclass(frozen=True, eq=False)
class FrameMotion:
    """Motion of a body frame and its modal coordinates; arrays may have any number of time dimensions."""

    r: Array  #: position of the origin, ground axes, (..., 3) [m]
    p: Array  #: Euler parameters of the frame, (..., 4)
    q: Array  #: modal coordinates, (..., n_q)
    v: Array  #: velocity of the origin, ground axes, (..., 3) [m/s]
    omega: Array  #: angular velocity, axes of the frame, (..., 3) [rad/s]
    q_dot: Array  #: rates of the modal coordinates, (..., n_q)
    v_dot: Array  #: acceleration of the origin, ground axes, (..., 3) [m/s²]
    omega_dot: Array  #: angular acceleration, axes of the frame, (..., 3) [rad/s²]
    q_ddot: Array  #: second rates of the modal coordinates, (..., n_q)

    @property
    def of_frame(self) -> BodyFrameMotion:
        """The motion of the frame without the modal coordinates."""
        return BodyFrameMotion(self.r, rotation_matrix(self.p), self.v, self.omega, self.v_dot, self.omega_dot)


@presented
@dataclass(frozen=True, eq=False)
class MeanAxes:
    """A stiffened body in mean axes, with the transformations to and from the frame of its file."""

    reduced: ReducedBody  #: the body in mean axes B', which are parallel to the file's axes in the undeformed body
    Z: Array  #: transformation of modal coordinates, q = Z q', (n_q, n_q)
    frame: MarkerShape  #: the point c_p with the axes of B, as a marker in B'
    point: Array  #: position of c_p in B, (3,) [m]

    @cached_property
    def inverse(self) -> Array:
        """Inverse of Z, (n_q, n_q), from file to mean-axis coordinates."""
        return np.asarray(np.linalg.inv(self.Z))

    def to_file(self, motion: FrameMotion) -> FrameMotion:
        """Convert a motion in mean axes to the frame of the file."""
        q = motion.q
        own = motion_in_body(self.frame, q, motion.q_dot, motion.q_ddot)
        at = marker_motion(motion.of_frame, own)
        back = np.swapaxes(at.axes, -1, -2)
        omega, omega_dot, c = rotated(back, at.omega), rotated(back, at.alpha), self.point
        theta = self.frame.deformation(q)[..., 3:]
        return FrameMotion(
            r=at.position - at.axes @ c,
            p=euler_parameter_product(motion.p, euler_parameters_of_rotation_vector(theta)),
            q=q @ self.Z.T,
            v=at.velocity - rotated(at.axes, cross(omega, c)),
            omega=omega,
            q_dot=motion.q_dot @ self.Z.T,
            v_dot=at.acceleration - rotated(at.axes, cross(omega_dot, c) + cross(omega, cross(omega, c))),
            omega_dot=omega_dot,
            q_ddot=motion.q_ddot @ self.Z.T,
        )

    def to_mean(self, motion: FrameMotion) -> FrameMotion:
        """Convert a motion in the frame of the file to mean axes."""
        q, q_dot, q_ddot = (x @ self.inverse.T for x in (motion.q, motion.q_dot, motion.q_ddot))
        own = motion_in_body(self.frame, q, q_dot, q_ddot)
        at = marker_motion(motion.of_frame, motion_in_body(MarkerShape(self.point, np.eye(3)), q, q_dot, q_ddot))
        R = at.axes @ np.swapaxes(own.axes, -1, -2)
        back = np.swapaxes(R, -1, -2)
        omega = rotated(back, at.omega) - own.spin
        omega_dot = rotated(back, at.alpha) - cross(omega, own.spin) - own.spin_dot
        theta = self.frame.deformation(q)[..., 3:]
        swing = cross(omega_dot, own.rho) + cross(omega, cross(omega, own.rho))
        return FrameMotion(
            r=at.position - rotated(R, own.rho),
            p=euler_parameter_product(motion.p, euler_parameters_of_rotation_vector(-theta)),
            q=q,
            v=at.velocity - rotated(R, cross(omega, own.rho) + own.rho_dot),
            omega=omega,
            q_dot=q_dot,
            v_dot=at.acceleration - rotated(R, swing + 2 * cross(omega, own.rho_dot) + own.rho_ddot),
            omega_dot=omega_dot,
            q_ddot=q_ddot,
        )

    def small_motions(self, q: Array) -> Array:
        """Return the matrix from small motions in mean axes to the file frame, (6 + n_q, 6 + n_q), at q', (n_q,).

        Both consist of translation and rotation of the frame in its own axes, and of modal coordinates.
        """
        n = self.reduced.n_q
        back = self.frame.pose(q)[1].T
        T = np.zeros((6 + n, 6 + n))
        T[:6] = np.kron(np.eye(2), back) @ self.frame.jacobian(q)
        T[:3] += tilde(self.point) @ T[3:6]  # minus phi × c_p
        T[6:, 6:] = self.Z
        return T


def mean_axes(reduced: ReducedBody) -> MeanAxes | None:
    """Return a body with geometric stiffness in mean axes; None if its file is already in mean axes.

    Bodies with the same `ReducedBody` share the result.

    Raises
    ------
    BodyError
        If the body has no inertia about some axis, or a rigid-body motion is among its mode shapes.
    """
    if reduced not in _made:
        _made[reduced] = None if reduced.frame.kind == "tisserand" or reduced.n_q == 0 else made_mean_axes(reduced)
    return _made[reduced]


def made_mean_axes(reduced: ReducedBody) -> MeanAxes:
    """Return a reduced body in mean axes, and its file frame's motion in these axes, by steps (1) to (4)."""
    x, y, z = ((float(a), float(b), float(c)) for a, b, c in reduced.frame.axes.T)
    mean, change = converted(reduced, TisserandFrame(axes=(x, y, z)))
    at = reduced.frame.at
    point = np.array(reduced.interface(at).position) if at else np.zeros(3)
    turn = tuple(-form for form in turn_of_mean_axes(reduced))  # rotation vector of B in B', the inverse rotation
    rho = place_of_point(reduced, point, *turn)
    Psi, second = (np.concatenate(parts) for parts in zip(rho, turn, strict=True))
    Z = change.Z
    bend = -np.einsum("lk,alm,mn->akn", Z, second, Z, optimize=True)
    arm = point - reduced.moments.center_of_mass
    return MeanAxes(mean, Z, MarkerShape(arm, np.eye(3), Psi @ Z, bend), point)


def turn_of_mean_axes(reduced: ReducedBody) -> tuple[Array, Array]:
    """Return the rotation vector of the mean axes relative to the body frame, theta = A q + ½ qᵀ C q.

    The coefficients are A, (3, n_q), and C, (3, n_q, n_q).
    """
    moments, geometric = reduced.moments, reduced.geometric
    assert geometric is not None
    c_0 = moments.center_of_mass
    R_bar = moments.R - moments.m * np.outer(c_0, c_0)
    inertia = np.trace(R_bar) * np.eye(3) - R_bar
    U_1 = np.swapaxes(moments.P, 0, 1) - np.einsum("ak,b->abk", moments.C1, c_0)  # ∫ phi_a c̄_b
    linear = np.linalg.solve(inertia, axial(U_1))  # (3)
    turns = np.einsum("acb,ck->abk", EPSILON, linear)  # (Theta_1)~
    U_2 = geometric.rotation - np.einsum("abc,b,ckl->akl", EPSILON, c_0, geometric.translation)
    back = both_orders(axial(np.einsum("abk,bcl->ackl", turns, U_1)))
    bend = both_orders(axial(np.einsum("abk,bcl,cd->adkl", turns, turns, R_bar, optimize=True)))
    moment = U_2 - back + bend / 2
    return linear, np.linalg.solve(inertia, moment.reshape(3, -1)).reshape(moment.shape)  # (4)


def place_of_point(reduced: ReducedBody, point: Array, linear: Array, second: Array) -> tuple[Array, Array]:
    """Return, by step (1), the position exp(theta) (c_p - s(q)/m) of a point of B in mean axes, to second order.

    The rotation vector theta of B in the mean axes is the negative of `turn_of_mean_axes`.
    """
    moments, geometric = reduced.moments, reduced.geometric
    assert geometric is not None
    arm, off = point - moments.center_of_mass, -moments.C1 / moments.m
    turns = np.einsum("acb,ck->abk", EPSILON, linear)  # (theta_1)~
    bent = np.einsum("abc,bkl,c->akl", EPSILON, second, arm) - geometric.translation / moments.m
    bent = bent + both_orders(np.einsum("abk,bcl,c->akl", turns, turns, arm, optimize=True)) / 2
    bent = bent + both_orders(np.einsum("abk,bl->akl", turns, off))
    return np.einsum("abk,b->ak", turns, arm) + off, bent


def axial(V: Array) -> Array:
    """Return Σ o × f for V = Σ f oᵀ; (3, ...) from (3, 3, ...)."""
    return np.asarray(np.einsum("abc,cb...->a...", EPSILON, V))


def both_orders(form: Array) -> Array:
    """Return the sum of a form (..., k, l) and its transpose in the last two axes."""
    return np.asarray(form + np.swapaxes(form, -1, -2))
