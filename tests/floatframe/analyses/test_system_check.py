"""`floatframe check`: what it tells of a system before the run, beside closed forms."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from floatframe import FlexibleBody, Marker, RevoluteJoint, System
from floatframe.analyses.system_check import check_system, system_vibrations, tangents_at
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.files.system_file.read_system import read_system
from tests.floatframe.command import run_floatframe
from tests.synthetic import synthetic_reduced_body

STIFFNESS, MASS, HEAVY, RADIUS = 1400.0, 0.3, 2.0, 250.0  # N/mm, t, t, mm
TURN = Rotation.from_rotvec([0.3, -0.5, 0.7])
OFFSET = np.array([1200.0, -700.0, 400.0])  # mm


def sledge_file(units="mm-t-s"):
    """A sledge on a rail with a spring, and a pendulum on its head; turned, off the origin."""
    kg, s = {"mm-t-s": (1.0, 1.0), "mm-kg-ms": (1e3, 1e3)}[units]  # units in a tonne and a second

    def way(x, y, z, per_second=0.0):
        return (TURN.apply([x, y, z]) * s**-per_second).tolist()

    def place(x, y, z):
        return (TURN.apply([x, y, z]) + OFFSET).tolist()

    return f"""
[system]
units = "{units}"
gravity = {way(0, 0, -9810.0, 2)}

[bodies.sledge]
mass = {MASS * kg}
inertia = [[{4e3 * kg}, 0, 0], [0, {5e3 * kg}, 0], [0, 0, {6e3 * kg}]]
position = {place(150.0, 40.0, 30.0)}
velocity = {way(20.0, 0.0, 5.0, 1)}

[bodies.bob]
mass = {HEAVY * kg}
inertia = [[{1e-3 * kg}, 0, 0], [0, {1e-3 * kg}, 0], [0, 0, {1e-3 * kg}]]
position = {place(-900.0, 300.0, RADIUS)}

[joints.rail]
type = "prismatic"
body_a = "ground"
body_b = "sledge"
marker_a = {place(0, 40.0, 30.0)}
marker_b = {way(-150.0, 0, 0)}
axis = {way(1, 0, 0)}

