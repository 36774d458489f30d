"""The frame of a file in mean axes: against particles, the interface that holds it, and differences."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
from floatframe import FlexibleBody, RigidBody, System
from floatframe.engine.compiling.file_frames import changed
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.bodies.marker_shape import interface_shape
from floatframe.model.bodies.mean_axes import FrameMotion, mean_axes, place_of_point, turn_of_mean_axes
from floatframe.model.rotations import euler_parameter_product, euler_parameters_of_rotation_vector, rotation_matrix
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import random_point_masses, random_second_order, reduced_body, stiffness

ROUNDOFF = 1e-12
SLACK = 1e-7  #: of matrices carried to another frame, as in test_geometric_conversion.py
N_Q = 3
LAST = 8
AXES = ((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0))
FRAMES = {
    "root": cms.NodalFrame("root"),
    "tip, turned axes, origin elsewhere": cms.NodalFrame("tip", origin=(0.3, -0.2, 0.1), axes=AXES),
    "both ends": cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (LAST, 1), (LAST, 2))),
    "Buckens": cms.reduction.BuckensFrame(),
}


@pytest.fixture(scope="module")
def bodies():
    """Return a slender beam, bent in two planes, twisted and stretched by its modes, in several frames."""
    mesh = fm.beams.straight_line((0, 0, 0), (2.0, 0, 0), LAST)
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", LAST))]
    alloy = fm.Material("alloy", E=7e10, nu=0.3, rho=2700.0)
    section = fm.beams.BeamProperty(fm.beams.Rectangle(0.03, 0.02), alloy, orientation=(0, 1, 0))
    body = cms.couple(fm.beam_body(mesh, section, name="beam", units=cms.unit_system("m-kg-s"), interfaces=ends))
    modes = cms.craig_bampton(body, n_modes=2)
    frames = FRAMES | {"mean": cms.TisserandFrame()}
    return {name: cms.reduce(body, modes, frame=frame, geometric=True) for name, frame in frames.items()}


def particle_body(seed=4):
    points = random_point_masses(N_Q, seed)
    second = random_second_order(points, seed)
    body = reduced_body(points, stiffness(N_Q))
    return replace(body, geometric=second.geometric((0, 1))), points, second


def test_mean_axes_are_the_polar_rotation_of_particles_but_for_third_order():
    """A displacement of 1, 1/2, 1/4, ... of itself; the rest falls with the cube."""
    body, points, second = particle_body()
    linear, by_squares = turn_of_mean_axes(body)
    point = np.array([0.7, -0.3, 0.2])
    q_0 = np.array([0.03, -0.02, 0.025])
    center = points.m @ points.c / points.m.sum()
    steps, turns, places = 0.5 ** np.arange(4), [], []
    for step in steps:
        q = step * q_0
        x = points.c + points.phi @ q + 0.5 * np.einsum("pakl,k,l->pa", second.g, q, q)
        R, _ = polar(np.einsum("p,pa,pb->ab", points.m, x, points.c - center))  # of the mean axes in B
        Theta = linear @ q + 0.5 * np.einsum("akl,k,l->a", by_squares, q, q)
        turns.append(np.abs(Theta - Rotation.from_matrix(R).as_rotvec()).max())
        seen = R.T @ (point - points.m @ x / points.m.sum())
        A, B = place_of_point(body, point, -linear, -by_squares)
        places.append(np.abs(point - center + A @ q + 0.5 * np.einsum("akl,k,l->a", B, q, q) - seen).max())
    assert turns[0] > 1e-7
    assert abs(slope(steps, turns) - 3) < 0.15
    assert abs(slope(steps, places) - 3) < 0.15


@pytest.mark.parametrize(("frame", "end"), [("root", "root"), ("tip, turned axes, origin elsewhere", "tip")])
def test_a_frame_held_at_an_interface_moves_as_its_marker(bodies, frame, end):
    """Two roads to the same kinematics: the moments of the body, and the carried matrices of the interface."""
    axes = mean_axes(bodies[frame])
    expected = interface_shape(axes.reduced, end, is_stiffened=True)
    for name in ("position", "psi", "bend"):
        found, other = getattr(axes.frame, name), getattr(expected, name)
        for rows in (slice(0, 3), slice(3, 6))[: 1 + (name != "position")]:
            scale = max(np.abs(other[rows]).max(), 1e-3)
            assert_allclose(found[rows], other[rows], rtol=0, atol=SLACK * scale, err_msg=name)


def moving(n, rng):
    """Return a motion with polynomials of time, and its exact rates."""
    q, q_dot, q_ddot = (rng.normal(size=n) * size for size in (1e-2, 1e-1, 1.0))
    r, v, a, spin, theta = rng.normal(size=(5, 3))
    p = euler_parameters_of_rotation_vector(theta)

    def at(t):
        turned = euler_parameters_of_rotation_vector(t * spin)  # by a constant angular velocity, body axes
        return FrameMotion(
            r=r + t * v + t**2 / 2 * a,
            p=euler_parameter_product(p, turned),
            q=q + t * q_dot + t**2 / 2 * q_ddot,
            v=v + t * a,
            omega=spin,
            q_dot=q_dot + t * q_ddot,
            v_dot=a,
            omega_dot=np.zeros(3),
            q_ddot=q_ddot,
        )

    return at


@pytest.mark.parametrize("frame", FRAMES)
def test_rates_in_the_frame_of_the_file_are_those_of_its_motion(bodies, frame):
    axes = mean_axes(bodies[frame])
    at = moving(axes.reduced.n_q, np.random.default_rng(1))
    step = 1e-4
    before, now, after = (axes.to_file(at(t)) for t in (-step, 0.0, step))
    R = rotation_matrix(now.p)
    spin = R.T @ (rotation_matrix(after.p) - rotation_matrix(before.p)) / (2 * step)
    scale = max(np.abs(now.v_dot).max(), np.abs(now.omega_dot).max(), 1.0)
    bound = 1e-6 * scale  # central difference: step², and rounding over the step
    assert_allclose((after.r - before.r) / (2 * step), now.v, rtol=0, atol=bound)
    assert_allclose((after.v - before.v) / (2 * step), now.v_dot, rtol=0, atol=bound)
    assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], now.omega, rtol=0, atol=bound)
    assert_allclose((after.omega - before.omega) / (2 * step), now.omega_dot, rtol=0, atol=bound)


@pytest.mark.parametrize("frame", FRAMES)
def test_there_and_back_is_the_same_motion_to_rounding(bodies, frame):
    axes = mean_axes(bodies[frame])
    motion = moving(axes.reduced.n_q, np.random.default_rng(2))(0.0)
    rows = FrameMotion(*(np.stack([getattr(motion, each.name)] * 2) for each in fields(motion)))
    for start, found in ((motion, axes.to_mean(axes.to_file(motion))), (rows, axes.to_file(axes.to_mean(rows)))):
        for each in fields(motion):
            one, two = getattr(start, each.name), getattr(found, each.name)
            assert_allclose(two, one, rtol=0, atol=100 * ROUNDOFF * max(np.abs(one).max(), 1.0), err_msg=each.name)


@pytest.mark.parametrize("frame", FRAMES)
def test_small_motions_are_the_derivative_of_the_motion(bodies, frame):
    """Velocities are small motions by time: (Rᵀ v, omega, q_dot)."""
    axes = mean_axes(bodies[frame])
    motion = moving(axes.reduced.n_q, np.random.default_rng(3))(0.0)
    told = axes.to_file(motion)

    def in_own_axes(x):
        return np.concatenate([rotation_matrix(x.p).T @ x.v, x.omega, x.q_dot])

    assert_allclose(axes.small_motions(motion.q) @ in_own_axes(motion), in_own_axes(told), rtol=0, atol=ROUNDOFF * 10)


@pytest.mark.parametrize("frame", FRAMES)
def test_places_of_interfaces_agree_between_the_frames_but_for_third_order(bodies, frame):
    """r + R (c + Psi q - 1/2 qᵀ K_P q) in the frame of the file and in mean axes."""
    reduced = bodies[frame]
    axes = mean_axes(reduced)
    rng = np.random.default_rng(5)
    K = np.diag(axes.reduced.K)
    q_0 = 0.05 * rng.normal(size=reduced.n_q) * np.sqrt(K.min() / K)
    steps, gaps = 0.5 ** np.arange(4), []
    zero = np.zeros(3)
    for step in steps:
        q = step * q_0
        there = axes.to_file(FrameMotion(zero, np.array([1.0, 0, 0, 0]), q, zero, zero, 0 * q, zero, zero, 0 * q))
        gap = 0.0
        for k in range(2):
            own = place(axes.reduced, k, q)
            gap = max(gap, np.abs(there.r + rotation_matrix(there.p) @ place(reduced, k, there.q) - own).max())
        gaps.append(gap)
    assert gaps[0] > 1e-9
    assert abs(slope(steps, gaps) - 3) < 0.15


def place(reduced, k, q):
    interface, K = reduced.interfaces[k], np.asarray(reduced.geometric.interfaces[k])
    return interface.position + interface.Psi[:3] @ q - 0.5 * np.einsum("akl,k,l->a", K[:3], q, q)


def test_only_a_stiffened_body_in_another_frame_is_moved_in_mean_axes(bodies):
    assert FlexibleBody("mean", bodies["mean"]).mean_axes is None
    assert FlexibleBody("linear", bodies["root"], stiffening=False).mean_axes is None
    assert FlexibleBody("linear", replace(bodies["root"], geometric=None)).moved.frame.kind == "nodal"
    one, two = FlexibleBody("one", bodies["root"]), FlexibleBody("two", bodies["root"])
    assert one.moved is two.moved
    assert one.moved.frame.kind == "tisserand"


def test_bodies_of_one_file_are_converted_each_by_its_own_motion(bodies):
    """Three of two files, with another frame and a rigid body between them, over three times."""
    rng = np.random.default_rng(3)
    parts = [
        FlexibleBody("a", bodies["root"]),
        RigidBody("b", 1.0, np.eye(3)),
        FlexibleBody("c", bodies["Buckens"]),
        FlexibleBody("d", bodies["mean"]),
        FlexibleBody("e", bodies["root"]),
    ]
    compiled = compiled_system(System(parts, []))
    n_q = compiled.model.bodies.n_q
    motions = [moving(n, rng) for n in n_q]
    own = [[at(t) for t in (0.0, 0.1, 0.2)] for at in motions]

    def rows(of_bodies):
        """Return r, p, q, u, u_dot of all bodies over time."""
        lines = [
            (
                [m.r for m in each], [m.p for m in each], np.concatenate([m.q for m in each]),
                np.concatenate([np.concatenate([m.v, m.omega, m.q_dot]) for m in each]),
                np.concatenate([np.concatenate([m.v_dot, m.omega_dot, m.q_ddot]) for m in each]),
            )
            for each in zip(*of_bodies, strict=True)
        ]  # fmt: skip
        return tuple(np.array(part) for part in zip(*lines, strict=True))

    for way in ("to_file", "to_mean"):
        alone = [
            motion if axes is None else [getattr(axes, way)(now) for now in motion]
            for axes, motion in zip(compiled.mean_axes, own, strict=True)
        ]
        for found, expected in zip(changed(compiled, rows(own), way), rows(alone), strict=True):
            assert_allclose(found, expected, rtol=0, atol=ROUNDOFF)


def test_a_product_of_euler_parameters_turns_as_the_product_of_the_matrices():
    p, other = (x / np.linalg.norm(x, axis=1)[:, None] for x in np.random.default_rng(7).normal(size=(2, 5, 4)))
    expected = rotation_matrix(p) @ rotation_matrix(other)
    assert_allclose(rotation_matrix(euler_parameter_product(p, other)), expected, rtol=0, atol=ROUNDOFF)
