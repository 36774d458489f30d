"""FMUs that FMPy validates and runs, in this process and in another, as the system file runs."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe import integrate, read_system
from floatframe.errors import ModelError, SystemFileError
from floatframe.files.cosimulation.archive import write_fmu
from floatframe.files.cosimulation.model_description import BaseUnit, base_unit
from floatframe.sensors import measured
from tests.floatframe.command import run_floatframe
from tests.floatframe.files.cosimulation.arms import JUMPS, MACRO, MOTORS, T_END, TOLERANCE, H, write_arm

ROOT = Path(__file__).resolve().parents[4]
MOTOR = "forces.motor.motor"
NAMED = {
    "inputs": [MOTOR, "torque"],
    "parameters": {"bodies.arm.mass": "bodies.arm.mass", "k": "forces.motor.stiffness"},
}


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return write_arm(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module", params=[2, 3])
def fmu(arm, request):
    path = arm.with_name(f"arm{request.param}.fmu")
    write_fmu(arm, path, fmi=request.param, **NAMED)
    return request.param, path


def motor_signal():
    """Return the motor as an input of FMPy: held values, a jump as two rows at one time."""
    rows = [(t, value) for t, value in zip(JUMPS, MOTORS, strict=True)]
    held = [row for k, row in enumerate(rows) for row in ([(row[0], rows[k - 1][1])] if k else []) + [row]]
    return np.array([*held, (T_END, MOTORS[-1])], dtype=[("time", float), (MOTOR, float)])


def test_fmpy_finds_nothing_wrong_with_it(fmu):
    assert validate_fmu(str(fmu[1])) == []


def test_fmpy_runs_it_as_the_system_file_runs(arm, fmu):
    system, run = read_system(arm)
    motion = measured(system, integrate(system, run.integrator, T_END, H))
    jumps = [round(t / MACRO) for t in JUMPS]
    found = fmpy.simulate_fmu(
        str(fmu[1]), stop_time=T_END, step_size=MACRO, output_interval=MACRO, input=motor_signal()
    )
    smooth = [k for k in range(round(T_END / MACRO) + 1) if k not in jumps[1:]]
    for name, sensor in motion.items():
        values = np.array([found[f"{name}.{column}"] for column in sensor.columns])
        expected = np.array(list(sensor.columns.values()))[:, :: round(MACRO / H)]
        atol = 1e-8 * np.abs(expected).max()
        assert_allclose(values[:, smooth], expected[:, smooth], rtol=0, atol=atol, err_msg=name)


def test_a_parameter_is_the_number_of_the_file(arm, fmu):
    system, run = read_system(arm, {"forces.motor.stiffness": 60.0})
    motion = measured(system, integrate(system, run.integrator, 0.02, H))["turn"].columns["angle"]
    found = fmpy.simulate_fmu(
        str(fmu[1]), stop_time=0.02, step_size=MACRO, output_interval=MACRO, start_values={"k": 60.0}
    )
    assert_allclose(found["turn.angle"], motion[:: round(MACRO / H)], rtol=0, atol=1e-10)


def in_a_process(*words, code=0):
    result = subprocess.run(
        [sys.executable, *map(str, words)], cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert result.returncode == code, result.stdout + result.stderr
    return result.stdout + result.stderr


def test_instances_states_reset_and_errors_in_another_process(fmu):
    """Two instances at once, back to a state, a state as bytes in a third, reset, failures in words, a clean end."""
    fmi, path = fmu
    text = in_a_process(Path(__file__).with_name("fmu_scenario.py"), path, fmi)
    found = json.loads(text.split("FOUND")[1].splitlines()[0])
    assert found["of one"] != found["of two"]
    assert found["second try"] == found["first try"] == found["from bytes"] != found["back"]
    assert found["back"] == found["after reset"] == found["of one"]
    assert found["motor back"] == MOTORS[0]
    assert found["released at exit"] == [".so"]  # else the binary writes into freed memory when the process ends
    assert "discard" in found["failed step"]
    assert "the step of 0.001 from t = 0.05 failed" in text
    assert_allclose([found["time of failed step"], found["after failed step"]], [0.05, 0.055], rtol=1e-12)
    for what, words in (("parameter", "is set before the initialisation ends"), ("nan", "expected a finite number"),
                        ("mass", "expected a number above 0")):  # fmt: skip
        assert "fatal" in found[what]
        assert words in text


def test_a_python_without_floatframe_is_told(fmu):
    code = (
        "import sys; sys.modules['floatframe'] = None; import fmpy\n"
        f"try: fmpy.simulate_fmu({str(fmu[1])!r}, stop_time=0.01)\n"
        "except Exception as error: print('ended', error)\n"
    )
    text = in_a_process("-c", code)
    assert "ended" in text
    assert "this FMU needs floatframe in the Python that hosts it" in text


def test_the_description_says_what_it_needs_and_in_which_units(fmu):
    description = fmpy.read_model_description(str(fmu[1]))
    assert "Needs Python with floatframe where it runs" in description.description
    variables = {v.name: v for v in description.modelVariables}
    assert {v.name for v in description.modelVariables if v.causality == "input"} == {MOTOR, "torque"}
    assert variables[MOTOR].unit == "N m"
    assert float(variables["bodies.arm.mass"].start) == 2.0
    bases = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
    assert (bases["N m"].kg, bases["N m"].m, bases["N m"].s) == (1, 2, -2)
    fed = {unknown.variable.name for unknown in description.outputs if unknown.dependencies}
    assert "tip.x" in fed
    assert "turn.angle" not in fed
    with zipfile.ZipFile(fmu[1]) as archive:
        assert {"documentation/index.html", "resources/system.toml"} <= set(archive.namelist())
        assert any(name.startswith("documentation/licenses/pythonfmu") for name in archive.namelist())
        page = archive.read("documentation/index.html").decode()
    assert all(f">{name}</td>" in page for name in variables)


def test_the_same_system_makes_the_same_bytes(arm, fmu, tmp_path):
    again = tmp_path / "again.fmu"
    write_fmu(arm, again, fmi=fmu[0], **NAMED)
    assert again.read_bytes() == fmu[1].read_bytes()


def test_without_names_constant_forces_and_all_numbers_are_variables(arm, tmp_path):
    """The motor has a function of time of its own and stays; a table [fmu] and options choose others."""
    kinds = {v.name: v.causality for v in write_fmu(arm, tmp_path / "arm.fmu").variables}
    assert {name for name, kind in kinds.items() if kind == "input"} == {"torque", "forces.push.amplitude"}
    assert {"bodies.arm.mass", "forces.motor.damping", "system.gravity.1"} <= kinds.keys()
    path = write_arm(
        tmp_path,
        ("[run]", '[fmu]\ninputs = []\noutputs = ["tip"]\nparameters = {k = "forces.motor.stiffness"}\n\n[run]'),
    )
    kinds = {v.name: v.causality for v in write_fmu(path, tmp_path / "arm.fmu").variables}
    assert set(kinds) == {"time", "k", "tip.x", "tip.y", "tip.z", "tip.size"}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("N", BaseUnit(1.0, 1, 1, -2)), ("mm/s²", BaseUnit(1e-3, m=1, s=-2)), ("N mm", BaseUnit(1e-3, 1, 2, -2)),
        ("MPa", BaseUnit(1e6, 1, -1, -2)), ("rad/s", BaseUnit(1.0, s=-1, rad=1)), ("t mm²/s", BaseUnit(1e-3, 1, 2, -1)),
        ("t^(1/2) mm", None), ("-", None),
    ],
)  # fmt: skip
def test_units_in_si(words, expected):
    found = base_unit(unit_system("mm-t-s"), words)
    assert (found is None) == (expected is None)
    if found is not None:
        assert found[1:] == expected[1:]
        assert_allclose(found.factor, expected.factor, rtol=1e-12)


PENDULUM = """
[system]
units = "{units}"
gravity = [0, {gravity}, 0]
[bodies.arm]
mass = 2.0
inertia = [[{J}, 0, 0], [0, {J}, 0], [0, 0, {J}]]
position = [{half}, 0, 0]
[joints.hinge]
type = "revolute"
body_a = "ground"
body_b = "arm"
marker_a = [0, 0, 0]
marker_b = [{behind}, 0, 0]
axis = [0, 0, 1]
[run]
t_end = {t_end}
h = {h}
"""


def test_time_is_in_seconds_whatever_the_units_of_the_system(tmp_path):
    """The same pendulum in metres and seconds, and in millimetres and milliseconds."""
    scales = {"m-kg-s": (1.0, 1.0), "mm-kg-ms": (1e3, 1e3)}  # lengths and times
    angles = []
    for units, (L, T) in scales.items():
        numbers = {"gravity": -9.81 * L / T**2, "J": 0.2 * L**2, "half": 0.5 * L, "behind": -0.5 * L}
        path = tmp_path / f"{units}.toml"
        path.write_text(PENDULUM.format(units=units, t_end=0.5 * T, h=1e-3 * T, **numbers))
        write_fmu(path, path.with_suffix(".fmu"), fmi=2, outputs=["hinge.angle"])
        unit = str(path.with_suffix(".fmu"))
        assert float(fmpy.read_model_description(unit).defaultExperiment.stopTime) == pytest.approx(0.5, rel=1e-12)
        found = fmpy.simulate_fmu(unit, stop_time=0.3, step_size=0.01, output_interval=0.01)
        angles.append(found["hinge.angle.value"])
    assert np.abs(angles[0]).max() > 0.5
    assert_allclose(angles[1], angles[0], rtol=0, atol=1e-10)


def test_the_command_writes_what_fmpy_runs(arm, tmp_path):
    path = tmp_path / "arm.fmu"
    words = ["export", arm, "-o", path, "--fmi", 3, "--input", MOTOR, "--out", "hinge.angle"]
    result = run_floatframe(*words, "--parameter", "m=bodies.arm.mass", code=0)
    assert "FMI 3.0 for x86_64-linux, x86_64-windows; it needs Python with floatframe" in result.output
    assert [v.name for v in fmpy.read_model_description(str(path)).modelVariables][:3] == ["time", "m", MOTOR]


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        ((), {"fmi": 1}, "fmi: expected one of 2, 3, got 1"),
        ((), {"inputs": ["forces.pusch.amplitude"]}, "did you mean 'forces.push.amplitude'"),
        ((), {"outputs": ["tap"]}, "no sensor or joint coordinate 'tap'; did you mean 'tip'"),
        ((), {"parameters": {"m": "bodies.arm.mas"}}, "'bodies.arm.mas': there is no such key; did you mean"),
        ((), {"parameters": {"m": "bodies.arm"}}, "expected a number, got"),
        ((), {"parameters": {"tip.x": "bodies.arm.mass"}}, "two variables are called 'tip.x'"),
        ((("[run]", "[fmu]\ninput = []\n[run]"),), {}, "fmu.input: unknown key; did you mean 'inputs'"),
        ((("[run]", "[events.stop]\nat = 0.1\nstop = true\n[run]"),), {}, r"table \[events\] cannot be a part"),
        (((f"[run]\nt_end = {T_END}\nh = {H}\ntolerance = {TOLERANCE}\n", ""),), {}, "run: missing"),
    ],
)  # fmt: skip
def test_bad_requests_are_refused_and_nothing_is_written(tmp_path, changes, options, words):
    path = write_arm(tmp_path, *changes)
    with pytest.raises((ModelError, SystemFileError), match=words):
        write_fmu(path, tmp_path / "arm.fmu", **options)
    assert not (tmp_path / "arm.fmu").exists()
