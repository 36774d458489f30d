"""System files: what they mean, and how mistakes in them are answered."""

import inspect

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
import floatframe
from floatframe import FixedJoint, GeneralizedAlpha, Gravity, PointForce, RevoluteJoint, integrate
from floatframe.errors import SystemFileError
from floatframe.files.system_file.connections import ELSEWHERE
from floatframe.files.system_file.read_system import read_system
from floatframe.integrators import hht, newmark, trapezoidal
from floatframe.model.joints import JOINTS
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.simulation import Event
from tests.changed_file import changed_file
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

SWING = """
[system]
units = "m-kg-s"
gravity = [0, 0, -9.81]

[bodies.rod]
file = "rod.h5"
position = [0, 0, 1]
rotation_vector = [0, 0.3, 0]

[bodies.bob]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
position = [1, 0, 1]
omega_B = [0, 0, 0]

[joints.pin]
type = "revolute"
body_a = "ground"
body_b = "rod"
marker_b = "end_b"
axis = [0, 1, 0]

[joints.weld]
type = "fixed"
body_a = "rod"
marker_a = "end_a"
body_b = "bob"

[forces.spring]
type = "spring-damper"
body_a = "bob"
body_b = "ground"
marker_b = [2, 0, 0]
stiffness = 10
damping = 0.5

[forces.push]
type = "point-force"
body = "bob"
force = [1, 0, 0]
is_follower = true

[run]
t_end = 0.05
h = 1e-3
rho_inf = 0.7
output_every = 5
"""

#: a sensor that may stand before the table [run]
TIP = """[sensors.tip]
type = "position"
body = "bob"
"""


@pytest.fixture
def write(tmp_path):
    cms.write(reduced_body(random_point_masses(3, 3), stiffness(3), name="rod"), tmp_path / "rod.h5")

    def written(*changes):
        return changed_file(tmp_path / "swing.toml", SWING, *changes)

    return written


def test_file_becomes_the_system_it_describes(write):
    system, run = read_system(write())
    assert system.name == "swing"
    assert [body.name for body in system.bodies] == ["rod", "bob"]
    assert_allclose(system.bodies[0].orientation, euler_parameters_of_rotation_vector([0, 0.3, 0]))
    assert isinstance(system.joints[0], RevoluteJoint)
    assert isinstance(system.joints[1], FixedJoint)
    assert [type(force).__name__ for force in system.forces] == ["Gravity", "SpringDamper", "PointForce"]
    assert isinstance(system.forces[0], Gravity)
    assert isinstance(system.forces[2], PointForce)
    assert system.forces[2].is_follower
    assert (run.t_end, run.h, run.output_every, run.integrator.rho_inf) == (0.05, 1e-3, 5, 0.7)
    motion = integrate(system, run.integrator, run.t_end, run.h, output_every=run.output_every)
    assert len(motion.t) == 11
    assert len(motion.head.bodies[0].digest) == 64
    assert np.isfinite(motion.body("rod").q).all()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('units = "m-kg-s"', 'units = "m-kg-z"', r'units = "m-kg-z": unknown unit system; did you mean .m-kg-s.'),
        ('file = "rod.h5"', 'file = "rad.h5"', r"no such file: .*rad.h5; did you mean 'rod.h5'"),
        ('file = "rod.h5"', 'file = "rod.h5"\nmodes = ["a"]',
         r'bodies.rod.modes.0 = "a": expected a list of whole numbers from 0, the modes to keep \(line 8\)'),
        ("mass = 2.0", "mass = -2.0", r"bodies.bob.mass = -2.0: expected a number above 0"),
        ("mass = 2.0", "mas = 2.0", r"bodies.bob.mas: unknown key; did you mean 'mass'"),
        ("inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]", "", "inertia: missing; a rigid body needs"),
        ("inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]", "inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 9]]",
         "no mass distribution has the principal moments"),
        ('type = "revolute"', 'type = "revolut"', "unknown type of joint; did you mean 'revolute'"),
        ('type = "revolute"', 'type = "hinge"', 'unknown type of joint; it is called "revolute" here'),
        ('type = "revolute"', 'type = "translational"', 'unknown type of joint; it is called "prismatic" here'),
        ('type = "revolute"', 'type = "spherical"', 'pin.axis: unknown key of type "spherical"; choices: body_a'),
        ('body_b = "rod"', 'body_b = "rodd"', r'pin.body_b = "rodd": there is no such body; did you mean .rod.'),
        ('marker_b = "end_b"', 'marker_b = "end_bb"', "has no interface 'end_bb'; did you mean 'end_b'"),
        ("axis = [0, 1, 0]", "", r"axis: missing; expected a list of numbers: Direction of .* \(line 17\)"),
        ("axis = [0, 1, 0]", "axis = [0, nan, 0]", r"axis = \[0, nan, 0\]: expected finite numbers, .* \(line 22\)"),
        ("stiffness = 10", "stiffness = -1", r"spring.stiffness = -1: expected a number of 0 or more, got -1 \(line 3"),
        ("force = [1, 0, 0]", "stiffness = 3", 'push.stiffness: unknown key of type "point-force"; choices: amplitude'),
        ("[run]", TIP + "tolerance = -0.1\n[run]", "on 'bob': tolerance: expected a number of 0 or more, got -0.1"),
        ("[run]", TIP + "relative_marker = [0, 0, 1]\n[run]",
         r"sensors.tip: relative_to: missing; expected the name of the body of relative_marker \(line 44\)"),
        ("t_end = 0.05", "", "run.t_end: missing; expected a number above 0, the end time"),
        ("h = 1e-3", "h = 0", "run.h = 0: expected a number above 0"),
        ("rho_inf = 0.7", "rho_inf = 1.7", "run.rho_inf = 1.7"),
        ("rho_inf = 0.7", 'scheme = "hth"', "run.scheme"),
        ("rho_inf = 0.7", 'scheme = "hht"\nrho_inf = 0.7', "the scheme hht has no key rho_inf"),
        ("[system]", "[system", "not valid TOML"),
    ],
)  # fmt: skip
def test_mistakes_are_answered_with_key_value_and_choices(write, old, new, words):
    with pytest.raises(SystemFileError, match=words):
        read_system(write((old, new)))


