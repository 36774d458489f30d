"""Von Mises' stress of vibrations against samples of it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2

from cms.body.stress import von_mises
from floatframe.durability.shaking.responses.stresses import (
    cycle_von_mises,
    exceeded,
    random_von_mises,
    von_mises_density,
)


def test_the_largest_over_a_cycle_is_that_of_its_samples():
    s = np.random.default_rng(0).normal(size=(5, 6)) + 1j * np.random.default_rng(1).normal(size=(5, 6))
    phase = np.exp(1j * np.linspace(0, 2 * np.pi, 20001))
    sampled = von_mises((s[:, :, None] * phase).real).max(axis=1)
    assert_allclose(cycle_von_mises(s), sampled, rtol=1e-7)


def test_rms_and_quantile_are_those_of_samples():
    rng = np.random.default_rng(5)
    L = rng.normal(size=(6, 6))
    found = random_von_mises(L @ L.T)
    sample = von_mises(rng.normal(size=(400_000, 6)) @ L.T)
    assert_allclose(found.rms, np.sqrt((sample**2).mean()), rtol=5e-3)
    assert_allclose(found.quantile, np.quantile(sample, 0.9973002), rtol=1e-2)
    assert_allclose(von_mises_density((L @ L.T)[None]), found.rms**2, rtol=1e-12)


def test_one_component_has_three_sigma_and_equal_ones_that_of_chi():
    one = np.zeros((6, 6))
    one[0, 0] = 4.0
    assert_allclose(random_von_mises(one), (2.0, 6.0, 3.0), rtol=1e-8)
    shear = np.diag([0, 0, 0, 1.0, 1.0, 1.0])
    assert_allclose(random_von_mises(shear).factor, np.sqrt(chi2.ppf(0.9973002039367398, 3) / 3), rtol=1e-7)
    assert random_von_mises(np.zeros((6, 6))).rms == 0


@pytest.mark.parametrize("n", [1, 2, 5])
def test_the_distribution_of_equal_shares_is_chi_square(n):
    for x in (0.5, 2.0, 9.0):
        assert_allclose(exceeded(np.full(n, 1 / n), x), chi2.sf(n * x, n), rtol=1e-8)
