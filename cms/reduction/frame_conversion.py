"""Conversion of a reduced body to another body frame, without the finite element model (theory.md §4).

Relative to another frame, the shapes of the motion r = c + Phi q are phi'_k = phi_k - d_k - theta_k × c. This is the
same deformation without the rigid-body motion C = [d; theta] that the condition of the new frame removes. With new
modes Z, phi'' = phi' Z. Then origin and axes of the frame change.

(1) C follows from the condition: [1C; 2C] for Tisserand, weighted sums for Buckens, the motion of held dofs for nodal
(2) M' = M - CᵀY - YᵀC + Cᵀ M_R C with Y = Psi_RᵀMPhi = [1C; 2C]; K is not affected by rigid motion
(3) new modes from K Z = M' Z omega²
(4) all quantities that are linear in the shapes are transformed with them; the Gram matrix of the moments is
    transformed by congruence, a'' = L a
"""

from dataclasses import dataclass, replace

import numpy as np

from cms.body.error_estimates import ErrorEstimates
from cms.body.invariants import INERTIA_TERMS, Moments, NodalSums, moments_from_gram
from cms.body.recovery_table import RecoveryTable
from cms.body.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.body.source_columns import SourceColumns
from cms.body.stress import PointStress
from cms.errors import BodyError
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.linear_algebra.solvers.eigen import orientation
from cms.reduction.basis.damping import Damping, modal_damping, statement_of
from cms.reduction.basis.frames import (
    BuckensFrame,
    Frame,
    HeldFrame,
    NodalFrame,
    TisserandFrame,
    checked_dofs,
    cholesky_of_inertia,
    determinate_rows,
    placed,
)
from cms.reduction.basis.node_results import turned_stress
from cms.reduction.geometric_stiffness.geometric_conversion import converted_geometric_stiffness, require_convertible
from fe_models.body.load_cases import ReducedLoadCase
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Change", "convert_frame", "converted"]


def convert_frame(reduced: ReducedBody, frame: Frame, *, damping: Damping | None = None) -> ReducedBody:
    """Return the same reduced body in another body frame, with newly diagonalised modes.

    Free-free frequencies, stiffness, damping and loads of the body do not change. The motion differs only by terms of
    second order in q (theory.md §4). The damping matrix is transformed, D'' = Zᵀ D Z, so that a deformation dissipates
    the same energy in both frames; in general it is no longer diagonal. Quadratic modes need the elements and are
    dropped.

    Parameters
    ----------
    reduced
        Reduced body in any frame.
    frame
        New frame.
    damping
        Damping of the new modes, by ratios or Rayleigh damping; None: the transformed damping.

    Raises
    ------
    BodyError
        If the body lacks data that the frame needs (the interface is unknown or has no rotation, or there are no
        weighted sums for a Buckens frame, as in a file of version 1); if its shapes contain a rigid-body motion; or if
        it has a geometric stiffness and the reaction of the new frame is not a combination of its unit loads
        (`geometric_conversion`).
    """
    return converted(reduced, frame, damping=damping)[0]


def converted(reduced: ReducedBody, frame: Frame, *, damping: Damping | None = None) -> tuple[ReducedBody, "Change"]:
    """Return the result of `convert_frame`, and the change of frame."""
    if reduced.is_held or isinstance(frame, HeldFrame):
        raise BodyError(
            f"reduced body {reduced.name!r}: a body held to the ground has the frame of the ground, and a free body "
            "has any other frame; reduce it again with or without its supports"
        )
    C, target = condition_of(reduced, frame)  # step (1)
    require_convertible(reduced, target)
    Y, M_R = reduced.moments.coupling, reduced.moments.rigid_mass
    M = reduced.M - C.T @ Y - Y.T @ C + C.T @ M_R @ C  # (2)
    Z, is_massive = modes_of(reduced, (M + M.T) / 2)  # (3)
    change = Change(C, Z, *relative_place(reduced.frame, target))
    change = replace(change, Z=Z @ orientation(orienting_rows(reduced, change), omega2_of(reduced, Z)))
    return changed_body(reduced, target, change, is_massive, damping), change  # (4)


