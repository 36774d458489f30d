"""Tall columns by rows on ranks that are threads, beside arrays."""

import gc

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fe_models.foundation.errors import BodyError
from fe_models.foundation.ranks.row_layout import RowLayout
from fe_models.foundation.ranks.rows import Rows
from fe_models.foundation.ranks.spread_columns import COLUMNS, spread_beside, spread_columns, spread_parts
from tests.thread_ranks import ThreadRanks

N, K = 30, COLUMNS + 3
STARTS = {1: (0, N), 2: (0, 11, N), 4: (0, 11, 11, 20, N)}  # one rank without rows


@pytest.fixture(params=STARTS)
def layout(request):
    order = np.random.default_rng(request.param).permutation(N)
    return RowLayout(ThreadRanks(request.param), order, Rows(STARTS[request.param]))


@pytest.fixture
def X():
    return np.random.default_rng(7).standard_normal((N, K))


def test_columns_come_back(layout, X):
    there = spread_columns(layout, X)
    assert there.shape == X.shape
    assert_array_equal(there.whole(), X)
    assert spread_columns(layout, there) is there


def test_parts_are_those_of_an_array(layout, X):
    there = spread_columns(layout, X)
    assert_array_equal(there[:, 2:5].whole(), X[:, 2:5])
    assert_array_equal(there[:, 2:6][:, 1:].whole(), X[:, 3:6])
    assert_array_equal(there[:, np.arange(K) % 2 == 0].whole(), X[:, ::2])
    assert_array_equal(there[[3, 29, 0, 3]], X[[3, 29, 0, 3]])
    assert_array_equal(there[[5, 4], 1:3], X[[5, 4], 1:3])
    assert there[np.zeros(0, int)].shape == (0, K)
    with pytest.raises(IndexError, match="whole"):
        there[2:5]


def test_callers_that_know_arrays_alone_get_one(layout, X):
    there = spread_columns(layout, X)
    assert_array_equal(np.asarray(there), X)
    for index in (3, (slice(None), 3)):
        with pytest.raises(IndexError, match="lists of them"):
            there[index]
    with pytest.raises(TypeError):
        there + X
    with pytest.raises(TypeError):
        list(there)


def test_columns_whose_making_fails_are_forgotten(layout, X):
    def blocks():
        yield X[:, :2]
        raise BodyError("no more")

    def failing(part):
        raise BodyError("no rows")

    for make in (
        lambda: spread_parts(layout, K, blocks()),
        lambda: spread_columns(layout, X).made(K, failing, spread_columns(layout, X)),
    ):
        with pytest.raises(BodyError, match="no "):
            make()
    gc.collect()
    layout.ask(lambda ranks: None)
    assert layout.ranks.stores == [{}] * layout.ranks.size


def test_sums_are_those_of_arrays(layout, X):
    there, factors = spread_columns(layout, X), np.arange(1.0, K + 1.0)
    assert_array_equal((there - there * 0.5 + 2.0 * there).whole(), X - X * 0.5 + 2.0 * X)
    assert_array_equal((there / factors).whole(), X / factors)


def test_blocks_stand_side_by_side(layout, X):
    there = spread_beside(layout, X, spread_columns(layout, X[:, :2]), X[:, :0])
    assert_array_equal(there.whole(), np.hstack([X, X[:, :2]]))


def test_columns_that_nobody_names_are_forgotten(layout, X):
    there = spread_columns(layout, X)
    part = there[:, 1:2]
    del there
    gc.collect()
    assert_array_equal(part.whole(), X[:, 1:2])  # the part holds what it is a part of
    del part
    gc.collect()
    layout.ask(lambda ranks: None)
    assert layout.ranks.stores == [{}] * layout.ranks.size


def test_requests_to_other_ranks_leave_columns_to_forget(layout, X):
    there, others = spread_columns(layout, X), RowLayout(ThreadRanks(layout.ranks.size), layout.order, layout.rows)
    del there
    gc.collect()
    others.ask(lambda ranks: None)
    layout.ask(lambda ranks: None)
    assert layout.ranks.stores == [{}] * layout.ranks.size


def test_what_is_made_on_the_ranks_stays_there(layout, X):
    made = spread_columns(layout, X).made(1, np.sum, spread_columns(layout, X), 1, None, None, True)
    assert_array_equal(made.whole(), X.sum(axis=1, keepdims=True))
