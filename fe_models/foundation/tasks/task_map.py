"""Protocol of a task map: function(value) for many values, computed in this process, other processes or a cluster.

`tasks_of` in `fe_models.foundation.tasks.workers` makes one from the user's choice: a number, dask, dask://host:port.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol, Self

from fe_models.foundation.errors import ReportedError

__all__ = ["Done", "Failed", "ProcessError", "Progress", "TaskMap", "WorkerError"]

Failed = Callable[[Any, Exception], Any]
Progress = Callable[[int, int], None]
Done = Callable[[int, Any], None]


class ProcessError(ReportedError, RuntimeError):
    """Every process that received this value ended without an answer, or value or answer cannot be sent."""


class WorkerError(ReportedError, RuntimeError):
    """No worker is usable: there are none, or they have another version of the project; this ends the whole map."""


class TaskMap(Protocol):
    """Computes a function at many values; serves several calls, and ends its workers when the context is left."""

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
        """Return function(value) for every value, in the order of the values.

        Parameters
        ----------
        function
            Function at the top level of a module, because it is sent to other processes by name.
        values
            Arguments of the calls.
        failed
            Function that returns a replacement for a value whose call failed; None: the first error, in order of the
            values, is raised.
        progress
            Callback that receives the number of finished values and of all values.
        done
            Callback that receives the index of a value and its result as soon as it is known, in any order.
        files
            Absolute paths of the files that the function reads or writes; every worker must see them.

        Raises
        ------
        WorkerError
            If workers are not available, have another version of the project, or do not see the files.
        ProcessError
            If the function cannot be sent.
        Exception
            The error of the function, if `failed` is not given.
        """

    def end(self) -> None:
        """End all workers that this map started; a later `map` starts new ones."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...
