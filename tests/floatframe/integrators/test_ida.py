"""SUNDIALS IDA on index-one equations against generalized-alpha on index three: methods without a line in common."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import FlexibleBody, GeneralizedAlpha, Gravity, Marker, SphericalJoint, System, integrate
from floatframe.components.mechanisms import pendulum as rigid_pendulum
from floatframe.errors import ModelError
from floatframe.integrators import Ida
from tests.floatframe.integrators.examples import pendulum
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

pytest.importorskip("sksundae", reason="the extra 'ida' is not installed")


def test_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "sksundae.ida", None)
    with pytest.raises(ModelError, match=r'pip install "floatframe\[ida\]"'):
        integrate(rigid_pendulum(), Ida(), 0.1, 0.01)


def test_flexible_pendulum_is_that_of_minimal_coordinates(exact):
    motion = integrate(pendulum(), Ida(1e-7, 1e-9), 0.2, 0.05)
    for k, t in enumerate(motion.t):
        _, q, omega, _, force = exact(t)
        assert_allclose(motion.body("body").q[k], q, rtol=0, atol=1e-5)
        assert_allclose(motion.body("body").omega_B[k], omega, rtol=0, atol=1e-4)
        assert_allclose(motion.reaction("pin").force[k], force, rtol=0, atol=1e-3)
    assert motion.drift("pin").distance.max() < 1e-11
    assert motion.drift("pin").distance_rate.max() < 1e-11


def test_rigid_pendulum_keeps_its_energy_to_the_tolerance():
    motion = integrate(rigid_pendulum(angle=0.4), Ida(), 0.5, 0.1)
    total = motion.energies.total
    assert np.ptp(motion.energies.kinetic) > 0.5
    assert_allclose(total, total[0], rtol=0, atol=1e-5)


def test_one_output_is_that_of_many():
    one, many = (integrate(rigid_pendulum(angle=0.4), Ida(), 0.2, h) for h in (0.2, 0.05))
    assert len(one.t) == 2
    name = one.body_names[0]
    assert_allclose(one.body(name).r[-1], many.body(name).r[-1], rtol=0, atol=1e-6)


def test_flexible_double_pendulum_converges_to_it_with_generalized_alpha():
    """The difference is the error of generalized-alpha: of second order, down to the tolerance of IDA."""
    upper = reduced_body(random_point_masses(2, 5), stiffness(2, omega=5.0), name="upper")
    lower = reduced_body(random_point_masses(2, 6), stiffness(2, omega=5.0), name="lower")
    a, b = (part.interface("end_b").position for part in (upper, lower))
    tip = upper.interface("end_a").position
    bodies = [FlexibleBody("upper", upper, position=-a, omega_B=(0.3, 0.5, 0.1), velocity=np.cross(a, (0.3, 0.5, 0.1))),
              FlexibleBody("lower", lower, position=tip - a - b)]  # fmt: skip
    joints = [SphericalJoint("top", "ground", Marker("upper", "end_b")),
              SphericalJoint("middle", Marker("upper", "end_a"), Marker("lower", "end_b"))]  # fmt: skip
    system = System(bodies, joints, [Gravity((0, 1.0, -9.81))])
    reference = integrate(system, Ida(1e-7, 1e-9), 0.2, 0.2)
    differences = []
    for h in (2e-3, 1e-3):
        motion = integrate(system, GeneralizedAlpha(0.8, 1e-11), 0.2, h)
        parts = [motion.body(name).q[-1] - reference.body(name).q[-1] for name in ("upper", "lower")]
        differences.append(np.abs(np.concatenate(parts)).max())
    assert 3 < differences[0] / differences[1] < 5
    assert differences[1] < 1e-3 * np.abs(reference.body("upper").q).max()
