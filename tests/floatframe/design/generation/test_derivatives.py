"""Derivatives of terms beside complex steps; the simplifications of the graph beside plain arithmetic."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.design.generation.graph import Graph
from floatframe.design.generation.routines import jacobian, seeds_of
from floatframe.errors import ModelError
from tests.floatframe.design.generation.calls import values_of


def some_terms(x, y, z, sin, cos):
    """Expressions of all operations, by terms or by numbers."""
    a = (x - 2.0 * y) / (z + 3.0)
    b = -(sin(x * y) - 0.5 * cos(-z)) / (2.0 - a)
    c = 2.0 * x + 3.0 * x - (y - x) - y + ((z + y) - y)
    return [a, b * a - c, sin(-b) * c + 1.0 / (x + 4.0), (c - 2.0 * c) * cos(a + b) - (-z)]


@pytest.fixture
def made():
    graph = Graph()
    symbols = [graph.symbol(name) for name in "xyz"]
    return graph, symbols, np.array(some_terms(*symbols, graph.sin, graph.cos), dtype=object)


def test_terms_have_the_values_of_what_they_were_made_of(made):
    _, _, outputs = made
    for point in np.random.default_rng(0).uniform(-1, 1, (5, 3)):
        got = values_of(outputs, dict(zip("xyz", point, strict=True)))
        assert_allclose(got, some_terms(*point, np.sin, np.cos), rtol=0, atol=1e-14)


def test_derivatives_are_those_of_complex_steps(made):
    graph, symbols, outputs = made
    by = jacobian(graph, outputs, seeds_of(graph, symbols))
    for point in np.random.default_rng(1).uniform(-1, 1, (5, 3)):
        got = values_of(by.ravel(), dict(zip("xyz", point, strict=True))).reshape(by.shape)
        steps = point + 1e-30j * np.eye(3)
        expected = np.array([some_terms(*each, np.sin, np.cos) for each in steps]).imag.T / 1e-30
        assert_allclose(got, expected, rtol=0, atol=1e-13)


def test_a_term_divided_by_zero_is_told():
    graph = Graph()
    with pytest.raises(ModelError, match="divided by zero"):
        graph.symbol("x") / 0.0
