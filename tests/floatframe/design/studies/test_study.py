"""Parameter studies against closed forms; points that fail are rows; mistakes in the file are answered in words."""

import csv
import json
import logging
import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.files import read_table
from fe_models.foundation.toml_file import FileContent, changed
from floatframe import GeneralizedAlpha, integrate
from floatframe.design.studies.study import StudyPoint, report_notes, run_study
from floatframe.design.studies.study_file import read_study
from floatframe.errors import SystemFileError
from floatframe.files.system_file.read_system import read_system
from floatframe.results.sensors import measured
from tests.floatframe.cli.examples import PENDULUM
from tests.floatframe.command import answer_of_floatframe

SENSOR = '\n[sensors.tip]\ntype = "velocity"\nbody = "rod"\nmarker = [1, 0, 0]\n'
STUDY = """
system = "pendulum.toml"
analysis = "modes"

[parameters.gravity]
path = "system.gravity.1"
values = [-9.81, -1.62]

[parameters.mass]
path = "bodies.rod.mass"
first = 1.0
last = 4.0
number = 3
scale = "log"

[outputs.swing]
of = "frequency 1"
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pendulum.toml").write_text(PENDULUM.replace("\n[run]", SENSOR + "\n[run]"))
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def sweep(*words, code=0):
    return answer_of_floatframe("sweep", *words, code=code)


def swing_of(mass, g):
    """Frequency of the rod: inertia 1/6 about its middle, at half a metre from the hinge."""
    return np.sqrt(mass * g * 0.5 / (1 / 6 + mass * 0.25)) / (2 * np.pi)


def test_frequencies_of_a_grid_are_those_of_the_textbook_in_its_order(folder):
    table = run_study(read_study(folder / "study.toml"), workers=1)
    assert [row.values for row in table.rows] == [(g, m) for g in (-9.81, -1.62) for m in (1.0, 2.0, 4.0)]
    exact = [swing_of(m, -g) for g, m in (row.values for row in table.rows)]
    assert_allclose(table.column("swing"), exact, rtol=1e-8)
    assert table.units == ("Hz",)


def test_set_gives_other_keys_one_value_at_all_points(folder):
    (folder / "mass.toml").write_text(STUDY.replace('[parameters.gravity]\npath = "system.gravity.1"\nvalues = '
                                                    "[-9.81, -1.62]\n", ""))  # fmt: skip
    words = "-j", 1, "--set", "system.gravity=[0, -1.62, 0]"
    record = json.loads(sweep(folder / "mass.toml", *words, "--json"))
    found = [point["outputs"]["swing"] for point in record["points"]]
    assert_allclose(found, [swing_of(mass, 1.62) for mass in (1.0, 2.0, 4.0)], rtol=1e-8)
    assert "another system, other parameters" in sweep(folder / "mass.toml", "-j", 1, code=2)
    assert "did you mean" in sweep(folder / "mass.toml", "--set", "system.gravty=1", "--journal", folder / "x", code=2)
    words = "--set", "bodies.rod.mass=3", "--journal", folder / "x"
    assert "parameter 'mass' varies this key" in sweep(folder / "mass.toml", *words, code=2)


def test_a_file_given_by_set_is_an_input_of_the_study(folder):
    """The digest of the journal covers its content."""
    (folder / "pendulum.toml").write_text(PENDULUM + '\n[signals.push]\nfile = "push.csv"\nunit = "-"\n')
    for name in ("push", "pull"):
        (folder / f"{name}.csv").write_text("t,v\n0,0\n1,1\n2,0\n3,1\n")
    (folder / "study.toml").write_text(STUDY)
    words = folder / "study.toml", "-j", 1, "--set", 'signals.push.file="pull.csv"'
    sweep(*words)
    (folder / "pull.csv").write_text("t,v\n0,0\n1,2\n2,0\n3,1\n")
    assert "journal is of another system" in sweep(*words, code=2)


@pytest.mark.long  # with processes alone below; what a cluster does with tasks: tests/fe_models/foundation/tasks
def test_points_of_a_cluster_give_the_table_of_this_process(folder):
    pytest.importorskip("distributed")
    for name, workers in (("one", "1"), ("dask", "dask:1")):
        sweep(folder / "study.toml", "-j", workers, "-o", folder / f"{name}.csv", "--journal", folder / name)
    assert (folder / "one.csv").read_bytes() == (folder / "dask.csv").read_bytes()


def test_points_in_other_processes_give_one_table_csv_json_and_picture(folder):
    for name, workers in (("one", "1"), ("two", "2")):
        files = ("out.json", "out.png", "out.html") if name == "two" else ()
        more = [word for file in files for word in ("-o", folder / file)]
        text = sweep(
            folder / "study.toml", "-j", workers, "-o", folder / f"{name}.csv", "--journal", folder / name, *more
        )
        assert "swing [Hz]" in text
    assert (folder / "one.csv").read_bytes() == (folder / "two.csv").read_bytes()
    with open(folder / "two.csv", newline="") as file:
        names, *rows = csv.reader(file)
    assert names == ["gravity", "mass", "swing [Hz]", "error"]
    assert_allclose([float(row[2]) for row in rows], [swing_of(float(m), -float(g)) for g, m, _, _ in rows], rtol=1e-8)
    record = json.loads((folder / "out.json").read_text())
    assert record["points"][3]["parameters"] == {"gravity": -1.62, "mass": 1.0}
    assert float(rows[3][2]) == record["points"][3]["outputs"]["swing"]
    table = read_table(folder / "out.json")
    assert table.names == ("gravity", "mass", "swing", "error")
    assert table["swing"].tolist() == [float(row[2]) for row in rows]
    assert (folder / "out.png").read_bytes().startswith(b"\x89PNG")
    page = (folder / "out.html").read_text()
    assert "swing [Hz]" in page
    assert all(f"{float(row[2]):.6g}" in page for row in rows)


def test_a_cluster_that_does_not_answer_is_told(folder):
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        words = sweep(folder / "study.toml", "-j", f"dask://127.0.0.1:{nobody.getsockname()[1]}", code=2)
    assert "no Dask scheduler answers" in words
    assert not (folder / "study.csv").exists()


def test_a_second_call_takes_the_journal_and_gives_the_same_table(folder):
    study, journal = read_study(folder / "study.toml"), folder / "study.journal"
    whole = run_study(study, workers=1, journal=journal)
    lines = journal.read_bytes().splitlines(keepends=True)
    assert len(lines) == 1 + 6
    journal.write_bytes(b"".join(lines[:3]) + lines[3][:20])  # killed while it wrote the third point
    again = run_study(study, workers=1, journal=journal)
    assert (again.n_known, again.rows) == (2, whole.rows)
    text = STUDY.replace("[-9.81, -1.62]", "[-9.81, -3.72, -1.62]").replace("number = 3", "number = 2")
    (folder / "study.toml").write_text(text)
    assert "4 of 6 points were in the journal" in sweep(folder / "study.toml", "-j", 1)
    (folder / "pendulum.toml").write_text(PENDULUM.replace("mass = 2.0", "mass = 2.5"))
    words = sweep(folder / "study.toml", "-j", 1, code=2)
    assert "this journal is of another system" in words
    journal.write_text("notes\nof mine\n")
    assert "expected a journal of floatframe sweep" in sweep(folder / "study.toml", "-j", 1, code=2)
    assert journal.read_text() == "notes\nof mine\n"


def test_runs_are_those_of_the_changed_system_and_failures_are_rows(folder):
    (folder / "study.toml").write_text("""
