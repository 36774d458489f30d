"""Forces in elements from a displacement field: sections of beams, resultants of shells, springs.

Each group of elements of one kind says which numbers it has and how they are named; groups of a body of several parts
stand side by side, in the order of the parts.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.beams.attachments import spring_motion
from fe_models.beams.model import BeamModel
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Dimensions
from fe_models.shells.elements import ShellCells
from fe_models.shells.model import ShellModel
from fe_models.shells.stiffeners import StiffenedModel
from fe_models.weld import WeldedModel, mesh_rows

__all__ = ["ElementGroup", "element_groups"]

FORCE, MOMENT = Dimensions(1, 1, -2), Dimensions(1, 2, -2)
PER_LENGTH, BENDING = Dimensions(1, 0, -2), Dimensions(1, 1, -2)
SECTION = ("N", "Vy", "Vz", "Mx", "My", "Mz")
BEAM = tuple(f"end {end} {name}" for end in "AB" for name in SECTION)
SHELL = ("Nx", "Ny", "Nxy", "Mx", "My", "Mxy", "Qx", "Qy")
SPRING = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True, eq=False)
class ElementGroup:
    """Elements of one kind and the forces in them.

    "beam force": on the face whose normal is the local +x, about the centroid, local axes, at both ends
    (`BeamModel.section_forces`). "shell resultant": in local axes, the mean of the points of its stiffness
    (`ShellCells.resultants`). "spring force": stiffness times the motion of the second side against the first, in the
    axes of the spring: a tension is positive.
    """

    quantity: str
    part: str  #: kind of cells, and the part of a body of several; "" where it need not be told
    count: int  #: elements, numbered from 0
    components: tuple[str, ...]
    dimensions: tuple[Dimensions, ...]  #: of each component
    forces: Callable[[Array, IntArray], Array]  #: of columns over the mesh dofs and elements, (n, n_components, k)


def element_groups(body: FEBody) -> tuple[ElementGroup, ...]:
    """Return the groups of elements of a body whose forces are known; none of bare matrices and solids."""
    model = body.element_model
    return () if model is None else tuple(_groups(model, "", slice(None)))


def _groups(model: object, part: str, rows: slice) -> Iterator[ElementGroup]:
    """Yield the groups of a model whose dofs are these rows of the mesh dofs of the body."""
    if isinstance(model, WeldedModel):
        for k, (each, own) in enumerate(zip(model.parts, mesh_rows(model.n_mesh_dof), strict=True)):
            yield from _groups(each, f"part {k + 1}", own)
    elif isinstance(model, StiffenedModel):
        yield from _groups(model.shell, part, slice(0, model.shell.n_mesh_dof))
        yield from _groups(model.frame, part, slice(model.shell.n_mesh_dof, model.n_mesh_dof))
    elif isinstance(model, ShellModel):
        for group in model.groups:
            name = " ".join(word for word in (part, group.kind) if word)
            dimensions = (PER_LENGTH,) * 3 + (BENDING,) * 3 + (PER_LENGTH,) * 2
            forces = _shell_resultants(group, rows)
            yield ElementGroup("shell resultant", name, len(group.cells), SHELL, dimensions, forces)
    elif isinstance(model, BeamModel):
        if len(model.dofs):
            forces = _section_forces(model, rows)
            yield ElementGroup("beam force", part, len(model.dofs), BEAM, ((FORCE,) * 3 + (MOMENT,) * 3) * 2, forces)
        if model.springs:
            forces = _spring_forces(model, rows)
            yield ElementGroup("spring force", part, len(model.springs), SPRING, (FORCE,) * 3 + (MOMENT,) * 3, forces)


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
