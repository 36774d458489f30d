"""Estimates have the deviations that they predict, and what a motion does not tell is said."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.design.identification.base_parameters import base_parameters
from floatframe.design.identification.estimation import Measured, estimate
from floatframe.design.identification.excitation import ExcitingMotion, MotionLimits, exciting_motion
from floatframe.design.identification.inertial_parameters import pseudo_inertia
from floatframe.design.identification.physical import log_cholesky, parameters_of_cholesky, real_parameters
from floatframe.design.identification.regressors import linear_form
from floatframe.design.identification.tree_samples import tree_samples
from floatframe.errors import ModelError
from tests.floatframe.design.identification.robots import KUKA_LIKE, six_axes

NOISE = np.array([8.0, 12.0, 6.0, 2.0, 1.5, 1.0])
BASE_NOISE = np.array([20.0, 20.0, 30.0, 15.0, 15.0, 10.0])


@pytest.fixture(scope="module")
def robot():
    form = linear_form(six_axes(**KUKA_LIKE, seed=4), ("viscous", "coulomb"))
    rng = np.random.default_rng(7)
    n_c = 6
    motion = ExcitingMotion(
        tuple(f"joint{k + 1}/angle" for k in range(n_c)), 6.0, rng.normal(size=(n_c, 11)) * 0.8, np.nan
    )
    samples = tree_samples(form.system, *motion.at(np.arange(100) * 0.06))
    phi = form.values
    phi[60:66], phi[66:] = 5.0, 3.0
    return form, samples, phi


@pytest.fixture(scope="module")
def truth(robot):
    form, samples, phi = robot
    return form.torques(samples) @ phi, form.reactions(samples) @ phi


def noisy(truth, rng):
    tau, wrench = truth
    return tau + NOISE * rng.normal(size=tau.shape), wrench + BASE_NOISE * rng.normal(size=wrench.shape)


@pytest.mark.parametrize(
    ("source", "n"), [("torques", 60), ("both", 60), pytest.param("torques", 200, marks=pytest.mark.long)]
)
def test_bias_and_deviation_over_many_noises_are_those_predicted(robot, truth, source, n):
    """Means within 4 standard errors, scatter within what chi-squared allows."""
    form, samples, phi = robot
    base = base_parameters(form, source=source, by="samples")
    rng = np.random.default_rng(11)
    found, predicted = [], []
    for _ in range(n):
        tau, wrench = noisy(truth, rng)
        made = estimate(form, Measured(samples, tau, wrench if source == "both" else None), base=base)
        found.append(made.values)
        predicted.append(made.deviations)
    error = np.array(found) - base.values(phi)
    deviation = np.mean(predicted, axis=0)
    assert np.abs(error.mean(axis=0) / deviation).max() * np.sqrt(n) < 4.0
    scatter = error.std(axis=0) / deviation
    assert np.abs(scatter - 1).max() < 4.5 / np.sqrt(2 * n)
    assert abs(np.sqrt((scatter**2).mean()) - 1) < 0.05
    assert_allclose(made.sigma[:6], NOISE, rtol=0.35)


def test_deviations_fall_as_torques_and_reactions_are_combined(robot, truth):
    form, samples, _ = robot
    tau, wrench = noisy(truth, np.random.default_rng(1))
    alone = estimate(form, Measured(samples, tau), base=base_parameters(form))
    both = estimate(form, Measured(samples, tau, wrench))
    in_both = both.base.B
    combined = alone.base.B[:, both.base.kept] @ both.covariance @ alone.base.B[:, both.base.kept].T
    # the combinations that torques show are combinations of those that both show
    assert_allclose(alone.base.B[:, both.base.kept] @ in_both, alone.base.B, rtol=0, atol=1e-7)
    ratio = np.sqrt(np.diag(combined)) / alone.deviations
    assert ratio.max() < 1.0
    assert ratio.min() < 0.6


def test_robust_estimates_bear_outliers(robot, truth):
    form, samples, phi = robot
    tau, _ = noisy(truth, np.random.default_rng(2))
    spoilt = tau.copy()
    spoilt[::17, 2] += 400.0
    base = base_parameters(form)
    plain = estimate(form, Measured(samples, spoilt), base=base)
    robust = estimate(form, Measured(samples, spoilt), base=base, method="robust")
    error = [np.abs((made.values - base.values(phi)) / robust.deviations).max() for made in (plain, robust)]
    assert error[1] < 4.5 < error[0]


def test_another_motion_is_predicted(robot, truth):
    form, samples, phi = robot
    made = estimate(form, Measured(samples, noisy(truth, np.random.default_rng(3))[0]))
    rng = np.random.default_rng(9)
    other = tree_samples(form.system, *(rng.normal(size=(30, 6)) for _ in range(3)))
    right = Measured(other, form.torques(other) @ phi)
    W = made.base.rows(form.torques(other))
    doubt = np.sqrt(np.einsum("skp,pq,skq->sk", W, made.covariance, W))
    assert (np.abs(made.predicted(right) - right.torques) / doubt).max() < 5.0  # of 180 values
    assert made.misfit(right).max() < 0.1
    wrong = form.torques(other) @ (phi + np.concatenate([[2.0] * 60, [0.0] * 12]))
    assert made.misfit(Measured(other, wrong)).max() > 0.2


def test_real_bodies_fit_as_well_and_no_real_prior_is_refused(robot, truth):
    form, samples, phi = robot
    made = estimate(form, Measured(samples, noisy(truth, np.random.default_rng(4))[0]))
    prior = phi.copy()
    prior[:60] *= 1.3  # a heavier drawing
    real = real_parameters(made, prior=prior)
    assert real.least.min() > 0
    assert real.excess < 0.1  # 48 parameters out of 600 rows
    assert [body.mass for body in real.system.bodies] == list(real.phi[:60:10])
    prior[10:20] = [1.0, 0, 0, 0, 1.0, 0, 0, 1.0, 0, 3.0]
    with pytest.raises(ModelError, match="'link2': the prior is not a real body"):
        real_parameters(made, prior=prior)


def test_unknowns_of_a_pseudo_inertia_come_back():
    phi = linear_form(six_axes()).values[:10]
    assert_allclose(parameters_of_cholesky(log_cholesky(pseudo_inertia(phi))), phi, rtol=1e-12)


def test_what_a_motion_does_not_tell_is_named(robot):
    form, samples, phi = robot
    still = tree_samples(form.system, samples.x, 0 * samples.rate, 0 * samples.acceleration)
    with pytest.raises(ModelError, match=r"does not determine .* J_zz\(link1\)"):
        estimate(form, Measured(still, form.torques(still) @ phi))
    few = tree_samples(form.system, samples.x[:5], samples.rate[:5], samples.acceleration[:5])
    with pytest.raises(ModelError, match="measure longer"):
        estimate(form, Measured(few, form.torques(few) @ phi))
    with pytest.raises(ModelError, match="expected 100 rows of 6 columns"):
        Measured(samples, np.zeros((100, 5)))
    with pytest.raises(ModelError, match="NaN"):
        Measured(samples, np.full((100, 6), np.nan))


def test_an_exciting_motion_keeps_its_limits_and_beats_random_ones():
    system = six_axes(**KUKA_LIKE, seed=4)
    small = linear_form(type(system)(system.bodies[:3], system.joints[:3], system.forces))
    base = base_parameters(small)
    names = [f"joint{k}/angle" for k in (1, 2, 3)]
    limits = dict.fromkeys(names, MotionLimits(-1.5, 1.5, 2.0, 8.0, 90.0))
    options = {"period": 5.0, "n_harmonics": 2, "n_instants": 15, "n_starts": 10}
    plain = exciting_motion(base, limits, **options, max_iterations=0)
    best = exciting_motion(base, limits, **options, max_iterations=8)
    x, rate, acceleration = best.at(np.arange(15) * 5.0 / 15)
    assert np.abs(x).max() <= 1.5 + 1e-6
    assert np.abs(rate).max() <= 2.0 + 1e-6
    assert np.abs(acceleration).max() <= 8.0 + 1e-6
    tau = small.torques(tree_samples(small.system, x, rate, acceleration)) @ small.values
    assert np.abs(tau).max() <= 90.0 * (1 + 1e-6)
    assert best.condition < 0.8 * plain.condition
    before, now, after = best.at(np.array([1.0 - 1e-5, 1.0, 1.0 + 1e-5]))[0]
    assert_allclose((after - before) / 2e-5, best.at(np.array([1.0]))[1][0], rtol=0, atol=1e-8)
    assert_allclose((after - 2 * now + before) / 1e-10, best.at(np.array([1.0]))[2][0], rtol=0, atol=1e-4)
    with pytest.raises(ModelError, match="none for 'joint3/angle'"):
        exciting_motion(base, dict.fromkeys(names[:2], limits[names[0]]), period=5.0)
    with pytest.raises(ModelError, match="no coordinate 'joint9/angle'"):
        exciting_motion(base, {**limits, "joint9/angle": limits[names[0]]}, period=5.0)


def test_friction_that_the_model_lacks_is_told_by_residuals_that_correlate(robot, truth):
    form, samples, _ = robot
    measured = Measured(samples, noisy(truth, np.random.default_rng(6))[0])
    whole, lacking = estimate(form, measured), estimate(linear_form(form.system), measured)
    assert not whole.warnings
    misses, words = lacking.warnings
    assert misses.startswith("the model misses ")
    assert "joint1/angle" in words
    assert "are not white: the model lacks an effect" in words
