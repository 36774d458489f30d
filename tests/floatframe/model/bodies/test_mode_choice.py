"""Bodies with some of their modes only."""

import numpy as np
from numpy.testing import assert_allclose

import cms
from floatframe.design.identification.scaled_link import scaled_body
from floatframe.model import AddedMass, with_masses
from floatframe.model.bodies.mode_choice import with_modes
from tests.bodies import bar

EPS = np.finfo(float).eps


def test_recovery_rows_of_fewer_modes_are_those_of_a_motion_in_these_modes():
    part = cms.couple(bar(nx=2))
    rows = cms.reduction.RecoveryRequest(
        "loads", (cms.reduction.Rows("interface force"), cms.reduction.Rows("net force", about=(0.0, 0.0, 0.0)))
    )
    reduced = cms.reduce(part, cms.craig_bampton(part, n_modes=3), geometric=False, recovery=[rows])
    z = np.random.default_rng(1).normal(size=(2, 6 + reduced.n_q))
    kept = [0, 1, 2, 3, 4, 5, 6 + 4, 6 + 1]
    only = np.zeros_like(z)
    only[:, kept] = z[:, kept]
    fewer = with_modes(reduced, [4, 1])
    expected = reduced.recovery["loads"].values(only, z_ddot=only)
    got = fewer.recovery["loads"].values(z[:, kept], z_ddot=z[:, kept])
    assert_allclose(got, expected, rtol=0, atol=4 * EPS * np.abs(expected).max())  # sums over fewer products


def test_errors_belong_to_all_modes_and_no_added_mass():
    part = cms.couple(bar(nx=2))
    reduced = cms.reduce(part, cms.craig_bampton(part, n_modes=3), geometric=False, errors=True)
    assert len(reduced.errors.frequency)
    assert with_modes(reduced, [4, 1]).errors is None
    assert with_masses(reduced, [AddedMass("left", 0.4)]).errors is None
    assert_allclose(scaled_body(reduced, 0.8, 1.3).errors.frequency, reduced.errors.frequency, rtol=0, atol=0)
