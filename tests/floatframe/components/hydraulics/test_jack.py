"""A mass on a cylinder with orifice and accumulator, against an independent model of the same equations."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from floatframe import GeneralizedAlpha, integrate
from floatframe.results import element_motion
from floatframe.results.energy_balance import balance_defect, energy_scale
from tests.floatframe.components.hydraulics.jack_examples import (
    AMBIENT,
    AREA,
    CHARGE,
    EXPONENT,
    FALL,
    GAS,
    GAS_NODE,
    HEAD_VOLUME,
    HOLE,
    MASS,
    RHO,
    START,
    STROKE,
    K,
    jack,
)


def independent(t_end):
    """Stroke, its rate, pressures of cylinder and gas: mass in each node by the exponential law of its density."""

    def rates(t, y):
        s, v, p_1, p_2 = y
        drop = p_1 - p_2
        q = 0.7 * HOLE * np.sqrt(2 / RHO) * drop / (drop**2 + (1e-3 * AMBIENT) ** 2) ** 0.25
        r_1, r_2 = np.exp((p_1 - AMBIENT) / K), np.exp((p_2 - AMBIENT) / K)
        oil = GAS * (1 - (CHARGE / p_2) ** (1 / EXPONENT))
        slope = GAS / EXPONENT * (CHARGE / p_2) ** (1 / EXPONENT) / p_2
        p_1_dot = (-q - AREA * v * r_1) / ((HEAD_VOLUME + AREA * s) * r_1 / K)
        p_2_dot = q / ((GAS_NODE + oil) * r_2 / K + r_2 * slope)
        return [v, (p_1 - AMBIENT) * AREA / MASS - FALL, p_1_dot, p_2_dot]

    start, atol = [STROKE, 0, START, START], [1e-13, 1e-13, 1e-5, 1e-5]
    return solve_ivp(rates, (0, t_end), start, method="Radau", rtol=1e-10, atol=atol).y[:, -1]


def test_a_mass_on_a_cylinder_with_orifice_and_accumulator_moves_as_by_an_independent_model():
    system = jack()
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-11), 0.3, 1e-4)
    seen = element_motion(system, motion, "circuit").outputs
    found = [seen[key][-1] for key in ("stroke jack", "rate jack", "pressure head", "pressure gas")]
    assert_allclose(found, independent(0.3), rtol=1e-6)
    assert_allclose(seen["content"], seen["content"][0], rtol=1e-8)
    assert np.abs(balance_defect(motion)).max() < 1e-7 * energy_scale(motion)


def test_a_node_far_faster_than_the_step_is_no_trouble():
    """The orifice fills the 20 cm³ of oil at the gas far faster than a step; without gas the pressures are equal."""
    system = jack()
    rate = K / (HEAD_VOLUME + AREA * STROKE) * 0.7 * HOLE * np.sqrt(2 / RHO) / np.sqrt(1e-3 * AMBIENT)
    h = 4e-4
    assert rate * h > 40  # explicit steps would have to be shorter than 2/rate
    seen = element_motion(system, integrate(system, GeneralizedAlpha(0.9, 1e-11), 0.3, h), "circuit").outputs
    found = [seen[key][-1] for key in ("stroke jack", "pressure head", "pressure gas")]
    assert_allclose(found, independent(0.3)[[0, 2, 3]], rtol=1e-5)
