import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.interpolate import RegularGridInterpolator

from floatframe.errors import ModelError
from floatframe.model.elements.curves import function_at, function_integral_at, function_numbers, grid_at, grid_numbers
from floatframe.model.functions.time_functions import constant, harmonic, piecewise, polynomial_of_time, smooth_step

FUNCTION = piecewise(
    [0.5, 1.0, 2.5], [polynomial_of_time([1.0, -2.0, 0.5, 3.0]), harmonic(2.0, 7.0, 0.4, 1.5), smooth_step(0, 1, 3, 4)]
)


@pytest.mark.parametrize("x", [-1.0, 0.5, 0.9, 1.7, 2.5, 3.1, 9.0])
def test_a_function_in_data_is_the_function(x):
    data = np.array([7.0, *function_numbers(FUNCTION)])
    assert_allclose(function_at(data, 1, x), FUNCTION(x), rtol=1e-13, atol=0)
    assert_allclose(function_at(data, 1, x + 1e-30j).imag / 1e-30, FUNCTION(x, 1), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("function", [FUNCTION, constant(3.0), harmonic(2.0, 0.0, 1.0)])
def test_the_integral_of_a_function_is_that_of_quadrature(function):
    data = np.array(function_numbers(function))
    for begin, end in ((-1.0, 0.8), (0.6, 1.4), (0.7, 3.2), (2.6, 9.0)):
        points = [x for x in function.begins if begin < x < end] or None
        area = quad(function, begin, end, points=points, epsabs=1e-13, epsrel=1e-13)[0]
        difference = function_integral_at(data, 0, end) - function_integral_at(data, 0, begin)
        assert_allclose(difference, area, rtol=1e-11, atol=1e-12)


def test_a_grid_in_data_is_bilinear_and_held_beyond_its_edges():
    x, y, values = [0.0, 1.0, 4.0], [-2.0, 0.0, 0.5, 3.0], np.random.default_rng(1).normal(size=(3, 4))
    data = np.array([1.0, 2.0, *grid_numbers("map", x, y, values)])
    there = RegularGridInterpolator((x, y), values)
    for a, b in np.random.default_rng(2).uniform(-3, 5, (30, 2)):
        assert_allclose(grid_at(data, 2, a, b), there([np.clip(a, 0, 4), np.clip(b, -2, 3)])[0], rtol=1e-12, atol=1e-13)


def test_grids_that_do_not_fit_are_refused_by_name():
    with pytest.raises(ModelError, match=r"map: y: expected two or more rising numbers, got \[1.0, 1.0\]"):
        grid_numbers("map", [0.0, 1.0], [1.0, 1.0], np.zeros((2, 2)))
    with pytest.raises(ModelError, match=r"map: values: expected shape \(2, 3\), got \(3, 2\)"):
        grid_numbers("map", [0.0, 1.0], [1.0, 2.0, 3.0], np.zeros((3, 2)))
