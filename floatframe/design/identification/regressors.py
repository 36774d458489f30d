"""Inverse dynamics and reactions of a tree as linear forms of its inertial parameters.

    tau = Y(x, x_dot, x_ddot) phi,      [F; M]_base = Y_0(x, x_dot, x_ddot) phi

For a body, with a: acceleration of its origin less gravity, all in its axes,

    f = m a + (alpha~ + omega~ omega~) S,      n = -a~ S + (L(alpha) + omega~ L(omega)) J,      L(x) J = J x,

and the equation of a column of a joint is the power of the wrenches of all bodies that it carries, at its unit rate.
Where loops close, tau are the torques of the independent coordinates, Γᵀ Y phi (`loops`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import nearest, quoted
from floatframe.design.identification.inertial_parameters import INERTIAL, inertia_columns, parameters_of
from floatframe.design.identification.loops import independent_columns, loop_samples, looped_tree
from floatframe.design.identification.tree_samples import TreeSamples, rigid_tree, tree_samples
from floatframe.engine.tree.topology import CoordinateName, tree_of
from floatframe.errors import ModelError
from floatframe.model.system import System

__all__ = ["DRIVE_TERMS", "LinearForm", "linear_form", "reaction_rows", "torque_rows"]

#: terms of a drive beside those of the bodies: what they multiply, in words
DRIVE_TERMS = {
    "motor-inertia": "inertia of rotor and gear, seen at the joint: times the acceleration",
    "viscous": "viscous friction: times the rate",
    "coulomb": "Coulomb friction: times the sign of the rate",
    "offset": "constant torque",
}


@dataclass(frozen=True, eq=False)
class LinearForm:
    """Which parameters a linear form has, in the order of its columns."""

    system: System
    names: tuple[str, ...]  #: "m(link1)", ..., "viscous(hinge/angle)", (p,)
    terms: tuple[str, ...]  #: of `DRIVE_TERMS`, of each coordinate
    independent: IntArray | None = None  #: columns of the tree that move independently, where loops close; None: all

    @property
    def columns(self) -> tuple[CoordinateName, ...]:
        """The coordinates that move independently, in the order of torques."""
        every = tree_of(self.system).columns
        return every if self.independent is None else tuple(every[k] for k in self.independent)

    def samples(self, x: Array, rate: Array, acceleration: Array) -> TreeSamples:
        """Return the motion at given coordinates, (n, n_c) each, in the order of `columns`."""
        if self.independent is None:
            return tree_samples(self.system, x, rate, acceleration)
        return loop_samples(self.system, self.independent, x, rate, acceleration)

    @property
    def n_inertial(self) -> int:
        """Number of inertial parameters, the first of all."""
        return 10 * len(self.system.bodies)

    @property
    def values(self) -> Array:
        """What the system says they are, (p,); those of drives are not known to it: zero."""
        own = np.concatenate([parameters_of(body) for body in self.system.bodies])  # type: ignore[arg-type]
        return np.concatenate([own, np.zeros(len(self.names) - len(own))])

    def torques(self, samples: TreeSamples) -> Array:
        """Return Y, (n, n_c, p): forces and torques of the coordinates, in the order of `columns`."""
        return torque_rows(self, samples)

    def reactions(self, samples: TreeSamples, point: Array | None = None) -> Array:
        """Return Y_0, (n, 6, p): force and moment of the ground on the tree about a point, ground axes."""
        return reaction_rows(self, samples, np.zeros(3) if point is None else np.asarray(point, dtype=float))


def linear_form(system: System, terms: Sequence[str] = (), *, independent: Sequence[str] | None = None) -> LinearForm:
    """Return the linear form of a tree of rigid bodies, or of one whose joints close loops.

    Parameters
    ----------
    system
        Its bodies are rigid; forces but gravity are left out.
    terms
        Of `DRIVE_TERMS`, for each coordinate, also those that loops make dependent, but not for joints that are cut.
    independent
        Where joints close loops: the coordinates that are driven and measured, as many as move independently. The
        others follow, and torques are those that act on these (`floatframe.design.identification.loops`).

    Raises
    ------
    ModelError
        If it is no tree of rigid bodies, a term is not known, or coordinates are not independent.
    """
    where = f"system {system.name!r}: inertial parameters"
    has_loops = independent is not None or bool(tree_of(system).cut)
    tree = looped_tree(system, where) if has_loops else rigid_tree(system, where)
    columns = independent_columns(system, independent, where) if has_loops else None
    if not tree.columns:
        raise ModelError(
            f"system {system.name!r}: inertial parameters: no joint has a coordinate, so that nothing moves"
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
    omega, alpha = tildes(samples.omega), tildes(samples.alpha)
    A = np.zeros((n, n_b, 6, 10))
    A[..., :3, 0] = samples.a
    A[..., :3, 1:4] = alpha + omega @ omega
    A[..., 3:, 1:4] = -tildes(samples.a)
    A[..., 3:, 4:] = inertia_columns(samples.alpha) + omega @ inertia_columns(samples.omega)
    A[..., :3, :] = samples.R @ A[..., :3, :]
    A[..., 3:, :] = samples.R @ A[..., 3:, :]
    return A


def tildes(x: Array) -> Array:
    """Return the matrices of cross products, (..., 3, 3)."""
    return np.cross(x[..., None, :], np.eye(3)).swapaxes(-1, -2)


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
    """Return Y_0, (n, 6, p): inner terms of drives do not reach the ground."""
    n, n_b = samples.r.shape[:2]
    A = body_wrenches(samples)
    Y = np.zeros((n, 6, len(form.names)))
    for i in range(n_b):
        at = slice(10 * i, 10 * i + 10)
        Y[:, :3, at] = A[:, i, :3]
        Y[:, 3:, at] = A[:, i, 3:] + tildes(samples.r[:, i] - point) @ A[:, i, :3]
    return Y
