"""Bushings in the axes of one of their ends: rotors in damped bearings, and torsion through full turns."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, GeneralizedAlpha, Marker, RevoluteJoint, RigidBody, System, integrate
from floatframe.forces import Bushing
from floatframe.integrators import (
    EnergyDecaying,
    EnergyMomentum,
    Ida,
    RelativeGeneralizedAlpha,
    RelativeOde,
    Variational,
)
from floatframe.joints import PlanarJoint
from floatframe.model.rotations import euler_parameters, rotation_exp
from floatframe.sensors import BushingSensor, measured
from floatframe.simulation import Event

A = rotation_exp(np.array([0.4, -0.7, 0.3]))  #: axes of the bearing; the rotor spins about the third
PLACE = np.array([3.0, -2.0, 5.0])
M, K, D = 10.0, 1e5, 200.0  #: of a rotor in damped bearings

METHODS = {
    "absolute": GeneralizedAlpha(0.95, 1e-11),
    "relative": RelativeGeneralizedAlpha(0.95, 1e-11),
    "conserving": EnergyMomentum(),
    "decaying": EnergyDecaying(),
    "variational": Variational(),
    "ida": Ida(),
    "ode": RelativeOde("DOP853"),
}


def rotor(speed, axes="a", length=1.0, mass=1.0, **law):
    """Return a disc in its bearing, off its centre by 0.1 mm along the first axis, and its second body at rest.

    length, mass: of the units of the system, by m and kg.
    """
    inertia = np.diag([0.1, 0.1, 0.2]) / (mass * length**2)
    place = (PLACE + 1e-4 * A[:, 0]) / length
    body = RigidBody("rotor", M / mass, inertia, position=place, orientation=euler_parameters(A), omega_B=(0, 0, speed))
    bearing = Marker(GROUND, position=PLACE / length, triad=A)
    law = law or {"stiffness": np.diag([K, K, 0, 0, 0, 0]), "damping": np.diag([D, D, 0, 0, 0, 0])}
    law = {name: matrix / mass for name, matrix in law.items()}
    return System([body], [PlanarJoint("plane", GROUND, Marker("rotor"), axis=A[:, 2])],
                  [Bushing("bearing", bearing, Marker("rotor"), axes=axes, **law)])  # fmt: skip


def decaying(t):
    """Return 0.1 mm of a damped oscillator that starts at rest."""
    lam = -D / (2 * M) + 1j * np.sqrt(K / M - (D / (2 * M)) ** 2)
    return 1e-4 * np.real((1 + 1j * lam.real / lam.imag) * np.exp(lam * t))


@pytest.mark.parametrize("speed", [0.0, 60.0, 300.0, -2000.0])
@pytest.mark.parametrize("name", ["absolute", "relative"])
def test_a_rotor_in_damped_bearings_moves_as_if_it_did_not_spin(speed, name):
    h = 2e-4 if abs(speed) < 1000 else 1e-4
    motion = integrate(rotor(speed), METHODS[name], 0.1, h)
    found = (motion.body("rotor").r - PLACE) @ A
    assert_allclose(found[:, 0], decaying(motion.t), rtol=0, atol=1e-7)
    assert_allclose(found[:, 1:], 0.0, rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ["conserving", "decaying", "variational", "ida", "ode"])
def test_every_scheme_knows_the_axes(name):
    motion = integrate(rotor(300.0), METHODS[name], 0.02, 2e-4)
    found = (motion.body("rotor").r - PLACE) @ A
    assert_allclose(found[:, 0], decaying(motion.t), rtol=0, atol=2e-7)
    assert_allclose(found[:, 1:], 0.0, rtol=0, atol=2e-7)


def test_a_rotor_is_the_same_in_millimetres_and_tonnes():
    motion = integrate(rotor(300.0, length=1e-3, mass=1e3), METHODS["absolute"], 0.1, 2e-4)
    found = (motion.body("rotor").r * 1e-3 - PLACE) @ A
    assert_allclose(found[:, 0], decaying(motion.t), rtol=0, atol=1e-7)


@pytest.mark.parametrize(("axes", "growth"), [("a", -10.0), ("half way", 4.9), ("b", 19.0)])
def test_a_damper_in_axes_that_turn_with_the_rotor_drives_it(axes, growth):
    """m z'' + d (z' - i s W z) + k z = 0 of z = x + i y where axes turn with s W: the forward whirl at W = 300 grows.

    s: 0 in axes of the ground, 1/2 half way, 1 in those of the rotor. growth: of the whirl, from the quadratic.
    """
    share = {"a": 0.0, "half way": 0.5, "b": 1.0}[axes]
    expected = max(np.roots([M, D, K - 1j * D * share * 300.0]).real)
    assert abs(expected - growth) < 0.1
    motion = integrate(rotor(300.0, axes), METHODS["absolute"], 0.4, 2e-4)
    whirl = np.linalg.norm((motion.body("rotor").r - PLACE) @ A, axis=1)
    t = motion.t
    begun, ended = (np.sqrt(np.mean(whirl[k : k + 314] ** 2)) for k in (800, len(t) - 314))
    found = np.log(ended / begun) / (t[-314] - t[800])
    assert_allclose(found, expected, rtol=0, atol=0.5)


def test_another_stiffness_across_stays_where_it_is():
    """Springs of 1e5 and 4e5 N/m along two axes of the ground: a push along one of them never comes to the other."""
    motion = integrate(rotor(300.0, stiffness=np.diag([1e5, 4e5, 0, 0, 0, 0])), METHODS["absolute"], 0.5, 2e-4)
    found = (motion.body("rotor").r - PLACE) @ A
    assert_allclose(found[:, 0], 1e-4 * np.cos(100 * motion.t), rtol=0, atol=2e-6)
    assert_allclose(found[:, 1], 0.0, rtol=0, atol=1e-9)


TORSION, MOMENT, SPEED = 8.0, 0.02, 100.0  #: amplitude SPEED sqrt(MOMENT/TORSION) = 5 rad


def torsion(axes="a", speed=SPEED):
    """Return a wheel on a hinge in a torsion spring, whose hinge and markers lie as they like."""
    wheel = RigidBody(
        "wheel", 1.0, np.diag([0.03, 0.04, MOMENT]), position=PLACE, orientation=euler_parameters(A),
        omega_B=(0, 0, speed),
    )  # fmt: skip
    hinge = RevoluteJoint("hinge", GROUND, Marker("wheel"), axis=A[:, 2])
    spring = Bushing("spring", Marker(GROUND, position=PLACE, triad=A), Marker("wheel"), axes=axes,
                     stiffness=np.array([1.0, 2.0, 3.0, 5.0, 6.0, TORSION]))  # fmt: skip
    return System([wheel], [hinge], [spring], sensors=[BushingSensor("spring", "spring")])


def angle(t):
    """Return the angle of the wheel."""
    omega = np.sqrt(TORSION / MOMENT)
    return SPEED / omega * np.sin(omega * t)


@pytest.mark.parametrize(("axes", "name"), [*(("a", name) for name in METHODS), ("b", "absolute"), ("b", "conserving")])
def test_a_torsion_spring_goes_on_beyond_half_a_turn(name, axes):
    motion = integrate(torsion(axes), METHODS[name], 0.1, 5e-4)
    turned = angle(motion.t)
    assert np.abs(turned).max() > 1.5 * np.pi
    found = measured(torsion(axes), motion, [BushingSensor("s", "spring")])["s"].columns
    assert_allclose(found["rz"], turned, rtol=0, atol=2e-3 * np.abs(turned).max())
    assert_allclose(found["rx"], 0.0, rtol=0, atol=1e-9)
    moment = motion.reaction("spring").moment @ A
    assert_allclose(moment[:, 2], TORSION * turned, rtol=0, atol=3e-3 * np.abs(TORSION * turned).max())
    assert_allclose(moment[:, :2], 0.0, rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ["absolute", "relative"])
def test_turns_go_on_through_many_turns_and_events(name):
    """Ten turns forth and back, cut at an event."""
    event = Event("there", "spring", column="rz", level=30.0, record=True)
    motion = integrate(replace(torsion(speed=2 * np.pi * 200.0), events=[event]), METHODS[name], 0.3, 2e-4)
    turned = 2 * np.pi * angle(motion.t) * 200.0 / SPEED
    assert np.abs(turned).max() > 60.0
    moment = motion.reaction("spring").moment @ A
    assert_allclose(moment[:, 2], TORSION * turned, rtol=0, atol=2e-3 * np.abs(TORSION * turned).max())
