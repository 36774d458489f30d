"""Channels, state space and frequency responses against closed forms, statics and each other; files read back."""

import csv
from dataclasses import replace

import h5py
import numpy as np
import pytest
import scipy.linalg as la
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from scipy.io import loadmat

from floatframe import (
    GROUND,
    FlexibleBody,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    frequency_response,
    linearize,
    static_equilibrium,
)
from floatframe.analyses import resolved_frequencies
from floatframe.analyses.snapshot import snapshot
from floatframe.errors import ModelError
from floatframe.joints import JointCoordinate
from floatframe.results.sensors import StressSensor
from floatframe.sensors import Channel, StressChannel
from tests.floatframe.cli.examples import PENDULUM
from tests.floatframe.command import answer_of_floatframe
from tests.floatframe.point_masses import PointMasses, random_point_masses, reduced_body, stiffness

M_, K_, C_ = 2.0, 50.0, 3.0


def oscillator():
    mass = RigidBody("mass", M_, np.eye(3), position=(1, 0, 0))
    springs = [
        SpringDamper(f"spring {axis}", Marker(GROUND, position=end), Marker("mass"), K_, C_, free_length=None)
        for axis, end in zip("xyz", ([0, 0, 0], [1, 1, 0], [1, 0, 1]), strict=True)
    ]
    return System([mass], [], springs)


def transfer_of(space, s):
    return space.C @ np.linalg.solve(s * np.eye(len(space.A)) - space.A, space.B) + space.D


def test_velocity_and_acceleration_outputs_are_those_of_the_oscillator_in_both_forms():
    push = Channel("push", Marker("mass"), (1, 0, 0))
    outputs = [replace(push, name=name, rate=rate) for rate, name in enumerate(("x", "v", "a"))]
    linear = linearize(oscillator(), inputs=[push], outputs=outputs)
    f = np.array([0.1, 0.8, 3.0])
    s = 2j * np.pi * f
    exact = np.array([s**rate / (K_ + s * C_ + s**2 * M_) for rate in (0, 1, 2)]).T
    response = frequency_response(linear, f)
    assert_allclose(response.values[:, :, 0], exact, rtol=1e-9)
    assert_allclose([transfer_of(linear.state_space(), x)[:, 0] for x in s], exact, rtol=1e-9)
    assert response.units == (("m/N",), ("m/s/N",), ("m/s²/N",))
    assert_allclose(response.phases[0, :, 0], np.degrees(np.angle(exact[0])), rtol=1e-9)


def test_joint_coordinate_is_input_and_output():
    rod = RigidBody("rod", 2.0, np.diag([1e-3, 0.2, 0.2]), center_of_mass=(0.5, 0, 0))
    hinge = RevoluteJoint("hinge", GROUND, Marker("rod"), axis=(0, 0, 1))
    turn = JointCoordinate("hinge", "angle", "turn", rate=0)
    linear = linearize(System([rod], [hinge], [Gravity((0, -9.81, 0))]), inputs=[turn], outputs=[turn])
    f = np.array([0.0, 0.3, 2.0])
    exact = 1 / (9.81 * 2.0 * 0.5 - (2 * np.pi * f) ** 2 * (0.2 + 2.0 * 0.25))
    assert_allclose(linear.response(f)[:, 0, 0], exact, rtol=1e-8)
    assert (linear.input_units, linear.output_units) == (("N m",), ("rad",))


def test_stress_output_at_rest_is_the_change_of_the_stress_with_the_force():
    points, K = random_point_masses(3, 3, softness=0.1), stiffness(3, omega=10.0)
    reduced = replace(reduced_body(points, K), stress=np.random.default_rng(0).normal(size=(40, 6, 3)))
    position = reduced.nodes[5]

    def held(*forces):
        joints = [RevoluteJoint("root", GROUND, Marker("body", "end_b"), axis=(0, 0, 1))]
        spring = SpringDamper("stay", Marker(GROUND, position=(0, 3, 0)), Marker("body", "end_a"), 40.0)
        return System([FlexibleBody("body", reduced)], joints, [spring, *forces])

    stress = StressChannel("stress", "body", "yz", position)
    push = Channel("push", Marker("body", "end_a"), (0.6, 0.8, 0))
    linear = linearize(held(), inputs=[push], outputs=[stress])

    def stress_under(force):
        system = held(PointForce("push", push.marker, force * push.direction))
        rest = static_equilibrium(system)
        sensor = StressSensor("s", "body", position=position)
        return sensor.measure(system, snapshot(system, rest.state, rest.u_dot, rest.w)).columns["yz"][0]

    s = 1e-3
    slope = (stress_under(s) - stress_under(-s)) / (2 * s)
    assert_allclose(linear.response([0.0])[0, 0, 0].real, slope, rtol=1e-5)
    assert linear.output_units == ("Pa",)


