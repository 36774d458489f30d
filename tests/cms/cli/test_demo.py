import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
import typer

from cms.cli import demo
from cms.errors import JobError
from cms.jobs.job import read_job


def test_the_inputs_are_put_there_twice_without_complaint_and_the_job_is_a_good_one(tmp_path):
    folder = tmp_path / "new" / "demo"
    demo.put_inputs(folder)
    demo.put_inputs(folder)
    job = read_job(folder / "rod.toml")
    assert job.body.mesh == folder / "rod.msh"
    assert set(job.interfaces) == {"big_end", "small_end"}


@pytest.mark.parametrize("name", demo.JOBS)
def test_a_job_that_the_user_has_changed_is_not_overwritten(name, tmp_path):
    demo.put_inputs(tmp_path)
    (tmp_path / name).write_text("# mine")
    (tmp_path / "rod.msh").unlink()
    with pytest.raises(JobError, match=rf"{name}: is there already, with other contents.*cms demo FOLDER"):
        demo.put_inputs(tmp_path)
    assert (tmp_path / name).read_text() == "# mine"
    assert not (tmp_path / "rod.msh").exists()


def test_an_error_of_the_reduction_ends_the_process_that_compiles(monkeypatch, tmp_path):
    started = []
    popen = demo.subprocess.Popen
    command = [sys.executable, "-c", "import time; time.sleep(600)"]
    monkeypatch.setattr(demo.subprocess, "Popen", lambda _, **k: started.append(popen(command, **k)) or started[0])
    with pytest.raises(typer.Exit):
        demo.run_steps(tmp_path)  # without its inputs
    assert started[0].returncode is not None


@pytest.mark.parametrize("is_signalled", [True, False])
def test_a_later_command_runs_at_its_signal_alone(is_signalled, tmp_path):
    with ExitStack() as running:
        later = demo.begun(running, tmp_path, "floatframe --version", demo.RUN_LATER)
        if is_signalled:
            later.signal()
        else:
            later.worker.stdin.close()
        assert later.worker.wait() == 0
        later.said.seek(0)
        assert later.said.read().startswith(b"floatframe") == is_signalled


def test_the_compiling_process_compiles(monkeypatch, tmp_path):
    from floatframe.cli import compile_kernels

    steps = []
    monkeypatch.setattr(compile_kernels, "integrate", lambda *a, formulation: steps.append(formulation))
    compile_kernels.main()
    assert steps == ["absolute"]  # the demo needs no more
    compile_kernels.main(["relative"])
    assert steps[1:] == ["absolute", "relative"]
    assert Path(compile_kernels.__file__).name == "compile_kernels.py"


def test_what_a_command_of_the_demo_says_is_shown_and_its_failure_ends_the_demo(tmp_path, capfd):
    with ExitStack() as running:
        good = demo.begun(running, tmp_path, "cms --version")
        bad = demo.begun(running, tmp_path, "cms info missing.h5")
        demo.finish(tmp_path, good)
        with pytest.raises(typer.Exit) as ended:
            demo.finish(tmp_path, bad)
    said = capfd.readouterr().out
    assert "$ cms --version\n" in said
    assert "missing.h5" in said
    assert ended.value.exit_code == 2
