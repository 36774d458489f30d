r"""Signed error of eigenvalues of shells: what the elements make of a smooth field that is fitted to the mode.

Shell elements with assumed strains are not conforming, so that the energy of the recovered stress is not their error.
For any smooth field u with the nodal values I u, mode u_h and e = u_h - I u, the eigenvalue is exactly

    lambda_h |u_h|²_Mh - |u_h|²_Kh = 0 = lambda_h |I u|²_Mh - |I u|²_Kh - |e|²_Kh + lambda_h |e|²_Mh,

and lambda = R(u) is the stationary value of the Rayleigh quotient of the continuous shell. With |u_h|_Mh = 1, so

    lambda_h - lambda = [|I u|²_Kh - a(u, u)] - lambda [|I u|²_Mh - m(u, u)] - |e|²_Kh + lambda |e|²_Mh,

with an error of second order in the error of u. All terms are sums over the cells, and each cell may have its own u.

(1) patches of a cell and its neighbours cover each smooth wall. Each cell belongs to the patch of a cell near it
(2) on each patch the surface and u are polynomials of the coordinates in the plane of the middle cell. Rotations follow
    from the slopes and the shear of equilibrium, gamma = H⁻¹ div(D kappa), so that thin shells have no false shear
(3) u has the least |u_h - I u|²_Kh + lambda_1 |u_h - I u|²_Mh. The cells do not see membrane strain of u that varies
    between their nodes, so its part that is not linear over the patch is added with a small weight
(4) a(u, u) and m(u, u) have the strains of the curved surface. The membrane energy of flat cells misses a mean strain d
    of the curved surface. N of equilibrium is that of the cells, so 2 ∫ N·d is the difference, and d is not squared
(5) at a free edge Kirchhoff's twisting moment T falls to zero within the length 1/k = sqrt(g / H), g = D_66. This
    lowers lambda by ∮ T² / (g k) ds. A mesh that resolves the layer has it in e

The layer is that of torsion in Reissner-Mindlin theory: the strip of width b has the factor 1 - 2 tanh(k b / 2) / (k b)
of G t³ b / 3. Rayleigh quotients of recovered fields are due to Naga, Zhang & Zhou [1]_.

References
----------
.. [1] Naga, Zhang & Zhou (2006), SIAM J. Sci. Comput. 28, 1289-1300.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import perm

import numpy as np
import scipy.sparse as sp

from fe_models.elements.shells.elements import STRAIN_DEGREE, ShellCells
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.shapes import flat_quadrature, flat_shape
from fe_models.elements.shells.skin import cell_edges
from fe_models.elements.shells.strains import jacobians
from fe_models.foundation.arrays import Array, IntArray, tilde

__all__ = ["signed_errors"]

DEGREE, SURFACE_DEGREE = 5, 4  #: degrees of displacements and of the surface
N_TERMS = (DEGREE + 1) * (DEGREE + 2) // 2
RIDGE = 1e-10 * np.array([0.0, 0.0, 1.0, 10.0, 100.0, 1000.0])  #: ridge of terms of each degree, relative
SMOOTH = 1e-2  #: weight of the membrane strain that is not linear over a patch
MANY = 0.8  #: share of the neighbours of the best cell nearby, from which a cell may be the middle of a patch
CHUNK = 64  #: number of patches or cells whose operators are in memory at a time
ENERGY_DEGREE = {"triangle": 4, "quad": 5}  #: quadrature of the energy of u


def exponents(degree: int) -> list[tuple[int, int]]:
    """Return the powers of x and y of the terms of a complete polynomial."""
    return [(total - j, j) for total in range(degree + 1) for j in range(total + 1)]


def terms(x: Array, y: Array, degree: int, n_x: int = 0, n_y: int = 0) -> Array:
    """Return derivatives of the terms of a complete polynomial, n_x times by x and n_y times by y, (..., n_terms)."""
    x_i, y_j = powers(x, degree), powers(y, degree)
    return derivatives(x_i, y_j, degree, n_x, n_y)


def powers(x: Array, degree: int) -> list[Array]:
    """Return 1, x, x², ..."""
    found = [np.ones_like(x)]
    for _ in range(degree):
        found.append(found[-1] * x)
    return found


def derivatives(x: list[Array], y: list[Array], degree: int, n_x: int, n_y: int) -> Array:
    """Return derivatives of the terms from the powers of x and y, (..., n_terms)."""
    found = np.zeros((*x[0].shape, (degree + 1) * (degree + 2) // 2))
    for column, (i, j) in enumerate(exponents(degree)):
        if i >= n_x and j >= n_y:
            np.multiply(x[i - n_x], perm(i, n_x) * perm(j, n_y) * y[j - n_y], out=found[..., column])
    return found


@dataclass(frozen=True, eq=False)
class Patches:
    """Planes of n patches, polynomials of their surfaces, and laws of their shear."""

    R: Array  #: axes of the middle cell as columns, mesh axes, (n, 3, 3)
    origin: Array  #: mean of its nodes, (n, 3) [m]
    size: Array  #: length that scales the coordinates, (n,) [m]
    surface: Array  #: coefficients of the height, (n, n_terms) [m]
    A: Array  #: membrane stiffness of the middle cell, (n, 3, 3) [N/m]
    D: Array  #: bending stiffness without membrane forces, (n, 3, 3) [N m]
    flexibility: Array  #: inverse of the shear stiffness, (n, 2, 2) [m/N]

    def __getitem__(self, rows: slice | IntArray) -> "Patches":
        return Patches(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def local(self, points: Array) -> Array:
        """Return scaled local coordinates of points in mesh axes, (n, p, 3)."""
        return ((points - self.origin[:, None]) @ self.R) / self.size[:, None, None]


@dataclass(frozen=True, eq=False)
class SurfaceFields:
    """Operators on the coefficients of u at p points of each patch, in the axes of the patch."""

    normal: Array  #: unit normal of the surface, (n, p, 3)
    area: Array  #: area of the surface over that of the plane, (n, p)
    motion: Array  #: translation, (n, p, 3, n_c) [m]
    director: Array  #: change of the unit normal to the section, (n, p, 3, n_c)
    rotation: Array  #: rotation, that about the normal being the mean one of the surface, (n, p, 3, n_c)
    strain: Array  #: eps_x eps_y gamma_xy, kappa_x kappa_y kappa_xy, gamma_x gamma_y, (n, p, 8, n_c)

    def motions(self, R: Array) -> Array:
        """Return translation and rotation in mesh axes, (n, p, 6, n_c)."""
        return np.concatenate([R[:, None] @ self.motion, R[:, None] @ self.rotation], axis=2)


def surface_fields(at: Patches, x: Array, y: Array, along: Array | None = None) -> SurfaceFields:
    """Return the operators at points x, y in scaled coordinates, (n, p).

    Parameters
    ----------
    along
        Direction in the axes of the patch that gives the x axis of the strains, (n, 3); None: the x axis of the patch.
    """
    shape = (*x.shape, 3 * N_TERMS)
    x_i, y_j = powers(x, DEGREE), powers(y, DEGREE)

    def u(n_x: int, n_y: int) -> Array:
        return derivatives(x_i, y_j, DEGREE, n_x, n_y) / at.size[:, None, None] ** (n_x + n_y)

    def z(n_x: int, n_y: int) -> Array:
        found = derivatives(x_i, y_j, SURFACE_DEGREE, n_x, n_y) @ at.surface[:, :, None]
        return np.asarray(found[..., 0] / at.size[:, None] ** (n_x + n_y))

    def dot(a: Array, own: Array) -> Array:
        return np.asarray((a[..., None] * own[:, :, None]).reshape(shape))

    z_x, z_y = z(1, 0), z(0, 1)
    zero, one = np.zeros_like(x), np.ones_like(x)
    a_1, a_2, n = (np.stack(each, axis=2) for each in ((one, zero, z_x), (zero, one, z_y), (-z_x, -z_y, one)))
    area = np.linalg.norm(n, axis=2)
    n = n / area[..., None]
    metric = np.stack([np.stack([1 + z_x**2, z_x * z_y], 2), np.stack([z_x * z_y, 1 + z_y**2], 2)], axis=2)
    dual = np.linalg.inv(metric) @ np.stack([a_1, a_2], axis=2)  # a^1, a^2
    u_1, u_2 = u(1, 0), u(0, 1)
    # gamma = H⁻¹ div(D kappa) with kappa = -(w_xx, w_yy, 2 w_xy), and its derivatives
    w = {(i, j): u(i, j) for total in (3, 4) for i, j in ((total - j, j) for j in range(total + 1))}
    D = -at.D * np.array([1.0, 1.0, 2.0])
    first = (at.flexibility @ D[:, [0, 2]])[:, None], (at.flexibility @ D[:, [2, 1]])[:, None]

    def shear(n_x: int, n_y: int) -> Array:
        found = np.zeros((*x.shape, 2, 3 * N_TERMS))
        for by, i, j in zip(first, (n_x + 1, n_x), (n_y, n_y + 1), strict=True):
            found[..., 2 * N_TERMS :] += by @ np.stack([w[2 + i, j], w[i, 2 + j], w[1 + i, 1 + j]], axis=2)
        return found

    gamma, gamma_1, gamma_2 = shear(0, 0), shear(1, 0), shear(0, 1)
    d = gamma - np.stack([dot(n, u_1), dot(n, u_2)], axis=2)  # covariant components of the director
    director = np.swapaxes(dual, 2, 3) @ d
    raised = (dual[..., None, :, 2] @ d)[:, :, 0]  # its component along z
    spin = (dot(a_2, u_1) - dot(a_1, u_2)) / (2 * area[..., None])
    rotation = tilde(n) @ director + n[..., None] * spin[:, :, None]
    curvature = [
        bend - dot(n, u(i, j)) - z(i, j)[..., None] * raised
        for i, j, bend in (
            (2, 0, gamma_1[:, :, 0]), (0, 2, gamma_2[:, :, 1]), (1, 1, (gamma_1[:, :, 1] + gamma_2[:, :, 0]) / 2)
        )
    ]  # fmt: skip
    membrane = [dot(a_1, u_1), dot(a_2, u_2), (dot(a_1, u_2) + dot(a_2, u_1)) / 2]
    e_x = a_1 if along is None else along[:, None] - n * (n @ along[..., None])
    e_x = e_x / np.linalg.norm(e_x, axis=2, keepdims=True)
    axes = np.stack([e_x, np.cross(n, e_x)], axis=2)
    F = axes @ np.swapaxes(dual, 2, 3)  # from covariant components to the axes
    f, g = F[..., 0], F[..., 1]
    rows = [
        np.stack([f[..., a] * f[..., b], g[..., a] * g[..., b], f[..., a] * g[..., b] + f[..., b] * g[..., a]], axis=2)
        for a, b in ((0, 0), (1, 1), (0, 1))
    ]
    tensor = np.stack(rows, axis=2) * np.array([1.0, 1.0, 2.0])[:, None]  # eps_x, eps_y, gamma_xy of eps_11, _22, _12
    motion = np.zeros((*x.shape, 3, 3 * N_TERMS))
    for a, own in enumerate(np.split(motion, 3, axis=3)):
        own[:, :, a] = u(0, 0)
    parts = [tensor @ np.stack(membrane, axis=2), tensor @ np.stack(curvature, axis=2), F @ gamma]
    return SurfaceFields(n, area, motion, director, rotation, np.concatenate(parts, axis=2))


# patches --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Patches of cells of all types, numbered successively."""

    middle: IntArray  #: cell in the middle of each patch, (n_patches,)
    of_cell: IntArray  #: patch of each cell, (n_cells,)
    cells: sp.csr_array  #: cells of each patch, (n_patches, n_cells)
    around: sp.csr_array  #: cells around each cell, (n_cells, n_cells)


