"""Geometric stiffness of a reduced body from its elements: one static solution and matrix per unit load (theory.md §7).

(1) balance the unit loads f_j with the support of the frame: P f_j (`cms.reduction.geometric_stiffness.unit_states`)
(2) compute static states u_j = G_R P f_j with the factorisation of the mode set; only their stress counts
(3) compute Phiᵀ K_geo(sigma_j) Phi of the elements, also for rotations of the body, as needed for other frames
(4) add rigid links: forces on followers (internal minus applied) do work on their second-order motion, and on the
    second-order motion of nodes inside the body that follow the mean of others; multipliers of distributing interfaces
    inside the body do work on the second-order gap that they close
(5) add interfaces that follow the mean of their members: the applied loads do work on the second-order mean motion
"""

import numpy as np
import scipy.sparse as sp

from cms.body.geometric_stiffness import GeometricStiffness, stiffness_of_loads
from cms.modes.families.families import Families, body_of
from cms.reduction.basis.frames import FrameCondition
from cms.reduction.basis.node_results import reference_motion, translation_rows
from cms.reduction.geometric_stiffness.unit_states import UnitStates, turned_rigid_work, unit_states
from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs, rotation_work
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import beside, rows_times

__all__ = [
    "elastic_part",
    "link_work",
    "mean_second_order",
    "reduced_geometric_stiffness",
    "stiffness_of_states",
]


# mean work ------------------------------------------------------------------------------------------------------------
# Second-order mean motion, which a linear distributing interface neglects when its members rotate (theory.md §7).
#
# The mean motion of members is the rigid motion that fits theirs best in least squares with weights w. With positions x
# from their weighted centre and displacements v, Σ w (x + v) × (R x) = 0. To first order J theta = Σ w x × v with J = Σ
# w (x² 1 - x xᵀ). To second order, in addition to the linear mean of the second-order motion of the members,
#
#     J gamma_kl = -Σ w { v_k × (theta_l × x) + v_l × (theta_k × x)
#                         + ½ x × [theta_k × (theta_l × x) + theta_l × (theta_k × x)] }
#
# The reference point, at a lever rho from the centre, moves by gamma × rho and by the second-order part of theta × rho.


def mean_second_order(points: Array, weights: Array, reference: Array, v: Array, *, turns: bool = True) -> Array:
    """Return the bilinear second-order translation and rotation of the reference point, (6, n, n).

    Parameters
    ----------
    points
        Undeformed positions of the members, (m, 3) [m].
    weights
        Weights with sum 1, (m,).
    reference
        Reference point, (3,) [m].
    v
        Translations of the members, (m, 3, n) [m].
    turns
        False: the members are collinear, so their mean has no rotation and the second-order motion is zero.
    """
    n = v.shape[2]
    gamma = np.zeros((6, n, n))
    if not turns:
        return gamma
    center = weights @ points
    x = points - center
    C = np.einsum("i,ia,ib->ab", weights, x, x)
    X = np.einsum("i,ia,ibk->kab", weights, x, v)  # Σ w x vᵀ
    J = np.trace(C) * np.eye(3) - C
    moment = np.stack([X[:, 1, 2] - X[:, 2, 1], X[:, 2, 0] - X[:, 0, 2], X[:, 0, 1] - X[:, 1, 0]])  # Σ w x × v
    theta = np.linalg.solve(J, moment)  # (3, n)
    # v_k × (theta_l × x) = theta_l (v_k·x) - x (v_k·theta_l);  x × (theta_k × (theta_l × x)) = (x × theta_l)(x·theta_k)
    half = np.einsum("al,kbb->akl", theta, X) - np.einsum("kab,bl->akl", X, theta)
    half = half + np.cross((C @ theta)[:, :, None], theta[:, None, :], axis=0) / 2
    gamma[3:] = -np.einsum("ab,bkl->akl", np.linalg.inv(J), half + half.transpose(0, 2, 1))
    rho = reference - center
    gamma[:3] = np.cross(gamma[3:], rho[:, None, None], axis=0)
    for a in range(3):
        gamma[a] += theta.T @ rotation_work(np.outer(np.eye(3)[a], rho)) @ theta
    return gamma


