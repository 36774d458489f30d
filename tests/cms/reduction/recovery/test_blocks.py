"""Rows of a quantity over the displacement of a body."""

import numpy as np
from numpy.testing import assert_array_equal

from cms.reduction.recovery.blocks import Block


def test_chosen_rows_keep_their_values_places_and_directions():
    rng = np.random.default_rng(0)
    A, points, directions = rng.normal(size=(4, 7)), rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    some = Block(("a", "b", "c", "d"), 2, lambda u: A @ u, (points, directions)).of_rows([3, 1])
    assert some.names == ("d", "b")
    assert some.order == 2
    u = rng.normal(size=(7, 2))
    assert_array_equal(some.values(u), (A @ u)[[3, 1]])
    assert some.places is not None
    assert_array_equal(some.places[0], points[[3, 1]])
    assert_array_equal(some.places[1], directions[[3, 1]])
