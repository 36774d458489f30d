"""Where commands may write: never over what they read, to pipes and devices as they stand."""

import os
import stat
import subprocess
import sys
import threading

import pytest
from typer.testing import CliRunner

from cms.cli.app import app as cms_app
from floatframe.cli.app import app
from tests.campaign.jobs import JOB
from tests.campaign.plain_mesh import FORMATS, bar
from tests.campaign.systems import SYSTEM
from tests.floatframe.command import run_floatframe
from tests.root import ROOT

FLEXIBLE = """
[system]
units = "mm-t-s"
[bodies.bar]
file = "bar.h5"
[run]
t_end = 1e-4
h = 1e-5
"""
STUDY = """
system = "system.toml"
analysis = "modes"
[parameters.mass]
path = "bodies.ball.mass"
values = [1.0]
[outputs.first]
of = "frequency 1"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("outputs")
    for name, text in {"bar.msh": FORMATS["msh"](*bar()), "job.toml": JOB, "system.toml": SYSTEM, "study.toml": STUDY,
                       "flexible.toml": FLEXIBLE}.items():  # fmt: skip
        (folder / name).write_text(text)
    for program, command, name, out in (
        (cms_app, "reduce", "job.toml", "bar.h5"),
        (app, "run", "flexible.toml", "run.h5"),
    ):
        assert CliRunner().invoke(program, [command, str(folder / name), "-o", str(folder / out)]).exit_code == 0
    (folder / "beams").mkdir()
    (folder / "beams" / "nodes.csv").write_text("1, 0, 0, 0\n2, 1, 0, 0\n")
    (folder / "beams" / "lines.csv").write_text("1, 1, 2, tube\n")
    (folder / "beams" / "job.toml").write_text("""
[body]
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"
[materials.steel]
young = 2.1e11
poisson = 0.3
density = 7850.0
[sections.tube]
lines = "tube"
shape = "circle"
radius = 0.01
[interfaces.left]
kind = "nodes"
nearest = {point = [0, 0, 0]}
[reduction]
set = "guyan"
""")
    return folder


@pytest.mark.parametrize("words", [
    "cms reduce job.toml -o bar.msh", "cms reduce job.toml -o job.toml", "cms reduce beams/job.toml -o beams/nodes.csv",
    "cms reduce beams/job.toml -o beams/lines.csv", "floatframe run flexible.toml -o bar.h5",
    "floatframe run flexible.toml -o flexible.toml", "floatframe export run.h5 -o run.h5",
    "floatframe export run.h5 -o bar.h5",
    "floatframe linearize flexible.toml -o bar.h5", "floatframe linearize flexible.toml -o flexible.toml",
    "floatframe kinematics flexible.toml -o bar.h5", "floatframe sweep study.toml -o system.toml",
    "cms frame bar.h5 --to buckens -o bar.h5",
])  # fmt: skip
def test_no_command_writes_over_what_it_reads(folder, words):
    program, command, *rest = words.split()
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    arguments = [str(folder / word) if "." in word and not word.startswith("-") else word for word in rest]
    result = CliRunner().invoke({"cms": cms_app, "floatframe": app}[program], [command, *arguments])
    assert result.exit_code == 2
    assert "is an input" in result.stderr
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_table_and_a_modal_file_go_into_a_pipe(folder, tmp_path):
    for program, words, name, begin in (
        (app, ["export", str(folder / "run.h5")], "table.csv", b"t"),
        (cms_app, ["frame", str(folder / "bar.h5"), "--to", "tisserand"], "bar.h5", b"floatframe modal-file"),
    ):
        pipe, got = tmp_path / name, []
        os.mkfifo(pipe)
        reader = threading.Thread(target=lambda pipe=pipe, got=got: got.append(pipe.read_bytes()))
        reader.start()
        result = CliRunner().invoke(program, [*words, "-o", str(pipe)])
        reader.join(20)
        assert result.exit_code == 0, result.output
        assert got[0].startswith(begin)
        assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
@pytest.mark.parametrize("words", [
    ["floatframe.cli", "--help"], ["cms.cli", "--version"],
    ["cms.cli", "info", str(ROOT / "tests/cms/body/modal_file/data/version_1.h5"), "--json"],
])  # fmt: skip
def test_a_full_standard_output_is_one_message(words):
    with open("/dev/full", "w") as full:
        made = subprocess.run(
            [sys.executable, "-m", *words], stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT, check=False
        )
    assert made.returncode == 2
    assert made.stderr.startswith("error: ")
    assert "No space left on device" in made.stderr
    assert len(made.stderr.splitlines()) == 1


def test_what_is_written_in_parts_refuses_a_pipe(folder, tmp_path):
    for words, name in (
        (["run", str(folder / "flexible.toml")], "out.h5"),
        (["animate", str(folder / "run.h5")], "out.gif"),
    ):
        os.mkfifo(tmp_path / name)
        result = run_floatframe(*words, "-o", tmp_path / name, code=2)
        assert "device or a pipe" in result.stderr
        assert stat.S_ISFIFO((tmp_path / name).stat().st_mode)
