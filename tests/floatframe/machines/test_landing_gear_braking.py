"""Braking of the landing gear: the rigid gear against SciPy's wheel, tyre and controller; locked wheel, gear walk."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import cms
import floatframe as ff

METHOD = ff.GeneralizedAlpha(0.8, 1e-8)
RIGID = {"bodies.piston.is_rigid": True, "forces.drag_brace.stiffness": 1e10}


def braked(gear_folder, t_end, h, **changes):
    system, _ = ff.read_system(gear_folder / "braking.toml", changes)
    motion = ff.integrate(system, METHOD, t_end, h)
    brake, tyre = (ff.results.element_motion(system, motion, name).outputs for name in ("brake", "tyre"))
    return system, motion, brake, tyre


def clipped(x):
    return min(max(x, 0.0), 1.0)


def quarter(mass, t):
    """Place, speed and wheel speed of a rigid mass on one wheel, (3, n), and the pressure: everything written anew."""
    load = mass * 9.81
    loaded, rolling = 0.35 - load / 2.5e5, 0.35 - load / 2.5e5 / 3
    B_stiff, C, E = 12.0 * load, 1.65, 0.5

    def friction(kappa, x):
        D = 0.75 * load * np.interp(x, [80, 80.5, 130, 130.5], [1, 0.45, 0.45, 1])
        b = B_stiff / (C * D) * kappa
        return D * np.sin(C * np.arctan(b - E * (b - np.arctan(b))))

    def rates(t, y):
        x, v, omega, tread, sensed, reference, valve, pressure = y
        drag = friction(tread / 0.15, x)
        sensed_rate = (omega - sensed) / 0.005
        rim = 0.3345 * sensed
        skid = max(((reference - rim) / max(reference, 5.0) - 0.15) / 0.06, (-0.3345 * sensed_rate - 40.0) / 20.0)
        s = clipped((t - 0.2) / 0.3)
        pilot = 1.4e7 * s**3 * (10 - 15 * s + 6 * s * s)
        opening = 3e7 * clipped(-skid) - 1.2e8 * clipped(skid)
        torque = 3e-4 * pressure * np.tanh(omega / 0.5)
        return [
            v,
            drag / mass,
            (-loaded * drag - torque) / 1.5,
            -(v - rolling * omega) - v / 0.15 * tread,
            sensed_rate,
            max((rim - reference) / 0.02, -8.0),
            max(min(opening, (pilot - valve) / 0.015), -valve / 0.015),
            (valve - pressure) / 0.015,
        ]

    start = [0.0, 45.0, 134.527, 0.0, 134.527, 0.3345 * 134.527, 0.0, 0.0]
    return solve_ivp(rates, (0, t[-1]), start, t_eval=t, method="LSODA", rtol=1e-8, atol=1e-8, max_step=1e-2).y


def test_a_rigid_gear_with_anti_skid_brakes_as_the_same_equations_by_scipy(gear_folder):
    """Over dry and wet road; friction, tread, sensor, valve and brake stand in `quarter` once more."""
    _, motion, brake, tyre = braked(gear_folder, 2.6, 1e-3, **RIGID)
    mass = 1100 + 25 + 28 + 25 + cms.read(gear_folder / "piston.h5").moments.gram[0, 0]
    exact = quarter(mass, motion.t)
    assert tyre["Fz"].std() < 1e-3 * mass * 9.81
    assert_allclose(motion.body("carriage").r[:, 0], exact[0], rtol=1e-4, atol=1e-3)
    assert_allclose(brake["speed"], exact[2], rtol=0, atol=0.012 * exact[2, 0])  # its cycles meet in time
    assert_allclose(brake["pressure"], exact[7], rtol=0, atol=0.03 * exact[7].max())
    assert np.ptp(exact[7, motion.t > 0.8]) > 7e6  # the valve works
    dry = (motion.t > 0.8) & (motion.t < 1.8)
    assert tyre["Fx"][dry].mean() < -0.95 * 0.75 * tyre["Fz"][dry].mean()


def walking_frequency(stroke):
    """The lowest frequency [Hz] of leg and piston under carriage: a hinged leg with an overhanging tube, by hand.

    Coordinates: carriage, turn of the leg, deflection and slope of the axle against the leg.
    """
    a, b = 0.4 - stroke, 0.4 + stroke
    lever = 0.5 + 0.8 - stroke
    EI = 205e9 * np.pi / 4 * (0.0357**4 - 0.0307**4)
    bend = np.array([[a * a * (a + b) / 3, a * (2 * b + 3 * a) / 6], [a * (2 * b + 3 * a) / 6, b / 3 + a]]) / EI
    K = np.zeros((4, 4))
    K[1, 1], K[2:, 2:] = 6e5, np.linalg.inv(bend)
    tube = 7850 * np.pi * (0.0357**2 - 0.0307**2) * 0.8
    place, turn, middle, slope = ([1, lever, 1, 0], [0, 1, 0, 1], [1, lever - 0.4, 0.2, 0], [0, 1, 0, 0])
    M = 1100 * np.outer([1, 0, 0, 0], [1, 0, 0, 0]) + 25 * np.outer([1, 0.45, 0, 0], [1, 0.45, 0, 0])
    for mass, row in ((53, place), (0.4 + 1.5, turn), (tube, middle), (1.2 + tube * 0.8**2 / 12, slope)):
        M = M + mass * np.outer(row, row)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    return np.sqrt(squares[1]) / (2 * np.pi)


def test_without_anti_skid_the_wheel_locks_and_the_leg_walks_at_its_own_frequency(gear_folder):
    system, motion, brake, tyre = braked(gear_folder, 2.8, 1e-3, **{"elements.brake.anti_skid": False})
    t, wet = motion.t, (motion.t > 2.05) & (motion.t < 2.75)
    locked = (t > 0.85) & (t < 1.9)
    assert np.abs(brake["speed"][locked]).max() < 0.01 * 134.5
    b = 12 / (1.65 * 0.75)
    sliding = 0.75 * np.sin(1.65 * np.arctan(-b - 0.5 * (-b + np.arctan(b))))
    assert_allclose(tyre["Fx"][locked] / tyre["Fz"][locked], sliding, rtol=5e-3)
    walk = (motion.body("wheel").r - motion.body("carriage").r)[:, 0]
    jump = walk[wet].mean() - walk[locked][-200:].mean()
    assert jump > 5e-3
    swing = walk[wet] - np.polyval(np.polyfit(t[wet], walk[wet], 2), t[wet])
    ups = t[wet][1:][(swing[:-1] < 0) & (swing[1:] >= 0)]
    found = (len(ups) - 1) / (ups[-1] - ups[0])
    stroke = ff.results.element_motion(system, motion, "strut").outputs["stroke"][wet].mean()
    assert_allclose(found, walking_frequency(stroke), rtol=0.03)
