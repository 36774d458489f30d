"""Recovery rows as sensors and outputs: against states near by, and against the forces of the joints on the body."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import cms
from fe_models.body.loads import nodal_load
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    Gravity,
    Marker,
    PointForce,
    SphericalJoint,
    System,
    linearize,
    static_equilibrium,
)
from floatframe.analyses import BaseMotion, consistent_state, snapshot
from floatframe.errors import ModelError
from floatframe.forces import BodyLoad, Bushing
from floatframe.sensors import InterfaceForceSensor, PlaceSensor, RecoverySensor, measured
from tests.cms.reduction.geometric_stiffness.examples import bar_of_beams
from tests.floatframe.analyses.examples import compare, held


def test_rows_are_linear_outputs(bar):
    system = held(bar)
    about = static_equilibrium(system, tolerance=1e-12)
    sensors = [RecoverySensor("rows", "bar", "instruments")]
    linear = linearize(system, about, outputs=sensors)
    assert len(linear.outputs) == bar.recovery["instruments"].n_rows
    compare(system, about, linear, sensors, size=1e-6, tolerance=1e-5)


@pytest.fixture(scope="module")
def placed():
    """A bar off the origin and turned, in bushings to the ground, under every load that a table knows."""
    part = bar_of_beams(6)
    part = part.with_load_cases(
        nodal_load(part, "wind", {2: np.array([9.0, -4.0, 6.0]), 4: np.array([-2.0, 5.0, 3.0])})
    )
    coupled = cms.couple(part)
    root, tip = (each.name for each in coupled.interfaces)
    rows = [cms.reduction.Rows(quantity, at=(tip,)) for quantity in ("displacement", "velocity", "acceleration")]
    rows += [cms.reduction.Rows("interface force"), cms.reduction.Rows("net force", about=(0.1, -0.2, 0.3))]
    asked = [cms.reduction.RecoveryRequest("instruments", rows=rows)]
    frame = cms.TisserandFrame(axes=Rotation.from_rotvec([0.4, 0.7, -0.5]).as_matrix())
    reduced = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=3), frame=frame, recovery=asked)
    turn, place = Rotation.from_rotvec([-0.8, 0.5, 1.1]), np.array([0.4, -0.3, 0.2])
    ends = {each.name: reduced.frame.origin + reduced.frame.axes @ each.position for each in reduced.interfaces}
    K, D = [3e5, 2e5, 4e5, 3e3, 2e3, 4e3], [200, 300, 100, 2, 3, 1]
    forces = [
        Bushing(name, Marker(GROUND, position=place + turn.apply(ends[name]), triad=turn.as_matrix()),
                Marker("bar", name), np.multiply(K, 1.0 + (name == tip)), D)
        for name in (root, tip)
    ]  # fmt: skip
    forces += [
        Gravity((4.0, -3.0, -8.0)),
        BodyLoad("blow", "bar", "wind", 1.3),
        PointForce("push", Marker("bar", tip), force=(30.0, -20.0, 50.0), torque=(1.0, 2.0, 3.0)),
    ]
    x, y, z, w = turn.as_quat()
    return System([FlexibleBody("bar", reduced, position=place, orientation=(w, x, y, z))], [], forces)


def test_rows_of_a_turned_body_are_linear_outputs(placed):
    about = static_equilibrium(placed, tolerance=1e-12)
    sensors = [RecoverySensor("rows", "bar", "instruments")]
    linear = linearize(placed, about, outputs=sensors)
    assert len(linear.outputs) == placed.bodies[0].reduced.recovery["instruments"].n_rows
    compare(placed, about, linear, sensors, size=1e-6, tolerance=1e-5)


def test_rows_of_a_turned_body_are_what_acts_on_it_and_how_it_moves(placed):
    bar = replace(placed.bodies[0], velocity=(0.03, -0.05, 0.02), omega_B=(2.0, -3.0, 4.0))
    placed = replace(placed, bodies=[bar])
    made = consistent_state(placed)
    root, tip = (each.name for each in placed.bodies[0].reduced.interfaces)
    now = snapshot(placed, made.state, made.u_dot, made.w)
    sensors = [
        RecoverySensor("rows", "bar", "instruments"),
        *(InterfaceForceSensor(name, "bar", name) for name in (root, tip)),
        PlaceSensor("place", Marker("bar", tip), "acceleration"),
    ]
    found = measured(placed, now, sensors)
    rows = found["rows"].columns
    turn = Rotation.from_quat(np.roll(placed.bodies[0].orientation, -1))
    place = turn.inv().apply([found["place"].columns[x][0] for x in "xyz"])
    table = placed.bodies[0].reduced.recovery["instruments"]
    own = {table.components[row]: rows[table.labels[row]][0] for row in table.rows("acceleration")}
    assert_allclose([own[f"u{x}"] for x in "xyz"], place, rtol=0, atol=1e-6 * np.abs(place).max())
    for name in (root, tip):
        own = found[name].columns
        for key, letter in (("force", "f"), ("moment", "m")):
            expected = turn.inv().apply([own[f"{key} {x}"][0] for x in "xyz"])
            got = [rows[f"interface force {name} {letter}{x}"][0] for x in "xyz"]
            assert np.abs(expected).max() > 1.0
            assert_allclose(got, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_recovered_interface_forces_and_accelerations_are_those_of_joints_and_places(bar):
    """What the rows say of the body's own motion against what acts on it and how its end moves, at rest and pushed."""
    tip = bar.interfaces[1].name
    system = held(bar, PointForce("push", Marker("bar", tip), force=(30.0, -20.0, 50.0), torque=(1.0, 2.0, 3.0)))
    made = consistent_state(system)
    now = snapshot(system, made.state, made.u_dot, made.w)
    sensors = [
        RecoverySensor("rows", "bar", "instruments"),
        *(InterfaceForceSensor(each.name, "bar", each.name, "body") for each in bar.interfaces),
        PlaceSensor("place", Marker("bar", tip), "acceleration"),
    ]
    found = measured(system, now, sensors)
    table, rows = bar.recovery["instruments"], found["rows"].columns
    frame, place = bar.frame.axes, [found["place"].columns[x][0] for x in "xyz"]
    assert np.abs(place).max() > 1.0
    checked = 0
    for label, quantity, component in zip(table.labels, table.quantities, table.components, strict=True):
        for interface in bar.interfaces:
            if quantity == "interface force" and interface.name in label:
                own = found[interface.name].columns
                force, moment = (frame @ [own[f"{key} {x}"][0] for x in "xyz"] for key in ("force", "moment"))
                expected = dict(zip(("fx", "fy", "fz", "mx", "my", "mz"), [*force, *moment], strict=True))
                assert_allclose(rows[label][0], expected[component], rtol=1e-6, atol=1e-6 * np.abs(force).max())
                checked += 1
        if quantity == "acceleration" and component in ("ux", "uy", "uz"):  # mesh axes are those of the ground here
            expected = place["xyz".index(component[1])]
            assert_allclose(rows[label][0], expected, rtol=0, atol=1e-6 * np.abs(place).max(), err_msg=label)
            checked += 1
    assert checked == 15


