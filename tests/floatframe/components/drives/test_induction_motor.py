"""Laws of the induction motor against an independent model in currents, the equivalent circuit, and energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from floatframe import GROUND, GeneralizedAlpha, Marker, PointForce, RevoluteJoint, RigidBody, System, integrate
from floatframe.components.drives import InductionMotor
from floatframe.errors import ModelError
from floatframe.model.functions.time_functions import piecewise, polynomial_of_time, smooth_step
from floatframe.results import element_motion
from tests.floatframe.element_laws import evaluate, marker_motion, placed, power_defect

A, B = Marker("ground"), Marker("rotor")
#: of a 4 kW machine: R_s, R_r, L_ls, L_lr, L_m, pole pairs
R_S, R_R, L_LS, L_LR, L_M, POLES = 1.405, 1.395, 5.839e-3, 5.839e-3, 0.1722, 2
U, F = 326.6, 50.0


def motor(**options):
    given = {"frequency": F, "voltage": U} | options
    return InductionMotor("motor", A, B, R_S, R_R, L_LS, L_LR, L_M, POLES, **given)


def turning(omega):
    return np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, 0], omega=[0, 0, omega])])


def steady_fluxes(slip):
    """Fluxes at t = 0 of the steady state, by the phasors of the stator."""
    w = 2 * np.pi * F
    L_s, L_r = L_LS + L_M, L_LR + L_M
    Z = np.array([[R_S + 1j * w * L_s, 1j * w * L_M], [1j * slip * w * L_M, R_R + 1j * slip * w * L_r]])
    i_s, i_r = np.linalg.solve(Z, [U, 0])
    psi_s, psi_r = L_s * i_s + L_M * i_r, L_M * i_s + L_r * i_r
    return np.array([psi_s.real, psi_s.imag, psi_r.real, psi_r.imag])


def torque_of_equivalent_circuit(slip):
    """Thevenin's closed form, effective values: 3 p/w U_th² R_r/s/((R_th + R_r/s)² + (X_th + X_lr)²)."""
    w = 2 * np.pi * F
    X_m, Z_s = w * L_M, R_S + 1j * w * L_LS
    U_th = abs(U / np.sqrt(2) * 1j * X_m / (Z_s + 1j * X_m))
    Z_th = 1j * X_m * Z_s / (Z_s + 1j * X_m)
    r = R_R / slip
    return 3 * POLES / w * U_th**2 * r / ((Z_th.real + r) ** 2 + (Z_th.imag + w * L_LR) ** 2)


@pytest.mark.parametrize("slip", [1.0, 0.3, 0.05, -0.04])
def test_the_steady_torque_is_that_of_the_equivalent_circuit(slip):
    law = motor().law(placed(turning(0)))
    w = 2 * np.pi * F
    z = steady_fluxes(slip)
    wrench, z_dot, seen = evaluate(law, 0.0, turning(w * (1 - slip) / POLES), z)
    assert_allclose(z_dot, w * np.array([-z[1], z[0], -z[3], z[2]]), rtol=0, atol=1e-9 * w * np.abs(z).max())
    assert_allclose(wrench[1, 5], torque_of_equivalent_circuit(slip), rtol=1e-12)
    assert_allclose(wrench[0, 5], -wrench[1, 5], rtol=0, atol=0)
    assert_allclose(seen["slip"], slip, rtol=0, atol=1e-14)
    air_gap = wrench[1, 5] * w / POLES  # the losses of the rotor are the slip times the power of the air gap
    stator = 1.5 * R_S * seen["current"] ** 2
    assert_allclose(seen["power in"], stator + air_gap, rtol=1e-11)
    assert_allclose(seen["power lost"] - stator, slip * air_gap, rtol=1e-9)


def test_electrical_power_is_stored_lost_or_given_to_the_shaft():
    law = motor(
        voltage=None, rated_voltage=U, rated_frequency=F, boost=20.0, frequency=polynomial_of_time([2.0, 30.0]),
        harmonics=[[-5, 0.2], [7, 1 / 7]], damping=0.01, ratio=3.0,
    ).law(placed(turning(0)))  # fmt: skip
    z = np.random.default_rng(2).normal(size=4)
    defect, throughput = power_defect(law, 0.37, turning(21.0), z)
    assert abs(defect) <= 1e-12 * throughput


