"""TOML beyond all measure: one short message with the key."""

from pathlib import Path

import numpy as np
import pytest

from cms.errors import JobError
from cms.jobs.job import read_job
from fe_models.foundation.toml_file import read_toml
from fe_models.foundation.words import nearest, quoted
from floatframe import integrate
from floatframe.errors import SystemFileError
from floatframe.files.system_file.read_system import read_system

RIGID = """
[system]
units = "m-kg-s"
[bodies.stick]
mass = 2.0
inertia = [[0.01, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
[run]
t_end = 0.5
h = 1e-3
"""


def refusal(folder, text):
    path = folder / "system.toml"
    path.write_text(text)
    with pytest.raises(SystemFileError) as error:
        read_system(path)
    message = str(error.value)
    assert message.startswith(str(path))
    assert len(message) < 600
    return message.removeprefix(str(path))


@pytest.mark.parametrize(("old", "new", "words"), [
    ("[run]", "[more]\na = " + "[" * 900 + "]" * 900 + "\n[run]", "nested too deeply"),
    ("[run]", "[more]\na = " + "[" * 30 + "]" * 30 + "\n[run]", "nested too deeply; expected up to 20 levels"),
    ("2.0", "1" + "0" * 401, "bodies.stick.mass = a whole number of more than 100 digits: expected a number"),
    ("2.0", "1" + "0" * 5000, "a number has too many digits"),
    ("0.01", "1e101", "bodies.stick.inertia.0.0 = 1e+101: expected a number"),
    ('"m-kg-s"', '"' + "m" * 3000 + '"', "unknown unit system"),
    ("mass = 2.0", "k" * 3000 + " = 2.0", "unknown key"),
    ("mass = 2.0", "\n".join(f"key_{k} = 1" for k in range(1000)), "and 982 more"),
])  # fmt: skip
def test_what_is_beyond_all_measure_is_refused_in_a_short_message(tmp_path, old, new, words):
    if "982" in words:
        path = tmp_path / "system.toml"
        path.write_text(RIGID.replace(old, new))
        with pytest.raises(SystemFileError, match=r"\.\.\. and \d+ more") as error:
            read_system(path)
        assert len(str(error.value).splitlines()) <= 22
        return
    assert words in refusal(tmp_path, RIGID.replace(old, new, 1))


def test_a_run_without_end_is_refused_before_it_begins(tmp_path):
    path = tmp_path / "system.toml"
    path.write_text(RIGID.replace("0.5", "1e30"))
    system, run = read_system(path)
    with pytest.raises(ValueError, match=r"has 1.0e\+33 steps, expected at most 1e\+12"):
        integrate(system, run.integrator, run.t_end, run.h)
    with pytest.raises(SystemFileError, match=r"are 1.0e\+33 times"):
        run.output_times()


def test_a_job_is_read_with_the_same_care(tmp_path):
    (tmp_path / "job.toml").write_text("[body]\nmesh = " + "[" * 5000 + "]" * 5000)
    with pytest.raises(JobError, match="nested too deeply"):
        read_job(tmp_path / "job.toml")


def test_devices_are_not_read():
    with pytest.raises(JobError, match="expected a file, got a device or a pipe"):
        read_toml(Path("/dev/zero"), JobError)


def test_names_and_choices_are_shortened():
    assert len(quoted("x" * 1000)) == 80
    assert quoted("rod") == "'rod'"
    with np.printoptions(legacy=False):  # some packages change it when they are imported
        assert quoted(np.eye(2)) == "array([[1., 0.], ..."
    assert quoted(10**5000) == "<int>"
    assert len(nearest("x" * 10**6, [f"{k:0500d}" for k in range(1000)])) < 4000
    assert nearest("rid", ["rod", "bob"]) == "; did you mean 'rod'? choices: bob, rod"
