"""Forces and strains in elements: beam sections, shell cells, springs, and centres of solid cells.

Each group holds elements of one kind with their numbers and names. The groups of a body of several parts are listed in
the order of the parts.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.body.weld import WeldedModel, mesh_rows
from fe_models.elements.beams.attachments import spring_motion
from fe_models.elements.beams.model import BeamModel
from fe_models.elements.shells.elements import ShellCells
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.stiffeners import StiffenedModel
from fe_models.elements.solids.body import SolidModel
from fe_models.elements.solids.elements import reference_centre
from fe_models.foundation.arrays import STRESS_COMPONENTS, Array, IntArray
from fe_models.foundation.units import Dimensions
from fe_models.meshes.numbering import NONE

__all__ = ["ElementGroup", "beam_strains", "centre_strains", "centre_stress", "element_groups", "shell_strains"]


# element strains ------------------------------------------------------------------------------------------------------
# Strains in elements: beam sections, middle surfaces of shells, and centres of solid cells with their stress.


Values = Callable[[Array, IntArray], Array]


def beam_strains(model: BeamModel, rows: slice) -> Values:
    """Return strains eps gamma_y gamma_z kappa_x kappa_y kappa_z at line ends: section forces over stiffness.

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


# element forces -------------------------------------------------------------------------------------------------------


