"""Derivatives of eigenvalues at the equilibrium, including the change of the equilibrium.

Small motions exp(lambda t) of the whole system, wrenches included, obey P(lambda) phi = 0 with

    P = [lambda² M + lambda C + K   -Jᵀ]        dlambda = - (psiᴴ P' phi)/(psiᴴ P_lambda phi)
        [lambda G_v + G_x            V ]

psi, phi the left and right null vectors, P_lambda the derivative by lambda and P' the derivative of the matrices by p
along (x(p), w(p), p), by differences of fourth order. For an eigenvalue of multiplicity m, psi and phi have m columns,
and the derivatives of its m branches are the eigenvalues of - (psiᴴ P_lambda phi)⁻¹ psiᴴ P' phi.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import steady_rotation
from floatframe.design.gradients.outputs import moved
from floatframe.design.gradients.parameters import Family, Neighbour, Parameter
from floatframe.design.gradients.tangents import Point, PointTangents, parameter_residuals, tangents_at
from floatframe.engine.compiling.file_frames import motion_of_engine
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.newton_equations import balanced_scales
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.rows import structure_of
from floatframe.errors import ModelError
from floatframe.model.rotations import tilde

__all__ = [
    "DEPENDS",
    "Branch",
    "SteadyRotation",
    "eigenvalue_derivatives",
    "equilibrium_adjoint",
    "equilibrium_columns",
    "equilibrium_matrix",
    "pencil_rates",
    "steady_rotation_of",
]


# equilibria at rest differentiated: the equations of balance, whose solution they are, once more ----------------------
# [K  -Jᵀ] [dx]     [dr/dp]
# [G   V ] [dw] = - [dg/dp]        one right-hand side per parameter (direct), or the transpose per output (adjoint)


SINGULAR_EQUILIBRIUM = 1e-12  #: smallest singular value of the scaled matrix, below which the equilibrium is not unique


@dataclass(frozen=True, eq=False)
class Balance:
    """The matrix [K, -Jᵀ; G, V] with scaled rows and columns, independent of units and system size."""

    scaled: Array  #: scaled matrix, of_rows[:, None] * matrix * of_columns
    of_columns: Array
    of_rows: Array

    def solve(self, right: Array) -> Array:
        """Return the solutions of matrix @ x = right for columns `right`."""
        return np.asarray(self.of_columns[:, None] * la.solve(self.scaled, self.of_rows[:, None] * right))

    def solve_transposed(self, right: Array) -> Array:
        """Return the solutions of matrix.T @ x = right for columns `right`."""
        return np.asarray(self.of_rows[:, None] * la.solve(self.scaled.T, self.of_columns[:, None] * right))


def balance_of(K: NDArray[Any], J: Array, G: NDArray[Any], V: Array, displacements: Array) -> Balance:
    """Return the scaled matrix; displacements, (n_u,): typical sizes that scale K to one."""
    work = np.abs(K * displacements[:, None] * displacements).max(initial=0.0)
    diagonal = (work if work > 0 else 1.0) / displacements**2
    of_columns, of_rows = balanced_scales(diagonal, np.abs(J), np.abs(G), np.abs(V))
    return Balance(of_rows[:, None] * np.block([[K, -J.T], [G, V]]) * of_columns, of_columns, of_rows)


def typical_displacements(compiled: CompiledSystem) -> Array:
    """Return displacements, (n_u,), that move a system by about its size: its length, a radian, and modes alike."""
    return np.asarray(compiled.length / compiled.motion_lengths)


def equilibrium_matrix(at: PointTangents, compiled: CompiledSystem, name: str) -> Balance:
    """Return the matrix of the balance of forces and constraints.

    Raises
    ------
    ModelError
        If a motion meets no resistance, so that the equilibrium is not unique.
    """
    balance = balance_of(at.K, at.J, at.G_x, at.V, typical_displacements(compiled))
    values = la.svdvals(balance.scaled)
    if values[-1] <= SINGULAR_EQUILIBRIUM * values[0]:
        raise ModelError(
            f"sensitivities: system {name!r}: its equilibrium is not unique (a motion meets no resistance) and has "
            "no derivative; hold it by a spring or a joint"
        )
    return balance


def equilibrium_columns(balance: Balance, by_p: Array) -> Array:
    """Return d(x, w)/dp, (n_u + n_w, n_p)."""
    return balance.solve(-by_p)


def equilibrium_adjoint(balance: Balance, slopes: Array, by_p: Array) -> Array:
    """Return the gradient of outputs with derivatives `slopes` by (x, w), (n_out, n_u + n_w): (n_out, n_p)."""
    return np.asarray(-balance.solve_transposed(slopes.T).T @ by_p)


# steady rotations -----------------------------------------------------------------------------------------------------
# Derivatives of steady rotations (relative equilibria): all bodies rotate about one axis, in a shape that depends on p.
#
# With the velocities u = U(x) and accelerations u_dot = A(x) of a rotation omega about a point c, body by body
#
#     v = omega × (r - c),  omega_B = Rᵀ omega,  v_dot = omega × v,                                   (1)
#
#     (K + C dU/dx + M dA/dx) dx - Jᵀ dw = - dr/dp,    (G_x + G_v dU/dx) dx + V dw = - dg/dp          (2)
#
# A steady rotation stays one when it is rotated about its axis. The matrix has this null vector, and outputs must not
# depend on it (a distance, a joint coordinate, a force in rotating axes do not). (2) is solved with the smallest norm;
# any other motion without resistance is refused.


#: smallest singular value, relative to the largest one of the scaled matrix, of a motion with resistance
SINGULAR = 1e-10
MEETS = 1e-6  #: largest difference between the motion without resistance and a rotation about the axis
#: smallest relative change of an output, per radian of rotation about the axis, that counts as dependence
DEPENDS = 1e-6


@dataclass(frozen=True, eq=False)
class SteadyRotation:
    """A steady rotation, its matrix, and the right-hand side for each parameter."""

    point: Point
    group: Configurations
    matrix: Array  #: matrix of (2), (n_u + n_w, n_u + n_w)
    inverse: Array  #: pseudo-inverse that excludes the rotation about the axis
    by_p: Array  #: derivatives of residual and rows by the parameters, (n_u + n_w, n_p)
    of_x: Array  #: d(u, u_dot)/dx, (2 n_u, n_u)
    turn: Array  #: change of (x, w) by a rotation about the axis, (n_u + n_w,); zero if the axis does not allow it

    def whole(self, columns: Array) -> Array:
        """Return changes of (x, u, u_dot, w), (3 n_u + n_w, k), from changes of (x, w)."""
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
    """Return the steady rotation of a system, with the matrices of its derivatives.

    Raises
    ------
    ModelError
        If a motion other than the rotation about the axis meets no resistance.
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
    K, G = at.K + at.C @ U + at.M @ A, at.G_x + at.G_v @ U
    matrix = np.block([[K, -at.J.T], [G, at.V]])
    balance = balance_of(K, at.J, G, at.V, typical_displacements(own.compiled))
    inverse, turn = without_turn(balance, turned / np.linalg.norm(omega), family.system.name)
    by_p = parameter_residuals(family.parameters, [point])[0]
    return SteadyRotation(point, group, matrix, inverse, by_p, np.vstack([U, A]), turn)


