"""Parameter sweeps: one function at many values, in parallel processes or on a cluster."""

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
        A function at the top level of a module (it is sent to other processes by name), such as one that builds a
        system for a value, integrates it and returns the numbers of interest.
    values
        What to call it with.
    workers
        Where (docs/cluster.md): how many processes at once, by default one per processor; 1: in this process, where
        `study` may be any callable; "dask", or "dask://host:port". Each has one thread, so that results are the same.
    failed
        What stands in the place of a value whose call failed, made from the value and the error; then no value can
        lose the others, not even one whose process is killed. None: the first error is raised.
    progress
        Called with the numbers of values done and of all values.

    Raises
    ------
    Exception
        Without `failed`: what `study` raised, for the first value in order that did.
    ProcessError
        If `study` cannot be sent to other processes.
    WorkerError
        If no workers can be had.
    """
    values = list(values)
    if not values:
        return []
    with tasks_of(workers, len(values)) as tasks:
        return tasks.map(study, values, failed=failed, progress=progress)
