"""The targets c, python, casadi and matlab of `floatframe export`: the files that the function makes, and messages."""

import json

import pytest

import floatframe as ff
from floatframe.design.generation.generate import LANGUAGES
from floatframe.design.generation.routines import ROUTINES
from floatframe.files.system_file.read_system import read_system
from tests.floatframe.command import run_floatframe
from tests.floatframe.design.generation.examples import PENDULUM


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM)
    return path


def called(*words):
    return run_floatframe("export", *words)


def test_the_command_writes_what_the_function_returns(pendulum, tmp_path):
    folder = tmp_path / "code"
    made = called(
        pendulum, "--to", "c", "--what", "inverse", "--what", "mass", "--name", "stick", "-o", folder, "--json"
    )
    assert made.exit_code == 0, made.output
    record = json.loads(made.stdout)
    assert sorted(path.name for path in folder.iterdir()) == [
        "stick_inverse.c", "stick_inverse.h", "stick_mass.c", "stick_mass.h",
    ]  # fmt: skip
    code = ff.design.generate(read_system(pendulum)[0], name="stick_inverse")
    assert (folder / "stick_inverse.c").read_text() == code.files["stick_inverse.c"]
    # torque = (J + m l²) z_ddot - m g l cos z: two products, a difference, a cosine; M is a number
    counted = record["functions"]["stick_inverse"]
    assert (counted["additions"], counted["multiplications"], counted["functions"]) == (1, 2, 1)
    assert record["functions"]["stick_mass"]["multiplications"] == 0


@pytest.mark.parametrize("language", LANGUAGES)
def test_all_routines_of_all_languages_are_written(language, pendulum, tmp_path):
    folder = tmp_path / "code"
    wanted = [word for what in ROUTINES for word in ("--what", what)]
    made = called(pendulum, *wanted, "--to", language, "--name", "stick", "-o", folder, "--json")
    assert made.exit_code == 0, made.output
    record = json.loads(made.stdout)
    assert set(record["functions"]) == {f"stick_{what}" for what in ROUTINES}
    for what in ROUTINES:
        code = ff.design.generate(read_system(pendulum)[0], what=what, language=language, name=f"stick_{what}")
        for name, text in code.files.items():
            assert (folder / name).read_text() == text
            assert f"{code.name}" in text


def test_help_names_all_routines_and_languages():
    shown = " ".join(called("--help").output.replace("│", " ").split())
    for each in (*ROUTINES, *LANGUAGES):
        assert each in shown


def test_what_cannot_be_is_told_and_nothing_is_written(pendulum, tmp_path):
    folder = tmp_path / "code"
    made = called(pendulum, "--to", "casady", "-o", folder)
    assert made.exit_code != 0
    assert "--to casady: unknown target; did you mean 'casadi'?" in made.stderr
    assert not folder.exists()
    (tmp_path / "file").write_text("")
    made = called(pendulum, "--to", "c", "-o", tmp_path / "file")
    assert made.exit_code != 0
    assert "cannot be written" in made.output
