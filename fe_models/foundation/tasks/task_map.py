"""What a map over tasks is: function(value) for many values, wherever that is computed.

`tasks_of` in `fe_models.foundation.tasks.workers` makes one from what a user asked for: a number, dask, dask://host:port.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol, Self

from fe_models.foundation.errors import ReportedError

__all__ = ["Done", "Failed", "ProcessError", "Progress", "TaskMap", "WorkerError"]

Failed = Callable[[Any, Exception], Any]
Progress = Callable[[int, int], None]
Done = Callable[[int, Any], None]


class ProcessError(ReportedError, RuntimeError):
    """Every process that had this value ended before it gave an answer, or value or answer cannot be sent."""


class WorkerError(ReportedError, RuntimeError):
    """No work can be done: there are no workers, or they are not those of this project; it ends the whole map."""


class TaskMap(Protocol):
    """Computes a function at many values; stays for several calls, and ends what it started when it is left."""

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
            At the top level of a module: it is sent to other processes by name.
        values
            What to call it with.
        failed
            What stands in the place of a value whose call failed; None: the error of the first one in order is raised.
        progress
            Called with the numbers of values done and of all values.
        done
            Called with the number of a value and its result as soon as that is known, in no order.
        files
            Absolute paths that the function reads or writes beside; every worker must see them.

        Raises
        ------
        WorkerError
            If workers cannot be had, have another version of the project, or do not see the files.
        ProcessError
            If the function cannot be sent.
        Exception
            Without `failed`: what the function raised.
        """

    def end(self) -> None:
        """End all workers that this map started; a later `map` starts others."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...
