"""What the modes of a flexible body leave out of a motion: the estimate against closed forms and the whole model."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm
import floatframe.simulation.integrate as integration
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.finishing import finish
from cms.reduction.basis.frames import frame_condition
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import Interface
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    System,
    integrate,
    read_results,
)
from floatframe.design.laboratory.full_model import all_dofs
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import harmonic
from floatframe.model.rotations import rotation_matrix
from floatframe.results.sensors.left_out import LeftOutSensor, at_rest, oscillation
from floatframe.results.validity import notes_from_json, notes_to_json
from floatframe.simulation import resume
from tests.bodies import beam, box_mesh, distorted, with_interfaces
from tests.floatframe.command import run_floatframe


class StopHereError(Exception):
    """Interrupts a run."""


T_END, H = 3e-3, 1e-5
DAMPING = cms.reduction.ModalDamping(0.01)
TURNED = np.array([0.5, 0.5, -0.5, 0.5])  #: Euler parameters of the bar in the ground
SETS = {"craig-bampton": {"n_modes": 3}, "normal": {"n_modes": 3}, "guyan": {}}


# oscillators ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.9])
def test_a_force_that_jumps_swings_an_oscillator_as_in_the_closed_form(zeta):
    """z = F [1 - exp(-zeta omega t) (cos omega_d t + zeta / sqrt(1 - zeta²) sin omega_d t)]; steps across `SERIES`."""
    omega, F = np.array([3.0, 40.0]), np.array([2.0, -5.0])
    t = np.cumsum(np.r_[0.0, np.random.default_rng(1).uniform(1e-4, 0.05, 60)])
    z, _ = oscillation(omega, np.full(2, zeta), t, np.tile(F, (len(t), 1)), at_rest(omega, zeta, t[0], np.zeros(2)))
    omega_d, s = omega * np.sqrt(1 - zeta**2), np.sqrt(1 - zeta**2)
    x = np.outer(t, omega_d)
    expected = F * (1 - np.exp(-zeta * np.outer(t, omega)) * (np.cos(x) + zeta / s * np.sin(x)))
    assert_allclose(z, expected, rtol=0, atol=1e-12 * np.abs(F).max())


def test_a_force_that_grows_evenly_swings_an_oscillator_as_in_the_closed_form():
    """From rest without damping, z = v (t - sin(omega t) / omega), whatever the steps, and in two parts."""
    omega, v = np.array([3.0, 700.0]), 4.0
    t = np.r_[np.linspace(0, 1e-3, 5), np.linspace(2e-3, 0.3, 40)]
    force = np.outer(t, [v, v])
    first, last = oscillation(omega, np.zeros(2), t[:17], force[:17], at_rest(omega, 0.0, 0.0, np.zeros(2)))
    second, _ = oscillation(omega, np.zeros(2), t[17:], force[17:], last)
    expected = v * (t[:, None] - np.sin(np.outer(t, omega)) / omega)
    assert_allclose(np.concatenate([first, second]), expected, rtol=0, atol=1e-12)


def test_an_oscillator_in_equilibrium_stays_there():
    omega, force = np.array([5.0]), np.full((30, 1), 3.0)
    z, _ = oscillation(omega, np.array([0.1]), np.linspace(0, 1, 30), force, at_rest(omega, 0.1, 0.0, force[0]))
    assert_allclose(z, 3.0, rtol=1e-12)


# a bar under one force ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rod():
    """A bar of 60 beam elements; its modes contain the first longitudinal one, and not the second."""
    end = Interface("end", "nodes", np.array([60]), np.array([1.0, 0, 0]))
    part = cms.couple(with_interfaces(beam(n=60), end))
    with Families(part) as families:
        exact = families.free_modes(60)
        along = np.array([np.abs(part.M @ exact.Phi[:, k])[part.dofs[:, 1] == 0].sum() for k in range(60)])
        axial = np.flatnonzero(along > 0.5 * along.max())
        return part, reduce(families, MODE_SETS["normal"](families, n_modes=int(axial[0]) + 1))


def test_a_force_on_a_bar_leaves_out_its_higher_longitudinal_modes(rod):
    """The accelerated free bar has the energy F² L / (6 EA); its first longitudinal mode has F² L / (pi² EA).

    The bar begins in the equilibrium of its modes. The share that they leave out is 1 - 6 / pi².
    """
    _, reduced = rod
    F = np.array([1000.0, 0.0, 0.0])
    q = reduced.interface("end").Psi[:3].T @ (reduced.frame.axes.T @ F) / np.diag(reduced.K)
    system = System([FlexibleBody("bar", reduced, q=q)], forces=[PointForce("push", Marker("bar", "end"), F)])
    found = integrate(system, GeneralizedAlpha(), 2e-3, 1e-4).left_out["bar"]
    assert_allclose(found.energy, found.energy[0], rtol=1e-6)
    assert_allclose(found.energy[0], F[0] ** 2 / (2.1e11 * 1e-4) * (1 / 6 - 1 / np.pi**2), rtol=2e-3)
    assert_allclose(found.share, 1 - 6 / np.pi**2, rtol=2e-3)


# beside the whole finite element model --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def body():
    """A bar of 12 solids in general position with two rigid interfaces."""
    mesh = distorted(box_mesh(6, 2, 1, 0.3, 0.06, 0.025), 0.1, seed=2)
    turn = la.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    mesh = replace(mesh, nodes=mesh.nodes @ (turn * la.det(turn)).T + [0.04, -0.9, 0.3])
    beside = np.array([3e-3, 1e-3, -2e-3])
    ports = [
        Interface(name, "rigid", nodes := mesh.node_sets[name], mesh.nodes[nodes].mean(axis=0) + beside)
        for name in ("left", "right")
    ]
    steel = fm.Material("steel", 2.1e11, 0.3, 7850.0)
    return fm.couple(fm.solid_body(mesh, steel, name="bar", units="m-kg-s", interfaces=ports))


@pytest.fixture(scope="module")
def reductions(body):
    """The whole model and its sets as reduced bodies, each with its shapes over the dofs."""
    condition = frame_condition(body, cms.TisserandFrame())
    with Families(body) as families:
        sets = {name: MODE_SETS[name](families, **options) for name, options in SETS.items()} | {
            "whole": all_dofs(body)
        }
        return {
            name: (
                reduce(families, modes, damping=DAMPING, stress=False, geometric=False, errors=name != "whole"),
                finish(body, modes, condition).Phi,
            )
            for name, modes in sets.items()
        }


def free(reduced, scale=1.0):
    """A turned bar that spins freely, pushed at an end by a force that begins at once; lengths times `scale`."""
    bar = FlexibleBody("bar", reduced, position=scale * np.array([0.1, 0.2, 0.3]), orientation=TURNED,
                       omega_B=(20.0, -30.0, 50.0))  # fmt: skip
    push = PointForce("push", Marker("bar", "right"), (50.0, 300.0, -200.0))
    return System([bar], forces=[Gravity(scale * np.array([0, 0, -9.81])), push], units=reduced.units)


def hinged(reduced):
    """A turned bar on a hinge at one end, pushed to and fro at the other."""
    left = reduced.interface("left")
    place = rotation_matrix(TURNED) @ (reduced.frame.origin + reduced.frame.axes @ left.position)
    pin = RevoluteJoint("pin", Marker(GROUND, position=place), Marker("bar", "left"), axis=(0, 1, 0))
    push = PointForce("push", Marker("bar", "right"), (50.0, 300.0, -200.0), amplitude=harmonic(1.0, 300.0))
    bar = FlexibleBody("bar", reduced, orientation=TURNED)
    return System([bar], [pin], [Gravity((0, 0, -9.81)), push])


@pytest.fixture(scope="module")
def whole(body, reductions):
    """Displacements over the dofs of the whole model in each system, (n_dof, n_t)."""
    reduced, Phi = reductions["whole"]
    return {
        make: Phi @ integrate(make(reduced), GeneralizedAlpha(), T_END, H).body("bar").q.T for make in (free, hinged)
    }


@pytest.mark.parametrize("make", [free, hinged], ids=["free", "hinged"])
@pytest.mark.parametrize("name", SETS)
def test_the_estimate_is_near_the_energy_that_the_whole_model_has_beside_the_modes(body, reductions, whole, name, make):
    reduced, Phi = reductions[name]
    u = whole[make]
    e = u - Phi @ np.linalg.solve(Phi.T @ body.K @ Phi, Phi.T @ (body.K @ u))
    true, strain = ((x * (body.K @ x)).sum(axis=0) / 2 for x in (e, u))
    found = integrate(make(reduced), GeneralizedAlpha(), T_END, H).left_out["bar"]
    assert true.max() > 1e-4 * strain.max()
    assert 0.6 <= found.energy.max() / true.max() <= 1.6
    assert 0.6 <= found.energy.mean() / true.mean() <= 1.6
    assert 0.6 <= found.share / (true.max() / strain.max()) <= 1.6


def pinned(reduced, end):
    """A beam on a pin at its left end, or clamped there, pushed at once at the other; no damping."""
    joint = {"pin": RevoluteJoint, "clamp": FixedJoint}[end]
    axis = {"axis": (0, 0, 1)} if end == "pin" else {}
    hold = joint(end, Marker(GROUND), Marker("bar", "left"), **axis)
    push = PointForce("push", Marker("bar", "right"), (0, 30.0, 0))
    return System([FlexibleBody("bar", reduced, stiffening=False)], [hold], [push])


@pytest.mark.parametrize("end", ["pin", "clamp"])
def test_a_joint_does_not_let_the_estimate_resonate(end):
    """A free vibration of the beam, 998 Hz, is near one of its modes on the pin, and W alone has others."""
    part = cms.couple(beam(8, length=0.6, A=4e-4, Iy=1e-8, Iz=2e-8, J=3e-8))
    with Families(part) as families:
        few, all_ = MODE_SETS["craig-bampton"](families, n_modes=3), all_dofs(part)
        own, rich = (reduce(families, modes, geometric=False, errors=modes is few) for modes in (few, all_))
    condition = frame_condition(part, cms.TisserandFrame())
    Phi, Phi_rich = (finish(part, modes, condition).Phi for modes in (few, all_))
    u = Phi_rich @ integrate(pinned(rich, end), GeneralizedAlpha(), 0.03, 1e-4, watch="off").body("bar").q.T
    e = u - Phi @ np.linalg.solve(Phi.T @ part.K @ Phi, Phi.T @ (part.K @ u))
    true = (e * (part.K @ e)).sum(axis=0) / 2
    found = integrate(pinned(own, end), GeneralizedAlpha(), 0.03, 1e-4, watch="off").left_out["bar"]
    assert 0.5 <= found.energy.max() / true.max() <= 2


def test_outputs_too_far_apart_leave_the_static_estimate(body, reductions, whole):
    reduced, Phi = reductions["craig-bampton"]
    u = whole[hinged]
    e = u - Phi @ np.linalg.solve(Phi.T @ body.K @ Phi, Phi.T @ (body.K @ u))
    true = (e * (body.K @ e)).sum(axis=0) / 2
    coarse, fine = (integrate(hinged(reduced), GeneralizedAlpha(), T_END, H, output_every=n).left_out["bar"]
                    for n in (40, 1))  # fmt: skip
    assert coarse.n_static == coarse.n_shapes > fine.n_static
    assert 0.3 <= coarse.energy.max() / true.max() <= 3


def test_a_body_that_begins_undeformed_has_left_out_nothing_at_first(reductions):
    reduced = reductions["craig-bampton"][0]
    coarse = integrate(free(reduced), GeneralizedAlpha(), T_END, H, output_every=20).left_out["bar"]
    assert coarse.energy[0] == 0 < coarse.energy[1]
    bent = free(reduced)
    bar = replace(bent.body("bar"), q=1e-6 * np.ones(reduced.n_q))
    assert integrate(replace(bent, bodies=(bar,)), GeneralizedAlpha(), T_END, H).left_out["bar"].energy[0] > 0


def test_the_estimate_is_the_same_in_other_units(reductions):
    reduced = reductions["craig-bampton"][0]
    here = integrate(free(reduced), GeneralizedAlpha(), T_END, H).left_out["bar"]
    other = cms.body.convert_units(reduced, "mm-t-s")
    there = integrate(free(other, 1e3), GeneralizedAlpha(), T_END, H).left_out["bar"]
    assert_allclose(there.energy, 1e3 * here.energy, rtol=1e-9, atol=1e-9 * 1e3 * here.energy.max())
    assert_allclose(there.share, here.share, rtol=1e-9)


# runs and files -------------------------------------------------------------------------------------------------------


def test_a_run_reports_what_the_modes_left_out(reductions, tmp_path):
    """The summary, the note and the series of a run in batches, of its file, and of one pass over its outputs."""
    system = free(reductions["guyan"][0])
    motion = integrate(system, GeneralizedAlpha(), T_END, H, output=tmp_path / "bar.h5", batch_steps=7)
    found = motion.left_out["bar"]
    told = motion.head.summary["left_out"]["bar"]
    assert_allclose([told["share"], told["t"]], [found.share, found.t_largest], rtol=1e-12)
    assert found.t_largest == found.t[found.energy.argmax()] > 0
    (note,) = (each for each in motion.validity if each.kind == "left out")
    assert_allclose(note.largest, found.share, rtol=1e-12)
    assert note.t_first == found.t[np.argmax(found.shares > note.limit)]
    assert "body 'bar'" in note.words
    assert "more modes" in note.action
    assert notes_from_json(notes_to_json(motion.validity)) == motion.validity
    again = read_results(tmp_path / "bar.h5", system=system)
    assert_array_equal(again.left_out["bar"].energy, found.energy)
    assert again.head.summary["left_out"] == motion.head.summary["left_out"]


def test_a_resumed_run_reports_what_the_whole_run_left_out(reductions, tmp_path, monkeypatch):
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    system = free(reductions["guyan"][0])

    def stop(progress):
        if progress.t > 7e-3:
            raise StopHereError

    with pytest.raises(StopHereError):
        integrate(system, GeneralizedAlpha(), 1e-2, H, output=tmp_path / "bar.h5", progress=stop)
    resumed = resume(system, tmp_path / "bar.h5")
    whole = integrate(system, GeneralizedAlpha(), 1e-2, H)
    assert whole.left_out["bar"].t_largest < 4e-3
    assert resumed.head.summary["left_out"] == whole.head.summary["left_out"]
    assert [note for note in resumed.validity if note.kind == "left out"] == [
        note for note in whole.validity if note.kind == "left out"
    ]


def test_a_share_below_the_limit_makes_no_note(reductions):
    motion = integrate(hinged(reductions["craig-bampton"][0]), GeneralizedAlpha(), T_END, H)
    assert 0 < motion.head.summary["left_out"]["bar"]["share"] < 0.1
    assert not [note for note in motion.validity if note.kind == "left out"]


def test_a_body_without_left_out_shapes_has_no_estimate(reductions):
    reduced = reductions["craig-bampton"][0]
    bare = replace(reduced, errors=replace(reduced.errors, left_out=None))
    a, b = (integrate(free(each), GeneralizedAlpha(), 20 * H, H) for each in (bare, reduced))
    assert not a.left_out
    assert "left_out" not in a.head.summary
    assert_array_equal(a.body("bar").q, b.body("bar").q)
    with pytest.raises(ModelError, match="has no left-out shapes; reduce it again"):
        LeftOutSensor("left out", "bar").measure(free(bare), a)


def test_the_sensor_of_left_out_energy_has_its_series(reductions):
    system = free(reductions["guyan"][0])
    system = replace(system, sensors=(LeftOutSensor("left out", "bar"),))
    motion = integrate(system, GeneralizedAlpha(), 50 * H, H)
    found, sensor = motion.left_out["bar"], motion.sensor("left out")
    assert_array_equal(sensor.energy, found.energy)
    assert_array_equal(sensor.strain, found.strain)
    assert sensor.share.max() == found.share


def test_the_command_prints_the_share(reductions, tmp_path):
    cms.write(reductions["guyan"][0], tmp_path / "bar.h5")
    (tmp_path / "push.toml").write_text(
        """
[system]
units = "m-kg-s"

[bodies.bar]
file = "bar.h5"
omega_B = [20, -30, 50]

[forces.push]
type = "point-force"
body = "bar"
marker = "right"
force = [50, 300, -200]

[run]
t_end = 1e-3
h = 1e-5
""",
        encoding="utf-8",
    )
    told = run_floatframe("run", tmp_path / "push.toml", code=0).stdout
    assert "left out by modes" in told
    assert re.search(
        r"body 'bar': up to about [0-9.]+ % of its strain energy, at t = [0-9.e-]+ s", " ".join(told.split())
    )
