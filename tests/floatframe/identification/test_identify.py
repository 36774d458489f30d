"""The command: a measured motion in, base parameters, report and JSON out; what a file lacks is said."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from floatframe import ModelError, linear_form, read_system, tree_samples
from floatframe.cli.app import app
from floatframe.identification.excitation import ExcitingMotion
from floatframe.identification.measured_file import read_measured

ROBOT = """
[system]
name = "two links"
units = "m-kg-s"
gravity = [0, -9.81, 0]

[bodies.upper]
mass = 4.0
inertia = [[0.02, 0, 0], [0, 0.1, 0], [0, 0, 0.11]]
center_of_mass = [0.25, 0.02, 0]

[bodies.lower]
mass = 2.0
inertia = [[0.01, 0, 0], [0, 0.04, 0], [0, 0, 0.045]]
center_of_mass = [0.2, 0, 0]
position = [0.5, 0, 0]

[joints.shoulder]
type = "revolute"
body_a = "ground"
body_b = "upper"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[joints.elbow]
type = "revolute"
body_a = "upper"
body_b = "lower"
marker_b = [0, 0, 0]
axis = [0, 0, 1]
"""
NAMES = ("shoulder/angle", "elbow/angle")
FRICTION = np.array([1.5, 0.8, 2.0, 1.2])  #: viscous, Coulomb


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robot")
    (folder / "robot.toml").write_text(ROBOT)
    return folder


def written(folder, name, seed, noise, *, heads=None, degrees=False):
    """A file of a motion of 8 s at 200 Hz: positions and torques."""
    system = read_system(folder / "robot.toml")[0]
    form = linear_form(system, ("viscous", "coulomb"))
    rng = np.random.default_rng(seed)
    motion = ExcitingMotion(NAMES, 4.0, rng.normal(size=(2, 7)), np.nan)
    t = np.arange(1600) / 200
    x, rate, acceleration = motion.at(t)
    phi = form.values
    phi[-4:] = FRICTION
    tau = form.torques(tree_samples(system, x, rate, acceleration)) @ phi + noise * rng.normal(size=(1600, 2))
    heads = heads or [
        "time [s]",
        *(f"{n} [{'deg' if degrees else 'rad'}]" for n in NAMES),
        *(f"{n} torque [N m]" for n in NAMES),
    ]
    table = np.column_stack([t, np.rad2deg(x) if degrees else x, tau])
    np.savetxt(folder / name, table, delimiter=",", header=",".join(heads), comments="", fmt="%.10g")
    return form, phi


def test_the_command_finds_the_parameters_and_writes_page_and_json(robot):
    _, phi = written(robot, "measured.csv", 1, 0.5)
    written(robot, "other.csv", 2, 0.5, degrees=True)
    page, record = robot / "report.html", robot / "report.json"
    words = [str(robot / "robot.toml"), str(robot / "measured.csv"), "-o", str(page), "-o", str(record)]
    made = CliRunner().invoke(app, ["identify", *words, "--cutoff", "10", "--check", str(robot / "other.csv")])
    assert made.exit_code == 0, made.output
    found = json.loads(record.read_text())
    named = {each["name"]: each for each in found["parameters"]}
    lead = named["J_zz(upper) + 0.25 m(lower)"]
    expected = phi[9] + 0.25 * phi[10]
    assert abs(lead["value"] - expected) < 4 * lead["deviation"] < 0.1 * expected
    terms = [f"{term}({name})" for term in ("viscous", "coulomb") for name in NAMES]
    for term, friction in zip(terms, FRICTION, strict=True):
        assert abs(named[term]["value"] - friction) < 4 * named[term]["deviation"] < 0.2 * friction
    assert max(found["validation"].values()) < 0.1
    assert max(each["whiteness"] for each in found["channels"]) < 2.6 / np.sqrt(found["n_instants"])
    assert found["real_bodies"]["least"][0] > 0
    assert "m(upper)" in found["without_effect"]
    html = page.read_text()
    assert "J_zz(upper) + 0.25 m(lower)" in html
    assert "https://" not in html.split("<script>")[0]


def test_units_of_the_file_are_heeded(robot):
    written(robot, "rad.csv", 3, 0.0)
    written(robot, "deg.csv", 3, 0.0, degrees=True)
    form = linear_form(read_system(robot / "robot.toml")[0])
    one, other = (read_measured(robot / name, form).measured.samples for name in ("rad.csv", "deg.csv"))
    assert np.abs(one.x - other.x).max() < 1e-8
    assert np.abs(one.acceleration - other.acceleration).max() < 1e-3 * np.abs(one.acceleration).max()


@pytest.mark.parametrize(
    ("heads", "words"),
    [
        (["time [s]", "shoulder/angle", "elbow/angel", "shoulder/angle torque", "elbow/angle torque"], "elbow/angel"),
        (["time [s]", NAMES[0], "base F_x", *(f"{n} torque" for n in NAMES)], "no position of 'elbow/angle'"),
        (["time [s]", *NAMES, "shoulder/angle torque", "base F_x"], "missing elbow/angle"),
        (["time [s]", *NAMES, "shoulder/angle rate", "elbow/angle rate"], "neither torques"),
        (["time [s]", f"{NAMES[0]} [kg]", NAMES[1], *(f"{n} torque" for n in NAMES)], "shoulder/angle"),
    ],
)  # fmt: skip
def test_files_with_wrong_columns_or_units_are_refused_by_name(robot, heads, words):
    written(robot, "wrong.csv", 1, 0.0, heads=heads)
    with pytest.raises((ModelError, ValueError), match=words):
        read_measured(robot / "wrong.csv", linear_form(read_system(robot / "robot.toml")[0]))


def test_short_files_and_high_cut_offs_are_refused(robot):
    written(robot, "long.csv", 1, 0.0)
    form = linear_form(read_system(robot / "robot.toml")[0])
    lines = (robot / "long.csv").read_text().splitlines()
    (robot / "short.csv").write_text("\n".join(lines[:15]))
    with pytest.raises(ModelError, match="at least 20 rows"):
        read_measured(robot / "short.csv", form)
    with pytest.raises(ModelError, match="below 90 Hz"):
        read_measured(robot / "long.csv", form, cutoff=120.0)
    with pytest.raises(ModelError, match="measure longer"):
        read_measured(robot / "long.csv", form, cutoff=0.5)
