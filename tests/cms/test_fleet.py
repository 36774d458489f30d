"""Fleets: files of the single command, what is done is not done again, one bad job takes no other along."""

import hashlib
import logging
import os
import signal

import h5py
import pytest
from numpy.testing import assert_equal

import cms
from cms.errors import JobError
from cms.fleet import FleetTask, fleet_of, inputs_of, reduce_fleet
from cms.jobs.job import read_job
from fe_models.foundation.tasks.workers import ThisProcess
from tests.cms.command import run_cms

ROD = """
[body]
name = "rod"
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"

[materials.steel]
young = 210e9
poisson = 0.3
density = 7850

[sections.rod]
shape = "tube"
radius = 0.02
thickness = 0.003

[interfaces.foot]
kind = "nodes"
nodes = "foot"

[reduction]
n_modes = {n_modes}
"""


@pytest.fixture
def jobs(tmp_path):
    (tmp_path / "nodes.csv").write_text("node,x,y,z,sets\n0,0,0,0,foot\n1,0.5,0,0,\n2,1,0,0,\n")
    (tmp_path / "lines.csv").write_text("node1,node2\n0,1\n1,2\n")
    for n_modes in (1, 2, 3):
        (tmp_path / f"rod_{n_modes}.toml").write_text(ROD.format(n_modes=n_modes))
    return sorted(tmp_path.glob("*.toml"))


def files_of(jobs):
    return {job.stem: hashlib.sha256(job.with_suffix(".h5").read_bytes()).hexdigest() for job in jobs}


def arrays_of(job):
    """Return every array of a modal file by its name; what it says of the solver's threads stands beside them."""
    found = {}
    with h5py.File(job.with_suffix(".h5")) as file:
        file.visititems(lambda name, it: found.update({name: it[()]}) if isinstance(it, h5py.Dataset) else None)
    return found


@pytest.mark.long  # a worker killed at its writing, below, runs the same by processes
def test_files_are_the_same_by_processes_by_a_cluster_and_here(jobs):
    """Byte for byte where workers have as many threads; here, where a job has all of them, every array bit for bit."""
    pytest.importorskip("distributed")
    rows = reduce_fleet(jobs, workers=1)
    assert [row.n_modes for row in rows] == [cms.read(job.with_suffix(".h5")).n_q for job in jobs]
    here = [arrays_of(job) for job in jobs]
    found = []
    for workers in (2, "dask:2"):
        for job in jobs:
            job.with_suffix(".h5").unlink()
        reduce_fleet(jobs, workers=workers)
        found.append(files_of(jobs))
        for job, arrays in zip(jobs, here, strict=True):
            assert_equal(arrays_of(job), arrays)
    assert found[0] == found[1]


def test_what_is_done_is_not_done_again_until_something_changes(jobs, monkeypatch):
    words = [str(job) for job in jobs]

    def reduced(*more):
        result = run_cms("reduce", *words, "--workers", "1", *more, code=0)
        return result.stdout.splitlines()[-1]

    assert reduced() == "3 jobs: 3 done, 0 done before, 0 failed"
    assert reduced() == "3 jobs: 0 done, 3 done before, 0 failed"
    jobs[0].write_text(jobs[0].read_text().replace("radius = 0.02", "radius = 0.03"))
    jobs[1].with_suffix(".h5").unlink()
    jobs[2].with_suffix(".h5").write_bytes(b"another")
    assert reduced() == "3 jobs: 3 done, 0 done before, 0 failed"
    (jobs[0].parent / "nodes.csv").write_text("node,x,y,z,sets\n0,0,0,0,foot\n1,0.6,0,0,\n2,1,0,0,\n")
    assert reduced() == "3 jobs: 3 done, 0 done before, 0 failed"
    (jobs[0].parent / "out").mkdir()
    assert reduced("-o", str(jobs[0].parent / "out")) == "3 jobs: 3 done, 0 done before, 0 failed"
    assert (jobs[0].parent / "out" / "rod_3.h5").is_file()


def test_a_job_is_done_again_when_a_file_that_it_extends_changes(jobs):
    """A base whose keys were all overridden counts too: a new key in it changes the job."""
    base = jobs[0].parent / "base.toml"
    base.write_text(jobs[0].read_text())
    jobs[0].write_text('extends = "base.toml"\n')
    before = inputs_of(jobs[0], read_job(jobs[0]))
    assert base in before
    (first,) = fleet_of(jobs[:1], [jobs[0].with_suffix(".h5")])
    base.write_text(base.read_text().replace("radius = 0.02", "radius = 0.03"))
    (then,) = fleet_of(jobs[:1], [jobs[0].with_suffix(".h5")])
    assert then.digest != first.digest


