"""The monitor of the range of linear frames: what it measures, when it tells, and where its notes are kept."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from cms.body.linear_range import LINEAR, STIFFENED
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    SphericalJoint,
    System,
    integrate,
    read_results,
    static_equilibrium,
)
from floatframe.components.mechanisms import slider_crank, spin_up_beam, spinning_shaft
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.entry import absolute_kernels
from floatframe.engine.kernels.memory import memory_at
from floatframe.engine.kernels.work import new_work
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.model.state import State
from floatframe.results.validity import ValidityNote, notes_from_json, notes_to_json
from floatframe.simulation.validity_watch import ValidityWatch, estimated_interface_loads
from tests.floatframe.command import run_floatframe
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffened_body, stiffness

N_Q = 4
ALLOY = fm.Material("alloy", E=7e10, nu=0.3, rho=2700.0)


def rows_of(system, q, u, u_dot, p=None):
    """Return one row of results at a state with given accelerations."""
    model = compiled_system(system).model
    placed = compiled_system(system).placed
    p = placed.p if p is None else p
    memory = memory_at(State(placed.r, p, q, u), u_dot, np.zeros(int(model.connections.w0[-1])))
    return absolute_kernels.observe(model, new_work(model), memory=memory, t=0.5)


@pytest.mark.parametrize("stiffening", [True, False])
def test_change_of_the_stiffness_is_that_of_all_loads_at_work(stiffening):
    """Against K + Σ lambda_j K_j written out; the loads of motion, gravity and a point force, in body axes."""
    reduced = stiffened_body(random_point_masses(N_Q, 3), stiffness(N_Q, omega=6.0), size=2.0)
    g, f = np.array([0.5, 2.0, -9.81]), np.array([3.0, -2.0, 1.0])
    body = FlexibleBody("body", reduced, stiffening=stiffening)
    system = System([body], forces=[Gravity(g), PointForce("load", Marker("body", "end_b"), f)])
    rng = np.random.default_rng(5)
    p = euler_parameters_of_rotation_vector(rng.normal(size=3))[None]
    u, u_dot = rng.normal(size=6 + N_Q), rng.normal(size=6 + N_Q)
    watch = ValidityWatch(system)
    watch.observe(rows_of(system, np.zeros(N_Q), u, u_dot, p))
    from floatframe.model.rotations import rotation_matrix

    R, geometric = rotation_matrix(p[0]), reduced.geometric
    K = np.einsum("a,akl->kl", R.T @ (u_dot[:3] - g), geometric.translation)
    K += np.einsum("a,akl->kl", u_dot[3:6], geometric.rotation)
    x, y, z = u[3:6]
    K += np.einsum("a,akl->kl", [x * x, y * y, z * z, 2 * x * y, 2 * y * z, 2 * z * x], geometric.spin)
    K += np.einsum("a,akl->kl", R.T @ f, geometric.interfaces[1, :3])
    change = la.eigh(K, reduced.K, eigvals_only=True)
    expected = -change[0] if stiffening else np.abs(change).max()
    note = next(note for note in watch.notes if note.kind == "load")
    assert expected > (STIFFENED if stiffening else LINEAR).load
    assert_allclose(note.largest, expected, rtol=1e-10)
    assert note.t_first == 0.5


def column(load, n=12):
    """Return a cantilever along x that gravity presses with `load` of its buckling load (Greenhill), stiffened."""
    length, A, inertia = 1.0, 1e-4, 1e-9
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), n)
    root = fm.beams.line_interface(mesh, "root", fm.beams.NodeIndices((0,)))
    section = fm.beams.BeamProperty(
        fm.beams.GeneralSection(A=A, Iy=inertia, Iz=inertia, J=2e-9), ALLOY, orientation=(0, 1, 0)
    )
    body = cms.couple(fm.beam_body(mesh, section, name="column", units=cms.unit_system("m-kg-s"), interfaces=[root]))
    reduced = cms.reduce(
        body, cms.craig_bampton(body, n_modes=6), frame=cms.NodalFrame("root"), geometric=True,
        damping=cms.reduction.RayleighDamping(0.0, 0.0),
    )  # fmt: skip
    critical = 7.837347 * ALLOY.E * inertia / (ALLOY.rho * A * length**3)  # Greenhill: of a column under its weight
    return System(
        [FlexibleBody("column", reduced)],
        [FixedJoint("foot", GROUND, Marker("column", "root"))],
        [Gravity((-load * critical, 0, 0))],
    )


def test_load_of_a_column_is_told_by_its_first_buckling_load():
    motion = integrate(column(0.8), GeneralizedAlpha(0.5), 1e-2, 1e-4)
    assert [note.kind for note in motion.validity] == ["load"]
    watch = ValidityWatch(column(0.8))
    assert watch.observe(rows_at_rest(column(0.8)))[0].kind == "load"
    assert_allclose(watch.notes[0].largest, 0.8, rtol=2e-3)
    assert integrate(column(0.3), GeneralizedAlpha(0.5), 1e-2, 1e-4).validity == ()


def rows_at_rest(system):
    """Return a row at rest under gravity."""
    model = compiled_system(system).model
    return rows_of(
        system,
        np.zeros(int(model.bodies.q0[-1])),
        np.zeros(int(model.bodies.u0[-1])),
        np.zeros(int(model.bodies.u0[-1])),
    )


def soft_beam(frame=None):
    mesh = fm.beams.straight_line((0, 0, 0), (2.0, 0, 0), 10)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", 10))]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.02, 0.02), ALLOY, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="beam", units=cms.unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(
        body, cms.craig_bampton(body, n_modes=4), frame=frame or cms.NodalFrame("root"), geometric=True
    )  # fmt: skip


def test_a_fast_spin_up_is_told_once_per_body_and_kind_with_what_to_do(tmp_path, caplog):
    beam = soft_beam()
    told = {}
    for name, reduced, stiffening in (
        ("without matrices", replace(beam, geometric=None), "auto"),
        ("off", beam, False),
        ("on", beam, "auto"),
    ):
        caplog.clear()
        system = spin_up_beam(reduced, speed=30.0, duration=0.5, stiffening=stiffening)
        path = tmp_path / f"{name.replace(' ', '_')}.h5"
        motion = integrate(system, GeneralizedAlpha(0.8), 0.5, 1e-3, output=path)
        told[name] = {note.kind: note for note in motion.validity}
        warned = [record.getMessage() for record in caplog.records if "left the range" in record.getMessage()]
        assert len(warned) == len(motion.validity) == len(told[name])
        assert read_results(path).validity == motion.validity
    assert set(told["without matrices"]) >= {"speed", "rotation"}
    assert set(told["off"]) == {"speed", "rotation", "load"}
    assert set(told["on"]) <= {"rotation"}
    assert "reduce it with geometric stiffness" in told["without matrices"]["speed"].action
    assert told["off"]["load"].action == "switch its stiffening on"
    assert "% (limit 10 %)" in told["off"]["load"].words
    note = told["off"]["speed"]
    assert_allclose(note.limit, LINEAR.speed)
    if "rotation" in told["off"]:
        assert told["off"]["rotation"].action.startswith("take mean axes (cms frame --to tisserand")
    assert note.t_first < note.t_largest
    lowest = 2 * np.pi * beam.frequencies.min()  # in the frame of the root, where it is fixed to the hub
    assert_allclose(note.largest, 30.0 / lowest, rtol=1e-3)


def test_notes_stand_in_the_summary_and_in_the_record(tmp_path):
    path = tmp_path / "spin.h5"
    integrate(spin_up_beam(soft_beam(), speed=30.0, duration=0.5, stiffening=False), GeneralizedAlpha(0.8), 0.5, 1e-3,
              output=path)  # fmt: skip
    shown = run_floatframe("info", path)
    assert "left the range of their linear frame" in shown.output
    record = run_floatframe("info", path, "--json")
    assert '"kind": "load"' in record.output
    assert '"is_stiffened": false' in record.output


def test_progress_carries_the_notes():
    seen = []
    system = spin_up_beam(soft_beam(), speed=30.0, duration=0.5, stiffening=False)
    integrate(system, GeneralizedAlpha(0.8), 0.5, 1e-3, progress=lambda p: seen.append(p.notes))
    assert seen[0] == () or len(seen[0]) <= len(seen[-1])
    assert {note.kind for note in seen[-1]} == {"speed", "rotation", "load"}


def test_a_calm_motion_has_no_notes():
    system = System([FlexibleBody("body", reduced_body(random_point_masses(3, 2), stiffness(3, omega=100.0)),
                                  omega_B=(0.0, 0.0, 1.0))])  # fmt: skip
    assert integrate(system, GeneralizedAlpha(0.8), 0.05, 1e-2).validity == ()


def test_a_rotor_above_its_critical_speed_is_out_of_a_linear_frame_and_in_a_stiffened_one():
    mesh = fm.beams.straight_line((0, 0, 0), (1.0, 0, 0), 10)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("left", 0), ("right", 10))]
    section = fm.beams.BeamProperty(fm.beams.Circle(0.01), ALLOY, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="shaft", units=cms.unit_system("m-kg-s"), interfaces=ends))
    shaft = cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=cms.TisserandFrame(), geometric=True)
    for stiffening, kinds in ((True, set()), (False, {"speed"})):
        system = spinning_shaft(shaft, speed=400.0, stiffening=stiffening)
        motion = integrate(system, GeneralizedAlpha(0.8), 0.01, 1e-3)
        assert {note.kind for note in motion.validity} == kinds


def test_notes_are_read_as_they_were_written():
    notes = (ValidityNote("blade", "speed", 0.2, 1.5, 0.1, 0.2, is_stiffened=False, has_matrices=True),)
    assert notes_from_json(notes_to_json(notes)) == notes


def shaft(length, diameter, frame, n=12, *, geometric=None):
    """Return a steel rod of two ends, 'start' and 'end'."""
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), n)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("start", 0), ("end", n))]
    steel = fm.Material("steel", E=2e11, nu=0.3, rho=7870.0)
    section = fm.beams.BeamProperty(fm.beams.Circle(diameter / 2), steel, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="rod", units=cms.unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=8), frame=frame, geometric=geometric)


FRAMES = (cms.TisserandFrame(), cms.NodalFrame("start"), cms.reduction.BuckensFrame())


@pytest.mark.parametrize("frame", FRAMES, ids=["mean", "root", "Buckens"])
def test_speed_is_told_by_the_frequency_of_the_body_as_a_joint_holds_it(frame):
    """3.516, 15.418 and 22.373 √(EI/ρAL⁴): clamped at an end, on a hinge, free; in every frame, stiffened or not."""
    length, diameter = 1.0, 0.01
    unit = np.sqrt(2e11 / 7870.0) * diameter / 4 / length**2
    for geometric in (None, False):
        rod = shaft(length, diameter, frame, geometric=geometric)
        body, end = FlexibleBody("rod", rod), Marker("rod", "start")
        for joints, expected in (
            ([FixedJoint("clamp", GROUND, end)], 3.5160),
            ([RevoluteJoint("hinge", GROUND, end)], 3.5160),  # out of its plane it is clamped
            ([SphericalJoint("ball", GROUND, end)], 15.418),
            ([], 22.373),
        ):
            watch = ValidityWatch(System([body], joints))
            assert_allclose(watch.bodies[0].frequency / unit, expected, rtol=2e-3)


def test_a_body_without_matrices_is_told_by_its_speed_and_an_estimate_of_its_loads():
    """A rod of a slider-crank and a spun-up beam, a quarter off without stiffening, in a mean-axis frame."""
    rod = shaft(0.3, 0.006, cms.TisserandFrame(), geometric=False)
    drive = polynomial_of_time([0.0, 150.0])
    mass = 7870.0 * np.pi * 0.003**2 * 0.3
    system = slider_crank(crank=0.15, rod=0.3, slider_mass=mass / 2, drive=drive, flexible_rod=rod, speed=150.0)
    motion = integrate(system, GeneralizedAlpha(0.8), 1e-3, 2e-5)
    kinds = {note.kind: note for note in motion.validity}
    assert {"load", "speed"} <= set(kinds)
    assert not kinds["load"].has_matrices
    assert "estimated from the rotation of its interfaces" in kinds["load"].words
    beam = replace(soft_beam(cms.TisserandFrame()), geometric=None)
    spun = integrate(spin_up_beam(beam, speed=6.0, duration=0.2), GeneralizedAlpha(0.8), 0.2, 1e-3)
    assert "speed" in {note.kind for note in spun.validity}


def test_the_estimate_of_a_load_is_near_that_of_the_matrices():
    """The Euler load of a pinned rod; the estimate, which takes a half sine for granted, is below it."""
    n, length, diameter = 12, 1.0, 0.01
    rod = shaft(length, diameter, cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (n, 1), (n, 2))), n)
    euler = np.pi**2 * 2e11 * np.pi * diameter**4 / 64 / length**2
    for K, rtol in ((np.asarray(rod.geometric.interfaces), 1e-3), (estimated_interface_loads(rod), 0.2)):
        change = la.eigh(K[0, 0] - K[1, 0], rod.K, eigvals_only=True)  # a unit push from both ends
        assert_allclose(-1 / change[0], euler, rtol=rtol)


def test_an_equilibrium_tells_a_load_near_buckling_and_the_far_bend_above_it(caplog):
    """Of the Euler load of a cantilever; above it the column stands bent, beyond the second order."""
    beam = soft_beam()
    EI, length = ALLOY.E * 0.02**4 / 12, 2.0
    euler = np.pi**2 * EI / (4 * length**2)

    def under(load):
        system = System(
            [FlexibleBody("column", beam)],
            [FixedJoint("foot", GROUND, Marker("column", "root"))],
            [PointForce("push", Marker("column", "tip"), (-load * euler, 0, 1e-3 * euler))],
        )
        return {note.kind: note for note in static_equilibrium(system).validity}

    assert under(0.5) == {}
    assert_allclose(under(0.9)["load"].largest, 0.9, rtol=1e-3)
    assert "its loads reach 0.9 of its buckling loads" in caplog.text
    above = under(1.9)
    assert set(above) == {"load", "rotation"}
    assert above["rotation"].largest > 1.0


def test_the_advice_on_rotations_is_what_the_remedy_gives():
    """The rotation against mean axes, as a run of the body in mean axes shows it; there nothing better is offered."""
    told = {}
    for name, frame in (("nodal", None), ("mean", cms.TisserandFrame())):
        joint = FixedJoint("clamp", GROUND, Marker("beam", "root"))
        push = PointForce("push", Marker("beam", "tip"), force=(0.0, 0.0, 150.0))
        system = System([FlexibleBody("beam", soft_beam(frame), stiffening=False)], [joint], [push])
        notes = static_equilibrium(system).validity
        told[name] = {note.kind: note for note in notes}["rotation"]
    nodal, mean = told["nodal"], told["mean"]
    assert nodal.in_mean_axes < 0.8 * nodal.largest
    assert_allclose(nodal.in_mean_axes, mean.largest, rtol=0.03)  # linear frames differ by the square of rotations
    assert f"relative to them it rotates by {nodal.in_mean_axes:.3g} rad" in nodal.words
    assert mean.in_mean_axes == -1.0
    assert "mean axes" not in mean.words
