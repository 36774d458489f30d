"""Inverse dynamics and reactions of a tree as linear forms of its inertial parameters.

    tau = Y(x, x_dot, x_ddot) phi,      [F; M]_base = Y_0(x, x_dot, x_ddot) phi

For a body, with the acceleration a of its origin minus gravity, all in its axes,

    f = m a + (alpha~ + omega~ omega~) S,      n = -a~ S + (L(alpha) + omega~ L(omega)) J,      L(x) J = J x,

and the equation of a joint column is the power of the wrenches of all bodies that the joint carries, at unit rate.
In systems with loops, tau are the torques of the independent coordinates, Γᵀ Y phi (`loops`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array, IntArray, tilde
from fe_models.foundation.presentation import presented
from fe_models.foundation.words import nearest, quoted
from floatframe.design.identification.inertial_parameters import INERTIAL, inertia_columns, parameters_of
from floatframe.design.identification.tree_samples import (
    TreeSamples,
    distances,
    joints_as_placed,
    motion_of_tree,
    rigid_bodies,
    rigid_tree,
    tree_samples,
)
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.work import new_work
from floatframe.engine.tree.kernels.tree import new_tangent_work
from floatframe.engine.tree.topology import CoordinateName, SystemTree, tree_of
from floatframe.errors import ModelError
from floatframe.model.forces import JointForce
from floatframe.model.joints.rows import is_held, is_held_length, is_held_position
from floatframe.model.system import System

__all__ = [
    "DRIVE_TERMS",
    "LinearForm",
    "independent_columns",
    "linear_form",
    "loop_samples",
    "looped_tree",
    "reaction_rows",
    "torque_rows",
]


# loops ----------------------------------------------------------------------------------------------------------------
# Motions of systems with closed loops: the dependent coordinates z_d follow from the independent ones z_i and the cut
# joints.
#
# With C the derivative of the constraints g of the cut joints by all coordinates z = (z_i, z_d),
#
#     g(z) = 0,      C_d z_d' = -C_i z_i',      C_d z_d'' = -C_i z_i'' - (second rates of g at z'' = 0),
#
# and the forces that drive the independent coordinates are the forces of the remaining tree, projected on the motions
# that the loops allow (reactions of cut joints do no work in these motions):
#
#     tau_i = Γᵀ Y phi,        Γ = dz'/dz_i' = (1, -C_d⁻¹ C_i).
#
# Rows of cut joints may be redundant, as three of five are in a parallelogram of hinges. The equations are therefore
# solved by least squares, and the residual of g is checked. A motion is followed in short steps from the placed
# configuration, so that it stays on the same branch.


#: largest singular value of C that counts as zero, relative to the largest one, with scaled rows and columns
RANK = 1e-8
CLOSED = 1e-11  #: largest gap of a closed loop, in scaled lengths and angles
MOST = 25  #: largest number of iterations
STRIDE = 0.1  #: largest step of an independent coordinate [rad, or system sizes]


def looped_tree(system: System, where: str) -> SystemTree:
    """Return the tree of a system of rigid bodies with loops, and its cut joints; `ModelError` for any other system."""
    rigid_bodies(system, where)
    tree = tree_of(system)
    if tree.is_tree:
        raise ModelError(
            f"{where}: independent: expected closed loops, got a tree, in which all coordinates are independent"
        )
    beside = [coupler.name for coupler in system.couplers] + [element.name for element in system.elements]
    if beside:
        raise ModelError(
            f"{where}: {', '.join(quoted(name) for name in beside)}: expected joints, whose reactions do no work, "
            "got couplers or elements; remove them"
        )
    normal = [
        force.joint
        for force in system.forces
        if isinstance(force, JointForce) and force.friction_coefficient and force.joint in tree.constrained
    ]
    if normal:
        raise ModelError(
            f"{where}: joint {quoted(normal[0])} has friction by its normal force, which is not linear in the "
            "parameters; remove it"
        )
    driven = [column.name for column in tree.columns if column.is_driven]
    if driven:
        raise ModelError(
            f"{where}: {', '.join(quoted(name) for name in driven)}: these motions are prescribed, but with loops "
            "the samples give the motion; remove them"
        )
    model = compiled_system(system).model
    kinds = model.rows.kind[tree.tree.kept_row >= 0]
    if (is_held(kinds) & ~is_held_position(kinds)).any():
        raise ModelError(f"{where}: joints that constrain velocities (rolling) are not supported in loops; remove them")
    return tree


class Loops:
    """The cut joints of a system, with working arrays."""

    def __init__(self, system: System, where: str) -> None:
        """Begin with the placed system."""
        compiled = compiled_system(system)
        self.where, self.parts = where, looped_tree(system, where)
        self.model, self.tree = compiled.model, self.parts.tree
        self.work, self.joints = new_work(self.model), joints_as_placed(system)
        self.tangent = new_tangent_work(self.model, self.tree)
        self.start = distances(self.tree, self.joints)
        kept = self.tree.kept_row >= 0
        kinds = self.model.rows.kind[kept]
        held = np.flatnonzero(is_held(kinds))
        self.held, self.rows = held, np.flatnonzero(kept)[held]
        self.row_size = np.where(is_held_length(kinds[held]), compiled.length, 1.0)
        self.size = np.array([compiled.length if column.unit == "m" else 1.0 for column in self.parts.columns])
        self.names = ", ".join(quoted(name) for name in (*self.parts.cut, *self.parts.constrained))

    def put(self, x: Array, rate: Array, acceleration: Array, *, by_increments: bool) -> Array:
        """Set the motion in `work`, with the rates of g; return C with scaled rows and coordinates, (n_rows, n_c)."""
        from floatframe.engine.tree.kernels.entry import constraints

        joints = self.joints
        joints.x[:], joints.rate[:], joints.acceleration[:] = x - self.start, rate, acceleration
        constraints(self.model, self.work, self.tree, joints, self.tangent, by_increments=by_increments)
        C = np.zeros((len(self.rows), len(self.size)))
        C[:, self.tree.column] = self.tangent.C[self.held]
        return C * self.size / self.row_size[:, None]

    def gap(self) -> Array:
        """Return the scaled constraint errors, (n_rows,)."""
        return self.work.connections.g[self.rows] / self.row_size

    def close(self, x: Array, dependent: IntArray, at: str) -> Array:
        """Return the coordinates after the dependent ones are changed so that the loops are closed."""
        x, zero = x.copy(), np.zeros_like(x)
        for _ in range(MOST):
            C_d = self.put(x, zero, zero, by_increments=True)[:, dependent]
            g = self.gap()
            step = solved(C_d, -g)
            x[dependent] += step * self.size[dependent]
            if np.abs(step).max() <= CLOSED:
                if np.abs(g).max() <= 1e3 * CLOSED:
                    return x
                break
        raise ModelError(
            f"{self.where}: the loops cut at {self.names} cannot be closed {at} (they miss by {np.abs(g).max():.2g} of "
            "their size); the coordinates are out of reach, or their zero is not the placed configuration"
        )


def solved(C_d: Array, right: Array) -> Array:
    """Return the dependent coordinates, by least squares, because rows may be redundant."""
    return np.asarray(la.lstsq(C_d, right, cond=RANK, lapack_driver="gelsy")[0])


def independent_columns(system: System, names: Sequence[str] | None, where: str) -> IntArray:
    """Return the columns of independent coordinates, (n_i,).

    Parameters
    ----------
    names
        The given names. Their number must be the number of degrees of freedom, and they must determine all other
        coordinates in the placed configuration.

    Raises
    ------
    ModelError
        If they are not independent; the message suggests names that are.
    """
    loops = Loops(system, where)
    every = [column.name for column in loops.parts.columns]
    zero = np.zeros(len(every))
    C = loops.put(loops.start, zero, zero, by_increments=False)
    s = la.svdvals(C)
    n_d = int((s > RANK * s[0]).sum())
    n_i = len(every) - n_d
    fit = f"{n_i} of {', '.join(every)} move independently"
    if names is None:
        raise ModelError(
            f"{where}: loops are cut at {loops.names}; {fit}: name those driven and measured, such as independent = "
            f"({', '.join(repr(each) for each in proposed(C, every, n_d))})"
        )
    for name in names:
        if name not in every:
            raise ModelError(f"{where}: independent: no coordinate {quoted(name)}{nearest(name, every)}")
    columns = np.array([every.index(name) for name in names], dtype=np.int64)
    if len(set(names)) != len(names) or len(columns) != n_i:
        raise ModelError(f"{where}: independent: {fit} (loops are cut at {loops.names}), got {', '.join(names)}")
    rest = np.setdiff1d(np.arange(len(every)), columns)
    s_d = la.svdvals(C[:, rest])
    if s_d[n_d - 1] <= RANK * s[0]:
        raise ModelError(
            f"{where}: independent: {', '.join(names)} do not determine the others in the placed configuration; take "
            f"{', '.join(proposed(C, every, n_d))}, or place the system where its links are not in line"
        )
    return columns


def proposed(C: Array, names: list[str], n_d: int) -> list[str]:
    """Return names of independent coordinates by pivoted elimination, which prefers early coordinates."""
    _, _, pivot = la.qr(C[:, ::-1], mode="economic", pivoting=True)
    dependent = {len(names) - 1 - int(k) for k in pivot[:n_d]}
    return [name for k, name in enumerate(names) if k not in dependent]


def loop_samples(system: System, independent: IntArray, x: Array, rate: Array, acceleration: Array) -> TreeSamples:
    """Return the motion of a system with loops at given independent coordinates.

    Parameters
    ----------
    independent
        Columns of the independent coordinates, (n_i,).
    x, rate, acceleration
        Values of the independent coordinates, (n, n_i), as in `tree_samples`; successive instants must be close.

    Raises
    ------
    ModelError
        If loops cannot be closed, or a position is singular; the message has the number of the instant.
    """
    where = f"system {system.name!r}: samples"
    loops = Loops(system, where)
    n, n_c = len(x), len(loops.size)
    if not x.shape == rate.shape == acceleration.shape == (n, len(independent)):
        names = ", ".join(loops.parts.columns[k].name for k in independent)
        raise ModelError(
            f"{where}: expected three arrays (n, {len(independent)}), one column for each of {names}; got {x.shape}, "
            f"{rate.shape}, {acceleration.shape}"
        )
    dependent = np.setdiff1d(np.arange(n_c), independent)
    size_d, size_i = loops.size[dependent], loops.size[independent]
    z, z_dot, z_ddot = np.empty((n, n_c)), np.empty((n, n_c)), np.empty((n, n_c))
    gamma = np.zeros((n, n_c, len(independent)))
    gamma[:, independent] = np.eye(len(independent))
    zero, here = np.zeros(n_c), loops.start.copy()
    for k in range(n):
        at = f"at instant {k}"
        way = (x[k] - here[independent]) / size_i
        n_strides = max(1, int(np.ceil(np.abs(way).max() / STRIDE)))
        for _ in range(n_strides):
            C = loops.put(here, zero, zero, by_increments=True)
            here[independent] += way / n_strides * size_i
            here[dependent] += solved(C[:, dependent], -C[:, independent] @ way / n_strides) * size_d
            here = loops.close(here, dependent, at)
        here[independent] = x[k]
        C = loops.put(here, zero, zero, by_increments=False)
        s = la.svdvals(C[:, dependent])
        if s[len(dependent) - 1] <= RANK * s[0]:
            raise ModelError(f"{where}: {at} the loops cut at {loops.names} are in a singular position")
        gamma[k, dependent] = solved(C[:, dependent], -C[:, independent]) * size_d[:, None] / size_i
        z[k], z_dot[k], z_ddot[k] = here, gamma[k] @ rate[k], zero
        z_ddot[k, independent] = acceleration[k]
        loops.put(here, z_dot[k], z_ddot[k], by_increments=False)
        bias = loops.work.connections.bias[loops.rows] / loops.row_size
        z_ddot[k, dependent] = solved(C[:, dependent], -bias) * size_d
    return motion_of_tree(system, loops.parts.tree, z, z_dot, z_ddot, gamma)


# regressors -----------------------------------------------------------------------------------------------------------


#: terms of a drive in addition to those of the bodies, with descriptions
DRIVE_TERMS = {
    "motor-inertia": "inertia of rotor and gear, reduced to the joint: times the acceleration",
    "viscous": "viscous friction: times the rate",
    "coulomb": "Coulomb friction: times the sign of the rate",
    "offset": "constant torque",
}


@presented
@dataclass(frozen=True, eq=False)
class LinearForm:
    """The parameters of a linear form, in the order of its columns."""

    system: System
    names: tuple[str, ...]  #: "m(link1)", ..., "viscous(hinge/angle)", (p,)
    terms: tuple[str, ...]  #: `DRIVE_TERMS` of each coordinate
    independent: IntArray | None = None  #: independent columns of the tree if there are loops; None: all columns

    @property
    def columns(self) -> tuple[CoordinateName, ...]:
        """The independent coordinates, in the order of torques."""
        every = tree_of(self.system).columns
        return every if self.independent is None else tuple(every[k] for k in self.independent)

    def samples(self, x: Array, rate: Array, acceleration: Array) -> TreeSamples:
        """Return the motion for given coordinates, (n, n_c) each, in the order of `columns`."""
        if self.independent is None:
            return tree_samples(self.system, x, rate, acceleration)
        return loop_samples(self.system, self.independent, x, rate, acceleration)

    @property
    def n_inertial(self) -> int:
        """Number of inertial parameters, which come first."""
        return 10 * len(self.system.bodies)

    @property
    def values(self) -> Array:
        """Values of the parameters in the system, (p,); parameters of drives are zero, because they are unknown."""
        own = np.concatenate([parameters_of(body) for body in self.system.bodies])  # type: ignore[arg-type]
        return np.concatenate([own, np.zeros(len(self.names) - len(own))])

    def torques(self, samples: TreeSamples) -> Array:
        """Return Y, (n, n_c, p): forces and torques of the coordinates, in the order of `columns`."""
        return torque_rows(self, samples)

    def reactions(self, samples: TreeSamples, point: Array | None = None) -> Array:
        """Return Y_0, (n, 6, p): force and moment of the ground on the tree about a point, ground axes."""
        return reaction_rows(self, samples, np.zeros(3) if point is None else np.asarray(point, dtype=float))


def linear_form(system: System, terms: Sequence[str] = (), *, independent: Sequence[str] | None = None) -> LinearForm:
    """Return the linear form of a system of rigid bodies, which may have closed loops.

    Parameters
    ----------
    system
        The system; all forces except gravity are ignored.
    terms
        Names in `DRIVE_TERMS`, for each coordinate, including dependent ones, but not for cut joints.
    independent
        For systems with loops: the coordinates that are driven and measured, as many as there are degrees of
        freedom. The others follow from them; torques act on them (`floatframe.design.identification.regressors`).

    Raises
    ------
    ModelError
        If the system contains anything else, a term is unknown, or coordinates are not independent.
    """
    where = f"system {system.name!r}: inertial parameters"
    has_loops = independent is not None or bool(tree_of(system).cut)
    tree = looped_tree(system, where) if has_loops else rigid_tree(system, where)
    columns = independent_columns(system, independent, where) if has_loops else None
    if not tree.columns:
        raise ModelError(
            f"system {system.name!r}: inertial parameters: expected a joint with a coordinate, got none; nothing moves"
        )
    for term in terms:
        if term not in DRIVE_TERMS:
            raise ModelError(f"linear_form: terms: no term {quoted(term)}{nearest(term, list(DRIVE_TERMS))}")
    names = [f"{name}({body.name})" for body in system.bodies for name in INERTIAL]
    names += [f"{term}({column.name})" for term in terms for column in tree.columns]
    return LinearForm(system, tuple(names), tuple(terms), columns)


def body_wrenches(samples: TreeSamples) -> Array:
    """Return the wrench on each body about its origin, ground axes, by its parameters, (n, n_b, 6, 10)."""
    n, n_b = samples.r.shape[:2]
    omega, alpha = tilde(samples.omega), tilde(samples.alpha)
    A = np.zeros((n, n_b, 6, 10))
    A[..., :3, 0] = samples.a
    A[..., :3, 1:4] = alpha + omega @ omega
    A[..., 3:, 1:4] = -tilde(samples.a)
    A[..., 3:, 4:] = inertia_columns(samples.alpha) + omega @ inertia_columns(samples.omega)
    A[..., :3, :] = samples.R @ A[..., :3, :]
    A[..., 3:, :] = samples.R @ A[..., 3:, :]
    return A


def torque_rows(form: LinearForm, samples: TreeSamples) -> Array:
    """Return Y, (n, n_c, p)."""
    tree = tree_of(form.system).tree
    n, n_b = samples.r.shape[:2]
    n_c = len(tree.side)
    A = body_wrenches(samples)
    Y = np.zeros((n, n_c, len(form.names)))
    for i in range(n_b):
        j = i
        while j >= 0:
            sign = -1.0 if tree.is_reversed[j] else 1.0
            for k in range(tree.column0[j], tree.column0[j + 1]):
                a = samples.turn[:, k]
                v = samples.t[:, k] + np.cross(a, samples.r[:, i] - samples.point[:, k])
                power = np.einsum("sa,sap->sp", v, A[:, i, :3]) + np.einsum("sa,sap->sp", a, A[:, i, 3:])
                Y[:, k, 10 * i : 10 * i + 10] = sign * power
            j = int(tree.parent[j])
    first = form.n_inertial
    for term in form.terms:
        what = {
            "motor-inertia": samples.acceleration,
            "viscous": samples.rate,
            "coulomb": np.sign(samples.rate),
            "offset": np.ones((n, n_c)),
        }[term]
        Y[:, np.arange(n_c), first + np.arange(n_c)] = what
        first += n_c
    return Y if samples.gamma is None else np.einsum("ski,skp->sip", samples.gamma, Y)


def reaction_rows(form: LinearForm, samples: TreeSamples, point: Array) -> Array:
    """Return Y_0, (n, 6, p); columns of drives are zero, because their torques are internal."""
    n, n_b = samples.r.shape[:2]
    A = body_wrenches(samples)
    Y = np.zeros((n, 6, len(form.names)))
    for i in range(n_b):
        at = slice(10 * i, 10 * i + 10)
        Y[:, :3, at] = A[:, i, :3]
        Y[:, 3:, at] = A[:, i, 3:] + tilde(samples.r[:, i] - point) @ A[:, i, :3]
    return Y
