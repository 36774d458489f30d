"""`cms reduce`: a job becomes a modal file."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import Output
from cms.cli.console import guarded, output_path, print_table, say, stages
from cms.cli.info import print_body

if TYPE_CHECKING:
    from cms.jobs.job import Job
    from cms.reduced_body.reduced_body import ReducedBody
    from fe_models.foundation.stages import Stages

__all__ = ["reduce_and_write", "reduce_command"]


def reduce_and_write(job: "Job", path: Path) -> "ReducedBody":
    """Run a job, write its modal file, and print what was done."""
    from cms.jobs.reduce_job import reduce_job
    from cms.modal_file.file import write

    reports: list[Any] = []
    try:
        with stages() as clock:
            reduced = reduce_job(job, clock, on_report=reports.append)
            with clock("write"):
                write(reduced, path)
    finally:  # a mesh that is refused is better understood with its numbers
        for report in reports:
            print_table(report.title, ("", ""), report.rows())
    print_body(reduced)
    print_times(clock)
    say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
    return reduced


def print_times(clock: "Stages") -> None:
    """Print the time of each stage."""
    rows = [(name, f"{seconds:.2f}") for name, seconds in clock.seconds.items()]
    print_table("Time", ("stage", "s>"), [*rows, ("all", f"{sum(clock.seconds.values()):.2f}")])


def inputs_of(path: Path, job: "Job") -> "list[Path]":
    """Return the job file and all files it names: meshes, tables, matrices, columns, and those of neighbours' jobs."""
    from cms.jobs.job import read_job
    from fe_models.foundation.toml_file import files_named

    found = [path]
    for each in files_named(job):
        found += inputs_of(each, read_job(each)) if each.suffix == ".toml" and each not in found else [each]
    return found


@guarded
def reduce_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML), see docs/job_file.md.")],
    output: Output = None,
) -> None:
    """Reduce a finite element body to a modal file.

    Without -o the modal file stands beside the job file: rod.toml gives rod.h5.

    Example: cms reduce rod.toml -o rod.h5
    """
    from cms.errors import JobError
    from cms.jobs.job import read_job

    read = read_job(job)
    inputs = inputs_of(job, read)
    path = output_path(output, job.with_suffix(".h5"), JobError, overwrite_of=inputs)
    reduce_and_write(read, path)
