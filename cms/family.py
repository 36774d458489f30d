"""A parametric body from a job: the job is reduced at every point of a grid of its parameters."""

import os
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

from cms.errors import JobError
from cms.jobs.job import Job, read_job
from cms.pipeline import reduce_job
from cms.reduction.parametric.parametric_body import (
    ParametricBody,
    fault_of_values,
    middle_point,
    parametric_body,
    point_name,
)
from fe_models.foundation.solver import Solver
from fe_models.foundation.stages import Stages

__all__ = ["job_at", "reduce_family"]

FEWEST_BEYOND = 4  #: modes beyond the cutoff of a sample, or the number of its modes if that is more
BEYOND_CUTOFF = 12  #: modes beyond a cutoff frequency


def reduce_family(
    path: Path | str,
    over: Mapping[str, Sequence[float]],
    *,
    solver: str | Solver | None = None,
    stages: Stages | None = None,
) -> ParametricBody:
    """Reduce a job at every combination of values of its parameters, and estimate the error of interpolation.

    A job with a parameter of two values only is reduced once more, in the middle, for the estimate. Samples also have
    modes beyond the cutoff of the mode set (`beyond` in the table [reduction], by default as many as `n_modes`), and no
    error estimates, which interpolated bodies do not have, unless the job requests them.

    Parameters
    ----------
    path
        Job file.
    over
        Ascending values of one to three parameters of the job, or of numbers by key path.
    solver
        As in `cms.reduce_job`.
    stages
        Receives the time of each reduction.

    Raises
    ------
    JobError
        If the job has no such parameter, or the values do not ascend.
    BodyError
        If the samples have different modes, interfaces or meshes, or their modes cannot be aligned.

    Examples
    --------
    >>> family = cms.reduction.reduce_family("rod.toml", {"length": [1.0, 1.2]})          # doctest: +SKIP
    >>> cms.write(family.at(length=1.1), "rod_1100.h5")                                   # doctest: +SKIP
    """
    path, stages = Path(path), stages or Stages()
    if fault := fault_of_values(over):
        raise JobError(f"{path}: {fault}")
    grid = [dict(zip(over, point, strict=True)) for point in product(*over.values())]
    points = grid + ([middle_point(over)] if any(len(values) == 2 for values in over.values()) else [])
    jobs = [job_at(path, point) for point in points]  # wrong names and values are refused before the first reduction
    samples = []
    for point, job in zip(points, jobs, strict=True):
        with stages(point_name(point)):
            samples.append(reduce_job(job, solver=solver))
    with stages("align and judge"):
        return parametric_body(over, samples[: len(grid)], middle=samples[-1] if len(points) > len(grid) else None)


def job_at(path: str | os.PathLike[str], point: Mapping[str, float]) -> Job:
    """Return the job of a sample: with these values of its parameters, and modes beyond the cutoff."""
    job = read_job(path, {name: int(x) if float(x).is_integer() else float(x) for name, x in point.items()})
    reduction = job.reduction
    if reduction.beyond is None:
        n = reduction.n_modes
        n_beyond = max(FEWEST_BEYOND, n) if isinstance(n, int) else BEYOND_CUTOFF
        reduction = reduction.model_copy(update={"beyond": n_beyond})
    if reduction.error_estimates is None:  # interpolated bodies have none
        reduction = reduction.model_copy(update={"error_estimates": False})
    return job.model_copy(update={"reduction": reduction})
