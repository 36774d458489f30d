"""The task map without other processes: one value after the other."""

from collections.abc import Callable, Sequence
from typing import Any, Self

from fe_models.foundation.tasks.task_map import Done, Failed, Progress, WorkerError
from fe_models.foundation.threads import bounded_threads

__all__ = ["ThisProcess"]


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
