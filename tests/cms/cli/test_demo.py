import logging
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
import typer

from cms.cli import demo
from cms.cli.console import commands, run
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
def test_later_commands_run_at_their_signal_alone(is_signalled, tmp_path):
    with ExitStack() as running:
        later = demo.begun(running, tmp_path, ["--version", "schema system -o s.json"])
        if is_signalled:
            demo.signal(later)
        else:
            later.stdin.close()
        said = later.stdout.read().decode()
        assert later.wait() == 0
    assert (f"{tmp_path}$ floatframe --version\nfloatframe" in said) == is_signalled
    assert (tmp_path / "s.json").exists() == is_signalled


def test_the_compiling_process_compiles(monkeypatch, tmp_path):
    from floatframe.cli import compile_kernels

    steps = []
    monkeypatch.setattr(compile_kernels, "integrate", lambda *a, formulation: steps.append(formulation))
    compile_kernels.main()
    assert steps == ["absolute"]  # the demo needs no more
    compile_kernels.main(["relative"])
    assert steps[1:] == ["absolute", "relative"]
    assert Path(compile_kernels.__file__).name == "compile_kernels.py"


def test_what_commands_of_the_demo_say_is_shown_and_the_first_failure_ends_it(tmp_path, capfd):
    with ExitStack() as running:
        later = demo.begun(running, tmp_path, ["--version", "info missing.h5", "schema system -o s.json"])
        demo.signal(later)
        with pytest.raises(typer.Exit) as ended:
            demo.finish(later)
    said = capfd.readouterr().out
    assert "$ floatframe --version\nfloatframe" in said
    assert said.count("missing.h5") >= 2  # the command, and its error
    assert "s.json" not in said
    assert ended.value.exit_code == 2


def test_a_note_is_printed_once_by_each_of_several_commands(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["notes", "note"])
    app = commands("notes", "A program.")

    @app.command()
    def note() -> None:
        logging.getLogger("anything").warning("a word")

    @app.command()
    def other() -> None:
        pass

    for _ in range(2):
        with pytest.raises(SystemExit):
            run(app, "notes")
        assert capsys.readouterr().err == "note: a word\n"
