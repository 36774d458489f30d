"""A function at many values in processes beside this one, none of which can take the others along when it ends.

A worker that is killed, or an answer that cannot be sent, is the error of one value; another worker takes its place.
Workers end with this process, however it ends (also by SIGTERM, SIGHUP or SIGKILL).
"""

import os
import pickle
import signal
import threading
from collections import deque
from collections.abc import Callable, Sequence
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from typing import Any, Self, TypeVar

from fe_models.foundation.errors import ReportedError

__all__ = ["ProcessError", "WorkerPool", "map_in_processes"]

MOST_FALSE_STARTS = 3  #: workers that end before their first value

Value = TypeVar("Value")
Result = TypeVar("Result")


class ProcessError(ReportedError, RuntimeError):
    """A process ended before it gave an answer, or the answer cannot be sent from it."""


class Worker:
    """A process, the pipe to it, and the number of the value it works on."""

    def __init__(self, function: bytes) -> None:
        context = get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=serve, args=(other, function), daemon=True)
        self.process.start()
        other.close()  # so that its end here is its end everywhere
        self.number: int | None = None
        self.is_ready = False

    def end(self) -> None:
        """End the process if it still runs."""
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def fate(self) -> str:
        """Say how the process ended."""
        self.process.join(1.0)
        code = self.process.exitcode
        if code is None or code >= 0:
            return f"its process ended with exit code {code}"
        name = signal.Signals(-code).name if -code in {each.value for each in signal.Signals} else str(-code)
        memory = "; the system may have run out of memory" if name == "SIGKILL" else ""
        return f"its process was killed by {name}{memory}"


def map_in_processes(
    function: Callable[[Value], Result],
    values: Sequence[Value],
    n: int,
    *,
    failed: Callable[[Value, Exception], Result] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Result]:
    """Return function(value) for every value, in the order of the values.

    Parameters
    ----------
    function
        At the top level of a module: it is sent to the processes by name.
    values
        What to call it with.
    n
        How many processes at once.
    failed
        What stands in the place of a value whose call failed; None: the error of the first one in order is raised.
    progress
        Called with the numbers of values done and of all values.

    Raises
    ------
    ProcessError
        If the function cannot be sent, or processes cannot be started.
    Exception
        Without `failed`: what the function raised.
    """
    with WorkerPool(function, n) as pool:
        return pool.map(values, failed=failed, progress=progress)


class WorkerPool:
    """Processes that stay for several calls of `map`, all of one function.

    Parameters
    ----------
    function
        At the top level of a module: it is sent to the processes by name.
    n
        How many processes at once.

    Raises
    ------
    ProcessError
        If the function cannot be sent.
    """

    def __init__(self, function: Callable[[Any], Any], n: int) -> None:
        try:
            self.code = pickle.dumps(function)
        except Exception as error:
            raise ProcessError(
                f"{function!r} cannot be sent to other processes ({error}); define it at the top level of a module"
            ) from error
        self.n = n
        self.workers: list[Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """End all processes; a later `map` starts others."""
        for worker in self.workers:
            worker.end()
        self.workers.clear()

    def map(
        self,
        values: Sequence[Any],
        *,
        failed: Callable[[Any, Exception], Any] | None = None,
        progress: Callable[[int, int], None] | None = None,
        done: Callable[[int, Any], None] | None = None,
    ) -> list[Any]:
        """Return function(value) for every value as `map_in_processes` does; done(k, result) as each comes."""
        try:
            return self.answers(values, failed, progress, done)
        except BaseException:
            self.end()  # some are at work on values nobody waits for any more
            raise

    def answers(
        self,
        values: Sequence[Any],
        failed: Callable[[Any, Exception], Any] | None,
        progress: Callable[[int, int], None] | None,
        done: Callable[[int, Any], None] | None,
    ) -> list[Any]:
        """Return the answers in the order of the values; raise the first error if nothing stands for it."""
        results: dict[int, Any] = {}
        errors: dict[int, Exception] = {}
        waiting = deque(range(len(values)))
        workers = self.workers
        false_starts = 0
        for worker in workers:  # of an earlier call
            if worker.is_ready:
                give(worker, values, waiting, errors)
        while waiting or any(worker.number is not None for worker in workers):
            while len(workers) < min(self.n, len(waiting) + sum(worker.number is not None for worker in workers)):
                workers.append(Worker(self.code))
            ready = wait([worker.pipe for worker in workers])
            for worker in [worker for worker in workers if worker.pipe in ready]:
                k = worker.number
                try:
                    answer = received(worker.pipe)
                    worker.is_ready = True
                except EOFError:
                    fate = worker.fate()
                    worker.end()
                    workers.remove(worker)
                    if k is None and not worker.is_ready:
                        false_starts += 1
                        if false_starts > MOST_FALSE_STARTS:
                            raise ProcessError(
                                f"processes cannot be started: {fate}; a script needs its work under "
                                "`if __name__ == '__main__':`"
                            ) from None
                    if k is None:
                        continue
                    answer = ProcessError(fate)
                if k is not None:
                    false_starts = 0
                    if isinstance(answer, Exception):
                        errors[k] = answer
                        if failed is None:
                            waiting.clear()
                        else:
                            results[k] = failed(values[k], answer)
                    else:
                        results[k] = answer[0]
                    if done is not None and k in results:
                        done(k, results[k])
                    if progress is not None:
                        progress(len(results), len(values))
                if worker in workers:
                    give(worker, values, waiting, errors)
        if errors and failed is None:
            raise errors[min(errors)]
        return [results[k] for k in range(len(values))]


def give(worker: Worker, values: Sequence[Any], waiting: "deque[int]", errors: dict[int, Exception]) -> None:
    """Send the next value to a worker, if there is one."""
    worker.number = None
    while waiting and worker.number is None:
        k = waiting.popleft()
        try:
            data = pickle.dumps(values[k])
        except Exception as error:
            errors[k] = ProcessError(f"the value cannot be sent to another process: {error}")
            raise errors[k] from error
        worker.number = k
        try:
            worker.pipe.send_bytes(data)
        except (BrokenPipeError, ConnectionResetError):  # it has just ended: the pipe tells at the next turn
            pass


def received(pipe: "Connection[Any, Any]") -> Any:
    """Return the answer of a worker: a tuple with the result, or an error; `EOFError` if it has ended."""
    try:
        data = pipe.recv_bytes()
    except (EOFError, OSError):
        raise EOFError from None
    try:
        return pickle.loads(data)
    except Exception as error:
        return ProcessError(f"the answer cannot be read: {type(error).__name__}: {error}")


def serve(pipe: "Connection[Any, Any]", function: bytes) -> None:
    """Answer values with results or errors until the pipe is closed; the main function of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that asks is interrupted, and ends this one
    threading.Thread(target=end_with_parent, daemon=True).start()
    call = pickle.loads(function)
    pipe.send_bytes(pickle.dumps(None))
    while True:
        try:
            value = pickle.loads(pipe.recv_bytes())
        except EOFError:
            return
        try:
            data = pickle.dumps((call(value),))
        except BaseException as error:  # SystemExit too: it is the answer of one value
            data = sendable(error)
        pipe.send_bytes(data)


def end_with_parent() -> None:
    """Wait for the end of the process that started this one, and end at once."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def sendable(error: BaseException) -> bytes:
    """Return an error as bytes; one that cannot be sent and read again is replaced by its words."""
    try:
        data = pickle.dumps(error)
        if isinstance(error, Exception) and type(pickle.loads(data)) is type(error):
            return data
    except Exception:
        pass
    return pickle.dumps(ProcessError(f"{type(error).__name__}: {error}"[:500]))
