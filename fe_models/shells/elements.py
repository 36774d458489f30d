"""The shell elements of one cell type: stiffness, mass, stress resultants, stress."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.beams.axes import skew
from fe_models.beams.slices import Slices
from fe_models.foundation.arrays import Array, IntArray
from fe_models.shells.geometry import CellPlanes, cell_planes
from fe_models.shells.quad import quad_strains
from fe_models.shells.shapes import FlatShape, flat_quadrature, flat_shape
from fe_models.shells.shell_property import ShellProperty
from fe_models.shells.strains import N_STRAINS, FlatStrains, jacobians, plane_elasticity
from fe_models.shells.triangle import triangle_strains

__all__ = ["ShellCells", "shell_cells"]

CHUNK = 500  #: cells whose operators are held at once
SHEAR_FACTOR = 5 / 6  #: of the transverse shear stiffness of a homogeneous plate
DRILLING = 0.1  #: gamma of quads, over the shear modulus; see docs/shells.md for what larger and smaller ones cost
DRILLING_SHARE = {"triangle": 1.0, "quad": 0.3}  #: of the drilling rotations in the displacement of the sides
STRAIN_DEGREE = {"triangle": 2, "quad": 3}
MASS_DEGREE = {"triangle": 4, "quad": 5}  #: squares of quadratic fields, times the area element


@dataclass(frozen=True, eq=False)
class ShellCells:
    """Cells of one type with their planes and numbers per cell."""

    kind: str
    cells: IntArray  #: nodes, (n, c)
    planes: CellPlanes
    t: Array  #: thickness, (n,) [m]
    E: Array  #: (n,) [Pa]
    nu: Array  #: (n,)
    mass: Array  #: per area, added mass included, (n,) [kg/m²]

    @property
    def dofs(self) -> IntArray:
        """Dofs of the nodes of each cell, (n, 6 c)."""
        return (6 * self.cells[:, :, None] + np.arange(6)).reshape(len(self.cells), -1)

    def chunks(self) -> Iterator[slice]:
        """Yield slices of rows small enough to hold their operators."""
        for begin in range(0, len(self.cells), CHUNK):
            yield slice(begin, min(begin + CHUNK, len(self.cells)))

    def strains(self, rows: slice) -> FlatStrains:
        """Return strain operators in local axes over the dofs of the nodes, points of `STRAIN_DEGREE`."""
        planes = self.planes[rows]
        G = self.E[rows] / (2 * (1 + self.nu[rows]))
        ratio = self.t[rows] ** 2 / (6 * SHEAR_FACTOR * (1 - self.nu[rows]))  # D / (kappa G t)
        if self.kind == "quad":
            local = quad_strains(planes.xy, plane_elasticity(self.E[rows], self.nu[rows]), DRILLING * G, ratio)
        else:
            local = triangle_strains(planes.xy, self.nu[rows], ratio)
        return FlatStrains(_times_blocks(local.B, planes), local.weights)

    def elasticity(self, rows: slice) -> Array:
        """Return resultants per strain: N, M, Q and drilling, (n, 9, 9) [N/m, N m]."""
        t, E, nu = self.t[rows], self.E[rows], self.nu[rows]
        C, G = plane_elasticity(E, nu), E / (2 * (1 + nu))
        D = np.zeros((len(t), N_STRAINS, N_STRAINS))
        D[:, :3, :3] = t[:, None, None] * C
        D[:, 3:6, 3:6] = (t**3 / 12)[:, None, None] * C
        D[:, 6, 6] = D[:, 7, 7] = SHEAR_FACTOR * G * t
        D[:, 8, 8] = DRILLING * G * t
        return D

    def stiffness(self) -> Array:
        """Return Σ w Bᵀ D B over the dofs of the nodes, (n, 6 c, 6 c)."""
        n, d = len(self.cells), 6 * self.cells.shape[1]
        K = np.empty((n, d, d))
        for rows in self.chunks():
            strains = self.strains(rows)
            weighted = self.elasticity(rows)[:, None] @ (strains.weights[..., None, None] * strains.B)
            part = len(strains.B)
            K[rows] = strains.B.reshape(part, -1, d).transpose(0, 2, 1) @ weighted.reshape(part, -1, d)
        return (K + K.transpose(0, 2, 1)) / 2

    def slices(self, rows: slice) -> Slices:
        """Return pieces of the normal as rigid slices: mass per area, and its second moment t²/12 along the normal.

        A slice at the middle surface moves by u + theta × z n, z in -t/2..t/2: the drilling rotation does not move it.
        """
        planes = self.planes[rows]
        points, w = flat_quadrature(self.kind, MASS_DEGREE[self.kind])
        shape = flat_shape(self.kind, points)
        n, p, c = len(planes.R), len(points), self.cells.shape[1]
        _, det = jacobians(shape.gradients, planes.xy)
        mass = self.mass[rows, None] * w * det
        motion = np.zeros((n, p, 6, c, 6))
        motion[:, :, :3] = translations(planes, shape.values, shape.side_values, shape, DRILLING_SHARE[self.kind])
        for a in range(3, 6):
            motion[:, :, a, :, a] = shape.values
        moments = np.zeros((n, p, 3))
        moments[:, :, 2] = mass * self.t[rows, None] ** 2 / 12
        return Slices(
            position=shape.values @ planes.corners,
            mass=mass,
            axes=np.broadcast_to(planes.R[:, None], (n, p, 3, 3)),
            moments=moments,
            motion=motion.reshape(n, p, 6, 6 * c),
            dofs=self.dofs[rows],
        )

    def areas(self) -> Array:
        """Return the area of each cell, (n,) [m²]."""
        points, w = flat_quadrature(self.kind, STRAIN_DEGREE[self.kind])
        return np.asarray(jacobians(flat_shape(self.kind, points).gradients, self.planes.xy)[1] @ w)

    def mass_matrices(self) -> Array:
        """Return consistent mass matrices with rotary inertia, (n, 6 c, 6 c)."""
        return np.concatenate([self.slices(rows).mass_matrices() for rows in self.chunks()])

    def resultants(self, u: Array, rows: slice) -> Array:
        """Return N_x N_y N_xy, M_x M_y M_xy, Q_x Q_y in local axes at the strain points, (n, p, 8, k) [N/m, N].

        Parameters
        ----------
        u
            Columns over the dofs of the nodes, (6 n_nodes, k).
        rows
            Of the cells.
        """
        strains = self.strains(rows)
        n, p, _, d = strains.B.shape
        values = (strains.B.reshape(n, p * N_STRAINS, d) @ u[self.dofs[rows]]).reshape(n, p, N_STRAINS, -1)
        return np.asarray((self.elasticity(rows)[:, None] @ values)[:, :, :8])

    def internal_forces(self, u: Array, rows: slice) -> Array:
        """Return K u of cells by the dofs of their nodes, (n, 6 c, k) [N, N m]."""
        strains = self.strains(rows)
        n, p, _, d = strains.B.shape
        flat = strains.B.reshape(n, p * N_STRAINS, d)
        values = (flat @ u[self.dofs[rows]]).reshape(n, p, N_STRAINS, -1)
        resultants = (self.elasticity(rows)[:, None] @ values) * strains.weights[..., None, None]
        return np.asarray(flat.transpose(0, 2, 1) @ resultants.reshape(n, p * N_STRAINS, -1))

    def corner_resultants(self, u: Array, rows: slice) -> Array:
        """Return the resultants carried linearly to the corners, (n, c, 8, k)."""
        return np.einsum("cp,npsk->ncsk", corner_extrapolation(self.kind), self.resultants(u, rows))

    def stress(self, resultants: Array, rows: slice, height: float) -> Array:
        """Return the stress at a height of the thickness, (n, ..., 6, k) [Pa], xx yy zz yz xz xy in mesh axes.

        sigma = N/t + 12 z M/t³; transverse shear 3 Q/(2 t) (1 - 4 z²/t²).

        Parameters
        ----------
        resultants
            In local axes, (n, p, 8, k).
        rows
            Of the cells.
        height
            z/t, -1/2 bottom, 0 middle, 1/2 top.
        """
        t = self.t[rows][:, None, None, None]
        plane = resultants[:, :, :3] / t + 12 * height / t**2 * resultants[:, :, 3:6]
        across = 1.5 * (1 - 4 * height**2) / t * resultants[:, :, 6:8]
        return np.einsum(
            "nas,npsk->npak", stress_directions(self.planes.R[rows]), np.concatenate([plane, across], axis=2)
        )


def shell_cells(
    nodes: Array, kind: str, cells: IntArray, used: tuple[ShellProperty, ...], of_cell: IntArray
) -> ShellCells:
    """Return the elements of one cell type.

    Parameters
    ----------
    nodes
        (n_nodes, 3) [m].
    kind, cells
        Type and nodes of the cells.
    used, of_cell
        Properties and the number of that of each cell, (n,).
    """

    def per_cell(values: list[float]) -> Array:
        return np.array(values, dtype=float)[of_cell]

    return ShellCells(
        kind,
        cells,
        cell_planes(nodes, cells, per_cell([item.offset for item in used])),
        t=per_cell([item.thickness for item in used]),
        E=per_cell([item.material.E for item in used]),
        nu=per_cell([item.material.nu for item in used]),
        mass=per_cell([item.material.rho * item.thickness + item.added_mass for item in used]),
    )


def translations(planes: CellPlanes, N: Array, E: Array, shape: FlatShape, share: float) -> Array:
    """Translation of the middle surface for unit dofs of the nodes, mesh axes, (n, p, 3, c, 6).

    u = Σ N_i (u_i + theta_i × lever_i) - 1/8 Σ_sides E_k (theta_j - theta_i) × (x_j - x_i): each side is the cubic's
    parabola through its ends with the rotations there, across the plane (bending) and in it (drilling). So u is
    quadratic along sides, and a rigid rotation is exact.

    Parameters
    ----------
    planes
        Of the cells.
    N, E
        Values, or derivatives by one coordinate, of the functions of corners and sides: (p, c) or (n, p, c).
    shape
        For the ends of the sides.
    share
        Of the drilling part.
    """
    n, c = planes.levers.shape[:2]
    N, E = (np.broadcast_to(table, (n, *table.shape[-2:])) for table in (N, E))
    u = np.zeros((n, N.shape[1], 3, c, 6))
    for a in range(3):
        u[:, :, a, :, a] = N
    normal = planes.R[:, :, 2]
    kept = np.eye(3) - (1 - share) * normal[:, :, None] * normal[:, None, :]
    for corner in range(c):
        u[:, :, :, corner, 3:] -= N[:, :, corner, None, None] * skew(planes.levers[:, corner])[:, None]
    for side, (i, j) in enumerate(shape.sides):
        arm = skew(planes.corners[:, j] - planes.corners[:, i]) @ kept / 8
        bulge = E[:, :, side, None, None] * arm[:, None]
        u[:, :, :, j, 3:] += bulge
        u[:, :, :, i, 3:] -= bulge
    return u


def corner_extrapolation(kind: str) -> Array:
    """Return values at the corners from those at the strain points, linear or bilinear, (c, p)."""
    points, _ = flat_quadrature(kind, STRAIN_DEGREE[kind])
    if kind == "triangle":
        corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
        at_points, at_corners = (np.column_stack([np.ones(len(x)), x]) for x in (points, corners))
    else:
        corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        at_points, at_corners = (np.column_stack([np.ones(len(x)), x, x[:, 0] * x[:, 1]]) for x in (points, corners))
    return np.asarray(at_corners @ np.linalg.inv(at_points))


def stress_directions(R: Array) -> Array:
    """Components xx yy zz yz xz xy in mesh axes of sigma_x sigma_y tau_xy tau_xz tau_yz in local ones, (n, 6, 5)."""
    columns = []
    for i, j in ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2)):
        tensor = np.einsum("na,nb->nab", R[:, :, i], R[:, :, j])
        if i != j:
            tensor = tensor + tensor.transpose(0, 2, 1)
        columns.append(np.stack([tensor[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1))
    return np.stack(columns, axis=2)


def _times_blocks(B: Array, planes: CellPlanes) -> Array:
    """B over local dofs of the corners as one over the dofs of the nodes: B T, block by block."""
    n, p, s, d = B.shape
    c = d // 6
    blocks = B.reshape(n, p * s, c, 6)
    Rt = planes.R.transpose(0, 2, 1)
    out = np.empty((n, c, p * s, 6))
    for k in range(c):
        force = np.ascontiguousarray(blocks[:, :, k, :3]) @ Rt
        out[:, k, :, :3] = force
        out[:, k, :, 3:] = np.ascontiguousarray(blocks[:, :, k, 3:]) @ Rt - force @ skew(planes.levers[:, k])
    return out.transpose(0, 2, 1, 3).reshape(n, p, s, d)
