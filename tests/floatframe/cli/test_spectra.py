"""Spectra and choice of sensors on the command line, of results and of measured files."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.files import read_table
from floatframe.files.signals import Signals, read_signals, write_rpc
from tests.floatframe.command import run_floatframe

SPRING = """
[system]
units = "mm-t-s"

[bodies.box]
mass = 1e-3
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[bodies.shaft]
mass = 1e-3
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[joints.guide]
type = "prismatic"
body_a = "ground"
body_b = "box"
marker_b = [0, 0, 0]
axis = [1, 0, 0]

[joints.guide.motions.distance]
type = "harmonic"
amplitude = 2.0
omega = 125.66370614359172

[joints.hub]
type = "revolute"
body_a = "ground"
body_b = "shaft"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[joints.hub.motions.angle]
type = "polynomial"
coefficients = [0.0, 60.0, 20.0]

[sensors."box 1"]
type = "position"
body = "box"

[sensors."box 2"]
type = "acceleration"
body = "box"

[run]
t_end = 2.0
h = 5e-4
output_every = 4
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("spectra")
    (folder / "box.toml").write_text(SPRING)
    run_floatframe("run", folder / "box.toml", "-o", folder / "box.h5", code=0)
    return folder / "box.h5"


def table(path):
    with path.open() as file:
        head, *rows = csv.reader(file)
    return head, np.array(rows, dtype=float)


def test_the_amplitude_of_a_driven_box_stands_at_its_frequency(results, tmp_path):
    """2 mm at 20 Hz, the acceleration 2 (2 pi 20)² mm/s²; on a line of the resolution of 0.5 Hz (1000 samples)."""
    out = tmp_path / "a.csv"
    run_floatframe(
        "spectrum",
        results,
        "-s",
        "box ?.x",
        "--as",
        "amplitude",
        "--window",
        "flattop",
        "--resolution",
        1,
        "-o",
        out,
        code=0,
    )
    head, rows = table(out)
    assert head == ["frequency [Hz]", "box 1.x amplitude (peak) [mm]", "box 2.x amplitude (peak) [mm/s²]"]
    at = rows[:, 0] == 20.0
    assert_allclose(rows[at, 1:], [[2.0, 2 * (40 * np.pi) ** 2]], rtol=2e-3, atol=0)


def test_third_octaves_of_all_sensors_as_json_hold_the_mean_square(results, tmp_path):
    out = tmp_path / "a.json"
    run_floatframe("spectrum", results, "-s", "box 1.x", "--as", "third-octave", "--resolution", 1, "-o", out, code=0)
    found = read_table(out)
    (settings,) = found.meta["spectra"]
    assert (settings["kind"], settings["unit"], settings["name"]) == ("1/3 octave (rms)", "mm", "box 1.x")
    levels = dict(zip(found["frequency"].tolist(), found["box 1.x 1/3 octave (rms)"].tolist(), strict=True))
    near = min(levels, key=lambda f: abs(f - 20))
    assert_allclose(levels[near], np.sqrt(2.0), rtol=0.01, atol=0)


def test_orders_of_a_run_up_are_drawn_and_tabled(results, tmp_path):
    out = tmp_path / "a.csv"
    words = ["spectrum", results, "-s", "hub.angle.rate", "--as", "orders", "--rotation", "hub.angle"]
    run_floatframe(*words, "-o", out, code=0)
    with out.open() as file:
        head, *rows = csv.reader(file)
    assert head == ["name", "time [s]", "speed [rad/s]", "order", "amplitude (peak)", "unit"]
    speeds = np.array([[float(row[1]), float(row[2])] for row in rows])
    assert_allclose(speeds[:, 1], 60 + 40 * speeds[:, 0], rtol=1e-6, atol=0)
    picture = tmp_path / "a.png"
    run_floatframe("plot", results, "-s", "box 1.x", "--as", "orders", "--rotation", "hub.angle", "-o", picture, code=0)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("kind", ["psd", "octave", "waterfall", "amplitude"])
def test_every_kind_is_drawn(results, tmp_path, kind):
    path = tmp_path / "a.svg"
    run_floatframe("plot", results, "--sensor", "box 1", "--as", kind, "-o", path, code=0)
    text = path.read_text()
    assert "<svg" in text
    assert len(text) > 5000


def test_responses_between_channels_of_a_measured_file(tmp_path):
    t = np.arange(8192) / 1000
    x = np.random.default_rng(0).normal(size=8192)
    signals = Signals(t, np.stack([x, 3 * x], axis=1), ("force", "acc"), ("N", "g"))
    write_rpc(signals, tmp_path / "a.rsp")
    out = tmp_path / "h.csv"
    run_floatframe(
        "spectrum", tmp_path / "a.rsp", "-s", "ac*", "--as", "response", "--input", "force", "-o", out, code=0
    )
    head, rows = table(out)
    assert head[1] == "acc / force H1 [(g)/(N)]"
    assert_allclose(rows[1:-1, [1, 3, 5]], [[3, 3, 1]] * len(rows[1:-1]), rtol=1e-5, atol=0)
    run_floatframe("plot", tmp_path / "a.rsp", code=2)
    picture = tmp_path / "h.png"
    run_floatframe(
        "spectrum", tmp_path / "a.rsp", "-s", "acc", "--as", "response", "--input", "force", "-o", picture, code=0
    )


def test_sensors_are_chosen_for_export_by_name_column_and_wildcard(results, tmp_path):
    out = tmp_path / "a.csv"
    run_floatframe("export", results, "-s", "box 2.x", "-s", "hub*", "-o", out, code=0)
    head, rows = table(out)
    assert head[1] == "box 2.x x [mm/s²]"
    assert [name for name in head[2:] if not name.startswith("hub.angle")] == []
    assert len(rows) == 1001
    drive = tmp_path / "drive.drv"
    run_floatframe("export", results, "-s", "box 1.x", "-o", drive, code=0)
    found = read_signals(drive)
    assert (found.names, found.units) == (("box 1.x",), ("mm",))
    assert_allclose(found.values[:, 0], 2 * np.sin(40 * np.pi * found.time), rtol=0, atol=1e-6)


@pytest.mark.parametrize("command", ["plot", "export", "spectrum"])
def test_all_missing_names_are_told_with_the_nearest(results, tmp_path, command):
    before = list(tmp_path.iterdir())
    done = run_floatframe(command, results, "-s", "bxo 1", "-s", "box 1.xx", "-s", "hib*", "-o",
               tmp_path / ("a.png" if command == "plot" else "a.csv"), code=2)  # fmt: skip
    words = " ".join(done.stderr.split())
    for each in ("did you mean 'box 1'", "no column 'xx'", "'hib*': no sensor, column or coordinate matches"):
        assert each in words
    assert list(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["-s", "box 1.x", "--as", "spd"], "did you mean 'psd'"),
        (["-s", "box 1.x", "--as", "orders"], "expected the channel with the angle or the speed"),
        (["-s", "box 1.x", "--as", "orders", "--rotation", "box 1.x"], "expected an angle"),
        (["-s", "box 1.x", "--as", "response"], "expected the sensor that is its input"),
        (["-s", "box 1.x", "--resolution", "0.01"], "a segment of"),
        (["-s", "box 1.x", "--window", "han"], "did you mean 'hann'"),
        (["-s", "box 1.x", "-o", "a.xls"], "expected a file name that ends in .csv, .json"),
    ],
)
def test_impossible_spectra_are_refused(results, words, told):
    done = run_floatframe("spectrum", results, *words, code=2)
    assert told in " ".join(done.stderr.split())
