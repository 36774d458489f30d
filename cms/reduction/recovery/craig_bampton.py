"""Craig-Bampton matrices of a reduced body with its rigid part, and recovery rows over the same coordinates.

The coordinates are y = (u_b, eta): motions of the interfaces in mesh axes, then fixed-interface modes of unit mass
(`interface_model`). With z = T y, the rows of a table become

    rows = D_0 T y + D_1 T y' + D_2 T y'' + L_b p_b + L p,   p_b = f_b of the rows of interface forces

where p_b are the loads at interfaces and p the others. If the base is driven, p_b is no input: it is replaced by f_b =
(M y'' + D y' + K y - G p)_b.
"""

from dataclasses import dataclass

import numpy as np

from cms.body.recovery_table import N_RIGID, RecoveryTable
from cms.body.reduced_body import ReducedBody
from cms.errors import ExportError, RecoveryError
from cms.reduction.interface_model import InterfaceModel, interface_model
from cms.reduction.recovery.interface_rows import node_words
from cms.reduction.recovery.load_columns import WRENCH, forces_of_loads
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array
from fe_models.foundation.components import MOTION_COMPONENTS

__all__ = ["CraigBampton", "InterfaceRows", "craig_bampton_matrices"]


@dataclass(frozen=True, eq=False)
class InterfaceRows:
    """Rows over (u_b, eta): `displacement` @ y + `velocity` @ y' + `acceleration` @ y'' + `load` @ p."""

    table: RecoveryTable  #: table of the rows: labels, quantities, units
    displacement: Array  #: (n_rows, n_b + n_modes)
    velocity: Array  #: (n_rows, n_b + n_modes)
    acceleration: Array  #: (n_rows, n_b + n_modes)
    loads: tuple[str, ...]  #: loads of the table that do not act at interfaces
    load: Array  #: (n_rows, n_loads)

    def values(self, y: Array, y_dot: Array, y_ddot: Array, p: Array | None = None) -> Array:
        """Return the rows, (..., n_rows), for motions, (..., n_b + n_modes), and amplitudes, (..., n_loads)."""
        total = y @ self.displacement.T + y_dot @ self.velocity.T + y_ddot @ self.acceleration.T
        return np.asarray(total if p is None else total + np.asarray(p) @ self.load.T)


