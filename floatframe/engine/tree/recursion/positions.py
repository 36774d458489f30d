"""Positions of joints from the poses of bodies, and bodies from those of nodes (docs/recursive.md §1)."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.tree.recursion.expansion import Expansion, chain_of, marker_shape, zero_rotation_of
from floatframe.engine.tree.recursion.nodes import ROTATION, TRANSLATION
from floatframe.model.rotations import euler_parameters, rotation_matrix
from floatframe.model.state import State

__all__ = ["positions_of_state"]


def positions_of_state(expansion: Expansion, state: State) -> Array:
    """Return the positions, (n_x,), of a state of the engine; joints are assumed closed."""
    compiled, tree = expansion.compiled, expansion.tree.tree
    bodies = compiled.model.bodies
    x = np.zeros(expansion.n_x)
    for i in range(len(bodies.kind)):
        q = state.q[bodies.q0[i] : bodies.q0[i + 1]]
        x[expansion.xq_of[i]] = q
        poses = []
        for m, body in ((int(tree.near[i]), int(tree.parent[i])), (int(tree.far[i]), i)):
            R, r = (np.eye(3), np.zeros(3)) if body < 0 else (rotation_matrix(state.p[body]), state.r[body])
            own = np.zeros(0) if body < 0 else state.q[bodies.q0[body] : bodies.q0[body + 1]]
            rho, axes = marker_shape(compiled, m).pose(own)
            poses.append((r + R @ rho, R @ axes))
        (r_a, A_a), (r_b, A_b) = poses[::-1] if tree.is_reversed[i] else poses
        x[expansion.x_of[i]] = joint_positions(expansion, i, A_a.T @ (r_b - r_a), A_a.T @ A_b)
    return x


def joint_positions(expansion: Expansion, i: int, d: Array, Q: Array) -> Array:
    """Return the positions of the joint of body i from d, axes of A, and Q = A_Aᵀ A_B."""
    tree = expansion.tree.tree
    Q0 = zero_rotation_of(expansion.system, expansion.compiled, tree, i)
    chain = chain_of(tree, i, Q0)
    turning = [each for each in chain if each.turn != 0.0 and each.kind not in (TRANSLATION, ROTATION)]
    M = Q @ Q0.T  # for rotations about axes of A at zero coordinates, one after the other
    angles = {}
    if len(turning) == 1:
        x, y, _ = turning[0].axes.T
        angles[turning[0].first] = np.arctan2(y @ M @ x - x @ M @ y, x @ M @ x + y @ M @ y) / turning[0].turn
    elif len(turning) == 2:  # at right angles: M e_2 rotates with the first, Mᵀ e_1 against the second
        first, second = turning
        e_1, e_2 = first.axes[:, 2], second.axes[:, 2]
        angles[first.first] = turn_between(e_1, e_2, M @ e_2) / first.turn
        angles[second.first] = -turn_between(e_2, e_1, M.T @ e_1) / second.turn
    parts: dict[int, Array] = {}
    for each in chain:
        if each.kind == TRANSLATION:
            parts[each.first] = d
        elif each.kind == ROTATION:
            parts[each.first] = euler_parameters(Q)
        elif each.first in angles:
            parts[each.first] = np.array([angles[each.first]])
        elif each.turn == 0.0:
            parts[each.first] = np.array([each.axes[:, 2] @ d / each.slide])
    return np.concatenate([*(parts[key] for key in sorted(parts)), np.zeros(0)])


def turn_between(axis: Array, a: Array, b: Array) -> float:
    """Return the angle about an axis from a to b, both normal to it."""
    return float(np.arctan2(axis @ np.cross(a, b), a @ b))
