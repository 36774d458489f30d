"""Stress at the centres of chosen cells, as named points (`fe_body.StressPointModel`), and in layers."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.elements.shells.elements import ShellCells
from fe_models.elements.shells.laminate import layer_axes_stress
from fe_models.elements.shells.model import BOTTOM, MIDDLE, TOP, ShellModel
from fe_models.elements.shells.stiffeners import StiffenedModel
from fe_models.errors import ShellError
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["ShellPoints", "layer_stress", "shell_points"]

HEIGHTS = {"top": TOP, "middle": MIDDLE, "bottom": BOTTOM}


@dataclass(frozen=True, eq=False)
class ShellPoints:
    """Points through the thickness at cell centres. Each has the stress of its own cell, without averaging."""

    parts: tuple[tuple[ShellCells, IntArray], ...]  #: cells of each type, and indices of the chosen cells

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each point, such as "quad 3 top", (n_points,)."""
        return tuple(f"{group.kind} {row} {name}" for group, rows in self.parts for row in rows for name in HEIGHTS)

    @property
    def positions(self) -> Array:
        """Undeformed positions in mesh axes, (n_points, 3) [m]."""
        places = []
        for group, rows in self.parts:
            center = group.planes.corners[rows].mean(axis=1)
            arm = group.t[rows, None] * group.planes.R[rows][:, :, 2]
            places.append(np.stack([center + height * arm for height in HEIGHTS.values()], axis=1).reshape(-1, 3))
        return frozen(np.concatenate(places))

    def stress(self, u: Array) -> Array:
        """Return the stress for columns over the mesh dofs, (n_points, 6, k) [Pa], xx yy zz yz xz xy in mesh axes."""
        values = []
        for group, rows in self.parts:
            for row in rows.tolist():
                at = slice(row, row + 1)
                mean = group.resultants(np.asarray(u), at).mean(axis=1, keepdims=True)
                values += [group.stress(mean, at, height)[0] for height in HEIGHTS.values()]
        return np.concatenate(values)


def shell_points(body: FEBody, cells: Mapping[str, Iterable[int]]) -> FEBody:
    """Return the body with named stress points at the top, middle and bottom of some cells.

    Parameters
    ----------
    body
        Body made by `shell_body`, coupled or not.
    cells
        Indices of cells in `ShellMesh.cells`, by cell type, such as a group `mesh.cell_sets["lug"]`.

    Raises
    ------
    ShellError
        If the body is not a shell, or a cell does not exist.
    """
    return replace(body, stress_points=ShellPoints(_chosen("shell_points", body, cells)))


def layer_stress(body: FEBody, u: Array, cells: Mapping[str, Iterable[int]], layer: int) -> Array:
    """Return the stress of one layer at the centres of some cells, in layer axes.

    Parameters
    ----------
    body
        Body made by `shell_body`, coupled or not.
    u
        Displacement columns over the dofs of the body, (n_dof, k).
    cells
        Indices of cells in `ShellMesh.cells`, by cell type.
    layer
        Index of the layer, 0 at the bottom.

    Returns
    -------
    Array
        Stress, (n_cells, 2, 5, k) [Pa]: sigma_1 sigma_2 tau_12 tau_13 tau_23 at the bottom and at the top of the layer.
        Axis 1 is at the angle of the layer, and axis 3 is the normal. Cells keep the given order.

    Raises
    ------
    ShellError
        If the body is not a shell, or a cell does not exist or has no such layer.
    """
    u = np.asarray(u)
    if u.ndim != 2 or len(u) != body.n_dof:
        raise ShellError(f"layer_stress: u: expected columns over {body.n_dof} dofs, got {u.shape}")
    of_mesh, values = body.mesh_displacement(u), []
    for group, rows in _chosen("layer_stress", body, cells):
        for row in rows.tolist():
            law = group.laws[group.law[row]]
            if not 0 <= layer < len(law.layers):
                raise ShellError(
                    f"layer_stress: {group.kind} {row} has {len(law.layers)} layers; expected 0..{len(law.layers) - 1}"
                    f", got {layer}"
                )
            resultants = group.resultants(of_mesh, slice(row, row + 1)).mean(axis=1)[0]
            T = layer_axes_stress(law.layers[layer].angle)
            values.append([T @ law.stress(z, layer) @ resultants for z in law.z[layer : layer + 2]])
    return np.array(values)


def _chosen(what: str, body: FEBody, cells: Mapping[str, Iterable[int]]) -> tuple[tuple[ShellCells, IntArray], ...]:
    model = body.element_model
    if isinstance(model, StiffenedModel):
        model = model.shell
    where = f"{what}: body {body.name!r}"
    if not isinstance(model, ShellModel):
        raise ShellError(f"{where} is not a shell; choose the points before welding")
    parts = []
    for kind, chosen in cells.items():
        group = next((group for group in model.groups if group.kind == kind), None)
        rows = np.array(list(chosen), dtype=np.int64)
        n = 0 if group is None else len(group.cells)
        if group is None or not len(rows) or rows.min() < 0 or rows.max() >= n:
            raise ShellError(f"{where}: {kind}: expected some of {n} cells, 0..{n - 1}, got {rows.tolist()[:5]}")
        parts.append((group, rows))
    if not parts:
        raise ShellError(f"{where}: expected cells, got none")
    return tuple(parts)