def without_turn(balance: Balance, turned: Array, name: str) -> tuple[Array, Array]:
    """Return the pseudo-inverse without the rotation about the axis, and the change of (x, w) by this rotation."""
    rows, columns = balance.of_rows, balance.of_columns
    left, sizes, right = la.svd(balance.scaled)
    n_free = int((sizes <= SINGULAR * sizes[0]).sum())
    keep = slice(None, len(sizes) - n_free)
    inverse = columns[:, None] * (right[keep].T @ (left[:, keep].T / sizes[keep, None])) * rows
    if n_free == 0:
        return inverse, np.zeros(len(rows))
    turn = columns * right[-1]
    own = turn[: len(turned)]
    factor = float(turned @ own) / float(own @ own) if own.any() else 0.0
    if n_free > 1 or np.abs(factor * own - turned).max() > MEETS * np.abs(turned).max():
        raise ModelError(
            f"sensitivities: system {name!r}: its steady rotation is not unique (a motion other than rotation about "
            "its axis meets no resistance) and has no derivative; hold it by a spring or a joint"
        )
    return inverse, factor * turn


# eigenvalues ----------------------------------------------------------------------------------------------------------


NEAR = 1e-6  #: relative distance below which eigenvalues count as equal
DEFECTIVE = 1e-9  #: smallest |psiᴴ P_lambda phi|, relative to its terms, of an eigenvalue with a derivative


