"""Derivatives by parameters in other units, and of arms of a micrometre and of 1000 km, are those in SI of a metre."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    JointForce,
    Marker,
    SpringDamper,
)
from floatframe.design import sensitivities
from floatframe.sensors import EnergySensor, PlaceSensor, ReactionSensor
from tests.floatframe.general_position.arm import PLACE, R, arm_with
from tests.floatframe.other_units import SI, SIZES, in_units, other_units

UNITS = ["mm-kg-ms", "in-slinch-s", *SIZES, pytest.param("mm-t-s", marks=pytest.mark.long)]
OUTPUTS = {"hinge.angle value": "rad", "slide.distance rate": "m/s", "load force size": "N", "load moment size": "N m",
           "energy kinetic": "J", "hand size": "m/s^2"}  # fmt: skip
PARAMETERS = {"bodies.arm.mass": "kg", "forces.rub.damping": "N m s", "forces.spring.stiffness": "N/m",
              "joints.slide.marker_a.position.0": "m"}  # fmt: skip
MODES = {"frequency 1": "Hz", "frequency 2": "Hz", "damping 2": "1"}


@cache
def arm():
    """An arm on a hinge with spring and damper, a block on a sprung slide in it, and a stay."""
    return arm_with(
        JointForce("spring", "slide", "distance", stiffness=200.0, damping=3.0),
        SpringDamper("stay", Marker(GROUND, position=(0.2, 0.1, 1.5)), Marker("arm", position=(0.6, 0, 0)), 90, 2, 0.9),
    )


SENSORS = [
    ReactionSensor("load", "hinge"),
    EnergySensor("energy"),
    PlaceSensor("hand", Marker("block"), "acceleration"),
]


@cache
def derivatives(units, analysis, method="direct"):
    """Return values and gradient of outputs, in SI of a metre."""
    other = other_units(units)
    system = replace(arm() if other.units == SI else in_units(arm(), other.units, R, PLACE), sensors=SENSORS)
    outputs = MODES if analysis == "modes" else OUTPUTS
    run = {"t_end": 0.02 * other.factor("s"), "h": 2.5e-3 * other.factor("s")} if analysis == "run" else {}
    found = sensitivities(system, list(outputs), list(PARAMETERS), analysis=analysis, method=method, **run)
    in_hertz = units not in SIZES  # frequencies are told in Hz in all units of time
    of = np.array([1.0 if unit == "Hz" and in_hertz else other.factor(unit) for unit in outputs.values()])
    by = np.array([other.factor(unit) for unit in PARAMETERS.values()])
    return found.values / of, found.gradient * by / of[:, None]


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(("analysis", "method"), [("run", "direct"), ("run", "adjoint"), ("static", "direct"),
                                                  ("static", "adjoint"), ("modes", "direct")])  # fmt: skip
def test_derivatives_are_alike_in_other_units_and_sizes(analysis, method, units):
    (values, gradient), (found, other) = derivatives(SI.name, analysis), derivatives(units, analysis, method)
    assert_allclose(found, values, rtol=1e-6, atol=1e-9)
    size = np.abs(gradient).max(axis=1, keepdims=True)
    assert (size > 1e-6).sum() >= 3
    size[size == 0] = 1.0  # at rest: rates, accelerations and kinetic energy
    assert_allclose(other / size, gradient / size, rtol=1e-4, atol=1e-6)
