"""Conversion of the geometric stiffness of a reduced body to another body frame, from its own data (theory.md §7).

A load consists of a load per unit mass A c + b, a wrench at each interface, and amplitudes of six loads distributed
over the nodes. Load and reaction together are balanced. The stress of a balanced load does not depend on the support,
so its matrix is a linear combination of the old matrices, with the coefficients of the load in the old unit loads.

(1) express the unit loads of the new frame in old coordinates
(2) add the reaction of the new frame: a rigid-body acceleration (Tisserand), a wrench at its interface (nodal), or a
    load distributed over the nodes (Buckens)
(3) combine the matrices of the balanced loads from the old ones
(4) transform to the new shapes (phi - Psi_R C) Z; matrix entries between two rotations follow from rotating the loads;
    entries between a rotation and a shape are stored; if they are missing, they are computed in the same way
"""

import logging
import re
from dataclasses import dataclass, replace

import numpy as np

from cms.body.geometric_stiffness import SPIN_PAIRS, GeometricStiffness, RotatedLoads, stiffness_of_loads
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.errors import BodyError
from cms.reduction.geometric_stiffness.unit_states import unit_mass_loads
from fe_models.body.rigid_motion import MassLoads
from fe_models.foundation.arrays import Array, axial

__all__ = ["converted_geometric_stiffness", "require_convertible"]

log = logging.getLogger(__name__)

OF_A_SHELL = re.compile(r"(^|: )shell \d+$")  #: provenance key for the thickness of a shell


@dataclass(frozen=True, eq=False)
class Loads:
    """Set of k loads on a reduced body, in axes of its frame and about its origin."""

    mass: MassLoads
    wrenches: Array  #: force and moment at each loaded interface, (k, n_loaded, 6)
    spread: Array  #: amplitudes of the loads distributed over the nodes, (k, 6); (k, 0) if the body has none


def require_convertible(reduced: ReducedBody, frame: BodyFrame) -> None:
    """Raise `BodyError` if the reaction of the new frame is not a combination of stored unit loads."""
    if reduced.geometric is None or frame.kind == "tisserand":
        return
    names = [interface.name for interface in reduced.interfaces]
    if frame.kind == "nodal" and frame.at and is_node(reduced, frame.at):
        if reduced.geometric.is_loaded[names.index(frame.at)]:
            return
        raise BodyError(
            f"reduced body {reduced.name!r}: the loads at interface {frame.at!r} were left out of its geometric "
            "stiffness, but a nodal frame there has its reaction at it; reduce the body anew with that interface "
            "among geometric_stiffness = [...], or leave the geometric stiffness out (cms frame "
            "--no-geometric-stiffness)"
        )
    if frame.kind == "buckens" and reduced.geometric.spread is not None:
        return
    why = "whose reaction is no load at one node"
    if frame.kind == "buckens":
        why = (
            "whose reaction, loads distributed over the nodes, is not stored (a file of a version before 4, or "
            "spread_loads = false)"
        )
    raise BodyError(
        f"reduced body {reduced.name!r}: its geometric stiffness can be converted to a Tisserand frame, or a nodal "
        f"frame at an interface with one reference node, not to this {frame.kind} frame, {why}; reduce "
        "the body anew in that frame, or leave the geometric stiffness out (cms frame --no-geometric-stiffness, or "
        "replace(body, geometric=None, quadratic=None))"
    )


def is_node(reduced: ReducedBody, name: str) -> bool:
    """Return whether an interface is a single node with six dofs."""
    interface = reduced.interface(name)
    return interface.has_rotation and (interface.kind != "nodes" or len(interface.members) == 1)