[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "bob"
marker_a = {place(-900.0, 300.0, 0.0)}
marker_b = {way(0, 0, -RADIUS)}
axis = {way(0, 1, 0)}

[forces.spring]
type = "spring-damper"
body_a = "ground"
body_b = "sledge"
marker_a = {place(-500.0, 40.0, 30.0)}
marker_b = [0, 0, 0]
stiffness = {STIFFNESS * kg / s**2}
free_length = 650.0

[run]
t_end = {0.5 * s}
h = {1e-3 * s}
"""


SLEDGE = sledge_file()


@pytest.fixture
def sledge(tmp_path):
    path = tmp_path / "sledge.toml"
    path.write_text(SLEDGE)
    return path


def checked(path, *arguments):
    result = run_floatframe("check", path, "--json", *arguments)
    record = json.loads(result.stdout) if result.stdout else None
    return result, {each["name"]: each for each in record["records"]} if record else {}


AWAY = f"bodies.sledge.position={(TURN.apply([150.0, 40.0, 90.0]) + OFFSET).tolist()}"  # 60 mm off its rail
UNITS = [("mm-t-s", 1.0), ("mm-kg-ms", 1e-3)]  # with seconds in the unit of time


@pytest.mark.parametrize(("units", "second"), UNITS)
def test_frequencies_free_and_falling_motions_are_those_of_the_closed_form(tmp_path, units, second):
    """A spring of stiffness k and a mass m; a pendulum that stands on its head has negative stiffness."""
    (tmp_path / "sledge.toml").write_text(sledge_file(units))
    system, _ = read_system(tmp_path / "sledge.toml")
    found = system_vibrations(system, tangents_at(system, consistent_motion(system)))
    assert_allclose(found.frequencies, [np.sqrt(STIFFNESS / MASS) / (2 * np.pi) * second], rtol=1e-9)
    assert found.bodies == ("sledge",)
    assert (found.n_free, found.n_unstable) == (0, 1)


@pytest.mark.parametrize(("units", "second"), UNITS)
def test_the_record_names_mobility_velocities_and_the_step_that_follows_the_vibration(tmp_path, units, second):
    (tmp_path / "sledge.toml").write_text(sledge_file(units))
    result, records = checked(tmp_path / "sledge.toml")
    assert result.exit_code == 0
    assert records["mobility"]["reason"].startswith(
        "2 independent motions: 2 bodies with 0 modes minus 10 constraints; 2 if"
    )
    assert f"speed is {20 * second:.3g} mm/{units[-2:].strip('-')}, of body 'sledge'" in records["start"]["reason"]
    change = 5.0 / np.hypot(20.0, 5.0)
    assert f"change the given velocities by {change:.2g} of their size" in records["start"]["reason"]
    period = 2 * np.pi / np.sqrt(STIFFNESS / MASS)
    assert f"from {1 / period:.4g} Hz" in records["vibrations"]["reason"]
    assert_allclose(records["step"]["value"], period / 1e-3, rtol=1e-9)
    assert f"the slowest needs h = {period / 20 / second:.2g}" in records["step"]["reason"]
    assert records["step"]["verdict"] == "pass"


@pytest.mark.parametrize(
    ("setting", "name", "verdict", "words"),
    [
        ("run.h=0.02", "step", "warn", "resolves 0 of 1 vibrations"),
        (
            f"bodies.sledge.position={(TURN.apply([150.0, 40.0, 90.0]) + OFFSET).tolist()}",
            "placement",
            "warn",
            "moves body 'sledge' by 60 mm",
        ),
    ],
)
def test_what_makes_a_result_doubtful_is_a_warning_with_a_remedy(sledge, setting, name, verdict, words):
    result, records = checked(sledge, "--set", setting)
    assert result.exit_code == 0
    assert records[name]["verdict"] == verdict
    assert words in records[name]["reason"]
    assert records[name]["action"]


def test_a_run_that_would_be_refused_fails_with_the_redundant_constraints_of_each_joint(sledge):
    rail = SLEDGE[SLEDGE.index("[joints.rail]") : SLEDGE.index("[joints.pin]")]
    second = SLEDGE.replace("[joints.pin]", rail.replace("rail", "again") + "[joints.pin]")
    sledge.write_text(second)
    result, records = checked(sledge)
    assert result.exit_code == 1
    assert records["mobility"]["verdict"] == "fail"
    assert "redundant: 5 of joint 'again'" in records["mobility"]["reason"]
    assert "start" not in records
    shared = second.replace('units = "mm-t-s"', 'units = "mm-t-s"\nredundant = "minimum-norm"')
    sledge.write_text(shared)
    result, records = checked(sledge)
    assert result.exit_code == 0
    assert "share the load" in records["mobility"]["reason"]


def test_a_file_that_cannot_be_read_has_exit_code_2(sledge):
    sledge.write_text(SLEDGE.replace("mass = 2.0", "mas = 2.0"))
    assert checked(sledge)[0].exit_code == 2


def test_functions_of_time_that_the_steps_miss_are_told(sledge):
    shake = """
[forces.shake]
type = "point-force"
body = "sledge"
marker = [0, 0, 0]
force = [1, 0, 0]
amplitude = {type = "harmonic", amplitude = 2.0, omega = 1130.0}
"""
    sledge.write_text(SLEDGE + shake)
    _, records = checked(sledge)
    assert records["function of time"]["verdict"] == "warn"
    assert "do not follow its frequency" in records["function of time"]["reason"]


def test_a_loop_that_a_flexible_body_frees_is_named_as_if_it_were_rigid():
    """Two hinges on one axis at the ends of a rod: if it is rigid, all constraints of the second repeat the first."""
    reduced = synthetic_reduced_body(n_q=8)
    ends = {interface.name: np.array(interface.position) for interface in reduced.interfaces}
    (one, p), (other, q) = ends.items()
    joints = [
        RevoluteJoint("first", Marker("ground", position=p), Marker("rod", one), axis=q - p),
        RevoluteJoint("second", Marker("ground", position=q), Marker("rod", other), axis=q - p),
    ]
    system = System([FlexibleBody("rod", reduced)], joints, units=reduced.units)
    records = {each.name: each for each in check_system(system)}
    assert "8 modes up to" in records["body rod"].reason
    assert "if all bodies were rigid: 5 of joint 'second'" in records["mobility"].reason
    assert "no constraint is redundant" in records["mobility"].reason
