"""Rigid bodies against published values and against solutions by other means."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import ellipj, ellipkinc

import cms
import fe_models as fm
from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SpringDamper,
    System,
    integrate,
    linearize,
    static_equilibrium,
    system_modes,
)
from floatframe.components.mechanisms import satellite
from floatframe.joints import JointCoordinate
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp
from floatframe.results.energy_balance import energy_scale
from floatframe.results.place_motion import point_motion
from tests.floatframe.orders import slope

METHOD = GeneralizedAlpha(0.9, 1e-11)


def test_body_turns_over_about_its_middle_axis_as_the_elliptic_functions_say():
    """Landau & Lifshitz, Mechanics, §37: free asymmetric top with M² > 2 E I_2."""
    I1, I2, I3 = 0.5, 1.0, 1.4
    omega = np.array([0.02, 2.0, 0.03])  # about the middle axis, nearly
    E2 = I1 * omega[0] ** 2 + I2 * omega[1] ** 2 + I3 * omega[2] ** 2
    M2 = (I1 * omega[0]) ** 2 + (I2 * omega[1]) ** 2 + (I3 * omega[2]) ** 2
    assert M2 > E2 * I2
    a = np.sqrt((E2 * I3 - M2) / (I1 * (I3 - I1)))
    b = np.sqrt((E2 * I3 - M2) / (I2 * (I3 - I2)))
    c = np.sqrt((M2 - E2 * I1) / (I3 * (I3 - I1)))
    rate = np.sqrt((I3 - I2) * (M2 - E2 * I1) / (I1 * I2 * I3))
    m = (I2 - I1) * (E2 * I3 - M2) / ((I3 - I2) * (M2 - E2 * I1))
    start = ellipkinc(np.arctan2(omega[1] / b, omega[0] / a), m)

    body = RigidBody("racket", 1.0, np.diag([I1, I2, I3]), omega_B=omega)
    steps, errors = np.array([8e-3, 4e-3, 2e-3]), []
    for h in steps:
        motion = integrate(System([body]), METHOD, 12.0, h).body("racket")
        sn, cn, dn, _ = ellipj(start + rate * motion.t, m)
        errors.append(np.abs(motion.omega_B - np.stack([a * cn, b * sn, c * dn], axis=1)).max())
    assert motion.omega_B[:, 1].min() < -1.99 < 1.99 < motion.omega_B[:, 1].max()  # it turned over
    assert errors[-1] < 2e-3
    assert abs(slope(steps, errors) - 2) < 0.15


ANGLES = {
    "beta": -0.0617138900142764496358948458001,
    "theta": 0.0,
    "gamma": 0.455279819163070380255912382449,
    "phi": 0.222668390165885884674473185609,
    "delta": 0.487364979543842550225598953530,
    "omega": -0.222668390165885884674473185609,
    "epsilon": 1.23054744454982119249735015568,
}  #: of the squeezer at the start


class Squeezer:
    """Andrews' squeezing mechanism: Hairer & Wanner, Solving ODEs II, VII.7; Test Set for IVP Solvers."""

    #: beta, gamma, delta, epsilon at t = 0.03, and their rates
    end = np.array([15.81077119629904, 0.04082224013073101, 0.5244099658805304, 1.048080741042263])
    end_rates = np.array([1139.920302151208, 11.03291221937134, 0.5735699284790808, 0.3231791658026955])

    @staticmethod
    def system() -> System:
        q = ANGLES
        A, B = np.array([-0.06934, -0.00227, 0]), np.array([-0.03635, 0.03273, 0])
        C = np.array([0.014, 0.072, 0])

        def along(angle):
            return np.array([np.cos(angle), np.sin(angle), 0.0])

        def across(angle):  # the direction called gamma, epsilon in the source
            return np.array([np.sin(angle), -np.cos(angle), 0.0])

        def arm(name, mass, inertia, origin, angle, center):
            J = np.diag([inertia / 2, inertia / 2, inertia])
            turned = euler_parameters_of_rotation_vector(np.array([0, 0, angle]))
            return RigidBody(name, mass, J, center_of_mass=center, position=origin, orientation=turned)

        F = 0.007 * along(q["beta"])
        H = A + 0.04 * along(q["delta"])
        G = A + 0.04 * across(q["epsilon"])
        E = F - 0.028 * along(q["beta"] + q["theta"])
        assert_allclose(B + 0.035 * across(q["gamma"]), E, atol=1e-15)
        assert_allclose(H + 0.02 * across(q["phi"] + q["delta"]), E, atol=1e-15)
        assert_allclose(G + 0.02 * along(q["omega"] + q["epsilon"]), E, atol=1e-15)
        x, y = np.eye(3)[:2]
        bodies = [
            arm("K1", 0.04325, 2.194e-6, np.zeros(3), q["beta"], 92e-5 * x),
            arm("K2", 0.00365, 4.410e-7, F, q["beta"] + q["theta"], -115e-4 * x),
            arm("K3", 0.02373, 5.255e-6, B, q["gamma"], 1874e-5 * x + 1043e-5 * y),
            arm("K4", 0.00706, 5.667e-7, H, q["phi"] + q["delta"], -(2e-2 - 1421e-5) * y),
            arm("K5", 0.07050, 1.169e-5, A, q["delta"], 2308e-5 * x + 916e-5 * y),
            arm("K6", 0.00706, 5.667e-7, G, q["omega"] + q["epsilon"], (2e-2 - 1421e-5) * x),
            arm("K7", 0.05498, 1.912e-5, A, q["epsilon"], 1228e-5 * x - 449e-5 * y),
        ]
        joints = [
            RevoluteJoint("O", GROUND, Marker("K1")),
            RevoluteJoint("F", Marker("K1", position=0.007 * x), Marker("K2")),
            RevoluteJoint("B", Marker(GROUND.name, position=B), Marker("K3")),
            RevoluteJoint("A5", Marker(GROUND.name, position=A), Marker("K5")),
            RevoluteJoint("A7", Marker(GROUND.name, position=A), Marker("K7")),
            RevoluteJoint("H", Marker("K5", position=0.04 * x), Marker("K4")),
            RevoluteJoint("G", Marker("K7", position=-0.04 * y), Marker("K6")),
            RevoluteJoint("E3", Marker("K2", position=-0.028 * x), Marker("K3", position=-0.035 * y)),
            RevoluteJoint("E4", Marker("K2", position=-0.028 * x), Marker("K4", position=-0.02 * y)),
            RevoluteJoint("E6", Marker("K2", position=-0.028 * x), Marker("K6", position=0.02 * x)),
        ]
        D = Marker("K3", position=0.02 * x - 0.018 * y)
        spring = SpringDamper("spring", Marker(GROUND.name, position=C), D, stiffness=4530.0, free_length=0.07785)
        motor = PointForce("motor", Marker("K1"), torque=(0, 0, 0.033))
        return System(bodies, joints, [spring, motor], name="squeezer", redundant="minimum-norm")


