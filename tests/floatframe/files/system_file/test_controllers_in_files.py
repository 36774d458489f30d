"""[controllers.NAME]: a state space or a function in a file is the controller of the same data in Python."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import floatframe as ff
from floatframe.files.system_file.read_system import read_system
from tests.floatframe.command import run_floatframe

ROTOR = """
[system]
units = "m-kg-s"
[bodies.hub]
mass = 2.0
inertia = [[0.7, 0, 0], [0, 0.7, 0], [0, 0, 0.7]]
[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "hub"
marker_a = [0, 0, 0]
axis = [0, 0, 1]
[forces.motor]
type = "joint-force"
joint = "pin"
coordinate = "angle"
motor = 0.0
[controllers.pid]
period = 0.01
inputs = ["pin.angle", "pin.angle.rate"]
outputs = ["motor.torque"]
{law}
[run]
t_end = 0.3
h = 1e-3
"""
SPACE = """
A = [[1.0]]
B = [[-0.01, 0]]
C = [[3.0]]
D = [[-20, -6.0]]
state = [{start}]
"""
LAW = """
import numpy as np

def pid(t, x, z):
    return 3.0 * z - 20.0 * x[0] - 6.0 * x[1], z - 0.01 * x[0]

def gain(t, x):
    return -20.0 * x[0] - 6.0 * x[1] + 1.0

GAIN = 3.0
"""
GAIN = 'function = "control.laws:gain"'
KINDS = {"matrices": SPACE.format(start=0.3), "function": 'function = "laws:pid"\nstate = [0.3]', "gain": GAIN}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "laws.py").write_text(LAW)
    (tmp_path / "control").mkdir()
    (tmp_path / "control" / "laws.py").write_text(LAW)
    return tmp_path


def written(folder, law):
    path = folder / "rotor.toml"
    path.write_text(ROTOR.format(law=law))
    return path


def in_python(system, kind):
    laws: dict = {}
    exec(LAW, laws)
    options = {"inputs": ["pin.angle", "pin.angle.rate"], "outputs": ["motor.torque"]}
    if kind == "gain":
        pid = ff.Controller("pid", 0.01, function=laws["gain"], **options)
    else:
        pid = ff.Controller("pid", 0.01, function=laws["pid"], state=[0.3], **options)
    bare = ff.System(system.bodies, system.joints, system.forces, controllers=[pid])
    return ff.integrate(bare, ff.GeneralizedAlpha(), 0.3, 1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_a_controller_of_a_file_is_that_of_python(folder, kind):
    path = written(folder, KINDS[kind])
    run_floatframe("run", path, code=0)
    found, expected = ff.read_results(path.with_suffix(".h5")), in_python(read_system(path)[0], kind)
    assert np.abs(expected.joint("pin").angle).max() > 1e-2
    np.testing.assert_allclose(found.joint("pin").angle, expected.joint("pin").angle, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.controller("pid")["motor.torque"], expected.controller("pid")["motor.torque"],
                               rtol=0, atol=1e-12)  # fmt: skip


def test_matrices_that_are_left_out_are_zero(folder):
    (controller,) = read_system(written(folder, "D = [[-20, -6]]"))[0].controllers
    assert controller.outputs_at(0.0, np.array([1.0, 2.0]), controller.state)[0] == [-32.0]
    law = "A = [[0.5]]\nB = [[1, 0]]\nC = [[2.0]]"
    (controller,) = read_system(written(folder, law))[0].controllers
    outputs, state = controller.outputs_at(0.0, np.array([1.0, 2.0]), np.array([3.0]))
    assert (outputs.tolist(), state.tolist()) == ([6.0], [2.5])


@pytest.mark.parametrize("kind", ["matrices", "function"])
def test_a_run_that_was_interrupted_is_resumed_by_the_command(folder, kind, monkeypatch):
    path = written(folder, KINDS[kind])
    system = read_system(path)[0]
    whole = ff.integrate(system, ff.GeneralizedAlpha(), 0.3, 1e-3)

    def interrupt(progress):
        if progress.n_steps >= 200:
            raise KeyboardInterrupt

    monkeypatch.setattr("floatframe.simulation.integrate.SEGMENT_SECONDS", 0.0)
    results = path.with_suffix(".h5")
    with pytest.raises(KeyboardInterrupt):
        ff.integrate(system, ff.GeneralizedAlpha(), 0.3, 1e-3, output=results, batch_steps=50, progress=interrupt)
    run_floatframe("resume", path, code=0)
    assert_array_equal(ff.read_results(results).joint("pin").angle, whole.joint("pin").angle)


def test_files_of_one_name_in_two_folders_are_two_modules(folder, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    (other / "laws.py").write_text("def pid(t, x, z):\n    return 7.0, z\n")
    laws = [read_system(written(each, KINDS["function"]))[0].controllers[0] for each in (folder, other)]
    assert laws[1].function(0.0, np.zeros(2), np.zeros(1))[0] == 7.0
    assert laws[0].function(0.0, np.zeros(2), np.zeros(1))[0] == 0.0


def test_the_module_of_a_function_is_a_file_of_the_system(folder):
    assert str(folder / "laws.py") in read_system(written(folder, KINDS["function"]))[0].files


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("", "controllers.pid: expected matrices A, B, C, D, or a function"),
        ("A = [[1.0]]\nB = [[1, 0]]", "C: missing; expected A, B, C together, or D alone"),
        (SPACE + GAIN, "expected either matrices or a function, got function and A, B, C, D"),
        ("D = [[1, 2], [3]]", "D: expected rows of the same length"),
        ("D = [[1, 2, 3]]", r"D: expected 1 rows of 2 numbers \(0 of memory, 2 inputs, 1 outputs\), got 1 x 3"),
        (SPACE.replace("[{start}]", "[1, 2]"), "state: expected 1 numbers"),
        ('function = "laws"', 'function: expected "MODULE:FUNCTION", such as "laws:pid"'),
        ('function = "lows:pid"', "there is no module 'lows'; expected the file .*lows.py"),
        ('function = "laws:pidd"', "laws has no function 'pidd'; did you mean 'pid'"),
        ('function = "laws:GAIN"', "laws has no function 'GAIN'"),
        ('function = "broken:pid"', "module broken cannot be imported: ZeroDivisionError"),
    ],
)
def test_a_controller_that_cannot_be_is_told(folder, law, words):
    (folder / "broken.py").write_text("1 / 0")
    with pytest.raises(ff.errors.SystemFileError, match=words):
        read_system(written(folder, law.replace("{start}", "0.3")))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"motor.torque"', '"moter"', "controller 'pid': outputs: no joint force.*did you mean 'motor'"),
        ('"pin.angle", ', '"pin.angel", ', "controller 'pid': inputs: .*did you mean 'pin.angle'"),
        ("period = 0.01", "period = -1", "controllers.pid.period"),
    ],
)
def test_names_of_controllers_are_checked_when_the_file_is_read(folder, old, new, words):
    path = written(folder, KINDS["matrices"])
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(ff.errors.SystemFileError, match=words):
        read_system(path)
