"""Steady running and small motions about it: bicycle, discs, rotor and cars against closed forms and other models."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import fsolve

import floatframe as ff
from floatframe.components import wheels
from tests.floatframe.components.wheels.car import HALF_TRACK, Car

G = 9.81
GRAVITY = ff.Gravity((0, 0, -G))


def eigenvalues(motion):
    return ff.system_modes(ff.linearize(motion.system, motion.equilibrium, inputs=(), outputs=())).eigenvalues


def upper(values):
    """Return eigenvalues with an imaginary part of at least zero, sorted."""
    values = np.asarray(values, dtype=complex)
    return np.sort_complex(values[values.imag >= 0])


# velocities that are held -------------------------------------------------------------------------------------------


def bicycle(v):
    """Return the benchmark bicycle of Meijaard et al. (2007); x ahead, here with y left and z up."""
    w, c, tilt = 1.02, 0.08, np.pi / 10

    def inertia(xx, yy, zz, xz):
        return np.array([[xx, 0, -xz], [0, yy, 0], [-xz, 0, zz]])

    places = {"rear": (0, 0, 0.3), "frame": (0.3, 0, 0.9), "fork": (0.9, 0, 0.7), "front": (w, 0, 0.35)}
    bodies = [
        ff.RigidBody(name, mass, J, position=places[name], velocity=(v, 0, 0), omega_B=(0, spin, 0))
        for name, mass, J, spin in (
            ("rear", 2.0, np.diag([0.0603, 0.12, 0.0603]), v / 0.3),
            ("frame", 85.0, inertia(9.2, 11.0, 2.8, 2.4), 0.0),
            ("fork", 4.0, inertia(0.05892, 0.06, 0.00708, -0.00756), 0.0),
            ("front", 3.0, np.diag([0.1405, 0.28, 0.1405]), v / 0.35),
        )
    ]
    axis = np.array([-np.sin(tilt), 0, np.cos(tilt)])
    head = np.array([w + c, 0, 0]) + 0.9 * axis

    def at(body, point):
        return ff.Marker(body, position=np.array(point) - places[body])

    joints = [
        ff.RevoluteJoint("rear_axle", at("frame", places["rear"]), ff.Marker("rear"), axis=(0, 1, 0)),
        ff.RevoluteJoint("steer", at("frame", head), at("fork", head), axis=tuple(axis)),
        ff.RevoluteJoint("front_axle", at("fork", places["front"]), ff.Marker("front"), axis=(0, 1, 0)),
        ff.joints.RollingDisc("rear_rolls", ff.Marker(ff.GROUND), ff.Marker("rear"), radius=0.3),
        ff.joints.RollingDisc("front_rolls", ff.Marker(ff.GROUND), ff.Marker("front"), radius=0.35),
    ]
    return ff.System(bodies, joints, [GRAVITY])


def bicycle_eigenvalues(v):
    """M q'' + v C_1 q' + (g K_0 + v² K_2) q = 0 of lean and steer, matrices as printed in Meijaard et al. (2007)."""
    M = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
    K_0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
    K_2 = np.array([[0, 76.59734589573222], [0, 2.65431523794604]])
    C_1 = np.array([[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
    K = np.linalg.solve(M, G * K_0 + v**2 * K_2)
    return np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -v * np.linalg.solve(M, C_1)]]))


@pytest.mark.parametrize("v", [3.0, 5.0, 8.0])
def test_the_bicycle_weaves_and_capsizes_as_the_benchmark_says(v):
    """Two spinning wheels that roll without slip, ridden straight: unstable weave, stable, unstable capsize."""
    motion = ff.analyses.steady_motion(bicycle(v), "frame")
    linear = ff.linearize(motion.system, motion.equilibrium, inputs=(), outputs=())
    found, expected = ff.system_modes(linear).eigenvalues, bicycle_eigenvalues(v)
    moving = found[np.abs(found) > 1e-3]  # x, y, yaw, and the turns of the wheels cost nothing, nor does the speed
    assert_allclose(upper(moving), upper(expected), rtol=1e-8)
    assert 3 <= len(found) - len(moving) <= 6  # with the speed six zeros; of two rounding may make a pair, told once
    A = np.linalg.eigvals(ff.analyses.named_state_space(linear).A)
    assert_allclose(upper(A[np.abs(A) > 1e-2]), upper(expected), rtol=1e-6)


