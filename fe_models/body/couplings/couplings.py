"""Couplings: interfaces with many nodes get boundary dofs. FEBody in, FEBody out (docs/theory.md §1).

A rigid interface (RBE2) eliminates its member dofs: u_members = T u_reference. A distributing interface (RBE3) keeps
them: the reference node follows the weighted mean motion of the members, u_reference = A u_members. Six Lagrange
multipliers enforce this; they stay in the body as massless interior dofs. K is then indefinite, but the motions that
satisfy the constraints have positive energy. Eliminating the members instead would fill K with a dense block over all
members.

RBE3 elements of a whole deck that join its parts are constraints of fe_models/assembly/constraints.py.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from fe_models.body.couplings.coupling_on_ranks import spread_extension
from fe_models.body.fe_body import MULTIPLIER, FEBody, Interface, Recovery
from fe_models.body.rigid_motion import rigid_motion_of_dofs, rigid_motion_of_points
from fe_models.errors import InterfaceError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.sparse.submatrix import principal_block

__all__ = ["RoundSurface", "check_overlap", "couple", "mean_motion", "require_spread", "round_surface"]

log = logging.getLogger(__name__)

#: ratio of smallest to largest radius of the members about their line, below which they count as collinear
RANK_TOLERANCE = 1e-6
ROUND = 0.02  #: deviation from a cylinder, relative to its radius, up to which points lie on it
FEWEST_ANGLES = 8  #: fewest points about the axis that make a cylinder; four would be the corners of a box
WIDEST_GAP = np.radians(240.0)  #: largest angle about the axis without points
OFF_AXIS, OFF_MIDDLE = 0.02, 0.05  #: distances of a reference that are noted, relative to the radius and the length


def couple(body: FEBody) -> FEBody:
    """Give every interface of the body its boundary dofs.

    The dofs of the result are, in this order: the mesh dofs that stay; for each rigid or distributing interface the six
    dofs of its reference node (a new node at the end of `nodes`, mesh axes); and the multipliers.

    Parameters
    ----------
    body
        A body with interfaces, not coupled before.

    Raises
    ------
    BodyError
        If two interfaces share a node, or the members of an interface cannot carry a rotation (collinear, too few).
    """
    if body.recovery is not None and body.interfaces and body.is_coupled:
        raise BodyError(f"body {body.name!r}: is coupled already")
    check_overlap(body.interfaces, numbers=body.numbering.nodes)
    todo = [interface for interface in body.interfaces if interface.dofs is None]
    rigid = [interface for interface in todo if interface.kind == "rigid"]
    distributing = [interface for interface in todo if interface.kind == "distributing"]
    for interface in todo:
        without = interface.nodes[~np.isin(interface.nodes, body.dofs[:, 0])]
        if len(without):
            raise BodyError(
                f"body {body.name!r}: interface {interface.name!r}: {len(without)} member nodes have no dofs, first "
                f"node {body.numbering.called(without[0])}: they follow a rigid link; take the node that leads them"
            )
    for interface in (*rigid, *distributing):
        _note_reference(body, interface)
    has_rotation = body.dofs[body.dofs[:, 1] >= 3, 0]
    for interface in (*rigid, *distributing):
        # a single node with rotations has all six motions of a rigid interface
        if interface.kind == "distributing" or not np.isin(interface.nodes, has_rotation).any():
            weights = interface.weights if interface.kind == "distributing" else np.ones(len(interface.nodes))
            require_spread(interface.name, interface.kind, body.nodes[interface.nodes], np.asarray(weights))

    # order of the new dofs: kept mesh dofs | reference nodes | multipliers
    slaves = [_dofs_of(body, interface.nodes) for interface in rigid]
    is_kept = np.ones(body.n_dof, dtype=bool)
    for slave in slaves:
        is_kept[slave] = False
    keep = np.flatnonzero(is_kept)
    references = [*rigid, *distributing]
    first_reference = len(keep)
    first_multiplier = first_reference + 6 * len(references)
    n_new = first_multiplier + 6 * len(distributing)
    reference_node = {interface.name: len(body.nodes) + k for k, interface in enumerate(references)}
    new_dofs = np.concatenate(
        [body.dofs[keep]]
        + [
            np.stack([np.full(6, reference_node[interface.name]), component], axis=1)
            for group, component in ((references, np.arange(6)), (distributing, np.full(6, MULTIPLIER)))
            for interface in group
        ]
    )

    # u_mesh = T u, where T is the identity on kept dofs and the rigid motion of the reference node on slave dofs
    slave_rows = np.concatenate(slaves) if slaves else np.zeros(0, np.int64)
    blocks = [
        rigid_motion_of_dofs(body.nodes, body.dofs[slave], interface.reference)
        for interface, slave in zip(rigid, slaves, strict=True)
    ]
    T_s = sp.block_diag(blocks, format="csr") if blocks else sp.csr_array((0, 0))
    recovery = _recovery_matrix(body.n_dof, keep, slave_rows, T_s, first_reference, n_new)
    n_constrained = n_new - first_reference - T_s.shape[1]
    D = None if body.D is None else _congruence(body.D, keep, slave_rows, T_s, n_constrained)
    new_index = np.full(body.n_dof, -1, np.int64)
    new_index[keep] = np.arange(len(keep))
    constraints = (
        _multiplier_rows(body, distributing, new_index, first_reference + 6 * len(rigid), first_multiplier, n_new)
        if distributing
        else None
    )
    K = _congruence(body.K, keep, slave_rows, T_s, n_constrained, constraints)
    M = _congruence(body.M, keep, slave_rows, T_s, n_constrained)

    boundary = {interface.name: first_reference + 6 * k + np.arange(6) for k, interface in enumerate(references)}
    for interface in todo:
        if interface.kind == "nodes":
            boundary[interface.name] = new_index[_dofs_of(body, interface.nodes)]
    interfaces = tuple(
        replace(
            interface, dofs=boundary.get(interface.name, None if interface.dofs is None else new_index[interface.dofs])
        )
        for interface in body.interfaces
    )
    return replace(
        body,
        M=M,
        K=K,
        D=D,
        dofs=new_dofs,
        interfaces=interfaces,
        nodes=np.concatenate([body.nodes, *[interface.reference[None] for interface in references]]),
        node_volumes=None
        if body.node_volumes is None
        else np.concatenate([body.node_volumes, np.zeros(len(references))]),
        numbering=body.numbering.with_nodes_added(len(references)),
        recovery=Recovery(recovery, body.dofs, body.layout)
        if body.recovery is None
        else replace(body.recovery, matrix=sp.csr_array(body.recovery.matrix @ recovery)),
        load_cases=tuple(replace(case, f=recovery.T @ case.f) for case in body.load_cases),
        ties=tuple(tie.changed(recovery, new_index) for tie in body.ties),
    )


class RoundSurface(NamedTuple):
    """A cylinder, or a part of its circumference, on which the nodes of an interface lie."""

    middle: Array  #: point on the axis in the middle of the length, (3,) [m]
    axis: Array  #: unit vector along the axis, (3,)
    radius: float  #: [m]
    length: float  #: extent of the nodes along the axis [m]


def round_surface(points: Array) -> RoundSurface | None:
    """Return the cylinder on which points lie; None if they lie on none, or cover less than a third of its turn.

    The axis of a cylinder, and of a part of it that is symmetric, is a principal axis of the points. For each of these
    axes a circle is fitted to the points seen along it, by linear least squares.

    Parameters
    ----------
    points
        Positions, (n, 3) [m].
    """
    center = points.mean(axis=0)
    for axis, *across in (np.roll(np.linalg.eigh(np.cov((points - center).T))[1].T, -k, axis=0) for k in range(3)):
        plane, along = (points - center) @ np.array(across).T, (points - center) @ axis
        fit, _, rank, _ = np.linalg.lstsq(np.column_stack([2 * plane, np.ones(len(plane))]), (plane**2).sum(axis=1))
        arms = plane - fit[:2]
        radius = float(np.sqrt(max(fit[2] + fit[:2] @ fit[:2], 0.0)))
        if rank < 3 or np.abs(np.linalg.norm(arms, axis=1) - radius).max() > ROUND * radius:
            continue
        angles = np.unique(np.round(np.arctan2(arms[:, 1], arms[:, 0]), 2))
        gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
        if len(angles) >= FEWEST_ANGLES and gaps.max() < WIDEST_GAP:
            middle = center + fit[:2] @ np.array(across) + 0.5 * (along.max() + along.min()) * axis
            return RoundSurface(middle, axis, radius, float(np.ptp(along)))
    return None


def _note_reference(body: FEBody, interface: Interface) -> None:
    """Log a warning if the nodes of an interface lie on a cylinder and its reference not in the middle of its axis."""
    if len(interface.nodes) < FEWEST_ANGLES or (found := round_surface(body.nodes[interface.nodes])) is None:
        return
    arm = interface.reference - found.middle
    from_middle = abs(float(arm @ found.axis))
    from_axis = float(np.linalg.norm(arm - (arm @ found.axis) * found.axis))
    places = []
    if from_axis > OFF_AXIS * found.radius:
        places.append(f"{from_axis:.3g} off its axis")
    if from_middle > OFF_MIDDLE * found.length + OFF_AXIS * found.radius:
        places.append(f"{from_middle:.3g} from the middle of its length")
    if places:
        middle = ", ".join(f"{number:.6g}" for number in found.middle)
        log.warning(
            "body %r: interface %r: its nodes lie on a cylinder of radius %.4g, its reference point lies %s; joints "
            "and forces act at the reference: set reference = [%s] if they belong in the middle of the cylinder",
            body.name, interface.name, found.radius, " and ".join(places), middle,
        )  # fmt: skip


def mean_motion(points: Array, weights: Array, reference: Array) -> Array:
    """Return the weighted mean motion of points: the best-fitting rigid motion of the reference point (RBE3).

    Minimising Σ w_i |u_i - d - theta × (c_i - reference)|² gives [d; theta] = (Σ w GᵀG)⁻¹ Σ w Gᵀ u.

    Parameters
    ----------
    points
        Positions, (n_points, 3) [m].
    weights
        Weight of each point, (n_points,) [-].
    reference
        Reference point, (3,) [m].

    Returns
    -------
    Array
        A in [d; theta] = A u, (6, 3 n_points), columns node-major.
    """
    G = rigid_motion_of_points(points, reference)  # (n, 3, 6)
    weighted = weights[:, None, None] * G
    N = np.einsum("nak,nal->kl", weighted, G)
    return np.linalg.solve(N, weighted.reshape(-1, 6).T)


def _dofs_of(body: FEBody, nodes: IntArray) -> IntArray:
    """Return all dofs of these nodes, node by node in component order."""
    place = np.full(len(body.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    at = place[body.dofs[:, 0]]
    own = np.flatnonzero(at >= 0)
    return own[np.lexsort((body.dofs[own, 1], at[own]))]


def _recovery_matrix(
    n_dof: int, keep: IntArray, slave_rows: IntArray, T_s: sp.csr_array, first_reference: int, n_new: int
) -> sp.csr_array:
    T_s = sp.coo_array(T_s)
    rows = np.concatenate([keep, slave_rows[T_s.row]])
    columns = np.concatenate([np.arange(len(keep)), first_reference + T_s.col])
    values = np.concatenate([np.ones(len(keep)), T_s.data])
    return sp.csr_array((values, (rows, columns)), shape=(n_dof, n_new))


def _congruence(
    A: sp.csc_array,
    keep: IntArray,
    slave_rows: IntArray,
    T_s: sp.csr_array,
    n_more: int,
    more: sp.csc_array | None = None,
) -> sp.csc_array:
    """Return Tᵀ A T + more with T = [1 0; 0 T_s], extended by n_more empty rows and columns.

    The kept block is cut out in one pass, and the few new rows and columns are added. The product with the whole T
    would read all of A three times. A distributed matrix stays distributed.
    """
    n_new = len(keep) + T_s.shape[1] + n_more
    new = _reference_entries(A, keep, slave_rows, T_s, n_new) if len(slave_rows) else None
    if not sp.issparse(A):
        return spread_extension(A, keep, sum((B for B in (new, more) if B is not None), sp.csc_array((n_new, n_new))))
    A_kk = principal_block(A, keep)
    indptr = np.append(A_kk.indptr, np.full(n_new - len(keep), A_kk.indptr[-1], A_kk.indptr.dtype))  # empty columns
    result = sp.csc_array((A_kk.data, A_kk.indices, indptr), shape=(n_new, n_new))
    for B in (new, more):
        if B is not None:
            result = sp.csc_array(result + B)
    return result


def _reference_entries(
    A: sp.csc_array, keep: IntArray, slave_rows: IntArray, T_s: sp.csr_array, n_new: int
) -> sp.csc_array:
    """Return the rows and columns of the reference nodes in the coupled matrix, (n_new, n_new)."""
    n_kept = len(keep)
    A_slave = sp.csr_array(A[:, slave_rows] @ T_s)  # (n_dof, 6 n_rigid)
    A_kr = sp.coo_array(A_slave[keep])
    A_rr = sp.coo_array(T_s.T @ A_slave[slave_rows])
    half = sp.coo_array(
        (
            np.concatenate([A_kr.data, A_rr.data / 2]),
            (np.concatenate([A_kr.row, n_kept + A_rr.row]), n_kept + np.concatenate([A_kr.col, A_rr.col])),
        ),
        shape=(n_new, n_new),
    ).tocsc()
    return sp.csc_array(half + half.T)


def _multiplier_rows(
    body: FEBody,
    distributing: list[Interface],
    new_index: IntArray,
    first_reference: int,
    first_multiplier: int,
    n_new: int,
) -> sp.csc_array:
    """Return [[0, Cᵀ], [C, 0]] of the constraints C u = A u_members - u_reference = 0, scaled to the size of K.

    The scale is the stiffness of the members. The rotation rows are scaled to lengths (theta times the radius of the
    interface), so that the pivots of the factorisation stay comparable.
    """
    rows, columns, values = [], [], []
    for k, interface in enumerate(distributing):
        where = f"body {body.name!r}: interface {interface.name!r}"
        members = _dofs_of(body, interface.nodes)
        members = members[(body.dofs[members, 1] >= 0) & (body.dofs[members, 1] < 3)]
        if len(members) != 3 * len(interface.nodes):
            raise BodyError(
                f"{where}: expected three translational dofs at every member node, got {len(members)} at "
                f"{len(interface.nodes)} nodes"
            )
        if (new_index[members] < 0).any():
            raise BodyError(f"{where}: shares nodes with a rigid interface")
        points = body.nodes[interface.nodes]
        A = mean_motion(points, np.asarray(interface.weights), interface.reference)
        radius = float(
            np.sqrt(np.average(((points - points.mean(axis=0)) ** 2).sum(axis=1), weights=interface.weights))
        )
        scale = np.repeat([1.0, radius], 3) * float(body.K.diagonal()[members].mean())
        C = scale[:, None] * np.hstack([A, -np.eye(6)])
        dofs = np.concatenate([new_index[members], first_reference + 6 * k + np.arange(6)])
        row, column = np.nonzero(C)
        rows.append(first_multiplier + 6 * k + row)
        columns.append(dofs[column])
        values.append(C[row, column])
    row, column, value = np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
    C = sp.csc_array((value, (row, column)), shape=(n_new, n_new))
    return sp.csc_array(C + C.T)


def check_overlap(interfaces: Sequence[Interface], *, numbers: IntArray | None = None) -> None:
    """Raise `InterfaceError` if two interfaces have the same name or share nodes; the message names pairs and counts.

    Parameters
    ----------
    interfaces
        All interfaces of one body.
    numbers
        The user's numbers of the nodes for the message, (n_nodes,); None or empty: the message uses indices.
    """
    shared = []
    for first, second in combinations(interfaces, 2):
        if first.name == second.name:
            raise InterfaceError(f"interfaces: two are named {first.name!r}; give each its own name")
        common = np.intersect1d(first.nodes, second.nodes)
        if common.size:
            node = common[0] if numbers is None or not numbers.size else numbers[common[0]]
            shared.append(f"{first.name!r} and {second.name!r} share {common.size} nodes (first node {node})")
    if shared:
        raise InterfaceError(
            f"interfaces: {'; '.join(shared)}; a node can follow only one interface: make the "
            f"selections smaller, or join the two interfaces to one"
        )


def require_spread(name: str, kind: str, positions: Array, weights: Array) -> None:
    """Raise `InterfaceError` unless the weighted points span a plane: two radii of gyration above zero."""
    where = f"interface {name!r}: {kind}"
    weighted = positions[weights > 0]
    if len(weighted) < 3:
        raise InterfaceError(
            f"{where}: expected at least 3 nodes that are not on one line, got {len(weighted)}; a "
            f"single node carries no rotation: use kind 'nodes', or select more"
        )
    w = weights[weights > 0] / weights.sum()
    radii = np.linalg.svd(np.sqrt(w)[:, None] * (weighted - w @ weighted), compute_uv=False)
    if radii[0] == 0:
        raise InterfaceError(f"{where}: its {len(weighted)} nodes are all at one place; merge coincident nodes")
    if radii[1] <= RANK_TOLERANCE * radii[0]:
        raise InterfaceError(
            f"{where}: its {len(weighted)} nodes lie on one line (widths {radii[1]:.2g} and "
            f"{radii[0]:.2g}), so the rotation about it is free; select nodes beside the line"
        )