def test_andrews_squeezer_comes_to_the_published_values():
    system = Squeezer.system()
    joints = ("O", "B", "A5", "A7")
    start = np.array([ANGLES[name] for name in ("beta", "gamma", "delta", "epsilon")])
    steps, errors, rate_errors = np.array([2e-5, 1e-5, 5e-6]), [], []
    for h in steps:
        motion = integrate(system, METHOD, 0.03, h)
        turned = [JointCoordinate(name, "angle").measure(system, motion) for name in joints]
        errors.append(np.abs(start + [c.value[-1] for c in turned] - Squeezer.end) / np.abs(Squeezer.end))
        rate_errors.append(np.abs([c.rate[-1] for c in turned] - Squeezer.end_rates) / np.abs(Squeezer.end_rates))
    assert np.max(errors[-1]) < 2e-3
    assert np.max(rate_errors[-1]) < 2e-2
    assert abs(slope(steps, np.max(errors, axis=1)) - 2) < 0.2


class Bricard:
    """Six hinged rods along edges of a cube, one of them the ground; every hinge is across its two rods."""

    points = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]], dtype=float)
    axes = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=float)

    @staticmethod
    def system() -> System:
        points, bodies, joints = Bricard.points, [], []
        for k in range(5):
            rod = points[k + 1] - points[k]
            inertia = (np.eye(3) - (1 - 1e-6) * np.outer(rod, rod)) / 12
            bodies.append(RigidBody(f"rod{k}", 1.0, inertia, center_of_mass=rod / 2, position=points[k]))
        for k in range(6):
            a = GROUND if k == 0 else Marker(f"rod{k - 1}", position=points[k] - points[k - 1])
            b = Marker(GROUND.name, position=points[5]) if k == 5 else Marker(f"rod{k}")
            joints.append(RevoluteJoint(f"hinge{k}", a, b, axis=Bricard.axes[k]))
        return System(bodies, joints, [Gravity((0, -9.81, 0))], name="Bricard", redundant="minimum-norm")

    @staticmethod
    def chain(angles) -> tuple[np.ndarray, np.ndarray]:
        """Points A to F by the five first hinge angles, and the gap of the loop, (18,)."""
        R, places = np.eye(3), [Bricard.points[0]]
        for k in range(5):
            R = R @ rotation_exp(angles[k] * Bricard.axes[k])
            places.append(places[-1] + R @ (Bricard.points[k + 1] - Bricard.points[k]))
        R = R @ rotation_exp(angles[5] * Bricard.axes[5])
        return np.array(places), np.concatenate([places[5] - Bricard.points[5], (R - np.eye(3)).ravel()])

    @staticmethod
    def by_first_angle(first: np.ndarray) -> np.ndarray:
        """Points of the closed loop for each angle a of the first hinge, (n, 6, 3), going on from the cube.

        The linkage keeps its threefold symmetry: the angles are (a, b, a, b, a, b).
        """
        b, result = 0.0, []
        for a in first:
            for _ in range(30):
                gap, ahead = (Bricard.chain(np.array([a, b + d] * 3))[1] for d in (0.0, 1e-7))
                slope = (ahead - gap) / 1e-7
                step = -(slope @ gap) / (slope @ slope)
                b += step
                if abs(step) < 1e-12:
                    break
            places, gap = Bricard.chain(np.array([a, b] * 3))
            assert np.abs(gap).max() < 1e-10
            result.append(places)
        return np.array(result)