def disc(V, lean=0.0, m=2.0, r=0.3):
    """Return a thin disc that rolls along x, leaning to its left."""
    body = ff.RigidBody(
        "disc", m, m * r**2 * np.diag([0.25, 0.5, 0.25]), position=(0, 0, r * np.cos(lean)), velocity=(V, 0, 0),
        orientation=(np.cos(lean / 2), -np.sin(lean / 2), 0, 0), omega_B=(0, V / r, 0),
    )  # fmt: skip
    rolls = ff.joints.RollingDisc("rolls", ff.Marker(ff.GROUND), ff.Marker("disc"), radius=r)
    return ff.System([body], [rolls], [GRAVITY])


@pytest.mark.parametrize("V", [0.5, 2.0])
def test_an_upright_disc_falls_below_the_speed_of_theory(V):
    """lambda² = 4 g/(5 r) - 12 V²/(5 r²): stable where V² > g r/3."""
    expected = np.sqrt(0.8 * G / 0.3 - 2.4 * (V / 0.3) ** 2 + 0j)
    found = eigenvalues(ff.analyses.steady_motion(disc(V), "disc"))
    assert np.abs(found - expected).min() < 1e-7


def test_a_disc_in_a_circle_leans_as_moments_about_its_contact_say():
    """m g r sin a = (m r² + I_3) w Omega cos a + I_1 Omega² sin a cos a, w = V/r its turn about its own axis."""
    V, R, m, r = 2.0, 1.5, 2.0, 0.3
    motion = ff.analyses.steady_motion(disc(V, lean=0.2), "disc", curvature=1 / R, spinning={"disc": (0, 1, 0)})
    w, x, y, z = motion.equilibrium.state.p[0]
    lean = np.arcsin(-2 * (y * z + w * x))  # the axle's z
    Omega = V / R
    left = m * G * r * np.sin(lean)
    right = 1.5 * m * r**2 * (V / r) * Omega * np.cos(lean) + 0.25 * m * r**2 * Omega**2 * np.sin(lean) * np.cos(lean)
    assert_allclose(left, right, rtol=1e-9)
    assert np.abs(eigenvalues(motion) - 1j * Omega).min() < 1e-6 * Omega  # a circle elsewhere


# spins ---------------------------------------------------------------------------------------------------------------


def test_a_rotor_in_a_housing_on_unlike_springs_whirls_as_its_four_equations_say():
    """Body axes of rotor and housing do not turn alike, and springs of the ground see no turning axes at all."""
    m, I_t, I_p, spin, k = 5.0, 0.04, 0.07, 300.0, (4e5, 7e5)
    arm, turning = 0.15, (2e3, 5e3)
    rotor = ff.RigidBody("rotor", m, np.diag([I_t, I_t, I_p]), omega_B=(0, 0, spin), position=(0, 0, arm))
    housing = ff.RigidBody("housing", 2.0, 0.01 * np.eye(3))
    bearing = ff.RevoluteJoint(
        "bearing", ff.Marker("housing", position=(0, 0, arm)), ff.Marker("rotor"), axis=(0, 0, 1)
    )
    stiffness = np.array([*k, 1e6, *turning, 1e3])
    springs = ff.forces.Bushing("springs", ff.Marker(ff.GROUND), ff.Marker("housing"), stiffness)
    motion = ff.analyses.steady_motion(ff.System([rotor, housing], [bearing], [springs]), "housing", 0.0)
    assert motion.spins == {"rotor": spin}
    # x, y of the housing, its rotations a about x and b about y; the rotor is at (x + arm b, y - arm a)
    M = np.diag([m + 2, m + 2, I_t + 0.01 + m * arm**2, I_t + 0.01 + m * arm**2])
    M[0, 3] = M[3, 0] = m * arm
    M[1, 2] = M[2, 1] = -m * arm
    gyro = np.zeros((4, 4))
    gyro[2, 3], gyro[3, 2] = I_p * spin, -I_p * spin
    K = np.diag([*k, *turning])
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, K), -np.linalg.solve(M, gyro)]])
    expected = np.sort(np.abs(np.linalg.eigvals(A).imag))[::2]
    found = eigenvalues(motion)
    assert_allclose([np.abs(found.imag - each).min() for each in expected], 0, atol=1e-7 * expected.max())
    assert np.abs(found.real).max() < 1e-6 * expected.max()


