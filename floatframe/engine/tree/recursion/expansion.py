"""Nodes from the tree of a system: each joint becomes a chain of elementary joints (docs/recursive.md §1).

Let Q be the rotation from marker A to B, and Q0 its value at zero coordinates. A joint moves B relative to A by
translations along axes of A, then rotations about axes of A, then rotations about axes of B. Because
exp(a x) Q0 exp(b y) = exp(a x) exp(Q0 b y) Q0, it is one chain of screws in the axes of A at zero coordinates, with Q0
at its end. If marker B is on the parent, the chain is reversed, with opposite signs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.model import Model, marker_shapes
from floatframe.engine.kernels.records import filled
from floatframe.engine.tree.kernels.tree import Tree
from floatframe.engine.tree.recursion.nodes import FIXED, NO_MARKER, ROTATION, SCREW, TRANSLATION, Nodes
from floatframe.engine.tree.topology import SystemTree, tree_of
from floatframe.engine.tree.tree_motions import joint_iterate
from floatframe.model.bodies.added_mass import second_moments
from floatframe.model.bodies.marker_shape import MarkerShape
from floatframe.model.joints import FixedJoint, SphericalJoint, UniversalJoint
from floatframe.model.joints.axis_frame import axis_in_b, normals_of, turning_frame
from floatframe.model.joints.joint import SIDE_A
from floatframe.model.rotations import euler_parameters, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Elementary", "Expansion", "expansion_of", "marker_shape", "positions_and_rates_of_state"]

N_POSITIONS = {FIXED: 0, SCREW: 1, TRANSLATION: 3, ROTATION: 4}
N_RATES = {FIXED: 0, SCREW: 1, TRANSLATION: 3, ROTATION: 3}
ZERO = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Elementary:
    """One elementary joint in a chain of them."""

    kind: int
    #: inner frame at zero coordinates in axes of the first marker, (3, 3); a screw acts along the third axis
    axes: Array
    slide: float
    turn: float
    first: int  #: index of its first column in the joint
    is_near: bool = False

    def reversed_in(self, Q0: Array) -> "Elementary":
        """Return the same joint from the other marker to this one."""
        near = self.kind == ROTATION and not self.is_near
        return Elementary(self.kind, Q0.T @ self.axes, -self.slide, -self.turn, self.first, near)


@dataclass(frozen=True, eq=False)
class Expansion:
    """The nodes of a system, and the correspondence of nodes and bodies."""

    nodes: Nodes
    node_of: tuple[int, ...]  #: node that carries each body
    first_of: tuple[int, ...]  #: first node of the joint of each body
    x_of: tuple[slice, ...]  #: positions of the joint of each body
    z_of: tuple[slice, ...]  #: rates of the joint of each body
    xq_of: tuple[slice, ...]  #: modal coordinates of each body among the positions
    vq_of: tuple[slice, ...]  #: the same among the rates
    frame_of: tuple[tuple[Array, Array], ...]  #: axes and origin of the node in the undeformed body, (3, 3) and (3,)
    n_x: int
    n_v: int
    system: System
    tree: SystemTree
    compiled: CompiledSystem


def zero_rotation(joint: object, A_a: Array, A_b: Array) -> Array:
    """Return Q0, (3, 3), the axes of B relative to A at zero joint coordinates."""
    if joint is None or isinstance(joint, SphericalJoint):
        return np.eye(3)
    if isinstance(joint, FixedJoint) and joint.rotation is not None:
        return np.asarray(joint.rotation)
    if isinstance(joint, UniversalJoint):
        z = A_a.T @ A_b @ joint.axis_b
        z = z - (z @ joint.axis) * joint.axis
        z = z / np.linalg.norm(z)
        z_b = A_b.T @ A_a @ joint.axis
        z_b = z_b - (z_b @ joint.axis_b) * joint.axis_b
        z_b = z_b / np.linalg.norm(z_b)
        in_a = np.column_stack([np.cross(z, joint.axis), z, joint.axis])
        return in_a @ np.column_stack([np.cross(joint.axis_b, z_b), joint.axis_b, z_b]).T
    if hasattr(joint, "axis_b"):
        axis_b = axis_in_b(joint.axis, joint.axis_b, A_a, A_b)  # type: ignore[attr-defined]
        x, z, y = turning_frame(joint.axis, axis_b, A_a, A_b)  # type: ignore[attr-defined]
        in_b = np.column_stack([np.cross(y, axis_b), y, axis_b])
        return np.column_stack([x, z, joint.axis]) @ in_b.T  # type: ignore[attr-defined]
    return np.asarray(A_a.T @ A_b)


def chain_of(tree: Tree, body: int, Q0: Array) -> list[Elementary]:
    """Return the chain from marker A to marker B of the joint of a body."""
    first, end = int(tree.column0[body]), int(tree.column0[body + 1])
    moves: list[Elementary] = []
    turns_a: list[Elementary] = []
    turns_b: list[Elementary] = []
    group_b = [k for k in range(first, end) if tree.side[k] != SIDE_A]
    group_a = [k for k in range(first, end) if tree.side[k] == SIDE_A and not tree.alpha[k].any()]
    for k in range(first, end):
        if len(group_b) == 3 and k in group_b:
            if k == group_b[0]:
                turns_b.append(Elementary(ROTATION, Q0, 1.0, 1.0, k - first))
        elif len(group_a) == 3 and k in group_a:
            if k == group_a[0]:
                moves.append(Elementary(TRANSLATION, np.eye(3), 1.0, 1.0, k - first))
        elif tree.side[k] == SIDE_A:
            is_move = not tree.alpha[k].any()
            axis = tree.tau[k] if is_move else tree.alpha[k]
            axis = axis / np.linalg.norm(axis)
            slide, turn = float(axis @ tree.tau[k]), float(axis @ tree.alpha[k])
            (moves if is_move else turns_a).append(Elementary(SCREW, frame_along(axis), slide, turn, k - first))
        else:
            axis = Q0 @ tree.alpha[k]
            turns_b.append(Elementary(SCREW, frame_along(axis), 0.0, 1.0, k - first))
    return [*moves, *turns_a, *turns_b]


def frame_along(axis: Array) -> Array:
    """Return a right-handed frame whose third axis is the given one, (3, 3)."""
    first, second = normals_of(axis)
    return np.column_stack([first, second, axis])


def expansion_of(system: System) -> Expansion:
    """Return the nodes of a system whose joints form a tree."""
    found, compiled = tree_of(system), compiled_system(system)
    tree, model = found.tree, compiled.model
    n_b = len(model.bodies.kind)
    x_of, z_of, xq_of, vq_of = positions_and_rates(found, model)
    items: list[dict] = []
    node_of, first_of = [-1] * n_b, [-1] * n_b
    frames: list[tuple[Array, Array]] = [(np.eye(3), ZERO)] * n_b
    h0, g0, c0 = [0], [0], [0]
    for i in (int(i) for i in tree.order):
        near, far, back = int(tree.near[i]), int(tree.far[i]), bool(tree.is_reversed[i])
        Q0 = zero_rotation_of(system, compiled, tree, i)
        chain = chain_of(tree, i, Q0)
        if back:
            chain, Q0 = [each.reversed_in(Q0) for each in reversed(chain)], Q0.T
        end = int(tree.column0[i + 1] - tree.column0[i])  # modes of a flexible body must follow the joint's last rate
        if not chain or (is_flexible(model, i) and chain[-1].first + N_RATES[chain[-1].kind] != end):
            chain.append(Elementary(FIXED, chain[-1].axes if chain else Q0, 0.0, 0.0, end))
        parent_body = int(tree.parent[i])
        is_elastic = parent_body >= 0 and is_flexible(model, parent_body)
        A_in, r_in = marker_place(model, near)
        if parent_body >= 0 and not is_elastic:
            F, origin = frames[parent_body]
            A_in, r_in = F.T @ A_in, F.T @ (r_in - origin)
        parent, W = (-1 if parent_body < 0 else node_of[parent_body]), np.eye(3)
        x, z = x_of[i].start, z_of[i].start
        starts = starts_of(chain, x, z)
        first_of[i] = len(items)
        n_parent = int(model.bodies.n_q[parent_body]) if is_elastic else 0
        for place, each in enumerate(chain):
            is_last = place == len(chain) - 1
            n = int(model.bodies.n_q[i]) if is_last and is_flexible(model, i) else 0
            items.append(
                {
                    "parent": parent,
                    "kind": each.kind,
                    "is_near": int(each.is_near),
                    "n_z": N_RATES[each.kind],
                    "x0": starts[each.first][0],
                    "v0": starts[each.first][1],
                    "slide": each.slide,
                    "turn": each.turn,
                    "A": A_in @ W.T @ each.axes if place == 0 else W.T @ each.axes,
                    "r": r_in if place == 0 else ZERO,
                    "above": near if place == 0 and is_elastic else NO_MARKER,
                    "body": -1,
                    "n_q": n,
                    "q0": 0,
                    "u0": 0,
                    "xq": 0,
                    "vq": 0,
                    "own": NO_MARKER,
                    "F": np.eye(3),
                    "mass": 0.0,
                    "s": ZERO,
                    "J": np.zeros((3, 3)),
                    "P": np.zeros((3, 3)),
                }
            )
            n_z = N_RATES[each.kind]
            h0.append(h0[-1] + ((6 + n) ** 2 if n else 0))
            g0.append(g0[-1] + ((n_z + n) ** 2 if n else 0))
            c0.append(c0[-1] + (n_parent if place == 0 else 0))
            parent, W = len(items) - 1, each.axes
        node_of[i] = parent
        triad, position = marker_place(model, far)
        F = triad @ Q0.T @ W
        frames[i] = (F, position)
        items[-1].update(carried(model, i, F, position))
        if is_flexible(model, i):
            items[-1].update(own=far, xq=xq_of[i].start, vq=vq_of[i].start)
    named = {name: [item[name] for item in items] for name in Nodes._fields if name not in ("h0", "g0", "c0")}
    nodes = filled(Nodes(), **named, h0=h0, g0=g0, c0=c0)
    n_x = max((part.stop for part in xq_of), default=0)
    n_v = max((part.stop for part in vq_of), default=0)
    return Expansion(
        nodes, tuple(node_of), tuple(first_of), x_of, z_of, xq_of, vq_of, tuple(frames), n_x, n_v, system, found,
        compiled,
    )  # fmt: skip


def starts_of(chain: Sequence[Elementary], x: int, z: int) -> dict[int, tuple[int, int]]:
    """Return each elementary joint's first position and rate, by its first column."""
    starts = {}
    for each in sorted(chain, key=lambda each: each.first):
        starts[each.first] = (x, z)
        x, z = x + N_POSITIONS[each.kind], z + N_RATES[each.kind]
    return starts