def test_a_damaged_modal_file_is_named_with_its_key(write, tmp_path):
    path = write()
    (tmp_path / "rod.h5").write_bytes(b"nothing")
    with pytest.raises(SystemFileError, match=r"bodies\.rod\.file: .*rod\.h5"):
        read_system(path)


MILLIMETRES = [
    ("m-kg-s", "mm-t-s"), ("-9.81", "-9810"), ("position = [0, 0, 1]", "position = [0, 0, 1000]"), ("2.0", "2.0e-3"),
    ("[[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]", "[[100, 0, 0], [0, 100, 0], [0, 0, 100]]"),
    ("position = [1, 0, 1]", "position = [1000, 0, 1000]"), ("[2, 0, 0]", "[2000, 0, 0]"),
    ("stiffness = 10", "stiffness = 0.01"), ("damping = 0.5", "damping = 0.5e-3"),
]  # fmt: skip


def test_a_file_in_other_units_is_converted_with_a_note_and_moves_the_same(write, caplog):
    """The same pendulum written in metres and in millimetres, both with the file in metres."""
    motions = []
    for changes in ([], MILLIMETRES):
        system, run = read_system(write(*changes))
        motions.append(integrate(system, run.integrator, run.t_end, run.h, output_every=run.output_every))
    assert [r.getMessage().split("rod.h5 ")[1] for r in caplog.records] == [
        "is in units m-kg-s: converted to those of the system, mm-t-s"
    ]
    metres, millimetres = motions
    for name in ("rod", "bob"):
        a, b = metres.body(name).r, millimetres.body(name).r
        assert np.abs(a - a[0]).max() > 1e-3
        assert_allclose(b / 1000, a, rtol=0, atol=1e-7 * np.abs(a - a[0]).max())
    q = metres.body("rod").q  # mass^(1/2) length
    assert_allclose(millimetres.body("rod").q * np.sqrt(1e3) * 1e-3, q, rtol=0, atol=1e-6 * np.abs(q).max())


