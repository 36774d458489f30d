"""Recovery matrices of a reduced body: rows that give motions, stress and forces from its coordinates and loads.

With z = (d, theta, q): the small displacement and rotation of B in axes of B, and the modal coordinates,

    y = D_0 z + D_1 dz/dt + D_2 d²z/dt² + L p

where D_k is `dynamic[k]`, L is `static`, and p are the amplitudes of the loads named in `loads`. For a stress or a
force, D_0 is the mode displacement method. D_2 and L add the static response to inertia and loads outside the modes.
Together they are the mode acceleration method (docs/theory.md §11).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from cms.body.geometric_stiffness import SPIN_PAIRS
from cms.errors import BodyError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies
from fe_models.foundation.units import Dimensions, Units, unit_text, unit_words
from fe_models.foundation.words import nearest, quoted

__all__ = ["N_RIGID", "ORDERS", "RecoveryTable", "row_table", "spin_accelerations", "spin_change", "spin_products"]

N_RIGID = 6  #: number of coordinates of z before q: three of d and three of theta
ORDERS = ("displacement", "velocity", "acceleration")  #: derivatives of z, in the order of `dynamic`
TEXTS = ("labels", "quantities", "entities", "components")


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class RecoveryTable(Tabular):
    """Recovery matrices with named rows. Row components are in mesh or element axes, columns in axes of B.

    Parameters
    ----------
    name
        Name of the table.
    labels
        Label of each row, unique, such as "node 17 acceleration ux".
    quantities
        Quantity of each row, such as "acceleration" or "beam force".
    entities
        Kind of object of the row: "node", "element", "interface", "point" or "body".
    numbers
        Number of the node or element, (n_rows,); -1 if it only has a name.
    components
        Component of each row, such as "ux", "xx" or "end A My".
    dimensions
        Exponents of mass, length and time of each row, (n_rows, 3).
    dynamic
        Factors of z, dz/dt and d²z/dt², (3, n_rows, 6 + n_q).
    loads
        Name of each column of `static`.
    load_dimensions
        Exponents of mass, length and time of each amplitude, (n_loads, 3).
    static
        Residual static response to each load of unit amplitude, (n_rows, n_loads).
    system
        Unit system of all numbers.
    truncated
        Description of what the rows neglect.

    Raises
    ------
    BodyError
        If shapes do not fit, a number is not finite, or a label is repeated.
    """

    name: str
    labels: Annotated[tuple[str, ...], ArrayShape(("n_rows",))]
    quantities: Annotated[tuple[str, ...], ArrayShape(("n_rows",))]
    entities: Annotated[tuple[str, ...], ArrayShape(("n_rows",))]
    numbers: Annotated[IntArray, ArrayShape(("n_rows",))]
    components: Annotated[tuple[str, ...], ArrayShape(("n_rows",))]
    dimensions: Annotated[Array, ArrayShape(("n_rows", 3))]
    dynamic: Annotated[Array, ArrayShape((3, "n_rows", None))]
    loads: Annotated[tuple[str, ...], ArrayShape(("n_loads",))]
    load_dimensions: Annotated[Array, ArrayShape(("n_loads", 3))]
    static: Annotated[Array, ArrayShape(("n_rows", "n_loads"))]
    system: Units
    truncated: str = ""

    def __post_init__(self) -> None:
        where = f"recovery {self.name!r}"
        if self.n_q < 0:
            raise BodyError(f"{where}: dynamic: expected (3, {self.n_rows}, 6 + n_q), got {self.dynamic.shape}")
        for what, words in (("label", self.labels), ("load", self.loads)):
            if len(set(words)) != len(words):
                twice = next(word for k, word in enumerate(words) if word in words[:k])
                raise BodyError(f"{where}: two rows or columns have the {what} {twice!r}; request each only once")

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.labels)

    @property
    def n_q(self) -> int:
        """Number of modes."""
        return int(self.dynamic.shape[2]) - N_RIGID

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each row, such as "N mm"."""
        return tuple(unit_words(self.system, Dimensions(*row)) for row in self.dimensions)

    @property
    def load_units(self) -> tuple[str, ...]:
        """Unit of each load amplitude."""
        return tuple(unit_words(self.system, Dimensions(*row)) for row in self.load_dimensions)

    def values(
        self, z: Array, z_dot: Array | None = None, z_ddot: Array | None = None, p: Array | None = None
    ) -> Array:
        """Return y for coordinates, rates, accelerations and load amplitudes; omitted arguments count as zero.

        Parameters
        ----------
        z, z_dot, z_ddot
            Coordinates and their time derivatives, (..., 6 + n_q).
        p
            Load amplitudes, (..., n_loads).

        Returns
        -------
        Array
            Row values y, (..., n_rows).
        """
        width = N_RIGID + self.n_q
        total = 0.0
        for matrix, columns, what, n in (
            *((self.dynamic[k], x, f"{ORDERS[k]} of z", width) for k, x in enumerate((z, z_dot, z_ddot))),
            (self.static, p, "loads", len(self.loads)),
        ):
            if columns is None:
                continue
            if np.shape(columns)[-1:] != (n,):
                raise BodyError(
                    f"recovery {self.name!r}: {what}: expected {n} numbers on the last axis, got {np.shape(columns)}"
                )
            total = total + np.asarray(columns) @ matrix.T
        return np.asarray(total)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Name of each coordinate of z."""
        return (*(f"d {a}" for a in "xyz"), *(f"theta {a}" for a in "xyz"), *(f"q {k + 1}" for k in range(self.n_q)))

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """Unit of each coordinate of z."""
        kinds = [Dimensions(0, 1)] * 3 + [Dimensions()] * 3 + [Dimensions(0.5, 1)] * self.n_q
        return tuple(unit_text(self.system, kind) for kind in kinds)

    def to_table(self) -> Table:
        """Return label, number and unit of each row, and its factors of z, its derivatives and the loads (`row_table`).

        Units in brackets are units of the coordinate; for its velocity and acceleration divide by time and time².
        """
        matrices = dict(zip(ORDERS, self.dynamic, strict=True)) | {"load": self.static}
        columns = dict(zip(self.coordinates, self.coordinate_units, strict=True))
        return row_table(self, matrices, columns, dict(zip(self.loads, self.load_units, strict=True)))

    def rows(self, wanted: str) -> IntArray:
        """Return the rows with this label or quantity, or whose labels begin with these words.

        Raises
        ------
        BodyError
            If there is no such row.
        """
        found = [
            k
            for k, (label, quantity) in enumerate(zip(self.labels, self.quantities, strict=True))
            if wanted in (label, quantity) or label.startswith(f"{wanted} ")
        ]
        if not found:
            choices = [*dict.fromkeys(self.quantities), *self.labels]
            raise BodyError(f"recovery {self.name!r}: no row {quoted(wanted)}{nearest(wanted, choices)}")
        return np.array(found, dtype=np.int64)

    def of_rows(self, rows: Sequence[int] | IntArray) -> "RecoveryTable":
        """Return a table with some of the rows, in the given order."""
        rows = np.asarray(rows, dtype=np.int64)
        texts: dict[str, Any] = {name: tuple(getattr(self, name)[int(k)] for k in rows) for name in TEXTS}
        return replace(
            self,
            **texts,
            numbers=self.numbers[rows],
            dimensions=self.dimensions[rows],
            dynamic=self.dynamic[:, rows],
            static=self.static[rows],
        )

    def changed(self, X: Array, R: Array, p: Array) -> "RecoveryTable":
        """Transform the rows to the coordinates of another frame of the same body.

        Parameters
        ----------
        X
            Transformation z = X z_new, (6 + n_q, 6 + n_new). It also holds for z_ddot, except for the term of the spin
            in the acceleration of the origin, see `p`.
        R
            New axes as columns, in old axes, (3, 3).
        p
            New origin in the old frame, (3,) [m]. The old origin moves about it: d_ddot = ... + omega × (omega × -p).
        """
        static = np.array(self.static)
        index = {name: k for k, name in enumerate(self.loads)}
        for k, name in enumerate(self.loads):
            group, _, component = name.rpartition(" ")
            is_amount = not self.load_dimensions[k].any()  # the amplitude of a load case, which does not depend on axes
            if not is_amount and (component in ("fx", "mx") or name == "gravity x"):
                three = [index[f"{group} {component[:-1]}{axis}"] for axis in "xyz"]
                static[:, three] = self.static[:, three] @ R
            elif name == "spin xx":
                six = [index[f"spin {'xyz'[a]}{'xyz'[b]}"] for a, b in SPIN_PAIRS]
                T = spin_change(R)
                static[:, six] = self.static[:, six] @ T + self.dynamic[2][:, :3] @ spin_accelerations(-p) @ T
        return replace(self, dynamic=self.dynamic @ X, static=static)

    def in_units(self, new: Units) -> "RecoveryTable":
        """Return the table with its numbers in other units."""
        old = self.system

        def factors(dimensions: Array, time: float = 0.0) -> Array:
            return np.array([Dimensions(m, length, t + time).factor(old, new) for m, length, t in dimensions])

        z = np.zeros((N_RIGID + self.n_q, 3))
        z[:3, 1], z[N_RIGID:, 0], z[N_RIGID:, 1] = 1.0, 0.5, 1.0
        row = factors(self.dimensions)
        dynamic = [row[:, None] / factors(z, -k) * matrix for k, matrix in enumerate(self.dynamic)]
        static = row[:, None] / factors(self.load_dimensions).reshape(1, -1) * self.static
        return replace(self, dynamic=np.array(dynamic), static=static, system=new)


def row_table(
    rows: RecoveryTable, matrices: Mapping[str, Array], coordinates: Mapping[str, str], loads: Mapping[str, str]
) -> Table:
    """Return names, number and unit of each row, then its entries; zero matrices are omitted.

    Parameters
    ----------
    matrices
        Matrices over coordinates, and "load" over the loads, by name.
    coordinates, loads
        Units of the columns by name.
    """
    columns: dict[str, Any] = {
        "label": rows.labels, "quantity": rows.quantities, "entity": rows.entities, "number": rows.numbers,
        "component": rows.components, "unit": rows.units,
    }  # fmt: skip
    units: dict[str, str] = {}
    for name, matrix in matrices.items():
        if not np.any(matrix):
            continue
        for (column, unit), values in zip((loads if name == "load" else coordinates).items(), matrix.T, strict=True):
            columns[f"{name}: {column}"], units[f"{name}: {column}"] = values, unit
    return Table(columns, units, {"name": rows.name, "unit system": rows.system.name, "truncated": rows.truncated})


def spin_products(omega: Array) -> Array:
    """Return amplitudes of the loads "spin xx yy zz xy yz zx", (..., 6), given angular velocities, (..., 3) [rad/s].

    The amplitudes are omega_a omega_b, doubled for two different axes, because ab and ba share one load.

    Parameters
    ----------
    omega
        Angular velocities in axes of B, (..., 3) [rad/s].
    """
    omega = np.asarray(omega)
    return np.stack([(1.0 if a == b else 2.0) * omega[..., a] * omega[..., b] for a, b in SPIN_PAIRS], axis=-1)


def spin_accelerations(c: Array) -> Array:
    """Return the acceleration omega × (omega × c) per amplitude of `spin_products`, (3, 6)."""
    e = np.eye(3)
    columns = [(np.cross(e[a], np.cross(e[b], c)) + np.cross(e[b], np.cross(e[a], c))) / 2 for a, b in SPIN_PAIRS]
    return np.stack(columns, axis=1)


def spin_change(R: Array) -> Array:
    """Return the (6, 6) matrix from angular-velocity products in new axes to old axes; omega_old = R omega_new."""
    columns = []
    for a, b in SPIN_PAIRS:
        both = np.outer(R[:, a], R[:, b])  # product omega_a omega_b of the new axes, as a tensor in old axes
        both = (both + both.T) / 2
        columns.append([both[i, j] * (1.0 if i == j else 2.0) for i, j in SPIN_PAIRS])
    return np.array(columns).T
