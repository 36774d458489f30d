"""The rank context: rank 0 runs the program, and the other ranks execute the functions that it requests of all."""

import os
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.tasks.installation import differences, installation

__all__ = ["OneRank", "RankError", "Ranks", "require_agreement", "started_ranks"]

#: environment variables in which MPI launchers give the number of processes
SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS")


class RankError(ReportedError, RuntimeError):
    """The ranks of a run are not compatible with each other, or one of them failed."""


class Ranks(Protocol):
    """The processes of a run. Rank 0 runs the program; the other ranks wait in `serve` for requests.

    `store` keeps data between functions of `everywhere`, on each rank, under a key that the function chooses.
    """

    rank: int
    size: int
    store: dict[str, Any]
    unreferenced: list[str]  #: on rank 0: keys whose data nothing refers to; ranks drop them with the next request
    comm: Any  #: communicator of mpi4py, for functions that run on all ranks; None without MPI

    def everywhere(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(ranks, *arguments) on all ranks at once, from rank 0; return their results in order.

        The function must be defined at the top level of a module. An error that all ranks or only rank 0 raise is
        raised here. Any other error ends all ranks, because the remaining ranks would wait forever.
        """

    def serve(self) -> None:
        """Execute requests of rank 0 until it ends; called on the other ranks."""

    def end(self) -> None:
        """Tell the other ranks to end; called on rank 0."""


class OneRank:
    """The rank context of a single process."""

    rank, size = 0, 1
    comm = None

    def __init__(self) -> None:
        self.store: dict[str, Any] = {}
        self.unreferenced: list[str] = []

    def everywhere(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call the function here."""
        return [function(self, *arguments)]

    def serve(self) -> None:
        """Do nothing: there is no rank 0 to serve."""

    def end(self) -> None:
        """Do nothing: there are no other ranks."""


def started_ranks() -> int:
    """Return how many processes the MPI launcher started, including this one; 1 without a launcher."""
    sizes = (os.environ.get(name, "") for name in SIZES)
    return next((int(text) for text in sizes if text.isdigit()), 1)


def require_agreement(ranks: Ranks, question: Sequence[str]) -> None:
    """Raise `RankError` on every rank, unless all have the same program, libraries and input.

    Parameters
    ----------
    question
        Input of this rank, such as the digest of its job file. Call this function on all ranks at once, not by
        `everywhere`.
    """
    own = installation() | {f"input {k}": text for k, text in enumerate(question)}
    all_of_them = [own] if ranks.comm is None else ranks.comm.allgather(own)
    for rank, other in enumerate(all_of_them):
        if words := differences(all_of_them[0], other):
            raise RankError(f"rank {rank} of {ranks.size} differs from rank 0: {words}; start all with one environment")
