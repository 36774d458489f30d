"""Where results are written: one run at a time, never over an input or a device, and a full disk in one message."""

import os
import stat
import subprocess
import sys
import textwrap

import pytest
from numpy.testing import assert_array_equal

import floatframe.simulation.integrate as integration
from floatframe import GeneralizedAlpha, integrate, read_results
from floatframe.analyses.driven.kinematics import kinematics
from floatframe.components.mechanisms import slider_crank
from floatframe.errors import ResultsError
from floatframe.model.functions.time_functions import cycloidal_spin_up
from floatframe.simulation import resume
from tests.floatframe.results.examples import SYSTEM
from tests.root import ROOT

METHOD = GeneralizedAlpha()


class StopHereError(Exception):
    """Raised by a progress callback to end a run."""


def run(path, **options):
    return integrate(SYSTEM, METHOD, 0.05, 1e-3, output=path, batch_steps=10, **options)


def test_a_second_run_to_the_same_file_is_refused_and_the_first_one_ends_as_alone(tmp_path):
    path, link, alone = tmp_path / "run.h5", tmp_path / "link.h5", integrate(SYSTEM, METHOD, 0.05, 1e-3)
    link.symlink_to(path)
    told = []

    def meanwhile(progress):
        for other in (lambda: run(path), lambda: run(link), lambda: resume(SYSTEM, path), lambda: resume(SYSTEM, link)):
            with pytest.raises(ResultsError, match=r"another run writes to it now \(process \d+ on") as error:
                other()
            told.append(error.value)

    motion = run(path, progress=meanwhile)
    assert len(told) == 20
    assert_array_equal(motion.source.read("q"), alone.source.read("q"))
    assert sorted(each.name for each in tmp_path.iterdir()) == ["link.h5", "run.h5"]


def test_kinematics_holds_the_place_too(tmp_path):
    system, path = slider_crank(drive=cycloidal_spin_up(30.0, 1.0), angle=0.2), tmp_path / "run.h5"

    def meanwhile(done, all_):
        with pytest.raises(ResultsError, match="another run writes to it now"):
            run(path)

    assert kinematics(system, [0, 0.1, 0.2], output=path, progress=meanwhile).is_complete


def test_the_place_is_free_after_a_run_that_failed_or_was_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    path = tmp_path / "run.h5"

    def stop(progress):
        raise StopHereError

    with pytest.raises(StopHereError):
        run(path, progress=stop)
    assert resume(SYSTEM, path).is_complete
    code = """
        import os, sys
        from tests.floatframe.results.test_writer import run
        run(sys.argv[1], progress=lambda p: os.kill(os.getpid(), 9))
    """
    path.unlink()
    killed = subprocess.run([sys.executable, "-c", textwrap.dedent(code), str(path)], cwd=ROOT, check=False)
    assert killed.returncode == -9
    assert (tmp_path / "run.h5.segments" / "lock").exists()
    assert not read_results(path).is_complete
    assert run(path).is_complete


def test_segments_that_somebody_changed_are_no_motion(tmp_path, monkeypatch):
    """As two runs without a lock would: a segment of the same system from elsewhere, or one fewer."""
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)

    def interrupted(path):
        def stop(progress):
            if progress.n_steps >= 800:
                raise StopHereError

        with pytest.raises(StopHereError):
            integrate(SYSTEM, METHOD, 2.0, 1e-3, output=path, progress=stop)
        return path.with_name(path.name + ".segments")

    folder = interrupted(tmp_path / "a.h5")
    (folder / "000001.h5").unlink()
    with pytest.raises(ResultsError, match=r"000001\.h5 is missing"):
        read_results(tmp_path / "a.h5")
    folder = interrupted(tmp_path / "b.h5")
    (folder / "000002.h5").write_bytes((folder / "000001.h5").read_bytes())
    with pytest.raises(ResultsError, match="do not continue"):
        resume(SYSTEM, tmp_path / "b.h5")
    folder = interrupted(tmp_path / "c.h5")
    data = bytearray((folder / "000001.h5").read_bytes())
    data[3000] ^= 1
    (folder / "000001.h5").write_bytes(data)
    with pytest.raises(ResultsError, match="altered"):
        resume(SYSTEM, tmp_path / "c.h5")


def test_files_of_others_in_the_folder_stay(tmp_path):
    folder = tmp_path / "run.h5.segments"
    folder.mkdir()
    (folder / "thesis.txt").write_text("mine")
    assert run(tmp_path / "run.h5").is_complete
    assert (folder / "thesis.txt").read_text() == "mine"


def test_a_pipe_or_a_device_is_refused_and_stays(tmp_path):
    pipe = tmp_path / "run.h5"
    os.mkfifo(pipe)
    with pytest.raises(ResultsError, match="got a device or a pipe"):
        run(pipe)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with pytest.raises(ResultsError, match="got a device or a pipe"):
        run("/dev/stdout")


def test_an_input_is_not_overwritten(tmp_path):
    from dataclasses import replace

    source = tmp_path / "system.toml"
    source.write_text("mine")
    (tmp_path / "link.toml").symlink_to(source)
    for path in (source, tmp_path / "link.toml"):
        with pytest.raises(ResultsError, match="this is an input of the run"):
            integrate(replace(SYSTEM, source=str(source)), METHOD, 0.01, 1e-3, output=path)
    assert source.read_text() == "mine"


FULL = """
    import resource, sys
    from floatframe import integrate
    from tests.floatframe.results.test_results_file import SYSTEM, METHOD
    import floatframe.simulation.integrate as integration
    from floatframe.engine.kernels.entry import prepare
    prepare()
    for path, most, seconds in zip(*(sys.argv[k::3] for k in (1, 2, 3)), strict=True):
        integration.SEGMENT_SECONDS = float(seconds)
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(most), -1))
        try:
            integrate(SYSTEM, METHOD, 3.0, 1e-3, output=path)
            print("written")
        except Exception as error:
            print(type(error).__name__, error)
        resource.setrlimit(resource.RLIMIT_FSIZE, (-1, -1))
"""
LIMITS = ((1000, 0.0), (20_000, 0.0), (200_000, 0.0), (500_000, 1e9))


def test_a_full_disk_is_one_message_and_leaves_what_was_closed(tmp_path):
    """No file may grow beyond a limit: at the head, in a segment, at the joined file. HDF5 itself never meets it."""
    paths = [tmp_path / str(most) / "run.h5" for most, _ in LIMITS]
    words = []
    for path, (most, seconds) in zip(paths, LIMITS, strict=True):
        path.parent.mkdir()
        words += [str(path), str(most), str(seconds)]
    made = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(FULL), *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert made.returncode == 0
    assert "Traceback" not in made.stderr
    assert "HDF5" not in made.stderr
    for path, said, (most, seconds) in zip(paths, made.stdout.splitlines(), LIMITS, strict=True):
        assert said.startswith("ResultsError results file")
        assert "cannot be written: File too large" in said
        left = {each.name for each in path.parent.rglob("*")}
        assert not {name for name in left if name.endswith(".unfinished")}
        assert not path.exists()
        if most > 1000 and seconds == 0.0:
            assert not read_results(path).is_complete