def test_interface_forces_of_a_body_that_spins_about_a_skew_axis_are_those_of_its_joint(bar):
    """Products of angular velocities about different axes count twice: each of them is a load on the body."""
    root, tip = (interface.name for interface in bar.interfaces)
    system = held(bar)
    joint = SphericalJoint("ball", GROUND, Marker("bar", root))
    turning = replace(system.bodies[0], omega_B=(20.0, 7.0, -11.0))
    made = consistent_state(replace(system, bodies=[turning], joints=[joint]))
    system = replace(system, bodies=[turning], joints=[joint])
    now = snapshot(system, made.state, made.u_dot, made.w)
    found = measured(system, now, [
        RecoverySensor("rows", "bar", "instruments"), *(InterfaceForceSensor(x, "bar", x, "body") for x in (root, tip))
    ])  # fmt: skip
    rows = found["rows"].columns
    for each in (root, tip):
        expected = [found[each].columns[f"{key} {x}"][0] for key in ("force", "moment") for x in "xyz"]
        got = [rows[f"interface force {each} {x}"][0] for x in ("fx", "fy", "fz", "mx", "my", "mz")]
        assert_allclose(got, expected, rtol=0, atol=1e-5 * np.abs(expected[:3]).max())


def test_what_is_not_there_is_refused_by_name(bar):
    for sensor, words in (
        (RecoverySensor("r", "bar", "instrument"), "did you mean 'instruments'"),
        (RecoverySensor("r", "bar", "instruments", rows=("nothing",)), "r"),
        (InterfaceForceSensor("f", "bar", "stat"), "no interface 'stat'"),
    ):
        with pytest.raises(ModelError, match=words):
            linearize(held(bar), outputs=[sensor])


@pytest.mark.parametrize("quantity", ["translation", "rotation"])
def test_interface_forces_under_moving_bases_are_those_of_the_craig_bampton_matrices(bar, quantity):
    """Both ends clamped, one of them driven: F = Z_bb - Z_be Z_ee⁻¹ Z_eb with Z = K - omega² M over (u_b, eta)."""
    joints = [FixedJoint(each.name, GROUND, Marker("bar", each.name)) for each in bar.interfaces]
    direction = np.array([0.0, 0.6, 0.8])
    end = bar.interfaces[1]
    place = bar.frame.origin + bar.frame.axes @ end.position
    base = BaseMotion("base", direction, quantity, place, joints=(end.name,), rate=0)
    outputs = [InterfaceForceSensor(each.name, "bar", each.name) for each in bar.interfaces]
    linear = linearize(System([FlexibleBody("bar", bar)], joints), inputs=[base], outputs=outputs)
    matrices, n_b = cms.reduction.craig_bampton_matrices(bar), 12
    for f in (0.0, 30.0, 400.0):
        Z = np.asarray(matrices.K) - (2 * np.pi * f) ** 2 * np.asarray(matrices.M)
        bb, be, ee = Z[:n_b, :n_b], Z[:n_b, n_b:], Z[n_b:, n_b:]
        u = np.zeros(n_b)
        u[6 if quantity == "translation" else 9 :][:3] = direction
        expected = (bb - be @ np.linalg.solve(ee, be.T)) @ u
        found = linear.response([f])[0, :, 0].real
        for k, each in enumerate(bar.interfaces):
            for first, key in ((0, "force"), (3, "moment")):
                part = [found[linear.outputs.index(f"{each.name}.{key} {x}")] for x in "xyz"]
                size = np.abs(expected).max()
                assert_allclose(part, expected[6 * k + first : 6 * k + first + 3], rtol=1e-6, atol=1e-6 * size)
