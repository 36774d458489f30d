"""The bogie with induction motors: closed forms of its torque ripple, its drive line, its mounts, the shipped files."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import simpson, solve_ivp
from scipy.linalg import expm

import cms
from floatframe import (
    GROUND,
    GeneralizedAlpha,
    JointForce,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
    read_system,
)
from floatframe.components.drives import InductionMotor
from floatframe.components.rails import Wheelset, height_on_rails
from floatframe.forces import Bushing
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.machines import copy_machine, parameters_of
from floatframe.machines.motor_bogie import SIX_STEPS, Motor, MotorBogie
from floatframe.machines.motor_bogie.closed_forms import (
    ripple_of_leakage,
    speed_of_torque,
    supply_voltage,
    torque_lines,
    torque_over_speed,
)
from floatframe.machines.motor_bogie.plots import at_rest, modes_of, predicted_lines
from floatframe.results import element_motion
from floatframe.sensors import measured

MOTOR = Motor()
UNBALANCED = ((-1, 0.03),)
L = np.array(
    [
        [MOTOR.stator_leakage + MOTOR.magnetizing, MOTOR.magnetizing],
        [MOTOR.magnetizing, MOTOR.rotor_leakage + MOTOR.magnetizing],
    ]
)
P = MOTOR.pole_pairs


def current_rates(i, u, speed):
    """Rates of the complex currents of stator and rotor, in axes of the stator, (2,)."""
    rotor_flux = L[1] @ i
    return np.linalg.solve(
        L, [u - MOTOR.stator_resistance * i[0], 1j * P * speed * rotor_flux - MOTOR.rotor_resistance * i[1]]
    )


def air_gap_torque(i):
    return 1.5 * P * MOTOR.magnetizing * (i[0] * np.conj(i[1])).imag


def supply(f, harmonics, t):
    """Vector of the supply at even frequency."""
    theta = 2 * np.pi * f * t
    parts = [(1, 1.0), *harmonics]
    return supply_voltage(MOTOR, f) * sum(share * np.exp(1j * order * theta) for order, share in parts)


def periodic_torque(f, harmonics, speed, n=256):
    """Torque over a period of the supply by the matrix exponential: dz/dt = A z with an oscillator for each order."""
    orders = [1, *(order for order, _ in harmonics)]
    shares = [1.0, *(share for _, share in harmonics)]
    size = 2 + len(orders)
    A = np.zeros((size, size), dtype=complex)
    for k in range(2):
        A[:2, k] = current_rates(np.eye(2)[k], 0.0, speed)
    for k, (order, share) in enumerate(zip(orders, shares, strict=True)):
        A[:2, 2 + k] = current_rates(np.zeros(2), share * supply_voltage(MOTOR, f), speed)
        A[2 + k, 2 + k] = 2j * np.pi * f * order
    step = expm(A / (f * n))
    z = np.linalg.matrix_power(np.linalg.matrix_power(step, n), 128) @ np.array([0, 0, *([1] * len(orders))])
    torque = []
    for _ in range(n):
        torque.append(air_gap_torque(z[:2]))
        z = step @ z
    return np.array(torque)


def test_the_harmonics_are_those_of_a_vector_that_jumps_by_sixty_degrees():
    n = 6 * 4096
    jumps = np.floor((np.arange(n) + 0.5) / n * 6 + 0.5)  # of the angle, in sixths of a turn
    c = np.fft.fft(np.exp(1j * np.pi / 3 * jumps)) * np.exp(-1j * np.pi * np.fft.fftfreq(n)) / n
    for order, share in SIX_STEPS:
        assert_allclose(c[order] / c[1], share, rtol=0, atol=1e-6)


@pytest.mark.parametrize("harmonics", [SIX_STEPS, UNBALANCED])
def test_mean_and_ripple_of_the_torque_are_those_of_the_matrix_exponential(harmonics):
    """Lines at 6 k f of an inverter in six steps, at 2 f of an unbalanced supply, and at no other multiple."""
    f = 7.3
    speed = speed_of_torque(MOTOR, f, 800.0)
    lines = torque_lines(MOTOR, harmonics, f, speed)
    torque = periodic_torque(f, harmonics, speed)
    exact = np.abs(np.fft.rfft(torque)) / len(torque)
    exact[1:] *= 2
    for n in range(30):
        assert_allclose(exact[n], lines.get(n, 0.0), rtol=1e-9, atol=1e-7)
    assert min(n for n in lines if n > 0) == (6 if harmonics is SIX_STEPS else 2)


def test_the_mean_torque_is_that_of_the_equivalent_circuit():
    """Thevenin: 3/2 p/w U² (R_r/s)/((R_th + R_r/s)² + (X_th + X_r)²) of peak values."""
    f = 40.0
    w = 2 * np.pi * f
    for slip in (0.5, 0.02, -0.03):
        Z_s, Z_m = MOTOR.stator_resistance + 1j * w * MOTOR.stator_leakage, 1j * w * MOTOR.magnetizing
        U, Z = supply_voltage(MOTOR, f) * Z_m / (Z_s + Z_m), Z_s * Z_m / (Z_s + Z_m)
        r = MOTOR.rotor_resistance / slip
        exact = 1.5 * P / w * abs(U) ** 2 * r / abs(Z + r + 1j * w * MOTOR.rotor_leakage) ** 2
        assert_allclose(torque_lines(MOTOR, (), f, w * (1 - slip) / P)[0], exact, rtol=1e-12)
    assert_allclose(torque_lines(MOTOR, (), f, speed_of_torque(MOTOR, f, 1500.0))[0], 1500.0, rtol=1e-9)


def test_at_high_frequency_the_ripple_is_that_of_the_leakage():
    """With next to no resistance and magnetizing current harmonics see the leakage alone, the flux is U/w."""
    motor = replace(
        MOTOR, magnetizing=100 * MOTOR.magnetizing, stator_resistance=1e-6, rotor_resistance=1e-6, boost=0.0
    )
    assert_allclose(torque_lines(motor, SIX_STEPS, 60.0, np.pi * 60.0)[6], ripple_of_leakage(motor, 60.0), rtol=1e-3)


def test_an_oscillating_speed_changes_the_torque_as_the_small_motions_say():
    f, at, size = 8.0, 11.0, 1e-3
    mean = speed_of_torque(MOTOR, f, 700.0)

    def rates(t, y):
        i = y[:2] + 1j * y[2:]
        di = current_rates(i, supply(f, (), t), mean + size * np.cos(2 * np.pi * at * t))
        return [*di.real, *di.imag]

    n = 240  # whole periods of both in a second
    t = 3.0 + np.arange(n) / n
    y = solve_ivp(rates, (0, t[-1]), np.zeros(4), t_eval=t, method="DOP853", rtol=1e-10, atol=1e-9).y
    torque = air_gap_torque(y[:2] + 1j * y[2:])
    found = 2 * np.mean(torque * np.exp(-2j * np.pi * at * t)) / size
    assert_allclose(found, torque_over_speed(MOTOR, f, mean, at), rtol=1e-4)


def test_a_drive_line_started_by_an_inverter_moves_as_an_independent_model():
    """Rotor, gear and elastic wheel by generalized-alpha, two steps extrapolated, against currents of SciPy: 1e-5."""
    J, J_w, k, c, ratio, f, T = 5.0, 112.0, 1.2e6, 340.0, 5.0, 20.0, 0.05
    ends = {name: Marker(name, position=(0, 0, 0)) for name in ("rotor", "quill", "wheel")}
    bodies = [
        RigidBody(name, 1.0, np.diag([inertia, inertia, inertia]))
        for name, inertia in (("rotor", J), ("quill", 12.0), ("wheel", J_w))
    ]
    ground = Marker(GROUND, position=(0, 0, 0))
    joints = [
        RevoluteJoint("spindle", ground, ends["rotor"], axis=(0, 0, 1)),
        RevoluteJoint("hollow", ground, ends["quill"], axis=(0, 0, 1)),
        RevoluteJoint("twist", ends["quill"], ends["wheel"], axis=(0, 0, 1)),
    ]
    gear = CoordinateCoupler(
        "gear", [(JointCoordinate("spindle", "angle"), 1.0), (JointCoordinate("hollow", "angle"), ratio)], 0.0
    )
    motor = InductionMotor(
        "motor", ground, ends["rotor"], **asdict(MOTOR), frequency=f, harmonics=SIX_STEPS, axis=(0, 0, -1)
    )
    spring = JointForce("spring", "twist", "angle", stiffness=k, damping=c)
    system = System(bodies, joints, [spring], couplers=[gear], elements=[motor])

    def rates(t, y):
        i = y[:2] + 1j * y[2:4]
        speed, twist, wheel = y[4:]
        di = current_rates(i, supply(f, SIX_STEPS, t), speed)
        torque = k * twist + c * (speed / ratio - wheel)
        faster = (air_gap_torque(i) - torque / ratio) / (J + 12.0 / ratio**2)
        return [*di.real, *di.imag, faster, speed / ratio - wheel, torque / J_w]

    exact = solve_ivp(rates, (0, T), np.zeros(7), method="DOP853", rtol=1e-10, atol=1e-9).y[:, -1]
    values, defects = [], []
    for h in (2e-4, 1e-4):
        motion = integrate(system, GeneralizedAlpha(0.9, 1e-11), T, h)
        seen = element_motion(system, motion, "motor").outputs
        wheel, quill = (motion.body(name).omega_B[:, 2] for name in ("wheel", "quill"))
        values.append([seen["speed"][-1], seen["current 1"][-1], wheel[-1]])
        brought = simpson(seen["power in"], x=motion.t)
        electric = simpson(seen["power lost"] + seen["power out"], x=motion.t) + seen["energy"][-1]
        heat = simpson(c * (wheel - quill) ** 2, x=motion.t)
        stored = motion.energies.kinetic[-1] + motion.energies.springs[-1] - seen["energy"][-1]
        defects.append([electric / brought - 1, (stored + heat) / simpson(seen["power out"], x=motion.t) - 1])
    extrapolated = (4 * np.array(values[1]) - np.array(values[0])) / 3
    assert_allclose(extrapolated, exact[[4, 0, 6]], rtol=1e-5)
    # what comes in is lost, stored in the fields or drives the shaft, and that moves bodies, spring and damper
    assert np.abs(defects[1]).max() < 1e-4
    assert_allclose(np.divide(*defects), 4, rtol=0.1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The machine, its frame reduced."""
    folder = tmp_path_factory.mktemp("motor_bogie")
    copy_machine("motor-bogie", folder)
    cms.write(cms.reduce_job(folder / "frame.toml"), folder / "frame.h5")
    return folder