@dataclass(frozen=True, eq=False)
class Change:
    """Change to another body frame: the removed rigid motion, the new modes, and origin and axes of the new frame."""

    C: Array  #: rigid motion [d; theta] of each old shape about the old origin, old axes, (6, n_q)
    Z: Array  #: new modes as combinations of the old ones, (n_q, n_new)
    p: Array  #: new origin in the old frame, (3,) [m]
    R: Array  #: new axes as columns, in old axes, (3, 3)

    def translations(self, Phi: Array, points: Array) -> Array:
        """Return translations of the new shapes, (n, 3, n_q), from those of the old ones at points in the old frame."""
        off = Phi - rigid_motion_of_points(points, np.zeros(3)) @ self.C if self.C.any() else Phi
        moved = (off.reshape(-1, off.shape[2]) @ self.Z).reshape(len(off), 3, -1)
        return moved if np.array_equal(self.R, np.eye(3)) else np.einsum("ba,nbk->nak", self.R, moved)

    def points(self, positions: Array) -> Array:
        """Return positions in the new frame, (n, 3) [m]."""
        return (positions - self.p) @ self.R


# (1) Condition of the frame ------------------------------------------------------------------------------------------


def condition_of(reduced: ReducedBody, frame: Frame) -> tuple[Array, BodyFrame]:
    """Return the rigid motion C that the frame condition removes, (6, n_q) about the old origin, and the frame."""
    moments = reduced.moments
    center = in_mesh(reduced.frame, moments.center_of_mass)
    if isinstance(frame, TisserandFrame):
        c = moments.center_of_mass
        J_c = moments.J0 - moments.m * (c @ c * np.eye(3) - np.outer(c, c))
        cholesky_of_inertia(reduced.name, J_c)
        return closest_rigid_motions(moments.m, c, J_c, moments.C1, moments.C2), placed("tisserand", frame, center)
    if isinstance(frame, BuckensFrame):
        sums = reduced.nodal_sums
        if sums is None:
            raise BodyError(
                f"reduced body {reduced.name!r}: a Buckens frame needs weighted sums over the nodes, which are not "
                "stored (a file of version 1, or nodes on one line); reduce it anew with this frame"
            )
        c = sums.S / sums.w
        R_c = sums.R - sums.w * np.outer(c, c)
        N_c = np.trace(R_c) * np.eye(3) - R_c
        return closest_rigid_motions(sums.w, c, N_c, sums.U1, sums.U2), placed(
            "buckens", frame, in_mesh(reduced.frame, c)
        )
    rows, u, held = nodal_condition(reduced, frame)
    default = center if frame.at is None else in_mesh(reduced.frame, reduced.interface(frame.at).position)
    return np.asarray(np.linalg.solve(rows, u)), placed("nodal", frame, default, held)


def closest_rigid_motions(weight: float, c: Array, N_c: Array, U1: Array, U2: Array) -> Array:
    """Return the rigid motions about the origin that fit the shapes best in a weighted norm, (6, n_q).

    About the weighted centre c the norm splits into translation and rotation: d_c = U1/w, N_c theta = U2 - c × U1.
    """
    theta = np.linalg.solve(N_c, U2 - np.cross(c, U1, axisb=0, axisc=0))
    return np.vstack([U1 / weight - np.cross(theta, c, axisa=0, axisc=0), theta])


def nodal_condition(reduced: ReducedBody, frame: NodalFrame) -> tuple[Array, Array, IntArray]:
    """Return rigid motions and shapes at the six fixed dofs, (6, 6) and (6, n_q), and the dofs (node, component)."""
    where = f"reduced body {reduced.name!r}: nodal frame"
    if frame.dofs is not None:
        held = checked_dofs(frame, where, reduced.numbering, reduced.node_ids)
        kept = {int(node): row for row, node in enumerate(reduced.node_ids)}
        for node, component in held:
            if component > 2 or int(node) not in kept:
                what = "no rotations of single nodes" if component > 2 else f"node {node} not"
                raise BodyError(
                    f"{where}: it holds {what}; name translations of kept nodes, or take an interface (at = ...)"
                )
        rows = np.array([kept[int(node)] for node in held[:, 0]])
        determinate_rows(reduced.nodes[rows], held[:, 1], where)
        to_axis = reduced.frame.axes[held[:, 1]]  # mesh axes of the dofs in B, (6, 3)
        motion = rigid_motion_of_points(reduced.nodes[rows], np.zeros(3))
        return np.einsum("na,nac->nc", to_axis, motion), np.einsum("na,nak->nk", to_axis, reduced.Phi[rows]), held
    interfaces = reduced.interfaces if frame.at is None else (reduced.interface(frame.at),)
    if not interfaces:
        raise BodyError(f"{where}: the body has no interface; take a Tisserand frame")
    points, components, motion, u, ids = (np.concatenate(part) for part in zip(
        *(interface_dofs(reduced, interface) for interface in interfaces), strict=True
    ))  # fmt: skip
    chosen = determinate_rows(points, components, where)
    named = np.stack([ids[chosen], components[chosen]], axis=1)
    return motion[chosen], u[chosen], named if (named >= 0).all() else np.zeros((0, 2), np.int64)