# cars ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sigma", [0.0, 0.5])
@pytest.mark.parametrize("V", [10.0, 25.0])
def test_a_car_straight_on_has_the_eigenvalues_of_the_single_track_model(sigma, V):
    """Wheels spin on their axles; with relaxation lengths 0 (two eigenvalues) and not (four)."""
    car = Car(sigma=sigma)
    found = eigenvalues(ff.analyses.steady_motion(car.system(V), "chassis"))
    expected = np.linalg.eigvals(car.matrix(V))
    apart = [np.abs(found - each).min() / abs(each) for each in upper(expected)]
    assert_allclose(apart, 0, atol=1e-3)  # wheels of 0.1 kg


CURVE, SPEED = Car(), 15.0


def pushed(steer, push):
    """Return the car with a force ahead at its centre of mass."""
    system = CURVE.system(SPEED, steer=steer)
    force = ff.PointForce("push", ff.Marker("chassis"), force=np.array([push, 0, 0]), is_follower=True)
    return replace(system, forces=[*system.forces, force])


def turning_rates(x, steer, push):
    """Return the rates of (v_x, v_y, r) of a plane car on four free wheels: F = -C v_across/v_ahead of each wheel."""
    car, (v_x, v_y, r) = CURVE, x
    F_x, F_y, M = push, 0.0, 0.0
    for place, C, delta in ((car.a, car.C_f, steer), (-car.b, car.C_r, 0.0)):
        for y in (HALF_TRACK, -HALF_TRACK):
            u, v = v_x - r * y, v_y + r * place
            ahead, across = u * np.cos(delta) + v * np.sin(delta), v * np.cos(delta) - u * np.sin(delta)
            F = -C / 2 * across / ahead
            f_x, f_y = -F * np.sin(delta), F * np.cos(delta)
            F_x, F_y, M = F_x + f_x, F_y + f_y, M + place * f_y - y * f_x
    return np.array([F_x / car.m + r * v_y, F_y / car.m - r * v_x, M / car.I_z])


@pytest.fixture(scope="module")
def curve():
    """Return the car in a curve of 60 m, its steer angle and push found."""
    return ff.analyses.steady_motion(pushed, "chassis", curvature=1 / 60, unknown={"steer": 0.04, "push": 10.0})


def test_a_car_in_a_steady_curve_is_trimmed_as_a_plane_one(curve):
    def open_rates(p):
        drift, steer, push = p
        x = [SPEED * np.cos(drift), SPEED * np.sin(drift), SPEED / 60]
        return turning_rates(x, steer, push * 1e3) * [1, 1, 1]

    drift, steer, push = fsolve(open_rates, [0.0, 0.04, 0.0], xtol=1e-12)
    assert_allclose([curve.found["steer"], curve.found["push"]], [steer, 1e3 * push], rtol=3e-4)
    w, _, _, z = curve.equilibrium.state.p[0]
    assert_allclose(-2 * np.arctan2(z, w), drift, rtol=1e-3)
    assert_allclose(curve.spins["fl"] * (0.3 - 0.01 / 3), SPEED * (1 - HALF_TRACK / 60), rtol=3e-3)


def test_a_car_in_a_steady_curve_has_the_eigenvalues_of_a_plane_one(curve):
    """Among them -0.0195, the speed; and those of every circle: 0 and, for a circle elsewhere, ± i Omega."""
    w, _, _, z = curve.equilibrium.state.p[0]
    drift = -2 * np.arctan2(z, w)
    x, h = np.array([SPEED * np.cos(drift), SPEED * np.sin(drift), SPEED / 60]), 1e-20
    A = np.stack(
        [turning_rates(x + 1j * h * e, curve.found["steer"], curve.found["push"]).imag / h for e in np.eye(3)], axis=1
    )
    found, expected = eigenvalues(curve), np.linalg.eigvals(A)
    apart = [np.abs(found - each).min() / abs(each) for each in upper(expected)]
    assert_allclose(apart, 0, atol=2e-3)
    assert np.abs(found - 1j * SPEED / 60).min() < 1e-9
    assert np.abs(found.real).min() == pytest.approx(0, abs=1e-9)


def test_with_the_steer_angle_given_the_curvature_is_found(curve):
    steer = curve.found["steer"]
    again = ff.analyses.steady_motion(
        lambda push: pushed(steer, push), "chassis", curvature=None, unknown={"push": 0.0}
    )
    assert_allclose(again.curvature, 1 / 60, rtol=1e-9)
    assert_allclose(again.found["push"], curve.found["push"], rtol=1e-6)


