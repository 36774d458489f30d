"""A full finite element body on bushings in a multibody system, without reduction, with large rotations.

(1) the system is run with the body rigid: motion of its frame B and of the other bodies, wrenches of the bushings
(2) u, displacement of the body relative to B, and w_k, small motions of chosen rigid bodies relative to (1):

        M u'' + D u' + K u + Σ B_uᵀ (D_b x' + K_b x) = -M Psi_R (a, alpha) - Σ omega_a omega_b f_ab + Σ B_uᵀ W_b(t)
        M_k w_k'' + Σ B_kᵀ (D_b x' + K_b x) = 0,        x = B_u u + Σ B_k w_k

    with x the additional deformation of a bushing; the right-hand side is in balance, since (1) is a motion
    (`imbalance`)
(3) one factorisation and direct integration (`full_transient`); the chosen bodies are in balance in (1) already

The motion (1) may be arbitrarily large. (2) neglects products of u and w with the relative angles of the bodies and
with omega (Coriolis), so that errors are of the order of these angles times the effect of flexibility.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cms.body.geometric_stiffness import SPIN_PAIRS
from cms.reduction.basis.damping import RayleighDamping
from fe_models.body.fe_body import FEBody
from fe_models.body.load_cases import LoadCase
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array
from floatframe.design.laboratory.full_transient import boundary_dofs, full_transient, spin_columns
from floatframe.design.laboratory.substitution import with_body
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.errors import ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.bodies.mode_choice import frozen_to_rigid
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Bushing
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.integrate import integrate

__all__ = ["SuspendedMotion", "suspended_motion"]

ALIGNED = 1e-9  #: rotation of a placed body below which it is a rounding error


@dataclass(frozen=True, eq=False)
class SuspendedMotion:
    """Motion of the full body relative to the frame of the rigid body, and the forces of its bushings."""

    t: Array  #: (n_t,) [s]
    u: Array  #: displacement of the dofs, mesh axes, with a small rigid motion of the whole body, (n_dof, n_t)
    u_dot: Array  #: rate of the displacement, (n_dof, n_t)
    forces: dict[str, Array]  #: bushing -> force and moment on the body at its interface, body axes, (n_t, 6) [N, N m]
    rigid: Trajectory  #: the rigid motion (1) at every step
    imbalance: float  #: resultant of inertia and bushing forces in (1), relative to the largest of its terms


@dataclass(frozen=True, eq=False)
class _Link:
    """A bushing between the body and another, or between two others, with its columns over the unknowns."""

    bushing: Bushing
    B: sp.csr_array  #: deformation x over (u, w_1, ...), (6, n)
    interface: str  #: interface of the body; "" if the bushing does not act on it
    is_b: bool  #: whether the body is at marker B


def suspended_motion(
    system: System,
    name: str,
    body: FEBody,
    *,
    free: Sequence[str],
    integrator: GeneralizedAlpha,
    t_end: float,
    h: float,
    every: int = 1,
    damping: RayleighDamping | None = None,
) -> SuspendedMotion:
    """Integrate a system with the full model of one of its flexible bodies.

    Parameters
    ----------
    system
        A system without gravity; the flexible body is held only by bushings between its interfaces and other bodies;
        all bodies are placed along the ground axes.
    name
        Name of the flexible body.
    body
        Its coupled finite element model, from which it was reduced in mean axes.
    free
        Rigid bodies that may follow its deformation, also held by bushings; all others move as in (1).
    every
        Results are stored at every `every`-th step.
    damping
        Damping of the finite element model.

    Raises
    ------
    ModelError
        If the system does not satisfy these conditions.
    """
    flexible = system.body(name)
    where = f"suspended body {name!r}"
    if not isinstance(flexible, FlexibleBody) or flexible.reduced.frame.kind != "tisserand":
        raise ModelError(f"{where}: expected a flexible body that was reduced in mean axes (frame = 'tisserand')")
    rigid_system = replace(with_body(system, name, [frozen_to_rigid(flexible.reduced)], stiffening=False), sensors=())
    rigid = integrate(rigid_system, integrator, t_end, h)
    masses = [_rigid_mass(where, system, each) for each in free]
    links = [link for link in (_link(where, system, body, name, free, f) for f in system.forces) if link is not None]
    columns, p, imbalance = _loads(body, flexible, name, rigid, links)
    n, n_all = body.n_dof, body.n_dof + 6 * len(free)
    alpha, beta = (0.0, 0.0) if damping is None else (damping.alpha, damping.beta)
    own = sp.csc_array(body.M.shape) if body.D is None else body.D
    M = sp.block_diag([body.M, *masses], format="csc")
    K = sp.block_diag([body.K, *[sp.csc_array((6, 6))] * len(free)], format="csc")
    D = sp.block_diag([own + alpha * body.M + beta * body.K, *[sp.csc_array((6, 6))] * len(free)], format="csc")
    for link in links:
        K = K + link.B.T @ link.bushing.stiffness @ link.B
        D = D + link.B.T @ link.bushing.damping @ link.B
    places = np.array([_placed(where, system, each) for each in free]).reshape(-1, 3)
    new = np.repeat(np.arange(len(free)), 6)
    vehicle = FEBody(
        name=f"{body.name} on bushings",
        M=sp.csc_array(M), K=sp.csc_array(K), D=sp.csc_array(D),
        nodes=np.concatenate([body.nodes, places]),
        dofs=np.concatenate([body.dofs, np.column_stack([len(body.nodes) + new, np.tile(np.arange(6), len(free))])]),
        units=body.units,
        load_cases=tuple(
            LoadCase(f"load {k}", "force", np.concatenate([column, np.zeros(n_all - n)]))
            for k, column in enumerate(columns.T)
        ),
    )  # fmt: skip
    found = full_transient(
        vehicle, rigid.t, loads={f"load {k}": row for k, row in enumerate(p.T)}, rho_inf=integrator.rho_inf, every=every
    )
    forces = {}
    for link in links:
        if link.interface:
            x, x_dot = found.u @ link.B.T, found.u_dot @ link.B.T
            more = x @ link.bushing.stiffness.T + x_dot @ link.bushing.damping.T
            forces[link.bushing.name] = _wrench(flexible, name, rigid, link)[::every] - (more if link.is_b else -more)
    return SuspendedMotion(found.t, found.u[:, :n].T, found.u_dot[:, :n].T, forces, rigid, imbalance)


def _placed(where: str, system: System, name: str) -> Array:
    """Return the position of the frame of a body, (3,); `ModelError` unless its axes are the ground axes."""
    body = {each.name: each for each in placed_bodies(system)}[system.body(name).name]
    if np.abs(np.asarray(body.orientation) - [1, 0, 0, 0]).max() > ALIGNED:
        raise ModelError(f"{where}: body {name!r}: expected axes along the ground axes, got a rotated body")
    return body.drawn_position


def _rigid_mass(where: str, system: System, name: str) -> Array:
    """Return the mass matrix of a rigid body about its frame origin, (6, 6)."""
    body = system.body(name)
    if not isinstance(body, RigidBody):
        raise ModelError(f"{where}: free: expected rigid bodies, got {name!r}")
    x, y, z = body.mass * body.center_of_mass
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.block([[body.mass * np.eye(3), -S], [S, body.inertia_about_origin]])


def _link(where: str, system: System, body: FEBody, name: str, free: Sequence[str], force: object) -> _Link | None:
    """Return a bushing as columns over the unknowns; None if both of its bodies move as in (1)."""
    if not isinstance(force, Bushing):
        touched = [body_name(m.body) for m in vars(force).values() if isinstance(m, Marker)]
        if name in touched or set(touched) & set(free):
            raise ModelError(f"{where}: force {getattr(force, 'name', '')!r}: expected a bushing")
        return None
    ends = [_end(end) for end in (force.marker_a, force.marker_b)]
    owners = [owner for owner, _ in ends]
    if name not in owners and not set(owners) & set(free):
        return None
    if force.characteristics or force.preload.any():
        raise ModelError(f"{where}: bushing {force.name!r}: expected no preload and no tables")
    point = next((p for p in (_point(where, system, body, *end, name) for end in ends) if p is not None), None)
    if point is None:
        raise ModelError(f"{where}: bushing {force.name!r}: expected a position at one of its ends, got none")
    n = body.n_dof + 6 * len(free)
    B, interface = sp.lil_array((6, n)), ""
    for sign, (owner, marker) in zip((-1.0, 1.0), ends, strict=True):
        if owner == name:
            if marker is None or marker.interface is None:
                raise ModelError(f"{where}: bushing {force.name!r}: expected an interface of the body as its marker")
            interface = marker.interface
            B[:, boundary_dofs(body, interface)] = sign * np.eye(6)
        elif owner in free:
            x, y, z = point - _placed(where, system, owner)
            arm = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])  # theta × arm
            k = body.n_dof + 6 * list(free).index(owner)
            B[:, k : k + 6] = sign * np.block([[np.eye(3), arm], [np.zeros((3, 3)), np.eye(3)]])
    return _Link(force, sp.csr_array(B), interface, owners[1] == name)


def _end(place: object) -> tuple[str, Marker | None]:
    return (body_name(place.body), place) if isinstance(place, Marker) else (body_name(place), None)  # type: ignore[arg-type]


def _point(where: str, system: System, body: FEBody, owner: str, marker: Marker | None, name: str) -> Array | None:
    """Return the position of a marker, ground axes, (3,); None if the other marker determines it."""
    if marker is None:
        return None
    if marker.triad is not None and np.abs(marker.triad - np.eye(3)).max() > ALIGNED:
        raise ModelError(f"{where}: marker on {owner!r}: expected axes along those of the body")
    if owner == name:
        assert marker.interface is not None
        interface = body.interface(marker.interface)
        if np.abs(interface.triad - np.eye(3)).max() > ALIGNED:
            raise ModelError(f"{where}: interface {interface.name!r}: expected axes along those of the mesh")
        return _placed(where, system, name) + np.asarray(interface.reference)
    position = np.zeros(3) if marker.position is None else marker.position
    return np.asarray(position) + (0.0 if owner == GROUND.name else _placed(where, system, owner))


def _loads(
    body: FEBody, flexible: FlexibleBody, name: str, rigid: Trajectory, links: Sequence[_Link]
) -> tuple[Array, Array, float]:
    """Return the load columns over the dofs, (n_dof, k), their amplitudes, (n_t, k), and the imbalance."""
    frame, motion = flexible.reduced.frame, rigid.body(name)
    R = rotation_matrix(motion.p) @ frame.axes.T  # from mesh axes to the ground
    acceleration = np.einsum("tab,ta->tb", R, motion.v_dot)
    omega, alpha = motion.omega_B @ frame.axes.T, motion.omega_B_dot @ frame.axes.T
    Psi = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin)
    columns = [-np.asarray(body.M @ Psi), spin_columns(body, frame.origin)]
    pairs = [(1 if a == b else 2) * omega[:, a] * omega[:, b] for a, b in SPIN_PAIRS]
    amplitudes = [np.hstack([acceleration, alpha]), np.stack(pairs, axis=1)]
    for link in links:
        if link.interface:
            unit = np.zeros((body.n_dof, 6))
            unit[boundary_dofs(body, link.interface)] = np.eye(6)
            columns.append(unit)
            amplitudes.append(_wrench(flexible, name, rigid, link))
    resultants = [column.T @ Psi for column in columns]
    terms = [p @ resultant for p, resultant in zip(amplitudes, resultants, strict=True)]
    scale = np.abs(np.array(terms)).max(axis=(0, 1))
    kinds = np.array([scale[:3].max()] * 3 + [scale[3:].max()] * 3)
    imbalance = float((np.abs(sum(terms)) / np.where(kinds > 0, kinds, 1.0)).max())
    return np.hstack(columns), np.hstack(amplitudes), imbalance


def _wrench(flexible: FlexibleBody, name: str, rigid: Trajectory, link: _Link) -> Array:
    """Return force and moment of a bushing on the body at its interface in (1), mesh axes, (n_t, 6).

    A bushing without mass is in balance: it acts on B with -F and -M + d × F, where d is from the point of A to that of
    B; both act at the reference point of the interface for any d.
    """
    motion, frame = rigid.body(name), flexible.reduced.frame
    interface = next(each for each in flexible.reduced.interfaces if each.name == link.interface)
    R_B = rotation_matrix(motion.p)
    reaction = rigid.reaction(link.bushing.name)
    force, moment = reaction.force, reaction.moment
    if link.is_b:
        here = motion.r + R_B @ interface.position
        there = _marker_path(rigid, flexible, link, name)
        force, moment = -force, -moment + np.cross(here - there, reaction.force)
    R = R_B @ frame.axes.T
    return np.hstack([np.einsum("tab,ta->tb", R, force), np.einsum("tab,ta->tb", R, moment)])


def _marker_path(rigid: Trajectory, flexible: FlexibleBody, link: _Link, name: str) -> Array:
    """Return the path of the point of marker A, ground axes, (n_t, 3)."""
    owner, marker = _end(link.bushing.marker_a)
    motion, body = rigid.body(owner), rigid.body(name)
    if marker is not None and marker.position is not None:
        local = marker.position
    else:  # at the placed position of the interface
        interface = next(each for each in flexible.reduced.interfaces if each.name == link.interface)
        local = rotation_matrix(motion.p[0]).T @ (
            body.r[0] + rotation_matrix(body.p[0]) @ interface.position - motion.r[0]
        )
    return np.asarray(motion.r + rotation_matrix(motion.p) @ local)
