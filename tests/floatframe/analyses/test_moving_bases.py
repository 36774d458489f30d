"""Bases and drives as inputs: against each other, momentum, the time integration of a harmonic drive, closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    State,
    System,
    integrate,
    linearize,
    static_equilibrium,
)
from floatframe.analyses import BaseMotion, Column, DriveMotion, named_state_space, steady_rotation
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced, in_ground_axes
from floatframe.errors import ModelError
from floatframe.joints import JointCoordinate
from floatframe.model.functions.time_functions import constant, harmonic
from floatframe.sensors import Channel, MomentumSensor, PlaceSensor, ReactionSensor, measured
from tests.floatframe.analyses.examples import machine, rotor, sensors

F = np.array([0.0, 0.4, 1.3, 9.0, 60.0])  #: Hz, across all modes
AXIS, ABOUT = np.array([0.0, 0.6, 0.8]), np.array([0.3, -0.2, 0.5])


def on_table(system, joint, moved):
    """The same system with a body in the place of the ground at some of its connections."""

    def carried(marker):
        return replace(marker, body="table") if getattr(marker, "body", None) in (GROUND, "ground") else marker

    def of_part(part):
        if part.name not in moved:
            return part
        if hasattr(part, "coordinates") and not hasattr(part, "marker_a"):
            link = part.coordinates["x"]
            return replace(part, coordinates={"x": replace(link, marker_a=carried(link.marker_a))})
        markers = {
            end: Marker("table") if getattr(part, end) is GROUND else carried(getattr(part, end))
            for end in ("marker_a", "marker_b")
        }
        return replace(part, **markers)

    table = RigidBody("table", 1.0, np.eye(3))
    gravity, *forces = system.forces
    return replace(
        system,
        bodies=[*system.bodies, table],
        joints=[joint, *(of_part(each) for each in system.joints)],
        couplers=system.couplers,
        forces=[gravity, *(each if not hasattr(each, "name") else of_part(each) for each in forces)],
    )


def seen():
    return [*sensors(), *(ReactionSensor(f"more {name}", name) for name in ("root", "stay"))]


@pytest.fixture(scope="module")
def stand():
    """The machine with markers on the ground where bodies stood in their place, so that a table can take over."""
    system = machine()
    root = replace(system.joints[0], marker_a=Marker(GROUND, position=arm_root(system)))
    return replace(system, joints=[root, *system.joints[1:]])


def arm_root(system):
    return system.bodies[0].reduced.interface("end_b").position


@pytest.mark.parametrize("kind", ["translation", "rotation"])
@pytest.mark.parametrize("moved", [("root", "stay", "control"), ("stay",), ("root", "control")])
def test_a_base_moves_like_a_table_that_is_driven(stand, kind, moved):
    if kind == "translation":
        joint = PrismaticJoint("rail", Marker(GROUND), Marker("table"), axis=AXIS, motions={"distance": constant(0.0)})
        drive = DriveMotion("shake", "rail", "distance")
    else:
        joint = RevoluteJoint(
            "rail", Marker(GROUND, position=ABOUT), "table", axis=AXIS, motions={"angle": constant(0.0)}
        )
        drive = DriveMotion("shake", "rail", "angle")
    everything = len(moved) == 3
    base = BaseMotion("shake", AXIS, kind, ABOUT, joints=None if everything else moved)
    own = linearize(stand, inputs=[base], outputs=seen())
    other = linearize(on_table(stand, joint, moved), inputs=[drive], outputs=seen())
    assert own.outputs == other.outputs
    one, two = own.response(F)[..., 0], other.response(F)[..., 0]
    is_finite = (np.isfinite(one) & np.isfinite(two)).all(axis=0)
    scale = np.abs(two[1:]).max(axis=0)
    if everything and kind == "translation":
        endless = [name for name, value, size in zip(own.outputs, one[0], scale, strict=True)
                   if not np.isfinite(value) and size > 1e-12]  # fmt: skip
        assert {name.split()[0] for name in endless} == {"position", "velocity", "momentum.linear", "momentum.angular"}
    for k, name in enumerate(own.outputs):
        if name.startswith("momentum") or scale[k] < 1e-12:  # that of the table is none of ours
            continue
        start = 0 if is_finite[k] else 1
        assert_allclose(one[start:, k], two[start:, k], rtol=1e-6, atol=1e-8 * scale[k], err_msg=name)
    if everything and kind == "translation":
        assert not own.B.any()
        assert not own.B_rate.any()
    space = own.state_space()
    for f in F[1:]:
        H = space.C @ np.linalg.solve(2j * np.pi * f * np.eye(len(space.A)) - space.A, space.B) + space.D
        assert_allclose(H, own.response([f])[0], rtol=1e-6, atol=1e-9 * np.abs(H).max())


def test_reactions_of_a_base_carry_the_momentum_of_the_system(stand):
    base = BaseMotion("shake", (1, 0, 0))
    outputs = [MomentumSensor("p"), ReactionSensor("root", "root"), ReactionSensor("stay", "stay")]
    linear = linearize(stand, inputs=[base], outputs=outputs)
    found = dict(zip(linear.outputs, linear.response(F[1:])[..., 0].T, strict=True))
    rate = 2j * np.pi * F[1:] * found["p.linear x"]
    carried = -(found["root.force x"] + found["stay.force x"])
    assert_allclose(carried, rate, rtol=1e-9)
    # beyond all modes the masses that hang in springs stand still; what is held takes part
    assert abs(found["root.force x"][-1]) < sum(body.reduced.moments.m if hasattr(body, "reduced") else body.mass
                                                for body in stand.bodies)  # fmt: skip


def test_quasi_static_part_of_a_slow_base_is_the_weight(stand):
    """An acceleration of the base so slow that nothing swings loads as gravity the other way."""
    slow = linearize(stand, inputs=[BaseMotion("shake", (0, 1, 0))], outputs=seen())
    g = 1e-4
    gravity, *forces = stand.forces
    moved = [replace(stand, forces=[replace(gravity, acceleration=gravity.acceleration - [0, s, 0]), *forces])
             for s in (g, -g)]  # fmt: skip
    found = []
    for system in moved:
        about = static_equilibrium(system, static_equilibrium(stand).state, tolerance=1e-12)
        found.append(linearize(system, about, outputs=seen()).output_values)
    slope = (found[0] - found[1]) / (2 * g)
    response = slow.response([0.0])[0, :, 0]
    checked = 0
    for k, name in enumerate(slow.outputs):
        if name.startswith(("root", "stay", "mount", "axle", "stress", "vm", "bend", "control", "gear", "more")) and (
            np.isfinite(response[k]) and "_dot" not in name
        ):
            assert_allclose(response[k].real, slope[k], rtol=1e-5, atol=1e-7 * np.abs(slope).max(), err_msg=name)
            checked += abs(slope[k]) > 1e-3
    assert checked > 20


def test_response_of_a_reaction_is_that_of_the_motion_under_a_harmonic_drive():
    """From a state of the linear steady motion on, a small drive gives forces of the linear amplitude and phase."""
    f, s = 2.3, 1e-5
    omega = 2 * np.pi * f
    table = RigidBody("table", 2.0, np.eye(3))
    block = RigidBody("block", 0.7, 0.02 * np.eye(3), position=(1, -0.2, 0))
    pin = RevoluteJoint(
        "pin", Marker("table", position=(1, 0, 0)), Marker("block", position=(0, 0.2, 0)), axis=(0, 0, 1)
    )
    spring = SpringDamper("tie", Marker(GROUND, position=(0, -1, 0)), Marker("block"), 90.0, 1.5)

    def driven(motion):
        rail = PrismaticJoint("rail", Marker(GROUND), Marker("table"), axis=(1, 0, 0), motions={"distance": motion})
        return System([table, block], [rail, pin], [Gravity((0, -9.81, 0)), spring])

    outputs = [ReactionSensor("pin", "pin", "marker"), JointCoordinate("rail", "distance", "rail"),
               JointCoordinate("pin", "angle", "swing")]  # fmt: skip
    linear = linearize(driven(constant(0.0)), inputs=[DriveMotion("x", "rail", "distance", rate=0)], outputs=outputs)
    about, model = linear.equilibrium, compiled_system(driven(constant(0.0))).model
    z = np.linalg.solve(
        linear.K + 1j * omega * linear.C - omega**2 * linear.M,
        linear.B + 1j * omega * linear.B_rate - omega**2 * linear.B_acceleration,
    )
    x = s * (linear.N @ z + linear.Y)[:, 0]  # times exp(i omega t); the drive is its imaginary part
    at = displaced(model, about.state, in_ground_axes(model, about.state, x.imag))
    start = State(at.r, at.p, at.q, in_ground_axes(model, about.state, (1j * omega * x).imag))
    run = integrate(driven(harmonic(s, omega)), GeneralizedAlpha(rho_inf=0.7), 1 / f, 1 / (400 * f), state=start)
    found = measured(driven(harmonic(s, omega)), run, outputs)
    H = linear.response([f])[0, :, 0]
    for k, name in enumerate(linear.outputs):
        sensor, column = name.split(".", 1)
        expected = linear.output_values[k] + s * (H[k] * np.exp(1j * omega * run.t)).imag
        size = max(s * abs(H[k]), 1e-12)
        reached = found[sensor].columns[column]
        late = slice(20, None)  # the scheme damps what its first steps shake in the reactions
        assert_allclose(reached[late], expected[late], rtol=0, atol=2e-3 * size, err_msg=name)


def test_a_mass_on_a_shaken_spring_is_that_of_the_textbook():
    m, k, c = 2.0, 50.0, 3.0
    mass = RigidBody("mass", m, np.eye(3))
    rail = PrismaticJoint("rail", Marker(GROUND), Marker("mass"), axis=(1, 0, 0))
    spring = SpringDamper("spring", Marker(GROUND, position=(-1, 0, 0)), Marker("mass"), k, c)
    outputs = [
        Channel("a", Marker("mass"), (1, 0, 0), rate=2),
        JointCoordinate("rail", "distance", "gap"),
        Column(ReactionSensor("spring", "spring"), "force x"),
    ]
    s = 2j * np.pi * F
    exact = np.array([(k + c * s) / (m * s**2 + c * s + k), -m / (m * s**2 + c * s + k),
                      -m * (k + c * s) / (m * s**2 + c * s + k)])  # fmt: skip
    for rate in (0, 1, 2):
        base = BaseMotion("shake", (1, 0, 0), rate=rate)
        linear = linearize(System([mass], [rail], [spring]), inputs=[base], outputs=outputs)
        rows = [linear.outputs.index(name) for name in ("a", "gap.value", "spring.force x")]
        assert_allclose(linear.response(F)[:, rows, 0].T, exact * s ** (2 - rate), rtol=1e-9, atol=1e-12)
    assert linear.input_units == ("m/s²",)
    # the acceleration of the mass needs no place of the base, its place would
    assert len(named_state_space(linear).states) == 2
    placed = linearize(System([mass], [rail], [spring]), inputs=[base], outputs=[PlaceSensor("place", Marker("mass"))])
    space = named_state_space(placed)
    assert space.states[2:] == ("shake displacement", "shake velocity")
    assert space.state_units[2:] == ("m", "m/s")
    f = 1.3
    H = space.C @ np.linalg.solve(2j * np.pi * f * np.eye(4) - space.A, space.B) + space.D
    assert_allclose(H[0, 0], exact[0, F == f][0] / (2j * np.pi * f) ** 2, rtol=1e-9)
    assert np.isinf(placed.response([0.0])[0, 0, 0])


@pytest.mark.parametrize(("channel", "words"), [
    (BaseMotion("b", joints=("rot",)), "'rot' does not exist; did you mean 'root'"),
    (BaseMotion("b", joints=("axle",)), "'axle' is not attached to the ground"),
    (DriveMotion("d", "root", "angle"), "no driven coordinate 'root.angle'"),
])  # fmt: skip
def test_impossible_inputs_are_refused(channel, words):
    with pytest.raises(ModelError, match=words):
        linearize(machine(), inputs=[channel])


def test_what_cannot_be_is_refused_where_it_is_made():
    with pytest.raises(ModelError, match="expected 0, 1 or 2"):
        BaseMotion("b", rate=3)
    with pytest.raises(ModelError, match="at rest"):
        linearize(rotor(), steady_rotation(rotor(), (0, 0, 2.0)), inputs=[BaseMotion("b")])
    mass = RigidBody("mass", 2.0, np.eye(3))
    rail = PrismaticJoint("rail", Marker(GROUND), Marker("mass"), axis=(1, 0, 0))
    linear = linearize(System([mass], [rail]), inputs=[BaseMotion("b", (0, 1, 0), rate=0)],
                       outputs=[ReactionSensor("rail", "rail")])  # fmt: skip
    assert_allclose(linear.response([1.0])[0, linear.outputs.index("rail.force y"), 0], 2.0 * (2 * np.pi) ** 2)
    shaken = linearize(System([mass], [rail]), inputs=[BaseMotion("b", (1, 0, 0), rate=2)],
                       outputs=[ReactionSensor("rail", "rail"), PlaceSensor("place", Marker("mass"))])  # fmt: skip
    assert_allclose(shaken.response([1.0])[0, shaken.outputs.index("place.x"), 0], 0.0, atol=1e-12)
