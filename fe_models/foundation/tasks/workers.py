"""The user's choice of where tasks are computed: a number of processes, dask, dask:4, dask://host:port."""

import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Self

from fe_models.foundation.tasks.processes import WorkerPool
from fe_models.foundation.tasks.task_map import Done, Failed, Progress, TaskMap, WorkerError
from fe_models.foundation.threads import bounded_threads, n_processors, n_threads
from fe_models.foundation.words import quoted

__all__ = ["WORKERS_HELP", "ThisProcess", "Workers", "checked_workers", "tasks_of"]


# the task map without other processes: one value after the other ------------------------------------------------------


class ThisProcess:
    """A `TaskMap` in this process; the function may be any callable.

    Parameters
    ----------
    threads
        Number of threads that a value may use; None: no limit set by the map.
    """

    def __init__(self, threads: int | None = 1) -> None:
        self.threads = threads

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """Do nothing, because no process was started."""

    def map(
        self,
        function: Callable[[Any], Any],
        values: Sequence[Any],
        *,
        failed: Failed | None = None,
        progress: Progress | None = None,
        done: Done | None = None,
        files: Sequence[str] = (),
    ) -> list[Any]:
        """Return function(value) for every value, as `TaskMap.map` does."""
        results: list[Any] = []
        with bounded_threads(self.threads):
            for k, value in enumerate(values):
                try:
                    results.append(function(value))
                except WorkerError:
                    raise
                except Exception as error:
                    if failed is None:
                        raise
                    results.append(failed(value, error))
                if done is not None:
                    done(k, results[-1])
                if progress is not None:
                    progress(len(results), len(values))
        return results


# workers --------------------------------------------------------------------------------------------------------------


Workers = int | str | TaskMap | None  #: choice of workers; None: one process per processor

WORKERS_HELP = "a number of processes, dask (a local cluster; dask:4 of 4 workers), or dask://host:port of a scheduler"
PORT = 8786  #: default port of a scheduler
ADDRESS = re.compile(r"dask://(?P<host>\[[0-9a-fA-F:.]+\]|[\w.-]+)(?::(?P<port>\d{1,5}))?/?")


def checked_workers(text: int | str) -> int | str:
    """Return the user's text as a number of processes, or unchanged if it names Dask.

    Raises
    ------
    WorkerError
        If the text is neither.
    """
    word = str(text).strip()
    if re.fullmatch(r"[1-9]\d{0,3}", word):
        return int(word)
    if word == "dask" or re.fullmatch(r"dask:[1-9]\d{0,3}", word) or ADDRESS.fullmatch(word):
        return word
    hint = ""
    if "dask" in word or "://" in word or re.fullmatch(r"[\w.-]+:\d+", word):
        hint = f"; did you mean dask://{word.rpartition('//')[2]}?" if re.search(r":\d+$", word) else ""
    raise WorkerError(f"workers = {quoted(text)}: expected {WORKERS_HELP}{hint}")


def tasks_of(
    workers: Workers, n_values: int | None = None, *, threads: int | None = 1
) -> AbstractContextManager[TaskMap]:
    """Return the chosen task map; a map that is passed in is not ended by this context.

    Parameters
    ----------
    workers
        A value that `checked_workers` accepts, a task map, or None for one process per processor.
    n_values
        Largest number of values; no more workers than that are started.
    threads
        Number of threads that a task may use; None: an equal share of the processors. Workers of a running cluster keep
        the number that the cluster gave them.

    Raises
    ------
    WorkerError
        If the text is not understood, or the cluster cannot be reached or started.
    """
    if workers is not None and not isinstance(workers, int | str):
        return nullcontext(workers)
    asked = n_processors() if workers is None else checked_workers(workers)
    if isinstance(asked, int):
        n = min(asked, n_values or asked)
        each = max(1, n_threads() // n) if threads is None else threads
        return ThisProcess(each if n_values != 1 or threads is not None else None) if n == 1 else WorkerPool(n, each)
    from fe_models.foundation.tasks.dask_tasks import dask_at, dask_here

    found = ADDRESS.fullmatch(asked)
    if found:
        return dask_at(found["host"], int(found["port"] or PORT))
    n = int(asked.partition(":")[2] or n_processors())
    n = min(n, n_values or n)
    return dask_here(n, max(1, n_threads() // n) if threads is None else threads)
