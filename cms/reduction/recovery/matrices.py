"""Recovery tables of a reduced body, computed from its own data or, during the reduction, from its FE model.

For every row R over the dofs of the model (docs/theory.md §11):

(1) mode displacement: R [Psi_B, Phi], over z
(2) u_j = G (F_j - W Psi_R (Psi_Rᵀ W Psi_R)⁻¹ Psi_Rᵀ F_j): static response to each balanced load, in the frame
(3) residual response: u_j - Phi K⁻¹ Phiᵀ F_j, the part that the modes do not contain
(4) the same for the inertia forces -M [Psi_B, Phi], over z''
(5) rows of displacement, stress and element force use (1), (3) and (4); rows of velocity and acceleration use only (1),
    and accelerations also the part omega × (omega × c) of a spin
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from cms.body.recovery_table import N_RIGID, RecoveryTable, spin_accelerations
from cms.body.reduced_body import ReducedBody
from cms.errors import RecoveryError
from cms.modes.families.families import Families, body_of, families_of
from cms.reduction.basis.frames import FrameCondition
from cms.reduction.recovery.blocks import Block, RowName
from cms.reduction.recovery.interface_rows import PartOfTable, interface_part
from cms.reduction.recovery.kept_rows import kept_part
from cms.reduction.recovery.load_columns import (
    SPIN,
    LoadColumns,
    forces_of_loads,
    loads_of_body,
    loads_of_model,
    on_coordinates,
)
from cms.reduction.recovery.model_rows import model_block
from cms.reduction.recovery.request import OF_INTERFACES, OF_MOTION, RecoveryRequest
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array

__all__ = ["recovery_matrices", "recovery_of_model", "tables_of_fewer_modes"]

OF_MODEL = (
    "omitted modes respond to inertia and loads statically; no Coriolis forces and no geometric "
    "stiffening; the static part has only the loads of its columns; velocities and accelerations have none"
)
OF_BODY = (
    "mode displacement alone: the static part of displacement and stress outside the modes needs the model; make "
    "the table while the body is reduced (recovery = ..., [recovery.NAME] in a job)"
)


def recovery_matrices(
    body: ReducedBody, requests: RecoveryRequest | Iterable[RecoveryRequest]
) -> Mapping[str, RecoveryTable]:
    """Return recovery tables with the rows that a reduced body can compute without its FE model.

    These are motions and stress of kept nodes, motions of interfaces, interface forces and net forces, without the
    static part of displacement and stress that the modes do not contain. `reduce(..., recovery=requests)` includes this
    part, and provides the other quantities.

    Parameters
    ----------
    body
        The reduced body.
    requests
        The requested rows; each request becomes one table.

    Raises
    ------
    RecoveryError
        If the body does not know a requested row.
    """
    loads, forces = loads_of_body(body)
    tables = {}
    for request in unique(requests):
        if request.loads_at:
            raise RecoveryError(
                f"recovery {request.name!r}: loads_at: the static part needs the model; make the table while the body "
                "is reduced"
            )
        parts = [
            interface_part(body, rows, loads, forces)
            if rows.quantity in OF_INTERFACES
            else kept_part(body, rows, loads)
            for rows in request.rows
        ]
        tables[request.name] = table_of(body, request.name, parts, loads, OF_BODY)
    return tables


def unique(requests: RecoveryRequest | Iterable[RecoveryRequest]) -> tuple[RecoveryRequest, ...]:
    """Return the requests after a check that their names are unique."""
    found = (requests,) if isinstance(requests, RecoveryRequest) else tuple(requests)
    names = [request.name for request in found]
    if len(set(names)) != len(names):
        raise RecoveryError(f"recovery: two tables have the same name; got {', '.join(names)}")
    return found


def table_of(
    body: ReducedBody, name: str, parts: Sequence[PartOfTable], loads: LoadColumns, truncated: str
) -> RecoveryTable:
    """Assemble the table from its parts, in their order."""
    names = [each for part in parts for each in part.names]
    return RecoveryTable(
        name=name,
        labels=tuple(each.label for each in names),
        quantities=tuple(each.quantity for each in names),
        entities=tuple(each.entity for each in names),
        numbers=np.array([each.number for each in names], dtype=np.int64),
        components=tuple(each.component for each in names),
        dimensions=np.array([dimensions_of(each) for each in names]).reshape(-1, 3),
        dynamic=np.concatenate([part.dynamic for part in parts], axis=1),
        loads=loads.names,
        load_dimensions=loads.dimensions,
        static=np.concatenate([part.static for part in parts]),
        system=body.units,
        truncated=truncated,
    )


def dimensions_of(name: RowName) -> tuple[float, float, float]:
    """Return the exponents of mass, length and time of a row."""
    return name.dimensions.mass, name.dimensions.length, name.dimensions.time


# Of the model ---------------------------------------------------------------------------------------------------------


def recovery_of_model(
    source: FEBody | Families,
    Phi: Array,
    condition: FrameCondition,
    reduced: ReducedBody,
    requests: RecoveryRequest | Iterable[RecoveryRequest],
    *,
    over: Array | None = None,
) -> Mapping[str, RecoveryTable]:
    """Compute the recovery tables of a body during its reduction.

    Parameters
    ----------
    source
        The coupled body, or its `Families`, whose factorisation is then reused.
    Phi
        Shapes of the body in the frame of `condition`, (n_dof, n_q).
    reduced
        The reduced body with these shapes.
    over
        Combinations of the modes, (n_q, k). The columns of the tables are then (d, theta) and these combinations, which
        costs k static solutions instead of n_q. None: all modes.

    Raises
    ------
    RecoveryError
        If the body does not know a requested row.
    """
    body = body_of(source)
    tables: dict[str, RecoveryTable] = {}
    wanted = unique(requests)
    if not wanted:
        return tables
    frame = condition.frame
    Psi_B = np.zeros((body.n_dof, N_RIGID))
    if not body.is_held:
        Psi_B = rigid_motion_of_dofs(body.nodes, body.dofs, frame.origin) @ np.kron(np.eye(2), frame.axes)
    motion = np.hstack([Psi_B, Phi if over is None else Phi @ over])
    with families_of(source) as families:
        for request in wanted:
            blocks = [None if rows.quantity in OF_INTERFACES else model_block(body, rows) for rows in request.rows]
            loads, F = loads_of_model(body, frame, request.loads_at)
            residual = np.zeros((body.n_dof, 0))
            if any(block is not None and not block.order for block in blocks):
                residual = residual_response(families, condition, Phi, reduced.K, np.hstack([F, -(body.M @ motion)]))
            columns = np.hstack([motion, residual])
            parts = [
                interface_part(reduced, rows, loads, np.vstack([Psi_B.T, Phi.T]) @ F).over(over)
                if block is None
                else part_of_block(block, columns, motion.shape[1], reduced, loads)
                for rows, block in zip(request.rows, blocks, strict=True)
            ]
            tables[request.name] = table_of(reduced, request.name, parts, loads, OF_MODEL)
    return tables


def residual_response(families: Families, condition: FrameCondition, Phi: Array, K: Array, F: Array) -> Array:
    """Return the part of the static response to load columns outside the modes, (n_dof, k): steps (2) and (3)."""
    if condition.Psi_R.shape[1]:
        F = F - condition.W @ np.linalg.solve(condition.Psi_R.T @ condition.W, condition.Psi_R.T @ F)
    u = families.static(F)
    if condition.Psi_R.shape[1]:
        u = u - condition.Psi_R @ condition.rigid_part(u)
    return np.asarray(u - Phi @ ((Phi.T @ F) / np.diag(K)[:, None]))


def part_of_block(block: Block, columns: Array, width: int, reduced: ReducedBody, loads: LoadColumns) -> PartOfTable:
    """Return the rows of one block: step (5).

    Parameters
    ----------
    columns
        [Psi_B, Phi], residual responses to the loads, and residual responses to the inertia forces, (n_dof, n).
    width
        Number of columns of [Psi_B, Phi].
    """
    n, n_loads = len(block.names), len(loads.names)
    dynamic, static = np.zeros((3, n, width)), np.zeros((n, n_loads))
    if block.order:
        dynamic[block.order] = block.values(columns[:, :width])
        if block.order == 2 and block.places is not None:
            static = spin_part(block.places, reduced, loads)
    else:
        values = block.values(columns)
        dynamic[0], static, dynamic[2] = np.split(values, [width, width + n_loads], axis=1)
    return PartOfTable(block.names, dynamic, static)


def spin_part(places: tuple[Array, Array], reduced: ReducedBody, loads: LoadColumns) -> Array:
    """Return the acceleration omega × (omega × c) at positions along given directions, (n_rows, n_loads)."""
    static = np.zeros((len(places[0]), len(loads.names)))
    if SPIN[0] in loads.names:
        first = loads.column(SPIN[0])
        A = reduced.frame.axes
        for row, (point, direction) in enumerate(zip(*places, strict=True)):
            c = A.T @ (point - reduced.frame.origin)
            static[row, first : first + 6] = (A.T @ direction) @ spin_accelerations(c)
    return static


# Of a body with fewer modes -------------------------------------------------------------------------------------------


def tables_of_fewer_modes(body: ReducedBody, Z: Array) -> Mapping[str, RecoveryTable]:
    """Return the tables of a body over the shapes Phi Z, (n_q, n_new), of which dropped modes respond statically.

    In steps (3) and (4), Phi K⁻¹ Phiᵀ becomes smaller by Phi X Phiᵀ with X = K⁻¹ - Z (Zᵀ K Z)⁻¹ Zᵀ.
    """
    X = np.diag(1 / np.diag(body.K)) - Z @ np.linalg.solve(Z.T @ body.K @ Z, Z.T)
    to_old = np.zeros((N_RIGID + body.n_q, N_RIGID + Z.shape[1]))
    to_old[:N_RIGID, :N_RIGID], to_old[N_RIGID:, N_RIGID:] = np.eye(N_RIGID), Z
    M = on_coordinates(body)[0]
    tables = {}
    for name, table in body.recovery.items():
        has_static = np.array(
            [each not in (*OF_MOTION[1:], *OF_INTERFACES) and table.truncated != OF_BODY for each in table.quantities]
        )
        rows = has_static[:, None] * table.dynamic[0][:, N_RIGID:] @ X
        dynamic = np.array(table.dynamic)
        dynamic[2] -= rows @ M[N_RIGID:]
        static = table.static + rows @ forces_of_loads(body, table.loads)[N_RIGID:]
        tables[name] = replace(table, dynamic=dynamic @ to_old, static=static)
    return tables
