"""An aircraft taxis over a bump: rigid against heave, pitch and strokes by SciPy; flexible wings under their weight."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import cms
import floatframe as ff
from fe_models.foundation.parametric_file import read_parametric
from floatframe.machines import copy_machine
from floatframe.machines.landing_gear import rolling_state
from floatframe.model.functions.tables import monotone_table
from floatframe.results.sensors import measurement_of

G, SPEED, AT, HIGH = 9.81, 20.0, 5.0, 0.03  # the bump of the file is twice as high: its nose wheel leaves the ground
ROAD = (("at", AT), ("height", HIGH))
SLIP, SPIN = (6e4, 2.5e4), (1.5, 0.7)
RIGID = {f"bodies.wing_{side}.is_rigid": True for side in ("left", "right")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("gear")
    copy_machine("landing-gear", place)
    cms.write(cms.reduce_job(place / "wing.toml"), place / "wing.h5")
    return place


def taxied(folder, t_end, **changes):
    near = {f"elements.tyre_{name}.road.{key}": value for name in ("left", "right", "nose") for key, value in ROAD}
    system, _ = ff.read_system(folder / "taxi.toml", near | changes)
    state = rolling_state(system, SPEED)
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.8, 1e-8), t_end, 1e-3, state=state)
    return system, motion


def felt_bump():
    """Return places, heights and slopes of what a disc of 0.35 m feels of the bump, by brute force."""
    x = np.arange(AT - 1, AT + 3.5, 0.005)
    reach = np.arange(-0.345, 0.3451, 0.005)
    s = np.clip((x[:, None] + reach - AT) / 2.5, 0, 1)
    felt = (HIGH / 2 * (1 - np.cos(2 * np.pi * s)) + np.sqrt(0.35**2 - reach**2) - 0.35).max(axis=1)
    return x, felt, np.gradient(felt, x)


def heave_and_pitch(wing, t):
    """Accelerations of cockpit and origin [m/s²] over t: fuselage with wings, two struts in one, nose strut.

    Coordinates: X, Z, theta (nose down) of the fuselage's origin and the strokes of main and nose gear; every mass m at
    (x, z) in the body moves with J = [1, 0, (R' p)_x, ...]; speeds of second order by the rate of J. Tyres push along
    the normal of what their discs feel, through the axles, and along it by the slip of wheels with inertia and a tread.
    """
    masses = [(1950.0, 3600.0, (0.0, 0.0)), (2 * wing[0], 2 * wing[2], wing[1])]
    gears = [(2 * 59.0, -0.35, 1.0, 2, 2.5e5), (26.0, 2.6, 0.35, 1, 1.5e5)]
    orifice = monotone_table([0.0, 0.1, 0.2, 0.32], [1.6e-4, 1.4e-4, 1.0e-4, 0.6e-4])
    nose = 1.24238e-05 / 6e-5
    x_felt, felt, slopes = felt_bump()

    def strut(s, rate, k):
        scale = gears[k][2]
        gas = 1.5e6 * (1 / (1 - 4e-3 * s / 1.6e-3)) ** 1.3
        hole = 0.9 * (orifice(s) if rate > 0 else 6e-5) * (1.0 if k == 0 else nose)
        pressure = gas + np.sign(rate) * 870 / 2 * (3.2e-3 * scale * rate / hole) ** 2
        oil = (pressure + np.hypot(pressure, 101325 / 50)) / 2
        force = (gas - 101325) * 4e-3 * scale + (oil - gas) * 3.2e-3 * scale
        force += scale * (300 + 2e-5 * (gas - 101325)) * rate / np.hypot(rate, 0.01)
        return force + 4e6 * (min(s, 0) * max(1 - 0.3 * rate, 0) + max(s - 0.32, 0) * max(1 + 0.3 * rate, 0))

    def rates(time, y):
        q, v, omega, tread = y[:5], y[5:10], y[10:12], y[12:]
        more = np.zeros(4)
        c, n = np.cos(q[2]), np.sin(q[2])
        turn, up = np.array([[-n, c], [-c, -n]]), np.array([n, c])  # d/dtheta of the axes; the strut's own
        M, f = np.zeros((5, 5)), np.zeros(5)

        def add(mass, inertia, place, k):
            J = np.zeros((2, 5))
            J[0, 0] = J[1, 1] = 1
            J[:, 2] = turn @ place
            drift = -np.array([c * place[0] + n * place[1], -n * place[0] + c * place[1]]) * v[2] ** 2
            if k is not None:
                J[:, 3 + k] = up
                drift = drift + 2 * v[2] * v[3 + k] * np.array([c, -n])
            nonlocal M, f
            M = M + mass * J.T @ J
            M[2, 2] += inertia
            f = f + J.T @ (np.array([0, -mass * G]) - mass * drift)
            return J

        for mass, inertia, place in masses:
            add(mass, inertia, np.array(place), None)
        for k, (mass, x, _, wheels, stiffness) in enumerate(gears):
            s, rate = q[3 + k], v[3 + k]
            place = np.array([x, s - 1.25])
            J = add(mass, 0.0, place, k)
            at = q[:2] + np.array([c * x + n * place[1], -n * x + c * place[1]])
            height, slope = np.interp(at[0], x_felt, felt), np.interp(at[0], x_felt, slopes)
            normal = np.hypot(1, slope)
            depth = 0.35 - (0.35 - (0.35 + height - at[1]) / normal)
            speed = J @ v
            closing = (slope * speed[0] - speed[1]) / normal
            load = max(stiffness * depth + 300 * closing, 0) * wheels if depth > 0 else 0.0
            along = (speed[0] + slope * speed[1]) / normal
            rolling = 0.35 - max(depth, 0) / 3
            slip, drag = SLIP[k], 0.0
            if depth > 0:
                drag = slip * tread[k] / 0.15
            more[k] = -rolling * drag / SPIN[k]
            more[2 + k] = rolling * omega[k] - along - along / 0.15 * tread[k]
            f = f + J.T @ (load * np.array([-slope, 1]) + wheels * drag * np.array([1, slope])) / normal
            f[3 + k] -= wheels * strut(s, rate, k)
        return np.concatenate([v, np.linalg.solve(M, f), more])

    rest = np.array([0, 1.42909425, -0.05027336, 0, 0, SPEED, 0, 0, 0, 0, 0, 0, 0, 0])
    for k, z in enumerate((0.30647456, 0.334117285)):
        c, n = np.cos(rest[2]), np.sin(rest[2])
        rest[10 + k] = SPEED / (0.35 - (0.35 - z) / 3)
        rest[3 + k] = 1.25 - (rest[1] - n * gears[k][1] - z) / c
    y = solve_ivp(rates, (0, t[-1]), rest, method="LSODA", t_eval=t, rtol=1e-6, atol=1e-7, max_step=4e-3).y
    accelerations = np.array([rates(a, b)[5:10] for a, b in zip(t, y.T, strict=True)])
    c, n = np.cos(y[2]), np.sin(y[2])
    cockpit = accelerations[:, 1] + accelerations[:, 2] * (-c * 2.6 - n * 0.3) - y[7] ** 2 * (-n * 2.6 + c * 0.3)
    return cockpit, accelerations[:, 1], y


def test_a_rigid_aircraft_goes_over_a_bump_as_heave_and_pitch_by_scipy(folder):
    system, motion = taxied(folder, 0.6, **RIGID)
    wing = next(body for body in system.bodies if body.name == "wing_left")
    gram = wing.reduced.moments.gram
    mass, centre = gram[0, 0], gram[0, 1:4] / gram[0, 0]
    inertia = gram[1, 1] + gram[3, 3] - mass * (centre[0] ** 2 + centre[2] ** 2)
    cockpit, origin, y = heave_and_pitch((mass, (-0.1, 0.1 + centre[2]), inertia), motion.t)
    found = [measurement_of(system, motion, name).columns["z"] for name in ("cockpit", "centre")]
    for mine, theirs in zip(found, (cockpit, origin), strict=True):
        assert_allclose(mine, theirs, rtol=0, atol=0.02 * np.abs(theirs).max())
    assert_allclose(motion.body("fuselage").r[:, 2], y[1], rtol=0, atol=2e-4)


def test_flexible_wings_roll_sagged_under_their_weight_until_the_bump_comes(folder):
    """The moment at the root at the start is that of the weights on the wing."""
    system, motion = taxied(folder, 0.6)
    root = measurement_of(system, motion, "root").columns["moment x"]
    wing = next(body for body in system.bodies if body.name == "wing_left").reduced.moments.gram
    weights = G * np.cos(0.0502) * wing[0, 2]  # about the root, on a plane floor
    assert_allclose(np.abs(root[0]), weights, rtol=2e-3)
    cockpit = measurement_of(system, motion, "cockpit").columns["z"]
    assert np.abs(cockpit[:50]).max() < 1e-4  # nothing happens before the bump
    assert np.abs(cockpit).max() > 1.0


def test_the_aircraft_that_taxis_is_the_one_that_lands(folder):
    lands, taxis = (read_parametric(folder / name, ff.errors.ModelError) for name in ("aircraft.toml", "taxi.toml"))
    placing = {"position", "rotation_vector", "euler_parameters", "velocity", "omega_B"}
    for name, body in taxis["bodies"].items():
        one, other = ({k: v for k, v in each.items() if k not in placing} for each in (body, lands["bodies"][name]))
        assert one == other
    assert taxis["joints"] == lands["joints"]
    for name, element in taxis["elements"].items():
        assert {k: v for k, v in element.items() if k != "road"} == lands["elements"][name]