def test_two_instances_read_their_file_once(write):
    path = write(("[bodies.bob]", '[bodies.rod2]\nfile = "rod.h5"\nposition = [5, 0, 0]\n\n[bodies.bob]'))
    system, _ = read_system(path)
    assert system.bodies[0].reduced is system.bodies[1].reduced


DRIVEN = """
[system]
units = "m-kg-s"

[bodies.nut]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]

[bodies.bob]
mass = 2.0
inertia = [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]
position = [1, 0, 0]

[joints.thread]
type = "screw"
body_a = "ground"
body_b = "nut"
marker_b = [0, 0, 0]
axis = [0, 0, 1]
lead = 0.2

[joints.thread.motions.angle]
type = "cycloidal-spin-up"
omega = 4
duration = 1.0

[joints.rod]
type = "distance"
body_a = "nut"
marker_a = [0, 0, 0]
body_b = "bob"
marker_b = [0, 0, 0]

[run]
t_end = 0.1
h = 1e-2
"""


def test_prescribed_motions_come_from_tables(tmp_path):
    path = tmp_path / "screw.toml"
    path.write_text(DRIVEN)
    system, run = read_system(path)
    screw, rod = system.joints
    assert (type(screw).__name__, type(rod).__name__, screw.lead) == ("ScrewJoint", "DistanceJoint", 0.2)
    assert_allclose(screw.motions["angle"](1.0, 1), 4.0, rtol=1e-12, atol=0)
    motion = integrate(system, run.integrator, run.t_end, run.h)
    angle = screw.motions["angle"](motion.t[-1])
    assert_allclose(motion.body("nut").r[-1, 2], 0.2 * angle / (2 * np.pi), rtol=0, atol=1e-9)


def test_pieces_come_from_tables(tmp_path):
    path = tmp_path / "screw.toml"
    pieces = """type = "piecewise"
t = [0.0, 0.5, 2.0]
pieces = [
    { type = "constant", value = 0.5 },
    { type = "polynomial", coefficients = [0.5, 0.0, 4.0] },
    { type = "polynomial", coefficients = [9.5, 12.0] },
]
"""
    old = DRIVEN[DRIVEN.index('type = "cycloidal') : DRIVEN.index("[joints.rod]")]
    path.write_text(DRIVEN.replace(old, pieces + "\n"))
    motion = read_system(path)[0].joints[0].motions["angle"]
    assert_allclose([motion(t) for t in (-1.0, 0.4, 1.5, 3.0)], [0.5, 0.5, 4.5, 21.5], rtol=1e-14, atol=0)
    for old, new, words in (
        ("[0.5, 0.0, 4.0]", "[0.6, 0.0, 4.0]", "joints.thread.motions: angle: the value jumps by 0.1 at t = 0.5"),
        ("t = [0.0, 0.5, 2.0]", "t = [0.0, 0.5]", "motions.angle: expected rising times and as many functions"),
        ("t = [0.0, 0.5, 2.0]", "t = [0.0, 0.5, 0.2]", "the times do not rise"),
        ("value = 0.5", "valeu = 0.5", "pieces.*valeu.*did you mean .value"),
    ):
        assert old in path.read_text()
        (tmp_path / "wrong.toml").write_text(path.read_text().replace(old, new))
        with pytest.raises(SystemFileError, match=words):
            read_system(tmp_path / "wrong.toml")


