"""A point on the deformed line of a beam: rigid limits, a moving mass against its own equations, energy."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import cms
import fe_models
from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PointForce,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
    static_equilibrium,
)
from floatframe.analyses import consistent_state, mobility
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import displaced, linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.errors import FloatframeError, ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.joints import ConstantOrientation, JointCoordinate, PointOnLine, SlidingJoint
from floatframe.model.bodies.mode_choice import frozen_to_rigid
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.results.place_motion import interface_motion, point_motion
from floatframe.results.small_motions.joint_rates import coordinate_rows
from tests.floatframe.model.joints.examples import held

UNITS = cms.unit_system("m-kg-s")
LENGTH, RHO_A, EI = 1.0, 1.0, 100.0
N_PARTS = 8
STATIONS = {f"s{k}": k * LENGTH / N_PARTS for k in range(N_PARTS + 1)}
FIRST, *FURTHER = STATIONS


def beam(EI=EI, **options):
    line = fe_models.beams.BeamLine(LENGTH, RHO_A, 1e6, EI, EI, 50.0, rho_Iy=1e-5, rho_Iz=1e-5)
    values = {"n_axial": 1, "n_bending": 8, "n_torsion": 1, "geometric": False} | options
    return cms.reduction.beam_from_assumed_modes(line, name="beam", units=UNITS, stations=STATIONS, **values)


def slider(mass, x, velocity=(0, 0, 0), **options):
    return RigidBody(
        "slider", mass, mass * np.diag([1.0, 2.0, 2.5]) * 1e-3, position=(x, 0, 0), velocity=velocity, **options
    )


SWING = dict(omega_B=(0.5, -1.0, 2.0))


@pytest.mark.parametrize("is_aligned", [False, True])
def test_on_a_rigid_line_it_is_the_point_on_a_line_and_the_prismatic_joint(is_aligned):
    body = frozen_to_rigid(beam())
    flexible = FlexibleBody("beam", body, **SWING)
    velocity = np.cross(SWING["omega_B"], (0.3, 0, 0)) + np.array([0.4, 0, 0])
    block = slider(0.5, 0.3, velocity, omega_B=SWING["omega_B"])
    hinge = SphericalJoint("hinge", GROUND, Marker("beam", FIRST))
    at, on = Marker("beam", FIRST), Marker("slider")
    along = np.array([1.0, 0, 0])
    known = PrismaticJoint("slide", at, on, axis=along) if is_aligned else PointOnLine("slide", at, on, axis=along)
    sliding = SlidingJoint("slide", at, on, line=FURTHER, is_aligned=is_aligned)
    method = GeneralizedAlpha(0.9, stabilized=False)  # stabilised steps differ by 2e-8, as their factors are kept
    motions = [
        integrate(System([flexible, block], [hinge, joint], [Gravity((0, -9.81, 0))], UNITS), method, 0.5, 1e-3)
        for joint in (known, sliding)
    ]
    expected, found = (motion.body("slider") for motion in motions)
    assert np.ptp(found.r, axis=0).min() > 0.02
    assert_allclose(found.r, expected.r, rtol=0, atol=1e-8)
    assert_allclose(found.p, expected.p, rtol=0, atol=1e-8)


def moving_mass(m, v, g, t, n=8):
    """Deflection under a mass that moves with speed v along a simply supported beam, (n_t,), in sine modes.

    rho_A L/2 (q_k_ddot + omega_k² q_k) = -f phi_k(x),  f = m (g + w_ddot),  with the whole second rate of w(v t, t).
    """
    k = np.arange(1, n + 1) * np.pi / LENGTH
    omega2, half = k**4 * EI / RHO_A, RHO_A * LENGTH / 2

    def rates(t, y):
        q, q_dot = y[:n], y[n:]
        x = v * t
        phi, slope, bend = np.sin(k * x), k * np.cos(k * x), -(k**2) * np.sin(k * x)
        known = 2 * v * slope @ q_dot + v**2 * bend @ q + g
        M = half * np.eye(n) + m * np.outer(phi, phi)
        return np.concatenate([q_dot, np.linalg.solve(M, -half * omega2 * q - m * known * phi)])

    y = solve_ivp(rates, (0, t[-1]), np.zeros(2 * n), method="DOP853", t_eval=t, rtol=1e-7, atol=1e-10).y
    return np.array([np.sin(k * v * s) @ q for s, q in zip(t, y[:n].T, strict=True)])


def simply_supported(body, slide, block, gravity):
    joints = [
        RevoluteJoint("left", GROUND, Marker("beam", FIRST), axis=(0, 0, 1)),
        PointOnLine("right", Marker(GROUND, position=(LENGTH, 0, 0)), Marker("beam", FURTHER[-1]), axis=(1, 0, 0)),
        slide,
    ]
    return System([FlexibleBody("beam", body), block], joints, [Gravity((0, -gravity, 0))], UNITS)


def test_moving_mass_deflects_a_simply_supported_beam_as_its_modal_equations_say():
    """Weight acts on the mass alone."""
    m, v, t_end, h = 0.8, 6.0, 0.15, 1e-4
    slide = SlidingJoint(
        "slide",
        Marker("beam", FIRST),
        Marker("slider"),
        line=FURTHER,
        motions={"distance": polynomial_of_time([0.0, v])},
    )
    system = simply_supported(beam(), slide, slider(m, 0.0, (v, 0, 0)), 0.0)
    weight = PointForce("weight", Marker("slider"), force=(0, -m * 9.81, 0))
    system = System(system.bodies, system.joints, [weight], UNITS)
    motion = integrate(system, GeneralizedAlpha(0.95), t_end, h)
    found = motion.body("slider").r
    exact = moving_mass(m, v, 9.81, motion.t)
    assert np.abs(exact).max() > 1e-3
    assert_allclose(found[:, 0], v * motion.t, rtol=0, atol=1e-4)
    assert_allclose(found[:, 1], exact, rtol=0, atol=2e-3 * np.abs(exact).max())


def swinging(is_aligned, body):
    """A soft beam that swings on a hinge with a block that slides outward on it."""
    hinge = SphericalJoint("hinge", GROUND, Marker("beam", FIRST))
    omega = np.array([0.0, 1.0, 8.0])
    block = slider(0.3, 0.35, np.cross(omega, (0.35, 0, 0)), omega_B=omega)
    slide = SlidingJoint("slide", Marker("beam", FIRST), Marker("slider"), line=FURTHER, is_aligned=is_aligned)
    return System([FlexibleBody("beam", body, omega_B=omega), block], [hinge, slide], [Gravity((0, -9.81, 0))], UNITS)


@pytest.mark.parametrize("is_aligned", [False, True])
@pytest.mark.parametrize("geometric", [False, True])
def test_energy_is_kept_while_the_block_slides_on_a_beam_that_bends(is_aligned, geometric):
    """The error of the integrator falls with h²; a reaction that did work would stay."""
    drift = []
    system = swinging(is_aligned, beam(2.0, geometric=geometric))
    for h in (1e-3, 5e-4):
        motion = integrate(system, GeneralizedAlpha(1.0), 0.2, h)
        energies = motion.energies
        total = energies.kinetic + energies.strain + energies.gravity
        drift.append(np.ptp(total))
    place = np.linalg.norm(motion.body("slider").r, axis=1)
    assert place[-1] > place[0] + 0.02
    assert np.abs(energies.strain).max() > 0.05
    assert drift[1] < 0.35 * drift[0]
    assert drift[1] < 2e-3 * np.abs(energies.strain).max()


def hermite_distance(motion, body, point):
    """Least distance of points from the line through the interfaces, by many places on cubics made here again."""
    places = [interface_motion(motion, "beam", body, name) for name in STATIONS]
    least = np.full(len(motion.t), np.inf)
    h = LENGTH / N_PARTS
    for a, b in pairwise(places):
        for x in np.linspace(0, 1, 201):
            value = (1 - 3 * x**2 + 2 * x**3) * a.position + (3 * x**2 - 2 * x**3) * b.position
            value += h * ((x - 2 * x**2 + x**3) * a.axes[:, :, 0] + (x**3 - x**2) * b.axes[:, :, 0])
            least = np.minimum(least, np.linalg.norm(point - value, axis=1))
    return least


def test_the_point_stays_on_the_cubic_through_the_interfaces():
    body = beam(2.0)
    motion = integrate(swinging(False, body), GeneralizedAlpha(0.9), 0.2, 1e-3)
    bending = np.abs(body.interface("s8").Psi[1] @ motion.body("beam").q.T).max()
    assert bending > 0.01
    # half of the distance of two of the places, and the part of second order of the tangents
    assert hermite_distance(motion, body, motion.body("slider").r).max() < 4e-4


def test_work_of_the_drive_is_the_energy_gained():
    drive = polynomial_of_time([0.2, 0.0, 3.0])
    slide = SlidingJoint("slide", Marker("beam", FIRST), Marker("slider"), line=FURTHER, motions={"distance": drive})
    system = simply_supported(beam(), slide, slider(0.5, 0.2), 9.81)
    motion = integrate(system, GeneralizedAlpha(0.9), 0.3, 2e-4)
    energies = motion.energies
    total = energies.kinetic + energies.strain + energies.gravity
    assert_allclose(energies.work - energies.work[0], total - total[0], rtol=0, atol=2e-3 * np.ptp(total))
    assert_allclose(motion.body("slider").r[:, 0], [drive(t) for t in motion.t], rtol=0, atol=1e-4)


def test_aligned_body_turns_with_the_line():
    """At a station the line has the direction of the interface there."""
    body = beam()
    slide = SlidingJoint(
        "slide", Marker("beam", FIRST), Marker("slider"), line=FURTHER, is_aligned=True, motions={"distance": 0.25}
    )
    system = simply_supported(body, slide, slider(2.0, 0.25), 9.81)
    motion = integrate(system, GeneralizedAlpha(0.8), 0.05, 5e-4)
    expected = interface_motion(motion, "beam", body, "s2")
    found = point_motion(motion, "slider", (0, 0, 0))
    assert np.abs(expected.axes[:, 1, 0]).max() > 1e-3
    assert_allclose(found.axes, expected.axes, rtol=0, atol=1e-8)
    assert_allclose(found.position, expected.position, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"line": ()}, "one or more further interfaces"),
        ({"line": ("s0",)}, "each once"),
        ({"line": ("s3", "s2")}, "in order on a straight line"),
        ({"line": ("s9",)}, "no interface 's9'"),
        ({"line": ("s4",), "normal": (1, 0, 0)}, "one along it"),
        ({"line": ("s4",), "motions": {"place": 0.1}}, "no coordinate 'place'"),
    ],
)
def test_impossible_lines_are_refused(options, text):
    with pytest.raises(ModelError, match=text):
        _ = compiled_system(
            System(
                [FlexibleBody("beam", beam()), slider(1.0, 0.0)],
                [SlidingJoint("slide", Marker("beam", FIRST), Marker("slider"), **options)],
                units=UNITS,
            )
        )


def test_a_force_along_the_deformed_line_is_refused_and_not_left_out():
    system = swinging(False, beam())
    rub = JointForce("rub", "slide", "distance", preload=3.0)
    with pytest.raises(ModelError, match="'distance' of joint 'slide' follows a deformed line and cannot take a force"):
        compiled_system(System(system.bodies, system.joints, [*system.forces, rub], UNITS))


def test_a_line_needs_a_flexible_body():
    with pytest.raises(ModelError, match="expected a Marker at an interface"):
        SlidingJoint("slide", Marker("beam"), Marker("slider"), line=("a",))


@pytest.mark.parametrize("is_aligned", [False, True])
def test_coordinate_of_the_joint_is_found_again_in_the_results(is_aligned):
    """Value and rate of a drive; its force times the rate is the power that enters."""
    drive = polynomial_of_time([0.2, 0.5, 3.0])
    slide = SlidingJoint(
        "slide",
        Marker("beam", FIRST),
        Marker("slider"),
        line=FURTHER,
        is_aligned=is_aligned,
        motions={"distance": drive},
    )
    system = simply_supported(beam(), slide, slider(0.5, 0.2, (0.5, 0, 0)), 9.81)
    motion = integrate(system, GeneralizedAlpha(0.9), 0.25, 2e-4)
    found = JointCoordinate("slide", "distance").measure(system, motion)
    assert_allclose(found.value, [drive(t) for t in found.t], rtol=0, atol=1e-9)
    assert_allclose(found.rate, [drive(t, 1) for t in found.t], rtol=0, atol=1e-5)
    power = found.force * found.rate
    work = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(found.t))])
    assert_allclose(work, motion.energies.work - motion.energies.work[0], rtol=0, atol=1e-3 * np.abs(work).max())


def test_system_file_knows_the_joint(tmp_path):
    cms.write(beam(), tmp_path / "beam.h5")
    text = """
        [system]
        units = "m-kg-s"
        [bodies.beam]
        file = "beam.h5"
        [bodies.slider]
        mass = 1.0
        inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        position = [0.25, 0, 0]
        [joints.slide]
        type = "sliding"
        body_a = "beam"
        marker_a = "s0"
        body_b = "slider"
        marker_b = [0, 0, 0]
        line = ["s4", "s8"]
        is_aligned = true
        normal = [0, 1, 0]
        [run]
        t_end = 0.1
        h = 1e-3
    """
    (tmp_path / "system.toml").write_text(text)
    system, _ = read_system(tmp_path / "system.toml")
    joint = system.joints[0]
    assert isinstance(joint, SlidingJoint)
    assert joint.stations == ("s0", "s4", "s8")
    assert joint.is_aligned
    assert mobility(system).mobility == 7  # both free but for five constraints
    (tmp_path / "bad.toml").write_text(text.replace('line = ["s4", "s8"]', ""))
    with pytest.raises(FloatframeError, match=r"joints.slide: line: expected the names of one or more"):
        read_system(tmp_path / "bad.toml")


@pytest.mark.parametrize("geometric", [False, True])
def test_row_of_its_rate_gives_the_rate_of_the_results(geometric):
    """In the middle of a motion, the beam bent."""
    system = swinging(False, beam(2.0, geometric=geometric))
    motion = integrate(system, GeneralizedAlpha(0.9), 0.1, 5e-4)
    compiled, state = compiled_system(system), motion.state(-1)
    work = new_work(compiled.model)
    set_iterate(work, state)
    linearized(compiled.model, work, 1.0, 0.0, 0.0)
    row = coordinate_rows(system, compiled, work, state)["slide.distance"]
    u = state.u.copy()
    for i, first in enumerate(compiled.model.bodies.u0[:-1]):
        u[first : first + 3] = work.state.R[i].T @ u[first : first + 3]
    assert_allclose(row @ u, JointCoordinate("slide", "distance").measure(system, motion).rate[-1], rtol=1e-9)


@pytest.mark.parametrize("is_aligned", [False, True])
def test_equilibrium_of_a_mass_held_in_the_middle(is_aligned):
    """M g L³/48 + 5/384 rho g L⁴ over EI; small, so that the shortening plays no part."""
    slide = SlidingJoint(
        "slide", Marker("beam", FIRST), Marker("slider"), line=FURTHER, is_aligned=is_aligned, motions={"distance": 0.5}
    )
    system = simply_supported(beam(n_bending=18), slide, slider(0.5, 0.5), 0.1)  # the shear jumps in the middle
    if not is_aligned:  # or it could turn about its point
        system = replace(
            system, joints=[*system.joints, ConstantOrientation("level", Marker(GROUND), Marker("slider"))]
        )
    found = static_equilibrium(system).state.r[1]
    exact = 0.1 * LENGTH**3 / EI * (0.5 / 48 + 5 / 384 * RHO_A * LENGTH)
    assert_allclose(found, [0.5 * LENGTH, -exact, 0], rtol=0, atol=1e-4 * exact)


@pytest.mark.parametrize("geometric", [False, True])
@pytest.mark.parametrize("drive", [None, polynomial_of_time([0.35, 1.5, -2.0])])
def test_second_rates_are_the_derivatives_of_what_is_held_along_a_motion(drive, geometric):
    """Of an aligned block, from a closed joint on, on a beam that bends and twists: accelerations stand on them."""
    body = beam(EI=5.0, n_bending=2, geometric=geometric)
    rng = np.random.default_rng(5)
    block = slider(0.3, 0.35, (1.5, 0.2, -0.1), omega_B=(0.5, 1.0, -2.0))
    rod = FlexibleBody("beam", body, omega_B=(0.3, 1.0, 4.0), q=0.03 * rng.normal(size=body.n_q),
                       q_dot=0.5 * rng.normal(size=body.n_q))  # fmt: skip
    slide = SlidingJoint("slide", Marker("beam", FIRST), Marker("slider"), line=FURTHER, is_aligned=True,
                         motions={} if drive is None else {"distance": drive})  # fmt: skip
    system = System([rod, block], [slide], units=UNITS)
    model, s = compiled_system(system).model, 2e-5
    start = consistent_state(system).state
    _, _, bias = held(system, start, 0.0)
    before, at, after = (held(system, displaced(model, start, k * s * start.u), k * s)[0] for k in (-1, 0, 1))
    assert np.abs(bias).max() > 1.0
    assert_allclose((after - 2 * at + before) / s**2, bias, rtol=0, atol=1e-5 * np.abs(bias).max())
