"""`cms reduce`: one job becomes one modal file, or many jobs many."""

import os
import re
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cms.cli.arguments import Memory, SetValues, Solver, Workers, changes_of
from cms.cli.console import (
    USER_ERROR,
    guarded,
    output_path,
    print_error,
    print_table,
    say,
    say_written,
    size_words,
    stages,
)
from cms.cli.info import print_body
from cms.errors import JobError
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.paths import file_digest
from fe_models.foundation.ranks.mpi import all_ranks
from fe_models.foundation.ranks.ranks import RankError, require_agreement, started_ranks

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody
    from cms.jobs.job import Job
    from fe_models.checks.report import Report
    from fe_models.foundation.stages import Stages

__all__ = ["Fleet", "on_ranks", "one_job_of_ranks", "reduce_and_write", "reduce_and_write_fleet", "reduce_command"]


def reduce_and_write(job: "Job", path: Path, solver: str | None = None, memory: str | None = None) -> "ReducedBody":
    """Run a job, write its modal file, and print a summary."""
    from cms.body.modal_file.file import write
    from cms.pipeline import reduce_job

    reports: list[Report] = []
    omit: tuple[str, ...] = ()
    try:
        with stages() as clock:
            reduced = reduce_job(job, clock, solver=solver, memory=memory, on_report=reports.append)
            omit = ("units",)  # logged while the body was made
            with clock("write"):
                write(reduced, path)
    finally:  # the mesh numbers help to understand why a mesh is rejected
        for report in reports:
            print_table(report.title, ("", ""), report.rows(omit=omit))
    print_body(reduced, has_warned=True)
    print_times(clock)
    say_written(path)
    return reduced


def with_workers(job: "Job", workers: str) -> "Job":
    """Return the job with a number of workers for the elimination of substructures."""
    from fe_models.foundation.tasks.workers import checked_workers

    reduction = job.reduction.model_copy(update={"workers": checked_workers(workers)})
    return job.model_copy(update={"reduction": reduction})


def with_error(job: "Job", error: float | None, up_to: str | None) -> "Job":
    """Return the job with the fewest modes that meet an estimated error up to a frequency.

    Raises
    ------
    JobError
        If one of both is missing, the frequency cannot be read, or the mode set has no cutoff.
    """
    from cms.jobs.reduction_table import AUTO, ReductionSection
    from fe_models.foundation.toml_file import validated

    if error is None and up_to is None:
        return job
    if error is None or up_to is None:
        raise JobError("--up-to needs --error" if error is None else "--error needs --up-to")
    found = re.fullmatch(r"\s*([0-9.]+(?:[eE][+-]?[0-9]+)?)\s*(k?Hz)?\s*", up_to)
    if found is None:
        raise JobError(f"--up-to {up_to}: expected a frequency such as 500Hz or 2kHz")
    highest = float(found[1]) * (1000.0 if found[2] == "kHz" else 1.0)
    asked = {"n_modes": AUTO, "cutoff": None, "error": error, "band": [0.0, highest], "measure": "estimate"}
    tables = {**job.reduction.model_dump(exclude_unset=True), **asked}
    reduction = validated(ReductionSection, tables, Path("cms reduce --error --up-to"), JobError)
    return job.model_copy(update={"reduction": reduction})


def print_times(clock: "Stages") -> None:
    """Print the time of each stage."""
    rows = [(name, f"{seconds:.2f}") for name, seconds in clock.seconds.items()]
    print_table("Time", ("stage", "s>"), [*rows, ("all", f"{sum(clock.seconds.values()):.2f}")])


@dataclass(frozen=True)
class Fleet:
    """Several jobs, and options for running them."""

    jobs: Sequence[Path]
    output: Path | None  #: folder of the modal files, or modal file of a single job; None: next to the jobs
    workers: str | None
    journal: Path | None  #: path of the journal; None: next to the modal files
    solver: str | None = None

    def journal_path(self, outputs: Sequence[Path]) -> Path:
        """Return the default path of the journal: in the folder that contains all modal files."""
        if self.journal is not None:
            return self.journal
        return Path(os.path.commonpath([os.path.abspath(path.parent) for path in outputs])) / "reduce.journal"