def test_a_number_fixes_a_coordinate(tmp_path):
    """In a file as in Python, where the motions are {"angle": 0.5}."""
    path = tmp_path / "screw.toml"
    begin, end = DRIVEN.index("[joints.thread.motions.angle]"), DRIVEN.index("[joints.rod]")
    path.write_text(DRIVEN[:begin] + "[joints.thread.motions]\nangle = 0.5\n\n" + DRIVEN[end:])
    motion = read_system(path)[0].joints[0].motions["angle"]
    assert [motion(0.0), motion(3.0)] == [0.5, 0.5]
    path.write_text(path.read_text().replace("angle = 0.5", 'angle = "0.5"'))
    with pytest.raises(SystemFileError, match=r'motions.angle = "0.5": expected .* a number .*\(line'):
        read_system(path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("lead = 0.2", "", "lead: missing; expected a number: Distance along the axis per turn"),
        (
            "lead = 0.2",
            "lead = 0",
            r"lead = 0: expected a number other than zero; use .* joint \(line 20\)",
        ),
        ("omega = 4", "omgea = 4", "motions.angle.omgea: .*did you mean .omega"),
        ("omega = 4", "", "omega: missing; expected a number: Angular speed"),
        ("omega = 4", "omega = 4\nphase = 1", 'phase: unknown key of type "cycloidal-spin-up"'),
        ("motions.angle", "motions.turn", "no coordinate 'turn'; choices: angle"),
        ('"cycloidal-spin-up"', '"cycloid"', "unknown type of motion; did you mean .cycloidal-spin-up.. choices"),
        ("duration = 1.0", "duration = 0", r"duration = 0: expected a number above 0, got 0 \(line 25\)"),
    ],
)
def test_mistakes_in_motions_are_answered_with_key_value_and_choices(tmp_path, old, new, words):
    path = tmp_path / "screw.toml"
    assert old in DRIVEN
    path.write_text(DRIVEN.replace(old, new))
    with pytest.raises(SystemFileError, match=words):
        read_system(path)


FORCES = """
[forces.motor]
type = "joint-force"
joint = "pin"
coordinate = "angle"
damping = 0.2
friction = 0.1

[forces.motor.motor]
type = "smooth-step"
t_start = 0
t_end = 1
first = 0
last = 2.0

[forces.bump]
type = "spring-damper"
body_a = "bob"
body_b = "ground"
marker_b = [2, 1, 0]
free_length = 1

[forces.bump.characteristic]
type = "table"
t = [-1, 0, 1, 2]
values = [-5, 0, 1, 8]

[run]
"""


def test_forces_in_joints_and_tables_are_read(write):
    system, _ = read_system(write(("[run]", FORCES), ("gravity =", 'redundant = "minimum-norm"\ngravity =')))
    motor = next(force for force in system.forces if getattr(force, "name", "") == "motor")
    bump = next(force for force in system.forces if getattr(force, "name", "") == "bump")
    assert (motor.joint, motor.coordinate, motor.damping, motor.friction) == ("pin", "angle", 0.2, 0.1)
    assert_allclose([motor.motor(0.5), bump.characteristic(2.0)], [1.0, 8.0], rtol=1e-12, atol=0)
    assert system.redundant == "minimum-norm"


def test_a_table_whose_spline_overshoots_is_noted_unless_its_interpolation_is_chosen(write, caplog):
    """A step at uneven times leaves its range by many times its size; a smooth table and a monotone one stay within."""
    step = "[0, 0, 10, 10, 10]"
    steps = FORCES.replace("t = [-1, 0, 1, 2]", "t = [0, 0.5, 0.52, 2, 5]").replace("[-5, 0, 1, 8]", step)
    monotone = steps.replace(step, f'{step}\ninterpolation = "monotone"')
    note = "forces.bump.characteristic: its cubic spline leaves the range"
    for text, notes in ((FORCES, []), (steps, [note]), (monotone, [])):
        caplog.clear()
        system, _ = read_system(write(("[run]", text)))
        found = [record.getMessage().split("swing.toml: ")[1] for record in caplog.records]
        assert [note[: len(wanted)] for note, wanted in zip(found, notes, strict=True)] == notes
        force = next(each for each in system.forces if getattr(each, "name", "") == "bump")
        beyond = np.max(force.characteristic.at(np.linspace(0, 2, 400))) - 10
        assert (beyond > 100) == bool(notes)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('joint = "pin"', "", "motor.joint: missing; expected text: Name of the joint"),
        ('joint = "pin"', 'joint = "pni"', r"force 'motor': no joint 'pni'; did you mean 'pin'.* \(line 45\)"),
        ('coordinate = "angle"', 'coordinate = "distance"', "no coordinate 'distance' that can take a force"),
        ("friction = 0.1", "friction = -1", "friction = -1: expected a number of 0 or more"),
        (
            "t_start = 0",
            "t_strat = 0",
            r"forces.motor.motor.t_strat: unknown key of type .smooth-step.; did you mean 't_start'.* \(line 54\)",
        ),
        ("damping = 0.2", "force = [1, 0, 0]", 'motor.force: unknown key of type "joint-force"; did you mean .free.'),
    ],
)
def test_mistakes_in_joint_forces_are_answered(write, old, new, words):
    assert old in FORCES
    with pytest.raises(SystemFileError, match=words):
        read_system(write(("[run]", FORCES.replace(old, new))))


