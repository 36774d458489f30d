"""Conversion of a displacement field over the mesh to the dofs of the coupled body."""

from dataclasses import dataclass

import numpy as np

from fe_models.body.couplings.couplings import mean_motion
from fe_models.body.fe_body import FEBody, Interface
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields

__all__ = ["CoupledField", "coupled_field"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class CoupledField:
    """Columns over the dofs of a coupled body, and the part of the motion that its rigid interfaces cannot follow.

    Parameters
    ----------
    columns
        Displacement columns, (n_dof, k).
    departure
        Largest non-rigid share of the motion of the members of each rigid interface, 0 to 1.
    """

    columns: Array
    departure: dict[str, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", frozen(self.columns))


def coupled_field(body: FEBody, u_mesh: Array) -> CoupledField:
    """Convert displacement columns over the mesh to the dofs of a coupled body.

    (1) mesh dofs that stay in the body are copied
    (2) a rigid interface takes the rigid motion that fits the motion of its members best (least squares, rotations of
        members scaled with the body length)
    (3) a distributing interface takes the weighted mean motion of its members, which is exact by definition
    (4) reference nodes inside the body, where parts are welded, take the best-fitting motion, as in (2)
    (5) multipliers are zero; a field that satisfies the constraint has the same energy for any multiplier

    Parameters
    ----------
    body
        The coupled body.
    u_mesh
        Columns over the dofs of the uncoupled body, (n_mesh_dof, k).
    """
    if body.recovery is None:
        return CoupledField(u_mesh, {})
    columns = np.zeros((body.n_dof, np.shape(u_mesh)[1]))  # (5)
    row_of = np.full((len(body.nodes), 6), -1, np.int64)
    in_mesh = np.flatnonzero(body.recovery.dofs[:, 1] >= 0)
    row_of[tuple(body.recovery.dofs[in_mesh].T)] = in_mesh
    row = np.where(body.dofs[:, 1] >= 0, row_of[tuple(body.dofs.T)], -1)
    columns[row >= 0] = u_mesh[row[row >= 0]]  # (1)
    is_known = (row >= 0) | (body.dofs[:, 1] < 0)
    departure: dict[str, float] = {}
    for interface in body.interfaces:
        if interface.dofs is None or interface.kind == "nodes":
            continue
        if interface.kind == "rigid":
            columns[interface.dofs], departure[interface.name] = _nearest_rigid(body, interface, u_mesh)  # (2)
        else:
            points = body.nodes[interface.nodes]
            A = mean_motion(points, np.asarray(interface.weights), interface.reference)
            columns[interface.dofs] = A @ _member_translations(body, interface, u_mesh)  # (3)
        is_known[interface.dofs] = True
    length = np.sqrt(np.asarray(body.recovery.matrix.power(2).sum(axis=0)).ravel())
    rest = np.flatnonzero(~is_known & (length > 0))
    if len(rest):  # (4)
        T, size = body.recovery.matrix[:, rest], length[rest]
        N = (T.T @ T).toarray() / np.outer(size, size)
        b = (T.T @ (u_mesh - body.recovery.matrix @ columns)) / size[:, None]
        columns[rest] = np.linalg.solve(N, b) / size[:, None]
    return CoupledField(columns, departure)


def _nearest_rigid(body: FEBody, interface: Interface, u_mesh: Array) -> tuple[Array, float]:
    """Return the motion of the reference node that fits the members best, (6, k), and the relative remainder."""
    assert body.recovery is not None
    rows = np.flatnonzero(np.isin(body.recovery.dofs[:, 0], interface.nodes))
    scale = np.where(body.recovery.dofs[rows, 1] >= 3, body.length, 1.0)[:, None]
    T = scale * body.recovery.matrix[rows][:, interface.dofs].toarray()
    u = scale * u_mesh[rows]
    column_scale = np.linalg.norm(T, axis=0)
    motion = np.linalg.lstsq(T / column_scale, u, rcond=None)[0] / column_scale[:, None]
    size = np.linalg.norm(u, axis=0)
    rest = np.linalg.norm(u - T @ motion, axis=0)
    largest = size.max(initial=0.0)
    relative = np.divide(rest, size, out=np.zeros_like(rest), where=size > 1e-12 * largest)
    return motion, float(relative.max(initial=0.0))


def _member_translations(body: FEBody, interface: Interface, u_mesh: Array) -> Array:
    """Return the translations of the members, (3 n_members, k), node-major."""
    assert body.recovery is not None
    dofs = body.recovery.dofs
    table = np.full((len(body.nodes), 3), -1, np.int64)
    rows = np.flatnonzero((dofs[:, 1] >= 0) & (dofs[:, 1] < 3))
    table[dofs[rows, 0], dofs[rows, 1]] = rows
    return u_mesh[table[interface.nodes].ravel()]
