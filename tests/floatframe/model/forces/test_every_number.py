"""Every number of springs and of forces in joints counts: by the acceleration that their formula gives to a body."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.model.functions.time_functions import polynomial_of_time

MASS, X, V, DOWN, T = 2.0, 0.3, 0.4, 9.81, 0.5
STAY = ff.SpringDamper("stay", ff.Marker(ff.GROUND), ff.Marker("b"), 30.0, 0.7, 0.25, 1.3,
                       characteristic=polynomial_of_time([0.2, 5.0]))  # fmt: skip
DRIVE = ff.JointForce("drive", "guide", "distance", stiffness=30.0, free=0.1, damping=0.7, preload=1.3,
                      motor=polynomial_of_time([0.2, 3.0]), characteristic=polynomial_of_time([0.1, 4.0]), friction=0.6,
                      friction_coefficient=0.2, friction_speed=0.5)  # fmt: skip
SPRING_NUMBERS = ("stiffness", "damping", "free_length", "preload")
DRIVE_NUMBERS = ("stiffness", "free", "damping", "preload", "friction", "friction_coefficient", "friction_speed")


def acceleration(force, motion):
    """Return the acceleration along a coordinate: of a block on a guide along x, or of a wheel on a hinge about z."""
    J, origin = np.diag([1.5, 1.6, MASS]), (0.0, 0.0, 0.0)
    if motion == "along":
        body = ff.RigidBody("b", MASS, J, position=(X, 0, 0), velocity=(V, 0, 0))
        joint = ff.PrismaticJoint("guide", ff.Marker(ff.GROUND, position=origin), ff.Marker("b"), axis=(1, 0, 0))
    else:
        body = ff.RigidBody("b", 3.0, J, omega_B=(0, 0, V))
        joint = ff.RevoluteJoint("guide", ff.Marker(ff.GROUND, position=origin), ff.Marker("b"), axis=(0, 0, 1))
        force = replace(force, coordinate="angle")
    pull = (0.0, 0.0, -DOWN) if motion == "along" else (0.0, -DOWN * MASS / 3.0, 0.0)  # across the axis, alike
    system = ff.System([body], [joint], [ff.Gravity(pull), force])
    found = ff.consistent_state(system, t=T).u_dot
    return found[0] if motion == "along" else found[5]


def of_spring(f, x):
    """Return the acceleration of the block by the formula of `SpringDamper`."""
    y = x - f.free_length
    return -(f.stiffness * y + f.damping * V + f.preload + 0.2 + 5.0 * y) / MASS


def of_drive(f, x):
    """Return the acceleration by the formula of `JointForce`."""
    y = x - f.free
    friction = (f.friction + f.friction_coefficient * MASS * DOWN) * np.tanh(V / f.friction_speed)
    given = f.preload + 0.2 + 3.0 * T + 0.1 + 4.0 * y
    return (-f.stiffness * y - f.damping * V + given - friction) / MASS


CASES = [(STAY, name, of_spring, "along") for name in SPRING_NUMBERS]
CASES += [(DRIVE, name, of_drive, motion) for motion in ("along", "about") for name in DRIVE_NUMBERS]


@pytest.mark.parametrize(("force", "name", "formula", "motion"), CASES)
def test_a_number_that_is_doubled_acts_as_the_formula_says(force, name, formula, motion):
    doubled = replace(force, **{name: 2 * getattr(force, name)})
    x = X if motion == "along" else 0.0  # the angle as assembled
    assert_allclose(acceleration(force, motion), formula(force, x), rtol=1e-10)
    assert_allclose(acceleration(doubled, motion), formula(doubled, x), rtol=1e-10)
    assert abs(formula(doubled, x) - formula(force, x)) > 1e-3
