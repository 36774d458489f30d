"""The task map on a Dask cluster: a cluster started here, or one whose scheduler is reached at an address.

(1) before any work, every worker must report the same installation as this process
(2) every task repeats this check, because workers may join later, and checks that it sees the files it needs
(3) a task whose worker ends is given to another worker, first by the scheduler according to its settings, then by this
    process; the last attempt runs alone, so that it cannot affect other tasks
"""

import logging
import os
import pickle
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import Any, Self

from fe_models.foundation.extras import extra_module
from fe_models.foundation.tasks.answers import answer, read_answer, sendable
from fe_models.foundation.tasks.installation import differences, installation
from fe_models.foundation.tasks.processes import MOST_TRIES
from fe_models.foundation.tasks.task_map import Done, Failed, ProcessError, Progress, WorkerError
from fe_models.foundation.threads import bounded_threads, thread_environment

__all__ = ["DaskTasks", "dask_at", "dask_here"]

log = logging.getLogger(__name__)

EXTRA = {"extra": "cluster", "purpose": "workers on a Dask cluster"}
CONNECT = 5.0  #: time within which a scheduler must answer [s]
LONGEST_GREETING = 1_000_000  #: largest size of the first message of a scheduler [bytes]
START = 60.0  #: time within which a cluster started here must have its workers [s]
MARK = "fe_models.foundation.tasks.installation:INSTALLATION"
SAME = "install the same version of the project and its libraries on all workers and start them anew"


def dask_here(n: int, threads: int = 1) -> "DaskTasks":
    """Return the task map on a cluster of n processes on this machine; the cluster ends with the map.

    Raises
    ------
    MissingExtraError
        If Dask is not installed.
    WorkerError
        If the processes cannot be started.
    """
    distributed = extra_module("distributed", **EXTRA)
    dask = extra_module("dask", **EXTRA)
    settings = {
        "distributed.scheduler.allowed-failures": 0,  # retries, step (3), are done from here
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.nanny.pre-spawn-environ": thread_environment(threads),
        "distributed.comm.timeouts.connect": START,
    }
    with dask.config.set(settings), interrupts_ignored():
        try:
            cluster = distributed.LocalCluster(
                n_workers=n, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0,
                # otherwise two clusters would compete for port 8787
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
                silence_logs=logging.CRITICAL,
            )  # fmt: skip
        except Exception as error:
            raise WorkerError(f"workers = dask: no cluster can be started here: {error}") from error
        try:
            client = distributed.Client(cluster, timeout=CONNECT, set_as_default=False)
            client.wait_for_workers(n, timeout=START)
        except BaseException as error:
            cluster.close()
            if not isinstance(error, Exception):
                raise
            raise WorkerError(f"workers = dask: no cluster can be started here: {error}") from error
    return DaskTasks(client, "workers = dask", cluster)


