"""Couplers, bushings, contacts and rolling discs from system files: the same as from Python, and refusals."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from floatframe import GROUND, Gravity, Marker, PrismaticJoint, RevoluteJoint, RigidBody, System, UserForce, integrate
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.records import leaves
from floatframe.errors import FloatframeError
from floatframe.files.system_file.read_system import read_system
from floatframe.files.system_file.recorded_system import recorded_system
from floatframe.forces import Bushing, SphereContact
from floatframe.joints import AxialDistance, CoordinateCoupler, JointCoordinate, PointDistance, RollingDisc
from floatframe.model.functions.time_functions import harmonic, table
from floatframe.results import coupler_motion, user_force_motion
from floatframe.sensors import ControlSensor, CouplerSensor, measured
from tests.changed_file import changed_file

MACHINE = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]

[bodies.wheel]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.2]]
position = [0, 0, 1]

[bodies.rack]
mass = 1.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.2]]
position = [1, 0, 1]

[joints.hub]
type = "revolute"
body_a = "ground"
body_b = "wheel"
marker_b = [0, 0, 0]
axis = [0, 0, 1]

[joints.guide]
type = "prismatic"
body_a = "ground"
body_b = "rack"
marker_b = [0, 0, 0]
axis = [1, 0, 0]

[joints.tyre]
type = "rolling-disc"
body_a = "ground"
body_b = "wheel"
marker_a = [0, 0, 0]
marker_b = [0, 0, 0]
axis = [0, 0, 1]
axis_b = [0, 1, 0]
radius = 0.7

[couplers.mesh]
constant = {type = "harmonic", amplitude = 0.1, omega = 3.0}

[[couplers.mesh.terms]]
joint = "hub"
coordinate = "angle"
factor = -0.3

[[couplers.mesh.terms]]
joint = "guide"
coordinate = "distance"
factor = 1

[[couplers.mesh.terms]]
type = "point-distance"
body_a = "wheel"
marker_a = [0, 0.1, 0]
body_b = "rack"
factor = 0.2

[forces.mount]
type = "bushing"
body_a = "ground"
body_b = "rack"
marker_b = [0, 0, 0.1]
stiffness = [1, 2, 3, 4, 5, 6]
damping = [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0],
    [0, 0, 0, 0, 0, 1]]
preload = [0, 0, 5, 0, 0, 0]

[forces.mount.characteristics.x]
type = "table"
t = [-1, 0, 1, 2]
values = [-3, 0, 1, 5]

[forces.stop]
type = "sphere-contact"
body_a = "ground"
marker_a = [5, 0, 0]
axis = [-1, 0, 0]
body_b = "rack"
radius_b = 0.2
modulus = 1e6
restitution = 0.5
dissipation = "flores"
friction = 0.1

[forces.pid]
type = "user-force"
forces = {phi = "-kp*(phi - aim(t)) - ki*e"}
rates = {e = "phi - aim(t) + 0*x"}
states = {e = 0.1}
parameters = {kp = 40, ki = 30.0}

[forces.pid.functions.aim]
type = "harmonic"
amplitude = 0.2
omega = 2.0

[forces.pid.coordinates.phi]
joint = "hub"
coordinate = "angle"

[forces.pid.coordinates.x]
type = "axial-distance"
body_a = "wheel"
body_b = "rack"
axis = [1, 0, 0]

[run]
t_end = 0.05
h = 1e-3
"""


@pytest.fixture
def write(tmp_path):
    def written(*changes):
        return changed_file(tmp_path / "machine.toml", MACHINE, *changes)

    return written


def test_file_becomes_the_system_it_describes(write):
    system, _ = read_system(write())
    wheel = RigidBody("wheel", 2.0, np.diag([0.1, 0.1, 0.2]), position=(0, 0, 1))
    rack = RigidBody("rack", 1.0, np.diag([0.1, 0.1, 0.2]), position=(1, 0, 1))
    x = np.array([-1.0, 0, 1, 2])
    expected = System(
        [wheel, rack],
        [
            RevoluteJoint("hub", GROUND, Marker("wheel", position=np.zeros(3)), axis=(0, 0, 1)),
            PrismaticJoint("guide", GROUND, Marker("rack", position=np.zeros(3)), axis=(1, 0, 0)),
            RollingDisc("tyre", Marker(GROUND, position=np.zeros(3)), Marker("wheel", position=np.zeros(3)), 0.7),
            CoordinateCoupler(
                "mesh",
                [(JointCoordinate("hub", "angle"), -0.3), (JointCoordinate("guide", "distance"), 1.0),
                 (PointDistance(Marker("wheel", position=(0, 0.1, 0)), Marker("rack")), 0.2)],
                harmonic(0.1, 3.0),
            ),
        ],
        [
            Gravity((0, 0, -9.81)),
            Bushing("mount", GROUND, Marker("rack", position=(0, 0, 0.1)), np.arange(1.0, 7.0), np.ones(6),
                    (0, 0, 5, 0, 0, 0), {"x": table(x, np.array([-3.0, 0, 1, 5]))}),
            SphereContact("stop", Marker(GROUND, position=(5, 0, 0)), Marker("rack"), 0.2, axis=(-1, 0, 0),
                          modulus=1e6, restitution=0.5, dissipation="flores", friction=0.1),
            UserForce("pid", {"phi": JointCoordinate("hub", "angle"),
                              "x": AxialDistance(Marker("wheel"), Marker("rack"), (1, 0, 0))},
                      {"phi": "-kp*(phi - aim(t)) - ki*e"}, {"e": "phi - aim(t) + 0*x"}, {"e": 0.1},
                      {"kp": 40.0, "ki": 30.0}, {"aim": harmonic(0.2, 2.0)}),
        ],
    )  # fmt: skip
    wanted = dict(leaves(compiled_system(expected).model))
    for name, found in leaves(compiled_system(system).model):
        assert_array_equal(found, wanted[name], err_msg=name)


