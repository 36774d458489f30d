"""Interrupted runs: what was closed is readable, and a resumed run becomes the motion of one never interrupted."""

import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import floatframe.simulation.integrate as integration
from floatframe import GeneralizedAlpha, Gravity, JointForce, System, integrate, read_results
from floatframe.components.mechanisms import slider_crank
from floatframe.engine.kernels.entry import prepare
from floatframe.errors import ResultsError
from floatframe.model.functions.time_functions import cycloidal_spin_up
from floatframe.simulation import resume
from tests.floatframe.simulation.examples import StopHereError, assert_same, steps_on_record, swing
from tests.root import ROOT

H, T_END = 1e-3, 1.7


def interrupted(path, at, system=None):
    """Run until the progress reaches a time, closing a segment at every place where a run can go on."""

    def on_progress(progress):
        if progress.t >= at - 1e-9:
            raise StopHereError

    with pytest.raises(StopHereError):
        integrate(system or swing(), GeneralizedAlpha(0.8), T_END, H, output=path, output_every=7, progress=on_progress)


@pytest.fixture(autouse=True)
def many_segments(monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)


@pytest.fixture(scope="module")
def whole():
    return integrate(swing(), GeneralizedAlpha(0.8), T_END, H, output_every=7)


@pytest.mark.parametrize("at", [0.1, 0.2, 0.75, 1.6])
def test_resumed_run_is_the_uninterrupted_one_bit_for_bit(tmp_path, whole, at):
    interrupted(tmp_path / "run.h5", at)
    assert steps_on_record(tmp_path / "run.h5") >= 400
    left = read_results(tmp_path / "run.h5")
    assert not left.is_complete
    assert 0 < len(left.t) < len(whole.t)
    assert_same(resume(swing(), tmp_path / "run.h5"), whole)
    assert not (tmp_path / "run.h5.segments").exists()


def test_driven_mechanism_with_friction_goes_on_at_the_time_it_stopped(tmp_path):
    """Drives depend on time, joints carry moments, friction on the normal force: all of it is in the record."""

    def driven():
        plain = slider_crank(drive=cycloidal_spin_up(30.0, 1.0), angle=0.2)
        friction = JointForce("rub", "guide", "distance", friction_coefficient=0.2, friction_speed=0.05)
        return System(plain.bodies, plain.joints, [Gravity((0, -9.81, 0)), friction])

    whole_run = integrate(driven(), GeneralizedAlpha(0.8), T_END, H, output_every=7)
    interrupted(tmp_path / "run.h5", 0.9, driven())
    assert_same(resume(driven(), tmp_path / "run.h5"), whole_run)


def test_run_interrupted_twice_still_ends_as_one(tmp_path, whole):
    interrupted(tmp_path / "run.h5", 0.5)

    def stop(progress):
        if progress.t > 1.1:
            raise StopHereError

    with pytest.raises(StopHereError):
        resume(swing(), tmp_path / "run.h5", progress=stop)
    assert_same(resume(swing(), tmp_path / "run.h5.segments"), whole)


def test_motion_does_not_depend_on_the_size_of_the_batches(whole):
    other = integrate(swing(), GeneralizedAlpha(0.8), T_END, H, output_every=7, batch_steps=33)
    assert_same(other, whole)


def test_another_system_is_refused(tmp_path):
    interrupted(tmp_path / "run.h5", 0.5)
    with pytest.raises(ResultsError, match="of another system"):
        resume(swing(softness=0.21), tmp_path / "run.h5")


def test_nothing_to_resume_is_said(tmp_path):
    with pytest.raises(ResultsError, match="no run with this name was begun"):
        resume(swing(), tmp_path / "run.h5")
    integrate(swing(), GeneralizedAlpha(0.8), 0.01, H, output=tmp_path / "run.h5")
    with pytest.raises(ResultsError, match="the run is complete"):
        resume(swing(), tmp_path / "run.h5")


KILLED = """
    import sys
    import floatframe.simulation.integrate as integration
    from floatframe import GeneralizedAlpha, integrate
    from tests.floatframe.simulation.test_restart import H, swing

    integration.SEGMENT_SECONDS = 0.0
    print("begin", flush=True)
    integrate(swing(), GeneralizedAlpha(0.8), {t_end}, H, output=sys.argv[1], output_every=7)
"""


def killed(path, t_end, delay):
    """Start a run in a process of its own and kill it so many seconds after it began."""
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(KILLED.format(t_end=t_end)), str(path)],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.readline()
    while not Path(f"{path}.segments/000000.h5").exists():
        time.sleep(1e-3)
    time.sleep(delay)
    is_killed = process.poll() is None
    process.kill()  # SIGKILL, unless it has ended
    process.wait()
    process.stdout.close()
    return is_killed


@pytest.mark.parametrize(("n_kills", "latest"), [(1, 0.6), pytest.param(100, 1.2, marks=pytest.mark.long)])
def test_killed_run_is_readable_and_can_be_resumed(tmp_path, n_kills, latest):
    """Killed (SIGKILL) at random moments up to `latest` times the length of a run, also while a segment is written."""
    t_end = 6.0
    prepare()  # compiling is no part of a run
    begun = time.monotonic()
    whole = integrate(swing(), GeneralizedAlpha(0.8), t_end, H, output_every=7)
    seconds = time.monotonic() - begun
    rng, caught = np.random.default_rng(0), 0
    for k in range(n_kills):
        path = tmp_path / f"run{k}.h5"
        caught += killed(path, t_end, rng.uniform(0, latest * seconds))
        left = read_results(path)
        assert_array_equal(left.t, whole.t[: len(left.t)])
        assert_array_equal(left.source.read("q"), whole.source.read("q")[: len(left.t)])
        if not left.is_complete:
            assert_same(resume(swing(), path), whole)
        path.unlink()
    assert caught > 0
