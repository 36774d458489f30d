"""Loads to which recovery rows respond: gravity, spin, wrenches at interfaces, load cases, forces at nodes.

All are in axes of B; wrenches act at the reference points of the interfaces. The generalised forces on z = (d, theta,
q) are Gᵀ F with the rigid motions and modes G. For a reduced body they follow from its moments.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cms.body.geometric_stiffness import SPIN_PAIRS
from cms.body.recovery_table import N_RIGID
from cms.body.reduced_body import BodyFrame, ReducedBody
from cms.errors import RecoveryError
from cms.reduction.basis.node_results import reference_motion
from cms.reduction.frame_conversion import six_motions
from cms.reduction.free_pencil import whole_pencil
from cms.reduction.geometric_stiffness.unit_states import has_geometric_stiffness, unit_mass_loads
from cms.reduction.recovery.model_rows import node_rows
from cms.reduction.recovery.places import Places
from cms.reduction.recovery.request import RecoveryRequest
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import MassLoads, rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "LoadColumns", "forces_of_loads", "loads_of_body", "loads_of_model", "nodes_of_loads", "on_coordinates",
]  # fmt: skip

GRAVITY = ("gravity x", "gravity y", "gravity z")
SPIN = tuple(f"spin {'xyz'[a]}{'xyz'[b]}" for a, b in SPIN_PAIRS)
WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")
ACCELERATION, RATE2, FORCE, MOMENT = (0.0, 1.0, -2.0), (0.0, 0.0, -2.0), (1.0, 1.0, -2.0), (1.0, 2.0, -2.0)


@dataclass(frozen=True, eq=False)
class LoadColumns:
    """Named loads of unit amplitude."""

    names: tuple[str, ...]
    dimensions: Array  #: exponents of mass, length and time of the amplitudes, (n_loads, 3)
    is_interface: np.ndarray  #: whether each load acts at an interface, (n_loads,) bool

    def column(self, name: str) -> int:
        """Return the column of a load."""
        return self.names.index(name)


class _Columns:
    """Collector of names, dimensions and flags of loads."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.dimensions: list[tuple[float, float, float]] = []
        self.is_interface: list[bool] = []

    def add(self, names: tuple[str, ...], dimensions: tuple[tuple[float, float, float], ...], at: bool = False) -> None:
        self.names += names
        self.dimensions += dimensions
        self.is_interface += [at] * len(names)

    def done(self) -> LoadColumns:
        return LoadColumns(
            tuple(self.names), np.array(self.dimensions).reshape(-1, 3), np.array(self.is_interface, dtype=bool)
        )


def loads_of_body(body: ReducedBody) -> tuple[LoadColumns, Array]:
    """Return the loads that a reduced body can represent, and their forces on z, (6 + n_q, n_loads).

    Spin is left out if the moments for its inertia forces are missing.
    """
    columns, forces = _Columns(), []
    n_q = body.n_q
    columns.add(GRAVITY, (ACCELERATION,) * 3)
    whole = rigid_rows(body)[:3].T
    forces.append(on_q_alone(whole, held=body.is_held))
    if not body.is_held and "3C" not in body.moments.missing:
        columns.add(SPIN, (RATE2,) * 6)
        forces.append(spin_forces(body))
    for interface in body.interfaces:
        columns.add(tuple(f"{interface.name} {word}" for word in WRENCH), (FORCE,) * 3 + (MOMENT,) * 3, at=True)
        motion = np.hstack([six_motions(interface.position), interface.Psi])
        if not interface.has_rotation:
            motion[3:] = 0.0
        forces.append(on_q_alone(motion.T, held=body.is_held))
    for case in body.load_cases:
        columns.add((f"load case {case.name}",), ((0.0, 0.0, 0.0),))
        forces.append(on_q_alone(np.concatenate([case.force, case.torque, case.h])[:, None], held=body.is_held))
    return columns.done(), np.hstack([np.zeros((N_RIGID + n_q, 0)), *forces])


def forces_of_loads(body: ReducedBody, names: Sequence[str]) -> Array:
    """Return the forces of named loads on z, (6 + n_q, n): loads stored in the body, or forces at kept nodes.

    Raises
    ------
    RecoveryError
        If a load acts at a node that is not kept, or a moment acts at a node whose rotation is unknown.
    """
    known, forces = loads_of_body(body)
    columns = [np.zeros((len(forces), 0))]
    for name in names:
        if name in known.names:
            columns.append(forces[:, [known.column(name)]])
        else:
            columns.append(on_q_alone(node_force(body, name)[:, None], held=body.is_held))
    return np.hstack(columns)


