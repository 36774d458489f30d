"""The railway vehicle in steady running: in a circle, and with an amplitude of its hunting mode."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GeneralizedAlpha, integrate, linearize
from floatframe.components import rails
from floatframe.errors import ModelError
from floatframe.machines.bogie import RailVehicle, in_circle, steady_motion_of, vehicle
from floatframe.machines.bogie.running import lateral_modes
from floatframe.machines.bogie.unstable_branch import bracket_of_unstable_cycle, hunted

DATA = RailVehicle()
LAWS = rails.ContactLaws(creep="kalker", friction=0.4)
RADIUS, CANT = 2000.0, 0.1


@pytest.fixture(scope="module")
def turning():
    return steady_motion_of(in_circle(DATA, 40.0, RADIUS, cant=CANT, laws=LAWS), RADIUS)


def test_a_vehicle_in_steady_running_on_a_circle_stays_there(turning):
    """Second road: the motion, whose bodies keep their distance from the middle of the circle."""
    motion = integrate(turning.system, GeneralizedAlpha(0.8, 1e-8), 0.2, 2e-3, state=turning.equilibrium.state)
    for name in ("body", "axle_front_leading", "frame_rear"):
        r = motion.body(name).r
        away = np.hypot(r[:, 0], r[:, 1] - RADIUS)
        assert_allclose(away, away[0], rtol=0, atol=1e-7)
        assert np.hypot(*(r[-1] - r[0])[:2]) > 7.9


def test_a_circle_of_large_radius_leaves_the_sway_of_the_body_as_it_is_straight_on(turning):
    """R = 2000 m: by less than 2 %."""
    straight = steady_motion_of(vehicle(DATA, 40.0, laws=LAWS))
    found = [lateral_modes(linearize(m.system, m.equilibrium, inputs=(), outputs=()))[0] for m in (straight, turning)]
    sway = [roots[np.argmin(np.abs(roots))] for roots in found]
    assert_allclose(sway[1], sway[0], rtol=0.02)


@pytest.fixture(scope="module")
def unstable():
    return hunted(vehicle(DATA, 100.0, pair=rails.Pair(wheel=rails.cone(0.1)), laws=LAWS), "axle_front_leading")


def test_a_vehicle_put_into_its_hunting_mode_moves_as_its_eigenvalue_says(unstable):
    """Second road: the motion from 0.01 mm, cones of 0.1 at 100 m/s."""
    now = unstable
    motion = integrate(now.motion.system, GeneralizedAlpha(0.9, 1e-9), 1.0, 1e-3, state=now.state(1e-5))
    y, t = motion.body("axle_front_leading").r[:, 1], motion.t
    wave = np.exp(now.eigenvalue * t)
    basis = np.stack([wave.real, wave.imag], axis=1)
    rest = y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]
    assert now.eigenvalue.real > 1.0
    assert np.abs(rest).max() < 0.03 * np.abs(y).max()


def test_bad_amplitudes_and_axles_are_told(unstable):
    system = vehicle(DATA, 60.0, laws=LAWS)
    with pytest.raises(ModelError, match="no body 'axle'; choose among body, axle_front_leading"):
        hunted(system, "axle")
    with pytest.raises(ModelError, match="expected 0 < low < high"):
        bracket_of_unstable_cycle(unstable, low=2.0, high=1.0)


@pytest.mark.long
def test_between_stable_running_and_the_cycle_from_flange_to_flange_lies_an_unstable_one():
    """At 74 m/s with FASTSIM: 4 mm die down, 5 mm end at 6 mm; see docs/bogie.md."""
    laws = rails.ContactLaws(creep="fastsim", friction=0.4, strips=8)
    found = bracket_of_unstable_cycle(hunted(vehicle(DATA, 74.0, laws=laws), "axle_front_leading"), n_runs=2)
    assert 3e-3 < found.decaying.start < found.lasting.start < 6e-3
    assert 5e-3 < found.cycle < 7e-3
    assert found.decaying.late < 2e-3