@dataclass(frozen=True)
class Branch:
    """An eigenvalue and its multiplicity."""

    value: complex
    n_times: int
    place: int  #: index of this mode among the equal eigenvalues


def pencil_rates(
    parameter: Parameter, own: Neighbour, group: Configurations, point: Point, column: Array
) -> PointTangents:
    """Return the derivatives of all matrices by a parameter, with the change `column` of the equilibrium."""
    n = group.n_v
    change = np.concatenate([column[:n], np.zeros(2 * n), column[n:]])
    found = []
    for offset, each in zip(parameter.stencil.offsets, parameter.around, strict=True):
        there = moved(group, own.compiled, point, change, offset * parameter.step)
        found.append(tangents_at(structure_of(each.compiled.model), each.compiled.model, each.work, there))
    names = PointTangents.__dataclass_fields__
    return PointTangents(*(parameter.derivative([getattr(each, name) for each in found]) for name in names))


def pencil(at: PointTangents, value: complex) -> Array:
    """Return P(lambda)."""
    bodies = value**2 * at.M + value * at.C + at.K
    return np.block([[bodies, -at.J.T.astype(complex)], [value * at.G_v + at.G_x, at.V.astype(complex)]])


def pencil_slope(at: PointTangents, value: complex) -> Array:
    """Return the derivative of P by lambda."""
    n_w = len(at.V)
    return np.block(
        [[2 * value * at.M + at.C, np.zeros((len(at.M), n_w))], [at.G_v.astype(complex), np.zeros((n_w, n_w))]]
    )


def branch_of(eigenvalues: Array, k: int) -> Branch:
    """Return mode k (from 0), and all modes with the same eigenvalue.

    Raises
    ------
    ModelError
        For a motion without resistance: its double zero eigenvalue has only one eigenvector and no derivative.
    """
    value = complex(eigenvalues[k])
    if value == 0:
        raise ModelError(f"sensitivities: mode {k + 1} has a double zero eigenvalue, which has no derivative")
    same = np.flatnonzero(np.abs(eigenvalues - value) <= NEAR * abs(value))
    return Branch(value, len(same), int(np.flatnonzero(same == k)[0]))


def null_vectors(at: PointTangents, value: complex, displacements: Array, n_times: int) -> tuple[Array, Array]:
    """Return left and right null vectors of P(lambda), (n, n_times) each, from scaled rows and columns."""
    bodies = value**2 * at.M + value * at.C + at.K
    P = balance_of(bodies, at.J, value * at.G_v + at.G_x, at.V, displacements)
    left, _, right = la.svd(P.scaled)
    return P.of_rows[:, None] * left[:, -n_times:], P.of_columns[:, None] * right[-n_times:].conj().T


def eigenvalue_derivatives(
    at: PointTangents, rates: list[PointTangents], branch: Branch, displacements: Array
) -> Array:
    """Return dlambda/dp of a mode by each parameter, (n_p,) complex, with branches in ascending order.

    displacements: `typical_displacements`.

    Raises
    ------
    ModelError
        If the eigenvalue is defective (modes coincide) and has no derivative.
    """
    psi, phi = null_vectors(at, branch.value, displacements, branch.n_times)
    slope = psi.conj().T @ pencil_slope(at, branch.value) @ phi
    size = np.abs(psi.conj().T) @ np.abs(pencil_slope(at, branch.value)) @ np.abs(phi)
    if la.svdvals(slope)[-1] <= DEFECTIVE * size.max():
        raise ModelError(
            f"sensitivities: the eigenvalue {branch.value:.6g} is defective (modes coincide, as at "
            "critical damping), and has no derivative"
        )
    found = []
    for rate in rates:
        by_p = -np.linalg.solve(slope, psi.conj().T @ pencil(rate, branch.value) @ phi)
        branches = np.linalg.eigvals(by_p) if branch.n_times > 1 else by_p[0]
        found.append(branches[np.lexsort((branches.real, branches.imag))][branch.place])
    return np.array(found)