def positions_and_rates(found: SystemTree, model: Model) -> tuple[tuple[slice, ...], ...]:
    """Return, for each body, positions and rates of its joint and of its modes."""
    tree = found.tree
    x, v = 0, 0
    parts: tuple[list[slice], ...] = ([], [], [], [])
    for i, n in enumerate(int(n) for n in model.bodies.n_q):
        first, end = int(tree.column0[i]), int(tree.column0[i + 1])
        n_z = end - first
        n_p = n_z + int((tree.side[first:end] != SIDE_A).sum() == 3)
        parts[0].append(slice(x, x + n_p))
        parts[1].append(slice(v, v + n_z))
        parts[2].append(slice(x + n_p, x + n_p + n))
        parts[3].append(slice(v + n_z, v + n_z + n))
        x, v = x + n_p + n, v + n_z + n
    return tuple(tuple(part) for part in parts)


def is_flexible(model: Model, i: int) -> bool:
    """Whether a body has modes."""
    return bool(model.bodies.n_q[i] > 0)


def marker_place(model: Model, m: int) -> tuple[Array, Array]:
    """Return axes and position of a marker in its undeformed body; -1: of the body frame or the ground."""
    if m < 0:
        return np.eye(3), ZERO
    return model.markers.triad[m], model.markers.position[m]


