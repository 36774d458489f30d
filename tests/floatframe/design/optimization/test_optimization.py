"""Optima against closed forms: bars of a linkage from points of its path, a pendulum, a tuned absorber; bad input."""

import csv
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.design import optimize, read_design
from floatframe.errors import ModelError, ResultsError, SystemFileError
from tests.floatframe.cli.examples import PENDULUM
from tests.floatframe.command import answer_of_floatframe

FOUR_BAR = """
[system]
units = "m-kg-s"

[bodies.crank]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[bodies.coupler]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [0.3, 0, 0]
rotation_vector = [0, 0, 0.8]

[bodies.rocker]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [1, 0, 0]
rotation_vector = [0, 0, 1.65]

[joints.main]
type = "revolute"
body_a = "ground"
body_b = "crank"
marker_b = [0, 0, 0]
axis = [0, 0, 1]
[joints.main.motions.angle]
type = "polynomial"
coefficients = [0, 1]

[joints.pin]
type = "spherical"
body_a = "crank"
marker_a = [0.33, 0, 0]
body_b = "coupler"
marker_b = [0, 0, 0]

[joints.knee]
type = "universal"
body_a = "rocker"
marker_a = [0.65, 0, 0]
body_b = "coupler"
marker_b = [0.95, 0, 0]
axis = [0, 0, 1]
axis_b = [0, 1, 0]

[joints.rest]
type = "revolute"
body_a = "ground"
marker_a = [1, 0, 0]
body_b = "rocker"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[sensors.P]
type = "position"
body = "coupler"
marker = [0.5, 0.15, 0]

[run]
t_end = 3.0
h = 0.5
"""
FIT = """
system = "four_bar.toml"
analysis = "kinematics"
method = "least-squares"
differences = "forward"
step = 1e-6
workers = 1
[parameters.crank]
path = "joints.pin.marker_a.0"
lower = 0.2
upper = 0.4
[parameters.coupler]
path = "joints.knee.marker_b.0"
lower = 0.8
upper = 1.1
[parameters.rocker]
path = "joints.knee.marker_a.0"
lower = 0.5
upper = 0.9
[parameters.along]
path = "sensors.P.marker.0"
lower = 0.2
upper = 0.7
[parameters.across]
path = "sensors.P.marker.1"
lower = 0.0
upper = 0.4
[objectives.x]
of = "P x"
table = "x.csv"
[objectives.y]
of = "P y"
table = "y.csv"
"""
BARS = {"crank": 0.3, "coupler": 0.9, "rocker": 0.7, "along": 0.45, "across": 0.2}
LONGER = """
system = "pendulum.toml"
analysis = "modes"
method = "slsqp"
workers = 1
[parameters.d]
path = "bodies.rod.center_of_mass.0"
lower = 0.05
upper = 1.0
[objectives.swing]
of = "frequency 1"
goal = "greatest"
"""
ABSORBER = """
[system]
units = "m-kg-s"

[bodies.main]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[bodies.absorber]
mass = 0.1
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[joints.slide]
type = "prismatic"
body_a = "ground"
body_b = "main"
marker_a = [0, 0, 0]
axis = [1, 0, 0]

[joints.rail]
type = "prismatic"
body_a = "main"
body_b = "absorber"
marker_a = [0, 0, 0]
axis = [1, 0, 0]

[forces.spring]
type = "joint-force"
joint = "slide"
coordinate = "distance"
stiffness = 1.0

[forces.tuned]
type = "joint-force"
joint = "rail"
coordinate = "distance"
stiffness = 0.1
damping = 0.04
"""
ABSORB = """
system = "absorber.toml"
analysis = "modes"
method = "differential-evolution"
workers = 1
population = 12
iterations = 40
[parameters.k]
path = "forces.tuned.stiffness"
lower = 0.05
upper = 0.12
[parameters.c]
path = "forces.tuned.damping"
lower = 0.01
upper = 0.1
[objectives.damping]
of = "damping least"
goal = "greatest"
"""
LATER = ["trust-constr", "differential-evolution"]
METHODS = ["slsqp", LATER[0], pytest.param(LATER[1], marks=pytest.mark.long)]
INERTIA = 1 / 6  #: of the rod about its middle, its mass 2


def path_of(t, crank, coupler, rocker, along, across):
    """Point of the coupler by the meeting of two circles, the fixed hinges one apart, the knee above."""
    tip = crank * np.array([np.cos(t), np.sin(t)])
    span = np.array([[1.0], [0.0]]) - tip
    d = np.hypot(*span)
    e = span / d
    n = np.array([-e[1], e[0]])
    part = (d**2 + coupler**2 - rocker**2) / (2 * d)
    axis = (part * e + np.sqrt(coupler**2 - part**2) * n) / coupler
    return tip + along * axis + across * np.array([-axis[1], axis[0]])