@contextmanager
def interrupts_ignored() -> Iterator[None]:
    """Ignore Ctrl-C here and in processes started meanwhile; this process ends them and reports the interrupt."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def dask_at(host: str, port: int) -> "DaskTasks":
    """Return the task map on a running cluster, given the address of its scheduler.

    Raises
    ------
    MissingExtraError
        If Dask is not installed.
    WorkerError
        If no scheduler answers within a few seconds.
    """
    distributed = extra_module("distributed", **EXTRA)
    told = f"workers = dask://{host}:{port}"
    try:
        listen(host.strip("[]"), port)
        # a lost scheduler is reported here, in one line
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        client = distributed.Client(f"tcp://{host}:{port}", timeout=CONNECT, set_as_default=False)
    except Exception as error:
        raise WorkerError(
            f"{told}: no Dask scheduler answers there within {CONNECT:g} s ({reason_of(error)}); start one (dask "
            "scheduler), take the address that it prints, and see that no firewall stands between"
        ) from error
    return DaskTasks(client, told)


def listen(host: str, port: int) -> None:
    """Raise `OSError` unless a scheduler listens at the address; it sends the length of a message in 8 bytes first.

    Without this check, Dask's client would wait forever if a program accepts the connection and sends nothing.
    """
    with socket.create_connection((host, port), timeout=CONNECT) as connection:
        heard = b""
        try:
            while len(heard) < 8 and (more := connection.recv(8 - len(heard))):
                heard += more
        except TimeoutError:
            pass
        if len(heard) < 8 or int.from_bytes(heard, "little") > LONGEST_GREETING:
            raise OSError("another program listens there")


def reason_of(error: BaseException) -> str:
    """Return the first line of the innermost cause."""
    while error.__cause__ is not None:
        error = error.__cause__
    return (str(error).strip().splitlines() or [""])[0][:200] or type(error).__name__


class DaskTasks:
    """A `TaskMap` on a Dask cluster.

    Parameters
    ----------
    client
        Client of `distributed`; it is closed with the map.
    told
        Beginning of messages.
    cluster
        Cluster that was started for this map and ends with it.

    Raises
    ------
    WorkerError
        If a worker has another version of the project.
    """

    def __init__(self, client: Any, told: str = "Dask", cluster: Any = None) -> None:
        self.client = client
        self.told = told
        self.cluster = cluster
        try:
            self.check_workers()
        except BaseException:
            self.end()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """Disconnect from the scheduler; end the cluster if it was started for this map."""
        try:
            self.client.close(timeout=CONNECT)
        finally:
            if self.cluster is not None:
                self.cluster.close(timeout=CONNECT)

    def check_workers(self) -> None:
        """(1) Raise `WorkerError` if a worker has another version of the project; warn if there is no worker yet."""
        from pkgutil import resolve_name

        found = self.client.run(resolve_name, MARK, on_error="return")
        if not found:
            log.warning("%s: the scheduler has no worker yet; waiting for the first one", self.told)
        for address, there in sorted(found.items()):
            if isinstance(there, ImportError | AttributeError):
                raise WorkerError(f"{self.told}: worker {address} has no such version of the project ({there}); {SAME}")
            if not isinstance(there, dict):
                raise WorkerError(f"{self.told}: worker {address} cannot be asked what is installed there: {there}")
            words = differences(installation(), there)
            if words:
                raise WorkerError(f"{self.told}: worker {address} differs from this process: {words}; {SAME}")
        shared = [info for info in self.client.scheduler_info(n_workers=-1)["workers"].values() if info["nthreads"] > 1]
        if shared:
            log.warning(
                "%s: %d of the workers have several threads; one task at a time runs in each: start them with "
                "--nthreads 1", self.told, len(shared),
            )  # fmt: skip

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
        work = Work(self, function, values, failed, progress, done, tuple(files))
        try:
            return work.results()
        except BaseException:
            work.cancel()
            raise


class Work:
    """One call of `map`: the values sent and the answers received."""

    def __init__(
        self,
        tasks: DaskTasks,
        function: Callable[[Any], Any],
        values: Sequence[Any],
        failed: Failed | None,
        progress: Progress | None,
        done: Done | None,
        files: tuple[str, ...],
    ) -> None:
        self.client, self.told = tasks.client, tasks.told
        self.n_tries = MOST_TRIES if tasks.cluster is not None else 2  # a running scheduler has retried by itself
        self.values, self.failed, self.progress, self.done = values, failed, progress, done
        try:
            code = extra_module("cloudpickle", **EXTRA).dumps(function)
            self.data = [pickle.dumps(value) for value in values]
        except Exception as error:
            raise ProcessError(f"{function!r} or its values cannot be sent to other processes ({error})") from error
        self.common = (installation(), files, code)
        self.found: dict[int, Any] = {}
        self.errors: dict[int, Exception] = {}
        self.futures: dict[Any, int] = {}

    def results(self) -> list[Any]:
        """Return all results in order."""
        suspects: Sequence[int] = range(len(self.values))
        for _ in range(self.n_tries - 1):
            suspects = self.gather(suspects)
        for k in suspects:  # (3)
            if self.gather([k]) and not self.is_over():
                tried = f"tried {MOST_TRIES} times or more, at last alone"
                self.take(k, ProcessError(f"its process ended; the system may have run out of memory ({tried})"))
        if self.errors and self.failed is None:
            raise self.errors[min(self.errors)]
        return [self.found[k] for k in range(len(self.values))]

    def is_over(self) -> bool:
        """Whether an error occurred for which no replacement was given."""
        return bool(self.errors) and self.failed is None

    def gather(self, numbers: Sequence[int]) -> list[int]:
        """Compute some values; return the indices of the values whose workers ended repeatedly."""
        distributed = extra_module("distributed", **EXTRA)
        if self.is_over() or not numbers:
            return []
        sent = self.client.map(call, [self.data[k] for k in numbers], common=self.common, pure=False)
        self.futures = dict(zip(sent, numbers, strict=True))
        suspects = []
        for future in distributed.as_completed(list(sent), loop=self.client.loop):
            k = self.futures.pop(future)
            try:
                answered = read_answer(future.result())
            except distributed.KilledWorker:
                suspects.append(k)
                continue
            except WorkerError as error:
                raise WorkerError(f"{self.told}: {error}") from None
            except Exception as error:
                raise WorkerError(f"{self.told}: {lost(error)}") from error
            finally:
                future.release()
            self.take(k, answered)
            if self.is_over():
                self.cancel()
                break
        return sorted(suspects)

    def take(self, k: int, answered: Any) -> None:
        """Keep the answer for a value."""
        if isinstance(answered, Exception):
            self.errors[k] = answered
            if self.failed is not None:
                self.found[k] = self.failed(self.values[k], answered)
        else:
            self.found[k] = answered[0]
        if self.done is not None and k in self.found:
            self.done(k, self.found[k])
        if self.progress is not None:
            self.progress(len(self.found), len(self.values))

    def cancel(self) -> None:
        """Cancel tasks that have not been computed."""
        left, self.futures = list(self.futures), {}
        if left and self.client.status == "running":
            self.client.cancel(left, force=True)


def lost(error: Exception) -> str:
    """Describe why a task has no answer at all."""
    if isinstance(error, ImportError | AttributeError):
        return f"a worker has no such version of the project ({error}); {SAME}"
    return (
        f"the scheduler was lost, or gave the work up ({type(error).__name__}: {reason_of(error)}); see that it "
        "runs, and start the same command again"
    )


#: lock for one value at a time, because threads of a worker share the threads and caches of libraries
one_at_a_time = threading.Lock()
for_good = ExitStack()  #: contexts of a worker that are never closed


def call(value: bytes, common: tuple[dict[str, str], tuple[str, ...], bytes]) -> bytes:
    """Return the answer for a value; runs in a worker."""
    expected, files, function = common
    words = differences(expected, installation())
    if words:
        return sendable(WorkerError(f"worker {here()} differs from the caller: {words}; {SAME}"))
    unseen = [name for name in files if not os.path.exists(name)]
    if unseen:
        return sendable(
            WorkerError(f"worker {here()} does not see {unseen[0]}; let all workers share the folder at the same path")
        )
    bind_threads()
    with one_at_a_time:
        return answer(function, value)


@cache
def bind_threads() -> None:
    """Limit this worker permanently to the number of threads in its environment variables."""
    threads = os.environ.get("OMP_NUM_THREADS", "")
    if threads.isdigit() and int(threads) > 0:
        for_good.enter_context(bounded_threads(int(threads)))


def here() -> str:
    """Return the host and id of this process, for messages."""
    return f"{os.getpid()} on {socket.gethostname()}"
