"""Strain at nodes of solids, on the outer faces of shells and at the extreme fibres of beams.

The strain of each element is S sigma with the compliance S of its material, so that an average over elements is the
average of their strains. Shells use plane stress and beams the stress of one fibre, so lateral contraction is included.
"""

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.body.material import Material
from fe_models.body.weld import WeldedModel, mesh_rows
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.shells.elements import ShellCells
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.stiffeners import StiffenedModel
from fe_models.elements.solids.body import SolidModel
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError

__all__ = ["isotropic_compliance", "nodal_strain"]


def nodal_strain(body: FEBody, u: Array, nodes: IntArray) -> Array:
    """Return the strain at nodes, (n, 6, k), xx yy zz yz xz xy in mesh axes, engineering shear strains.

    Parameters
    ----------
    u
        Displacement columns over the dofs of the mesh, (n_mesh_dof, k).
    nodes
        Nodes of solids, of the skins of beams and shells, or of the middle surface of shells, (n,).

    Raises
    ------
    BodyError
        If a node belongs to none of these, or to a layup whose faces are not isotropic.
    """
    found = np.zeros((len(nodes), 6, np.shape(u)[1]))
    put(found, np.arange(len(nodes)), body.element_model, np.asarray(u), np.asarray(nodes), f"body {body.name!r}")
    return found


def put(found: Array, rows: IntArray, model: object, u: Array, nodes: IntArray, where: str) -> None:
    """Write the strain at nodes of one element model into rows of `found`."""
    if not len(nodes):
        return
    if isinstance(model, WeldedModel):
        first = np.cumsum([0, *model.n_nodes])
        part_of = np.searchsorted(first, nodes, side="right") - 1
        require(bool((part_of < len(model.parts)).all()), where, nodes)
        for k, (part, own_u) in enumerate(zip(model.parts, mesh_rows(model.n_mesh_dof), strict=True)):
            own = part_of == k
            put(found, rows[own], part, u[own_u], nodes[own] - int(first[k]), where)
    elif isinstance(model, StiffenedModel):
        n, dofs = model.shell.n_nodes + len(model.shell.skin.points), model.shell.n_mesh_dof
        on_shell = nodes < n
        put(found, rows[on_shell], model.shell, u[:dofs], nodes[on_shell], where)
        put(found, rows[~on_shell], model.frame, u[dofs:], nodes[~on_shell] - n, where)
    elif isinstance(model, SolidModel):
        require(bool((nodes < len(model.mesh.nodes)).all()), where, nodes)
        compliances = np.array([np.linalg.inv(material.stiffness) for material in model.materials])
        found[rows] = compliances[model.of_node[nodes]] @ model.nodal_stress(u, nodes=np.unique(nodes))[nodes]
    elif isinstance(model, BeamModel):
        on_skin = nodes - model.n_nodes
        require(bool((on_skin >= 0).all()), where, nodes)
        compliances = np.array([isotropic_compliance(E, G) for E, G in model.moduli])
        found[rows] = compliances[section_of_skin(model)[on_skin]] @ model.nodal_stress(u)[nodes]
    elif isinstance(model, ShellModel):
        require(bool((nodes < model.n_nodes + len(model.skin.points)).all()), where, nodes)
        found[rows] = model.means_of_corners(u, lambda *at: shell_strain(where, *at))[nodes]
    else:
        require(ok=False, where=where, nodes=nodes)


def require(ok: bool, where: str, nodes: IntArray) -> None:
    """Raise `BodyError` if the strain at some of these nodes is unknown."""
    if not ok:
        raise BodyError(
            f"{where}: strain: node {int(nodes[0])} is of no solid, shell or skin of a beam; ask for its stress, or "
            'for "beam strain" and "shell strain" of elements'
        )


def section_of_skin(model: BeamModel) -> IntArray:
    """Return the section of each skin point, (n_skin,); a ring joins only lines with the same section."""
    found = np.zeros(len(model.skin.points), np.int64)
    for line, number in enumerate(np.asarray(model.of_line).tolist()):
        for start in model.skin.ring_start[line].tolist():
            found[start : start + len(model.sections[number].points)] = number
    return found


def shell_strain(where: str, group: ShellCells, resultants: Array, rows: slice, height: float) -> Array:
    """Return the strain of cells at one height, (n, p, 6, k), in the form of `ShellCells.stress`."""
    stress = group.stress(resultants, rows, height)
    of_law = np.zeros((len(group.laws), 6, 6))
    for number in np.unique(group.law[rows]):
        law = group.laws[number]
        if not law.layers:
            raise BodyError(
                f"{where}: strain at nodes of shells of given stiffness is not known; ask for "
                '"shell strain" of its elements: strains of the middle surface and curvatures'
            )
        material = law.layers[law.layer_at(height * law.thickness)].material
        if not isinstance(material, Material):
            raise BodyError(
                f"{where}: strain at nodes of a layup of {type(material).__name__} is not known; ask for "
                '"shell strain" of its elements: strains of the middle surface and curvatures'
            )
        of_law[number] = isotropic_compliance(material.E, material.mu)
    return np.asarray(of_law[group.law[rows]][:, None] @ stress)


def isotropic_compliance(E: float, G: float) -> Array:
    """Return the (6, 6) matrix from stress to strain [1/Pa]; nu = E/(2 G) - 1."""
    S = np.diag([1 / E] * 3 + [1 / G] * 3)
    S[:3, :3] -= (E / (2 * G) - 1) / E * (1 - np.eye(3))
    return S