def test_a_small_disturbance_of_the_curve_moves_with_the_eigenvalues(curve):
    """Second road: the motion itself after a small side force begins to act, its yaw rate a sum of the slow modes."""
    side = ff.PointForce("side", ff.Marker("chassis"), force=(0, 10.0, 0), torque=(0, 0, 10.0), is_follower=True)
    blown = replace(curve.system, forces=[*curve.system.forces, side])
    motion = ff.integrate(blown, ff.GeneralizedAlpha(0.9, 1e-10), 0.6, 2e-3, state=curve.equilibrium.state)
    rate = motion.body("chassis").omega_B[:, 2] - SPEED / 60
    slow = eigenvalues(curve)
    slow = slow[(np.abs(slow) > 1e-6) & (np.abs(slow) < 15) & (np.abs(slow - 1j * SPEED / 60) > 1e-6)]

    def misfit(eigenvalues):
        waves = np.exp(np.outer(motion.t, [0.0, *eigenvalues]))
        basis = np.hstack([waves.real, waves.imag])
        rest = rate - basis @ np.linalg.lstsq(basis, rate, rcond=None)[0]
        return np.abs(rest[10:]).max() / np.abs(rate).max()

    assert misfit(slow) < 1e-5 < 0.2 * misfit(1.02 * slow)


# what is not steady -------------------------------------------------------------------------------------------------


def test_what_is_not_steady_is_told():
    car = Car()
    system = car.system(20.0)
    bodies = [replace(b, inertia=np.diag([1e-4, 1e-4, 1.2e-4])) if b.name == "fl" else b for b in system.bodies]
    oval = ff.analyses.steady_motion(replace(system, bodies=bodies), "chassis")
    with pytest.raises(
        ff.errors.ModelError, match="not steady: body 'fl' spins about an axis about which its mass is not"
    ):
        eigenvalues(oval)
    about = ff.analyses.steady_motion(system, "chassis").equilibrium
    u = about.state.u.copy()
    u[1] += 0.1
    with pytest.raises(ff.errors.ModelError, match=r"not steady: body 'chassis' moves at 0\.1 relative to the others"):
        ff.linearize(system, replace(about, state=replace(about.state, u=u.ravel())), inputs=(), outputs=())
    braked = replace(system, forces=[*system.forces, ff.PointForce("f", ff.Marker("chassis"), force=(-500.0, 0, 0))])
    with pytest.raises(ff.errors.ModelError, match=r"not steady: forces are unbalanced by .* of the acting forces"):
        ff.linearize(braked, about, inputs=(), outputs=())
    with pytest.raises(
        ff.errors.ConvergenceError, match=r"cannot run steadily with these values; make a parameter unknown"
    ):
        ff.analyses.steady_motion(braked, "chassis")
    ahead = wheels.profile_road([-20.0, 1.2, 1.3, 3.0, 20.0], [0.0, 0.0, 0.01, 0.3, 0.3])
    ramp = replace(system, elements=[replace(each, road=ahead) for each in system.elements])
    with pytest.raises(ff.errors.ModelError, match=r"not steady: 0\.0183 time units later, forces are unbalanced"):
        eigenvalues(ff.analyses.steady_motion(ramp, "chassis"))


def test_bad_questions_are_answered_by_one_message():
    system = Car().system(20.0)
    with pytest.raises(ff.errors.ModelError, match=r"no body 'chasis'.*'chassis'"):
        ff.analyses.steady_motion(system, "chasis")
    with pytest.raises(ff.errors.ModelError, match="expected a function that returns the system"):
        ff.analyses.steady_motion(system, "chassis", unknown={"steer": 0.1})
    with pytest.raises(ff.errors.ModelError, match="speed: expected a number of 0 or more"):
        ff.analyses.steady_motion(system, "chassis", -3.0)
    with pytest.raises(ff.errors.ModelError, match="1/curvature"):
        ff.analyses.steady_motion(system, "chassis", curvature=0.1, center=(0, 50, 0))
    still = replace(system, bodies=[replace(b, velocity=(0, 0, 0)) for b in system.bodies])
    with pytest.raises(ff.errors.ModelError, match="placed without a velocity"):
        ff.analyses.steady_motion(still, "chassis", 10.0)
