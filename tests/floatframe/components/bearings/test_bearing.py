"""Bearings by coefficients: Jeffcott rotors in closed form, the limit of cross terms, gyroscopic tilt, free spin."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, GeneralizedAlpha, Marker, RigidBody, System, integrate, linearize, read_system
from floatframe.components.bearings import Bearing
from floatframe.errors import ModelError
from floatframe.integrators import RelativeGeneralizedAlpha
from floatframe.joints import PlanarJoint
from floatframe.model.rotations import euler_parameters, rotation_exp
from floatframe.results import element_motion
from tests.floatframe.element_laws import power_defect
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.laws.contacts import FORMS

A = rotation_exp(np.array([0.4, -0.7, 0.3]))  #: axes of the housing
PLACE = np.array([3.0, -2.0, 5.0])
M, K, D = 10.0, 1e5, 200.0
ACROSS, ALONG = 0.1, 0.18  #: moments of inertia
K_T, D_T = 400.0, 2.0
WHIRL_ERROR = 2e-8  #: error of the trapezoidal rule, z_0 (omega h)²/12 omega t = 1e-8, twice
#: all others take the bearing in tests/floatframe/engine/structure_preserving
METHODS = {
    "absolute": GeneralizedAlpha(0.95, 1e-11),
    "relative": RelativeGeneralizedAlpha(0.95, 1e-11),
}


def cross(q, k=K):
    """Return k with cross terms q, which push a whirl forward."""
    return np.array([[k, q], [-q, k]])


def rotor(speed, q=0.0, damping=D, *, off=1e-4, omega=(0, 0), length=1.0, mass=1.0, joints=(), **more):
    """Return a disc in its bearing, off its middle along x, that spins; length, mass: units by m and kg."""
    inertia = np.diag([ACROSS, ACROSS, ALONG]) / (mass * length**2)
    body = RigidBody("rotor", M / mass, inertia, position=(PLACE + off * A[:, 0]) / length,
                     orientation=euler_parameters(A), omega_B=(*omega, speed))  # fmt: skip
    numbers = {"axial_stiffness": K, "axial_damping": D, "tilt_stiffness": K_T, "tilt_damping": D_T} | more
    for name in numbers:
        numbers[name] /= mass * (length**2 if name.startswith("tilt") else 1.0)
    housing = Marker(GROUND, position=PLACE / length, triad=A)
    bearing = Bearing("bearing", housing, Marker("rotor"), cross(q) / mass, np.array(damping) / mass, **numbers)
    return System([body], joints, elements=[bearing])


def whirl(t, q, damping=D, z_0=1e-4, m=M, k=K, spin=0.0):
    """Return z = x + i y of m z'' + (d - i spin) z' + (k - i q) z = 0 that starts at rest off its middle."""
    a, b = np.roots([m, damping - 1j * spin, k - 1j * q])
    return z_0 * (b * np.exp(a * t) - a * np.exp(b * t)) / (b - a)


@pytest.mark.parametrize("name", METHODS)
def test_a_rotor_whirls_in_cross_terms_as_the_closed_form(name):
    system = rotor(300.0, 2e4)
    motion = integrate(system, METHODS[name], 0.03, 2e-4)
    x, y, axial = ((motion.body("rotor").r - PLACE) @ A).T
    z = whirl(motion.t, 2e4)
    assert np.abs(z.imag).max() > 1e-5
    assert_allclose(x + 1j * y, z, rtol=0, atol=WHIRL_ERROR)
    assert_allclose(axial, 0.0, rtol=0, atol=1e-12)
    seen = element_motion(system, motion, "bearing").outputs
    assert_allclose(seen["x"] + 1j * seen["y"], x + 1j * y, rtol=0, atol=1e-12)


def test_a_rotor_is_the_same_in_millimetres_and_tonnes():
    motion = integrate(rotor(300.0, 2e4, length=1e-3, mass=1e3), METHODS["absolute"], 0.03, 2e-4)
    x, y, _ = ((motion.body("rotor").r * 1e-3 - PLACE) @ A).T
    assert_allclose(x + 1j * y, whirl(motion.t, 2e4), rtol=0, atol=WHIRL_ERROR)


@pytest.mark.parametrize("part", [0.9, 1.1])
def test_cross_terms_drive_a_whirl_once_they_exceed_damping_times_frequency(part):
    """q < d sqrt(k/m); eigenvalues of the disc in its plane are the roots of both directions of whirl."""
    q = part * D * np.sqrt(K / M)
    plane = PlanarJoint("plane", GROUND, Marker("rotor"), axis=A[:, 2])
    linear = linearize(rotor(0.0, q, off=0.0, tilt_stiffness=0.0, tilt_damping=0.0, joints=[plane]))
    found = np.linalg.eigvals(linear.state_space().A)
    found = found[np.abs(found) > 1.0]
    wanted = np.concatenate([np.roots([M, D, K - 1j * q]), np.roots([M, D, K + 1j * q])])
    assert (wanted.real.max() > 0) == (part > 1)
    for each in wanted[wanted.imag > 0]:
        assert np.abs(found - each).min() < 1e-6 * abs(each)


