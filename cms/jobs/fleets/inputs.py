"""The files that a job depends on."""

from pathlib import Path

from cms.jobs.job import Job, read_job
from fe_models.foundation.toml_file import files_named

__all__ = ["inputs_of"]


def inputs_of(path: Path, job: Job) -> list[Path]:
    """Return the job file and all files that it names: meshes, tables, matrices, columns, and neighbours' files."""
    found = [path]
    for each in files_named(job):
        found += inputs_of(each, read_job(each)) if each.suffix == ".toml" and each not in found else [each]
    return found
