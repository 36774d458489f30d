"""Estimate of the mesh error: change of the free frequencies of a solid when its mesh is refined.

(1) refine the bare solid, without couplings: first-order cells become second-order cells; second-order cells are halved
    along every edge, on the same curved surface
(2) compute the free elastic frequencies f_1 of the given mesh and f_2 of the refined mesh
(3) with f = f_0 + c h^p and half the size, f_1 - f_0 = (f_1 - f_2) / (1 - 2^-p). The order p = 1 is assumed, as in
    `cms.jobs.studies.mesh_convergence`, because frequencies converge no faster if there are re-entrant edges. Smooth
    modes of second-order cells have p = 4; their error is overestimated by a factor of up to 1.9. If the order of the
    cells was raised, the estimate is f_1 - f_2 itself, because the remaining error is of higher order
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.modes.families.families import Families
from fe_models.body.material import AnyMaterial
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import Units
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.quadratic_mesh import RAISED, quadratic_mesh
from fe_models.meshes.refined import refined_mesh

__all__ = ["MOST_DOFS", "MeshRefinement", "mesh_refinement"]

MOST_DOFS = 600_000  #: default for the largest number of dofs of the refined model
ORDER = 1.0


@dataclass(frozen=True, eq=False)
class MeshRefinement:
    """Free frequencies of a solid and of the same solid with a finer mesh."""

    how: str  #: kind of refinement: "second order" or "half the size"
    n_dof: tuple[int, int]  #: number of dofs of the given mesh and of the refined mesh
    frequencies: Array  #: frequencies with the given mesh and with the refined mesh, (2, n) [Hz]

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequencies", frozen(self.frequencies))

    @property
    def error(self) -> Array:
        """Estimated relative error of the frequencies with the given mesh, (n,), by step (3)."""
        change = self.frequencies[0] / self.frequencies[1] - 1
        return np.asarray(change if self.how == "second order" else change / (1 - 0.5**ORDER))


def mesh_refinement(
    mesh: Mesh,
    materials: AnyMaterial | Mapping[str, AnyMaterial],
    *,
    units: Units,
    n_modes: int = 6,
    incompatible_modes: bool = False,
    most_dofs: int = MOST_DOFS,
    stages: Stages | None = None,
) -> MeshRefinement:
    """Compare the free frequencies of a solid with those for a refined mesh.

    Parameters
    ----------
    mesh
        Solid cells without errors of the mesh report.
    materials, units, incompatible_modes
        As for `solid_body`; the finer mesh has no incompatible modes.
    n_modes
        Number of elastic frequencies.
    most_dofs
        Largest number of dofs of the refined model.

    Raises
    ------
    QualityError
        If the refined model would have more dofs, or these cells cannot be refined (wedges of second order).
    """
    stages = stages or Stages()
    with stages("finer mesh"):
        if all(kind in RAISED for kind in mesh.cells):
            finer, how = quadratic_mesh(mesh)[0], "second order"
            sets = {g: {RAISED[kind]: rows for kind, rows in by.items()} for g, by in mesh.cell_sets.items()}
            finer = Mesh(finer.nodes, finer.cells, cell_sets=sets)
        else:
            finer, how = refined_mesh(mesh), "half the size"
    n_dof = (3 * len(mesh.nodes), 3 * len(finer.nodes))
    if n_dof[1] > most_dofs:
        raise QualityError(
            f"the finer mesh ({how}) has {n_dof[1]} dofs, more than {most_dofs}; allow more, or compare two meshes of "
            "your own"
        )
    found = []
    for each, bricks in ((mesh, incompatible_modes), (finer, False)):
        with stages("free modes"):
            body = solid_body(each, materials, name="bare solid", units=units, incompatible_modes=bricks)
            with Families(body) as families:
                found.append(families.free_modes(n_modes).frequencies / units.time)
    return MeshRefinement(how, n_dof, np.array([each[:n_modes] for each in found]))
