"""The commands static, modes, linearize and campbell: what they say is what the functions return; refusals in words."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.files import read_table
from tests.floatframe.cli.examples import PENDULUM
from tests.floatframe.command import run_floatframe


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM)
    return path


def invoke(*words, code=0):
    result = run_floatframe(*words, code=code)
    return result.output


def test_static_tells_where_the_rod_hangs_and_what_holds_it(pendulum):
    record = json.loads(invoke("static", pendulum, "--json"))
    assert_allclose(np.abs(record["bodies"][0]["rotation_vector"]), [0, 0, np.pi / 2], rtol=0, atol=1e-8)
    assert_allclose(record["reactions"][0]["force"], [0, -2 * 9.81, 0], rtol=0, atol=1e-7)
    assert record["is_stable"]
    assert "stable" in invoke("static", pendulum)


def test_static_prints_the_sensors_at_the_equilibrium(pendulum):
    """The rod hangs: its end, at twice the centre of mass, is 1 below the hinge; the angle is -90 degrees."""
    text = (
        PENDULUM
        + """
[sensors.end]
type = "position"
body = "rod"
marker = [1.0, 0, 0]

[sensors.angle]
type = "coordinate"
joint = "hinge"
coordinate = "angle"

[sensors.held]
type = "reaction"
of = "hinge"
"""
    )
    pendulum.write_text(text)
    sensors = json.loads(invoke("static", pendulum, "--json"))["sensors"]
    assert_allclose([sensors[f"end {c}"]["value"] for c in "xyz"], [0, -1, 0], rtol=0, atol=1e-8)
    assert_allclose(abs(sensors["angle value"]["value"]), np.pi / 2, rtol=0, atol=1e-8)
    assert_allclose(sensors["held force y"]["value"], -2 * 9.81, rtol=0, atol=1e-7)
    assert sensors["end y"]["unit"] == "m"
    said = invoke("static", pendulum)
    assert "Sensors" in said
    assert "held force y" in said


def test_eig_tells_the_frequency_of_the_textbook(pendulum):
    record = json.loads(invoke("modes", pendulum, "--json"))
    assert_allclose(record["modes"][0]["frequency_hz"], np.sqrt(1.5 * 9.81) / (2 * np.pi), rtol=1e-8)
    table = pendulum.with_suffix(".modes.json")
    assert "rod 100 %" in invoke("modes", pendulum, "-o", table)
    assert_allclose(read_table(table)["frequency"][0], record["modes"][0]["frequency_hz"], rtol=1e-12)


def test_linearize_writes_the_state_space_of_the_pendulum(pendulum, tmp_path):
    path = tmp_path / "lin.npz"
    invoke("linearize", pendulum, "--input", "rod:rz", "--out", "rod:rz", "-o", path)
    J = 2.0 / 3
    s = 2j
    with np.load(path) as data:
        transfer = data["C"] @ np.linalg.solve(s * np.eye(2) - data["A"], data["B"]) + data["D"]
    assert_allclose(transfer[0, 0], 1 / (J * s**2 + 9.81), rtol=1e-8)


def test_campbell_draws_a_picture_and_writes_a_table(pendulum, tmp_path):
    still = pendulum.with_name("free.toml")
    still.write_text(PENDULUM.replace("[0, -9.81, 0]", "[0, 0, 0]"))
    assert "free.png" in invoke("campbell", still, "--speeds", "0:5:3")
    assert (tmp_path / "free.png").read_bytes().startswith(b"\x89PNG")
    invoke("campbell", still, "--speeds", "0:5:3", "-o", tmp_path / "table.csv")
    lines = (tmp_path / "table.csv").read_text().splitlines()
    assert lines[0] == "speed,Hz 1,damping 1"
    assert len(lines) == 4


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["linearize", "--input", "rod/tip"], "or body/interface:component"),
        (["linearize", "--input", "rode:x"], "no body 'rode'; did you mean 'rod'"),
        (["modes", "--axis", "up"], "expected x, y, z or three numbers"),
        (["campbell", "--speeds", "0:5"], 'expected "from:to:number"'),
        (["modes", "--speed", "3", "--axis", "x"], "does not allow a rotation"),
    ],
)
def test_what_cannot_be_understood_is_refused_with_words(pendulum, words, message):
    output = invoke(words[0], pendulum, *words[1:], code=2)
    assert message in " ".join(output.split())


def test_a_system_without_a_run_can_be_analysed_but_not_run(pendulum):
    pendulum.write_text(PENDULUM[: PENDULUM.index("[run]")])
    for command in ("static", "modes", "linearize"):
        invoke(command, pendulum)
    invoke("campbell", pendulum, "--speeds", "0:0:1", "-o", pendulum.with_suffix(".csv"))
    for command in ("run", "kinematics"):
        assert "expected a table [run] with t_end and h" in " ".join(invoke(command, pendulum, code=2).split())


def test_campbell_prints_draws_and_writes_the_outputs(tmp_path):
    """A ball in a cage that turns: it pulls with m omega² r, r as the bushing gives way: k r = k r_0 + m omega² r."""
    path = tmp_path / "rotor.toml"
    path.write_text(ROTOR)
    table = tmp_path / "rotor.csv"
    told = invoke("campbell", path, "--speeds", "0:10:3", "-o", table)
    assert "pull" in told
    lines = [line.split(",") for line in table.read_text().splitlines()]
    head, rows = lines[0], np.array(lines[1:], float)
    column = rows[:, head.index("pull [N]")]
    k, m, r = 4000.0, 2.0, 0.5
    stretched = k * r / (k - m * rows[:, 0] ** 2)
    assert_allclose(np.abs(column), m * rows[:, 0] ** 2 * stretched, rtol=1e-6, atol=1e-6)
    invoke("campbell", path, "--speeds", "0:10:3", "--out", "cage.force size", "--out", "place", "-o", table)
    names = table.read_text().splitlines()[0]
    assert "place.x [m]" in names
    assert "pull" not in names
    picture = tmp_path / "rotor.svg"
    invoke("campbell", path, "--speeds", "0:10:3", "-o", picture)
    assert picture.read_text().count("[N]") or picture.stat().st_size > 10_000
    assert "did you mean 'cage'" in invoke("campbell", path, "--speeds", "0:10:3", "--out", "cag", code=2)


def test_amplitudes_motors_and_drives_are_inputs_by_name(pendulum, tmp_path):
    """The names that a table [fmu] uses too; the transfer of a motor is that of the textbook."""
    text = PENDULUM.replace("[run]", MOTOR + "\n[run]")
    pendulum.write_text(text)
    path = tmp_path / "lin.npz"
    for name in ("forces.drive.motor", "twist"):
        invoke("linearize", pendulum, "--input", name, "--out", "rod:rz", "-o", path)
        s = 2j
        with np.load(path) as data:
            transfer = data["C"] @ np.linalg.solve(s * np.eye(2) - data["A"], data["B"]) + data["D"]
        assert_allclose(transfer[0, 0], 1 / (2.0 / 3 * s**2 + 9.81), rtol=1e-8)
    invoke("response", pendulum, "--input", "forces.push.amplitude", "--out", "rod:rz", "-o", tmp_path / "r.csv")
    assert "did you mean" in invoke("linearize", pendulum, "--input", "forces.pusch.amplitude", code=2)


ROTOR = """
[system]
units = "m-kg-s"

[bodies.hub]
mass = 1.0
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

[bodies.ball]
mass = 2.0
inertia = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]
position = [0.5, 0, 0]

[joints.axle]
type = "revolute"
body_a = "ground"
body_b = "hub"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[forces.cage]
type = "bushing"
body_a = "hub"
marker_a = [0.5, 0, 0]
body_b = "ball"
stiffness = [4000, 4000, 4000, 100, 100, 100]

[sensors.cage]
type = "reaction"
of = "cage"

[sensors.place]
type = "position"
body = "ball"
marker = [0, 0, 0]

[outputs.pull]
sensor = "cage"
column = "force x"
"""
MOTOR = """
[forces.drive]
type = "joint-force"
joint = "hinge"
coordinate = "angle"
preload = 0.0
[forces.drive.motor]
type = "constant"
value = 0.0

[forces.push]
type = "point-force"
body = "rod"
marker = [0, 0, 0]
force = [1, 0, 0]

[inputs.twist]
type = "motor"
force = "drive"
"""
