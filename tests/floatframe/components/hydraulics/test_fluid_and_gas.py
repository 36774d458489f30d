"""What the fluid and the gas of accumulators do over pressure: slopes, integrals, limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from floatframe.components.hydraulics.fluid import Fluid, compression
from floatframe.components.hydraulics.gas import gas_numbers, oil_in_accumulator

STEP = 1e-20
FLUIDS = [
    Fluid(870.0, 1.4e9, 101325.0),
    Fluid(870.0, 1.4e9, 1e5, air=0.02),
    Fluid(870.0, 1e9, 1e5, 0.03, 0.01, 1.0, 2e3),
]


@pytest.mark.parametrize("fluid", FLUIDS)
@pytest.mark.parametrize("p", [-8e4, -3e3, 50.0, 3e3, 4e4, 1e5, 2e7])
def test_slope_and_work_of_a_fluid_are_derivative_and_integral_of_its_volume(fluid, p):
    numbers = np.array(fluid.numbers)
    v, dv, h = compression(p, numbers, 0)
    v_c, _, h_c = compression(p + 1j * STEP, numbers, 0)
    assert_allclose([v_c.imag / STEP, h_c.imag / STEP], [dv, v], rtol=1e-12)
    assert dv < 0
    assert_allclose(compression(fluid.ambient, numbers, 0)[::2], [1, 0], rtol=0, atol=1e-6)
    if p > 2e4:
        area = quad(lambda x: compression(x, numbers, 0)[0], fluid.ambient, p, epsrel=1e-11)[0]
        assert_allclose(h, area, rtol=1e-9, atol=1e-6)


def test_the_pressure_of_a_pulled_fluid_stays_near_that_of_its_vapour():
    fluid = Fluid(870.0, 1.4e9, 1e5, vapour_pressure=5e3)
    assert fluid.compression(5e3)[0] == pytest.approx(2, rel=1e-4)  # as much vapour as oil
    assert fluid.compression(5e3 - 3 * 1.9e3)[0] > 20
    assert fluid.compression(3e4)[0] < 1 + 1e-4


@pytest.mark.parametrize("exponent", [1.0, 1.4])
def test_the_oil_in_an_accumulator_is_continuous_with_its_slope_and_its_integral(exponent):
    numbers = np.array(gas_numbers(1e-3, 5e6, exponent, 8e-4))
    corners = numbers[4:8]
    places = [
        4e6,
        *corners * (1 + 1e-9),
        *corners * (1 - 1e-9),
        *(corners[::2] + corners[1::2]) / 2,
        8e6,
        corners[3] * 1.2,
    ]
    for p in places:
        U, dU, area = oil_in_accumulator(p, numbers, 0)
        U_c, _, area_c = oil_in_accumulator(p + 1j * STEP, numbers, 0)
        assert_allclose([U_c.imag / STEP, area_c.imag / STEP], [dU, U], rtol=1e-11, atol=1e-18)
        within = [corner for corner in corners if 4e6 < corner < p] or None
        exact = quad(lambda x: oil_in_accumulator(x, numbers, 0)[0], 4e6, p, points=within, epsabs=1e-9, epsrel=1e-11)[
            0
        ]
        assert_allclose(area, exact, rtol=1e-8, atol=1e-8)
    for corner in corners:
        below, above = (np.array(oil_in_accumulator(corner * (1 + d), numbers, 0)) for d in (-1e-12, 1e-12))
        assert_allclose(below, above, rtol=1e-8, atol=1e-16)
    assert_allclose(oil_in_accumulator(8e6, numbers, 0)[0], 1e-3 * (1 - (5 / 8) ** (1 / exponent)), rtol=1e-13)
    assert oil_in_accumulator(4.9e6, numbers, 0)[0] == 0
    assert oil_in_accumulator(corners[3], numbers, 0)[0] == pytest.approx(8e-4, rel=1e-12)