def interface_dofs(reduced: ReducedBody, interface: ReducedInterface) -> tuple[Array, IntArray, Array, Array, IntArray]:
    """Return the dofs of an interface that a nodal frame may fix: points, components, rigid motions, shapes, nodes.

    All are in mesh axes. They are the six dofs of the reference point, or the translations of the members if there is
    no such node (kind "nodes").
    """
    A = reduced.frame.axes
    if interface.kind == "nodes" and not (len(interface.members) == 1 and interface.has_rotation):
        points, Phi = reduced.nodes[interface.members], reduced.Phi[interface.members]
        motion, n = rigid_motion_of_points(points, np.zeros(3)), len(points)
        return (
            np.repeat(in_mesh(reduced.frame, points), 3, axis=0), np.tile(np.arange(3), n),
            (A @ motion).reshape(3 * n, 6), (A @ Phi).reshape(3 * n, reduced.n_q),
            np.repeat(reduced.node_ids[interface.members], 3),
        )  # fmt: skip
    position = interface.position
    turn = np.kron(np.eye(2), A)
    motion = turn @ six_motions(position)
    at = np.flatnonzero((reduced.nodes == position).all(axis=1))  # the reference node is a kept node
    ids = np.full(6, reduced.node_ids[at[-1]] if len(at) else -1)
    return np.tile(in_mesh(reduced.frame, position), (6, 1)), np.arange(6), motion, turn @ interface.Psi, ids


def six_motions(position: Array) -> Array:
    """Return translation and rotation of a point under the six rigid-body motions about the origin, (6, 6)."""
    rotation = np.hstack([np.zeros((3, 3)), np.eye(3)])
    return np.vstack([rigid_motion_of_points(np.asarray(position)[None], np.zeros(3))[0], rotation])


# (2), (3) Pencil of the new frame ------------------------------------------------------------------------------------


def modes_of(reduced: ReducedBody, M: Array) -> tuple[Array, np.ndarray]:
    """Return the modes of K and the new mass in terms of the old shapes, (n_q, n_q), and whether each has mass."""
    stiffness, mass = np.diag(reduced.K), np.diag(M)
    omega2_1 = (2 * np.pi * reduced.free_frequencies.min()) ** 2 if len(reduced.free_frequencies) else 0.0
    if not omega2_1 > 0:
        omega2_1 = float((stiffness[mass > 0] / mass[mass > 0]).min(initial=np.inf))
    try:
        return elastic_eigenvectors(reduced.K, M, omega2_1)
    except np.linalg.LinAlgError as error:
        raise BodyError(
            f"reduced body {reduced.name!r}: its {reduced.n_q} shapes contain rigid-body motion ({error}); expected "
            "only elastic shapes"
        ) from error


def omega2_of(reduced: ReducedBody, Z: Array) -> Array:
    """Return Z_kᵀ K Z_k for each mode k, (n_q,)."""
    return np.asarray(np.einsum("lk,l,lk->k", Z, np.diag(reduced.K), Z))


def orienting_rows(reduced: ReducedBody, change: Change) -> Array:
    """Return rows of the new shapes that fix their signs, (n, n_q): kept nodes, or interfaces, or momenta."""
    if len(reduced.nodes):
        return change.translations(reduced.Phi, reduced.nodes).reshape(-1, reduced.n_q)
    if reduced.interfaces:
        return np.vstack([interface.Psi @ change.Z for interface in reduced.interfaces])
    return np.asarray(reduced.moments.P).reshape(9, -1) @ change.Z


