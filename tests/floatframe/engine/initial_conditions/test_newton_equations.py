"""Scales of the equations of a system, by which its factors have their pivots."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from floatframe.engine.initial_conditions.newton_equations import balanced_scales


@pytest.mark.parametrize("made", [np.asarray, sp.csr_array], ids=["dense", "sparse"])
def test_a_body_on_springs_has_the_scale_of_their_stiffness(made):
    """Two springs with rows V w = -G y; the second has half its force as unknown. H holds only rounding errors."""
    k = np.array([4e6, 9e2])
    J, G, V = np.diag([1.0, 2.0]), np.diag(k), np.diag([1.0, 2.0])
    for noise in (0.0, 1e-9, -1e-9):
        of_columns, of_rows = balanced_scales(np.full(2, noise), made(J), made(G), made(V))
        assert_allclose(of_columns[:2], 1 / np.sqrt(k), rtol=1e-9)
        assert_allclose(of_rows[:2], 1 / np.sqrt(k), rtol=1e-9)


def test_masses_and_springs_add_up_and_rows_without_springs_add_nothing():
    mass, k, lever = 3.0, 5.0, 0.25
    J = G = np.array([[1.0], [lever]])
    of_columns, _ = balanced_scales(np.array([mass]), J, k * G, np.diag([1.0, 0.0]))
    assert_allclose(of_columns[0], 1 / np.sqrt(mass + k), rtol=1e-14)


def test_rounding_of_rows_is_no_spring_and_a_softened_unknown_keeps_its_size():
    """A load has made the first stiffness negative. The spring acts on other unknowns; its row holds rounding here."""
    J, G, V = np.array([[1e-10, 1e-10]]), np.array([[1e-10, 1e-10]]), np.eye(1)
    of_columns, _ = balanced_scales(np.array([-4e-3, 0.0]), J, G, V)
    assert_allclose(of_columns[:2], [1 / np.sqrt(4e-3), 1.0], rtol=1e-12)
