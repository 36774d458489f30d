"""The shake file, the command and its files, and what is told about bad ones."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from fe_models.files import read_table
from fe_models.foundation.documents.html import html_page
from floatframe.durability.shaking.page import shake_document
from floatframe.durability.shaking.record import light_record, shake_record, shake_table, size_of_curves
from floatframe.errors import SystemFileError
from tests.bodies import bar
from tests.floatframe.command import run_floatframe

FILE = """
body = "bar.h5"
title = "A bar"
[base]
interface = "left"
[damping]
Q = 25
[uncertainty]
factor = 1.1
[outputs.tip]
interface = "right"
quantities = ["acceleration", "displacement"]
[outputs.root]
position = [PLACE]
quantities = ["stress"]
[sine.qual]
level = [[5, 1.0], [100, 1.0]]
rate = 4.0
directions = ["z"]
[random.qual]
level = "level.csv"
directions = ["z"]
duration = 60.0
[shock.pulse]
pulse = "half-sine"
amplitude = 20.0
duration = 0.011
directions = ["z"]
[transient.launch]
file = "launch.csv"
inputs = { "left:z" = "a", "right:z" = "f" }
[notch.tip]
of = "sine.qual"
output = "tip acceleration z"
level = 10.0
[notch.load]
of = "random"
output = "left force z"
C = 1.4
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shake")
    part = cms.couple(bar(nx=3))
    body = cms.reduce(part, cms.craig_bampton(part, n_modes=3))
    cms.write(body, folder / "bar.h5")
    place = body.frame.origin + body.frame.axes @ body.nodes[4]
    (folder / "bar.toml").write_text(FILE.replace("PLACE", ", ".join(repr(float(x)) for x in place)))
    (folder / "level.csv").write_text("20 0.01\n80 0.04\n350 0.04\n2000 0.007\n")
    t = np.arange(0, 0.1, 5e-4)
    rows = np.column_stack([t, np.sin(60 * t), 100 * np.cos(90 * t)])
    lines = "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
    (folder / "launch.csv").write_text(f"time [s],a [g],f [N]\n{lines}\n")
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return ff.durability.shaking.shake(ff.durability.shaking.read_shake(folder / "bar.toml"))


