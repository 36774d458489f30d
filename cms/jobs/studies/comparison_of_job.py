"""Mode sets of a job compared with its full model, as `cms compare` does."""

import zipfile
from collections.abc import Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.compare.compare import check_request, compare_sets
from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.mode_counts import mode_counts
from cms.assessment.quality.reference.transient import Snapshots
from cms.errors import CmsError, CompareError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import Job, read_job
from cms.jobs.mode_set_of_job import set_options
from cms.jobs.reduction_table import mode_set_options
from cms.modes.families.interface_loads import InterfaceLoad
from fe_models.body.fe_body import FEBody
from fe_models.foundation.stages import Stages
from fe_models.foundation.tasks.workers import Workers

__all__ = ["COUNTS", "SETS", "compare"]

SETS = ("guyan", "craig-bampton", "craig-bampton-ir", "rubin")  #: mode sets compared by default
COUNTS = "0:20"  #: numbers of vibration modes by default


def compare(
    job: Job | Path | str,
    sets: Sequence[str] = SETS,
    counts: Sequence[int] | str = COUNTS,
    *,
    band: float | None = None,
    n_reference: int = 10,
    loads: Sequence[InterfaceLoad] = (),
    pulse_at: str | None = None,
    motion: Snapshots | Path | str | None = None,
    cache: Path | None = None,
    workers: Workers = None,
    stages: Stages | None = None,
    on_report: Any = None,
) -> Comparison:
    """Compare mode sets of a job with its full model.

    Parameters
    ----------
    job
        A job file, or a job that has been read.
    sets
        Names in `MODE_SETS`. The set of the job has the options of the job, the others have their default options.
    counts
        Numbers of vibration modes: a sequence, or text such as "0:20", "0:30:5" or "0,2,5".
    band
        Highest frequency of the comparison [Hz]; None: that of elastic free mode `n_reference`.
    n_reference
        Number of elastic free modes to compare without a band.
    loads
        Neighbours at interfaces, for sets that take loads.
    pulse_at
        Interface at which the force pulse of the motion acts; None: the first.
    motion
        Reference motion instead of the pulse: snapshots, or an .npz file with u, (n_dof, n_t), over the dofs of the
        coupled body, and t, (n_t,) [s].
    cache
        File that keeps the solution of the full model for the next comparison; None: nothing is kept.
    workers
        Where sets and numbers of modes are judged (docs/cluster.md); they need a job file and a cache. None: here.
    stages
        Called with the name of each stage.
    on_report
        Called with each report on the mesh.

    Raises
    ------
    CompareError
        If the requested comparison is impossible.
    JobError
        If the job is invalid.
    """
    path = None if isinstance(job, Job) else Path(job).absolute()
    asked = job if isinstance(job, Job) else read_job(job)
    numbers = mode_counts(counts) if isinstance(counts, str) else tuple(counts)
    check_request({name: {} for name in sets}, numbers)
    body = job_body(asked, stages, on_report=on_report)
    return compare_sets(
        body,
        options_of_sets(asked, body, sets, loads),
        numbers,
        band=band,
        n_reference=n_reference,
        pulse_at=pulse_at,
        motion=read_motion(Path(motion), body) if isinstance(motion, str | Path) else motion,
        cache=cache,
        stage=stages,
        workers=workers,
        source=None if path is None else partial(body_of_file, path),
    )


def body_of_file(path: Path) -> FEBody:
    """Return the coupled body of a job file; workers call this function."""
    return job_body(read_job(path))


def options_of_sets(
    job: Job, body: FEBody, names: Sequence[str], loads: Sequence[InterfaceLoad]
) -> Mapping[str, dict[str, Any]]:
    """Return the options of each set: those of the job for its own set, and loads for sets that need them."""
    options: dict[str, dict[str, Any]] = {}
    for name in names:
        section = job.reduction.model_copy(update={"set": name, "n_modes": None, "cutoff": None, "verify": None})
        given = set_options(body, section)
        if name != job.reduction.set:
            given = {key: value for key, value in given.items() if key == "loads"}
        if loads and "loads" in mode_set_options(name):
            given["loads"] = list(loads)
        options[name] = given
    return options


def read_motion(path: Path, body: FEBody) -> Snapshots:
    """Read a reference motion from .npz: u, (n_dof, n_t), over the dofs of the coupled body, and t, (n_t,) [s].

    Raises
    ------
    CompareError
        If the file does not have this form.
    """
    try:
        with np.load(BytesIO(path.read_bytes()), allow_pickle=False) as file:
            u, t = np.asarray(file["u"], dtype=float), np.asarray(file["t"], dtype=float)
    except (ValueError, KeyError, zipfile.BadZipFile, EOFError) as error:
        raise CompareError(
            f"{path}: expected an .npz file with u, ({body.n_dof}, n_t), and t, (n_t,) [s]; {error}"
        ) from error
    if u.ndim != 2 or u.shape != (body.n_dof, len(t)) or t.ndim != 1 or not len(t):
        raise CompareError(
            f"{path}: u has shape {u.shape}, t {t.shape}; expected ({body.n_dof}, n_t) over the dofs of the coupled "
            "body, and (n_t,)"
        )
    if not (np.isfinite(u).all() and np.isfinite(t).all()):
        raise CompareError(f"{path}: u and t: expected finite numbers")
    try:
        return Snapshots.of_displacements(u, t / body.units.time)
    except CmsError as error:
        raise CompareError(f"{path}: {error}") from error