def test_a_job_that_fails_takes_no_other_along(jobs):
    jobs[1].write_text(jobs[1].read_text().replace("n_modes = 2", "n_modes = 99"))
    result = run_cms("reduce", *jobs, "-j", "1", code=2)
    assert "3 jobs: 2 done, 0 done before, 1 failed" in result.stdout
    assert f"{jobs[1]}: " in result.stderr
    assert "99" in result.stderr
    assert [job.with_suffix(".h5").is_file() for job in jobs] == [True, False, True]


def test_warnings_of_a_job_are_told_once_with_its_row(jobs, monkeypatch, caplog):
    monkeypatch.setattr("cms.modes.families.cost.MANY", 3)
    rows = reduce_fleet(jobs[:2], workers=1)
    assert [len(row.notes) for row in rows] == [1, 1]
    assert "interface 'foot' of 1 nodes has 6 boundary dofs" in rows[0].notes[0]
    assert not caplog.records
    logging.getLogger("later").warning("told as ever")
    assert caplog.messages == ["told as ever"]


def test_bad_fleets_are_refused_before_any_work(jobs, tmp_path):
    copy = tmp_path / "more" / jobs[0].name
    copy.parent.mkdir()
    copy.write_text(jobs[0].read_text().replace('"nodes.csv"', '"../nodes.csv"').replace('"lines', '"../lines'))
    with pytest.raises(JobError, match="would both be written"):
        reduce_fleet([jobs[0], copy], [tmp_path / "rod.h5"] * 2)
    with pytest.raises(JobError, match="is an input of a job"):
        reduce_fleet([jobs[0]], [tmp_path / "nodes.csv"])
    (tmp_path / "kept.journal").write_text("notes\nof mine\n")
    with pytest.raises(JobError, match="expected a journal of cms reduce"):
        reduce_fleet(jobs, journal=tmp_path / "kept.journal")
    for words, message in (
        (["-o", str(tmp_path / "one.h5")], "expected a folder that is there"),
        (["-j", "dsak"], "expected a number of processes, dask"),
    ):
        result = run_cms("reduce", *jobs, *words, code=2)
        assert message in " ".join(result.stderr.split())
    assert not list(tmp_path.rglob("*.h5"))


class KilledOnce(FleetTask):
    """Reduces a job; the first worker that has written half of its file is killed."""

    def __call__(self, job):
        mark = job.output.with_name("killed")
        if not mark.exists():
            mark.write_text(str(os.getpid()))
            job.output.with_name(f".{job.output.name}.0123abcd.part").write_bytes(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
        return super().__call__(job)


class Interrupted(FleetTask):
    """Stands for Ctrl-C while the second job is at its writing."""

    def __call__(self, job):
        if job.job.name == "rod_2.toml":
            job.output.with_name(f".{job.output.name}.0123abcd.part").write_bytes(b"half")
            raise KeyboardInterrupt
        return super().__call__(job)


def test_a_worker_killed_at_its_writing_loses_no_job(jobs, monkeypatch):
    """Every array is the one that this process writes, bit for bit."""
    reduce_fleet(jobs, workers=1)
    here = [arrays_of(job) for job in jobs]
    for job in jobs:
        job.with_suffix(".h5").unlink()
    monkeypatch.setattr("cms.fleet.FleetTask", KilledOnce)
    rows = reduce_fleet(jobs, workers=2)
    assert [row.n_modes for row in rows] == [cms.read(job.with_suffix(".h5")).n_q for job in jobs]
    assert_equal([arrays_of(job) for job in jobs], here)
    assert (jobs[0].parent / "killed").is_file()
    assert not any(row.error for row in rows)
    assert len(files_of(jobs)) == 3
    assert not list(jobs[0].parent.glob(".*.part"))


def test_an_interrupt_leaves_nothing_half_written_and_a_second_call_goes_on(jobs, monkeypatch):
    journal = jobs[0].with_name("reduce.journal")
    with monkeypatch.context() as patch:
        patch.setattr("cms.fleet.FleetTask", Interrupted)
        with pytest.raises(KeyboardInterrupt):
            reduce_fleet(jobs, workers=1, journal=journal)
    assert not list(jobs[0].parent.glob(".*.part"))
    rows = reduce_fleet(jobs, workers=ThisProcess(), journal=journal)
    assert [row.is_known for row in rows] == [True, False, False]