@pytest.mark.parametrize(
    ("keys", "integrator"),
    [
        ('scheme = "hht"\nalpha = -0.2\nerror_tolerance = 1e-6', hht(-0.2, error_tolerance=1e-6)),
        ('scheme = "newmark"\nbeta = 0.3\ngamma = 0.6', newmark(0.3, 0.6)),
        ('scheme = "trapezoidal"\ntolerance = 1e-9', trapezoidal(tolerance=1e-9)),
        ("rho_inf = 0.6\nh_min = 1e-5\nmax_iterations = 9", GeneralizedAlpha(0.6, h_min=1e-5, max_iterations=9)),
    ],
)
def test_run_names_its_scheme(write, keys, integrator):
    _, run = read_system(write(("rho_inf = 0.7", keys)))
    assert run.integrator == integrator


def test_file_holds_events(write):
    text = '[events.low]\nwatch = "pin.angle"\nlevel = -0.5\ndirection = "falling"\nswitch_off = ["spring"]\n\n[run]'
    system, _ = read_system(write(("[run]", text)))
    assert system.events == (Event("low", "pin.angle", -0.5, "falling", switch_off=("spring",)),)
    for old, new, words in (("pin.angle", "pin.angel", "no sensor or joint coordinate 'pin.angel'"),
                            ('"spring"]', '"sprnig"]', "no force, coupler or element 'sprnig'; did you mean 'spring'"),
                            ("falling", "fallling", "events.low.direction")):  # fmt: skip
        with pytest.raises(SystemFileError, match=words):
            read_system(write(("[run]", text.replace(old, new))))


def test_file_holds_events_at_times_and_events_that_record(write):
    text = '[events.go]\nat = 0.25\nswitch_on = ["spring"]\n[events.low]\nwatch = "pin.angle"\nrecord = true\n\n[run]'
    system, _ = read_system(write(("[run]", text)))
    assert system.events == (Event("go", at=0.25, switch_on=("spring",)), Event("low", "pin.angle", record=True))
    with pytest.raises(SystemFileError, match=r"events.go: expected either watch .* got both \(line 44\)"):
        read_system(write(("[run]", text.replace("at = 0.25", 'at = 0.25\nwatch = "pin.angle"'))))


def test_modal_coordinates_at_the_start_stand_in_the_file(write):
    """And the motion begins with them: a joint takes the body as a whole."""
    where = 'file = "rod.h5"'
    system, _ = read_system(write((where, f"{where}\nq = [0.01, -0.02, 0.005]\nq_dot = [0.1, 0, 0]")))
    rod = system.bodies[0]
    assert_array_equal(rod.q, [0.01, -0.02, 0.005])
    assert_array_equal(rod.q_dot, [0.1, 0, 0])
    for keys, words in (("q = [0.01]", r"bodies\.rod\.q: expected 3 numbers, one for each mode of the body, got 1"),
                        ('q = ["a", 0, 0]', r"bodies\.rod\.q"),
                        ("modes = [0, 2]\nq_dot = [0, 0, 1]", r"bodies\.rod\.q_dot: expected 2 numbers")):  # fmt: skip
        with pytest.raises(SystemFileError, match=words):
            read_system(write((where, f"{where}\n{keys}")))
    with pytest.raises(SystemFileError, match="q: a rigid body has no such key"):
        read_system(write(("mass = 2.0", "mass = 2.0\nq = [0.0]")))


def test_names_that_joints_have_elsewhere_lead_to_joints():
    assert set(ELSEWHERE.values()) <= set(JOINTS)
    assert not set(ELSEWHERE) & set(JOINTS)


def test_read_system_is_public():
    assert inspect.unwrap(floatframe.read_system) is read_system