@dataclass(frozen=True, eq=False)
class CraigBampton:
    """Mass, stiffness and damping over (u_b, eta), and rigid motions in these coordinates."""

    body: ReducedBody
    M: Array  #: (n, n), n = n_b + n_modes
    K: Array  #: (n, n), without coupling between boundary and modes
    D: Array  #: (n, n)
    T: Array  #: z = T y, (6 + n_q, n)
    boundary: tuple[str, ...]  #: name of each boundary dof, such as "tip ux", (n_b,)
    about: Array  #: reference point of the rigid motions, mesh coordinates, (3,) [m]
    rigid: Array  #: motions of the boundary dofs under the six rigid motions, mesh axes, (n_b, 6)

    @property
    def n_b(self) -> int:
        """Number of boundary dofs."""
        return len(self.boundary)

    @property
    def M_rigid(self) -> Array:
        """Mass matrix of the rigid motions, (6, 6), from the reduced boundary; exact if the mode set contains them."""
        b = slice(self.n_b)
        return np.asarray(self.rigid.T @ self.M[b, b] @ self.rigid)

    @property
    def frequencies(self) -> Array:
        """Frequencies of the fixed-interface modes, (n_modes,), cycles per time unit; infinite for massless modes."""
        inner = slice(self.n_b, None)
        mass, stiffness = np.diag(self.M)[inner], np.diag(self.K)[inner]
        omega2 = np.divide(stiffness, mass, out=np.full(len(mass), np.inf), where=mass > 0)
        return np.asarray(np.sqrt(omega2) / (2 * np.pi))

    def recover(self, table: RecoveryTable | str) -> InterfaceRows:
        """Return the rows of a table over (u_b, eta); interface loads are replaced by the equations of motion.

        Parameters
        ----------
        table
            A table of this body, or its name in `ReducedBody.recovery`.

        Raises
        ------
        RecoveryError
            If the table belongs to another body, a load acts at a node that is not kept, or an interface does not
            transmit the wrench of a single node (kind "nodes" with several nodes).
        """
        if isinstance(table, str):
            if table not in self.body.recovery:
                known = ", ".join(self.body.recovery) or "none"
                raise RecoveryError(f"body {self.body.name!r}: no recovery table {table!r}; there are {known}")
            table = self.body.recovery[table]
        if table.n_q != self.body.n_q or table.system != self.body.units:
            raise RecoveryError(
                f"recovery {table.name!r}: of {table.n_q} modes in {table.system.name}; expected one of body "
                f"{self.body.name!r}, {self.body.n_q} modes in {self.body.units.name}"
            )
        T = self.T if not self.body.is_held else np.vstack([np.zeros((N_RIGID, self.T.shape[1])), self.T])
        position, rate, acceleration = (matrix @ T for matrix in table.dynamic)
        L, other, G = self._split(table, T)
        for total, matrix in ((position, self.K), (rate, self.D), (acceleration, self.M)):
            total += L @ matrix[: self.n_b]
        load = table.static[:, other] - L @ G[: self.n_b]
        loads = tuple(table.loads[k] for k in other)
        return InterfaceRows(table, position, rate, acceleration, loads, load)

    def _split(self, table: RecoveryTable, T: Array) -> tuple[Array, list[int], Array]:
        """Return the static part over f_b, the other columns, and the forces of the other loads on y, (n, n_other).

        A wrench at an interface acts on its single node, in axes of B.
        """
        A = self.body.frame.axes
        turn = np.kron(np.eye(2), A.T)
        L = np.zeros((table.n_rows, self.n_b))
        names = [f"{interface.name} {word}" for interface in self.body.interfaces for word in WRENCH]
        other = [k for k, name in enumerate(table.loads) if name not in names]
        forces = forces_of_loads(self.body, [table.loads[k] for k in other])
        for interface in self.body.interfaces:
            if f"{interface.name} fx" not in table.loads:
                continue
            first = table.loads.index(f"{interface.name} fx")
            static = table.static[:, first : first + 6]
            rows = [k for k, word in enumerate(self.boundary) if word.rpartition(" ")[0] == interface.name]
            if len(rows) in (3, 6):
                L[:, rows] = (static @ turn)[:, : len(rows)]
            elif static.any():
                raise RecoveryError(
                    f"recovery {table.name!r}: interface {interface.name!r} has {len(rows)} dofs of several nodes, and "
                    "the static part knows the wrench of all together"
                )
        return L, other, T.T @ forces


def craig_bampton_matrices(body: ReducedBody, *, about: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> CraigBampton:
    """Return the Craig-Bampton matrices of a reduced body.

    Parameters
    ----------
    about
        Reference point of the rigid motions, mesh coordinates [m].

    Raises
    ------
    RecoveryError
        If its modes do not move the interface dofs independently, or the interfaces do not hold the body.
    """
    try:
        model = interface_model(body)
    except ExportError as error:
        raise RecoveryError(f"Craig-Bampton matrices: {error}") from error
    point = np.asarray(about, dtype=float)
    return CraigBampton(
        body, model.M, model.K, model.D, model.T, boundary_words(model), point, boundary_motion(model, point)
    )


def boundary_words(model: InterfaceModel) -> tuple[str, ...]:
    """Return the names of the boundary dofs."""
    return tuple(
        f"{word} {MOTION_COMPONENTS[component]}"
        for node, word in zip(model.nodes, node_words(model.nodes), strict=True)
        for component in node.components
    )


def boundary_motion(model: InterfaceModel, about: Array) -> Array:
    """Return the boundary dofs under the six rigid motions about a point, mesh axes, (n_b, 6)."""
    rows = [np.zeros((0, 6))]
    for node in model.nodes:
        motion = np.vstack([rigid_motion_of_points(node.position[None], about)[0], np.eye(6)[3:]])
        rows.append(motion[node.components])
    return np.concatenate(rows)
