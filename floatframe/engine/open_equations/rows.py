"""Rows of a system at one state for each connection, as the kernels evaluate them, without a global matrix."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.initial_conditions.newton_equations import summed
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work, vectors_of_end
from floatframe.model.joints.rows import is_held

__all__ = ["End", "RowParts", "Structure", "row_parts", "structure_of"]


@dataclass(frozen=True)
class End:
    """One end of a connection on a body."""

    marker: int
    body: int
    connection: int
    w0: int  #: index of the first row and wrench component of the connection
    size: int  #: number of rows of the connection
    u0: int  #: index of the first velocity of the body
    n: int  #: number of velocities of the body
    x0: int  #: index of the first column of the end, if the columns of all ends are counted one after another
    #: pairs (part of the motion, part of the wrench) for the force and moment at the end
    places: tuple[tuple[int, int], ...]
    sign: float


@dataclass(frozen=True, eq=False)
class Structure:
    """Data that do not change with the state: the ends and the constraint rows of each connection."""

    ends: tuple[End, ...]
    holds: NDArray[np.bool_]  #: whether each row is a constraint, (n_w,)
    held: IntArray  #: indices of the constraint rows, (n_lam,)
    lam0: IntArray  #: index of the first multiplier of each connection, (n_c + 1,)
    n_u: int


@dataclass(frozen=True, eq=False)
class RowParts:
    """Rows at one state, with derivatives by body displacements in ground axes."""

    structure: Structure
    model: Model
    G: tuple[Array, ...]  #: for each end, derivatives of all connection rows by the displacement of the body, (size, n)
    J: tuple[Array, ...]  #: for each end, transposed map from wrench to body forces: forces = J.T @ w, (size, n)
    V: tuple[Array, ...]  #: for each connection, derivatives of the rows by its own wrench, (size, size)
    g: Array  #: residual of all rows, (n_w,)

    def held_force(self, lam: Array) -> Array:
        """Return the constraint forces Gᵀ lam, (n_u,)."""
        at = self.structure
        every, result = np.zeros(len(at.holds)), np.zeros(at.n_u)
        every[at.held] = lam
        for end, G in zip(at.ends, self.G, strict=True):
            result[end.u0 : end.u0 + end.n] += every[end.w0 : end.w0 + end.size] @ G
        return result

    def wrench_force(self, w: Array) -> Array:
        """Return the body forces Jᵀ w of all wrenches, (n_u,)."""
        result = np.zeros(self.structure.n_u)
        for end, J in zip(self.structure.ends, self.J, strict=True):
            result[end.u0 : end.u0 + end.n] += w[end.w0 : end.w0 + end.size] @ J
        return result

    def held_jacobian(self) -> sp.csr_array:
        """Return the constraint Jacobian G, (n_lam, n_u)."""
        at = self.structure
        parts = [(G, end.w0, end.u0) for end, G in zip(at.ends, self.G, strict=True)]
        return sp.csr_array(summed(parts, (len(at.holds), at.n_u))[at.held])

    def of_connection(self, c: int) -> tuple[Array, Array]:
        """Return row derivatives and wrench map of connection c for velocities of its bodies, (size, n_own) each."""
        own = [k for k, end in enumerate(self.structure.ends) if end.connection == c]
        places: dict[int, int] = {}
        n = 0
        for k in own:
            end = self.structure.ends[k]
            if end.body not in places:
                places[end.body] = n
                n += end.n
        size = int(self.model.connections.size[c])
        G, J = np.zeros((size, n)), np.zeros((size, n))
        for k in own:
            end = self.structure.ends[k]
            columns = slice(places[end.body], places[end.body] + end.n)
            G[:, columns] += self.G[k]
            J[:, columns] += self.J[k]
        return G, J


def structure_of(model: Model) -> Structure:
    """Return the data that do not change with the state."""
    ends = []
    for m in (int(m) for m in model.bodies.ends):
        i, c = int(model.markers.body[m]), int(model.markers.connection[m])
        parts = ((0, int(model.markers.force[m])), (3, int(model.markers.moment[m])))
        ends.append(
            End(
                m, i, c, int(model.connections.w0[c]), int(model.connections.size[c]), int(model.bodies.u0[i]),
                6 + int(model.bodies.n_q[i]), int(model.markers.x0[m]), tuple(p for p in parts if p[1] >= 0),
                float(model.markers.sign[m]),
            )
        )  # fmt: skip
    holds = is_held(model.rows.kind)
    lam0 = np.concatenate([[0], np.cumsum(holds)])[model.connections.w0]
    return Structure(tuple(ends), holds, np.flatnonzero(holds), lam0, int(model.bodies.u0[-1]))


def row_parts(structure: Structure, model: Model, work: Work) -> RowParts:
    """Return the rows that `evaluate_and_linearize` has stored in `work`."""
    G, J = [], []
    for end in structure.ends:
        R, n = work.state.R[end.body], end.n
        row = vectors_of_end(work.solver.J_row, 4, end.x0, n)
        column = vectors_of_end(work.solver.J_column, 2, end.x0, n)
        own = work.connections.P[end.marker, : end.size] @ (R @ row).reshape(12, n)
        own[:, :3] = own[:, :3] @ R.T
        carried = R @ column
        carried[:, :, :3] = carried[:, :, :3] @ R.T
        to_body = np.zeros((end.size, n))
        for part, place in end.places:
            to_body[place : place + 3] += end.sign * carried[part // 3]
        G.append(own)
        J.append(to_body)
    V = tuple(work.connections.V[c, :size, :size].copy() for c, size in enumerate(model.connections.size))
    return RowParts(structure, model, tuple(G), tuple(J), V, work.connections.g.copy())
