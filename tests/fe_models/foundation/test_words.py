"""Numbers in messages are short, and rounding errors are not shown."""

import numpy as np
import pytest

from fe_models.foundation.words import did_you_mean, node_list, number_list


@pytest.mark.parametrize(("values", "scale", "expected"), [
    ((3.49024e-18, 0.2, -0.019), None, "0, 0.2, -0.019"), ((1e-18, -2e-18), None, "1e-18, -2e-18"),
    ((1e-18, -2e-18), 1.0, "0, 0"), ((-0.0, 1 / 3), None, "0, 0.333333"), ((np.nan, 1.0), None, "nan, 1"),
    ((), None, ""),
])  # fmt: skip
def test_numbers_within_rounding_of_the_scale_are_zero_and_nan_stays(values, scale, expected):
    assert number_list(values, scale) == expected


def test_a_list_of_nodes_has_positions_without_rounding():
    assert node_list([1], np.array([[5, 5, 5], [1e-17, 0, 2.5]]), lambda n: f"a{n}") == "node a1 at (0, 0, 2.5)"


@pytest.mark.parametrize(("name", "choices", "meant"), [
    ("force", ["bushing", "user-force", "point-force", "forked"], "; did you mean 'user-force' or 'point-force'?"),
    ("pionts", ["point-force", "points"], "; did you mean 'points'?"), ("dist", ["rigid", "distributing"],
    "; did you mean 'distributing'?"), ("abc", ["xyz"], ""), ("", ["a"], ""),
])  # fmt: skip
def test_names_with_the_word_come_before_similar_ones_and_beginnings_last(name, choices, meant):
    assert did_you_mean(name, choices) == meant