def converted_geometric_stiffness(
    reduced: ReducedBody, frame: BodyFrame, *, C: Array, Z: Array, p: Array, R: Array
) -> GeometricStiffness:
    """Return the matrices of the unit loads of the new frame over the new shapes.

    Parameters
    ----------
    frame
        New frame.
    C, Z, p, R
        Fields of `cms.reduction.frame_conversion.Change`: rigid part of each shape, new shapes, place of the new frame.
    """
    old, moments = reduced.geometric, reduced.moments
    assert old is not None
    loads = with_reaction(reduced, new_unit_loads(reduced, p, R), frame)  # (1), (2)
    K = of_balanced(old, loads, None if old.spread is None else old.spread.K)  # (3)
    on_rigid = turned_work(loads, *rotation_moments(reduced))
    if old.spread is not None:
        on_rigid = on_rigid + np.tensordot(loads.spread, old.spread.turned_rigid, axes=1)
    if old.turned is not None:
        on_modes = of_balanced(old.turned, loads, None if old.spread is None else old.spread.turned)
    else:
        warn_of_old_shells(reduced)
        Psi = np.array([interface.Psi for interface in loaded_of(reduced)]).reshape(-1, 6, reduced.n_q)
        on_modes = turned_work(loads, moments.C1, moments.P, Psi)
    C_theta = C[3:]
    K = K - np.einsum("ak,jal->jkl", C_theta, on_modes) - np.einsum("jak,al->jkl", on_modes, C_theta)  # (4)
    K = K + np.einsum("ak,jab,bl->jkl", C_theta, on_rigid, C_theta, optimize=True)
    K = Z.T @ ((K + K.transpose(0, 2, 1)) / 2) @ Z
    on_modes = R.T @ (on_modes - on_rigid @ C_theta) @ Z
    for zero in (K, on_modes):  # loads that equal the reaction of the new frame have zero matrices
        if frame.kind == "tisserand":
            zero[:6] = 0.0
        if frame.kind == "buckens":
            zero[12 + 6 * len(old.interfaces) :] = 0.0
    return stiffness_of_loads(
        K,
        None if old.turned is None else on_modes,
        None if old.spread is None else changed_rigid(reduced, old.spread.turned_rigid, p, R),
        is_loaded=old.is_loaded,
    )


def loaded_of(reduced: ReducedBody) -> list[ReducedInterface]:
    """Return the interfaces whose wrenches are among the unit loads."""
    assert reduced.geometric is not None
    return [reduced.interfaces[k] for k in reduced.geometric.loaded]


def warn_of_old_shells(reduced: ReducedBody) -> None:
    """Warn that, for bodies from old files, loads in shells do not rotate exactly with the frame."""
    if any(OF_A_SHELL.search(key) for key in reduced.provenance):
        log.warning(
            "body %r: its file is from before version 4 and it has shells, whose geometric stiffness in another frame "
            "can be off by a quarter on coarse meshes; reduce it anew", reduced.name,
        )  # fmt: skip


def new_unit_loads(reduced: ReducedBody, p: Array, R: Array) -> Loads:
    """Step (1): return new unit loads in new axes about the new origin: per unit mass, wrenches, distributed loads."""
    assert reduced.geometric is not None
    n, n_spread = len(reduced.geometric.interfaces), 0 if reduced.geometric.spread is None else 6
    k = 12 + 6 * n + n_spread
    wrenches, spread = np.zeros((k, n, 6)), np.zeros((k, n_spread))
    for i in range(n):
        wrenches[12 + 6 * i : 18 + 6 * i, i] = np.kron(np.eye(2), R).T
    if n_spread:
        spread[12 + 6 * n :] = placed_spread(p, R)
    return Loads(unit_mass_loads(BodyFrame("", p, R), k - 12), wrenches, spread)


def placed_spread(p: Array, R: Array) -> Array:
    """Return distributed loads e, e × (c - p) of the new axes and origin in terms of the old ones, (6, 6)."""
    amounts = np.kron(np.eye(2), R.T)
    amounts[3:, :3] = -np.cross(R.T, p)
    return np.asarray(amounts, np.float64)


def with_reaction(reduced: ReducedBody, loads: Loads, frame: BodyFrame) -> Loads:
    """Step (2): add to each load the reaction that balances it."""
    force, torque = resultants(reduced, loads)
    if frame.kind == "tisserand":
        m, S, J0 = reduced.moments.m, reduced.moments.S, reduced.moments.J0
        S_tilde = np.cross(S, np.eye(3)).T
        M_R = np.block([[m * np.eye(3), -S_tilde], [S_tilde, J0]])
        motion = np.linalg.solve(M_R, np.hstack([force, torque]).T)
        return replace(loads, mass=loads.mass.plus_rigid(-motion, np.zeros(3)))
    if frame.kind == "buckens":
        amounts = np.linalg.solve(spread_resultants(reduced).T, np.hstack([force, torque]).T).T
        return replace(loads, spread=loads.spread - amounts)
    index = [interface.name for interface in loaded_of(reduced)].index(frame.at)
    wrenches = np.array(loads.wrenches)
    wrenches[:, index, :3] -= force
    wrenches[:, index, 3:] -= torque - np.cross(loaded_of(reduced)[index].position, force)
    return replace(loads, wrenches=wrenches)


