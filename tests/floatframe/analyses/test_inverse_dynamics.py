"""Drive torques against closed forms; the motors they make give the motion back."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    inverse_dynamics,
    read_results,
)
from floatframe.analyses import drive_forces, with_motors
from floatframe.components.mechanisms import slider_crank
from floatframe.components.mechanisms.rods import slender_inertia
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.command import run_floatframe
from tests.floatframe.examples import CRANK, TURN
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

G = 9.81


def test_torque_and_reaction_of_a_driven_pendulum_are_those_of_the_textbook():
    m, length, J = 2.0, 1.5, 0.4
    rod = RigidBody("rod", m, np.diag([0.1, J, J]), center_of_mass=(length / 2, 0, 0))
    drive = harmonic(1.2, 3.0)
    hinge = RevoluteJoint("hinge", GROUND, Marker("rod"), axis=(0, 0, 1), motions={"angle": drive})
    inverse = inverse_dynamics(System([rod], [hinge], [Gravity((0, -G, 0))]), np.linspace(0, 2, 41))
    t = inverse.motion.t
    angle, rate, rate2 = (np.array([drive(x, order) for x in t]) for order in (0, 1, 2))
    arm = length / 2
    torque = (J + m * arm**2) * rate2 + m * G * arm * np.cos(angle)
    found = inverse.drives["hinge.angle"]
    assert_allclose(found.value, angle, rtol=0, atol=1e-12)
    assert_allclose(found.force, torque, rtol=0, atol=1e-11 * np.abs(torque).max())
    radial, across = np.stack([np.cos(angle), np.sin(angle)]), np.stack([-np.sin(angle), np.cos(angle)])
    force = m * arm * (rate2 * across - rate**2 * radial) + m * G * np.array([[0.0], [1.0]])
    assert_allclose(-inverse.motion.reaction("hinge").force[:, :2], force.T, rtol=0, atol=1e-11 * np.abs(force).max())


def test_torque_of_a_slider_crank_is_that_of_its_energy():
    """tau = d/dt (dT/d phi') - dT/d phi + dV/d phi with T = J(phi) phi'²/2, derivatives by differences."""
    r, length, m_c, m_r, m_s = 0.15, 0.35, 0.5, 0.3, 0.4
    drive = harmonic(1.5, 4.0)
    plain = slider_crank(crank=r, rod=length, crank_mass=m_c, rod_mass=m_r, slider_mass=m_s, angle=0.4, drive=drive)
    inverse = inverse_dynamics(System(plain.bodies, plain.joints, [Gravity((0, -G, 0))]), np.linspace(0, 1.5, 31))

    def rod_of(phi):
        pin = r * np.array([np.cos(phi), np.sin(phi)])
        slider = np.array([pin[0] + np.sqrt(length**2 - pin[1] ** 2), 0.0 * pin[1]])
        return pin, slider

    def inertia(phi, s=1e-5):
        (p1, s1), (p0, s0) = rod_of(phi + s), rod_of(phi - s)
        d_pin, d_slider = (p1 - p0) / (2 * s), (s1 - s0) / (2 * s)
        turn = (np.arctan2(*(s1 - p1)[::-1]) - np.arctan2(*(s0 - p0)[::-1])) / (2 * s)
        middle = (d_pin + d_slider) / 2
        J_c, J_r = slender_inertia(m_c, r)[2, 2] + m_c * r**2 / 4, slender_inertia(m_r, length)[2, 2]
        return J_c + m_r * middle @ middle + J_r * turn**2 + m_s * d_slider @ d_slider

    def potential(phi):
        return G * (m_c + m_r) * r * np.sin(phi) / 2

    found = inverse.drives["main.angle"]
    exact, s = [], 1e-3
    for t in found.t:
        phi, rate, rate2 = 0.4 + drive(t), drive(t, 1), drive(t, 2)
        slope = (inertia(phi + s) - inertia(phi - s)) / (2 * s)
        exact.append(inertia(phi) * rate2 + slope * rate**2 / 2 + (potential(phi + s) - potential(phi - s)) / (2 * s))
    assert_allclose(found.force, exact, rtol=0, atol=1e-5 * np.abs(exact).max())


def test_motors_with_the_torques_give_the_motion_back_at_second_order():
    system = slider_crank(drive=harmonic(1.0, 6.0), angle=0.3)
    inverse = inverse_dynamics(system, np.linspace(0, 1, 101))
    motors = with_motors(system, inverse.drives)
    assert not motors.joints[0].motions
    errors = []
    for h in (5e-3, 2.5e-3, 1.25e-3):
        start = inverse.motion.state(0)
        back = integrate(motors, GeneralizedAlpha(1.0), 1.0, h, state=start, output_every=round(1e-2 / h))
        errors.append(np.abs(back.body("slider").r - inverse.motion.body("slider").r).max())
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert_allclose(slopes, 2, atol=0.15)


def test_motors_with_the_torques_of_a_vibrating_arm_give_its_motion_back():
    points = random_point_masses(3, 5, softness=0.1)
    body = FlexibleBody(
        "arm", reduced_body(points, stiffness(3, omega=30.0)), position=-points.c[np.argmin(points.c[:, 0])]
    )
    hinge = RevoluteJoint(
        "hinge", GROUND, Marker("arm", "end_b"), axis=(0, 1, 0), motions={"angle": harmonic(0.5, 7.0)}
    )
    system = System([body], [hinge], [Gravity((0, 0, -G))])
    motion = integrate(system, GeneralizedAlpha(0.9), 1.0, 5e-4)
    drives = drive_forces(system, motion)
    back = integrate(with_motors(system, drives), GeneralizedAlpha(0.9), 1.0, 5e-4, state=motion.state(0))
    q, q_back = motion.body("arm").q, back.body("arm").q
    assert np.ptp(q) > 0.01
    assert_allclose(q_back, q, rtol=0, atol=2e-3 * np.ptp(q))
    quasi_static = inverse_dynamics(system, motion.t[::100]).drives["hinge.angle"].force
    vibrating = drives["hinge.angle"].force[::100]
    assert np.abs(quasi_static - vibrating).max() > 0.02 * np.abs(vibrating).max()  # it is the vibrations that count


def test_motor_for_what_is_not_driven_is_refused():
    system = slider_crank(drive=harmonic(1.0, 6.0), angle=0.3)
    drives = inverse_dynamics(system, np.linspace(0, 1, 5)).drives
    with pytest.raises(ModelError, match=r"'pin.angle' is not driven; driven are main.angle"):
        with_motors(system, {"pin.angle": drives["main.angle"]})


@pytest.fixture
def driven(tmp_path):
    path = tmp_path / "crank.toml"
    path.write_text(CRANK.replace("\n[run]", TURN + "\n[run]").replace("h = 1e-3", "h = 2.5e-2"))
    return path


def run(*words, code=0):
    result = run_floatframe(*words, code=code)
    return result.output if code else result.stdout


def test_kinematics_command_tells_coordinates_and_writes_results(driven):
    record = json.loads(run("kinematics", driven, "--json"))
    main = record["coordinates"]["main.angle"]
    assert main["is_driven"]
    assert_allclose([main["least"], main["greatest"], main["rate_greatest"]], [0, 2.0, 4.0], rtol=0, atol=1e-10)
    assert record["n_times"] == 21
    assert driven.with_name("crank.kinematics.h5").is_file()
    text = run("kinematics", driven, "-o", driven.with_name("out.h5"))
    assert "guide.distance" in text
    assert "driven" in text
    assert "out.h5" in text
    assert "21 outputs" in run("info", driven.with_name("out.h5"))
    run("plot", driven.with_name("out.h5"))


def test_inverse_command_tells_what_the_drives_give(driven):
    record = json.loads(run("inverse", driven, "--json"))
    dynamic = json.loads(run("inverse", driven, "--elastic", "dynamic", "--set", "run.watch=tell", "--json"))
    assert read_results(driven.with_name("crank.inverse.h5")).head.run["watch"] == "tell"
    main, other = (r["coordinates"]["main.angle"] for r in (record, dynamic))
    assert main["force_unit"] == "N m"
    assert_allclose(main["force_greatest"], other["force_greatest"], rtol=2e-2)
    assert_allclose(
        record["reactions"]["pin"]["largest_force"], dynamic["reactions"]["pin"]["largest_force"], rtol=1e-3
    )
    text = run("inverse", driven)
    for words in ("main.angle", "N m", "rms", "gudgeon", "crank.inverse.h5"):
        assert words in text


def test_commands_refuse_what_is_not_driven_and_unknown_words(driven):
    assert "did you mean 'frozen'" in run("kinematics", driven, "--elastic", "frosen", code=2)
    assert "expected one of frozen, quasi-static" in run("kinematics", driven, "--elastic", "dynamic", code=2)
    driven.write_text(CRANK)
    message = " ".join(run("inverse", driven, code=2).split())
    assert "is not fully driven: 'main.angle' is free (driven: nothing); prescribe its motion" in message
    assert not driven.with_name("crank.inverse.h5").exists()
