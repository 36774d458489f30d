"""Checks of the interfaces of a reduced body: rigid motion of their members, and motions that no mode provides."""

import numpy as np

from cms.assessment.quality.of_body.identities import body_length, mode_size
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.reduced_body import ReducedBody, ReducedInterface
from cms.linear_algebra.elastic_pencil import stiffness_scale
from cms.reduction.free_pencil import port_rows
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array

__all__ = ["check_interface_motions", "check_interface_places", "check_rigid_interfaces", "missing_motions"]

#: ratio of a singular value of the scaled interface motions to the largest one, below which a motion is missing
MISSING = 1e-7


def check_rigid_interfaces(reduced: ReducedBody) -> QualityRecord:
    """Check that members of a rigid interface follow its reference point: Phi_m = Psi_t + Psi_r × (c_m - c)."""
    defects = {
        interface.name: rigid_defect(reduced, interface)
        for interface in reduced.interfaces
        if interface.kind == "rigid" and len(interface.members)
    }
    if not defects or reduced.n_q == 0:
        return information("rigid-interfaces", "the file holds no members of rigid interfaces")
    name = max(defects, key=lambda key: defects[key])
    reason = f"largest departure is {defects[name]:.1e} of a mode's largest displacement, at {name!r}"
    return judge("rigid-interfaces", defects[name], reason, {"defects": defects})


def check_interface_places(reduced: ReducedBody) -> QualityRecord:
    """Check that the reference point of a rigid or distributing interface is a kept node and moves as this node.

    The value is the largest distance divided by the body length, or the largest difference of translations divided by a
    mode's largest displacement. Other programs may omit reference nodes; then there is no verdict.
    """
    defects: dict[str, float] = {}
    length, size = body_length(reduced), mode_size(reduced)
    for interface in reduced.interfaces:
        if interface.kind == "nodes" or not len(reduced.nodes):
            continue
        distance = np.linalg.norm(reduced.nodes - interface.position, axis=1)
        near = np.flatnonzero(distance <= distance.min() * (1 + 1e-9))
        moved = np.abs(reduced.Phi[near] - interface.Psi[:3]).max(axis=1)
        apart = float((moved / size).max(axis=1).min()) if reduced.n_q else 0.0
        defects[interface.name] = max(float(distance.min()) / length, apart)
    if not defects:
        return information("interface-places", "the file keeps no reference nodes of interfaces")
    name = max(defects, key=lambda key: defects[key])
    reason = f"largest departure of a reference point from its node is {defects[name]:.1e}, at {name!r}"
    if "version floatframe" not in reduced.provenance:
        return information("interface-places", f"{reason}; another program may omit these nodes", {"defects": defects})
    return judge("interface-places", defects[name], reason, {"defects": defects})


def rigid_defect(reduced: ReducedBody, interface: ReducedInterface) -> float:
    """Return the largest deviation of the members from rigid motion, over the largest displacement of the mode.

    Stored rotations of members, times the body length, are compared with those of the reference point.
    """
    motion = rigid_motion_of_points(reduced.nodes[interface.members], interface.position) @ interface.Psi
    size = mode_size(reduced)
    largest = float((np.abs(reduced.Phi[interface.members] - motion) / size).max())
    for row in interface.members.tolist() if reduced.kept is not None else ():
        assert reduced.kept is not None
        turn = reduced.kept.of_node(row)
        if turn is None:
            continue
        # rotations of solids are half the curl in their elements, and these deform next to the rigid face
        if reduced.kept.source[int(np.flatnonzero(reduced.kept.nodes == row)[0])] == "dofs":
            largest = max(largest, float((np.abs(turn - interface.Psi[3:]) * body_length(reduced) / size).max()))
    return largest


def check_interface_motions(reduced: ReducedBody) -> QualityRecord:
    """Check that rigid motion and modes can move every interface in six directions, independently of the others."""
    if not reduced.interfaces:
        return information("interface-motions", "the body has no interfaces")
    missing = missing_motions(reduced)
    n = len(missing)
    data = {"directions": missing, "labels": motion_labels(reduced)}
    if n == 0:
        reason = "joints can move every interface in every direction without locking"
    else:
        strongest = np.asarray(motion_labels(reduced))[np.argsort(-np.abs(missing), axis=1)[:, 0]]
        reason = f"{n} combination{'s' if n > 1 else ''} cannot move, mostly {', '.join(dict.fromkeys(strongest))}"
    return judge("interface-motions", float(n), reason, data)


def missing_motions(reduced: ReducedBody) -> Array:
    """Return combinations of interface motions missing in rigid motion and modes, (n_missing, 6 n_interfaces).

    They are the left null space of the matrix that maps rigid and modal coordinates to the motions of all reference
    points. Rotations are multiplied by the body length, and mode k by omega_1 / omega_k, so that a stiff static shape
    is weighted by its compliance.
    """
    length = body_length(reduced)
    stiffness = np.diag(reduced.K)
    weight = np.sqrt(stiffness_scale(reduced.K, reduced.M) / np.where(stiffness > 0, stiffness, np.inf))
    scale = np.tile(np.repeat([1.0, length], 3), len(reduced.interfaces))
    A = scale[:, None] * np.vstack([port_rows(reduced, interface.name) for interface in reduced.interfaces])
    n_r = A.shape[1] - reduced.n_q
    A[:, 3:n_r] /= length
    A[:, :n_r] /= np.sqrt(reduced.moments.m)
    A[:, n_r:] *= weight
    wanted = np.concatenate([provided_rows(interface) for interface in reduced.interfaces])
    row_size = np.linalg.norm(A[wanted], axis=1, keepdims=True)
    U, singular, _ = np.linalg.svd(A[wanted] / np.where(row_size > 0, row_size, 1.0))
    sizes = np.zeros(int(wanted.sum()))
    sizes[: len(singular)] = singular
    null = U[:, sizes < MISSING * sizes.max(initial=1.0)].T
    result = np.zeros((len(null), len(wanted)))
    result[:, wanted] = null
    return result


def provided_rows(interface: ReducedInterface) -> Array:
    """Return which of the six motions an interface has, (6,) bool; an interface of collinear nodes has no rotation."""
    has_rotation = bool(interface.Psi[3:].any()) or interface.kind != "nodes"
    return np.array([True] * 3 + [has_rotation] * 3)


def motion_labels(reduced: ReducedBody) -> tuple[str, ...]:
    """Return a label for each interface motion: 'big_end ux' to 'small_end rz'."""
    return tuple(f"{interface.name} {component}" for interface in reduced.interfaces for component in MOTION_COMPONENTS)
