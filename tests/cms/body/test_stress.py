"""Stress of modal coordinates: many rows at once are the rows one by one."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.body import stress as room
from cms.body.stress import stress_of, von_mises, von_mises_of


@pytest.mark.parametrize("at_once", [1, 100, 10**9])
def test_blocks_of_rows_have_the_stress_of_each_row(monkeypatch, at_once):
    monkeypatch.setattr(room, "CHUNK_SIZE", at_once)
    rng = np.random.default_rng(4)
    modes, q = rng.normal(size=(7, 6, 3)), rng.normal(size=(11, 3))
    found = np.concatenate(list(von_mises_of(modes, q)))
    expected = [von_mises(np.array([node @ row for node in modes])) for row in q]
    assert_allclose(found, expected, rtol=1e-13, atol=0)
    assert_allclose(stress_of(modes, q[4]), stress_of(modes, q)[:, :, 4], rtol=1e-13, atol=0)
    assert not list(von_mises_of(modes, q[:0]))
