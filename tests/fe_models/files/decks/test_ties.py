"""The foot of a point on a face, beside a search over a fine grid of places; beyond an edge, for faces without skew."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models.files.abaqus.couplings import _foot
from fe_models.meshes.cell_shapes import shape_values

TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
CORNERS = {
    "triangle": np.array([[0, 0, 0], [2.0, 0, 0], [0, 2.0, 0]]) @ TURN + [5.0, -3.0, 2.0],
    "quad": np.array([[0, 0, 0], [2.0, 0, 0], [2.0, 1.5, 0], [0, 1.5, 0]]) @ TURN + [5.0, -3.0, 2.0],
}


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("kind", CORNERS)
def test_the_foot_is_the_nearest_place_of_a_face(kind, inside):
    X = CORNERS[kind]
    steps = np.linspace(0, 1, 401)
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    if kind == "triangle":
        places = places[places.sum(axis=1) <= 1 + 1e-12]
    N = shape_values(kind, places)[0]
    across = np.cross(X[1] - X[0], X[2] - X[0])
    middle = X.mean(axis=0)
    beyond = middle if inside else middle + 0.9 * (X[1] + X[2] - 2 * middle)  # past the edge between both corners
    point = beyond + 0.2 * across / np.linalg.norm(across)
    distances = np.linalg.norm(point - N @ X, axis=1)
    distance, weights = _foot(kind, X, point)
    assert_allclose(distance, distances.min(), rtol=1e-3)
    assert_allclose(weights.sum(), 1.0, rtol=1e-12)