system = "pendulum.toml"
combine = "together"
workers = 1
[parameters.mass]
path = "bodies.rod.mass"
values = [1.0, 0.0, 3.0]
[parameters.h]
path = "run.h"
values = [1e-2, 1e-2, 2e-2]
[outputs.fastest]
of = "tip size"
take = "greatest"
[outputs.angle]
of = "hinge.angle value"
[outputs.mean]
of = "hinge.angle rate"
take = "mean"
""")
    text = sweep(folder / "study.toml")
    assert "failed at mass = 0, h = 0.01" in text
    assert "bodies.rod.mass = 0.0: expected a number above 0" in text
    assert "1 of 3 points failed" in text
    with open(folder / "study.csv", newline="") as file:
        names, first, second, third = csv.reader(file)
    assert names[2:] == ["fastest [m/s]", "angle [rad]", "mean [rad/s]", "error"]
    assert second[2:5] == ["", "", ""]
    assert "expected a number above 0" in second[5]
    system, _ = read_system(folder / "pendulum.toml", {"bodies.rod.mass": 3.0})
    motion = integrate(system, GeneralizedAlpha(), 1.0, 2e-2)
    assert float(third[2]) == measured(system, motion)["tip"].columns["size"].max()
    assert_allclose(float(first[4]), float(first[3]), rtol=0.05)  # the mean rate over one second


def test_a_note_of_many_points_is_told_once(folder, monkeypatch, caplog):
    """The notes of the six points differ in a number."""

    def noted(self, system, given):
        logging.getLogger("floatframe").warning("mass %g is large", system.bodies[0].mass)
        return plain(self, system, given)

    plain = StudyPoint.motion
    monkeypatch.setattr(StudyPoint, "motion", noted)
    (folder / "study.toml").write_text(STUDY.replace('"modes"', '"static"').replace('"frequency 1"', '"hinge.angle"'))
    for n_known in (0, 6):  # the notes are in the journal too
        caplog.clear()
        table = run_study(read_study(folder / "study.toml"), workers=1, journal=folder / "study.journal")
        assert table.n_known == n_known
        assert [row.notes for row in table.rows][:2] == [("mass 1 is large",), ("mass 2 is large",)]
        assert [text for text in caplog.messages if "large" in text] == ["mass 1 is large (and at 5 more points)"]


def test_the_watch_of_the_run_is_that_of_all_points(folder):
    study = replace(read_study(folder / "study.toml"), analysis="run")
    for changes, watch in (({}, "stop"), ({"run.watch": "tell"}, "tell")):
        system, given = read_system(study.system, changes)
        assert StudyPoint(study).motion(system, given).head.run["watch"] == watch


def test_notes_on_two_numbered_bodies_are_both_told(caplog):
    report_notes([("body 'arm1': 2 modes", "body 'arm2': 2 modes"), ("body 'arm2': 3 modes",)])
    assert caplog.messages == ["body 'arm1': 2 modes", "body 'arm2': 2 modes (and at 1 more point)"]


def test_what_nobody_foresaw_is_a_row_too(folder, monkeypatch):
    def fails_once(system, **options):
        if system.bodies[0].mass == 2.0:
            raise RuntimeError("a fault\nof the program")
        return found(system, **options)

    import floatframe.design.studies.study as study

    found = study.linearize
    monkeypatch.setattr(study, "linearize", fails_once)
    table = run_study(read_study(folder / "study.toml"), workers=1)
    assert [row.error for row in table.rows] == ["", "RuntimeError: a fault of the program", ""] * 2
    assert_allclose(table.column("swing")[[0, 2]], [swing_of(1, 9.81), swing_of(4, 9.81)], rtol=1e-6)


def test_equilibria_and_driven_motions_can_be_varied_too(folder):
    text = STUDY.replace('"modes"', '"static"').replace('"frequency 1"', '"hinge.angle value"')
    (folder / "study.toml").write_text(text)
    table = run_study(read_study(folder / "study.toml"), workers=1)
    assert_allclose(np.abs(table.column("swing")), np.pi / 2, rtol=1e-8)
    drive = '\n[joints.hinge.motions.angle]\ntype = "harmonic"\namplitude = 1.0\nomega = 2.0\n'
    (folder / "pendulum.toml").write_text(PENDULUM.replace("\n[run]", drive + "\n[run]").replace("1e-3", "5e-2"))
    text = STUDY.replace('"modes"', '"inverse"').replace('"frequency 1"', '"hinge.angle force"\ntake = "first"')
    (folder / "study.toml").write_text(text)
    table = run_study(read_study(folder / "study.toml"), workers=1)
    assert_allclose(table.column("swing"), [m * -g * 0.5 for g, m in (row.values for row in table.rows)], rtol=1e-9)
    assert table.units == ("N m",)


def test_study_without_any_result_says_why_and_fails(folder):
    (folder / "study.toml").write_text(STUDY.replace("values = [-9.81, -1.62]", 'values = ["down"]'))
    message = sweep(folder / "study.toml", "-j", 1, code=2)
    assert "no point gave a result; the first one:" in message
    assert "system.gravity" in message


@pytest.mark.parametrize(("old", "new", "words"), [
    ('"pendulum.toml"', '"pendulm.toml"', "no such file"),
    ('"modes"', '"mode"', "did you mean 'modes'"),
    ('"system.gravity.1"', '"system.gravity.7"', "expected an index of 0 to 2, got '7'"),
    ('"bodies.rod.mass"', '"bodies.rodd.mass"', "there is no 'rodd'; did you mean 'rod'"),
    ('"bodies.rod.mass"', '"bodies.rod.maas"', "unknown key; did you mean 'mass'"),
    ('"frequency 1"', '"frequncy 1"', "expected one of frequency, damping, real, imaginary"),
    ("number = 3\n", "", "expected values, or first, last and number"),
    ("first = 1.0", "first = -1.0", "expected first and last above 0"),
    ('analysis = "modes"', 'combine = "together"', "expected as many values of each parameter, got gravity 2, mass 3"),
    ('analysis = "modes"', 'analysis = "run"', "no sensor or joint coordinate 'frequency 1'; choices: hinge"),
    ("[outputs.swing]\nof = \"frequency 1\"", "[outputs]", "expected one table [outputs.NAME] at least"),
])  # fmt: skip
def test_mistakes_are_answered_before_any_work(folder, old, new, words):
    assert STUDY.count(old) == 1
    (folder / "study.toml").write_text(STUDY.replace(old, new))
    assert words in sweep(folder / "study.toml", code=2)
    assert sorted(path.name for path in folder.iterdir()) == ["pendulum.toml", "study.toml"]


def test_column_of_a_sensor_is_named_with_its_choices(folder):
    text = STUDY.replace('"modes"', '"run"').replace('"frequency 1"', '"{}"')
    for of, words in (
        ("tip", "has the columns x, y, z, size"),
        ("tip siz", "did you mean 'size'"),
    ):
        (folder / "study.toml").write_text(text.format(of))
        assert words in sweep(folder / "study.toml", code=2)


def test_values_are_changed_by_key_path_and_names_may_hold_dots():
    content = FileContent({"a": {"b.c": {"d": [1, [2, 3]]}, "b": 4}}, Path("file.toml"))
    found = changed(content, {"a.b.c.d.1.0": 9, "a.b": 5, "a.new": 6}, "file", SystemFileError)
    assert found == {"a": {"b.c": {"d": [1, [9, 3]]}, "b": 5, "new": 6}}
    assert content["a"]["b"] == 4
    for path in ("a.b.x", "x.y", "a.b.c.d.2.0"):
        with pytest.raises(SystemFileError, match="key path"):
            changed(content, {path: 1}, "file", SystemFileError)
