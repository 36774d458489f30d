"""A command that several ranks run together (mpirun): rank 0 does the work and writes, the others do what it asks."""

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


OF_RANKS = ("petsc", "petsc-disk", "slepc")  #: solvers that many ranks share


def one_job_of_ranks(jobs: Sequence[Path], workers: str | None, solver: str | None) -> None:
    """Refuse what several ranks cannot do; nothing is refused of one process."""
    n = started_ranks()
    if n == 1:
        return
    if len(jobs) > 1 or workers is not None:
        raise JobError(f"{n} ranks work on one job together; several jobs are spread by --workers, without mpirun")
    if solver not in OF_RANKS:
        named = "the default solver" if solver is None else f"solver {solver}"
        raise JobError(f"{n} ranks, but {named} works in one process; take --solver petsc, or start without mpirun")


def on_ranks(question: Callable[[], Sequence[Path | str]], work: Callable[[], None]) -> None:
    """Do the work on rank 0, once all ranks have the same program and the same question; alone: do it.

    Parameters
    ----------
    question
        Words, and files of which the content counts; called on every rank. Its error is that of rank 0, if all have it.
    work
        Called on rank 0.

    Raises
    ------
    RankError
        On rank 0, if a rank differs from it; the others end without a word.
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
    signal.signal(signal.SIGTERM, stopped)  # so that mpirun, when a rank is lost, finds nothing half written
    try:
        work()
    finally:
        ranks.end()


def stopped(*_: object) -> None:
    """End this process as Ctrl-C does: what was begun is taken back."""
    raise KeyboardInterrupt
