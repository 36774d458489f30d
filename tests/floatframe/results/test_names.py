"""Names of sensors, columns, coordinates and forces mean the same in every function, in Python and in files."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import floatframe as ff
from floatframe.analyses.snapshot import snapshot
from floatframe.files.system_file.read_system import read_system
from floatframe.model.forces import driven_forces
from floatframe.results.sensors import sensor_and_column

ARM = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]
[bodies.arm]
mass = 2.0
inertia = [[1.0, 0, 0], [0, 2, 0], [0, 0, 2.5]]
position = [0.5, 0, 0]
[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "arm"
marker_a = [0, 0, 0]
axis = [0, 1, 0]
[forces.motor]
type = "joint-force"
joint = "pin"
coordinate = "angle"
stiffness = 500.0
[forces.push]
type = "point-force"
body = "arm"
force = [0, 0, 1]
[forces.brake]
type = "user-force"
coordinates = {phi = "pin.angle"}
forces = {phi = "-3*phi_dot"}
[sensors.tip]
type = "position"
body = "arm"
marker = [0.5, 0, 0]
[sensors."left wheel"]
type = "position"
body = "arm"
marker = [0.1, 0, 0]
[outputs.height]
sensor = "tip.z"
[run]
t_end = 0.02
h = 1e-3
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    path = tmp_path_factory.mktemp("names") / "arm.toml"
    path.write_text(ARM)
    return read_system(path)[0]


@pytest.mark.parametrize(
    ("name", "owner", "column"),
    [
        ("tip", "tip", ""), ("tip.x", "tip", "x"), ("tip x", "tip", "x"),
        ("pin.angle", "pin.angle", ""), ("pin.angle.rate", "pin.angle", "rate"),
        ("pin.angle rate", "pin.angle", "rate"),
        ("pin angle", "pin.angle", ""), ("pin angle rate", "pin.angle", "rate"),
        ("left wheel", "left wheel", ""), ("left wheel x", "left wheel", "x"), ("left wheel.x", "left wheel", "x"),
        ("height", "height", ""),
    ],
)  # fmt: skip
def test_a_dot_and_a_blank_before_a_column_are_the_same(system, name, owner, column):
    sensor, found = sensor_and_column(system, name)
    assert (sensor.name, found) == (owner, column)


def test_a_linear_system_takes_names(system):
    named = ff.linearize(system, inputs=["motor.torque", "push", "arm:z"], outputs=["pin.angle", "tip x", "height"])
    tip = next(sensor for sensor in system.sensors if sensor.name == "tip")
    given = ff.linearize(
        system,
        inputs=[ff.analyses.ForceInput("a", "motor"), ff.analyses.ForceInput("b", "push"),
                ff.sensors.Channel("c", ff.Marker("arm"), direction=(0, 0, 1))],
        outputs=[ff.joints.JointCoordinate("pin", "angle", "a", rate=0), ff.analyses.Column(tip, "x"),
                 ff.analyses.Column(tip, "z")],
    )  # fmt: skip
    assert named.inputs == ("motor.torque", "push", "arm:z")
    assert named.outputs == ("pin.angle", "tip x", "height")
    for part in "ABCD":
        assert_array_equal(getattr(named.state_space(), part), getattr(given.state_space(), part))


@pytest.mark.parametrize("name", ["motor", "motor.torque", "forces.motor.motor"])
def test_a_force_has_the_same_names_as_input_and_as_output_of_a_controller(system, name):
    assert ff.linearize(system, inputs=[name], outputs=["pin.angle"]).inputs == (name,)
    hold = ff.Controller("hold", 2e-3, ["pin.angle"], [name], lambda t, x: -20.0 * x[0] - 5.0)
    known = ff.Controller("hold", 2e-3, ["pin.angle value"], ["motor"], lambda t, x: -20.0 * x[0] - 5.0)
    motions = [
        ff.integrate(replace(system, controllers=[each]), ff.GeneralizedAlpha(), 0.01, 1e-3)
        for each in (hold, known)
    ]  # fmt: skip
    assert_array_equal(motions[0].body("arm").r, motions[1].body("arm").r)
    assert motions[0].controller("hold").units[name] == "N m"


def test_a_force_keeps_its_name_beside_a_longer_name_of_another(system):
    driven = driven_forces(system.forces)
    motor, named = driven["motor"], replace(driven["push"], name="motor.torque")
    for forces in ([motor, named], [named, motor]):
        found = driven_forces(forces)
        assert (found["motor.torque"], found["forces.motor.motor"]) == (named, motor)


def test_a_colon_in_the_name_of_a_sensor_is_no_place(system):
    tip = replace(next(sensor for sensor in system.sensors if sensor.name == "tip"), name="tip:1")
    linear = ff.linearize(replace(system, sensors=[tip], outputs=[]), inputs=["arm:z"], outputs=["tip:1 x", "arm:z"])
    assert linear.outputs == ("tip:1 x", "arm:z")


def test_a_user_force_and_a_coupler_take_the_name_of_a_coordinate(system):
    brake = next(force for force in system.forces if getattr(force, "name", "") == "brake")
    given = ff.UserForce("u", {"phi": ff.joints.JointCoordinate("pin", "angle")}, forces={"phi": "-phi"})
    assert brake.coordinates == given.coordinates
    assert ff.UserForce("u", {"phi": "pin angle"}, forces={"phi": "-phi"}).coordinates == brake.coordinates
    terms = [("pin.angle", 2.0)], [(ff.joints.JointCoordinate("pin", "angle"), 2.0)]
    assert len({ff.joints.CoordinateCoupler("c", each).terms for each in terms}) == 1


def test_measurements_gradients_events_and_outputs_read_a_column_by_dot_and_blank(system):
    motion = ff.integrate(system, ff.GeneralizedAlpha(), 0.01, 1e-3)
    for dot, blank in (("tip.z", "tip z"), ("pin.angle.rate", "pin.angle rate")):
        a, b = motion.sensor(dot), motion.sensor(blank)
        (x,), (y,) = a.columns.values(), b.columns.values()
        assert_array_equal(x, y)
        assert a.units == b.units
    assert_allclose(motion.sensor("height").value, motion.sensor("tip").z, rtol=0, atol=0)
    for watch in ("tip.z", "tip z"):
        event = ff.simulation.Event("falls", watch=watch, level=-1e-4, direction="falling", stop=True)
        cut = ff.integrate(replace(system, events=[event]), ff.GeneralizedAlpha(), 0.1, 1e-3)
        assert cut.t[-1] < 0.1
        assert_allclose(cut.sensor("tip").z[-1], -1e-4, rtol=1e-6)


MISTAKES = {
    "an output": (lambda s: ff.linearize(s, inputs=[], outputs=["pin.angel"]), "did you mean 'pin.angle'"),
    "an input": (lambda s: ff.linearize(s, inputs=["motor.torqe"], outputs=[]), "did you mean 'motor.torque'"),
    "a column": (lambda s: ff.linearize(s, inputs=[], outputs=["tip.q"]), "no column 'q'; choices: size, x, y, z"),
    "a component": (lambda s: ff.linearize(s, inputs=["arm:q"], outputs=[]), "choices: rx, ry, rz, x, y, z"),
    "a coordinate": (lambda s: ff.UserForce("u", {"phi": "pin"}, forces={"phi": "-phi"}), "such as 'hub.angle'"),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_an_unknown_name_is_told_with_the_nearest(system, what):
    call, words = MISTAKES[what]
    with pytest.raises(ff.errors.ModelError, match=words):
        call(system)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('coordinates = {phi = "pin.angle"}', 'coordinates = {phi = "pin"}', "such as 'hub.angle', or a table"),
        ('sensor = "tip.z"', 'sensor = "top.z"', "no sensor 'top.z'; choices: left wheel, tip"),
        ('sensor = "tip.z"', 'coordinate = "pin.angle"', None),
        ('sensor = "tip.z"', 'coordinate = "pin angle"', None),
    ],
)
def test_names_in_files(tmp_path, old, new, words):
    (tmp_path / "arm.toml").write_text(ARM.replace(old, new))
    if words is None:
        (height,) = read_system(tmp_path / "arm.toml")[0].outputs
        assert (height.joint, height.coordinate) == ("pin", "angle")
        return
    with pytest.raises(ff.errors.SystemFileError, match=words):
        read_system(tmp_path / "arm.toml")


def test_a_study_and_a_gradient_take_both_forms(tmp_path):
    (tmp_path / "arm.toml").write_text(ARM)
    found = ff.design.sensitivities(tmp_path / "arm.toml", ["tip.z", "tip z", "pin.angle"], ["bodies.arm.mass"])
    assert_array_equal(found.gradient[0], found.gradient[1])
    assert_array_equal(found.values[0], found.values[1])
    assert np.isfinite(found.gradient).all()


def test_an_equilibrium_as_a_motion_takes_the_names(system):
    """Stiffness times angle is the moment of weight less push, half a metre from the hinge."""
    rest = snapshot(system, ff.static_equilibrium(system))
    (angle,) = rest.sensor("pin.angle.value").value
    assert_allclose(500.0 * angle, (2 * 9.81 - 1.0) * 0.5 * np.cos(angle), rtol=1e-9)
    assert_allclose(rest.sensor("tip z").z, [-np.sin(angle)], rtol=1e-12)
    assert rest.to_dataframe("tip").shape == (1, 4)


def test_one_joint_coordinate_is_coordinate_sensor_input_and_output(system):
    """A coupler and a user force, a measurement, the columns and matrices of a linear system, all by one object."""
    angle = ff.joints.JointCoordinate("pin", "angle")
    motion = ff.integrate(replace(system, sensors=[angle]), ff.GeneralizedAlpha(), 0.01, 1e-3)
    assert_array_equal(angle.measure(system, motion).value, motion.joint("pin").angle)
    assert motion.to_dataframe("pin.angle").columns.tolist() == ["pin.angle value", "pin.angle rate", "pin.angle force"]
    one = ff.linearize(system, inputs=[angle], outputs=[replace(angle, rate=0)])
    named = ff.linearize(system, inputs=["pin.angle"], outputs=["pin.angle"])
    assert (one.inputs, one.outputs, one.output_units) == (named.inputs, named.outputs, ("rad",))
    assert_array_equal(ff.frequency_response(one, [3.0]).values, ff.frequency_response(named, [3.0]).values)
    whole = ff.linearize(system, inputs=[angle], outputs=[angle])
    assert whole.outputs == ("pin.angle.value", "pin.angle.rate", "pin.angle.force")
    assert [ff.joints.JointCoordinate("pin", "angle", rate=k).name for k in (0, 1)] == ["pin.angle", "pin.angle.rate"]
