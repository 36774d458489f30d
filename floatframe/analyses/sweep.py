"""Parameter sweeps: one function at many values, in parallel processes."""

import os
from collections.abc import Callable, Iterable
from typing import TypeVar

from fe_models.foundation.processes import map_in_processes

__all__ = ["sweep"]

Value = TypeVar("Value")
Result = TypeVar("Result")


def sweep(
    study: Callable[[Value], Result],
    values: Iterable[Value],
    *,
    processes: int | None = None,
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
    processes
        How many at once; by default one per processor. 1: in this process, where `study` may be any callable.
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
        If `study` cannot be sent to other processes, or none can be started.
    """
    values = list(values)
    n = min(len(values), processes or os.cpu_count() or 1)
    if n > 1:
        return map_in_processes(study, values, n, failed=failed, progress=progress)
    results: list[Result] = []
    for value in values:
        try:
            results.append(study(value))
        except Exception as error:
            if failed is None:
                raise
            results.append(failed(value, error))
        if progress is not None:
            progress(len(results), len(values))
    return results