def test_the_system_of_results_is_found_again_with_couplers_and_control(write):
    tyre = MACHINE[MACHINE.index("[joints.tyre]") : MACHINE.index("[couplers.mesh]")]
    path = write((tyre, ""))
    system, run = read_system(path)
    motion = integrate(system, run.integrator, 0.002, 1e-3)
    again = recorded_system(motion, path)
    assert again is not None
    assert compiled_system(again).connection_names == compiled_system(system).connection_names
    with pytest.raises(FloatframeError, match=r"joints and springs are .*other.*; give the system file of the run"):
        recorded_system(motion, write((tyre, ""), ("[forces.stop]", "[forces.other]")))


def test_sensors_of_couplers_and_control_measure_what_the_motion_has(write):
    """A motor and its gear: columns by name with their units, the same numbers as from Python."""
    sensors = '[sensors.mesh]\ntype = "coupler"\nof = "mesh"\n\n[sensors.loop]\ntype = "control"\nof = "pid"\n\n[run]'
    tyre = MACHINE[MACHINE.index("[joints.tyre]") : MACHINE.index("[couplers.mesh]")]
    system, run = read_system(write((tyre, ""), ("[run]", sensors)))
    motion = integrate(system, run.integrator, 0.02, 1e-3)
    found = measured(system, motion)
    mesh, loop = found["mesh"], found["loop"]
    assert list(mesh.columns) == [f"{what} {k}" for k in (1, 2, 3) for what in ("value", "rate", "force")]
    assert [mesh.units[f"{what} 1"] for what in ("value", "rate", "force")] == ["rad", "rad/s", "N m"]
    assert [mesh.units[f"{what} 2"] for what in ("value", "rate", "force")] == ["m", "m/s", "N"]
    assert list(loop.columns) == ["phi", "phi_dot", "phi force", "x", "x_dot", "e"]
    assert_array_equal(loop.columns["phi force"], user_force_motion(system, motion, "pid").force["phi"])
    assert_array_equal(mesh.columns["force 2"], coupler_motion(system, motion, "mesh").force[:, 1])
    with pytest.raises(FloatframeError, match="no user force 'pdi'"):
        measured(system, motion, [ControlSensor("s", "pdi")])
    with pytest.raises(FloatframeError, match="no coupler 'pid'"):
        measured(system, motion, [CouplerSensor("s", "pid")])


TURNS = 'constant = {type = "harmonic", amplitude = 0.1, omega = 3.0}'


def test_stops_of_a_coupler_stand_in_the_file(write):
    system, _ = read_system(write((TURNS, "limits = {lower = -0.1, restitution = 0.5}")))
    limits = system.couplers[0].limits
    assert (limits.lower, limits.upper, limits.restitution) == (-0.1, None, 0.5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((TURNS, "limits = {lower = 0.5, upper = 0.1}"), r"mesh.limits: expected lower below upper, .* \(line 41\)"),
        ((TURNS, "limits = {lower = 0.5, restitution = 2}"), r"mesh.limits.restitution = 2: expected 0 to 1, got 2"),
        (("omega = 3.0", 'omega = "3"'), r"mesh.constant.omega = .3.: expected a number: Angular frequency"),
        (('coordinate = "angle"', 'coordinate = "angel"'), "joint 'hub' has no coordinate 'angel'"),
        (('joint = "hub"', 'joint = "hbu"'), "no joint 'hbu'; did you mean 'hub'"),
        (('body_a = "wheel"\nmarker_a = [0, 0.1, 0]', 'body_a = "weel"'), 'body_a = "weel": there is no such body'),
        (("factor = 1\n", "factor = 0\n"), "coefficient 2: expected a number other than zero"),
        (('type = "point-distance"', 'type = "axial-angle"'), "axis: expected .x, y, z. in the axes of marker_a"),
        (('type = "point-distance"', 'joint = "hub"'), "coordinate: missing; expected a coordinate of the joint"),
        (("radius = 0.7\n", ""), "radius: missing; expected a number: Radius of the disc"),
        (("stiffness = [1, 2, 3, 4, 5, 6]", "stiffness = 3.0"), r"stiffness = 3.0: expected six numbers, or six rows"),
        (
            ("stiffness = [1, 2, 3, 4, 5, 6]", "stiffness = [1, 2]"),
            r"stiffness = \[1, 2\]: expected six numbers, or six rows",
        ),
        (("radius_b = 0.2\n", ""), "radius_b: missing; expected a number: Radius of the sphere"),
        (('"flores"', '"flroes"'), "dissipation.*did you mean 'flores'"),
        (("restitution = 0.5", "restitution = 2"), r"restitution = 2: expected 0 < e <= 1, got 2 \(line"),
        (("- ki*e", "- ki*ee"), "force 'pid': forces: phi: unknown name 'ee' at column 25.*did you mean 'e'"),
        (("states = {e = 0.1}\n", ""), "a rate and an initial value for each state"),
        (('rates = {e = "phi', 'rates = {e = "sni(phi) + phi'), "rates: e: unknown function 'sni' at column 1"),
        (
            ('body_a = "wheel"\nbody_b', 'body_a = "weel"\nbody_b'),
            "forces.pid.coordinates.x.body_a = .weel.: there is no such body",
        ),
        (("axis_b = [0, 1, 0]", "axis_b = [0, 0, 1]"), "the disc lies flat on the plane"),
    ],
)
def test_mistakes_are_named(write, change, words):
    with pytest.raises(FloatframeError, match=words):
        read_system(write(change))