def neighbours(model: ShellModel, centers: Array) -> Neighbours:
    """Return patches of cells that share a smooth corner with their middle, by step (1)."""
    sizes = [patch.shape for patch in model.skin.patch]
    rows = np.repeat(np.arange(len(centers)), np.concatenate([np.full(n, c) for n, c in sizes]))
    corners = np.concatenate([patch.ravel() for patch in model.skin.patch])
    inside = sp.csr_array((np.ones(len(rows)), (rows, corners)), (len(centers), model.skin.n_patches))
    near = sp.csr_array(inside @ inside.T)
    near.sort_indices()
    count = np.diff(near.indptr)
    is_full = count >= MANY * np.maximum.reduceat(count[near.indices], near.indptr[:-1])
    around = np.split(near.indices, near.indptr[1:-1])
    middle = np.full(len(centers), -1)
    for cell in np.flatnonzero(is_full):
        if (middle[around[cell]] < 0).all():
            middle[around[cell]] = cell
    is_middle = np.zeros(len(centers), bool)
    is_middle[middle[middle >= 0]] = True
    for cell in np.flatnonzero(middle < 0):
        found = around[cell]
        best = count[found] + 1e3 * is_full[found] + 1e6 * (is_middle & is_full)[found]
        found = found[best >= (1e6 if best.max() >= 1e6 else best.max())]
        middle[cell] = found[np.linalg.norm(centers[found] - centers[cell], axis=1).argmin()]
    used, of_cell = np.unique(middle, return_inverse=True)
    return Neighbours(used, of_cell, near[used], near)


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of one type, with what all steps use."""

    group: ShellCells
    first: int  #: number of the first cell
    X: Array  #: nodes of the cells, (n, c, 3) [m]
    K: Array  #: stiffness, (n, 6 c, 6 c)
    M: Array  #: mass, (n, 6 c, 6 c)
    areas: Array  #: areas of the cells, (n,) [m²]
    dofs: IntArray  #: dofs of the nodes, (n, 6 c)
    u: Array  #: columns over the dofs of the nodes, (n_dof, k)

    def columns(self, rows: slice | IntArray) -> Array:
        """Return the columns over the dofs of some cells, (..., 6 c, k)."""
        return np.asarray(self.u[self.dofs[rows]])


@dataclass(frozen=True, eq=False)
class FittedFields:
    """The field u of each patch."""

    patches: Patches
    u: Array  #: coefficients of u, (n, n_c, k)
    membrane: Array  #: membrane strain that is linear over the patch, coefficients of 1, x, y, (n, 3, 3, k)


def patch_planes(groups: list[Cells], near: Neighbours) -> Patches:
    """Return the planes and surfaces of the patches, by step (2)."""
    n = len(near.middle)
    R, origin, A, D, flexibility = (np.zeros((n, *s)) for s in ((3, 3), (3,), (3, 3), (3, 3), (2, 2)))
    for part in groups:
        own = np.flatnonzero((near.middle >= part.first) & (near.middle < part.first + len(part.X)))
        middle, group = near.middle[own] - part.first, part.group
        R[own], origin[own] = group.planes.R[middle], part.X[middle].mean(axis=1)
        A[own], D[own] = group.by_law(lambda law: law.A, middle), group.by_law(lambda law: law.bending, middle)
        flexibility[own] = group.by_law(lambda law: np.linalg.inv(law.H), middle)
    whole = Patches(R, origin, np.ones(n), np.zeros((n, 1)), A, D, flexibility)
    size, surface = np.empty(n), np.empty((n, (SURFACE_DEGREE + 1) * (SURFACE_DEGREE + 2) // 2))
    for rows in chunks(n):
        points, weights = [], []
        for part in groups:
            cells, is_cell = cells_of(near, rows, part)
            points.append(part.X[cells].reshape(len(cells), -1, 3))
            weights.append(np.repeat(is_cell, part.X.shape[1], axis=1))
        w = np.concatenate(weights, axis=1).astype(float)
        x, y, z = np.moveaxis(whole[rows].local(np.concatenate(points, axis=1)), 2, 0)
        h = np.sqrt((w * (x**2 + y**2)).sum(axis=1) / w.sum(axis=1))
        B = terms(x / h[:, None], y / h[:, None], SURFACE_DEGREE)
        size[rows] = h
        surface[rows] = ridge_solve(
            np.swapaxes(B, 1, 2) @ (w[..., None] * B), np.swapaxes(B, 1, 2) @ (w * z)[..., None], SURFACE_DEGREE
        )[..., 0]
    return Patches(R, origin, size, surface, A, D, flexibility)


def chunks(n: int) -> Iterator[slice]:
    """Yield slices of n patches or cells."""
    for begin in range(0, n, CHUNK):
        yield slice(begin, min(begin + CHUNK, n))


def cells_of(near: Neighbours, rows: slice, part: Cells) -> tuple[IntArray, Array]:
    """Return the cells of one type in patches, and whether an entry is a cell, (n, m) each."""
    own = near.cells[rows, part.first : part.first + len(part.X)]
    count = np.diff(own.indptr)
    is_cell = np.arange(count.max(initial=1)) < count[:, None]
    cells = np.zeros(is_cell.shape, np.int64)
    cells[is_cell] = own.indices
    return cells, is_cell


def ridge_solve(G: Array, rhs: Array, degree: int, n_fields: int = 1) -> Array:
    """Solve normal equations of polynomials with a small ridge, which grows with the degree of the term."""
    ridge = np.tile(RIDGE[[i + j for i, j in exponents(degree)]], n_fields)
    scale = np.sqrt(np.einsum("naa->na", G))
    scale = 1 / np.where(scale > 0, scale, 1.0)
    S = G * scale[:, :, None] * scale[:, None] + np.diag(ridge)
    return np.asarray(scale[:, :, None] * np.linalg.solve(S, scale[:, :, None] * rhs))


def fitted_fields(groups: list[Cells], near: Neighbours, lowest: float) -> FittedFields:
    """Return u on all patches, by step (3); `lowest` is the lowest eigenvalue."""
    planes, k = patch_planes(groups, near), groups[0].u.shape[1]
    coefficients, membrane = np.empty((len(planes.size), 3 * N_TERMS, k)), np.empty((len(planes.size), 3, 3, k))
    for rows in chunks(len(planes.size)):
        at = planes[rows]
        n = len(at.size)
        G, rhs = np.zeros((n, 3 * N_TERMS, 3 * N_TERMS)), np.zeros((n, 3 * N_TERMS, k))
        x, y, areas = [], [], []
        for part in groups:
            cells, is_cell = cells_of(near, rows, part)
            m, c = cells.shape[1], part.X.shape[1]
            nodes = at.local(part.X[cells].reshape(n, -1, 3))
            P = surface_fields(at, nodes[..., 0], nodes[..., 1]).motions(at.R).reshape(n, m * 6 * c, -1)
            K = (part.K[cells] + lowest * part.M[cells]) * is_cell[..., None, None]
            P_K = np.swapaxes((K @ P.reshape(n, m, 6 * c, -1)).reshape(P.shape), 1, 2)
            G += P_K @ P
            rhs += P_K @ part.columns(cells).reshape(n, m * 6 * c, k)
            values = flat_shape(
                part.group.kind, flat_quadrature(part.group.kind, STRAIN_DEGREE[part.group.kind])[0]
            ).values
            points = np.einsum("pc,nmca->nmpa", values, nodes.reshape(n, m, c, 3)[..., :2])
            x.append(points[..., 0].reshape(n, -1))
            y.append(points[..., 1].reshape(n, -1))
            areas.append(np.repeat(part.areas[cells] * is_cell / len(values), len(values), axis=1))
        place, area = (np.concatenate(x, axis=1), np.concatenate(y, axis=1)), np.concatenate(areas, axis=1)
        strain = surface_fields(at, *place).strain[:, :, :3]
        linear = terms(*place, 1)
        weighted = np.swapaxes(area[..., None] * linear, 1, 2)
        flat = strain.reshape(*area.shape, -1)
        mean = np.linalg.solve(weighted @ linear, weighted @ flat)
        beside = (flat - linear @ mean).reshape(strain.shape)
        stress = (SMOOTH * area[..., None, None]) * (at.A[:, None] @ beside)
        G += np.swapaxes(beside.reshape(n, -1, 3 * N_TERMS), 1, 2) @ stress.reshape(n, -1, 3 * N_TERMS)
        coefficients[rows] = ridge_solve(G, rhs, DEGREE, 3)
        membrane[rows] = mean.reshape(n, 3, 3, -1) @ coefficients[rows][:, None]
    return FittedFields(planes, coefficients, membrane)


# cells ----------------------------------------------------------------------------------------------------------------


def signed_errors(model: ShellModel, u: Array, lam: Array, loaded: IntArray) -> tuple[Array, Array]:
    """Return the share of each cell in lambda_h - lambda, and twice its strain energy, (n_cells, k) each [J].

    Parameters
    ----------
    u
        M-normalised modes over the dofs of the mesh, (n_mesh_dof, k).
    lam
        Their eigenvalues, (k,).
    loaded
        Nodes whose edges may carry moments.
    """
    nodes, first, groups = mesh_nodes(model), 0, []
    for group in model.groups:
        matrices = group.stiffness(), group.mass_matrices()
        groups.append(Cells(group, first, nodes[group.cells], *matrices, group.areas(), group.dofs, u))
        first += len(group.cells)
    near = neighbours(model, np.concatenate([part.X.mean(axis=1) for part in groups]))
    fields = fitted_fields(groups, near, float(lam.min()))
    errors, energies = [], []
    for part in groups:
        for rows in chunks(len(part.X)):
            errors.append(cell_errors(part, rows, fields, near.of_cell[part.first :][rows], lam))
            own = part.columns(rows)
            energies.append((own * (part.K[rows] @ own)).sum(axis=1))
    # errors of both signs alternate between cells; only those of some neighbours together show where the mesh is coarse
    around = sp.csr_array(near.around != 0, dtype=float)
    error = around @ (np.concatenate(errors) / around.sum(axis=0)[:, None])
    for part in groups:
        add_edge_layers(error, model, part, fields, near.of_cell, loaded)
    return error, np.concatenate(energies)


def mesh_nodes(model: ShellModel) -> Array:
    """Return the nodes of a shell, (n_nodes, 3) [m]."""
    nodes = np.zeros((model.n_nodes, 3))
    for group in model.groups:
        nodes[group.cells] = group.planes.corners - group.planes.levers
    return nodes


def cell_errors(part: Cells, rows: slice, fields: FittedFields, patch: IntArray, lam: Array) -> Array:
    """Return the share of cells in lambda_h - lambda without free edges, (n, k)."""
    at, c, group = fields.patches[patch], fields.u[patch], part.group
    n, k = len(patch), c.shape[2]
    nodes = at.local(part.X[rows])[..., :2]
    v = (surface_fields(at, nodes[..., 0], nodes[..., 1]).motions(at.R) @ c[:, None]).reshape(n, -1, k)
    e = part.columns(rows) - v
    found = (v * (part.K[rows] @ v) - e * (part.K[rows] @ e)).sum(axis=1)
    found -= lam * (v * (part.M[rows] @ v) - e * (part.M[rows] @ e)).sum(axis=1)
    points, w = flat_quadrature(group.kind, ENERGY_DEGREE[group.kind])
    shape = flat_shape(group.kind, points)
    place = shape.values @ nodes
    planes = group.planes[rows]
    along = np.einsum("nab,na->nb", at.R, planes.R[:, :, 0])
    own = surface_fields(at, place[..., 0], place[..., 1], along)
    dA = jacobians(shape.gradients, nodes)[1] * w * own.area * at.size[:, None] ** 2
    share = dA / dA.sum(axis=1, keepdims=True)
    offset = np.einsum("nca,na->n", planes.levers, planes.R[:, :, 2]) / planes.levers.shape[1]
    strain = own.strain @ c[:, None]
    strain[:, :, :3] += offset[:, None, None, None] * strain[:, :, 3:6]
    # the membrane strain is linear over the patch, with the mean of u over the cell
    linear = turned_strain(along) @ fields.membrane[patch].reshape(n, 3, 3, k)
    smooth = np.einsum("npt,ntsk->npsk", terms(place[..., 0], place[..., 1], 1), linear)
    mean = np.einsum("np,npsk->nsk", share, strain[:, :, :3])
    strain[:, :, :3] = smooth - np.einsum("np,npsk->nsk", share, smooth)[:, None] + mean[:, None]
    E = group.by_law(lambda law: law.stiffness, rows)
    found -= np.einsum("np,npsk,npsk->nk", dA, strain, E[:, None] @ strain)
    flat = group.strains(rows)
    of_cells = np.einsum("np,npsd->nsd", flat.weights / flat.weights.sum(axis=1, keepdims=True), flat.B[:, :, :3]) @ v
    d = of_cells - mean  # (4)
    found += dA.sum(axis=1)[:, None] * (d * (E[:, :3, :3] @ d)).sum(axis=1)
    motion, director = own.motion @ c[:, None], own.director @ c[:, None]
    mass, centre, spread = (
        group.by_law(value, rows) for value in (lambda x: x.mass, lambda x: x.centre, lambda x: x.spread)
    )
    motion = motion + (offset + centre)[:, None, None, None] * director
    density = (motion**2).sum(axis=2) + spread[:, None, None] * (director**2).sum(axis=2)
    return np.asarray(found + lam * np.einsum("np,npk->nk", dA * mass[:, None], density))


def turned_strain(along: Array) -> Array:
    """Return the map of eps_x eps_y gamma_xy to axes whose x axis is `along`, (n, 1, 3, 3)."""
    c, s = (along[:, :2] / np.linalg.norm(along[:, :2], axis=1, keepdims=True)).T
    rows = [[c**2, s**2, c * s], [s**2, c**2, -c * s], [-2 * c * s, 2 * c * s, c**2 - s**2]]
    return np.moveaxis(np.array(rows), 2, 0)[:, None]


def add_edge_layers(
    error: Array, model: ShellModel, part: Cells, fields: FittedFields, of_cell: IntArray, loaded: IntArray
) -> None:
    """Add step (5) for the free edges of the cells of one type; edges between two loaded nodes are not free."""
    edges, group = cell_edges(tuple(each.cells for each in model.groups)), part.group
    is_own = (edges.cell >= part.first) & (edges.cell < part.first + len(part.X))
    is_free = is_own & (edges.count == 1) & ~np.isin(edges.nodes, loaded).all(axis=1)
    cells = edges.cell[is_free]
    own = cells - part.first
    for rows in chunks(len(cells)):
        cell = own[rows]
        at, c = fields.patches[of_cell[cells[rows]]], fields.u[of_cell[cells[rows]]]
        start = np.argmax(group.cells[cell] == edges.nodes[is_free][rows][:, :1], axis=1)
        ends = np.stack([start, (start + 1) % group.cells.shape[1]], axis=1)
        nodes, side = at.local(part.X[cell[:, None], ends])[..., :2], group.planes.xy[cell[:, None], ends]
        s = side[:, 1] - side[:, 0]
        length = np.linalg.norm(s, axis=1)
        x, y = (s / length[:, None]).T
        points, w = np.polynomial.legendre.leggauss(2)
        place = np.stack([(1 - points) / 2, (1 + points) / 2], axis=1) @ nodes
        along = np.einsum("nab,na->nb", at.R, group.planes.R[cell][:, :, 0])
        strain = surface_fields(at, place[..., 0], place[..., 1], along).strain @ c[:, None]
        stiffness = group.by_law(lambda law: law.stiffness, cell)
        # weights of M_x, M_y, M_xy in M_ns, which are also kappa_x, kappa_y, kappa_xy for kappa_ns = 1/2
        twist = np.stack([x * y, -x * y, y**2 - x**2], axis=1)
        T = np.einsum("ns,npsk->npk", twist, stiffness[:, None, 3:6] @ strain)
        g = np.einsum("ni,nij,nj->n", twist, group.by_law(lambda law: law.bending, cell), twist)
        H = group.by_law(lambda law: np.linalg.inv(law.H), cell)
        t = np.stack([x, y], axis=1)
        k = np.sqrt(1 / (np.einsum("ni,nij,nj->n", t, H, t) * g))
        np.add.at(error, cells[rows], ((length / (2 * g * k))[:, None, None] * w[:, None] * T**2).sum(axis=1))