def write_table(path, t, values):
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows([("t", "value"), *zip(t, values, strict=True)])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "four_bar.toml").write_text(FOUR_BAR)
    (tmp_path / "pendulum.toml").write_text(PENDULUM)
    (tmp_path / "fit.toml").write_text(FIT)
    (tmp_path / "longer.toml").write_text(LONGER)
    t = np.arange(0.0, 3.01, 0.5)
    x, y = path_of(t, **BARS)
    write_table(tmp_path / "x.csv", t, x)
    write_table(tmp_path / "y.csv", t, y)
    return tmp_path


def frequency(d):
    return np.sqrt(2 * 9.81 * d / (INERTIA + 2 * d**2)) / (2 * np.pi)


def command(*words, code=0):
    return answer_of_floatframe("optimize", *words, code=code)


def test_bars_of_a_four_bar_linkage_are_found_from_points_of_its_path(folder):
    found = optimize(read_design(folder / "fit.toml"))
    assert found.is_converged
    assert found.n_failed == 0
    for name, length in BARS.items():
        assert_allclose(found.values[name], length, rtol=0, atol=1e-6)
    assert max(found.numbers.values()) < 1e-7


@pytest.mark.parametrize("method", METHODS)
def test_a_pendulum_swings_fastest_about_its_radius_of_gyration(folder, method):
    """f = sqrt(m g d / (I + m d^2)) is greatest at d = sqrt(I / m); F is flat there: d to the root of its noise."""
    text = LONGER.replace("slsqp", method).replace('analysis = "modes"', 'analysis = "modes"\npopulation = 8')
    if method == "differential-evolution":
        text = text.replace("[parameters", "tolerance = 1e-7\n[parameters", 1)
    (folder / "longer.toml").write_text(text)
    found = optimize(read_design(folder / "longer.toml"))
    d = np.sqrt(INERTIA / 2)
    assert found.is_converged
    assert_allclose(found.values["d"], d, rtol=0, atol=1e-4)
    assert_allclose(found.numbers["swing"], frequency(d), rtol=1e-7)


@pytest.mark.parametrize("method", ["slsqp", *(pytest.param(name, marks=pytest.mark.long) for name in LATER)])
def test_a_limit_holds_where_the_best_without_it_breaks_it(folder, method):
    """f(d) grows up to d = 0.2887; the frequency at d = 0.15 as the limit leaves d = 0.15 as the best."""
    limit = frequency(0.15)
    text = LONGER.replace("slsqp", method).replace('analysis = "modes"', 'analysis = "modes"\npopulation = 8')
    text = text.replace("lower = 0.05", "lower = 0.05\nstart = 0.1").replace("upper = 1.0", "upper = 0.25")
    if method == "differential-evolution":
        text = text.replace("[parameters", "iterations = 12\n[parameters", 1)
    (folder / "longer.toml").write_text(text + f'[constraints.slow]\nof = "frequency 1"\nmost = {limit}\n')
    found = optimize(read_design(folder / "longer.toml"))
    assert found.best.violation <= 1e-6
    assert_allclose(found.values["d"], 0.15, rtol=0, atol=2e-3 if method == "differential-evolution" else 2e-5)


@pytest.mark.long
def test_an_absorber_that_damps_most_has_its_frequency_and_damping(folder):
    """Both pairs of (s^2+1)(s^2+c s/mu+k/mu) + s^2(c s+k) = 0 meet at k/mu = 1/(1+mu)^2, damping sqrt(mu)/2 of both.

    Comparing the coefficients with those of (s^2 + 2 a b s + b^2)^2: b^2 = f, f = 1/(1+mu), 4 a^2 = (1-f)/f = mu.
    """
    mu = 0.1
    (folder / "absorber.toml").write_text(ABSORBER)
    (folder / "absorb.toml").write_text(ABSORB)
    found = optimize(read_design(folder / "absorb.toml"))
    best = np.sqrt(mu) / 2
    assert best * (1 - 5e-3) < found.numbers["damping"] < best * (1 + 1e-6)
    k, c = found.values["k"], found.values["c"]
    assert_allclose(np.sqrt(k / mu), 1 / (1 + mu), rtol=2e-3)
    assert_allclose(c / (2 * np.sqrt(k * mu)), np.sqrt(mu / (1 + mu)), rtol=2e-2)


def test_a_second_call_takes_the_journal_and_ends_at_the_same_point(folder):
    design = read_design(folder / "longer.toml")
    journal = folder / "kept.journal"
    whole = optimize(design, journal=journal)
    lines = journal.read_bytes().splitlines(keepends=True)
    assert len(lines) == 1 + len(whole.history) == 1 + whole.n_computed
    journal.write_bytes(b"".join(lines[:5]) + lines[5][:20])  # killed while it wrote the fifth evaluation
    again = optimize(design, journal=journal)
    assert again.n_computed == len(whole.history) - 4
    assert again.values == whole.values
    assert optimize(design, journal=journal).n_computed == 0
    (folder / "pendulum.toml").write_text(PENDULUM.replace("mass = 2.0", "mass = 2.5"))
    with pytest.raises(ResultsError, match="journal is of another system"):
        optimize(design, journal=journal)
    journal.write_text("notes\nof mine\n")
    with pytest.raises(ResultsError, match="expected a journal"):
        optimize(design, journal=journal)
    assert journal.read_text() == "notes\nof mine\n"