# geometric reduction --------------------------------------------------------------------------------------------------


COLLINEAR = 1e-12  #: ratio of the second largest spread of members to the largest, below which they are collinear
LOADS_AT_ONCE = 60  #: number of loads whose mesh displacements are in memory at a time


def reduced_geometric_stiffness(body: FEBody | Families, Phi: Array, condition: FrameCondition) -> GeometricStiffness:
    """Return the geometric stiffness of shapes for all unit loads of a body frame.

    Parameters
    ----------
    body
        A coupled body with an element model, or its `Families`.
    Phi
        Shapes over the dofs of the body that satisfy the condition of the frame, (n_dof, n_q).
    condition
        Frame condition, which is also the support of all loads.

    Raises
    ------
    BodyError
        If the body has no element model with geometric stiffness.
    """
    return stiffness_of_states(body_of(body), Phi, unit_states(body, frame=condition))


def stiffness_of_states(body: FEBody, Phi: Array, states: UnitStates) -> GeometricStiffness:
    """Steps (3) to (5) for the static states of the unit loads; the factorisation is no longer needed.

    The matrices are computed over shapes and rotations about the axes of B; the mixed part becomes `RotatedLoads`.
    """
    frame = states.condition.frame
    rotations = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin)[:, 3:] @ frame.axes
    columns = beside(rotations, Phi)
    K = np.zeros((states.mass.k, columns.shape[1], columns.shape[1]))
    for first in range(0, len(states.loaded), LOADS_AT_ONCE):
        some = slice(first, first + LOADS_AT_ONCE)
        loads = states.loaded[some]
        mass = MassLoads(states.mass.A[loads], states.mass.b[loads])
        K[loads] = elastic_part(body, states.u[:, some], mass, columns)
    K -= mean_part(body, states.on_dofs, columns, frame.axes, states.interfaces)
    turned = (K[:, :3, 3:] + K[:, 3:, :3].transpose(0, 2, 1)) / 2
    rigid = None if states.spread is None else turned_rigid_work(body, states.spread, frame)
    names = {interface.name for interface in states.interfaces}
    is_loaded = tuple(interface.name in names for interface in body.interfaces)
    return stiffness_of_loads(K[:, 3:, 3:], turned, rigid, is_loaded=is_loaded)


def elastic_part(body: FEBody, u: Array, mass: MassLoads, Phi: Array) -> Array:
    """Return the result of steps (3) and (4) for static states u, (n_dof, k), under loads per unit mass, (k, n, n)."""
    model = body.element_model
    assert model is not None
    u_mesh = body.mesh_displacement(u)
    K = model.geometric_stiffness(u_mesh, mass, body.mesh_displacement(Phi))
    if body.ties:
        K = K + tie_part(body, u, Phi)
    if body.recovery is None:
        return K
    T, dofs = body.recovery.matrix, body.recovery.dofs
    nodes = dofs[_levers(T, dofs, body.dofs).row, 0]  # nodes whose translation follows a rotation
    of_means = [dofs[np.unique(mean.follows.tocoo().row), 0] for mean in body.mean_nodes]
    asked = np.unique(np.concatenate([nodes, *of_means]))
    if not len(asked):
        return K
    forces = model.internal_forces(u_mesh, nodes=asked) - model.mass_forces(mass)
    work = link_work(T, dofs, body.dofs, forces, Phi)
    return K + (work + mean_nodes_part(body, forces, Phi) if body.mean_nodes else work)


