"""Equilibria by loads that grow, where Newton's method and the flow lose their way."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from floatframe.analyses.equilibrium import words_of
from floatframe.analyses.led_equilibrium import Balance, LoadPathEnd, is_left_by_none, led_equilibrium
from floatframe.engine.initial_conditions.newton_equations import Linearized


def led(f, slope, x0):
    """Return where loads lead for one unknown without rows."""

    def balance(x, w):
        return Balance(f(x), np.zeros(0), lambda force, _: (-force / slope(x), np.zeros(0)))

    found = led_equilibrium(
        np.array([x0]), np.zeros(0), balance, lambda x, way: x + way, lambda way: float(np.abs(way).max())
    )
    return found.state[0], found


def test_a_root_that_newton_leaves_is_found():
    def f(x):
        return np.arctan(4 * (x - 2.0))

    x, found = led(f, lambda x: 4 / (1 + 16 * (x - 2.0) ** 2), 0.5)
    assert found.p == 1.0
    assert_allclose(x, 2.0, atol=1e-6)
    step = float((f(np.array([0.5])) / (4 / (1 + 16 * 1.5**2)))[0])
    assert abs(0.5 - step - 2.0) > 1.5  # Newton's first step leads further away


def test_nothing_is_found_where_there_is_nothing():
    """x² + 1 = 2 (1 - p) has a root up to p = 1/2; that is told after few solves."""
    x, found = led(lambda x: x**2 + 1.0, lambda x: 2 * x, 1.0)
    assert_allclose(x**2 + 1.0, 2 * (1 - found.p), atol=1e-3)
    assert 0.45 < found.p <= 0.5
    assert found.n_solves <= 60


@pytest.mark.parametrize(("k", "is_stable"), [(2.0, True), (-2.0, False)])
def test_an_equilibrium_that_the_flow_leaves_is_told(k, is_stable):
    none = sp.csr_array((0, 2))
    parts = Linearized((), none, none, sp.csr_array((0, 0)))
    assert is_left_by_none(parts, (np.diag([1.0, k]),), (np.eye(2),)) is is_stable
    held = sp.csr_array(np.array([[0.0, 1.0]]))  # the second unknown is held
    parts = Linearized((), held, held, sp.csr_array((1, 1)))
    assert is_left_by_none(parts, (np.diag([1.0, k]),), (np.eye(2),))


def test_where_loads_have_led_is_told():
    def words(p, n_solves, *, is_stable=False):
        return words_of(LoadPathEnd(np.zeros(1), np.zeros(0), p, n_solves), is_stable)

    assert words(0.0, 0) == ""
    assert words(0.37, 52) == ", nor by increasing loads (52 solves, up to 37 % of them)"
    assert words(1.0, 9) == ", and increasing loads (9 solves) lead only to an unstable one"
    assert words(1.0, 9, is_stable=True) == ", nor by increasing loads (9 solves, up to 100 % of them)"
