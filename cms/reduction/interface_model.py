"""A reduced body over interface motions and fixed-interface modes, the superelement form of other programs.

The modal file holds diagonalised modes without rigid motion. Together with the rigid motion (d, theta) of B they give

    u(c) = d + theta × c + Phi q,  z = (d, theta, q),  M_z = [M_R, Y; Yᵀ, M],  K_z = diag(0, K),  Y = [1C; 2C]

The interfaces move by u_b = B z, where B follows from their positions and maps Psi. If B has full row rank, z follows
from u_b and the remaining coordinates (docs/theory.md §2):

(1) N is a basis of the motions in which all interfaces are at rest, B N = 0
(2) constraint modes Z: B Z = 1 with minimal energy, so that NᵀK_z Z = 0
(3) fixed-interface modes N X of the pencil (Nᵀ K_z N, Nᵀ M_z N), with unit mass
(4) T = [Z, N X] gives K = Tᵀ K_z T, and M and D likewise; loads are Tᵀ (force, torque, h)

The columns of T have the span of rigid motion and modes of the body, so nothing is lost or added. For a Craig-Bampton
body the result is its original superelement.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.body.reduced_body import ReducedBody, ReducedInterface
from cms.errors import ExportError
from cms.reduction.frame_conversion import six_motions
from cms.reduction.free_pencil import free_pencil
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import MOTION_COMPONENTS, Array, IntArray, symmetric_part

__all__ = ["BoundaryNode", "InterfaceModel", "interface_model"]

RANK_TOLERANCE = 1e-9  #: relative singular value of the scaled map, below which it counts as zero
#: motion of the interfaces in a mode relative to its largest motion, below which it is rounding because the frame is at
#: the interface; rotations are multiplied by the extent of the body
ROUNDING_MOTION = 1e-12
#: mass of a fixed-interface mode of unit stiffness relative to the largest, below which it counts as zero
MASSLESS = 1e-14


@dataclass(frozen=True, eq=False)
class BoundaryNode:
    """A point of an interface, and its dofs in the boundary."""

    interface: str
    position: Array  #: in mesh coordinates, (3,) [m]
    components: IntArray  #: 0-2 translations, 3-5 rotations, mesh axes
    first: int  #: row of its first dof in the boundary vector


@dataclass(frozen=True, eq=False)
class InterfaceModel:
    """Matrices over y = (motions of boundary nodes in mesh axes, fixed-interface modes of unit mass)."""

    body: ReducedBody
    nodes: tuple[BoundaryNode, ...]
    K: Array  #: (n, n), symmetric
    M: Array  #: (n, n), symmetric
    D: Array  #: (n, n), symmetric
    T: Array  #: z = T y: rigid motion of B (six rows; none for a held body), then q, (6 + n_q, n)
    loads: Array  #: load cases of unit amplitude as forces on y, (n, n_load_cases)

    @property
    def n_boundary(self) -> int:
        """Number of dofs of all boundary nodes."""
        return sum(len(node.components) for node in self.nodes)

    @property
    def n_modes(self) -> int:
        """Number of fixed-interface modes."""
        return len(self.K) - self.n_boundary

    @property
    def omega(self) -> Array:
        """Angular frequencies of the fixed-interface modes, (n_modes,) [rad/s]; infinite for massless modes."""
        inner = slice(self.n_boundary, None)
        mass, stiffness = np.diag(self.M)[inner], np.diag(self.K)[inner]
        return np.sqrt(np.divide(stiffness, mass, out=np.full(len(mass), np.inf), where=mass > 0))

    def recovery(self) -> Array:
        """Return the translations of the kept nodes in mesh axes for unit values of y, (n_kept, 3, n)."""
        body = self.body
        motions = body.Phi
        if not body.is_held:
            motions = np.concatenate([rigid_motion_of_points(body.nodes, np.zeros(3)), body.Phi], axis=2)
        return np.asarray(body.frame.axes @ motions @ self.T)

    def mesh_positions(self) -> Array:
        """Return the positions of the kept nodes in mesh coordinates, (n_kept, 3) [m]."""
        frame = self.body.frame
        return np.asarray(frame.origin + self.body.nodes @ frame.axes.T)


def interface_model(body: ReducedBody) -> InterfaceModel:
    """Return mass, stiffness and damping of the body over its interface motions and fixed-interface modes.

    Raises
    ------
    ExportError
        If its modes do not move all interface dofs independently (the message names the missing constraint modes), or
        if it can move with all interfaces fixed.
    """
    nodes, B = boundary_of(body)
    pencil, loads = free_pencil(body), loads_of(body)
    M, K, D = pencil.M, pencil.K, pencil.D
    S = 1 / np.maximum(np.abs(B).max(axis=0), np.finfo(float).tiny) if len(B) else np.ones(B.shape[1])
    S[np.abs(B).max(axis=0, initial=0.0) == 0] = 1.0
    rows = 1 / np.maximum(np.linalg.norm(B * S, axis=1), np.finfo(float).tiny)
    scaled = rows[:, None] * B * S  # columns scaled to equal size, then rows
    require_rank(body, nodes, scaled)
    N = S[:, None] * la.qr(scaled.T)[0][:, len(B) :]
    z = S[:, None] * la.lstsq(scaled, np.diag(rows))[0]
    K_N = N.T @ K @ N
    factor = held_factor(body, K_N)
    Z = z - N @ la.cho_solve(factor, N.T @ (K @ z))
    X = fixed_modes(K_N, N.T @ M @ N)
    T = np.hstack([Z, N @ X])
    n_b = len(B)
    K_y, M_y, D_y = (symmetric_part(T.T @ matrix @ T) for matrix in (K, M, D))
    K_y[:n_b, n_b:] = K_y[n_b:, :n_b] = 0.0  # step (2); nonzero values are rounding
    for matrix in (K_y, M_y):  # step (3)
        inner = matrix[n_b:, n_b:]
        inner[...] = np.diag(np.diag(inner))
    return InterfaceModel(body, nodes, K_y, M_y, D_y, T, T.T @ loads)


def loads_of(body: ReducedBody) -> Array:
    """Return the load cases over z, or over q alone for a body that is fixed to the ground, a column each."""
    loads = np.array([case.h for case in body.load_cases]).reshape(-1, body.n_q).T
    if body.is_held:
        return loads
    return np.vstack([np.array([[*case.force, *case.torque] for case in body.load_cases]).reshape(-1, 6).T, loads])


def boundary_of(body: ReducedBody) -> tuple[tuple[BoundaryNode, ...], Array]:
    """Return the boundary nodes of all interfaces, and the map B from z to their dofs in mesh axes."""
    frame, A = body.frame, body.frame.axes
    nodes: list[BoundaryNode] = []
    rows: list[Array] = []
    count = 0
    for interface in body.interfaces:
        for position, motion in places_of(body, interface):
            turned = np.kron(np.eye(len(motion) // 3), A) @ motion
            nodes.append(BoundaryNode(interface.name, frame.origin + A @ position, np.arange(len(motion)), count))
            rows.append(turned[:, 6:] if body.is_held else turned)
            count += len(motion)
    width = body.n_q + (0 if body.is_held else 6)
    B = np.concatenate(rows) if rows else np.zeros((0, width))
    components = np.concatenate([node.components for node in nodes]) if nodes else np.zeros(0, dtype=int)
    B[:, width - body.n_q :][:, still_modes(body, B[:, width - body.n_q :], components)] = 0.0
    return tuple(nodes), B


def still_modes(body: ReducedBody, motion: Array, components: IntArray) -> Array:
    """Return whether each mode moves the interfaces by no more than rounding, (n_q,) bool.

    `motion` has a row for each of `components`: 0-2 translations, 3-5 rotations, (n, n_q).

    If the frame is at the only interface, no mode moves it. Without this check, rounding errors of about 1e-19 would be
    scaled up and replace the rigid motions.
    """
    extent = float(np.ptp(body.nodes, axis=0).max(initial=0.0))
    if not len(motion) or extent == 0.0:  # a single point has no length by which to scale rotations
        return np.zeros(body.n_q, dtype=bool)
    path = np.abs(motion) * np.where(components < 3, 1.0, extent)[:, None]
    return np.asarray(path.max(axis=0) <= ROUNDING_MOTION * np.abs(body.Phi).max(axis=(0, 1)))


def places_of(body: ReducedBody, interface: ReducedInterface) -> list[tuple[Array, Array]]:
    """Return points of an interface in B, each with the map from (d, theta, q) to its three or six dofs.

    This is one point with six dofs, or the members with three dofs each if the interface has no reference node.
    """
    if interface.kind == "nodes" and not (len(interface.members) == 1 and interface.has_rotation):
        points, Phi = body.nodes[interface.members], body.Phi[interface.members]
        motion = np.concatenate([rigid_motion_of_points(points, np.zeros(3)), Phi], axis=2)
        return list(zip(points, motion, strict=True))
    motion = np.hstack([six_motions(interface.position), interface.Psi])
    return [(interface.position, motion if interface.has_rotation else motion[:3])]


def require_rank(body: ReducedBody, nodes: tuple[BoundaryNode, ...], scaled: Array) -> None:
    """Raise `ExportError`, which names the missing constraint modes, unless the map has full row rank."""
    names = [f"{node.interface} {MOTION_COMPONENTS[c]}" for node in nodes for c in node.components]
    n_b = len(scaled)
    _, R, order = la.qr(scaled.T, mode="economic", pivoting=True)
    size = np.abs(np.diag(R))
    rank = int((size > RANK_TOLERANCE * size.max(initial=0.0)).sum())
    if rank == n_b:
        return
    missing = sorted(int(k) for k in order[rank:])
    shown = ", ".join(names[k] for k in missing[:12]) + (f" and {len(missing) - 12} more" if len(missing) > 12 else "")
    raise ExportError(
        f"body {body.name!r}: its {body.n_q} modes{'' if body.is_held else ' and 6 rigid motions'} move only {rank} of "
        f"the {n_b} dofs of its interfaces independently, and matrices over the interfaces need all of them; "
        f"missing constraint modes: {shown}. Reduce the body with a set that has a static mode for each "
        "(craig-bampton, guyan, rubin), or with fewer interfaces"
    )


def held_factor(body: ReducedBody, K_N: Array) -> tuple[Array, bool]:
    """Return the Cholesky factor of the stiffness with fixed interfaces; raise `ExportError` if it is singular."""
    energy = la.eigvalsh(K_N) if len(K_N) else np.ones(0)
    free = int((energy <= 1e-12 * energy.max(initial=0.0)).sum())
    if free:
        raise ExportError(
            f"body {body.name!r}: its interfaces do not hold it: {free} motions without energy remain when all are "
            "fixed, so there are no constraint modes; give it interfaces that prevent all rigid motions"
        )
    factor, lower = la.cho_factor(K_N) if len(K_N) else (K_N, False)
    return factor, bool(lower)


def fixed_modes(K_N: Array, M_N: Array) -> Array:
    """Return the eigenvectors by ascending frequency, scaled to unit mass, or to unit stiffness if massless."""
    if not len(K_N):
        return K_N
    # M x = mu K x, because K is definite but M may be singular
    mu, X = la.eigh(symmetric_part(M_N), symmetric_part(K_N))
    mu, X = mu[::-1], X[:, ::-1]
    has_mass = mu > MASSLESS * mu[0]
    return np.asarray(X / np.sqrt(np.where(has_mass, mu, 1.0)))
