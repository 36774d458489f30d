"""Equilibria by loads that grow, where Newton's method and the flow lose their way."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from floatframe.analyses.led_equilibrium import Balance, is_left_by_none, led_equilibrium
from floatframe.start.newton_equations import Linearized


def led(f, slope, x0):
    """Return where loads lead for one unknown without rows."""

    def balance(x, w):
        return Balance(f(x), np.zeros(0), lambda force, _: (-force / slope(x), np.zeros(0)))

    found = led_equilibrium(
        np.array([x0]), np.zeros(0), balance, lambda x, way: x + way, lambda way: float(np.abs(way).max())
    )
    return None if found is None else float(found[0][0])


def test_a_root_that_newton_leaves_is_found():
    def f(x):
        return np.arctan(4 * (x - 2.0))

    x = led(f, lambda x: 4 / (1 + 16 * (x - 2.0) ** 2), 0.5)
    assert_allclose(x, 2.0, atol=1e-6)
    step = float((f(np.array([0.5])) / (4 / (1 + 16 * 1.5**2)))[0])
    assert abs(0.5 - step - 2.0) > 1.5  # Newton's first step leads further away


def test_nothing_is_found_where_there_is_nothing():
    assert led(lambda x: x**2 + 1.0, lambda x: 2 * x, 1.0) is None


@pytest.mark.parametrize(("k", "is_stable"), [(2.0, True), (-2.0, False)])
def test_an_equilibrium_that_the_flow_leaves_is_told(k, is_stable):
    none = sp.csr_array((0, 2))
    parts = Linearized((), none, none, sp.csr_array((0, 0)))
    assert is_left_by_none(parts, (np.diag([1.0, k]),), (np.eye(2),)) is is_stable
    held = sp.csr_array(np.array([[0.0, 1.0]]))  # the second unknown is held
    parts = Linearized((), held, held, sp.csr_array((1, 1)))
    assert is_left_by_none(parts, (np.diag([1.0, k]),), (np.eye(2),))