def reduce_and_write_fleet(fleet: Fleet) -> None:
    """Run several jobs in workers, write their modal files, and print the result of each.

    Raises
    ------
    JobError, WorkerError
        Before any work, if a job, an output or the workers are invalid.
    typer.Exit
        If a job failed.
    """
    from cms.errors import JobError
    from cms.fleet import reduce_fleet

    made = [job.with_suffix(".h5") for job in fleet.jobs]
    if fleet.output is not None and fleet.output.is_dir():
        made = [fleet.output / path.name for path in made]
    elif fleet.output is not None:
        if len(fleet.jobs) > 1:
            raise JobError(f"--output {fleet.output}: expected a folder that is there, for the files of several jobs")
        made = [fleet.output]
    outputs = [output_path(path, None, JobError, needs_file=True) for path in made]
    journal = output_path(fleet.journal_path(outputs), None, JobError, overwrite_of=fleet.jobs, needs_file=True)
    with stages(remaining=True) as clock, clock(f"{len(fleet.jobs)} jobs") as advance:
        rows = reduce_fleet(
            fleet.jobs, outputs, workers=fleet.workers, journal=journal, solver=fleet.solver,
            progress=lambda done, all_: advance(done / all_),
        )  # fmt: skip
    for job, output, row in zip(fleet.jobs, outputs, rows, strict=True):
        for note in row.notes:
            typer.echo(f"note: {job}: {note}", err=True)
        if not row.error:
            size = size_words(output.stat().st_size)
            before = "done before" if row.is_known else f"{row.seconds:.2f} s"
            say(f"{'kept' if row.is_known else 'wrote'} {output} ({size}, {row.n_modes} modes, {before})")
    failed = [(job, row.error) for job, row in zip(fleet.jobs, rows, strict=True) if row.error]
    n_known = sum(row.is_known for row in rows)
    say(f"{len(rows)} jobs: {len(rows) - n_known - len(failed)} done, {n_known} done before, {len(failed)} failed")
    for job, error in failed:
        print_error(f"{job}: {error}")
    if failed:
        raise typer.Exit(USER_ERROR)


