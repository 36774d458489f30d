import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.linear_algebra.solvers.tall import combine, combined, inner, ordered, subtract

ROUNDOFF = 1e-12


def columns(n, k, order, seed=0):
    return np.asarray(np.random.default_rng(seed).standard_normal((n, k)), order=order)


@pytest.mark.parametrize("n", [50, 30_001])  # one thread; several, in slices of unequal length
@pytest.mark.parametrize("order_x", ["C", "F"])
@pytest.mark.parametrize("order_y", ["C", "F"])
def test_products_are_those_of_numpy_in_any_order(n, order_x, order_y):
    X, Y = columns(n, 7, order_x), columns(n, 3, order_y, seed=1)
    C = columns(7, 3, "C", seed=2)
    assert_allclose(inner(X, Y), X.T @ Y, rtol=0, atol=ROUNDOFF * n)
    product = combine(X, C)
    assert_allclose(product, X @ C, rtol=0, atol=ROUNDOFF)
    assert product.flags.c_contiguous == (order_x == "C")
    assert combine(X, C, order=order_y).flags.c_contiguous == (order_y == "C")
    assert_allclose(combine(X, C, order=order_y), X @ C, rtol=0, atol=ROUNDOFF)
    expected = Y - X @ C
    subtract(Y, X, C)
    assert_allclose(Y, expected, rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("n", [50, 30_001])
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_change_of_order_keeps_every_entry(n, order):
    X = columns(n, 5, "C")
    result = ordered(X, order)
    assert_array_equal(result, X)
    assert result.flags.c_contiguous == (order == "C")
    assert ordered(result, order) is result


def test_parts_of_rows_are_combined_in_place_of_copies():
    rows = columns(20, 40_000, "C")
    V = rows[:8].T
    C = columns(8, 2, "C", seed=1)
    assert_allclose(combine(V, C), V @ C, rtol=0, atol=ROUNDOFF)
    assert combine(V, C).flags.f_contiguous


def test_columns_are_combined_in_their_place_down_to_none():
    X = np.random.default_rng(0).standard_normal((50, 5))
    for k in (5, 1):
        for m in range(k + 1):
            for order in "CF":
                C = np.random.default_rng(m).standard_normal((k, m))
                some = np.array(X[:, :k], order=order)
                assert_allclose(combined(some, C), X[:, :k] @ C, rtol=0, atol=1e-14)
