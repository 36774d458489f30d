"""Ranks under MPI (mpi4py): rank 0 broadcasts the name of a function, all ranks call it and report the outcome."""

import os
import sys
import time
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.ranks.ranks import OneRank, RankError, Ranks, started_ranks

__all__ = ["MpiRanks", "all_ranks"]

NAP = 5e-4  #: time between checks whether all ranks have arrived [s]
FAILED = 2  #: exit code of all ranks if one of them failed


class MpiRanks:
    """The processes started by `mpirun -n N`; implements `Ranks`."""

    def __init__(self) -> None:
        if find_spec("mpi4py") is None:
            raise RankError(
                f"{started_ranks()} ranks: need mpi4py, which is not installed; benchmarks/install_petsc.sh builds it "
                "beside Debian's Open MPI, or start one process without mpirun"
            )
        self.MPI = import_module("mpi4py.MPI")
        self.comm = self.MPI.COMM_WORLD
        self.rank, self.size = self.comm.rank, self.comm.size
        self.store: dict[str, Any] = {}
        self.unreferenced: list[str] = []
        self._is_over = False

    def everywhere(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(ranks, *arguments) on all ranks at once; return their results in the order of the ranks."""
        self._wake()
        self.comm.bcast((function, arguments), root=0)
        return self._call(function, arguments)

    def serve(self) -> None:
        """Execute requests of rank 0 until it ends."""
        while True:
            self._wake()
            asked = self.comm.bcast(None, root=0)
            if asked is None:
                return
            self._call(*asked)

    def end(self) -> None:
        """Tell the other ranks to end."""
        if not self._is_over:
            self._is_over = True
            self._wake()
            self.comm.bcast(None, root=0)

    def _wake(self) -> None:
        """Wait for rank 0 while sleeping; MPI would poll, which takes processor time from the threads of rank 0."""
        waiting = self.comm.Ibarrier()
        while not waiting.Test():
            time.sleep(NAP)

    def abort(self, words: str) -> None:
        """Print the reason once, and end all ranks."""
        # print here, because the command line cannot report the error after the next call has ended this process
        sys.stderr.write(f"error: rank {self.rank} of {self.size}: {words}; all ranks end, no file is written\n")
        sys.stderr.flush()
        self.comm.Abort(FAILED)
        os._exit(FAILED)

    def _call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> list[Any]:
        """Call the function here. If only some ranks raise an error, the others would wait forever: end all ranks."""
        answer: Any = None
        error: ReportedError | None = None
        try:
            answer = function(self, *arguments)
        except ReportedError as told:  # all ranks raise it: functions agree on the errors that they report
            error = told
        except BaseException as fault:
            self.abort(f"{type(fault).__name__}: {fault}")
        answers = self.comm.gather((answer, error), root=0)
        if answers is None:
            return []
        for _, each in answers:
            if each is not None:
                raise each
        return [found for found, _ in answers]


_ranks: list[Ranks] = []


def all_ranks() -> Ranks:
    """Return the ranks of this run: those of MPI if its launcher started several processes, else a single rank."""
    if not _ranks:
        _ranks.append(MpiRanks() if started_ranks() > 1 else OneRank())
    return _ranks[0]
