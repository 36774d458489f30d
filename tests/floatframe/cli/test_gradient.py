"""The command gradient: what it prints and writes is what `sensitivities` returns; refusals in words."""

import csv
import json

import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from tests.floatframe.command import run_floatframe

SWING = """
[system]
units = "m-kg-s"
gravity = [0, -9.81, 0]

[bodies.rod]
mass = 2.0
inertia = [[1e-4, 0, 0], [0, 0.2, 0], [0, 0, 0.2]]
center_of_mass = [0.5, 0, 0]

[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "rod"
marker_a = [0, 0, 0]
axis = [0, 0, 1]

[run]
t_end = 0.1
h = 1e-2
"""


@pytest.fixture
def swing(tmp_path):
    path = tmp_path / "swing.toml"
    path.write_text(SWING)
    return path


def invoke(*words, code=0):
    result = run_floatframe(*words, code=code)
    return result.output


def test_the_command_says_what_the_function_returns(swing):
    asked = [
        "--out",
        "hinge.angle value",
        "--out",
        "hinge.angle rate:rms",
        "-p",
        "bodies.rod.mass",
        "-p",
        "system.gravity.1",
    ]
    told = json.loads(invoke("gradient", swing, *asked, "--json", "--method", "adjoint"))
    outputs = {"hinge.angle value": "hinge.angle value", "rms": ("hinge.angle rate", "rms")}
    found = ff.design.sensitivities(str(swing), outputs, ["bodies.rod.mass", "system.gravity.1"], method="adjoint")
    assert_allclose(list(told["gradient"]["hinge.angle value"].values()), found.gradient[0], rtol=1e-12)
    assert_allclose(list(told["gradient"]["hinge.angle rate:rms"].values()), found.gradient[1], rtol=1e-12)
    # angle = -(m g c/2 J) t² at first, J about the hinge = 0.2 + m c²: by the weight it is angle/g
    slope = told["gradient"]["hinge.angle value"]["system.gravity.1"]
    assert_allclose(slope, told["outputs"]["hinge.angle value"]["value"] / -9.81, rtol=1e-3)
    printed = invoke("gradient", swing, *asked, "-o", swing.with_suffix(".csv"))
    assert "bodies.rod.mass" in printed
    with swing.with_suffix(".csv").open() as file:
        rows = list(csv.DictReader(file))
    assert_allclose([float(row["derivative"]) for row in rows], found.gradient.ravel(), rtol=1e-8)


def test_refusals(swing):
    asked = ["gradient", swing, "--out", "hinge.angle value"]
    assert "did you mean 'rod'" in invoke(*asked, "-p", "bodies.rodd.mass", code=2)
    assert "did you mean 'mass'" in invoke(*asked, "-p", "bodies.rod.masss", code=2)
    assert "at least one" in invoke(*asked, code=2)
    assert ".csv, .json, .mat" in invoke(*asked, "-p", "y", "-o", "out.txt", code=2)
