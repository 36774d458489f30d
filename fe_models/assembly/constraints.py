"""Linear constraints between components of nodes (rigid groups, mean motions, equations), and their elimination."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError

__all__ = [
    "MeanMotion",
    "NodeEquation",
    "RigidNodes",
    "characteristic_length",
    "eliminated",
    "motion_by_nodes",
    "translation_weights",
    "weighted_motion",
]


# mean motion of points with one weight per component, as in the RBE3 element of Nastran -------------------------------


ALL = (0, 1, 2, 3, 4, 5)
UNDETERMINED = (
    1e-12  #: eigenvalue of the normal matrix, relative to the largest, below which a motion moves no weighted component
)
PART = 1e-6  #: largest share of such a motion in a requested component


def characteristic_length(points: Array, reference: Array) -> float:
    """Return the mean distance of the points from the reference point [m]; 1 if all points coincide with it.

    Nastran multiplies the weights of rotations by the square of this length, so that they compare with those of
    translations. Other programs use other lengths, or ignore the rotations of members.
    """
    length = float(np.linalg.norm(points - reference, axis=1).mean())
    return length if length > 0 else 1.0


def weighted_motion(
    points: Array,
    weights: Array,
    reference: Array,
    *,
    axes: Array | None = None,
    components: tuple[int, ...] = ALL,
    triad: Array | None = None,
) -> Array:
    """Return the rigid motion of a reference point that fits the motion of points best.

    (1) a rigid motion moves point i by u_i = G_i [d; theta], G_i (6, 6), translation and rotation in the axes of i
    (2) minimise Σ w_ic (u_ic - G_i,c [d; theta])², where w_ic is the weight, times L² for rotations
    (3) solve [d; theta] = N⁻¹ Σ G_iᵀ W_i u_i with N = Σ G_iᵀ W_i G_i; L is the mean distance from the reference point

    Parameters
    ----------
    points
        (n, 3) [m].
    weights
        Weights of the translations and rotations of each point, (n, 6) [-]; a component with weight 0 does not take
        part.
    reference
        Reference point, (3,) [m].
    axes
        Axes of the weighted components, as columns, (n, 3, 3); None: mesh axes.
    components
        Requested components of the motion, 0-2 translation, 3-5 rotation.
    triad
        Axes of the requested components, as columns, (3, 3); None: mesh axes.

    Returns
    -------
    Array
        A in (requested components of [d; theta]) = A u, (n_components, 6 n). The columns are the translation and
        rotation of each point in mesh axes.

    Raises
    ------
    BodyError
        If weights are negative, infinite or all zero, or if a requested component moves no weighted component, as for
        points on a line without rotational weights.
    """
    points, weights = np.asarray(points, dtype=float), np.asarray(weights, dtype=float)
    if weights.shape != (len(points), 6):
        raise BodyError(f"weighted motion: expected weights ({len(points)}, 6), got {weights.shape}")
    if not np.isfinite(weights).all() or (weights < 0).any() or not weights.any():
        raise BodyError("weighted motion: expected finite weights of zero or more, and one above zero")
    L = characteristic_length(points, reference)
    G = np.zeros((len(points), 6, 6))  # (1)
    G[:, :3] = rigid_motion_of_points(points, reference)
    G[:, 3:, 3:] = np.eye(3)
    R = np.tile(np.eye(3), (len(points), 1, 1)) if axes is None else np.asarray(axes, dtype=float)
    to_axes = np.zeros((len(points), 6, 6))
    to_axes[:, :3, :3] = to_axes[:, 3:, 3:] = np.swapaxes(R, 1, 2)
    W = weights * np.repeat([1.0, L**2], 3)
    weighted = np.swapaxes(to_axes, 1, 2) @ (W[:, :, None] * to_axes)  # (n, 6, 6), mesh axes
    right = np.einsum("nak,nab->knb", G, weighted).reshape(6, -1)  # (2)
    N = right @ G.reshape(-1, 6)
    scale = np.repeat([1.0, 1 / L], 3)  # rotations are scaled to lengths
    values, vectors = np.linalg.eigh(scale[:, None] * N * scale)
    turned = np.zeros((6, 6))
    turned[:3, :3] = turned[3:, 3:] = np.eye(3) if triad is None else np.asarray(triad, dtype=float).T
    rows = turned[list(components)] @ (scale[:, None] * vectors)
    is_known = values > UNDETERMINED * values[-1]
    if (np.abs(rows[:, ~is_known]) > PART * scale[list(components), None]).any():
        raise BodyError(
            f"weighted motion: {len(points)} points with these weights do not determine the components "
            f"{', '.join(str(c + 1) for c in components)} of the reference point: they lie on a line or at one point; "
            "take more points, weights of their rotations, or fewer components"
        )
    return np.asarray(rows[:, is_known] / values[is_known] @ (vectors[:, is_known].T @ (scale[:, None] * right)))  # (3)


# constraints ----------------------------------------------------------------------------------------------------------


#: share of the largest coefficient of an equation, below which its first component cannot be eliminated
NEGLIGIBLE = 1e-14


@dataclass(frozen=True, eq=False)
class RigidNodes:
    """Nodes that move rigidly with one node, in the given components."""

    name: str
    node: int
    followers: IntArray  #: node index of each follower, (n_followers,)
    components: tuple[int, ...] = ALL


@dataclass(frozen=True, eq=False)
class MeanMotion:
    """Node that follows the weighted mean motion of other nodes (docs/theory.md §1)."""

    name: str
    node: int
    members: IntArray  #: node index of each member, (n_members,)
    weights: Array  #: weights of the translations, (n_members,), or of each component, mesh axes, (n_members, 6)
    components: tuple[int, ...] = ALL


@dataclass(frozen=True)
class NodeEquation:
    """Linear equation Σ coefficient × component = 0; the component of the first term is eliminated."""

    name: str
    terms: tuple[tuple[int, int, float], ...]  #: (node, component, coefficient) of each term


Constraint = RigidNodes | MeanMotion | NodeEquation
#: dependent dof, dofs on which it depends, coefficients, name of the constraint
Row = tuple[int, list[int], list[float], str]


def eliminated(
    constraints: Iterable[Constraint], points: Array, dof_of: IntArray, n_dof: int
) -> tuple[IntArray, sp.csr_array]:
    """Return the dependent dofs, and their rows over all dofs.

    (1) every constraint gives rows u_s = C u for its dependent dofs
    (2) dependent dofs on the right-hand side are substituted until none is left: T = C + C_s C + ..., where C_s holds
        the columns of dependent dofs

    Parameters
    ----------
    constraints
        Constraints in any order.
    points
        Positions of the nodes, (n_nodes, 3) [m].
    dof_of
        Dof of each component of each node, (n_nodes, 6); -1 if the node has no such dof.
    n_dof
        Number of dofs.

    Returns
    -------
    tuple
        Dependent dofs, (n_s,), and T_s, (n_s, n_dof), which is zero in the columns of dependent dofs.

    Raises
    ------
    BodyError
        If two constraints determine one dof, constraints form a loop, or a node lacks a dof.
    """
    rows = [row for constraint in constraints for row in _rows(constraint, points, dof_of)]
    slaves, T = _matrix(rows, n_dof)
    by: dict[int, str] = {}
    for slave, _, _, name in rows:
        if slave in by:
            node, component = (int(i[0]) for i in np.nonzero(dof_of == slave))
            raise BodyError(
                f"constraints: component {component + 1} of node {node} is defined by two of them, {by[slave]} "
                f"and {name}; remove it from one"
            )
        by[slave] = name
    for _ in range(len(rows) + 1):  # (2)
        inner = sp.csr_array(T[:, slaves])
        inner.eliminate_zeros()
        if not inner.nnz:
            return slaves, T
        is_slave = np.zeros(n_dof, dtype=bool)
        is_slave[slaves] = True
        outer = sp.csr_array(T @ sp.diags_array((~is_slave).astype(float)))
        T = sp.csr_array(outer + inner @ T)
        T.eliminate_zeros()
        if abs(T).max() > 1e8:
            break
    raise BodyError(f"constraints: some form a loop, such as {rows[0][3]}; open the loop")


def motion_by_nodes(
    constraints: Iterable[Constraint], nodes: IntArray, points: Array, dof_of: IntArray, n_dof: int
) -> sp.csr_array:
    """Return the map from the motion of nodes that follow others to all dofs, as if these nodes were independent.

    Parameters
    ----------
    constraints
        Constraints for which `eliminated` finds rows.
    nodes
        Nodes that follow others, (n,).
    points, dof_of, n_dof
        As for `eliminated`.

    Returns
    -------
    sparse array
        (n_dof, 6 n). Its columns are the components of the nodes. A node that follows another one moves with it.
    """
    slaves, C = _matrix([row for each in constraints for row in _rows(each, points, dof_of)], n_dof)
    put = sp.csr_array((np.ones(len(slaves)), (slaves, np.arange(len(slaves)))), shape=(n_dof, len(slaves)))
    own = dof_of[nodes].ravel()
    chosen = np.flatnonzero(own >= 0)
    start = sp.csr_array((np.ones(len(chosen)), (own[chosen], chosen)), shape=(n_dof, len(own)))
    owner = np.full(n_dof, -1)
    owner[own[chosen]] = chosen // 6
    motion, moved = start, start
    while moved.nnz:
        moved = sp.coo_array(put @ (C @ moved))
        keep = (owner[moved.row] != moved.col // 6) & (moved.data != 0)  # drops the motion of a node by itself
        moved = sp.csr_array((moved.data[keep], (moved.row[keep], moved.col[keep])), shape=(n_dof, len(own)))
        motion = motion + moved
    return sp.csr_array(motion)


def translation_weights(coupling: MeanMotion) -> Array | None:
    """Return one weight for each member; None if rotations or single components have weights."""
    given = np.asarray(coupling.weights, dtype=float)
    if given.ndim == 1:
        return given
    is_plain = np.array_equal(given[:, :3], np.repeat(given[:, :1], 3, axis=1)) and not given[:, 3:].any()
    return given[:, 0] if is_plain else None


def _matrix(rows: list[Row], n_dof: int) -> tuple[IntArray, sp.csr_array]:
    """Return the dependent dofs, (n_s,), and C of step (1), (n_s, n_dof)."""
    index = np.repeat(np.arange(len(rows)), [len(row[1]) for row in rows])
    columns = np.array([c for row in rows for c in row[1]], dtype=np.int64)
    values = np.array([v for row in rows for v in row[2]])
    C = sp.csr_array((values, (index, columns)), shape=(len(rows), n_dof))
    return np.array([row[0] for row in rows], dtype=np.int64), C


def _rows(constraint: Constraint, points: Array, dof_of: IntArray) -> list[Row]:
    """Return the rows of one constraint: step (1)."""
    makers = {RigidNodes: _rigid, MeanMotion: _mean, NodeEquation: _equation}
    made: list[Row] = makers[type(constraint)](constraint, points, dof_of)  # type: ignore[operator]
    return made


def _rigid(group: RigidNodes, points: Array, dof_of: IntArray) -> list[Row]:
    rows = []
    for node in group.followers.tolist():
        motion = np.eye(6)
        motion[:3] = rigid_motion_of_points(points[node][None], points[group.node])[0]
        for c in group.components:
            if dof_of[node, c] < 0:
                continue
            used = np.flatnonzero(motion[c])
            _require(group.name, group.node, dof_of[group.node, used], used)
            rows.append((int(dof_of[node, c]), dof_of[group.node, used].tolist(), motion[c, used].tolist(), group.name))
    return rows


def _mean(coupling: MeanMotion, points: Array, dof_of: IntArray) -> list[Row]:
    given = np.asarray(coupling.weights, dtype=float)
    each = given[:, None] * [1.0, 1.0, 1.0, 0.0, 0.0, 0.0] if given.ndim == 1 else given
    members, at = np.unique(coupling.members, return_inverse=True)  # a node may be listed once for each weight
    weights = np.zeros((len(members), 6))
    np.add.at(weights, at, each)
    for node, weight in zip(members.tolist(), weights, strict=True):
        used = np.flatnonzero(weight)
        _require(coupling.name, node, dof_of[node, used], used)
    try:
        A = weighted_motion(points[members], weights, points[coupling.node], components=coupling.components)
    except BodyError as error:
        raise BodyError(f"{coupling.name}: {error}") from error
    is_used = weights.ravel() > 0
    columns = dof_of[members].ravel()[is_used].tolist()
    return [
        (int(dof_of[coupling.node, c]), columns, row[is_used].tolist(), coupling.name)
        for c, row in zip(coupling.components, A, strict=True)
        if dof_of[coupling.node, c] >= 0
    ]


def _equation(equation: NodeEquation, points: Array, dof_of: IntArray) -> list[Row]:
    dofs = [int(dof_of[node, component]) for node, component, _ in equation.terms]
    for (node, component, _), dof in zip(equation.terms, dofs, strict=True):
        _require(equation.name, node, np.array([dof]), np.array([component]))
    a = np.array([coefficient for _, _, coefficient in equation.terms])
    if abs(a[0]) <= NEGLIGIBLE * np.abs(a).max():
        raise BodyError(f"{equation.name}: the first coefficient is {a[0]:g}; it must not vanish")
    return [(dofs[0], dofs[1:], (-a[1:] / a[0]).tolist(), equation.name)]


def _require(name: str, node: int, dofs: IntArray, components: Sequence[int] | IntArray) -> None:
    missing = np.flatnonzero(np.asarray(dofs) < 0)
    if missing.size:
        component = int(np.asarray(components)[missing[0] % len(components)])
        raise BodyError(
            f"{name}: node {node} has no dof for component {component + 1}; nodes of solids have no rotations"
        )
