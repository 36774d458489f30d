"""Parameters of systems whose motion is computed: flexible links, springs; deviations are those that noise makes."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import Marker, PrismaticJoint, RigidBody, SpringDamper, System
from floatframe.design import sensitivities
from floatframe.design.identification.output_error import MeasuredOutputs, computed_outputs, fit_outputs
from floatframe.design.identification.scaled_link import scaled_body, scaled_link
from floatframe.errors import ModelError
from floatframe.sensors import PlaceSensor
from tests.floatframe.design.identification.flexible_arm import NOISE, OUTPUTS, TRUTH, arm, link

TIME = np.arange(61) * 0.05
TRUE = {"k": 40.0, "c": 1.2}


def oscillator(p):
    """A mass of p["m"] (2 kg) on a spring, let go from 0.1 m."""
    mass = RigidBody("mass", p.get("m", 2.0), np.eye(3), position=(1.1, 0, 0))
    guide = PrismaticJoint("guide", Marker("ground"), Marker("mass"), axis=(1, 0, 0))
    spring = SpringDamper("spring", Marker("ground"), Marker("mass"), p["k"], p["c"], 1.0)
    return System([mass], [guide], [spring], sensors=[PlaceSensor("place", Marker("mass"))])


@pytest.fixture(scope="module")
def swung():
    return computed_outputs(oscillator(TRUE), TIME, ["place x"]).table[:, 0]


def measured(values):
    return MeasuredOutputs(TIME, {"place x": values})


@pytest.fixture(scope="module")
def first(swung):
    return fit_outputs(oscillator, {"k": 30.0, "c": 0.5}, measured(swung + 1e-3 * noise(0)))


def noise(seed):
    return np.random.default_rng(seed).normal(size=len(TIME))


@pytest.mark.long
def test_bias_and_scatter_of_a_fit_are_those_it_predicts(swung, first):
    """16 noises: means within 4 standard errors, scatter of both parameters together within that of chi-squared."""
    n = 16
    made = [fit_outputs(oscillator, TRUE, measured(swung + 1e-3 * noise(k)), near=first) for k in range(1, n + 1)]
    error = np.array([each.values for each in made]) - np.array(list(TRUE.values()))
    deviation = np.mean([each.deviations for each in made], axis=0)
    assert np.abs(error.mean(axis=0) / deviation).max() * np.sqrt(n) < 4.0
    assert abs(np.sqrt(((error / deviation) ** 2).mean()) - 1) < 3.0 / np.sqrt(4 * n)
    assert np.mean([each.n_runs for each in made]) < 5
    assert np.mean([bool(each.warnings) for each in made]) < 0.1  # white


def at_row(k):
    """What takes the value of row k over time, with its derivatives."""
    return lambda values: (float(values[k]), np.eye(len(values))[k])


def test_derivatives_and_deviations_are_those_of_the_differentiated_steps(first):
    """Within the error of second order of differences, (1e-3 phase/2)²/6 with a phase of 13 rad."""
    at = dict(zip(first.names, first.values.tolist(), strict=True))
    paths = ["forces.spring.stiffness", "forces.spring.damping"]
    rows = {f"row {k}": ("place x", at_row(k)) for k in range(len(TIME))}
    S = sensitivities(oscillator(at), rows, paths, t_end=float(TIME[-1]), h=0.05).gradient
    made = fit_outputs(oscillator, at, measured(first.predicted[:, 0] + 1e-9 * noise(3)), sigma={"place x": 2e-3})
    assert_allclose(made.slopes[:, 0], S, rtol=0, atol=8e-6 * np.abs(S).max())
    assert_allclose(made.covariance, 4e-6 * np.linalg.inv(S.T @ S), rtol=1e-4)
    variance = made.deviations[1] ** 2 / 1.5**2
    assert_allclose(made.derived(lambda p: p["c"] / 1.5)[1] ** 2, variance, rtol=1e-9)


def test_what_the_model_lacks_is_told(swung):
    made = fit_outputs(lambda p: oscillator({"k": p["k"], "c": 0.8}), {"k": 39.0}, measured(swung + 1e-3 * noise(1)))
    assert "residuals of place x are not white" in made.warnings[0]


def test_parameters_that_act_alike_or_not_at_all_are_refused_by_name(swung):
    data = measured(swung + 1e-3 * noise(1))
    with pytest.raises(ModelError, match="k and m act alike"):
        fit_outputs(oscillator, {**TRUE, "m": 2.1}, data)
    with pytest.raises(ModelError, match="no output changes with color"):
        fit_outputs(oscillator, {**TRUE, "color": 1.0}, data)


def test_wrong_measurements_are_refused(swung, first):
    data = measured(swung)
    with pytest.raises(ModelError, match="guesses other than 0"):
        fit_outputs(oscillator, {"k": 40.0, "c": 0.0}, data)
    with pytest.raises(ModelError, match="divided by a whole number"):
        fit_outputs(oscillator, TRUE, data, h=0.03)
    with pytest.raises(ModelError, match="no such column"):
        fit_outputs(oscillator, TRUE, MeasuredOutputs(TIME, {"place w": swung}))
    with pytest.raises(ModelError, match="equally spaced, increasing times"):
        MeasuredOutputs(TIME**2, {"place x": swung})
    with pytest.raises(ModelError, match="61 values"):
        MeasuredOutputs(TIME, {"place x": swung[1:]})
    with pytest.raises(ModelError, match="a fit of the same parameters"):
        fit_outputs(oscillator, {"k": 40.0}, data, near=first)
    with pytest.raises(ModelError, match="sigma: no output 'place y'"):
        fit_outputs(oscillator, TRUE, data, sigma={"place y": 1.0})


def numbers(record):
    """The arrays of a record and of those in it, by name, but for what names another model."""
    found = {}
    for each in fields(record):
        value = getattr(record, each.name)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            found[each.name] = value
        elif is_dataclass(value):
            found |= {f"{each.name}.{name}": array for name, array in numbers(value).items()}
        elif isinstance(value, tuple) and value and is_dataclass(value[0]):
            found |= {f"{each.name}.{k}.{n}": a for k, one in enumerate(value) for n, a in numbers(one).items()}
    return found


def test_a_scaled_link_is_the_one_of_other_density_and_modulus():
    """Every number of it, but for the signs of modes, against the model reduced anew."""
    scaled, anew = (numbers(body) for body in (scaled_body(link(), 0.8, 1.3), link(1.3 * 7e10, 0.8 * 2700.0)))
    assert scaled.keys() == anew.keys()
    for name, expected in anew.items():
        if name != "interfaces.0.Psi":  # the root, which the frame holds: rounding
            size = np.abs(expected).max(initial=0.0)
            assert_allclose(np.abs(scaled[name]), np.abs(expected), rtol=0, atol=1e-9 * size, err_msg=name)


@pytest.mark.long  # the scaled link is tested above, the fit with a spring
def test_a_flexible_link_is_identified_with_its_inertia():
    """Hub, payload, mass, stiffness and damping of the link from torque, tip and base, from 1 % beside."""
    t, n_p = np.arange(101) * 0.01, len(TRUTH)
    exact = computed_outputs(arm(TRUTH), t, OUTPUTS, h=0.01).table
    seen = exact + NOISE * np.random.default_rng(5).normal(size=exact.shape)
    guess = {name: value * (1 + 0.01 * (-1) ** k) for k, (name, value) in enumerate(TRUTH.items())}
    made = fit_outputs(arm, guess, MeasuredOutputs(t, dict(zip(OUTPUTS, seen.T, strict=True))), h=0.01)
    z = (made.values - np.array(list(TRUTH.values()))) / made.deviations
    assert (z**2).sum() < n_p + 5 * np.sqrt(2 * n_p)
    assert made.deviations[1:5].max() < 0.01  # payload, factors of mass and stiffness, damping ratio
    assert_allclose(made.sigma, NOISE, rtol=0.3)
    f_0 = link().frequencies[0]
    f, deviation = made.derived(lambda p: f_0 * np.sqrt(p["stiffness"] / p["mass"]))
    assert abs(f - f_0 * np.sqrt(TRUTH["stiffness"] / TRUTH["mass"])) < 4 * deviation < 0.05


def test_factors_of_a_link_are_positive():
    body = arm(TRUTH).bodies[1]
    with pytest.raises(ModelError, match="mass: expected a factor above 0"):
        scaled_link(body, mass=-1.0)
    with pytest.raises(ModelError, match="ratios of 0 or more"):
        scaled_link(body, damping=[-0.1])