FORCE, MOMENT = Dimensions(1, 1, -2), Dimensions(1, 2, -2)
PER_LENGTH, BENDING = Dimensions(1, 0, -2), Dimensions(1, 1, -2)
SECTION = ("N", "Vy", "Vz", "Mx", "My", "Mz")
BEAM = tuple(f"end {end} {name}" for end in "AB" for name in SECTION)
SHELL = ("Nx", "Ny", "Nxy", "Mx", "My", "Mxy", "Qx", "Qy")
BEAM_STRAIN = tuple(f"end {end} {name}" for end in "AB" for name in ("eps", "gy", "gz", "kx", "ky", "kz"))
SHELL_STRAIN = ("ex", "ey", "gxy", "kx", "ky", "kxy", "gxz", "gyz")
NUMBER, PER_METRE, STRESS = Dimensions(), Dimensions(0, -1, 0), Dimensions(1, -1, -2)
SPRING = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Elements of one kind, and their forces or strains.

    "beam force": on the face with normal local +x, about the centroid, in local axes, at both ends
    (`BeamModel.section_forces`). "shell resultant": in local axes, averaged over the points of the stiffness
    (`ShellCells.resultants`). "spring force": stiffness times the motion of the second side relative to the first, in
    the axes of the spring; tension is positive. "beam strain", "shell strain": the strains that belong to these forces
    (`beam_strains`, `shell_strains`). "element stress", "element strain": at the centre of solid cells, in mesh axes.
    """

    quantity: str
    part: str  #: cell type, and name of the part if the body has several; "" if not needed
    names: tuple[str, ...]  #: user's name of each element; if it has no number, part and index, such as "part 1 3"
    numbers: IntArray  #: user's number of each element, (n,); -1: none
    groups: Mapping[str, IntArray]  #: elements of the group in each set of the user
    components: tuple[str, ...]
    dimensions: tuple[Dimensions, ...]  #: dimensions of each component
    #: function of columns over the mesh dofs and of elements, (n, n_components, k)
    forces: Callable[[Array, IntArray], Array]
    source: "ShellCells | BeamModel | SolidModel"  #: element model that computes the values
    rows: slice  #: rows of the element model among the mesh dofs of the body
    first_node: int  #: index in the body of the first node of the element model
    kind: str = ""  #: cell type of solids

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.names)

    def members(self, at: str | int, *, is_only: bool) -> IntArray:
        """Return the elements with this name or number; an empty array if the group has none.

        Parameters
        ----------
        at
            Number or name of an element, or name of a set or of the part.
        is_only
            Whether this is the only group. A number is then an index if the elements have no numbers.
        """
        if isinstance(at, str):
            if at in self.groups:
                return self.groups[at]
            return np.arange(self.count) if at and at == self.part else np.flatnonzero(np.array(self.names) == at)
        if (self.numbers >= 0).any():
            return np.flatnonzero(self.numbers == at)
        return np.array([at] if is_only and 0 <= at < self.count else [], dtype=np.int64)


@dataclass(frozen=True)
class _Place:
    """Position of the element model of a part in its body."""

    part: str
    rows: slice  #: rows of the element model among the mesh dofs
    first_node: int
    n_nodes: int


def element_groups(body: FEBody) -> tuple[ElementGroup, ...]:
    """Return the groups of elements of a body that can compute forces; none for bare matrices."""
    if body.element_model is None:
        return ()
    return tuple(_groups(body, body.element_model, _Place("", slice(None), 0, len(body.nodes))))


def _groups(body: FEBody, model: object, at: _Place) -> Iterator[ElementGroup]:
    """Yield the element groups of an element model."""
    if isinstance(model, WeldedModel):
        first = np.cumsum([0, *model.n_nodes]).tolist()
        for k, (each, rows) in enumerate(zip(model.parts, mesh_rows(model.n_mesh_dof), strict=True)):
            yield from _groups(body, each, _Place(f"part {k + 1}", rows, first[k], model.n_nodes[k]))
    elif isinstance(model, StiffenedModel):
        shell, frame = model.shell.n_mesh_dof, model.n_mesh_dof
        n = model.shell.n_nodes + len(model.shell.skin.points)
        yield from _groups(body, model.shell, _Place(at.part, slice(0, shell), at.first_node, n))
        yield from _groups(body, model.frame, _Place(at.part, slice(shell, frame), at.first_node + n, at.n_nodes - n))
    elif isinstance(model, ShellModel):
        dimensions = (PER_LENGTH,) * 3 + (BENDING,) * 3 + (PER_LENGTH,) * 2
        triangles = _triangles(body, at, model.skin.cell_of, sum(len(group.cells) for group in model.groups))
        cells = np.cumsum([0, *(len(group.cells) for group in model.groups)]).tolist()
        for group, begin, end in zip(model.groups, cells[:-1], cells[1:], strict=True):
            part = " ".join(word for word in (at.part, group.kind) if word)
            named = _named(body, part, triangles[begin:end])
            forces = _shell_resultants(group, at.rows)
            yield ElementGroup(
                "shell resultant", part, *named, SHELL, dimensions, forces, group, at.rows, at.first_node
            )
            dimensions_of_strains = (NUMBER,) * 3 + (PER_METRE,) * 3 + (NUMBER,) * 2
            strains = shell_strains(group, at.rows)
            yield ElementGroup(
                "shell strain", part, *named, SHELL_STRAIN, dimensions_of_strains, strains, group, at.rows,
                at.first_node,
            )  # fmt: skip
    elif isinstance(model, BeamModel):
        six = (FORCE,) * 3 + (MOMENT,) * 3
        if len(model.dofs):
            named = _named(body, at.part, _triangles(body, at, model.skin.line_of, len(model.dofs)))
            forces = _section_forces(model, at.rows)
            yield ElementGroup("beam force", at.part, *named, BEAM, six * 2, forces, model, at.rows, at.first_node)
            of_strains = ((NUMBER,) * 3 + (PER_METRE,) * 3) * 2
            strains = beam_strains(model, at.rows)
            yield ElementGroup(
                "beam strain", at.part, *named, BEAM_STRAIN, of_strains, strains, model, at.rows, at.first_node
            )
        if model.springs:
            named = _named(body, at.part, np.full(len(model.springs), NONE))
            forces = _spring_forces(model, at.rows)
            yield ElementGroup("spring force", at.part, *named, SPRING, six, forces, model, at.rows, at.first_node)

    elif isinstance(model, SolidModel):
        for kind in model.mesh.cells:
            part = " ".join(word for word in (at.part, kind) if word)
            named = _named_cells(part, model, kind)
            for quantity, dimension, values in (
                ("element stress", STRESS, centre_stress(model, kind, at.rows)),
                ("element strain", NUMBER, centre_strains(model, kind, at.rows)),
            ):
                yield ElementGroup(
                    quantity, part, *named, STRESS_COMPONENTS, (dimension,) * 6, values, model, at.rows,
                    at.first_node, kind,
                )  # fmt: skip


def _named_cells(part: str, model: SolidModel, kind: str) -> tuple[tuple[str, ...], IntArray, Mapping[str, IntArray]]:
    """Return names, numbers and sets of the solid cells of a type, including cells inside the body."""
    n = len(model.mesh.cells[kind])
    numbers = np.asarray(model.mesh.cell_numbers.get(kind, np.full(n, NONE)))
    names = tuple(f"{part} {k}" if number == NONE else str(number) for k, number in enumerate(numbers.tolist()))
    sets = {name: rows[kind] for name, rows in model.mesh.cell_sets.items() if len(rows.get(kind, ()))}
    return names, numbers, sets


def _triangles(body: FEBody, at: _Place, element_of: IntArray, count: int) -> IntArray:
    """Return one surface triangle of the body for each element of a part, (count,); -1 if it has none."""
    found = np.full(count, NONE)
    inside = (body.surface >= at.first_node) & (body.surface < at.first_node + at.n_nodes)
    own = np.flatnonzero(inside.all(axis=1))
    if len(own) == len(element_of):  # otherwise other parts share the nodes, and the owner of a triangle is unknown
        found[element_of[::-1]] = own[::-1]
    return found


def _named(body: FEBody, part: str, triangles: IntArray) -> tuple[tuple[str, ...], IntArray, Mapping[str, IntArray]]:
    """Return names, numbers and sets of elements, given a triangle of each element."""
    numbering = body.numbering
    numbers = np.full(len(triangles), NONE)
    has = triangles != NONE
    if numbering.elements.size:
        numbers[has] = numbering.elements[triangles[has]]
    names = tuple(
        f"{part} {k}".strip() if number == NONE else numbering.element_name(int(triangle))
        for k, (number, triangle) in enumerate(zip(numbers, triangles, strict=True))
    )
    sets = {
        each.name: np.flatnonzero(has & np.isin(triangles, each.members))
        for each in numbering.sets
        if each.kind == "elements"
    }
    return names, numbers, {name: members for name, members in sets.items() if len(members)}


def _section_forces(model: BeamModel, rows: slice) -> Callable[[Array, IntArray], Array]:
    def forces(u: Array, elements: IntArray) -> Array:
        own = model.section_forces(u[rows])[elements]
        return own.reshape(len(elements), len(BEAM), -1)

    return forces


def _shell_resultants(group: ShellCells, rows: slice) -> Callable[[Array, IntArray], Array]:
    def forces(u: Array, elements: IntArray) -> Array:
        means = [group.resultants(u[rows], slice(k, k + 1)).mean(axis=1)[0] for k in elements.tolist()]
        return np.array(means).reshape(len(elements), len(SHELL), u.shape[1])

    return forces


def _spring_forces(model: BeamModel, rows: slice) -> Callable[[Array, IntArray], Array]:
    def forces(u: Array, elements: IntArray) -> Array:
        of_mesh, found = u[rows], []
        for k in elements.tolist():
            spring = model.springs[k]
            B, dofs = spring_motion(model.nodes, spring)
            found.append(np.asarray(spring.stiffness) @ (B @ of_mesh[dofs]))
        return np.array(found).reshape(len(elements), len(SPRING), u.shape[1])

    return forces