def test_state_space_holds_the_flexibility_of_motions_without_mass():
    points, K = random_point_masses(3, 3, softness=0.1), stiffness(3, omega=10.0)
    phi = np.concatenate([points.phi, np.zeros((len(points.c), 3, 1))], axis=2)
    reduced = reduced_body(PointMasses(points.m, points.c, phi), la.block_diag(K, [[40.0]]))
    end = reduced.interface("end_a")
    Psi = end.Psi.copy()
    Psi[:3, 3] = [0.6, 0.0, 0.8]
    reduced = replace(reduced, interfaces=(replace(end, Psi=Psi),))
    anchors = np.array([[3.0, 1, 1], [0, 4, 2], [1, 0, 7], [5, 5, 5], [-2, 1, 0], [0, 0, 0]])
    tip = Marker("body", "end_a")
    springs = [
        SpringDamper(f"spring {k}", Marker(GROUND, position=a), tip, 50.0 + 9 * k) for k, a in enumerate(anchors)
    ]
    push = Channel("push", tip, (0.6, 0.0, 0.8))
    linear = linearize(
        System([FlexibleBody("body", reduced, position=(1, 2, 3))], [], springs), inputs=[push], outputs=[push]
    )
    assert linear.feedthrough()[0, 0] > 1e-4 * abs(linear.response([0.0])[0, 0, 0])
    for f in (0.05, 0.4):
        exact = linear.response([f])[0, 0, 0]
        assert_allclose(transfer_of(linear.state_space(), 2j * np.pi * f)[0, 0], exact, rtol=1e-8)


def test_resonances_are_met_by_their_frequencies():
    push = Channel("push", Marker("mass"), (1, 0, 0))
    springs = [replace(spring, damping=0.01) for spring in oscillator().forces]
    linear = linearize(System(oscillator().bodies, [], springs), inputs=[push], outputs=[push])
    f = resolved_frequencies(linear, 0.1, 10.0, n=50)
    peak = frequency_response(linear, f).amplitudes.max()
    zeta = 0.01 / (2 * np.sqrt(K_ * M_))
    assert_allclose(peak, 1 / (2 * zeta * K_), rtol=1e-4)
    with pytest.raises(ModelError, match="an ascending band above 0"):
        resolved_frequencies(linear, 1.0, 0.5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: linearize(oscillator(), inputs=[StressChannel("s", "mass", "xx", (0, 0, 0))]), "'s' is a stress"),
        (
            lambda: linearize(oscillator(), outputs=[StressChannel("s", "mass", "xx", (0, 0, 0))]),
            "no flexible body 'mass'",
        ),
        (
            lambda: linearize(oscillator(), outputs=[JointCoordinate("pin", "angle", "c", rate=0)]),
            "no joint 'pin' in the motion",
        ),
        (lambda: Channel("c", Marker("mass"), rate=3), "rate: expected 0, 1 or 2"),
        (lambda: StressChannel("s", "b", "vm", (0, 0, 0)), "component: expected one of xx"),
        (lambda: frequency_response(linearize(oscillator()), [1.0]), "has no inputs"),
    ],
)
def test_impossible_channels_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


CHANNELS = """
[inputs.torque]
joint = "hinge"
coordinate = "angle"

[inputs.push]
body = "rod"
marker = [1, 0, 0]
direction = [0, 1, 0]

[outputs.tip]
body = "rod"
marker = [1, 0, 0]
direction = [1, 0, 0]
measure = "acceleration"

[outputs.turn]
joint = "hinge"
coordinate = "angle"
"""
WORDS = ("inputs", "outputs", "output_units")
LINEAR = PENDULUM.replace("\n[run]", CHANNELS + "\n[run]")


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(LINEAR)
    return path


