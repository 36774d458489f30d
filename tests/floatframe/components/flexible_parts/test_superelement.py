"""Corotational superelements: stiffness and inertia of the nodes, invariance, floating frames as the other road."""

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
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    System,
    integrate,
    linearize,
    static_equilibrium,
    system_modes,
)
from floatframe.components import corotational
from floatframe.components.flexible_parts.finite_segments import element_stiffness
from floatframe.components.flexible_parts.superelement import node_inertias, relative_stiffness
from floatframe.errors import ModelError
from floatframe.model.bodies.mode_choice import frozen_to_rigid
from floatframe.results.place_motion import interface_motion, point_motion
from tests.bodies import bar

STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=7870.0)
UNITS = cms.unit_system("m-kg-s")
LENGTH = 0.4
ITEM = fm.beams.BeamProperty(fm.beams.Rectangle(0.01, 0.02), STEEL, orientation=(0, 1, 0))
CHORD = cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (6, 1), (6, 2)))


THIN = replace(ITEM, section=fm.beams.Circle(0.001))


def beam(length=LENGTH, *, n_modes=0, frame=None, item=ITEM):
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), 6)
    ends = [fm.beams.line_interface(mesh, end, fm.beams.NodeIndices((k,))) for end, k in (("start", 0), ("end", 6))]
    body = cms.couple(fm.beam_body(mesh, item, name="beam", units=UNITS, interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=n_modes), frame=frame)


def law(length=LENGTH):
    return fm.beams.beam_line(length, replace(ITEM, orientation=None))


@pytest.mark.parametrize("frame", [cms.TisserandFrame(), cms.NodalFrame("start"), CHORD])
@pytest.mark.parametrize("n_modes", [0, 5])
def test_stiffness_is_that_of_the_beam_in_any_frame_and_with_any_modes(frame, n_modes):
    body = beam(frame=frame, n_modes=n_modes)
    found = relative_stiffness("", body, body.interface("start"), body.interface("end"))
    scale = np.sqrt(np.diag(found))
    exact = element_stiffness(law(), 0.0, LENGTH)
    assert_allclose(found / np.outer(scale, scale), exact / np.outer(scale, scale), rtol=0, atol=1e-8)


@pytest.mark.parametrize("frame", [cms.TisserandFrame(), cms.NodalFrame("start"), CHORD])
def test_shares_of_the_nodes_are_those_of_the_consistent_mass(frame):
    """Rows of a thin beam's mass times rigid motion: m/2, m L (0.15 + 1/12)/2, m L²/30, each about its node."""
    body = beam(frame=frame, n_modes=3)
    m = body.moments.m
    (m_a, S_a, J_a), (m_b, S_b, J_b) = node_inertias("", body, body.interface("start"), body.interface("end"))
    assert_allclose([m_a, m_b], m / 2, rtol=1e-9)
    middle = m * LENGTH * (0.15 + 1 / 12) / 2
    assert_allclose([S_a[0], -S_b[0]], middle, rtol=2e-3)  # shear and rotary inertia
    assert_allclose([J_a[1, 1], J_b[2, 2]], m * LENGTH**2 / 30, rtol=5e-3)


def bodies():
    solid = cms.couple(bar(nx=6, length=0.4, width=0.05, height=0.04))
    return {"beam": beam(), "solid": cms.reduce(solid, cms.modes.guyan(solid))}


@pytest.mark.parametrize("name", ["beam", "solid"])
def test_mass_centre_and_inertia_of_the_whole_are_kept(name):
    body = bodies()[name]
    part = corotational("part", body, ends=tuple(interface.name for interface in body.interfaces))
    c = [rotated(b) @ b.center_of_mass + b.position for b in part.bodies]
    masses = [b.mass for b in part.bodies]
    origin = body.frame.origin
    assert_allclose(sum(masses), body.moments.m, rtol=1e-12)
    first = sum(m * (point - origin) for m, point in zip(masses, c, strict=True))
    assert_allclose(first, body.frame.axes @ body.moments.S, rtol=0, atol=1e-10 * body.moments.m)
    J = sum(
        rotated(b) @ b.inertia @ rotated(b).T
        + b.mass * (np.dot(p - origin, p - origin) * np.eye(3) - np.outer(p - origin, p - origin))
        for b, p in zip(part.bodies, c, strict=True)
    )
    assert_allclose(J, body.frame.axes @ body.moments.J0 @ body.frame.axes.T, rtol=0, atol=1e-9 * np.trace(J))


def rotated(body):
    from floatframe.model.rotations import rotation_matrix

    return rotation_matrix(body.orientation)


def cantilever(part, *forces):
    return System(part.bodies, [FixedJoint("clamp", GROUND, part.marker("start"))], [*part.forces, *forces], UNITS)


