"""Light of pictures: colours that mean numbers are read alike on all sides."""

import numpy as np

from cms.assessment.rendering.light import brightness


def test_faces_that_are_seen_are_lit_alike_where_colours_mean_numbers():
    """Whatever faces the eye by more than five degrees has between 0.65 and 1.1 of its colour, undersides among it."""
    normals = np.random.default_rng(0).standard_normal((20000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    seen = normals[normals[:, 2] > np.sin(np.deg2rad(5))]
    light = brightness(seen, shows_numbers=True)
    assert light.min() > 0.65
    assert light.max() < 1.1
    below = np.array([[0.0, -0.95, 0.3122], [-0.6, -0.74, 0.3]])  # undersides, dark where light comes from above alone
    assert brightness(below, shows_numbers=True).min() > 0.7
    assert brightness(below, shows_numbers=False).min() > 0.5
