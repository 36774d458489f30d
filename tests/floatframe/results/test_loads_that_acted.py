"""Sensors of loads see those that acted: switched by events, led by another program, turned with their markers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Marker,
    PointForce,
    System,
    integrate,
    linearize,
    read_results,
    static_equilibrium,
)
from floatframe.analyses import snapshot
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError, ResultsError
from floatframe.files.cosimulation.unit import Unit
from floatframe.forces import BodyLoad
from floatframe.model.rotations import rotation_matrix
from floatframe.results.results_file import MemorySource
from floatframe.results.trajectory import Trajectory
from floatframe.results.writer import arrays_of
from floatframe.sensors import Channel, ElongationSensor, InterfaceForceSensor, RecoverySensor, measured
from floatframe.simulation import Event
from tests.floatframe.analyses.examples import compare

L, WIDTH, E_STEEL = 1.0, 0.03, 210e9  #: m, Pa
TURN = np.array([0.6, 0.3, -0.5, np.sqrt(0.3)])  #: of the mesh in the ground
R = rotation_matrix(TURN)
PLACE = np.array([30.0, -20.0, 5.0])
PUSH, CASE = 100.0, 1000.0  #: N at the tip, N in the middle by the load case, both across the beam, mesh axes
METHOD = GeneralizedAlpha(rho_inf=0.6)


def cantilever(width=WIDTH, frame=None, n_modes=2, axes=None, **options):
    """A steel beam of 8 elements, interfaces "foot" and "tip", a load case in its middle and rows of its foot."""
    mesh = fm.beams.straight_line((0, 0, 0), (L, 0, 0), 8)
    steel = fm.Material("steel", E=E_STEEL, nu=0.3, rho=7850.0)
    ends = [
        fm.beams.line_interface(mesh, n, fm.selections.NodeSet(at)) for n, at in (("foot", "start"), ("tip", "end"))
    ]
    section = fm.beams.BeamProperty(fm.beams.Rectangle(width, width), steel)
    body = fm.beam_body(mesh, section, name="b", units=cms.unit_system("m-kg-s"), interfaces=ends)
    force = np.zeros(len(body.dofs))
    force[(body.dofs[:, 0] == 4) & (body.dofs[:, 1] == 2)] = CASE
    body = cms.couple(replace(body, load_cases=(fm.loads.LoadCase("middle", "force", force),)))
    rows = (cms.reduction.Rows("beam force", components=("end A My",)), cms.reduction.Rows("interface force"))
    return cms.reduce(
        body, cms.craig_bampton(body, n_modes), frame=cms.NodalFrame("foot") if frame is None else frame,
        damping=cms.reduction.ModalDamping(0.5, heavy=True), recovery=cms.reduction.RecoveryRequest("t", rows),
        **options,
    )  # fmt: skip


@pytest.fixture(scope="module")
def beam():
    return cantilever()


def clamped(reduced, forces, **parts):
    foot = Marker(GROUND, position=PLACE, triad=R)
    body = FlexibleBody("b", reduced, PLACE, TURN, stiffening=False)
    return System([body], [FixedJoint("clamp", foot, Marker("b", "foot"))], forces, units=reduced.units, **parts)


def across(size=1.0):
    """Return a force across the beam, ground axes."""
    return size * R @ (0.0, 0.0, 1.0)


SENSORS = [
    InterfaceForceSensor("tip", "b", "tip", "body"),
    InterfaceForceSensor("foot", "b", "foot", "body"),
    RecoverySensor("rows", "b", "t"),
]


def loads(system, motion, k):
    """Return the forces across the beam at tip and foot, the moment at the foot by recovery, and its interface rows."""
    found = measured(system, motion, SENSORS)
    rows = found["rows"].columns
    labels = ["element 0 beam force end A My", "interface force tip fz", "interface force foot fz"]
    return np.array([*(found[at].columns["force z"][k] for at in ("tip", "foot")), *(rows[name][k] for name in labels)])


def expected(tip, case):
    """Return the same by statics for parts of both loads; the rows count the load case among the forces of a body."""
    return np.array([tip * PUSH, -tip * PUSH - case * CASE, 0.0, tip * PUSH, -tip * PUSH - case * CASE]), (
        tip * PUSH * L + case * CASE * L / 2
    )


def require_statics(found, tip, case):
    force, moment = expected(tip, case)
    assert_allclose(np.delete(found, 2), np.delete(force, 2), rtol=0, atol=2e-6 * CASE)
    assert_allclose(abs(found[2]), moment, rtol=0, atol=2e-6 * CASE * L)


def test_what_events_switch_off_and_on_acts_no_more_and_again(beam, tmp_path):
    """Statics of a cantilever long after each switch; the rows of the load case told half of its force for good."""
    events = [Event("off", at=0.3, switch_off=("push", "middle")), Event("on", at=0.6, switch_on=("middle",))]
    forces = [PointForce("push", Marker("b", "tip"), force=across(PUSH)), BodyLoad("middle", "b", "middle", 1.0)]
    system = clamped(beam, forces, events=events)
    motion = integrate(system, METHOD, t_end=0.9, h=1e-3, output=tmp_path / "run.h5")
    for each in (motion, read_results(tmp_path / "run.h5")):
        for t, tip, case in ((0.299, 1, 1), (0.599, 0, 0), (0.9, 0, 1)):
            require_statics(loads(system, each, int(np.argmin(np.abs(each.t - t)))), tip, case)
    old = replace(motion, head=replace(motion.head, loads=None, load_cases=None))  # a file without the record
    for t, tip, case in ((0.299, 1, 1), (0.599, 0, 0), (0.9, 0, 1)):
        require_statics(loads(system, old, int(np.argmin(np.abs(old.t - t)))), tip, case)
    other = clamped(beam, [replace(forces[0], name="pull"), forces[1]])
    with pytest.raises(ResultsError, match="expected the forces pull, got push"):
        measured(other, motion, SENSORS[:1])


def test_amplitudes_that_another_program_sets_act(beam):
    """A unit led to other amplitudes, and its motion read with the system of the file: an input is a force too."""
    forces = [PointForce("push", Marker("b", "tip"), force=across(PUSH)), BodyLoad("middle", "b", "middle", 1.0)]
    pull = Channel("pull", Marker("b", "tip"), across())
    system = clamped(beam, forces, inputs=(pull,), sensors=SENSORS)
    unit = Unit(system, METHOD, 1e-3)
    for name, value in (("forces.push.amplitude", 2.5), ("forces.middle.amplitude", -0.5), ("pull", 0.25 * PUSH)):
        unit.set(name, value)
    unit.begin()
    kept = []
    for k in range(4):
        unit.step(0.1 * k, 0.1)
        kept += unit.steps
    values = unit.values()
    assert_allclose(values["tip.force z"], 2.75 * PUSH, rtol=1e-9)
    assert_allclose(values["foot.force z"], -2.75 * PUSH + 0.5 * CASE, rtol=0, atol=2e-6 * CASE)
    rows = rows_of_file(compiled_system(unit.system), kept[-1])
    motion = Trajectory(unit.head, MemorySource(arrays_of([rows])), is_complete=False)
    require_statics(loads(system, motion, 0), 2.75, -0.5)


def test_a_follower_turns_with_its_marker(beam):
    """A beam under a follower, which its tip turns by 0.14 rad, is in balance; slopes against states near by."""
    follower = PointForce("push", Marker("b", "tip"), force=(0, 0, 40 * PUSH), is_follower=True)
    system = clamped(beam, [follower])
    about = static_equilibrium(system, tolerance=1e-12)
    found = measured(system, snapshot(system, about), SENSORS[:2])
    straight = angle = 40 * PUSH * L**2 / (2 * E_STEEL * WIDTH**4 / 12)
    for _ in range(20):  # the part of the force across the beam bends it
        angle = straight * np.cos(angle)
    tip, foot = (np.array([found[at].columns[f"force {x}"][0] for x in "xyz"]) for at in ("tip", "foot"))
    assert_allclose(tip, 40 * PUSH * np.array([-np.sin(angle), 0, np.cos(angle)]), rtol=0, atol=1e-6 * 40 * PUSH)
    assert_allclose(tip, -foot, rtol=0, atol=1e-8 * 40 * PUSH)
    sensors = [replace(each, name=f"{each.name} {x}", axes=x) for each in SENSORS[:2] for x in ("ground", "body")]
    compare(system, about, linearize(system, about, outputs=sensors), sensors, size=1e-6, tolerance=1e-5)


@pytest.mark.parametrize(("frame", "turn"), [(cms.NodalFrame("foot"), 0.0), (cms.TisserandFrame(), 0.06)])
@pytest.mark.parametrize("more", [{}, {"quadratic": True}])
def test_bending_elongates_no_neutral_axis(frame, turn, more):
    """Slopes of 0.09 rad, and a pull along the beam: the strain is that of the pull alone, F/(E A), everywhere.

    Mean axes turn against the foot, and the bending force with them into the beam: by that part of it.
    """
    width, bend, pull = 0.01, 30.0, 300.0
    reduced = cantilever(width, frame, 4, **more)
    gauges = [ElongationSensor(f"at {x:g}", "b", (x, 0, 0), (x + 0.125, 0, 0)) for x in (0.0, 0.5, 0.875)]
    force = PointForce("f", Marker("b", "tip"), force=R @ (pull, 0.0, bend))
    system = clamped(reduced, [force], sensors=gauges)
    motion = snapshot(system, static_equilibrium(system, tolerance=1e-12))
    for name, found in measured(system, motion).items():
        strain, rtol = found.columns["strain"][-1], 1e-6 + turn * bend / pull + turn**2
        assert_allclose(strain, pull / (E_STEEL * width**2), rtol=rtol, err_msg=name)
    slope = bend * L**2 / (2 * E_STEEL * width**4 / 12)
    assert slope > 0.08
    with pytest.raises(ModelError, match="have the same nearest node"):
        measured(system, motion, [ElongationSensor("e", "b", (0, 0, 0), (1e-6, 0, 0))])
