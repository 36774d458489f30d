"""What a rank context is: one program on rank 0, and others beside it that do what it asks of all of them at once."""

import os
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.tasks.installation import differences, installation

__all__ = ["OneRank", "RankError", "Ranks", "require_agreement", "started_ranks"]

#: variables by which the launchers of MPI say how many processes they started
SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS")


class RankError(ReportedError, RuntimeError):
    """The ranks of a run do not do for one another, or one of them failed."""


class Ranks(Protocol):
    """The processes of a run. Rank 0 runs the program; the others wait in `serve` for what it asks of all.

    `store` keeps what a function of `everywhere` leaves on a rank for the next one, by a key of its own.
    """

    rank: int
    size: int
    store: dict[str, Any]
    comm: Any  #: of mpi4py, for functions that run everywhere; None where there is no MPI

    def everywhere(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(ranks, *arguments) on all ranks at once, from rank 0; return their answers in order.

        The function stands at the top level of a module. An error of rank 0 alone, or the same of all, is raised; any
        other ends all ranks, because those left would wait for ever.
        """

    def serve(self) -> None:
        """Do what rank 0 asks for until it has ended; on the other ranks."""

    def end(self) -> None:
        """Let the other ranks end; from rank 0."""


class OneRank:
    """The rank context of a process that is alone."""

    rank, size = 0, 1
    comm = None

    def __init__(self) -> None:
        self.store: dict[str, Any] = {}

    def everywhere(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call the function here."""
        return [function(self, *arguments)]

    def serve(self) -> None:
        """Nobody asks."""

    def end(self) -> None:
        """Nobody waits."""


def started_ranks() -> int:
    """Return how many processes the launcher of MPI started this one among; 1 without a launcher."""
    sizes = (os.environ.get(name, "") for name in SIZES)
    return next((int(text) for text in sizes if text.isdigit()), 1)


def require_agreement(ranks: Ranks, question: Sequence[str]) -> None:
    """Raise `RankError`, on every rank, unless all have the same program, libraries and question.

    Parameters
    ----------
    question
        What this rank was asked, such as the digest of its job file; called on all ranks at once, not by `everywhere`.
    """
    own = installation() | {f"input {k}": text for k, text in enumerate(question)}
    all_of_them = [own] if ranks.comm is None else ranks.comm.allgather(own)
    for rank, other in enumerate(all_of_them):
        if words := differences(all_of_them[0], other):
            raise RankError(f"rank {rank} of {ranks.size} differs from rank 0: {words}; start all with one environment")
