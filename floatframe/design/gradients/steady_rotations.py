"""Steady rotations (relative equilibria) differentiated: all bodies turn about one axis, and their shape follows p.

With the velocities u = U(x) and accelerations u_dot = A(x) of a rotation omega about a point c, body by body

    v = omega × (r - c),  omega_B = Rᵀ omega,  v_dot = omega × v,                                   (1)

    (K + C dU/dx + M dA/dx) dx - Jᵀ dw = - dr/dp,    (G_x + G_v dU/dx) dx + V dw = - dg/dp          (2)

Turned about its axis a steady rotation is another one: the matrix has this null vector,
and what is asked for must not depend on it (a distance, a coordinate of a joint, a force in axes that turn). (2) is
solved with the least change; anything else that moves at no cost is refused.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import steady_rotation
from floatframe.design.gradients.parameters import Family, Neighbour
from floatframe.design.gradients.tangents import Point, parameter_residuals, tangents_at
from floatframe.engine.compiling.file_frames import motion_of_engine
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.rows import structure_of
from floatframe.errors import ModelError
from floatframe.model.rotations import tilde

__all__ = ["DEPENDS", "SteadyRotation", "steady_rotation_of"]

SINGULAR = 1e-10  #: of the largest singular value of the scaled matrix: below, a motion costs nothing
MEETS = 1e-6  #: by which the motion at no cost may differ from a turn about the axis
DEPENDS = 1e-6  #: change of an output by a turn of one radian, over its size, from which on it depends on the turn


@dataclass(frozen=True, eq=False)
class SteadyRotation:
    """A steady rotation, its matrix, and the right side of each parameter."""

    point: Point
    group: Configurations
    matrix: Array  #: of (2), (n_u + n_w, n_u + n_w)
    inverse: Array  #: its pseudo-inverse without the turn about the axis
    by_p: Array  #: derivatives of residual and rows by the parameters, (n_u + n_w, n_p)
    of_x: Array  #: d(u, u_dot)/dx, (2 n_u, n_u)
    turn: Array  #: change of (x, w) by a turn about the axis, (n_u + n_w,); zero where the axis does not allow it

    def whole(self, columns: Array) -> Array:
        """Return changes of (x, u, u_dot, w) of those of (x, w), (3 n_u + n_w, k)."""
        n = self.group.n_v
        return np.vstack([columns[:n], self.of_x @ columns[:n], columns[n:]])

    def columns(self) -> Array:
        """Return d(x, w)/dp, (n_u + n_w, n_p)."""
        return np.asarray(-self.inverse @ self.by_p)

    def adjoint(self, slopes: Array) -> Array:
        """Return the gradient of outputs with slopes by (x, u, u_dot, w), (n_out, 3 n_u + n_w): (n_out, n_p)."""
        n = self.group.n_v
        by_x = slopes[:, :n] + slopes[:, n : 3 * n] @ self.of_x
        return np.asarray(-(np.hstack([by_x, slopes[:, 3 * n :]]) @ self.inverse) @ self.by_p)


def steady_rotation_of(family: Family, own: Neighbour, omega: Array, center: Array) -> SteadyRotation:
    """Return the steady rotation of a system with what its derivatives need.

    Raises
    ------
    ModelError
        If something else than the turn about the axis costs nothing.
    ConvergenceError
        If there is no such motion.
    """
    found = steady_rotation(family.system, omega, center=center, tolerance=1e-12)
    state, u_dot = motion_of_engine(own.compiled, found.state, found.u_dot)
    point, model = Point(0.0, state, u_dot, found.w), own.compiled.model
    group, structure = Configurations(np.array(model.bodies.n_q)), structure_of(model)
    at = tangents_at(structure, model, own.work, point)
    n = group.n_v
    U, A, turned = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    spin = tilde(omega)
    for i, (_, j, _) in enumerate(group.parts()):
        R = point.R[i]
        U[j : j + 3, j : j + 3], A[j : j + 3, j : j + 3] = spin, spin @ spin  # of (1)
        U[j + 3 : j + 6, j + 3 : j + 6] = tilde(R.T @ omega)  # d(Rᵀ omega) = (Rᵀ omega) × dtheta
        turned[j : j + 3] = np.cross(omega, state.r[i] - center)
        turned[j + 3 : j + 6] = R.T @ omega
    matrix = np.block([[at.K + at.C @ U + at.M @ A, -at.J.T], [at.G_x + at.G_v @ U, at.V]])
    inverse, turn = without_turn(matrix, turned / np.linalg.norm(omega), family.system.name)
    by_p = parameter_residuals(family.parameters, [point])[0]
    return SteadyRotation(point, group, matrix, inverse, by_p, np.vstack([U, A]), turn)


def without_turn(matrix: Array, turned: Array, name: str) -> tuple[Array, Array]:
    """Return the pseudo-inverse of a matrix that a turn about the axis leaves alone, and that turn of (x, w)."""
    rows, columns = np.ones(len(matrix)), np.ones(len(matrix))
    scaled = matrix.copy()
    tiny = np.finfo(float).tiny
    for _ in range(5):  # rows and columns of one size, so that units do not decide
        r = 1 / np.sqrt(np.maximum(np.abs(scaled).max(axis=1), tiny))
        scaled, rows = r[:, None] * scaled, rows * r
        c = 1 / np.sqrt(np.maximum(np.abs(scaled).max(axis=0), tiny))
        scaled, columns = scaled * c, columns * c
    left, sizes, right = la.svd(scaled)
    n_free = int((sizes <= SINGULAR * sizes[0]).sum())
    keep = slice(None, len(sizes) - n_free)
    inverse = columns[:, None] * (right[keep].T @ (left[:, keep].T / sizes[keep, None])) * rows
    if n_free == 0:
        return inverse, np.zeros(len(matrix))
    turn = columns * right[-1]
    own = turn[: len(turned)]
    factor = float(turned @ own) / float(own @ own) if own.any() else 0.0
    if n_free > 1 or np.abs(factor * own - turned).max() > MEETS * np.abs(turned).max():
        raise ModelError(
            f"sensitivities: system {name!r}: its steady rotation is one of many (something besides the turn about its "
            "axis moves at no cost), and has no derivative; hold it by a spring or a joint"
        )
    return inverse, factor * turn