def test_what_fails_is_a_row_and_counts_as_not_permitted(folder):
    """No body has a mass at or below zero: a third of the space fails."""
    text = LONGER.replace("rod.center_of_mass.0", "rod.mass").replace("slsqp", "differential-evolution")
    text = text.replace("lower = 0.05", "lower = -1.0").replace("upper = 1.0", "upper = 2.0")
    (folder / "longer.toml").write_text(text.replace("[parameters", "iterations = 5\npopulation = 8\n[parameters", 1))
    found = optimize(read_design(folder / "longer.toml"))
    failed = [row for row in found.history if row.evaluation.error]
    assert failed
    assert len(failed) == found.n_failed
    assert all(row.evaluation.values[0] <= 0 and row.violation == np.inf for row in failed)
    assert "expected a number above 0" in failed[0].evaluation.error
    assert found.values["d"] == 2.0  # f grows with the mass: sqrt(m g l / (I + m l^2))


def test_the_command_works_in_processes_and_writes_table_picture_and_journal(folder):
    text = command(folder / "longer.toml", "-j", 2)
    assert "converged" in text
    assert "0.2886" in text
    with open(folder / "longer.csv", newline="") as file:
        names, *rows = csv.reader(file)
    assert names == ["evaluation", "purpose", "d", "swing", "objective", "violation", "error"]
    assert_allclose([float(row[3]) for row in rows], [frequency(float(row[2])) for row in rows], rtol=1e-8)
    assert (folder / "longer.png").read_bytes().startswith(b"\x89PNG")
    record = json.loads(command(folder / "longer.toml", "-j", 1, "--json"))
    assert record["computed"] == 0
    assert len(record["history"]) == len(rows)
    assert record["converged"]
    heavy = folder / "longer.toml", "-j", 1, "--json", "--set", "bodies.rod.mass=4.0"
    assert "journal is of another system" in command(*heavy, code=2)
    record = json.loads(command(*heavy, "--journal", folder / "heavy.journal"))
    assert_allclose(record["best"]["parameters"]["d"], np.sqrt(INERTIA / 4.0), rtol=0, atol=1e-4)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("rod.center_of_mass.0", "rdo.center_of_mass.0", "there is no 'rdo'; did you mean 'rod'"),
    ("rod.center_of_mass.0", "rod.center_of_mass", "expected the key path of a number"),
    ("lower = 0.05", "lower = 1.5", "expected lower below upper, got lower = 1.5, upper = 1"),
    ("lower = 0.05", "lower = 0.6", "outside of the bounds 0.6 to 1; give start"),
    ("slsqp", "slqsp", "did you mean 'slsqp'"),
    ("slsqp", "least-squares", "expects a target or a table"),
    ("frequency 1", "frequenzy 1", "expected one of frequency, damping"),
    ("frequency 1", "frequency 9", "the system has 1 modes"),
    ('goal = "greatest"', 'goal = "greatest"\ntarget = 1.0', "expected one of goal, target and table"),
    ('goal = "greatest"', 'table = "x.csv"', "has no times"),
    ('goal = "greatest"', '[constraints.low]\nof = "frequency 1"', "expected least or most"),
    ('goal = "greatest"', '[constraints.low]\nof = "frequency 1"\nleast = 9.0', "satisfies all constraints; the"),
])  # fmt: skip
def test_mistakes_are_answered_in_words(folder, old, new, words):
    text = LONGER.replace(old, new).replace("[parameters", "iterations = 3\n[parameters", 1)
    (folder / "longer.toml").write_text(text)
    assert words in command(folder / "longer.toml", code=2)


def test_tables_and_first_evaluations_that_do_not_fit_are_told(folder):
    (folder / "fit.toml").write_text(FIT.replace("lower = 0.8\n", "lower = 0.01\nstart = 0.02\n"))
    with pytest.raises(ModelError, match="the evaluation at the start failed"):
        optimize(read_design(folder / "fit.toml"))
    (folder / "fit.toml").write_text(FIT)
    write_table(folder / "y.csv", [0.0, 7.0], [0.0, 1.0])
    with pytest.raises(ModelError, match="its table covers t = 0 to 7, but the motion only 0 to 3"):
        optimize(read_design(folder / "fit.toml"))
    write_table(folder / "y.csv", [1.0, 0.5], [0.0, 1.0])
    with pytest.raises(SystemFileError, match=r"y.csv, line 3: expected increasing times, got 0.5 after 1"):
        read_design(folder / "fit.toml")