# (4) Everything that follows the shapes ------------------------------------------------------------------------------


def in_mesh(frame: BodyFrame, points: Array) -> Array:
    """Convert points of B to mesh coordinates."""
    return np.asarray(frame.origin + points @ frame.axes.T)


def relative_place(old: BodyFrame, new: BodyFrame) -> tuple[Array, Array]:
    """Return origin and axes of the new frame relative to the old frame."""
    return old.axes.T @ (new.origin - old.origin), old.axes.T @ new.axes


def changed_body(
    reduced: ReducedBody, frame: BodyFrame, change: Change, is_massive: np.ndarray, damping: Damping | None
) -> ReducedBody:
    """Return the body with all its data in the new frame."""
    Z = change.Z
    M, K = np.diag(is_massive.astype(float)), np.diag(omega2_of(reduced, Z))
    D = Z.T @ reduced.D @ Z if damping is None else modal_damping(damping, M, K, second=reduced.units.time)
    labels, shares = changed_labels(reduced, Z)
    old = reduced.frame
    record = {"frame converted from": f"{old.kind}{f' at {old.at}' if old.at else ''}"}
    if damping is not None:
        record["damping"] = statement_of(damping, reduced)
    return replace(
        reduced,
        frame=frame,
        M=M,
        K=K,
        D=(D + D.T) / 2,
        labels=labels,
        energy_shares=shares,
        moments=changed_moments(reduced.moments, change),
        nodes=change.points(reduced.nodes),
        Phi=change.translations(reduced.Phi, reduced.nodes),
        interfaces=tuple(changed_interface(reduced, interface, change) for interface in reduced.interfaces),
        provenance=dict(reduced.provenance) | record,
        columns=None if reduced.columns is None else reduced.columns.of_modes(Z),
        nodal_sums=None if reduced.nodal_sums is None else changed_sums(reduced.nodal_sums, change),
        kept=None if reduced.kept is None else reduced.kept.moved(change.C[3:], change.R, Z),
        load_cases=tuple(changed_load_case(case, change) for case in reduced.load_cases),
        stress=None if reduced.stress is None else turned_stress(np.asarray(reduced.stress) @ Z, change.R),
        geometric=None
        if reduced.geometric is None
        else converted_geometric_stiffness(reduced, frame, C=change.C, Z=Z, p=change.p, R=change.R),
        quadratic=None,  # quadratic modes depend on the reaction of the old frame
        point_stress=None if reduced.point_stress is None else changed_point_stress(reduced.point_stress, change),
        recovery={name: changed_table(table, change) for name, table in reduced.recovery.items()},
        errors=None if reduced.errors is None else changed_errors(reduced.errors, change),
    )


def changed_moments(moments: Moments, change: Change) -> Moments:
    """Return the moments in the new frame: L Gram Lᵀ, with a'' = L a for a = [1, c, phi_x, phi_y, phi_z].

    Missing terms stay missing. Removing a rotation from the shapes mixes 3C into 4C and 5C, which are then missing too.
    Mass, 1C, 2C and M* of the new frame follow from their old values alone.
    """
    n, n_old = change.Z.shape[1], moments.n_q
    L = np.zeros((4 + 3 * n, 4 + 3 * n_old))
    L[0, 0] = 1.0
    L[1:4, 0], L[1:4, 1:4] = -change.R.T @ change.p, change.R.T
    # new shape k, component a: R_ba (phi_b - d_b - eps_bce theta_c c_e), multiplied by Z
    shapes = L[4:].reshape(3, n, -1)
    off = change.C @ change.Z
    cross = -np.cross(np.eye(3)[:, None], off[3:].T[None])  # [e, k, b] = -(e_e × theta_k)_b = (theta_k × e_e)_b
    shapes[:, :, 0] = -change.R.T @ off[:3]
    shapes[:, :, 1:4] = -np.einsum("ba,ekb->ake", change.R, cross)
    shapes[:, :, 4:] = np.einsum("ba,lk->akbl", change.R, change.Z).reshape(3, n, 3 * n_old)
    missing = INERTIA_TERMS if "3C" in moments.missing else moments.missing
    return moments_from_gram(L @ moments.gram @ L.T, is_exact=moments.is_exact, missing=missing)


