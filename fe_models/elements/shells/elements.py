"""All shell elements of one cell type: stiffness, mass, stress resultants, stress."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.elements.beams.axes import stress_directions
from fe_models.elements.beams.slices import Slices
from fe_models.elements.shells.laminate import ShellLaw, shell_law
from fe_models.elements.shells.plates import quad_strains, triangle_strains
from fe_models.elements.shells.shapes import FlatShape, flat_quadrature, flat_shape
from fe_models.elements.shells.shell_property import AnyShellProperty, ShellProperty
from fe_models.elements.shells.strains import N_STRAINS, FlatLaw, FlatStrains, jacobians
from fe_models.errors import ShellError
from fe_models.foundation.arrays import Array, IntArray, frozen, tilde

__all__ = ["CellPlanes", "ShellCells", "cell_planes", "shell_cells"]


# the plane of every cell: local axes, corners in the plane, and the map from nodal dofs to corner dofs ----------------


@dataclass(frozen=True, eq=False)
class CellPlanes:
    """Planes of n cells of one type with c corners.

    Rigid arms connect the corners of the plane to the nodes: normal to the plane if four nodes are warped, and along
    the offset of the middle surface. u_corner = u_node + theta_node × lever, so rigid motion is always exact.
    """

    R: Array  #: local axes x, y, z (normal) as columns, mesh axes, (n, 3, 3)
    corners: Array  #: corners of the middle surface, mesh axes, (n, c, 3) [m]
    levers: Array  #: vectors from node to corner, mesh axes, (n, c, 3) [m]
    xy: Array  #: corners in local axes relative to their mean, (n, c, 2) [m]
    warp: Array  #: distance of the corner nodes of a quad from its plane, (n,) [m]

    @property
    def T(self) -> Array:
        """Map from nodal dofs to local corner dofs, (n, 6c, 6c): u_x u_y u_z theta_x theta_y theta_z at each corner."""
        n, c = self.levers.shape[:2]
        T = np.zeros((n, 6 * c, 6 * c))
        Rt = self.R.transpose(0, 2, 1)
        for k in range(c):
            at = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
            T[:, at[0], at[0]] = T[:, at[1], at[1]] = Rt
            T[:, at[0], at[1]] = -Rt @ tilde(self.levers[:, k])
        return T

    def __getitem__(self, rows: slice | IntArray) -> "CellPlanes":
        return CellPlanes(self.R[rows], self.corners[rows], self.levers[rows], self.xy[rows], self.warp[rows])


def cell_planes(nodes: Array, cells: IntArray, offset: Array, direction: Array) -> CellPlanes:
    """Return the planes of cells with three or four nodes.

    (1) z is normal to both diagonals of a quad, or to the sides of a triangle, right-handed in the order of the nodes
    (2) x is the direction projected onto the plane; without a direction it is the first side of a triangle, or for a
        quad d_13 - d_24, which lies between the diagonals
    (3) the plane passes through the mean of the nodes, moved by the offset along z

    Parameters
    ----------
    nodes
        Positions, (n_nodes, 3) [m].
    cells
        Nodes of the cells, (n, 3) or (n, 4).
    offset
        Distance of the middle surface from the nodes along z, (n,) [m].
    direction
        Direction in mesh axes, (n, 3); zero: none.
    """
    X = nodes[cells]
    if cells.shape[1] == 3:
        x, other = X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
        normal = np.cross(x, other)
    else:
        d_13, d_24 = X[:, 2] - X[:, 0], X[:, 3] - X[:, 1]
        normal = np.cross(d_13, d_24)  # (1)
        x = _unit(d_13) - _unit(d_24)  # (2)
    z = _unit(normal)
    along = direction - z * np.einsum("na,na->n", direction, z)[:, None]
    x = _unit(np.where((direction != 0).any(axis=1)[:, None], along, x))
    R = np.stack([x, np.cross(z, x), z], axis=2)
    middle = X.mean(axis=1, keepdims=True)
    local = (X - middle) @ R
    plane = local * np.array([1.0, 1.0, 0.0]) + offset[:, None, None] * np.array([0.0, 0.0, 1.0])  # (3)
    levers = (plane - local) @ R.transpose(0, 2, 1)
    warp = np.abs(local[:, :, 2]).max(axis=1)
    return CellPlanes(frozen(R), frozen(X + levers), frozen(levers), frozen(local[:, :, :2]), frozen(warp))


def _unit(v: Array) -> Array:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(length > 0, length, 1.0)


# elements -------------------------------------------------------------------------------------------------------------


CHUNK = 500  #: number of cells whose operators are in memory at a time
LEAST_ANGLE = 5.0  #: smallest angle between the reference direction of a layup and the normal of a cell [degree]
#: gamma of quads, relative to the shear modulus; docs/measured.md has the error of larger and smaller values
DRILLING = 0.1
#: contribution of the drilling rotations to the displacement of the sides
DRILLING_SHARE = {"triangle": 1.0, "quad": 0.3}
STRAIN_DEGREE = {"triangle": 2, "quad": 3}
#: quadrature degree for the mass: squares of quadratic fields times the area element
MASS_DEGREE = {"triangle": 4, "quad": 5}


@dataclass(frozen=True, eq=False)
class ShellCells:
    """Shell cells of one type, with their planes, thicknesses and laws."""

    kind: str
    cells: IntArray  #: corner nodes of each cell, (n, c)
    planes: CellPlanes
    laws: tuple[ShellLaw, ...]
    law: IntArray  #: index of the law of each cell, (n,)

    @property
    def t(self) -> Array:
        """Thickness, (n,) [m]."""
        return self.by_law(lambda law: law.thickness, slice(None))

    def by_law(self, value: Callable[[ShellLaw], Any], rows: slice | IntArray) -> Array:
        """Evaluate a function of the law for each of the given cells, (n, ...)."""
        return np.array([value(law) for law in self.laws], dtype=float)[self.law[rows]]

    @property
    def dofs(self) -> IntArray:
        """Dofs of the nodes of each cell, (n, 6 c)."""
        return (6 * self.cells[:, :, None] + np.arange(6)).reshape(len(self.cells), -1)

    def chunks(self) -> Iterator[slice]:
        """Yield slices of cells whose operators fit in memory."""
        for begin in range(0, len(self.cells), CHUNK):
            yield slice(begin, min(begin + CHUNK, len(self.cells)))

    def strains(self, rows: slice) -> FlatStrains:
        """Return strain operators in local axes over nodal dofs, at the points of the rule `STRAIN_DEGREE`."""
        planes = self.planes[rows]
        law = FlatLaw(
            A=self.by_law(lambda law: law.A, rows),
            B=self.by_law(lambda law: law.B, rows),
            bending=self.by_law(lambda law: law.bending, rows),
            shear_flexibility=self.by_law(lambda law: np.linalg.inv(law.H), rows),
            drilling=DRILLING * self.by_law(lambda law: law.shear_modulus, rows),
            nu=self.by_law(lambda law: law.nu, rows),
        )
        local = quad_strains(planes.xy, law) if self.kind == "quad" else triangle_strains(planes.xy, law)
        return FlatStrains(_times_blocks(local.B, planes), local.weights)

    def elasticity(self, rows: slice) -> Array:
        """Return the matrix from strains to resultants N, M, Q and drilling moment, (n, 9, 9) [N/m, N m]."""
        stiffness = self.by_law(lambda law: law.stiffness, rows)
        D = np.zeros((len(stiffness), N_STRAINS, N_STRAINS))
        D[:, :8, :8] = stiffness
        D[:, 8, 8] = DRILLING * self.by_law(lambda law: law.shear_modulus, rows)
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
        """Return segments of the normal as rigid slices, with mass per area and its second moment along the normal.

        A point moves by u + theta × z n, z in -t/2..t/2, so the drilling rotation does not move it. The second moment
        is t²/12 for one material. Layers may have their centre of mass away from the middle surface.
        """
        planes = self.planes[rows]
        points, w = flat_quadrature(self.kind, MASS_DEGREE[self.kind])
        shape = flat_shape(self.kind, points)
        n, p, c = len(planes.R), len(points), self.cells.shape[1]
        _, det = jacobians(shape.gradients, planes.xy)
        mass = self.by_law(lambda law: law.mass, rows)[:, None] * w * det
        arm = self.mass_arms(rows)
        motion = np.zeros((n, p, 6, c, 6))
        motion[:, :, :3] = translations(planes, shape.values, shape.side_values, shape, DRILLING_SHARE[self.kind])
        for a in range(3, 6):
            motion[:, :, a, :, a] = shape.values
        motion[:, :, :3] -= np.einsum("nab,npbcd->npacd", tilde(arm), motion[:, :, 3:])
        moments = np.zeros((n, p, 3))
        moments[:, :, 2] = mass * self.by_law(lambda law: law.spread, rows)[:, None]
        return Slices(
            position=shape.values @ planes.corners + arm[:, None],
            mass=mass,
            axes=np.broadcast_to(planes.R[:, None], (n, p, 3, 3)),
            moments=moments,
            motion=motion.reshape(n, p, 6, 6 * c),
            dofs=self.dofs[rows],
        )

    def mass_arms(self, rows: slice) -> Array:
        """Return the vector from the middle surface to the centre of mass, mesh axes, (n, 3) [m]."""
        return self.by_law(lambda law: law.centre, rows)[:, None] * self.planes.R[rows][:, :, 2]

    def areas(self) -> Array:
        """Return the area of each cell, (n,) [m²]."""
        points, w = flat_quadrature(self.kind, STRAIN_DEGREE[self.kind])
        return np.asarray(jacobians(flat_shape(self.kind, points).gradients, self.planes.xy)[1] @ w)

    def corner_masses(self) -> Array:
        """Return ∫ N_i rho t dA at each corner, (n, c) [kg], with bilinear or linear shape functions N_i."""
        points, w = flat_quadrature(self.kind, MASS_DEGREE[self.kind])
        shape = flat_shape(self.kind, points)
        _, det = jacobians(shape.gradients, self.planes.xy)
        return np.asarray(self.by_law(lambda law: law.mass, slice(None))[:, None] * ((w * det) @ shape.values))

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
            Rows of the cells.
        """
        strains = self.strains(rows)
        n, p, _, d = strains.B.shape
        values = (strains.B.reshape(n, p * N_STRAINS, d) @ u[self.dofs[rows]]).reshape(n, p, N_STRAINS, -1)
        return np.asarray((self.elasticity(rows)[:, None] @ values)[:, :, :8])

    def internal_forces(self, u: Array, rows: slice) -> Array:
        """Return K u of some cells over their nodal dofs, (n, 6 c, k) [N, N m]."""
        strains = self.strains(rows)
        n, p, _, d = strains.B.shape
        flat = strains.B.reshape(n, p * N_STRAINS, d)
        values = (flat @ u[self.dofs[rows]]).reshape(n, p, N_STRAINS, -1)
        resultants = (self.elasticity(rows)[:, None] @ values) * strains.weights[..., None, None]
        return np.asarray(flat.transpose(0, 2, 1) @ resultants.reshape(n, p * N_STRAINS, -1))

    def corner_resultants(self, u: Array, rows: slice) -> Array:
        """Return the resultants, extrapolated linearly to the corners, (n, c, 8, k)."""
        return np.einsum("cp,npsk->ncsk", corner_extrapolation(self.kind), self.resultants(u, rows))

    def stress(self, resultants: Array, rows: slice, height: float) -> Array:
        """Return the stress at a height in the thickness, (n, ..., 6, k) [Pa], xx yy zz yz xz xy in mesh axes.

        sigma = Q (eps + z kappa) of the layer at this height (of the lower layer where two meet). Transverse shear
        follows from equilibrium (`fe_models.elements.shells.laminate`). One material gives N/t + 12 z M/t³ and 3 Q/(2
        t) (1 - 4 z²/t²).

        Parameters
        ----------
        resultants
            Stress resultants in local axes, (n, p, 8, k).
        rows
            Rows of the cells.
        height
            z/t: -1/2 bottom, 0 middle, 1/2 top.
        """

        def at_height(law: ShellLaw) -> Array:
            z = height * law.thickness
            return law.stress(z, law.layer_at(z))

        local = self.by_law(at_height, rows)[:, None] @ resultants
        directions = stress_directions(self.planes.R[rows], ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2)))
        return np.einsum("nas,npsk->npak", directions, local)