def test_static_deflection_under_an_end_load_is_exact():
    part = corotational("part", [beam(LENGTH / 2)] * 2)
    load = PointForce("load", part.marker("end"), force=(0.0, 0.02, -0.03))
    found = static_equilibrium(cantilever(part, load)).state.r[-1]
    exact = [
        F * (LENGTH**3 / (3 * EI) + LENGTH / GA)
        for F, EI, GA in ((0.02, law().EIz, law().GAy), (-0.03, law().EIy, law().GAz))
    ]
    assert_allclose(found[1:], exact, rtol=1e-6)


def test_an_end_moment_bends_a_row_to_a_quarter_of_a_circle():
    moment = np.pi * STEEL.E * np.pi / 4 * 0.001**4 / (2 * LENGTH)
    exact = np.array([2 * LENGTH / np.pi, 0.0, 2 * LENGTH / np.pi])
    errors = []
    for n in (4, 8):
        part = corotational("part", [beam(LENGTH / n, item=THIN)] * n)
        load = PointForce("load", part.marker("end"), torque=(0, -moment, 0))
        found = static_equilibrium(cantilever(part, load)).state.r[-1]
        errors.append(np.linalg.norm(found - exact) / LENGTH)
    assert errors[1] < 5e-3
    assert 3.6 < errors[0] / errors[1] < 4.4


def test_frequencies_of_a_row_converge_to_those_of_the_beam():
    exact = beam(n_modes=8, frame=cms.NodalFrame("start")).frequencies[:3]
    errors = []
    for n in (4, 8):
        part = corotational("part", [beam(LENGTH / n)] * n)
        errors.append(np.abs(system_modes(linearize(cantilever(part))).frequencies[:3] / exact - 1))
    assert errors[1].max() < 0.02
    assert (errors[1] < 0.3 * errors[0]).all()


def test_free_motion_keeps_momenta_and_energy_while_it_bends_and_turns():
    part = corotational("part", [beam(LENGTH / 4)] * 4)
    rng = np.random.default_rng(1)
    thrown = [
        replace(b, velocity=np.cross([0, 20.0, 40.0], b.position) + 0.02 * rng.normal(size=3), omega_B=(0, 20.0, 40.0))
        for b in part.bodies
    ]
    drift = []
    for h in (2e-5, 1e-5):
        motion = integrate(System(thrown, [], part.forces, UNITS), GeneralizedAlpha(1.0, 1e-12), 0.01, h)
        e = motion.energies
        total = e.kinetic + e.springs
        momentum = motion.linear_momentum
        drift.append(np.ptp(total))
        assert np.ptp(e.springs) > 0.1 * e.springs.max()
        assert np.abs(momentum - momentum[0]).max() < 1e-7 * np.linalg.norm(momentum[0])  # rounding of stiff springs
    assert drift[1] < 0.35 * drift[0]


def test_small_deflection_moves_as_floating_frames_do():
    """A pendulum of four elements against four floating frames with static shapes, fixed to each other."""
    n, t_end, h = 4, 0.3, 2.5e-4
    body = beam(LENGTH / n)
    hinge = (0, 0, 1)
    frames = [FlexibleBody(f"part {k}", body, position=(k * LENGTH / n, 0, 0)) for k in range(n)]
    joints = [RevoluteJoint("hinge", GROUND, Marker("part 0", "start"), axis=hinge)]
    joints += [
        FixedJoint(f"joint {k}", Marker(f"part {k}", "end"), Marker(f"part {k + 1}", "start")) for k in range(n - 1)
    ]
    gravity = Gravity((0, -9.81, 0))
    floating = integrate(System(frames, joints, [gravity], UNITS), GeneralizedAlpha(0.8), t_end, h)
    part = corotational("part", [body] * n)
    system = System(
        part.bodies, [RevoluteJoint("hinge", GROUND, part.marker("start"), axis=hinge)], [gravity, *part.forces], UNITS
    )
    own = integrate(system, GeneralizedAlpha(0.8), t_end, h)
    end = interface_motion(floating, "part 3", body, "end").position
    found = point_motion(own, "part 5", (0, 0, 0)).position
    assert np.abs(end[:, 1]).max() > 0.5 * LENGTH
    assert_allclose(found, end, rtol=0, atol=2e-5 * LENGTH)


def test_damping_is_proportional_to_the_stiffness_between_the_nodes():
    part = corotational("part", beam(), damping=0.02)
    (element,) = part.forces
    assert np.abs(element.stiffness).max() > 0
    assert_allclose(element.damping, 0.02 * np.asarray(element.stiffness), rtol=1e-15, atol=0)


def test_a_body_without_flexibility_between_its_nodes_is_refused():
    with pytest.raises(ModelError, match="no flexibility between 'start' and 'end'"):
        corotational("part", frozen_to_rigid(beam()))


def test_nodes_that_do_not_fit_are_refused():
    body = beam()
    turned = replace(body.interfaces[1], triad=np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    with pytest.raises(ModelError, match="shares a node"):
        corotational("part", [replace(body, interfaces=(body.interfaces[0], turned)), body])
    with pytest.raises(ModelError, match="got none"):
        corotational("part", [])
    with pytest.raises(ModelError, match="damping: expected zero or more"):
        corotational("part", body, damping=-1.0)
