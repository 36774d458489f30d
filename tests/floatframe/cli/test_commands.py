import json
import logging
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from cms.body.modal_file.file import write
from cms.cli.app import app as cms_app
from cms.cli.console import Notes
from floatframe.cli.app import app
from floatframe.pictures.animation import bodies_of
from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.export import run_record
from floatframe.results.trajectory import read_trajectory
from tests.cms.command import assert_refused
from tests.floatframe.cli.examples import FLEXIBLE, RIGID
from tests.floatframe.command import run_floatframe
from tests.root import ROOT, heed_signals
from tests.synthetic import synthetic_reduced_body

PROGRAM = [sys.executable, "-c", "from floatframe.cli import main; main()"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / "swing.toml").write_text(RIGID)
    return tmp_path


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """The results of the rigid pendulum, computed by the command."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "swing.toml").write_text(RIGID)
    run_floatframe("run", folder / "swing.toml", code=0)
    return folder / "swing.h5"


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() if p.is_file() else b"" for p in sorted(folder.iterdir())}


def test_run_computes_the_motion_that_the_file_describes(results):
    """The stick falls about the pin: energy gives its speed at the last position."""
    trajectory = read_trajectory(results)
    assert trajectory.is_complete
    motion = trajectory.body("stick")
    height = motion.r[-1, 2]
    inertia_about_pin = 0.2 + 2.0 * 0.5**2
    omega = np.linalg.norm(motion.omega_B[-1])
    assert_allclose(0.5 * inertia_about_pin * omega**2, -2.0 * 9.81 * height, rtol=1e-4)
    assert sorted(p.name for p in results.parent.iterdir()) == ["swing.h5", "swing.toml"]


def test_run_prints_steps_balance_and_drift(folder):
    result = run_floatframe("run", folder / "swing.toml", "-o", folder / "out.h5", code=0)
    for word in ("500", "Newton iterations", "wall time", "energy defect", "kinetic", "pin", "wrote"):
        assert word in result.stdout
    assert sorted(contents(folder)) == ["out.h5", "swing.toml"]


def test_a_flexible_body_runs_from_its_modal_file(folder):
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "spin.toml").write_text(FLEXIBLE)
    run_floatframe("run", folder / "spin.toml", code=0)
    record = run_record(read_trajectory(folder / "spin.h5"))
    assert record["bodies"][0]["n_modes"] == 5
    assert len(record["bodies"][0]["digest"]) == 64


def test_info_shows_the_run(results):
    result = run_floatframe("info", results, code=0)
    for word in ("swing", "m-kg-s", "stick", "GeneralizedAlpha", "rho_inf = 0.8", "energy defect", "pin"):
        assert word in result.stdout
    record = json.loads(run_floatframe("info", results, "--json").stdout)
    assert record["n_steps"] == 500
    assert record["t_last"] == 0.5
    assert record["energy_defect"] < 1e-4
    assert record["drift"]["pin"]["distance"] < 1e-9


@pytest.mark.parametrize(
    ("suffix", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml"), pytest.param("pdf", b"%PDF", marks=pytest.mark.long)]
)
def test_plot_draws_a_picture(results, tmp_path, suffix, magic):
    run_floatframe("plot", results, "-o", tmp_path / f"swing.{suffix}", code=0)
    assert (tmp_path / f"swing.{suffix}").read_bytes().startswith(magic)
    assert sorted(contents(tmp_path)) == [f"swing.{suffix}"]


def test_plot_writes_more_than_eight_panels_as_pages(folder):
    """Five panels of every motion and four sensors are nine: a second picture, or a second page of the .pdf."""
    sensors = [f'[sensors.at_{k}]\ntype = "position"\nbody = "stick"\nmarker = [{k}, 0, 0]\n' for k in range(4)]
    text = (folder / "swing.toml").read_text()
    (folder / "swing.toml").write_text("\n".join([text, *sensors]))
    for words in (("run", "swing.toml"), ("plot", "swing.h5"), ("plot", "swing.h5", "-o", "swing.pdf")):
        run_floatframe(words[0], *(folder / word if "." in word else word for word in words[1:]), code=0)
    assert {"swing.png", "swing-2.png", "swing.pdf"} < set(contents(folder))
    assert "swing-3.png" not in contents(folder)
    assert (folder / "swing.pdf").read_bytes().count(b"/Type /Page ") == 2


def test_plot_goes_without_the_modal_files_and_says_so(folder):
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "spin.toml").write_text(FLEXIBLE)
    run_floatframe("run", folder / "spin.toml", code=0)
    assert "note" not in run_floatframe("plot", folder / "spin.h5").stderr
    (folder / "part.h5").unlink()
    result = run_floatframe("plot", folder / "spin.h5", code=0)
    assert result.stderr.startswith("note: elastic displacement is omitted")


def test_plot_refuses_other_kinds_of_files(results, tmp_path):
    assert_refused(run_floatframe("plot", results, "-o", tmp_path / "swing.jpg"), ".png, .svg, .pdf")
    assert_refused(run_floatframe("plot", results, "-o", results), "this is an input; choose another name")
    assert contents(tmp_path) == {}


def test_animate_draws_a_film(results, tmp_path):
    run_floatframe("animate", results, "-o", tmp_path / "swing.gif", "--speed", "100", code=0)
    assert (tmp_path / "swing.gif").read_bytes().startswith(b"GIF8")
    assert sorted(contents(tmp_path)) == ["swing.gif"]


@pytest.mark.parametrize(("options", "words"), [
    (["-o", "swing.avi"], ".gif or .mp4"),
    (["-o", "nowhere/swing.gif"], "does not exist"),
    (["--speed", "-1"], "speed"),
    (["--fps", "0"], "fps"),
])  # fmt: skip
def test_animate_refuses_what_it_cannot_draw(results, tmp_path, monkeypatch, options, words):
    (tmp_path / "swing.h5").write_bytes(results.read_bytes())
    monkeypatch.chdir(tmp_path)
    assert_refused(run_floatframe("animate", "swing.h5", *options), words)
    assert sorted(contents(tmp_path)) == ["swing.h5"]


def test_animate_refuses_a_modal_file_that_has_changed(folder):
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "spin.toml").write_text(FLEXIBLE)
    run_floatframe("run", folder / "spin.toml", code=0)
    write(synthetic_reduced_body(seed=1), folder / "part.h5")
    before = contents(folder)
    assert_refused(run_floatframe("animate", folder / "spin.h5"), "part.h5", "has changed")
    (folder / "part.h5").unlink()
    assert_refused(run_floatframe("animate", folder / "spin.h5"), "part.h5", "no such file")
    assert sorted(contents(folder)) == sorted(set(before) - {"part.h5"})


def test_the_energy_defect_is_the_balance_over_the_energy_that_moves(results):
    trajectory = read_trajectory(results)
    energies = trajectory.energies
    total = energies.kinetic + energies.gravity
    assert_allclose(balance_defect(trajectory), total - total[0], rtol=0, atol=1e-13 * energy_scale(trajectory))
    assert_allclose(energy_scale(trajectory), max(energies.kinetic.max(), np.ptp(energies.gravity)), rtol=1e-14)


@pytest.mark.parametrize(("old", "new", "words"), [
    ('units = "m-kg-s"', 'units = "m-kg"', ["system.units", "did you mean 'm-kg-s'?"]),
    ("mass = 2.0", "mass = -2.0", ["bodies.stick.mass = -2.0: expected a number above 0"]),
    ("mass = 2.0", "mass = nan", ["bodies.stick.mass = nan"]),
    ("mass = 2.0", "maas = 2.0", ["bodies.stick.maas: unknown key; did you mean 'mass'?"]),
    ('type = "revolute"', 'type = "revolut"', ["joints.pin.type", "did you mean 'revolute'?"]),
    ('body_b = "stick"', 'body_b = "stik"', ["joints.pin.body_b", "did you mean 'stick'?"]),
    ("h = 1e-3", "h = 0", ["run.h = 0: expected a number above 0"]),
    ("h = 1e-3", "", ["run.h: missing"]),
    ("[run]", "[rum]", ["rum: unknown key; did you mean 'run'?"]),
    ("mass = 2.0\n", 'file = "part.h5"\n', ["bodies.stick.file", "no such file"]),
    ("[run]", "[run", ["not valid TOML"]),
])  # fmt: skip
def test_a_bad_system_file_ends_in_one_message_and_leaves_nothing(folder, old, new, words):
    assert RIGID.count(old) == 1
    (folder / "swing.toml").write_text(RIGID.replace(old, new))
    before = contents(folder)
    assert_refused(run_floatframe("run", folder / "swing.toml"), *words)
    assert contents(folder) == before


def test_a_damaged_modal_file_is_refused(folder):
    write(synthetic_reduced_body(), folder / "part.h5")
    damaged = (folder / "part.h5").read_bytes()
    (folder / "part.h5").write_bytes(damaged[:-100])
    (folder / "spin.toml").write_text(FLEXIBLE)
    before = contents(folder)
    assert_refused(run_floatframe("run", folder / "spin.toml"), "part.h5", "truncated")
    (folder / "part.h5").write_bytes(damaged[:4000] + bytes([damaged[4000] ^ 8]) + damaged[4001:])
    assert_refused(run_floatframe("run", folder / "spin.toml"), "part.h5", "altered")
    assert sorted(contents(folder)) == sorted(before)


def test_bodies_in_other_units_are_converted_with_a_note(folder, caplog):
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "spin.toml").write_text(FLEXIBLE.replace("mm-t-s", "m-kg-s"))
    run_floatframe("run", folder / "spin.toml", "-o", folder / "spin.h5", code=0)
    assert "part.h5 is in units mm-t-s: converted to those of the system, m-kg-s" in caplog.text
    part = bodies_of(read_trajectory(folder / "spin.h5"))["part"]
    assert_allclose(part.nodes, synthetic_reduced_body().nodes / 1000, rtol=1e-14)


@pytest.mark.parametrize("chosen", ["is_rigid = true", "modes = [0, 1]"])
def test_a_body_with_selected_modes_is_plotted_filmed_and_exported(folder, chosen):
    """The modal file has five modes, and the system file says which of them move."""
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "spin.toml").write_text(FLEXIBLE.replace("omega_B", f"{chosen}\nomega_B"))
    run_floatframe("run", folder / "spin.toml", code=0)
    results = folder / "spin.h5"
    for words in (["plot"], ["animate", "--speed", "0.1"], ["export", "--to", "csv"], ["export", "--to", "vtk"]):
        result = run_floatframe(words[0], results, *words[1:])
        assert (result.exit_code, result.stderr) == (0, ""), words
    assert {"spin.png", "spin.gif", "spin.csv", "spin.pvd"} < set(contents(folder))
    (folder / "spin.toml").unlink()
    assert_refused(run_floatframe("animate", results), "part.h5 has 5 modes, but its motion has", "put it back")


def test_the_output_is_checked_before_the_work(folder):
    for output, words in [
        ("nowhere/out.h5", "does not exist"),
        ("swing.toml", "this is an input"),
        (".", "folder"),
    ]:
        assert_refused(run_floatframe("run", folder / "swing.toml", "-o", folder / output), words)
    assert sorted(contents(folder)) == ["swing.toml"]


@pytest.mark.parametrize("command", ["info", "plot", "animate"])
def test_a_file_that_holds_no_results_is_refused(folder, command, results, monkeypatch):
    monkeypatch.chdir(folder)  # messages cut long paths
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "text.h5").write_text("no results")
    (folder / "short.h5").write_bytes(results.read_bytes()[:3000])
    for name in ("part.h5", "text.h5", "short.h5", "missing.h5"):
        before = contents(folder)
        assert_refused(run_floatframe(command, name), name)
        assert contents(folder) == before


def test_an_interrupted_run_can_be_read_and_leaves_the_old_results(folder, results):
    """`results` comes first, so that the kernels are compiled and the run gets to its steps at once."""
    (folder / "swing.h5").write_bytes(b"the old results")
    (folder / "swing.toml").write_text(RIGID.replace("t_end = 0.5", "t_end = 1e5"))
    often = "import floatframe.simulation.integrate as i; i.SEGMENT_SECONDS = 0.5; "
    with subprocess.Popen(
        [*PROGRAM[:2], often + PROGRAM[2], "run", "swing.toml", "--watch", "off"],
        cwd=folder,
        env=ENVIRONMENT,
        preexec_fn=heed_signals,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        try:
            segments = folder / "swing.h5.segments"
            while not (segments / "000001.h5").is_file() and process.poll() is None:
                time.sleep(0.1)  # the first segment holds the start, the second one steps
            process.send_signal(signal.SIGINT)
            _, error = process.communicate()
        finally:
            process.kill()
    assert process.returncode == 130, error
    assert error.startswith("error: interrupted")
    assert "Traceback" not in error
    assert (folder / "swing.h5").read_bytes() == b"the old results"
    result = run_floatframe("info", segments, code=0)
    assert "did not reach its end" in result.stdout


def test_help_names_the_commands_and_loads_nothing_heavy():
    script = PROGRAM[2].replace("main()", "\ntry: main()\nfinally: import sys; print(sorted(sys.modules))")
    result = subprocess.run([sys.executable, "-c", script, "--help"], env=ENVIRONMENT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    for command in ("run", "info", "plot", "animate"):
        assert command in result.stdout
    loaded = result.stdout[result.stdout.rindex("[") :]
    for heavy in ("numpy", "scipy", "h5py", "pydantic", "pyvista", "numba", "matplotlib"):
        assert f"'{heavy}'" not in loaded


@pytest.mark.parametrize(
    ("program", "name", "now"),
    [
        (app, "eig", "floatframe modes swing.toml."),
        (app, "study", "floatframe compare swing.toml."),
        (app, "reduce", "cms reduce swing.toml."),
        (app, "urdf", "floatframe export swing.toml --to urdf."),
        (app, "fmu", "floatframe export swing.toml --to fmu."),
        (app, "generate", "floatframe export swing.toml --to c (or python, casadi, matlab, fmu-c)."),
        (cms_app, "study", "floatframe compare swing.toml for models of a body in a mechanism"),
    ],
)
def test_a_command_under_another_name_is_answered_with_its_name_here(program, name, now):
    result = CliRunner().invoke(program, [name, "swing.toml"])
    assert result.exit_code == 2
    assert f"No such command '{name}'. Use {now}" in " ".join(result.output.replace("│", " ").split())


GROUPS = {
    "cms": {
        "Model": "demo job faces converge split schema",
        "Reduce": "run reduce modes frame family interpolate",
        "Judge": "check accept compare correlate frf",
        "Exchange": "import export recovery formats",
        "Look": "info view show",
    },
    "floatframe": {
        "Start": "demo example check",
        "Compute": "run resume static modes campbell response linearize kinematics inverse",
        "Look": "info plot animate view spectrum show",
        "Vary": "sweep optimize compare gradient",
        "Assess": "shake fatigue identify",
        "Exchange": "import export",
        "Setup": "prepare schema",
    },
}


@pytest.mark.parametrize("program", [app, cms_app])
def test_the_help_of_a_program_fits_a_screen(program):
    """46 lines of 80 columns; each command has one line, in the group of its work."""
    lines = CliRunner().invoke(program, ["--help"], env={"COLUMNS": "80"}).output.splitlines()
    assert len(lines) <= 46
    assert max(map(len, lines)) <= 80
    text = "\n".join(lines[lines.index("") + 1 :])
    found = {part.split()[0]: re.findall(r"^ (\S+)", part, re.MULTILINE) for part in re.split(r"\n(?=\w)", text)}
    assert found.pop("Options") == ["--version", "--debug", "--install-completion", "-h,"]
    assert found == {name: words.split() for name, words in GROUPS[program.info.name].items()}


@pytest.mark.parametrize(("name", "meant"), [("machine", "example NAME"), ("urdf", "export FILE --to urdf")])
def test_a_command_under_another_name_says_what_it_takes(name, meant):
    shown = " ".join(run_floatframe(name).output.replace("│", " ").split())
    assert f"Use floatframe {meant}." in shown


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_of_a_shell_offers_the_targets_of_export(shell):
    typed = {"COMP_WORDS": "floatframe export arm.toml --to fm", "COMP_CWORD": "4",
             "_TYPER_COMPLETE_ARGS": "floatframe export arm.toml --to fm",
             "_TYPER_COMPLETE_FISH_ACTION": "get-args"}  # fmt: skip
    environment = ENVIRONMENT | typed | {"_FLOATFRAME_COMPLETE": f"complete_{shell}"}
    result = subprocess.run(PROGRAM, env=environment, capture_output=True, text=True)
    assert "fmu-c" in result.stdout, result.stderr
    assert "urdf" not in result.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_of_a_shell_offers_the_commands(shell):
    typed = {"COMP_WORDS": "floatframe anim", "COMP_CWORD": "1", "_TYPER_COMPLETE_ARGS": "floatframe anim",
             "_TYPER_COMPLETE_FISH_ACTION": "get-args"}  # fmt: skip
    environment = ENVIRONMENT | typed | {"_FLOATFRAME_COMPLETE": f"complete_{shell}"}
    result = subprocess.run(PROGRAM, env=environment, capture_output=True, text=True)
    assert "animate" in result.stdout, result.stderr


def test_version():
    assert run_floatframe("--version").stdout.startswith("floatframe ")


def test_info_of_a_system_file_names_the_command_that_tells_of_it(tmp_path):
    path = tmp_path / "stick.toml"
    path.write_text(RIGID)
    result = run_floatframe("info", path, code=2)
    assert f"try floatframe check {path}" in " ".join(result.output.split())


def test_resume_asks_for_the_system_file_where_it_gets_the_results(results):
    result = run_floatframe("resume", results, code=2)
    assert "expected the system file (TOML) of the run, got its results" in " ".join(result.output.split())
    assert "resume swing.toml -o" in " ".join(result.output.split())


def test_a_note_is_printed_once_also_with_the_full_path_of_its_file(capsys):
    notes = Notes()
    for text in ("a.toml: unused", f"{os.getcwd()}/a.toml: unused", "b.toml: unused"):
        notes.handle(logging.makeLogRecord({"msg": text, "levelno": logging.WARNING}))
    assert capsys.readouterr().err.splitlines() == ["note: a.toml: unused", "note: b.toml: unused"]
