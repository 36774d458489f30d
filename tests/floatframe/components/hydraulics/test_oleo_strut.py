"""An oleo-pneumatic strut: a drop of two masses against an independent model, energy, statics of the gas, bad input."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from floatframe import GeneralizedAlpha, Marker, integrate
from floatframe.errors import ModelError
from floatframe.model.functions.tables import monotone_table
from floatframe.results import element_motion
from tests.floatframe.components.hydraulics.oleo_strut_examples import (
    A_GAS,
    A_OIL,
    AREA,
    CHARGE,
    DISCHARGE,
    FALL,
    GAS,
    HEIGHT,
    LENGTH,
    LOWER,
    RECOIL,
    SEAL,
    SEAL_AREA,
    SLOW,
    SPEED,
    STOP,
    STOP_DAMPING,
    STROKE,
    TYRE,
    TYRE_DAMPING,
    UPPER,
    N,
    drop,
    strut,
)
from tests.floatframe.element_laws import evaluate, marker_motion, placed, power_defect
from tests.floatframe.finite_differences import assert_tangent_is_exact


def independent(t_end, oil_volume=None):
    """Height and speed of both masses, and the pressure of compressible oil."""
    p_a, rho, K, width = 101325.0, 870.0, 1.4e9, 101325.0 / 50

    def specific_volume(p):
        return np.exp(-(p - p_a) / K) + np.exp(-p / width)

    def rates(t, y):
        upper, lower, v_upper, v_lower = y[:4]
        s, rate = LENGTH - (upper - lower), v_lower - v_upper
        volume = GAS - A_GAS * s
        if oil_volume:
            volume -= oil_volume * (specific_volume(y[4]) - specific_volume(CHARGE))
        gas = CHARGE * (GAS / volume) ** N
        hole = DISCHARGE * (AREA(s) if rate > 0 else RECOIL)
        pressure_rate = []
        if oil_volume:
            drop = y[4] - gas
            hole = DISCHARGE * (AREA(s) if drop > 0 else RECOIL)
            q = hole * np.sqrt(2 / rho) * drop / (drop**2 + (1e-3 * p_a) ** 2) ** 0.25
            slope = np.exp(-(y[4] - p_a) / K) / K + np.exp(-y[4] / width) / width
            pressure_rate = [(A_OIL * rate - q) / (oil_volume * slope)]
            oil = y[4]
        else:
            lost = gas + np.sign(rate) * rho / 2 * (A_OIL * rate / hole) ** 2
            oil = (lost + np.hypot(lost, width)) / 2
        seals = (SEAL + SEAL_AREA * (gas - p_a)) * rate / np.hypot(rate, SLOW)
        stops = 0.0
        if s < 0:
            stops = -STOP * -s * max(1 - STOP_DAMPING * rate, 0)
        elif s > STROKE:
            stops = STOP * (s - STROKE) * max(1 + STOP_DAMPING * rate, 0)
        force = (gas - p_a) * A_GAS + (oil - gas) * A_OIL + seals + stops
        ground = -TYRE * (lower - HEIGHT) - TYRE_DAMPING * v_lower
        return [v_upper, v_lower, force / UPPER - FALL, (ground - force) / LOWER - FALL, *pressure_rate]

    start = [HEIGHT + LENGTH, HEIGHT, -SPEED, -SPEED] + ([CHARGE] if oil_volume else [])
    atol = [1e-11] * 4 + ([1e-3] if oil_volume else [])
    return solve_ivp(rates, (0, t_end), start, method="Radau", rtol=1e-9, atol=atol, max_step=2e-3)


@pytest.mark.parametrize("oil_volume", [None, 1.2e-3])
def test_a_drop_of_two_masses_is_that_of_an_independent_model(oil_volume):
    system = drop(oil_volume=oil_volume)
    t_end = 0.4
    motion = integrate(system, GeneralizedAlpha(0.9, 1e-11), t_end, 2e-5, output_every=400)
    exact = independent(t_end, oil_volume)
    found = [motion.body("upper").r[-1, 2], motion.body("lower").r[-1, 2]]
    stroke = exact.y[1] - exact.y[0] + LENGTH
    assert stroke.max() > 0.25  # it has been through compression, and recoils
    assert stroke[-1] < 0.8 * stroke.max()
    assert_allclose(found, exact.y[:2, -1], rtol=1e-6)
    seen = element_motion(system, motion, "strut").outputs
    assert_allclose(seen["stroke"][-1], stroke[-1], rtol=1e-5)


@pytest.mark.parametrize("oil_volume", [None, 2e-3])
@pytest.mark.parametrize("s", [-0.01, 0.1, 0.31, 0.33])
@pytest.mark.parametrize("rate", [3.0, -3.0])
def test_what_the_strut_takes_is_stored_or_lost(oil_volume, s, rate):
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    e = turn @ (0, 0.6, 0.8)
    a = marker_motion([0.1, 0, 0], turn, (1, 2, 3), (1, 2, -3))
    b = marker_motion([0.1, 0, 0] + e * (LENGTH - s) + 0.01 * turn[:, 0], turn @ turn, -rate * e, (10, 30, 20))
    x = np.array([a, b])
    law = strut(Marker("upper"), Marker("lower"), (0, 0.6, 0.8), oil_volume=oil_volume).law(placed(x))
    z = np.array(law.start) * rng.uniform(0.5, 1.5)
    wrench, _, seen = evaluate(law, 0.0, x, z)
    defect, throughput = power_defect(law, 0.0, x, z)
    assert abs(defect) <= 1e-12 * throughput
    assert seen["power lost"] > 0
    moment = (wrench[:, 3:] + np.cross(x[:, :3], wrench[:, :3])).sum(axis=0)
    assert_allclose(moment, 0, atol=1e-12 * np.abs(wrench).max())
    assert_allclose(wrench[0, :3], -wrench[1, :3], rtol=0, atol=0)


def test_a_pulled_strut_cavitates_at_the_vapour_pressure():
    """Recoil at 30 m/s would need an oil pressure far below zero; the force is that of the vapour pressure."""
    x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, LENGTH - 0.1], v=[0, 0, 30.0])])
    law = strut(Marker("upper"), Marker("lower"), (0, 0, 1), friction=0.0, friction_area=0.0).law(placed(x))
    seen = evaluate(law, 0.0, x, np.zeros(0))[2]
    assert 0 <= seen["oil pressure"] < 1.0
    pulled = (seen["gas pressure"] - 101325.0) * A_GAS - seen["gas pressure"] * A_OIL
    assert_allclose(seen["force"], pulled, rtol=1e-5)


@pytest.mark.parametrize("oil_volume", [None, 1.2e-3])
def test_the_tangent_of_a_strut_is_exact(oil_volume):
    assert_tangent_is_exact(drop(oil_volume=oil_volume))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"gas_volume": 1e-3},
            "gas_volume: expected more than gas_area times stroke = 0.00128, got 0.001",
        ),
        ({"area": monotone_table([0.0, 0.3], [1e-4, -1e-5])}, "area: expected areas above 0 over the stroke, got -"),
        ({"charge": -6e5}, "element 'strut': charge: expected a number above 0, got -600000"),
        ({"recoil_area": 0.0}, "recoil_area: expected a number above 0, got 0"),
    ],
)
def test_a_strut_that_cannot_be_is_refused(options, message):
    with pytest.raises(ModelError, match=message):
        strut(Marker("upper"), Marker("lower"), (0, 0, 1), **options)


def test_a_strut_that_is_placed_elsewhere_is_refused():
    for distance, message in (
        (-0.7, "marker_b lies -0.7 along the axis from marker_a as placed; expected one above 0: does the axis point"),
        (
            0.1,
            "its markers are 0.1 apart along the axis as placed, stroke 0.7; expected 0 to 0.32",
        ),
    ):
        x = np.array([marker_motion([0, 0, 0]), marker_motion([0, 0, distance])])
        with pytest.raises(ModelError, match=message):
            strut(Marker("upper"), Marker("lower"), (0, 0, 1)).law(placed(x))
