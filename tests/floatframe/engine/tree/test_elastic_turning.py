"""Second derivatives of the Jacobian of the exponential: closed forms and series beside differences and each other."""

import math

import pytest
from numpy.testing import assert_allclose

from floatframe.engine.kernels.rotation import quotient_da, quotient_db
from floatframe.engine.tree.kernels.elastic_turning import SERIES_UP_TO, quotient_dda, quotient_ddb

PAIRS = [(quotient_da.py_func, quotient_dda.py_func), (quotient_db.py_func, quotient_ddb.py_func)]


@pytest.mark.parametrize(("function", "derivative"), PAIRS)
@pytest.mark.parametrize("t", [0.8, 1.9, 2.1, 3.5])
def test_they_are_the_derivatives_of_the_first_ones(function, derivative, t):
    h = 1e-3
    near, far = (function((t + k * h) ** 2) - function((t - k * h) ** 2) for k in (1, 2))
    assert_allclose(derivative(t * t), (8 * near - far) / (12 * h) / t, rtol=1e-8)


@pytest.mark.parametrize("derivative", [pair[1] for pair in PAIRS])
def test_series_and_closed_form_meet_at_the_switch(derivative):
    below, above = derivative(SERIES_UP_TO), derivative(math.nextafter(SERIES_UP_TO, 5.0))
    assert_allclose(above, below, rtol=1e-12)
