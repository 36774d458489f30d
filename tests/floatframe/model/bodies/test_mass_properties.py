"""Mass properties as CAD programs give them, and bodies with fewer modes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.errors import ModelError
from floatframe.model.bodies.mass_properties import combined, mass_properties, point_mass
from floatframe.model.bodies.mode_choice import frozen_to_rigid, with_modes, without_modes
from floatframe.model.rotations import rotation_exp
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

POINTS = random_point_masses(4, 3)


def of_points(m, c):
    """Sums over point masses: mass, centre, tensor about the centre."""
    center = m @ c / m.sum()
    d = c - center
    return m.sum(), center, np.einsum("p,pab->ab", m, [x @ x * np.eye(3) - np.outer(x, x) for x in d])


def test_tensors_in_other_axes_about_other_points_are_the_same_body():
    mass, center, J = of_points(POINTS.m, POINTS.c)
    values, axes = np.linalg.eigh(J)
    axes = axes * np.sign(np.linalg.det(axes))
    at_origin = J + mass * (center @ center * np.eye(3) - np.outer(center, center))
    positive = 2 * np.diag(np.diag(J)) - J
    A = rotation_exp(np.array([0.3, -0.5, 0.8]))
    for found in (
        mass_properties(mass, center, J),
        mass_properties(mass, center, np.diag(values), axes=axes),
        mass_properties(mass, center, at_origin, reference=(0, 0, 0)),
        mass_properties(mass, center, positive, positive_products=True),
        mass_properties(mass, center, A.T @ J @ A, axes=A),
    ):
        assert_allclose(found.inertia, J, rtol=0, atol=1e-12 * np.abs(J).max())


def test_parts_sum_to_the_whole():
    half = len(POINTS.m) // 2
    parts = [mass_properties(*of_points(POINTS.m[part], POINTS.c[part])) for part in (slice(half), slice(half, -1))]
    whole = combined(*parts, point_mass(POINTS.m[-1], POINTS.c[-1]))
    mass, center, J = of_points(POINTS.m, POINTS.c)
    assert_allclose(whole.mass, mass, rtol=1e-14, atol=0)
    assert_allclose(whole.center_of_mass, center, rtol=0, atol=1e-14)
    assert_allclose(whole.inertia, J, rtol=0, atol=1e-13)
    assert RigidBody("whole", **whole.arguments).mass == whole.mass


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: mass_properties(1.0, (2, 0, 0), np.eye(3), reference=(0, 0, 0)), "negative principal moment"),
        (lambda: mass_properties(1.0, (0, 0, 0), np.eye(3), axes=2 * np.eye(3)), "orthonormal"),
        (lambda: combined(), "at least one part"),
        (lambda: point_mass(0.0, (0, 0, 0)), "mass: expected a number above 0"),
        (lambda: with_modes(reduced_body(POINTS, stiffness(4)), [4]), "modes 0 to 3"),
        (lambda: with_modes(reduced_body(POINTS, stiffness(4)), [1, 1]), "each to be named once"),
        (lambda: without_modes(reduced_body(POINTS, stiffness(4)), [7]), "modes 0 to 3"),
    ],
)
def test_impossible_properties_are_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


def swing(body, place):
    joint = RevoluteJoint("pin", GROUND, Marker("b", **place), axis=(0, 1, 0))
    return integrate(System([body], [joint], [Gravity((0, 0, -9.81))]), GeneralizedAlpha(0.9, 1e-11), 0.4, 1e-3)


def test_a_frozen_body_moves_as_the_rigid_body_of_its_mass():
    reduced = reduced_body(POINTS, stiffness(4))
    mass, center, J = of_points(POINTS.m, POINTS.c)
    frozen = swing(FlexibleBody("b", frozen_to_rigid(reduced)), {"interface": "end_b"})
    rigid = swing(RigidBody("b", mass, J, center), {"position": reduced.interface("end_b").position})
    assert_allclose(frozen.body("b").r, rigid.body("b").r, rtol=0, atol=1e-10)
    assert frozen.body("b").q.shape[1] == 0


def test_a_body_with_a_mode_off_moves_as_with_that_mode_infinitely_stiff():
    K = np.diag([40.0, 60.0, 500.0, 900.0])
    reduced = reduced_body(POINTS, K)
    stiff = reduced_body(POINTS, np.diag([40.0, 1e9, 500.0, 900.0]))
    off = swing(FlexibleBody("b", without_modes(reduced, [1])), {"interface": "end_b"}).body("b")
    held = swing(FlexibleBody("b", stiff), {"interface": "end_b"}).body("b")
    assert_allclose(off.q, held.q[:, [0, 2, 3]], rtol=0, atol=1e-4 * np.abs(off.q).max())
    assert_allclose(off.r, held.r, rtol=0, atol=1e-5)
