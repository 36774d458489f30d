"""Mean motion of several nodes: whether their places determine a rotation."""

import numpy as np
import pytest

from cms.reduction.basis.node_results import are_spread

LINE = np.array([0.6, -0.64, 0.48])
ACROSS = np.array([0.8, 0.48, -0.36])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e5])
@pytest.mark.parametrize("offset", [0.0, 3.0, 1e3])
def test_points_on_a_line_determine_no_rotation_wherever_it_lies(size, offset):
    """Sizes and offsets of the points, which lie in a line that passes the origin by: a plane through both is none."""
    place = offset * np.array([0.2, 0.9, 1.3])
    on_line = np.array([-1.0, -0.2, 0.5, 2.0])[:, None] * LINE
    assert not are_spread(size * (place + on_line))
    assert not are_spread(size * (place + on_line + 1e-9 * np.array([1, -1, 2, 0])[:, None] * ACROSS))
    off_line = on_line + 1e-4 * np.array([1, -1, 2, 0])[:, None] * ACROSS
    assert are_spread(size * (place + off_line))


def test_one_or_two_points_determine_no_rotation_and_three_do():
    places = np.array([[0.1, 0.2, 0.3], [0.5, 0.1, 0.0], [0.2, 0.9, -0.4]])
    assert not are_spread(places[:1])
    assert not are_spread(places[:2])
    assert are_spread(places)
