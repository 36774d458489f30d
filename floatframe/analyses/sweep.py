"""Parameter sweeps: one function at many values, in parallel processes."""

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

__all__ = ["sweep"]

Value = TypeVar("Value")
Result = TypeVar("Result")


def sweep(
    study: Callable[[Value], Result],
    values: Iterable[Value],
    *,
    processes: int | None = None,
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
    progress
        Called with the numbers of values done and of all values.

    Raises
    ------
    Exception
        What `study` raised, for the first value in order that did.
    """
    values = list(values)
    n = min(len(values), processes or os.cpu_count() or 1)
    results: list[Result] = []
    if n <= 1:
        for value in values:
            results.append(study(value))
            _tell(progress, len(results), values)
        return results
    with ProcessPoolExecutor(n, mp_context=get_context("spawn")) as pool:
        for result in pool.map(study, values):
            results.append(result)
            _tell(progress, len(results), values)
    return results


def _tell(progress: Callable[[int, int], None] | None, done: int, values: Sequence[object]) -> None:
    if progress is not None:
        progress(done, len(values))