@guarded
def reduce_command(
    jobs: Annotated[list[Path], typer.Argument(help="Job files (TOML), see docs/job_file.md.", metavar="JOB...")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Modal file to write; with several jobs: their folder.")
    ] = None,
    journal: Annotated[
        Path | None,
        typer.Option("--journal", help="With several jobs: file of the finished ones; default: beside the files."),
    ] = None,
    workers: Workers = None,
    solver: Solver = None,
    memory: Memory = None,
    error: Annotated[
        float | None,
        typer.Option("--error", help="With --up-to: the fewest modes with this estimated error of the frequencies."),
    ] = None,
    up_to: Annotated[
        str | None, typer.Option("--up-to", help="Highest frequency of interest, such as 500Hz or 2kHz.")
    ] = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Reduce finite element bodies to modal files.

    Without -o the modal file is written beside the job file: rod.toml gives rod.h5. With several jobs or --workers,
    each job is a task; finished jobs are recorded in a journal (reduce.journal), and the same command continues from
    there. For one job with the mode set multilevel, its substructures are the tasks.

    Example: cms reduce rod.toml -o rod.h5

    Example: cms reduce rod.toml --set length=0.4 -o rod400.h5

    Example: cms reduce rod.toml --error 1e-3 --up-to 500Hz

    Example: cms reduce jobs/*.toml --workers 4

    Example: mpirun -n 4 cms reduce rod.toml --solver petsc
    """
    from cms.errors import JobError
    from cms.fleet import inputs_of
    from cms.jobs.job import read_job
    from fe_models.foundation.ranks.ranks import started_ranks

    if started_ranks() > 1:

        def question() -> list[Path | str]:
            asked = read_job(jobs[0], changes_of(set_values))
            chosen = solver or asked.reduction.solver
            one_job_of_ranks(jobs, workers, chosen)
            return [f"solver {chosen}", *inputs_of(jobs[0], asked)]

        def work() -> None:
            asked = read_job(jobs[0], changes_of(set_values))
            made = output_path(output, jobs[0].with_suffix(".h5"), JobError, overwrite_of=inputs_of(jobs[0], asked))
            reduce_and_write(asked, made, solver, memory)

        on_ranks(question, work)
        return
    job = jobs[0]
    read = read_job(job, changes_of(set_values)) if len(jobs) == 1 else None
    if read is not None and read.reduction.set == "multilevel" and workers is not None and journal is None:
        read, workers = with_workers(read, workers), None
    if memory is not None and (read is None or workers is not None):
        raise JobError('--memory: belongs to one job; several have memory = "8GB" in their tables [reduction]')
    if (error is not None or up_to is not None) and (read is None or workers is not None):
        raise JobError("--error, --up-to: belong to one job without --workers")
    if read is not None:
        read = with_error(read, error, up_to)
    if set_values and (read is None or workers is not None):
        raise JobError("--set: belongs to one job without --workers")
    if read is None or workers is not None:
        reduce_and_write_fleet(Fleet(jobs, output, workers, journal, solver))
        return
    inputs = inputs_of(job, read)
    path = output_path(output, job.with_suffix(".h5"), JobError, overwrite_of=inputs)
    reduce_and_write(read, path, solver, memory)


# commands that several ranks run together (mpirun): rank 0 works and writes; the others serve its requests ------------


PARALLEL_SOLVERS = ("petsc", "petsc-disk", "slepc")  #: solvers that several ranks can share


def one_job_of_ranks(jobs: Sequence[Path], workers: str | None, solver: str | None) -> None:
    """Raise `JobError` if several ranks cannot process this request; one process can process any."""
    n = started_ranks()
    if n == 1:
        return
    if len(jobs) > 1 or workers is not None:
        raise JobError(f"{n} ranks work on one job together; several jobs are spread by --workers, without mpirun")
    if solver not in PARALLEL_SOLVERS:
        named = "the default solver" if solver is None else f"solver {solver}"
        raise JobError(f"{n} ranks, but {named} works in one process; take --solver petsc, or start without mpirun")


def on_ranks(question: Callable[[], Sequence[Path | str]], work: Callable[[], None]) -> None:
    """Do the work on rank 0 after a check that all ranks have the same program and input.

    Parameters
    ----------
    question
        Function that every rank calls. It returns texts and paths of files, whose content is compared. An error that
        is the same on all ranks is raised on rank 0.
    work
        Function that only rank 0 calls.

    Raises
    ------
    RankError
        On rank 0, if a rank differs from it; the others end silently.
    """
    if started_ranks() == 1:
        work()
        return
    ranks = all_ranks()
    refusal: ReportedError | None = None
    try:
        asked = [file_digest(each) if isinstance(each, Path) else each for each in question()]
    except ReportedError as error:
        asked, refusal = [f"refused: {error}"], error
    try:
        require_agreement(ranks, asked)
        if refusal is not None:
            raise refusal
    except (RankError, ReportedError):
        if ranks.rank:
            raise typer.Exit(USER_ERROR) from None
        raise
    if ranks.rank:
        ranks.serve()
        return
    signal.signal(signal.SIGTERM, stopped)  # so that mpirun leaves no half-written file if it stops the ranks
    try:
        work()
    finally:
        ranks.end()


def stopped(*_: object) -> None:
    """End this process as Ctrl-C does, so that unfinished output is removed."""
    raise KeyboardInterrupt