def mean_nodes_part(body: FEBody, forces: Array, Phi: Array) -> Array:
    """Return the work of forces on the mesh dofs on the second-order motion of nodes that follow a mean, (k, n, n).

    The second-order work has three parts: (1) forces on the node, which moves as the second-order mean of its members;
    (2) forces on its own followers, which also move by their levers; (3) forces passed to members that follow leaders,
    because the node moves by the linear mean of their second-order motion. In the matrix to the mesh these links appear
    as levers from the leaders to the node, which is correct only for its translation, so their work is subtracted.
    """
    K = np.zeros((forces.shape[1], Phi.shape[1], Phi.shape[1]))
    six = np.stack([np.zeros(6, np.int64), np.arange(6)], axis=1)
    dofs = body.to_mesh.dofs
    for mean in body.mean_nodes:
        points, weights = body.nodes[mean.members], np.asarray(mean.weights)
        x = points - weights @ points
        spread = np.linalg.eigvalsh(np.einsum("i,ia,ib->ab", weights, x, x))
        if not spread[1] > COLLINEAR * spread[2]:  # collinear members have no mean rotation
            continue
        rows = translation_rows(body, mean.members)
        v = rows_times(rows, Phi)
        gamma = mean_second_order(points, weights, mean.reference, v.reshape(len(points), 3, -1))
        F = mean.follows.T @ forces
        K += np.einsum("cj,ckl->jkl", F, gamma, optimize=True)  # (1)
        A = mean_motion(points, weights, mean.reference)
        K += link_work(mean.follows, dofs, six, forces, A @ v)  # (2)
        of_rows = np.stack(np.divmod(np.arange(3 * len(points)), 3), axis=1)
        K += link_work(rows, of_rows, body.dofs, A.T @ F, Phi)  # (3)
        K -= link_work(sp.csr_array(mean.follows @ sp.csr_array(A @ rows)), dofs, body.dofs, forces, Phi)
    return K


def tie_part(body: FEBody, u: Array, Phi: Array) -> Array:
    """Return the work of multipliers on the second-order gap of the ties of a body, (k, n, n).

    The gap is the second-order motion of the reference node, which follows a lever or the members of another interface,
    minus the second-order motion of the mean of the members. A multiplier lambda exerts F = Sᵀ lambda on the gap.
    """
    K = np.zeros((u.shape[1], Phi.shape[1], Phi.shape[1]))
    six = np.stack([np.zeros(6, np.int64), np.arange(6)], axis=1)
    for tie in body.ties:
        F = tie.S.T @ u[tie.multipliers]
        K -= np.einsum("cj,ckl->jkl", F, members_second_order(body, tie.interface, Phi, True), optimize=True)
        if tie.leader is None:
            K += link_work(tie.motion, six, body.dofs, F, Phi)
            continue
        arm = tie.interface.reference - tie.leader.reference
        gamma = members_second_order(body, tie.leader, Phi, True)
        gamma[:3] += np.cross(gamma[3:], arm[:, None, None], axis=0)
        K += np.einsum("cj,ckl->jkl", F, gamma, optimize=True)
        theta = rows_times(tie.motion, Phi)[3:]
        W = rotation_work(F[:3].T[:, :, None] * arm)
        K += np.einsum("ak,jab,bl->jkl", theta, W, theta, optimize=True)
    return K


def mean_part(body: FEBody, on_dofs: Array, Phi: Array, axes: Array, loaded: tuple[Interface, ...]) -> Array:
    """Step (5): return the work of the loads on the second-order motion of the interfaces, (k, n, n).

    A distributing interface transmits the load on its reference node to its members. The other interfaces that are not
    nodes of the body follow several members or a lever. For them, only their own unit loads do such work; these have
    the indices 12 + 6 i + c, where i counts the loaded interfaces.
    """
    work = distributing_part(body, on_dofs, Phi)
    turn = np.kron(np.eye(2), axes)
    for number, interface in enumerate(loaded):
        own = slice(12 + 6 * number, 18 + 6 * number)
        if interface.kind == "distributing":
            continue
        motion = reference_motion(body, interface)
        if motion.is_mean:
            gamma = members_second_order(body, interface, Phi, motion.has_rotation)
            work[own] += np.einsum("cj,ckl->jkl", turn, gamma, optimize=True)
        else:
            six = np.stack([np.zeros(6, np.int64), np.arange(6)], axis=1)
            work[own] += link_work(motion.rows, six, body.dofs, np.asarray(turn, np.float64), Phi)
    return work


