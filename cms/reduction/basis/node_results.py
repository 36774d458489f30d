"""Motion of nodes and interfaces, whether their dofs are in the body or only in its mesh, and stress at nodes."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from cms.body.kept_points import KeptPoints
from cms.body.reduced_body import BodyFrame
from cms.body.stress import PointStress
from cms.errors import BodyError
from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.fe_body import FEBody, Interface, StressPointModel
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import elsewhere, in_memory
from fe_models.foundation.tall.on_disk import is_on_disk, release, zeros_like

__all__ = [
    "ReferenceMotion",
    "are_spread",
    "interface_node_motion",
    "kept_points",
    "nodal_stress_modes",
    "node_motion",
    "node_weights",
    "point_stress_modes",
    "reference_motion",
    "translation_rows",
    "turned_stress",
    "weighted_rigid_modes",
]


def node_motion(body: FEBody, node: int) -> sp.csr_array | None:
    """Return translation and rotation of a node as rows over u, (6, n_dof); None if one of its six dofs is missing."""
    rows = np.flatnonzero((body.dofs[:, 0] == node) & (body.dofs[:, 1] >= 0))
    if len(rows) == 6:
        return sp.csr_array((np.ones(6), (body.dofs[rows, 1], rows)), shape=(6, body.n_dof))
    if body.recovery is None:
        return None
    dofs = body.recovery.dofs
    rows = np.flatnonzero((dofs[:, 0] == node) & (dofs[:, 1] >= 0))
    return sp.csr_array(body.recovery.matrix[rows[np.argsort(dofs[rows, 1])]]) if len(rows) == 6 else None


def interface_node_motion(body: FEBody, interface: Interface) -> sp.csr_array | None:
    """Return the motion of the reference point that a member with six components moves rigidly, (6, n_dof).

    This is for a rigid interface or one with a single node; None if there is no such node.
    """
    if interface.kind == "distributing" or (interface.kind == "nodes" and len(interface.nodes) > 1):
        return None
    motion = node_motion(body, int(interface.nodes[0]))
    if motion is None:
        return None
    transport = np.eye(6)
    transport[:3] = rigid_motion_of_points(interface.reference[None], body.nodes[interface.nodes[0]])[0]
    return sp.csr_array(sp.csr_array(transport) @ motion)


class ReferenceMotion(NamedTuple):
    """Motion of the reference point of an interface."""

    rows: sp.csr_array  #: translation and rotation of the point over the dofs of the body, mesh axes, (6, n_dof)
    point: Array  #: position of the point, (3,) [m]
    has_rotation: bool = True  #: whether the motion includes a rotation; otherwise rows 3-5 are zero
    is_mean: bool = False  #: whether the point moves as the mean of several members, because no single node moves it


def reference_motion(body: FEBody, interface: Interface) -> ReferenceMotion:
    """Return the motion of the reference point of an interface.

    It is the motion of the reference node, or of a member with six components that moves it rigidly, or else the
    weighted mean motion of the members. If the members are collinear, it is their mean translation.
    """
    dofs = interface.dofs
    if dofs is None:
        raise BodyError(f"body {body.name!r}: interface {interface.name!r} is not coupled; call cms.couple(body)")
    if len(dofs) == 6 and len(np.unique(body.dofs[dofs, 0])) == 1:
        rows = sp.csr_array((np.ones(6), (np.arange(6), dofs)), shape=(6, body.n_dof))
        return ReferenceMotion(rows, body.nodes[body.dofs[dofs[0], 0]])
    carried = interface_node_motion(body, interface)
    if carried is not None:
        return ReferenceMotion(carried, interface.reference)
    points, weights = body.nodes[interface.nodes], np.asarray(interface.weights)
    has_rotation = are_spread(points)
    mean = mean_motion(points, weights, interface.reference) if has_rotation else mean_translation(weights)
    rows = sp.csr_array(sp.csr_array(mean) @ translation_rows(body, interface.nodes))
    return ReferenceMotion(rows, interface.reference, has_rotation, is_mean=True)


def translation_rows(body: FEBody, nodes: IntArray) -> sp.csr_array:
    """Return the translations of nodes, node-major, as rows over the dofs, (3 n, n_dof); zero without dofs."""
    n = len(nodes)
    place = np.full(len(body.nodes), -1, np.int64)
    place[nodes] = np.arange(n)
    rows = sp.csr_array((3 * n, body.n_dof))
    sources = [(body.dofs, None)] if body.recovery is None else [(body.recovery.dofs, body.recovery.matrix)]
    if body.recovery is not None:
        of_mesh = np.isin(body.dofs[:, 0], body.recovery.dofs[:, 0])
        # reference nodes, which the mesh does not have
        sources.append((np.where(of_mesh[:, None], -1, body.dofs), None))
    for dofs, matrix in sources:
        chosen = np.flatnonzero((dofs[:, 1] >= 0) & (dofs[:, 1] < 3) & (place[dofs[:, 0]] >= 0))
        target = 3 * place[dofs[chosen, 0]] + dofs[chosen, 1]
        placement = sp.csr_array((np.ones(len(chosen)), (target, np.arange(len(chosen)))), shape=(3 * n, len(chosen)))
        if matrix is None:
            own = sp.csr_array(
                (np.ones(len(chosen)), (np.arange(len(chosen)), chosen)), shape=(len(chosen), body.n_dof)
            )
        else:
            own = matrix[chosen]
        rows = sp.csr_array(rows + placement @ own)
    return rows


def are_spread(points: Array) -> bool:
    """Return whether the points are not collinear, so that a mean rotation exists."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(len(points) >= 3 and spread[1] > 1e-6 * spread[0])