def changed_interface(reduced: ReducedBody, interface: ReducedInterface, change: Change) -> ReducedInterface:
    """Return an interface in the new frame. If it has no rotation, Psi is the mean translation of its members."""
    middle = interface.position if interface.has_rotation else reduced.nodes[interface.members].mean(axis=0)
    Psi = (interface.Psi - six_motions(middle) @ change.C) @ change.Z
    rotation = Psi[3:] if interface.has_rotation else np.zeros_like(Psi[3:])
    return replace(
        interface,
        position=change.R.T @ (interface.position - change.p),
        triad=change.R.T @ interface.triad,
        Psi=np.concatenate([change.R.T @ Psi[:3], change.R.T @ rotation]),
    )


def changed_sums(sums: NodalSums, change: Change) -> NodalSums:
    """Return the weighted nodal sums in the new frame."""
    w, S, R, p, A = sums.w, np.asarray(sums.S), np.asarray(sums.R), change.p, change.R
    norm = np.trace(R) * np.eye(3) - R
    d, theta = change.C[:3], change.C[3:]
    U1 = sums.U1 - (w * d + np.cross(theta, S, axisa=0, axisc=0))
    U2 = sums.U2 - (np.cross(S, d, axisb=0, axisc=0) + norm @ theta)
    U2 = U2 - np.cross(p, U1, axisb=0, axisc=0)
    R_p = R - np.outer(p, S) - np.outer(S, p) + w * np.outer(p, p)
    return replace(
        sums, S=A.T @ (S - w * p), R=A.T @ R_p @ A, U1=A.T @ U1 @ change.Z, U2=A.T @ U2 @ change.Z
    )  # fmt: skip


def changed_load_case(case: ReducedLoadCase, change: Change) -> ReducedLoadCase:
    """Return a load case in the new frame: phi''ᵀ f = Zᵀ (phiᵀ f - d·F - theta·T)."""
    wrench = np.concatenate([case.force, case.torque])
    return replace(
        case,
        force=change.R.T @ case.force,
        torque=change.R.T @ (case.torque - np.cross(change.p, case.force)),
        h=change.Z.T @ (case.h - change.C.T @ wrench),
    )


def changed_table(table: RecoveryTable, change: Change) -> RecoveryTable:
    """Return recovery rows in the new frame, which follow from z = X z'' (docs/theory.md §11)."""
    X = np.zeros((6 + table.n_q, 6 + change.Z.shape[1]))
    X[:6, :6] = six_motions(-change.p) @ np.kron(np.eye(2), change.R)  # d - theta × p, theta
    X[:6, 6:] = -change.C @ change.Z
    X[6:, 6:] = change.Z
    return table.changed(X, change.R, change.p)


def changed_errors(errors: ErrorEstimates, change: Change) -> ErrorEstimates:
    """Return the estimated errors, which no frame changes, with the forces on left-out shapes in the new frame."""
    left_out = errors.left_out
    return errors if left_out is None else replace(errors, left_out=left_out.changed(change.Z, change.R))


def changed_point_stress(points: PointStress, change: Change) -> PointStress:
    """Return the stress of the new shapes at named points; a rigid motion has no stress."""
    modes = turned_stress(np.asarray(points.modes) @ change.Z, change.R)
    return replace(points, positions=change.points(np.asarray(points.positions)), modes=modes)


def changed_labels(reduced: ReducedBody, Z: Array) -> tuple[tuple[str, ...], Array]:
    """Return labels and energy shares of the new modes; without source columns, shares refer to the old modes.

    The energy Z_kᵀ K Z_k is the sum of the terms Z_lk K_l Z_lk, because the old modes are K-orthogonal.
    """
    if reduced.columns is not None:
        columns: SourceColumns = reduced.columns.of_modes(Z)
        return columns.mode_labels(), columns.group_shares()
    names = tuple(f"{reduced.frame.kind} mode {k + 1}" for k in range(reduced.n_q))
    modes = SourceColumns(names, names, Z, np.diag(reduced.K)[:, None] * Z)
    return modes.mode_labels(), modes.shares() @ reduced.energy_shares
