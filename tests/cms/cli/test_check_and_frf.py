import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_reduction.frf import resonance_grid
from cms.assessment.quality.reference.port_model import file_resonances, frf
from cms.body.modal_file.file import read, write
from cms.cli.frf import parse_band, parse_component
from cms.jobs.job import read_job
from cms.pipeline import reduce_job
from fe_models.files import read_table
from tests.bodies import box_mesh
from tests.cms.command import assert_refused, run_cms
from tests.decks import JOB, write_deck

FRF = ("--from", "left", "--to", "right", "--band", "100:30000:60")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A job of a bar, its modal file, one file with a wrong sign, one of a poorer mode set and one in other units."""
    folder = tmp_path_factory.mktemp("quality")
    write_deck(folder / "bar.inp", box_mesh(6, 2, 2, 100.0, 10.0, 10.0, "hexahedron"))
    (folder / "bar.toml").write_text(JOB.replace("n_modes = 3", "n_modes = 12"))
    good = reduce_job(read_job(folder / "bar.toml"))
    write(good, folder / "bar.h5")
    C1 = np.array(good.moments.C1)
    C1[:, 0] *= -1
    write(replace(good, moments=replace(good.moments, C1=C1)), folder / "wrong.h5")
    (folder / "poor.toml").write_text(JOB.replace("n_modes = 3", "n_modes = 0"))
    write(reduce_job(read_job(folder / "poor.toml")), folder / "poor.h5")
    (folder / "metres.toml").write_text(
        JOB.replace("mm-t-s", "mm-kg-ms").replace("210000", "210").replace("7.85e-9", "7.85e-6")
    )
    return folder


def test_a_good_file_passes_with_exit_code_0(folder):
    result = run_cms("check", folder / "bar.h5", code=0)
    for word in ("free-frequencies", "Quality of bar", "tolerance", "pass"):
        assert word in result.stdout
    assert "fail" not in result.stdout
    assert "give its job with --job" in result.stdout


def test_a_wrong_sign_in_the_file_fails_with_exit_code_1(folder):
    result = run_cms("check", folder / "wrong.h5", code=1)
    assert "a mass moment has a wrong sign" in result.stdout
    assert "bar fails: " in result.stdout


def test_the_json_of_a_check_is_its_records(folder):
    result = run_cms("check", folder / "wrong.h5", "--json", code=1)
    told = json.loads(result.stdout)
    assert (told["body"], told["verdict"]) == ("bar", "fail")
    by_name = {record["name"]: record for record in told["records"]}
    assert by_name["free-frequencies"]["verdict"] == "fail"
    assert by_name["symmetry"]["verdict"] == "pass"
    assert set(by_name["symmetry"]) == {"name", "title", "value", "tolerance", "verdict", "reason", "action", "data"}


def test_with_its_job_a_file_is_compared_with_the_full_model(folder):
    """The job of the poor file with the number of modes of the good one is the job of the good one."""
    job = folder / "poor.toml", "--set", "reduction.n_modes=12"
    result = run_cms("check", folder / "bar.h5", "--job", *job, "--json", "--band", "10000")
    told = {record["name"]: record for record in json.loads(result.stdout)["records"]}
    assert result.exit_code == 0, told
    assert told["frequency-error"]["data"]["band_hz"] == 10000
    assert "default" not in told["frequency-error"]["reason"]
    shown = run_cms("check", folder / "bar.h5", "--job", *job, "--json").stdout
    told_by_default = {record["name"]: record for record in json.loads(shown)["records"]}
    assert "this band is the default" in told_by_default["frequency-error"]["reason"]
    assert told["same-body"]["verdict"] == told["frequency-response"]["verdict"] == "pass"
    assert "interface-stiffening" in told


def test_the_file_of_another_job_fails(folder):
    result = run_cms("check", folder / "poor.h5", "--job", folder / "bar.toml", "--json", code=1)
    told = {record["name"]: record for record in json.loads(result.stdout)["records"]}
    assert told["same-body"]["verdict"] == "fail"
    assert "job" in told["same-body"]["action"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "nothing.h5"], ["nothing.h5"]),
        (["check", "bar.toml"], ["bar.toml"]),
        (["check", "bar.h5", "--band", "1000"], ["--band", "--job"]),
        (["check", "bar.h5", "--set", "n=1"], ["--set", "--job"]),
        (["check", "bar.h5", "--job", "bar.toml", "--set", "n=1"], ["there is no parameter 'n'"]),
        (["accept", "bar.h5", "--set", "n=1"], ["--set", "--job"]),
        (["accept", "bar.h5", "--full", "bar.toml", "-o", "a.json", "--set", "n=1"], ["there is no parameter 'n'"]),
        (["compare", "bar.toml", "--set", "n=1"], ["there is no parameter 'n'"]),
        (["modes", "bar.toml", "--set", "n=1"], ["there is no parameter 'n'"]),
        (["converge", "bar.toml", "--set", "n=1"], ["there is no parameter 'n'"]),
        (["converge", "bar.toml", "--ratio", "2"], ["--ratio 2", "bar.toml has one mesh", "leave --ratio out"]),
        (["modes", "bar.toml", "--set", "n=1", "--set", "n = 2"], ["--set n = 2", "'n' already has a value"]),
        (["converge", "bar.toml", "--error", "inf"], ["--error inf: expected a number above 0"]),
        (["converge", "bar.toml", "--error", "nan"], ["--error nan: expected a number above 0"]),
        (["frf", "bar.h5", *FRF, "--set", "n=1"], ["--set", "--job"]),
        (["frf", "bar.h5", *FRF, "--job", "bar.toml", "--set", "n=1"], ["there is no parameter 'n'"]),
        (["check", "bar.h5", "--job", "nothing.toml"], ["nothing.toml"]),
        (["check", "bar.h5", "--job", "bar.toml", "--band", "-5"], ["expected a frequency above 0"]),
        (["check", "bar.h5", "--job", "metres.toml"], ["mm-kg-ms", "mm-t-s"]),
        (["frf", "bar.h5", *FRF[:4], "--band", "10-50"], ["expected lowest:highest"]),
        (["frf", "bar.h5", *FRF[:4], "--band", "50:10"], ["0 < lowest < highest"]),
        (["frf", "bar.h5", *FRF[:4], "--band", "0:10"], ["0 < lowest < highest"]),
        (["frf", "bar.h5", "--from", "lft", *FRF[2:]], ["no interface 'lft'", "did you mean 'left'"]),
        (["frf", "bar.h5", *FRF, "-c", "uq"], ["'uq' is no component"]),
        (["frf", "bar.h5", *FRF, "-c", "uz/fz"], ["'fz' is no component"]),
        (["frf", "bar.h5", *FRF, "-o", "frf.txt"], [".png", ".csv"]),
        (["frf", "bar.h5", *FRF, "-o", "nowhere/frf.png"], ["does not exist"]),
        (["frf", "bar.h5", *FRF, "--damping", "-1"], ["expected a ratio of 0 or more"]),
        (["frf", "bar.h5", *FRF, "--job", "metres.toml"], ["mm-kg-ms", "mm-t-s"]),
    ],
)
def test_bad_input_is_refused_in_one_message(folder, monkeypatch, arguments, words):
    monkeypatch.chdir(folder)
    before = sorted(p.name for p in folder.iterdir())
    assert_refused(run_cms(*arguments), *words)
    assert sorted(p.name for p in folder.iterdir()) == before


def test_the_table_of_a_response_is_that_of_the_function(folder, tmp_path):
    path = tmp_path / "frf.csv"
    result = run_cms("frf", folder / "bar.h5", *FRF, "-c", "uz", "-c", "rz/uy", "--inertance", "-o", path, code=0)
    with path.open() as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == [
        "frequency [Hz]", "reduced uz/fz real [mm/s²/N]", "reduced uz/fz imag [mm/s²/N]",
        "reduced rz/fy real [rad/s²/N]", "reduced rz/fy imag [rad/s²/N]",
    ]  # fmt: skip
    values = np.array(rows[1:], dtype=float)
    reduced = read(folder / "bar.h5")
    grid = resonance_grid(parse_band("100:30000:60"), *file_resonances(reduced))
    assert len(grid) > 60
    wanted = frf(reduced, grid).between("left", "right").inertance
    assert_allclose(values[:, 0], grid, rtol=0)
    assert_allclose(values[:, 1] + 1j * values[:, 2], wanted[:, 2, 2], rtol=0)
    assert_allclose(values[:, 3] + 1j * values[:, 4], wanted[:, 5, 1], rtol=0)
    assert "mm/s²/N" in result.stdout
    assert "rad/s²/N" in result.stdout


def test_the_full_model_is_drawn_over_the_reduced_one(folder, tmp_path):
    picture, table = tmp_path / "frf.png", tmp_path / "frf.csv"
    result = run_cms("frf", folder / "bar.h5", *FRF, "--job", folder / "bar.toml", "-o", picture, "-o", table, code=0)
    assert "Against the full model: below 5 % up to" in result.stdout
    assert "1 % in every free-free mode" in result.stdout
    assert picture.read_bytes()[:4] == b"\x89PNG"
    values = read_table(table)
    own, full = values["reduced uz/fz"].real, values["full uz/fz"].real
    low = values["frequency"] < 5000
    assert_allclose(own[low], full[low], rtol=0.02)
    assert np.abs(own - full).max() > 0


def test_bands_and_components_are_read_as_written():
    assert_allclose(parse_band("1:100:3"), [1, 10, 100], rtol=1e-12)
    assert len(parse_band("1:100")) == 400
    assert parse_component("uz") == (2, 2)
    assert parse_component("rx/uy") == (3, 1)
    with pytest.raises(QualityError):
        parse_band("1:2:3:4")