def distributing_part(body: FEBody, on_dofs: Array, Phi: Array) -> Array:
    """Return the work of loads on reference nodes that follow the mean of their members, (k, n, n)."""
    n = Phi.shape[1]
    work = np.zeros((on_dofs.shape[1], n, n))
    for interface in body.interfaces:
        if interface.kind == "distributing":
            gamma = members_second_order(body, interface, Phi, reference_motion(body, interface).has_rotation)
            work += np.einsum("cj,ckl->jkl", on_dofs[np.asarray(interface.dofs)], gamma, optimize=True)
    return work


def members_second_order(body: FEBody, interface: Interface, Phi: Array, turns: bool) -> Array:
    """Return the second-order mean motion of the members for the shapes, (6, n, n), mesh axes."""
    rows = translation_rows(body, interface.nodes)
    v = rows_times(rows, Phi).reshape(len(interface.nodes), 3, -1)
    weights = np.asarray(interface.weights)
    return mean_second_order(body.nodes[interface.nodes], weights, interface.reference, v, turns=turns)


# second-order motion of rigid links: a follower away from the axis of a rotation moves to second order (theory.md §7)
# In a recovery u_mesh = T u, the rotation columns hold the lever of every follower: u_s = u + B theta with B = -a~. If
# theta is a rotation vector, the follower also moves by ½ theta × (B theta). Forces on followers do work on this
# motion.


def link_work(T: sp.csr_array, row_dofs: IntArray, column_dofs: IntArray, forces: Array, Phi: Array) -> Array:
    """Return the work of forces on the second-order motion of links, forces·½ [theta_k × (B theta_l) + …], (k, n, n).

    Parameters
    ----------
    T
        Matrix from the dofs of the body to rows, such as the mesh dofs, (n_rows, n_dof).
    row_dofs, column_dofs
        (node, component) of rows and columns, (n_rows, 2) and (n_dof, 2).
    forces
        Forces on the rows, (n_rows, k) [N].
    Phi
        Displacement columns over the dofs of the body, (n_dof, n).
    """
    n_loads, n = forces.shape[1], Phi.shape[1]
    levers = _levers(T, row_dofs, column_dofs)
    components = np.zeros((len(row_dofs) and int(row_dofs[:, 0].max()) + 1, 3, n_loads))
    is_translation = (row_dofs[:, 1] >= 0) & (row_dofs[:, 1] < 3)
    components[row_dofs[is_translation, 0], row_dofs[is_translation, 1]] = forces[is_translation]
    at = components[row_dofs[levers.row, 0]]  # components of the complete node, (n_levers, 3, n_loads)
    is_loaded = at.any(axis=(1, 2))
    row, column, value, at = levers.row[is_loaded], levers.col[is_loaded], levers.data[is_loaded], at[is_loaded]
    masters, index = np.unique(column_dofs[column, 0], return_inverse=True)
    # f·(theta_k × B theta_l) = -theta_kᵀ f~ B theta_l; column c of f~ is f × e_c
    work = -value[:, None, None] * np.cross(at, np.eye(3)[row_dofs[row, 1]][:, :, None], axis=1)
    Q = np.zeros((len(masters), 3, 3, n_loads))
    for a in range(3):
        np.add.at(Q[:, a], (index, column_dofs[column, 1] - 3), work[:, a])
    theta = np.zeros((len(masters), 3, n))
    place = np.searchsorted(masters, column_dofs[:, 0])
    is_theta = (column_dofs[:, 1] >= 3) & np.isin(column_dofs[:, 0], masters)
    theta[place[is_theta], column_dofs[is_theta, 1] - 3] = Phi[is_theta]
    half = np.einsum("mak,mabj,mbl->jkl", theta, Q, theta, optimize=True)
    return np.asarray((half + half.transpose(0, 2, 1)) / 2)


def _levers(T: sp.csr_array, row_dofs: IntArray, column_dofs: IntArray) -> sp.coo_array:
    """Return the matrix entries by which a rotation moves a translation."""
    entries = sp.coo_array(T)
    row, column = row_dofs[entries.row, 1], column_dofs[entries.col, 1]
    chosen = (row >= 0) & (row < 3) & (column >= 3) & (entries.data != 0)
    return sp.coo_array((entries.data[chosen], (entries.row[chosen], entries.col[chosen])), shape=entries.shape)
