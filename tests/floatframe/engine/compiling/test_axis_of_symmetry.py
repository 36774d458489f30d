"""Axes of symmetry of bodies, whose origins lie beside the axis."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from floatframe.engine.compiling.bodies import SYMMETRIC, axis_of_symmetry

MASS, S = 3.0, 3.0 * np.array([0.7, -0.4, 1.1])
R = Rotation.from_rotvec([0.5, -1.2, 0.8]).as_matrix()


def axis_of(moments):
    """The axis of a body with principal moments about the axes R at its centre of mass, S/m from its origin."""
    s = S / MASS
    return axis_of_symmetry(MASS, S, R @ np.diag(moments) @ R.T + MASS * (s @ s * np.eye(3) - np.outer(s, s)))


@pytest.mark.parametrize("own", [0.3, 1.7])  # a rod, a disc
@pytest.mark.parametrize("k", range(3))
def test_the_axis_is_that_of_the_moment_which_differs(k, own):
    moments = np.ones(3)
    moments[k] = own
    axis = axis_of(moments)
    assert_allclose(abs(axis @ R), np.eye(3)[k], rtol=0, atol=1e-12)


def test_a_body_with_three_moments_and_a_sphere_have_none():
    assert_array_equal(axis_of([1.0, 1.2, 1.5]), 0.0)
    assert_array_equal(axis_of([1.0, 1.0, 1.0]), 0.0)


def test_moments_that_are_nearly_equal_count_as_equal():
    assert abs(axis_of([1.0, 1.0 + 0.9 * 1.7 * SYMMETRIC, 1.7]) @ R[:, 2]) > 0.999
    assert_array_equal(axis_of([1.0, 1.0 + 1.1 * 1.7 * SYMMETRIC, 1.7]), 0.0)
