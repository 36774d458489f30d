"""The retraction with a flexible leg: its sag when it is up, and the work of the jack."""

import numpy as np
from numpy.testing import assert_allclose

import cms
import floatframe as ff
from floatframe.machines import copy_machine

OUTER, INNER, LENGTH, END = 0.04, 0.036, 0.75, 55.0


def test_a_leg_that_is_up_hangs_below_its_gland_as_a_cantilever(tmp_path):
    copy_machine("landing-gear", tmp_path)
    reduced = cms.reduce_job(tmp_path / "leg.toml")
    cms.write(reduced, tmp_path / "leg.h5")
    system, _ = ff.read_system(tmp_path / "retraction_flexible.toml")
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.8, 1e-8), 7.0, 4e-3)
    theta = ff.joints.JointCoordinate("hinge", "angle").measure(system, motion).value
    late = motion.t > 6.0
    assert theta[late].min() > np.radians(85)
    assert np.ptp(theta[late]) < 0.01  # it swings a little on its oil
    q = np.average(motion.body("leg").q[late], axis=0, weights=np.hanning(late.sum()))
    places = {each.name: each.Psi @ q for each in reduced.interfaces}
    sag = places["axle"][1] - places["gland"][1] - LENGTH * places["gland"][3]
    EI = 205e9 * np.pi / 4 * (OUTER**4 - INNER**4)
    line = 7850 * np.pi * (OUTER**2 - INNER**2)
    GA = 205e9 / 2.6 * 2.6 / 4.9 * np.pi * (OUTER**2 - INNER**2)
    weight, load = 9.81 * END * np.sin(theta[late].mean()), 9.81 * line * np.sin(theta[late].mean())
    bend = weight * LENGTH**3 / (3 * EI) + load * LENGTH**4 / (8 * EI)
    shear = weight * LENGTH / GA + load * LENGTH**2 / (2 * GA)
    assert_allclose(-sag, bend + shear, rtol=5e-3)
