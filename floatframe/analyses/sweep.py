"""Parameter sweeps: evaluation of one function at many values, in parallel processes or on a cluster."""

from collections.abc import Callable, Iterable
from typing import TypeVar

from fe_models.foundation.tasks.workers import Workers, tasks_of

__all__ = ["sweep"]

Value = TypeVar("Value")
Result = TypeVar("Result")


def sweep(
    study: Callable[[Value], Result],
    values: Iterable[Value],
    *,
    workers: Workers = None,
    failed: Callable[[Value, Exception], Result] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Result]:
    """Return study(value) for every value, in the order of the values.

    Parameters
    ----------
    study
        A function at the top level of a module, because it is sent to other processes by name. For example, it builds a
        system for a value, integrates it and returns the results of interest.
    values
        Arguments of `study`.
    workers
        Number of parallel processes, by default one per processor, or "dask" or "dask://host:port" for a cluster
        (docs/cluster.md). With 1, `study` runs in this process, and may be any callable. Each process has one thread,
        so that results do not depend on the number of workers.
    failed
        Returns the result for a value whose call failed, from the value and the error. The other values are then
        computed even if a process is killed. None: the first error is raised.
    progress
        Called with the number of completed values and the number of all values.

    Raises
    ------
    Exception
        Without `failed`: the error of `study` for the first value that failed, in the order of the values.
    ProcessError
        If `study` cannot be sent to other processes.
    WorkerError
        If no workers are available.
    """
    values = list(values)
    if not values:
        return []
    with tasks_of(workers, len(values)) as tasks:
        return tasks.map(study, values, failed=failed, progress=progress)
