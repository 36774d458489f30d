"""Commands that several ranks run together (mpirun): rank 0 works and writes; the others serve its requests."""

import signal
from collections.abc import Callable, Sequence
from pathlib import Path

import typer

from cms.cli.console import USER_ERROR
from cms.errors import JobError
from fe_models.foundation.digest import file_digest
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.ranks.mpi import all_ranks
from fe_models.foundation.ranks.ranks import RankError, require_agreement, started_ranks

__all__ = ["on_ranks", "one_job_of_ranks"]


PARALLEL_SOLVERS = ("petsc", "petsc-disk", "slepc")  #: solvers that several ranks can share


def one_job_of_ranks(jobs: Sequence[Path], workers: str | None, solver: str | None) -> None:
    """Raise `JobError` if several ranks cannot process the request; a single process has no restrictions."""
    n = started_ranks()
    if n == 1:
        return
    if len(jobs) > 1 or workers is not None:
        raise JobError(f"{n} ranks work on one job together; several jobs are spread by --workers, without mpirun")
    if solver not in PARALLEL_SOLVERS:
        named = "the default solver" if solver is None else f"solver {solver}"
        raise JobError(f"{n} ranks, but {named} works in one process; take --solver petsc, or start without mpirun")


def on_ranks(question: Callable[[], Sequence[Path | str]], work: Callable[[], None]) -> None:
    """Do the work on rank 0, after a check that all ranks have the same program and input; a single rank just does it.

    Parameters
    ----------
    question
        Returns texts, and files whose content counts; called on every rank. An error on all ranks is that of rank 0.
    work
        Called on rank 0.

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
