"""What a user gives and gets speaks of the frame of the file: start, results, states, shapes, sensors, restart.

The second road is the engine in that very frame: the same body, said to be in mean axes, so that it stays where it is.
That works where its root is clamped.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm
import floatframe.simulation.integrate as integration
from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    System,
    integrate,
    linearize,
    read_results,
    static_equilibrium,
    system_modes,
)
from floatframe.analyses import consistent_state, snapshot
from floatframe.results.recovery import interface_positions
from floatframe.results.trajectory import BodyMotion
from floatframe.sensors import PlaceSensor, measured
from floatframe.simulation import resume
from tests.floatframe.orders import slope

LENGTH, N = 2.0, 8
T_END, H = 0.4, 1e-3


@cache
def reduced(frame):
    """Return a slender beam with damping ratios of the modes of its frame: "root" or "mean"."""
    mesh = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), N)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", N))]
    alloy = fm.Material("alloy", E=7e10, nu=0.3, rho=2700.0)
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.03, 0.02), alloy, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="beam", units=cms.unit_system("m-kg-s"), interfaces=ends))
    at = cms.NodalFrame("root") if frame == "root" else cms.TisserandFrame()
    damping = cms.reduction.ModalDamping(0.03)
    return cms.reduce(body, cms.craig_bampton(body, n_modes=2), frame=at, geometric=True, damping=damping)


@pytest.fixture
def beam():
    return reduced("root")


def as_it_is(beam):
    return replace(beam, frame=replace(beam.frame, kind="tisserand"))


def cantilever(reduced, force=0.0, **start):
    """Return the beam clamped at its root, with a force across, along and about it on its tip."""
    body = FlexibleBody("beam", reduced, position=(0.3, -0.2, 0.5), orientation=(0.8, 0.0, 0.6, 0.0), **start)
    load = PointForce("load", Marker("beam", "tip"), (0.2 * force, force, 0.5 * force), torque=(0.1 * force, 0, 0))
    held = FixedJoint("clamp", GROUND, Marker("beam", "root"))
    return System([body], [held], [load] if force else [])


def moved(system, **options):
    return integrate(system, GeneralizedAlpha(0.8, 1e-10), T_END, H, output_every=4, **options)


FIELDS = ("r", "p", "q", "v", "omega_B", "q_dot", "v_dot", "omega_B_dot", "q_ddot")


def test_results_of_a_clamped_beam_are_those_of_the_engine_in_the_frame_of_the_file(beam):
    """They part with the third power of the load, damping by the ratios of the file included; the root stays."""
    forces, gaps = np.array([30.0, 15.0, 7.5]), []
    for force in forces:
        found, expected = (moved(cantilever(each, force)).body("beam") for each in (beam, as_it_is(beam)))
        size = np.abs(expected.q).max()
        gaps.append(np.abs(found.q - expected.q).max())
        for name in ("r", "p"):
            one, two = getattr(found, name), getattr(expected, name)
            assert_allclose(one, two, rtol=0, atol=1e-9, err_msg=name)
    assert gaps[0] < 0.01 * size * forces[0] / forces[-1]
    assert slope(forces, gaps) > 2.5


def test_initial_coordinates_are_those_of_the_file(beam):
    """The beam begins bent and moving by modes of its file: results begin with these, and its tip where they say."""
    rng = np.random.default_rng(3)
    stiff = np.sqrt(np.diag(beam.K).min() / np.diag(beam.K))
    q, q_dot = 0.02 * stiff * rng.normal(size=beam.n_q), 0.5 * stiff * rng.normal(size=beam.n_q)
    system = cantilever(beam, q=q, q_dot=q_dot)
    motion = moved(system)
    start = motion.body("beam")
    state = consistent_state(system).state
    for found in (start.q[0], state.q):
        assert_allclose(found, q, rtol=0, atol=1e-9 * np.abs(q).max())
    for found in (start.q_dot[0], state.u[6:]):
        assert_allclose(found, q_dot, rtol=0, atol=1e-6 * np.abs(q_dot).max())
    assert_allclose(start.r[0], system.body("beam").frame_position, rtol=0, atol=1e-10)
    tip = interface_positions(motion, "beam", beam, "tip")[0]
    sensed = measured(system, motion, [PlaceSensor("tip", Marker("beam", "tip"))])["tip"]
    bend = np.linalg.norm(tip - undeformed_tip(beam))
    assert 0.01 < bend < 0.1
    assert_allclose([sensed.columns[axis][0] for axis in "xyz"], tip, rtol=0, atol=bend * (bend / LENGTH) ** 2)


def undeformed_tip(beam):
    system = cantilever(beam)
    return interface_positions(snapshot(system, consistent_state(system).state), "beam", beam, "tip")[0]


def test_a_state_of_the_results_begins_the_rest_of_the_motion(beam):
    system = cantilever(beam, 20.0)
    whole = moved(system)
    middle = len(whole.t) // 2
    rest = integrate(system, GeneralizedAlpha(0.8, 1e-10), T_END, H, t_start=whole.t[middle], state=whole.state(middle))
    assert_allclose(rest.body("beam").q[0], whole.body("beam").q[middle], rtol=0, atol=1e-9)
    assert_allclose(rest.body("beam").q_dot[0], whole.body("beam").q_dot[middle], rtol=0, atol=1e-6)
    last, size = whole.body("beam").q[-1], np.abs(whole.body("beam").q).max()
    assert_allclose(rest.body("beam").q[-1], last, rtol=0, atol=2e-3 * size)  # begun anew: second order of the step


def test_an_interrupted_run_goes_on_bit_for_bit(tmp_path, beam, monkeypatch):
    monkeypatch.setattr(integration, "RESTART_STEPS", 100)
    monkeypatch.setattr(integration, "SEGMENT_SECONDS", 0.0)
    system = cantilever(beam, 20.0)
    whole = moved(system, output=tmp_path / "whole.h5")

    class EnoughError(Exception):
        pass

    def stop(progress):
        if progress.n_steps >= 250:
            raise EnoughError

    with pytest.raises(EnoughError):
        moved(system, output=tmp_path / "parts.h5", progress=stop)
    again = resume(cantilever(beam, 20.0), tmp_path / "parts.h5")
    for name in FIELDS:
        assert_array_equal(getattr(again.body("beam"), name), getattr(whole.body("beam"), name), err_msg=name)
    assert isinstance(read_results(tmp_path / "parts.h5").body("beam"), BodyMotion)


def test_equilibrium_and_vibrations_speak_of_the_frame_of_the_file(beam):
    """State and shapes are those of the engine in that frame, but for second order in the deflection (2e-4)."""
    states, found = [], []
    for each in (beam, as_it_is(beam)):
        at_rest = static_equilibrium(cantilever(each, 1.0))
        found.append(system_modes(linearize(cantilever(each, 1.0), at_rest)))
        states.append(at_rest.state)
    one, two = states
    assert_allclose(one.q, two.q, rtol=0, atol=1e-4 * np.abs(two.q).max())
    assert_allclose(one.r, two.r, rtol=0, atol=1e-10)
    modes, expected = found
    assert_allclose(modes.frequencies[:4], expected.frequencies[:4], rtol=1e-4)
    for k in range(4):
        assert_allclose(cosine(modes.shapes[:, k], expected.shapes[:, k]), 1.0, rtol=1e-6)
        assert np.abs(modes.shapes[:6, k]).max() < 1e-9  # the frame is clamped
    assert_allclose(modes.energy_shares, 1.0)


def cosine(a, b):
    return abs(np.vdot(a, b)) / np.linalg.norm(a) / np.linalg.norm(b)


def test_shares_of_the_energy_do_not_depend_on_the_frames_of_the_shapes():
    """Two beams in a row, bent by their weight, with masses and shapes in other frames; damping left out."""
    shares = []
    for frame in ("root", "mean"):
        part = replace(reduced(frame), D=np.zeros_like(reduced(frame).D))
        bodies = [FlexibleBody("near", part), FlexibleBody("far", part, position=(LENGTH, 0, 0))]
        joints = [
            FixedJoint("wall", GROUND, Marker("near", "root")),
            FixedJoint("weld", Marker("near", "tip"), Marker("far", "root")),
        ]
        system = System(bodies, joints, [Gravity((0, 0, -0.5))])
        shares.append(system_modes(linearize(system, static_equilibrium(system))).energy_shares[:6])
    assert 0.05 < shares[0].min() < shares[0].max() < 0.95
    assert_allclose(shares[0], shares[1], rtol=0, atol=1e-6)