def exact_response(s):
    """Of turn over torque, turn over push, tip over torque; the rod hangs along -y, its tip at (0, -1)."""
    turn = 1 / (9.81 + s**2 * (1 / 6 + 0.5))
    return turn, 0.0 * s, s**2 * turn


def test_linearize_writes_the_channels_of_the_file_in_three_forms(pendulum):
    s = 2j
    for suffix in (".npz", ".mat", ".h5"):
        path = pendulum.with_suffix(suffix)
        assert "2 inputs, 2 outputs" in answer_of_floatframe("linearize", pendulum, "-o", path)
        if suffix == ".npz":
            with np.load(path) as data:
                A, B, C, D = (data[name] for name in "ABCD")
                words = {name: list(data[name]) for name in WORDS}
        elif suffix == ".mat":
            data = loadmat(path)
            A, B, C, D = (data[name] for name in "ABCD")
            words = {
                name: [str(text[0]) for text in data[name].ravel()] for name in ("inputs", "outputs", "output_units")
            }
        else:
            with h5py.File(path) as data:
                A, B, C, D = (data[name][...] for name in "ABCD")
                words = {name: list(data.attrs[name]) for name in WORDS}
        assert words == {"inputs": ["torque", "push"], "outputs": ["tip", "turn"], "output_units": ["m/s²", "rad"]}
        H = C @ np.linalg.solve(s * np.eye(2) - A, B) + D
        turn, push, tip = exact_response(s)
        assert_allclose(H, [[tip, push], [turn, push]], rtol=1e-8, atol=1e-8)
    pendulum.write_text(PENDULUM)
    for suffix in (".mat", ".h5"):
        assert "0 inputs" in answer_of_floatframe("linearize", pendulum, "-o", pendulum.with_suffix(suffix))


def test_response_draws_and_writes_what_the_textbook_says(pendulum):
    text = answer_of_floatframe("response", pendulum, "--band", "0.1:10")
    assert pendulum.with_suffix(".response.png").read_bytes().startswith(b"\x89PNG")
    assert "turn / torque" in text
    answer_of_floatframe(
        "response",
        pendulum,
        "--band",
        "0.1:10",
        "--points",
        20,
        "-i",
        "hinge.angle",
        "--out",
        "turn",
        "-o",
        pendulum.with_suffix(".csv"),
    )
    with open(pendulum.with_suffix(".csv"), newline="") as file:
        names, *rows = csv.reader(file)
    assert names == ["frequency [Hz]", "turn / hinge.angle amplitude [rad/(N m)]", "turn / hinge.angle phase [degrees]"]
    f, size, _ = np.array(rows, dtype=float).T
    assert_allclose(size, np.abs(exact_response(2j * np.pi * f)[0]), rtol=1e-6)


def test_plot_of_responses_has_a_panel_for_each_unit_and_one_for_phases():
    push = Channel("push", Marker("mass", position=(0, 0.5, 0)), (1, 0, 0))
    turn = Channel("turn", Marker("mass"), (0, 0, 1), "rotation")
    still = Channel("still", Marker("mass"), (0, 1, 0), rate=1)
    linear = linearize(oscillator(), inputs=[push], outputs=[push, turn, still])
    figure = frequency_response(linear, np.geomspace(0.1, 10, 30)).plot()
    assert [ax.get_ylabel() for ax in figure.axes] == ["amplitude [m/N]", "amplitude [rad/N]", "phase [degrees]"]
    assert figure.get_suptitle() == "no response: still / push"
    response, axes = frequency_response(linear, np.geomspace(0.1, 10, 30)), Figure().subplots(3)
    assert response.plot(axes=axes) is axes[0].figure
    assert [ax.get_ylabel() for ax in axes] == [ax.get_ylabel() for ax in figure.axes]
    with pytest.raises(ModelError, match=r"expected 3 axes, for the amplitudes in m/N, rad/N and the phases, got 2"):
        response.plot(axes=axes[:2])