def placed_axes(compiled: CompiledSystem, m: int, body: int) -> Array:
    """Return assembled ground axes of a marker, with deformation, or of a body that has no marker."""
    placed, bodies = compiled.placed, compiled.model.bodies
    i = body if m < 0 else int(compiled.model.markers.body[m])
    R = np.eye(3) if i < 0 else rotation_matrix(placed.p[i])
    q = np.zeros(0) if i < 0 else placed.q[bodies.q0[i] : bodies.q0[i + 1]]
    return np.asarray(R @ marker_shape(compiled, m).pose(q)[1])


def marker_shape(compiled: CompiledSystem, m: int) -> MarkerShape:
    """Return a marker of a compiled system relative to its body; -1: the body frame."""
    markers, bodies = compiled.model.markers, compiled.model.bodies
    if m < 0:
        return MarkerShape(ZERO, np.eye(3))
    i = int(markers.body[m])
    if i < 0 or markers.psi0[m] < 0:
        return MarkerShape(markers.position[m], markers.triad[m])
    n, first = int(bodies.n_q[i]), int(markers.bend0[m])
    bend = None
    if first >= 0:
        bend = np.moveaxis(markers.bend[first : first + 6 * n * n].reshape(n, 6, n), 0, 2)
    shapes = marker_shapes(compiled.model, markers.psi, m)
    return MarkerShape(markers.position[m], markers.triad[m], shapes, bend)


