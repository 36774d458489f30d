"""Strains in elements: beam sections, middle surfaces of shells, and centres of solid cells with their stress."""

from collections.abc import Callable

import numpy as np

from fe_models.elements.beams.model import BeamModel
from fe_models.elements.shells.elements import ShellCells
from fe_models.elements.solids.body import SolidModel
from fe_models.elements.solids.elements import reference_centre
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["beam_strains", "centre_strains", "centre_stress", "shell_strains"]

Values = Callable[[Array, IntArray], Array]


def beam_strains(model: BeamModel, rows: slice) -> Values:
    """Return eps gamma_y gamma_z kappa_x kappa_y kappa_z at both ends of lines: section forces divided by stiffness.

    kappa_x is the twist per length from torsion about the shear centre. A section without shear deformation has zero
    gamma.
    """

    def values(u: Array, elements: IntArray) -> Array:
        forces = np.array(model.section_forces(u[rows])[elements])
        of_line = np.asarray(model.of_line)[elements]
        stiffness = np.array([section_stiffness(model, number) for number in range(len(model.sections))])
        y_s, z_s = np.array([section.shear_center for section in model.sections])[of_line].T[:, :, None, None]
        forces[:, :, 3] += z_s * forces[:, :, 1] - y_s * forces[:, :, 2]
        return np.asarray((forces / stiffness[of_line][:, None, :, None]).reshape(len(elements), 12, -1))

    return values


def section_stiffness(model: BeamModel, number: int) -> Array:
    """Return E A, G A_sy, G A_sz, G J, E Iy, E Iz of a section, (6,) [N, N m²]."""
    section, (E, G) = model.sections[number], model.moduli[number]
    return np.array([E * section.A, G * section.A_sy, G * section.A_sz, G * section.J, E * section.Iy, E * section.Iz])


def shell_strains(group: ShellCells, rows: slice) -> Values:
    """Return eps_x eps_y gamma_xy, kappa_x kappa_y kappa_xy, gamma_xz gamma_yz of cells, local axes: C⁻¹ (N, M, Q).

    Like the resultants, they are averaged over the points of the stiffness.
    """

    def values(u: Array, elements: IntArray) -> Array:
        found = []
        for k in elements.tolist():
            mean = group.resultants(u[rows], slice(k, k + 1)).mean(axis=1)[0]
            found.append(np.linalg.solve(group.laws[group.law[k]].stiffness, mean))
        return np.array(found).reshape(len(elements), 8, u.shape[1])

    return values


def centre_strains(model: SolidModel, kind: str, rows: slice) -> Values:
    """Return the strain at the centres of solid cells, (n, 6, k), xx yy zz yz xz xy in mesh axes, engineering shear.

    It is the symmetric gradient of the displacement, eps = sym(sum_i u_i grad N_i). Incompatible modes of bricks have
    zero gradient at the centre.
    """
    cells, nodes = model.mesh.cells[kind], model.mesh.nodes
    gradients = reference_centre(kind)  # (n_corners, 3)

    def values(u: Array, elements: IntArray) -> Array:
        own = cells[elements]
        J = np.einsum("nca,cb->nab", nodes[own], gradients)  # derivatives dx_a/dxi_b
        dN = np.einsum("cb,nba->nca", gradients, np.linalg.inv(J))
        of_nodes = u[rows].reshape(len(nodes), 3, -1)[own]  # (n, c, 3, k)
        H = np.einsum("ncik,ncj->nijk", of_nodes, dN)
        xx, yy, zz = H[:, 0, 0], H[:, 1, 1], H[:, 2, 2]
        shears = [H[:, a, b] + H[:, b, a] for a, b in ((1, 2), (0, 2), (0, 1))]
        return np.stack([xx, yy, zz, *shears], axis=1)

    return values


def centre_stress(model: SolidModel, kind: str, rows: slice) -> Values:
    """Return the stress C eps at the centres of solid cells, (n, 6, k) [Pa]."""
    strains = centre_strains(model, kind, rows)
    tensors = np.array([material.stiffness for material in model.materials])

    def values(u: Array, elements: IntArray) -> Array:
        return np.asarray(tensors[model.of_cell[kind][elements]] @ strains(u, elements))

    return values
