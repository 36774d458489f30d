"""SciPy's solvers on independent coordinates: against generalized-alpha, with loops closed to rounding."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, ModelError, RelativeOde, integrate
from floatframe.mechanisms import slider_crank, spinning_top
from floatframe.relative.partition import partition_of
from tests.floatframe.relative.mechanisms import MECHANISMS


@pytest.mark.parametrize("name", ["slider-crank", "four-bar", "satellite"])
def test_the_solver_agrees_with_generalized_alpha_and_keeps_energy_and_loops(name):
    system = MECHANISMS[name]()
    fine = [
        integrate(system, GeneralizedAlpha(1.0, 1e-11), 0.1, 0.05 / k, output_every=k, formulation="relative")
        for k in (50, 100)
    ]
    motion = integrate(system, RelativeOde("DOP853", 1e-9, 1e-11), 0.1, 0.05)
    for body in system.bodies:
        coarse, close = (each.body(body.name).r for each in fine)
        error = np.abs(coarse - close).max()
        assert_allclose(motion.body(body.name).r, close, rtol=0, atol=error + 1e-9)
    if name != "satellite":  # it is pushed
        assert np.ptp(motion.energies.total) < 1e-8
    for joint in system.joints:
        drift = motion.drift(joint.name)
        for of_joint in (drift.distance, drift.angle, drift.distance_rate, drift.angle_rate):
            assert of_joint.max() < 1e-11


def test_a_stiff_solver_follows_a_loop_through_dead_centres():
    """A slider-crank over more than a turn: the guide's distance, or the rod's angle, cannot be free everywhere."""
    system = slider_crank(angle=0.3, speed=40.0)
    motion = integrate(system, RelativeOde("BDF", 1e-6, 1e-8), 0.17, 0.17)
    fine = integrate(system, GeneralizedAlpha(1.0, 1e-11), 0.17, 1e-4, output_every=1700, formulation="relative")
    assert np.ptp(motion.energies.total) < 1e-3 * motion.energies.total[0]
    assert_allclose(motion.body("slider").r[-1], fine.body("slider").r[-1], rtol=0, atol=1e-3)


def test_rotations_are_counted_from_anew_after_two_radians():
    """A fast top, many turns: energy is kept, and the tip stays."""
    motion = integrate(spinning_top(), RelativeOde("DOP853", 1e-9, 1e-11), 0.04, 0.02)
    assert np.ptp(motion.energies.total) < 1e-6 * np.abs(motion.energies.total).max()
    assert motion.drift("tip").distance.max() < 1e-12


def test_a_partition_solves_what_it_should_and_knows_when_it_is_worn():
    rng = np.random.default_rng(0)
    C = rng.normal(size=(3, 7))
    made = partition_of(C, ("a", "b", "c"), np.ones(7))
    y = rng.normal(size=7)
    y[made.dependent] = made.solved(C, -C[:, made.independent] @ y[made.independent])
    assert_allclose(C @ y, 0, rtol=0, atol=1e-12)
    assert not made.is_worn(C)
    worn = C.copy()
    worn[:, made.dependent[0]] = worn[:, made.dependent[1]] + 1e-6
    assert made.is_worn(worn)


def test_singular_positions_are_told_in_words():
    C = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]])
    with pytest.raises(ModelError, match="1 of 2 constraints of 'ring', 'pin' repeat others here"):
        partition_of(C, ("ring", "pin"), np.ones(3))
    with pytest.raises(ModelError, match="joint 'pin' holds what cannot move"):
        partition_of(np.array([[1.0, 0.0], [0.0, 0.0]]), ("ring", "pin"), np.ones(2))


def test_solvers_that_are_none_are_refused():
    with pytest.raises(ModelError, match="RelativeOde: method 'BFD'; did you mean 'BDF'"):
        RelativeOde("BFD")