def zero_rotation_of(system: System, compiled: CompiledSystem, tree: Tree, i: int) -> Array:
    """Return Q0, (3, 3), for the joint of body i."""
    joint = None if tree.joint[i] < 0 else system.joints[tree.joint[i]]
    near, far = placed_axes(compiled, int(tree.near[i]), -1), placed_axes(compiled, int(tree.far[i]), i)
    return zero_rotation(joint, *((far, near) if tree.is_reversed[i] else (near, far)))


def carried(model: Model, i: int, F: Array, origin: Array) -> dict:
    """Return the body data of a node: moments of the undeformed body, in the frame F at its origin."""
    bodies, types = model.bodies, model.body_types
    t = int(bodies.kind[i])
    m, S = float(types.mass[t]), types.S[t]
    s = S - m * origin
    P = F.T @ (second_moments(types.J0[t]) - np.outer(S, origin) - np.outer(origin, s)) @ F
    P = 0.5 * (P + P.T)
    moments = {"mass": m, "s": F.T @ s, "J": np.trace(P) * np.eye(3) - P, "P": P}
    return {"body": i, "q0": int(bodies.q0[i]), "u0": int(bodies.u0[i]), "F": F} | moments


# positions of joints from the poses of bodies, and bodies from those of nodes (docs/recursive.md §1) ------------------


def positions_and_rates_of_state(expansion: Expansion, state: State) -> tuple[Array, Array]:
    """Return positions, (n_x,), and rates, (n_v,), for a state of the engine whose joints are assumed closed."""
    compiled, tree = expansion.compiled, expansion.tree.tree
    bodies = compiled.model.bodies
    _, joints = joint_iterate(compiled, tree, state)
    x, v = np.zeros(expansion.n_x), np.zeros(expansion.n_v)
    for i in range(len(bodies.kind)):
        x[expansion.x_of[i]] = joint_positions(expansion, i, joints.d[i], joints.Q[i])
        v[expansion.z_of[i]] = joints.rate[tree.column0[i] : tree.column0[i + 1]]
        x[expansion.xq_of[i]] = state.q[bodies.q0[i] : bodies.q0[i + 1]]
        v[expansion.vq_of[i]] = state.u[bodies.u0[i] + 6 : bodies.u0[i + 1]]
    return x, v


def joint_positions(expansion: Expansion, i: int, d: Array, Q: Array) -> Array:
    """Return the joint positions of body i from d, axes of A, and Q = A_Aᵀ A_B."""
    tree = expansion.tree.tree
    Q0 = zero_rotation_of(expansion.system, expansion.compiled, tree, i)
    chain = chain_of(tree, i, Q0)
    turning = [each for each in chain if each.turn != 0.0 and each.kind not in (TRANSLATION, ROTATION)]
    M = Q @ Q0.T  # product of the rotations about axes of A at zero coordinates, one after the other
    angles = {}
    if len(turning) == 1:
        x, y, _ = turning[0].axes.T
        angles[turning[0].first] = np.arctan2(y @ M @ x - x @ M @ y, x @ M @ x + y @ M @ y) / turning[0].turn
    elif len(turning) == 2:  # perpendicular axes: M e_2 rotates with the first, Mᵀ e_1 opposite to the second
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
    """Return the angle about an axis from a to b, both of which are normal to the axis."""
    return float(np.arctan2(axis @ np.cross(a, b), a @ b))
