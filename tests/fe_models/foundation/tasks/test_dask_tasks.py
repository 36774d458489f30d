"""The same map on a Dask cluster: the same answers, and a worker that is killed loses nothing."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from functools import partial

import pytest

from fe_models.foundation.tasks.dask_tasks import dask_at, dask_here
from fe_models.foundation.tasks.installation import differences, installation
from fe_models.foundation.tasks.task_map import ProcessError, WorkerError
from fe_models.foundation.tasks.workers import checked_workers, tasks_of
from fe_models.foundation.threads import n_threads
from tests.fe_models.foundation.tasks.examples import answer, require_workers_to_end, row
from tests.root import ROOT

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def dask():
    with dask_here(2) as tasks:
        yield tasks


def test_results_and_errors_are_those_of_processes_in_the_order_of_the_values(dask):
    values, seen, done = [3, "raise", 1, "exit", "memory", 2], [], {}
    found = dask.map(
        answer, values, failed=row, progress=lambda *told: seen.append(told), done=lambda k, got: done.update({k: got})
    )
    with tasks_of(2) as processes:
        assert found == processes.map(answer, values, failed=row)
    assert seen[-1] == (6, 6)
    assert done == dict(enumerate(found))
    with pytest.raises(KeyError, match="a bad one"):
        dask.map(answer, [1, "raise", 2])
    assert dask.map(partial(pow, 2), range(4)) == [1, 2, 4, 8]


def test_two_clusters_stand_beside_each_other(dask):
    """Without a word about ports: warnings are errors here."""
    with dask_here(1) as other:
        assert other.map(partial(pow, 3), [2]) == [9]


def threads_of(value):
    from threadpoolctl import threadpool_info

    return n_threads(), *(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")


def test_every_worker_has_one_thread_everywhere(dask):
    pytest.importorskip("numpy")
    for workers in (1, 2, dask):
        with tasks_of(workers, 2) as tasks:
            for counts in tasks.map(threads_of, [1, 2]):
                assert set(counts) == {1}


def slow_square(folder, value):
    """Square a number, slowly, and tell by which process."""
    (folder / f"{value}-{os.getpid()}-{time.monotonic_ns()}.pid").write_text("")
    time.sleep(0.4)
    return value * value


#: of processes also by test_one_bad_value_never_loses_the_others of test_processes.py
@pytest.mark.parametrize("which", [pytest.param("processes", marks=pytest.mark.long), "dask"])
def test_a_worker_killed_at_work_loses_nothing(dask, tmp_path, which):
    killed = []

    def kill_one(k, result):
        running = [path for path in tmp_path.glob("*.pid") if int(path.name.split("-")[0]) not in known]
        known.add(values[k])
        running = [path for path in running if int(path.name.split("-")[0]) not in known]
        if not killed and running:
            killed.append(int(running[0].name.split("-")[1]))
            os.kill(killed[0], signal.SIGKILL)

    known, values = set(), [3, 1, 4, 5, 9, 2]
    with tasks_of(2 if which == "processes" else dask) as tasks:
        found = tasks.map(partial(slow_square, tmp_path), values, failed=row, done=kill_one)
    assert killed
    assert found == [value * value for value in values]
    tried = len(list(tmp_path.glob("*.pid")))
    assert tried >= len(values) + 1  # the one at work twice, and what that worker still kept for us
    assert tried <= len(values) + 3


def test_what_kills_every_worker_is_the_error_of_its_value_alone(dask):
    found = dask.map(answer, [1, "killed", 2, 3], failed=lambda value, error: error)
    assert isinstance(found[1], ProcessError)
    assert [found[0], *found[2:]] == [1, 4, 9]


def test_a_file_that_workers_do_not_see_ends_the_map_with_one_message(dask, tmp_path):
    with pytest.raises(WorkerError, match=r"does not see .*missing.toml; let all workers share the folder"):
        dask.map(answer, [1, 2], failed=row, files=[str(tmp_path / "missing.toml")])


@pytest.mark.parametrize("words", [None, b"", b"SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n"])
def test_no_scheduler_at_an_address_is_said_within_seconds(words, monkeypatch):
    """Nobody listens; one takes connections and never says a word; another one says what it is."""
    monkeypatch.setattr("fe_models.foundation.tasks.dask_tasks.CONNECT", 0.5)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        if words is not None:
            other.listen()
            greeting = threading.Thread(target=greet, args=(other, words))
            greeting.start()
        port = other.getsockname()[1]
        reason = "refused" if words is None else "another program listens there"
        told = rf"dask://127.0.0.1:{port}: no Dask scheduler answers there within 0.5 s \(.*{reason}\); start one"
        with pytest.raises(WorkerError, match=told):
            tasks_of(f"dask://127.0.0.1:{port}")
        if words is not None:
            greeting.join()


def greet(listening, words):
    """Say some words to the first one who comes, and wait for the end."""
    connection, _ = listening.accept()
    with connection, suppress(ConnectionResetError):
        connection.sendall(words)
        connection.recv(1)


@pytest.mark.parametrize(("text", "words"), [
    ("0", "expected a number of processes"), ("dsak", "expected a number"), ("dask:0", "expected a number"),
    ("cluster:8786", "did you mean dask://cluster:8786?"), ("tcp://cluster:8786", "did you mean dask://cluster:8786?"),
    ("dask://", "expected a number"), ("-3", "expected a number"), ("dask://a b:1", "expected a number"),
])  # fmt: skip
def test_words_that_are_no_workers_are_answered_with_what_there_is(text, words):
    with pytest.raises(WorkerError) as caught:
        checked_workers(text)
    assert words in str(caught.value)


def test_workers_of_all_kinds_are_understood():
    assert [checked_workers(text) for text in ("4", 2, "dask", "dask:3")] == [4, 2, "dask", "dask:3"]
    for text in ("dask://node-7.cluster", "dask://10.0.0.5:41234", "dask://[::1]:8786"):
        assert checked_workers(text) == text


def test_a_changed_installation_is_told_by_name():
    there = {**installation(), "numpy": "1.0"}
    assert differences(installation(), installation()) == ""
    assert differences(installation(), there) == f"numpy: expected {installation()['numpy']}, got 1.0"


def test_a_worker_with_another_version_of_the_project_is_refused_before_any_work(tmp_path, dask):
    """A cluster of another checkout, which lacks two of the packages."""
    shutil.copytree(ROOT / "fe_models", tmp_path / "fe_models", ignore=shutil.ignore_patterns("data", "__pycache__"))
    address = dask.client.scheduler.address
    host, port = address.removeprefix("tcp://").split(":")
    worker = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny", "--no-dashboard"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)}, cwd=tmp_path, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        dask.client.wait_for_workers(3, timeout=60)
        with pytest.raises(WorkerError, match=r"differs from this process: project: expected .*install"):
            dask_at(host, int(port))
        with pytest.raises(WorkerError, match="differs from the caller: project"):  # it came later than the check
            dask.map(partial(slow_square, tmp_path), range(9), failed=row)
    finally:
        worker.kill()
        worker.wait()


@pytest.mark.long
def test_a_scheduler_that_is_lost_at_work_ends_the_map_with_one_line():
    def started(*words, **more):
        command = [sys.executable, "-m", *words, "--no-dashboard"]
        return subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, text=True, **more)

    scheduler = started(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", stderr=subprocess.PIPE
    )  # fmt: skip
    running = [scheduler]
    try:
        found = next(filter(None, (re.search(r"tcp://127.0.0.1:(\d+)", line) for line in scheduler.stderr)))
        running.append(started("distributed.cli.dask_worker", found[0], "--no-nanny", stderr=subprocess.DEVNULL))
        with dask_at("127.0.0.1", int(found[1])) as tasks:
            tasks.client.wait_for_workers(1, timeout=60)
            with pytest.raises(WorkerError, match=r"the scheduler was lost.*start the same command again") as caught:
                tasks.map(time.sleep, [0.2] * 100, done=lambda k, _: scheduler.kill())
        assert "\n" not in str(caught.value)
    finally:
        for process in running:
            process.kill()
            process.communicate()


@pytest.mark.long
@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="processes are looked up in /proc")
@pytest.mark.parametrize("name", ["SIGINT", "SIGKILL"])
def test_workers_end_with_the_process_that_started_them(tmp_path, name):
    send = os.killpg if name == "SIGINT" else os.kill  # a terminal interrupts the whole group
    require_workers_to_end(tmp_path, "dask:2", lambda process: send(process.pid, signal.Signals[name]))