def test_the_mounts_carry_the_ripple_that_closed_form_and_frequency_response_say(folder):
    """At 2 m/s 6 f is 41.5 Hz, among modes of motors and frame; the motor answers the swing of its rotor."""
    data, t_end = MotorBogie(speed=2.0), 0.35
    system, _ = read_system(folder / "six_steps.toml", data.even_running())
    f = data.running_frequency
    linear = at_rest(system)
    expected = predicted_lines(data, linear, [f], 0.0, multiples=(6,))
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-7), t_end, 5e-4)
    t = np.asarray(motion.t)
    late = t > t_end - 10 / (6 * f)
    w = np.hanning(late.sum())

    def line(values):
        y = values[late] - values[late].mean()
        return 2 * abs(np.sum(w * np.exp(-12j * np.pi * f * t[late]) * y)) / w.sum()

    torque = line(element_motion(system, motion, "leading_drive").outputs["torque"])
    assert_allclose(torque, expected.torque[6][0], rtol=0.01)
    assert_allclose(line(measured(system, motion)["leading_lower"].columns["force x"]), expected.load[6][0], rtol=0.03)
    alone = torque_lines(data.motor, data.harmonics, f, 2 * np.pi * f / P)[6]
    assert expected.torque[6][0] > 1.05 * alone  # what the mechanics add is more than the tolerance
    modes = modes_of(linear)
    assert any(15 < mode.frequency < 22 and mode.flexible < 0.02 for mode in modes)  # of motors on their mounts
    assert any(mode.flexible > 0.9 for mode in modes)  # of the frame


