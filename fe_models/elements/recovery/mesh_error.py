r"""Energy error of the elements of a mesh, by recovered stress (Zienkiewicz & Zhu).

(1) sample the stress where it is most accurate, and fit it to patches of elements (`patches`): sigma*. It has no
    jumps between elements of one material
(2) remove the traction of sigma* on the free surface of solids. Without this step, the shear stress of torsion and of
    bending would look exact in a wall of one or two layers of elements
(3) integrate eta² = ∫ (sigma* - sigma) · C⁻¹ (sigma* - sigma) dV over each element, its energy error

With M-normalised modes, an eigenvalue of conforming elements exceeds the exact one by lambda_h - lambda =
|u - u_h|²_E - lambda |u - u_h|²_0, and the last term is of higher order. So sum eta² estimates lambda_h - lambda. For a
rod of linear elements of length h, sigma = E u' is constant, sigma* - sigma is E u'' s about the middle, and sum eta² /
lambda = (k h)² / 12, as in the exact eigenvalue lambda (1 + (k h)² / 12).

Solids whose fields are not conforming, or whose energy is not fully integrated, also have errors that lower the
eigenvalues. Then the sum only gives the size of an error of unknown sign. Shells have a signed estimate of their own
(`fe_models.elements.recovery.shell_consistency`).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.body.fe_body import ElementModel
from fe_models.body.weld import WeldedModel, mesh_rows
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.recovery.patches import PatchCells, patch_recovery
from fe_models.elements.recovery.shell_consistency import signed_errors
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.stiffeners import StiffenedModel
from fe_models.elements.solids.body import SolidModel
from fe_models.elements.solids.elements import ShapeTable, reference_element
from fe_models.elements.solids.geometric import CURVED, bends_of_cells
from fe_models.elements.solids.incompatible import KIND, VOIGT, brick_chunks, brick_operators, gradient_stress
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.threads import in_threads
from fe_models.meshes.boundary import CORNERS, boundary_facets, facets_of
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.mesh import Mesh

__all__ = ["EnergyErrors", "energy_errors", "powers_of_size", "skin_nodes", "surface_elements", "without_estimate"]

SAMPLE_BYTES = 4e8  #: size of the sampled stress that is in memory at a time [bytes]
#: cells whose reduced integration leaves out a part of the strain energy, also if their edges are straight
UNDERINTEGRATED = ("hexahedron20", "hexahedron27", "wedge", "wedge15")
EDGE = 0.1  #: share of a direction in n nᵀ, above which it is a normal of an edge or a corner
SYMMETRIC = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  #: components of a tensor: xx yy zz yz xz xy


@dataclass(frozen=True, eq=False)
class EnergyErrors:
    """Energy errors of the elements that have an estimate, numbered by part of the body, type and cell."""

    error: Array  #: share of each element in lambda_h - lambda of each column; of solids eta², (n_cells, k) [J]
    energy: Array  #: twice the strain energy of each element and column, (n_cells, k) [J]
    nonconforming: str  #: why the sign of the error of a frequency is not known; "": it is known
    is_signed: bool = False  #: whether errors may be negative, because elements are shells

    @property
    def total(self) -> Array:
        """Sum over the elements, (k,) [J]."""
        return np.asarray(self.error.sum(axis=0))


def without_estimate(model: ElementModel | None) -> str:
    """Return why no element of a body has an estimate of its energy error; "" if some elements have one."""
    if model is None:
        return "the body consists of matrices"
    if isinstance(model, SolidModel) and model.parts is not None:
        return "the mesh is distributed over ranks"
    if isinstance(model, WeldedModel):
        reasons = [without_estimate(part) for part in model.parts]
        return reasons[0] if all(reasons) else ""
    if isinstance(model, SolidModel | ShellModel | StiffenedModel):
        return ""
    return "the stress of beams is not recovered" if isinstance(model, BeamModel) else "no element has stress"


def energy_errors(model: ElementModel, u: Array, lam: Array, loaded: IntArray) -> EnergyErrors:
    """Return the energy errors of all solid and shell elements for displacement columns.

    Parameters
    ----------
    model
        Element model for which `without_estimate` returns "".
    u
        Displacement columns over the dofs of the mesh, (n_mesh_dof, k); for shells, M-normalised modes.
    lam
        Eigenvalues of the modes, (k,); solids do not use them.
    loaded
        Nodes on which something else than inertia may act. Elsewhere the surface of solids is free of traction, and
        the edges of shells are free of moments.
    """
    found = list(errors_of_parts(model, np.asarray(u), lam, loaded))
    return EnergyErrors(
        np.concatenate([each.error for each in found]),
        np.concatenate([each.energy for each in found]),
        next((each.nonconforming for each in found if each.nonconforming), ""),
        any(each.is_signed for each in found),
    )


def errors_of_parts(model: ElementModel, u: Array, lam: Array, loaded: IntArray) -> Iterator[EnergyErrors]:
    """Yield the energy errors of the parts of a body that have an estimate."""
    if isinstance(model, WeldedModel):
        first = np.cumsum([0, *model.n_nodes])[:-1]
        for part, rows, begin in zip(model.parts, mesh_rows(model.n_mesh_dof), first, strict=True):
            if not without_estimate(part):
                yield from errors_of_parts(part, u[rows], lam, loaded - begin)
    elif isinstance(model, StiffenedModel):
        yield from errors_of_parts(model.shell, u[: model.shell.n_mesh_dof], lam, np.union1d(loaded, model.nodes))
    elif isinstance(model, ShellModel):
        yield EnergyErrors(*signed_errors(model, u, lam, loaded), "", is_signed=True)
    elif isinstance(model, SolidModel):
        yield solid_errors(model, u, loaded)


def surface_elements(model: ElementModel | None) -> IntArray:
    """Return the element of each surface triangle of a body, numbered as in `EnergyErrors`, (n_tri,); -1: none."""
    if isinstance(model, WeldedModel):
        parts, first = [], 0
        for part in model.parts:
            own = surface_elements(part)
            parts.append(np.where(own < 0, -1, own + first))
            first += len(powers_of_size(part))
        return np.concatenate(parts)
    if isinstance(model, StiffenedModel):
        return np.concatenate([model.shell.skin.cell_of, np.full(len(model.frame.skin.triangles), -1)])
    if isinstance(model, SolidModel):
        return facets_of(model.mesh).cells
    if isinstance(model, ShellModel):
        return model.skin.cell_of
    return np.full(len(model.skin.triangles) if isinstance(model, BeamModel) else 0, -1)


def skin_nodes(model: ElementModel | None) -> IntArray:
    """Return the nodes of a body that are points on the skin of shells, which follow nodes and bear no load."""
    if isinstance(model, WeldedModel):
        first = np.cumsum([0, *model.n_nodes])
        return np.concatenate([skin_nodes(part) + begin for part, begin in zip(model.parts, first, strict=False)])
    if isinstance(model, StiffenedModel):
        return skin_nodes(model.shell)
    return model.n_nodes + np.arange(len(model.skin.points)) if isinstance(model, ShellModel) else np.zeros(0, np.int64)


def powers_of_size(model: ElementModel | None) -> IntArray:
    """Return for each element the power 2 p + d of its size with which its eta² falls, p its order, d its dimension."""
    if isinstance(model, WeldedModel):
        return np.concatenate([powers_of_size(part) for part in model.parts])
    if isinstance(model, SolidModel):
        orders = [np.full(len(c), 2 if CELL_SHAPES[kind].middles else 1) for kind, c in model.mesh.cells.items()]
        return np.asarray(2 * np.concatenate(orders) + 3)
    shell = model.shell if isinstance(model, StiffenedModel) else model
    return np.full(sum(len(group.cells) for group in shell.groups) if isinstance(shell, ShellModel) else 0, 2 + 2)


def column_blocks(u: Array, bytes_of_column: float) -> list[Array]:
    """Return blocks of equally many columns, whose samples are no larger than `SAMPLE_BYTES`."""
    return np.array_split(u, max(1, int(np.ceil(u.shape[1] * bytes_of_column / SAMPLE_BYTES))), axis=1)


# solids ---------------------------------------------------------------------------------------------------------------


def error_table(kind: str, integration: str) -> ShapeTable:
    """Return the points at which the energy error of a cell is integrated: those of the stiffness, or more.

    At the points of the stress, that of simplices is too accurate.
    """
    element = reference_element(kind, integration if kind in UNDERINTEGRATED else "full")
    return element.mass if kind == "tetra" else element.stiffness


def solid_errors(model: SolidModel, u: Array, loaded: IntArray) -> EnergyErrors:
    """Return the energy errors of a solid, in blocks of columns."""
    mesh = model.mesh
    tensors = np.array([material.stiffness for material in model.materials])
    kinds = [kind for kind, cells in mesh.cells.items() if len(cells)]
    # a node has one row for each material, because the stress jumps where materials meet
    own = {kind: mesh.cells[kind] * len(tensors) + model.of_cell[kind][:, None] for kind in kinds}
    keys = np.unique(np.concatenate([each.ravel() for each in own.values()]))
    rows = {kind: np.searchsorted(keys, each) for kind, each in own.items()}
    groups = [patch_cells(model, kind, rows[kind]) for kind in kinds]
    order = 2 if all(CELL_SHAPES[kind].middles for kind in kinds) else 1
    recovery = patch_recovery(mesh.nodes[keys // len(tensors)], groups, order)
    surface, free = free_surface(model.mesh, loaded)
    place = np.full(len(mesh.nodes), -1)
    place[surface] = np.arange(len(surface))
    on_surface = np.flatnonzero(place[keys // len(tensors)] >= 0)
    P = free[place[keys[on_surface] // len(tensors)]]
    n_samples = sum(group.samples.shape[0] * group.samples.shape[1] for group in groups)
    errors, energies = [], []
    for block in column_blocks(u, 48 * n_samples):
        columns = np.ascontiguousarray(block)
        k = columns.shape[1]
        sampled = [cell_stress(model, kind, tensors, columns) for kind in kinds]
        at_samples = [each.reshape(-1, 6 * k) for each in sampled]
        recovered = recovery.at_nodes(np.concatenate(at_samples) if len(kinds) > 1 else at_samples[0])
        recovered = recovered.reshape(-1, 6, k)
        recovered[on_surface] = P @ recovered[on_surface]  # (2)
        parts = [
            cell_defects(model, kind, tensors, columns, rows[kind], sigma, recovered)
            for kind, sigma in zip(kinds, sampled, strict=True)
        ]
        errors.append(np.concatenate([part[0] for part in parts]))
        energies.append(np.concatenate([part[1] for part in parts]))
    return EnergyErrors(np.hstack(errors), np.hstack(energies), nonconforming_solid(model))


def free_surface(mesh: Mesh, loaded: IntArray) -> tuple[IntArray, Array]:
    """Return nodes of the free surface, (n,), and the map of their stress to one without traction, (n, 6, 6).

    With the mean T of n nᵀ over the facets at a node, whose eigenvectors are its normals, and the projection T on all
    directions but these, the map is T sigma T. Re-entrant edges are left out, because stress is singular there.
    """
    N, mean, towards = np.zeros((len(mesh.nodes), 3, 3)), np.zeros((len(mesh.nodes), 3)), np.zeros((len(mesh.nodes), 3))
    for kind, facets in boundary_facets(mesh).items():
        x = mesh.nodes[facets[:, : CORNERS[kind]]]
        normal = (
            np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
            if x.shape[1] == 3
            else np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
        )
        area = np.linalg.norm(normal, axis=1)
        outer = normal[:, :, None] * normal[:, None] / area[:, None, None]
        center = x.mean(axis=1)
        for column in facets.T:
            np.add.at(N, column, outer)
            np.add.at(mean, column, normal)
            np.add.at(towards, column, center - mesh.nodes[column])
    size = np.einsum("naa->n", N)
    is_free = size > 0
    is_free[loaded[(loaded >= 0) & (loaded < len(is_free))]] = False
    share, axes = np.linalg.eigh(N / np.where(size > 0, size, 1.0)[:, None, None])
    is_normal = share > EDGE
    is_convex = np.einsum("na,na->n", mean, towards) < 0
    is_free &= (is_normal.sum(axis=1) == 1) | is_convex
    nodes = np.flatnonzero(is_free)
    T = np.einsum("nab,nb,ncb->nac", axes[nodes], ~is_normal[nodes], axes[nodes])
    P = np.zeros((len(nodes), 6, 6))
    for row, (i, j) in enumerate(SYMMETRIC):
        for column, (a, b) in enumerate(SYMMETRIC):
            P[:, row, column] = T[:, i, a] * T[:, j, b] + (T[:, i, b] * T[:, j, a] if a != b else 0.0)
    return nodes, P


def nonconforming_solid(model: SolidModel) -> str:
    """Return why frequencies of this solid may be too low; "": they are not."""
    mesh = model.mesh
    kinds = [kind for kind, cells in mesh.cells.items() if len(cells)]
    if any(is_incompatible(model, kind) for kind in kinds):
        return "bricks have incompatible modes"
    if model.integration == "full":
        return ""
    is_curved = "tetra10" in kinds and (bends_of_cells(mesh.nodes, mesh.cells["tetra10"]) > CURVED).any()
    is_inexact = is_curved or "pyramid13" in kinds or any(kind in UNDERINTEGRATED for kind in kinds)
    return "the stiffness has reduced integration" if is_inexact else ""


def patch_cells(model: SolidModel, kind: str, rows: IntArray) -> PatchCells:
    """Return the cells of a type with the positions of their stress points."""
    shape = CELL_SHAPES[kind]
    samples = np.einsum("pa,nai->npi", reference_element(kind).stress.values, model.mesh.nodes[model.mesh.cells[kind]])
    return PatchCells(rows, len(shape.corners), shape.middles, samples)


def is_incompatible(model: SolidModel, kind: str) -> bool:
    """Whether cells of this type have incompatible modes."""
    return model.incompatible and kind == KIND


def cell_stress(model: SolidModel, kind: str, tensors: Array, u: Array) -> Array:
    """Return the stress at the stress points of all cells of a type, (n_cells, n_points, 6, k) [Pa]."""
    from fe_models.elements.solids.stress_kernels import write_cell_stress

    cells, of_cell, nodes = model.mesh.cells[kind], model.of_cell[kind], model.mesh.nodes
    if is_incompatible(model, kind):
        return np.concatenate([sigma for _, sigma, _ in brick_stress(nodes, cells, tensors[of_cell], u)])
    dN, k = reference_element(kind).stress.gradients, u.shape[1]
    sigma = np.empty((len(cells), len(dN), 6, k))
    in_threads(write_cell_stress, (nodes, cells, of_cell, tensors, dN, u.reshape(len(nodes), 3, k)), (sigma,))
    return sigma


def brick_stress(nodes: Array, cells: IntArray, tensors: Array, u: Array) -> Iterator[tuple[slice, Array, Array]]:
    """Yield rows of bricks with incompatible modes, their stress, (n, 8, 6, k) [Pa], and volumes, (n, 8) [m³]."""
    for rows, dofs in brick_chunks(cells):
        B, volumes = brick_operators(nodes[cells[rows]], tensors[rows])
        yield rows, gradient_stress(B @ u[dofs][:, None], tensors[rows])[:, :, VOIGT], volumes


def cell_defects(
    model: SolidModel, kind: str, tensors: Array, u: Array, rows: IntArray, sampled: Array, recovered: Array
) -> tuple[Array, Array]:
    """Return eta² and twice the strain energy of all cells of a type, (n_cells, k) each [J].

    Parameters
    ----------
    rows
        Row of `recovered` of each node of each cell, (n_cells, n_a).
    sampled, recovered
        Stress at the stress points, (n_cells, n_points, 6, k), and at the nodes, (n_rows, 6, k) [Pa].
    """
    from fe_models.elements.solids.stress_kernels import add_affine_defects, add_stress_defects

    cells, of_cell, nodes = model.mesh.cells[kind], model.of_cell[kind], model.mesh.nodes
    defect, energy = np.zeros((len(cells), u.shape[1])), np.zeros((len(cells), u.shape[1]))
    compliances, table = np.linalg.inv(tensors), error_table(kind, model.integration)
    if is_incompatible(model, kind):
        for part, sigma, volumes in brick_stress(nodes, cells, tensors[of_cell], u):
            d = np.einsum("pa,nack->npck", table.values, recovered[rows[part]]) - sigma
            S = volumes[:, :, None, None] * compliances[of_cell[part], None]
            defect[part] = (d * (S @ d)).sum(axis=(1, 2))
            energy[part] = (sigma * (S @ sigma)).sum(axis=(1, 2))
        return defect, energy
    affine, others = affine_cells(model, kind)
    if len(affine):
        edges = nodes[cells[affine, 1:4]] - nodes[cells[affine, :1]]
        element = reference_element(kind)
        L_T = np.linalg.cholesky(table.values.T @ (table.weights[:, None] * table.values)).T.copy()
        maps = (L_T, L_T @ element.extrapolation, element.stress.weights)
        straight = (affine, np.linalg.det(edges), of_cell, compliances, *maps, rows, recovered, sampled)
        in_threads(add_affine_defects, straight, (defect, energy))
    if len(others):
        rule = (table.values, table.gradients, table.weights)
        inputs = (others, nodes, cells, of_cell, tensors, compliances, *rule, u.reshape(len(nodes), 3, -1), rows)
        in_threads(add_stress_defects, (*inputs, recovered), (defect, energy))
    return defect, energy


def affine_cells(model: SolidModel, kind: str) -> tuple[IntArray, IntArray]:
    """Return the straight tetrahedra of a type, whose stress is in the span of its samples, and the other cells."""
    cells = model.mesh.cells[kind]
    is_affine = np.full(len(cells), kind == "tetra")
    if kind == "tetra10":
        is_affine = bends_of_cells(model.mesh.nodes, cells) <= CURVED
    return np.flatnonzero(is_affine), np.flatnonzero(~is_affine)