def mean_translation(weights: Array) -> Array:
    """Return the matrix of the weighted mean translation of points, (6, 3 n_points), node-major, without rotation."""
    translation = np.kron(weights, np.eye(3))
    return np.vstack([translation, np.zeros_like(translation)])


# rotations of the kept nodes, over the shapes -------------------------------------------------------------------------


def kept_points(body: FEBody, Phi: Array, axes: Array, row_of: IntArray) -> KeptPoints:
    """Return the kept points of a body, with their rotations.

    (1) if all three rotations of the node are dofs (beams, shells, leaders of rigid groups): these dofs
    (2) else, if the elements provide the rotation: half the curl of the displacement
        (`fe_models.elements.solids.body`)
    (3) else the rotations that are dofs, and zero for the others, as in a plane model; if no rotation is a dof, the
        rotation is unknown

    Parameters
    ----------
    body
        Coupled body.
    Phi
        Shapes over the dofs of the body, (n_dof, n_q).
    axes
        Axes of B as columns, in mesh axes, (3, 3).
    row_of
        Row of every node among the kept nodes, (n_nodes,).
    """
    nodes = body.kept
    Phi = in_memory(Phi)
    u = body.mesh_displacement(Phi)
    rotation, has = rotations_of_dofs(body, Phi, u, nodes)
    source = np.where(has.any(axis=1), "dofs", "unknown").astype(object)
    ask = np.flatnonzero(~has.all(axis=1))
    if len(ask) and body.element_model is not None:
        own = body.element_model.nodal_rotation(u, nodes[ask])
        known = np.isfinite(own).all(axis=(1, 2))
        rotation[ask[known]], source[ask[known]] = own[known], "elements"
    order = np.argsort(row_of[nodes])
    in_body = np.einsum("ba,nbk->nak", axes, rotation)
    return KeptPoints(row_of[nodes][order], in_body[order], tuple(str(word) for word in source[order]))