def test_bricard_mechanism_moves_as_its_energy_in_one_angle_says():
    """A thin rod between points a, b has m/6 (a'·a' + a'·b' + b'·b') of kinetic energy."""
    grid = np.linspace(0.0, 2.95, 400)
    places = CubicSpline(grid, Bricard.by_first_angle(grid))
    tangent = places(grid, 1)
    a, b = tangent[:, :-1], tangent[:, 1:]
    mass = CubicSpline(grid, ((a * a + a * b + b * b).sum(axis=2) / 3).sum(axis=1))
    height = places(grid)[:, :, 1]
    potential = CubicSpline(grid, 9.81 * (height[:, :-1] + height[:, 1:]).sum(axis=1) / 2)

    def rate(t, y):
        phi, dphi = y
        return [dphi, (-0.5 * mass(phi, 1) * dphi**2 - potential(phi, 1)) / mass(phi)]

    t_end = 1.9
    exact = solve_ivp(rate, (0, t_end), [0.0, 0.0], rtol=1e-10, atol=1e-12, dense_output=True)
    assert exact.y[0].max() < grid[-1]
    system = Bricard.system()
    steps, errors = np.array([4e-3, 2e-3, 1e-3]), []
    for h in steps:
        motion = integrate(system, METHOD, t_end, h)
        found = JointCoordinate("hinge0", "angle").measure(system, motion)
        errors.append(np.abs(found.value - exact.sol(motion.t)[0]).max())
    corner = point_motion(motion, "rod2", (0, 0, 1)).position
    assert_allclose(corner, places(exact.sol(motion.t)[0])[:, 3], rtol=0, atol=1e-4)
    assert found.value[-1] > 2.5
    assert errors[-1] < 1e-4
    assert abs(slope(steps, errors) - 2) < 0.2
    energies = motion.energies
    assert np.abs(energies.total - energies.total[0]).max() < 1e-4 * energy_scale(motion)


