"""Derivatives of terms beside complex steps; the simplifications of the graph beside plain arithmetic."""

import cmath
import operator

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.errors import ModelError
from floatframe.generation.derivatives import jacobian, seeds_of
from floatframe.generation.graph import ADD, CONSTANT, COS, DIV, MUL, NEG, SIN, SUB, Graph, reachable

CALLS = {
    ADD: operator.add, SUB: operator.sub, MUL: operator.mul, DIV: operator.truediv, NEG: operator.neg, SIN: cmath.sin,
    COS: cmath.cos,
}  # fmt: skip


def values_of(outputs, inputs):
    """Evaluate terms, operation by operation; inputs: symbol -> number."""
    value = {symbol.index: each for symbol, each in inputs.items()}
    for term in reachable(outputs):
        if term.kind == CONSTANT:
            value[term.index] = term.value
        elif term.args:
            value[term.index] = CALLS[term.kind](*(value[each.index] for each in term.args))
    return np.array([value[term.index] for term in outputs])


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
    _, symbols, outputs = made
    for point in np.random.default_rng(0).uniform(-1, 1, (5, 3)):
        got = values_of(outputs, dict(zip(symbols, point, strict=True)))
        assert_allclose(got, some_terms(*point, np.sin, np.cos), rtol=0, atol=1e-14)


def test_derivatives_are_those_of_complex_steps(made):
    graph, symbols, outputs = made
    by = jacobian(graph, outputs, seeds_of(graph, symbols))
    for point in np.random.default_rng(1).uniform(-1, 1, (5, 3)):
        got = values_of(by.ravel(), dict(zip(symbols, point, strict=True))).reshape(by.shape)
        steps = point + 1e-30j * np.eye(3)
        expected = np.array([some_terms(*each, np.sin, np.cos) for each in steps]).imag.T / 1e-30
        assert_allclose(got.real, expected, rtol=0, atol=1e-13)


def test_a_term_divided_by_zero_is_told():
    graph = Graph()
    with pytest.raises(ModelError, match="divided by zero"):
        graph.symbol("x") / 0.0