def resultants(reduced: ReducedBody, loads: Loads) -> tuple[Array, Array]:
    """Return force and torque about the origin for each load, (k, 3) each."""
    moments, A, b = reduced.moments, loads.mass.A, loads.mass.b
    force = moments.m * b + A @ moments.S
    V = np.einsum("jab,bc->jac", A, moments.R) + b[:, :, None] * moments.S  # ∫ f cᵀ
    torque = axial(V)
    for i, interface in enumerate(loaded_of(reduced)):
        force = force + loads.wrenches[:, i, :3]
        torque = torque + loads.wrenches[:, i, 3:] + np.cross(interface.position, loads.wrenches[:, i, :3])
    if loads.spread.size:
        of_spread = loads.spread @ spread_resultants(reduced)
        force, torque = force + of_spread[:, :3], torque + of_spread[:, 3:]
    return force, torque


def spread_resultants(reduced: ReducedBody) -> Array:
    """Return force and torque about the origin of the six distributed loads, one load in each row, (6, 6)."""
    sums = reduced.nodal_sums
    assert sums is not None
    center, R = sums.S / sums.w, sums.R / sums.w
    lever = np.cross(center, np.eye(3))
    return np.asarray(np.block([[np.eye(3), lever], [lever.T, np.trace(R) * np.eye(3) - R]]), np.float64)


def of_balanced(old: GeometricStiffness | RotatedLoads, loads: Loads, spread: Array | None) -> Array:
    """Step (3): return the matrices of balanced loads over the old shapes, (k, ...), from the old unit-load matrices.

    A c + b is a combination of the unit loads: b gives translations, the antisymmetric part of A gives rotations, and
    the symmetric part gives products of angular velocities, whose A is 1 - e_a e_aᵀ or -½ (e_a e_bᵀ + e_b e_aᵀ).
    `spread` holds the matrices of the loads distributed over the nodes.
    """
    A, b = loads.mass.A, loads.mass.b
    K = np.tensordot(-b, old.translation, axes=1) + np.tensordot(-axial(A) / 2, old.rotation, axes=1)
    symmetric = (A + A.transpose(0, 2, 1)) / 2
    half_trace = np.trace(A, axis1=1, axis2=2) / 2
    amounts = [half_trace - symmetric[:, a, a] if a == c else -2 * symmetric[:, a, c] for a, c in SPIN_PAIRS]
    K = K + np.tensordot(np.stack(amounts, axis=1), old.spin, axes=1)
    if spread is not None:
        K = K + np.tensordot(loads.spread, spread, axes=1)
    return np.asarray(K + np.tensordot(loads.wrenches, old.interfaces, axes=2))


def changed_rigid(reduced: ReducedBody, turned_rigid: Array, p: Array, R: Array) -> Array:
    """Return `turned_rigid` for distributed loads of the new frame and rotations e_b × (c - p) about its origin."""
    forces = spread_resultants(reduced)[:, :3]
    # e_x × F for each load, (6, 3, 3): the work of the rotated load on translations
    turned = -np.cross(forces[:, None], np.eye(3))
    work = turned_rigid - turned @ np.cross(np.eye(3), p).T
    return np.einsum("ji,ixb->jxb", placed_spread(p, R), R.T @ work @ R)


def turned_work(loads: Loads, C1: Array, P: Array, Psi: Array) -> Array:
    """Return the work of loads rotated about each axis on the shapes, (k, 3, n); moments have a factor ½.

    Parameters
    ----------
    C1, P
        ∫ phi_a,k, (3, n), and ∫ c_a phi_b,k, (3, 3, n), of the shapes.
    Psi
        Motion of the loaded interfaces, (n_loaded, 6, n).
    """
    turn = np.stack([np.cross(e, np.eye(3)).T for e in np.eye(3)])  # e_a~
    work = np.einsum("xab,jbc,cak->jxk", turn, loads.mass.A, P, optimize=True)
    work = work + np.einsum("xab,jb,ak->jxk", turn, loads.mass.b, C1, optimize=True)
    six = np.stack([np.kron(np.diag([1.0, 0.5]), e) for e in turn])
    return np.asarray(work + np.einsum("xab,jib,iak->jxk", six, loads.wrenches, Psi, optimize=True))


def rotation_moments(reduced: ReducedBody) -> tuple[Array, Array, Array]:
    """Return C1, P and Psi for the three unit rotations e_k × c about the origin."""
    e = np.stack([np.cross(axis, np.eye(3)).T for axis in np.eye(3)])  # e_k × c = e[k] c
    C1 = np.einsum("kab,b->ak", e, reduced.moments.S)
    P = np.einsum("kbc,ac->abk", e, reduced.moments.R)
    interfaces = loaded_of(reduced)
    Psi = np.zeros((len(interfaces), 6, 3))
    for i, interface in enumerate(interfaces):
        Psi[i, :3] = np.einsum("kab,b->ak", e, interface.position)
        Psi[i, 3:] = np.eye(3) if interface.has_rotation else 0.0
    return C1, P, Psi
