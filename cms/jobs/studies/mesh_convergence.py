"""Discretisation error of the free frequencies of a CAD body, from the same job with two mesh sizes.

(1) the job is meshed at its own size h and at a coarser one; curvature and smallest size change in proportion
(2) both bodies are coupled as the job requires, and their lowest elastic frequencies are computed
(3) with f(h) = f + c h^p, the error at h is (f(r h) - f(h)) / (r^p - 1) (Richardson extrapolation). The ratio r is the
    ratio of the numbers of dofs to the power 1/3. The assumed order is p = 1. Frequencies of elements of order k
    converge with h^(2k) where the modes are smooth. Beside a re-entrant edge the displacement varies with the distance
    to the power lambda, and frequencies converge with h^(2 lambda): lambda is 1/2 at a crack and 0.545 at a right
    angle. Such edges dominate for fine meshes. With p = 1, the errors of smooth modes of quadratic elements are
    overestimated by a factor of (r⁴ - 1) / (r - 1)
(4) first-order cells can be far from convergence: no error is smaller than the one in the mesh report
(5) beside it stands the error estimated from the stress on each mesh alone (`cms.jobs.studies.mesh_estimate`). The
    power of the element size with which the largest of these falls gives the size for a wanted error
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.quality.record import QualityRecord
from cms.errors import JobError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import Job, read_job
from cms.jobs.studies.mesh_estimate import MeshEstimate, mesh_estimate
from fe_models.foundation.arrays import Array
from fe_models.foundation.stages import Stages

__all__ = ["ORDER", "MeshConvergence", "mesh_convergence"]

ORDER = 1.0  #: assumed order of convergence of the frequencies
RATES = 1.0, 4.0  #: least and largest power of step (5)
RATIO = 1.5  #: default ratio of the sizes in the two meshes
LEAST_RATIO = 1.05  #: smallest ratio of the sizes in the two meshes


@dataclass(frozen=True, eq=False)
class MeshConvergence:
    """Free frequencies at two mesh sizes, and the estimated error for the finer mesh."""

    sizes: tuple[float, float]  #: sizes of the coarse and the fine mesh; the fine mesh is that of the job [length]
    n_dof: tuple[int, int]  #: numbers of dofs of the coupled bodies
    frequencies: Array  #: frequencies with the coarse and the fine mesh, (2, n) [Hz]
    first_order: float = 0.0  #: relative error due to first-order cells, from the report of the fine mesh
    estimates: tuple[MeshEstimate, ...] = ()  #: estimates from the stress on the coarse and on the fine mesh

    @property
    def ratio(self) -> float:
        """Ratio of coarse to fine element size, from the numbers of dofs."""
        return float((self.n_dof[1] / self.n_dof[0]) ** (1 / 3))

    @property
    def change(self) -> Array:
        """Coarse frequencies over fine frequencies, minus 1, (n,)."""
        return np.asarray(self.frequencies[0] / self.frequencies[1] - 1)

    @property
    def error(self) -> Array:
        """Estimated relative error of the fine frequencies, (n,), by steps (3) and (4); positive: too high."""
        return np.maximum(self.change / (self.ratio**ORDER - 1), self.first_order or -np.inf)

    @property
    def rate(self) -> float:
        """Power of the element size with which the largest estimated error falls, by step (5)."""
        coarse, fine = (each.worst for each in self.estimates)
        return float(np.clip(np.log(coarse / fine) / np.log(self.ratio), *RATES))

    def judged(self, error: float) -> QualityRecord:
        """Return the verdict about the finer mesh for a wanted error, as `MeshEstimate.judged`."""
        return self.estimates[1].judged(error, self.rate, self.sizes[1])

    def size_for(self, error: float) -> float:
        """Return the element size for which the largest estimated error of the frequencies is `error` [length]."""
        return self.sizes[1] * self.estimates[1].size_factor(error, self.rate)


def mesh_convergence(
    job: Job | Path | str, *, ratio: float = RATIO, n_modes: int = 10, stages: Stages | None = None
) -> MeshConvergence:
    """Compute the free frequencies of a CAD job at its own mesh size and at a coarser one.

    Parameters
    ----------
    job
        Job whose mesh is a CAD file, or the path of its job file.
    ratio
        Coarse mesh size divided by that of the job, above 1.
    n_modes
        Number of elastic frequencies.
    stages
        Receives the time of each stage.

    Raises
    ------
    JobError
        If the body does not come from a CAD file, the ratio is invalid, or both sizes give the same mesh.
    MeshError, InterfaceError
        If the mesh or an interface of the job is invalid.
    """
    job = job if isinstance(job, Job) else read_job(Path(job))
    stages = stages or Stages()
    if job.mesh_size is None:
        raise JobError(
            "converge: the body comes from a mesh or from matrices, which have one size; expected a CAD file with "
            "[mesh_size]. Mesh it at two sizes and compare, or see the mesh report on first-order cells"
        )
    if not 1.1 <= ratio <= 4:
        raise JobError(f"converge: ratio: expected a number between 1.1 and 4, got {ratio:g}")
    if n_modes < 1:
        raise JobError(f"converge: modes: expected 1 or more, got {n_modes}")
    fine = job.mesh_size
    coarse = fine.model_copy(
        update={
            "size": ratio * fine.size,
            "smallest": None if fine.smallest is None else ratio * fine.smallest,
            "curvature": max(fine.curvature / ratio, 3.0) if fine.curvature else 0.0,
        }
    )
    n_dof, found = [], []
    for table in (coarse, fine):  # (1)
        reports: list[Any] = []
        body = job_body(job.model_copy(update={"mesh_size": table}), stages, on_report=reports.append)
        with stages("free modes"):
            n_dof.append(body.n_dof)
            found.append(mesh_estimate(body, n_modes))  # (2)
    n = min(len(each.frequencies) for each in found)
    frequencies = np.array([each.frequencies[:n] for each in found])
    first_order = next((each.first_order.error for each in reports if each.first_order is not None), 0.0)
    result = MeshConvergence((coarse.size, fine.size), (n_dof[0], n_dof[1]), frequencies, first_order, tuple(found))
    if result.ratio < LEAST_RATIO:
        raise JobError(
            f"converge: the sizes {coarse.size:g} and {fine.size:g} gave nearly the same mesh ({n_dof[0]} and "
            f"{n_dof[1]} dofs): small features set the size; take a smaller size, or curvature = 0"
        )
    return result
