"""The railway vehicle: its hunting linearised and as motion, conicity, independent wheels, the files as shipped."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from floatframe import GeneralizedAlpha, integrate
from floatframe.components import rails
from floatframe.errors import ModelError
from floatframe.files.system_file.read_system import read_system
from floatframe.machines import copy_machine
from floatframe.machines.bogie import (
    RailVehicle,
    critical_speed,
    falling_speed,
    flexible_frames,
    hunting,
    steady_running,
    vehicle,
)
from floatframe.machines.bogie.curves_and_comfort import weighted_rms, weighting
from floatframe.machines.bogie.running import Hunting, lateral_modes

DATA = RailVehicle()
LAWS = rails.ContactLaws(creep="kalker", friction=0.4)


def on_cones(conicity, speed, **options):
    return vehicle(DATA, speed, pair=rails.Pair(wheel=rails.cone(conicity)), laws=LAWS, **options)


def test_a_disturbance_grows_and_moves_as_the_eigenvalues_say():
    """Second road: the nonlinear motion after a small blow to one axle is, late, made of the two growing modes."""
    system = on_cones(0.1, 120.0)
    roots, _ = lateral_modes(steady_running(system))
    growing = roots[roots.real > 0]
    assert len(growing) == 2  # one of each bogie
    bodies = [
        replace(each, velocity=np.array([120.0, 1e-3, 0])) if each.name == "axle_front_leading" else each
        for each in system.bodies
    ]
    motion = integrate(replace(system, bodies=bodies), GeneralizedAlpha(0.9, 1e-9), 1.6, 1e-3)
    t, y = motion.t, motion.body("axle_front_leading").r[:, 1]
    late = t > 0.8
    waves = np.exp(np.outer(t[late] - 0.8, growing))
    basis = np.hstack([waves.real, waves.imag])
    rest = y[late] - basis @ np.linalg.lstsq(basis, y[late], rcond=None)[0]
    assert np.abs(rest).max() < 0.03 * np.abs(y[late]).max()
    assert np.abs(y[late]).max() > 2 * np.abs(y[~late]).max()


def test_more_conicity_hunts_faster_and_independent_wheels_not_at_all():
    low, high = hunting(on_cones(0.1, 110.0)), hunting(on_cones(0.3, 110.0))
    assert low.damping < 0 > high.damping
    assert high.frequency > 1.5 * low.frequency  # Klingel: with the root of the conicity
    assert hunting(on_cones(0.3, 110.0, is_independent=True)).damping > 0.05


@pytest.mark.long  # at 85 m/s, with more conicity, the search for the critical speed below begins damped
def test_a_slow_vehicle_on_wheels_of_little_conicity_is_well_damped():
    assert hunting(on_cones(0.05, 50.0)).damping > 0.1


def test_the_critical_speed_lies_where_damping_ends():
    speed = critical_speed(lambda V: on_cones(0.1, V), 85.0, 93.0, tolerance=4.0)
    assert_allclose(speed, 88.4, rtol=0, atol=2.5)  # finely bisected: 88.4, see docs/bogie.md


def test_a_range_of_speeds_without_the_critical_one_is_refused(monkeypatch):
    monkeypatch.setattr(
        "floatframe.machines.bogie.running.hunting", lambda V: Hunting(damping=1 - V / 90, frequency=1.0)
    )
    with pytest.raises(ModelError, match=r"expected more damping than 0 at 110 m/s and less at 120 m/s, got -0\.222"):
        critical_speed(lambda V: V, 110.0, 120.0)


def test_the_files_make_the_vehicle(tmp_path):
    copy_machine("bogie", tmp_path)
    frame = cms.reduce_job(tmp_path / "frame.toml")
    assert_allclose(frame.moments.m, DATA.frame_mass, rtol=1e-6)
    cms.write(frame, tmp_path / "frame.h5")
    read = read_system(tmp_path / "straight.toml")[0]
    plain = replace(read, elements=[replace(each, track=rails.Track()) for each in read.elements])
    made = vehicle(DATA, 55.0, frames=flexible_frames(DATA, frame, 55.0))
    one, other = (integrate(each, GeneralizedAlpha(0.8, 1e-8), 0.02, 2e-3) for each in (plain, made))
    for name in ("body", "axle_rear_trailing", "frame_front"):
        assert_allclose(one.body(name).r, other.body(name).r, rtol=0, atol=1e-7)


@pytest.mark.long
def test_limit_cycles_are_followed_by_falling_speed_to_where_they_end():
    """S1002: hunting from flange to flange at 75 m/s, none below 66 m/s, in between falling in every second."""
    laws = replace(LAWS, creep="fastsim", strips=8)
    found = falling_speed(vehicle(DATA, 80.0, laws=laws), "axle_front_leading", deceleration=1.0, end=65.0, kick=0.1)
    high, low = found.amplitude[found.speed > 73.0], found.amplitude[found.speed < 67.0]
    assert high[2:].min() > 5e-3
    assert low.max() < 2e-4
    assert np.all(np.diff(found.amplitude[found.speed < 72.0]) < 0)


def test_weightings_of_comfort_are_those_of_the_standards_tables():
    """Factors printed in ISO 2631-1 at the nominal frequencies of octaves."""
    f = np.array([1, 2, 4, 8, 16, 31.5])
    assert_allclose(weighting(f, "vertical"), [0.482, 0.531, 0.967, 1.036, 0.768, 0.405], rtol=5e-3)
    assert_allclose(weighting(f, "lateral"), [1.011, 0.890, 0.512, 0.253, 0.125, 0.0632], rtol=5e-3)
    t = np.arange(0, 20, 0.005)
    wave = 0.3 * np.sin(2 * np.pi * 4 * t)
    expected = 0.3 / np.sqrt(2) * weighting(np.array([4.0]), "vertical")[0]
    assert_allclose(weighted_rms(t, 5.0 + wave, "vertical"), expected, rtol=1e-3)
    with pytest.raises(ModelError, match="vertical, lateral"):
        weighting(f, "up")
    with pytest.raises(ModelError, match="equally spaced"):
        weighted_rms(t**2, wave, "vertical")