@pytest.mark.parametrize(("old", "new", "words"), [
    ('joint = "hinge"\ncoordinate = "angle"\n\n[inputs.push]', 'joint = "hinge"\n\n[inputs.push]', "coordinate: mis"),
    ('[inputs.push]\n', '[inputs.push]\njoint = "hinge"\n', "do not go together"),
    ('measure = "acceleration"', 'measure = "accelration"', "did you mean 'acceleration'"),
    ('measure = "acceleration"', 'component = "xx"', "do not go together"),
    ('[inputs.push]\nbody = "rod"', '[inputs.push]\nbody = "rodd"', "inputs.push.body = \"rodd\""),
    ('[inputs.push]\nbody = "rod"\nmarker = [1, 0, 0]\ndirection = [0, 1, 0]', "[inputs.push]", "expected body"),
])  # fmt: skip
def test_mistakes_in_channels_are_answered(pendulum, old, new, words):
    assert LINEAR.count(old) == 1
    pendulum.write_text(LINEAR.replace(old, new))
    assert words in answer_of_floatframe("linearize", pendulum, code=2)


@pytest.mark.parametrize(("words", "message"), [
    (["linearize", "-o", "out.txt"], "expected a file name that ends in .npz, .mat, .h5"),
    (["linearize", "-i", "torqe"], "did you mean 'torque'"),
    (["response", "--band", "1-2"], 'expected "from:to" in Hz'),
    (["response", "--band", "5:1"], "an ascending band above 0"),
])  # fmt: skip
def test_commands_refuse_what_they_cannot_do(pendulum, words, message):
    assert message in answer_of_floatframe(words[0], pendulum, *words[1:], code=2)


SHAKEN = PENDULUM.replace(
    "\n[run]",
    """
[sensors.load]
type = "reaction"
of = "hinge"

[inputs.shake]
type = "base"
direction = [1, 0, 0]

[outputs.side]
sensor = "load"
column = "force x"

[outputs.bearing]
sensor = "load"

[run]""",
)


def test_files_name_sensors_as_outputs_and_bases_as_inputs(pendulum):
    """A rod that hangs on a hinge shaken sideways with a: force x on the ground m a (1 + s² l c/(s² + g c)), ..."""
    pendulum.write_text(SHAKEN)
    path = pendulum.with_suffix(".npz")
    text = answer_of_floatframe("linearize", pendulum, "-o", path)
    with np.load(path) as data:
        names, units = list(data["outputs"]), list(data["output_units"])
        A, B, C, D = (data[name] for name in "ABCD")
    assert names[0] == "side"
    assert names[1:4] == [f"bearing.force {axis}" for axis in "xyz"]
    assert units[0] == "N"
    assert "omitted: bearing.moment size" in text
    s = 2j * np.pi * 0.7
    H = C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D
    m, J, c, g = 2.0, 1 / 6 + 0.5, 0.5, 9.81
    turn = -m * c / (J * s**2 + m * g * c)  # by the acceleration of the hinge
    assert_allclose(H[0, 0], -m * (1 + c * s**2 * turn), rtol=1e-9)
    for name in ("side", "load.force x", "bearing.force x"):
        csv_path = pendulum.with_suffix(".csv")
        answer_of_floatframe("response", pendulum, "--band", "0.7:0.9", "--out", name, "-o", csv_path)
        with open(csv_path, newline="") as file:
            rows = list(csv.reader(file))
        assert_allclose(float(rows[1][1]), abs(H[0, 0]), rtol=1e-6)


@pytest.mark.parametrize(("old", "new", "words"), [
    ('sensor = "load"\ncolumn', 'sensor = "lod"\ncolumn', "no sensor 'lod'; did you mean 'load'"),
    ('column = "force x"', 'column = "force u"', "no column 'force u'"),
    ('column = "force x"', 'column = "moment size"', "is not linear here"),
    ('type = "base"', 'type = "bse"', "did you mean 'base'"),
    ('type = "base"', 'type = "base"\nbody = "rod"', "an input of type base has no key body"),
    ('type = "base"\ndirection = [1, 0, 0]', 'type = "drive"\njoint = "hinge"', "coordinate: missing"),
])  # fmt: skip
def test_mistakes_in_outputs_of_sensors_are_answered(pendulum, old, new, words):
    assert SHAKEN.count(old) == 1
    pendulum.write_text(SHAKEN.replace(old, new))
    assert words in answer_of_floatframe("linearize", pendulum, code=2)
