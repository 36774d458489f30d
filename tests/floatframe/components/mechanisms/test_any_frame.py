"""Stiffened bodies whose root moves, in any frame of their file: one motion, that of geometrically exact beams."""

from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
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
    RigidBody,
    System,
    integrate,
)
from floatframe.model.functions.time_functions import sampled, smooth_step
from floatframe.results.place_motion import interface_motion
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem
from tests.references.planar_dynamics import integrate as integrate_exact

LENGTH, SIDE, N = 5.0, 0.03, 16
ALLOY = fm.Material("alloy", E=7e10, nu=0.3, rho=2700.0)
SQUARE = fm.beams.Rectangle(SIDE, SIDE)
INERTIA = 20.0  #: of the hub about z [kg m²]
H = 4e-3
FRAMES = {
    "mean": cms.TisserandFrame(),
    "root": cms.NodalFrame("root"),
    "both ends": cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (N, 1), (N, 2))),
    "Buckens": cms.reduction.BuckensFrame(),
}
SAME = 1e-6  #: of the deflection: what Newton's tolerance of 1e-9 leaves between frames over hundreds of steps


@cache
def boom(frame):
    """Return an aluminium boom of 5 m, elastic in its plane, in a frame."""
    mesh = fm.beams.straight_line((0, 0, 0), (LENGTH, 0, 0), N)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", N))]
    section = fm.beams.BeamProperty(SQUARE, ALLOY, orientation=(0, 1, 0))
    body = fm.beam_body(mesh, section, name="boom", units=cms.unit_system("m-kg-s"), interfaces=ends)
    body = fm.planar(cms.couple(body))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=4), frame=FRAMES[frame], geometric=True)


def exact_boom():
    A, inertia = SIDE**2, SIDE**4 / 12
    shear = ALLOY.E / (2 * (1 + ALLOY.nu)) * SQUARE.properties(ALLOY.nu).A_sy
    data = ALLOY.E * A, shear, ALLOY.E * inertia, ALLOY.rho * A, ALLOY.rho * inertia
    return ExactBeam((0, 0), (LENGTH, 0), 5, *data)


def still(t):
    return 0.0, 0.0, 0.0


def moved(system, t_end):
    return integrate(system, GeneralizedAlpha(0.8, 1e-9), t_end, H)


def at(motion, frame, body, end):
    return interface_motion(motion, body, boom(frame), end).position[:, :2]


