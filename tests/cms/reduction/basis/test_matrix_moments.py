import numpy as np
import scipy.sparse as sp
from numpy.testing import assert_allclose

from cms.reduction.basis.matrix_moments import gram_from_matrices
from fe_models.body.fe_body import FEBody


def test_nodal_masses_with_isotropic_inertia_are_exact():
    """Each node stands for six points at ± rho on its axes, moving rigidly with it: their sum is the truth."""
    rng = np.random.default_rng(4)
    n_nodes, n_q, rho = 5, 3, 0.3
    nodes, mass = rng.normal(size=(n_nodes, 3)), rng.uniform(1, 2, n_nodes)
    s = mass * rho**2 / 3  # ∫ offset_a offset_b = s δ_ab, so the nodal inertia is 2 s
    diagonal = np.stack([mass, mass, mass, 2 * s, 2 * s, 2 * s], axis=1).ravel()
    dofs = np.stack([np.repeat(np.arange(n_nodes), 6), np.tile(np.arange(6), n_nodes)], axis=1)
    body = FEBody("lumped", sp.diags_array(diagonal), sp.csc_array((6 * n_nodes, 6 * n_nodes)), nodes, dofs)
    Phi = rng.normal(size=(6 * n_nodes, n_q))

    u = Phi.reshape(n_nodes, 6, n_q)
    offsets = rho * np.concatenate([np.eye(3), -np.eye(3)])
    expected = np.zeros((4 + 3 * n_q, 4 + 3 * n_q))
    for n in range(n_nodes):
        for offset in offsets:
            phi = u[n, :3] + np.cross(u[n, 3:].T, offset).T
            a = np.concatenate([[1.0], nodes[n] + offset, phi.ravel()])
            expected += mass[n] / 6 * np.outer(a, a)
    gram = gram_from_matrices(body, Phi)
    assert_allclose(gram, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
