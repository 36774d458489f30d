"""Sensors against differences of what they measure, and sums over the modes; in the file, the table and the plot."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.body.modal_file.file import write
from cms.body.stress import von_mises
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    integrate,
    read_results,
)
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.joints import JointCoordinate
from floatframe.model.rotations import rotation_matrix
from floatframe.pictures.body_colors import VON_MISES
from floatframe.results.place_motion import interface_motion, largest_von_mises, point_motion
from floatframe.results.sensors import (
    AngleSensor,
    DisplacementSensor,
    ElongationSensor,
    EnergySensor,
    ModeSensor,
    MomentumSensor,
    PlaceSensor,
    ReactionSensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
    measured,
    sensor_of,
)
from tests.floatframe.command import answer_of_floatframe, run_floatframe
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness
from tests.floatframe.results.examples import BODY, RNG, TEXT

H = 5e-4
REDUCED = replace(reduced_body(random_point_masses(3, 5), stiffness(3), name="rod"), stress=RNG.normal(size=(40, 6, 3)))
TIP, ARM_TIP = Marker("rod", "end_a"), Marker("arm", position=(0.5, 0.1, 0))


def swing_system(*sensors):
    rod = FlexibleBody("rod", REDUCED, omega_B=(0.3, 1, 3))
    arm = RigidBody("arm", 0.5, 0.1 * np.eye(3), position=REDUCED.interface("end_a").position, omega_B=(2.0, 0, -1.0))
    joints = [
        SphericalJoint("pin", GROUND, Marker("rod", "end_b")),
        RevoluteJoint("knee", TIP, Marker("arm"), axis=(0, 1, 0)),
    ]
    spring = SpringDamper("stay", Marker(GROUND, position=(0, 0, 3)), ARM_TIP, 5.0, 0.1, 1.0)
    return System([rod, arm], joints, [Gravity((0, 0, -9.81)), spring], sensors=sensors)


@pytest.fixture(scope="module")
def swing():
    return integrate(swing_system(), GeneralizedAlpha(0.8), 0.3, H)


def vector(system, motion, sensor):
    columns = sensor.measure(system, motion).columns
    return np.stack([columns[axis] for axis in "xyz"], axis=1)


def rate(values):
    return (values[2:] - values[:-2]) / (2 * H)


@pytest.mark.parametrize(("place", "other"), [(ARM_TIP, TIP), (Marker("rod", "end_b"), ARM_TIP), (ARM_TIP, None)])
def test_velocity_and_acceleration_are_the_rates_of_what_the_other_marker_sees(swing, place, other):
    system = swing_system()
    position, velocity, acceleration = (
        vector(system, swing, PlaceSensor("s", place, quantity, other))
        for quantity in ("position", "velocity", "acceleration")
    )
    assert_allclose(rate(position), velocity[1:-1], rtol=0, atol=1e-4 * np.abs(velocity).max())
    assert_allclose(rate(velocity), acceleration[1:-1], rtol=0, atol=1e-3 * np.abs(acceleration).max())


def test_rotation_and_angular_velocity_are_those_of_the_axes(swing):
    system = swing_system()
    sensor = PlaceSensor("s", ARM_TIP, "angular-velocity", TIP)
    a, b = interface_motion(swing, "rod", REDUCED, "end_a"), point_motion(swing, "arm", (0, 0, 0))
    axes = np.einsum("tba,tbc->tac", a.axes, b.axes)
    spin = np.einsum("tab,tcb->tac", rate(axes), axes[1:-1])
    found = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    omega = vector(system, swing, sensor)
    assert_allclose(found, omega[1:-1], rtol=0, atol=1e-4 * np.abs(omega).max())
    turned = vector(system, swing, replace(sensor, quantity="rotation-vector"))
    assert_allclose(
        turned[:, 1], -vector(system, swing, PlaceSensor("s", TIP, "rotation-vector", ARM_TIP))[:, 1], atol=1e-12
    )
    angle = AngleSensor("a", TIP, Marker("arm"), axis=(0, 1, 0)).measure(system, swing).columns["angle"]
    hinge = JointCoordinate("knee", "angle", "h").measure(system, swing).columns["value"]
    assert_allclose(np.diff(angle), np.diff(hinge), rtol=0, atol=1e-6)
    assert np.ptp(hinge) > 0.1


def test_displacement_of_interface_and_of_the_node_nearest_to_a_position(swing):
    system = swing_system()
    q = swing.body("rod").q
    at_interface = vector(system, swing, DisplacementSensor("d", TIP))
    assert_allclose(at_interface, q @ REDUCED.interface("end_a").Psi[:3].T, rtol=1e-14)
    node = 7
    near = REDUCED.nodes[node] + 1e-3
    assert_allclose(
        vector(system, swing, DisplacementSensor("d", Marker("rod", position=near))), q @ REDUCED.Phi[node].T
    )
    motion = swing.body("rod")
    exact = [r + rotation_matrix(p) @ (REDUCED.nodes[node] + REDUCED.Phi[node] @ x)
             for r, p, x in zip(motion.r, motion.p, motion.q, strict=True)]  # fmt: skip
    assert_allclose(
        vector(system, swing, PlaceSensor("p", Marker("rod", position=near))), exact, rtol=1e-12, atol=1e-13
    )


def test_a_displacement_relative_to_an_end_is_the_change_of_its_position_seen_from_there(swing):
    system, end = swing_system(), REDUCED.interface("end_b")
    base = Marker("rod", "end_b")
    seen = vector(system, swing, PlaceSensor("p", TIP, relative_to=base)) @ end.triad.T  # from axes of the end
    arm = REDUCED.interface("end_a").position - end.position
    found = vector(system, swing, DisplacementSensor("d", TIP, base))
    assert_allclose(found, seen - arm, rtol=0, atol=1e-13 * np.linalg.norm(arm))
    assert np.abs(found).max() > 1e-6 * np.linalg.norm(arm)
    assert_allclose(vector(system, swing, DisplacementSensor("d", base, base)), 0.0, atol=1e-15)
    with pytest.raises(ModelError, match="body 'arm' is not flexible"):
        DisplacementSensor("d", TIP, Marker("arm")).measure(system, swing)


def test_stress_strain_and_their_largest(swing):
    system = swing_system()
    q, node = swing.body("rod").q, 11
    position = REDUCED.nodes[node]
    columns = StressSensor("s", "rod", position=position).measure(system, swing).columns
    stress = np.einsum("cq,tq->tc", REDUCED.stress[node], q)
    for k, name in enumerate(("xx", "yy", "zz", "yz", "xz", "xy")):
        assert_allclose(columns[name], stress[:, k], rtol=0, atol=1e-14 * np.abs(stress).max())
    assert_allclose(columns["von Mises"], von_mises(stress), rtol=1e-12)
    d, E, nu = np.array([0.6, 0.0, 0.8]), 210.0, 0.3
    tensor = stress[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
    strain = (1 + nu) / E * tensor - nu / E * np.trace(tensor, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    gauge = StrainGauge("g", "rod", 5 * d, E, nu, position=position).measure(system, swing).columns["strain"]
    assert_allclose(gauge, np.einsum("a,tab,b->t", d, strain, d), rtol=0, atol=1e-14 * np.abs(strain).max())
    largest = VonMisesSensor("v", "rod").measure(system, swing).columns
    size, where = largest_von_mises(swing, "rod", REDUCED)
    assert_allclose(largest["largest"], size)
    assert_allclose(largest["node"], REDUCED.node_ids[where])
    assert_allclose(VON_MISES.values(REDUCED, q).max(axis=1), size, rtol=1e-12)


def test_elongation_is_the_change_along_the_line(swing):
    system, q = swing_system(), swing.body("rod").q
    a, b = REDUCED.nodes[3], REDUCED.nodes[20]
    found = ElongationSensor("e", "rod", a, b).measure(system, swing).columns["strain"]
    change = q @ (REDUCED.Phi[20] - REDUCED.Phi[3]).T
    assert_allclose(found, change @ (b - a) / ((b - a) @ (b - a)), rtol=0, atol=1e-14)
    assert np.abs(found).max() > 1e-3
    with pytest.raises(ModelError, match="have the same nearest node"):
        ElongationSensor("e", "rod", a, a).measure(system, swing)


def test_reactions_energies_momenta_and_modes_are_those_of_the_motion(swing):
    system = swing_system()
    motion = swing.reaction("knee")
    columns = ReactionSensor("r", "knee").measure(system, swing).columns
    assert_allclose(columns["force x"], motion.force[:, 0])
    assert_allclose(columns["moment size"], np.linalg.norm(motion.moment, axis=1))
    turned = ReactionSensor("r", "knee", "marker").measure(system, swing).columns
    assert_allclose(turned["force size"], columns["force size"], rtol=1e-12)
    # a hinge carries no moment about its axis, in the axes of the marker
    assert np.abs(turned["moment y"]).max() < 1e-9 * turned["moment size"].max()
    assert np.abs(columns["moment y"]).max() > 1e-2 * columns["moment size"].max()
    tension = ReactionSensor("t", "stay", "marker").measure(system, swing).columns
    assert_allclose(tension["force size"], np.linalg.norm(swing.reaction("stay").force, axis=1))
    energies = EnergySensor("e").measure(system, swing)
    assert_allclose(energies.columns["total"], swing.energies.total)
    assert energies.units["total"] == "N m"
    momentum = MomentumSensor("m").measure(system, swing).columns
    assert_allclose(momentum["angular z"], swing.angular_momentum[:, 2])
    mode = ModeSensor("q2", "rod", 2).measure(system, swing).columns
    assert_allclose(mode["q_dot"], swing.body("rod").q_dot[:, 1])


@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (PlaceSensor("tip", Marker("rodd", "end_a")), "sensor 'tip': marker: no body 'rodd'; did you mean 'rod'"),
        (PlaceSensor("tip", Marker("rod", "end_x")), "has no interface 'end_x'; did you mean"),
        (StressSensor("s", "arm", position=(0, 0, 0)), "sensor 's': no flexible body 'arm'"),
        (StressSensor("s", "rod", point="top"), "body 'rod' has no stress point 'top'"),
        (DisplacementSensor("d", Marker("arm")), "body 'arm' is not flexible"),
        (ReactionSensor("r", "kneee"), "no joint or spring 'kneee'; did you mean 'knee'"),
        (ModeSensor("m", "rod", 9), "mode: expected 1 to 3, got 9"),
    ],
)
def test_what_a_sensor_cannot_find_is_named(swing, sensor, words):
    with pytest.raises(ModelError, match=words):
        measured(swing_system(sensor), swing)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PlaceSensor("s", TIP, "speed"), "quantity: expected one of position, velocity"),
        (lambda: StressSensor("s", "rod"), "either a position or a stress point"),
        (lambda: StrainGauge("s", "rod", (0, 0, 0), 1.0, 0.3, position=(0, 0, 0)), "direction: expected a direction"),
        (lambda: StrainGauge("s", "rod", (1, 0, 0), 0.0, 0.3, position=(0, 0, 0)), "young: expected a number above 0"),
        (lambda: ReactionSensor("s", "pin", "body"), "axes: expected one of ground, marker"),
        (lambda: swing_system(EnergySensor("e"), EnergySensor("e")), "'e' is used twice"),
        (
            lambda: sensor_of(swing_system(EnergySensor("all")), "al"),
            "no sensor or joint coordinate 'al'; did you mean 'all'",
        ),
    ],
)
def test_impossible_sensors_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


def test_motion_of_another_system_is_refused(swing):
    with pytest.raises(ModelError, match="give the system of the run"):
        measured(System([RigidBody("other", 1.0, np.eye(3))]), swing)


@pytest.fixture
def spin(tmp_path):
    write(BODY, tmp_path / "part.h5")
    path = tmp_path / "spin.toml"
    path.write_text(TEXT)
    return path


def test_sensors_of_the_file_are_in_table_plot_and_record(spin):
    text = answer_of_floatframe("run", spin)
    assert "largest stress largest" in text
    results = spin.with_suffix(".h5")
    record = json.loads(answer_of_floatframe("info", results, "--json"))["sensors"]
    system, _ = read_system(spin)
    motion = read_results(results)
    tip = measured(system, motion)["tip"]
    assert record["tip size"]["unit"] == "mm/s"
    assert_allclose(record["tip size"]["greatest"], tip.columns["size"].max(), rtol=1e-15)
    answer_of_floatframe("export", results)
    with open(spin.with_suffix(".csv"), newline="") as file:
        names, *rows = csv.reader(file)
    table = dict(zip(names, np.array(rows, dtype=float).T, strict=True))
    assert_allclose(table["tip x [mm/s]"], tip.columns["x"], rtol=0, atol=0)
    rate = JointCoordinate("hinge", "angle").measure(system, motion).rate
    assert_allclose(table["hinge.angle rate [rad/s]"], rate, rtol=0, atol=0)
    assert "largest stress largest [MPa]" in names
    answer_of_floatframe("plot", results)
    answer_of_floatframe("plot", results, "-s", "tip", "-s", "hinge.angle", "-o", spin.with_name("two.png"))
    assert spin.with_name("two.png").read_bytes().startswith(b"\x89PNG")
    assert "did you mean 'hinge.angle'" in answer_of_floatframe("plot", results, "-s", "hinge.angel", code=2)


def test_results_whose_system_file_has_gone_or_changed_are_still_shown(spin, caplog):
    answer_of_floatframe("run", spin)
    results = spin.with_suffix(".h5")
    spin.write_text(TEXT.replace("[sensors.tip]", '[sensors.more]\ntype = "momentum"\n\n[sensors.tip]'))
    assert "more linear size" in answer_of_floatframe("info", results)
    assert "has changed since the run" in caplog.text
    spin.write_text(TEXT.replace("hinge]", "axle]").replace('"hinge"', '"axle"'))
    result = run_floatframe("info", results, code=0)
    assert "note: sensors are omitted" in result.stderr
    spin.unlink()
    assert "Sensors" not in answer_of_floatframe("info", results)
    assert "system file of the run does not exist any more" in answer_of_floatframe(
        "plot", results, "-s", "tip", code=2
    )


@pytest.mark.parametrize(("old", "new", "words"), [
    ('type = "velocity"', 'type = "velocty"', "did you mean 'velocity'"),
    ('type = "velocity"\nbody = "part"', 'type = "velocity"\nbody = "prt"', "sensors.tip.body = "),
    ('type = "von-mises"\n', 'type = "von-mises"\nmode = 3\n', 'mode: unknown key of type "von-mises"; did you'),
    ('of = "hinge"\n', "", "of: missing; expected text: Name of a joint or spring-damper (line 28)"),
    ('axes = "marker"', 'axes = "body"', 'axes = "body": unknown value; choices: ground, marker'),
    ('type = "von-mises"', 'type = "stress"', "expected either a position or a stress point"),
])  # fmt: skip
def test_mistakes_in_sensors_are_answered_with_key_and_choices(spin, old, new, words):
    assert TEXT.count(old) == 1
    spin.write_text(TEXT.replace(old, new))
    assert words in answer_of_floatframe("run", spin, code=2)


def test_film_is_coloured_by_stress_on_request(spin):
    answer_of_floatframe("run", spin)
    results = spin.with_suffix(".h5")
    answer_of_floatframe(
        "animate", results, "--color", "von-mises", "--fps", "1", "--speed", "0.003", "-o", spin.with_name("film.gif")
    )
    assert spin.with_name("film.gif").read_bytes().startswith(b"GIF8")
    assert "did you mean 'von-mises'" in answer_of_floatframe("animate", results, "--color", "von-mieses", code=2)
