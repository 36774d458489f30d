import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import fe_models as fm
from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.modes.families.rigid_modes import determinate_partition, independent_rigid_modes
from cms.modes.mode_sets.classical import craig_bampton
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs, rigid_motion_of_points
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.meshes.mesh import Mesh
from tests.bodies import bar, beam, box_mesh


@pytest.mark.parametrize("make", [lambda: couple(bar(nx=4)), lambda: couple(beam())])
def test_three_routes_span_the_same_space(make):
    """From positions; as modes of zero frequency of the free body; as static answers to displaced determinate dofs."""
    body = make()
    geometric = rigid_motion_of_dofs(body.nodes, body.dofs)
    r, _ = determinate_partition(body, independent_rigid_modes(body)[0])
    f = np.setdiff1d(np.arange(body.n_dof), r)
    K = body.K.toarray()
    static = np.zeros((body.n_dof, 6))
    static[r], static[f] = np.eye(6), -np.linalg.solve(K[np.ix_(f, f)], K[np.ix_(f, r)])
    for other in (eigenmodes(body.K, body.M, n_modes=6).Phi, static):
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
    Psi_R, _ = independent_rigid_modes(body)
    r, extra = determinate_partition(body, Psi_R)
    assert set(r) <= set(body.b)
    assert not len(extra)
    assert np.linalg.matrix_rank(Psi_R[r]) == len(r) == 6


@pytest.mark.parametrize("seed", [*range(8), 38, 53, 54, 57, 66, 70, 97, 104])
def test_a_body_held_along_a_line_may_turn_about_it(seed):
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes *= np.sign(la.det(axes))
    box = box_mesh(3, 1, 1, 1.0, 0.4, 0.3, "hexahedron")
    edge = np.flatnonzero((box.nodes[:, 1] == 0) & (box.nodes[:, 2] == 0))
    mesh = Mesh(box.nodes @ axes.T + rng.normal(size=3), box.cells)
    port = Interface("edge", "nodes", edge, mesh.nodes[edge].mean(axis=0), axes)
    steel = fm.Material("steel", 2.1e11, 0.3, 7850.0)
    body = couple(fm.solid_body(mesh, steel, name="box", units=UNIT_SYSTEMS["m-kg-s"], interfaces=[port]))
    modes = craig_bampton(body, n_modes=3)
    K, M = body.K.toarray(), body.M.toarray()
    free = np.setdiff1d(np.arange(body.n_dof), body.b)
    omega2 = la.eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)
    assert abs(omega2[0]) < 1e-10 * omega2[1]
    assert_allclose(modes.frequencies[-3:], np.sqrt(omega2[1:4]) / (2 * np.pi), rtol=1e-8)
