"""Which parameters of a tree never reach the ground, by rules over its joints: base parameters of reactions.

The reaction of the ground is the rate of the momentum of all bodies less their weight. Parameters do nothing to it
where they bring no linear and no angular momentum in any motion, and no weight or moment of weight where they are
placed: without momentum their first moment stays. In the words of `transfer_rules`:

(1) Transfers: masses along the axis of a rotation, inertia tensors without mass through a translation, and a first
    moment along the translation if all rotations before it, if any, have its direction. What passes to the ground has
    no momentum.
(2) Where all rotations on the way of a body to the ground are parallel to e: inertia tensors square to e (J e = 0).
(3) Drives act between two bodies: nothing of theirs reaches the ground.
(4) Of what (1) and (2) leave without momentum, only what has no weight and no moment of weight does nothing: of n
    directions those that solve six equations, force and moment of gravity on them at the placed configuration.

Each does nothing by the balance of momentum; that they are all is not proven. `base_parameters` finds the same by the
rank of sampled regressors, and tests hold them against each other over trees of all kinds.
"""

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.design.identification.inertial_parameters import parameters_in
from floatframe.design.identification.regressors import LinearForm
from floatframe.design.identification.transfer_rules import (
    SAME,
    Move,
    chain,
    dipole,
    moves_of,
    passing,
    rotations,
    square_to,
    tensor_row,
)
from floatframe.design.identification.tree_samples import as_placed, gravity_of, rigid_tree, tree_samples
from floatframe.engine.compiling.system import compiled_system

__all__ = ["silent_at_base"]


def silent_at_base(form: LinearForm) -> Array:
    """Return directions of the parameters, (p, k), along which no reaction of the ground changes; independent.

    Raises
    ------
    ModelError
        If the tree has a screw joint, for which there is no rule.
    """
    system = form.system
    tree = rigid_tree(system, f"system {system.name!r}: rules of base parameters").tree
    n_c, n_b, p = len(tree.side), len(tree.parent), len(form.names)
    zero = np.zeros((1, n_c))
    placed = tree_samples(system, as_placed(system)[None], zero, zero)
    moves = [moves_of(form, placed, tree, i) for i in range(n_b)]
    size = compiled_system(system).length
    to_ground = [parameters_in(placed.r[0, i], placed.R[0, i]) for i in range(n_b)]
    found: list[Array] = []  # parameters of all bodies in ground axes about its origin, without momentum
    for i in range(n_b):
        parent = int(tree.parent[i])
        before = [move for j in chain(tree, parent) for move in moves[j]]
        for phi in passing(moves[i], before, size, still_dipoles):
            direction = np.zeros((n_b, 10))
            direction[i] = phi
            if parent >= 0:
                direction[parent] = -phi
            found.append(direction)
        for phi in without_momentum([*before, *moves[i]]):
            direction = np.zeros((n_b, 10))
            direction[i] = phi
            found.append(direction)
    drives = np.eye(p)[:, form.n_inertial :]  # (3)
    if not found:
        return drives
    scale = np.tile([1.0] + [size] * 3 + [size**2] * 6, n_b)[:, None]
    at_ground = (la.orth(np.array(found).reshape(-1, 10 * n_b).T / scale, rcond=SAME) * scale).reshape(n_b, 10, -1)
    gravity = gravity_of(system)
    weights = weight(at_ground, gravity) / np.repeat([1.0, size], 3)[:, None]
    weightless = at_ground @ unseen(weights, SAME * np.linalg.norm(gravity))
    inertial = np.concatenate([la.solve(to_ground[i], weightless[i]) for i in range(n_b)])
    if inertial.shape[1]:
        inertial = la.orth(inertial)
    return np.hstack([np.vstack([inertial, np.zeros((p - 10 * n_b, inertial.shape[1]))]), drives])


def unseen(weights: Array, least: np.floating) -> Array:
    """Return orthonormal directions, (k, n), whose weight is at most `least`: that of transfers is rounding."""
    _, s, Vt = la.svd(weights)
    return Vt[int((s > least).sum()) :].T


def still_dipoles(before: list[Move], shift: Array) -> Array:
    """(1) Return the first moment along a translation, (1, 10), if all rotations before it have its direction."""
    e, are_several = rotations(before)
    if are_several or (e is not None and np.linalg.norm(np.cross(e, shift)) >= SAME):
        return np.zeros((0, 10))
    return dipole(np.zeros(3), shift)[None]


def without_momentum(way: list[Move]) -> list[Array]:
    """(2) Return inertia tensors of a body, (10,) each, that never turn about an axis along which they have inertia."""
    e, _ = rotations(way)
    if e is None:
        return []
    across = square_to(e)
    return [tensor_row(np.outer(x, y) + np.outer(y, x)) for a, x in enumerate(across) for y in across[a:]]


def weight(at_ground: Array, gravity: Array) -> Array:
    """(4) Return force and moment of gravity about the origin, (6, k), of parameters in ground axes, (n_b, 10, k)."""
    total = at_ground.sum(axis=0)
    return np.vstack([np.outer(gravity, total[0]), np.cross(total[1:4], gravity, axis=0)])
