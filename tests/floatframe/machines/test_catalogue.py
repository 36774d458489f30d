"""Machines in a folder of one's own: the files as shipped, and refusals."""

import pytest

from floatframe.errors import ModelError
from floatframe.machines import MACHINES, copy_machine, machine_files
from tests.floatframe.command import run_floatframe


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_is_copied_as_it_is_shipped(name, tmp_path):
    targets = copy_machine(name, tmp_path / "mine")
    shipped = [path for path in targets if not path.name.endswith(".schema.json")]
    assert [path.read_bytes() for path in shipped] == [path.read_bytes() for path in machine_files(name)]
    assert {path.name for path in targets} - {path.name for path in shipped} >= {"system.schema.json"}
    assert "README.md" in [path.name for path in targets]
    assert any(path.suffix == ".toml" for path in targets)


@pytest.mark.parametrize("name", MACHINES)
def test_what_stands_there_is_kept(name, tmp_path):
    (tmp_path / "README.md").write_text("mine")
    with pytest.raises(ModelError, match="exists; copy it into another folder, nothing was written"):
        copy_machine(name, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["README.md"]


def test_the_files_of_the_machines_stay_short():
    """They were 17 123 lines before they had parameters, base files and repeated tables; a quarter is the limit."""
    files = [path for name in MACHINES for path in machine_files(name) if path.suffix == ".toml"]
    lines = sum(len(path.read_text("utf-8").splitlines()) for path in files)
    assert 1000 < lines <= 17123 / 4


def test_an_unknown_machine_is_refused_with_the_nearest():
    name = next(iter(MACHINES))
    with pytest.raises(ModelError, match=f"did you mean '{name}'"):
        machine_files(name[:-1] + "_")


def test_the_command_lists_them():
    outcome = run_floatframe("example", code=0)
    assert all(name in outcome.output for name in MACHINES)


def test_the_old_name_of_the_command_names_the_new_one():
    outcome = run_floatframe("machine", "kart", "-o", "mine")
    assert outcome.exit_code != 0
    assert "floatframe example kart -o mine" in outcome.output
