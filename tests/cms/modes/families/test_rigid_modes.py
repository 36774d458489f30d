import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.errors import BodyError
from cms.modes.families.rigid_modes import (
    determinate_dofs,
    geometric_rigid_modes,
    null_space_rigid_modes,
    static_rigid_modes,
)
from fe_models.body.couplings.couplings import couple
from fe_models.body.rigid_motion import rigid_motion_of_points
from tests.bodies import bar, beam


@pytest.mark.parametrize("make", [lambda: couple(bar(nx=4)), lambda: couple(beam())])
def test_three_routes_span_the_same_space(make):
    body = make()
    geometric = geometric_rigid_modes(body)
    r = determinate_dofs(body, np.arange(body.n_dof))
    for other in (null_space_rigid_modes(body), static_rigid_modes(body, r)):
        # angles in the M-norm: rotations and translations share no unit
        half = la.cholesky(body.M.toarray())
        angles = la.subspace_angles(half @ geometric, half @ other)
        assert angles.max() < 1e-6


def test_motion_is_translation_plus_rotation_about_the_origin():
    rng = np.random.default_rng(0)
    points, origin, d, theta = rng.normal(size=(5, 3)), rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
    expected = d + np.cross(theta, points - origin)
    assert_allclose(rigid_motion_of_points(points, origin) @ np.r_[d, theta], expected, rtol=0, atol=1e-14)


def test_determinate_dofs_hold_every_rigid_motion():
    body = couple(bar(nx=4))
    r = determinate_dofs(body, body.b)
    assert len(r) == 6
    scaled = geometric_rigid_modes(body)[r]
    assert np.linalg.matrix_rank(scaled) == 6


def test_dofs_on_a_line_of_nodes_are_refused():
    body = bar(nx=4, kind="hexahedron")
    on_edge = np.flatnonzero((body.nodes[:, 1] == 0) & (body.nodes[:, 2] == 0))
    candidates = np.flatnonzero(np.isin(body.dofs[:, 0], on_edge))
    with pytest.raises(BodyError, match="hold only 5 of the 6"):
        determinate_dofs(body, candidates)
