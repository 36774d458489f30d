"""Functions of a rotation vector without a branch: their numbers, and their derivatives of any order."""

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.design.generation.graph import CONSTANT, COS, NEG, SIN, STUMPFF, SYMBOL, Graph, reachable
from floatframe.design.generation.rotation_series import expanded, rotation_matrix
from floatframe.design.generation.routines import derivative
from floatframe.model.rotations import rotation_exp
from tests.floatframe.design.generation.calls import values_of


def exact(k, x):
    """Return c_k(x) as a fraction."""
    x = Fraction(x)
    return sum((-x) ** j / math.factorial(2 * j + k) for j in range(40))


@pytest.mark.parametrize(("angle", "rtol"), [(0.0, 1e-15), (1e-9, 1e-15), (0.3, 1e-15), (2.0, 2e-15), (4.0, 2e-15)])
def test_written_out_they_are_those_of_the_series(angle, rtol):
    graph = Graph()
    x = graph.symbol("x")
    terms = expanded(graph, [graph.stumpff(k, x) for k in range(8)])
    assert not any(term.kind == STUMPFF for term in reachable(terms))
    expected = [float(exact(k, angle**2)) for k in range(8)]
    assert_allclose(values_of(terms, {"x": angle**2}), expected, rtol=rtol, atol=0)


def test_alone_each_is_as_good_up_to_four_radians():
    """The highest of each parity is the polynomial, so that others do not lend it their order."""
    for k in range(1, 6):
        graph = Graph()
        value = expanded(graph, [graph.stumpff(k, graph.symbol("x"))])
        assert_allclose(values_of(value, {"x": 16.0}), [float(exact(k, 16))], rtol=0, atol=1e-15)


def test_a_derivative_is_that_of_a_complex_step():
    graph = Graph()
    x = graph.symbol("x")
    terms = [graph.stumpff(k, x) for k in range(6)]
    changes = derivative(graph, reachable(terms), {x: graph.one})
    slopes = expanded(graph, [changes[term.index] for term in terms])
    for at in (0.0, 0.1, 3.0):
        expected = values_of(expanded(graph, terms), {"x": at + 1e-30j}).imag / 1e-30
        assert_allclose(values_of(slopes, {"x": at}), expected, rtol=1e-13, atol=0)


@pytest.mark.parametrize("th", [(0, 0, 0), (0, 0.7, 0), (1e-8, 0, 2e-8), (0.3, -0.2, 0), (1.5, 2.0, -1.0)])
def test_the_rotation_matrix_is_that_of_the_exponential(th):
    graph = Graph()
    symbols = [graph.symbol(name) if value else graph.zero for name, value in zip("xyz", th, strict=True)]
    R = rotation_matrix(graph, np.array(symbols, dtype=object))
    got = values_of(expanded(graph, list(R.ravel())), dict(zip("xyz", th, strict=True)))
    assert_allclose(got.reshape(3, 3), rotation_exp(np.array(th, dtype=float)), rtol=0, atol=1e-15)


def test_a_rotation_about_one_axis_is_a_sine_and_a_cosine():
    graph = Graph()
    R = rotation_matrix(graph, np.array([graph.zero, graph.symbol("y"), graph.zero], dtype=object))
    assert {term.kind for term in reachable(R.ravel())} <= {CONSTANT, SIN, COS, NEG, SYMBOL}
