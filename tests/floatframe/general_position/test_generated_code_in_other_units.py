"""Generated code of an arm in other units, of a micrometre and of 1000 km, and units of it, give what they do in SI."""

from functools import cache

import fmpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import JointForce
from floatframe.design import generate_fmu
from tests.floatframe.design.generation.calls import python_function
from tests.floatframe.general_position.arm import PLACE, R, arm_with
from tests.floatframe.other_units import SI, SIZES, in_units, other_units

UNITS = ["mm-t-s", "mm-kg-ms", "in-slinch-s"]
Z, Z_DOT, Z_DDOT = np.array([0.4, 0.05]), np.array([2.0, -0.6]), np.array([5.0, 3.0])
OF = [("rad", "N m"), ("m", "N")]  #: units of each coordinate and of what acts along it


@cache
def arm():
    """An arm on a hinge and a block on a slide in it, each with a spring, a damper and a preload."""
    return arm_with(JointForce("spring", "slide", "distance", stiffness=200.0, free=0.02, damping=3.0, preload=1.5))


def placed(other):
    return arm() if other.units == SI else in_units(arm(), other.units, R, PLACE)


@cache
def evaluated(units):
    """Return accelerations by forces, forces for a motion, and mass matrix, in SI of a metre."""
    other = other_units(units)
    x, f = (np.array([other.factor(unit[k]) for unit in OF]) for k in (0, 1))
    t, system = other.factor("s"), placed(other)
    z, z_dot, z_ddot = Z * x, Z_DOT * x / t, Z_DDOT * x / t**2
    push = np.array([1.0, -2.0]) * f
    forward = python_function(system, "forward")(z, z_dot, push)
    inverse = python_function(system, "inverse")(z, z_dot, z_ddot)
    mass = python_function(system, "mass")(z)
    return [np.ravel(forward) / x * t**2, np.ravel(inverse) / f, np.reshape(mass, (2, 2)) / np.outer(f, 1 / x) / t**2]


@pytest.mark.parametrize("units", [*UNITS, *SIZES])
def test_generated_equations_are_alike(units):
    for found, expected in zip(evaluated(units), evaluated(SI.name), strict=True):
        assert_allclose(found, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("units", UNITS)
def test_a_unit_of_the_equations_moves_alike_in_seconds(units, tmp_path):
    ends = []
    for name in (SI.name, units):
        other = other_units(name)
        unit = generate_fmu(placed(other), tmp_path / f"{name}.fmu", step=1e-3, stop_time=0.2)
        states = [each.name for each in unit.variables if each.is_state]
        found = fmpy.simulate_fmu(str(unit.path), fmi_type="CoSimulation", stop_time=0.2)
        x, rate = (np.array([other.factor(each) for each in row]) for row in (("rad", "m"), ("rad/s", "m/s")))
        ends.append(np.array([found[state][-1] for state in states]) / np.concatenate([x, rate]))
    assert np.abs(ends[0]).min() > 1e-3
    assert_allclose(ends[1], ends[0], rtol=1e-9, atol=1e-12)