def shell_cells(
    nodes: Array, kind: str, cells: IntArray, used: tuple[AnyShellProperty, ...], of_cell: IntArray
) -> ShellCells:
    """Return the elements of one cell type.

    Parameters
    ----------
    nodes
        Positions, (n_nodes, 3) [m].
    kind, cells
        Type and nodes of the cells.
    used, of_cell
        Properties, and the index of the property of each cell, (n,).
    """
    none = (0.0, 0.0, 0.0)
    directions = np.array([none if isinstance(item, ShellProperty) else item.direction for item in used])
    offsets = np.array([item.offset for item in used], dtype=float)
    planes = cell_planes(nodes, cells, offsets[of_cell], directions[of_cell])
    along = directions[of_cell]
    lengths = np.linalg.norm(along, axis=1)
    across = np.linalg.norm(np.cross(along, planes.R[:, :, 2]), axis=1)
    lost = np.flatnonzero((lengths > 0) & (across < np.sin(np.deg2rad(LEAST_ANGLE)) * lengths))
    if lost.size:
        raise ShellError(
            f"laminate: {lost.size} {kind} cells are normal to direction {tuple(along[lost[0]].tolist())}, first cell "
            f"{lost[0]}: within {LEAST_ANGLE:g} degrees of their normal it gives no axis on them; give these cells a "
            "laminate with another direction"
        )
    return ShellCells(kind, cells, planes, tuple(shell_law(item) for item in used), of_cell)


