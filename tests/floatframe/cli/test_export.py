"""The command export: how it chooses its target, and options that belong to others."""

import inspect

import pytest

from floatframe.cli.export import TARGETS
from tests.floatframe.command import run_floatframe

PENDULUM = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]
[bodies.stick]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
position = [0.5, 0, 0]
[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "stick"
marker_a = [0, 0, 0]
axis = [0, 1, 0]
[sensors.tip]
type = "position"
body = "stick"
marker = [0.5, 0, 0]
[run]
t_end = 0.02
h = 1e-3
"""


def export(*words):
    return run_floatframe("export", *words)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    (folder / "swing.toml").write_text(PENDULUM)
    run_floatframe("run", folder / "swing.toml", code=0)
    return folder


@pytest.mark.parametrize(
    ("words", "written", "begin"),
    [
        ("swing.h5", "swing.csv", b"t [s],"),
        ("swing.h5 --to npz", "swing.npz", b"PK"),
        ("swing.h5 --to rpc --sensor tip.x", "swing.rsp", b"FORMAT"),
        ("swing.h5 -o out.json", "out.json", b"{"),
        ("swing.toml --to urdf", "swing.urdf", b"<?xml"),
        ("swing.toml -o other.urdf", "other.urdf", b"<?xml"),
        ("swing.toml --to python --what mass --name stick -o code", "code/stick_mass.py", b'r"""Mass matrix'),
        ("swing.toml --to fmu --out tip", "swing.fmu", b"PK"),
        ("swing.toml --to fmu-c -o unit.fmu --step 0.01", "unit.fmu", b"PK"),
    ],
)
def test_a_target_is_chosen_by_name_by_the_ending_or_by_default(folder, monkeypatch, words, written, begin):
    monkeypatch.chdir(folder)
    made = export(*words.split())
    assert made.exit_code == 0, made.output
    assert (folder / written).read_bytes().startswith(begin)
    assert f"wrote {written}" in made.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            "swing.toml",
            "--to: missing: expected --to with one of urdf, fmu, fmu-c, c, python, casadi, matlab, or a file",
        ),
        ("swing.toml -o swing.csv", "--output swing.csv: expected --to with one of urdf, fmu, "),
        (
            "swing.toml --to csv",
            "--to csv: needs a results file (.h5), got a system file (.toml) swing.toml; floatframe run",
        ),
        ("swing.h5 --to urdf", "--to urdf: needs a system file (.toml), got a results file (.h5) swing.h5"),
        ("swing.h5 --to cvs", "--to cvs: unknown target; did you mean 'csv'?"),
        ("swing.h5 --to csv -o swing.mat", "--output swing.mat: expected a file name that ends in .csv"),
        ("swing.toml --to urdf --fmi 3", "--fmi: belongs to --to fmu, fmu-c; --to urdf has --effort, --velocity"),
        ("swing.h5 --to vtk --every 5", "export: no body with a surface"),
        ("swing.h5 --every 2", "--every: belongs to --to vtk; --to csv has --sensor"),
        ("swing.toml --to fmu --parameter m", "--parameter m: expected NAME=KEY.PATH"),
        ("swing.toml --to fmu --fmi 0", "fmi: expected one of 2, 3, got 0"),
        ("swing.toml --to fmu-c --step 0", "step: expected a time above 0, got 0.0"),
        ("swing.toml --to urdf -o swing.toml", "--output swing.toml: would overwrite swing.toml, which is an input"),
    ],
)
def test_a_target_that_does_not_fit_is_refused_and_nothing_is_written(folder, monkeypatch, words, message):
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    made = export(*words.split())
    assert made.exit_code == 2
    assert message in made.stderr
    assert sorted(folder.iterdir()) == before


def test_every_option_belongs_to_a_target_and_every_target_is_in_the_help():
    shown = " ".join(export("--help").output.replace("│", " ").split())
    for key, target in TARGETS.items():
        assert key in shown
        for name in inspect.signature(target.write).parameters:
            if name not in ("file", "output", "ending", "language"):
                assert name.rstrip("s") in shown
