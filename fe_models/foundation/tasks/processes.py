"""Evaluation of a function at many values in local processes; a process that ends does not affect the others.

If a worker is killed, another worker takes its value. A value whose workers all ended, or whose answer cannot be sent,
is an error of this value alone. Workers end with this process, for any cause (also SIGTERM, SIGHUP or SIGKILL).
"""

import os
import pickle
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from typing import Any, Self

from fe_models.foundation.tasks.answers import answer, read_answer
from fe_models.foundation.tasks.task_map import Done, Failed, ProcessError, Progress, WorkerError
from fe_models.foundation.threads import bounded_threads, thread_environment

__all__ = ["MOST_TRIES", "WorkerPool"]

MOST_FALSE_STARTS = 3  #: largest number of workers that may end before their first value
MOST_TRIES = 3  #: largest number of attempts at a value whose worker ends


class Worker:
    """A process, the pipe to it, and the index of the value on which it works."""

    def __init__(self, threads: int) -> None:
        context = get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=serve, args=(other, threads), daemon=True)
        with environment(thread_environment(threads)):
            self.process.start()
        other.close()  # so that closing the remaining end is noticed on the other side
        self.number: int | None = None
        self.is_ready = False
        self.function = b""  #: function that the process has received

    def end(self) -> None:
        """End the process if it still runs."""
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def fate(self) -> str:
        """Describe how the process ended."""
        self.process.join(1.0)
        code = self.process.exitcode
        if code is None or code >= 0:
            return f"its process ended with exit code {code}"
        name = signal.Signals(-code).name if -code in {each.value for each in signal.Signals} else str(-code)
        memory = "; the system may have run out of memory" if name == "SIGKILL" else ""
        return f"its process was killed by {name}{memory}"


@contextmanager
def environment(variables: dict[str, str]) -> Iterator[None]:
    """Set environment variables for processes started within this context."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


class WorkerPool:
    """A `TaskMap` of local processes.

    Parameters
    ----------
    n
        Number of processes.
    threads
        Number of threads that each process may use.
    """

    def __init__(self, n: int, threads: int = 1) -> None:
        self.n = n
        self.threads = threads
        self.workers: list[Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """End all processes; a later `map` starts new ones."""
        for worker in self.workers:
            worker.end()
        self.workers.clear()

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
        """Return function(value) for every value, as `TaskMap.map` does; local processes see the same files."""
        try:
            code = pickle.dumps(function)
        except Exception as error:
            raise ProcessError(
                f"{function!r} cannot be sent to other processes ({error}); define it at the top level of a module"
            ) from error
        try:
            return self.answers(code, values, failed, progress, done)
        except BaseException:
            self.end()  # some still work on values that are no longer needed
            raise

    def answers(
        self, code: bytes, values: Sequence[Any], failed: Failed | None, progress: Progress | None, done: Done | None
    ) -> list[Any]:
        """Return the answers in the order of the values; raise the first error if it has no replacement."""
        results: dict[int, Any] = {}
        errors: dict[int, Exception] = {}
        waiting = deque(range(len(values)))
        losses: Counter[int] = Counter()
        workers = self.workers
        false_starts = 0
        while waiting or any(worker.number is not None for worker in workers):
            for worker in workers:  # workers of an earlier call, or workers that were idle until another one was lost
                if worker.is_ready and worker.number is None:
                    give(worker, code, values, waiting, errors)
            while len(workers) < min(self.n, len(waiting) + sum(worker.number is not None for worker in workers)):
                workers.append(Worker(self.threads))
            ready = wait([worker.pipe for worker in workers])
            for worker in [worker for worker in workers if worker.pipe in ready]:
                k = worker.number
                found: Any
                try:
                    found = received(worker.pipe)
                    worker.is_ready = True
                except EOFError:
                    fate = worker.fate()
                    worker.end()
                    workers.remove(worker)
                    if k is None:
                        false_starts += not worker.is_ready
                        if false_starts > MOST_FALSE_STARTS:
                            raise WorkerError(
                                f"processes cannot be started: {fate}; a script needs its work under "
                                "`if __name__ == '__main__':`"
                            ) from None
                        continue
                    losses[k] += 1
                    if losses[k] < MOST_TRIES and not (errors and failed is None):
                        waiting.appendleft(k)
                        continue
                    found = ProcessError(f"{fate} (tried {losses[k]} times)")
                if k is not None:
                    false_starts = 0
                    if isinstance(found, Exception):
                        errors[k] = found
                        if failed is None:
                            waiting.clear()
                        else:
                            results[k] = failed(values[k], found)
                    else:
                        results[k] = found[0]
                    if done is not None and k in results:
                        done(k, results[k])
                    if progress is not None:
                        progress(len(results), len(values))
                if worker in workers:
                    give(worker, code, values, waiting, errors)
        if errors and failed is None:
            raise errors[min(errors)]
        return [results[k] for k in range(len(values))]


def give(
    worker: Worker, code: bytes, values: Sequence[Any], waiting: "deque[int]", errors: dict[int, Exception]
) -> None:
    """Send the next value to a worker, if there is one; first send the function, unless the worker already has it."""
    worker.number = None
    if not waiting:
        return
    k = waiting.popleft()
    try:
        data = pickle.dumps(values[k])
    except Exception as error:
        errors[k] = ProcessError(f"the value cannot be sent to another process: {error}")
        raise errors[k] from error
    worker.number = k
    try:
        worker.pipe.send_bytes(pickle.dumps((None if worker.function == code else code, data)))
        worker.function = code
    # the worker has just ended, which the pipe reports in the next iteration
    except (BrokenPipeError, ConnectionResetError):
        pass


def received(pipe: "Connection[Any, Any]") -> Any:
    """Return the answer of a worker: a tuple with the result, or an error; raise `EOFError` if it has ended."""
    try:
        data = pipe.recv_bytes()
    except (EOFError, OSError):
        raise EOFError from None
    return read_answer(data)


def serve(pipe: "Connection[Any, Any]", threads: int) -> None:
    """Answer values with results or errors until the pipe is closed; this is the main function of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles the interrupt and ends this one
    threading.Thread(target=end_with_parent, daemon=True).start()
    function = b""
    pipe.send_bytes(pickle.dumps(None))
    with bounded_threads(threads):
        while True:
            try:
                code, value = pickle.loads(pipe.recv_bytes())
            except EOFError:
                return
            function = function if code is None else code
            pipe.send_bytes(answer(function, value))


def end_with_parent() -> None:
    """Wait for the end of the parent process, then end immediately."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
