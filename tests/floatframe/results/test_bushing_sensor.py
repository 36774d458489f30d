"""Deformations of bushings: the law of the force from them, their rates as slopes, and small motions."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from floatframe import GROUND, GeneralizedAlpha, Marker, RigidBody, System, integrate, linearize, static_equilibrium
from floatframe.analyses import steady_rotation
from floatframe.errors import ModelError
from floatframe.forces import Bushing
from floatframe.results.sensors.elements import scalars
from floatframe.sensors import BushingSensor, measured
from tests.floatframe.analyses.examples import compare, machine, rotor

K = np.diag([40.0, 50, 60, 3, 4, 5]) + 0.3
D = np.diag([0.4, 0.5, 0.6, 0.03, 0.04, 0.05])
TURN = Rotation.from_rotvec([0.5, -0.8, 0.3]).as_matrix()


@pytest.fixture(scope="module")
def motion():
    """A body that swings in a soft bushing by more than a right angle."""
    body = RigidBody("body", 1.0, np.diag([0.05, 0.06, 0.07]), velocity=(2.0, -1.0, 1.0), omega_B=(9.0, -12.0, 10.0))
    mount = Bushing("mount", Marker(GROUND, position=(0.1, 0, 0), triad=TURN), Marker("body"), K, D)
    system = System([body], [], [mount])
    return system, integrate(system, GeneralizedAlpha(0.9), 0.5, 5e-4)


@pytest.mark.parametrize(("axes", "share"), [("a", 0.0), ("b", 1.0), ("half way", 0.5)])
def test_the_law_of_the_force_follows_from_them(motion, axes, share):
    system, run = motion
    if axes != "a":
        system = System(system.bodies, [], [replace(system.forces[0], axes=axes)])
        run = integrate(system, GeneralizedAlpha(0.9), 0.2, 5e-4)
    columns = np.array(list(measured(system, run, [BushingSensor("s", "mount")])["s"].columns.values()))
    assert np.linalg.norm(columns[3:6], axis=0).max() > np.pi / 2
    law = K @ columns[:6] + D @ columns[6:]
    A = TURN @ Rotation.from_rotvec(share * columns[3:6].T).as_matrix()
    force = np.einsum("tab,bt->ta", A, law[:3])
    found = run.reaction("mount").force
    assert_allclose(force, found, rtol=0, atol=1e-9 * np.abs(found).max())


def test_rates_are_slopes(motion):
    system, run = motion
    columns = np.array(list(measured(system, run, [BushingSensor("s", "mount")])["s"].columns.values()))
    slopes = (columns[:6, 2:] - columns[:6, :-2]) / (run.t[2:] - run.t[:-2])
    for slope, rate in zip(slopes, columns[6:, 1:-1], strict=True):
        assert_allclose(slope, rate, rtol=0, atol=3e-4 * np.abs(rate).max())


@pytest.mark.parametrize(("axes", "is_turning"), [("a", False), ("b", False), ("half way", False), ("half way", True)])
def test_small_motions(axes, is_turning):
    sensor = [BushingSensor("s", "cage" if is_turning else "mount")]
    if is_turning:
        system = with_axes(rotor(), axes)
        about = steady_rotation(system, (0, 0, 2.0), tolerance=1e-12)
    else:
        system = with_axes(machine(), axes)
        about = static_equilibrium(system, tolerance=1e-12)
    linear = linearize(system, about, outputs=sensor)
    assert len(linear.outputs) == 12
    compare(system, about, linear, sensor, tolerance=2e-6)


def with_axes(system, axes):
    """Return the system with all bushings in these axes."""
    forces = [replace(force, axes=axes) if isinstance(force, Bushing) else force for force in system.forces]
    return replace(system, forces=forces)


def test_a_bushing_that_is_not_there(motion):
    system, run = motion
    with pytest.raises(ModelError, match="no bushing 'mout'; did you mean 'mount'"):
        measured(system, run, [BushingSensor("s", "mout")])


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_series_at_small_angles_are_the_closed_forms(share):
    """Closed forms in long double on both sides of the angle below which series stand for them."""
    t2 = np.array([1e-4, 1e-3, 0.99e-2, 1.01e-2, 0.5, 4.0, 9.0])
    t = np.sqrt(t2.astype(np.longdouble))
    is_half = share == 0.5
    alpha = t / 2 / (np.sin(t / 2) if is_half else np.tan(t / 2))
    tau = np.tan(t / 4) / (2 * t) if is_half else 0 * t
    for found, expected in zip(scalars(t2, share), (alpha, (1 - alpha) / t**2, tau), strict=True):
        assert_allclose(found, expected.astype(float), rtol=2e-12, atol=0)
