"""Identification in other units, and of arms of a micrometre and of 1000 km, finds what it finds in SI for a metre."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.foundation.units import unit_system
from floatframe import GROUND, Gravity, Marker, PrismaticJoint, RevoluteJoint, System
from floatframe.design.identification.base_parameters import SOURCES, base_parameters
from floatframe.design.identification.estimation import METHODS, Measured, estimate
from floatframe.design.identification.excitation import ExcitingMotion, MotionLimits, exciting_motion
from floatframe.design.identification.next_motion import next_motion
from floatframe.design.identification.regressors import linear_form
from tests.floatframe.design.identification.robots import some_body
from tests.floatframe.other_units import SI, Other, in_units

TERMS = ("motor-inertia", "viscous", "coulomb", "offset")
UNITS = [("mm-kg-ms", 1.0), ("in-slinch-s", 1.0), ("mm-t-s", 1.0), ("m-kg-s", 1e-6), ("m-kg-s", 1e6)]
#: forces and torques of each term in multiples of what a metre, a kilogram and a second make
DRIVES = {"motor-inertia": 0.05, "viscous": 0.3, "coulomb": 0.2, "offset": 0.1}
WIDE = (2.0, 0.2, 1.5)  #: half of the range of each coordinate, of a metre
PERIOD, N = 5.0, 60
SLIDE = 1  #: the coordinate that is a length


def arm(size):
    """A waist, a slide on it and a hand on that; gravity falls through the size in the same time for all sizes."""
    rng = np.random.default_rng(3)
    places = {"waist": np.zeros(3), "slide": np.array([0.2, 0, 0.3]), "hand": np.array([0.5, 0.1, 0.3])}
    bodies = []
    for name, place in places.items():
        body = some_body(name, rng)
        bodies.append(type(body)(name, body.mass, body.inertia * size**2, center_of_mass=body.center_of_mass * size,
                                 position=place * size))  # fmt: skip
    joints = [
        RevoluteJoint("turn", Marker(GROUND, position=np.zeros(3)), Marker("waist"), axis=(0, 0, 1)),
        PrismaticJoint("reach", Marker("waist", position=places["slide"] * size), Marker("slide"), axis=(0.6, 0, 0.8)),
        RevoluteJoint("wrist", Marker("slide", position=(places["hand"] - places["slide"]) * size), Marker("hand"),
                      axis=(0, 1, 0)),
    ]  # fmt: skip
    return System(bodies, joints, [Gravity(np.array([0.0, 0.5, -9.81]) * size)])


class Case:
    """The arm of a size in units: its form, and magnitudes of a coordinate, a time and a force along it."""

    def __init__(self, units, size):
        self.other = Other(unit_system(units))
        self.form = linear_form(in_units(arm(size), self.other.units) if units != SI.name else arm(size), TERMS)
        self.length, self.time = self.other.factor("m") * size, self.other.factor("s")
        self.x = np.array([1.0, self.length, 1.0])
        self.channels = self.other.factor("N") * size * np.array([self.length, 1.0, self.length])

    def parameters(self):
        """Return the parameters of bodies and drives."""
        phi = self.form.values.copy()
        rates = {"motor-inertia": self.x / self.time**2, "viscous": self.x / self.time}
        drives = [DRIVES[term] * self.channels / rates.get(term, 1.0) for term in TERMS]
        phi[self.form.n_inertial :] = np.concatenate(drives)
        return phi

    def measured(self, source):
        """Return a motion, with noise of the same random numbers in all units."""
        rng = np.random.default_rng(5)
        coefficients = rng.normal(size=(3, 7)) * 0.4 * self.x[:, None]
        coefficients[SLIDE] *= 0.3
        coefficients[:, 1:] /= self.time
        names = tuple(column.name for column in self.form.columns)
        t = np.arange(N) * PERIOD * self.time / N
        samples = self.form.samples(*ExcitingMotion(names, PERIOD * self.time, coefficients, np.nan).at(t))
        force = self.channels[SLIDE]
        of_base = np.repeat([force, force * self.length], 3)
        tau = self.form.torques(samples) @ self.parameters() + 0.05 * self.channels * rng.normal(size=(N, 3))
        wrench = self.form.reactions(samples) @ self.parameters() + 0.05 * of_base * rng.normal(size=(N, 6))
        tau, wrench = None if source == "reactions" else tau, None if source == "torques" else wrench
        return Measured(samples, tau, wrench, time=t)


@cache
def case(units, size):
    return Case(units, size)


@pytest.mark.parametrize("by", ["rules", "samples"])
@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize(("units", "size"), UNITS)
def test_base_parameters_are_the_same_combinations(units, size, source, by):
    one, other = (base_parameters(each.form, source=source, by=by) for each in (case(SI.name, 1.0), case(units, size)))
    assert list(other.kept) == list(one.kept)
    assert other.without_effect == one.without_effect
    values = [base.values(each.parameters()) for base, each in ((one, case(SI.name, 1.0)), (other, case(units, size)))]
    assert_allclose(values[1] / scales(case(units, size))[one.kept], values[0], rtol=1e-6, atol=1e-9)


def scales(own):
    """Return by how much parameters of a case are larger than those in SI of a metre."""
    mass, length = own.other.factor("kg"), own.length
    of_body = mass * np.array([1.0] + [length] * 3 + [length**2] * 6)
    one = case(SI.name, 1.0)
    drives = own.parameters()[own.form.n_inertial :] / one.parameters()[one.form.n_inertial :]
    return np.concatenate([np.tile(of_body, 3), drives])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize(("units", "size"), UNITS)
def test_estimates_are_those_of_the_same_measurement(units, size, source, method):
    one, other = (
        estimate(each.form, each.measured(source), method=method) for each in (case(SI.name, 1.0), case(units, size))
    )
    assert_allclose(other.relative_deviations, one.relative_deviations, rtol=1e-5)
    assert_allclose(other.values / other.deviations, one.values / one.deviations, rtol=1e-5, atol=1e-5)
    assert_allclose(other.condition, one.condition, rtol=1e-5)
    assert_allclose(other.weights, one.weights, rtol=1e-4)


@cache
def excited(units, size):
    """Return condition and positions of an exciting motion, in SI of a metre."""
    each = case(units, size)
    limits = {
        column.name: MotionLimits(-wide * x, wide * x, 3 * wide * x / each.time, 20 * wide * x / each.time**2)
        for column, wide, x in zip(each.form.columns, WIDE, each.x, strict=True)
    }
    options = {"n_harmonics": 2, "n_instants": 20, "n_starts": 4, "max_iterations": 4}
    found = exciting_motion(base_parameters(each.form), limits, period=PERIOD * each.time, **options)
    return found.condition, found.at(np.linspace(0, PERIOD, 9) * each.time)[0] / each.x


@pytest.mark.parametrize(("units", "size"), UNITS)
def test_exciting_motions_are_the_same_motion(units, size):
    (condition, x), (found, other) = excited(SI.name, 1.0), excited(units, size)
    assert_allclose(found, condition, rtol=1e-2)  # by differences in SLSQP
    assert_allclose(other, x, rtol=0, atol=0.02)


@cache
def proposed(units, size):
    """Return the largest position, rate and acceleration of the motion that would help, where the slide stood still."""
    each = case(units, size)
    made = estimate(each.form, each.measured("torques"))
    moved = made.measured.samples
    stood = (a * np.where(np.arange(3) == SLIDE, 1e-9, 1.0) for a in (moved.x, moved.rate, moved.acceleration))
    still = replace(made, measured=replace(made.measured, samples=each.form.samples(*stood)), condition=np.inf)
    parts = next_motion(still).motion.at(np.linspace(0, PERIOD, 101) * each.time)
    return np.array([np.abs(a).max(axis=0) * each.time**k / each.x for k, a in enumerate(parts)])


@pytest.mark.parametrize(("units", "size"), [("mm-kg-ms", 1.0), ("m-kg-s", 1e-6)])
def test_a_slide_that_stood_still_is_moved_as_far(units, size):
    """By a share of the size of the arm, and its rates by that share in the time of the measurement."""
    assert_allclose(proposed(units, size), proposed(SI.name, 1.0), rtol=0.05)