def translations(planes: CellPlanes, N: Array, E: Array, shape: FlatShape, share: float) -> Array:
    """Return translations of the middle surface per unit nodal dof, mesh axes, (n, p, 3, c, 6).

    u = Σ N_i (u_i + theta_i × lever_i) - 1/8 Σ_sides E_k (theta_j - theta_i) × (x_j - x_i). On each side this is the
    quadratic part of the cubic through the ends with their rotations, normal to the plane (bending) and in the plane
    (drilling). So u is quadratic along sides, and a rigid rotation is exact.

    Parameters
    ----------
    planes
        Planes of the cells.
    N, E
        Functions of corners (N) and sides (E), or their derivatives by one coordinate, (p, c) or (n, p, c).
    shape
        Shape functions, which name the ends of the sides.
    share
        Share of the drilling part.
    """
    n, c = planes.levers.shape[:2]
    N, E = (np.broadcast_to(table, (n, *table.shape[-2:])) for table in (N, E))
    u = np.zeros((n, N.shape[1], 3, c, 6))
    for a in range(3):
        u[:, :, a, :, a] = N
    normal = planes.R[:, :, 2]
    kept = np.eye(3) - (1 - share) * normal[:, :, None] * normal[:, None, :]
    for corner in range(c):
        u[:, :, :, corner, 3:] -= N[:, :, corner, None, None] * tilde(planes.levers[:, corner])[:, None]
    for side, (i, j) in enumerate(shape.sides):
        arm = tilde(planes.corners[:, j] - planes.corners[:, i]) @ kept / 8
        bulge = E[:, :, side, None, None] * arm[:, None]
        u[:, :, :, j, 3:] += bulge
        u[:, :, :, i, 3:] -= bulge
    return u