def test_the_command_writes_page_record_and_table(folder):
    found = run_floatframe("shake", folder / "bar.toml", code=0)
    assert "1 g = 9.80665 m/s²" in found.output
    record = json.loads((folder / "bar.shake.json").read_text())
    with (folder / "bar.shake.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert record["units"]
    assert read_table(folder / "bar.shake.json")["output"].tolist() == [row["output"] for row in rows]
    page = (folder / "bar.shake.html").read_text()
    assert "http" not in page.split("<script")[0]
    for word in (
        "Sine qual, left:z",
        "Random qual",
        "Shock pulse",
        "Transient launch",
        "Cumulative effective mass",
        "Miles",
    ):
        assert word in page


def test_the_options_of_a_modal_file_make_the_same_run(folder):
    options = ["--base", "left", "--Q", "25", "--sine", "5:1,100:1", "--rate", "4", "--directions", "z", "--json"]
    found = run_floatframe("shake", folder / "bar.h5", *options, code=0)
    columns = {each["name"]: each["values"] for each in json.loads(found.stdout)["table"]["columns"]}
    own = dict(zip(columns["output"], columns["value"], strict=True))
    job = ff.durability.shaking.shake(ff.durability.shaking.read_shake(folder / "bar.toml"))
    names = [output.name for output in job.sine[0].outputs]
    expected = job.sine[0].peaks[names.index("tip acceleration z")] / 9.80665
    assert_allclose(own["right acceleration z"], expected, rtol=1e-12)


def test_record_and_table_tell_the_runs_in_their_units(result):
    record = shake_record(result)
    run = record["random"][0]
    k = [output["name"] for output in run["outputs"]].index("tip acceleration z")
    assert_allclose(run["rms"][k], result.random[0].rms[k] / 9.80665, rtol=1e-12)
    assert run["outputs"][k]["unit"] == "g"
    assert_allclose(run["input_rms"][0], 6.058, rtol=1e-3)
    assert record["modes"][-1]["cumulative"][2] <= 1.0
    assert json.loads(json.dumps(record, allow_nan=False)) == record
    table = shake_table(result)
    is_run = (table["kind"] == "random") & (table["test"] == run["test"]) & (table["direction"] == run["direction"])
    is_output = table["output"] == "tip acceleration z"
    assert_allclose(table["value"][is_run & is_output], [run["rms"][k]], rtol=1e-6)


def back_in(light, arrays):
    """The record with its curves put back."""
    if isinstance(light, dict) and set(light) == {"array", "shape"}:
        assert list(arrays[light["array"]].shape) == light["shape"]
        return arrays[light["array"]].tolist()
    if isinstance(light, dict):
        return {key: back_in(value, arrays) for key, value in light.items() if key != "curves"}
    return [back_in(each, arrays) for each in light] if isinstance(light, list) else light


def test_a_long_record_has_its_curves_in_a_file_of_arrays(folder, result, monkeypatch):
    record = shake_record(result)
    n = size_of_curves(record)
    monkeypatch.setattr("floatframe.durability.shaking.record.MOST_NUMBERS", n)
    assert light_record(record, "a.npz") == (record, {})  # few numbers stay
    monkeypatch.setattr("floatframe.durability.shaking.record.MOST_NUMBERS", 1000)
    found = run_floatframe("shake", folder / "bar.toml", "-o", folder / "long.json", code=0)
    assert "long.npz" in found.output
    light = json.loads((folder / "long.json").read_text())
    assert light["curves"] == {"file": "long.npz", "key": "array", "missing": "NaN"}
    assert light["random"][0]["densities"]["array"] == "random/0/densities"
    assert light.pop("table")["format"] == "floatframe table"
    with np.load(folder / "long.npz") as arrays:
        assert back_in(light, arrays) == record
    assert (folder / "long.json").stat().st_size < 0.2 * len(json.dumps(record))


def test_a_file_takes_bands_with_slopes_and_damped_sines(folder):
    text = (folder / "bar.toml").read_text()
    text = text.replace('"level.csv"', '[[20, 80, "+3 dB/oct"], [80, 350, 0.04], [350, 2000, "-3 dB/oct"]]')
    old = 'pulse = "half-sine"\namplitude = 20.0\nduration = 0.011'
    new = 'srs = [[100, 300, "+6 dB/oct"], [300, 1000, 50]]\nshapes = "damped-sines"\ndecay = 0.04'
    assert old in text
    path = folder / "slopes.toml"
    path.write_text(text.replace(old, new))
    job = ff.durability.shaking.read_shake(path)
    assert_allclose(job.random[0].level.at(np.array([20.0, 100, 2000])), [0.01, 0.04, 0.007], rtol=0.01)
    shock = next(test for test in job.shock if test.name == "pulse")
    assert_allclose(shock.synthesis.target[0], 50 / 3 ** (6 / 20 / np.log10(2)), rtol=1e-12)
    assert np.abs(shock.synthesis.decibels).max() < 1.0
    assert shock.words.startswith("damped sines made for a spectrum of Q = 10, met within -")
    for bad, words in ((('"damped-sines"\ndecay', '"wavelets"\ndecay'), "decay belongs to an srs"),
                       (('"+6 dB/oct"', '"+6 dB"'), "expected a slope"),
                       (('[300, 1000, 50]', '[300, 1000, true]'), "band 2: expected")):  # fmt: skip
        path.write_text(text.replace(old, new).replace(*bad))
        with pytest.raises((SystemFileError, ff.errors.ModelError), match=words):
            ff.durability.shaking.read_shake(path)


def test_a_transient_takes_accelerations_and_forces_of_a_file(result):
    run = next(run for run in result.time if run.test == "launch")
    assert run.inputs == ("left:z", "right:z")
    assert_allclose(run.input_values[0].max(), 9.80665, rtol=1e-3)
    assert_allclose(run.input_values[1].max(), 100.0, rtol=1e-6)


def test_names_are_escaped_on_the_page(result):
    from dataclasses import replace

    assert "<b>bold" not in html_page(shake_document(replace(result, job=replace(result.job, title="<b>bold</b>"))))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('interface = "left"', 'interface = "lft"', "left"),
        ("Q = 25", "Q = 25\nratio = 0.1", "either ratio or Q"),
        ("Q = 25", "", "got nothing"),
        ("level = [[5, 1.0], [100, 1.0]]", "level = [[5, 1.0], [4, 1.0]]", "sine.qual: level: row 2: 4 Hz after 5 Hz"),
        ("level = [[5, 1.0], [100, 1.0]]", "level = [[5, 1.0], [40, 0.0]]", "expected a level above 0"),
        ("level = [[5, 1.0], [100, 1.0]]", "level = [[5, 1.0], [40, nan]]", "row 2: expected 2 finite numbers"),
        ("level = [[5, 1.0], [100, 1.0]]", "level = [5, 1.0]", "row 1: expected 2 finite numbers"),
        ("Q = 25", "bands = [[200, 2000]]", "row 1: expected 3 finite numbers"),
        ('level = "level.csv"', 'level = "leve.csv"', "no such file"),
        ('pulse = "half-sine"', 'pulse = "half-sin"', "half-sine"),
        ('of = "sine.qual"', 'of = "sine.quad"', "choices: sine.qual"),
        ('output = "tip acceleration z"\nlevel', 'output = "tip accel z"\nlevel', "tip acceleration z"),
        ("level = 10.0", "level = 1e-4", "requires a notch of"),
        ("rate = 4.0", "rate = 4.0\nspeed = 3", "unknown key"),
        ('quantities = ["stress"]', 'quantities = ["strain"]', "unknown quantity"),
        ('directions = ["z"]\n[random', 'directions = ["w"]\n[random', "no base direction"),
        ('"left:z" = "a"', '"left:z" = "b"', "b"),
        ('body = "bar.h5"', "", "either body, a modal file, or system"),
        ("duration = 0.011", "", "needs amplitude and duration"),
        (
            "[notch.load]",
            '[notch.rms]\nof = "random"\noutput = "tip acceleration z"\nrms = 1e-12\n[notch.load]',
            "a notch of",
        ),
        ("[notch.tip]", "[spectra]\nQ = [0.1]\n[notch.tip]", "Q: expected numbers above 0.5"),
        ("[notch.tip]", "[spectra]\nQ = []\n[notch.tip]", "Q: expected numbers above 0.5"),
        ("[notch.tip]", "[spectra]\nfirst = 100.0\nlast = 10.0\n[notch.tip]", "expected rising frequencies"),
    ],
)
def test_bad_files_are_refused_in_words(folder, old, new, words):
    text = (folder / "bar.toml").read_text()
    assert old in text
    path = Path(folder / "bad.toml")
    path.write_text(text.replace(old, new))
    found = run_floatframe("shake", path, "-o", folder / "bad.csv", code=2)
    assert words in found.output
    assert not (folder / "bad.csv").exists()


def test_levels_of_a_file_are_told_with_their_line(folder):
    (folder / "wrong.csv").write_text("20 0.01\n80 -0.04\n")
    path = folder / "bad.toml"
    path.write_text((folder / "bar.toml").read_text().replace("level.csv", "wrong.csv"))
    with pytest.raises(SystemFileError, match=r"wrong.csv, line 2: -0.04 g2/Hz at 80 Hz"):
        ff.durability.shaking.read_shake(path)
