"""Every joint, drive, coupler, force and body in other units, turned and far from the origin: the same motion."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from floatframe import GeneralizedAlpha, integrate
from floatframe.model.rotations import rotation_matrix
from tests.floatframe.engine.structure_preserving.element_parts import ELEMENT_PARTS
from tests.floatframe.engine.structure_preserving.parts import PARTS
from tests.floatframe.other_units import SIZES, in_units, other_units

R = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
PLACE = np.array([300.0, -200.0, 150.0])
METHOD, STEPS = GeneralizedAlpha(0.9, 1e-11), 4
CLOSE = 1e-6  #: of the way of a body, and of its axes
#: what has numbers in expressions or in functions of Python, or tables in metres
EXPRESSIONS = {"user force", "user force with a state", "user force that is a function", "elements.expressions"}
IN_METRES = {"rails.wheelset", "rails.wheelset (normal = constraint)", "rails.wheel-on-rail"}
OF_PARTS = [name for name in PARTS if name not in EXPRESSIONS]
OF_ELEMENTS = [name for name in ELEMENT_PARTS if "." in name and name not in EXPRESSIONS | IN_METRES]


def run(system, h):
    return integrate(system, METHOD, STEPS * h, h)


@cache
def in_si(name):
    part = (PARTS | ELEMENT_PARTS)[name]
    system = part.make()
    return part, system, run(system, part.h)


def assert_moves_alike(name, units):
    """Compare places, axes and energies, turned back into SI, of a system and of itself elsewhere in other units."""
    part, system, motion = in_si(name)
    other = other_units(units)
    found = run(in_units(system, other.units, R, PLACE), part.h * other.factor("s"))
    for body in motion.body_names:
        a, b = motion.body(body), found.body(body)
        way = max(np.abs(a.r - a.r[0]).max(), 1e-6)
        assert np.abs((b.r / other.factor("m") - PLACE) @ R - a.r).max() < CLOSE * way
        assert np.abs(R.T @ rotation_matrix(b.p) - rotation_matrix(a.p)).max() < CLOSE
    kinetic = motion.energies.kinetic
    assert np.abs(found.energies.kinetic / other.factor("J") - kinetic).max() < CLOSE * kinetic.max()


@pytest.mark.parametrize("units", ["odd", *SIZES])
@pytest.mark.parametrize("name", OF_PARTS)
def test_a_part_moves_alike_in_other_units_and_elsewhere(name, units):
    assert_moves_alike(name, units)


@pytest.mark.long
@pytest.mark.parametrize("name", OF_ELEMENTS)
def test_an_element_moves_alike_in_other_units_and_elsewhere(name):
    assert_moves_alike(name, "odd")