def test_the_phase_of_the_supply_is_the_integral_of_its_frequency():
    frequency = piecewise([0.0, 0.2], [polynomial_of_time([5.0, 100.0]), smooth_step(0.0, 0.1, 25.0, 50.0)])
    law = motor(frequency=frequency).law(placed(turning(0)))
    turns = solve_ivp(lambda t, y: [frequency(t)], (0, 0.2), [0], rtol=1e-12, atol=1e-13).y[0, -1]
    turns += solve_ivp(lambda t, y: [frequency(t)], (0.2, 0.45), [0], rtol=1e-12, atol=1e-13).y[0, -1]
    z_dot = evaluate(law, 0.45, turning(0), np.zeros(4))[1]
    assert_allclose(z_dot, [U * np.cos(2 * np.pi * turns), U * np.sin(2 * np.pi * turns), 0, 0], rtol=0, atol=1e-8 * U)


def test_a_supply_of_harmonics_5_and_7_ripples_at_six_times_its_frequency():
    law = motor(harmonics=[[-5, 0.2], [7, 1 / 7]]).law(placed(turning(0)))
    x = turning(2 * np.pi * F * (1 - 0.03) / POLES)

    def rates(t, z):
        return evaluate(law, t, x, z)[1]

    t = 1.0 + np.arange(128) / 128 / F
    z = solve_ivp(rates, (0, t[-1]), steady_fluxes(0.03), t_eval=t, rtol=1e-7, atol=1e-8, method="LSODA").y
    torque = np.array([evaluate(law, each, x, z[:, k])[2]["torque"] for k, each in enumerate(t)])
    lines = np.abs(np.fft.rfft(torque)) / 64
    assert np.argmax(lines[1:]) + 1 == 6
    assert lines[6] > 10 * np.delete(lines[1:], [5, 11]).max()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"voltage": None},
            "expected a voltage, or rated_voltage and rated_frequency for V/f, got neither: missing supply",
        ),
        ({"rated_voltage": U, "rated_frequency": F}, "expected a voltage, or .* got both"),
        ({"ratio": 0.0}, "ratio: expected a number other than 0"),
        ({"axis": [0, 0, 0]}, "axis: expected a direction, got the zero vector"),
    ],
)
def test_a_motor_that_cannot_be_is_refused(options, message):
    with pytest.raises(ModelError, match=message):
        motor(**options)


def test_a_run_up_is_that_of_an_independent_model_in_currents():
    J, load = 0.0131, 10.0
    a, b = Marker(GROUND, position=(0, 0, 0)), Marker("rotor", position=(0, 0, 0))
    rotor = RigidBody("rotor", mass=1.0, inertia=np.diag([1e-2, 1e-2, J]))
    machine = InductionMotor("motor", a, b, R_S, R_R, L_LS, L_LR, L_M, POLES, frequency=F, voltage=U)
    system = System(
        [rotor], [RevoluteJoint("hinge", a, b, axis=(0, 0, 1))], [PointForce("load", b, torque=(0, 0, -load))],
        elements=[machine],
    )  # fmt: skip
    inductances = np.array([[L_LS + L_M, L_M], [L_M, L_LR + L_M]])

    def rates(t, y):
        i = y[:2] + 1j * y[2:4]
        rotor_flux = inductances[1] @ i
        u = [U * np.exp(2j * np.pi * F * t) - R_S * i[0], 1j * POLES * y[4] * rotor_flux - R_R * i[1]]
        di = np.linalg.solve(inductances, u)
        return [*di.real, *di.imag, (1.5 * POLES * L_M * (i[0] * i[1].conj()).imag - load) / J]

    exact = solve_ivp(rates, (0, 0.1), np.zeros(5), method="Radau", rtol=1e-10, atol=1e-9).y[:, -1]
    values = []
    for h in (1e-4, 5e-5, 2.5e-5):
        found = element_motion(system, integrate(system, GeneralizedAlpha(0.9, 1e-11), 0.1, h), "motor").outputs
        values.append(np.array([found["speed"][-1], found["current 1"][-1]]))
    assert_allclose((4 * values[2] - values[1]) / 3, exact[[4, 0]], rtol=1e-6)
    errors = np.array(values) - exact[[4, 0]]
    assert_allclose(np.log2(errors[:-1] / errors[1:]), 2, rtol=0, atol=0.15)
