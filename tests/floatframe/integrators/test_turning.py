"""Bodies that turn far in a step: joints give them no energy, and rotors precess as they should.

A rigid arm on a hinge, its frame away from the hinge, keeps its speed; a pendulum its energy. A fast rotor whose weight
is carried beside its point of suspension precesses with m g l/(J w), however far it spins in a step; a wheel that is
tilted on its shaft turns steadily. Beyond one radian a step an arm is refused by name.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from floatframe import (
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
    integrate,
)
from floatframe.components.mechanisms.linkages import slider_crank
from floatframe.errors import ConvergenceError
from floatframe.integrators import trapezoidal
from floatframe.joints import DistanceJoint, PointOnLine, UniversalJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix
from tests.bodies import beam
from tests.floatframe.orders import slope

#: general position: where the system stands and how it is turned
PLACE, ORIENTATION = np.array([3.0, -40.0, 7.0]), euler_parameters_of_rotation_vector(np.array([0.4, -0.8, 0.3]))
TURN = rotation_matrix(ORIENTATION)
G = 9.81


def on_ground(x=0.0):
    return Marker("ground", position=PLACE + x * TURN[:, 0])


def at(body, x):
    return Marker(body, position=np.array([x, 0.0, 0.0]))


def body_at(name, mass, inertia, point, velocity, omega_B):
    """Return a body at a point of the turned axes, with a velocity in them."""
    return RigidBody(
        name, mass, inertia, position=PLACE + TURN @ np.array(point), orientation=ORIENTATION,
        velocity=TURN @ np.array(velocity), omega_B=omega_B,
    )  # fmt: skip


def arm(speed, J, mass=1.0):
    """Return an arm of unit length that turns about its end."""
    body = body_at("arm", mass, J * np.diag([0.3, 0.8, 1.0]), (1, 0, 0), (0, speed, 0), (0, 0, speed))
    hinge = RevoluteJoint("hinge", on_ground(), at("arm", -1.0), axis=TURN[:, 2])
    return System([body], [hinge])


@pytest.mark.parametrize("rho_inf", [1.0, 0.95, 0.9, 0.8, 0.5])
@pytest.mark.parametrize("turn", [0.05, 0.5], ids=["0.05 rad a step", "0.5 rad a step"])
def test_a_hinge_gives_a_rotating_arm_no_energy(rho_inf, turn):
    motion = integrate(arm(10.0, 0.01), GeneralizedAlpha(rho_inf), 20 * turn, turn / 10.0)
    speed = motion.body("arm").omega_B[:, 2]
    assert speed.max() < 10.0 * (1 + 1e-3)
    if rho_inf >= 0.9:  # more damping takes what it does of a point on a circle
        assert speed.min() > 10.0 * (1 - 0.03)


@pytest.mark.parametrize(
    "method", [trapezoidal(), GeneralizedAlpha(0.95), GeneralizedAlpha(0.8)], ids=["trapezoidal", "0.95", "0.8"]
)
@pytest.mark.parametrize("h", [5e-3, 2e-2])
@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_rod_gives_a_pendulum_no_energy(method, h, formulation):
    ball = body_at("ball", 2.0, np.eye(3), (1, 0, 0), (0, 0, 0), (0, 0, 0))
    rod = DistanceJoint("rod", on_ground(), at("ball", 0.0))
    motion = integrate(System([ball], [rod], [Gravity(-G * TURN[:, 2])]), method, 10.0, h, formulation=formulation)
    total = motion.energies.total - motion.energies.total[0]
    assert total.max() < 5e-3 * 2.0 * G  # where it swings fast, the error of the scheme of second order
    assert total.min() > -2e-2 * 2.0 * G


def test_an_arm_that_turns_too_far_in_a_step_is_refused_by_name():
    words = "body 'arm' turns by .* rad in a step, with a joint away from its axis.*at most 1 rad"
    with pytest.raises(ConvergenceError, match=words):
        integrate(arm(10.0, 0.01), GeneralizedAlpha(0.8), 10.0, 0.15)


def test_a_loop_whose_crank_turns_too_far_in_a_step_is_refused_by_name():
    """Without the limit the slider-crank reaches 1e78 times its energy in joint coordinates."""
    words = "body 'crank' turns by 1.35 rad in a step, with a joint away from its axis.*at most 1 rad"
    with pytest.raises(ConvergenceError, match=words):
        integrate(slider_crank(speed=10.0), GeneralizedAlpha(0.95), 13.0, 0.13, formulation="relative")


def test_a_loop_through_the_axis_of_its_turn_follows_any_step():
    """The arm stands on a ball joint and is led at a point above it: a loop in joint coordinates, on the axis."""
    up, body = 0.5 * TURN[:, 2], arm(10.0, 0.01).bodies[0]
    joints = [
        SphericalJoint("foot", on_ground(), at("arm", -1.0)),
        PointOnLine(
            "head", Marker("ground", position=PLACE + up), Marker("arm", position=np.array([-1, 0, 0.5])),
            axis=TURN[:, 2],
        ),
    ]  # fmt: skip
    motion = integrate(System([body], joints), GeneralizedAlpha(0.8), 15.0, 0.3, formulation="relative")
    assert_allclose(motion.body("arm").omega_B[:, 2], 10.0, rtol=1e-10, atol=0)


def test_a_step_of_an_arm_that_turns_too_far_is_divided():
    motion = integrate(arm(10.0, 0.01), GeneralizedAlpha(0.95, h_min=1e-3), 1.5, 0.15)
    assert_allclose(motion.body("arm").omega_B[:, 2], 10.0, rtol=3e-2, atol=0)


M, L, J, ACROSS = 1.0, 0.3, 0.02, 0.012  # a rotor: its mass, its distance from the suspension, its moments of inertia


def precession(motion):
    """Return the mean rate at which the rotor goes about the vertical, and how far it leaves the level."""
    r = (motion.body("rotor").r - PLACE) @ TURN
    return np.unwrap(np.arctan2(r[:, 1], r[:, 0]))[-1] / motion.t[-1], np.abs(r[:, 2]).max()


def rotor(spin, rate):
    return body_at("rotor", M, np.diag([J, ACROSS, ACROSS]), (L, 0, 0), (0, rate * L, 0), (spin, 0, rate))


def gyroscope(spin, rate):
    """Return a rotor on a hinge in a light frame, which stands on a universal joint."""
    frame = body_at("frame", 0.01, 1e-4 * np.eye(3), (0, 0, 0), (0, 0, 0), (0, 0, rate))
    joints = [
        UniversalJoint("gimbal", on_ground(), at("frame", 0.0), axis=TURN[:, 2], axis_b=(0, 1, 0)),
        RevoluteJoint("hinge", at("frame", L), at("rotor", 0.0), axis=(1, 0, 0)),
    ]
    return System([frame, rotor(spin, rate)], joints, [Gravity(-G * TURN[:, 2])])


def top(spin, rate):
    """Return a rotor on a ball joint."""
    pin = SphericalJoint("pin", on_ground(), at("rotor", -L))
    return System([rotor(spin, rate)], [pin], [Gravity(-G * TURN[:, 2])])


@pytest.mark.parametrize("system", [gyroscope, top])
@pytest.mark.parametrize("rho_inf", [0.9, 0.8, 0.5])
@pytest.mark.parametrize("turn", [0.1, 0.4, 1.0, 5.0], ids=lambda turn: f"{turn} rad a step")
def test_a_spinning_rotor_precesses_as_its_weight_asks(system, rho_inf, turn):
    """Steady precession with a level axis: m g l = J w W, exactly; plain steps of 0.1 rad are off by 0.2 %."""
    spin = 1000.0 if turn > 1 else 200.0
    rate = M * G * L / (J * spin)
    found, height = precession(integrate(system(spin, rate), GeneralizedAlpha(rho_inf), 1.0, turn / spin))
    assert_allclose(found, rate, rtol=1e-3, atol=0)
    assert height < 1e-4 * L


def test_a_step_in_which_a_rotor_spins_too_far_is_refused_by_its_turn():
    with pytest.raises(ConvergenceError, match=r"diverged: body 'rotor' turns by 10 rad in a step"):
        integrate(gyroscope(100.0, M * G * L / (J * 100.0)), GeneralizedAlpha(0.8), 0.5, 0.1)


@pytest.mark.parametrize("is_reversed", [False, True], ids=["rotor second", "rotor first"])
@pytest.mark.parametrize("turn", [0.4, 5.0])
def test_a_top_in_joint_coordinates_precesses_as_its_weight_asks(turn, is_reversed):
    spin = 1000.0 if turn > 1 else 200.0
    rate = M * G * L / (J * spin)
    ends = (at("rotor", -L), on_ground()) if is_reversed else (on_ground(), at("rotor", -L))
    system = System([rotor(spin, rate)], [SphericalJoint("pin", *ends)], [Gravity(-G * TURN[:, 2])])
    motion = integrate(system, GeneralizedAlpha(0.8), 1.0, turn / spin, formulation="relative")
    found, height = precession(motion)
    assert_allclose(found, rate, rtol=1e-4, atol=0)
    assert height < 1e-4 * L
    assert motion.head.summary["n_iterations"] < 2.5 * motion.head.summary["n_steps"]  # the tangent knows the spin


@pytest.mark.parametrize(
    ("h", "error"), [(2.5e-3, 2e-3), (1e-2, 4e-2)], ids=["0.5 rad a step", "2 rad a step, 0.4 rad of nutation"]
)
def test_a_top_on_a_turntable_in_joint_coordinates_follows_a_fine_run(h, error):
    """The parent turns and is slowed by the top: what spins is the motion of the rotor against it."""
    spin, turning, place = 200.0, 3.0, 0.4 + L
    table = body_at("table", 5.0, np.diag([0.5, 0.5, 1.0]), (0, 0, 0), (0, 0, 0), (0, 0, turning))
    inertia = np.diag([J, ACROSS, ACROSS])
    body = body_at("rotor", M, inertia, (place, 0, 0), (0, place * turning, 0), (spin, 0, turning))
    joints = [
        RevoluteJoint("bearing", on_ground(), at("table", 0.0), axis=TURN[:, 2]),
        SphericalJoint("pin", at("table", 0.4), at("rotor", -L)),
    ]
    system, method = System([table, body], joints, [Gravity(-G * TURN[:, 2])]), GeneralizedAlpha(0.8)
    fine = integrate(system, method, 0.5, 2e-4, output_every=50)
    coarse = integrate(system, method, 0.5, h, output_every=round(0.01 / h), formulation="relative")
    assert_allclose(coarse.body("rotor").r, fine.body("rotor").r, rtol=0, atol=error * L)


def halves(spin, rate):
    """Return a rotor of two halves, each without an axis of symmetry, which have one together."""
    bodies = [
        body_at(name, 0.5 * M, np.diag([0.5 * J, one, 0.006]), (L, 0, 0), (0, rate * L, 0), (spin, 0, rate))
        for name, one in (("rotor", 0.004), ("other", 0.008))
    ]
    return bodies, [FixedJoint("seam", at("rotor", 0.1), at("other", 0.1))]


def body_of(*moments):
    def parts(spin, rate):
        return [body_at("rotor", M, np.diag(moments), (L, 0, 0), (0, rate * L, 0), (spin, 0, rate))], []

    return parts


@pytest.mark.parametrize(
    ("parts", "turn", "error"),
    [(body_of(J, J, J), 0.4, 1e-3), (halves, 1.0, 1e-3), (body_of(J, 0.010, 0.014), 1.0, 4e-3)],
    ids=["sphere", "two halves", "nearly symmetric"],
)
def test_in_joint_coordinates_the_inertia_about_a_ball_joint_counts(parts, turn, error):
    """Spins are taken by themselves: plain steps are off by 9 % at 0.4 rad, by 40 % at 1 rad."""
    spin = 200.0
    bodies, joints = parts(spin, M * G * L / (J * spin))
    pin = SphericalJoint("pin", on_ground(), at("rotor", -L))
    system = System(bodies, [pin, *joints], [Gravity(-G * TURN[:, 2])])
    fine = integrate(system, GeneralizedAlpha(0.8), 0.5, 2.5e-4, output_every=round(turn / spin / 2.5e-4))
    coarse = integrate(system, GeneralizedAlpha(0.8), 0.5, turn / spin, formulation="relative")
    way = np.ptp(fine.body("rotor").r, axis=0).max()
    assert_allclose(coarse.body("rotor").r, fine.body("rotor").r, rtol=0, atol=error * way)


def test_a_flexible_shaft_on_a_ball_joint_keeps_its_whirl_in_joint_coordinates():
    """Its spin is not taken by itself, as its modes go around with it: by that the whirl grew a thousandfold here."""
    spin, diameter, length = 1000.0, 0.006, 0.3
    A, inertia = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    line = cms.couple(beam(6, length, E=2.1e11, G=8e10, A=A, Iy=inertia, Iz=inertia, J=2 * inertia))
    half = cms.reduce(line, cms.craig_bampton(line, n_modes=4))
    bodies = [
        FlexibleBody("left", half, position=(0, 0, 0), omega_B=(spin, 0, 0)),
        FlexibleBody("right", half, position=(length, 0, 0), omega_B=(spin, 0, 0)),
        RigidBody(
            "disc", 1.0, 1e-4 * np.diag([5, 3, 3]), position=(length, 0, 0), velocity=(0, 0.05, 0), omega_B=(spin, 0, 0)
        ),
    ]
    joints = [
        SphericalJoint("pin", Marker("ground"), Marker("left", "left")),
        FixedJoint("hub", Marker("left", "right"), Marker("disc")),
        FixedJoint("other", Marker("disc"), Marker("right", "left")),
        PointOnLine("end", Marker("ground", position=(2 * length, 0, 0)), Marker("right", "right"), axis=(1, 0, 0)),
    ]
    system = System(bodies, joints)
    motion = integrate(system, GeneralizedAlpha(0.8), 0.2, 2e-4, formulation="relative", watch="off")
    kinetic = 0.5 * 0.05**2
    assert np.abs(motion.energies.total - motion.energies.total[0]).max() < 1e-2 * kinetic


def test_a_spinning_rotor_precesses_with_a_step_that_follows_its_error():
    rate = M * G * L / (J * 200.0)
    motion = integrate(gyroscope(200.0, rate), GeneralizedAlpha(0.8, error_tolerance=1e-6), 1.0, 0.02)
    assert_allclose(precession(motion)[0], rate, rtol=2e-3, atol=0)


def test_a_top_takes_steps_of_one_size_in_both_formulations_for_one_error():
    """Its axis is let go at rest, so that it nods; the error counts what happens in axes that do not spin."""
    system = top(200.0, 0.0)
    method = GeneralizedAlpha(0.8, error_tolerance=1e-6)
    one, other = (integrate(system, method, 0.5, 0.05, formulation=each) for each in ("absolute", "relative"))
    assert_allclose(other.head.summary["n_steps"], one.head.summary["n_steps"], rtol=0.1, atol=0)
    assert_allclose(other.body("rotor").r, one.body("rotor").r, rtol=0, atol=2e-3 * L)


@pytest.mark.parametrize("turn", [0.3, 3.0])
def test_a_wheel_tilted_on_its_shaft_turns_steadily_in_steps_of_any_size(turn):
    """Its axis of symmetry is not that of the hinge: the moment (J - J') w² sin cos of the tilt turns with it."""
    tilt, spin = 0.2, 50.0
    tilted = rotation_exp(np.array([0.0, tilt, 0.0]))
    wheel = body_at("wheel", M, tilted @ np.diag([J, ACROSS, ACROSS]) @ tilted.T, (0, 0, 0), (0, 0, 0), (spin, 0, 0))
    hinge = RevoluteJoint("hinge", on_ground(), at("wheel", 0.0), axis=TURN[:, 0])
    motion = integrate(System([wheel], [hinge]), GeneralizedAlpha(0.8), 100 * turn / spin, turn / spin)
    assert_allclose(motion.body("wheel").omega_B, np.tile([spin, 0, 0], (len(motion.t), 1)), rtol=0, atol=1e-9 * spin)
    moment = np.linalg.norm(motion.reaction("hinge").moment, axis=1)
    assert_allclose(moment, (J - ACROSS) * spin**2 * np.sin(tilt) * np.cos(tilt), rtol=1e-9, atol=0)


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
def test_a_free_axisymmetric_body_follows_its_closed_form_with_second_order(formulation):
    """Its axis goes about the angular momentum H with |H|/J' while it spins by w (1 - J/J') against that."""
    omega, inertia, end = np.array([8.0, 1.5, -1.0]), np.array([J, ACROSS, ACROSS]), 1.0
    H = TURN @ (inertia * omega)
    turned = rotation_exp(H / ACROSS * end) @ TURN
    exact = turned @ rotation_exp(np.array([omega[0] * (1 - J / ACROSS) * end, 0, 0]))
    steps, errors = np.array([0.04, 0.02, 0.01, 0.005]), []
    for h in steps:
        body = body_at("free", M, np.diag(inertia), (0, 0, 0), (1, 2, 3), omega)
        motion = integrate(System([body], []), GeneralizedAlpha(0.8, 1e-11), end, h, formulation=formulation)
        errors.append(np.abs(rotation_matrix(motion.body("free").p[-1]) - exact).max())
    assert abs(slope(steps, errors) - 2) < 0.15


def test_free_bodies_without_an_axis_of_symmetry_move_as_without_stabilisation():
    body = body_at("free", M, np.diag([0.01, 0.02, 0.027]), (0, 0, 0), (1, 2, 3), (0.2, 9.0, -0.4))
    plain, stabilized = (
        integrate(System([body], []), GeneralizedAlpha(0.8, stabilized=each), 1.0, 0.02) for each in (False, True)
    )
    np.testing.assert_array_equal(plain.body("free").p, stabilized.body("free").p)


@pytest.mark.parametrize("rho", [0.5, 0.8])
@pytest.mark.parametrize("h", [0.19, 0.2, 0.235, 0.25])
def test_newton_follows_a_pendulum_that_turns_most_of_a_radian_a_step(rho, h):
    """Factors made at the start of such a step are renewed in it, also where an iteration corrects no velocities."""
    rod = RigidBody("rod", 1.0, 0.01 * np.eye(3), position=(1, 0, 0))
    end = Marker("rod", position=np.array([-1.0, 0, 0]))
    hinge = RevoluteJoint("hinge", Marker("ground"), end, axis=(0, 0, 1))
    system = System([rod], [hinge], [Gravity((0, -9.81, 0))])
    motion = integrate(system, GeneralizedAlpha(rho), 6 * h, h, watch="off")
    r, v = motion.body("rod").r, motion.body("rod").v
    energy = 0.5 * 1.01 * np.einsum("tk,tk->t", v, v) + 9.81 * r[:, 1]  # r x v is one metre times the speed
    assert np.abs(np.linalg.norm(r, axis=1) - 1.0).max() < 1e-6
    assert energy.max() < 0.02 * 9.81


def test_held_velocities_cost_hardly_any_iterations():
    spent = []
    for is_stabilized in (False, True):
        method = GeneralizedAlpha(0.8, stabilized=is_stabilized)
        motion = integrate(slider_crank(angle=0.4, speed=20.0), method, 0.3, 0.002)
        spent.append(motion.head.summary["n_iterations"])
    assert spent[1] < 1.1 * spent[0]
