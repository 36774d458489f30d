"""Ready mechanisms: mobility, closed-form kinematics, frequencies and invariants of their motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
import fe_models as fm
from floatframe import FlexibleBody, GeneralizedAlpha, integrate, linearize, static_equilibrium, system_modes
from floatframe.analyses import consistent_state, mobility
from floatframe.components.mechanisms import (
    chain,
    double_pendulum,
    four_bar,
    pendulum,
    satellite,
    slider_crank,
    spinning_top,
)
from floatframe.errors import ModelError
from floatframe.joints import JointCoordinate
from floatframe.model.functions.time_functions import cycloidal_spin_up, polynomial_of_time
from floatframe.model.rotations import rotation_exp, rotation_matrix
from floatframe.results.place_motion import interface_motion, point_motion


@pytest.mark.parametrize(
    ("system", "freedom"),
    [
        (pendulum(), 1),
        (double_pendulum(), 2),
        (chain(4), 4),
        (slider_crank(angle=0.7), 1),
        (four_bar(), 1),
        (spinning_top(), 3),
        (satellite(), 6),
    ],
    ids=lambda value: value.name if hasattr(value, "name") else "",
)
def test_mechanism_has_its_degrees_of_freedom_and_no_redundant_constraint(system, freedom):
    found = mobility(system)
    assert found.mobility == freedom
    assert not found.redundant


def test_slider_goes_where_the_crank_says():
    r, l = 0.15, 0.3  # noqa: E741
    system = slider_crank(crank=r, rod=l, drive=cycloidal_spin_up(20.0, 0.2))
    motion = integrate(system, GeneralizedAlpha(0.8), 0.4, 1e-3)
    phi = JointCoordinate("main", "angle").measure(system, motion).value
    exact = r * np.cos(phi) + np.sqrt(l**2 - (r * np.sin(phi)) ** 2)
    assert phi[-1] > 5
    assert_allclose(point_motion(motion, "slider", (0, 0, 0)).position[:, 0], exact, rtol=0, atol=1e-9)


def test_torque_of_the_drive_does_the_work_that_the_mechanism_gains():
    system = slider_crank(drive=cycloidal_spin_up(20.0, 0.2), angle=0.3)
    motion = integrate(system, GeneralizedAlpha(0.9), 0.3, 2e-4)
    main = JointCoordinate("main", "angle").measure(system, motion)
    work = np.sum(np.diff(main.t) * (main.force[1:] * main.rate[1:] + main.force[:-1] * main.rate[:-1]) / 2)
    assert_allclose(work, motion.energies.kinetic[-1], rtol=2e-3)


def test_rocker_follows_the_loop_equation():
    d, a, b, c = 1.0, 0.3, 0.9, 0.7
    system = four_bar(ground=d, crank=a, coupler=b, rocker=c, angle=1.0, drive=polynomial_of_time([0.0, 8.0]))
    motion = integrate(system, GeneralizedAlpha(0.8), 0.8, 1e-3)
    tip = point_motion(motion, "rocker", (c, 0, 0)).position
    start = point_motion(motion, "crank", (a, 0, 0)).position
    assert_allclose(np.linalg.norm(tip - start, axis=1), b, rtol=0, atol=1e-9)
    theta = 1.0 + 8.0 * motion.t
    assert_allclose(start[:, :2], a * np.stack([np.cos(theta), np.sin(theta)], 1), rtol=0, atol=1e-9)
    # the rocker by the loop equation, on the branch it starts on
    span = np.array([d, 0]) - start[:, :2]
    length = np.linalg.norm(span, axis=1)
    along = (length**2 + b**2 - c**2) / (2 * length)
    e = span / length[:, None]
    exact = start[:, :2] + along[:, None] * e + np.sqrt(b**2 - along**2)[:, None] * np.stack([-e[:, 1], e[:, 0]], 1)
    assert_allclose(tip[:, :2], exact, rtol=0, atol=1e-8)


def test_the_hub_of_a_satellite_is_a_solid_sphere_with_booms_on_its_surface():
    """2/5 m r² about any axis; a boom reaches from r to r + length."""
    system = satellite(hub_mass=30.0, hub_radius=0.3, boom_length=2.0, boom_mass=1.5, spin=0.7)
    hub, right, left = system.bodies
    assert_allclose(hub.inertia, 0.4 * 30.0 * 0.3**2 * np.eye(3), rtol=1e-14)
    assert_allclose([right.position, left.position], [[0.3, 0, 0], [-0.3, 0, 0]], rtol=0, atol=1e-15)
    assert_allclose([right.center_of_mass, left.center_of_mass], [[1.0, 0, 0]] * 2, rtol=0, atol=1e-15)
    assert_allclose(right.velocity, [0, 0.7 * 0.3, 0], rtol=0, atol=1e-15)


def test_bars_of_a_four_bar_linkage_have_the_mass_of_their_length():
    lengths = {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}
    system = four_bar(**lengths, mass_per_length=1.7)
    assert len(system.bodies) == 3
    for body in system.bodies:
        m, length = 1.7 * lengths[body.name], lengths[body.name]
        assert_allclose(body.mass, m, rtol=1e-14)
        assert_allclose(body.center_of_mass, [length / 2, 0, 0], rtol=1e-14)
        assert_allclose(np.diag(body.inertia)[1:], m * length**2 / 12, rtol=1e-3)


def test_bars_that_do_not_close_are_refused():
    with pytest.raises(ModelError, match="do not close"):
        four_bar(ground=3.0, crank=0.3, coupler=0.9, rocker=0.7)
    with pytest.raises(ModelError, match="expected 0 < crank < rod"):
        slider_crank(crank=0.4, rod=0.3)


def test_slow_precession_of_the_top_is_steady():
    """A p² cos(tilt) - C omega_3 p + m g arm = 0, moments about the tip, omega_3 the whole spin along the axis."""
    m, arm, across, along, tilt, g, total = 1.0, 0.1, 0.002, 0.001, 0.5, 9.81, 300.0
    A = across + m * arm**2
    c = np.cos(tilt)
    p = min(np.roots([A * c, -along * total, m * g * arm]).real)
    system = spinning_top(tilt=tilt, spin=total - p * c, precession=p)
    motion = integrate(system, GeneralizedAlpha(1.0, 1e-12), 0.5, 5e-5)
    axis = np.array([rotation_matrix(e)[:, 2] for e in motion.body("top").p[::500]])
    t = motion.t[::500]
    assert_allclose(np.arccos(axis[:, 2]), tilt, rtol=0, atol=1e-4)
    angle = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    assert_allclose(angle - angle[0], p * t, rtol=0, atol=2e-3)


def test_chain_hangs_and_swings_like_the_double_pendulum_pencil():
    rest = static_equilibrium(chain(2))
    modes = system_modes(linearize(chain(2), rest))
    M = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]])
    radius = 0.01
    M += np.eye(2) * radius**2 / 4  # the rods are a little thick
    K = 9.81 * np.diag([1.5, 0.5])
    exact = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    assert_allclose(np.sort(modes.frequencies), np.sort(exact) / (2 * np.pi), rtol=1e-6)


def test_satellite_begins_as_one_turning_body():
    system = satellite(spin=2.0)
    consistent = consistent_state(system)
    axes = [rotation_matrix(p) for p in consistent.state.p]
    in_ground = np.array([R @ w for R, w in zip(axes, consistent.state.u.reshape(3, 6)[:, 3:], strict=True)])
    assert_allclose(in_ground, np.broadcast_to([0, 0, 2.0], (3, 3)), rtol=0, atol=1e-12)
    given = np.concatenate([np.concatenate([body.velocity, body.omega_B]) for body in system.bodies])
    assert_allclose(consistent.state.u, given, rtol=0, atol=1e-12)  # no joint had to correct it


def stiff_rod(length=1.0, mass=1.0):
    """A reduced rod as slender as the rigid ones and nearly as stiff, its interfaces with axes of their own."""
    radius = 0.01 * length
    light = fm.Material("light", E=1e13, nu=0.3, rho=mass / (np.pi * radius**2 * length))
    mesh = fm.beams.straight_line((0.1, 0.2, 0.0), (0.1, 0.2, length), 6)  # along z, away from the origin of the mesh
    triads = [rotation_exp(np.array(v)) for v in ((0.3, -0.5, 0.8), (-1.0, 0.2, 0.4))]
    ends = [
        fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,)), triad=triad)
        for name, k, triad in zip(("start", "end"), (0, 6), triads, strict=True)
    ]
    body = fm.beam_body(
        mesh,
        fm.beams.BeamProperty(fm.beams.Circle(radius), light),
        name="rod",
        units=cms.unit_system("m-kg-s"),
        interfaces=ends,
    )
    coupled = cms.couple(body)
    return cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=2))


@pytest.mark.parametrize(
    "make",
    [
        lambda rod: chain(3, angles=(0.4, -0.3, 1.0), rod=rod),
        lambda rod: satellite(spin=3.0, boom=rod, boom_length=1.0, boom_mass=1.0),
        lambda rod: slider_crank(crank=0.4, rod=1.0, rod_mass=1.0, angle=0.5, speed=3.0, flexible_rod=rod),
        lambda rod: four_bar(ground=1.2, crank=0.3, coupler=1.0, rocker=0.9, flexible_coupler=rod,
                             drive=polynomial_of_time([0.0, 3.0])),
    ],
    ids=["chain", "satellite", "slider-crank", "four-bar"],
)  # fmt: skip
def test_mechanism_of_nearly_rigid_reduced_rods_moves_as_the_rigid_one(make):
    """Laid on its points whatever its mesh axes and the triads of its interfaces."""
    rigid, flexible = make(None), make(stiff_rod())
    assert any(isinstance(body, FlexibleBody) for body in flexible.bodies)
    motions = [integrate(system, GeneralizedAlpha(0.8), 0.4, 2e-3) for system in (rigid, flexible)]
    for body in rigid.bodies:
        if isinstance(flexible.body(body.name), FlexibleBody):
            part = flexible.body(body.name).reduced
            exact = point_motion(motions[0], body.name, (1.0, 0, 0)).position
            found = interface_motion(motions[1], body.name, part, "end").position
        else:
            exact, found = (point_motion(motion, body.name, (1.0, 0, 0)).position for motion in motions)
        assert np.ptp(exact, axis=0).max() > 0.05
        assert_allclose(found, exact, rtol=0, atol=2e-4)
