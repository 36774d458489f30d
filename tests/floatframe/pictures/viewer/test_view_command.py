"""The command `floatframe view`: what it writes, and its messages."""

import pytest

from cms.body.modal_file.file import write
from tests.floatframe.cli.examples import FLEXIBLE, PENDULUM, RIGID
from tests.floatframe.command import run_floatframe
from tests.floatframe.pictures.viewer.pages import ReadPage
from tests.synthetic import synthetic_reduced_body


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    (folder / "swing.toml").write_text(RIGID + '\n[[bodies.stick.shapes]]\ntype = "box"\nsize = [1.0, 0.1, 0.1]\n')
    (folder / "pendulum.toml").write_text(PENDULUM)
    run_floatframe("run", folder / "swing.toml", code=0)
    return folder


def test_a_page_stands_beside_the_results_and_the_command_says_what_it_leaves_out(folder):
    result = run_floatframe("view", folder / "swing.h5", code=0)
    assert "interpolated linearly" in result.output
    read = ReadPage(folder / "swing.html")
    assert [piece["carrier"] for piece in read.record["pieces"] if piece["kind"] == "body"] == [1]
    assert ["results", "swing.h5"] in read.record["sources"]


def test_a_system_file_gives_its_modes_or_its_equilibrium(folder):
    run_floatframe("view", folder / "pendulum.toml", code=0)
    assert ReadPage(folder / "pendulum.html").record["kind"] == "modes"
    run_floatframe("view", folder / "pendulum.toml", "--rest", "-o", folder / "rest.html", code=0)
    assert ReadPage(folder / "rest.html").record["facts"][0] == "equilibrium"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["swing.h5", "-o", "swing.gif"], "ends in .html"),
        (["swing.h5", "--color", "stress"], "expected one of displacement, von-mises"),
        (["swing.h5", "--color", "von-mises"], "all are rigid"),
        (["swing.h5", "--rest"], "is a motion"),
        (["swing.h5", "--largest", "0.2"], "too small"),
        (["swing.h5", "--sensor", "pim.angle"], "pin.angle"),
        (["swing.npz"], "give the system file"),
        (["none.h5"], "none.h5"),
        (["pendulum.toml", "--sensor", "a"], "expected results (.h5)"),
        (["pendulum.toml", "--magnification", "2"], "amplitude of a mode is arbitrary"),
    ],
)
def test_messages_name_what_was_expected(folder, monkeypatch, arguments, words):
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    result = run_floatframe("view", *arguments, code=2)
    assert words in " ".join(result.stderr.split())
    assert sorted(folder.iterdir()) == before


def test_a_modal_file_that_is_gone_or_another_is_named(folder):
    write(synthetic_reduced_body(), folder / "part.h5")
    (folder / "spin.toml").write_text(FLEXIBLE)
    run_floatframe("run", folder / "spin.toml", code=0)
    write(synthetic_reduced_body(seed=1), folder / "part.h5")
    assert "has changed since" in run_floatframe("view", folder / "spin.h5").stderr
    (folder / "part.h5").unlink()
    assert "no such file" in run_floatframe("view", folder / "spin.h5").stderr
    (folder / "spin.toml").unlink()
    assert "put the modal file back" in " ".join(run_floatframe("view", folder / "spin.h5").stderr.split())