def test_the_files_have_the_motors_of_the_closed_forms(folder):
    data, given = MotorBogie(), parameters_of(folder / "six_steps.toml")
    system, _ = read_system(folder / "six_steps.toml")
    for motor in (each for each in system.elements if isinstance(each, InductionMotor)):
        assert {name: getattr(motor, name) for name in asdict(MOTOR)} == asdict(MOTOR)
        assert_allclose(motor.harmonics, SIX_STEPS, rtol=1e-15)
    assert given.ratio == data.ratio
    assert_allclose(given.rolling_radius, data.rolling_radius, rtol=1e-12)
    geared, _ = read_system(folder / "six_steps.toml", {"ratio": 4})
    assert [coupler.terms[1][1] for coupler in geared.couplers] == [4.0, 4.0]


def test_the_axles_stand_on_the_loaded_rails_and_mounts_carry_the_motors(folder):
    given, g = parameters_of(folder / "six_steps.toml"), 9.81
    system, _ = read_system(folder / "six_steps.toml")
    wheels = next(each for each in system.elements if isinstance(each, Wheelset))
    axles = 2 * (1563 + 250)
    load = (g * (given.body_mass + given.frame_mass + axles) + 2 * given.motor_weight) / 4
    assert_allclose(given.axle_height, height_on_rails(wheels, load), rtol=0, atol=1e-10)
    mounts = [force for force in system.forces if isinstance(force, Bushing) and force.name.startswith("leading_mount")]
    assert_allclose(sum(mount.preload for mount in mounts)[[0, 2]], [0, -given.motor_weight], rtol=0, atol=1e-9)