def node_force(body: ReducedBody, name: str) -> Array:
    """Return the force on z due to a load such as "node 17 fx" at a kept node, in axes of B, (6 + n_q,)."""
    place, _, word = name.rpartition(" ")
    node = place.removeprefix("node ")
    flags = body.numbering.on_skin
    rows = [row for row in range(len(body.nodes)) if not (flags.size and flags[row]) and body.node_name(row) == node]
    turning = [] if body.kept is None else [row for row in rows if body.kept.of_node(row) is not None]
    if not rows or word not in WRENCH or not place.startswith("node "):
        raise RecoveryError(
            f"body {body.name!r}: load {name!r}: its work on the modes is unknown, because the body does not keep this "
            "node; reduce it again with the table (nodes of loads_at are kept), or make the table without loads_at"
        )
    row = (turning or rows)[0]
    motion = np.hstack([six_motions(body.nodes[row]), np.zeros((6, body.n_q))])
    motion[:3, N_RIGID:] = body.Phi[row]
    if word in WRENCH[3:]:
        rotation = None if body.kept is None else body.kept.of_node(row)
        if rotation is None:
            raise RecoveryError(f"body {body.name!r}: load {name!r}: the rotation of that node is not known")
        motion[3:, N_RIGID:] = rotation
    return np.asarray(motion[WRENCH.index(word)])


def spin_forces(body: ReducedBody) -> Array:
    """Return the forces on z due to the loads A c of `unit_mass_loads` with unit amplitude, (6 + n_q, 6)."""
    moments = body.moments
    columns = []
    for A in unit_mass_loads(BodyFrame("", np.zeros(3))).A[6:]:
        V = A @ moments.R  # ∫ f cᵀ
        torque = np.array([V[2, 1] - V[1, 2], V[0, 2] - V[2, 0], V[1, 0] - V[0, 1]])
        columns.append(np.concatenate([A @ moments.S, torque, np.einsum("ba,abk->k", A, moments.P)]))
    return np.array(columns).T


def on_q_alone(forces: Array, *, held: bool) -> Array:
    """Return forces on z; for a body fixed to the ground, the forces on the rigid motions are zero."""
    forces = np.array(forces)
    if held:
        forces[:N_RIGID] = 0.0
    return forces


def loads_of_model(body: FEBody, frame: BodyFrame, loads_at: Iterable[str | int] = ()) -> tuple[LoadColumns, Array]:
    """Return the loads on a finite element body, and their forces on its dofs, (n_dof, n_loads)."""
    columns, forces = _Columns(), []
    turn = np.kron(np.eye(2), frame.axes)
    columns.add(GRAVITY, (ACCELERATION,) * 3)
    forces.append(np.asarray(body.M @ (rigid_motion_of_dofs(body.nodes, body.dofs)[:, :3] @ frame.axes)))
    if has_geometric_stiffness(body):
        assert body.element_model is not None
        mass = unit_mass_loads(frame)
        columns.add(SPIN, (RATE2,) * 6)
        on_mesh = body.element_model.mass_forces(MassLoads(mass.A[6:], mass.b[6:]))
        forces.append(np.asarray(on_mesh if body.recovery is None else body.recovery.matrix.T @ on_mesh))
    for interface in body.interfaces:
        columns.add(tuple(f"{interface.name} {word}" for word in WRENCH), (FORCE,) * 3 + (MOMENT,) * 3, at=True)
        forces.append(np.asarray(reference_motion(body, interface).rows.T @ turn))
    for case in body.load_cases:
        columns.add((f"load case {case.name}",), ((0.0, 0.0, 0.0),))
        forces.append(np.asarray(case.f)[:, None])
    places = Places(body)
    for at in loads_at:
        for node in places.nodes(at).tolist():
            matrix, components = node_rows(body, node)
            for first, words, dimensions in ((0, WRENCH[:3], FORCE), (3, WRENCH[3:], MOMENT)):
                own = np.flatnonzero((components >= first) & (components < first + 3))
                if len(own) == 3:
                    columns.add(tuple(f"node {places.word(node)} {word}" for word in words), (dimensions,) * 3)
                    forces.append(np.asarray(sp.csr_array(matrix[own]).T @ frame.axes))
    return columns.done(), np.hstack([np.zeros((body.n_dof, 0)), *forces])


def nodes_of_loads(body: FEBody, requests: Iterable[RecoveryRequest]) -> IntArray:
    """Return the nodes in `loads_at`, (n,). The reduced body keeps them so that it knows the work of these loads."""
    places = Places(body)
    found = [places.nodes(at) for request in requests for at in request.loads_at]
    return np.concatenate([np.zeros(0, np.int64), *found])


def on_coordinates(body: ReducedBody) -> tuple[Array, Array, Array]:
    """Return M, D and K over z = (d, theta, q), (6 + n_q, 6 + n_q) each; a fixed body has zeros for rigid motions."""
    pencil = whole_pencil(body)
    M = np.array(pencil.M)
    if body.is_held:
        M[:N_RIGID] = M[:, :N_RIGID] = 0.0
    return M, pencil.D, pencil.K


def rigid_rows(body: ReducedBody) -> Array:
    """Return the matrix that maps accelerations of z to force and torque about the origin of B, (6, 6 + n_q)."""
    return np.hstack([body.moments.rigid_mass, body.moments.coupling])
