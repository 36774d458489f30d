"""The landing gear: its drop against two masses by SciPy, spin-up and spring-back, its retraction against circles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import cumulative_trapezoid, solve_ivp

import cms
import floatframe as ff
from floatframe.machines.landing_gear import retraction
from floatframe.model.functions.tables import monotone_table
from floatframe.model.rotations import rotation_matrix
from floatframe.results.sensors import measurement_of

G, SINK, FORWARD, LIFT, CARRIAGE = 9.81, 2.5, 40.0, 7200.0, 1100.0
RADIUS, TYRE, TYRE_DAMPING, FRICTION, SPIN = 0.35, 2.5e5, 300.0, 0.7, 1.5
METHOD = ff.GeneralizedAlpha(0.8, 1e-10)


def dropped(gear_folder, t_end, h, **changes):
    system, _ = ff.read_system(gear_folder / "drop.toml", changes)
    motion = ff.integrate(system, METHOD, t_end, h)
    strut, tyre = (ff.results.element_motion(system, motion, name).outputs for name in ("strut", "tyre"))
    return motion, strut, tyre


def two_masses(lower, t_end):
    """Heights of carriage and axle over those at touch-down, and their speeds."""
    area = monotone_table([0.0, 0.1, 0.2, 0.32], [1.6e-4, 1.4e-4, 1.0e-4, 0.6e-4])
    p_a, width = 101325.0, 101325.0 / 50

    def rates(t, y):
        s, rate = y[1] - y[0], y[3] - y[2]
        gas = 1.5e6 * (1.6e-3 / (1.6e-3 - 4e-3 * s)) ** 1.3
        hole = 0.9 * (area(s) if rate > 0 else 6e-5)
        pressure = gas + np.sign(rate) * 870 / 2 * (3.2e-3 * rate / hole) ** 2
        oil = (pressure + np.hypot(pressure, width)) / 2
        force = (gas - p_a) * 4e-3 + (oil - gas) * 3.2e-3
        force += (300 + 2e-5 * (gas - p_a)) * rate / np.hypot(rate, 0.01)
        force += 4e6 * min(s, 0) * max(1 - 0.3 * rate, 0) + 4e6 * max(s - 0.32, 0) * max(1 + 0.3 * rate, 0)
        depth = max(-y[1], 0)
        part = min(depth / (RADIUS / 500), 1)
        ground = max(TYRE * depth - TYRE_DAMPING * part**2 * (3 - 2 * part) * y[3], 0) if depth else 0.0
        return [y[2], y[3], (force + LIFT) / CARRIAGE - G, (ground - force) / lower - G]

    start = [0, 0, -SINK, -SINK]
    return solve_ivp(rates, (0, t_end), start, method="Radau", rtol=1e-9, atol=1e-11, max_step=2e-3).y


def test_the_drop_of_a_rigid_gear_is_that_of_two_masses(gear_folder):
    t_end = 0.2
    motion, strut, _ = dropped(gear_folder, t_end, 5e-5, **{"bodies.piston.is_rigid": True})
    exact = two_masses(cms.read(gear_folder / "piston.h5").moments.gram[0, 0] + 28 + 25, t_end)
    assert strut["stroke"].max() > 0.25
    found = [motion.body("carriage").r[-1, 2] - 1.15, motion.body("wheel").r[-1, 2] - RADIUS]
    assert_allclose(found, exact[:2, -1], rtol=2e-5)
    assert_allclose(strut["stroke"].max(), (exact[1] - exact[0]).max(), rtol=1e-4)


def test_a_standing_wheel_spins_up_by_the_friction_of_the_ground_and_the_piston_springs_back(gear_folder):
    motion, strut, tyre = dropped(gear_folder, 0.2, 1e-4)
    spin = motion.body("wheel").omega_B[:, 1]
    lever = RADIUS - tyre["deflection"] / 3  # of the rolling radius: the power of slip is lost, no more
    gained = -cumulative_trapezoid(tyre["Fx"] * lever, motion.t, initial=0)
    assert_allclose(SPIN * spin[-1], gained[-1], rtol=2e-3)
    slides = (motion.t > 0.02) & (spin < 60)
    assert_allclose(tyre["Fx"][slides] / tyre["Fz"][slides], -FRICTION, rtol=2e-2)
    rolling = FORWARD / RADIUS
    assert rolling < spin[-1] < 1.15 * rolling
    carriage, wheel = motion.body("carriage").r, motion.body("wheel").r
    back = wheel[:, 0] - carriage[:, 0]
    k = np.argmin(back)
    overhang, between = 0.4 - strut["stroke"][k], 0.4 + strut["stroke"][k]
    EI = 205e9 * np.pi / 4 * (0.0357**4 - 0.0307**4)
    static = -tyre["Fx"].min() * overhang**2 * (overhang + between) / (3 * EI)
    assert 0.5 * static < -back[k] < 2 * static
    assert back[k:].max() > 0.1 * -back[k]


def test_a_retracting_gear_follows_its_circles_and_the_jack_gives_what_it_gains(gear_folder):
    system, _ = ff.read_system(gear_folder / "retraction.toml")
    motion = ff.integrate(system, METHOD, 7.0, 4e-3)
    theta = ff.joints.JointCoordinate("hinge", "angle").measure(system, motion).value
    jack = ff.results.element_motion(system, motion, "hydraulics").outputs
    exact = retraction(theta)
    assert theta[-1] > np.radians(88)
    assert_allclose(jack["stroke jack"] + 0.4, exact.jack, rtol=0, atol=1e-9)
    assert_allclose(motion.body("lower").r[:, 1:], exact.knee, rtol=0, atol=1e-9)
    work = cumulative_trapezoid(jack["force jack"], jack["stroke jack"], initial=0)
    gained = 9.81 * (exact.potential - exact.potential[0])
    slow = np.abs(np.gradient(theta, motion.t)) < 0.1
    assert_allclose(work[slow], gained[slow], rtol=0, atol=0.01 * gained.max())
    for name in ("head", "rod"):
        assert jack[f"pressure {name}"].min() > 0


@pytest.fixture(scope="module")
def aircraft(gear_folder):
    cms.write(cms.reduce_job(gear_folder / "wing.toml"), gear_folder / "wing.h5")
    return gear_folder / "aircraft.toml"


def test_an_aircraft_stands_on_its_three_gears_by_the_rule_of_levers(aircraft):
    system, _ = ff.read_system(aircraft)
    rest = ff.static_equilibrium(system)
    motion = ff.integrate(system, METHOD, 1e-3, 1e-3, state=rest.state)
    weight, moment = 0.0, 0.0
    for body in system.bodies:
        is_rigid = isinstance(body, ff.RigidBody)
        mass, centre = (body.mass, body.center_of_mass) if is_rigid else of_wing(body.reduced.moments.gram)
        moved = motion.body(body.name)
        weight += G * mass
        moment += G * mass * (moved.r[0] + rotation_matrix(moved.p[0]) @ centre)[0]
    loads = {
        name: ff.results.element_motion(system, motion, f"tyre_{name}").outputs for name in ("left", "right", "nose")
    }
    assert_allclose(sum(each["Fz"][0] for each in loads.values()), weight, rtol=1e-8)
    assert_allclose(sum(each["Fz"][0] * each["px"][0] for each in loads.values()), moment, rtol=0, atol=1e-4 * weight)
    assert_allclose(loads["left"]["Fz"][0], loads["right"]["Fz"][0], rtol=1e-6)
    assert 0.05 * weight < loads["nose"]["Fz"][0] < 0.2 * weight


def of_wing(gram):
    """Return the mass of a wing and its centre."""
    return gram[0, 0], gram[0, 1:4] / gram[0, 0]


def test_an_aircraft_lands_on_its_main_gears_with_the_lift_of_its_attitude(aircraft):
    system, _ = ff.read_system(aircraft)
    motion = ff.integrate(system, METHOD, 0.3, 1e-3)
    loads = {
        name: ff.results.element_motion(system, motion, f"tyre_{name}").outputs["Fz"]
        for name in ("left", "right", "nose")
    }
    first = {name: motion.t[np.argmax(load > 100)] for name, load in loads.items()}
    assert first["left"] == first["right"] < 0.01 < first["nose"]
    assert_allclose(loads["left"], loads["right"], rtol=0, atol=1e-6 * loads["left"].max())
    tip = measurement_of(system, motion, "tip").columns["z"]
    assert tip.max() > 0.1  # the lift bends it up
    left, right = (
        ff.results.element_motion(system, motion, f"lift_{side}_outer").outputs for side in ("left", "right")
    )
    assert_allclose(left["lift"], right["lift"], rtol=1e-6)
    sinks = np.arctan2(2.0, 40.0) + np.radians(4)  # of the path and of the nose
    assert_allclose(left["alpha"][0], sinks, rtol=1e-6)
    assert_allclose(left["lift"][0], 0.5 * 1.225 * 1604 * 3.7 * 4.8 * (sinks + 0.14), rtol=1e-6)
