"""Rods of a truss: lines with axial force only, as a body with translational dofs.

(1) elongation of a rod: e = t · (u_2 - u_1) with direction t; energy ½ E A / L e²
(2) displacement is linear along the rod: kinetic energy ½ rho A L / 6 (2 v_1² + 2 v_1 · v_2 + 2 v_2²)
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.body.fe_body import FEBody, dofs_of
from fe_models.body.material import Material
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.units import Units
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh_numbering import line_numbering

__all__ = ["Rod", "rod_body"]


@dataclass(frozen=True)
class Rod:
    """Material and cross-section area of rods."""

    material: Material
    area: float  #: cross-section area [m²]


def rod_body(mesh: LineMesh, rods: Mapping[str, Rod], *, name: str, units: Units, is_lumped: bool = False) -> FEBody:
    """Return the body of the rods of a truss, with three translations at each node.

    Parameters
    ----------
    mesh
        Mesh whose lines are the rods.
    rods
        Material and area of each group of lines.
    name, units
        Name and unit system of the body.
    is_lumped
        Whether half of the mass of a rod is at each end; False: consistent mass (2).

    Raises
    ------
    BodyError
        If a line has no area, two areas or no length, or an area is not positive.
    """
    of_line: list[Rod | None] = [None] * len(mesh.lines)
    for group, rod in rods.items():
        if not 0 < rod.area < np.inf:
            raise BodyError(f"rods {group!r}: expected an area above zero, got {rod.area!r}")
        for line in mesh.line_sets[group].tolist():
            if of_line[line] not in (None, rod):
                raise BodyError(f"rods {group!r}: line {line} has two areas or materials")
            of_line[line] = rod
    used = [rod for rod in of_line if rod is not None]
    if len(used) < len(of_line):
        raise BodyError(f"body {name!r}: {len(of_line) - len(used)} rods have no area")
    x = mesh.nodes[mesh.lines[:, 1]] - mesh.nodes[mesh.lines[:, 0]]
    L = np.linalg.norm(x, axis=1)
    if not L.all():
        raise BodyError(f"body {name!r}: rod {int(np.argmin(L))} has no length")
    t = x / L[:, None]
    A = np.array([rod.area for rod in used])
    E, rho = (np.array([getattr(rod.material, key) for rod in used]) for key in ("E", "rho"))
    signs = np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = np.einsum("n,ab,ni,nj->naibj", E * A / L, signs, t, t)  # (1)
    shares = np.diag([3.0, 3.0]) if is_lumped else np.array([[2.0, 1.0], [1.0, 2.0]])
    M = np.einsum("n,ab,ij->naibj", rho * A * L / 6, shares, np.eye(3))  # (2)
    n_nodes = len(mesh.nodes)
    dofs = (3 * mesh.lines[:, :, None] + np.arange(3)).reshape(-1, 6)
    volumes = np.zeros(n_nodes)
    np.add.at(volumes, mesh.lines.ravel(), np.repeat(A * L / 2, 2))
    return FEBody(
        name=name,
        M=_assembled(M.reshape(-1, 6, 6), dofs, 3 * n_nodes),
        K=_assembled(K.reshape(-1, 6, 6), dofs, 3 * n_nodes),
        nodes=mesh.nodes,
        dofs=dofs_of(np.arange(n_nodes), 3),
        units=units,
        node_volumes=volumes,
        numbering=line_numbering(mesh, np.zeros(0, np.int64), np.zeros(0, np.int64)),
        kept=np.arange(n_nodes),
    )


def _assembled(matrices: Array, dofs: IntArray, n_dof: int) -> sp.csc_array:
    rows = np.repeat(dofs, 6, axis=1).ravel()
    columns = np.tile(dofs, (1, 6)).ravel()
    return sp.coo_array((matrices.ravel(), (rows, columns)), shape=(n_dof, n_dof)).tocsc()