def across(points, angle):
    """Return the components of points along and across axes at these angles, (n_t, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([points[:, 0] * c + points[:, 1] * s, points[:, 1] * c - points[:, 0] * s])


# a free hub with two booms ------------------------------------------------------------------------------------------


def booms(frame, torque):
    """Return a hub in free flight, which a torque turns, with two booms fixed to its middle."""
    bodies = [
        RigidBody("hub", 50.0, INERTIA * np.eye(3)),
        FlexibleBody("right", boom(frame)),
        FlexibleBody("left", boom(frame), orientation=(0, 0, 0, 1)),
    ]
    joints = [FixedJoint(f"{name} root", Marker("hub"), Marker(name, "root")) for name in ("right", "left")]
    return System(bodies, joints, [PointForce("torque", Marker("hub"), torque=(0, 0, 1.0), amplitude=torque)])


def exact_booms(torque, t_end):
    """Return tip of the right boom and angle of the hub: by symmetry one boom on half a hub whose middle is held."""
    beam = exact_boom()
    root = beam.node(0)
    half = sp.csc_array(([INERTIA / 2], ([root[2]], [root[2]])), shape=(beam.n_dof,) * 2)

    def load(t):
        p = np.zeros(beam.n_dof)
        p[root[2]] = torque(t) / 2
        return p

    problem = Problem(beam.mass() + half, beam.force, beam.x0, {int(k): still for k in root[:2]}, load=load)
    motion = integrate_exact(problem, t_end, H, rho_inf=0.8)
    return motion.x[:, beam.node(-1)[:2]], motion.x[:, root[2]]


def angle_of(motion, body):
    p = motion.body(body).p
    return 2 * np.unwrap(np.arctan2(p[:, 3], p[:, 0]))


@pytest.mark.parametrize(("size", "bend", "limit"), [(50.0, 0.005, 0.001), (1200.0, 0.15, 0.015)])
def test_booms_on_a_free_hub_bend_as_exact_beams_in_every_frame(size, bend, limit):
    """They failed at 1 % of their length in a frame held at the root; here 0.8 % and 18 %."""
    torque = sampled(lambda t: size * np.sin(np.pi * t) ** 3, 0.0, 2.0, 1e-4 * size)
    tip, angle = exact_booms(torque, 2.0)
    expected = across(tip, angle) - [LENGTH, 0.0]
    assert np.abs(expected[:, 1]).max() > bend * LENGTH
    seen = {}
    for frame in FRAMES:
        motion = moved(booms(frame, torque), 2.0)
        seen[frame] = across(at(motion, frame, "right", "tip"), angle_of(motion, "hub")) - [LENGTH, 0.0]
        assert motion.validity == ()
        gap = np.abs(seen[frame] - seen["mean"]).max(axis=0)
        assert (gap < SAME * np.abs(expected).max()).all()
    error = np.abs(seen["mean"] - expected).max(axis=0) / np.abs(expected).max(axis=0)
    assert (error < limit).all()


# a driven arm of two links ------------------------------------------------------------------------------------------


def arm(frame, drive):
    """Return two booms in a row: the first turned by a drive, the second on a hinge."""
    bodies = [FlexibleBody("upper", boom(frame)), FlexibleBody("fore", boom(frame), position=(LENGTH, 0, 0))]
    joints = [
        RevoluteJoint("shoulder", GROUND, Marker("upper", "root"), motions={"angle": drive}),
        RevoluteJoint("elbow", Marker("upper", "tip"), Marker("fore", "root")),
    ]
    return System(bodies, joints)


def exact_arm(drive, t_end):
    """Return elbow and tip: two exact beams that share the place of the elbow."""
    beam = exact_boom()
    n, elbow = beam.n_dof, beam.node(-1)
    columns = np.concatenate([np.arange(n), elbow[:2], np.arange(n, 2 * n - 2)])
    T = sp.csc_array((np.ones(2 * n), (np.arange(2 * n), columns)), shape=(2 * n, 2 * n - 2))
    fore = beam.x0.copy()
    fore[0::3] += LENGTH

    def force(x):
        both = T @ x
        (f_1, K_1), (f_2, K_2) = beam.force(both[:n]), beam.force(both[n:])
        return T.T @ np.concatenate([f_1, f_2]), sp.csc_array(T.T @ sp.block_diag([K_1, K_2]) @ T)

    M = sp.csc_array(T.T @ sp.block_diag([beam.mass(), beam.mass()]) @ T)
    driven = {0: still, 1: still, 2: lambda t: (drive(t), drive(t, 1), drive(t, 2))}
    motion = integrate_exact(Problem(M, force, np.concatenate([beam.x0, fore[2:]]), driven), t_end, H, rho_inf=0.8)
    return motion.x[:, elbow[:2]], motion.x[:, -3:-1]


def test_a_driven_arm_of_two_links_moves_as_exact_beams_in_every_frame():
    """It failed at 0.24 % of the length in a frame held at the roots; here the upper link bends by 15 %."""
    drive = smooth_step(0.0, 2.0, 0.0, 0.5)
    elbow, tip = exact_arm(drive, 2.5)
    angle = np.array([drive(H * k) for k in range(len(elbow))])
    bend = across(elbow, angle)[:, 1]
    assert np.abs(bend).max() > 0.14 * LENGTH
    seen = {}
    for frame in FRAMES:
        motion = moved(arm(frame, drive), 2.5)
        seen[frame] = np.hstack([at(motion, frame, "upper", "tip"), at(motion, frame, "fore", "tip")])
        assert_allclose(at(motion, frame, "fore", "root"), seen[frame][:, :2], rtol=0, atol=1e-9 * LENGTH)
        assert np.abs(seen[frame] - seen["mean"]).max() < SAME * np.abs(bend).max()
    assert np.abs(across(seen["mean"][:, :2], angle)[:, 1] - bend).max() < 0.003 * np.abs(bend).max()
    assert np.abs(seen["mean"][:, 2:] - tip).max() < 0.003 * np.abs(bend).max()


# a rod on a hinge ---------------------------------------------------------------------------------------------------


def test_a_hinged_rod_that_falls_and_is_struck_moves_as_an_exact_beam_in_every_frame():
    """Released level under gravity, with a blow on its tip: it bends by 6 % while its root turns freely."""
    weight = 9.81
    blow = sampled(lambda t: 150.0 * np.sin(np.pi * t / 0.4) ** 3 * (t < 0.4), 0.0, 1.0, 1e-2)
    beam = exact_boom()
    mass = beam.mass()
    down = np.zeros(beam.n_dof)
    down[1::3] = -weight

    def load(t):
        p = mass @ down
        p[beam.node(-1)[1]] += blow(t)
        return p

    root = beam.node(0)
    exact = integrate_exact(
        Problem(mass, beam.force, beam.x0, {int(k): still for k in root[:2]}, load=load), 1.0, H, rho_inf=0.8
    )
    tip, angle = exact.x[:, beam.node(-1)[:2]], exact.x[:, root[2]]
    bend = np.abs(across(tip, angle)[:, 1]).max()
    assert bend > 0.05 * LENGTH
    seen = {}
    for frame in FRAMES:
        system = System(
            [FlexibleBody("rod", boom(frame))],
            [RevoluteJoint("hinge", GROUND, Marker("rod", "root"))],
            [Gravity((0, -weight, 0)), PointForce("blow", Marker("rod", "tip"), (0, 1.0, 0), amplitude=blow)],
        )
        motion = moved(system, 1.0)
        seen[frame] = at(motion, frame, "rod", "tip")
        assert np.abs(at(motion, frame, "rod", "root")).max() < 1e-9 * LENGTH
        assert np.abs(seen[frame] - seen["mean"]).max() < SAME * bend
    assert np.abs(seen["mean"] - tip).max() < 0.005 * bend
