import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.foundation.tall.columns import (
    are_finite,
    beside,
    combine,
    combined,
    copied,
    dots,
    in_memory,
    inner,
    ordered,
    rows_times,
    subtract,
)

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


class HalvedColumns:
    """Columns in two pieces, with the members of the protocol that the functions use."""

    def __init__(self, first, second):
        self.pieces, self.shape = (first, second), (len(first) + len(second), first.shape[1])

    def __getitem__(self, index):
        if isinstance(index, tuple):
            return HalvedColumns(*(piece[index] for piece in self.pieces))
        return self.whole()[index]

    def on_rows(self, function, *arguments):
        halves = zip(*(a.pieces if isinstance(a, HalvedColumns) else (a, a) for a in arguments), strict=True)
        return [function(*each) for each in halves]

    def made(self, k, function, *arguments):
        return HalvedColumns(*self.on_rows(function, *arguments))

    def like(self, X):
        n = len(self.pieces[0])
        return X if isinstance(X, HalvedColumns) else HalvedColumns(X[:n].copy(), X[n:].copy())

    def beside(self, *blocks):
        return HalvedColumns(*self.on_rows(beside, *(self.like(X) for X in blocks)))

    def whole(self):
        return np.concatenate(self.pieces)


def test_columns_of_any_kind_are_treated_as_arrays():
    X, Y, C = columns(50, 4, "C"), columns(50, 3, "F", seed=1), columns(4, 3, "C", seed=2)
    far, far_Y, d = HalvedColumns(X[:20].copy(), X[20:].copy()), HalvedColumns(Y[:20].copy(), Y[20:].copy()), Y[:, 0]
    S = sp.csr_array((np.array([2.0, -1.0]), (np.array([0, 1]), np.array([3, 40]))), shape=(2, 50))
    close = {"rtol": 0, "atol": ROUNDOFF * 50}
    assert_allclose(inner(far, far_Y), X.T @ Y, **close)
    assert_allclose(inner(far, Y), X.T @ Y, **close)
    assert_allclose(inner(X, far_Y), X.T @ Y, **close)
    for products in (dots(far, far), dots(far, X), dots(X, far)):
        assert_allclose(products, (X * X).sum(axis=0), **close)
    assert_allclose(dots(far, far, d), d @ X**2, **close)
    assert_allclose(rows_times(S, far), S @ X, **close)
    for product in (combine(far, C), combined(far, C)):
        assert isinstance(product, HalvedColumns)
        assert_allclose(in_memory(product), X @ C, **close)
    for made, expected in (
        (copied(far), X),
        (beside(Y, far), np.hstack([Y, X])),
        (beside(far, far_Y), np.hstack([X, Y])),
    ):
        assert isinstance(made, HalvedColumns)
        assert_array_equal(in_memory(made), expected)
    kept = copied(far_Y)
    subtract(far_Y, X, C)
    assert_allclose(in_memory(far_Y), Y - X @ C, **close)
    assert_array_equal(in_memory(kept), Y)
    assert are_finite(far)
    far.pieces[1][5, 2] = np.nan
    assert not are_finite(far)
    assert not are_finite(in_memory(far))