def corner_extrapolation(kind: str) -> Array:
    """Return the matrix from values at the strain points to values at the corners, (c, p), linear or bilinear."""
    points, _ = flat_quadrature(kind, STRAIN_DEGREE[kind])
    if kind == "triangle":
        corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
        at_points, at_corners = (np.column_stack([np.ones(len(x)), x]) for x in (points, corners))
    else:
        corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        at_points, at_corners = (np.column_stack([np.ones(len(x)), x, x[:, 0] * x[:, 1]]) for x in (points, corners))
    return np.asarray(at_corners @ np.linalg.inv(at_points))


def _times_blocks(B: Array, planes: CellPlanes) -> Array:
    """Return B T block by block: B is over local corner dofs, B T over nodal dofs."""
    n, p, s, d = B.shape
    c = d // 6
    blocks = B.reshape(n, p * s, c, 6)
    Rt = planes.R.transpose(0, 2, 1)
    out = np.empty((n, c, p * s, 6))
    for k in range(c):
        force = np.ascontiguousarray(blocks[:, :, k, :3]) @ Rt
        out[:, k, :, :3] = force
        out[:, k, :, 3:] = np.ascontiguousarray(blocks[:, :, k, 3:]) @ Rt - force @ tilde(planes.levers[:, k])
    return out.transpose(0, 2, 1, 3).reshape(n, p, s, d)
