"""A fleet of jobs: workers reduce each job to its own modal file."""

import hashlib
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cms.errors import JobError
from cms.jobs.job import Job, read_job
from cms.linear_algebra.solvers.registry import solver_of
from fe_models.foundation.parametric_file import extended_files
from fe_models.foundation.paths import file_digest, file_identity, remove_parts
from fe_models.foundation.presentation import presented
from fe_models.foundation.tasks.campaign import Campaign, open_task_journal
from fe_models.foundation.tasks.installation import source_mark
from fe_models.foundation.tasks.notes import recorded_notes
from fe_models.foundation.tasks.workers import Workers
from fe_models.foundation.toml_file import files_named

__all__ = ["FleetJob", "FleetRow", "inputs_of", "reduce_fleet"]


# one job of a fleet: the request to a worker, its work, and its answer ------------------------------------------------


@dataclass(frozen=True)
class FleetJob:
    """Job of a fleet: full paths of the job and its modal file, and a fingerprint of all files that it depends on."""

    job: Path
    output: Path
    digest: str
    solver: str | None = None  #: solver that replaces the solver of the job; None: that of the job


@presented
@dataclass(frozen=True)
class FleetRow:
    """Result of one job of a fleet."""

    job: FleetJob
    name: str = ""  #: name of the body
    n_modes: int = 0
    seconds: float = 0.0
    notes: tuple[str, ...] = ()  #: warnings during this job
    error: str = ""  #: reason if there is no modal file; empty: success
    is_lasting: bool = True  #: whether another attempt would fail with the same error
    is_known: bool = False  #: whether the row was read from the journal


class FleetTask:
    """Task of a worker: reduce a job to its modal file."""

    def __call__(self, job: FleetJob) -> FleetRow:
        """Run a job and write its modal file."""
        from cms.body.modal_file.file import write
        from cms.pipeline import reduce_job

        began = time.perf_counter()
        with recorded_notes() as notes:
            reduced = reduce_job(job.job, solver=job.solver)
            write(reduced, job.output)
        return FleetRow(job, reduced.name, reduced.n_q, time.perf_counter() - began, tuple(notes))

    def failed(self, job: FleetJob, words: str, is_lasting: bool) -> FleetRow:
        """Return the row of a failed job."""
        return FleetRow(job, error=words, is_lasting=is_lasting)

    def key(self, job: FleetJob) -> tuple[str, str, str]:
        """Return the files of a job as key in the journal, and the digest of the input."""
        return str(job.job), str(job.output), job.digest

    def record(self, row: FleetRow) -> dict[str, Any] | None:
        """Return the journal entry of a finished row, with the digest of its modal file; failed jobs are run again."""
        made = {"made": file_digest(row.job.output), "name": row.name, "n_modes": row.n_modes, "seconds": row.seconds}
        return None if row.error else {**made, "notes": row.notes}

    def row(self, job: FleetJob, record: dict[str, Any]) -> FleetRow:
        """Return the row of a journal entry if its modal file is unchanged."""
        if record["made"] != file_digest(job.output):
            raise ValueError("another modal file")
        notes = tuple(str(note) for note in record["notes"])
        numbers = int(record["n_modes"]), float(record["seconds"])
        return FleetRow(job, str(record["name"]), *numbers, notes, is_known=True)


# fleet ----------------------------------------------------------------------------------------------------------------


KIND = "cms reduce journal 2"


def reduce_fleet(
    jobs: Sequence[str | os.PathLike[str]],
    outputs: Sequence[str | os.PathLike[str]] | None = None,
    *,
    workers: Workers = None,
    journal: str | os.PathLike[str] | None = None,
    solver: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[FleetRow]:
    """Reduce many jobs, each to a modal file. A failed job gives a row with its error, and the others continue.

    Parameters
    ----------
    jobs
        Job files.
    outputs
        Modal file of each job; default: beside the job, rod.toml gives rod.h5.
    workers
        Where jobs are run (docs/cluster.md); default: one process per processor. Processes of this machine share its
        processors evenly.
    journal
        A file to which every finished job is appended. A finished job is not run again as long as its input files, the
        program and its modal file are unchanged. None: no journal.
    solver
        Name of the solver (`cms.linear_algebra.solvers.registry`); it overrides the solver of the jobs.
    progress
        Receives the number of finished jobs and the number of all jobs.

    Raises
    ------
    JobError
        Before any work, if a job file cannot be read, or an output is also an input or the output of another job.
    FactorizationError
        If the solver is unknown or not installed.
    WorkerError
        If no workers are available.
    """
    if solver is not None:
        solver_of(solver)
    paths = [Path(path) for path in jobs]
    made = [path.with_suffix(".h5") for path in paths] if outputs is None else [Path(path) for path in outputs]
    fleet = fleet_of(paths, made, solver)
    kept = None if journal is None else open_task_journal(Path(journal), KIND, source_mark(), "this call", JobError)
    campaign = Campaign(FleetTask(), kept)
    files = sorted({str(path) for job in fleet for path in (job.job, job.output.parent)})
    try:
        return campaign.rows(fleet, workers, threads=None, progress=progress, files=files)
    finally:  # a worker that was killed while writing could not clean up
        for job in fleet:
            remove_parts(job.output)


def fleet_of(jobs: Sequence[Path], outputs: Sequence[Path], solver: str | None = None) -> list[FleetJob]:
    """Return the checked jobs of a fleet; raise `JobError` if two jobs have the same file."""
    inputs = [inputs_of(path, read_job(path)) for path in jobs]
    # several jobs may use the same mesh
    digests = {each: file_digest(each) for each in {each for files in inputs for each in files}}
    read = {file_identity(each) for each in digests}
    made: dict[object, Path] = {}
    found = []
    for path, output, files in zip(jobs, outputs, inputs, strict=True):
        where = file_identity(output)
        if where in read:
            raise JobError(f"{path}: {output} is an input of a job; choose another folder or name")
        if where in made:
            raise JobError(f"{path} and {made[where]} would both be written to {output}; rename one")
        made[where] = path
        mark = hashlib.sha256(" ".join([*(digests[each] for each in files), solver or ""]).strip().encode()).hexdigest()
        found.append(FleetJob(Path(os.path.abspath(path)), Path(os.path.abspath(output)), mark, solver))
    return found


def inputs_of(path: Path, job: Job) -> list[Path]:
    """Return the job file and all files that it refers to: base files, meshes, tables, matrices, neighbours."""
    found = [path, *extended_files(path, JobError)]
    for each in files_named(job):
        found += inputs_of(each, read_job(each)) if each.suffix == ".toml" and each not in found else [each]
    return found
