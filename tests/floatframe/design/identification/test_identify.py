"""The command: a measured motion in, base parameters, report and JSON out; what a file lacks is said."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import read_system
from floatframe.design.identification import linear_form, tree_samples
from floatframe.design.identification.estimation import Measured, estimate
from floatframe.design.identification.excitation import ExcitingMotion
from floatframe.design.identification.measured_file import read_measured
from floatframe.design.identification.next_motion import next_motion
from floatframe.design.identification.physical import real_parameters
from floatframe.errors import ModelError
from tests.floatframe.command import run_floatframe

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
    page, record, motion = robot / "report.html", robot / "report.json", robot / "next.csv"
    words = [str(robot / "robot.toml"), str(robot / "measured.csv"), "-o", str(page), "-o", str(record)]
    words += ["--motion", str(motion)]
    run_floatframe("identify", *words, "--cutoff", "10", "--check", robot / "other.csv", code=0)
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
    verdicts = {each["name"]: each["verdict"] for each in found["parameters"]}
    assert verdicts["J_zz(upper) + 0.25 m(lower)"] == "well known"
    assert verdicts["S_y(lower)"] in ("zero within its deviation", "not known")  # it is zero
    assert {each["unit"] for each in found["parameters"]} == {"kg m", "kg m²", "N m s/rad", "N m"}
    assert max(abs(each["off"]) for each in found["parameters"] if each["off"] is not None) < 4
    assert [each["off"] for each in found["parameters"]][-4:] == [None] * 4  # the file knows no friction
    table = np.loadtxt(motion, delimiter=",", skiprows=1)
    assert motion.read_text().startswith("time [s],shoulder/angle [rad],elbow/angle [rad]")
    assert_allclose(table[-1, 1:], table[0, 1:], rtol=0, atol=1e-7)  # periodic
    html = page.read_text()
    assert "Which motion would help" in html
    assert "J_zz(upper) + 0.25 m(lower)" in html
    assert "https://" not in html.split("<script>")[0]


def test_the_motion_that_would_help_tells_as_well_as_it_says(robot):
    """Of a lazy measurement; the motion found is made, with the same noise, and estimated."""
    form = linear_form(read_system(robot / "robot.toml")[0], ("viscous",))
    t, rng = np.arange(150) * 0.04, np.random.default_rng(2)
    lazy = ExcitingMotion(NAMES, 6.0, np.array([[0.2, 1.0, 0, 0, 0.3], [0.1, 1.0, 0.05, 0, 0.3]]), np.nan)

    def noisy(motion):
        samples = form.samples(*motion.at(t))
        return Measured(samples, form.torques(samples) @ form.values + 0.3 * rng.normal(size=(150, 2)), time=t)

    made = estimate(form, noisy(lazy))
    better = next_motion(made)
    then = estimate(form, noisy(better.motion))
    assert_allclose(then.deviations, better.deviations, rtol=0.2)  # the noise is estimated twice
    assert_allclose(then.condition, better.condition, rtol=0.2)
    assert (better.deviations / made.deviations).min() < 0.5
    assert better.condition < 0.5 * made.condition
    x = better.motion.at(t)
    assert all(np.abs(a).max() < 1.2 * np.abs(b).max() for a, b in zip(x, lazy.at(t), strict=True))


def test_wrong_signs_and_units_that_can_be_fitted_are_told(robot):
    form, _ = written(robot, "right.csv", 1, 0.5)
    form = linear_form(form.system, ("viscous", "coulomb"))
    right = read_measured(robot / "right.csv", form, cutoff=10.0).measured
    made = estimate(form, right)
    assert not made.warnings
    assert real_parameters(made).is_fit
    turned = estimate(form, replace(right, torques=-right.torques))
    assert "viscous(shoulder/angle), " in turned.warnings[0]
    assert "are negative" in turned.warnings[0]
    assert not real_parameters(turned).is_fit
    x, rate, acceleration = (np.rad2deg(getattr(right.samples, n)) for n in ("x", "rate", "acceleration"))
    degrees = estimate(form, replace(right, samples=form.samples(x, rate, acceleration)))
    assert "the model misses shoulder/angle by " in degrees.warnings[0]
    with pytest.raises(ModelError, match="are zero"):
        estimate(form, replace(right, torques=0 * right.torques))


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