def test_bricard_mechanism_moves_at_any_step():
    """Rods with a millionth of their moment about their own axis: reactions of least norm stand above rounding."""
    system = Bricard.system()
    for n_steps in (475, 479, 484, 488, 493):
        plain = integrate(system, replace(METHOD, stabilized=False), 1.9, 1.9 / n_steps)
        assert plain.head.summary["n_iterations"] < 5 * n_steps
        motion = integrate(system, METHOD, 1.9, 1.9 / n_steps)
        assert motion.head.summary["n_iterations"] < 7 * n_steps  # held velocities converge slowly here: 6.4 a step


def boom(length, radius, material):
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), 40)
    ends = [fm.beams.line_interface(mesh, name, fm.selections.NodeSet(name)) for name in ("start", "end")]
    section = fm.beams.BeamProperty(fm.beams.Circle(radius), material, shear=False, rotary_inertia=False)
    body = cms.couple(fm.beam_body(mesh, section, name="boom", units=cms.unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=60))


def test_hub_with_two_booms_has_the_roots_of_its_characteristic_equations():
    """Euler-Bernoulli booms, y'''' = beta⁴ y of the whole deflection y, free at the tip.

    Turning hub:  y(0) = R theta, y'(0) = theta,  -omega² J theta = 2 E I (y''(0) - R y'''(0))
    Moving hub:   y(0) = Y, y'(0) = 0,            -omega² M Y = -2 E I y'''(0)
    """
    L, radius, hub_mass, R = 5.0, 0.02, 20.0, 0.4
    material = fm.Material("boom", E=7e10, nu=0.3, rho=2700.0)
    EI, mu = material.E * np.pi * radius**4 / 4, material.rho * np.pi * radius**2
    J = 0.4 * hub_mass * R**2

    def deflection(beta, y0, slope0):
        """y''(0) and y'''(0) of the beam free at L, with y = sum of c (cosh, sinh, cos, sin) beta x."""
        ch, sh, co, si = np.cosh(beta * L), np.sinh(beta * L), np.cos(beta * L), np.sin(beta * L)
        A = np.array([[1, 0, 1, 0], [0, beta, 0, beta], [ch, sh, -co, -si], [sh, ch, si, -co]])
        c = np.linalg.solve(A, [y0, slope0, 0, 0])
        return beta**2 * (c[0] - c[2]), beta**3 * (c[1] - c[3])

    def turning(beta):
        bend, shear = deflection(beta, R, 1.0)
        return EI * beta**4 / mu * J + 2 * EI * (bend - R * shear)

    def moving(beta):
        _, shear = deflection(beta, 1.0, 0.0)
        return EI * beta**4 / mu * hub_mass - 2 * EI * shear

    def roots(f):
        betas = np.linspace(0.5, 14, 4000) / L
        values = np.array([f(beta) for beta in betas])
        change = np.flatnonzero(values[:-1] * values[1:] < 0)
        found = np.array([brentq(f, betas[k], betas[k + 1], xtol=1e-14) for k in change])
        keep = np.array([abs(f(beta)) < 1e-3 * np.abs(values[k : k + 2]).max() for beta, k in zip(found, change)])  # noqa: B905
        return found[keep]  # not the poles

    system = satellite(
        hub_mass=hub_mass, hub_radius=R, boom_length=L, boom_mass=1.0, boom=boom(L, radius, material)
    )  # fmt: skip
    found = system_modes(linearize(system, static_equilibrium(system))).natural_frequencies
    for f, at_least in ((turning, 3), (moving, 3)):
        exact = np.sqrt(EI / mu) * roots(f) ** 2 / (2 * np.pi)
        assert len(exact) >= at_least
        for frequency in exact[:3]:
            near = np.sort(np.abs(found / frequency - 1))[:2]  # in both planes
            assert_allclose(near, 0, rtol=0, atol=1e-5)  # of 40 elements