def test_a_shaft_that_spins_tilts_as_a_gyroscope_in_its_bearing():
    """A z'' + (d_t - i C W) z' + k_t z = 0 of the tilt z; damping that saw the spin would push the shaft aside."""
    speed, rate = 50.0, 0.01
    system = rotor(speed, off=0.0, omega=(rate, 0.0))
    motion = integrate(system, METHODS["absolute"], 0.1, 2e-4)
    seen = element_motion(system, motion, "bearing").outputs
    a, b = np.roots([ACROSS, D_T - 1j * ALONG * speed, K_T])
    z = rate * (np.exp(a * motion.t) - np.exp(b * motion.t)) / (a - b)
    assert_allclose(seen["tilt x"] + 1j * seen["tilt y"], z, rtol=0, atol=3e-4 * np.abs(z).max())


def test_a_shaft_spins_freely_however_it_tilts():
    system = rotor(50.0, 2e4, omega=(6.0, -3.0))
    motion = integrate(system, METHODS["absolute"], 0.1, 2e-4)
    seen = element_motion(system, motion, "bearing").outputs
    assert np.hypot(seen["tilt x"], seen["tilt y"]).max() > 0.05
    assert_allclose(motion.body("rotor").omega_B[:, 2], 50.0, rtol=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_energy_goes_where_it_says_and_forces_balance(seed):
    form = FORMS["bearing"]
    law, state = form.law(), form.states[seed]
    defect, throughput = power_defect(law, state.t, state.x, np.zeros(0))
    assert abs(defect) < 1e-10 * throughput
    wrench = np.zeros((2, 6))
    law.function.py_func(0.0, state.x, np.zeros(0), np.zeros(0), law.data, wrench, np.zeros(0), np.zeros(0),
                         np.zeros(len(law.outputs)))  # fmt: skip
    about = wrench[:, 3:] + np.cross(state.x[:, :3], wrench[:, :3])
    assert_allclose(wrench[:, :3].sum(axis=0), 0.0, rtol=0, atol=1e-12 * np.abs(wrench).max())
    assert_allclose(about.sum(axis=0), 0.0, rtol=0, atol=1e-12 * np.abs(about).max())
    shaft = state.x[1, 3:12].reshape(3, 3) @ form.element.shaft_axis
    assert abs(shaft @ wrench[1, 3:]) < 1e-12 * np.linalg.norm(wrench[1, 3:])


def test_tangent_is_that_of_the_law():
    system = rotor(5.0, 2e4, [[D, 30.0], [20.0, 90.0]], omega=(0.3, 0.2), off=0.05)
    box = RigidBody("box", 20.0, np.diag([1.0, 2.0, 3.0]), position=PLACE - [0.3, 0.2, 0.1], omega_B=(0.1, -0.2, 0.3))
    rotor_in_box = Bearing("bearing", Marker("box", position=(0.3, 0.2, 0.1), triad=A), Marker("rotor"),
                           system.elements[0].stiffness, system.elements[0].damping, K, D, K_T, D_T)  # fmt: skip
    assert_tangent_is_exact(System([*system.bodies, box], elements=[rotor_in_box]))


def test_a_system_file_names_it(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(
        """
        [system]
        units = "m-kg-s"
        [bodies.rotor]
        mass = 2.0
        inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        position = [0, 0, 0]
        [elements.bearing]
        type = "bearings.bearing"
        marker_a = {body = "ground", marker = [0, 0, 0]}
        marker_b = {body = "rotor", marker = [0, 0, 0]}
        axis = [0, 1, 0]
        stiffness = [[2e6, 3e5], [-3e5, 1e6]]
        damping = 400.0
        tilt_stiffness = 5.0
        """
    )
    bearing = read_system(path)[0].elements[0]
    assert isinstance(bearing, Bearing)
    assert_allclose(bearing.stiffness, [[2e6, 3e5], [-3e5, 1e6]])
    assert_allclose(bearing.damping, 400.0 * np.eye(2))
    assert_allclose(bearing.x_axis, [0, 0, 1])  # x of axis z, y of axis x, z of axis y


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"stiffness": np.eye(3)}, r"stiffness: expected"),
        ({"stiffness": 0.0}, "other than zero, got none"),
        ({"axial_stiffness": -1.0}, "axial_stiffness: expected"),
        ({"axis": (1, 0, 0), "x_axis": (2, 0, 0)}, "not parallel to the axis, got a parallel one"),
        ({"marker_b": 3}, "marker_b: expected a Marker"),
    ],
)
def test_what_does_not_fit_is_refused(numbers, words):
    with pytest.raises(ModelError, match=words):
        Bearing(**({"name": "b", "marker_a": Marker(GROUND), "marker_b": Marker("rotor"), "stiffness": K} | numbers))


def test_a_shaft_that_points_elsewhere_is_refused():
    bearing = Bearing("b", Marker(GROUND), Marker("rotor"), K, shaft_axis=(0, 1, 0))
    system = System([RigidBody("rotor", 1.0, np.eye(3))], elements=[bearing])
    with pytest.raises(ModelError, match="at most 60° between shaft and bearing at assembly, got 90°"):
        integrate(system, METHODS["absolute"], 1e-3, 1e-3)