def rotations_of_dofs(body: FEBody, Phi: Array, u: Array, nodes: IntArray) -> tuple[Array, np.ndarray]:
    """Return the rotation dofs, (n, 3, n_q), zero where there is none, and whether each is a dof, (n, 3) bool.

    A recovery row without entries provides no motion: its rotation had no stiffness and was removed from the model.
    """
    place = np.full(len(body.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    rotation, has = np.zeros((len(nodes), 3, Phi.shape[1])), np.zeros((len(nodes), 3), dtype=bool)
    tables = [(body.dofs, Phi, np.ones(len(body.dofs), dtype=bool))]
    if body.recovery is not None:
        is_motion = np.diff(body.recovery.matrix.tocsr().indptr) > 0
        tables.insert(0, (body.recovery.dofs, u, is_motion))
    for dofs, values, is_motion in tables:
        rows = np.flatnonzero((dofs[:, 1] >= 3) & (place[dofs[:, 0]] >= 0) & is_motion)
        at, component = place[dofs[rows, 0]], dofs[rows, 1] - 3
        rotation[at, component], has[at, component] = values[rows], True
    return rotation, has


# sums over the nodes of a body, weighted with nodal volume: the norm of a Buckens frame (theory.md §4) ----------------


def node_weights(body: FEBody) -> Array:
    """Return the weight of each node, (n_nodes,): its volume, or 1; 0 if a translation is not a dof of the node.

    Reference nodes of couplings have weight 0, because they represent no material.
    """
    dofs = body.to_mesh.dofs
    has = np.zeros((len(body.nodes), 3), dtype=bool)
    translation = dofs[(dofs[:, 1] >= 0) & (dofs[:, 1] < 3)]
    has[translation[:, 0], translation[:, 1]] = True
    weights = np.ones(len(body.nodes)) if body.node_volumes is None else np.asarray(body.node_volumes)
    return np.where(has.all(axis=1), weights, 0.0)


def weighted_rigid_modes(body: FEBody, origin: Array) -> Array | None:
    """Return W Psi_R over the dofs of the body, (n_dof, 6); (W Psi_R)ᵀ u gives weighted sums of columns u.

    The result is None if there is no Buckens frame: too few nodes have three translations, or they are collinear.
    """
    weights, dofs = node_weights(body), body.to_mesh.dofs
    used = weights > 0
    points = body.nodes[used]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if used.sum() > 2 else np.zeros(3)
    if spread[1] <= 1e-8 * spread[0]:
        return None
    motion = rigid_motion_of_points(body.nodes, origin)
    node, component = dofs.T
    rows = np.flatnonzero((component >= 0) & (component < 3))
    on_mesh = np.zeros((len(dofs), 6))
    on_mesh[rows] = weights[node[rows], None] * motion[node[rows], component[rows]]
    return on_mesh if body.recovery is None else np.asarray(body.recovery.matrix.T @ on_mesh)


# stress of shapes at nodes and at named points ------------------------------------------------------------------------


FEWEST = 16  #: smallest number of columns processed at a time
FEWEST_OF_RANKS = 4  #: smallest number of distributed columns processed at a time; they belong to large bodies
BYTES_AT_ONCE = 512e6  #: memory for the stress at all nodes, before the kept nodes are selected
BYTES_FROM_DISK = (
    64e6  #: memory limit if columns are on disk or distributed; columns and stress together take five times as much
)


def nodal_stress_modes(body: FEBody, Phi: Array, nodes: IntArray, axes: Array) -> Array | None:
    """Return the stress of the shapes at given nodes in axes of B, (n, 6, n_q) [Pa per unit]; None if unknown.

    Parameters
    ----------
    body
        Body, coupled or not.
    Phi
        Shapes over the dofs of the body, (n_dof, n_q).
    nodes
        Indices into `FEBody.nodes`, (n,). Reference nodes are not in the mesh; their stress is zero.
    axes
        Axes of B as columns, in mesh axes, (3, 3).
    """
    model = body.element_model
    if model is None or not model.has_nodal_stress:
        return None
    modes = zeros_like(Phi, (len(nodes), 6, Phi.shape[1]))
    is_on_ranks = elsewhere(Phi) is not None
    room = BYTES_FROM_DISK if is_on_ranks or is_on_disk(Phi) else BYTES_AT_ONCE
    fewest = FEWEST_OF_RANKS if is_on_ranks else FEWEST
    # wide blocks, because the geometry is computed once per block
    width = max(fewest, int(room / (48 * len(body.nodes))))
    for begin in range(0, Phi.shape[1], width):
        columns = slice(begin, begin + width)
        everywhere = model.nodal_stress(body.mesh_displacement(in_memory(Phi[:, columns])), nodes=nodes)
        on_mesh = nodes < len(everywhere)
        modes[on_mesh, :, columns] = turned_stress(everywhere[nodes[on_mesh]], axes)
        release(modes)
    return modes


def point_stress_modes(body: FEBody, points: StressPointModel, Phi: Array, frame: BodyFrame) -> PointStress:
    """Return the stress of the shapes at the stress points of the body, in axes of B."""
    modes = points.stress(body.mesh_displacement(in_memory(Phi)))
    positions = (np.asarray(points.positions) - frame.origin) @ frame.axes
    return PointStress(points.names, positions, turned_stress(modes, frame.axes))


def turned_stress(stress: Array, axes: Array) -> Array:
    """Return stress components in rotated axes: Rᵀ sigma R, (n, 6, k), where R = axes has the new axes as columns."""
    if np.array_equal(axes, np.eye(3)):
        return np.asarray(stress)
    tensor = np.asarray(stress)[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
    turned = np.einsum("ia,nijk,jb->nabk", axes, tensor, axes, optimize=True)
    return np.stack([turned[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1)
