"""The commands carry the formulation: asked for, or that of the table [run]."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.floatframe.command import run_floatframe

ARM = """
[system]
units = "m-kg-s"
gravity = [0.0, 0.0, -9.81]

[bodies.upper]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
position = [0.0, 0.0, -0.5]

[bodies.lower]
mass = 1.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
position = [0.0, 0.0, -1.5]

[joints.shoulder]
type = "revolute"
body_a = "ground"
body_b = "upper"
marker_b = [0.0, 0.0, 0.5]
axis = [0, 1, 0]

[joints.elbow]
type = "revolute"
body_a = "upper"
body_b = "lower"
marker_b = [0.0, 0.0, 0.5]
axis = [0, 1, 0]
"""
RUN = '\n[run]\nt_end = 1.0\nh = 1e-2\nformulation = "relative"\n'


def run(*words):
    result = run_floatframe(*words, code=0)
    return result.output


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.toml").write_text(ARM)
    (tmp_path / "joints.toml").write_text(ARM + RUN)
    return tmp_path


def test_a_linearised_system_has_states_named_after_its_joints(arm):
    """In relative coordinates M, C, K over z too: z are the angles."""
    said = run("linearize", arm / "joints.toml", "-o", arm / "joints.npz")
    assert "states: shoulder.angle, elbow.angle, and their rates" in said
    asked = run("linearize", arm / "arm.toml", "-o", arm / "arm.npz", "--formulation", "relative")
    assert asked.splitlines()[:-1] == said.splitlines()[:-1]
    with np.load(arm / "joints.npz") as file:
        found = dict(file)
    assert_allclose(found["A"][2:, :2], -np.linalg.solve(found["M_z"], found["K_z"]), rtol=1e-9)
    m, m_2, g = 2.0, 1.0, 9.81  # of a double pendulum hanging down, links of 1
    M = [[0.2 + m / 4 + 2.25 * m_2, 0.1 + 0.75 * m_2], [0.1 + 0.75 * m_2, 0.1 + m_2 / 4]]
    assert_allclose(found["M_z"], M, rtol=1e-9)
    assert_allclose(found["K_z"], g * np.array([[m / 2 + 1.5 * m_2, m_2 / 2], [m_2 / 2, m_2 / 2]]), rtol=1e-7)


def test_equilibria_and_modes_do_not_depend_on_the_formulation(arm):
    for command in ("static", "modes"):
        one, other = (json.loads(run(command, arm / f"{name}.toml", "--json")) for name in ("arm", "joints"))
        assert one["is_stable"]
        assert other["is_stable"]
        if command == "modes":
            pairs = zip(one["modes"], other["modes"], strict=True)
            assert all(abs(a["frequency_hz"] - b["frequency_hz"]) < 1e-8 for a, b in pairs)


def test_a_formulation_that_is_none_is_refused(arm):
    result = run_floatframe("modes", arm / "arm.toml", "--formulation", "relatve")
    assert result.exit_code != 0
    assert "did you mean 'relative'" in result.output
